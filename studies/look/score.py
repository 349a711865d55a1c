"""Score `rotordrop look` on records alone, without machine file, against the truth of simulated drops.

Usage: python studies/look/score.py DROPBENCH RECORDS RESULTS [--half odd|even]

DROPBENCH is what ``rotordrop-bench make`` wrote; RECORDS holds further records and their truth in ``truth``.
Writes ``drops.csv`` (a line for every bearing) and ``table.md`` to RESULTS.

The rule of an impact is that of `rotordrop.record.impacts`: a contact of the truth after a flight as long as
gravity needs to take the rotor off its race by 5 % of the gap, the first contact included; what follows the
last of them counts as lasting contact.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.evidence.look import look

GRAVITY = 9.81
HOP = 0.05
WINDOW = 0.25
"""The truth holds the contacts of this time after power-off [s]."""

HEAD = (
    "drop", "rotor", "rate_Hz", "family", "bearing", "gap_um", "look_um", "low_um", "high_um", "touch_ms",
    "look_touch_ms", "touch_low_ms", "touch_high_ms", "order", "impacts", "look_impacts", "lasting_ms",
    "look_lasting_ms", "largest_um", "look_largest_um", "largest_low_um", "largest_high_um",
    "impacts_low", "impacts_high", "lasting_low_ms", "lasting_high_ms",
)  # fmt: skip


def true_impacts(contacts: list[list[float]], gap: float) -> list[float]:
    """Begins of the contacts that count as impacts, from power-off [s]."""
    flight = math.sqrt(8.0 * HOP * gap / GRAVITY)
    begins = [row[0] for row in contacts]
    flown = [math.inf, *(b[0] - a[1] for a, b in pairwise(contacts))]
    return [begin for begin, time in zip(begins, flown, strict=True) if time > flight]


def order_of(truth: dict[str, float], seen: dict[str, tuple[float, float, float]]) -> str:
    """Whether the end that touches first is the right one."""
    if len(seen) < 2:
        return "missing"
    first, second = sorted(seen, key=lambda name: seen[name][0])
    apart = seen[second][0] - seen[first][0]
    error = math.hypot(seen[first][2] - seen[first][0], seen[second][2] - seen[second][0])
    if apart <= error:
        return "not determined"
    return "right" if truth[first] < truth[second] else "wrong"


def scored(record: Path, truth: dict[str, Any]) -> list[dict[str, Any]]:
    """One row for every bearing of a drop."""
    try:
        found = look(record).as_json()
    except RecordError as error:
        print(record, error)
        return []
    off, names = float(truth["t_off_in_record_s"]), list(truth["air_gap_m"])
    planes = [
        name if name in names else names[i] for i, name in enumerate(p["plane"] for p in found["planes"])
    ]
    rows, seen = [], {}
    for plane, bearing in zip(found["planes"], planes, strict=True):
        hits = [hit["time_s"] - off for hit in found["impacts"] if hit["plane"] == plane["plane"]]
        touch = plane.get("first_touch_s", hits[0] + off if hits else None)
        if touch is not None:
            ends = plane.get("first_touch_interval_90_s") or [touch, touch]
            seen[bearing] = (touch - off, ends[0] - off, ends[1] - off)
        lasting = plane.get("contact_from_s", found["drops"][0]["permanent_contact_s"])
        between = plane["contact_from_interval_90_s"] or (math.nan, math.nan)
        gap = float(truth["air_gap_m"][bearing])
        impacts = true_impacts(truth["contact_intervals_0_0p25_s"][bearing], gap)
        low, high = plane.get("air_gap_interval_90_m") or (plane["air_gap_m"],) * 2
        least, most = (
            plane.get("largest_displacement_interval_90_m") or (plane["largest_displacement_m"],) * 2
        )
        rows.append(
            {
                "drop": truth["name"],
                "rotor": truth.get("rotor", "lp400"),
                "rate_Hz": truth.get("fs", ""),
                "family": truth.get("family", "supplied"),
                "bearing": bearing,
                "gap_um": 1e6 * gap,
                "look_um": 1e6 * plane["air_gap_m"],
                "low_um": 1e6 * low,
                "high_um": 1e6 * high,
                "touch_ms": 1e3 * truth["first_contact_time_s"][bearing],
                "look_touch_ms": 1e3 * seen[bearing][0] if bearing in seen else math.nan,
                "touch_low_ms": 1e3 * seen[bearing][1] if bearing in seen else math.nan,
                "touch_high_ms": 1e3 * seen[bearing][2] if bearing in seen else math.nan,
                "impacts": len(impacts),
                "look_impacts": sum(hit < WINDOW for hit in hits),
                "lasting_ms": 1e3 * impacts[-1],
                "look_lasting_ms": math.nan if lasting is None else 1e3 * (lasting - off),
                "largest_um": 1e6 * truth["max_radial_displacement_m"][bearing],
                "look_largest_um": 1e6 * plane["largest_displacement_m"],
                "largest_low_um": 1e6 * least,
                "largest_high_um": 1e6 * most,
                "impacts_low": plane["impacts_interval_90"][0],
                "impacts_high": plane["impacts_interval_90"][1],
                "lasting_low_ms": 1e3 * (between[0] - off),
                "lasting_high_ms": 1e3 * (between[1] - off),
            }
        )
    order = order_of(truth["first_contact_time_s"], seen)
    return [{**row, "order": order} for row in rows]


def summary(rows: list[dict[str, Any]]) -> list[str]:
    """The cells of one line of the table."""

    def column(name: str) -> np.ndarray:
        return np.array([float(row[name]) for row in rows])

    gap, seen = column("gap_um"), column("look_um")
    held = (column("low_um") <= gap) & (gap <= column("high_um"))
    touch = np.abs(column("look_touch_ms") - column("touch_ms"))
    in_touch = (column("touch_low_ms") <= column("touch_ms")) & (
        column("touch_ms") <= column("touch_high_ms")
    )
    impacts = np.abs(column("look_impacts") - column("impacts"))
    counted = (column("impacts_low") <= column("impacts")) & (column("impacts") <= column("impacts_high"))
    settled = np.isfinite(column("lasting_low_ms"))
    lasted = (column("lasting_low_ms") <= column("lasting_ms")) & (
        column("lasting_ms") <= column("lasting_high_ms")
    )
    lasting = np.abs(column("look_lasting_ms") - column("lasting_ms"))
    largest, top = column("largest_um"), column("look_largest_um")
    inside = (column("largest_low_um") <= largest) & (largest <= column("largest_high_um"))
    orders = [rows[i]["order"] for i in range(0, len(rows), 2)]
    stated = [order for order in orders if order in ("right", "wrong")]
    share = [
        f"{100 * np.median(np.abs(seen / gap - 1.0)):.1f}",
        f"{100 * np.median((column('high_um') - column('low_um')) / 2 / gap):.1f}",
        f"{100 * held.mean():.0f}",
        f"{orders.count('right')}/{len(stated)}"
        + (f" ({len(orders) - len(stated)})" if len(stated) < len(orders) else ""),
        f"{100 * np.mean(touch < 0.3):.0f}",
        f"{100 * in_touch.mean():.0f}",
        f"{100 * np.mean(impacts <= 2):.0f}",
        f"{np.nanmedian(lasting):.0f}",
        f"{100 * np.mean(lasting < 20.0):.0f}",
        f"{100 * np.median(np.abs(top / largest - 1.0)):.1f}",
        f"{100 * inside.mean():.0f}",
        f"{100 * counted.mean():.0f}",
        f"{100 * lasted[settled].mean():.0f}",
    ]
    return [str(len(rows)), *share]


def table(rows: list[dict[str, Any]]) -> str:
    """A table by rotor and rate."""
    head = (
        "bearings", "gap: error [%]", "half width [%]", "held [%]", "end first (not determined)",
        "touch within 0.3 ms [%]", "touch held [%]", "impacts ± 2 [%]", "lasting from: error [ms]",
        "within 20 ms [%]", "largest: error [%]", "held [%]", "impacts: held [%]", "lasting from: held [%]",
    )  # fmt: skip
    lines = ["| | " + " | ".join(head) + " |", "|---" * (len(head) + 1) + "|"]
    groups = {"all": rows}
    for row in rows:
        other = "" if float(row["rate_Hz"]) == 20_000.0 else f", {float(row['rate_Hz']) / 1e3:.0f} kHz"
        groups.setdefault(f"{row['rotor']}{other}", []).append(row)
    return "\n".join(
        [*lines, *(f"| {name} | " + " | ".join(summary(some)) + " |" for name, some in groups.items())]
    )


def main() -> None:
    """Run what the command line says."""
    words = argparse.ArgumentParser(description=__doc__)
    for name in ("bench", "records", "results"):
        words.add_argument(name, type=Path)
    words.add_argument("--half", choices=("odd", "even"))
    told = words.parse_args()
    told.results.mkdir(parents=True, exist_ok=True)
    places = {
        path: told.bench / "drops" / path.stem / "record.csv"
        for path in sorted((told.bench / "truth").glob("*.json"))
    }
    if told.half:
        places = {
            path: place
            for path, place in places.items()
            if (int(path.stem[-3:]) % 2 == 1) == (told.half == "odd")
        }
    if told.half != "odd":
        places |= {
            path: told.records / f"{path.stem}.csv"
            for path in sorted((told.records / "truth").glob("*.json"))
        }
    rows = [
        row
        for path, record in places.items()
        for row in scored(record, {"name": path.stem, **json.loads(path.read_text())})
    ]
    with (told.results / "drops.csv").open("w", newline="") as out:
        written = csv.DictWriter(out, HEAD)
        written.writeheader()
        written.writerows(
            {k: f"{v:.2f}" if isinstance(v, float) else v for k, v in row.items()} for row in rows
        )
    (told.results / "table.md").write_text(table(rows) + "\n")
    print(table(rows))


if __name__ == "__main__":
    main()
