"""Take a rotor over from ROSS or from a shaft table.

Makes a machine file of it. Shows mass, inertias and frequencies of what was read, beside the bearings that
the source has.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._options import ForceOption, JsonOption, quantity
from rotordrop.cli._output import deliver, deliver_text, require_places
from rotordrop.errors import UsageError


def import_rotor(
    source: Annotated[
        Path,
        typer.Argument(metavar="SOURCE", help="ROSS file (.toml, .json), or shaft table (.csv, .xlsx)."),
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Machine file to write.")
    ] = None,
    designation: Annotated[
        str, typer.Option(metavar="NAME", help="Touchdown bearings of the machine file.")
    ] = "XCB7013C",
    gap: Annotated[
        float, typer.Option(parser=quantity("length"), metavar="LENGTH", help="Their radial air gap.")
    ] = 250e-6,
    speed: Annotated[
        float, typer.Option(parser=quantity("speed"), metavar="SPEED", help="Nominal speed.")
    ] = 1884.9555921538758,
    force: ForceOption = False,
    json_file: JsonOption = None,
) -> None:
    """Take a rotor over from a file of ROSS or a shaft table; show it, and make a machine file of it."""
    from rotordrop.machine.other_programs import read_rotor
    from rotordrop.report.rotor_content import imported_content, imported_json
    from rotordrop.report.terminal import print_summary

    require_places(json_file)
    imported = read_rotor(source)
    content = imported_content(imported, source.name)
    deliver(imported_json(imported), json_file, lambda out: print_summary(content, out))
    if output is None:
        return
    from rotordrop.machine import machine_text
    from rotordrop.machine.simple import SimpleMachine, drafted_machine

    if len({spring.node for spring in imported.springs if spring.kind == "BearingElement"}) < 2:
        last = len(imported.rotor.node_positions)
        nodes = (max(1, round(0.1 * last)), min(last, round(0.9 * last)))
    else:
        ends = sorted(spring.node for spring in imported.springs if spring.kind == "BearingElement")
        nodes = (ends[0], ends[-1])
    if nodes[0] == nodes[1]:
        raise UsageError("the rotor has too few nodes for two bearings; cut it into more elements")
    known = SimpleMachine(
        mass=imported.rotor.mass,
        centre=imported.rotor.centre_of_gravity,
        length=imported.rotor.node_positions[-1],
        bearings=(0.0, imported.rotor.node_positions[-1]),
        sensors=(0.0, imported.rotor.node_positions[-1]),
        sensor_angle="135 deg",
        designation=designation,
        gap=gap,
        speed=speed,
        grade="G 2.5",
        support="1e8 N/m",
        name=source.stem,
    )
    planes = [("NDE", nodes[0]), ("DE", nodes[1])]
    notes = [f"rotor from {source.name} ({imported.source})", *imported.notes]
    machine = drafted_machine(rotor=imported.rotor, bearings=planes, sensors=planes, known=known, notes=notes)
    deliver_text(machine_text(machine), output, overwrite=force)
