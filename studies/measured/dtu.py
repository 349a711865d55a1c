"""The force on a rotor from its motion, against the force measured on the rig of DTU (source: README.md).

    python studies/measured/dtu.py rot_sim_exp315.mat [TABLE.md]

Everything is asked of `rotordrop.estimate_force`. The unbalance has a published size and an unknown phase:
near resonance it swings the rotor by half a millimetre. Its phase is the one that leaves least force across
the pull of the magnet, where none acts; the measured force does not enter there.
"""

from __future__ import annotations

import hashlib
import math
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.optimize import least_squares, minimize_scalar

from rotordrop import ForceEstimate, Machine, Record, estimate_force, load_machine
from rotordrop.elements.sensor import Sensor
from rotordrop.files import write_text
from rotordrop.known import Known
from rotordrop.rotor.suspension import spring

FILE = "c15c57667a34df89b1b5e6e859d3c433682e423be2c3c3f21b1b935c4978a321"
"""SHA-256 of rot_sim_exp315.mat at commit 29f0ac0."""
MAGNET, BEARING, DISC, STATOR = 2, 3, 5, 6
SPIN = 2.0 * math.pi * 17.0
UNBALANCE = 1e-3 * math.hypot(0.027, 0.072)
COUPLED = [spring(BEARING, [[0.0, 2456.0], [292.0, 0.0]])]
"""Published k_xy and k_yx; their sign turns with y."""
SLOW = 60.0
"""Bandwidth [Hz] of the magnet's force."""
AROUND, CONTACT = (0.050, 0.095), (0.066, 0.0712)
"""Part of the record [s] in which the impact is estimated, and the impact."""
BEFORE, AFTER = (0.058, 0.065), (0.0725, 0.0795)
"""Where nothing touches [s]: what is found there is what model and magnet leave, and is taken off."""
Array = np.ndarray


def read(path: Path) -> tuple[Array, Record]:
    """Magnet force (N, 2) [N] and record."""
    found = hashlib.sha256(path.read_bytes()).hexdigest()
    if found != FILE:
        raise SystemExit(f"{path}: SHA-256 {found}, expected {FILE}")
    time, force, x, y = loadmat(path)["exp"].T
    time = np.arange(len(time)) / 8000.0
    sensors = (Sensor(name="x", node=DISC, angle="0 deg"), Sensor(name="y", node=DISC, angle="-90 deg"))
    record = Record(time=time, signals=np.column_stack([x, y]), sensors=sensors, sampling_rate=8000.0)
    return np.column_stack([force, 0.0 * force]), record


def unbalance_force(time: Array, phase: float) -> Array:
    """Force of the unbalance at the disc (N, 2) [N] with a phase [rad]."""
    angle = SPIN * time + phase
    return UNBALANCE * SPIN**2 * np.column_stack([np.cos(angle), np.sin(angle)])


def without_unbalance(machine: Machine) -> Machine:
    """The machine for a caller who gives the force of the unbalance."""
    return machine.model_copy(update={"unbalances": ()})


def pulled(
    machine: Machine, record: Record, phase: float | None, bandwidth: float | None = SLOW
) -> ForceEstimate:
    """Estimate of the force at the magnet."""
    known = {} if phase is None else {DISC: unbalance_force(record.time, phase)}
    described = machine if phase is None else without_unbalance(machine)
    return estimate_force(
        described, record, nodes=[MAGNET], supports=COUPLED, known_forces=known, bandwidth=bandwidth
    )


def within(record: Record | ForceEstimate, start: float, end: float) -> Array:
    """The samples between two times [s]."""
    return (record.time >= start - 1e-9) & (record.time <= end + 1e-9)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def phase_across(machine: Machine, record: Record, start: float, end: float) -> float:
    """Phase of the unbalance [rad] that leaves least force in y."""
    here = within(record, start, end)

    def across(phase: float) -> float:
        return rms(pulled(machine, record, phase).force[here, 0, 1])

    coarse = min(np.arange(0.0, 2.0 * math.pi, math.pi / 6.0), key=across)
    return float(
        minimize_scalar(
            across, bounds=(coarse - 0.5, coarse + 0.5), method="bounded", options={"xatol": 0.01}
        ).x
    )


def fitted(
    machine: Machine,
    record: Record,
    force: Array,
    phase: float,
    names: tuple[str, ...],
    start: float,
    end: float,
) -> tuple[Machine, Record, dict[str, float]]:
    """Machine and record with the factors that bring the estimate to the measured force."""
    here = within(record, start, end)

    def changed(factors: Mapping[str, float]) -> tuple[Machine, Record]:
        values = {
            "ambs.bearing.stiffness": Known(value=3.09e4 * factors.get("stiffness", 1.0)),
            "ambs.bearing.damping": Known(value=8.48 * factors.get("damping", 1.0)),
        }
        exact = {"gain": Known(value=factors.get("gain", 1.0)), "offset": Known(value=0.0)}
        sensors = tuple(one.model_copy(update=exact) for one in record.sensors)
        return machine.with_values(values), replace(record, sensors=sensors)

    def misfit(point: Array) -> Array:
        one = pulled(*changed(dict(zip(names, point, strict=True))), phase)
        return one.force[here, 0, 0] - force[: len(record.time)][here, 0]

    found = least_squares(
        misfit, np.ones(len(names)), bounds=(0.0, 5.0), diff_step=0.02, xtol=1e-3, max_nfev=12
    )
    factors = dict(zip(names, map(float, found.x), strict=True))
    return *changed(factors), factors


