"""What a designation, load ratings and a rigidity say of bearings whose makers had no part in the rules.

Usage: python studies/designations/rated_bearings.py TABLE.csv [TABLE.csv ...]

A table is typed from a public catalogue, one bearing a line: maker, designation, bore, outside, width [mm],
angle [deg], static, dynamic [N], preload [N] and rigidity of the pair [N/um] by class with ";" between them,
and where they are published count, ball and pitch [mm]. The bearings of the packaged catalogue are done by
inferred_balls.py; the tables are not part of this repository. Results stand in results/rated_bearings.json;
makers that are not in the tables keep theirs.

Published rigidity and ratings are compared as they are. Where balls are not published but rigidities are,
those balls (with the conformity, which the ratings depend on too) are taken that reproduce both ratings and
all rigidities best, and the largest ball load comes from them: at ten times the second preload radially, at a
twentieth of the static rating for deep grooves without play. Ratings alone do not tell balls: an error of 5 %
in them is one of 36 % in the count. What reconstructed balls are worth is seen where balls are published:
these bearings are done a second time as if they were not ("MAKER reconstructed").
"""

from __future__ import annotations

import csv
import json
import math
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.elements.catalog.boundary import DIMENSION_SERIES
from rotordrop.elements.catalog.designation import read_designation
from rotordrop.elements.catalog.inference import (
    USUAL_GROOVE,
    InferredBalls,
    PairRigidity,
    dynamic_rating,
    groove_factors,
    infer_balls,
    pair_rigidity,
    static_rating,
)
from rotordrop.physics.ball_bearing import axial_rigidity, bearing_constants
from rotordrop.physics.ball_bearing_geometry import BallBearingGeometry
from rotordrop.physics.ball_set import ball_set_entries, ball_set_load, balls_of, static_deflection

HERE = Path(__file__).parent
DRAWS = 40
SIGMAS = {"static": 0.05, "dynamic": 0.07, "rigidity": 0.04}
CONFORMITIES = tuple(0.510 + 0.005 * k for k in range(11))
KNOWN = ("designation", "and ratings", "and rigidity")


@dataclass(frozen=True, kw_only=True)
class Listed:
    """A line of a table, in SI units."""

    maker: str
    designation: str
    bore: float
    outside: float
    angle: float
    static: float
    dynamic: float
    preload: tuple[float, ...]
    rigidity: tuple[float, ...]
    pitch: float
    balls: tuple[int, float] | None

    @property
    def force(self) -> float:
        """Preload of the second class [N]."""
        return self.preload[1] if self.preload else 0.0

    @property
    def radial_force(self) -> float:
        """Force under which the largest ball load is compared [N]."""
        return 10.0 * self.force if self.preload else 0.05 * self.static


Balls = tuple[int, float, float]
"""Count, diameter [m] and conformity [1]."""


def main(tables: list[str]) -> None:
    """Compare every bearing of the tables and print how the errors are spread."""
    random = np.random.Generator(np.random.Philox(2))
    bearings = [one for table in tables for one in listed(Path(table))]
    blind = [
        replace(one, maker=f"{one.maker} reconstructed", balls=None)
        for one in bearings
        if one.balls and one.rigidity
    ]
    rows = [row for one in (*bearings, *blind) for row in compared(one, random)]
    makers = sorted({row["maker"] for row in rows})
    file = HERE / "results" / "rated_bearings.json"
    result: dict[str, Any] = json.loads(file.read_text()) if file.exists() else {}
    for maker in makers:
        result.pop(maker, None)
        for known in KNOWN:
            chosen = [r for r in rows if r["known"] == known and r["maker"] == maker]
            if chosen:
                result.setdefault(maker, {})[known] = summary(chosen)
    print(json.dumps(result, indent=1))
    file.write_text(json.dumps(result, indent=1) + "\n")


