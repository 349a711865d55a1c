"""Rotors of ROSS read without it, against what ROSS itself computed of them.

Usage: python studies/ross/compare.py FOLDER

FOLDER is what ``in_ross.py`` wrote, one for each version of ROSS. Every rotor is read from TOML and JSON,
put on the bearings of its file, and compared in lateral natural frequencies at two speeds and in the
magnitude of its response to an unbalance; then written back as ``NAME_back`` for ROSS to load. Writes
``results/ross_VERSION.json``; with FOLDER/back.json there, the rotors that went to and fro too.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import RotordropError
from rotordrop.machine.ross_files import ImportedRotor, Spring, read_ross, write_ross
from rotordrop.rotor.assembly import rotor_fe
from rotordrop.rotor.suspension import Support, spring
from rotordrop.rotor.whirl import unbalance_response, whirl_modes

HERE = Path(__file__).parent
AMOUNT = 1e-4


def supports_of(imported: ImportedRotor, speed: float) -> list[Support]:
    """Bearings of the source as supports here, with their coefficients at a speed [rad/s]."""
    return [spring(one.node, *at_speed(one, speed)) for one in imported.springs]


def at_speed(bearing: Spring, speed: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and damping matrix of a bearing at a speed [rad/s], straight between those of its table."""
    stiffness, damping = np.array(bearing.stiffness_matrix), np.array(bearing.damping_matrix)
    for letter, matrix in (("k", stiffness), ("c", damping)):
        for place, axes in np.ndenumerate([["xx", "xy"], ["yx", "yy"]]):
            if len(values := bearing.told.get(f"{letter}{axes}", ())) > 1:
                matrix[place] = np.interp(speed, bearing.told["frequency"], values)
    return stiffness, damping


def tabled(imported: ImportedRotor, speed: float) -> bool:
    """Whether all bearings have coefficients at a speed, so that no interpolation is compared."""
    tables = [one.told["frequency"] for one in imported.springs if len(one.told.get("frequency", ())) > 1]
    return all(min(abs(speed - at) for at in table) < 1e-6 * speed for table in tables)


def compared(imported: ImportedRotor, numbers: dict[str, Any]) -> dict[str, Any]:
    """Largest relative errors of one rotor."""
    fe = replace(rotor_fe(imported.rotor), modal_damping=0.0)  # a shaft of ROSS has none
    row: dict[str, Any] = {"mass": imported.rotor.mass / numbers["mass"] - 1.0, "notes": list(imported.notes)}
    for speed, wanted in numbers["frequencies"].items():
        found = whirl_modes(fe, float(speed), supports_of(imported, float(speed))).frequency
        row[f"frequencies at {speed} rad/s"] = matched(found, np.array(wanted)).tolist()
    told = numbers["response"]
    node = imported.nodes[told["node"]]
    chosen = [k for k, speed in enumerate(told["speeds"]) if tabled(imported, speed)]
    speeds = np.array(told["speeds"])[chosen]
    unbalance = {node: complex(AMOUNT)}
    if any(len(one.told.get("frequency", ())) > 1 for one in imported.springs):
        moved = np.array(
            [unbalance_response(fe, speed, unbalance, supports_of(imported, speed))[0] for speed in speeds]
        )
    else:
        moved = unbalance_response(fe, speeds, unbalance, supports_of(imported, 0.0))
    found = np.abs(moved[:, [n - 1 for n in imported.nodes], :])
    wanted = np.array(told["magnitude"])[chosen]
    row["response speeds"] = len(chosen)
    row["response"] = float(np.max(np.abs(found - wanted) / np.max(wanted, axis=(1, 2), keepdims=True)))
    return row


def back_in_ross(back: dict[str, Any], numbers: dict[str, Any]) -> dict[str, float]:
    """Largest relative errors of what ROSS computes of the rotor that was written here."""
    before = {float(key): np.array(one) for key, one in numbers["frequencies"].items()}
    errors = {
        f"frequencies at {key} rad/s": float(np.max(np.abs(matched(np.array(new), before[float(key)]))))
        for key, new in back["frequencies"].items()
    }
    old, new = (np.array(one["response"]["magnitude"]) for one in (numbers, back))
    if old.shape == new.shape:
        scale = np.max(old, axis=(1, 2), keepdims=True)
        errors["response"] = float(np.max(np.abs(new - old) / scale))
    return errors


def matched(found: NDArray[np.float64], wanted: NDArray[np.float64]) -> NDArray[np.float64]:
    """Relative error of the nearest frequency found, for every wanted one."""
    nearest = found[np.argmin(np.abs(found[:, None] - wanted), axis=0)]
    return np.asarray(nearest / wanted - 1.0)


def main() -> None:
    """Compare every rotor of a folder and write it back."""
    folder = Path(sys.argv[1])
    told = json.loads((folder / "numbers.json").read_text())
    back = json.loads((folder / "back.json").read_text()) if (folder / "back.json").is_file() else None
    results: dict[str, Any] = {"version": told["version"], "rotors": {}}
    for name, numbers in told["rotors"].items():
        row: dict[str, Any] | None = None
        for suffix in ("json", "toml"):
            file = folder / f"{name}.{suffix}"
            if not file.is_file():
                continue
            try:
                imported = read_ross(file)
            except RotordropError as error:
                results["rotors"][file.name] = {"refused": str(error)}
                continue
            if row is None:
                row, first = compared(imported, numbers), imported
            row = dict(row)
            row["same as JSON"] = (imported.rotor, imported.springs) == (first.rotor, first.springs)
            again = folder / f"{name}_back.{suffix}"
            write_ross(imported.rotor, again, imported.springs)
            back_here = read_ross(again)
            row["read back equal"] = (back_here.rotor, back_here.springs) == (
                imported.rotor,
                imported.springs,
            )
            if back is not None:
                assert row is not None
                row["back in ROSS"] = back_in_ross(back["rotors"][again.name], numbers)
            results["rotors"][file.name] = row
    for name, row in results["rotors"].items():
        print(name, {key: value for key, value in row.items() if key != "notes"})
    (HERE / "results" / f"ross_{told['version']}.json").write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
