"""What a rotor from another program amounts to, on the bearings that its source gives it."""

from __future__ import annotations

import numpy as np

from rotordrop.document import stated
from rotordrop.machine.ross_files import ImportedRotor, Spring
from rotordrop.physics.linear_algebra import generalised_eigen
from rotordrop.rotor.assembly import N_RIGID, free_free_modes, rotor_fe
from rotordrop.rotor.suspension import Support, link
from rotordrop.rotor.whirl import matrices_of

SHOWN = 6
"""Frequencies that are given; chosen, not measured."""


def imported_json(imported: ImportedRotor) -> dict[str, object]:
    """Mass, inertias and frequencies of a rotor from another program, ready for JSON [SI]."""
    return {
        "source": imported.source,
        "notes": list(imported.notes),
        "nodes": len(imported.rotor.node_positions),
        **rotor_fe(imported.rotor).as_json(),
        "free_free_Hz": free_frequencies(imported),
        "on_source_bearings_x_Hz": supported_frequencies(imported, 0),
        "on_source_bearings_y_Hz": supported_frequencies(imported, 1),
        "bearings": [_bearing_json(spring) for spring in imported.springs],
    }


def _bearing_json(spring: Spring) -> dict[str, object]:
    entry = stated(spring, "node name stiffness_N_per_m damping_N_s_per_m")
    if spring.support is not None:
        entry["support"] = _bearing_json(spring.support) | {"mass_kg": spring.support_mass}
    return entry


def free_frequencies(imported: ImportedRotor) -> list[float]:
    """Bending frequencies of the free rotor at standstill [Hz]."""
    fe = rotor_fe(imported.rotor)
    return [float(f) for f in free_free_modes(fe, min(fe.size, N_RIGID + SHOWN)).frequency[N_RIGID:]]


def supported_frequencies(imported: ImportedRotor, axis: int) -> list[float]:
    """Undamped frequencies [Hz] in x or y at standstill, on the bearings and supports of the source."""
    if not imported.springs:
        return []
    fe, held = rotor_fe(imported.rotor), []
    for spring in imported.springs:
        links = [link(one.stiffness) for one in (spring, spring.support) if one is not None]
        mass = () if spring.support is None else (spring.support_mass[axis],)
        held.append(Support(node=spring.node, links=tuple(links), masses=mass))
    system = matrices_of(fe, held)
    n = system.plane_size
    plane = slice(axis * n, (axis + 1) * n)
    values, _ = generalised_eigen(system.stiffness[plane, plane], system.mass[plane, plane])
    return [float(f) for f in np.sqrt(np.maximum(values[:SHOWN], 0.0)) / (2.0 * np.pi)]
