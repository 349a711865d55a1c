"""Calibrate a machine: one fit over several drops, written back with intervals and provenance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.document import Document, stated
from rotordrop.elements.contact import pair_of_the_file
from rotordrop.elements.landing_sleeve import with_amounts
from rotordrop.elements.magnet import FORCES
from rotordrop.elements.parameter import below
from rotordrop.elements.table import row_of, rows, separating_measurement
from rotordrop.errors import IdentificationError, UsageError
from rotordrop.estimate.published import Structure
from rotordrop.evidence.evidence import Evidence, insisted
from rotordrop.evidence.given import given_drops
from rotordrop.evidence.one_end import on_common_zeros, with_zeros
from rotordrop.known import NINETY, Known, Status, deviation_of
from rotordrop.machine import Machine
from rotordrop.machine.calibration import CalibrationDrop, CalibrationOrigin, JointSpread, RecordedLift
from rotordrop.one_thread import one_thread
from rotordrop.progress import Shown, shown
from rotordrop.record.record import Record
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop.rotor.unknowns import (
    Unknown,
    file_of_fitted,
    file_path,
    is_logarithmic,
    is_of_a_bearing,
    slope_signs,
    weight_per_magnet,
)
from rotordrop.track.consistency import Check, consistency_checks
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import Smoothed
from rotordrop.twin.problems import Drops, tail_first
from rotordrop.twin.search import Search, track_drops
from rotordrop.twin.steps import Steps
from rotordrop.twin.tracked_loads import INCONSISTENT, symmetric, widening_of
from rotordrop.twin.tracked_parameters import NOT_DETERMINED, fitted_values, identified

CONFOUNDED = 0.9
"""Correlation from which two parameters are reported as confounded [1] (chosen)."""


class Identifiability(Document):
    """What the records say about one parameter: its prior and posterior standard deviation, and the verdict.

    Standard deviations are of the logarithm for positive parameters; the verdict is that of its value.
    """

    path: str
    prior_standard_deviation: float
    posterior_standard_deviation: float
    verdict: Status


class Confounded(Document):
    """Two parameters the records cannot tell apart, their correlation [1], and what would separate them."""

    first: str
    second: str
    correlation: float
    separated_by: str


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """A calibrated machine with what stands behind it."""

    machine: Machine
    """The machine with estimates in place of guesses."""
    values: dict[str, Known]
    """Every estimated parameter by path."""
    identifiability: tuple[Identifiability, ...]
    """What the records determine."""
    confounded: tuple[Confounded, ...]
    """What they cannot tell apart."""
    checks: dict[str, tuple[Check, ...]]
    """Consistency checks of each drop."""
    consistent: bool
    """Whether all checks of all drops passed."""
    nis: dict[str, float]
    structure: tuple[Structure, ...] = ()
    """What the machine has beyond the base model; empty where that does."""

    def sentence(self) -> str:
        """The outcome in words."""
        verdicts = [entry.verdict for entry in self.identifiability]
        found, weakly = (verdicts.count(one) for one in ("determined", "weakly determined"))
        text = (
            f"{found} of {len(verdicts)} parameters are determined by {len(self.checks)} drop(s)"
            f", {weakly} more weakly"
        )
        found_too = "".join(f" {one.sentence}" for one in self.structure)
        if self.consistent:
            return f"{text}; the model is consistent with all of them.{found_too}"
        bad = [name for name, checks in self.checks.items() if not all(check.passed for check in checks)]
        return f"{text}; the model is not consistent with {', '.join(bad)}: intervals are doubled.{found_too}"


@one_thread()
def calibrate_machine(
    machine: Machine,
    records: Sequence[Record],
    tails: Sequence[Record | None],
    *,
    names: Sequence[str] | None = None,
    progress: Shown = None,
) -> Calibration:
    """Fit the parameters of a machine to several recorded drops.

    Parameters
    ----------
    machine : Machine
        The machine with guesses.
    records, tails : sequence of Record
        Drops of this machine, and their settled tails (None where there is none).
    names : sequence of str, optional
        Names of the drops.
    progress : callable or False, optional
        Called with a sentence and the fraction done; by default a bar in a terminal or a notebook.

    Returns
    -------
    Calibration
        The machine with estimates, what the records determine and what not.
    """
    records, tails, stems = given_drops(machine, records, tails, names)
    own = [
        Evidence(record=record, machine=with_zeros(record, machine), tail=tail, name=stem)
        for record, tail, stem in zip(records, tails, stems, strict=True)
    ]
    alike = on_common_zeros(own)
    machine = alike[0].machine
    model = build_drop_model(machine)
    evidence = [insisted(one.with_facts(base=model)) for one in alike]
    drops = Drops(evidence=tuple(tail_first(evidence)), calibrate_only=True)
    with shown(progress, "calibrating") as tell:
        search = Search(drops=drops, progress=Steps(tell))
        found = track_drops(search, search.with_rotor(machine))
    machine, tracked = found.machine, found.fit
    checks = {
        name: consistency_checks(problem, judged, found.noise_factor)
        for name, problem, judged in zip(stems, tracked.problems, found.judged, strict=True)
    }
    consistent = all(check.passed for one in checks.values() for check in one)
    problem, smoothed = tracked.problems[-1], tracked.smoothed[-1]
    at = smoothed.filtered.parameter_sample
    covariance = smoothed.covariance(at)
    mean = smoothed.means[at]
    widening = widening_of(check for one in checks.values() for check in one)
    values = values_of(problem, mean, covariance, widening)
    identifiability = _identifiability(problem, covariance, values)
    known = _as_known(as_filed(machine, values), identifiability)
    marked = "" if consistent else " (not consistent with them)"  # for people: nothing reads a source
    source = f"calibrated on {', '.join(stems)}{marked}"
    fitted = machine_values([one.name for one in machine.touchdown_bearings], known, source)
    fit = {unknown.path: unknown for unknown in problem.unknowns}
    of = slice(problem.n_dynamic, problem.n_dynamic + len(fit))
    joint = joint_covariance(problem.model, fit, mean[of], covariance[of, of], known)
    said = values | _of_drop(problem, mean, covariance)
    calibrated_on = [
        CalibrationDrop(name=name, sha256=record.sha256, lift=_lift(one, followed))
        for name, record, one, followed in zip(
            stems, records, tracked.problems, tracked.smoothed, strict=True
        )
    ]
    origin = CalibrationOrigin(drops=tuple(calibrated_on), consistent=consistent, joint=joint)
    if not consistent:  # nothing is determined by a model that is not believed
        values = {path: replace(one, status=INCONSISTENT) for path, one in values.items()}
        identifiability = tuple(one.model_copy(update={"verdict": INCONSISTENT}) for one in identifiability)
    return Calibration(
        machine=_possible(with_found(machine, said), fitted, stems).calibrated_on(origin),
        values=values,
        identifiability=identifiability,
        confounded=confounded_of(problem, covariance),
        checks=checks,
        consistent=consistent,
        nis={name: one.nis for name, one in zip(stems, found.baseline, strict=True)},
        structure=tuple(one.structure(machine, said, believed=consistent) for one in found.accepted),
    )


def _of_drop(problem: DropProblem, mean: Array, covariance: Array) -> dict[str, Known]:
    """What was found of the last drop alone: unbalance, remanent lift, drag of the air."""
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    first = problem.n_dynamic
    return {
        unknown.path: identified(unknown, float(mean[first + k]), float(sigma[first + k]))
        for k, unknown in enumerate(problem.unknowns)
        if unknown.scope == "drop"
    }


def _lift(problem: DropProblem, smoothed: Smoothed) -> tuple[RecordedLift, ...]:
    """What a drop shows of the remanent force of each magnet, in shares of the weight it carries."""
    at, machine = smoothed.filtered.parameter_sample, problem.model.machine
    mean, sigma = smoothed.means[at], np.sqrt(np.maximum(np.diag(smoothed.covariance(at)), 0.0))
    share = weight_per_magnet(machine)
    places = {unknown.path: problem.n_dynamic + k for k, unknown in enumerate(problem.unknowns)}
    lifts = []
    for amb in machine.ambs:
        if amb.stays_on:
            continue
        entries = [places[row.path_of(amb.name)] for row in FORCES]
        (sideways, up), (sideways_error, up_error) = (
            [float(values[k]) / share for k in entries] for values in (mean, sigma)
        )
        lifts.append(
            RecordedLift(
                magnet=amb.name, sideways=sideways, sideways_error=sideways_error, up=up, up_error=up_error
            )
        )
    return tuple(lifts)


def with_found(machine: Machine, said: Mapping[str, Known]) -> Machine:
    """The machine with an unbalance beyond the described one, and landing sleeves, as large as those found.

    What was described then is the width of a prior, and no amount that a simulation could use.
    """
    values: dict[str, Known] = {}
    for bearing in machine.touchdown_bearings:
        amounts = with_amounts(bearing, below(said, f"{bearing.name}."))
        values |= {f"{bearing.name}.{path}": amount for path, amount in amounts.items()}
    for i, unbalance in enumerate(machine.unbalances):
        if unbalance.beyond_described is not None:
            along = [said[row.path_of(str(i))].value for row in rows("unbalance")]
            found = math.hypot(*along)
            factor = float(unbalance.beyond_described) * found / float(unbalance.amount)
            values[f"unbalance.{i}.amount"] = Known(value=found, status="guess")
            values[f"unbalance.{i}.beyond_described"] = Known(value=factor, status="guess")
    return machine.with_values(values) if values else machine


def _possible(machine: Machine, fitted: dict[str, Known], drops: Sequence[str]) -> Machine:
    """The machine with the fitted values, if there can be such a machine."""
    try:
        return machine.with_values(fitted)
    except UsageError as error:
        raise IdentificationError(
            f"the fit to {', '.join(drops)} ended at a machine that cannot be: {error}. The description is "
            "too far from the machine, or a sensor is missing, swapped or reversed; check sensors, bearing "
            "nodes and ranges, and that all drops are of this machine."
        ) from error


def values_of(problem: DropProblem, mean: Array, covariance: Array, widening: float) -> dict[str, Known]:
    """Values for the machine file by their paths, with intervals."""
    fitted = zip(problem.unknowns, fitted_values(problem, mean, covariance, widening), strict=True)
    # a machine file states intervals, and not which part of them the model leaves out
    values = {u.path: replace(value, allowance_90=None) for u, value in fitted if u.scope == "machine"}
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    first = problem.n_dynamic + len(problem.unknowns)
    for c, sensor in enumerate(problem.model.machine.sensors):
        gain, offset = first + c, first + problem.n_channels + c
        reading = 1.0 + float(mean[gain])
        values |= {
            f"sensors.{sensor.name}.{name}": symmetric(value, error, "determined", unit, widening)
            for name, value, error, unit in (
                ("gain", 1.0 / reading, float(sigma[gain]) / reading**2, "1"),
                ("offset", sensor.polarity * float(mean[offset]), float(sigma[offset]), "m"),
            )
        }
    return values


def as_filed(machine: Machine, values: dict[str, Known]) -> dict[str, Known]:
    """Fitted values as a machine file has them: some belong to each other, such as a contact's."""
    found, load = dict(values), float(np.mean(bearing_load_shares(machine)))
    for bearing in machine.touchdown_bearings:
        changed = pair_of_the_file(bearing, below(values, f"{bearing.name}."), load)
        found |= {f"{bearing.name}.{path}": value for path, value in changed.items()}
    return found


