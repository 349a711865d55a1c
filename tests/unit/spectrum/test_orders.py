"""Order tracking reads a falling 1X, and resonances on the way down are found and named."""

import numpy as np
import pytest
from tests.unit.spectrum.synthetic import TURN, CoastDown

from rotordrop.errors import RecordError, UsageError
from rotordrop.spectrum.candidates import mains_candidates, mode_candidate
from rotordrop.spectrum.orders import find_resonances, track_orders, tracking_for
from rotordrop.spectrum.speed import FrequencyPath, exact_speed_profile
from rotordrop.spectrum.waterfall import waterfalls


def chirp(**options):
    """1X that grows with the square of the speed on top of a constant runout, and 2X."""
    down = CoastDown(duration=20.0, time_constant=5.9, **options)

    def amplitude(time):
        return 20e-6 * np.exp(-2.0 * np.asarray(time) / 5.9) + 2e-6

    a = amplitude(down.time)
    down.xy += np.column_stack([a * np.cos(down.angle + 0.3), 0.7 * a * np.sin(down.angle + 0.5)])
    down.xy += 1e-6 * np.column_stack([np.cos(2.0 * down.angle), np.sin(2.0 * down.angle)])
    return down, amplitude


def steady(frequency):
    return FrequencyPath(time=np.zeros(1), frequency=np.array([frequency]))


def off(track, amplitude):
    return np.abs(track.amplitude[:, 0, 0]) / amplitude(track.time) - 1.0


def test_exact_speed_gives_the_amplitude_within_a_thousandth():
    down, amplitude = chirp(noise=0.0)
    track = down.tracked()
    assert len(track.time) > 50
    assert np.abs(off(track, amplitude)).max() < 1e-3
    assert np.abs(np.abs(track.amplitude[:, 1, 1]) / 1e-6 - 1.0).max() < 1e-3


@pytest.mark.parametrize("seed", range(4))
def test_recorded_speed_gives_the_amplitude_within_a_hundredth(seed):
    down, amplitude = chirp(noise=0.0, seed=seed)
    track = down.tracked(down.recorded(noise=0.05, step=0.1))
    assert np.abs(off(track, amplitude)).max() < 1e-2


def test_tracking_has_phase_and_direction_and_no_smear():
    down, amplitude = chirp(noise=0.0)
    (frames,) = waterfalls(down.xy, down.sampling_rate, components=("x",))
    assert frames.points == 32768  # 13 s at this sampling rate: the smear is drastic
    assert frames.amplitude[0, frames.frequency > 30.0].max() < 0.25 * amplitude(3.0)
    track = down.tracked()
    row = np.argmin(np.abs(track.time - 3.0))
    assert np.abs(track.amplitude[row, 0, 0]) == pytest.approx(amplitude(track.time[row]), rel=1e-3)
    down = CoastDown(duration=10.0, noise=0.0)
    down.xy += 3e-6 * np.column_stack([np.cos(down.angle - 0.4), np.sin(down.angle - 0.4)])
    down.xy += 1e-6 * np.column_stack([np.cos(down.angle + 1.1), -np.sin(down.angle + 1.1)])
    track = down.tracked(orders=(1.0,))
    assert track.forward[:, 0] == pytest.approx(np.full(len(track.time), 3e-6), rel=1e-3)
    assert track.backward[:, 0] == pytest.approx(np.full(len(track.time), 1e-6), rel=1e-3)
    assert track.major_axis[:, 0] == pytest.approx(np.full(len(track.time), 4e-6), rel=1e-3)
    turning = track.amplitude[:, 0, 0] + 1j * track.amplitude[:, 0, 1]
    assert np.angle(turning) == pytest.approx(np.full(len(track.time), -0.4), abs=1e-3)


