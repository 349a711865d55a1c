"""Write summary.md from the results.

python studies/replay/summarise.py
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from common import RESULTS, SUPPORT

ASKED = {
    "support.stiffness [%]": "1 %",
    "support.mass [%]": "1 %",
    "support.damping [%]": "15 %",
    "air_gap [um]": "1 µm",
}
NAMES = {
    "support.stiffness_N_per_m": "support K",
    "support.mass_kg": "support M",
    "support.damping_N_s_per_m": "support C",
    "contact.stiffness_N_per_m_n": "contact K",
    "friction.dynamic": "friction",
    "peak_force_N": "peak force",
    "mean_force_0p15_0p2_N": "mean force, 0.15–0.2 s",
    "peak_stress_Pa": "peak stress",
    "mean_stress_Pa": "mean stress",
    "race.inertia_kg_m2": "race inertia",
    "preload_N": "preload",
    "contact.damping_s_per_m": "contact λ",
    "damping_time_s": "bearing damping time",
    "friction.static": "static friction",
}


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    """A table in Markdown."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return [*lines, *("| " + " | ".join(row) + " |" for row in rows), ""]


def identification() -> list[str]:
    """Errors of the supports and of the air gap."""
    content = json.loads((RESULTS / "identification.json").read_text())
    records, sizes = content["records"], content["summary"]
    seeds = [record["seed"] for record in records]
    lines = ["## Supports and air gap, everything else known", ""]
    lines += [
        f"{len(records)} hidden machines (seeds {seeds[0]} to {seeds[-1]}), two bearings each; sensors "
        "without zero and gain errors. Absolute errors.",
        "",
    ]
    rows = []
    for name, asked in ASKED.items():
        size, limit = sizes[name], float(asked.split()[0])
        key = name.split(" ")[0]
        errors = [
            abs(bearing["air_gap_error_um"] if key == "air_gap" else bearing[key]["error_percent"])
            for record in records
            for bearing in record["bearings"].values()
        ]
        inside = sum(error <= limit for error in errors)
        rows.append(
            [
                key.replace("_", " "),
                asked,
                *(f"{size[part]:.2f}" for part in ("median", "p90", "worst")),
                f"{inside} of {len(errors)}",
            ]
        )
    lines += table(["", "asked", "median", "90th percentile", "worst", "within what was asked"], rows)
    share = sizes["share of 90 % intervals that hold the truth"]
    lines += [f"{100 * share:.0f} % of the 90 % intervals of K, M and C hold the truth.", ""]
    rows = [
        [
            str(record["seed"]),
            f"{record['speed_Hz']:.0f}",
            *(
                " / ".join(f"{b[path]['error_percent']:+.2f}" for b in record["bearings"].values())
                for path in SUPPORT
            ),
            " / ".join(f"{b['air_gap_error_um']:+.2f}" for b in record["bearings"].values()),
            record["ended_early"] or "",
        ]
        for record in records
    ]
    lines += table(["seed", "Hz", "K % NDE / DE", "M %", "C %", "gap µm", "ended early"], rows)
    return lines


def open_loop() -> list[str]:
    """Errors of the peak force by the start."""
    content = json.loads((RESULTS / "open_loop.json").read_text())
    drops = content["drops"]
    lines = ["## Open loop with true parameters", ""]
    lines += [
        f"{len(drops)} drops (seeds {drops[0]['seed']} to {drops[-1]['seed']}), two bearings each; errors of "
        "the peak ball force in percent of the true one. The ways are described in `open_loop.py`.",
        "",
    ]
    rows = []
    for name, size in content["summary"].items():
        early, whole = size["peak in 20 ms [%]"], size["peak in 0.2 s [%]"]
        orbit = size["median orbit error after 20, 50, 200 ms per bearing [um]"]
        rows.append(
            [
                name,
                f"{early['median']:.2f}",
                " / ".join(f"{v:.2f}" for v in size["median per bearing, 20 ms [%]"]),
                f"{early['rms']:.2f}",
                f"{early['worst']:.1f}",
                f"{whole['median']:.2f} ({whole['rms']:.1f})",
                ", ".join("/".join(f"{v:.1f}" for v in pair) for pair in orbit),
            ]
        )
    head = ["start", "20 ms: median", "NDE / DE", "rms", "worst", "0.2 s: median (rms)"]
    return [*lines, *table([*head, "orbit rms to 20, 50, 200 ms, median, µm"], rows)]


