"""A coast-down taken apart: what its document says is what was put in; displacement over it."""

import json

import numpy as np
import pytest
from tests.unit.spectrum.synthetic import TURN, CoastDown

from rotordrop.errors import RecordError
from rotordrop.evidence.impacts import shortest_flight
from rotordrop.report.waterfall_page import bode_figure, polar_figure, waterfall_figure
from rotordrop.spectrum.candidates import order_candidates
from rotordrop.spectrum.coast_down import (
    BLOCK,
    analyse_coast_down,
    displacement_history,
    find_settling,
)
from rotordrop.units import GRAVITY

AMPLITUDES = {0.5: 1.5e-6, 1.0: 6e-6, 1.5: 2e-6, 2.0: 4e-6, 2.5: 3e-6, 3.0: 2.5e-6}
TIME_CONSTANT = 15.0


@pytest.fixture(scope="module")
def analysis():
    down = CoastDown(sampling_rate=1000.0, duration=25.0, time_constant=TIME_CONSTANT, noise=0.1e-6)
    for order, amplitude in AMPLITUDES.items():
        down.add_order(order, amplitude)
    signal = down.signal(speed_time=down.time[::50], speed=down.speed[::50])
    return analyse_coast_down(signal, order_candidates())


def test_every_order_to_three_is_followed_halves_included(analysis):
    track = analysis.planes["DE"].track
    assert track is not None
    assert track.orders == pytest.approx(list(AMPLITUDES))
    for order, amplitude in AMPLITUDES.items():
        read = track.major_axis[:, track.of(order)]
        assert np.median(read) == pytest.approx(amplitude, rel=0.02), order


def test_the_name_of_an_order_at_the_right_edge_stands_within(analysis):
    fall = next(one for one in analysis.planes["DE"].waterfalls if one.component == "x")
    top = 2.5 * float(fall.speed.max()) / TURN  # the third order comes in from the right
    figure = waterfall_figure(fall, "DE", highest=top)
    anchors = {one.text: one.xanchor for one in figure.layout.annotations if one.text.endswith("X")}
    assert anchors == {"0.5X": "left", "1X": "left", "2X": "left", "3X": "right"}


def test_the_document_holds_the_numbers_put_in(analysis):
    found = json.loads(json.dumps(analysis.as_json(), allow_nan=False))
    assert found["recorded"] is True and found["sampling_rate_hz"] == 1000.0
    law = found["speed_law"]
    assert law["time_constant_s"]["value"] == pytest.approx(TIME_CONSTANT, rel=1e-4)
    assert law["linear_1_s"]["value"] == pytest.approx(1.0 / TIME_CONSTANT, rel=1e-2)
    plane = found["planes"]["DE"]
    largest = float(np.max(np.hypot(*analysis.signal.planes["DE"][:].T)))
    assert plane["largest_displacement_m"] == pytest.approx(largest, rel=1e-12)
    assert plane["largest_indentation_m"] == pytest.approx(largest - 285e-6, abs=1e-15)
    orders, track = plane["orders"], analysis.planes["DE"].track
    assert track is not None
    assert np.shape(orders["major_axis_zero_to_peak_m"]) == (len(orders["time_s"]), len(AMPLITUDES))
    expected = 60.0 * np.exp(-np.array(orders["time_s"]) / TIME_CONSTANT)
    assert orders["speed_hz"] == pytest.approx(expected, rel=1e-4)
    lines = {round(line["order"], 3) for line in found["lines"] if line["order"] is not None}
    assert lines == set(AMPLITUDES)
    for fall in plane["waterfalls"]:
        assert len(fall["frequency_hz"]) == len(fall["rms_over_frames_m"])
        assert fall["resolution_hz"] == pytest.approx(1000.0 / fall["points"])


def test_bode_and_polar_plots_draw_the_vectors_put_in():
    down = CoastDown(sampling_rate=1000.0, duration=10.0, noise=0.05e-6)
    put = {"x": 3e-6 * np.exp(0.7j), "y": 2e-6 * np.exp(-1.1j)}
    down.xy += np.column_stack([(one * np.exp(1j * down.angle)).real for one in put.values()])
    track = down.tracked(orders=(1.0, 2.0))
    bode, polar = bode_figure(track, "DE"), polar_figure(track, "DE")
    for name, vector in put.items():
        amplitude, phase = (one for one in bode.data if one.name == name and one.xaxis in ("x", "x3"))
        assert np.median(amplitude.y) == pytest.approx(1e6 * abs(vector), rel=0.01)
        assert np.median(phase.y) == pytest.approx(np.degrees(np.angle(vector)), abs=1.0)
        ends, twice = (one for one in polar.data if one.name == name)
        assert np.median(ends.x) == pytest.approx(1e6 * vector.real, rel=0.02)
        assert np.median(ends.y) == pytest.approx(1e6 * vector.imag, rel=0.02)
        assert np.abs([twice.x, twice.y]).max() < 0.1  # nothing comes twice per turn
        assert next(text for text in ends.text if text) == f"{track.speed[0] / TURN:.0f}"


def test_without_speed_nothing_is_said_of_orders():
    down = CoastDown(sampling_rate=1000.0, duration=10.0, noise=0.1e-6)
    down.xy[:, 0] += 5e-6 * np.cos(TURN * 40.0 * down.time)
    found = analyse_coast_down(down.signal(profile=None, speed_time=None, speed=None), ())
    written = found.as_json()
    assert found.planes["DE"].track is None and "orders" not in written["planes"]["DE"]
    assert written["speed_law"] is None
    (line,) = found.lines
    assert line.frequency == pytest.approx(40.0, abs=0.02)


