"""Bearings that warm: books of heat and energy, stretches, springs, fast balls, resumed runs, refusals."""

import re
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.simulate.short_drop import Killed, killed_after

from rotordrop import build_drop_model, load_result, simulate_coast_down, simulate_drop
from rotordrop.errors import MachineFileError, UsageError
from rotordrop.estimate.simulated_drop import simulation_numbers
from rotordrop.machine import example_path, loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.physics import columns as L
from rotordrop.physics import thermal
from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.physics.fast_balls import FastBalls, centred_balls
from rotordrop.report.simulate_page import simulate_page
from rotordrop.rotor.machine_summary import machine_warnings, summarise_machine
from rotordrop.simulate import _rhs as R
from rotordrop.simulate import heat
from rotordrop.simulate.case import CoastDownCase, DropCase, StateStart
from rotordrop.simulate.coast_down_file import load_coast_down
from rotordrop.study.quantities import columns_of
from rotordrop.study.quantities import row_of as row_of_drop

COLD = example_path("small").read_text(encoding="utf-8")
NOMINAL = float(loads_machine(COLD).speed.nominal)


def text_of(table="", bearing=""):
    """The small machine with bearings that warm, and more under 'bearing'."""
    support = "[touchdown_bearings.support]"
    warm = COLD.replace(support, f"[touchdown_bearings.thermal]\n{table}\n{support}")
    return warm.replace("preload = { guess", f"{bearing}\npreload = {{ guess")


def model_of(table="", bearing=""):
    return build_drop_model(loads_machine(text_of(table, bearing)), "quick")


@pytest.fixture(scope="module")
def warm():
    return model_of()


HOT = 'slip_share = 1.0\nrace_capacity = "5 J/K"'
"""A race that warms eighteen times as fast."""


def turning(model, duration=0.06, share=0.5):
    """A drop that begins with its races turning."""
    state = model.at_rest()
    state[model.layout.rotor_speed], state[model.layout.race_spin] = NOMINAL, share * NOMINAL
    case = DropCase(speed=NOMINAL, duration=duration, reduction="quick", start=StateStart(state=state))
    return simulate_drop(model, case)


@pytest.fixture(scope="module")
def drop(warm):
    return turning(warm)


@pytest.mark.parametrize("parts", [1, 7, 400])
def test_nodes_come_to_the_same_in_one_step_and_in_many(warm, parts):
    network = thermal.HeatNetwork.of_entries(warm.parameters.bearing[0, L.THERMAL : L.THERMAL_END])
    start, power = np.array([3.0, 40.0, 20.0, 8.0, 1.0, 0.2]), np.array([30.0, 90.0, 20.0, 15.0, 0.0, 2.0])
    once, gone = network.after(start, power, 12.0)
    warmth, total = start, 0.0
    for _ in range(parts):
        warmth, more = network.after(warmth, power, 12.0 / parts)
        total += more
    assert warmth == pytest.approx(once, rel=1e-9)
    assert total == pytest.approx(gone, rel=1e-9)
    held = float(np.sum(network.capacity * (once - start)))
    assert held + gone == pytest.approx(12.0 * float(np.sum(power)), rel=1e-10)


def test_without_the_way_outwards_all_heat_stays():
    network = thermal.HeatNetwork.of(np.array([3.0, 5.0]), np.array([2.0]), np.zeros(2))
    warmth, gone = network.after(np.zeros(2), np.array([8.0, 0.0]), 1e5)
    assert gone == 0.0
    assert warmth == pytest.approx(8.0e5 / 8.0 + np.array([1.5625, -0.9375]) * 1.0, rel=1e-6)


def test_heat_is_what_was_lost_at_its_places_warms_race_and_sleeve_and_raises_the_preload(drop):
    lost = drop.lost[:-1]
    assert drop.heat.taken == pytest.approx(np.sum(lost, axis=1), rel=1e-9)
    assert drop.heat.gone + drop.heat.held == pytest.approx(drop.heat.taken, rel=1e-9)
    assert np.all(lost[:, R.SLIDING] > 1.0)
    assert drop.certificate.energy_residual < 1e-6 * drop.certificate.energy_scale
    warmth = drop.heat.temperature[-1, 0]
    assert warmth[thermal.SKIN] > warmth[thermal.RACE] > warmth[thermal.OUTER] > 0.0
    assert drop.heat.preload[0, 0] == pytest.approx(156.0, rel=1e-9)
    assert np.all(np.diff(drop.heat.preload[:, 0]) > -1e-3)
    assert drop.heat.preload[-1, 0] > 1.02 * drop.heat.preload[0, 0]
    assert drop.heat.growth[-1, 0] > 0.0


