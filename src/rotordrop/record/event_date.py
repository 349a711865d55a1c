"""When a drop was, by the header of its record: a date is read where its form leaves no doubt."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import date, time

_KEYS = (
    "start|event time|event date|event|trigger time|trigger date|trigger|triggerzeit|triggerdatum|"
    "auslösezeit|ausloesezeit|auslösung|ereignis|ereigniszeit|date and time|date time|datetime|"
    "datum und uhrzeit|datum uhrzeit|timestamp|zeitstempel|zeitpunkt|date|datum|recorded at|recorded|"
    "recording date|recording time|aufgezeichnet am|aufgezeichnet|aufnahmedatum|aufnahmezeit|aufnahme|"
    "measurement date|measured|measurement|messdatum|messzeit|messung|acquisition date|acquisition time|"
    "start time|start date|startzeit|startdatum|beginn|time"
).split("|")
"""Header entries of recorders that say when the drop was, the most telling first."""
_TIMES_OF_DAY = ("time", "uhrzeit", "zeit", "trigger time", "start time")
"""Entries that hold a time of day beside a date."""

_MONTHS = dict(zip("jan feb mar apr may jun jul aug sep oct nov dec".split(), range(1, 13), strict=True))
_MONTHS |= {"mär": 3, "mae": 3, "mai": 5, "okt": 10, "dez": 12}
_WORD = rf"(?:{'|'.join(_MONTHS)})[a-z]{{0,6}}\.?"
_DAY = re.compile(
    r"(?P<y>\d{4})(?P<a>[-/.])(?P<m>\d{1,2})(?P=a)(?P<d>\d{1,2})"
    r"|(?P<first>\d{1,2})(?P<b>[-/.])(?P<second>\d{1,2})(?P=b)(?P<last>\d{4})"
    rf"|(?P<day>\d{{1,2}})(?:\.|st|nd|rd|th)?[ -]?(?P<word>{_WORD})[ ,-]+(?P<year>\d{{4}})"
    rf"|(?P<word2>{_WORD}) (?P<day2>\d{{1,2}})(?:st|nd|rd|th)?,? (?P<year2>\d{{4}})",
    re.IGNORECASE,
)
_OF_DAY = re.compile(
    r"(?P<h>\d{1,2}):(?P<min>\d{2})(?::(?P<s>\d{2})(?:[.,](?P<part>\d{1,9}))?)?"
    r"(?: ?(?P<half>[ap]\.?m\b\.?))?(?: Uhr\b)?(?: ?(?P<zone>Z\b|UTC\b|[+-]\d{2}:?\d{2}))?",
    re.IGNORECASE,
)
_END = re.compile(r"(?![\w.:/-])")
_LIKE_A_DATE = re.compile(r"\d{1,4}([./-])\d{1,2}\1\d{1,4}")
_LONGEST_FIRST = "|".join(key.replace(" ", "[ _/]+") for key in sorted(_KEYS, key=len, reverse=True))
_LINE = re.compile(rf"({_LONGEST_FIRST})\b[\s:=,;|\"]*", re.IGNORECASE)


def event_of(entries: Mapping[str, str]) -> tuple[str, str]:
    """When the drop was (ISO 8601) by header entries, and a note where a date leaves a doubt; else empty."""
    found = {re.sub(r"[^a-zäöüß]+", " ", k.lower()).strip(): str(v).strip() for k, v in entries.items()}
    said = [(key, found[key]) for key in _KEYS if key in found]
    for _, text in said:
        if (matched := _matched(text)) is not None:
            moment = matched[0]
            if "T" not in moment:
                of_day = (_OF_DAY.fullmatch(found.get(key, "")) for key in _TIMES_OF_DAY)
                moment += next((f"T{clock}" for one in of_day if one and (clock := _clock(one))), "")
            return moment, ""
    for key, text in said:
        if _LIKE_A_DATE.match(text):
            return "", (
                f"the date {text[:40]!r} behind {key!r} leaves open which day it is, and was left out; "
                "written as 2026-11-24 13:05 it counts"
            )
    return "", ""


def dated_line(line: str) -> tuple[str, str] | None:
    """Key and date of a line of a head, whatever stands between them; None where it holds no date."""
    key = _LINE.match(line)
    if key is None or (end := _matched(line[key.end() :])) is None:
        return None
    return key[1], line[key.end() : key.end() + end[1]]


def _matched(text: str) -> tuple[str, int] | None:
    """The moment that stands at the beginning of a text, and where it ends."""
    day = _DAY.match(text)
    if day is None or (moment := _date(day)) is None:
        return None
    gap = re.compile(r"[T ,;]+(?:um |at )?").match(text, day.end())
    of_day = None if gap is None else _OF_DAY.match(text, gap.end())
    if of_day is not None and (clock := _clock(of_day)) and _END.match(text, of_day.end()):
        return f"{moment}T{clock}", of_day.end()
    return (moment, day.end()) if _END.match(text, day.end()) else None


def _date(found: re.Match[str]) -> str | None:
    """A day; None where day and month cannot be told apart, or there is no such day."""
    if found["y"]:
        year, month, day = found["y"], found["m"], found["d"]
    elif found["last"]:
        year, day, month = found["last"], found["first"], found["second"]
        if found["b"] != ".":  # with points the day comes first, in every country
            if int(day) <= 12 and int(month) <= 12 and int(day) != int(month):
                return None
            if int(month) > 12:
                day, month = month, day
    else:
        month = str(_MONTHS[(found["word"] or found["word2"])[:3].lower()])
        year, day = found["year"] or found["year2"], found["day"] or found["day2"]
    try:
        return date(int(year), int(month), int(day)).isoformat()
    except ValueError:
        return None


def _clock(found: re.Match[str]) -> str:
    """A time of day; empty where there is no such."""
    hour = int(found["h"])
    if found["half"]:
        hour = hour % 12 + (12 if found["half"][0] in "pP" else 0) if 1 <= hour <= 12 else 24
    micro = int((found["part"] or "")[:6].ljust(6, "0"))
    if max(hour - 23, int(found["min"]) - 59, int(found["s"] or 0) - 59) > 0:
        return ""
    clock = time(hour, int(found["min"]), int(found["s"] or 0), micro)
    zone = (found["zone"] or "").upper().replace("UTC", "Z")
    return clock.isoformat("auto" if clock.microsecond or clock.second else "minutes") + zone
