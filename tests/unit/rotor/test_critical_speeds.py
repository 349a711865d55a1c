"""Critical speed map and Campbell diagram: limits, monotony, agreement, the paper's two modes."""

from types import SimpleNamespace

import numpy as np
import pytest

from rotordrop.errors import UsageError
from rotordrop.physics.timoshenko import round_section
from rotordrop.rotor.assembly import PointMass, assemble, free_free_modes, modes_on_springs
from rotordrop.rotor.campbell import (
    Crossing,
    Separation,
    campbell_diagram,
    campbell_lines,
    required_margin,
    separations,
)
from rotordrop.rotor.critical_speeds import critical_speed_map, critical_speeds
from rotordrop.rotor.reduction import Reduction, reduce_rotor
from rotordrop.rotor.suspension import (
    Support,
    equivalent_stiffness,
    link,
    spring,
    suspension_of,
    touchdown_supports,
)


@pytest.fixture(scope="module")
def paper_map(paper):
    return critical_speed_map(paper, np.geomspace(1e4, 1e11, 15))


def test_the_map_has_its_ends_and_the_modes_it_was_fitted_to(paper_map, paper_fe):
    free = free_free_modes(paper_fe, 6).frequency[2:]
    pinned = modes_on_springs(paper_fe, {4: 1e14, 26: 1e14}, 6).frequency
    assert paper_map.massless[0, 2:] == pytest.approx(free, rel=2e-4)
    assert paper_map.massless[-1] == pytest.approx(pinned, rel=5e-3)
    # Own reference: 134 and 235 Hz were used to reconstruct this machine, so this is no validation.
    assert paper_map.at_lines["tangent"][:2] == pytest.approx([134.0, 235.0], abs=0.01)
    assert paper_map.at_lines["with support mass"][1:3] == pytest.approx([206.4, 265.2], abs=0.1)
    assert np.all(paper_map.at_lines["simple"] < paper_map.at_lines["tangent"])
    assert np.all(paper_map.at_lines["with contact"] < paper_map.at_lines["tangent"])


def test_frequencies_rise_along_the_map_and_from_backward_to_forward(paper_map, paper):
    assert np.all(np.diff(paper_map.massless, axis=0) > 0.0)
    shown = paper_map.with_support_mass[~np.isnan(paper_map.with_support_mass[:, 0])]
    assert 5 < len(shown) < 15
    assert np.all(np.diff(shown, axis=0) > 0.0)
    forward, still, backward = (
        critical_speed_map(paper, [1e8], whirl=w).massless[0] for w in ("forward", "standstill", "backward")
    )
    assert np.all(forward > still)
    assert np.all(still > backward)


def test_support_mass_is_felt_and_resonates_where_it_should(paper):
    masses = {f"{b.name}.support.mass": 1e-4 for b in paper.touchdown_bearings}
    light = critical_speed_map(paper.with_values(masses), [1e8])
    assert light.at_lines["with support mass"] == pytest.approx(light.at_lines["tangent"], rel=1e-5)
    assert light.with_support_mass[0] == pytest.approx(light.massless[0], rel=1e-5)
    section = round_section(0.1, 0.0, 2e11, 0.3, 7850.0)
    rotor = assemble([0.0, 0.5, 1.0], [section] * 2, modal_damping=0.0)
    loose = [Support(node=n, links=(link(1e2), link(1e8)), masses=(40.0,)) for n in (1, 3)]
    assert np.sqrt(1e8 / 40) / (2 * np.pi) == pytest.approx(251.6, abs=0.1)
    found = critical_speeds(rotor, loose, whirl="standstill")
    assert np.min(np.abs(found - 251.646)) < 1e-2


def body_on_springs(polar_inertia):
    """A body of 50 kg on a shaft without mass and two springs of 1e6 N/m, each 0.4 m away."""
    section = round_section(0.1, 0.0, 2e11, 0.3, 0.0)
    body = PointMass(node=2, mass=50.0, polar_inertia=polar_inertia, diametral_inertia=2.0)
    rotor = assemble([0.0, 0.4, 0.8], [section] * 2, [body])
    return reduce_rotor(rotor, Reduction(modes=2, attachment=False)), [spring(1, 1e6), spring(3, 1e6)]


def test_a_rigid_body_has_its_textbook_critical_speeds_and_a_disc_no_conical_forward_one():
    rotor, held = body_on_springs(polar_inertia=0.5)
    turning = 2e6 * 0.4**2
    for whirl, inertia in (("forward", 2.0 - 0.5), ("backward", 2.0 + 0.5), ("standstill", 2.0)):
        expected = sorted([np.sqrt(2e6 / 50.0), np.sqrt(turning / inertia)])
        assert critical_speeds(rotor, held, whirl=whirl) * 2 * np.pi == pytest.approx(expected, rel=1e-6)
    rotor, held = body_on_springs(polar_inertia=4.0)
    assert len(critical_speeds(rotor, held, whirl="forward")) == 1
    assert len(critical_speeds(rotor, held, whirl="backward")) == 2


def test_equivalent_stiffness_is_a_series_and_supports_hold_with_its_parts(paper):
    for parts, bearing in zip(equivalent_stiffness(paper), paper.touchdown_bearings, strict=True):
        assert parts.bearing == bearing.name
        assert 1 / parts.equivalent() == pytest.approx(1 / parts.tangent + 1 / parts.support, rel=1e-12)
        assert 1 / parts.equivalent("simple") == pytest.approx(
            1 / parts.simple + 1 / parts.support, rel=1e-12
        )
        rest = 1 / parts.equivalent(contact=True) - 1 / parts.equivalent()
        assert rest == pytest.approx(1 / parts.contact, rel=1e-9)
        assert parts.simple < parts.tangent
    support = touchdown_supports(paper)[0]
    parts = equivalent_stiffness(paper)[0]
    series = 1 / sum(1 / part.stiffness[1, 1] for part in support.links)
    assert series == pytest.approx(parts.equivalent(contact=True), rel=1e-12)
    assert support.masses == (0.24, 40.0)
    assert support.links[1].damping[0, 0] == pytest.approx(1e-5 * parts.tangent)


