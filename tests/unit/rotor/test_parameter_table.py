"""The parameter table: rows that are whole, and machines that have what the rows name."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rotordrop.elements.parameter import Role, Step
from rotordrop.elements.table import (
    TABLE,
    following,
    keys_of,
    parameter,
    published,
    row_of,
    rows,
    separating_measurement,
)
from rotordrop.known import Known
from rotordrop.machine.examples import example_machine
from rotordrop.physics import columns as L
from rotordrop.rotor.layout import StateLayout
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.unknowns import all_unknowns
from rotordrop.units import KINDS


def test_paths_and_fields_name_one_row_each():
    paths = [(row.owner, row.path) for row in TABLE]
    fields = [row.field for row in TABLE if row.field]
    assert len(set(paths)) == len(paths) and len(set(fields)) == len(fields)
    assert all(row.kind in KINDS for row in TABLE)


def test_every_parameter_of_a_bearing_is_published():
    assert set(published()) == {row.field for row in rows("bearing")}
    assert "" not in published()
    assert all(row.truth for row in rows("bearing"))


def test_every_row_of_a_bearing_is_an_unknown_or_follows_from_others(lp400):
    unknowns = {u.parameter for u in all_unknowns(build_drop_model(lp400, "quick"))}
    for row in rows("bearing"):
        assert (row in unknowns) == (row.role is not Role.DERIVED), row.path


def test_the_table_says_what_the_machine_file_calls_it(lp400):
    bearing = lp400.touchdown_bearings[0]
    for row in rows("bearing"):
        if row.path in ("equivalent_stiffness", "support.anisotropy"):
            continue
        quantity = row.described(bearing)
        assert quantity.unit == (row.unit if row.unit != "1" else ""), row.path
        assert lp400.with_values({row.path_of("NDE"): float(quantity)}) is not None


def test_a_path_leads_back_to_its_row():
    for row in rows("bearing"):
        assert row_of(row.path_of("DE left")) is row
    assert row_of("sensors.S.1.gain") is parameter("gain", "sensor")
    assert row_of("friction.dynamic") is parameter("friction.dynamic")  # one for all bearings


def test_a_search_begins_at_what_the_machine_file_says(lp400):
    for unknown in all_unknowns(build_drop_model(lp400, "quick")):
        if unknown.parameter.owner != "bearing":
            continue
        described = float(unknown.parameter.described(lp400.bearing(unknown.owner)))
        assert unknown.value_of(unknown.begin) == pytest.approx(described, rel=1e-6), unknown.path


def test_the_horizontal_support_keeps_its_ratio_to_the_vertical_one(lp400):
    """Stiffness and anisotropy set one entry; a calibrated machine multiplies what they say."""
    uneven = lp400.with_values({"NDE.support.stiffness_horizontal": 0.7e8})
    model = build_drop_model(uneven, "quick")
    anisotropy = next(u for u in all_unknowns(model) if u.path == "NDE.support.anisotropy")
    assert anisotropy.value_of(anisotropy.mean) == pytest.approx(0.7)
    assert anisotropy.value_of(anisotropy.mean + 0.1) == pytest.approx(0.7 * math.exp(0.1))


def test_the_error_of_a_published_value_is_the_slope_times_that_of_the_estimated_number(lp400):
    for unknown in all_unknowns(build_drop_model(lp400, "quick")):
        step = 1e-4 * unknown.sigma
        slope = (unknown.value_of(unknown.mean + step) - unknown.value_of(unknown.mean - step)) / (2.0 * step)
        error = unknown.standard_error(unknown.mean, 0.1 * unknown.sigma)
        assert error == pytest.approx(slope * 0.1 * unknown.sigma, rel=1e-3), unknown.path


def test_bounds_hold_the_prior_mean(lp400):
    for unknown in all_unknowns(build_drop_model(lp400, "quick")):
        low, high = unknown.bounds
        assert low < unknown.mean < high
    exponent = next(u for u in all_unknowns(build_drop_model(lp400)) if u.path == "NDE.contact.exponent")
    assert np.exp(exponent.bounds) == pytest.approx((1.0, 2.0))
    friction = next(u for u in all_unknowns(build_drop_model(lp400)) if u.path == "DE.friction.dynamic")
    assert np.exp(friction.bounds) == pytest.approx((0.1 / 3.0, 0.3))


def test_what_separates_two_parameters_does_not_depend_on_their_order():
    stiffness, mass = parameter("support.stiffness"), parameter("support.mass")
    assert "hammer" in separating_measurement(stiffness, mass) == separating_measurement(mass, stiffness)
    gap, offset = parameter("air_gap"), parameter("offset", "sensor")
    assert "lift test" in separating_measurement(offset, gap)
    assert separating_measurement(mass, offset).startswith("more drops")


def test_a_step_of_the_replay_finds_what_is_sought():
    sought = [row for row in rows("bearing") if row.role is Role.SOUGHT]
    assert sought and all(row.step is not Step.NONE for row in sought)
    assert all(row.step is Step.IMPACTS for row in rows("bearing") if row.role is Role.CONSIDERED)


def test_limits_hold_a_value():
    exponent = parameter("contact.exponent")
    assert [exponent.within(n) for n in (0.9, 1.2, 2.5)] == [1.0, 1.2, 2.0]
    assert parameter("preload").within(math.pi) == math.pi


def test_a_value_that_follows_another_names_a_row_and_a_path_finds_its_key():
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
