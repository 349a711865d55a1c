"""Hidden machines: repeatable, within their ranges, broken only where asked; their rest at any weight."""

from operator import attrgetter

import numpy as np
import pytest
from tests.scaled_machines import scaled_machine

from rotordrop.elements.table import rows
from rotordrop.errors import UsageError
from rotordrop.machine import example_machine
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop_bench import Violations, hidden_machine, synthesize_drop
from rotordrop_bench.event import LARGEST_JITTER, LARGEST_ORBIT, drop_conditions, stream
from rotordrop_bench.settled import settled_coordinates
from rotordrop_bench.true_values import machine_truth


def test_the_same_seed_draws_the_same_machine_and_stream(known, hidden):
    again = hidden_machine(known, 3)
    assert machine_truth(again.machine) == machine_truth(hidden.machine)
    assert again.model.parameters.bearing.tobytes() == hidden.model.parameters.bearing.tobytes()
    other = machine_truth(hidden_machine(known, 4).machine)
    assert other["support.stiffness_N_per_m"] != machine_truth(hidden.machine)["support.stiffness_N_per_m"]
    assert stream(5, "noise").random() == stream(5, "noise").random()
    assert stream(5, "noise").random() != stream(5, "drop").random()
    assert stream(5, "noise").random() != stream(6, "noise").random()


@pytest.mark.parametrize("example", ["lp400", "paper", "small"])
def test_drawn_values_spread_and_stay_in_the_ranges_of_the_owner(example):
    known = example_machine(example)
    factors = []
    estimated = [row for row in rows("bearing") if row.entries]
    for seed in range(12):
        machine = hidden_machine(known, seed).machine
        for true, told in zip(machine.touchdown_bearings, known.touchdown_bearings, strict=True):
            for row in estimated:
                value, named = row.described(true), row.described(told)
                if named.range is not None:
                    assert named.range[0] <= float(value) <= named.range[1], row.path
            factors.append(float(true.support.stiffness) / float(told.support.stiffness))
    assert 0.6 <= min(factors) < 0.8 < 1.2 < max(factors) <= 1.45


def test_what_is_estimated_is_drawn_and_the_rotor_exact(known, hidden):
    """Else its estimate would be scored against what the estimator was told."""
    structure = {"contact.exponent", "support.anisotropy"}  # drawn as a violation of the model, when asked
    for true, told in zip(hidden.machine.touchdown_bearings, known.touchdown_bearings, strict=True):
        for row in rows("bearing"):
            if row.entries:
                same = float(row.described(true)) == float(row.described(told))
                assert same == (row.path in structure), row.path
    assert hidden.machine.rotor.elements == known.rotor.elements
    assert hidden.machine.sensors == known.sensors
    assert hidden.model.basis.size == 16
    plain = hidden_machine(known, 3, drawn=False)
    assert machine_truth(plain.machine) == machine_truth(known)


@pytest.mark.parametrize(
    ("parts", "path", "factor"),
    [
        ({"race": {"mass": 1.5}}, "race.mass", 1.5),
        ({"race": {"mass": 1.5}}, "race.inertia", 1.5),
        ({"support": {"stiffness_ratio": 0.6}}, "support.stiffness_horizontal", 0.6),
        ({"support": {"damping_ratio": 0.6}}, "support.damping_horizontal", 0.6),
        ({"friction": {"dynamic": 0.28}}, "friction.dynamic", 0.28),
        ({"friction": {"dynamic": 0.28}}, "friction.static", 0.28),
    ],
)
def test_a_violation_changes_what_it_names_at_every_bearing(known, hidden, parts, path, factor):
    broken = hidden_machine(known, 3, Violations.of(parts)).machine
    for true, plain in zip(broken.touchdown_bearings, hidden.machine.touchdown_bearings, strict=True):
        was = 1.0 / float(plain.friction.dynamic) if "friction" in parts else 1.0  # there it is the value
        value = attrgetter(path)
        assert float(value(true)) == pytest.approx(factor * was * float(value(plain)), rel=1e-12)
        assert float(true.support.stiffness) == float(plain.support.stiffness)
        assert float(true.air_gap) == float(plain.air_gap)


def test_another_exponent_is_as_deep_at_a_typical_force(known, hidden):
    broken = hidden_machine(known, 3, Violations.of({"contact": {"exponent": 1.5}})).machine
    for pair in zip(broken.touchdown_bearings, hidden.machine.touchdown_bearings, strict=True):
        typical = 5.0 * 0.5 * 9.81 * known.rotor.mass
        depths = [(typical / float(b.contact.stiffness)) ** (1 / float(b.contact.exponent)) for b in pair]
        assert float(pair[0].contact.exponent) == 1.5
        assert depths[0] == pytest.approx(depths[1], rel=1e-12)


def test_conditions_of_drops_differ_within_their_limits(hidden):
    drawn = [drop_conditions(hidden, 400.0, seed) for seed in range(30)]
    assert len({c.start.rotor_angle for c in drawn}) == 30
    assert all(abs(c.jitter) <= LARGEST_JITTER for c in drawn)
    late = [c.jitter for c in drawn]
    assert max(late) > 0.5 * LARGEST_JITTER > -0.5 * LARGEST_JITTER > min(late)
    for c in drawn:
        assert np.all(np.abs(c.start.orbit) <= LARGEST_ORBIT)
        assert np.all(c.start.remanent_force[:, 1] > 0.0)
        assert np.all(c.start.remanent_force[:, 1] < 0.31 * hidden.machine.rotor.mass * 9.81 / 2)
    assert drop_conditions(hidden, 400.0, 1).start.rotor_angle == drawn[1].start.rotor_angle
    with pytest.raises(UsageError, match="a drop at 0 rad/s cannot be synthesized"):
        drop_conditions(hidden, 0.0, 1)


SIZES = [(5.0, 1.0), (36.0, 1.0), (60.0, 1.2), (130.0, 1.5), (6000.0, 1.0), (6000.0, 1.3)]


@pytest.mark.parametrize(("mass", "slenderness"), SIZES)
def test_a_rotor_of_any_mass_finds_its_rest(mass, slenderness):
    machine = scaled_machine(mass, slenderness=slenderness)
    assert machine.rotor.mass == pytest.approx(mass, rel=0.03)
    model = build_drop_model(machine)
    layout, p = model.layout, model.parameters
    state = layout.zeros()
    state[: layout.n_coordinates] = settled_coordinates(model)
    change, work = layout.zeros(), scratch_of(p)
    drop_derivative(0.0, state, p, change, work)
    left = change[layout.velocity_of(layout.modal_y)]
    assert np.max(np.abs(left)) < 1e-8 * np.max(np.abs(p.gravity))
    carried = -state[layout.support].reshape(-1, 2)[:, 1] * p.bearing[:, L.SUPPORT_STIFFNESS_Y]
    assert np.sum(carried) == pytest.approx(9.81 * machine.rotor.mass, rel=1e-8)
    assert carried == pytest.approx(model.load_shares, rel=1e-3)


def test_a_heavy_slender_rotor_is_synthesized_with_its_tail():
    machine = scaled_machine(130.0, slenderness=1.5)
    drop = synthesize_drop(hidden_machine(machine, 1), float(machine.speed.nominal), 1, duration=0.02)
    assert drop.tail is not None
    depth = np.hypot(*np.mean(drop.tail.signals.reshape(-1, 2, 2), axis=0).T)
    gaps = [float(bearing.air_gap) for bearing in machine.touchdown_bearings]
    assert depth == pytest.approx(gaps, rel=0.3)