def listed(table: Path) -> Iterator[Listed]:
    """Bearings of a table that can be compared: with ratings, and a preload if it is no deep groove."""
    with table.open(encoding="utf-8") as lines:
        for line in csv.DictReader(lines):
            number = {name: float(line[name]) for name in ("bore", "outside", "angle", "static", "dynamic")}
            several = {
                name: tuple(float(part) for part in line[name].split(";") if part)
                for name in ("preload", "rigidity")
            }
            if number["angle"] > 0.0 and len(several["rigidity"]) < 2:
                continue
            pitch = float(line["pitch"] or 0.5 * (number["bore"] + number["outside"]))
            yield Listed(
                maker=line["maker"],
                designation=line["designation"],
                bore=1e-3 * number["bore"],
                outside=1e-3 * number["outside"],
                angle=math.radians(number["angle"]),
                static=number["static"],
                dynamic=number["dynamic"],
                preload=several["preload"],
                rigidity=tuple(1e6 * value for value in several["rigidity"]),
                pitch=1e-3 * pitch,
                balls=(int(line["count"]), 1e-3 * float(line["ball"])) if line["count"] else None,
            )


def compared(one: Listed, random: np.random.Generator) -> Iterator[dict[str, Any]]:
    """Errors of one bearing, by what is known of it; nothing where the designation is not read."""
    read = read_designation(one.designation)
    if read is None or read.series is None:
        yield {"maker": one.maker, "known": KNOWN[0], "read": False}
        return
    right = (read.kind == "deep groove") == (one.angle == 0.0) and abs(read.bore - one.bore) < 1e-6
    true = true_balls(one) if one.balls or one.rigidity else None
    rated = {"static_load_rating": one.static, "dynamic_load_rating": one.dynamic}
    known: dict[str, Mapping[str, Any]] = {KNOWN[0]: {}, KNOWN[1]: rated}
    if one.rigidity:
        rigidity = PairRigidity(value=one.rigidity[1], preload=one.force, hybrid=False)
        known[KNOWN[2]] = rated | {"rigidity": rigidity}
    for name, more in known.items():
        found = infer_balls(
            kind=read.kind,
            dimension_series=DIMENSION_SERIES[read.series],
            bore=one.bore,
            outside_diameter=one.outside,
            contact_angle=one.angle,
            small_balls=read.balls == "small",
            **more,
        )
        row: dict[str, Any] = {"maker": one.maker, "known": name, "read": right}
        row |= errors_of_ratings(one, found, random)
        yield row | (errors(one, true, found, random) if true else {})


def errors_of_ratings(one: Listed, found: InferredBalls, random: np.random.Generator) -> dict[str, Any]:
    """Load ratings of the inferred balls against the published ones, and whether the range of draws holds."""

    def ratings(count: int, diameter: float) -> list[float]:
        row = (count, diameter, one.pitch, one.angle)
        return [static_rating(*row), dynamic_rating(*row)]

    value = ratings(found.ball_count, found.ball_diameter)
    drawn = np.array(
        [
            ratings(round(random.uniform(*found.count_range)), random.uniform(*found.diameter_range))
            for _ in range(DRAWS)
        ]
    )
    row: dict[str, Any] = {}
    for k, (name, published) in enumerate((("static rating", one.static), ("dynamic rating", one.dynamic))):
        row[name] = value[k] / published - 1.0
        row[f"{name} held"] = bool(drawn[:, k].min() <= published <= drawn[:, k].max())
    return row


def errors(one: Listed, true: Balls, found: InferredBalls, random: np.random.Generator) -> dict[str, Any]:
    """Errors of the numbers of a bearing with inferred balls, and whether the range of draws holds them."""
    truth = numbers(one, true)
    if one.rigidity:
        truth[0] = one.rigidity[1]
    middle, sigma = found.conformity
    value = numbers(one, (found.ball_count, found.ball_diameter, middle))
    reach = 1.645 * sigma
    drawn = np.array(
        [
            numbers(
                one,
                (
                    round(random.uniform(*found.count_range)),
                    random.uniform(*found.diameter_range),
                    max(random.uniform(middle - reach, middle + reach), 0.504),
                ),
            )
            for _ in range(DRAWS)
        ]
    )
    row: dict[str, Any] = {
        "count": found.ball_count / true[0] - 1.0,
        "diameter": found.ball_diameter / true[1] - 1.0,
    }
    row["count held"] = found.count_range[0] <= true[0] <= found.count_range[1]
    row["diameter held"] = found.diameter_range[0] <= true[1] * (1 + 1e-3) and (
        true[1] * (1 - 1e-3) <= found.diameter_range[1]
    )
    low, high = drawn.min(axis=0), drawn.max(axis=0)
    for k, name in enumerate(("rigidity", "ball load")):
        if truth[k] > 0.0:
            row[name] = value[k] / truth[k] - 1.0
            row[f"{name} held"] = bool(low[k] <= truth[k] <= high[k])
            row[f"{name} half width"] = 0.5 * (high[k] - low[k]) / truth[k]
    return row


