"""What a rotor from another program amounts to here, to be compared with what the source says."""

from __future__ import annotations

import numpy as np

from rotordrop.machine.ross_files import ImportedRotor
from rotordrop.report.content import Cell, ReportContent, Statement, Table
from rotordrop.report.quantity import Quantity
from rotordrop.rotor.assembly import N_RIGID, free_free_modes, modes_on_springs, rotor_fe

SHOWN = 6


def imported_json(imported: ImportedRotor) -> dict[str, object]:
    """Mass, inertias and frequencies of a rotor from another program, ready for JSON [SI]."""
    fe = rotor_fe(imported.rotor)
    return {
        "source": imported.source,
        "notes": list(imported.notes),
        "nodes": len(imported.rotor.node_positions),
        "mass_kg": fe.total_mass,
        "centre_of_gravity_m": fe.centre_of_gravity,
        "polar_inertia_kg_m2": fe.polar_inertia,
        "diametral_inertia_kg_m2": fe.diametral_inertia,
        "free_free_Hz": _free(imported),
        "on_source_bearings_x_Hz": _supported(imported, 0),
        "on_source_bearings_y_Hz": _supported(imported, 1),
        "bearings": [
            {"node": s.node, "name": s.name, "stiffness_N_per_m": s.stiffness, "damping_N_s_per_m": s.damping}
            for s in imported.springs
        ],
    }


def imported_content(imported: ImportedRotor, name: str) -> ReportContent:
    """Show mass, inertias and frequencies of a rotor from another program."""
    fe = rotor_fe(imported.rotor)
    rows: tuple[tuple[Cell, ...], ...] = (
        ("nodes", f"{len(imported.rotor.node_positions)}"),
        ("mass", Quantity(value=fe.total_mass, kind="mass")),
        ("centre of gravity from node 1", Quantity(value=fe.centre_of_gravity, kind="dimension")),
        ("polar inertia", f"{fe.polar_inertia:.5g} kg m²"),
        ("diametral inertia about the centre of gravity", f"{fe.diametral_inertia:.5g} kg m²"),
    )
    modes = [("free-free bending, at standstill", _free(imported))]
    for k, axis in enumerate("xy"):
        if imported.springs:
            modes.append((f"on the bearings of the source, {axis}, undamped", _supported(imported, k)))
    columns = ("mode", *(str(number + 1) for number in range(SHOWN)))
    return ReportContent(
        title=f"Rotor from {name}",
        subtitle=imported.source,
        verdict=tuple(Statement(text=note) for note in imported.notes)
        or (Statement(text="Everything in the file was taken over.", level="good"),),
        summary=(
            Table(columns=("rotor", ""), rows=rows),
            Table(columns=columns, rows=tuple((label, *_frequencies(values)) for label, values in modes)),
        ),
    )


def _free(imported: ImportedRotor) -> list[float]:
    fe = rotor_fe(imported.rotor)
    return [float(f) for f in free_free_modes(fe, min(fe.size, N_RIGID + SHOWN)).frequency[N_RIGID:]]


def _supported(imported: ImportedRotor, axis: int) -> list[float]:
    if not imported.springs:
        return []
    fe = rotor_fe(imported.rotor)
    springs: dict[int, float] = {}
    for spring in imported.springs:
        springs[spring.node] = springs.get(spring.node, 0.0) + spring.stiffness[axis]
    return [float(f) for f in modes_on_springs(fe, springs, min(fe.size, SHOWN)).frequency]


def _frequencies(values: list[float]) -> list[Cell]:
    padded = [*values, *([np.nan] * SHOWN)][:SHOWN]
    return [Quantity(value=value, kind="frequency") for value in padded]
