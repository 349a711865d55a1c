"""Why two modes of ROSS's compressor differ by 0.17 %: layers that move by shear functions of their own.

Usage: python studies/ross/layers.py FOLDER

A layer without stiffness (laminations, impeller hubs) moves with the shaft below it, so its inertia is
carried by the shape functions of the shaft here. In ROSS a layer is a shaft element with the shear parameter
of its own soft material, whose shape functions move it otherwise than the shaft between the nodes. FOLDER is
what ``in_ross.py`` wrote. The compressor is computed in both ways, as it is and with every element cut in two
and in four: with layers as in ROSS its numbers come out, and both ways meet where elements become short.
Writes results/layers.json: largest relative difference of 16 frequencies at two speeds.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.machine.ross_files import ImportedRotor, read_ross
from rotordrop.physics import timoshenko
from rotordrop.rotor.assembly import PointMass, RotorFE, assemble
from rotordrop.rotor.suspension import spring
from rotordrop.rotor.whirl import whirl_modes

HERE = Path(__file__).parent
PARTS = (1, 2, 4)
SOFT_POISSON = -0.5
"""Poisson ratio of a material of equal elastic and shear modulus, as that of the soft layers [1]."""


def finite_elements(imported: ImportedRotor, parts: int, *, as_in_ross: bool) -> RotorFE:
    """The rotor with its elements cut into parts; layers as shaft elements of their own, or on the shaft."""
    rotor = imported.rotor
    z, sections, layers = [rotor.node_positions[0]], [], []
    for e, one in enumerate(rotor.elements):
        outer, length = float(one.outer_diameter), rotor.node_positions[e + 1] - rotor.node_positions[e]
        section = timoshenko.round_section(
            outer,
            float(one.inner_diameter),
            float(one.youngs_modulus),
            float(one.poisson_ratio),
            float(one.density),
        )
        layer = None
        if one.layer_diameter is not None:
            told = float(one.layer_diameter), float(one.layer_density)
            if as_in_ross:
                layer = timoshenko.round_section(told[0], outer, 1.0, SOFT_POISSON, told[1])
            else:
                section = timoshenko.with_layer(section, outer, *told)
        for _ in range(parts):
            z.append(z[-1] + length / parts)
            sections.append(section)
            layers.append(layer)
    discs = [
        PointMass(
            node=parts * (disc.node - 1) + 1,
            mass=float(disc.mass),
            polar_inertia=float(disc.polar_inertia),
            diametral_inertia=float(disc.diametral_inertia),
        )
        for disc in rotor.discs
    ]
    fe = assemble(z, sections, discs, modal_damping=0.0)
    for e, layer in enumerate(layers):
        if layer is not None:
            here = slice(2 * e, 2 * e + 4)
            fe.mass[here, here] += timoshenko.element_mass(layer, z[e + 1] - z[e])
            fe.polar[here, here] += timoshenko.element_polar(layer, z[e + 1] - z[e])
    return fe


def frequencies(imported: ImportedRotor, fe: RotorFE, parts: int, speed: float) -> np.ndarray:
    """Lateral natural frequencies [Hz] at a speed [rad/s] on the bearings of the file."""
    at = [one.at_speed(speed) for one in imported.springs]
    supports = [
        spring(parts * (one.node - 1) + 1, np.array(one.stiffness_matrix), np.array(one.damping_matrix))
        for one in at
    ]
    return np.asarray(whirl_modes(fe, speed, supports).frequency)


def largest(found: np.ndarray, wanted: np.ndarray) -> float:
    """Largest relative difference of the nearest frequency found, over all wanted ones [1]."""
    nearest = found[np.argmin(np.abs(found[:, None] - wanted), axis=0)]
    return float(np.max(np.abs(nearest / wanted - 1.0)))


def main() -> None:
    """Compare both ways with ROSS and with each other."""
    folder = Path(sys.argv[1])
    told = json.loads((folder / "numbers.json").read_text())
    imported = read_ross(folder / "compressor_example.json")
    wanted = {float(k): np.array(v) for k, v in told["rotors"]["compressor_example"]["frequencies"].items()}
    found = {
        (parts, as_in_ross, speed): frequencies(imported, fe, parts, speed)
        for parts in PARTS
        for as_in_ross in (True, False)
        for fe in [finite_elements(imported, parts, as_in_ross=as_in_ross)]
        for speed in wanted
    }
    results: dict[str, Any] = {"version": told["version"]}
    for as_in_ross, name in ((True, "layers as in ROSS"), (False, "layers on the shaft")):
        results[name] = {
            "against ROSS": max(largest(found[1, as_in_ross, v], numbers) for v, numbers in wanted.items()),
            "against elements in four": max(
                largest(found[1, as_in_ross, v], found[PARTS[-1], as_in_ross, v][: len(numbers)])
                for v, numbers in wanted.items()
            ),
        }
    results["the two ways"] = {
        f"elements in {parts}": max(
            largest(found[parts, False, v], found[parts, True, v][: len(numbers)])
            for v, numbers in wanted.items()
        )
        for parts in PARTS
    }
    print(json.dumps(results, indent=1))
    (HERE / "results" / "layers.json").write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
