"""The parameter table, and the priors that come of what a machine file says of a value."""

import math

import numpy as np
import pytest

from rotordrop.elements.parameter import Role
from rotordrop.elements.table import TABLE, following, keys_of, parameter, published, row_of, rows
from rotordrop.known import NINETY, Known
from rotordrop.machine.examples import example_machine
from rotordrop.physics import columns as L
from rotordrop.rotor.layout import StateLayout
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.unknowns import all_unknowns, prior, sensor_prior
from rotordrop.units import KINDS


def test_the_table_names_each_path_and_unknown_once(lp400):
    paths = [(row.owner, row.path) for row in TABLE]
    fields = [row.field for row in TABLE if row.field]
    assert len(set(paths)) == len(paths) and len(set(fields)) == len(fields)
    assert all(row.kind in KINDS for row in TABLE)
    assert set(published()) == {row.field for row in rows("bearing")}
    assert "" not in published()
    for row in rows("bearing"):
        assert row_of(row.path_of("DE left")) is row
    assert row_of("sensors.S.1.gain") is parameter("gain", "sensor")
    assert row_of("friction.dynamic") is parameter("friction.dynamic")  # one for all bearings
    bearing = lp400.touchdown_bearings[0]
    for row in rows("bearing"):
        if row.path in ("equivalent_stiffness", "support.anisotropy"):
            continue
        quantity = row.described(bearing)
        assert quantity.unit == (row.unit if row.unit != "1" else ""), row.path
        assert lp400.with_values({row.path_of("NDE"): float(quantity)}) is not None
    unknowns = {u.parameter for u in all_unknowns(build_drop_model(lp400, "quick"))}
    for row in rows("bearing"):
        assert (row in unknowns) == (row.role is not Role.DERIVED), row.path


def test_a_search_begins_at_what_the_machine_file_says_within_bounds(lp400):
    for unknown in all_unknowns(build_drop_model(lp400, "quick")):
        if unknown.parameter.owner != "bearing":
            continue
        described = float(unknown.parameter.described(lp400.bearing(unknown.owner)))
        assert unknown.value_of(unknown.begin) == pytest.approx(described, rel=1e-6), unknown.path
    for unknown in all_unknowns(build_drop_model(lp400, "quick")):
        low, high = unknown.bounds
        assert low < unknown.mean < high
    exponent = next(u for u in all_unknowns(build_drop_model(lp400)) if u.path == "NDE.contact.exponent")
    assert np.exp(exponent.bounds) == pytest.approx((1.0, 2.0))
    friction = next(u for u in all_unknowns(build_drop_model(lp400)) if u.path == "DE.friction.dynamic")
    assert np.exp(friction.bounds) == pytest.approx((0.1 / 3.0, 0.3))


def test_published_values_keep_ratio_and_slope(lp400):
    """Stiffness and anisotropy set one entry; a calibrated machine multiplies what they say."""
    uneven = lp400.with_values({"NDE.support.stiffness_horizontal": 0.7e8})
    model = build_drop_model(uneven, "quick")
    anisotropy = next(u for u in all_unknowns(model) if u.path == "NDE.support.anisotropy")
    assert anisotropy.value_of(anisotropy.mean) == pytest.approx(0.7)
    assert anisotropy.value_of(anisotropy.mean + 0.1) == pytest.approx(0.7 * math.exp(0.1))
    for unknown in all_unknowns(build_drop_model(lp400, "quick")):
        step = 1e-4 * unknown.sigma
        slope = (unknown.value_of(unknown.mean + step) - unknown.value_of(unknown.mean - step)) / (2.0 * step)
        error = unknown.standard_error(unknown.mean, 0.1 * unknown.sigma)
        assert error == pytest.approx(slope * 0.1 * unknown.sigma, rel=1e-3), unknown.path


SUPPORT = ("stiffness", "mass", "damping")


def test_rows_of_the_table_are_whole():
    sought = {row.path for row in rows("bearing") if row.role is Role.SOUGHT}
    assert sought == {"air_gap", "friction.dynamic", *(f"support.{of}" for of in SUPPORT)}
    exponent = parameter("contact.exponent")
    assert [exponent.within(n) for n in (0.9, 1.2, 2.5)] == [1.0, 1.2, 2.0]
    assert parameter("preload").within(math.pi) == math.pi
    bearing = example_machine("lp400").touchdown_bearings[0]
    followed = {row.path: (path, by) for row, path, by in following()}
    path, by = followed["friction.static"]
    assert by(bearing, Known(value=0.2)).value == 0.2 * bearing.friction.ratio
    assert parameter(path).entries  # what is followed is estimated
    assert keys_of(["preload"]) == ["bearing", "preload"] and keys_of(["air_gap"]) == ["air_gap"]


