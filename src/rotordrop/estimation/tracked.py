"""The tracked twin: force and stress from a drop model that follows the record, with intervals that hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import IdentificationError
from rotordrop.estimated import IdentifiedValue
from rotordrop.machine import Machine
from rotordrop.measurement.events import DropInstant, find_drop_instant
from rotordrop.measurement.record import Record
from rotordrop.model.parameters import DropModel, build_drop_model
from rotordrop.model.reduction import Reduction
from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.simulation.certificate import refined_peak
from rotordrop.tracking.calibration import (
    BLIND_SCHEDULE,
    CALIBRATED_SCHEDULE,
    Stage,
    TrackedDrops,
    shifted,
    track,
)
from rotordrop.tracking.consistency import Check, consistency_checks
from rotordrop.tracking.forces import ForceHistory, force_history
from rotordrop.tracking.problem import DropProblem, build_problem
from rotordrop.tracking.smoother import PassSettings, Smoothed, forward
from rotordrop.tracking.transfer import transferred
from rotordrop.tracking.unknowns import NINETY, Unknown, preload_of_offset

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

COARSE_BASIS = Reduction(modes=6, attachment=True)
FINE_BASIS = Reduction(modes=10, attachment=True)
FINE_SCHEDULE: tuple[Stage, ...] = (
    Stage(until=0.06, impulse=1e-3, share=0.01, passes=2),
    Stage(until=0.1, impulse=1e-3, share=0.01, passes=1),
    Stage(until=0.15, impulse=1e-3, share=0.01, passes=1),
    Stage(until=0.2, impulse=1e-3, share=0.01, passes=2),
)
CALIBRATION_SCHEDULE = FINE_SCHEDULE[:1]
WINDOW = 0.2
NOISE_FACTORS = (0.5, 1.0, 2.0, 4.0, 8.0)

MODEL_FORCE_SIGMA = 0.01
"""Relative standard deviation of a force peak by what every model here leaves out (basis, sampling) [1]."""
MODEL_STRESS_SIGMA = 0.004
MODEL_MEAN_STRESS_SIGMA = 0.04
"""The same for the mean stress: preload sets it, known only through the ball stiffness [1]."""
MODEL_GAP_SIGMA = 2.5e-6
"""Standard deviation of an air gap by what confounds it with gains and offsets beyond the fit [m]."""
PARAMETER_WIDENING = 1.5
"""Factor on standard errors of parameters for what the linearised fit leaves out [1]."""
MODEL_MEAN_FORCE_SIGMA = 0.01
"""Relative standard deviation of a mean force by what every model here leaves out [1]."""
INDEPENDENT_SPANS = 50.0
"""Independent stretches in the 50 ms of the mean force: its errors last about a millisecond [1]."""
INCONSISTENT_WIDENING = 2.0
"""Factor on intervals when the model is not consistent with the record [1]."""


@dataclass(frozen=True, kw_only=True)
class Impact:
    """One impact at one bearing, each number with its 90 % interval.

    Times [s] from power-off, azimuth [rad ccw from +x] of the contact normal at the peak, peak ball force
    [N], normal
    impulse [N s], energy dissipated in the contact [J].
    """

    bearing: str
    start: float
    end: float
    azimuth: float
    peak_time: float
    peak_force: IdentifiedValue
    impulse: IdentifiedValue
    dissipated_energy: IdentifiedValue


@dataclass(frozen=True, kw_only=True)
class TrackedDrop:
    """What the tracked twin says about one drop.

    Attributes
    ----------
    record : Record
        The recording.
    drop_instant : DropInstant
        Power-off in record time.
    forces : ForceHistory
        Force and stress over time with standard deviations.
    values : dict of dict
        Per bearing, identified values by the field names of the estimate's JSON.
    impacts : tuple of Impact
        Every impact.
    checks : tuple of Check
        Consistency of model and record.
    consistent : bool
        Whether all checks passed.
    """

    name: str
    record: Record
    drop_instant: DropInstant
    speed: float
    problem: DropProblem
    smoothed: Smoothed
    forces: ForceHistory
    values: dict[str, dict[str, IdentifiedValue]]
    peak_times: dict[str, float]
    impacts: tuple[Impact, ...]
    checks: tuple[Check, ...]
    consistent: bool
    noise_factor: float
    nis: float

    def sentence(self) -> str:
        """The verdict on model and record."""
        if self.consistent:
            return "The model is consistent with the record."
        failed = "; ".join(check.message for check in self.checks if not check.passed)
        return f"The model is not consistent with the record: {failed}. Intervals are widened."


@dataclass(frozen=True, kw_only=True)
class Preparation:
    """A record made ready: power-off found, tail averaged."""

    name: str
    record: Record
    instant: DropInstant
    tail_level: Array | None


def prepare(
    machine: Machine, record: Record, tail: Record | None, name: str, instant: DropInstant | None = None
) -> Preparation:
    """Find power-off and average the settled tail of a record."""
    if tail is None and record.duration > 20.0:
        tail = _last_seconds(record, 2.0)
    return Preparation(
        name=name,
        record=record,
        instant=find_drop_instant(record, machine) if instant is None else instant,
        tail_level=None if tail is None else np.asarray(tail.signals).mean(axis=0) * _polarity(tail),
    )


def _last_seconds(record: Record, span: float) -> Record:
    keep = record.time >= record.time[-1] - span
    return replace(
        record,
        time=record.time[keep],
        signals=record.signals[keep],
        speed=None if record.speed is None else record.speed[keep],
    )


def _polarity(record: Record) -> Array:
    return np.array([float(sensor.polarity) for sensor in record.sensors])


def drop_problem(model: DropModel, prepared: Preparation, until: float = WINDOW) -> DropProblem:
    """Estimation problem of a prepared record."""
    record = prepared.record
    if record.speed is None:
        raise IdentificationError(
            f"the record {prepared.name} has no rotor speed; expected one. Map it with a profile."
        )
    near = record.time < prepared.instant.value + until + 0.01
    return build_problem(
        model,
        np.asarray(record.time[near] - prepared.instant.value),
        np.asarray(record.signals[near]) * _polarity(record),
        np.asarray(record.speed[near]),
        tail_level=prepared.tail_level,
        until=until,
    )


def is_calibrated(machine: Machine) -> bool:
    """Whether support and contact of every bearing are estimates, not guesses."""
    return all(
        quantity.status == "estimated"
        for bearing in machine.touchdown_bearings
        for quantity in (bearing.support.stiffness, bearing.support.mass, bearing.contact.stiffness)
    )


def track_drops(
    machine: Machine,
    prepared: Sequence[Preparation],
    *,
    quick: bool = False,
    calibrate_only: bool = False,
    progress: Progress | None = None,
) -> TrackedDrops:
    """Follow recorded drops of one machine with the drop model.

    From guesses, a coarse basis finds the parameters in growing windows and a finer one refines them; a
    calibrated
    machine starts with the finer one (with ``quick``, one pass of the coarse one).
    """
    until = BLIND_SCHEDULE[-1].until + 0.01 if calibrate_only else WINDOW
    coarse_model = build_drop_model(machine, COARSE_BASIS)
    coarse = [drop_problem(coarse_model, item, until) for item in prepared]
    if is_calibrated(machine) and not calibrate_only:
        if quick:
            return track(coarse, CALIBRATED_SCHEDULE[1:2], progress=progress)
        fine_model = build_drop_model(machine, FINE_BASIS)
        return track(
            [drop_problem(fine_model, p, until) for p in prepared], CALIBRATED_SCHEDULE, progress=progress
        )
    contact = max(_first_contact(item) for item in prepared)
    first = track(coarse, shifted(BLIND_SCHEDULE, contact), progress=progress)
    fine_model = build_drop_model(machine, FINE_BASIS)
    fine = [drop_problem(fine_model, item, until) for item in prepared]
    references = [
        transferred(one, two, drop.means) for one, two, drop in zip(coarse, fine, first.smoothed, strict=True)
    ]
    schedule = shifted(CALIBRATION_SCHEDULE if calibrate_only else FINE_SCHEDULE, contact)
    return track(fine, schedule, references=references, progress=progress)


def _first_contact(item: Preparation) -> float:
    return max(item.instant.fall.end - item.instant.value, 0.002)


def best_noise_factor(problem: DropProblem, smoothed: Smoothed, stage: Stage) -> float:
    """Size of the unknown impulses, relative to the usual one, that makes the readings most likely [1]."""
    scores = []
    for factor in NOISE_FACTORS:
        settings = PassSettings(impulse=stage.impulse * factor, share=stage.share * factor)
        result = forward(
            problem, settings, reference=smoothed.means, samples=len(smoothed.means), smoothing=False
        )
        scores.append(result.negative_log_likelihood if result.done == len(smoothed.means) else math.inf)
    return NOISE_FACTORS[int(np.argmin(scores))]


def tracked_drop(
    prepared: Preparation, problem: DropProblem, smoothed: Smoothed, noise_factor: float
) -> TrackedDrop:
    """Forces, values, impacts and checks of one smoothed drop."""
    checks = consistency_checks(problem, smoothed, noise_factor)
    consistent = all(check.passed for check in checks)
    widening = 1.0 if consistent else INCONSISTENT_WIDENING
    forces = force_history(problem, smoothed)
    values: dict[str, dict[str, IdentifiedValue]] = {}
    peak_times: dict[str, float] = {}
    for b, name in enumerate(problem.model.bearing_names):
        values[name] = _parameter_values(problem, smoothed, name, widening)
        peak_values, peak_times[name] = _force_values(forces, b, widening)
        values[name].update(peak_values)
    return TrackedDrop(
        name=prepared.name,
        record=prepared.record,
        drop_instant=prepared.instant,
        speed=float(problem.mean[problem.model.layout.rotor_speed]),
        problem=problem,
        smoothed=smoothed,
        forces=forces,
        values=values,
        peak_times=peak_times,
        impacts=_impacts(problem, forces, widening),
        checks=checks,
        consistent=consistent,
        noise_factor=noise_factor,
        nis=smoothed.filtered.nis,
    )


def with_interval(value: float, sigma: float, widening: float = 1.0, unit: str = "") -> IdentifiedValue:
    """A value with a symmetric 90 % interval."""
    half = NINETY * sigma * widening
    return IdentifiedValue(
        value=value, standard_error=sigma * widening, interval_90=(value - half, value + half), unit=unit
    )


def _force_values(forces: ForceHistory, b: int, widening: float) -> tuple[dict[str, IdentifiedValue], float]:
    peak, moment = refined_peak(forces.time, forces.magnitude[:, b])
    at = int(np.argmax(forces.magnitude[:, b]))
    sigma = math.hypot(float(forces.magnitude_sigma[at, b]), MODEL_FORCE_SIGMA * peak)
    highest, _ = refined_peak(forces.time, forces.stress[:, b])
    top = int(np.argmax(forces.stress[:, b]))
    stress_sigma = math.hypot(float(forces.stress_sigma[top, b]), MODEL_STRESS_SIGMA * highest)
    mean_stress = float(np.mean(forces.stress[:, b]))
    mean_sigma = math.hypot(float(np.mean(forces.stress_sigma[:, b])), MODEL_MEAN_STRESS_SIGMA * mean_stress)
    values = {
        "peak_force_N": with_interval(peak, sigma, widening, "N"),
        "peak_stress_Pa": with_interval(highest, stress_sigma, widening, "Pa"),
        "mean_stress_Pa": with_interval(mean_stress, mean_sigma, widening, "Pa"),
    }
    late = (forces.time >= 0.15) & (forces.time <= 0.2)
    if forces.time[-1] >= 0.199:
        mean = float(np.mean(forces.magnitude[late, b]))
        spread = float(np.mean(forces.magnitude_sigma[late, b])) / math.sqrt(INDEPENDENT_SPANS)
        sigma = math.hypot(spread, MODEL_MEAN_FORCE_SIGMA * mean)
        values["mean_force_0p15_0p2_N"] = with_interval(mean, sigma, widening, "N")
    return values, moment


_FIELDS = {
    "air_gap": "air_gap_m",
    "support.stiffness": "support.stiffness_N_per_m",
    "support.damping": "support.damping_N_s_per_m",
    "support.mass": "support.mass_kg",
    "contact.stiffness": "contact.stiffness_N_per_m_n",
    "contact.damping": "contact.damping_s_per_m",
    "friction.dynamic": "friction.dynamic",
    "race.inertia": "race.inertia_kg_m2",
    "damping_time": "damping_time_s",
}
DETERMINED_SHARE = 0.7
"""A parameter counts as determined when its error falls below this share of its prior's [1]."""