def error(entry: dict[str, Any]) -> str:
    """Relative error, marked where the interval misses."""
    text = f"{entry['error_percent']:+.1f}"
    return text + {True: "", False: " (missed)", None: " (no interval)"}[entry["covered"]]


def number(entry: dict[str, Any], scale: float, digits: int) -> str:
    """Value with its interval."""
    text = f"{scale * entry['value']:.{digits}f}"
    if "interval_90" not in entry:
        return text
    low, high = (scale * limit for limit in entry["interval_90"])
    return f"{text} ({low:.{digits}f}–{high:.{digits}f})"


def supplied() -> list[str]:
    """What the replay says of recorded drops."""
    content = json.loads((RESULTS / "supplied.json").read_text())
    found = {
        (stem, way): one
        for stem, ways in content.items()
        if isinstance(ways, dict)
        for way, one in ways.items()
    }
    lines = ["## Recorded drops (simulated by another program)", ""]
    known = {key: one for key, one in found.items() if "truth" in one}
    lines += ["Errors in percent against the truth; *missed*: outside the 90 % interval.", ""]
    head = ["", *(f"{stem}, {way}, {b}" for (stem, way) in known for b in ("NDE", "DE"))]
    rows = [
        [label, *(error(one["truth"][b][path]) for one in known.values() for b in ("NDE", "DE"))]
        for path, label in NAMES.items()
    ]
    rows.append(
        [
            "air gap, µm",
            *(
                f"{one['truth'][b]['air_gap_m']['error_um']:+.1f}"
                for one in known.values()
                for b in ("NDE", "DE")
            ),
        ]
    )
    rows.append(
        [
            "power-off, µs",
            *(f"{one['truth']['drop_instant_error_us']:+.1f}" for one in known.values() for _ in range(2)),
        ]
    )
    lines += table(head, rows)
    lines += [
        "All records; 90 % intervals in parentheses. *fixed*: supports and friction of the first record.",
        "",
    ]
    rows = []
    for (stem, way), one in found.items():
        if "refused" in one:
            rows.append([stem, way, one["refused"]])
            continue
        for b, entry in one["bearings"].items():
            rows.append(
                [
                    stem,
                    way,
                    b,
                    number(entry["support"]["stiffness_N_per_m"], 1e-6, 1),
                    number(entry["support"]["mass_kg"], 1.0, 1),
                    number(entry["support"]["damping_N_s_per_m"], 1.0, 0),
                    number(entry["friction"]["dynamic"], 1.0, 4),
                    number(entry["peak_force_N"], 1.0, 0),
                    number(entry["peak_stress_Pa"], 1e-6, 0),
                    " / ".join(f"{rms[b]:.1f}" for rms in one["orbit_rms_um"].values()),
                    f"{1e3 * one['horizon_s'][b]:.0f}",
                ]
            )
    head = ["record", "", "", "K, N/µm", "M, kg", "C, N s/m", "friction", "peak, N", "peak stress, MPa"]
    lines += table([*head, "orbit rms, µm: first contact / 20 / 50 / 200 ms", "horizon, ms"], rows)
    said = [
        f"- {stem}, {way}: {words}"
        for (stem, way), one in found.items()
        for words in one.get("warnings", ())
        if words.startswith("supports") or ".support." in words or "first impacts" in words
    ]
    return [*lines, *(["What it warned of:", "", *said, ""] if said else [])]


def main() -> None:
    """Write the summary."""
    lines = ["# Numbers", ""]
    for name, part in (("identification", identification), ("open_loop", open_loop), ("supplied", supplied)):
        if (RESULTS / f"{name}.json").exists():
            lines += part()
    text = "\n".join(lines).rstrip() + "\n"
    (Path(__file__).parent / "summary.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
