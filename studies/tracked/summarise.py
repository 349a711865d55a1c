"""Put the raw results of blind_calibration.py and replay_side_by_side.py into tables.

Usage: python studies/tracked/summarise.py [FOLDER]

Writes ``summary.json`` and ``summary.md`` beside the raw results: errors, coverage and half-widths per rotor
kind, the paper's route beside the tracked twin, and every machine whose structure is not what the estimator
believes. Coverage is counted over bearings and drops; its Wilson interval takes machines as the independent
units (the effective number of trials is the number of intervals over the design effect of clustering by
machine).
"""

from __future__ import annotations

import json
import math
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from blind_calibration import half_width, holds

HERE = Path(__file__).parent
FORCES = ("peak_force_N", "peak_stress_Pa", "mean_force_0p15_0p2_N", "mean_stress_Pa")


def wilson(hits: float, trials: float, z: float = 1.96) -> tuple[float, float]:
    """Wilson interval of a proportion."""
    if trials <= 0:
        return 0.0, 1.0
    share = hits / trials
    centre = (share + z * z / (2 * trials)) / (1 + z * z / trials)
    half = z * math.sqrt(share * (1 - share) / trials + z * z / (4 * trials**2)) / (1 + z * z / trials)
    return max(0.0, centre - half), min(1.0, centre + half)


def clustered_coverage(covered: dict[int, list[bool]]) -> dict[str, float]:
    """Coverage with a Wilson interval whose number of trials is reduced by the clustering within machines."""
    values = [np.array(v, dtype=float) for v in covered.values() if v]
    everything = np.concatenate(values)
    share, count = float(everything.mean()), len(everything)
    size = count / len(values)
    between = float(np.var([v.mean() for v in values], ddof=1)) if len(values) > 1 else 0.0
    binomial = share * (1 - share) / size
    effect = max(1.0, between / binomial) if binomial > 0 else 1.0
    low, high = wilson(share * count / effect, count / effect)
    return {"coverage": share, "low": low, "high": high, "intervals": count, "machines": len(values)}


def spread(errors: list[float]) -> dict[str, float]:
    """Median and 90th percentile of absolute errors, and their number."""
    a = np.abs(np.array(errors))
    return {
        "median": float(np.median(a)),
        "p90": float(np.quantile(a, 0.9)),
        "worst": float(a.max()),
        "count": len(a),
    }


def collect(results: list[dict[str, Any]]) -> dict[str, Any]:
    """All figures of one group of results."""
    errors: dict[str, list[float]] = defaultdict(list)
    widths: dict[str, list[float]] = defaultdict(list)
    covered: dict[str, dict[int, list[bool]]] = defaultdict(lambda: defaultdict(list))
    flags, lost, seconds, calibration = [], 0, [], []
    for result in results:
        if "error" in result:
            lost += 1
            continue
        calibration.append(result["calibration_seconds"])
        for path, entry in result["parameters"].items():
            name = path.partition(".")[2]
            _add(name, entry, result["seed"], errors, widths, covered)
        for drop in result["drops"]:
            if "error" in drop:
                lost += 1
                continue
            seconds.append(drop["seconds"])
            flags.append(not drop["consistent"])
            for bearing in drop["bearings"].values():
                for field in FORCES:
                    if field in bearing:
                        _add(field, bearing[field], result["seed"], errors, widths, covered)
                for estimate, sigma, truth in bearing["impacts"]:
                    errors["impact peaks"].append(estimate / truth - 1.0)
                    error = math.hypot(sigma, 0.01 * estimate)
                    covered["impact peaks"][result["seed"]].append(abs(estimate - truth) < 1.645 * error)
    return {
        "machines": len(results),
        "lost": lost,
        "flagged_inconsistent": float(np.mean(flags)) if flags else None,
        "drops": len(flags),
        "seconds_per_drop_median": float(np.median(seconds)) if seconds else None,
        "seconds_per_calibration_median": float(np.median(calibration)) if calibration else None,
        "errors": {name: spread(values) for name, values in errors.items()},
        "half_width_median": {name: float(np.median(values)) for name, values in widths.items()},
        "coverage_90": {name: clustered_coverage(values) for name, values in covered.items()},
    }


def _add(
    name: str,
    entry: dict[str, Any],
    seed: int,
    errors: dict[str, list[float]],
    widths: dict[str, list[float]],
    covered: dict[str, dict[int, list[bool]]],
) -> None:
    absolute = name in ("air_gap", "friction.dynamic")
    errors[name].append((entry["estimate"] - entry["truth"]) / (1.0 if absolute else entry["truth"]))
    widths[name].append(half_width(entry) / (1.0 if absolute else abs(entry["estimate"])))
    covered[name][seed].append(holds(entry))


