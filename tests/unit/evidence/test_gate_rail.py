"""A rail with noise on it and a block of zeros are found; impacts, orbits and rests are none."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.evidence.quality import check_record
from rotordrop.evidence.quality.channels import check_rail


@pytest.mark.parametrize("share", [0.5, 0.7, 0.85])
@pytest.mark.parametrize("noise", [0.2e-6, 0.4e-6])
def test_a_rail_with_noise_on_it_is_clipping(share, noise, drop, machine, edited):
    def change(signals):
        level = share * np.min(signals[:, 0])
        cut = signals[:, 0] < level
        signals[cut, 0] = level + np.random.default_rng(5).normal(0.0, noise, np.count_nonzero(cut))

    clipped = edited(drop, change)
    (found,) = check_rail(clipped)
    assert (found.kind, found.channel, found.severity) == ("clipping", "S_NDE_A", "stop")
    assert "runs into its lower limit near" in found.message
    assert "clipping" in [one.kind for one in check_record(clipped, machine)]


def test_a_rail_of_two_levels_is_found_too(drop, edited):
    """A converter at its rail toggles by one bit."""

    def change(signals):
        level = 0.7 * np.min(signals[:, 3])
        cut = signals[:, 3] < level
        signals[cut, 3] = level + 0.3e-6 * np.random.default_rng(6).integers(0, 2, np.count_nonzero(cut))

    assert [found.channel for found in check_rail(edited(drop, change))] == ["S_DE_B"]


def test_sound_records_run_into_no_rail(whole_drop, drop, fast_drop, tail):
    for record in (whole_drop, drop, fast_drop, tail):
        assert check_rail(record) == []


@pytest.mark.parametrize("count", [3, 8, 64])
@pytest.mark.parametrize("at", [5600, 6500])
def test_a_block_of_zeros_far_from_zero_is_damage(count, at, drop, machine, edited):
    def change(signals):
        signals[at : at + count, 1] = 0.0

    found = [one for one in check_record(edited(drop, change), machine) if one.kind == "zeroed block"]
    assert [one.channel for one in found] == ["S_NDE_B"]
    assert f"{count} samples in 1 block(s) read exactly zero" in found[0].message
    assert found[0].time == pytest.approx(drop.time[at])


def test_zeros_of_a_coarse_recorder_while_the_rotor_floats_at_zero_are_none(drop, machine, edited):
    level = np.mean(drop.signals[:4000], axis=0)
    rounded = edited(drop, lambda signals: 1e-6 * np.rint((signals - level) / 1e-6))
    assert np.any(rounded.signals[:4000] == 0.0)
    assert "zeroed block" not in [one.kind for one in check_record(rounded, machine)]


def test_turning_points_short_of_the_extreme_are_no_rail(drop, machine):
    """A light rotor turned back four times at one depth and once went deeper: it was called clipped."""
    rng = np.random.default_rng(2)
    rate, time = drop.sampling_rate, drop.time
    values = np.where(time < 0.0, 0.0, -100e-6 - 60e-6 * np.cos(2 * np.pi * 40.0 * time))
    for start in (0.05, 0.1, 0.15, 0.2):
        first = int(np.searchsorted(time, start))
        values[first : first + round(1e-3 * rate)] = -200e-6
    values[int(np.searchsorted(time, 0.24))] = -206e-6
    values = values + rng.normal(0.0, 0.8e-6, len(values))
    assert check_rail(replace(drop, signals=np.column_stack([values] * 4))) == []
    values[int(np.searchsorted(time, 0.24))] = -200e-6
    assert {found.kind for found in check_rail(replace(drop, signals=np.column_stack([values] * 4)))} == {
        "clipping"
    }