def test_steady_lines_are_explained_and_followed():
    down, amplitude = chirp(noise=0.0)
    down.xy[:, 0] += 80e-6 * np.cos(TURN * 29.03 * down.time)
    known = down.tracked(orders=(1.0,), steady_lines=[steady(29.03)])
    error = off(known, amplitude)
    apart = known.separable[:, 0]
    assert 0.5 < apart.mean() < 1.0
    assert np.abs(error[apart]).max() < 5e-3
    unknown = down.tracked(orders=(1.0,))
    assert np.abs(off(unknown, amplitude)).max() > 1.0
    down, amplitude = chirp(noise=0.0)
    frequency = 29.3 - 0.6 * np.exp(-down.time / 5.0)
    phase = TURN * np.cumsum(frequency) / down.sampling_rate
    down.xy[:, 0] += 80e-6 * np.cos(phase)
    path = FrequencyPath(time=down.time[::50], frequency=frequency[::50])
    found = down.tracked(orders=(1.0,), steady_lines=[path])
    error = off(found, amplitude)
    assert np.abs(error[found.separable[:, 0]]).max() < 1e-2


def test_a_steady_line_on_an_order_counts_with_it():
    """Where the two cannot be told apart both are the order's amplitude, and the track says so."""
    down = CoastDown(duration=20.0, first_speed=30.0, time_constant=1e9, noise=0.05e-6)
    down.xy += 5e-6 * np.column_stack([np.cos(down.angle), np.sin(down.angle)])
    down.xy += 3e-6 * np.cos(TURN * 30.0 * down.time)[:, None]
    lines = [steady(30.0)]
    track = down.tracked(orders=(1.0,), steady_lines=lines)
    assert not track.separable.any()
    assert np.abs(track.amplitude[:, 0, 0]) == pytest.approx(np.full(len(track.time), 8e-6), rel=0.01)
    assert np.abs(track.amplitude[:, 0, 1]) == pytest.approx(np.full(len(track.time), 34e-12**0.5), rel=0.01)
    assert np.all(track.standard_error < 0.05e-6)


def test_close_orders_need_turns_and_errors_are_the_scatter(monkeypatch):
    down, _ = chirp(noise=1e-6, seed=5)
    truth, _ = chirp(noise=0.0)
    found = down.tracked(orders=(1.0, 2.0))
    clean = truth.tracked(orders=(1.0, 2.0))
    ratio = (np.abs(found.amplitude) - np.abs(clean.amplitude)) / found.standard_error
    assert 0.8 < np.sqrt(np.mean(ratio**2)) < 1.25
    monkeypatch.setattr("rotordrop.spectrum.orders.LONGEST_WINDOW", 1.0)
    whole = truth.tracked(orders=(1.0, 2.0))
    halves = truth.tracked(orders=(0.5, 1.0, 1.5))
    assert halves.speed.min() > whole.speed.min()
    assert (halves.window * halves.speed / TURN).min() >= 6.0 - 1e-9


@pytest.mark.parametrize(
    ("turns", "orders", "revolutions"),
    [
        (60.0, (0.5, 1.0, 2.0), 24.0),
        (40.0, (0.5, 1.0, 2.0), 12.0),
        (7.0, (0.5, 1.0, 2.0), 6.0),
        (5.0, (1.0, 2.0), 4.0),
    ],
)
def test_a_short_signal_is_tracked_over_fewer_turns(turns, orders, revolutions):
    down = CoastDown(duration=turns / 60.0, sampling_rate=5000.0, noise=0.0)
    down.xy += 3e-6 * np.column_stack([np.cos(down.angle), np.sin(down.angle)])
    turned = float(down.angle[-1] - down.angle[0]) / TURN
    assert tracking_for(turned, (0.5, 1.0, 2.0)) == (orders, revolutions)
    track = down.tracked(orders=orders, revolutions=revolutions)
    assert track.revolutions == revolutions and len(track.time) >= 2
    assert track.major_axis[:, track.of(1.0)] == pytest.approx(np.full(len(track.time), 3e-6), rel=5e-3)
    with pytest.raises(RecordError, match="no whole window of 24 turns"):
        track_orders(down.xy[: int(20.0 / 60.0 * 5000.0)], down.sampling_rate, down.exact())


