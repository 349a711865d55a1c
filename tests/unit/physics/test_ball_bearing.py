"""Bearing constants, preload, axial rigidity, lift-off and centrifugal force."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from tests.reference.closed_forms import bearing_equilibrium, lift_off_force

from rotordrop.errors import UsageError
from rotordrop.physics import ball_bearing as bb
from rotordrop.physics.ball_bearing_geometry import BallBearingGeometry
from rotordrop.physics.ball_bearing_response import bearing_response

Bearing = Callable[..., BallBearingGeometry]
ZK, A_0 = 2.4e11, 5.7e-4


@pytest.mark.acceptance
@pytest.mark.parametrize(
    ("change", "agrees"), [({}, True), ({"preload": 531.0}, False), ({"ball_youngs_modulus": 316e9}, False)]
)
def test_reference_machine_constants(
    touchdown_bearing: Bearing, change: dict[str, float], agrees: bool
) -> None:
    """Own reference: K_tot, preload ball load and inner-race stress at preload of the reference machine."""
    constants = bb.bearing_constants(touchdown_bearing(**change))
    stress = constants.stress_coefficient_inner * constants.preload_ball_load ** (1 / 3)
    got = (constants.ball_stiffness, constants.preload_ball_load, stress / 1e6)
    assert (got == pytest.approx((1.06217e10, 53.2925, 993.3556), rel=5e-6)) == agrees


@pytest.mark.parametrize("alpha", [0.0, 1e-4, 0.26, 0.44, 1.0])
def test_approach_inverts_the_axial_force(alpha: float) -> None:
    F = np.geomspace(1e-9, 1e6, 31)
    s = bb.row_approach(F, ZK, A_0, alpha)
    np.testing.assert_allclose(bb.row_axial_force(s, ZK, A_0, alpha), F, rtol=1e-13)
    assert bb.row_approach(0.0, ZK, A_0, alpha) == 0.0


@pytest.mark.parametrize("alpha", [0.0, 0.26, 0.44])
@pytest.mark.parametrize("s", [1e-6, 1e-5, 1e-4])
def test_axial_stiffness_is_the_slope_of_the_force(alpha: float, s: float) -> None:
    h = 1e-4 * s
    slope = (bb.row_axial_force(s + h, ZK, A_0, alpha) - bb.row_axial_force(s - h, ZK, A_0, alpha)) / (2 * h)
    assert bb.row_axial_stiffness(s, ZK, A_0, alpha) == pytest.approx(slope, rel=1e-7)


def test_small_approach_keeps_the_contact_angle() -> None:
    """F → Z K (s sin α)^1.5 sin α, with an error of first order in s/A₀."""
    s, alpha = 1e-9, 0.44
    expected = ZK * (s * math.sin(alpha)) ** 1.5 * math.sin(alpha)
    assert bb.row_axial_force(s, ZK, A_0, alpha) == pytest.approx(expected, rel=1e-5)


def test_steep_contact_angle_is_a_thrust_bearing() -> None:
    assert bb.row_axial_force(1e-5, ZK, A_0, math.pi / 2) == pytest.approx(ZK * 1e-5**1.5, rel=1e-12)


def test_preload_of_the_row_is_carried_by_its_balls(touchdown_bearing: Bearing) -> None:
    for arrangement, axial in (("X", 0.0), ("O", 0.0), ("tandem", -1060.0), ("single", -530.0)):
        constants = bb.bearing_constants(touchdown_bearing(arrangement=arrangement))
        response = bearing_response(constants, np.zeros(5), row_spacing=0.016)
        np.testing.assert_allclose(response.ball_loads, constants.preload_ball_load, rtol=1e-12)
        row = response.ball_loads * np.sin(response.contact_angles)
        np.testing.assert_allclose(np.abs(row.sum(axis=1)), 530.0, rtol=1e-12)
        assert response.force[2] == pytest.approx(axial, abs=1e-9)


def test_zero_preload_leaves_the_balls_just_touching(touchdown_bearing: Bearing) -> None:
    constants = bb.bearing_constants(touchdown_bearing(preload=0.0))
    assert constants.preload_ball_load == 0.0
    assert constants.preload_approach == 0.0
    distance = math.hypot(constants.radial_offset, constants.axial_offset)
    assert distance == pytest.approx(constants.groove_distance, rel=1e-15)


def test_axial_rigidity_is_the_tangent_of_the_pair(touchdown_bearing: Bearing) -> None:
    for arrangement in ("X", "O"):
        constants = bb.bearing_constants(touchdown_bearing(arrangement=arrangement))
        tangent = bearing_response(constants, np.zeros(5)).stiffness[2, 2]
        assert bb.axial_rigidity(constants) == pytest.approx(tangent, rel=1e-11)


def test_lift_off_force_empties_one_row_and_not_sooner(touchdown_bearing: Bearing) -> None:
    constants = bb.bearing_constants(touchdown_bearing())
    lift_off = lift_off_force(constants)
    held = (False, False, True, False, False)
    for share, empty in ((0.999, False), (1.001, True)):
        q = bearing_equilibrium(constants, [0, 0, share * lift_off, 0, 0], free=held)
        loads = bearing_response(constants, q).ball_loads
        assert (loads[0].max() == 0.0) == empty
        assert loads[1].min() > 100.0
    q = bearing_equilibrium(constants, [0, 0, lift_off, 0, 0], free=held)
    assert q[2] == pytest.approx(constants.preload_approach, rel=1e-9)
    # rule of thumb of the catalogues: 2^1.5 times the preload, a little more for the growing contact angle
    assert 2.0**1.5 * 530.0 < lift_off < 3.1 * 530.0


@pytest.mark.parametrize(("arrangement", "named"), [("tandem", "a tandem pair"), ("single", "a single row")])
def test_rigidity_needs_a_pair(touchdown_bearing: Bearing, arrangement: str, named: str) -> None:
    constants = bb.bearing_constants(touchdown_bearing(arrangement=arrangement))
    with pytest.raises(UsageError, match=f'axial rigidity is defined .* not for {named}.*"X" or "O"'):
        bb.axial_rigidity(constants)


def test_first_ball_sits_on_plus_y_and_turns_with_the_spin(touchdown_bearing: Bearing) -> None:
    constants = bb.bearing_constants(touchdown_bearing(first_ball_angle=0.1, second_row_offset=0.5))
    rows = constants.row_ball_angles
    pitch = 2 * math.pi / 23
    assert rows.shape == (2, 23)
    assert rows[0, 0] == pytest.approx(math.pi / 2 + 0.1)
    np.testing.assert_allclose(np.diff(rows, axis=1), pitch)
    np.testing.assert_allclose(rows[1] - rows[0], 0.5 * pitch)


@pytest.mark.parametrize(("speed_Hz", "force_N"), [(60, 1.8), (210, 22), (550, 149)])
def test_ball_centrifugal_force_at_three_ring_speeds(
    touchdown_bearing: Bearing, speed_Hz: float, force_N: float
) -> None:
    force = bb.ball_centrifugal_force(touchdown_bearing(), 2 * math.pi * speed_Hz)
    assert force == pytest.approx(force_N, rel=0.025)


def test_ball_centrifugal_force_is_mass_times_radius_times_cage_speed_squared(
    touchdown_bearing: Bearing,
) -> None:
    bearing = touchdown_bearing(
        contact_angle=math.pi / 2
    )  # the balls then roll on equal circles: half the speed
    mass = 3200.0 * math.pi / 6 * 0.009525**3
    assert bb.ball_centrifugal_force(bearing, 100.0) == pytest.approx(mass * 0.0425 * 50.0**2, rel=1e-12)
