"""Write the rotor of a machine as a file that ROSS loads."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._options import JsonOption, MachineArgument
from rotordrop.cli._output import deliver, require_places


def export_rotor(
    machine: MachineArgument,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="File to write, .toml or .json.")
    ] = Path("rotor_ross.toml"),
    json_file: JsonOption = None,
) -> None:
    """Write the rotor of a machine, with its AMBs as springs and dampers, as a file that ROSS loads."""
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
    told = {"file": str(output), "elements": len(described.rotor.elements), "mass_kg": described.rotor.mass}
    deliver(told, json_file, lambda out: out.print(f"written: {output}"))
