"""What the catalogue fits return on numbers made by the bearing model itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from tests.reference.ball_bearing_catalogue import (
    conformity_of_rigidity,
    pair_lift_off_force,
    pair_rigidity,
    row_of_catalogue,
    row_of_conformity,
)
from tests.reference.closed_forms import lift_off_force

from rotordrop.machine import example_machine
from rotordrop.physics.ball_bearing import axial_rigidity, bearing_constants
from rotordrop.physics.ball_bearing_geometry import BallBearingGeometry
from rotordrop.physics.hertz import compliance

Bearing = Callable[..., BallBearingGeometry]
ETA = compliance(208e9, 0.3, 315e9, 0.26)


def test_pair_numbers_are_those_of_the_bearing(touchdown_bearing: Bearing) -> None:
    bearing = touchdown_bearing()
    constants = bearing_constants(bearing)
    row = row_of_conformity(0.53, 0.009525, 0.085, 23, bearing.contact_angle, ETA)
    assert row == pytest.approx((23 * constants.ball_stiffness, constants.groove_distance), rel=1e-12)
    assert pair_rigidity(530.0, *row, bearing.contact_angle) == pytest.approx(
        axial_rigidity(constants), rel=1e-12
    )
    lift_off = pair_lift_off_force(530.0, *row, bearing.contact_angle)
    assert lift_off == pytest.approx(lift_off_force(constants), rel=1e-12)


def test_conformity_comes_back_from_the_rigidity() -> None:
    f = np.array([0.505, 0.52, 0.53, 0.56])
    D_w, alpha = np.array([3.2e-3, 9.5e-3, 1.2e-2, 4e-3]), np.array([0.26, 0.44, 0.26, 0.44])
    rigidity = pair_rigidity(200.0, *row_of_conformity(f, D_w, 9 * D_w, 20, alpha, ETA), alpha)
    np.testing.assert_allclose(
        conformity_of_rigidity(rigidity, 200.0, D_w, 9 * D_w, 20, alpha, ETA), f, rtol=1e-12
    )


def test_rigidity_out_of_reach_returns_the_end_of_the_range() -> None:
    ends = conformity_of_rigidity([1e3, 1e12], 200.0, 0.0095, 0.085, 23, 0.44, ETA)
    assert ends == pytest.approx([1.0, 0.5], abs=1e-5)


def test_lumped_rows_come_back_from_six_numbers_each() -> None:
    ZK, A_0 = np.array([3e10, 2.4e11, 9e11]), np.array([1.6e-4, 5.7e-4, 2.4e-3])
    alpha = np.radians([15.0, 25.0, 15.0])
    F_V = np.array([[9.0, 34.0, 77.0], [96.0, 452.0, 1026.0], [900.0, 3000.0, 6000.0]])
    row = (ZK[:, None], A_0[:, None], alpha[:, None])
    found = row_of_catalogue(F_V, pair_rigidity(F_V, *row), pair_lift_off_force(F_V, *row), alpha)
    np.testing.assert_allclose(found, (ZK, A_0), rtol=1e-7)


def test_bearing_of_the_machine_file_gives_the_same_constants(touchdown_bearing: Bearing) -> None:
    described = bearing_constants(example_machine("paper").touchdown_bearings[0].bearing)
    plain = bearing_constants(touchdown_bearing())
    for name, value in vars(plain).items():
        np.testing.assert_allclose(getattr(described, name), value, rtol=1e-14, err_msg=name)
