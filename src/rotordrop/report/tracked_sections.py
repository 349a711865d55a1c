"""The parts of a report that show how the tracked twin follows the record."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotordrop.estimated import NINETY
from rotordrop.estimation.tracked import INCONSISTENT_WIDENING, TrackedDrop
from rotordrop.estimation.tracked_values import (
    MODEL_FORCE_SIGMA,
    MODEL_STRESS_SIGMA,
    identified,
    model_error,
    parameter_widening,
)
from rotordrop.machine import Machine
from rotordrop.model.unknowns import Unknown
from rotordrop.report.content import Figure, Section, Statement, Table
from rotordrop.report.first_contact import FirstContact
from rotordrop.report.force import Peak
from rotordrop.report.history import AirGap, Band, BearingHistories, BearingMotions, History, Motion
from rotordrop.report.impacts import Impact
from rotordrop.report.innovations import innovations_figure, nis_figure, whiteness_figure
from rotordrop.report.measured_motion import measured_at_bearings
from rotordrop.report.parameters import ParameterRow, parameter_figure, parameter_table
from rotordrop.report.quantity import Quantity
from rotordrop.report.stress_box import StressBox, stress_box
from rotordrop.simulation.certificate import refined_peak
from rotordrop.tracking.consistency import NIS_RANGE, normalised_innovations
from rotordrop.tracking.smoother import parameter_sample

Array = NDArray[np.float64]


def widening(drop: TrackedDrop) -> float:
    """Factor on the intervals: more than one when model and record do not agree [1]."""
    return 1.0 if drop.consistent else INCONSISTENT_WIDENING


def tracked_motions(drop: TrackedDrop, machine: Machine) -> tuple[BearingMotions, ...]:
    """Measured and estimated motion at every bearing; the air gap is the estimated one with its interval."""
    measured = measured_at_bearings(machine, corrected_readings(drop))
    motions = []
    for index, (name, values) in enumerate(drop.values.items()):
        gap = values["air_gap_m"]
        low, high = gap.interval_90 or (gap.value, gap.value)
        motions.append(
            BearingMotions(
                bearing=name,
                air_gap=AirGap(lower=low, upper=high),
                motions=(
                    Motion(
                        label="measured",
                        time=drop.problem.time,
                        displacement=measured[:, index],
                        role="measured",
                    ),
                    Motion(
                        label="estimated",
                        time=drop.forces.time,
                        displacement=drop.forces.displacement[:, index],
                        role="estimated",
                    ),
                ),
            )
        )
    return tuple(motions)


def corrected_readings(drop: TrackedDrop) -> Array:
    """Displacement along the sensors [m], shape (N, C), with the estimated gains and offsets taken out."""
    problem = drop.problem
    first = problem.n_dynamic + len(problem.unknowns)
    errors = drop.smoothed.means[-1][first : first + 2 * problem.n_channels]
    gain, offset = errors[: problem.n_channels], errors[problem.n_channels :]
    return np.asarray((problem.readings - offset) / (1.0 + gain))


def tracked_forces(drop: TrackedDrop) -> tuple[BearingHistories, ...]:
    """Bearing force of every bearing with its 90 % band."""
    return _banded(drop, drop.forces.magnitude, drop.forces.magnitude_sigma, MODEL_FORCE_SIGMA)


def tracked_stresses(drop: TrackedDrop) -> tuple[BearingHistories, ...]:
    """Hertz stress of every bearing with its 90 % band."""
    return _banded(drop, drop.forces.stress, drop.forces.stress_sigma, MODEL_STRESS_SIGMA)


def _banded(
    drop: TrackedDrop, values: Array, sigma: Array, model_share: float
) -> tuple[BearingHistories, ...]:
    """Histories with bands as wide as the stated intervals: what every model leaves out belongs to them."""
    time = drop.forces.time
    half = NINETY * widening(drop) * np.hypot(sigma, model_share * values)
    return tuple(
        BearingHistories(
            bearing=name,
            histories=(History(label="estimated", time=time, values=values[:, b], role="estimated"),),
            band=Band(
                time=time,
                lower=np.maximum(values[:, b] - half[:, b], 0.0),
                upper=values[:, b] + half[:, b],
            ),
        )
        for b, name in enumerate(drop.values)
    )


def tracked_peaks(drop: TrackedDrop, field: str) -> dict[str, Peak]:
    """Peak of force (``"peak_force_N"``) or stress (``"peak_stress_Pa"``) of every bearing."""
    histories = drop.forces.magnitude if field == "peak_force_N" else drop.forces.stress
    peaks = {}
    for b, (name, values) in enumerate(drop.values.items()):
        _, moment = refined_peak(drop.forces.time, histories[:, b])
        peaks[name] = Peak(time=moment, value=values[field].value, interval_90=values[field].interval_90)
    return peaks


def tracked_boxes(drop: TrackedDrop) -> tuple[StressBox, ...]:
    """Distribution of the estimated stress; the preload's own stress is the one in the free fall."""
    label = Quantity(value=drop.speed / (2 * np.pi), kind="frequency", digits=3).text
    return tuple(
        stress_box(label, name, drop.forces.stress[:, b], float(drop.forces.stress[0, b]))
        for b, name in enumerate(drop.values)
    )


def tracked_impacts(drop: TrackedDrop) -> tuple[Impact, ...]:
    """Impacts with the intervals of peak, impulse and dissipated energy."""
    return tuple(
        Impact(
            bearing=impact.bearing,
            time=Quantity(value=impact.peak_time, kind="time"),
            duration=Quantity(value=impact.end - impact.start, kind="time", digits=3),
            azimuth=Quantity(value=impact.azimuth, kind="angle", digits=3),
            peak_force=Quantity.of(impact.peak_force, "force"),
            impulse=Quantity.of(impact.impulse, "impulse", digits=3),
            dissipated_energy=Quantity.of(impact.dissipated_energy, "energy", digits=3),
        )
        for name in drop.values
        for impact in drop.impacts
        if impact.bearing == name
    )


