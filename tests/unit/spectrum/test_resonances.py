"""Resonances on the way down: found where the response rises, named by mode, honest under steady lines."""

from __future__ import annotations

import numpy as np
import pytest
from tests.unit.spectrum.synthetic import TURN, CoastDown

from rotordrop.spectrum.candidates import mains_candidates, mode_candidate
from rotordrop.spectrum.frequency_path import steady_path
from rotordrop.spectrum.orders import track_orders
from rotordrop.spectrum.resonances import find_resonances

MODES = (mode_candidate("first bending", 35.5, 2.0), mode_candidate("second bending", 71.0, 3.0))


def response(frequency: np.ndarray, natural: float, damping: float) -> np.ndarray:
    ratio = frequency / natural
    return 1.0 / np.hypot(1.0 - ratio**2, 2.0 * damping * ratio)


def passing(natural: float = 36.0, damping: float = 0.1, order: float = 1.0, seed: int = 0) -> CoastDown:
    down = CoastDown(duration=30.0, noise=0.1e-6, seed=seed)
    amplitude = 1e-6 * response(order * down.speed / TURN, natural, damping)
    down.xy += np.column_stack(
        [amplitude * np.cos(order * down.angle), 0.5 * amplitude * np.sin(order * down.angle)]
    )
    return down


@pytest.mark.parametrize("seed", range(3))
def test_a_resonance_is_found_where_the_response_is_highest(seed):
    down = passing(seed=seed)
    track = track_orders(down.xy, down.sampling_rate, down.recorded(), orders=(1.0, 2.0))
    found = find_resonances(track, "DE", candidates=MODES)
    assert len(found) == 1
    assert found[0].order == 1.0 and found[0].certain
    assert abs(found[0].frequency - 36.0) < min(1.0, found[0].frequency_error)
    assert found[0].name.label == "first bending"
    assert found[0].amplitude == pytest.approx(5.025e-6, rel=0.01)


def test_second_order_excites_its_own_mode():
    down = passing(natural=70.5, order=2.0)
    found = find_resonances(
        track_orders(down.xy, down.sampling_rate, down.exact(), orders=(1.0, 2.0)), "DE", candidates=MODES
    )
    assert [(r.order, r.name.label) for r in found] == [(2.0, "second bending")]
    assert found[0].speed / TURN == pytest.approx(35.25, abs=0.5)


def test_a_mode_not_on_the_list_stays_unnamed():
    down = passing(natural=25.0)
    track = track_orders(down.xy, down.sampling_rate, down.exact(), orders=(1.0,))
    found = find_resonances(track, "DE", candidates=(*MODES, *mains_candidates()))
    assert len(found) == 1 and not found[0].name.named


def test_runout_and_unbalance_below_resonance_pass_none():
    down = CoastDown(duration=30.0)
    down.add_order(1.0, 5e-6, growth=2.0)
    down.add_order(2.0, 0.3e-6)
    track = track_orders(down.xy, down.sampling_rate, down.recorded())
    assert find_resonances(track, "DE", candidates=MODES) == ()


def test_crossing_a_strong_steady_line_is_no_resonance():
    down = CoastDown(duration=30.0)
    down.add_order(1.0, 0.5e-6)
    down.xy[:, 0] += 80e-6 * np.cos(TURN * 29.0 * down.time)
    track = track_orders(down.xy, down.sampling_rate, down.recorded(), steady_lines=[steady_path(29.0)])
    assert not track.separable.all()
    assert find_resonances(track, "DE", candidates=MODES) == ()


def test_a_resonance_whose_top_is_hidden_is_uncertain():
    down = passing(natural=29.0, damping=0.15)
    down.xy[:, 0] += 80e-6 * np.cos(TURN * 29.0 * down.time)
    track = track_orders(
        down.xy, down.sampling_rate, down.recorded(), orders=(1.0,), steady_lines=[steady_path(29.0)]
    )
    found = find_resonances(track, "DE", candidates=MODES, least_rise=1.2)
    assert len(found) == 1
    assert not found[0].certain
    assert found[0].amplitude < 1e-6 * 1.5 / (2.0 * 0.15)
    assert abs(found[0].frequency - 29.0) < found[0].frequency_error
    assert found[0].as_json()["certain"] is False
