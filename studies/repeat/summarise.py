"""Join the predictions of several hidden machines into one summary.

    python studies/repeat/summarise.py FOLDER --out studies/repeat/prediction.json

The drops of one machine share the error of its calibration, so that their places hang together. Beside the
test of Kolmogorov and Smirnov on all places stands how far the mean places of machines scatter, over what
independent places would give. The first 25 drops of every machine count; of two of them more were made.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import kstest

COUNTED = 25
SHARES = (0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95)


def summary_of(rows: list[dict[str, Any]], name: str) -> dict[str, Any]:
    """Reliability of one predicted quantity."""
    of_machines = [np.array(row["places"][name][:COUNTED]) for row in rows]
    places = np.concatenate(of_machines)
    means = [float(one.mean()) for one in of_machines]
    alone = np.sqrt(1.0 / 12.0 / len(of_machines[0]))
    return {
        "true_drops": len(places),
        "inside_90": float(np.mean((places > 0.05) & (places < 0.95))),
        "below_predicted_share": {str(share): float(np.mean(places < share)) for share in SHARES},
        "mean_place": float(places.mean()),
        "mean_place_of_each_machine": means,
        "scatter_of_machines_over_independent": float(np.std(means, ddof=1) / alone)
        if len(means) > 1
        else None,
        "kolmogorov_smirnov": float(kstest(places, "uniform").statistic),
        "kolmogorov_smirnov_p": float(kstest(places, "uniform").pvalue),
    }


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    rows = [json.loads(file.read_text()) for file in sorted(asked.folder.glob("prediction_*.json"))]
    content = {
        "machines": rows,
        "quantities": {name: summary_of(rows, name) for name in rows[0]["places"]},
    }
    asked.out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(content["quantities"], indent=1))


if __name__ == "__main__":
    main()