def replayed(folder: Path, kind: str) -> dict[str, Any]:
    """Errors of the paper's route, as far as it was run."""
    errors: dict[str, list[float]] = defaultdict(list)
    failed: list[str] = []
    for file in sorted((folder / "replay").glob(f"{kind}_*.json")):
        for drop in json.loads(file.read_text())["drops"]:
            if "error" in drop:
                failed.append(f"{file.stem}: {drop['error']}")
                continue
            for bearing in drop["bearings"].values():
                for name, entry in bearing.items():
                    absolute = name == "air_gap_m"
                    apart = entry["estimate"] - entry["truth"]
                    errors[name].append(apart if absolute else apart / entry["truth"])
    return {"failed": failed, "errors": {name: spread(values) for name, values in errors.items()}}


SCALES = {"air_gap": (1e6, "µm"), "air_gap_m": (1e6, "µm"), "friction.dynamic": (1.0, "")}
"""Factor and unit in which a quantity's error is shown; all else in per cent."""


def shown(quantity: str, value: float) -> str:
    """An error with its unit."""
    scale, unit = SCALES.get(quantity, (100.0, "%"))
    return f"{scale * value:.3g} {unit}".strip()


def kind_table(figures: dict[str, Any]) -> list[str]:
    """Errors, coverage and half-widths of one rotor kind."""
    lines = [
        "| quantity | median error | 90th percentile | worst | coverage of 90 % (Wilson) | half-width |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for quantity, e in figures["errors"].items():
        c = figures["coverage_90"].get(quantity)
        cover = f"{c['coverage']:.3f} ({c['low']:.2f}–{c['high']:.2f})" if c else ""
        width = figures["half_width_median"].get(quantity)
        cells = [shown(quantity, e[key]) for key in ("median", "p90", "worst")]
        wide = "" if width is None else shown(quantity, width)
        lines.append(f"| {quantity} | {' | '.join(cells)} | {cover} | {wide} |")
    for quantity, e in figures["replay"]["errors"].items():
        cells = [shown(quantity, e[key]) for key in ("median", "p90", "worst")]
        lines.append(f"| *paper's route:* {quantity} | {' | '.join(cells)} | | |")
    return lines


def violation_table(groups: dict[str, list[dict[str, Any]]]) -> list[str]:
    """One line per machine whose structure is wrong: errors, coverage of the peak force, flags."""
    lines = [
        "| rotor | what is wrong | seed | peak force: median error | worst | peak stress: median "
        "| peaks covered | drops flagged | covered or flagged |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for results in groups.values():
        for result in results:
            head = f"| {result['kind']} | {result['violation']} | {result['seed']} "
            if "error" in result:
                lines.append(f"{head}| {result['error']} | | | | refused | |")
                continue
            drops = [d for d in result["drops"] if "error" not in d]
            refused = len(result["drops"]) - len(drops)
            peaks = [(d, b["peak_force_N"]) for d in drops for b in d["bearings"].values()]
            stress = [b["peak_stress_Pa"] for d in drops for b in d["bearings"].values()]
            error = np.array([abs(p["estimate"] / p["truth"] - 1.0) for _, p in peaks])
            of_stress = np.median([abs(p["estimate"] / p["truth"] - 1.0) for p in stress])
            inside = [holds(p) for _, p in peaks]
            flagged = not result["calibration_consistent"]
            either = [ok or flagged or not d["consistent"] for ok, (d, _) in zip(inside, peaks, strict=True)]
            flags = sum(flagged or not d["consistent"] for d in drops) + refused
            lines.append(
                f"{head}| {shown('', np.median(error))} | {shown('', error.max())} | {shown('', of_stress)} "
                f"| {sum(inside)} of {len(inside)} | {flags} of {len(result['drops'])} "
                f"| {sum(either)} of {len(either)} |"
            )
    return lines


def main() -> None:
    """Summarise a folder of raw results."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "results"
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for file in sorted(folder.glob("*_*_*.json")):
        result = json.loads(file.read_text())
        groups[f"{result['kind']}, {result['violation']}"].append(result)
    right = {name: results for name, results in groups.items() if results[0]["violation"] == "none"}
    wrong = {name: results for name, results in groups.items() if name not in right}
    summary = {}
    lines = ["# Blind calibration: errors and coverage", "", "Friction is absolute.", ""]
    for name, results in right.items():
        figures = collect(results)
        figures["replay"] = replayed(folder, results[0]["kind"])
        route = f"; the paper's route failed on {len(figures['replay']['failed'])} drops"
        summary[name] = figures
        lines += [
            f"## {name}",
            "",
            f"{figures['machines']} machines, {figures['drops']} drops, {figures['lost']} lost, flagged "
            f"inconsistent {shown('', figures['flagged_inconsistent'])}, "
            f"{figures['seconds_per_drop_median']:.1f} s per drop, "
            f"{figures['seconds_per_calibration_median']:.1f} s per calibration on busy cores"
            f"{route if figures['replay']['errors'] else ''}.",
            "",
            *kind_table(figures),
            "",
        ]
    if wrong:
        lines += ["## Wrong structure", "", *violation_table(wrong), ""]
    for name, results in wrong.items():
        summary[name] = collect(results)
    (folder / "summary.json").write_text(json.dumps(summary, indent=1))
    (folder / "summary.md").write_text("\n".join(lines))
    print("\n".join(lines))


if __name__ == "__main__":
    main()
