"""The drops that are kept: the row of a job in the list, and what people say of it."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from rotordrop.errors import DamagedFileError, UsageError
from rotordrop.web.running import Verb, result_folder
from rotordrop.web.workspace import Job, labelled

THUMBNAIL_S, THUMBNAIL_POINTS = (-0.005, 0.15), 140
"""Part of a drop from its release that a thumbnail shows [s], and in how many points; chosen, not
measured."""
THUMBNAIL_SIZE = 100
"""Units of a thumbnail from edge to edge; chosen, not measured."""
LONGEST_NOTE, LONGEST_TAG, MOST_TAGS, MOST_NOTES = 2000, 40, 12, 60
"""Characters of a note and of a tag, tags of a drop, and notes at an instant; chosen, not measured."""


def row_of_job(job: Job) -> dict[str, Any] | None:
    """What is known of a drop: by its estimate, else by the look at it; None where neither is there.

    What cannot be read of them is named under ``damaged``.
    """
    damaged: dict[str, Any] = {}
    verbs: tuple[Verb, ...] = ("estimate", "look")
    for verb in verbs:
        try:
            folder = result_folder(job, verb)
            if folder is not None:
                return {**_row_in(folder, verb), **damaged}
        except (DamagedFileError, UsageError) as error:
            damaged = {"damaged": str(error).replace(f"{job.path}/", "")}
    return damaged or None


@lru_cache(maxsize=2048)
def _row_in(folder: Path, verb: str) -> dict[str, Any]:
    told = json.loads((folder / "page.json").read_bytes())
    row = told.get("row")
    if row is None and verb == "estimate":  # an earlier version wrote none
        from rotordrop.estimate.published import read_drop
        from rotordrop.ledger.book import drop_of_estimate
        from rotordrop.web.rows import row_of

        row = row_of(drop_of_estimate(read_drop(folder / "document.json"), ""))
    orbit = _thumbnail(folder, told, 0.0 if verb == "estimate" else told.get("zero", 0.0))
    return {
        "orbit": orbit,
        "verdict": "",
        "numbers": [],
        **(row or {}),
        "statement": told.get("verdict", [None])[0],
        "verb": verb,
    }


def _thumbnail(folder: Path, told: dict[str, Any], release: float) -> dict[str, Any] | None:
    """The orbit of a drop in few points, and the radius of its clearance circle, in units of a thumbnail.

    It is that of the bearing with the largest force, or of the first plane.
    """
    import numpy as np

    from rotordrop.web.traces import open_traces

    if not told.get("places"):
        return None
    traces = open_traces(folder, told["traces"]["name"], tuple(told["traces"]["columns"]))
    place = max(told["places"], key=lambda one: one.get("peaks", {}).get("force", {}).get("value") or 0.0)
    first, last = np.searchsorted(traces.time, [release + edge for edge in THUMBNAIL_S])
    if last - first < 2:
        return None
    few = np.linspace(first, last - 1, min(last - first, THUMBNAIL_POINTS)).astype(int)
    x, y = traces.values[traces.chosen(tuple(place.get("measured") or place["estimated"]))][:, few].astype(
        float
    )
    known = np.isfinite(x) & np.isfinite(y)
    gap = place["gap"][1] if place["gap"] else 0.0
    reach = max(gap, float(np.hypot(x[known], y[known]).max(initial=0.0))) or 1.0
    scale, middle = 0.48 * THUMBNAIL_SIZE / reach, THUMBNAIL_SIZE // 2
    points = zip(x[known], y[known], strict=True)
    path = " ".join(f"{middle + scale * right:.0f},{middle - scale * up:.0f}" for right, up in points)
    return {"path": path, "gap": round(scale * gap, 1)}


def label_of(order: dict[str, Any]) -> dict[str, Any]:
    """What somebody says of a drop, checked; what is not named stays."""
    for name in order:
        if name not in _LABEL:
            raise UsageError(f"there is no {labelled(name)!r} of a drop; there are {', '.join(_LABEL)}")
        kind, most, _ = _LABEL[name]
        if type(order[name]) is not kind:
            raise UsageError(f"{name} is {labelled(str(order[name]))!r}; expected {kind.__name__}")
        if kind is not bool and len(order[name]) > most:
            counted = "signs" if kind is str else "entries"
            raise UsageError(f"{name} holds {len(order[name])} {counted}; at most {most} are kept")
    return {name: _LABEL[name][2](value) for name, value in order.items()}


def _text(said: Any) -> str:
    if not isinstance(said, str) or len(said) > LONGEST_NOTE:
        raise UsageError(f"{labelled(str(said))!r} is no text of at most {LONGEST_NOTE} signs")
    return "".join(
        sign if sign.isprintable() or sign == "\n" else "\N{REPLACEMENT CHARACTER}" for sign in said
    )


def _instant(note: Any) -> dict[str, Any]:
    time = note.get("time") if isinstance(note, dict) else None
    if not isinstance(time, int | float) or isinstance(time, bool) or not abs(time) < 1e9:
        raise UsageError(f"{labelled(str(note))!r} is no note at an instant; expected a time [s] and a text")
    return {"time": float(time), "text": _text(note.get("text"))}


_LABEL: dict[str, tuple[type, int, Callable[[Any], Any]]] = {
    "name": (str, LONGEST_NOTE, lambda said: labelled(said.strip())),
    "note": (str, LONGEST_NOTE, _text),
    "bearings": (str, LONGEST_TAG, _text),
    "archived": (bool, 0, bool),
    "tags": (list, MOST_TAGS, lambda said: sorted({_text(tag).strip()[:LONGEST_TAG] for tag in said} - {""})),
    "notes": (list, MOST_NOTES, lambda said: sorted(map(_instant, said), key=lambda one: one["time"])),
}
"""What people may say of a drop: its kind, how much of it at most, and how it is kept."""


def label(job: Job, order: dict[str, Any]) -> None:
    """Keep what somebody says of a drop; what was found of it stays."""
    said, told = label_of(order), job.read()
    name = said.pop("name", told["name"])
    job.write({**told, "name": name, "label": {**told.get("label", {}), **said}})
