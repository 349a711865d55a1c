"""What extensions would bring beside a fit: by one pass for all, and by a pass for each."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.elements.table import EXTENSIONS
from rotordrop.evidence.evidence import Evidence
from rotordrop.machine import Machine
from rotordrop.track.calibration import Stage, track
from rotordrop.twin.problems import Drops
from rotordrop.twin.rises import Rises, _density_beside, _log_density
from rotordrop_bench import SyntheticDrop

STAGE = Stage(until=0.016, force=0.07, share=0.01, passes=2)


@pytest.fixture(scope="module")
def rises(calibrated: Machine, synthetic: SyntheticDrop) -> Rises:
    """Beside a fit of the first impacts."""
    evidence = Evidence(record=synthetic.record, machine=calibrated, tail=synthetic.tail, name="drop")
    drops = Drops(evidence=(evidence,), calibrate_only=True)
    fit = track(drops.fine(calibrated), (STAGE,))
    return Rises(drops=drops, machine=calibrated, fit=fit, stage=replace(STAGE, passes=1), noise=1.0)


def test_one_pass_with_the_unknowns_of_all_says_what_a_pass_for_each_says(rises: Rises) -> None:
    chosen = [one for one in EXTENSIONS if one.begins_as_base_model and one.values(rises.machine)]
    at_once, apart = (
        {one.name: rise for rise, one in pairs} for pairs in (rises.at_once(chosen), rises.apart(chosen))
    )
    assert len(at_once) > 8 and at_once.keys() == apart.keys()
    for name, rise in apart.items():
        # what is known of the place of rest, which is no part of these readings, differs with a sleeve
        within = 6.0 if "sleeve" in name else 0.5
        assert at_once[name] == pytest.approx(rise, abs=within), name
    assert min(apart.values()) < -2.0  # they differ


def test_what_begins_otherwise_is_asked_by_a_pass_of_its_own(rises: Rises, monkeypatch) -> None:
    asked: dict[str, list[str]] = {}

    def noted(way: str):
        def note(_: Rises, extensions):
            asked[way] = [one.name for one in extensions]
            return []

        return note

    for way in ("at_once", "apart"):
        monkeypatch.setattr(Rises, way, noted(way))
    rises.of_all(EXTENSIONS)
    assert {"sensor lag", "foundation mode", "turned support axes", "ring masses"} <= set(asked["apart"])
    assert len(asked["at_once"]) + len(asked["apart"]) == len(EXTENSIONS)


def test_the_density_of_zero_is_that_of_a_normal_distribution() -> None:
    mean, covariance = np.array([1.0, -2.0]), np.array([[2.0, 0.6], [0.6, 0.5]])
    turn = np.linalg.inv(covariance)
    expected = -0.5 * mean @ turn @ mean - 0.5 * math.log((2.0 * math.pi) ** 2 * np.linalg.det(covariance))
    assert _log_density(mean, covariance) == pytest.approx(expected)


def test_beside_others_it_is_that_of_what_is_left_where_they_are_zero() -> None:
    """Of a pair, the second known: a normal distribution with the mean and variance of the regression."""
    mean, covariance = np.array([1.0, -2.0]), np.array([[2.0, 0.6], [0.6, 0.5]])
    middle, variance = 1.0 + 0.6 / 0.5 * 2.0, 2.0 - 0.6**2 / 0.5
    expected = -0.5 * middle**2 / variance - 0.5 * math.log(2.0 * math.pi * variance)
    found = _density_beside(mean, covariance, np.array([False, True]))
    assert found == pytest.approx(expected)