SPEEDS = np.linspace(0.0, 2 * np.pi * 700.0, 29)


def test_lines_cross_the_speed_where_the_critical_speeds_are(overhung):
    held = [spring(2, 2e7), spring(8, 2e7)]
    basis = reduce_rotor(overhung, "accurate", (2, 8))
    diagram = campbell_lines(basis, overhung.node_positions, SPEEDS, held, count=10)
    for direction in ("forward", "backward"):
        expected = critical_speeds(basis, held, whirl=direction)
        expected = expected[expected < SPEEDS[-1] / (2 * np.pi)]
        found = [c.speed / (2 * np.pi) for c in diagram.crossings if c.direction == direction]
        assert len(found) >= 1
        assert found == pytest.approx(expected[: len(found)], rel=5e-3)
        assert len(found) == len(expected)


@pytest.mark.parametrize("suspension", ["free-free", "AMBs", "touchdown bearings"])
def test_lines_are_smooth_and_keep_their_direction(paper, suspension):
    diagram = campbell_diagram(paper, SPEEDS, suspension, count=8)
    assert diagram.frequency.shape == (29, 8)
    jump = np.abs(np.diff(diagram.frequency, axis=0, n=2))
    assert np.nanmax(jump) < 0.02 * np.nanmax(diagram.frequency)
    for line in range(8):
        assert diagram.direction(line) in ("forward", "backward")
        assert len(set(np.sign(diagram.whirl[:, line]))) == 1
    assert np.all(diagram.damping_ratio > 0.0)
    assert diagram.shapes.shape == (29, 8, 36, 2)


def test_lines_that_cross_are_followed_through():
    """A bounce that the spin does not touch and a tilt that it slows: their lines cross."""
    rotor, held = body_on_springs(polar_inertia=1.5)
    diagram = campbell_lines(rotor, np.array([0.0, 0.4, 0.8]), np.linspace(0.0, 1500.0, 31), held, count=4)
    bounce = np.sqrt(2e6 / 50.0) / (2 * np.pi)
    level = [k for k in range(4) if np.allclose(diagram.frequency[:, k], bounce, rtol=1e-6)]
    assert len(level) == 2
    (falling,) = (k for k in range(4) if diagram.frequency[0, k] > diagram.frequency[-1, k] + 1.0)
    assert diagram.frequency[0, falling] > bounce > diagram.frequency[-1, falling]
    assert diagram.direction(falling) == "backward"


@pytest.mark.parametrize(
    ("request_of", "message"),
    [
        (lambda paper, _: critical_speed_map(paper, [0.0, 1e6]), "must be positive, got 0 N/m"),
        (lambda _, fe: critical_speeds(fe, [spring(2, 1e6)], whirl="sideways"), "'sideways'; expected"),
        (lambda _, fe: critical_speeds(fe, []), "springs at two nodes at least"),
        (lambda paper, _: suspension_of(paper, "air"), "suspension is 'air'; expected one of free-free"),
        (lambda paper, _: campbell_diagram(paper, [10.0, 5.0]), "must increase"),
        (lambda paper, _: campbell_diagram(paper, [0.0]), "highest speed .* is 0.0; expected a positive"),
        (lambda paper, _: equivalent_stiffness(paper)[0].equivalent("exact"), "unknown .* 'exact'; choose"),
    ],
)
def test_bad_requests_are_refused(paper, overhung, request_of, message):
    with pytest.raises(UsageError, match=message):
        request_of(paper, overhung)


@pytest.mark.parametrize(
    ("factor", "below", "above"),
    [
        (2.4, 0.0, 0.0),
        (2.5, 0.0, 0.10),
        (3.5, 0.085, 0.185),
        (10.0, 0.15, 0.25),
        (18.5, 0.16, 0.26),
        (1e9, 0.16, 0.26),
    ],
)
def test_margins_are_those_of_the_convention(factor, below, above):
    """17 (1 - 1/(AF - 1.5)) % and at most 16 below, ten more above; at AF = 10 exactly 15 and 25."""
    assert required_margin(factor, above=False) == pytest.approx(below, abs=1e-9)
    assert required_margin(factor, above=True) == pytest.approx(above, abs=1e-9)


def crossing(speed, damping_ratio=0.02, direction="forward"):
    return Crossing(speed=speed, line=0, direction=direction, damping_ratio=damping_ratio)


def test_a_critical_speed_is_set_against_the_nearer_end_of_the_range():
    below, inside, above = crossing(80.0), crossing(110.0), crossing(180.0)
    damped, backward = crossing(99.0, 0.3), crossing(100.0, direction="backward")
    diagram = SimpleNamespace(crossings=(below, inside, damped, backward, above))
    found = separations(diagram, 100.0, 120.0).values()
    assert [one.margin for one in found] == pytest.approx([0.2, 0.0, 0.01, 0.5])
    assert [one.verdict for one in found] == ["met", "not met", "critically damped", "met"]


@pytest.mark.parametrize(
    ("factor", "speed", "said"),
    [(2.0, 101.0, ("none", "critically damped")), (10.0, 90.0, ("15.0 %", "not met"))],
)
def test_a_margin_in_words(factor, speed, said):
    one = Separation.of(speed, factor, 100.0, 100.0)
    assert (one.asked, one.verdict) == said
