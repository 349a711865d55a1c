"""Bearing constants, preload, lift-off, centrifugal force; with clearance, contact angle and loaded balls."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.plain_bearing import BallBearingGeometry
from tests.reference.closed_forms import bearing_equilibrium, lift_off_force

from rotordrop.errors import UsageError
from rotordrop.machine import example_machine
from rotordrop.physics import ball_bearing as bb
from rotordrop.physics.ball_bearing import bearing_constants, free_contact_angle
from rotordrop.physics.ball_bearing_response import bearing_response
from rotordrop.physics.ball_set import loose_race_seat, static_deflection

ZK, A_0 = 2.4e11, 5.7e-4


@pytest.mark.acceptance
@pytest.mark.parametrize(
    ("change", "agrees"), [({}, True), ({"preload": 531.0}, False), ({"ball_youngs_modulus": 316e9}, False)]
)
def test_reference_machine_constants(touchdown_bearing, change, agrees):
    """Own reference: K_tot, preload ball load and inner-race stress at preload of the reference machine."""
    constants = bb.bearing_constants(touchdown_bearing(**change))
    stress = constants.stress_coefficient_inner * constants.preload_ball_load ** (1 / 3)
    got = (constants.ball_stiffness, constants.preload_ball_load, stress / 1e6)
    assert (got == pytest.approx((1.06217e10, 53.2925, 993.3556), rel=5e-6)) == agrees


@pytest.mark.parametrize("alpha", [0.0, 1e-4, 0.26, 0.44, 1.0])
def test_approach_inverts_the_axial_force(alpha):
    F = np.geomspace(1e-9, 1e6, 31)
    s = bb.row_approach(F, ZK, A_0, alpha)
    np.testing.assert_allclose(bb.row_axial_force(s, ZK, A_0, alpha), F, rtol=1e-13)
    assert bb.row_approach(0.0, ZK, A_0, alpha) == 0.0


def test_preload_is_carried_by_the_balls_and_without_any_they_just_touch(touchdown_bearing):
    for arrangement, axial in (("X", 0.0), ("O", 0.0), ("tandem", -1060.0), ("single", -530.0)):
        constants = bb.bearing_constants(touchdown_bearing(arrangement=arrangement))
        response = bearing_response(constants, np.zeros(5), row_spacing=0.016)
        np.testing.assert_allclose(response.ball_loads, constants.preload_ball_load, rtol=1e-12)
        row = response.ball_loads * np.sin(response.contact_angles)
        np.testing.assert_allclose(np.abs(row.sum(axis=1)), 530.0, rtol=1e-12)
        assert response.force[2] == pytest.approx(axial, abs=1e-9)
    constants = bb.bearing_constants(touchdown_bearing(preload=0.0))
    assert constants.preload_ball_load == 0.0
    assert constants.preload_approach == 0.0
    distance = math.hypot(constants.radial_offset, constants.axial_offset)
    assert distance == pytest.approx(constants.groove_distance, rel=1e-15)


def test_axial_rigidity_is_the_tangent_of_the_pair(touchdown_bearing):
    for arrangement in ("X", "O"):
        constants = bb.bearing_constants(touchdown_bearing(arrangement=arrangement))
        tangent = bearing_response(constants, np.zeros(5)).stiffness[2, 2]
        assert bb.axial_rigidity(constants) == pytest.approx(tangent, rel=1e-11)


def test_lift_off_force_empties_one_row_and_not_sooner(touchdown_bearing):
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
def test_rigidity_needs_a_pair(touchdown_bearing, arrangement, named):
    constants = bb.bearing_constants(touchdown_bearing(arrangement=arrangement))
    with pytest.raises(UsageError, match=f'axial rigidity is defined .* not for {named}.*"X" or "O"'):
        bb.axial_rigidity(constants)


def test_balls_begin_at_plus_y_and_pull_outwards(touchdown_bearing):
    constants = bb.bearing_constants(touchdown_bearing(first_ball_angle=0.1, second_row_offset=0.5))
    rows = constants.row_ball_angles
    pitch = 2 * math.pi / 23
    assert rows.shape == (2, 23)
    assert rows[0, 0] == pytest.approx(math.pi / 2 + 0.1)
    np.testing.assert_allclose(np.diff(rows, axis=1), pitch)
    np.testing.assert_allclose(rows[1] - rows[0], 0.5 * pitch)
    bearing = touchdown_bearing(contact_angle=math.pi / 2)  # the balls roll on equal circles: half the speed
    mass = 3200.0 * math.pi / 6 * 0.009525**3
    assert bb.ball_centrifugal_force(bearing, 100.0) == pytest.approx(mass * 0.0425 * 50.0**2, rel=1e-12)


def test_bearing_of_the_machine_file_gives_the_same_constants(touchdown_bearing):
    described = bb.bearing_constants(example_machine("paper").touchdown_bearings[0].bearing)
    plain = bb.bearing_constants(touchdown_bearing())
    for name, value in vars(plain).items():
        np.testing.assert_allclose(getattr(described, name), value, rtol=1e-14, err_msg=name)


GROOVES = BallBearingGeometry(
    ball_diameter=12.7e-3,
    ball_count=9,
    pitch_diameter=65e-3,
    contact_angle=0.0,
    conformity_inner=0.52,
    conformity_outer=0.52,
    ball_youngs_modulus=208e9,
    ball_poisson_ratio=0.3,
    clearance=15e-6,
    arrangement="single",
)
"""A 209 bearing, the example of Harris, Rolling Bearing Analysis."""

SJOVALL = {0.1: 0.1156, 0.2: 0.1590, 0.3: 0.1892, 0.4: 0.2117, 0.5: 0.2288}
"""Sjövall's radial integral of point contacts by the extent of the load zone (Harris, load integrals)."""