def parameter_sample(smoothed: Smoothed) -> int:
    """Sample at which parameters are read: shortly after the first contacts."""
    return min(200, len(smoothed.means) - 1)


def identified(unknown: Unknown, theta: float, sigma: float, widening: float = 1.0) -> IdentifiedValue:
    """An estimated parameter as a value with interval, start and verdict."""
    half = NINETY * sigma * widening
    value = unknown.value_of(theta)
    error = sigma * widening * (value if unknown.logarithmic else 1.0)
    determined = sigma < DETERMINED_SHARE * unknown.sigma
    return IdentifiedValue(
        value=value,
        status="determined" if determined else "the record does not determine it",
        standard_error=error,
        interval_90=(unknown.value_of(theta - half), unknown.value_of(theta + half)),
        start=unknown.value_of(unknown.mean),
        unit=unknown.unit,
    )


def parameter_widening(unknown: Unknown, sigma: float, widening: float = 1.0) -> float:
    """Factor on a parameter's standard error [1]; the widened error stays within that of the prior."""
    return max(1.0, min(PARAMETER_WIDENING * widening, unknown.sigma / max(sigma, 1e-300)))


def _parameter_values(
    problem: DropProblem, smoothed: Smoothed, name: str, widening: float
) -> dict[str, IdentifiedValue]:
    at = parameter_sample(smoothed)
    theta = smoothed.means[at][problem.parameter_slice]
    sigma = np.sqrt(np.maximum(np.diag(smoothed.covariance(at))[problem.parameter_slice], 0.0))
    values = {}
    for unknown, t, s in zip(problem.unknowns, theta, sigma, strict=True):
        owner, _, path = unknown.path.partition(".")
        if owner != name:
            continue
        error = math.hypot(float(s), MODEL_GAP_SIGMA) if path == "air_gap" else float(s)
        wide = parameter_widening(unknown, error, widening)
        if path in _FIELDS:
            values[_FIELDS[path]] = identified(unknown, float(t), error, wide)
        elif path == "axial_offset":
            values["preload_N"] = preload_value(problem, name, unknown, float(t), error, wide)
    values["friction.static"] = _static_friction(problem, name, values["friction.dynamic"])
    values["equivalent_stiffness_N_per_m"] = _equivalent_stiffness(problem, name, values)
    return values