def test_wrong_calls_are_refused():
    down, _ = chirp(noise=0.0)
    with pytest.raises(UsageError, match=r"orders \[-1\.0\] given"):
        down.tracked(orders=(-1.0,))
    slow = exact_speed_profile(np.arange(10.0), np.full(10, 0.1))
    with pytest.raises(RecordError, match="holds no whole window"):
        track_orders(down.xy, down.sampling_rate, slow)
    with pytest.raises(UsageError, match=r"order 3X was not tracked; tracked are 1X"):
        down.tracked(orders=(1.0,)).of(3.0)


MODES = (mode_candidate("first bending", 35.5, 2.0), mode_candidate("second bending", 71.0, 3.0))


def passing(natural=36.0, damping=0.1, order=1.0, seed=0):
    down = CoastDown(duration=30.0, noise=0.1e-6, seed=seed)
    ratio = order * down.speed / TURN / natural
    amplitude = 1e-6 / np.hypot(1.0 - ratio**2, 2.0 * damping * ratio)
    down.xy += np.column_stack(
        [amplitude * np.cos(order * down.angle), 0.5 * amplitude * np.sin(order * down.angle)]
    )
    return down


@pytest.mark.parametrize("seed", range(3))
def test_a_resonance_is_found_where_the_response_is_highest(seed):
    down = passing(seed=seed)
    track = down.tracked(down.recorded(), orders=(1.0, 2.0))
    found = find_resonances(track, "DE", candidates=MODES)
    assert len(found) == 1
    assert found[0].order == 1.0 and found[0].certain
    assert abs(found[0].frequency - 36.0) < min(1.0, found[0].frequency_error)
    assert found[0].name.label == "first bending"
    assert found[0].amplitude == pytest.approx(5.025e-6, rel=0.01)


def test_another_order_excites_its_own_mode_and_one_not_on_the_list_stays_unnamed():
    down = passing(natural=70.5, order=2.0)
    found = find_resonances(down.tracked(orders=(1.0, 2.0)), "DE", candidates=MODES)
    assert [(r.order, r.name.label) for r in found] == [(2.0, "second bending")]
    assert found[0].speed / TURN == pytest.approx(35.25, abs=0.5)
    down = passing(natural=25.0)
    track = down.tracked(orders=(1.0,))
    found = find_resonances(track, "DE", candidates=(*MODES, *mains_candidates()))
    assert len(found) == 1 and not found[0].name.named


def test_runout_unbalance_and_a_strong_steady_line_are_no_resonance():
    down = CoastDown(duration=30.0)
    down.add_order(1.0, 5e-6, growth=2.0)
    down.add_order(2.0, 0.3e-6)
    track = down.tracked(down.recorded())
    assert find_resonances(track, "DE", candidates=MODES) == ()
    down = CoastDown(duration=30.0)
    down.add_order(1.0, 0.5e-6)
    down.xy[:, 0] += 80e-6 * np.cos(TURN * 29.0 * down.time)
    track = down.tracked(down.recorded(), steady_lines=[steady(29.0)])
    assert not track.separable.all()
    assert find_resonances(track, "DE", candidates=MODES) == ()


def test_a_resonance_whose_top_is_hidden_is_uncertain():
    down = passing(natural=29.0, damping=0.1)
    down.xy[:, 0] += 80e-6 * np.cos(TURN * 29.0 * down.time)
    track = down.tracked(down.recorded(), orders=(1.0,), steady_lines=[steady(29.0)])
    found = find_resonances(track, "DE", candidates=MODES)
    assert len(found) == 1
    assert not found[0].certain
    assert found[0].amplitude < 1e-6 * 1.5 / (2.0 * 0.1)
    assert abs(found[0].frequency - 29.0) < found[0].frequency_error
    assert found[0].as_json()["certain"] is False
