"""What the machine file says of a value, and the prior that comes of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rotordrop.elements.table import parameter, rows
from rotordrop.known import NINETY, Known
from rotordrop.machine import Machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.unknowns import Unknown, all_unknowns, prior, sensor_prior

GAP = parameter("air_gap")
STIFFNESS = parameter("support.stiffness")
GAIN, OFFSET = parameter("gain", "sensor"), parameter("offset", "sensor")


def unknown_of(machine: Machine, path: str) -> Unknown:
    return next(u for u in all_unknowns(build_drop_model(machine, "quick")) if u.path == path)


def ninety(unknown: Unknown) -> list[float]:
    return [unknown.value_of(unknown.mean + s * NINETY * unknown.sigma) for s in (-1.0, 1.0)]


def test_a_range_is_the_prior_interval_wherever_the_guess_lies(lp400):
    """It was moved onto the guess before: 175 to 325 µm for a gap that its owner puts at 200 to 350 µm."""
    gap = unknown_of(lp400, "NDE.air_gap")  # air_gap = {guess = 0.25 mm, range = [0.2, 0.35] mm}
    assert ninety(gap) == pytest.approx([200e-6, 350e-6])
    assert gap.value_of(gap.begin) == pytest.approx(250e-6)


@pytest.mark.parametrize("path", ["support.stiffness", "contact.damping", "friction.dynamic", "preload"])
def test_a_range_of_a_positive_quantity_too(lp400, path):
    value = float(parameter(path).described(lp400.bearing("DE")))
    limits = 0.9 * value, 3.0 * value
    guess = Known(value=value, status="guess", range=limits)
    found = unknown_of(lp400.with_values({f"DE.{path}": guess}), f"DE.{path}")
    assert ninety(found) == pytest.approx(limits, rel=1e-6)
    assert found.value_of(found.begin) == pytest.approx(value, rel=1e-6)


def test_an_interval_that_is_not_centred_on_its_value_is_kept_as_well():
    found = prior(GAP, Known(value=2.6e-4, status="estimated", interval_90=(2.5e-4, 3.0e-4)))
    assert found.mean - NINETY * found.sigma == pytest.approx(2.5e-4)
    assert found.mean + NINETY * found.sigma == pytest.approx(3.0e-4)
    assert found.start == 2.6e-4


def test_a_centred_interval_leaves_the_value_as_it_is():
    value = Known(value=1e8, status="estimated", interval_90=(1e8 / 1.3, 1.3e8))
    assert prior(STIFFNESS, value).mean == prior(STIFFNESS, value).start == math.log(1e8)


def test_a_range_from_zero_on_is_left_above_by_one_in_twenty():
    found = prior(parameter("contact.damping"), Known(value=0.08, status="guess", range=(0.0, 0.5)))
    assert found.mean == found.start == math.log(0.08)
    assert math.exp(found.mean + NINETY * found.sigma) == pytest.approx(0.5)


@pytest.mark.parametrize("status", ["given", "guess", "estimated", "default", "inferred"])
def test_only_an_estimate_counts_as_calibrated(lp400, status):
    """Whether the verdict says 'known from the calibration' hangs on it, of the contact exponent too."""
    for row in rows("bearing"):
        if not row.entries or row.path == "support.anisotropy":
            continue
        value = Known(value=float(row.described(lp400.bearing("NDE"))), status=status)
        found = unknown_of(lp400.with_values({row.path_of("NDE"): value}), row.path_of("NDE"))
        assert found.calibrated == (status == "estimated"), row.path


def test_the_range_of_a_guessed_sensor_counts_and_that_of_a_default_does_not():
    guess = Known(value=1.01, status="guess", range=(0.97, 1.03))
    assert sensor_prior(GAIN, guess, 250e-6).sigma == pytest.approx(0.06 / (2.0 * NINETY))
    assert sensor_prior(GAIN, guess, 250e-6).mean == pytest.approx(1.0)
    default = Known(value=1.0, status="default", range=(0.97, 1.03))
    assert sensor_prior(GAIN, default, 250e-6).sigma == pytest.approx(0.01)
    zero = Known(value=0.0, status="default", range=(-50e-6, 50e-6))
    assert sensor_prior(OFFSET, zero, 250e-6).sigma == pytest.approx(10e-6)
    known = Known(value=2e-6, status="estimated", standard_error=1e-6)
    assert sensor_prior(OFFSET, known, 250e-6).sigma == 1e-6


def test_what_a_bearing_does_not_have_is_no_unknown(lp400):
    loose = lp400.with_values({"NDE.contact.damping": 0.0})
    paths = {u.path for u in all_unknowns(build_drop_model(loose, "quick"))}
    assert "NDE.contact.damping" not in paths and "DE.contact.damping" in paths


def test_priors_scale_with_the_machine(lp400):
    """Twice the weight in gaps three times as wide: remanent force by weight, gap and offsets by the gap."""
    heavy = lp400.with_values({"gravity": 2.0 * 9.81, "NDE.air_gap": 750e-6, "DE.air_gap": 750e-6})
    light = lp400.with_values({"NDE.air_gap": 250e-6, "DE.air_gap": 250e-6})
    for path, factor in (("NDE.remanent_force.y", 2.0), ("NDE.air_gap", 3.0)):
        assert unknown_of(heavy, path).sigma == pytest.approx(factor * unknown_of(light, path).sigma)
    weight = lp400.rotor.mass * 9.81
    assert unknown_of(lp400, "DE.remanent_force.x").sigma == pytest.approx(0.2 * weight / 2.0)
    ratio = unknown_of(heavy, "DE.air_gap").drift / unknown_of(light, "DE.air_gap").drift
    assert ratio == pytest.approx(3.0)
    depths = [unknown_of(m, "DE.contact.exponent").targets[1].factor for m in (heavy, light)]
    assert depths[0] / depths[1] == pytest.approx(2.0**0.9)  # of a line contact, by the load


def test_a_value_beyond_the_limits_of_its_row_is_the_limit(lp400):
    gap = unknown_of(lp400, "NDE.air_gap")
    assert gap.value_of(-20e-6) == 0.0
    exponent = unknown_of(lp400, "NDE.contact.exponent")
    assert exponent.value_of(np.log(2.4)) == 2.0
