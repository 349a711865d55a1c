"""What a rotor from another program amounts to here, to be compared with what the source says."""

from __future__ import annotations

from rotordrop.machine.ross_files import ImportedRotor
from rotordrop.report.content import ReportContent, Statement
from rotordrop.report.machine_content import inertias_json, mode_table, named_values, rotor_values
from rotordrop.rotor.assembly import N_RIGID, free_free_modes, modes_on_springs, rotor_fe

SHOWN = 6


def imported_json(imported: ImportedRotor) -> dict[str, object]:
    """Mass, inertias and frequencies of a rotor from another program, ready for JSON [SI]."""
    return {
        "source": imported.source,
        "notes": list(imported.notes),
        "nodes": len(imported.rotor.node_positions),
        **inertias_json(rotor_fe(imported.rotor)),
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
    rows = [("nodes", len(imported.rotor.node_positions)), *rotor_values(rotor_fe(imported.rotor), 5)]
    modes = [("free-free bending, at standstill", _free(imported))]
    for k, axis in enumerate("xy"):
        if imported.springs:
            modes.append((f"on the bearings of the source, {axis}, undamped", _supported(imported, k)))
    return ReportContent(
        title=f"Rotor from {name}",
        subtitle=imported.source,
        verdict=tuple(Statement(note) for note in imported.notes)
        or (Statement("All of the rotor in the file was taken over.", "good"),),
        summary=(named_values("rotor", rows), mode_table(modes, "rotor held", SHOWN)),
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
