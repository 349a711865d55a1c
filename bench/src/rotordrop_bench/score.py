"""Score an estimate against the truth: errors of every quantity, and whether the intervals hold."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.document import read_json
from rotordrop.errors import UsageError
from rotordrop_bench.truth import Truth, read_truth, truth_of

Estimate = Mapping[str, Any]

Score = dict[str, Any]
"""How far one value is from the truth: ``estimate``, ``truth``, ``error`` [SI], and where they are known
``relative_error``, ``interval_90``, ``covered`` (whether that holds the truth), ``half_width`` over it."""


def score_estimate(
    estimate: Estimate | str | Path, truth: Truth | Mapping[str, Any] | str | Path, *, drop: str | None = None
) -> dict[str, Any]:
    """Compare the result of ``rotordrop estimate --json`` with the truth of its recording.

    ``drop`` is the recording meant of an estimate of several, or the name it was given since; an estimate of
    another recording is refused, by the hash of the file where the truth has it, else by its name. The
    scores are ``method`` and ``consistent`` (what the estimate says of itself); ``named``, what it says the
    machine has beyond the base model, and ``violated``, what it has; ``drop``,
    ``bearings.<name>.<quantity>`` and ``structure.<path>``, each with ``estimate``, ``truth``, ``error``,
    ``relative_error`` and, where an interval was given, ``interval_90``, ``covered`` and ``half_width``;
    ``coverage`` over all intervals.
    """
    if not isinstance(truth, Truth):
        truth = truth_of(truth) if isinstance(truth, Mapping) else read_truth(truth)
    if not isinstance(estimate, Mapping):
        estimate = read_json(Path(estimate), "rotordrop estimate --json")
    found = _one_drop(estimate, truth, drop)
    _refuse_another_recording(found, truth, drop)
    told = {name: found.get("bearings", {}).get(name, {}) for name in truth.bearing_names}
    bearings = {name: _scores(fields, truth.of_bearing(name)) for name, fields in told.items()}
    instant = {"value": found.get("drop_instant_s"), "interval_90": found.get("drop_instant_interval_90_s")}
    of_drop = {"drop_instant_s": "t_off_in_record_s", "speed_Hz": "n0_hz"}
    true = {name: float(v) for name, key in of_drop.items() if (v := truth.values.get(key)) is not None}
    whole = _scores({"drop_instant_s": instant, "speed_Hz": found.get("speed_Hz")}, true)
    listed = {str(entry.get("path")): entry.get("estimate") for entry in _listed(found, "parameters")}
    structure = _scores(listed, truth.structure)
    every = [score for scores in (whole, *bearings.values(), structure) for score in scores.values()]
    if not every:
        raise UsageError(
            f"the estimate holds none of the quantities of the truth {truth.name!r}: it has "
            f"{', '.join(sorted(found)) or 'nothing'}; expected the JSON of 'rotordrop estimate'"
        )
    judged = [score["covered"] for score in every if "covered" in score]
    named = [one for one in _listed(found, "structure") if "name" in one and one.get("probability") is None]
    return {
        "name": truth.name,
        "method": found.get("method"),
        "consistent": found.get("consistent", _at(found, "consistency.consistent")),
        "drop": whole,
        "bearings": bearings,
        "named": [entry["name"] for entry in named],
        "violated": list(truth.violated),
        "structure": structure,
        "coverage": {
            "intervals": len(judged),
            "covered": sum(judged),
            "fraction": float(np.mean(judged)) if judged else None,
        },
    }


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
    if hashes and own in hashes.values():
        return
    if hashes and own:
        belongs = ", ".join(f"{file} ({sha[:12]}…)" for file, sha in hashes.items())
        raise UsageError(
            f"the estimate is of a recording with SHA-256 {str(own)[:12]}…, and the truth {truth.name!r} "
            f"belongs to {belongs}; give the truth of that recording"
        )
    record = estimate.get("record")
    names = {estimate.get("name"), Path(record).stem if isinstance(record, str) else None} - {None}
    if names and (drop or truth.name) not in names:
        raise UsageError(
            f"the estimate is of the recording {' or '.join(sorted(map(repr, names)))}, the truth of "
            f"{truth.name!r}; give the truth of that recording, or say --drop {min(map(str, names))} if it "
            "was renamed"
        )


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


def _scores(entries: Mapping[str, Any], truths: Mapping[str, float]) -> dict[str, Score]:
    """Score of every true value that the estimate has."""
    scores: dict[str, Score] = {}
    for path, truth in truths.items():
        entry = entries.get(path, _at(entries, path))
        value, interval = entry, None
        if isinstance(entry, Mapping):
            value, interval = entry.get("value"), entry.get("interval_90")
        if not isinstance(value, int | float) or not math.isfinite(value):
            continue
        scores[path] = {"estimate": float(value), "truth": truth, "error": float(value) - truth}
        if truth != 0.0:
            scores[path]["relative_error"] = (value - truth) / truth
        if interval is not None:
            low, high = _ends(interval)
            scores[path]["interval_90"], scores[path]["covered"] = [low, high], low <= truth <= high
            if truth != 0.0:
                scores[path]["half_width"] = 0.5 * (high - low) / abs(truth)
    return scores


def _ends(interval: Any) -> tuple[float, float]:
    """Ends of an interval of an estimate, which somebody else's program may have written."""
    numbers = isinstance(interval, list | tuple) and all(isinstance(end, int | float) for end in interval)
    if not numbers or len(interval) != 2 or not interval[0] <= interval[1]:
        raise UsageError(f"interval_90 is {interval!r}; expected two numbers, the lower one first, or none")
    return float(interval[0]), float(interval[1])
