"""What a drop amounts to in a few numbers: for the hook, the overview and the line on the screen."""

from __future__ import annotations

import json
import math
from typing import Any

from rotordrop.estimate.published import Drop, read_drop
from rotordrop.jobs.runner import Verb, result_folder
from rotordrop.jobs.workspace import Job
from rotordrop.report.compare_page import ComparedDrop, limit_statement
from rotordrop.report.quantity import Quantity
from rotordrop.units import format_quantity
from rotordrop.watch.fleet import Watched

NOT_KNOWN = "the machine is not known"
PEAKS = (("peak_force", "N"), ("peak_stress", "Pa"))
KINDS = ("force", "pressure")
"""Numbers of a drop and the kinds they are of."""
NO_PEAKS: dict[str, Any] = dict.fromkeys(
    f"{name}{end}_{unit}" for name, unit in PEAKS for end in ("", "_lower", "_upper")
)
CUT = "truncated"
"""What the warning of a reader says of a file that ends too early."""
REPLACED = "replaced"
"""Outcome of a record that was taken before it was complete, and is kept whole."""
VERBS: dict[str, Verb] = {"estimated": "estimate", "looked": "look"}
"""Computations of the page by what came of them."""


def scalars_of(job: Job, status: dict[str, Any], watched: Watched | None) -> dict[str, Any]:
    """At most fifteen numbers and texts of a drop, flat, SI, the unit in the key; null where none is known.

    ``needs_person`` says why somebody should look, and is empty where nobody needs to.
    """
    entry, outcome, why = job.read()["files"]["record"], status["outcome"], status.get("why", "")
    found: dict[str, Any] = {
        "sha256": entry["sha256"],
        "record": entry["name"],
        "machine": status.get("serial", ""),
        "recorded": "",
        "outcome": outcome,
        "verdict": why,
        "needs_person": "" if outcome == REPLACED else why,
        "speed_Hz": None,
        "bearing": "",
        **NO_PEAKS,
    }
    folder = None if outcome not in VERBS else result_folder(job, VERBS[outcome], "document.json")
    if folder is None:
        return found
    if outcome == "estimated":
        return found | _of_estimate(read_drop(folder / "document.json"), watched)
    seen = json.loads((folder / "document.json").read_bytes())
    speed = seen["speed_rad_per_s"]
    cut = [f"; {one['message']}" for one in seen["findings"] if CUT in one["message"]]
    warned = f"{NOT_KNOWN}: {why}{''.join(cut)}"
    return found | {
        "verdict": warned,
        "needs_person": warned,
        "speed_Hz": None if speed is None else speed / (2.0 * math.pi),
    }


def _of_estimate(drop: Drop, watched: Watched | None) -> dict[str, Any]:
    """Peaks of the bearing where each is largest, and what the limits of the owner say of them."""
    found: dict[str, Any] = {"recorded": drop.recorded, "speed_Hz": drop.speed_Hz, "verdict": drop.verdict}
    places = []
    if not all(one.stated("peak_force_N") for one in drop.bearings.values()):
        return found | {"needs_person": drop.verdict}
    for name, unit in PEAKS:
        place, peak = drop.largest(f"{name}_{unit}")
        lower, upper = peak.interval or (None, None)
        places.append(place)
        found[f"{name}_{unit}"] = peak.value
        found[f"{name}_lower_{unit}"], found[f"{name}_upper_{unit}"] = lower, upper
    force, stress = places
    found["bearing"] = force if force == stress else f"{force} (force), {stress} (stress)"
    limits = {} if watched is None else watched.limits
    judged = limit_statement([ComparedDrop(drop.record, drop)], limits)
    doubts = [] if drop.consistent else [drop.verdict]
    doubts += [f"{one}." for one in drop.warnings if CUT in one]
    if limits:
        found["verdict"] = f"{drop.verdict} {judged.text}"
        doubts += [judged.text] if judged.level != "good" else []
    found["needs_person"] = " ".join(doubts)
    return found


def line_of(found: dict[str, Any], number: int | None) -> str:
    """A drop on one line."""
    who = f"{found['record']}: {found['machine'] or 'unknown machine'}"
    if found["peak_force_N"] is None:
        return f"{who}, {found['outcome']}: {found['verdict']}"
    force, stress = (shown_peak(found, *peak, kind) for peak, kind in zip(PEAKS, KINDS, strict=True))
    speed = format_quantity(2.0 * math.pi * found["speed_Hz"], "speed")
    logged = "" if number is None else f", drop {number} of the log"
    person = f"; needs a person: {found['needs_person']}" if found["needs_person"] else ""
    return (
        f"{who}, {speed}, {found['bearing']}: {force.text} ({force.interval_text}), "
        f"{stress.text} ({stress.interval_text}){logged}{person}"
    )


def shown_peak(found: dict[str, Any], name: str, unit: str, kind: str) -> Quantity:
    """A peak with its interval."""
    low, high = found[f"{name}_lower_{unit}"], found[f"{name}_upper_{unit}"]
    value = found[f"{name}_{unit}"]
    return Quantity(
        value=math.nan if value is None else value,
        kind=kind,
        interval_90=None if low is None else (low, high),
    )