def test_the_layout_holds_the_states_that_the_parts_of_a_bearing_ask_for():
    machine = example_machine("lp400")
    first, second = machine.touchdown_bearings
    softer = first.changed(mount={"maxwell": [{"stiffness": "4e7 N/m", "time": "3 ms"}]})
    machine = machine.changed(touchdown_bearings=(softer, second))
    foundation = {"foundation_share": 0.1, "foundation_frequency": 600.0, "foundation_damping_ratio": 0.03}
    machine = machine.with_values({f"DE.support.{name}": value for name, value in foundation.items()})
    layout = StateLayout.of_machine(machine, 3)
    at = layout.bearing_at()
    start = layout.race_spin.stop
    assert at[:, L.BEARING_OWN].tolist() == [-1, start] and at[:, L.MOUNT_STATES].tolist() == [start + 4, -1]
    assert layout.kinds[layout.further_at(L.BEARING_OWN)].tolist() == [L.INTERNAL] * 4
    assert layout.kinds[layout.further_at(L.MOUNT_STATES)].tolist() == [L.POSITION] * 2
    assert layout.rotor_speed == start + 6


def test_unbalance_is_turned_by_its_phase_from_the_vertical(paper):
    """At rotor angle zero a phase of 0 pulls up, of 90° to the left: amount times shape, added up."""
    values = {"unbalance.0.phase": 0.0, "unbalance.1.phase": math.pi / 2}
    model = build_drop_model(paper.with_values(values), "quick")
    first, second = paper.unbalances
    rows = [model.basis.node_row(u.node) for u in (first, second)]
    assert len(paper.unbalances) == 2
    up = float(first.amount) * rows[0]
    left = float(second.amount) * rows[1]
    size = np.max(np.abs(up)) + np.max(np.abs(left))
    assert model.parameters.unbalance_sin == pytest.approx(up, abs=1e-12 * size)
    assert model.parameters.unbalance_cos == pytest.approx(-left, abs=1e-12 * size)


def test_magnets_of_another_machine_are_in_its_model_and_what_a_start_put_there_stays(paper):
    model = build_drop_model(paper, "quick")
    started = model.parameters.magnet
    started[:, L.REMANENT_X] = 7.0
    stiffer = tuple(
        amb.model_copy(update={"stiffness": Known(value=2.0 * float(amb.stiffness), status="given")})
        for amb in paper.ambs
    )
    other = model.with_machine(paper.model_copy(update={"ambs": stiffer})).parameters.magnet
    assert len(other) == len(paper.ambs) > 0
    assert other[:, L.AMB_STIFFNESS] == pytest.approx(2.0 * started[:, L.AMB_STIFFNESS])
    assert other[:, L.REMANENT_X] == pytest.approx(7.0)
    assert started[:, L.AMB_STIFFNESS] == pytest.approx([float(amb.stiffness) for amb in paper.ambs])


GAP = parameter("air_gap")
STIFFNESS = parameter("support.stiffness")
GAIN, OFFSET = parameter("gain", "sensor"), parameter("offset", "sensor")


def unknown_of(machine, path):
    return next(u for u in all_unknowns(build_drop_model(machine, "quick")) if u.path == path)


def ninety(unknown):
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


def test_an_interval_is_kept_centred_or_not_and_one_from_zero_on_is_left_above():
    found = prior(GAP, Known(value=2.6e-4, status="estimated", interval_90=(2.5e-4, 3.0e-4)))
    assert found.mean - NINETY * found.sigma == pytest.approx(2.5e-4)
    assert found.mean + NINETY * found.sigma == pytest.approx(3.0e-4)
    assert found.start == 2.6e-4
    value = Known(value=1e8, status="estimated", interval_90=(1e8 / 1.3, 1.3e8))
    assert prior(STIFFNESS, value).mean == prior(STIFFNESS, value).start == math.log(1e8)
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


def test_values_beyond_limits_or_that_a_bearing_does_not_have(lp400):
    loose = lp400.with_values({"NDE.contact.damping": 0.0})
    paths = {u.path for u in all_unknowns(build_drop_model(loose, "quick"))}
    assert "NDE.contact.damping" not in paths and "DE.contact.damping" in paths
    gap = unknown_of(lp400, "NDE.air_gap")
    assert gap.value_of(-20e-6) == 0.0
    exponent = unknown_of(lp400, "NDE.contact.exponent")
    assert exponent.value_of(np.log(2.4)) == 2.0


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