def factors_of(fit: tuple[Machine, Record, dict[str, float]]) -> str:
    """The factors of a fit in words."""
    return ", ".join(f"{name} × {value:.2f}" for name, value in fit[2].items())


def against(found: ForceEstimate, force: Array, start: float, end: float) -> str:
    """Cells of the table: rms, bias, slope, coverage and half width of the band."""
    here = within(found, start, end)
    true, got = force[: len(found.time)][here, 0], found.force[here, 0, 0]
    held = (found.lower[here, 0, 0] <= true) & (true <= found.upper[here, 0, 0])
    slope = np.polyfit(true, got, 1)[0]
    half = float(np.mean(found.upper[here, 0, 0] - got))
    exact = "ambs.bearing.stiffness" in found.taken_as_exact
    band = "– | –" if exact else f"{100.0 * np.mean(held):.0f} | ±{half:.1f}"
    return (
        f"{rms(got - true):.2f} | {np.mean(got - true):+.2f} | {slope:.2f} "
        f"| {rms(found.force[here, 0, 1]):.2f} | {band}"
    )


def impact(
    text: str, machine: Machine, whole: Record, force: Array, phase: float, bandwidth: float | None
) -> str:
    """One row on the impact: the force at the stator where magnet and unbalance are known."""
    record = whole.window(*AROUND)
    pull = force[within(whole, *AROUND)]
    known = {MAGNET: pull, DISC: unbalance_force(record.time, phase)}
    found = estimate_force(
        without_unbalance(machine),
        record,
        nodes=[STATOR],
        supports=COUPLED,
        known_forces=known,
        bandwidth=bandwidth,
    )
    at, beside = within(found, *CONTACT), within(found, *BEFORE) | within(found, *AFTER)
    contact = found.force[:, 0] - found.force[beside, 0].mean(axis=0)
    impulse = np.trapezoid(contact[at], found.time[at], axis=0)
    mean = (np.hypot(*contact[at].T)[:, None] * found.displacement[at, 0]).sum(axis=0)
    across = math.degrees(math.atan2(mean[1] * impulse[0] - mean[0] * impulse[1], -mean @ impulse))
    seen = whole.along[within(whole, *CONTACT)]
    return (
        f"| {text} | {found.bandwidth:.0f} | {np.hypot(*impulse):.4f} "
        f"| {math.degrees(math.atan2(-impulse[1], impulse[0])):.1f} | {across:+.1f} "
        f"| {np.hypot(*contact[at].T).max():.1f} | {1e3 * np.hypot(*seen.T).max():.4f} |"
    )


def main() -> None:
    force, record = read(Path(sys.argv[1]))
    machine = load_machine(Path(__file__).with_name("dtu.toml"))
    before = record.window(0.0, 0.066)
    lines = [
        "| what is given | stretch, ms | rms, N | bias, N | slope | rms across, N | held, % | band, N |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
    ]

    def row(text: str, found: ForceEstimate, start: float = 0.004, end: float = 0.064) -> None:
        line = f"| {text} | {1e3 * start:.0f} to {1e3 * end:.0f} | {against(found, force, start, end)} |"
        print(line, flush=True)
        lines.append(line)

    phase = phase_across(machine, before, 0.004, 0.064)
    print("phase", math.degrees(phase))
    row("published, phase of the unbalance unknown", pulled(machine, before, None))
    row("published, phase from the direction across", pulled(machine, before, phase))
    row("the same, bandwidth by likelihood", pulled(machine, before, phase, None))
    three = fitted(machine, before, force, phase, ("gain", "stiffness", "damping"), 0.004, 0.064)
    row(f"fitted on this stretch: {factors_of(three)}", pulled(three[0], three[1], phase))
    early = record.window(0.0, 0.042)
    phase_then = phase_across(machine, early, 0.004, 0.040)
    one = fitted(machine, early, force, phase_then, ("stiffness",), 0.004, 0.040)
    foretold = pulled(one[0], replace(before, sensors=one[1].sensors), phase_then)
    row(f"fitted to 40 ms: {factors_of(one)}", foretold, 0.043, 0.064)
    lines += [
        "",
        "| machine | up to, Hz | impulse, N s | direction, ° | off the radius, ° | peak, N | farthest, mm |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for text, (described, seen) in {
        "published": (machine, record),
        "three fitted": three[:2],
    }.items():
        whole = replace(record, sensors=seen.sensors)
        for bandwidth in (150.0, 300.0, 539.0):
            line = impact(text, described, whole, force, phase, bandwidth)
            print(line, flush=True)
            lines.append(line)
    print("\n".join(lines))
    if len(sys.argv) > 2:
        write_text(sys.argv[2], "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