def tracked_first_contacts(drop: TrackedDrop) -> dict[str, FirstContact]:
    """First contact of every bearing that was touched; depth beyond the estimated air gap."""
    found: dict[str, FirstContact] = {}
    names = list(drop.values)
    for impact in drop.impacts:
        if impact.bearing in found:
            continue
        b = names.index(impact.bearing)
        inside = (drop.forces.time >= impact.start) & (drop.forces.time <= impact.end)
        radius = np.where(inside, np.hypot(*drop.forces.displacement[:, b].T), -np.inf)
        deepest = int(np.argmax(radius))
        found[impact.bearing] = FirstContact(
            start=impact.start,
            end=impact.end,
            indentation=float(radius[deepest]) - drop.values[impact.bearing]["air_gap_m"].value,
            deepest_time=float(drop.forces.time[deepest]),
        )
    return found


def parameter_section(drop: TrackedDrop) -> Section:
    """Every unknown with prior, estimate, interval and verdict; first those of the machine."""
    at = parameter_sample(drop.smoothed)
    theta = drop.smoothed.means[at][drop.problem.parameter_slice]
    variance = np.diag(drop.smoothed.covariance(at))[drop.problem.parameter_slice]
    rows: dict[str, list[ParameterRow]] = {"machine": [], "drop": []}
    for unknown, mean, square in zip(drop.problem.unknowns, theta, variance, strict=True):
        rows[unknown.scope].append(_row(drop, unknown, float(mean), float(np.sqrt(max(square, 0.0)))))
    tables = [
        parameter_table(rows["machine"], caption="Parameters of the machine", note=PRIOR_NOTE),
        parameter_table(rows["drop"], caption="Unknowns of this drop"),
    ]
    figure = Figure(
        chart=parameter_figure(rows["machine"]),
        caption="Estimates with 90 % intervals over their priors, both relative to the prior's centre. Where "
        "the blue bar is as wide as the grey one, the record says nothing about the parameter.",
    )
    return Section(heading="Parameters", figures=(figure,), tables=(*tables, sensor_table(drop)))


PRIOR_NOTE = (
    "Below a prior or an estimate: its 90 % interval. What the record does not determine enters the "
    "intervals of force and stress by its prior."
)


def _row(drop: TrackedDrop, unknown: Unknown, mean: float, sigma: float) -> ParameterRow:
    error = model_error(unknown, sigma)
    wide = parameter_widening(unknown, error, widening(drop))
    prior = identified(unknown, unknown.mean, unknown.sigma)
    estimate = identified(unknown, mean, error, wide)
    kind = unknown.parameter.display_kind
    return ParameterRow(
        name=unknown.path,
        prior=Quantity.of(prior, kind),
        estimate=Quantity.of(estimate, kind),
        verdict=estimate.status,
    )


def sensor_table(drop: TrackedDrop) -> Table:
    """Estimated gain and offset of every sensor with their intervals."""
    problem, sensors = drop.problem, drop.problem.model.machine.sensors
    first, count = problem.n_dynamic + len(problem.unknowns), problem.n_channels
    mean = drop.smoothed.means[-1]
    half = NINETY * widening(drop) * np.sqrt(np.diag(drop.smoothed.covariance(len(drop.smoothed.means) - 1)))

    def quantity(index: int, kind: str) -> Quantity:
        value, spread = float(mean[index]), float(half[index])
        return Quantity(value=value, kind=kind, interval_90=(value - spread, value + spread))

    return Table(
        columns=("sensor", "gain error", "offset", "noise (standard deviation)"),
        rows=tuple(
            (
                sensor.name,
                quantity(first + c, "share"),
                quantity(first + count + c, "length"),
                Quantity(value=float(np.sqrt(problem.variances[c])), kind="length", digits=2),
            )
            for c, sensor in enumerate(sensors)
        ),
        caption="Sensors",
        note="Gains and offsets are estimated with the motion; the settled tail ties them to the air gap.",
    )


def consistency_section(drop: TrackedDrop) -> Section:
    """Checks of the model against the record, and the innovations behind them."""
    filtered = drop.smoothed.filtered
    done, time = filtered.done, drop.problem.time
    channels = [sensor.name for sensor in drop.problem.model.machine.sensors]
    innovations = filtered.innovations[:done, :-1]
    deviation = np.sqrt(filtered.innovation_variances[:done, :-1])
    normalised = normalised_innovations(drop.smoothed)
    square = np.nan_to_num(np.nanmean(normalised**2, axis=1), nan=1.0)
    figures = (
        Figure(
            chart=innovations_figure(time[:done], innovations, channels, deviation),
            caption="What each reading says beyond the prediction from all readings before it.",
        ),
        Figure(
            chart=nis_figure(time[:done], square, NIS_RANGE),
            caption="Innovations squared over what the filter expects: one where model and noise are right.",
        ),
        Figure(
            chart=whiteness_figure(np.nan_to_num(normalised), channels, float(time[1] - time[0])),
            caption="Autocorrelation of the innovations; a correct model leaves none.",
        ),
    )
    table = Table(
        columns=("check", "passed", "numbers compared"),
        rows=tuple((check.name, "yes" if check.passed else "no", check.message) for check in drop.checks),
        caption="Consistency of model and record",
        note="The checks cannot see a wrong contact stiffness or exponent; those enter by their priors.",
    )
    verdict = Statement(text=drop.sentence(), level="good" if drop.consistent else "bad")
    return Section(heading="Consistency", statements=(verdict,), figures=figures, tables=(table,))