def _as_known(values: dict[str, Known], identifiability: tuple[Identifiability, ...]) -> dict[str, Known]:
    """Values of which a parameter that the records do not determine has the interval of its prior.

    What the fit leaves of its uncertainty rests on a random walk of the filter; an estimate with the
    calibrated machine would take it for knowledge.
    """
    found = dict(values)
    for entry in identifiability:
        path = entry.path
        if entry.verdict in NOT_DETERMINED and row_of(path).logarithmic:
            row, value, reach = (
                row_of(path),
                found[path].value,
                math.exp(NINETY * entry.prior_standard_deviation),
            )
            interval = (row.within(value / reach), row.within(value * reach))
            found[path] = replace(found[path], interval_90=interval)
    return found


def machine_values(bearings: Sequence[str], values: dict[str, Known], source: str) -> dict[str, Known]:
    """Calibrated values as entries of a machine description, the horizontal support with them.

    What the records do not determine stays a guess, so that no later estimate calls it known.
    """
    entries = {}
    for path, value in values.items():
        known = value.status not in NOT_DETERMINED
        entries[path] = Known(
            value=value.value,
            status="estimated" if known else "guess",
            interval_90=value.interval_90 if known else None,
            range=None if known else value.interval_90,
            source=source if known else f"{source}; {value.status}",
            unit=value.unit,
        )
    for name, row in ((name, row) for name in bearings for row in rows("bearing")):
        ratio = entries.pop(row.path_of(name), None) if row.ratio is not None else None
        if ratio is None or row.ratio is None:
            continue
        vertical = entries[f"{name}.{row.ratio[1]}"]
        low, high = vertical.interval_90 or vertical.range or (vertical.value, vertical.value)
        scaled = (low * ratio.value, high * ratio.value)
        entries[f"{name}.{row.file_path}"] = replace(
            vertical,
            value=vertical.value * ratio.value,
            interval_90=None if vertical.interval_90 is None else scaled,
            range=None if vertical.range is None else scaled,
        )
    return entries


