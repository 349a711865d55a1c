"""The truth of a synthetic drop: numbers and histories, laid out like the supplied truth files."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.parameter import Step
from rotordrop.elements.race_bearing import numbers_of
from rotordrop.elements.table import rows
from rotordrop.machine import Machine, TouchdownBearing
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop.simulate.certificate import refined_peak
from rotordrop.simulate.result import DropResult
from rotordrop_bench.event import DropConditions, HiddenMachine
from rotordrop_bench.motion import true_motion
from rotordrop_bench.sensor_chain import SensorChain, SensorErrors
from rotordrop_bench.true_structure import (
    true_structure,
    turned_supports,
    violated_kinds,
    without_powers,
)

Array = NDArray[np.float64]

WHOLE = 0.2
SETTLING = (0.15, 0.2)
HISTORY_BEFORE = 0.02
CONTACT_WINDOW = 0.25
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
    values: dict[str, Any] = {
        "name": name,
        "origin": "simulated, not measured",
        "n0_hz": conditions.speed / (2.0 * math.pi),
        "fs": chain.sampling_rate,
        "t_off_in_record_s": conditions.jitter,
    }
    values |= _loads(result)
    values |= _motion(hidden, result, rest)
    values |= without_powers(hidden, machine_truth(hidden.machine)) | turned_supports(hidden)
    values["structure"] = true_structure(hidden, conditions, errors)
    values["violated"] = list(violated_kinds(hidden.violations))
    values |= _conditions(conditions, hidden)
    values |= _sensors(chain, errors)
    values["violations"] = _violations(hidden)
    values["time_note"] = (
        "times are from power-off; record time = t_off_in_record_s + t; unbalance phases are relative to the "
        "(unknown) rotor mark; axes x horizontal, y up"
    )
    return values


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
    radius = np.linalg.norm(result.displacement, axis=-1)
    settled = np.hypot(shape @ rest[layout.modal_x], shape @ rest[layout.modal_y])
    start = result.state[0]
    values: dict[str, Any] = {
        "max_radial_displacement_m": _each(names, np.max(radius, axis=0)),
        "settled_radius_um": _each(names, 1e6 * settled),
        "initial_xy_at_bearings_m": result.displacement[0].tolist(),
        "initial_velocity_xy_m_s": np.column_stack(
            [
                shape @ start[layout.velocity_of(layout.modal_x)],
                shape @ start[layout.velocity_of(layout.modal_y)],
            ]
        ).tolist(),
    }
    return values | _contacts(result)


def _contacts(result: DropResult) -> dict[str, Any]:
    intervals: dict[str, list[list[float]]] = {}
    for index, name in enumerate(result.bearing_names):
        log = result.contacts.of_bearing(index)
        end = np.minimum(
            np.where(np.isfinite(log.end), log.end, np.inf), min(CONTACT_WINDOW, result.time[-1])
        )
        rows = zip(log.start, end, log.peak_force, strict=True)
        intervals[name] = [[float(v) for v in row] for row in rows if row[0] < CONTACT_WINDOW]
    first = {name: rows[0] for name, rows in intervals.items() if rows}
    return {
        "first_contact_time_s": {name: row[0] for name, row in first.items()},
        "first_contact_duration_s": {name: row[1] - row[0] for name, row in first.items()},
        "contact_intervals_0_0p25_s": intervals,
    }


def machine_truth(machine: Machine) -> dict[str, Any]:
    """True parameters of a machine, in the fields of the supplied truth files."""
    bearings = machine.touchdown_bearings
    first = bearings[0].friction
    constant = machine.speed.aero_time_constant
    described = (row for row in rows("bearing") if len(row.truth) == 1 and row.step is not Step.FIRST_CONTACT)
    return {
        **{row.truth[0]: {b.name: float(row.described(b)) for b in bearings} for row in described},
        "rotor_weight_N": machine.rotor.mass * float(machine.gravity),
        "equivalent_stiffness": _equivalent_stiffness(machine),
        "friction_dynamic": float(first.dynamic),
        "friction_static": float(first.static),
        "tau_aero": None if constant is None else float(constant),
        "contact": [_contact(b) for b in bearings],
        "support": [_support(b) for b in bearings],
        "ring": [{"m": float(b.race.mass), "Ip": float(b.race.inertia)} for b in bearings],
        "bearing": [_bearing(b) for b in bearings],
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


def _equivalent_stiffness(machine: Machine) -> dict[str, float]:
    """Support and bearing in series [N/m], the bearing by its tangent at the static load."""
    found = {}
    for bearing, load in zip(machine.touchdown_bearings, bearing_load_shares(machine), strict=True):
        tangent = numbers_of(bearing).tangent_stiffness(float(load))
        support = float(bearing.support.stiffness)
        found[bearing.name] = support * tangent / (support + tangent)
    return found


def _contact(b: TouchdownBearing) -> dict[str, float]:
    return {
        "n": float(b.contact.exponent),
        "K": float(b.contact.stiffness),
        "lam": float(b.contact.damping),
        "q": 1,
        "gap": float(b.air_gap),
        "r_bore": float(b.bore_radius),
        "mu_s": float(b.friction.static),
        "mu_d": float(b.friction.dynamic),
        "v_stribeck": float(b.friction.stribeck_speed),
        "v_smooth": float(b.friction.smoothing_speed),
    }


def _support(b: TouchdownBearing) -> dict[str, float]:
    s = b.support
    return {
        "m": float(s.mass),
        "K": float(s.stiffness),
        "C": float(s.damping),
        "m_horizontal": float(s.mass_horizontal),
        "K_horizontal": float(s.stiffness_horizontal),
        "C_horizontal": float(s.damping_horizontal),
    }


def _bearing(b: TouchdownBearing) -> dict[str, float]:
    return {
        **numbers_of(b).truth(),
        "Cb_over_Kb": float(b.damping_time),
        "drag_mu": float(b.race.drag_coefficient),
        "drag_omega0": float(b.race.drag_speed),
    }


def _conditions(conditions: DropConditions, hidden: HiddenMachine) -> dict[str, Any]:
    start = conditions.start
    force = (
        start.remanent_force if start.remanent_force is not None else np.zeros((len(hidden.machine.ambs), 2))
    )
    return {
        "rotor_angle_at_power_off_rad": start.rotor_angle,
        "levitated_offset_m": None if start.offset is None else np.asarray(start.offset).tolist(),
        "remanent_force": [
            {"vertical_N": float(y), "x_N": float(x), "time_constant_s": start.remanence_time_constant}
            for x, y in np.asarray(force)
        ],
    }


def _sensors(chain: SensorChain, errors: SensorErrors) -> dict[str, Any]:
    return {
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
    }


def _violations(hidden: HiddenMachine) -> dict[str, Any]:
    return hidden.violations.values() | {"machine_seed": hidden.seed}


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
    normal = _sampled(time, result.time, _contact_vectors(result), 0.0)
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


def _contact_vectors(result: DropResult) -> Array:
    """Normal force on the race as a vector, shape (T, B, 2) [N]."""
    between = result.displacement - result.race_displacement
    length = np.linalg.norm(between, axis=-1, keepdims=True)
    return np.asarray(result.contact_force[..., None] * between / np.maximum(length, 1e-12))


def _sampled(time: Array, grid: Array, values: Array, before: float | None) -> Array:
    """Values on a grid at other times, by straight lines; before the grid a constant, or the first value."""
    place = np.clip(np.searchsorted(grid, time, side="right") - 1, 0, len(grid) - 2)
    weight = np.clip((time - grid[place]) / (grid[place + 1] - grid[place]), 0.0, 1.0)
    weight = weight.reshape((-1,) + (1,) * (values.ndim - 1))
    sampled = (1.0 - weight) * values[place] + weight * values[place + 1]
    if before is not None:
        sampled[time < 0.0] = before
    return np.asarray(sampled)
