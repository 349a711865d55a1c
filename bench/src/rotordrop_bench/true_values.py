"""The truth of a synthetic drop: motion at any time, and numbers by the paths of an estimate."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.table import published
from rotordrop.machine import Machine
from rotordrop.machine.saving import machine_text
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop.series import refined_peak
from rotordrop.simulate.levitation import levitated_orbit, levitated_static
from rotordrop.simulate.result import DropResult
from rotordrop_bench.departures import DEPARTURES, Parts
from rotordrop_bench.event import DropConditions, HiddenMachine
from rotordrop_bench.sensor_chain import SensorChain, SensorErrors, true_places
from rotordrop_bench.structure import support_matrices
from rotordrop_bench.violations import Violations

WHOLE, SETTLING = 0.2, (0.15, 0.2)
CONTACT_WINDOW = 0.25
"""Windows of loads, of the settled force and of contacts [s], by definition."""
MPA = 1e-6
STATED = {path: row for path, row in published().items() if path != "equivalent_stiffness_N_per_m"}
"""Values that the description of a bearing has, by their path in an estimate."""


def true_motion(
    hidden: HiddenMachine, result: DropResult, conditions: DropConditions, time: Array
) -> tuple[Array, Array, Array]:
    """Modal amplitudes (N, 2m), rotor angle [rad] and speed [rad/s] at times from the true power-off [s].

    Before power-off the levitated orbit, afterwards the simulated drop, between its samples by cubics.
    """
    from scipy.interpolate import CubicHermiteSpline

    layout = hidden.model.layout
    m = layout.n_modes
    floating = time < 0.0
    orbit = levitated_orbit(hidden.model, conditions.speed, conditions.start.orbit)
    static, _ = levitated_static(hidden.model, conditions.start.offset)
    angle = conditions.start.rotor_angle + conditions.speed * time
    turn = np.exp(1j * angle[floating])[:, None]
    amplitudes = np.empty((len(time), 2 * m))
    amplitudes[floating] = static.T.ravel() + (turn * orbit.T.ravel()).real
    n_q = layout.n_coordinates
    states = result.state
    path = CubicHermiteSpline(result.time, states[:, : 2 * m], states[:, n_q : n_q + 2 * m])
    amplitudes[~floating] = path(time[~floating])
    angle[~floating] = np.interp(time[~floating], result.time, states[:, layout.rotor_angle])
    speed = np.interp(time, result.time, result.speed)
    return amplitudes, angle, speed


def housing_motion(result: DropResult, time: Array) -> Array:
    """Displacement of the supports [m], shape (N, B, 2), at times from power-off [s]; at rest before it."""
    moved = result.support_displacement.reshape(len(result.time), -1)
    found = [np.interp(time, result.time, column) for column in moved.T]
    return np.stack(found, axis=-1).reshape(len(time), *result.support_displacement.shape[1:])


def true_values(
    hidden: HiddenMachine,
    result: DropResult,
    conditions: DropConditions,
    chain: SensorChain,
    errors: SensorErrors,
    name: str,
) -> dict[str, Any]:
    """Everything that is true about a drop, ready for JSON; times from the true power-off."""
    start = conditions.start
    force = np.zeros((len(hidden.machine.ambs), 2)) if start.remanent_force is None else start.remanent_force
    return {
        "name": name,
        "origin": "simulated, not measured",
        "n0_hz": conditions.speed / (2.0 * math.pi),
        "fs": chain.sampling_rate,
        "t_off_in_record_s": conditions.jitter,
        **_loads(result),
        **_motion(result),
        **machine_truth(hidden.machine, hidden.violations),
        "structure": true_structure(hidden, conditions, errors),
        "violated": list(violated_kinds(hidden.violations)),
        "rotor_angle_at_power_off_rad": start.rotor_angle,
        "remanent_force": [
            {"vertical_N": float(y), "x_N": float(x), "time_constant_s": start.remanence_time_constant}
            for x, y in np.asarray(force)
        ],
        **{
            f"sensor_{key}": (abs(one) if "runout" in key else one).tolist()
            for key, one in vars(errors).items()
        },
        "sensor_chain": asdict(chain),
        "violations": {**hidden.violations.given, "machine_seed": hidden.seed},
        "machine": machine_text(hidden.machine),
    }


def _loads(result: DropResult) -> dict[str, Any]:
    names = result.bearing_names
    whole = result.time <= WHOLE + 1e-9
    late = whole & (result.time >= SETTLING[0])
    time, force, stress = result.time[whole], result.bearing_force_magnitude, result.max_stress
    # the certificate's own refinement reads a peak between samples; of a stress as of megapascals
    peaks = {b: refined_peak(time, force[whole, i]) for i, b in enumerate(names)}
    top = {b: refined_peak(time, MPA * stress[whole, i]) for i, b in enumerate(names)}
    values: dict[str, Any] = {
        "peak_force_N": {b: peak[0] for b, peak in peaks.items()},
        "peak_force_time_s": {b: peak[1] for b, peak in peaks.items()},
        "peak_stress_Pa": {b: peak[0] / MPA for b, peak in top.items()},
        "mean_stress_Pa": _each(names, np.mean(stress[whole], axis=0)),
    }
    if result.time[-1] >= WHOLE - 1e-9:
        values["mean_force_0p15_0p2_N"] = _each(names, np.mean(force[late], axis=0))
    return values


def _each(names: tuple[str, ...], numbers: Array) -> dict[str, float]:
    return {name: float(number) for name, number in zip(names, numbers, strict=True)}


def _motion(result: DropResult) -> dict[str, Any]:
    names = result.bearing_names
    end = min(CONTACT_WINDOW, result.time[-1])
    intervals: dict[str, list[list[float]]] = {}
    for index, name in enumerate(names):
        log = result.contacts.of_bearing(index)
        found = np.column_stack([log.start, log.end, log.peak_force])
        found[:, 1] = np.fmin(found[:, 1], end)
        intervals[name] = found[found[:, 0] < CONTACT_WINDOW].tolist()
    first = {name: rows[0] for name, rows in intervals.items() if rows}
    furthest = np.linalg.norm(result.displacement, axis=-1).max(axis=0)
    return {
        "max_radial_displacement_m": _each(names, furthest),
        "first_contact_time_s": {name: row[0] for name, row in first.items()},
        "contact_intervals_0_0p25_s": intervals,
    }


def machine_truth(machine: Machine, broken: Violations | None = None) -> dict[str, Any]:
    """True values of a machine [SI]: of each bearing by the path that an estimate has.

    A contact whose law is no power has neither stiffness nor exponent; of a support with turned axes it is
    stiffness and damping in y that are published, and their ratio.
    """
    bearings = machine.touchdown_bearings
    values = {path: {b.name: float(row.described(b)) for b in bearings} for path, row in STATED.items()}
    series = values["equivalent_stiffness_N_per_m"] = {}  # by the tangent of the bearing at its static load
    for bearing, load in zip(bearings, bearing_load_shares(machine), strict=True):
        parts = numbers_of(bearing).tangent_stiffness(float(load)), float(bearing.support.stiffness)
        series[bearing.name] = parts[0] * parts[1] / sum(parts)
        own = (broken or Violations()).of_bearing(bearing.name)
        if own["contact.law"]:
            for path in ("contact.stiffness_N_per_m_n", "contact.exponent"):
                del values[path][bearing.name]
        if own["support.axes_angle"] != 0.0:
            matrix = support_matrices(bearing, own)
            values["support.stiffness_N_per_m"][bearing.name] = matrix["K_yy"]
            values["support.damping_N_s_per_m"][bearing.name] = matrix["C_yy"]
            values["support.anisotropy"][bearing.name] = matrix["K_xx"] / matrix["K_yy"]
    return values


KINDS: dict[str, Parts] = {"one end held": {"magnets": {"stays_on": ()}}, **DEPARTURES}
"""Names of the kinds of violations, with the parts and keys of a case file that make them."""


def violated_kinds(violations: Violations) -> tuple[str, ...]:
    """Names of the kinds of violations that a case holds, in the order of `KINDS`."""
    alone = violations.given.get("bearing", {}).values()
    given = {
        (part, key)
        for own in (violations.given, *alone)
        for part, keys in own.items()
        if part != "bearing"
        for key in keys
    }
    return tuple(
        kind
        for kind, parts in KINDS.items()
        if any((part, key) in given for part, keys in parts.items() for key in keys)
    )


def true_structure(
    hidden: HiddenMachine, conditions: DropConditions, errors: SensorErrors
) -> dict[str, float]:
    """True values of the structures of an estimate [SI] by path; absent ones as that means them."""
    values: dict[str, float] = {}
    for bearing in hidden.machine.touchdown_bearings:
        v, support = hidden.violations.of_bearing(bearing.name), bearing.support
        matrix, mass, own = support_matrices(bearing, v), v["foundation.mass"], f"{bearing.name}.support."
        deflection = v["support.hardening_force"] / float(support.stiffness)
        damped = matrix["C_xx"] * matrix["C_yy"]
        values |= {
            own + "coupling": matrix["K_xy"] / math.sqrt(matrix["K_xx"] * matrix["K_yy"]),
            own + "damping_coupling": matrix["C_xy"] / math.sqrt(damped) if damped > 0.0 else 0.0,
            own + "cubic": v["support.hardening"] / deflection**2,
            own + "foundation_share": 0.0 if mass is None else float(support.mass) / mass,
        }
        if mass is not None:
            values[own + "foundation_frequency"] = 2.0 * math.pi * v["foundation.frequency"]
            values[own + "foundation_damping_ratio"] = v["foundation.damping_ratio"]
    stated = hidden.machine.rotor.node_positions
    places = true_places(hidden.machine, errors)
    for i, sensor in enumerate(hidden.machine.sensors):
        mine = {name: getattr(errors, name)[i] for name in ("time_constant", "cross_axis", "follows_housing")}
        mine["plane_offset"] = places[i] - stated[sensor.node - 1]
        values |= {f"sensors.{sensor.name}.{path}": float(value) for path, value in mine.items()}
    values["rotor.stiffness_factor"] = hidden.violations["rotor.youngs_modulus"]
    values["clock_error"] = hidden.violations["sensors.clock_error"]
    # steady force in +x over the weight: gravity on a tilted machine, and what pushes the rotor
    values["side_force"] = math.sin(hidden.violations["stand.tilt"])
    if (side := hidden.violations["side_force.force"]) is not None:
        values["side_force"] += side / (hidden.machine.rotor.mass * float(hidden.machine.gravity))
    values["remanence.time_constant"] = conditions.start.remanence_time_constant
    return values
