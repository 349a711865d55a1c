"""Machines of several sizes, each known as after a calibration: right within intervals of the right width.

One seed shows a wrong value; whether an interval is honest shows only over several. Every machine is drawn
around its description, and its owner's estimates are off by their standard errors, drawn too.
"""

import math
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom
from tests.bank import calibrated_about

from rotordrop import Machine, Tracked, estimate_drop, example_machine, load_machine
from rotordrop.estimate.document import estimate_document
from rotordrop_bench import hidden_machine, synthesize_drop

HEAVY = Path(__file__).parents[2] / "machines" / "long_rotor.toml"
SPEEDS = {"small": 300.0, "paper": 100.0, "heavy": 130.0}
"""Speed at power-off [Hz] of a rotor of 13 kg, the paper's, and a long one of 130 kg with three planes."""

SEEDS = (11, 12)
ERRORS = {"peak_force_N": 0.015, "peak_stress_Pa": 0.006, "mean_force_0p15_0p2_N": 0.006}
"""Largest root mean square of the relative errors over all machines, bearings and seeds [1]."""

PARAMETERS = ("support.stiffness", "support.mass", "air_gap")
HALF_WIDTHS = {
    "small": {"peak_force_N": 0.028, "peak_stress_Pa": 0.010, "support.stiffness": 0.0103},
    "paper": {"peak_force_N": 0.027, "peak_stress_Pa": 0.010, "support.stiffness": 0.0117},
    "heavy": {"peak_force_N": 0.038, "peak_stress_Pa": 0.0137, "support.stiffness": 0.008},
}
"""Half of a 90 % interval over its value [1], geometric mean over bearings and seeds: what the filter does
not know of the drop, and what every model leaves out (0.6 % of a force, 0.2 % of a stress)."""

HALF_WIDTH_LIMIT = 1.25
"""Factor up or down: intervals that a check doubles are 2, or as wide as the prior."""


@dataclass(frozen=True, kw_only=True)
class Number:
    """One number of one estimate against the truth."""

    machine: str
    field: str
    error: float
    half_width: float
    covered: bool


def numbers_of(name, seed):
    known: Machine = load_machine(HEAVY) if name == "heavy" else example_machine(name)
    hidden = hidden_machine(known, seed)
    speed = 2.0 * math.pi * SPEEDS[name]
    drop = synthesize_drop(hidden, speed, 10 * seed, duration=0.22, tolerance=1e-7)
    machine = calibrated_about(known, hidden, seed, 1.0)
    estimate = estimate_drop(machine, drop.record, drop.tail, method=Tracked(quick=True))
    written = estimate_document(estimate)
    assert written["consistency"]["consistent"], (name, seed, written["consistency"])
    parameters = {entry["path"]: entry["estimate"] for entry in written["parameters"]}
    found = []
    for bearing in hidden.machine.touchdown_bearings:
        loads = {field: drop.truth[field][bearing.name] for field in ERRORS}
        values = {path: float(attrgetter(path)(bearing)) for path in PARAMETERS}
        for field, true in {**loads, **values}.items():
            own = f"{bearing.name}.{field}"
            entry = written["bearings"][bearing.name][field] if field in loads else parameters[own]
            (low, high), value = entry["interval_90"], entry["value"]
            half, held = 0.5 * (high - low) / value, low <= true <= high
            found.append(
                Number(machine=name, field=field, error=value / true - 1.0, half_width=half, covered=held)
            )
    return found


@pytest.fixture(scope="module")
def numbers():
    return [number for name in SPEEDS for seed in SEEDS for number in numbers_of(name, seed)]


@pytest.mark.slow
def test_loads_are_right_on_every_machine(numbers):
    for field, limit in ERRORS.items():
        errors = [number.error for number in numbers if number.field == field]
        assert len(errors) == 2 * len(SPEEDS) * len(SEEDS)
        assert np.sqrt(np.mean(np.square(errors))) < limit, (field, errors)


@pytest.mark.slow
def test_no_more_intervals_miss_than_one_in_ten_would(numbers):
    """Binomial bound at 1 in 1000, counted per estimate and field: the bearings of a drop err together."""
    missed = [number for number in numbers if not number.covered]
    assert len(missed) <= binom.ppf(0.999, len(numbers) // 2, 0.1), missed


@pytest.mark.slow
@pytest.mark.parametrize("name", SPEEDS)
def test_intervals_are_neither_wider_nor_narrower_than_they_should_be(name, numbers):
    for field, expected in HALF_WIDTHS[name].items():
        widths = [n.half_width for n in numbers if n.machine == name and n.field == field]
        mean = math.exp(np.mean(np.log(widths)))
        assert expected / HALF_WIDTH_LIMIT < mean < expected * HALF_WIDTH_LIMIT, (field, widths)