def loads(bearing, load):
    """Ball loads of a loose bearing with its race at rest under a load downwards."""
    constants = bearing_constants(bearing)
    dx, dy = loose_race_seat(constants, load)
    response = bearing_response(constants, [dx, dy, 0.0, 0.0, 0.0])
    assert response.force[:2] == pytest.approx([0.0, load], abs=1e-9 * load)
    return response.ball_loads


def test_a_209_bearing_has_its_free_contact_angle_and_no_force_within_its_play():
    constants = bearing_constants(GROOVES)
    assert math.degrees(constants.contact_angle) == pytest.approx(9.0 + 52.0 / 60.0, abs=0.02)
    assert constants.axial_play == pytest.approx(0.1739e-3, rel=1e-3)
    assert free_contact_angle(0.0, 1e-3) == 0.0
    assert constants.radial_play == pytest.approx(7.5e-6, rel=1e-12)
    for part, axis in ((constants.radial_play, 1), (0.5 * constants.axial_play, 2)):
        for share, touches in ((0.999, False), (1.001, True)):
            q = np.zeros(5)
            q[axis] = share * part
            assert (np.max(bearing_response(constants, q).ball_loads) > 0.0) == touches


@pytest.mark.parametrize("epsilon", SJOVALL)
def test_the_load_zone_is_that_of_sjovalls_integral(epsilon):
    # ε = ½ (1 − P_d / (2 δ_r)) with the shift δ_r of the race; many balls make the sum an integral.
    many = replace(GROOVES, ball_count=1200, ball_diameter=1e-3, clearance=15e-6 if epsilon < 0.5 else 0.0)
    constants = bearing_constants(many)
    shift = 7.5e-6 / (1.0 - 2.0 * epsilon) if epsilon < 0.5 else 10e-6
    response = bearing_response(constants, [0.0, -shift, 0.0, 0.0, 0.0])
    share = response.force[1] / (1200 * np.max(response.ball_loads))
    assert share == pytest.approx(SJOVALL[epsilon], abs=1e-4)
    zone = np.mean(response.ball_loads > 0.0)
    assert zone == pytest.approx(math.acos(1.0 - 2.0 * epsilon) / math.pi, abs=2e-3)
    dx, dy = loose_race_seat(constants, float(response.force[1]))
    assert (dx, dy) == pytest.approx((0.0, -shift), abs=1e-13)


@pytest.mark.parametrize("clearance", [0.0, 15e-6, 60e-6])
@pytest.mark.parametrize("phase", [0.0, 0.1, 0.25, 0.4, 0.5])
@pytest.mark.parametrize("count", [3, 5, 9])
def test_a_few_balls_carry_the_load_wherever_the_first_one_stands(clearance, phase, count):
    turned = replace(
        GROOVES, ball_count=count, clearance=clearance, first_ball_angle=phase * 2.0 * math.pi / count
    )
    for load in (1.0, 300.0, 20e3):
        carried = loads(turned, load)
        assert np.sum(carried > 0.0) >= 1
        deflection, stiffness = static_deflection(bearing_constants(turned), load)
        assert deflection > 0.5 * clearance
        more, _ = static_deflection(bearing_constants(turned), load * (1.0 + 1e-6))
        assert stiffness == pytest.approx(1e-6 * load / (more - deflection), rel=2e-3)


def test_pairs_that_just_touch_or_are_mounted_with_play():
    pair = replace(GROOVES, contact_angle=math.radians(15.0), clearance=None, arrangement="X", ball_count=19)
    least = static_deflection(bearing_constants(replace(pair, preload=1e-6)), 800.0)
    assert static_deflection(bearing_constants(pair), 800.0) == pytest.approx(least, rel=1e-4)
    pair = replace(GROOVES, contact_angle=math.radians(15.0), clearance=20e-6, arrangement="X")
    constants = bearing_constants(pair)
    A = constants.groove_distance
    assert constants.radial_play == pytest.approx(10e-6, rel=1e-9)
    assert math.cos(constants.radial_contact_angle) == pytest.approx(math.cos(math.radians(15.0)) + 10e-6 / A)
    assert constants.axial_offset < A * math.sin(math.radians(15.0))


def test_a_preload_on_deep_grooves_acts_at_the_angle_the_clearance_leaves():
    constants = bearing_constants(replace(GROOVES, preload=200.0, arrangement="X"))
    response = bearing_response(constants, np.zeros(5))
    assert constants.preloaded
    assert constants.radial_play == 0.0
    assert np.min(np.abs(response.contact_angles)) > math.radians(9.86)
    row = np.sum(response.ball_loads[0] * np.abs(np.sin(response.contact_angles[0])))
    assert row == pytest.approx(200.0, rel=1e-9)