def preload_value(
    problem: DropProblem, name: str, unknown: Unknown, theta: float, sigma: float, widening: float = 1.0
) -> IdentifiedValue:
    """Preload [N] from the estimated axial offset of the rows."""
    constants = bearing_constants(problem.model.machine.bearing(name).bearing)
    half = NINETY * sigma * widening
    low, value, high = (preload_of_offset(constants, theta + d) for d in (-half, 0.0, half))
    base = identified(unknown, theta, sigma, widening)
    return replace(
        base,
        value=value,
        standard_error=(high - low) / (2.0 * NINETY),
        interval_90=(low, high),
        start=preload_of_offset(constants, unknown.mean),
        unit="N",
    )


def _static_friction(problem: DropProblem, name: str, dynamic: IdentifiedValue) -> IdentifiedValue:
    """Static coefficient at its prior ratio to the dynamic one: sliding drops say little about it."""
    friction = problem.model.machine.bearing(name).friction
    ratio = float(friction.static) / float(friction.dynamic)
    low, high = dynamic.interval_90 or (dynamic.value, dynamic.value)
    return IdentifiedValue(
        value=ratio * dynamic.value,
        status="prior",
        standard_error=None if dynamic.standard_error is None else ratio * dynamic.standard_error,
        interval_90=(0.85 * ratio * low, 1.15 * ratio * high),
        unit="1",
    )


