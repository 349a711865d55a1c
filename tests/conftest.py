"""For all tests: linear algebra on one thread, as the command line has it; Ctrl-C; the bank."""

import os
import signal

import pytest
from tests.shared import Shared

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

# A shell starts a background job, and whatever that starts, deaf to Ctrl-C; some tests send one.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def bank(tmp_path_factory):
    """Drops and estimates by their names in ``bank.py``: each is made once a run, each call gives a copy."""
    from tests.bank import MAKERS

    folder = tmp_path_factory.getbasetemp()
    return Shared((folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / "bank", MAKERS)
