"""A coast-down taken apart: what its document says is what was put in."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.spectrum.synthetic import TURN, CoastDown

from rotordrop.report.waterfall_figure import waterfall_figure
from rotordrop.report.waterfall_page import waterfall_page
from rotordrop.spectrum.candidates import order_candidates
from rotordrop.spectrum.coast_down import CoastDownAnalysis, CoastDownSignal, analyse_coast_down
from rotordrop.spectrum.speed_profile import exact_speed_profile

AMPLITUDES = {0.5: 1.5e-6, 1.0: 6e-6, 1.5: 2e-6, 2.0: 4e-6, 2.5: 3e-6, 3.0: 2.5e-6}
TIME_CONSTANT = 15.0


@pytest.fixture(scope="module")
def analysis() -> CoastDownAnalysis:
    down = CoastDown(sampling_rate=1000.0, duration=25.0, time_constant=TIME_CONSTANT, noise=0.1e-6)
    for order, amplitude in AMPLITUDES.items():
        down.add_order(order, amplitude)
    speed = down.speed[::50]
    signal = CoastDownSignal(
        planes={"DE": down.xy},
        air_gap={"DE": 285e-6},
        sampling_rate=down.sampling_rate,
        start_time=0.0,
        profile=down.exact(),
        speed_time=down.time[::50],
        speed=speed,
        recorded=True,
    )
    return analyse_coast_down(signal, order_candidates())


def test_every_order_to_three_is_followed_halves_included(analysis: CoastDownAnalysis) -> None:
    track = analysis.planes["DE"].track
    assert track is not None
    assert track.orders == pytest.approx(list(AMPLITUDES))
    for order, amplitude in AMPLITUDES.items():
        read = track.major_axis[:, track.of(order)]
        assert np.median(read) == pytest.approx(amplitude, rel=0.02), order


def test_the_card_claims_no_lasting_contact_beside_shorter_hops(analysis: CoastDownAnalysis) -> None:
    labels = [one.label for one in waterfall_page(analysis, title="hops", drawn=False).cards[0].figures]
    assert "Mostly in contact from" in labels and "In contact from" not in labels


def test_the_speeds_a_record_covers_are_said_first(analysis: CoastDownAnalysis) -> None:
    """Of a record that ends turning it was said that the first 0.2 s held the maximum, and no more."""
    first = waterfall_page(analysis, title="ends").verdict[0]
    ends = analysis.signal.profile.speed_at(25.0) / TURN
    assert first.level == "warning" and f" to {ends:.2f} Hz" in first.text
    assert first.text.startswith("The record covers the 25.0 s after power-off, from ")
    assert "ends before standstill" in first.text
    time = np.linspace(0.0, 40.0, 41)
    down = exact_speed_profile(time, np.maximum(400.0 - 20.0 * time, 0.0))
    stopped = replace(analysis.signal, profile=down)
    first = waterfall_page(replace(analysis, signal=stopped), title="stands").verdict[0]
    assert first.level == "notice" and first.text.endswith(" to standstill.")


def test_the_name_of_an_order_at_the_right_edge_stands_within(analysis: CoastDownAnalysis) -> None:
    fall = next(one for one in analysis.planes["DE"].waterfalls if one.component == "x")
    top = 2.5 * float(fall.speed.max()) / TURN  # the third order comes in from the right
    figure = waterfall_figure(fall, "DE", highest=top)
    anchors = {one.text: one.xanchor for one in figure.layout.annotations if one.text.endswith("X")}
    assert anchors == {"0.5X": "left", "1X": "left", "2X": "left", "3X": "right"}


def test_the_document_holds_the_numbers_put_in(analysis: CoastDownAnalysis) -> None:
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


def test_a_signal_of_a_few_turns_says_what_its_orders_cannot_tell() -> None:
    down = CoastDown(sampling_rate=5000.0, duration=0.3, noise=0.1e-6)
    down.xy += 20e-6 * np.column_stack([np.cos(down.angle), np.sin(down.angle)])
    signal = CoastDownSignal(
        planes={"DE": down.xy},
        air_gap={"DE": 285e-6},
        sampling_rate=5000.0,
        start_time=0.0,
        profile=down.exact(),
        speed_time=down.time,
        speed=down.speed,
        recorded=True,
    )
    found = analyse_coast_down(signal, ())
    assert found.as_json()["planes"]["DE"]["orders"]["turns_per_window"] == 6.0
    page = waterfall_page(found, title="short")
    (section,) = (one for one in page.sections if one.heading == "Orders and resonances")
    assert any("over 6 turns in place of 24" in said.text for said in section.statements)


def test_without_speed_nothing_is_said_of_orders() -> None:
    down = CoastDown(sampling_rate=1000.0, duration=10.0, noise=0.1e-6)
    down.xy[:, 0] += 5e-6 * np.cos(TURN * 40.0 * down.time)
    signal = CoastDownSignal(
        planes={"DE": down.xy},
        air_gap={"DE": 285e-6},
        sampling_rate=1000.0,
        start_time=0.0,
        profile=None,
        speed_time=None,
        speed=None,
        recorded=True,
    )
    found = analyse_coast_down(signal, ())
    written = found.as_json()
    assert found.planes["DE"].track is None and "orders" not in written["planes"]["DE"]
    assert written["speed_law"] is None
    (line,) = found.lines
    assert line.frequency == pytest.approx(40.0, abs=0.02)
