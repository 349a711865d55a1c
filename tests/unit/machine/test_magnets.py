"""Magnets and controllers in a machine file: what follows from them, what is refused, what check says."""

from __future__ import annotations

import json

import pytest
from tests.unit.simulate.looped import CONTROLLER, MAGNET, looped_machine

from rotordrop.cli.app import run
from rotordrop.machine import example_machine, loads_machine
from rotordrop.machine.saving import machine_text, save_machine

STATE_SPACE = {
    "kind": "state_space",
    "a": [[1.0, 0.0], [0.5, 0.25]],
    "b": [1e-4, 1.0],
    "c": [3e5, -20.0],
    "d": 2e4,
}


def with_tables(magnet=None, controller=None):
    paper = example_machine("paper")
    tables = {"magnet": magnet, "controller": controller}
    return paper.changed(ambs=tuple(amb.changed(**tables) for amb in paper.ambs))


def test_stiffness_and_damping_follow_from_the_gains():
    amb = looped_machine().ambs[0]
    by_current, by_way = amb.magnet.slopes
    assert amb.stiffness.value == pytest.approx(by_current * 14600.0 - by_way)
    assert amb.damping.value == pytest.approx(30.0 * by_current)
    assert amb.magnet.current_limit.value == 4.0


@pytest.mark.parametrize("controller", [CONTROLLER, STATE_SPACE])
def test_a_machine_with_a_loop_comes_back_from_its_file(controller):
    machine = with_tables(MAGNET, controller)
    assert loads_machine(machine_text(machine)) == machine


@pytest.mark.parametrize(
    ("magnet", "controller", "told"),
    [
        (None, CONTROLLER, "a controller needs its magnet"),
        (
            MAGNET,
            CONTROLLER | {"proportional": "7 kA/m"},
            r"7.*kA/m does not hold the rotor: .*k_s/k_i .* 7.27",
        ),
        (
            MAGNET | {"gap": "0.25 mm"},
            CONTROLLER | {"proportional": "40 kA/m"},
            "gap of 250 µm, and a touchdown bearing lets the rotor move by 285",
        ),
        (MAGNET, {"derivative": "3 A s/m"}, 'of kind "pid" needs a gain'),
        (MAGNET, CONTROLLER | {"a": [[1.0]]}, "'a' does not belong to a controller of kind 'pid'"),
        (MAGNET, STATE_SPACE | {"integral": "1 A/(m s)"}, "'integral' does not belong to .* 'state_space'"),
        (MAGNET, STATE_SPACE | {"b": [1.0]}, "a has 2 rows, b 1 and c 2 entries"),
        (MAGNET, CONTROLLER | {"delay": "400 us"}, "delay of 400 µs is longer than 7 sample times, 350 µs"),
        (MAGNET, CONTROLLER | {"sensor": "S9"}, "measures with sensor 'S9', which does not exist"),
        (MAGNET | {"turns": -3}, CONTROLLER, "must be positive"),
    ],
)
def test_tables_that_do_not_fit_are_refused(magnet, controller, told):
    with pytest.raises(ValueError, match=told):
        with_tables(magnet, controller)


def test_controllers_of_another_beat_are_refused():
    paper = example_machine("paper")
    one, other = paper.ambs
    ambs = (
        one.changed(magnet=MAGNET, controller=CONTROLLER),
        other.changed(magnet=MAGNET, controller=CONTROLLER | {"sample_time": "60 us"}),
    )
    with pytest.raises(ValueError, match="AMBs DE and NDE have another sample time or delay"):
        paper.changed(ambs=ambs)


def test_a_sensor_plane_beside_the_magnet_is_measured():
    machine = looped_machine(controller={"sensor": "S_DE_A"})
    sensor = next(one for one in machine.sensors if one.name == "S_DE_A")
    assert machine.measured_node(machine.ambs[0]) == sensor.node != machine.ambs[0].node


def test_check_states_the_operating_point_and_the_margins(tmp_path, capsys):
    save_machine(looped_machine(), tmp_path / "good.toml")
    assert run(["check", str(tmp_path / "good.toml"), "--json", str(tmp_path / "out.json")]) == 0
    text = capsys.readouterr().out
    for said in ("force by current", "368.4 N/A", "phase margin", "longest delay, bending included"):
        assert said in text
    numbers = json.loads((tmp_path / "out.json").read_text())
    assert numbers["control_loop"]["stable"]
    assert numbers["magnets"]["DE"]["negative_stiffness_N_per_m"] == pytest.approx(2.6796e6, rel=1e-4)


def test_check_says_that_a_loop_is_unstable_and_a_magnet_too_weak(tmp_path, capsys):
    machine = looped_machine({"turns": 120}, {"delay": "150 us"})
    save_machine(machine, tmp_path / "bad.toml")
    assert run(["check", str(tmp_path / "bad.toml"), "--all"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "the control loop is unstable: motion at" in text
    assert "DE: at full current it lacks" in text
