"""Join the predictions of several hidden machines into one summary.

python studies/repeat/summarise.py FOLDER --out studies/repeat/prediction.json
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from scipy.stats import kstest


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    rows = [json.loads(file.read_text()) for file in sorted(asked.folder.glob("prediction_*.json"))]
    summary = {"machines": [row["seed"] for row in rows], "quantities": {}}
    for name in rows[0]["places"]:
        places = np.concatenate([row["places"][name] for row in rows])
        summary["quantities"][name] = {
            "true_drops": len(places),
            "inside_90": float(np.mean((places > 0.05) & (places < 0.95))),
            "mean_place": float(places.mean()),
            "mean_place_of_each_machine": [row["mean_place"][name] for row in rows],
            "kolmogorov_smirnov_p": float(kstest(places, "uniform").pvalue),
        }
    asked.out.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(summary, indent=1))


if __name__ == "__main__":
    main()
