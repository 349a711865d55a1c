"""Drops onto touchdown bearings without preload: deep grooves of class C3, and a pair that just touches."""

import re

import numpy as np
import pytest
from tests.scaled_machines import scaled_machine

from rotordrop import DropCase, build_drop_model, simulate_drop
from rotordrop.estimate.simulated_drop import simulation_numbers
from rotordrop.physics import columns as L
from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.rotor.machine_summary import machine_warnings, summarise_machine
from rotordrop_bench.settled import settled_coordinates

B6016 = (
    '{ rows = 1, clearance = "C3", bore_diameter = "80 mm", ball_diameter = "13.494 mm", ball_count = 14, '
    'pitch_diameter = "102.5 mm", conformity_inner = 0.515, conformity_outer = 0.525, '
    'ball_material = "steel", width = "22 mm" FIRST }'
)
TOUCHING = (
    '{ ball_diameter = "13.494 mm", ball_count = 21, pitch_diameter = "102.5 mm", '
    'contact_angle = "15 deg", preload = "0 N" FIRST }'
)


def loose(bearing, first=0.0):
    return scaled_machine(60.0, bearing=bearing.replace("FIRST", f', first_ball_angle = "{first} deg"'))


@pytest.fixture(scope="module", params=[B6016, TOUCHING], ids=["6016 C3", "15 deg, 0 N"])
def bearing(request):
    return request.param


@pytest.mark.parametrize("first", [0.0, 5.0, 180.0 / 14.0])
def test_a_loose_bearing_is_summarised_and_checked(bearing, first):
    machine = loose(bearing, first)
    summary = summarise_machine(machine)
    for described, rest in zip(machine.touchdown_bearings, summary.bearings, strict=True):
        constants = bearing_constants(described.bearing)
        assert rest.deflection > constants.radial_play
        assert 1e6 < rest.tangent_stiffness < 1e9
        loaded = re.search(r"on (\d+) balls", rest.figures[-1].note)
        assert 1 <= int(loaded[1]) < 0.6 * constants.row_count * constants.ball_count
    told = [warning.message for warning in machine_warnings(machine, summary)]
    assert any("the load of the lowest ball at rest" in text for text in told)
    assert not any("preload" in text for text in told)


def test_a_drop_onto_loose_bearings_keeps_its_energy_and_ends_on_the_weight(bearing):
    model = build_drop_model(loose(bearing, 3.0), "quick")
    result = simulate_drop(model, DropCase(speed=200.0, duration=0.25))
    assert result.finished
    assert result.certificate.energy_residual < 1e-4 * result.certificate.energy_scale
    late = result.time > 0.1
    mean = np.mean(result.bearing_force[late, :, 1], axis=0)
    p = model.parameters.bearing
    weight = model.load_shares + p[:, L.RACE_WEIGHT]
    assert np.sum(mean) == pytest.approx(np.sum(weight), rel=0.1)
    shown = simulation_numbers(result, model.machine)
    assert "nan" not in str(shown).lower()
    assert "preload" not in str(shown)
    pressure = shown["bearings"]["NDE"]["peak_contact_pressure_Pa"]["value"]
    line = result.line_contacts[0]
    bore, gap = p[0, L.BORE_RADIUS], p[0, L.AIR_GAP]
    assert line.radius == pytest.approx(bore * (bore - gap) / gap, rel=1e-12)
    per_length = np.max(result.contact_force[:, 0]) / line.length
    assert pressure == pytest.approx(np.sqrt(per_length / line.compliance / np.pi / line.radius), rel=0.01)


def test_a_loose_race_lies_on_its_balls_before_the_drop_and_a_preloaded_one_has_no_weight():
    model = build_drop_model(loose(B6016), "quick")
    result = simulate_drop(model, DropCase(speed=200.0, duration=0.004))
    assert np.max(result.contact_force) == 0.0
    lowest = result.race_displacement[:, :, 1]
    assert lowest[0] == pytest.approx([-19e-6, -19e-6], abs=2e-6)
    assert np.max(np.abs(lowest - lowest[0])) < 1e-10
    carried = result.bearing_force[-1, :, 1]
    assert carried == pytest.approx(model.parameters.bearing[:, L.RACE_WEIGHT], rel=1e-3)
    assert np.all(build_drop_model(scaled_machine(60.0), "quick").parameters.bearing[:, L.RACE_WEIGHT] == 0.0)


@pytest.mark.parametrize("first", [0.0, 5.0, 180.0 / 14.0])
def test_the_rotor_at_rest_lies_deeper_by_the_play(first):
    model = build_drop_model(loose(B6016, first))
    rest = settled_coordinates(model)
    layout, p = model.layout, model.parameters.bearing
    depth = -(model.parameters.bearing_shape @ rest[layout.modal_y])
    assert np.all(depth > p[:, L.AIR_GAP] + 19e-6)
    assert np.all(depth < p[:, L.AIR_GAP] + 19e-6 / np.cos(np.pi / 14) + 60e-6)
    carried = -rest[layout.support].reshape(-1, 2)[:, 1] * p[:, L.SUPPORT_STIFFNESS_Y]
    assert np.sum(carried) == pytest.approx(np.sum(model.load_shares + p[:, L.RACE_WEIGHT]), rel=1e-8)
