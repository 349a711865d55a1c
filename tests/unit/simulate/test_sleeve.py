"""Drops into sleeves: derivative, energy, what a machine file and a result say of them."""

import json

import numpy as np
import pytest
from tests.unit.simulate.test_right_hand_side import SPEED, a_state, assert_jacobian, mirrored_drops

from rotordrop import (
    CoastDownCase,
    DropCase,
    campbell_diagram,
    critical_speed_map,
    simulate_coast_down,
    simulate_drop,
)
from rotordrop.errors import MachineFileError, UsageError
from rotordrop.estimate.simulated_drop import simulation_numbers
from rotordrop.machine import example_path, loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.physics import columns as L
from rotordrop.report.simulate_page import simulate_page
from rotordrop.rotor.campbell import critical_speeds_json
from rotordrop.rotor.machine_summary import machine_warnings, summarise_machine
from rotordrop.rotor.parameters import build_drop_model, sag_of_model
from rotordrop.simulate.losses import losses

TEXT = example_path("small").read_text(encoding="utf-8")
CASE = DropCase(speed=SPEED, duration=0.03, reduction="quick")


def text_of(*names, more=""):
    """The small machine with sleeves in place of some of its bearings."""
    head, *parts = TEXT.split("[[touchdown_bearings]]\n")
    changed = [head]
    for part in parts:
        name = part.split('"')[1]
        if name in names:
            before, _, rest = part.partition("[touchdown_bearings.bearing]")
            tables = (f"[touchdown_bearings.{table}]" for table in ("contact", "race", "support"))
            contact, race, support = map(rest.index, tables)
            part = f'kind = "sleeve"\n{before}{more}{rest[contact:race]}{rest[support:]}'
        changed.append(part)
    return "[[touchdown_bearings]]\n".join(changed)


@pytest.fixture(scope="module")
def model():
    return build_drop_model(loads_machine(text_of("DE")), "quick")


@pytest.fixture(scope="module")
def drop(model):
    return simulate_drop(model, CASE)


def test_jacobian_agrees_with_finite_differences(model):
    state = a_state(model, np.array([-40e-6, 15e-6]), 0.98)
    state[model.layout.support][-2:] = 9e-6, -4e-6
    race = np.r_[model.layout.race][2:], np.r_[model.layout.velocity_of(model.layout.race)][2:]
    state[np.concatenate(race)] = state[model.layout.race_spin.stop - 1] = 0.0
    assert_jacobian(model, state)


def test_energy_closes_by_place_and_the_contact_is_what_the_bearing_bears(model, drop):
    assert drop.certificate.energy_residual < 1e-6 * drop.certificate.energy_scale
    assert losses(model, drop).total == pytest.approx(drop.state[-1, model.layout.dissipated], rel=1e-12)
    assert np.all(drop.race_speed[:, 1] == 0.0) and np.any(drop.race_speed[:, 0] != 0.0)
    assert np.array_equal(drop.race_displacement[:, 1], drop.support_displacement[:, 1])
    borne = np.hypot(drop.contact_force[:, 1], drop.friction_force[:, 1])
    assert drop.bearing_force_magnitude[:, 1] == pytest.approx(borne, rel=1e-12)
    pressure = drop.line_contacts[1].maximum_pressure(drop.contact_force[:, 1])
    assert drop.max_stress[:, 1] == pytest.approx(pressure, rel=1e-12)
    assert np.any(drop.friction_force[:, 1] > 0.0)
    texts = [one.text for one in simulate_page(drop, model.machine).verdict]
    (rated,) = (text for text in texts if text.startswith("Peak stress is"))
    assert "(NDE)" in rated and "(DE)" not in rated  # balls have a static load rating, a sleeve has none
    assert simulation_numbers(drop, model.machine)["bearings"]["DE"]["peak_force_N"]["value"] > 0.0


def test_a_mirrored_drop_is_the_mirror_and_a_coast_down_stops_sooner_than_on_races():
    one, other = mirrored_drops(loads_machine(text_of("NDE", "DE")))
    assert one.bearing_force[..., 0] == pytest.approx(-other.bearing_force[..., 0], rel=1e-5, abs=1e-2)
    assert one.bearing_force[..., 1] == pytest.approx(other.bearing_force[..., 1], rel=1e-5, abs=1e-2)
    case = CoastDownCase(speed=300.0, duration=0.4, reduction="quick", rest=0.0)
    drag = '[speed]\naero_time_constant = "8 s"'
    slid, rolled = (
        simulate_coast_down(loads_machine(text.replace("[speed]", drag)), case)
        for text in (text_of("NDE", "DE"), TEXT)
    )
    assert slid.windows.speed[-1] < rolled.windows.speed[-1] - 1.0
    assert slid.energy_residual < 1e-5 * slid.energy_scale
    assert np.all(slid.peak_value > 0.0)


def test_what_holds_the_rotor_is_contact_and_support(model):
    machine, (_, part) = model.machine, critical_speed_map(model.machine, [1e7]).lines
    assert part.tangent == part.simple and part.contact == np.inf
    assert 1.0 / part.equivalent() == pytest.approx(1.0 / part.tangent + 1.0 / part.support, rel=1e-12)
    assert sag_of_model(model).race[1] == 0.0 < sag_of_model(model).indentation[1]
    diagram = campbell_diagram(machine, [0.0, 300.0])
    document = critical_speeds_json({"standstill": critical_speed_map(machine, [1e7])}, {"bearings": diagram})
    held = document["maps"]["standstill"]["bearings"]["DE"]
    assert held["contact_N_m"] is None and held["tangent_N_m"] == part.tangent
    assert json.dumps(document, allow_nan=False)
    summary = summarise_machine(machine)
    assert summary.bearings[1].figures == () and summary.bearings[1].contact_pressure > 1e5
    assert not [
        one for one in machine_warnings(machine, summary) if one.bearing == "DE" and "race" in one.kind
    ]


def test_a_sleeve_is_written_and_read_again():
    more = '[touchdown_bearings.bearing]\nlength = "25 mm"\nyoungs_modulus = "4 GPa"\npoisson_ratio = 0.38\n'
    machine = loads_machine(text_of("DE", more=more))
    assert float(machine.touchdown_bearings[1].race.width) == 0.025
    again = loads_machine(machine_text(machine))
    assert again.touchdown_bearings == machine.touchdown_bearings
    lighter = machine.with_values({"DE.bearing.length": 0.02, "DE.friction.dynamic": 0.2})
    assert float(lighter.touchdown_bearings[1].race.width) == 0.02
    row = build_drop_model(lighter, "quick").parameters.bearing[1]
    assert row[L.FRICTION_DYNAMIC] == 0.2 and row[L.RACE_MASS] == 0.0


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ('[touchdown_bearings.race]\nmass = "0.1 kg"\n', r"a sleeve has no race; leave out the table 'race'"),
        ("[touchdown_bearings.bearing]\nball_count = 20\n", r"unknown key 'ball_count'"),
        ('[touchdown_bearings.bearing]\nlength = "0 mm"\n', r"must be positive"),
    ],
)
def test_sleeves_that_cannot_be_are_refused(more, message):
    with pytest.raises(MachineFileError, match=message):
        loads_machine(text_of("DE", more=more))


def test_other_kinds_and_designations_are_refused(model):
    with pytest.raises(MachineFileError, match=r"'planetary'|\"planetary\" is reserved"):
        loads_machine(text_of("DE").replace('kind = "sleeve"', 'kind = "planetary"'))
    with pytest.raises(UsageError, match="it is a sleeve"):
        model.machine.with_bearing("DE", "XCB71908C.T.P4S")
