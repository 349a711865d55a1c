"""Score an estimate against the truth: errors of every quantity, and whether the intervals hold."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import UsageError
from rotordrop_bench.truth import Truth, read_truth, truth_of

Array = NDArray[np.float64]
Estimate = Mapping[str, Any]

LARGE_IMPACT = 1.7
"""Impacts are scored whose true peak exceeds this many times the mean weight on a bearing [1]."""

SAME_IMPACT = 5e-4
"""An estimated impact belongs to a true one when it peaks within it, widened by this [s]."""


@dataclass(frozen=True, kw_only=True)
class Score:
    """How far one estimated value is from the truth."""

    estimate: float
    truth: float
    """The two values (SI)."""
    error: float
    """Estimate minus truth."""
    relative_error: float | None
    """Error over truth [1]."""
    covered: bool | None
    """Whether the 90 % interval holds the truth; None without an interval."""
    half_width: float | None
    """Half the interval over the truth [1]."""

    def as_json(self) -> dict[str, Any]:
        """The fields that are known."""
        return {name: value for name, value in vars(self).items() if value is not None}


def score_estimate(
    estimate: Estimate | str | Path, truth: Truth | Mapping[str, Any] | str | Path, *, drop: str | None = None
) -> dict[str, Any]:
    """Compare an estimate with the truth of its recording.

    Parameters
    ----------
    estimate : mapping or path
        Result of ``rotordrop estimate --json``, of one recording or of several.
    truth : Truth, mapping or path
        Truth file of a recording, ours or a supplied one.
    drop : str, optional
        Which recording of an estimate of several, or the name the recording was given since; the name of the
        truth when left out.

    Returns
    -------
    dict
        ``method`` and ``consistent`` (what the estimate says of itself); ``named``, what it says the machine
        has beyond the usual model, and ``violated``, what it has; ``drop``,
        ``bearings.<name>.<quantity>`` and ``structure.<path>``, each with ``estimate``, ``truth``, ``error``,
        ``relative_error`` and, where an interval was given, ``covered`` and ``half_width``; ``impacts`` per
        bearing where the estimate lists impacts; ``coverage`` over all intervals.

    Raises
    ------
    UsageError
        If the estimate is none, or is one of another recording: by the hash of the file where the truth has
        it, else by its name.
    """
    known = _truth(truth)
    found = _one_drop(_estimate(estimate), known, drop)
    _refuse_another_recording(found, known, drop)
    bearings = {name: _bearing_scores(found, known, name) for name in known.bearing_names}
    whole = _drop_scores(found, known)
    structure = _structure_scores(found, known)
    impacts = {name: score for name in known.bearing_names if (score := _impact_scores(found, known, name))}
    every = [*whole.values(), *(score for scores in bearings.values() for score in scores.values())]
    every += structure.values()
    if not every:
        raise UsageError(
            f"the estimate holds none of the quantities of the truth {known.name!r}: it has "
            f"{', '.join(sorted(found)) or 'nothing'}; expected the JSON of 'rotordrop estimate'"
        )
    return {
        "name": known.name,
        "method": found.get("method"),
        "consistent": found.get("consistent", _at(found, "consistency.consistent")),
        "drop": {name: score.as_json() for name, score in whole.items()},
        "bearings": {
            name: {path: score.as_json() for path, score in scores.items()}
            for name, scores in bearings.items()
        },
        "named": [entry["name"] for entry in _listed(found, "structure") if "name" in entry],
        "violated": list(known.values.get("violated", [])),
        "structure": {path: score.as_json() for path, score in structure.items()},
        "impacts": impacts,
        "coverage": _coverage(every),
    }


def _truth(truth: Truth | Mapping[str, Any] | str | Path) -> Truth:
    if isinstance(truth, Truth):
        return truth
    return truth_of(truth) if isinstance(truth, Mapping) else read_truth(truth)


def _estimate(estimate: Estimate | str | Path) -> Estimate:
    if isinstance(estimate, Mapping):
        return estimate
    try:
        loaded = json.loads(Path(estimate).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UsageError(
            f"{estimate} cannot be read as an estimate ({error}); "
            "give the file of 'rotordrop estimate --json'"
        ) from error
    if not isinstance(loaded, Mapping):
        raise UsageError(f"{estimate} holds no estimate; give the file of 'rotordrop estimate --json'")
    return loaded


def _one_drop(estimate: Estimate, truth: Truth, drop: str | None) -> Estimate:
    drops = estimate.get("drops")
    if not isinstance(drops, Mapping):
        return estimate
    wanted = drop or truth.name
    if wanted not in drops:
        raise UsageError(
            f"the estimate has no drop {wanted!r}; it has {', '.join(map(repr, drops))}: name one with --drop"
        )
    machine = estimate.get("machine")
    shared = machine.get("bearings", {}) if isinstance(machine, Mapping) else {}
    mine = drops[wanted]
    names = {*shared, *mine.get("bearings", {})}
    merged = {name: {**shared.get(name, {}), **mine.get("bearings", {}).get(name, {})} for name in names}
    return {**mine, "bearings": merged}


def _refuse_another_recording(estimate: Estimate, truth: Truth, drop: str | None) -> None:
    """Refuse an estimate of another recording: its numbers compare with nothing."""
    hashes, own = truth.values.get("record_sha256"), estimate.get("record_sha256")
    if hashes and own:
        if own not in hashes.values():
            raise UsageError(
                f"the estimate is of a recording with SHA-256 {str(own)[:12]}…, and the truth {truth.name!r} "
                f"belongs to {', '.join(f'{file} ({sha[:12]}…)' for file, sha in hashes.items())}; give the "
                "truth of that recording"
            )
        return
    record = estimate.get("record")
    names = {estimate.get("name"), Path(record).stem if isinstance(record, str) else None} - {None}
    if names and (drop or truth.name) not in names:
        raise UsageError(
            f"the estimate is of the recording {' or '.join(sorted(map(repr, names)))}, the truth of "
            f"{truth.name!r}; give the truth of that recording, or say --drop {min(map(str, names))} if it "
            "was renamed"
        )


def _bearing_scores(estimate: Estimate, truth: Truth, bearing: str) -> dict[str, Score]:
    fields = estimate.get("bearings", {}).get(bearing, {})
    scores = {}
    for path, true in truth.of_bearing(bearing).items():
        score = _score(_at(fields, path), true)
        if score is not None:
            scores[path] = score
    return scores


def _drop_scores(estimate: Estimate, truth: Truth) -> dict[str, Score]:
    pairs = (("drop_instant_s", "t_off_in_record_s"), ("speed_Hz", "n0_hz"))
    scores = {}
    for name, key in pairs:
        true = truth.values.get(key)
        entry = estimate.get(name)
        if name == "drop_instant_s" and not isinstance(entry, Mapping):
            entry = {"value": entry, "interval_90": estimate.get("drop_instant_interval_90_s")}
        score = None if true is None else _score(entry, float(true))
        if score is not None:
            scores[name] = score
    return scores


def _structure_scores(estimate: Estimate, truth: Truth) -> dict[str, Score]:
    """Scores of structures by path, where the estimate lists them among its ``parameters``."""
    listed = {entry.get("path"): entry.get("estimate") for entry in _listed(estimate, "parameters")}
    scores = {path: _score(listed.get(path), true) for path, true in truth.structure.items()}
    return {path: score for path, score in scores.items() if score is not None}


def _listed(estimate: Estimate, key: str) -> list[Mapping[str, Any]]:
    """Entries of a list of an estimate; none where it has no such list."""
    listed = estimate.get(key)
    return [entry for entry in listed if isinstance(entry, Mapping)] if isinstance(listed, list) else []


def _at(fields: Any, path: str) -> Any:
    for key in path.split("."):
        if not isinstance(fields, Mapping) or key not in fields:
            return None
        fields = fields[key]
    return fields


def _score(entry: Any, truth: float) -> Score | None:
    value = entry.get("value") if isinstance(entry, Mapping) else entry
    if not isinstance(value, int | float) or not math.isfinite(value):
        return None
    interval = entry.get("interval_90") if isinstance(entry, Mapping) else None
    relative = (value - truth) / truth if truth != 0.0 else None
    covered = half = None
    if interval is not None:
        low, high = _ends(interval)
        covered = low <= truth <= high
        half = 0.5 * (high - low) / abs(truth) if truth != 0.0 else None
    return Score(
        estimate=float(value),
        truth=truth,
        error=float(value) - truth,
        relative_error=relative,
        covered=covered,
        half_width=half,
    )


def _ends(interval: Any) -> tuple[float, float]:
    """Ends of an interval of an estimate, which somebody else's program may have written."""
    numbers = isinstance(interval, list | tuple) and all(isinstance(end, int | float) for end in interval)
    if not numbers or len(interval) != 2 or not interval[0] <= interval[1]:
        raise UsageError(f"interval_90 is {interval!r}; expected two numbers, the lower one first, or none")
    return float(interval[0]), float(interval[1])


