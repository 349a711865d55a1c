"""The truth of a synthetic drop: numbers and histories, laid out like the supplied truth files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from operator import attrgetter
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.parameter import Step
from rotordrop.elements.race_bearing import numbers_of
from rotordrop.elements.table import rows
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.machine import Machine
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop.simulate.certificate import refined_peak
from rotordrop.simulate.result import DropResult
from rotordrop_bench.event import DropConditions, HiddenMachine
from rotordrop_bench.motion import true_motion
from rotordrop_bench.sensor_chain import SensorChain, SensorErrors, true_places
from rotordrop_bench.structure import support_matrices
from rotordrop_bench.violations import BearingViolations, Violations

WHOLE, SETTLING = 0.2, (0.15, 0.2)
HISTORY_BEFORE, CONTACT_WINDOW = 0.02, 0.25
"""Windows of loads and of the settled force, and what histories and contacts hold [s], by definition those of
the supplied truth files."""
MPA = 1e-6


def true_values(
    hidden: HiddenMachine,
    result: DropResult,
    conditions: DropConditions,
    chain: SensorChain,
    errors: SensorErrors,
    rest: Array,
    name: str,
) -> dict[str, Any]:
    """Everything that is true about a drop, ready for JSON; times from the true power-off."""
    start = conditions.start
    force = np.zeros((len(hidden.machine.ambs), 2)) if start.remanent_force is None else start.remanent_force
    structure = true_structure(hidden, conditions, errors)
    return {
        "name": name,
        "origin": "simulated, not measured",
        "n0_hz": conditions.speed / (2.0 * math.pi),
        "fs": chain.sampling_rate,
        "t_off_in_record_s": conditions.jitter,
        **_loads(result),
        **_motion(hidden, result, rest),
        **machine_truth(hidden.machine),
        **_replaced(hidden),
        "structure": structure,
        "violated": list(violated_kinds(hidden.violations)),
        "rotor_angle_at_power_off_rad": start.rotor_angle,
        "levitated_offset_m": None if start.offset is None else np.asarray(start.offset).tolist(),
        "remanent_force": [
            {"vertical_N": float(y), "x_N": float(x), "time_constant_s": start.remanence_time_constant}
            for x, y in np.asarray(force)
        ],
        "sensor_gain": errors.gain.tolist(),
        "sensor_offset_m": errors.offset.tolist(),
        "sensor_angle_error_rad": errors.angle.tolist(),
        "sensor_plane_shift_m": errors.plane_shift.tolist(),
        "sensor_cross_axis": errors.cross_axis.tolist(),
        "sensor_follows_housing": errors.follows_housing.tolist(),
        "sensor_time_constant_s": errors.time_constant.tolist(),
        "noise_rms_m": chain.noise,
        "hum_50hz_m": chain.hum,
        "runout_1x_m": np.abs(errors.runout_1x).tolist(),
        "runout_2x_m": np.abs(errors.runout_2x).tolist(),
        "bits": chain.bits,
        "anti_alias_hz": chain.anti_alias_frequency,
        "violations": hidden.violations.values() | {"machine_seed": hidden.seed},
        "time_note": "times are from power-off; record time = t_off_in_record_s + t; unbalance phases are "
        "relative to the (unknown) rotor mark; axes x horizontal, y up",
    }


def _loads(result: DropResult) -> dict[str, Any]:
    names = result.bearing_names
    whole = result.time <= WHOLE + 1e-9
    late = whole & (result.time >= SETTLING[0])
    time, force, stress = result.time[whole], result.bearing_force_magnitude, result.max_stress
    peaks = {b: refined_peak(time, force[whole, i]) for i, b in enumerate(names)}
    top = {b: refined_peak(time, MPA * stress[whole, i]) for i, b in enumerate(names)}
    values: dict[str, Any] = {
        "peak_force_N": {b: peak[0] for b, peak in peaks.items()},
        "peak_force_time_s": {b: peak[1] for b, peak in peaks.items()},
        "peak_contact_force_N": _each(names, np.max(result.contact_force[whole], axis=0)),
        "rms_force_0_0p2_N": _each(names, np.sqrt(np.mean(force[whole] ** 2, axis=0))),
        "max_stress_MPa": {b: peak[0] for b, peak in top.items()},
        "mean_stress_MPa": _each(names, MPA * np.mean(stress[whole], axis=0)),
        "median_stress_MPa": _each(names, MPA * np.median(stress[whole], axis=0)),
        "stress_q1_MPa": _each(names, MPA * np.quantile(stress[whole], 0.25, axis=0)),
        "stress_q3_MPa": _each(names, MPA * np.quantile(stress[whole], 0.75, axis=0)),
        "stress_std_MPa": _each(names, MPA * np.std(stress[whole], axis=0)),
    }
    if result.time[-1] >= WHOLE - 1e-9:
        values["mean_force_0p15_0p2_N"] = _each(names, np.mean(force[late], axis=0))
        values["speed_0p2_Hz"] = float(result.speed[whole][-1]) / (2.0 * math.pi)
        values["ring_speed_0p2_Hz"] = _each(names, result.race_speed[whole][-1] / (2.0 * math.pi))
    return values


def _each(names: tuple[str, ...], numbers: Array) -> dict[str, float]:
    return {name: float(number) for name, number in zip(names, numbers, strict=True)}


def _motion(hidden: HiddenMachine, result: DropResult, rest: Array) -> dict[str, Any]:
    names, layout = result.bearing_names, hidden.model.layout
    shape = hidden.model.parameters.bearing_shape
    start, end = result.state[0], min(CONTACT_WINDOW, result.time[-1])
    intervals: dict[str, list[list[float]]] = {}
    for index, name in enumerate(names):
        log = result.contacts.of_bearing(index)
        found = np.column_stack([log.start, log.end, log.peak_force])
        if hidden.model.layout.departing:
            found = _contacts_on_the_grid(
                result.time, result.indentation[:, index], result.contact_force[:, index]
            )
        found[:, 1] = np.fmin(found[:, 1], end)
        intervals[name] = found[found[:, 0] < CONTACT_WINDOW].tolist()
    first = {name: rows[0] for name, rows in intervals.items() if rows}
    planes = (layout.modal_x, layout.modal_y)
    return {
        "max_radial_displacement_m": _each(names, np.linalg.norm(result.displacement, axis=-1).max(axis=0)),
        # with one end held nobody knows how long it stays so
        **(
            {}
            if hidden.violations.magnets.stays_on
            else {
                "settled_radius_um": _each(names, 1e6 * np.hypot(*(shape @ rest[plane] for plane in planes)))
            }
        ),
        "initial_xy_at_bearings_m": result.displacement[0].tolist(),
        "initial_velocity_xy_m_s": np.column_stack(
            [shape @ start[layout.velocity_of(plane)] for plane in planes]
        ).tolist(),
        "first_contact_time_s": {name: row[0] for name, row in first.items()},
        "first_contact_duration_s": {name: row[1] - row[0] for name, row in first.items()},
        "contact_intervals_0_0p25_s": intervals,
    }


def _contacts_on_the_grid(time: Array, delta: Array, force: Array) -> Array:
    """Start and end [s] and peak force [N] of contacts, shape (R, 3), from the output grid.

    The truth of version 1 of the bench has them so where a machine departs; the log of the loop is finer.
    """
    touches = np.concatenate([[False], delta > 0.0, [False]])
    rows = []
    for i, j in np.flatnonzero(np.diff(touches.astype(int))).reshape(-1, 2):
        ends = [float(time[0]), math.nan]
        for side, at in enumerate((i - 1, j - 1)):
            if 0 <= at < len(time) - 1:  # a straight line between two samples
                share = delta[at] / (delta[at] - delta[at + 1])
                ends[side] = float(time[at] + share * (time[at + 1] - time[at]))
        peak = refined_peak(time[i:j], force[i:j])[0] if j - i > 2 else float(force[i:j].max())
        rows.append((*ends, peak))
    return np.array(rows).reshape(-1, 3)


_PARTS: Mapping[str, Mapping[str, str]] = {
    "contact": {
        "n": "contact.exponent",
        "K": "contact.stiffness",
        "lam": "contact.damping",
        "q": "",
        "gap": "air_gap",
        "r_bore": "bore_radius",
        "mu_s": "friction.static",
        "mu_d": "friction.dynamic",
        "v_stribeck": "friction.stribeck_speed",
        "v_smooth": "friction.smoothing_speed",
    },
    "support": {
        "m": "support.mass",
        "K": "support.stiffness",
        "C": "support.damping",
        "m_horizontal": "support.mass_horizontal",
        "K_horizontal": "support.stiffness_horizontal",
        "C_horizontal": "support.damping_horizontal",
    },
    "ring": {"m": "race.mass", "Ip": "race.inertia"},
    "bearing": {
        "Cb_over_Kb": "damping_time",
        "drag_mu": "race.drag_coefficient",
        "drag_omega0": "race.drag_speed",
    },
}
"""Fields of the supplied truth files that are lists over the bearings, and where a bearing has their values;
the power of the damping in the contact is always one. What a row of the parameters says beside joins them."""


def machine_truth(machine: Machine) -> dict[str, Any]:
    """True parameters of a machine, in the fields of the supplied truth files."""
    bearings = machine.touchdown_bearings
    described = (row for row in rows("bearing") if len(row.truth) == 1 and row.step is not Step.FIRST_CONTACT)
    series = {}  # support and bearing in series [N/m], the bearing by its tangent at the static load
    for bearing, load in zip(bearings, bearing_load_shares(machine), strict=True):
        tangent, support = (
            numbers_of(bearing).tangent_stiffness(float(load)),
            float(bearing.support.stiffness),
        )
        series[bearing.name] = support * tangent / (support + tangent)

    def stated(part: str, bearing: TouchdownBearing) -> dict[str, float]:
        own = (row for row in rows("bearing") if len(row.truth) == 2 and row.truth[0] == part)
        return {row.truth[1]: float(row.described(bearing)) for row in own}

    parts = {
        part: [
            {key: float(attrgetter(path)(b)) if path else 1 for key, path in paths.items()} | stated(part, b)
            for b in bearings
        ]
        for part, paths in _PARTS.items()
    }
    constant = machine.speed.aero_time_constant
    return {
        **{row.truth[0]: {b.name: float(row.described(b)) for b in bearings} for row in described},
        "rotor_weight_N": machine.rotor.mass * float(machine.gravity),
        "equivalent_stiffness": series,
        "friction_dynamic": float(bearings[0].friction.dynamic),
        "friction_static": float(bearings[0].friction.static),
        "tau_aero": None if constant is None else float(constant),
        **parts,
        "bearing": [numbers_of(b).truth() | ring for b, ring in zip(bearings, parts["bearing"], strict=True)],
        "unbalance": [
            {"node": u.node, "U": float(u.amount), "phase": float(u.phase)} for u in machine.unbalances
        ],
        "modal_damping": float(machine.rotor.modal_damping),
        "amb": {
            "nodes": [a.node for a in machine.ambs],
            "K": [float(a.stiffness) for a in machine.ambs],
            "C": [float(a.damping) for a in machine.ambs],
        },
    }


def _replaced(hidden: HiddenMachine) -> dict[str, Any]:
    """Fields of the truth of a machine that structures change.

    A contact whose law is no power has neither stiffness nor exponent; with turned axes it is the stiffness
    and damping that act in y which are published, and their ratio.
    """
    values = machine_truth(hidden.machine)
    broken = {b.name: hidden.violations.of_bearing(b.name) for b in hidden.machine.touchdown_bearings}
    bent = {name: bool(v.contact.law) for name, v in broken.items()}
    found: dict[str, Any] = {
        "contact_K": {name: value for name, value in values["contact_K"].items() if not bent[name]},
        "contact": [
            {key: value for key, value in row.items() if not (law and key in ("K", "n"))}
            for row, law in zip(values["contact"], bent.values(), strict=True)
        ],
    }
    if any(float(v.support.axes_angle) != 0.0 for v in broken.values()):
        matrices = {b.name: support_matrices(b, broken[b.name]) for b in hidden.machine.touchdown_bearings}
        found["support_stiffness"] = {name: m["K_yy"] for name, m in matrices.items()}
        found["support_damping"] = {name: m["C_yy"] for name, m in matrices.items()}
        found["support_anisotropy"] = {name: m["K_xx"] / m["K_yy"] for name, m in matrices.items()}
    return found


def true_histories(
    hidden: HiddenMachine, result: DropResult, conditions: DropConditions, rate: float
) -> dict[str, Array]:
    """True histories, keys and units of the supplied truth files: from 20 ms before power-off, B bearings.

    Displacements in the sensor planes are those in the planes the owner states.
    """
    first = -round(HISTORY_BEFORE * rate)
    time = np.arange(first, int(result.time[-1] * rate) + 1) / rate
    amplitudes, _, speed = true_motion(hidden, result, conditions, time)
    m = hidden.model.layout.n_modes
    x, y = amplitudes[:, :m], amplitudes[:, m:]
    nodes = list(dict.fromkeys(sensor.node for sensor in hidden.known.sensors))
    planes = np.array([hidden.model.basis.node_row(node) for node in nodes]).reshape(len(nodes), m)
    shape = hidden.model.parameters.bearing_shape
    force = _sampled(time, result.time, result.bearing_force, 0.0)
    between = result.displacement - result.race_displacement
    length = np.maximum(np.linalg.norm(between, axis=-1, keepdims=True), 1e-12)
    normal = _sampled(time, result.time, result.contact_force[..., None] * between / length, 0.0)
    stress = _sampled(time, result.time, result.max_stress, None)
    race = _sampled(time, result.time, result.race_speed, 0.0)
    return {
        "t0": np.array(time[0]),
        "fs": np.array(rate),
        "bearing_force": np.linalg.norm(force, axis=-1),
        "contact_force": np.linalg.norm(normal, axis=-1),
        "max_inner_race_stress_MPa": MPA * stress,
        "race_speed_hz": race[::10] / (2.0 * math.pi),
        "speed_hz": speed[::10] / (2.0 * math.pi),
        "bearing_displacement": np.stack([x @ shape.T, y @ shape.T], axis=-1),
        "sensor_plane_displacement": np.stack([x @ planes.T, y @ planes.T], axis=-1),
        "bearing_force_xy": force,
        "contact_force_xy": normal,
        "first_250ms_t0": np.array(time[0]),
    }


def _sampled(time: Array, grid: Array, values: Array, before: float | None) -> Array:
    """Values on a grid at other times, by straight lines; before the grid a constant, or the first value."""
    place = np.clip(np.searchsorted(grid, time, side="right") - 1, 0, len(grid) - 2)
    weight = np.clip((time - grid[place]) / (grid[place + 1] - grid[place]), 0.0, 1.0)
    weight = weight.reshape((-1,) + (1,) * (values.ndim - 1))
    sampled = (1.0 - weight) * values[place] + weight * values[place + 1]
    if before is not None:
        sampled[time < 0.0] = before
    return np.asarray(sampled)


KINDS: dict[str, tuple[str, ...]] = {
    "turned support axes": (
        "support.axes_angle",
        "support.stiffness_ratio",
        "support.damping_ratio",
    ),
    "support damping": ("support.damping",),
    "cubic support": ("support.hardening",),
    "hysteretic support": ("support.slip_force",),
    "foundation mode": ("foundation.mass",),
    "contact stiffness": ("contact.stiffness",),
    "contact damping": ("contact.damping",),
    "contact exponent": ("contact.exponent",),
    "contact law": ("contact.law",),
    "ring masses": ("race.mass",),
    "race inertia": ("race.inertia",),
    "race tilt": ("race.tilt_stiffness",),
    "friction": ("friction.dynamic", "friction.static", "friction.stribeck_speed"),
    "gap drift": ("gap.drift",),
    "thermal gap": ("gap.closing",),
    "stop": ("support.stop_gap",),
    "ribbon": ("support.ribbon_slip",),
    "spring preload": ("balls.held_preload",),
    "thrust": ("face.thrust",),
    "fast balls": ("balls.inertia",),
    "seat play": ("balls.seat_play",),
    "ball phase": ("balls.first_ball_angle", "balls.turn"),
    "bearing centres": ("centre.x", "centre.y"),
    "sensor lag": ("sensors.time_constant",),
    "cross-axis sensitivity": ("sensors.cross_axis",),
    "sensor planes elsewhere": ("sensors.plane_shift",),
    "brackets that follow the housing": ("sensors.follows_housing",),
    "anti-alias filter": ("sensors.anti_alias_frequency",),
    "long remanence": ("magnets.remanence_time", "magnets.remanent_lift"),
    "unbalance beyond its grade": ("rotor.unbalance",),
    "rotor stiffness": ("rotor.youngs_modulus",),
    "eccentric sleeve": ("sleeve.eccentricity",),
    "oval sleeve": ("sleeve.ovality",),
    "wear": ("friction.wear",),
    "coloured noise": ("sensors.flicker",),
    "sampling clock": ("sensors.clock_error",),
    "late speed signal": ("sensors.speed_delay",),
    "curved sensors": ("sensors.curvature",),
    "asymmetric magnet decay": ("magnets.pull",),
    "bowed shaft": ("rotor.bow",),
    "tilted machine": ("stand.tilt",),
    "side force": ("side_force.force",),
    "rubbing seal": ("seal.gap",),
    "unbalance jump": ("unbalance_jump.node",),
    "one end held": ("magnets.stays_on",),
}
"""Names of the kinds of violations, with the keys of a case file that make them."""


def violated_kinds(violations: Violations) -> tuple[str, ...]:
    """Names of the kinds of violations that a case holds, in the order of `KINDS`."""
    values = violations.values()
    parts = [(part, keys) for part, keys in values.items() if part not in ("bearing", "sensor")]
    for bearing in values.get("bearing", {}).values():
        parts += list(bearing.items())
    parts += [("sensors", sensor) for sensor in values.get("sensor", {}).values()]
    given = {f"{part}.{key}" for part, keys in parts for key in keys}
    return tuple(kind for kind, keys in KINDS.items() if given & set(keys))


def true_structure(
    hidden: HiddenMachine, conditions: DropConditions, errors: SensorErrors
) -> dict[str, float]:
    """True values of all structures [SI] by path, absent ones with the value that means absent."""
    values: dict[str, float] = {}
    for bearing in hidden.machine.touchdown_bearings:
        mine = _of_bearing(bearing, hidden.violations.of_bearing(bearing.name))
        values |= {f"{bearing.name}.{path}": value for path, value in mine.items()}
    stated = hidden.machine.rotor.node_positions
    places = true_places(hidden.machine, errors)
    for i, sensor in enumerate(hidden.machine.sensors):
        mine = {
            "time_constant": errors.time_constant[i],
            "cross_axis": errors.cross_axis[i],
            "follows_housing": errors.follows_housing[i],
            "plane_offset": places[i] - stated[sensor.node - 1],
        }
        values |= {f"sensors.{sensor.name}.{path}": float(value) for path, value in mine.items()}
    values["rotor.stiffness_factor"] = float(hidden.violations.rotor.youngs_modulus)
    values["clock_error"] = float(hidden.violations.sensors.clock_error)
    values["side_force"] = _side_force(hidden)
    values["remanence.time_constant"] = conditions.start.remanence_time_constant
    return values


def _side_force(hidden: HiddenMachine) -> float:
    """Steady force in +x over the weight: what pushes the rotor, and gravity on a tilted machine."""
    tilt, side, machine = float(hidden.violations.stand.tilt), hidden.violations.side_force, hidden.machine
    if side is None:
        return math.sin(tilt)
    weight = machine.rotor.mass * float(machine.gravity)
    return math.sin(tilt) + float(side.force) * math.cos(float(side.direction)) / weight


def _of_bearing(bearing: TouchdownBearing, v: BearingViolations) -> dict[str, float]:
    matrix = support_matrices(bearing, v)
    support, foundation = bearing.support, v.foundation
    deflection = float(v.support.hardening_force) / float(support.stiffness)
    values = {
        "support.coupling": matrix["K_xy"] / math.sqrt(matrix["K_xx"] * matrix["K_yy"]),
        "support.damping_coupling": matrix["C_xy"] / math.sqrt(matrix["C_xx"] * matrix["C_yy"])
        if matrix["C_xx"] * matrix["C_yy"] > 0.0
        else 0.0,
        "support.axes_angle": float(v.support.axes_angle),
        "support.axes_ratio": float(support.stiffness_horizontal) / float(support.stiffness),
        "support.cubic": float(v.support.hardening) / deflection**2,
        "support.slip_force": float(v.support.slip_force),
        "support.foundation_share": 0.0,
        "gap.drift": float(v.gap.drift),
        "gap.closing": float(v.gap.closing),
        "centre.x": float(v.centre.x),
        "centre.y": float(v.centre.y),
    }
    if foundation.mass is not None and foundation.frequency is not None:
        values |= {
            "support.foundation_share": float(support.mass) / float(foundation.mass),
            "support.foundation_frequency": 2.0 * math.pi * float(foundation.frequency),
            "support.foundation_damping_ratio": float(foundation.damping_ratio),
            "foundation.mass": float(foundation.mass),
        }
    if v.race.tilt_stiffness is not None:
        values["race.tilt_stiffness"] = float(v.race.tilt_stiffness)
    return values