def test_the_work_of_growth_is_booked(monkeypatch):
    model = model_of(HOT)
    closed = turning(model).certificate
    assert closed.energy_residual < 2e-6 * closed.energy_scale
    monkeypatch.setattr(heat, "stored_energy", lambda *_: 0.0)
    left_out = turning(model).certificate
    assert left_out.energy_residual > 2e-5 * left_out.energy_scale


def test_stretches_half_as_long_change_next_to_nothing(warm, drop, monkeypatch):
    monkeypatch.setattr(heat, "WARMED", 0.5 * heat.WARMED)
    monkeypatch.setattr(heat, "SHORTEST", 0.5 * heat.SHORTEST)
    finer = turning(warm)
    assert len(finer.heat.time) > 1.2 * len(drop.heat.time)
    assert finer.heat.preload[-1] == pytest.approx(drop.heat.preload[-1], rel=2e-3)
    assert finer.peak_force(0)[0] == pytest.approx(drop.peak_force(0)[0], rel=1e-3)


def test_parts_that_do_not_grow_and_cold_bearings_leave_the_drop_as_it_is():
    """But for the drag of the preload: without any drag all is as in a cold bearing."""
    still = 'expansion = "0 1/K"\nball_expansion = "0 1/K"\n'
    smooth = [
        loads_machine(text).with_values({f"{b}.race.drag_coefficient": 0.0 for b in ("NDE", "DE")})
        for text in (COLD, text_of(still))
    ]
    one, other = (turning(build_drop_model(machine, "quick"), 0.02) for machine in smooth)
    assert one.heat is None
    assert other.heat.taken[0] > 0.0
    assert other.peak_force(0)[0] == pytest.approx(one.peak_force(0)[0], rel=1e-5)
    assert other.race_speed[-1] == pytest.approx(one.race_speed[-1], rel=1e-6)
    p = build_drop_model(loads_machine(COLD), "quick").parameters
    assert heat.warmed(p, p.memory, np.zeros(1)) is p
    assert len(p.memory) == 0
    only = text_of().replace("[touchdown_bearings.thermal]\n\n", "", 1)
    mixed = turning(build_drop_model(loads_machine(only), "quick"), 0.01)
    assert mixed.heat.warmed == (1,)
    assert np.all(np.isnan(mixed.heat.temperature[:, 0]))


def test_springs_keep_the_preload_and_fast_balls_close_their_energy():
    sprung, rigid = (turning(model_of(HOT, f'preload_kind = "{kind}"')) for kind in ("spring", "rigid"))
    risen = [one.heat.preload[-1, 0] - one.heat.preload[0, 0] for one in (sprung, rigid)]
    assert risen[1] > 60.0
    assert 0.0 < risen[0] < 0.25 * risen[1]
    assert sprung.certificate.energy_residual < 2e-6 * sprung.certificate.energy_scale
    fast = turning(model_of(bearing="ball_inertia = true"))
    assert fast.certificate.energy_residual < 2e-6 * fast.certificate.energy_scale
    assert fast.heat.preload[0, 0] == pytest.approx(164.7, rel=1e-3)


@pytest.mark.parametrize(("warmth", "share"), [(0.0, 0.0), (4.0, 0.0), (4.0, 0.8), (-2.0, 0.6)])
def test_warm_fast_balls_are_those_of_shifted_grooves(warmth, share):
    model = model_of(bearing="ball_inertia = true")
    p = model.parameters._replace(memory=model.parameters.memory.copy())
    kept = heat.remembered(p, p.memory)
    kept[:, [thermal.SKIN, thermal.RACE]] = warmth
    state = model.at_rest()
    state[model.layout.race_spin] = share * NOMINAL
    now = heat.warmed(p, p.memory, state)
    described = model.machine.touchdown_bearings[0].bearing
    constants = bearing_constants(described)
    grown = thermal.growth(p.bearing[0, L.THERMAL : L.THERMAL_END], kept[0, : thermal.N_NODES])
    balls = FastBalls.of(described, constants)
    balls = replace(balls, radial_offset=balls.radial_offset + grown)
    wanted = constants.ball_count * float(centred_balls(balls, share * NOMINAL)[0].axial_force[0])
    # the orbit of the table is that of cold balls
    assert heat.preload_of(0, now, state)[0] == pytest.approx(wanted, rel=2e-3)


