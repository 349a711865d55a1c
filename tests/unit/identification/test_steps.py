"""Steps between record and parameters, each against what is known of its input."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rotordrop.errors import IdentificationError
from rotordrop.evidence.rest import LARGEST_SWAY, _rest
from rotordrop.identification.friction import TENFOLD, orbit_disagreement
from rotordrop.identification.search import Schedule, _Searching
from rotordrop.identification.support import identified_values
from rotordrop.machine import example_machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.unknowns import all_unknowns

NINETY = 1.6448536269514722


def test_a_rotor_that_swings_in_one_bearing_alone_is_not_at_rest() -> None:
    time = np.arange(0.0, 4.0, 1e-3)
    along = np.zeros((len(time), 4))
    along[:, [1, 3]] = -280e-6
    sensing: Any = SimpleNamespace(
        settled_bend=np.zeros(4),
        offset_sigma=np.full(4, 1e-6),
        to_bearings=np.zeros((2, 2, 4)),
        from_bearings=np.zeros((4, 2, 2)),
        at_bearings=lambda values: values.reshape(*values.shape[:-1], 2, 2),
    )
    found = _rest("tail", time, along, sensing)
    assert found.radius == pytest.approx([280e-6, 280e-6])
    along[:, 2] = 1.5 * LARGEST_SWAY * 280e-6 * np.sin(2.0 * math.pi * 8.0 * time)
    with pytest.raises(IdentificationError, match=r"tail: the rotor is not at rest on its bearings"):
        _rest("tail", time, along, sensing)


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


def test_a_search_that_draws_again_goes_on_from_two_minima() -> None:
    """With one start kept as a rule, a second try keeps two, and fills up with the best of the draws."""
    fits = [SimpleNamespace(x=np.array([place, 0.0]), covariance=0.01 * np.eye(2)) for place in (0.0, 5.0)]
    searching: Any = SimpleNamespace(
        schedule=Schedule(windows=(0.01, 0.02), kept=(1,), draws=(6,), filled=False),
        problem=SimpleNamespace(
            considered=np.zeros(2, dtype=np.bool_),
            leading=np.ones(2, dtype=np.bool_),
            bounds=(np.full(2, -9.0), np.full(2, 9.0)),
        ),
        random=np.random.default_rng(1),
        _minima=lambda found: found,
        _sorted=lambda points, window: [(float(k), point) for k, point in enumerate(points)],
    )
    once = _Searching._drawn(searching, fits, 0.01, 0)  # type: ignore[arg-type]
    assert [point[0] for point in once] == [0.0]
    again = _Searching._drawn(searching, fits, 0.01, 0, more=3)  # type: ignore[arg-type]
    assert [point[0] for point in again] == [0.0, 5.0]


def test_a_found_parameter_lies_in_the_middle_of_its_interval() -> None:
    unknowns = all_unknowns(build_drop_model(example_machine("lp400"), "quick"))
    low, high = (np.array([unknown.bounds[side] for unknown in unknowns]) for side in (0, 1))
    problem: Any = SimpleNamespace(bounds=(low, high), vector=SimpleNamespace(unknowns=unknowns))
    mean = np.array([unknown.mean for unknown in unknowns])
    error = np.array([0.1 * unknown.sigma for unknown in unknowns])
    found = identified_values(problem, mean, np.diag(error**2))
    for unknown, middle, one in zip(unknowns, mean, error, strict=True):
        value = found[unknown.path]
        assert value.value == unknown.value_of(middle)
        limits = [unknown.value_of(middle + side * NINETY * one) for side in (-1.0, 1.0)]
        assert value.interval_90 == pytest.approx(tuple(limits), rel=1e-9), unknown.path
        assert limits[0] < value.value < limits[1]
        bounds = tuple(unknown.value_of(bound) for bound in unknown.bounds)
        assert value.bounds == pytest.approx(bounds, nan_ok=True)
        assert value.status == "determined"
    given = identified_values(problem, mean, np.diag(error**2), given=True)
    assert {value.status for value in given.values()} == {"taken over"}
