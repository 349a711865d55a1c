from importlib import resources
from pathlib import Path

import pytest
from tests.unit.web.browser import Browser
from tests.unit.web.serving import Served

from rotordrop.jobs.workspace import Workspace

PACKAGE = Path(str(resources.files("rotordrop")))


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    server = Served(Workspace(tmp_path_factory.mktemp("served")))
    yield server
    server.stop()


@pytest.fixture
def server(tmp_path):
    """A page with an empty workspace."""
    one = Served(Workspace(tmp_path / "space"))
    yield one
    one.stop()


@pytest.fixture
def browser(tmp_path):
    page = Browser(tmp_path / "profile")
    yield page
    page.close()


@pytest.fixture(scope="session")
def files():
    """The bundled machine, record and tail, as they are dropped on the page."""
    return {
        "machine": PACKAGE / "machine" / "examples" / "lp400.toml",
        "beside": PACKAGE / "machine" / "examples" / "lp400_shaft.csv",
        "tail": PACKAGE / "examples" / "lp400" / "drop_060_tail.csv",
        "record": PACKAGE / "examples" / "lp400" / "drop_060.h5",
    }
