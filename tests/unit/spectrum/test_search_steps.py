"""Steps of the search for lines, each against what is known of its input."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm
from tests.unit.spectrum.synthetic import TURN, CoastDown, found_line

from rotordrop.known import Known
from rotordrop.machine import example_machine
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop.spectrum._search import BRIEF, LineSearch
from rotordrop.spectrum._views import BANDWIDTH, LOWEST_FREQUENCY, Clock, View
from rotordrop.spectrum.candidates import (
    LineEvidence,
    bearing_defect_candidates,
    density_of,
    mode_candidate,
    pendulum_candidate,
    settled_modes,
)
from rotordrop.spectrum.lines import MOST_LINES, SWING_ERROR, _joined, name_lines, of_swings
from rotordrop.spectrum.speed import inflation
from rotordrop.spectrum.waterfall import (
    FALSE_ALARM,
    FramePower,
    clearest_peak,
    half_power_width,
    waterfalls,
)


def search(signal, rate, profile=None):
    clock = Clock(len(signal), rate, profile, start_time=0.0, highest_frequency=450.0)
    return LineSearch(signal, clock, MOST_LINES)


@pytest.mark.parametrize("length", [0.25, 4.0])
@pytest.mark.parametrize(("kind", "widths"), [("steady", 2.0), ("order", None)])
def test_no_line_is_looked_for_where_one_was_taken_out(length, kind, widths):
    """A steady line blocks two widths of a frame or of the extraction, whichever is wider; an order that
    passes leaves what its strength leaves."""
    seeker = search(np.zeros((8000, 2)), 1000.0)
    place = np.arange(0.0, 200.0, 0.05)
    frames = {"time": np.array([2.0, 4.0]), "coordinate": place, "power": np.ones((2, len(place), 2))}
    view = View(**frames, of_orders=False, length=np.full(2, length), share=1.0)
    line = found_line(kind, 100.0, seeker._clock.time, ratio=1e4)
    seeker.found = [line]
    free = seeker._free(view)
    blocked = place[~free[0] & (place > 50.0)]
    reach = max(BANDWIDTH, 1.0 / length) * (line.skirt if widths is None else widths)
    assert line.skirt == pytest.approx(3.5)
    assert (blocked[0], blocked[-1]) == pytest.approx((100.0 - reach, 100.0 + reach), abs=0.06)
    assert np.array_equal(free[0], free[1]) and not free[0][place < LOWEST_FREQUENCY].any()


def test_a_line_that_lasts_is_not_brief_and_a_late_burst_is():
    down = CoastDown(duration=20.0, noise=0.1e-6)
    down.xy[:, 0] += 2e-6 * np.cos(TURN * 134.2 * down.time)
    down.add_whirl(77.0, 100e-6, 15.0, 16.5)
    found = search(down.xy, down.sampling_rate).run()
    lasting = next(line for line in found if abs(line.frequency - 134.2) < 0.1)
    burst = next(line for line in found if abs(line.frequency - 77.0) < 0.5)
    assert not lasting.brief and lasting.last_seen - lasting.first_seen > BRIEF * 20.0
    assert burst.brief and 13.5 < burst.first_seen < 15.1
    for line in found:
        assert line.existence == 1.0 - FALSE_ALARM


@pytest.mark.parametrize(("steady", "multiple"), [(200.0, 1.0), (200.0, -2.0), (20.0, -1.0)])
def test_a_sum_or_difference_of_a_steady_line_and_an_order_is_found_on_its_path(steady, multiple):
    """As a bearing with play makes them; a difference below zero is seen at its positive frequency."""
    down = CoastDown(duration=14.0, time_constant=20.0, noise=0.05e-6)
    phase = TURN * steady * down.time + multiple * down.angle + 0.3
    down.xy[:, 0] += 3e-6 * np.cos(TURN * steady * down.time) + 0.5e-6 * np.cos(phase)
    found = down.lines()
    (line,) = (one for one in found if one.kind == "combination")
    path = np.abs(steady + multiple * down.speed / TURN)
    assert line.frequency == pytest.approx(path.mean(), rel=0.1)  # weighted by power
    assert line.path.frequency_at([7.0]) == pytest.approx(np.interp([7.0], down.time, path), rel=1e-3)
    assert path.min() - 0.1 < line.drift[0] < line.drift[1] < path.max() + 0.1
    assert line.amplitude == pytest.approx(0.5e-6, rel=0.2)
    partner = max((one for one in found if one.kind == "steady"), key=lambda one: one.amplitude)
    assert partner.frequency == pytest.approx(steady, abs=0.02)


def test_the_partner_of_a_sum_is_a_line_that_was_kept():
    """What swells a hundredfold for a third of the time is refused as a burst and found again as a line."""
    down = CoastDown(duration=14.0, time_constant=20.0, noise=0.05e-6)
    phase = TURN * 200.0 * down.time
    down.xy[:, 0] += 3e-6 * np.cos(phase) + 0.5e-6 * np.cos(phase + down.angle + 0.3)
    down.add_whirl(200.0, 300e-6, 3.0, 7.0)
    found = search(down.xy, down.sampling_rate, down.exact()).run()
    (line,) = (one for one in found if one.kind == "combination")
    assert line.parent in found
    names = [one.label for one in name_lines([("DE", one) for one in found], (), 285e-6, (450.0, 20.0))]
    assert names == ["forward whirl", "forward whirl + 1X"]


def test_a_line_in_the_last_quarter_alone_is_seen_in_its_stretch():
    dice = np.random.default_rng(5)
    power = dice.exponential(1e-16, size=(40, 400, 2))
    power[30:, 200, 1] = 4e-14
    frames = FramePower(time=np.arange(40.0), coordinate=np.arange(400.0), power=power)
    stretches = [(first, first + 10) for first in (0, 10, 20, 30)]
    allowed = np.ones((40, 400), dtype=np.bool_)
    peak = clearest_peak(frames, allowed, stretches)
    assert peak is not None
    assert (peak.first, peak.last, peak.channel) == (30, 40, 1)
    assert peak.coordinate == pytest.approx(200.0, abs=0.6)
    quiet = clearest_peak(frames, allowed, stretches[:3])
    assert quiet is None
    # where the noise is loudest, the line is not there: it stands above the floor by the frames that show it
    loudness = np.repeat([1.0, 20.0, 30.0], [12, 12, 16])[:, None]
    power[:, :, 1] = loudness * dice.exponential(1e-16, size=(40, 400))
    power[:24, 200, 1] = 4e-15 * loudness[:24, 0]
    peak = clearest_peak(frames, allowed, [(0, 40)])
    assert peak is not None and peak.coordinate == pytest.approx(200.0, abs=0.6)
    assert peak.ratio == pytest.approx(math.sqrt(40.0), rel=0.2)


@pytest.mark.parametrize("line", [1, 2, 3, 10])
def test_the_width_of_a_triangle_is_half_its_foot(line):
    """Linear between its lines, so exact wherever it stands; cut off at an edge, as wide as it is seen."""
    power = np.maximum(1.0 - np.abs(np.arange(20.0) - line) / 3.2, 0.0)
    left = min(1.6, line)
    assert half_power_width(power, line) == pytest.approx(left + 1.6)
    assert half_power_width(power[::-1], 19 - line) == pytest.approx(left + 1.6)


def test_a_harmonic_is_looked_for_where_the_swing_was_while_the_line_was_strong():
    """Weighted by power: at 10 Hz with three times the amplitude, as long at 20 Hz."""
    swing = SimpleNamespace(path=np.array([10.0] * 50 + [20.0] * 50), frequency_error=0.01)
    line = SimpleNamespace(power=np.repeat(np.float32([9e-12, 1e-12]), 50))
    first, *_ = of_swings(line, [("pendulum", swing), ("itself", line)])
    assert first.value == pytest.approx(2.0 * 11.0)
    assert first.tolerance >= 2.0 * SWING_ERROR
    silent = SimpleNamespace(power=np.zeros(100, dtype=np.float32))
    assert of_swings(silent, [("pendulum", swing)]) == []


def test_defect_frequencies_are_those_published_for_a_6205():
    """Nine balls, pitch 1.537 in, balls 0.3126 in: Case Western Reserve University, bearing data center."""
    published = {
        "cage": 0.39828,
        "outer-race defect": 3.5848,
        "inner-race defect": 5.4152,
        "ball defect": 4.7135,
    }
    balls = {"ball_count": 9, "ball_diameter": 0.3126, "pitch_diameter": 1.537, "contact_angle": 0.0}
    candidates = bearing_defect_candidates("DE", **balls, race_speed_ratio=(1.0, 1.0))
    found = {candidate.name: candidate for candidate in candidates}
    for what, value in published.items():
        assert found[f"DE {what}"].value == pytest.approx(value, rel=2e-3), what
    outer, inner = found["DE outer-race defect"].value, found["DE inner-race defect"].value
    assert outer + inner == pytest.approx(9.0)
    assert outer == pytest.approx(9.0 * found["DE cage"].value)


def test_residuals_that_follow_each_other_count_for_fewer():
    """Of a first-order process of correlation 0.6, one in four; independent or alternating ones all."""
    dice = np.random.default_rng(2)
    noise = dice.standard_normal(200_000)
    following = np.empty_like(noise)
    following[0] = noise[0]
    for k in range(1, len(noise)):
        following[k] = 0.6 * following[k - 1] + noise[k]
    assert inflation(following) == pytest.approx((1.0 + 0.6) / (1.0 - 0.6), rel=0.05)
    assert inflation(noise) == pytest.approx(1.0, abs=0.02)
    assert inflation(noise * (-1.0) ** np.arange(len(noise)) * 0.1 + (-1.0) ** np.arange(len(noise))) == 1.0
    assert inflation(np.zeros(5)) == 1.0


@pytest.mark.parametrize("offset", [-1.4, -0.9, 0.0, 0.3, 1.1])
def test_a_candidate_is_an_even_chance_within_its_tolerance_seen_through_the_error(offset):
    candidate = mode_candidate("mode", 100.0, 1.0)
    seen = {"kind": "steady", "frequency": 100.0 + offset, "frequency_error": 0.4, "order": 0.0}
    seen |= {"order_error": math.inf, "roundness": 0.0, "radius": 1e-6, "plane": "DE"}
    line = LineEvidence(**seen, band=400.0, order_band=20.0)
    expected = (norm.cdf((offset + 1.0) / 0.4) - norm.cdf((offset - 1.0) / 0.4)) / 2.0
    assert density_of(line, candidate) == pytest.approx(expected, rel=1e-9)


def test_the_average_over_frames_is_that_of_the_power():
    """Half of the frames at 3 µm, half at 4 µm."""
    rate, points = 20000.0, 2048
    time = np.arange(8 * points) / rate
    size = np.where(time < 4 * points / rate, 3e-6, 4e-6)
    phase = TURN * 50.0 * rate / points * time
    xy = size[:, None] * np.column_stack([np.cos(phase), np.sin(phase)])
    (found,) = waterfalls(xy, rate, components=("x",), points=points, overlap=0.0)
    assert found.amplitude.shape[0] == 8
    assert found.average()[50] == pytest.approx(math.sqrt(0.5 * (9.0 + 16.0)) * 1e-6, rel=1e-9)


def test_twice_a_swing_is_its_harmonic_in_a_record_too_short_to_decide():
    """In two seconds the speed hardly falls: no line is known to stand still, yet 57.4 Hz is 2 × 28.7 Hz."""
    time = np.arange(0.0, 2.0, 1e-3)
    turning = np.array([5e-5])
    strong = {"forward": turning, "backward": turning, "power": np.ones(len(time), np.float32)}
    swing, twice = (
        found_line("undecided", hertz, time, ratio=1e3, order=hertz / 60.0, order_error=0.003, **strong)
        for hertz in (28.7, 57.4)
    )
    known = (pendulum_candidate("pendulum", 28.3, 29.8),)
    bands = (450.0, 20.0)
    names = [line.label for line in name_lines([("DE", swing), ("DE", twice)], known, 285e-6, bands)]
    assert names == ["pendulum", "pendulum, harmonic 2"]
    ends = [pendulum_candidate(f"pendulum {end}", 28.3, 29.8, planes=[end]) for end in ("NDE", "DE")]
    seen = [("NDE", swing), ("DE", replace(swing, frequency=28.71)), ("DE", twice)]
    joined = _joined(name_lines(seen, ends, 285e-6, bands))  # both ends at one frequency: the rotor swings
    assert [line.label for line in joined] == ["pendulum NDE and DE", "pendulum, harmonic 2"]
    assert set(joined[0].forward) == {"NDE", "DE"}
    # in one plane, each known to 0.2 Hz or 0.0033 of the speed
    twins = [("DE", replace(swing, order=order, frequency_error=0.2)) for order in (0.480, 0.484, 0.488)]
    assert [line.order for line in _joined(name_lines(twins, (), None, bands))] == [0.480, 0.488]


def test_the_conical_swing_and_what_it_mixes_to_are_named_from_the_pendulum_found():
    """The small machine is stiff: its weight holds it as springs in the ratio of its loads."""
    machine = example_machine("small")
    (share,) = (one.value for one in settled_modes(machine) if one.of_swing)
    rotor = build_rotor_fe(machine)
    nodes = [one.node - 1 for one in machine.touchdown_bearings]
    left, right = np.abs(rotor.node_positions[nodes] - rotor.centre_of_gravity)
    rigid = math.sqrt(rotor.total_mass * left * right / rotor.diametral_inertia)
    assert share == pytest.approx(rigid, rel=0.02)
    time = np.arange(0.0, 20.0, 0.01)
    places = {
        "pendulum": 30.0,
        "conical swing": 30.0 * share,
        "pendulum + conical swing": 30.0 * (1.0 + share),
        "2 × conical swing − pendulum": 30.0 * (2.0 * share - 1.0),
        "conical swing − pendulum": 30.0 * (share - 1.0),
    }
    turning = np.array([5e-5])
    seen = [
        found_line("steady", hertz, time, forward=turning, backward=turning, power=np.ones(time.size))
        for hertz in places.values()
    ]
    known = (pendulum_candidate("pendulum", 29.0, 31.0), *settled_modes(machine))
    lines = name_lines([("DE", one) for one in seen], known, 285e-6, (450.0, 20.0))
    assert [line.label for line in lines] == list(places)


def test_modes_that_the_machine_leaves_wide_open_name_no_line():
    machine = example_machine("paper")
    assert any("mode" in one.name for one in settled_modes(machine))
    wide = Known(value=1e8, status="guess", range=(2e7, 5e8))
    ends = {f"{one.name}.support.stiffness": wide for one in machine.touchdown_bearings}
    left = {one.name for one in settled_modes(machine.with_values(ends))}
    assert not any("resonance" in name for name in left)
