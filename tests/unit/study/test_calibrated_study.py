"""A calibrated machine with its joint covariance is a distribution for a study."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from rotordrop import example_machine
from rotordrop.errors import MachineFileError, UsageError
from rotordrop.machine import loads_machine
from rotordrop.machine.calibration import CalibrationDrop, CalibrationOrigin, JointSpread
from rotordrop.machine.saving import machine_text
from rotordrop.study.folder import open_folder, study_of
from rotordrop.study.plan import read_study

PATHS = ("NDE.air_gap", "NDE.support.stiffness", "NDE.support.mass", "NDE.friction.dynamic")
SIGMA = np.array([1.5e-6, 0.01, 0.012, 0.03])
CORRELATION = np.array(
    [[1.0, 0.2, 0.1, 0.0], [0.2, 1.0, 0.97, 0.0], [0.1, 0.97, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
COVARIANCE = SIGMA[:, None] * CORRELATION * SIGMA


def calibrated():
    spread = JointSpread(
        paths=PATHS,
        logarithmic=(False, True, True, True),
        covariance=tuple(COVARIANCE[np.tril_indices(4)].tolist()),
    )
    drops = (CalibrationDrop(name="a"),)
    return example_machine("lp400").calibrated_on(
        CalibrationOrigin(drops=drops, consistent=True, joint=spread)
    )


def study(machine, **changes):
    table = {"drops": 4000, "calibrated": True, "speed": "100 Hz", "start": "centred", **changes}
    return read_study(table, machine)


def test_the_distribution_comes_back_from_the_file():
    again = loads_machine(machine_text(calibrated()))
    assert again == calibrated()
    np.testing.assert_allclose(again.calibration.joint.matrix, COVARIANCE, rtol=1e-12)


@pytest.mark.parametrize("design", ["random", "latin hypercube", "sobol"])
def test_values_have_middle_spread_and_correlation_of_the_calibration(design):
    machine = calibrated()
    drawn = study(machine, design=design, drops=4096).values(0, 4096)
    names = list(study(machine).varied)
    y = np.column_stack([drawn[:, names.index(path)] for path in PATHS])
    y[:, 1:] = np.log(y[:, 1:])
    bearing = machine.touchdown_bearings[0]
    middle = [float(bearing.air_gap), float(bearing.support.stiffness), float(bearing.support.mass)]
    np.testing.assert_allclose(y.mean(axis=0)[0], middle[0], rtol=1e-3)
    np.testing.assert_allclose(np.exp(y.mean(axis=0)[1:3]), middle[1:], rtol=2e-3)
    np.testing.assert_allclose(y.std(axis=0), SIGMA, rtol=0.05)
    assert np.corrcoef(y.T)[1, 2] == pytest.approx(0.97, abs=0.01)
    assert ndtr((y[:, 0] - middle[0]) / SIGMA[0]).mean() == pytest.approx(0.5, abs=0.02)


def test_static_friction_follows_the_dynamic_one():
    machine = calibrated()
    one = study(machine)
    values = dict(zip(one.varied, one.values(3, 4)[0].tolist(), strict=True))
    found = one.machine_values(values)
    friction = machine.touchdown_bearings[0].friction
    assert found["NDE.friction.static"] / found["NDE.friction.dynamic"] == pytest.approx(
        float(friction.static) / float(friction.dynamic)
    )
    assert "DE.friction.static" not in found


def test_a_folder_keeps_the_distribution(tmp_path):
    one = study(calibrated())
    folder = open_folder(one, tmp_path / "study")
    np.testing.assert_array_equal(study_of(folder.path).values(0, 5), one.values(0, 5))


def test_what_is_no_distribution_is_refused():
    with pytest.raises(UsageError, match=r"holds no joint distribution .*rotordrop calibrate"):
        study(example_machine("lp400"))
    with pytest.raises(UsageError, match=r"NDE.air_gap: drawn in two ways"):
        study(calibrated(), vary={"*.air_gap": {"uniform": ["200 um", "300 um"]}})
    text = machine_text(calibrated())
    broken = text.replace("logarithmic = [false, ", "logarithmic = [")
    with pytest.raises(MachineFileError, match=r"3 entries; 4 paths need 4 of them"):
        loads_machine(broken)
