"""What a machine and its bearings amount to, against the paper's numbers and by statics."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.reference.rotor_shapes import bending_part
from tests.scaled_machines import scaled_machine

from rotordrop import Known, example_machine
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.table import parameter
from rotordrop.errors import SimulationError, UsageError
from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.physics.timoshenko import round_section
from rotordrop.report.machine_content import machine_content
from rotordrop.rotor.assembly import assemble
from rotordrop.rotor.machine_summary import CRITICAL, machine_warnings, summarise_machine
from rotordrop.rotor.statics import bearing_load_shares, levitated_sag, rest_on, settled_sag, weight_vector
from rotordrop.rotor.suspension import equivalent_stiffness


@pytest.fixture(scope="module")
def machine():
    return example_machine("paper")


@pytest.fixture(scope="module")
def summary(machine):
    return summarise_machine(machine)


def test_the_reference_machine_has_its_numbers_with_and_without_ambs(summary, machine):
    """Mass, polar inertia, map, free-free modes and bearings as published for the reference machine."""
    assert summary.fe.total_mass == pytest.approx(59.49996, rel=1e-6)
    assert summary.fe.polar_inertia == pytest.approx(0.0875213, rel=1e-6)
    assert summary.free_free[:3] == pytest.approx([187.305, 482.965, 876.980], rel=1e-5)
    assert summary.settled[:2] == pytest.approx([134.0, 235.0], rel=1e-3)
    nde, de = summary.bearings
    assert (nde.load, de.load) == pytest.approx((174.6, 409.1), rel=3e-4)
    stated = {figure.field: figure.value for figure in nde.figures}
    assert stated["preload_stress_Pa"] == pytest.approx(993.3556e6, rel=1e-6)
    assert (nde.tangent_stiffness, de.tangent_stiffness) == pytest.approx((509.925e6, 507.524e6), rel=1e-5)
    assert summary.levitated_sag is not None
    assert summarise_machine(machine.model_copy(update={"ambs": ()})).levitated_sag is None
    nominal = machine_warnings(machine, summary)
    assert nominal == machine_warnings(machine, summary, float(machine.speed.nominal))


def warnings_of(machine, kind, speed_Hz):
    found = machine_warnings(machine, summarise_machine(machine), 2 * math.pi * speed_Hz)
    return [warning for warning in found if warning.kind == kind]


def test_a_critical_speed_near_the_speed_is_told_where_the_magnets_are_given(machine):
    """548.4 Hz beside a nominal 550 Hz, by a stiffness of the user and not by a default of ours."""
    given = tuple(
        one.model_copy(
            update={name: replace(getattr(one, name), status="given") for name in ("stiffness", "damping")}
        )
        for one in machine.ambs
    )
    stated = machine.model_copy(update={"ambs": given})
    (found,) = warnings_of(stated, CRITICAL, 550.0)
    assert (found.value / (2 * math.pi), found.doubtful) == (pytest.approx(548.4, abs=0.2), False)
    assert "0.3 % from 550 Hz" in found.message
    said = machine_content(stated, summarise_machine(stated), (found,)).verdict
    assert [one.level for one in said[:2]] == ["good", "warning"]
    assert not warnings_of(stated, CRITICAL, 400.0) and not warnings_of(machine, CRITICAL, 550.0)


@pytest.mark.parametrize(("speed_Hz", "force"), [(60.0, 1.8), (210.0, 22.0), (550.0, 149.0)])
def test_ball_centrifugal_force_is_compared_with_preload(machine, speed_Hz, force):
    """1.8 / 22 / 149 N per ball against 53 N preload ball load: small, then near half, then dominant."""
    found = warnings_of(machine, "ball centrifugal force", speed_Hz)
    assert bool(found) == (force > 0.1 * 53.3)
    for warning in found:
        assert warning.value == pytest.approx(force, rel=0.03)
        assert warning.limit == pytest.approx(53.2925, rel=1e-4)


def test_a_summary_names_what_is_out_of_the_usual(machine):
    bearing = machine.touchdown_bearings[1]
    limit = bearing.bearing.preload.__class__(value=2 * math.pi * 200, unit="rad/s")
    limited = bearing.model_copy(
        update={"bearing": bearing.bearing.model_copy(update={"limiting_speed": limit})}
    )
    slow = machine.model_copy(update={"touchdown_bearings": (machine.touchdown_bearings[0], limited)})
    assert warnings_of(slow, "limiting speed", 199.0) == []
    (warning,) = warnings_of(slow, "limiting speed", 210.0)
    assert warning.bearing == "DE"
    # A 40 kg support on 1e8 N/m resonates at 252 Hz and splits the 235 Hz mode.
    (nde,) = [w for w in warnings_of(machine, "support resonance", 60.0) if w.bearing == "NDE"]
    assert (nde.value, nde.limit) == pytest.approx((251.6, 235.0), rel=1e-3)
    light = machine.with_values({"NDE.support.mass": 4.0, "DE.support.mass": 4.0})
    assert warnings_of(light, "support resonance", 60.0) == []
    de = machine.touchdown_bearings[1].model_copy(update={"node": 10})
    tipped = machine.model_copy(update={"touchdown_bearings": (machine.touchdown_bearings[0], de)})
    (warning,) = warnings_of(tipped, "load direction", 60.0)
    assert warning.bearing == "NDE"
    assert warning.value < 0.0
    with pytest.raises(UsageError, match=r"'NDE' carries -1.31e.03 N of the rotor's weight"):
        equivalent_stiffness(tipped)
    # The estimators take the range as it stands, not one about the guess.
    found = warnings_of(example_machine("lp400"), "guess off the middle of its range", 60.0)
    assert [warning.bearing for warning in found] == ["NDE", "DE"]


def test_frictional_heat_matters_at_nominal_speed_and_not_in_the_papers_tests(machine):
    assert warnings_of(machine, "frictional heat", 60.0) == []
    found = warnings_of(machine, "frictional heat", 550.0)
    assert [warning.bearing for warning in found] == ["NDE", "DE"]
    assert all(warning.value > 0.1 * warning.limit for warning in found)
    slippery = machine.with_values({"NDE.friction.dynamic": 0.0, "DE.friction.dynamic": 0.0})
    assert warnings_of(slippery, "frictional heat", 550.0) == []


@pytest.mark.parametrize("preload", [20.0, 92.0, 400.0])
def test_the_number_a_preload_is_estimated_by_gives_it_back(paper, preload):
    by = parameter("preload").estimated_by
    assert by is not None
    measure = by(paper.touchdown_bearings[0])
    assert measure.value_of(measure.of_value(preload)) == pytest.approx(preload, rel=1e-9)


def test_the_seat_carries_the_load_and_equal_bearings_share_numbers(paper):
    numbers = numbers_of(paper.touchdown_bearings[0])
    way, stiffness = numbers.deflection(200.0)
    further, _ = numbers.deflection(202.0)
    assert numbers.seat(200.0) == (0.0, -way)
    assert (further - way) * stiffness == pytest.approx(2.0, rel=2e-3)
    first = numbers_of(paper.touchdown_bearings[0]).constants
    other_friction = paper.with_values({"NDE.friction.dynamic": 0.2}).touchdown_bearings[0]
    assert numbers_of(other_friction).constants is first
    preload = 1.2 * float(paper.touchdown_bearings[0].bearing.preload)
    loaded = paper.with_values({"NDE.preload": preload}).touchdown_bearings[0]
    assert numbers_of(loaded).constants is not first
    assert numbers_of(loaded).constants.axial_offset != first.axial_offset


def test_a_loose_row_states_its_play_along_and_across():
    row = '{ rows = 1, clearance = "38 um", ball_diameter = "13.494 mm", ball_count = 14, '
    row += 'pitch_diameter = "102.5 mm", ball_material = "steel" }'
    loose = scaled_machine(60.0, bearing=row).touchdown_bearings[0]
    stated = {figure.field: figure.value for figure in numbers_of(loose).figures(200.0)}
    constants = bearing_constants(loose.bearing)
    assert stated["clearance_m"] == pytest.approx(38e-6)
    assert stated["axial_play_m"] == pytest.approx(
        2.0 * constants.groove_distance * math.sin(constants.contact_angle)
    )
    assert "preload_N" not in stated


def test_a_preload_beyond_the_static_stress_is_doubted(paper):
    bearing = paper.touchdown_bearings[0]
    pressed = bearing.changed(bearing=bearing.bearing.changed(preload=Known(value=2e5)))
    machine = paper.model_copy(update={"touchdown_bearings": (pressed, paper.touchdown_bearings[1])})
    found = machine_warnings(machine, summarise_machine(machine))
    (told,) = (warning for warning in found if warning.kind == "preload" and warning.limit == 4.2e9)
    assert told.doubtful
    assert told.value > 4.2e9


G = 9.81


def test_load_shares_and_sags_are_those_of_the_textbook(paper, paper_fe):
    shares = bearing_load_shares(paper)
    assert shares == pytest.approx([174.618, 409.077], abs=1e-3)
    assert np.sum(shares) == pytest.approx(paper_fe.total_mass * G, rel=1e-12)
    positions = np.array(paper.rotor.node_positions)[[3, 25]]
    assert shares @ positions == pytest.approx(
        paper_fe.total_mass * G * paper_fe.centre_of_gravity, rel=1e-12
    )
    section = round_section(0.05, 0.0, 2.1e11, 0.3, 7850.0)
    beam = assemble(np.linspace(0.0, 1.0, 9), [section] * 8)
    shape, reactions = rest_on(beam, [1, 9], G)
    load = section.mass * G
    bending, shear = 5 * load / (384 * section.bending_stiffness), load / (8 * section.shear_stiffness)
    assert shape[8] == pytest.approx(-(bending + shear), rel=1e-9)
    assert reactions == pytest.approx([0.5 * load] * 2, rel=1e-9)
    assert shape[1] == pytest.approx(-load / (24 * section.bending_stiffness), rel=1e-9)
    section = round_section(0.01, 0.0, 2.1e11, 0.3, 7850.0)
    beam = assemble(np.linspace(0.0, 1.0, 9), [section] * 8)
    _, reactions = rest_on(beam, [1, 5, 9], G)
    assert reactions / (section.mass * G) == pytest.approx([3 / 16, 10 / 16, 3 / 16], rel=1e-3)


def test_the_rotor_sags_between_its_magnets_and_between_its_bearings(paper, paper_fe):
    sag = levitated_sag(paper_fe, paper)
    assert sag[[14, 42]] == pytest.approx([0.0, 0.0], abs=1e-15)
    bent = bending_part(paper_fe, sag)
    assert bent[[6, 50]] * 1e6 == pytest.approx([-6.6, 4.9], abs=0.06)
    twice = bending_part(paper_fe, bent)
    np.testing.assert_allclose(twice, bent, atol=1e-18)
    sag = settled_sag(paper_fe, paper)
    assert sag[[6, 50]] == pytest.approx([0.0, 0.0], abs=1e-15)
    assert np.min(sag[0::2]) < -5e-6
    difference = levitated_sag(paper_fe, paper) - sag
    force = paper_fe.stiffness @ difference
    assert set(np.flatnonzero(np.abs(force) > 1e-5)) == {6, 14, 42, 50}


def test_sag_goes_with_gravity_and_with_magnets_that_give_way(paper_fe, paper):
    one, other = (rest_on(paper_fe, [8, 22], g) for g in (G, 2 * G))
    np.testing.assert_allclose(2 * one[0], other[0], rtol=1e-9, atol=1e-16)
    force = paper_fe.stiffness @ one[0] - weight_vector(paper_fe, G)
    expected = one[1][0] * paper_fe.node_row(8) + one[1][1] * paper_fe.node_row(22)
    np.testing.assert_allclose(force, expected, atol=1e-6)
    ambs = [
        SimpleNamespace(node=n, stiffness=2e6, integral_action=integral)
        for n, integral in ((8, True), (22, False))
    ]
    sag = levitated_sag(paper_fe, SimpleNamespace(ambs=ambs, gravity=G, name="half"))
    _, reactions = rest_on(paper_fe, [8, 22], G)
    assert sag[14] == pytest.approx(0.0, abs=1e-12)
    assert sag[42] == pytest.approx(-reactions[1] / 2e6, rel=1e-9)


def test_one_bearing_may_carry_all_and_none_means_no_rest(paper, paper_fe):
    only = SimpleNamespace(
        touchdown_bearings=[SimpleNamespace(node=18, name="mid")], gravity=G, rotor=paper.rotor
    )
    assert bearing_load_shares(only, paper_fe) == pytest.approx([paper_fe.total_mass * G])
    sag = settled_sag(paper_fe, only)
    assert sag[34] == pytest.approx(0.0, abs=1e-18)
    assert sag[0] < 0.0
    assert sag[70] < 0.0
    # A section of some nanometres among others ended in a traceback of the linear algebra.
    with pytest.raises(SimulationError, match=r"two or more different nodes; it is held at: 8, 8"):
        rest_on(paper_fe, [8, 8], G)
    lone = SimpleNamespace(ambs=paper.ambs[:1], gravity=G)
    with pytest.raises(SimulationError, match=r"the machine has 1 AMB planes; the sag .* needs two"):
        levitated_sag(paper_fe, lone)
    stiffness = paper_fe.stiffness.copy()
    stiffness[40:42] = stiffness[:, 40:42] = 0.0
    with pytest.raises(SimulationError, match="the shaft cannot hold its own weight"):
        rest_on(replace(paper_fe, stiffness=stiffness), [8, 28], G)
