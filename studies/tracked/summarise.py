"""Put the raw results of blind_calibration.py into one table: errors, coverage, half-widths, per rotor kind.

Usage: python studies/tracked/summarise.py [FOLDER]

Writes ``summary.json`` and ``summary.md`` beside the raw results. Coverage is counted over
bearings and drops; its
Wilson interval takes machines as the independent units (the effective number of trials is the
number of intervals
over the design effect of clustering by machine).
"""

from __future__ import annotations

import json
import math
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

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
        "replay": _replay(results),
    }


def _add(
    name: str,
    entry: dict[str, Any],
    seed: int,
    errors: dict[str, list[float]],
    widths: dict[str, list[float]],
    covered: dict[str, dict[int, list[bool]]],
) -> None:
    low, high = entry["interval_90"]
    absolute = name in ("air_gap", "friction.dynamic")
    errors[name].append((entry["estimate"] - entry["truth"]) / (1.0 if absolute else entry["truth"]))
    widths[name].append(0.5 * (high - low) / (1.0 if absolute else abs(entry["estimate"])))
    covered[name][seed].append(low <= entry["truth"] <= high)


def _replay(results: list[dict[str, Any]]) -> dict[str, Any]:
    errors: dict[str, list[float]] = defaultdict(list)
    failed = 0
    for result in results:
        for drop in result.get("replay", []):
            if "error" in drop:
                failed += 1
                continue
            for bearing in drop["bearings"].values():
                for name, entry in bearing.items():
                    errors[name].append(entry["estimate"] / entry["truth"] - 1.0)
    return {"failed": failed, "errors": {name: spread(values) for name, values in errors.items()}}


def main() -> None:
    """Summarise a folder of raw results."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "results"
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for file in sorted(folder.glob("*_*_*.json")):
        result = json.loads(file.read_text())
        groups[f"{result['kind']}, {result['violation']}"].append(result)
    summary = {name: collect(results) for name, results in groups.items()}
    (folder / "summary.json").write_text(json.dumps(summary, indent=1))
    lines = [
        "# Blind calibration: errors and coverage",
        "",
        "Air gap in metres, friction absolute, all else relative.",
        "",
    ]
    for name, figures in summary.items():
        lines += [
            f"## {name}",
            "",
            f"{figures['machines']} machines, {figures['drops']} drops, {figures['lost']} lost, "
            f"flagged inconsistent {figures['flagged_inconsistent']}, "
            f"{figures['seconds_per_drop_median']} s per drop, "
            f"{figures['seconds_per_calibration_median']} s per calibration",
            "",
            "| quantity | median error | 90th percentile | worst | coverage of 90 % (Wilson) | half-width |",
            "| --- | --- | --- | --- | --- | --- |",
        ]
        for quantity, e in figures["errors"].items():
            c = figures["coverage_90"].get(quantity)
            cover = f"{c['coverage']:.3f} ({c['low']:.2f}–{c['high']:.2f})" if c else ""
            width = figures["half_width_median"].get(quantity)
            lines.append(
                f"| {quantity} | {e['median']:.3g} | {e['p90']:.3g} | {e['worst']:.3g} | {cover} | "
                f"{'' if width is None else f'{width:.3g}'} |"
            )
        for quantity, e in figures["replay"]["errors"].items():
            lines.append(
                f"| replay: {quantity} | {e['median']:.3g} | {e['p90']:.3g} | {e['worst']:.3g} | | |"
            )
        lines.append("")
    (folder / "summary.md").write_text("\n".join(lines))
    print("\n".join(lines))


if __name__ == "__main__":
    main()
