from __future__ import annotations

from collections.abc import Iterator
from importlib import resources
from pathlib import Path

import pytest
from tests.unit.web.serving import Served

from rotordrop.web.workspace import Workspace

PACKAGE = Path(str(resources.files("rotordrop")))


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    server = Served(Workspace(tmp_path_factory.mktemp("served")))
    yield server
    server.stop()


@pytest.fixture(scope="session")
def files() -> dict[str, Path | tuple[str, bytes]]:
    """The bundled machine, record and tail, as they are dropped on the page."""
    return {
        "machine": PACKAGE / "machine" / "examples" / "lp400.toml",
        "beside": PACKAGE / "machine" / "examples" / "lp400_shaft.csv",
        "tail": PACKAGE / "examples" / "lp400" / "drop_060_tail.csv",
        "record": PACKAGE / "examples" / "lp400" / "drop_060.h5",
    }