def true_balls(one: Listed) -> Balls:
    """Published balls, with the conformity that fits; else those that reproduce what is published best."""
    if one.balls is not None:
        candidates = [one.balls]
    else:
        height = one.outside - one.bore
        sizes = [0.396875e-3 * k for k in range(3, 200) if 0.17 * height < 0.396875e-3 * k < 0.37 * height]
        candidates = [
            (count, size) for size in sizes for count in range(5, int(math.pi * one.pitch / size) + 1)
        ]
    grooves = CONFORMITIES if one.rigidity else (USUAL_GROOVE,)
    tried = sorted(
        (misfit_of_ratings(one, (count, size, groove)), (count, size, groove))
        for count, size in candidates
        for groove in grooves
    )
    best, least = (0, 0.0, 0.0), math.inf
    for rated, row in tried:
        if rated > least:
            break
        total = rated + misfit_of_rigidity(one, row)
        if total < least:
            best, least = row, total
    return best


def misfit_of_ratings(one: Listed, balls: Balls) -> float:
    """Squared misfit of both ratings, in standard deviations."""
    count, size, conformity = balls
    row = (count, size, one.pitch, one.angle)
    static, dynamic = groove_factors(row, conformity)
    return float(
        (math.log(one.static / (static * static_rating(*row))) / SIGMAS["static"]) ** 2
        + (math.log(one.dynamic / (dynamic * dynamic_rating(*row))) / SIGMAS["dynamic"]) ** 2
    )


def misfit_of_rigidity(one: Listed, balls: Balls) -> float:
    """Squared misfit of the rigidities of the classes, in standard deviations."""
    return sum(
        (
            math.log(value / pair_rigidity((*balls[:2], one.pitch, one.angle), balls[2], preload))
            / SIGMAS["rigidity"]
        )
        ** 2
        for preload, value in zip(one.preload, one.rigidity, strict=True)
    )


def geometry(one: Listed, balls: Balls, preload: float) -> BallBearingGeometry:
    """A bearing of steel balls."""
    deep = one.angle == 0.0
    return BallBearingGeometry(
        ball_diameter=balls[1],
        ball_count=balls[0],
        pitch_diameter=one.pitch,
        contact_angle=one.angle,
        conformity_inner=balls[2],
        conformity_outer=balls[2],
        ball_youngs_modulus=208e9,
        ball_poisson_ratio=0.3,
        preload=preload,
        arrangement="single" if deep else "X",
        clearance=1e-9 if deep else None,
    )


def numbers(one: Listed, balls: Balls) -> list[float]:
    """Axial rigidity of a pair [N/m], 0 for deep grooves, and largest ball load [N]."""
    constants = bearing_constants(geometry(one, balls, one.force))
    down, _ = static_deflection(constants, one.radial_force)
    load, _ = ball_set_load(ball_set_entries(constants), balls_of(constants), 0.0, -down)
    return [axial_rigidity(constants) if one.rigidity else 0.0, float(load)]


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Quantiles of the errors, and how often the range holds."""
    found: dict[str, Any] = {
        "bearings": len(rows),
        "read": round(float(np.mean([row["read"] for row in rows])), 3),
    }
    for name in ("static rating", "dynamic rating", "count", "diameter", "rigidity", "ball load"):
        errors_of = np.array([row[name] for row in rows if name in row])
        if len(errors_of):
            quantiles = np.quantile(errors_of, (0.05, 0.5, 0.95))
            found[f"{name}: error 5/50/95 %"] = [round(float(q), 3) for q in quantiles]
            found[f"{name}: held"] = round(float(np.mean([r[f"{name} held"] for r in rows if name in r])), 3)
        wide = [row[f"{name} half width"] for row in rows if f"{name} half width" in row]
        if wide:
            found[f"{name}: half width"] = round(float(np.median(wide)), 3)
    return found


if __name__ == "__main__":
    main(sys.argv[1:])