@pytest.mark.parametrize("warmth", [0.0, 80.0])
def test_no_preload_stops_a_race_at_once(warm, warmth):
    """The drag of a pair that runs away builds up over so much speed that it is not stiff."""
    bearing = warm.parameters.bearing.copy()
    bearing[:, L.DRAG_SPEED] = 1e-3
    p = warm.parameters._replace(bearing=bearing, memory=warm.parameters.memory.copy())
    heat.remembered(p, p.memory)[:, [thermal.SKIN, thermal.RACE]] = warmth
    row = heat.warmed(p, p.memory, warm.at_rest()).bearing[0]
    torque = 0.5 * row[L.DRAG_COEFFICIENT] * row[L.PITCH_DIAMETER] * row[L.PRESSED]
    assert torque / row[L.RACE_INERTIA] / row[L.DRAG_SPEED] == pytest.approx(heat.STIFFEST, rel=1e-12)
    assert row[L.DRAG_SPEED] < (1.0 if warmth else 0.03)


def test_a_warm_sleeve_closes_the_gap_and_warmth_all_through_keeps_the_preload_of_steel_balls(warm):
    p = warm.parameters
    entries, gap = p.bearing[0, L.THERMAL : L.THERMAL_END], p.bearing[0, L.AIR_GAP]
    for nodes, change in (((thermal.SLEEVE,), -12e-6 * 10.0 * (0.02 - gap)), ((1, 2), 12e-6 * 10.0 * 0.02)):
        warmth = np.zeros(thermal.N_NODES)
        warmth[list(nodes)] = 10.0
        assert thermal.gap_growth(entries, warmth, 0.02, 0.02 - gap) == pytest.approx(change, rel=1e-12)
    steel = model_of(bearing='ball_material = "steel"').parameters
    even = np.full(thermal.N_NODES, 25.0)
    assert thermal.growth(steel.bearing[0, L.THERMAL : L.THERMAL_END], even) == pytest.approx(0.0, abs=1e-15)


def test_it_is_kept_with_the_result_and_said_of_a_drop(drop, tmp_path, warm):
    drop.save(tmp_path / "drop.h5")
    found = load_result(tmp_path / "drop.h5").heat
    assert np.array_equal(found.temperature, drop.heat.temperature)
    with pytest.raises(UsageError, match="the balls of NDE warm"):
        drop.ball_loads(warm.machine, "NDE")
    page = simulate_page(drop, warm.machine)
    (section,) = [one for one in page.sections if one.heading == "Heat"]
    assert [len(one.chart.data) for one in section.figures] == [2 * thermal.N_NODES, 2]
    numbers = simulation_numbers(drop, warm.machine)["heat"]["NDE"]
    assert numbers["race_K"]["largest"] == pytest.approx(np.max(drop.heat.race(0)), rel=1e-12)
    assert numbers["preload_N"]["end"] == drop.heat.preload[-1, 0]
    assert numbers["heat_J"]["taken"] == pytest.approx(np.sum(drop.lost[0]), rel=1e-9)
    kept = dict(zip((one.name for one in columns_of(warm.machine)), row_of_drop(warm, drop), strict=True))
    assert kept["DE.heat.preload"] == drop.heat.preload[-1, 1]
    assert kept["NDE.heat.race"] == numbers["race_K"]["largest"]


COASTING = 'nominal = "500 Hz"\naero_time_constant = "8 s"'


@pytest.fixture(scope="module")
def coasting():
    return build_drop_model(loads_machine(text_of().replace('nominal = "500 Hz"', COASTING)), "quick")


CASE = CoastDownCase(speed=NOMINAL, duration=1.4)


def test_a_coast_down_with_heat_is_resumed_to_the_last_bit_and_said(coasting, tmp_path):
    whole = simulate_coast_down(coasting, CASE, output=tmp_path / "whole.h5")
    with pytest.raises(Killed):
        simulate_coast_down(coasting, CASE, output=tmp_path / "cut.h5", progress=killed_after(2))
    resumed = simulate_coast_down(coasting, CASE, output=tmp_path / "cut.h5", resume=True)
    assert np.array_equal(resumed.heat.temperature, whole.heat.temperature)
    assert np.array_equal(resumed.windows.peak, whole.windows.peak)
    assert resumed.heat.taken == pytest.approx(whole.heat.gone + whole.heat.held, rel=1e-9)
    assert whole.energy_residual < 1e-6 * whole.energy_scale
    assert np.array_equal(load_coast_down(tmp_path / "cut.h5").heat.preload, whole.heat.preload)


