"""Two orbits whose distances, contacts and bounces are known by construction."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from rotordrop.estimate.agreement import (
    AFTER_CONTACT,
    TENFOLD,
    compare_orbits,
    orbit_disagreement,
    spread_horizon,
)

GAP = 300e-6
times = np.arange(0.0, 0.2, 5e-5)
GAPS = np.array([GAP, GAP])


def orbit(contacts: tuple[tuple[float, float], ...], *, sideways: float = 0.0) -> Any:
    """Vertical motion that hangs at half the gap, and beyond the gap in the contacts; shape (T, 2)."""
    place = np.zeros((len(times), 2))
    place[:, 0], place[:, 1] = sideways, -0.5 * GAP
    for start, end in contacts:
        place[(times >= start) & (times <= end), 1] = -GAP - 10e-6
    return place


def test_every_window_has_the_distance_of_its_own_time() -> None:
    """3 µm apart before the first contact, 4 µm in it and until 2 ms later, 20 µm from there on."""
    measured = np.stack([orbit(((0.010, 0.012),)), orbit(((0.011, 0.015),))], axis=1)
    apart = np.where(times < 0.0099, 3e-6, np.where(times < 0.0171, 4e-6, 20e-6))
    simulated = measured + apart[:, None, None] * np.array([1.0, 0.0])
    found = {window.name: window for window in compare_orbits(times, measured, simulated, GAPS).windows}
    assert list(found) == ["first contact", "20 ms", "50 ms", "200 ms"]
    first = found["first contact"]
    assert (first.start, first.end) == pytest.approx((0.010, 0.015 + AFTER_CONTACT), abs=6e-5)
    assert first.rms == pytest.approx([4e-6, 4e-6], rel=1e-9)
    for name, end in (("20 ms", 0.02), ("50 ms", 0.05), ("200 ms", 0.2)):
        expected = np.sqrt(np.mean(apart[times <= end] ** 2))
        assert found[name].rms == pytest.approx([expected, expected], rel=1e-9), name
        assert found[name].end == pytest.approx(end, abs=1e-4)


def test_an_orbit_apart_sideways_and_in_height_is_apart_by_both() -> None:
    measured = np.stack([orbit(((0.01, 0.012),))] * 2, axis=1)
    simulated = measured + np.array([3e-6, 4e-6])
    found = compare_orbits(times, measured, simulated, GAPS)
    assert all(window.rms == pytest.approx([5e-6, 5e-6]) for window in found.windows)


def test_contacts_bounces_and_horizon_belong_to_their_orbit() -> None:
    measured = np.stack([orbit(((0.010, 0.012), (0.020, 0.022)))] * 2, axis=1)
    simulated = np.stack([orbit(((0.010, 0.012), (0.020, 0.022)))] * 2, axis=1)
    flight = (times > 0.0125) & (times < 0.0195)
    measured[flight, 0, 1] = -0.4 * GAP
    simulated[flight, 0, 1] = -0.45 * GAP
    simulated[times >= 0.030, 0, 0] = 0.2 * GAP  # a fifth of the gap apart: beyond the horizon
    simulated[(times >= 0.040) & (times <= 0.041), 0, 1] = -GAP - 10e-6
    near, other = compare_orbits(times, measured, simulated, GAPS).bearings
    assert near.measured_contacts == pytest.approx(np.array([[0.010, 0.012], [0.020, 0.022]]), abs=6e-5)
    assert near.simulated_contacts == pytest.approx(
        np.array([[0.010, 0.012], [0.020, 0.022], [0.040, 0.041]]), abs=6e-5
    )
    assert near.measured_bounce == pytest.approx(0.6 * GAP)
    assert near.simulated_bounce == pytest.approx(0.55 * GAP)
    assert near.horizon == pytest.approx(0.030, abs=1.1e-3)  # half of the running mean
    assert other.horizon == pytest.approx(times[-1])


def test_a_simulated_drop_is_compared_at_the_times_of_the_record() -> None:
    """The measured orbit touches once, the simulated one, on a grid of its own, twice."""
    fine = np.arange(0.0, 0.2, 1.25e-5)
    measured = np.stack([orbit(((0.010, 0.012),))] * 2, axis=1)
    simulated = np.stack([orbit(((0.010, 0.012), (0.050, 0.052)))] * 2, axis=1)
    columns = simulated.reshape(len(times), -1).T
    finer = np.column_stack([np.interp(fine, times, column) for column in columns]).reshape(-1, 2, 2)
    found = compare_orbits(times, measured, finer, GAPS, at=fine)
    for one in found.bearings:
        assert (len(one.measured_contacts), len(one.simulated_contacts)) == (1, 2)
    assert found.expected_horizon is None


def test_draws_say_up_to_when_two_drops_can_be_compared() -> None:
    spread = np.where(times < 0.07, 1e-6, 0.2 * GAP)[:, None] * np.ones(2)
    assert spread_horizon(times, spread, GAPS) == pytest.approx(0.07, abs=6e-5)


def test_a_difference_counts_ten_times_less_33_ms_later() -> None:
    """1 µm apart at the first contact is as much as 10 µm 33 ms later, and as 1 µm before it."""
    contact, time = 0.01, np.linspace(0.0, 0.1, 1001)

    def one_moment(at: float, size: float) -> float:
        distance = np.zeros((len(time), 2))
        distance[int(np.argmin(np.abs(time - at)))] = size
        return orbit_disagreement(time, distance, contact)

    first = one_moment(contact, 1e-6)
    assert one_moment(contact + TENFOLD, 10e-6) == pytest.approx(first, rel=1e-2)
    assert one_moment(0.002, 1e-6) == pytest.approx(first)
    assert orbit_disagreement(time, np.full((1001, 2), 3e-6), contact) == pytest.approx(3e-6)


def test_disagreement_forgets_what_chaos_does() -> None:
    time = np.arange(0.0, 40e-3, 5e-5)
    early = np.where(time[:, None] < 10e-3, 1e-6, 0.0)
    late = np.where(time[:, None] > 30e-3, 1e-6, 0.0)
    assert orbit_disagreement(time, np.full((len(time), 1), 2e-6), 5e-3) == pytest.approx(2e-6, rel=1e-12)
    assert orbit_disagreement(time, late, 5e-3) < 0.3 * orbit_disagreement(time, early, 5e-3)