def _equivalent_stiffness(
    problem: DropProblem, name: str, values: dict[str, IdentifiedValue]
) -> IdentifiedValue:
    """Support and bearing in series [N/m], the bearing by its tangent at the static load."""
    from rotordrop.model.parameters import static_bearing_stiffness

    index = problem.model.bearing_names.index(name)
    constants = bearing_constants(problem.model.machine.bearing(name).bearing)
    bearing = static_bearing_stiffness(constants, float(problem.model.load_shares[index]))
    support = values["support.stiffness_N_per_m"]
    low, high = support.interval_90 or (support.value, support.value)

    def series(stiffness: float) -> float:
        return stiffness * bearing / (stiffness + bearing)

    return replace(
        support,
        value=series(support.value),
        interval_90=(series(low), series(high)),
        standard_error=(series(high) - series(low)) / (2.0 * NINETY),
        start=None,
    )


def _impacts(problem: DropProblem, forces: ForceHistory, widening: float) -> tuple[Impact, ...]:
    found: list[Impact] = []
    for b, name in enumerate(problem.model.bearing_names):
        touching = forces.indentation[:, b] > 0.0
        edges = np.flatnonzero(np.diff(np.concatenate([[0], touching.astype(int), [0]])))
        for first, last in zip(edges[0::2], edges[1::2], strict=True):
            found.append(_impact(forces, b, name, int(first), int(last), widening))
    return tuple(sorted(found, key=lambda impact: impact.start))


