"""Score an estimate against the truth: errors of every quantity, and whether the intervals hold.

A truth is that of a recording made here, or a supplied one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotordrop.document import read_json
from rotordrop.elements.table import published
from rotordrop.errors import UsageError
from rotordrop.severity.numbers import LOADS

_NEEDED = ("air_gap_m", "peak_force_N")
SUPPLIED: dict[str, tuple[str, ...]] = {
    "equivalent_stiffness_N_per_m": ("equivalent_stiffness",),
    "support.stiffness_N_per_m": ("support_stiffness",),
    "support.mass_kg": ("support_mass",),
    "support.damping_N_s_per_m": ("support_damping",),
    "contact.stiffness_N_per_m_n": ("contact_K",),
    "contact.exponent": ("contact", "n"),
    "contact.damping_s_per_m": ("contact", "lam"),
    "friction.static": ("friction_static",),
    "friction.dynamic": ("friction_dynamic",),
    "friction.stribeck_speed_m_per_s": ("contact", "v_stribeck"),
    "race.mass_kg": ("ring", "m"),
    "race.inertia_kg_m2": ("ring_Ip",),
    "race.drag_coefficient": ("bearing", "drag_mu"),
    "damping_time_s": ("bearing", "Cb_over_Kb"),
    "peak_stress_Pa": ("max_stress_MPa",),
    "mean_stress_Pa": ("mean_stress_MPa",),
}
"""Where a supplied truth file has what it calls otherwise than an estimate: a number, one for each bearing,
or a list of bearings and a key."""

SEEN_AS = {"tilted machine": "side force"}
"""Kinds of violations that a drop does not tell from another one."""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What is true about one simulated recording."""

    values: Mapping[str, Any]
    """The fields of the truth file."""
    path: Path | None = None
    """Where the truth was read."""

    @property
    def name(self) -> str:
        """Name of the recording."""
        return str(self.values.get("name", self.path.stem if self.path else "truth"))

    @property
    def bearing_names(self) -> tuple[str, ...]:
        """Names of the touchdown bearings."""
        return tuple(self.values["air_gap_m"])

    def of_bearing(self, bearing: str) -> dict[str, float]:
        """True values of one bearing (SI) by path in an estimate, such as ``"support.mass_kg"``."""
        found = {}
        for path in (*published(), *(load.field for load in LOADS)):
            place = (path,) if path in self.values else SUPPLIED.get(path, (path,))
            value = self.values.get(place[0])
            if isinstance(value, Mapping):
                value = value.get(bearing)
            elif isinstance(value, Sequence):
                value = value[self.bearing_names.index(bearing)].get(place[1])
            if value is not None:
                found[path] = (1e6 if place[0].endswith("_MPa") else 1.0) * float(value)
        return found

    @property
    def violated(self) -> tuple[str, ...]:
        """Kinds of violations, by the name that an estimate has for what it sees of them."""
        return tuple(SEEN_AS.get(kind, kind) for kind in self.values.get("violated", ()))

    @property
    def structure(self) -> dict[str, float]:
        """True values of structures beyond the base model [SI], by path such as ``"NDE.support.cubic"``."""
        return {path: float(value) for path, value in self.values.get("structure", {}).items()}


def read_truth(path: str | Path) -> Truth:
    """Read a truth file, ours or a supplied one."""
    return truth_of(read_json(Path(path), "rotordrop-bench synthesize"), path=Path(path))


def truth_of(values: Any, *, path: Path | None = None) -> Truth:
    """Truth from the fields of a truth file, refused when it is none."""
    missing = [key for key in _NEEDED if not isinstance(values, Mapping) or key not in values]
    if missing:
        keys = " and no ".join(map(repr, missing))
        raise UsageError(
            f"{path or 'the given object'} is no truth file: it has no {keys}; "
            "give the .json that 'rotordrop-bench synthesize' wrote, or a supplied truth file"
        )
    return Truth(values=values, path=path)


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
    ``relative_error`` and, where an interval was given, ``interval_90``, ``covered`` and ``half_width``.
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