def joint_covariance(
    model: DropModel,
    fitted: Mapping[str, Unknown],
    mean: Sequence[float],
    covariance: Array,
    known: Mapping[str, Known],
) -> JointSpread:
    """Joint distribution of the calibrated values of the touchdown bearings.

    The correlations are those of the fit, with mean (n,) and covariance (n, n) of the unknowns by path; the
    spreads are as wide as the intervals that the machine file states: a study of drops must not believe a
    value more than the file says.
    """
    chosen = [
        (place, unknown)
        for place, (path, unknown) in enumerate(fitted.items())
        # a value that came out as zero has no logarithm to correlate
        if is_of_a_bearing(unknown) and not (is_logarithmic(unknown) and known[path].value <= 0.0)
    ]
    places, unknowns = [place for place, _ in chosen], [unknown for _, unknown in chosen]
    logs = [is_logarithmic(unknown) for unknown in unknowns]
    block = covariance[np.ix_(places, places)]
    errors = np.sqrt(np.maximum(np.diag(block), 1e-300))
    named = [(known[one.path], log) for one, log in zip(unknowns, logs, strict=True)]
    stated = [deviation_of(one.value, one.interval_90, logarithmic=log) for one, log in named]
    scale = slope_signs(unknowns, np.array(mean)[places], errors) * np.array(stated) / errors
    through = file_of_fitted(model, unknowns, [known[one.path].value for one in unknowns])
    matrix = through @ (scale[:, None] * block * scale) @ through.T
    return JointSpread(
        paths=tuple(file_path(one.path) for one in unknowns),
        logarithmic=tuple(logs),
        covariance=tuple(matrix[np.tril_indices(len(unknowns))].tolist()),
    )


