"""LabVIEW measurement files (.lvm): text with a head for the file and one for every segment."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from rotordrop.record.profile import Profile
from rotordrop.record.readers.delimited import recording_of_lines
from rotordrop.record.readers.text import fields_of, read_lines, stamp_parts
from rotordrop.record.recording import Recording

_END_OF_HEAD = "***End_of_Header***"

_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}


def read_lvm(path: Path, profile: Profile) -> Recording:
    """Read the segments of a file, with one time column, one for each channel or none.

    Segments that follow each other are joined. Of others the first is read with a warning, or the one that
    holds `text.first_data_line` of the profile.
    """
    lines, complete, encoding = read_lines(path, profile.text)
    head = "\n".join(lines[:40])
    named = re.search(r"^Separator[\t,;](\w+)", head, re.MULTILINE)
    comma = re.search(r"^Decimal_Separator[\t,;],", head, re.MULTILINE)
    separator = profile.text.separator or _SEPARATORS.get(named[1].lower() if named else "", "\t")
    decimal = profile.text.decimal or ("," if comma else ".")
    starts, ends = _segments(lines, separator)
    if (wanted := profile.text.first_data_line) is not None:
        chosen = max((i for i, start in enumerate(starts) if start < wanted), default=0)
        starts, ends = starts[chosen : chosen + 1], ends[chosen : chosen + 1]
    parts = []
    for start, end in zip(starts, ends, strict=True):
        # blank lines in front keep the numbers of lines in messages
        body = [""] * start + _without_comments(lines[start:end], separator)
        top = next((i for i, line in enumerate(body) if line.startswith("X_Value")), start - 1) + 1
        text = profile.text.model_copy(
            update={"separator": separator, "decimal": decimal, "first_data_line": top + 1}
        )
        ruled, whole = profile.model_copy(update={"text": text}), complete or end < len(lines)
        parts.append(recording_of_lines(body, whole, f"LabVIEW measurement in {encoding}", path, ruled))
    return _joined(parts, starts)


def _segments(lines: Sequence[str], separator: str) -> tuple[list[int], list[int]]:
    """Where the head of every segment begins, and where its readings end."""
    marks = [i for i, line in enumerate(lines) if line.startswith(_END_OF_HEAD)]
    if len(marks) < 2:  # no heads of segments
        first = marks[0] + 1 if marks else 0
        return [first], [len(lines)]
    below = next((line for line in lines[marks[0] + 1 :] if line.strip()), "")
    if below.startswith("X_Value"):  # the head of the file and that of the first segment are one
        marks = [-1, *marks]
    starts = []
    for before, mark in pairwise(marks):
        heads = (i for i in range(mark, before, -1) if lines[i].startswith(f"Channels{separator}"))
        starts.append(next(heads, before + 1))
    return starts, [*starts[1:], len(lines)]


def _without_comments(lines: list[str], separator: str) -> list[str]:
    """Cut off the column of comments, which many rows lack; blank lines between segments go too."""
    while lines and not lines[-1].strip():
        lines.pop()
    names = next((fields_of(line, separator) for line in lines if line.startswith("X_Value")), [])
    lines = [line for line in lines if not line.startswith(_END_OF_HEAD)] if not names else lines
    if not names or names[-1] != "Comment":
        return lines
    return [separator.join(line.split(separator)[: len(names) - 1]) for line in lines]


def _joined(parts: list[Recording], starts: Sequence[int]) -> Recording:
    """One recording of segments that follow each other, else the first with a warning."""
    first, began = parts[0], _began(parts[0])
    pieces = [first]
    for part in parts[1:]:
        last, after = pieces[-1].channels[0].time, part.channels[0].time
        step = (last[-1] - last[0]) / max(len(last) - 1, 1)
        moved = after
        if after[0] <= last[-1]:  # the time of each segment counts from its own start
            moved = after + (_began(part) - began)
        named = [channel.label for channel in part.channels] == [channel.label for channel in first.channels]
        if not named or abs(moved[0] - last[-1] - step) > 0.5 * step:
            words = (
                f"the file holds {len(parts)} segments that do not follow each other; the first is read "
                f"(first_data_line = {starts[1] + 1} under [text] of a profile reads the second)"
            )
            return replace(first, warnings=(*first.warnings, words))
        shift = float(moved[0] - after[0])
        pieces.append(replace(part, channels=tuple(replace(c, time=c.time + shift) for c in part.channels)))
    channels = tuple(
        replace(
            channel,
            time=np.concatenate([piece.channels[i].time for piece in pieces]),
            values=np.concatenate([piece.channels[i].values for piece in pieces]),
        )
        for i, channel in enumerate(first.channels)
    )
    warnings = tuple(word for piece in pieces for word in piece.warnings)
    return replace(first, channels=channels, warnings=warnings)


def _began(part: Recording) -> float:
    """When a segment began by its date and time of day [s]; 0 where it says none."""
    date = part.metadata.get("Date", "").split(" ")[0].replace("/", "-")
    clock = re.sub(r"([.,]\d{1,9})\d*.*", r"\1", part.metadata.get("Time", "").split(" ")[0])
    seconds, nanoseconds = stamp_parts(f"{date} {clock}") or (0, 0)
    return seconds % 86_400_000 + 1e-9 * nanoseconds