def test_a_settled_rotor_warms_by_what_it_loses(coasting):
    """The scheme for settled rotors books by places too, with all that is lost."""
    result = simulate_coast_down(coasting, CoastDownCase(speed=0.02 * NOMINAL, duration=8.0))
    assert np.any(result.windows.settled[:, 0] > 0.9)
    assert float(np.sum(result.heat.taken)) == pytest.approx(result.dissipated, rel=2e-2)
    assert result.energy_residual < 1e-5 * result.energy_scale


def test_what_check_says_of_a_pair_without_a_steady_state():
    machine = loads_machine(text_of())
    summary = summarise_machine(machine)
    figures = {one.field: one for one in summary.bearings[0].figures}
    assert figures["steady_conductance_W_per_K"].value > 4.0
    said = [one for one in machine_warnings(machine, summary) if one.kind == "thermal runaway"]
    assert [one.bearing for one in said] == ["NDE", "DE"]
    better = loads_machine(text_of('ball_conductance = "40 W/K"'))
    assert "thermal runaway" not in {one.kind for one in machine_warnings(better, summarise_machine(better))}
    assert "frictional heat" not in {one.kind for one in machine_warnings(machine, summary)}


def test_a_value_of_the_heat_moves_its_columns():
    machine = loads_machine(text_of())
    changed = machine.with_values({"NDE.thermal.ball_conductance": 16.0, "NDE.thermal.race_capacity": 60.0})
    row = build_drop_model(changed, "quick").parameters.bearing[0, L.THERMAL : L.THERMAL_END]
    assert list(row[thermal.CONDUCTANCE + np.array([thermal.RACE, thermal.BALLS])]) == [16.0, 16.0]
    assert list(row[[thermal.SKIN, thermal.RACE]]) == [15.0, 45.0]
    assert loads_machine(machine_text(machine)).touchdown_bearings == machine.touchdown_bearings


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ('race_capacity = "0 J/K"', r"race_capacity.*0 J/K.*must be positive"),
        ('ball_conductance = "-4 W/K"', r"ball_conductance.*-4.*must not be negative"),
        ("slip_share = 1.2", r"slip_share.*at most"),
        ("expansion = 12e-6", r"expansion.*has no unit.*12e-6 1/K"),
        ('race_capcity = "40 J/K"', r"did you mean 'race_capacity'"),
    ],
)
def test_bad_input_is_named(table, told):
    with pytest.raises(MachineFileError, match=told):
        loads_machine(text_of(table))


def test_a_sleeve_has_no_heat():
    text = 'kind = "sleeve"\nthermal = {}'
    head, _, rest = COLD.partition("[touchdown_bearings.bearing]")
    contact = rest.index("[touchdown_bearings.contact]")
    race, support = (rest.index(f"[touchdown_bearings.{one}]") for one in ("race", "support"))
    with pytest.raises(MachineFileError, match=r"NDE cannot have a table 'thermal': heat"):
        loads_machine(f"{head}{text}\n{rest[contact:race]}{rest[support:]}")


@pytest.mark.parametrize(
    ("preload", "race", "grade", "told"),
    [
        ([500.0, 620.0, 600.0], 8.0, "good", "500 N → 600 N."),
        ([500.0, 1900.0, 1800.0], 64.0, "warning", r"64.0 K above the housing 1.00 s .*500 N → 1.80 kN."),
        ([500.0, 2900.0, 600.0], 8.0, "warning", r"500 N → 600 N, 2.90 kN at 1.00 s."),
        ([500.0, 200.0, 0.0], 8.0, "bad", r"without any from 2.00 s on: balls lie loose"),
        ([500.0, 510.0, 505.0], 140.0, "bad", r"140 K above the start its steel loses hardness"),
        ([0.0, 0.0, 0.0], 8.0, "good", r"after power-off.$"),
    ],
)
def test_the_verdict_on_a_race(preload, race, grade, told):
    warmth = np.zeros((3, 1, thermal.N_NODES))
    warmth[1, 0, [thermal.SKIN, thermal.RACE]] = race
    rows, one = np.zeros((3, 1)), np.zeros(1)
    found = heat.Heat(
        time=np.arange(3.0), temperature=warmth, growth=rows, gap=rows, preload=np.array([preload]).T,
        taken=one, gone=one, held=one,
    )  # fmt: skip
    ((text, said),) = found.sentences(("NDE",))
    assert said == grade
    assert re.search(told, text), text
