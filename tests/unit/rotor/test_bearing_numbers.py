"""What a bearing states of itself, by which everything above it works."""

from __future__ import annotations

import math

import pytest
from tests.scaled_machines import scaled_machine

from rotordrop.elements.race_bearing import numbers_of
from rotordrop.elements.table import parameter
from rotordrop.known import Known
from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.rotor.machine_summary import machine_warnings, summarise_machine


@pytest.mark.parametrize("preload", [20.0, 92.0, 400.0])
def test_the_number_a_preload_is_estimated_by_gives_it_back(paper, preload):
    by = parameter("preload").estimated_by
    assert by is not None
    measure = by(paper.touchdown_bearings[0])
    assert measure.value_of(measure.of_value(preload)) == pytest.approx(preload, rel=1e-9)


def test_a_parameter_that_is_not_turned_into_another_is_estimated_by_itself():
    assert parameter("support.mass").estimated_by is None


def test_the_seat_of_a_held_race_carries_the_load(paper):
    numbers = numbers_of(paper.touchdown_bearings[0])
    way, stiffness = numbers.deflection(200.0)
    further, _ = numbers.deflection(202.0)
    assert numbers.seat(200.0) == (0.0, -way)
    assert (further - way) * stiffness == pytest.approx(2.0, rel=2e-3)


def test_a_loose_row_states_its_play_along_and_across():
    row = (
        '{ rows = 1, clearance = "38 um", ball_diameter = "13.494 mm", ball_count = 14, '
        'pitch_diameter = "102.5 mm", ball_material = "steel" }'
    )
    loose = scaled_machine(60.0, bearing=row).touchdown_bearings[0]
    stated = {figure.field: figure.value for figure in numbers_of(loose).figures(200.0)}
    constants = bearing_constants(loose.bearing)
    assert stated["clearance_m"] == pytest.approx(38e-6)
    assert stated["axial_play_m"] == pytest.approx(
        2.0 * constants.groove_distance * math.sin(constants.contact_angle)
    )
    assert "preload_N" not in stated


def test_a_preload_beyond_the_static_stress_is_doubted(paper):
    bearing = paper.touchdown_bearings[0]
    pressed = bearing.changed(bearing=bearing.bearing.changed(preload=Known(value=2e5)))
    machine = paper.model_copy(update={"touchdown_bearings": (pressed, paper.touchdown_bearings[1])})
    found = machine_warnings(machine, summarise_machine(machine))
    (told,) = (warning for warning in found if warning.kind == "preload" and warning.limit == 4.2e9)
    assert told.doubtful
    assert told.value > 4.2e9
