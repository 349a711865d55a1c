"""Rotors of ROSS's own examples with what ROSS computes of them; runs in an environment with ROSS alone.

Usage: python in_ross.py FOLDER [NAME ...]

Saves every rotor as TOML and JSON into FOLDER and writes FOLDER/numbers.json: lateral natural frequencies at
two speeds and the response to an unbalance. ``python in_ross.py FOLDER --back`` loads the rotors that
``compare.py`` wrote back and writes FOLDER/back.json in the same way.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import ross as rs
from ross.tests import test_examples

SPEEDS = (0.0, 400.0)
"""Speeds of the natural frequencies [rad/s]; of bearings by speed, two of their table."""
RESPONSE_SPEEDS = np.linspace(20.0, 600.0, 59)
OVERDAMPED = 0.5
"""Damping ratio from which motion is no mode [1]."""
AMOUNT = 1e-4
"""Unbalance at the middle node [kg m]."""
MODES = 16

EXAMPLES = {
    "rotor_example": rs.rotor_example,
    "compressor_example": rs.compressor_example,
    "rotor_example_6dof": getattr(rs, "rotor_example_6dof", None),
    "rotor_example_with_damping": getattr(rs, "rotor_example_with_damping", None),
    **{f"friswell_{n}": getattr(test_examples, f"rotor_example{n}", None) for n in range(1, 7)},
}


def lateral_frequencies(rotor: rs.Rotor, speed: float) -> list[float]:
    """Damped natural frequencies of the lateral modes [Hz], lowest first."""
    values, vectors = np.linalg.eig(rotor.A(speed))
    size, per_node = rotor.ndof, rotor.number_dof
    found = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value.imag <= 2.0 or -value.real > OVERDAMPED * abs(value):
            continue
        motion = np.abs(vector[:size].reshape(-1, per_node))
        across = motion[:, [0, 1]].max() if per_node == 4 else motion[:, [0, 1, 3, 4]].max()
        along = 0.0 if per_node == 4 else motion[:, [2, 5]].max()
        if across > along:
            found.append(float(value.imag / (2.0 * np.pi)))
    return sorted(found)[:MODES]


def response(rotor: rs.Rotor) -> dict[str, object]:
    """Displacement (x, y) at every node under an unbalance at the middle node, as real and imaginary part."""
    node = rotor.nodes[len(rotor.nodes) // 2]
    per_node, answers = rotor.number_dof, []
    speeds = tabled_speeds(rotor)
    speeds = RESPONSE_SPEEDS if speeds is None else speeds
    for speed in speeds:
        force = np.zeros(rotor.ndof, dtype=complex)
        force[per_node * node] = AMOUNT * speed**2
        force[per_node * node + 1] = -1j * AMOUNT * speed**2
        dynamic = (
            rotor.K(speed) - speed**2 * rotor.M(speed) + 1j * speed * (rotor.C(speed) + speed * rotor.G())
        )
        moved = np.linalg.solve(dynamic, force).reshape(-1, per_node)[:, :2]
        answers.append(np.abs(moved[: rotor.nodes[-1] + 1]).tolist())
    return {"node": int(node), "speeds": np.asarray(speeds).tolist(), "magnitude": answers}


def tabled_speeds(rotor: rs.Rotor) -> np.ndarray | None:
    """Speeds at which the bearings have coefficients; None where these are the same at all speeds."""
    told = [getattr(b, key, None) for b in rotor.bearing_elements for key in ("frequency", "speed")]
    tables = [np.atleast_1d(one) for one in told if one is not None]
    longest = max(tables, key=len, default=np.zeros(0))
    return longest if len(longest) > 1 else None


def numbers(rotor: rs.Rotor) -> dict[str, object]:
    """What is compared of a rotor."""
    tabled = tabled_speeds(rotor)
    speeds = SPEEDS if tabled is None else (float(tabled[0]), float(tabled[len(tabled) // 2]))
    return {
        "mass": float(rotor.m),
        "inertia": float(rotor.Ip),
        "frequencies": {repr(float(speed)): lateral_frequencies(rotor, speed) for speed in speeds},
        "response": response(rotor),
    }


def main() -> None:
    """Save the examples and their numbers."""
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[str, object] = {"version": rs.__version__, "rotors": {}}
    if "--back" in sys.argv:
        for file in sorted(folder.glob("*_back.*")):
            found["rotors"][file.name] = numbers(rs.Rotor.load(file))
        (folder / "back.json").write_text(json.dumps(found) + "\n")
        return
    chosen = sys.argv[2:]
    if chosen:
        found = json.loads((folder / "numbers.json").read_text())
    for name, make in EXAMPLES.items():
        if make is None or (chosen and name not in chosen):
            continue
        rotor = make()
        for suffix in ("toml", "json"):
            try:
                rotor.save(folder / f"{name}.{suffix}")
            except Exception as error:
                print(name, suffix, "cannot be saved:", error)
        found["rotors"][name] = numbers(rotor)
        print(name, rotor.number_dof, next(iter(found["rotors"][name]["frequencies"].values()))[:6])
    (folder / "numbers.json").write_text(json.dumps(found) + "\n")


if __name__ == "__main__":
    main()