def _identifiability(
    problem: DropProblem, covariance: Array, values: dict[str, Known]
) -> tuple[Identifiability, ...]:
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return tuple(
        Identifiability(
            path=unknown.path,
            prior_standard_deviation=unknown.sigma,
            posterior_standard_deviation=float(sigma[problem.n_dynamic + k]),
            verdict=values[unknown.path].status,
        )
        for k, unknown in enumerate(problem.unknowns)
        if unknown.scope == "machine"
    )


def confounded_of(problem: DropProblem, covariance: Array) -> tuple[Confounded, ...]:
    """Pairs of unknowns that the records tell apart badly."""
    start, n_p = problem.n_dynamic, len(problem.unknowns)
    known = [(u.parameter, u.owner) for u in problem.unknowns]
    known += [(row, s.name) for row in rows("sensor") for s in problem.model.machine.sensors]
    count = n_p + 2 * problem.n_channels
    block = covariance[start : start + count, start : start + count]
    sigma = np.sqrt(np.maximum(np.diag(block), 1e-300))
    correlation = block / np.outer(sigma, sigma)
    pairs = [(i, j) for i in range(count) for j in range(i) if abs(correlation[i, j]) > CONFOUNDED]
    return tuple(
        Confounded(
            first=known[j][0].path_of(known[j][1]),
            second=known[i][0].path_of(known[i][1]),
            correlation=float(correlation[i, j]),
            separated_by=separating_measurement(known[j][0], known[i][0]),
        )
        for i, j in sorted(pairs, key=lambda pair: -abs(correlation[pair]))
    )


def calibration_json(calibration: Calibration) -> dict[str, object]:
    """The calibration ready for JSON: values, identifiability, confounded pairs, checks."""
    return stated(
        calibration,
        "values identifiability confounded checks consistent structure nis sentence",
        checks={
            name: [stated(one, "name passed message=said") for one in checks]
            for name, checks in calibration.checks.items()
        },
    )