def _impact_scores(estimate: Estimate, truth: Truth, bearing: str) -> dict[str, Any]:
    """Errors of the peaks of all large impacts that the estimate lists, and how many it missed."""
    listed = estimate.get("bearings", {}).get(bearing, {}).get("impacts")
    if not isinstance(listed, list):
        return {}
    true, least = truth.impacts(bearing), LARGE_IMPACT * truth.bearing_load
    true = true[true[:, 2] > least]
    matches = [_matching(listed, row) for row in true]
    errors = [(m[0] - row[2]) / row[2] for m, row in zip(matches, true, strict=True) if m is not None]
    covered = [m[1] <= row[2] <= m[2] for m, row in zip(matches, true, strict=True) if m is not None and m[3]]
    return {
        "true_impacts": len(true),
        "above_N": least,
        "found": len(errors),
        "relative_errors": errors,
        "median_absolute_error": float(np.median(np.abs(errors))) if errors else None,
        "covered": float(np.mean(covered)) if covered else None,
    }


def _matching(listed: list[Any], row: Array) -> tuple[float, float, float, bool] | None:
    best = None
    for impact in listed:
        time, peak = _number(impact, "time_s", "peak_time_s"), _number(impact, "peak_force_N", "peak_N")
        if time is None or peak is None or not row[0] - SAME_IMPACT <= time <= row[1] + SAME_IMPACT:
            continue
        entry = impact.get("peak_force_N", impact.get("peak_N"))
        interval = entry.get("interval_90") if isinstance(entry, Mapping) else None
        low, high = _ends(interval) if interval is not None else (math.nan, math.nan)
        if best is None or peak > best[0]:
            best = (peak, low, high, interval is not None)
    return best


def _number(entry: Any, *names: str) -> float | None:
    for name in names:
        value = entry.get(name) if isinstance(entry, Mapping) else None
        value = value.get("value") if isinstance(value, Mapping) else value
        if isinstance(value, int | float):
            return float(value)
    return None


def _coverage(scores: list[Score]) -> dict[str, Any]:
    judged = [score.covered for score in scores if score.covered is not None]
    return {
        "intervals": len(judged),
        "covered": int(sum(judged)),
        "fraction": float(np.mean(judged)) if judged else None,
    }