FS = 5000.0
GAP = 280e-6


def swing(duration=10.0, noise=0.0):
    """A rotor lying in the race and swinging; it never leaves the circle of the gap."""
    time = np.arange(int(duration * FS)) / FS
    angle = 0.3 * np.exp(-time / 5.0) * np.cos(2.0 * np.pi * 29.0 * time)
    xy = GAP * np.column_stack([np.sin(angle), -np.cos(angle)])
    return xy + noise * np.random.default_rng(0).standard_normal(xy.shape)


def test_maxima_are_found_early_and_late_and_told():
    xy = swing(noise=0.4e-6)
    xy[150] = [0.0, -GAP - 35e-6]
    found = displacement_history(xy, FS, air_gap=GAP)
    assert found.largest_time == pytest.approx(0.03)
    assert found.largest_indentation == pytest.approx(35e-6)
    assert found.held_maximum
    assert found.noise == pytest.approx(0.4e-6, rel=0.1)
    xy = swing()
    xy[30000] = [200e-6, -260e-6]
    found = displacement_history(xy, FS, air_gap=GAP, start_time=0.01, error=4e-6)
    assert found.largest_time == pytest.approx(6.01)
    assert found.largest_interval_90 == pytest.approx((321.4e-6, 334.6e-6), abs=0.1e-6)
    assert "at 6.01 s; until 0.2 s at most 85 % of it" in found.statement
    assert not found.held_maximum


def test_short_records_and_differences_within_the_noise_are_left_open_and_empty_ones_refused():
    xy = swing(noise=0.5e-6)
    found = displacement_history(xy, FS, air_gap=GAP)
    text = found.statement
    assert "leaves open" in text if found.largest_time <= 0.2 else "did not hold" in text
    found = displacement_history(swing(0.1), FS, air_gap=GAP)
    assert np.isnan(found.largest_later)
    with pytest.raises(RecordError, match="1 samples, at least 2"):
        displacement_history(np.zeros((1, 2)), FS, air_gap=GAP)


def test_envelope_holds_every_sample_once():
    xy = swing(noise=2e-6)
    radius = np.hypot(*xy.T)
    found = displacement_history(xy, FS, air_gap=GAP, intervals=300)
    assert 250 <= len(found.time) <= 300
    assert found.highest.max() == radius.max()
    assert found.lowest.min() == radius.min()
    assert found.lowest_xy.min(axis=0) == pytest.approx(xy.min(axis=0))
    per = -(-len(xy) // 300)
    assert found.highest[7] == radius[7 * per : 8 * per].max()


def bouncing(restitution, duration=8.0):
    """A mass that falls on a damped spring of 300 Hz: its path, and the times at which it lands [s]."""
    stiffness = (2.0 * np.pi * 300.0) ** 2
    share = -np.log(restitution) / np.hypot(np.pi, np.log(restitution))
    damping, steps = 2.0 * share * np.sqrt(stiffness), 10
    heights, landings = np.empty(int(duration * FS)), []
    height, velocity, touching = 0.0, 0.0, False
    for sample in range(len(heights)):
        heights[sample] = height
        for _ in range(steps):
            depth = -GAP - height
            push = max(stiffness * depth - damping * velocity, 0.0) if depth > 0.0 else 0.0
            if depth > 0.0 and not touching:
                landings.append(sample / FS)
            touching = depth > 0.0
            velocity += (push - GRAVITY) / (FS * steps)
            height += velocity / (FS * steps)
    return np.column_stack([np.full(len(heights), 1e-6), heights]), np.array(landings)


def after_flights(landings):
    """The landings that end a flight of a twentieth of the gap or more."""
    flown = np.diff(landings, prepend=-np.inf)
    return landings[flown > shortest_flight(GAP) + 2e-3]


def test_impacts_are_flights_that_end_and_contact_lasts_from_the_last():
    xy, landings = bouncing(0.6)
    xy += 0.2e-6 * np.random.default_rng(0).standard_normal(xy.shape)
    found = find_settling(xy, FS, air_gap=GAP, start_time=-0.1)
    assert len(landings) > len(after_flights(landings)) > 2
    assert found.touched == pytest.approx(after_flights(landings) - 0.1, abs=0.7e-3)
    assert found.contact_from == found.touched[-1]
    low, high = found.count_interval_90
    assert low <= len(after_flights(landings)) <= high
    assert found.contact_from_interval_90 is not None
    early, late = found.contact_from_interval_90
    assert early < after_flights(landings)[-1] - 0.1 < late


def test_late_impacts_count_and_rotors_that_hop_do_not_settle():
    """Read in blocks: a hop in the third of them is an impact, and lying on the race in between is none."""
    one, landings = bouncing(0.6, 1.0)
    once = after_flights(landings)
    late = int((once[0] + 2e-3) * FS)
    xy = np.tile(one[-1], (35 * int(FS), 1))
    xy[: len(one)] = one
    xy[2 * BLOCK + 1000 :][: len(one) - late] = one[late:]
    found = find_settling(xy, FS, air_gap=GAP)
    again = (2 * BLOCK + 1000 - late) / FS + once[1:]
    assert found.touched == pytest.approx(np.concatenate([once, again]), abs=0.7e-3)
    xy, _ = bouncing(0.95, duration=0.25)
    found = find_settling(xy, FS, air_gap=GAP)
    assert len(found.touched) > 5
    assert found.contact_from is None
    assert found.contact_from_interval_90 is None
    assert len(find_settling(swing(noise=0.4e-6), FS, air_gap=GAP).touched) <= 1
