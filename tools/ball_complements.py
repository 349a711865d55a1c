"""Reconstruct what bearing catalogues do not publish: balls of FAG bearings, conformities of GMN ones.

The FAG spindle bearing tables hold preload, lift-off force and axial rigidity at three preloads, but neither
ball diameter nor ball count. Bearings of the same bore and outside diameter share their rings and balls
(steel and ceramic balls, 15 and 25 degrees), so that up to six bearings with six numbers each determine

- one ball diameter (a standard size), one ball count and one groove conformity,

with the pitch circle half way between bore and outside diameter. Balls are looked for around the proportions
of a catalogue that does publish them (GMN): 0.53 to 0.64 of the section height, 70 to 89 % of the pitch
circle filled; 0.40 to 0.52 of the section height and 62 to 84 % for the high-speed series with small balls.

    python tools/ball_complements.py src/rotordrop/elements/catalog/complements.json
"""

from __future__ import annotations

import json
import math
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.elements.catalog.lookup import CatalogueBearing, ball_size, designations, find_bearing
from rotordrop.physics.ball_bearing import row_approach, row_axial_force, row_axial_stiffness
from rotordrop.physics.hertz import compliance, contacts_in_series, race_contact

CONFORMITIES = np.linspace(0.505, 0.62, 116)
PROPORTIONS = {"standard": ((0.53, 0.64), (0.70, 0.89)), "small": ((0.40, 0.52), (0.62, 0.84))}
AS_GOOD = 1.3
BALL_SIZES = sorted({k * 0.79375 for k in range(2, 90)} | {k * 0.396875 for k in range(5, 24)})
COMPLIANCE = {
    "steel": compliance(208e9, 0.3, 208e9, 0.3),
    "silicon nitride": compliance(208e9, 0.3, 315e9, 0.26),
}
FROM_RATINGS = {
    (70.0, 100.0, "standard"): {
        "ball_count": 23,
        "ball_diameter_mm": 9.525,
        "conformity": 0.53,
        "basis": "reconstructed: 23 balls of 9.525 mm reproduce the ISO 281/76 load ratings of the "
        "71914 series to 0.3 % (23 balls of 8.731 mm with conformity 0.53 would reproduce its axial rigidity "
        "to 2.6 %)",
    }
}


def families() -> dict[tuple[float, float, str], list[CatalogueBearing]]:
    """Group the bearings that share their balls."""
    found: dict[tuple[float, float, str], list[CatalogueBearing]] = defaultdict(list)
    for bearing in map(find_bearing, designations()):
        if bearing.maker == "FAG":
            size = (round(bearing.bore * 1e3, 3), round(bearing.outside_diameter * 1e3, 3))
            found[(*size, ball_size(bearing.designation))].append(bearing)
    return found


def candidates(bore: float, outside: float, kind: str) -> Iterator[tuple[float, int]]:
    """Standard ball sizes [mm] and counts with usual proportions."""
    proportion, fill = PROPORTIONS[kind]
    section, circle = 0.5 * (outside - bore), 0.5 * math.pi * (outside + bore)
    for ball in BALL_SIZES:
        if proportion[0] <= ball / section <= proportion[1]:
            first, last = math.ceil(fill[0] * circle / ball), math.floor(fill[1] * circle / ball)
            for count in range(first, last + 1):
                yield ball, count


def deviations(bearing: CatalogueBearing, ball: float, count: int, pitch: float) -> np.ndarray:
    """Relative deviation of rigidity and lift-off force for every conformity; shape (conformities, 6)."""
    eta, alpha = COMPLIANCE[bearing.ball_material], bearing.contact_angle
    inner, outer = (
        race_contact(ball, pitch, CONFORMITIES, alpha, eta, inner=side).stiffness for side in (True, False)
    )
    row = (count * contacts_in_series(inner, outer), (2.0 * CONFORMITIES - 1.0) * ball, alpha)
    columns = []
    for name, force in bearing.preload.items():
        s = row_approach(force, *row)
        columns.append(2.0 * row_axial_stiffness(s, *row) / bearing.axial_rigidity[name] - 1.0)
        if bearing.lift_off:
            columns.append(row_axial_force(2.0 * s, *row) / bearing.lift_off[name] - 1.0)
    return np.stack(columns, axis=-1)


def best_complement(key: tuple[float, float, str], members: list[CatalogueBearing]) -> dict[str, Any]:
    """Balls that reproduce the tables of a family best."""
    bore, outside, kind = key
    pitch = 0.5 * (bore + outside)
    tried: list[tuple[float, float, int, float]] = []
    for ball, count in candidates(bore, outside, kind):
        found = [deviations(member, ball * 1e-3, count, pitch * 1e-3) for member in members]
        rms = np.sqrt(np.mean(np.concatenate(found, axis=-1) ** 2, axis=-1))
        i = int(np.argmin(rms))
        tried.append((float(rms[i]), ball, count, float(CONFORMITIES[i])))
    rms, ball, count, conformity = min(tried)
    as_good = [other[1] for other in tried if other[0] < AS_GOOD * rms]
    size = {"bore_mm": bore, "outside_mm": outside, "balls": kind}
    if key in FROM_RATINGS:
        return size | {"pitch_diameter_mm": pitch} | FROM_RATINGS[key]
    return size | {
        "pitch_diameter_mm": pitch,
        "ball_count": count,
        "ball_diameter_mm": round(ball, 6),
        "conformity": round(conformity, 4),
        "basis": f"reconstructed: {count} balls of {ball:.4g} mm with conformity {conformity:.3g} reproduce "
        f"axial rigidity and lift-off force of the catalogue to {100 * rms:.1f} % rms (balls of "
        f"{min(as_good):.4g} to {max(as_good):.4g} mm do nearly as well)",
    }


def conformities() -> dict[str, float]:
    """Groove conformity of every bearing whose balls are published."""
    found = {}
    for bearing in map(find_bearing, designations()):
        if bearing.maker == "GMN":
            balls = bearing.complement
            errors = deviations(bearing, balls.ball_diameter, balls.ball_count, balls.pitch_diameter)
            found[bearing.designation] = float(CONFORMITIES[int(np.argmin(np.mean(errors**2, axis=-1)))])
    return found


def main() -> None:
    """Write the complements of all families and the conformities of bearings with published balls."""
    rows = [best_complement(key, members) for key, members in sorted(families().items())]
    blocks = {
        "families": [json.dumps(row, ensure_ascii=False) for row in rows],
        "conformities": [
            json.dumps({"name": name, "conformity": round(value, 4)})
            for name, value in conformities().items()
        ],
    }
    text = ",\n".join(f' "{key}": [\n  ' + ",\n  ".join(lines) + "\n ]" for key, lines in blocks.items())
    Path(sys.argv[1]).write_text("{\n" + text + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
