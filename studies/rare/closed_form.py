"""Intervals of subset simulation on 72 problems whose probability is known; several seeds each.

python studies/rare/closed_form.py --seeds 3 --out studies/rare/closed_form.json
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from tests.unit.study.test_rare import PROBLEMS, solve


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    rows = []
    for seed in range(asked.seeds):
        for k, (kind, d, p) in enumerate(PROBLEMS):
            found = solve(kind, d, p, 1000 * (seed + 1) + k)
            rows.append(
                {
                    "problem": kind.__name__.strip("_"),
                    "variables": d,
                    "probability": p,
                    "held": bool(found.lower <= p <= found.upper),
                    "ratio": found.probability / p,
                    "factor": float(np.sqrt(found.upper / found.lower)),
                    "evaluations": found.evaluations,
                }
            )
    summary = {
        "seeds": asked.seeds,
        "problems": len(PROBLEMS),
        "held": float(np.mean([row["held"] for row in rows])),
        "factor_quantiles_50_90_100": np.quantile([row["factor"] for row in rows], [0.5, 0.9, 1.0]).tolist(),
        "evaluations_mean": float(np.mean([row["evaluations"] for row in rows])),
        "by_problem": {
            name: {
                "held": float(np.mean([r["held"] for r in rows if r["problem"] == name])),
                "mean_ratio": float(np.mean([r["ratio"] for r in rows if r["problem"] == name])),
            }
            for name in dict.fromkeys(row["problem"] for row in rows)
        },
    }
    asked.out.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(summary, indent=1))


if __name__ == "__main__":
    main()
