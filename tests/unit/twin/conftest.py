"""The machine of the synthetic drop as known after a calibration, and its estimates."""

import pytest
from tests.bank import calibrated_machine, handed_out

workshop, check, tracked, quick = map(handed_out, ("workshop", "check", "tracked", "quick"))


@pytest.fixture(scope="session")
def calibrated():
    """The machine as known after a calibration."""
    return calibrated_machine()
