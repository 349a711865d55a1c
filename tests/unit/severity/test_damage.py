"""Exposure of a bearing: constant load returns itself, exposure adds up, the static limit is named."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rotordrop.errors import UsageError
from rotordrop.severity.damage import bearing_exposure

TIME = np.linspace(0.0, 2.0, 20001)
SPEED = np.full_like(TIME, 2.0 * math.pi * 50.0)


def test_constant_load_is_its_own_equivalent():
    found = bearing_exposure(TIME, np.full_like(TIME, 400.0), SPEED, np.full_like(TIME, 1e9))
    assert found.equivalent_load == pytest.approx(400.0, rel=1e-12)
    assert found.turns == pytest.approx(100.0, rel=1e-12)


def test_sinusoidal_load_has_the_cubic_mean():
    """Mean of |sin|³ is 4/(3π)."""
    load = 1000.0 * np.sin(2.0 * math.pi * 10.0 * TIME)
    found = bearing_exposure(TIME, load, SPEED, np.full_like(TIME, 1e9))
    assert found.equivalent_load == pytest.approx(1000.0 * (4.0 / (3.0 * math.pi)) ** (1.0 / 3.0), rel=1e-6)


def test_exposure_adds_up_over_parts():
    load = 500.0 + 300.0 * np.cos(3.0 * TIME)
    stress = np.full_like(TIME, 1e9)
    whole = bearing_exposure(TIME, load, SPEED, stress).exposure
    first = bearing_exposure(TIME[:10001], load[:10001], SPEED[:10001], stress[:10001]).exposure
    second = bearing_exposure(TIME[10000:], load[10000:], SPEED[10000:], stress[10000:]).exposure
    assert first + second == pytest.approx(whole, rel=1e-12)


def test_a_race_at_rest_is_not_tired():
    found = bearing_exposure(TIME, np.full_like(TIME, 400.0), 0.0 * SPEED, np.full_like(TIME, 1e9))
    assert found.equivalent_load == 0.0 and found.exposure == 0.0


def test_static_limit_is_told():
    stress = np.full_like(TIME, 2.1e9)
    found = bearing_exposure(TIME, np.full_like(TIME, 400.0), SPEED, stress)
    assert found.static_ratio == pytest.approx(0.5)
    assert found.static_load_ratio == pytest.approx(0.125)
    assert "2100 MPa, 50% of the static limit" in found.statement
    assert "inspect" in bearing_exposure(TIME, TIME, SPEED, 2.5 * stress).statement


def test_unequal_lengths_are_refused():
    with pytest.raises(UsageError, match=r"force \(5,\).*expected four equal"):
        bearing_exposure(TIME, np.zeros(5), SPEED, TIME)
