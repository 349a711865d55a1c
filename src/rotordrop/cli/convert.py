"""Convert rotors between ROSS, shaft tables and machine files.

Shows mass, inertias and frequencies of a rotor that was read, beside the bearings of its source, and makes a
machine file of it. The other way round, writes the rotor of a machine as ROSS loads it.
"""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._options import ForceOption, JsonOption, quantity, refuse_beside
from rotordrop.cli._output import deliver, deliver_text, require_places
from rotordrop.errors import UsageError


class Target(StrEnum):
    """What a rotor is converted to."""

    machine = "machine"
    ross = "ross"


def convert(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SOURCE",
            help="ROSS file (.toml, .json) or shaft table (.csv, .xlsx); with --to ross a machine file.",
        ),
    ],
    to: Annotated[Target, typer.Option("--to", help="What to make of it.")] = Target.machine,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="File to write; rotor_ross.toml by default with --to ross."
        ),
    ] = None,
    designation: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Touchdown bearings of the machine file; XCB7013C by default."),
    ] = None,
    gap: Annotated[
        float | None,
        typer.Option(
            parser=quantity("length"), metavar="LENGTH", help="Their radial air gap; 250 um by default."
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(parser=quantity("speed"), metavar="SPEED", help="Nominal speed; 300 Hz by default."),
    ] = None,
    force: ForceOption = False,
    json_file: JsonOption = None,
) -> None:
    """Make a machine file of a rotor of ROSS or of a shaft table, or a file for ROSS of a machine."""
    if to is Target.ross:
        others = {"--designation": designation, "--gap": gap, "--speed": speed, "--force": force or None}
        refuse_beside("--to ross", others)
        _written_for_ross(source, output or Path("rotor_ross.toml"), json_file)
        return
    from rotordrop.machine.ross_files import read_rotor
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
        designation="XCB7013C" if designation is None else designation,
        gap=250e-6 if gap is None else gap,
        speed=600.0 * math.pi if speed is None else speed,
        grade="G 2.5",
        support="1e8 N/m",
        name=source.stem,
    )
    planes = [("NDE", nodes[0]), ("DE", nodes[1])]
    notes = [f"rotor from {source.name} ({imported.source})", *imported.notes]
    machine = drafted_machine(rotor=imported.rotor, bearings=planes, sensors=planes, known=known, notes=notes)
    deliver_text(machine_text(machine), output, overwrite=force)


def _written_for_ross(machine: Path, output: Path, json_file: Path | None) -> None:
    """Write the rotor of a machine, with its AMBs as springs and dampers."""
    from rotordrop.machine import load_machine
    from rotordrop.machine.ross_files import Spring, write_ross

    require_places(output, json_file)
    described = load_machine(machine)
    springs = [
        Spring(
            node=amb.node,
            name=f"AMB {amb.name}",
            stiffness=(amb.stiffness.value, amb.stiffness.value),
            damping=(amb.damping.value, amb.damping.value),
        )
        for amb in described.ambs
    ]
    write_ross(described.rotor, output, springs)
    content = {
        "file": str(output),
        "elements": len(described.rotor.elements),
        "mass_kg": described.rotor.mass,
    }
    deliver(content, json_file, lambda out: out.print(f"written: {output}"))
