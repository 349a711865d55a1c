"""Lifts from the touchdown bearings in simulation: what the operating point predicts, and what happens.

Usage: python studies/relevitate/lifts.py [LIFTS] [SEED]

The machine of the paper with magnets and a PID in the loop is let go, falls, and 0.4 s later the magnets
take it up again. Speed, rotor angle, friction, gap of the magnets, current limit and voltage are drawn. Three
predictions are compared with the simulation: by the slopes k_i and k_s, by the true pull at full current on
the rotor at rest, and by the same with a gap that is 30 µm wrong either way. Prints the table.
"""

from __future__ import annotations

import sys

import numpy as np

from rotordrop.errors import RotordropError
from rotordrop.machine import Machine, example_machine
from rotordrop.rotor.magnet_loop import magnet_summaries
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate.case import DropCase, LevitatedStart, MagnetEvent
from rotordrop.simulate.drop import simulate_drop

MAGNET = {
    "turns": 200,
    "pole_area": "6 cm^2",
    "gap": "0.55 mm",
    "bias": "4 A",
    "resistance": "0.5 ohm",
    "voltage": "150 V",
    "current_limit": "4 A",
    "bandwidth": "2 kHz",
}
CONTROLLER = {
    "proportional": "14.6 kA/m",
    "integral": "300 kA/(m s)",
    "derivative": "30 A s/m",
    "filter": "5 kHz",
    "sample_time": "50 us",
    "delay": "50 us",
}
BEGUN, END = 0.4, 0.55
WRONG = 30e-6
SPEEDS = (10.0, 60.0, 110.0, 160.0, 210.0)
EVENTS = (MagnetEvent(action="off", time=0.0), MagnetEvent(action="levitate", time=BEGUN))


def looped(machine: Machine) -> Machine:
    ambs = (amb.changed(magnet=MAGNET, controller=CONTROLLER) for amb in machine.ambs)
    return machine.changed(ambs=tuple(ambs))


def main(lifts: int, seed: int) -> None:
    machine = looped(example_machine("paper"))
    model = build_drop_model(machine, loops=True)
    names = [amb.name for amb in machine.ambs]

    def with_magnets(gap: float, limit: float, voltage: float, **more: float) -> Machine:
        values = {f"ambs.{n}.magnet.gap": gap for n in names}
        values |= {f"ambs.{n}.magnet.current_limit": limit for n in names}
        values |= {f"ambs.{n}.magnet.voltage": voltage for n in names}
        return machine.with_values(values | {path.replace("__", "."): one for path, one in more.items()})

    def predicted(one: Machine, linear: bool = False) -> bool:
        found = magnet_summaries(one, model.fe)
        return all((m.lift.spare if linear else m.spare_at_rest) > 0.0 for m in found)

    rows = []
    for number in range(lifts):
        rng = np.random.default_rng((seed, number))
        gap, limit = rng.uniform(0.5e-3, 0.6e-3), rng.uniform(2.0, 4.0)
        voltage, speed = rng.choice([20.0, 150.0]), rng.uniform(SPEEDS[0], SPEEDS[-1])
        friction, angle = rng.uniform(0.05, 0.2), rng.uniform(0.0, 2.0 * np.pi)
        drawn = with_magnets(
            gap, limit, voltage, NDE__friction__dynamic=friction, DE__friction__dynamic=friction
        )
        case = DropCase(
            speed=2.0 * np.pi * speed,
            duration=END,
            output_step=1e-4,
            start=LevitatedStart(rotor_angle=angle),
            magnets=EVENTS,
        )
        try:
            result = simulate_drop(model.with_machine(drawn), case)
        except RotordropError as error:
            print(f"lift {number}: {error}", file=sys.stderr)
            continue
        lift = result.lift
        assert lift is not None
        took = lift.free_from - lift.begun if lift.succeeded and lift.free_from is not None else np.nan
        rows.append(
            (
                lift.succeeded,
                predicted(drawn, linear=True),
                predicted(drawn),
                predicted(with_magnets(gap + WRONG, limit, voltage)),
                predicted(with_magnets(gap - WRONG, limit, voltage)),
                speed,
                voltage,
                took,
            )
        )
    told(np.array(rows, dtype=float), lifts)


def told(table: np.ndarray, lifts: int) -> None:
    true = table[:, 0] > 0.5
    print(f"{len(table)} lifts simulated, {lifts - len(table)} refused; {np.sum(true)} succeed")
    print("\n| prediction | right | said to lift, does not | said not to, lifts |\n| --- | --- | --- | --- |")
    labels = (
        "slopes k_i and k_s",
        "true pull at full current",
        "the same, gap 30 µm too large",
        "30 µm too small",
    )
    for label, column in zip(labels, range(1, 5), strict=True):
        said = table[:, column] > 0.5
        right, vain, surprised = np.sum(said == true), np.sum(said & ~true), np.sum(~said & true)
        print(f"| {label} | {right} of {len(table)} | {vain} | {surprised} |")
    print(
        "\n| speed at the release | voltage | lifts that succeed | median time |\n| --- | --- | --- | --- |"
    )
    for k, low in enumerate(SPEEDS[:-1]):
        for voltage in (150.0, 20.0):
            here = (table[:, 5] >= low) & (table[:, 5] < SPEEDS[k + 1]) & (table[:, 6] == voltage)
            took = table[here & true, 7]
            time = f"{1e3 * np.median(took):.1f} ms" if len(took) else "–"
            count = f"{np.sum(true & here)} of {np.sum(here)}"
            print(f"| {low:g} to {SPEEDS[k + 1]:g} Hz | {voltage:g} V | {count} | {time} |")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200, int(sys.argv[2]) if len(sys.argv) > 2 else 401)
