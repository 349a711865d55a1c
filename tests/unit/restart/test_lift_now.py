"""Whether the magnets lift the rotor from where it rests: simulated lifts, and what the card says of them."""

from __future__ import annotations

import pytest
from tests.unit.simulate.looped import looped_machine

from rotordrop.known import Known
from rotordrop.machine import example_machine
from rotordrop.restart.card import _of_lift
from rotordrop.restart.foreseen import LiftNow
from rotordrop.restart.next_drop import lift_now
from rotordrop.rotor.magnet_loop import carrying_currents
from rotordrop.rotor.parameters import build_drop_model


def test_strong_magnets_lift_every_time_and_weak_ones_never() -> None:
    strong, weak = (
        lift_now(looped_machine({"current_limit": amount}), lifts=2) for amount in ("4 A", "0.5 A")
    )
    assert strong is not None and weak is not None
    assert strong.probability.value == 1.0 and strong.probability.drops == 2
    assert strong.took is not None and 0.0 < strong.took[0] <= strong.took[1] < 0.1
    assert weak.probability.value == 0.0 and weak.took is None
    assert set(weak.current.values()) == {None} and set(weak.limit.values()) == {0.5}


def test_a_magnet_that_is_a_spring_is_not_lifted_with() -> None:
    assert lift_now(example_machine("paper")) is None


def test_the_current_that_carries_pulls_with_the_weight() -> None:
    machine = looped_machine()
    model = build_drop_model(machine)
    depth = max(float(bearing.air_gap) for bearing in machine.touchdown_bearings)
    needed = carrying_currents(machine, model.fe)
    pulls = [amb.magnet.pull(-depth, needed[amb.name]) for amb in machine.ambs]  # type: ignore[union-attr, arg-type]
    assert sum(pulls) == pytest.approx(machine.rotor.mass * float(machine.gravity))


def test_the_card_says_how_often_how_fast_and_with_which_current() -> None:
    often = Known(value=0.75, status="estimated", interval_90=(0.47, 0.93), drops=12)
    lift = LiftNow(
        probability=often, took=(0.014, 0.02), current={"NDE": 1.2, "DE": None}, limit={"NDE": 4.0, "DE": 4.0}
    )
    (said,) = _of_lift(lift)
    for words in (
        "9 of 12 simulated lifts succeed",
        "47 %",
        "93 %",
        "14.0 ms to 20.0 ms",
        "1.2 A of 4 A of NDE",
        "more than the 4 A of DE",
    ):
        assert words in said, said
    assert list(_of_lift(None)) == []
