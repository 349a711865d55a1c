"""What a designation alone says of a bearing, against the catalogue of 540.

Usage: python studies/designations/inferred_balls.py

Every bearing of the catalogue is described twice: as its maker lists it, and by its designation alone with
balls inferred from the boundary dimensions. The published ball complements (GMN), the axial rigidity at three
preloads, and the largest ball load and Hertz stress at a given radial force are compared, and whether the
intervals of the inference hold them. Prints one table and writes it to results/inferred_balls.json.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.elements.catalog.designation import read_designation
from rotordrop.elements.catalog.lookup import (
    CatalogueBearing,
    designations,
    find_bearing,
    infer_from_designation,
)
from rotordrop.physics.ball_bearing import BearingConstants, axial_rigidity, bearing_constants
from rotordrop.physics.ball_bearing_geometry import BallBearingGeometry
from rotordrop.physics.ball_set import ball_set_entries, ball_set_load, balls_of, static_deflection

HERE = Path(__file__).parent
DRAWS = 40


def main() -> None:
    """Compare every bearing and print how the errors are spread."""
    random = np.random.Generator(np.random.Philox(1))
    rows = [_compared(find_bearing(name), random) for name in designations()]
    summary = {maker: _summary([r for r in rows if r["maker"] == maker]) for maker in ("GMN", "FAG")}
    summary["both"] = _summary(rows)
    for maker, numbers in summary.items():
        for name, value in numbers.items():
            print(f"{maker:5} {name:34} {value}")
    (HERE / "results" / "inferred_balls.json").write_text(json.dumps(summary, indent=1) + "\n")


def _compared(listed: CatalogueBearing, random: np.random.Generator) -> dict[str, Any]:
    read = read_designation(listed.designation)
    assert read is not None, listed.designation
    inferred = infer_from_designation(read)
    row: dict[str, Any] = {"maker": listed.maker, "kind": inferred.kind == listed.kind}
    true, found = listed.complement, inferred.complement
    assert found.count_range and found.diameter_range and found.conformity_range
    row["count"] = found.ball_count / true.ball_count - 1.0
    row["diameter"] = found.ball_diameter / true.ball_diameter - 1.0
    row["count held"] = found.count_range[0] <= true.ball_count <= found.count_range[1]
    row["diameter held"] = _within(true.ball_diameter, found.diameter_range)
    force = listed.preload["medium"]
    truth = _numbers(_constants(listed, true.ball_count, true.ball_diameter, true.conformity, force), force)
    truth[0] = listed.axial_rigidity["medium"]
    value = _numbers(
        _constants(listed, found.ball_count, found.ball_diameter, found.conformity, force), force
    )
    spread = np.array(
        [
            _numbers(
                _constants(
                    listed,
                    round(random.uniform(*found.count_range)),
                    random.uniform(*found.diameter_range),
                    random.uniform(*found.conformity_range),
                    force,
                ),
                force,
            )
            for _ in range(DRAWS)
        ]
    )
    low, high = spread.min(axis=0), spread.max(axis=0)
    for k, name in enumerate(("rigidity", "ball load", "stress")):
        row[name] = value[k] / truth[k] - 1.0
        row[f"{name} held"] = bool(low[k] <= truth[k] <= high[k])
    return row


def _within(value: float, bounds: tuple[float, float]) -> bool:
    return bool(bounds[0] - 1e-6 <= value <= bounds[1] + 1e-6)


def _constants(
    bearing: CatalogueBearing, count: int, diameter: float, conformity: float, preload: float
) -> BearingConstants:
    steel = bearing.ball_material == "steel"
    return bearing_constants(
        BallBearingGeometry(
            ball_diameter=diameter,
            ball_count=count,
            pitch_diameter=bearing.complement.pitch_diameter,
            contact_angle=bearing.contact_angle,
            conformity_inner=conformity,
            conformity_outer=conformity,
            ball_youngs_modulus=208e9 if steel else 315e9,
            ball_poisson_ratio=0.3 if steel else 0.26,
            preload=preload,
        )
    )


def _numbers(constants: BearingConstants, preload: float) -> list[float]:
    """Axial rigidity [N/m]; largest ball load [N] and stress [Pa] at ten times the preload radially."""
    down, _ = static_deflection(constants, 10.0 * preload)
    load, stress = ball_set_load(ball_set_entries(constants), balls_of(constants), 0.0, -down)
    return [axial_rigidity(constants), float(load), float(stress)]


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    numbers: dict[str, Any] = {"bearings": len(rows), "kind read": _share(rows, "kind")}
    for name in ("count", "diameter", "rigidity", "ball load", "stress"):
        errors = np.array([row[name] for row in rows])
        low, middle, high = (round(float(q), 3) for q in np.quantile(errors, (0.05, 0.5, 0.95)))
        numbers[f"{name}: error 5/50/95 %"] = [low, middle, high]
        numbers[f"{name}: held"] = _share(rows, f"{name} held")
    return numbers


def _share(rows: list[dict[str, Any]], name: str) -> float:
    return round(float(np.mean([row[name] for row in rows])), 3)


if __name__ == "__main__":
    main()
