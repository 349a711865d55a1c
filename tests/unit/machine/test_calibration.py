"""What a calibrated machine file says of the drops it was calibrated on."""

from __future__ import annotations

import pytest

from rotordrop.errors import MachineFileError
from rotordrop.machine import example_machine, load_machine, loads_machine
from rotordrop.machine.calibration import CalibrationDrop, CalibrationOrigin
from rotordrop.machine.saving import machine_text, save_machine

NAMES = ("drop 1, after the repair", "müller's “drop”", "calibrated on x")


@pytest.fixture
def origin() -> CalibrationOrigin:
    return CalibrationOrigin(
        drops=tuple(CalibrationDrop(name=name, sha256=str(k) * 64) for k, name in enumerate(NAMES)),
        consistent=False,
    )


def test_names_of_drops_come_back_as_they_are(origin, tmp_path):
    """A comma in a file name split it in two when names stood in a sentence."""
    machine = example_machine("lp400").calibrated_on(origin)
    save_machine(machine, tmp_path / "machine.toml")
    again = load_machine(tmp_path / "machine.toml")
    assert again == machine
    assert again.calibration is not None
    assert tuple(drop.name for drop in again.calibration.drops) == NAMES
    assert again.calibration.drops[1].sha256 == "1" * 64
    assert again.calibration.consistent is False


def test_other_values_leave_the_origin_of_the_calibration(origin):
    machine = example_machine("lp400").calibrated_on(origin).with_values({"NDE.air_gap": 3e-4})
    assert machine.calibration == origin
    assert example_machine("lp400").calibration is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[calibration]\nconsistent = true\ndrops = []\n",
            r"calibration.drops: .* one entry is needed",
        ),
        ('[calibration]\ndrops = [{name = "a"}]\n', r"'consistent' is missing"),
        (
            '[calibration]\nconsistent = "yes"\ndrops = [{name = "a"}]\n',
            r"'yes' .* expected a valid boolean",
        ),
        (
            '[calibration]\nconsistent = true\ndrops = [{name = "a"}, {name = "a"}]\n',
            r"'a' stands twice in the calibration; names must differ",
        ),
    ],
)
def test_a_calibration_that_says_nothing_is_refused(text, message):
    with pytest.raises(MachineFileError, match=message):
        loads_machine(f"{machine_text(example_machine('paper'))}\n{text}")