def _impact(forces: ForceHistory, b: int, name: str, first: int, last: int, widening: float) -> Impact:
    window = slice(max(first - 1, 0), min(last + 2, len(forces.time)))
    peak, moment = refined_peak(forces.time[window], forces.magnitude[window, b])
    at = window.start + int(np.argmax(forces.magnitude[window, b]))
    relative = math.hypot(float(forces.magnitude_sigma[at, b]) / max(peak, 1e-9), MODEL_FORCE_SIGMA)
    dt = float(forces.time[1] - forces.time[0])
    impulse = dt * float(np.sum(forces.contact_force[first:last, b]))
    lost = dt * float(np.sum(forces.contact_power[first:last, b]))
    middle = first + int(np.argmax(forces.contact_force[first:last, b]))
    return Impact(
        bearing=name,
        start=float(forces.time[first]),
        end=float(forces.time[last - 1]),
        azimuth=float(forces.azimuth[middle, b]),
        peak_time=moment,
        peak_force=with_interval(peak, relative * peak, widening, "N"),
        impulse=with_interval(impulse, relative * impulse, widening, "N s"),
        dissipated_energy=with_interval(lost, 2.0 * relative * abs(lost), widening, "J"),
    )


def estimate_tracked(
    machine: Machine,
    records: Sequence[Record],
    tails: Sequence[Record | None],
    *,
    names: Sequence[str] | None = None,
    quick: bool = False,
    progress: Progress | None = None,
) -> tuple[TrackedDrop, ...]:
    """Force and stress of recorded drops of one machine, each drop following its record.

    Parameters
    ----------
    machine : Machine
        The machine, calibrated or with guesses; several drops share its parameters in one fit.
    records, tails : sequence of Record
        The drops and their settled tails (None where there is none).
    names : sequence of str, optional
        Names of the drops; file stems by default.
    quick : bool
        One pass with a small basis; needs a calibrated machine to be accurate.
    progress : callable, optional
        Called with a sentence and the fraction done.
    """
    stems = names or [r.path.stem if r.path else f"drop_{i + 1}" for i, r in enumerate(records)]
    prepared = [prepare(machine, r, t, n) for r, t, n in zip(records, tails, stems, strict=True)]
    tracked = track_drops(machine, prepared, quick=quick, progress=progress)
    drops = []
    for item, problem, smoothed in zip(prepared, tracked.problems, tracked.smoothed, strict=True):
        factor = 1.0 if quick else best_noise_factor(problem, smoothed, FINE_SCHEDULE[-1])
        drops.append(tracked_drop(item, problem, smoothed, factor))
    return tuple(drops)
