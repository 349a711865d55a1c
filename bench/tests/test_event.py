"""Hidden machines: repeatable, within their ranges, and broken only where asked."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.elements.table import rows
from rotordrop.errors import UsageError
from rotordrop.machine import example_machine
from rotordrop_bench import VIOLATIONS, Violations, hidden_machine
from rotordrop_bench.event import LARGEST_JITTER, LARGEST_ORBIT, drop_conditions, stream
from rotordrop_bench.true_values import machine_truth


def test_the_same_seed_draws_the_same_machine(known, hidden):
    again = hidden_machine(known, 3)
    assert machine_truth(again.machine) == machine_truth(hidden.machine)
    assert again.model.parameters.bearing.tobytes() == hidden.model.parameters.bearing.tobytes()
    other = machine_truth(hidden_machine(known, 4).machine)
    assert other["support_stiffness"] != machine_truth(hidden.machine)["support_stiffness"]


def test_a_stream_does_not_depend_on_the_other_ones():
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


def test_the_truth_of_every_estimated_parameter_is_drawn(known, hidden):
    """Else its estimate would be scored against what the estimator was told."""
    structure = {"contact.exponent", "support.anisotropy"}  # drawn as a violation of the model, when asked
    for true, told in zip(hidden.machine.touchdown_bearings, known.touchdown_bearings, strict=True):
        for row in rows("bearing"):
            if row.entries:
                same = float(row.described(true)) == float(row.described(told))
                assert same == (row.path in structure), row.path


def _at(part, path):
    for key in path.split("."):
        part = getattr(part, key)
    return part


def test_the_rotor_itself_is_exact(known, hidden):
    assert hidden.machine.rotor.elements == known.rotor.elements
    assert hidden.machine.sensors == known.sensors
    assert hidden.model.basis.size == 16


def test_without_a_draw_the_owner_is_right(known):
    plain = hidden_machine(known, 3, drawn=False)
    assert machine_truth(plain.machine) == machine_truth(known)


@pytest.mark.parametrize(
    ("name", "path", "factor"),
    [
        ("contact stiffness +25 %", "contact.stiffness", 1.25),
        ("contact stiffness -25 %", "contact.stiffness", 0.75),
        ("contact damping +50 %", "contact.damping", 1.5),
        ("race inertia +25 %", "race.inertia", 1.25),
        ("race inertia -25 %", "race.inertia", 0.75),
        ("sharper friction", "friction.stribeck_speed", 0.2),
        ("sharper friction", "friction.static", 1.3),
        ("anisotropic support 0.6", "support.stiffness_horizontal", 0.6),
    ],
)
def test_a_violation_changes_what_it_names_at_every_bearing(known, hidden, name, path, factor):
    broken = hidden_machine(known, 3, name)
    for true, plain in zip(broken.machine.touchdown_bearings, hidden.machine.touchdown_bearings, strict=True):
        assert float(_at(true, path)) == pytest.approx(factor * float(_at(plain, path)), rel=1e-12)
        assert float(true.support.stiffness) == float(plain.support.stiffness)
        assert float(true.air_gap) == float(plain.air_gap)


def test_another_exponent_is_as_deep_at_a_typical_force(known, hidden):
    broken = hidden_machine(known, 3, "contact exponent 1.5")
    for true, plain in zip(broken.machine.touchdown_bearings, hidden.machine.touchdown_bearings, strict=True):
        typical = 5.0 * 0.5 * 9.81 * known.rotor.mass
        depths = [
            (typical / float(b.contact.stiffness)) ** (1 / float(b.contact.exponent)) for b in (true, plain)
        ]
        assert float(true.contact.exponent) == 1.5
        assert depths[0] == pytest.approx(depths[1], rel=1e-12)


def test_violations_of_the_sensors_leave_the_machine_alone(known, hidden):
    for name in ("sensor planes 30 mm off", "anti-alias filter", "none"):
        assert machine_truth(hidden_machine(known, 3, name).machine) == machine_truth(hidden.machine)
    assert VIOLATIONS["sensor planes 30 mm off"] == Violations.model_validate(
        {"sensors": {"plane_shift": "30 mm"}}
    )


def test_an_unknown_violation_names_those_there_are(known):
    with pytest.raises(
        UsageError, match="unknown violation 'moon'; choose one of 'none', 'contact stiffness"
    ):
        hidden_machine(known, 3, "moon")


def test_conditions_of_drops_differ_within_their_limits(hidden):
    drawn = [drop_conditions(hidden, 400.0, seed) for seed in range(30)]
    assert len({c.start.rotor_angle for c in drawn}) == 30
    assert all(abs(c.jitter) <= LARGEST_JITTER for c in drawn)
    assert (
        max(c.jitter for c in drawn)
        > 0.5 * LARGEST_JITTER
        > -0.5 * LARGEST_JITTER
        > min(c.jitter for c in drawn)
    )
    for c in drawn:
        assert np.all(np.abs(c.start.orbit) <= LARGEST_ORBIT)
        assert np.all(c.start.remanent_force[:, 1] > 0.0)
        assert np.all(c.start.remanent_force[:, 1] < 0.31 * hidden.machine.rotor.mass * 9.81 / 2)
    assert drop_conditions(hidden, 400.0, 1).start.rotor_angle == drawn[1].start.rotor_angle
    assert drop_conditions(hidden, 400.0, 1, jitter=False).jitter == 0.0


def test_a_drop_at_standstill_is_refused(hidden):
    with pytest.raises(UsageError, match="a drop at 0 rad/s cannot be synthesized"):
        drop_conditions(hidden, 0.0, 1)
