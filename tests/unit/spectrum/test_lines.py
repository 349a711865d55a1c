"""Lines of synthetic coast-downs are found where they are and named rightly or not at all."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import binary_closing
from tests.unit.spectrum.synthetic import TURN, CoastDown, found_line

from rotordrop.errors import RecordError
from rotordrop.series import closed
from rotordrop.spectrum._views import path_range
from rotordrop.spectrum.candidates import (
    mains_candidates,
    mode_candidate,
    order_candidates,
    pendulum_candidate,
)
from rotordrop.spectrum.lines import find_lines
from rotordrop.spectrum.waterfall import median_of_known

AIR_GAP = 285e-6
KNOWN = (*order_candidates(), *mains_candidates(), pendulum_candidate("pendulum", 28.3, 29.8))


class Drawn:
    """A coast-down with lines drawn at random, and the truth about them."""

    def __init__(self, seed, *, unbalance, whirl):
        self.random = np.random.default_rng(1000 + seed)
        self.down = CoastDown(seed=seed)
        self.names = {}
        self.candidates = list(KNOWN)
        self._taken = [29, 58, 87, 116, 145, *range(50, 301, 50), *range(60, 361, 60)]
        floor = self.down.floor()
        growth = self.random.choice([0.0, 1.0, 2.0])
        self.down.add_order(1.0, unbalance * 10 ** self.random.uniform(-6.3, -5.0), growth=growth)
        for order in (0.5, 1.5, 2.0, 2.5, 3.0):
            if self.random.random() < 0.6:
                self.down.add_order(order, floor * 10 ** self.random.uniform(0.6, 2.2))
        self.swing = self.down.add_pendulum(28.7, 29.3, self.random.uniform(20e-6, 110e-6))
        self._steady(50.0 + self.random.uniform(-0.05, 0.05), 1.5, "mains hum 50 Hz")
        for k in range(3):
            frequency = self._free()
            off = frequency + self.random.uniform(-0.5, 0.5)
            self.candidates.append(mode_candidate(f"mode {k}", off, 1.0))
            self._steady(frequency, 2.5, f"mode {k}")
        for _ in range(2):
            self._steady(self._free(), 2.0, None)
        self.whirl = -92.0 + self.random.uniform(-4.0, 4.0) if whirl else None
        if self.whirl is not None:
            self.down.add_whirl(self.whirl, 250e-6, 0.3, 1.5)

    def _free(self):
        while True:
            frequency = self.random.uniform(12.0, 420.0)
            if min(abs(frequency - taken) for taken in self._taken) > 6.0:
                self._taken.append(frequency)
                return frequency

    def _steady(self, frequency, decades, name):
        amplitude = self.down.floor() * 10 ** self.random.uniform(0.6, decades)
        decay = self.random.choice([15.0, 40.0, math.inf])
        self.down.add_steady(frequency, amplitude, decay_time=decay)
        self.names[frequency] = name

    def truth(self):
        """Kind and place of every line above three times the floor."""
        least = 3.0 * self.down.floor()
        orders = [("order", k) for k, a in self.down.orders.items() if a >= least]
        return orders + [("steady", f) for f, a in self.down.steady.items() if a >= least]

    def search(self):
        return self.down.lines(self.down.recorded(), candidates=self.candidates, air_gap=AIR_GAP)

    def right_name(self, line):
        """Whether a name is true: it must belong to a line that is there."""
        for k in self.down.orders:
            if line.label == f"{k:g}X":
                return abs(line.order - k) <= 0.01 * k
        for frequency, name in self.names.items():
            if line.label == name:
                return abs(line.frequency - frequency) <= 0.5
        if line.label == "backward whirl":
            return self.whirl is not None and abs(line.frequency - abs(self.whirl)) <= 0.5
        harmonics = {"pendulum": 1, **{f"pendulum, harmonic {k}": k for k in range(2, 6)}}
        k = harmonics.get(line.label, 0)
        return k > 0 and abs(line.frequency - k * self.swing) <= 0.3 * k


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["usual", "8 times unbalance", "whirl"])
def test_lines_are_found_and_none_is_named_wrongly(kind):
    wanted = found = 0
    missed = []
    for seed in range(3):
        case = Drawn(seed, unbalance=8.0 if "8" in kind else 1.0, whirl=kind == "whirl")
        lines = case.search()
        for what, value in case.truth():
            near = 0.002 * value if what == "order" else 0.5
            seen = any(
                line.kind == what and abs((line.order if what == "order" else line.frequency) - value) <= near
                for line in lines
            )
            wanted, found = wanted + 1, found + seen
            missed += [] if seen else [(seed, what, value)]
        wrong = [(line.label, line.frequency) for line in lines if line.named and not case.right_name(line)]
        assert wrong == [], seed
        assert sum(line.label == "backward whirl" for line in lines) == (kind == "whirl")
    assert wanted > 20
    assert found >= 0.95 * wanted, missed


@pytest.fixture(scope="module")
def typical():
    down = CoastDown(seed=7)
    down.add_order(1.0, 4e-6, growth=2.0)
    down.add_order(1.5, 0.4e-6)
    down.add_pendulum(28.7, 29.3, 80e-6)
    down.add_steady(50.0, 0.1e-6)
    down.add_steady(134.2, 0.3e-6, decay_time=15.0)
    candidates = [*KNOWN, mode_candidate("bending mode 1", 133.0, 12.0)]
    lines = find_lines(
        {"DE": down.xy, "NDE": 0.5 * down.xy},
        down.sampling_rate,
        down.recorded(),
        candidates=candidates,
        air_gap=AIR_GAP,
        highest_frequency=450.0,
    )
    return down, lines


def named(lines, label):
    chosen = [line for line in lines if line.label == label]
    assert len(chosen) == 1, [line.label for line in lines]
    return chosen[0]


def test_amplitudes_drift_and_names_of_a_typical_coast_down(typical):
    _, lines = typical
    rub = named(lines, "1.5X")
    assert rub.amplitude_xy["DE"] == pytest.approx((0.4e-6, 0.28e-6), rel=0.05)
    assert rub.amplitude_xy["NDE"] == pytest.approx((0.2e-6, 0.14e-6), rel=0.05)
    assert rub.forward["DE"] == pytest.approx(0.34e-6, rel=0.05)
    assert rub.backward["DE"] == pytest.approx(0.06e-6, rel=0.3)
    swing = named(lines, "pendulum")
    assert 28.6 < swing.drift[0] < swing.drift[1] < 29.2
    assert swing.path.frequency_at([35.0]) == pytest.approx([29.11], abs=0.05)
    assert named(lines, "pendulum, harmonic 2").frequency == pytest.approx(2.0 * swing.frequency, abs=0.3)
    hum = named(lines, "mains hum 50 Hz")
    assert hum.frequency == pytest.approx(50.0, abs=0.01)
    assert hum.width < 0.5
    line = next(line for line in lines if abs(line.frequency - 134.2) < 0.5)
    assert not line.named
    assert line.label == "unnamed (bending mode 1?)"
    assert line.as_json()["candidates"][0]["name"] == "bending mode 1"


def test_an_order_that_passes_a_resonance_is_named_and_its_interval_holds_it():
    """Through a resonance the phase of 1X turns by half a turn, which moves its mean order."""
    down = CoastDown(first_speed=250.0, duration=8.0, time_constant=5.6, seed=1)
    r = down.speed / (TURN * 110.0)
    swing = 3e-6 * r**2 / (1.0 - r**2 + 0.06j * r) * np.exp(1j * down.angle)
    down.xy += np.column_stack([swing.real, swing.imag])
    down.add_order(2.0, 0.5e-6)
    lines = down.lines(down.recorded(noise=0.1), candidates=KNOWN, highest_frequency=600.0)
    assert [line.label for line in lines] == ["1X", "2X"]
    for order, line in enumerate(lines, start=1):
        assert abs(line.order - order) < 1.645 * line.order_error < 0.01


def test_constant_speed_leaves_the_kind_open_and_a_broad_line_is_not_called_hum():
    """Noise in a band about 50 Hz: something is there, but no power grid."""
    down = CoastDown(duration=8.0, time_constant=1e6, seed=3)
    down.add_order(1.0, 5e-6)
    lines = down.lines(candidates=KNOWN)
    line = max(lines, key=lambda one: one.amplitude)
    assert line.kind == "undecided"
    assert not line.named
    assert "1X" in line.label and "mains hum 60 Hz" in line.label
    down = CoastDown(seed=11)
    wander = np.cumsum(down.random.standard_normal(down.time.size)) * 0.04
    down.xy[:, 0] += 2e-6 * np.cos(2.0 * math.pi * 50.0 * down.time + wander)
    lines = down.lines(candidates=KNOWN)
    assert any(abs(line.frequency - 50.0) < 3.0 for line in lines)
    assert not any("mains" in line.label for line in lines if line.named)


def test_noise_and_brief_lines_are_told_as_what_they_are():
    for seed in range(3):
        down = CoastDown(seed=seed)
        assert down.lines() == ()
    with pytest.raises(RecordError, match="no plane given"):
        find_lines({}, 1000.0, None)
    # Frames beside it see no line; a line of the whole signal keeps its frequency to both ends.
    time = np.linspace(0.0, 40.0, 401)
    line = found_line("steady", 92.0, time, first_seen=5.0, last_seen=8.0, brief=True)
    at = np.array([3.9, 4.1, 6.0, 8.9, 9.1])
    assert line.frequency_at(at) == pytest.approx([np.inf, 92.0, 92.0, 92.0, np.inf])
    assert replace(line, brief=False).frequency_at(at) == pytest.approx(np.full(5, 92.0))
    unit = np.ones((3, 5))
    low, high = path_range(line, np.array([2.0, 6.5, 20.0]), np.full(3, 1.0), unit)
    assert low == pytest.approx([np.inf, 92.0, np.inf]) and high == pytest.approx([np.inf, 92.0, np.inf])


def test_medians_leave_out_what_is_unknown():
    values = np.random.default_rng(0).random((9, 50, 2))
    values[values < 0.4] = np.nan
    assert median_of_known(values) == pytest.approx(np.nanmedian(values, axis=0), nan_ok=True)


@pytest.mark.parametrize("gap", [1, 2, 7, 40])
def test_gaps_are_closed_as_a_morphological_closing_does(gap):
    random = np.random.default_rng(gap)
    for share in (0.02, 0.3, 0.7, 0.98):
        mask = random.random(500) < share
        padded = binary_closing(np.pad(mask, gap), np.ones(gap, dtype=np.bool_))[gap:-gap] | mask
        np.testing.assert_array_equal(closed(mask, gap), padded)
