"""Make simulated recordings of drops whose truth is known.

Draws a machine around its description, simulates drops and records them with imperfect sensors.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotordrop.cli._options import JsonOption, MachineArgument, quantity
from rotordrop.cli._output import deliver, progress_bar
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop_bench import SyntheticDrop


def synthesize(
    machine: MachineArgument,
    speed: Annotated[
        list[float],
        typer.Option(
            parser=quantity("speed"), metavar="SPEED", help='Speed at power-off, such as "60 Hz"; repeatable.'
        ),
    ],
    folder: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Where the files go.")],
    seed: Annotated[int, typer.Option(metavar="NUMBER", min=0, help="Seed of the hidden machine.")] = 0,
    first_drop: Annotated[
        int, typer.Option(metavar="NUMBER", min=0, help="Seed of the first drop; the next ones follow.")
    ] = 0,
    duration: Annotated[
        float,
        typer.Option(
            parser=quantity("time"), metavar="TIME", help="Recorded after power-off.", show_default="0.3 s"
        ),
    ] = 0.3,
    sampling_rate: Annotated[
        float,
        typer.Option(
            parser=quantity("frequency"), metavar="RATE", help="Sampling rate.", show_default="20 kHz"
        ),
    ] = 20e3,
    noise: Annotated[
        float,
        typer.Option(
            parser=quantity("length"), metavar="LENGTH", help="Sensor noise, rms.", show_default="0.45 um"
        ),
    ] = 0.45e-6,
    bits: Annotated[int, typer.Option(metavar="NUMBER", help="Bits of the converter; 0 for none.")] = 16,
    violation: Annotated[
        str,
        typer.Option(
            metavar="NAME|FILE",
            help="What the estimator's model cannot represent, by name ('list' names all) or as .toml file.",
        ),
    ] = "none",
    fault: Annotated[
        str | None, typer.Option(metavar="NAME", help="A deliberate mistake in the file; 'list' names all.")
    ] = None,
    hdf5: Annotated[bool, typer.Option("--hdf5", help="Write the recording as HDF5 too.")] = False,
    json_file: JsonOption = None,
) -> None:
    """Make simulated recordings of drops; the hidden truth goes into a folder of its own."""
    from rotordrop_bench import FAULTS, VIOLATIONS

    if (not violation.endswith(".toml") and _listed(violation, VIOLATIONS)) or _listed(fault, FAULTS):
        return
    from rotordrop.machine import load_machine
    from rotordrop_bench import SensorChain, hidden_machine, synthesize_drop, write_synthetic

    chain = SensorChain(sampling_rate=sampling_rate, noise=noise, bits=bits)
    written: list[dict[str, Any]] = []
    with progress_bar("synthesizing") as report:
        hidden = hidden_machine(load_machine(machine), seed, violation)
        for index, value in enumerate(speed):
            name = _name(value, index, speed)
            report(name, index / len(speed))
            drop = synthesize_drop(
                hidden, value, first_drop + index, sensor_chain=chain, duration=duration, name=name
            )
            drop = _faulty(drop, fault)
            files = write_synthetic(drop, folder, formats=("csv", "h5") if hdf5 else ("csv",))
            written.append(_entry(drop, [str(file) for file in files]))

    def summarise(out: Console) -> None:
        out.print(f"Simulated recordings of {hidden.known.name} (not measured), hidden machine {seed}")
        for entry in written:
            out.print(f"{entry['name']}: {entry['outcome']}")
            for file in entry["files"]:
                out.print(f"  written: {file}")

    deliver(
        {"origin": "simulated, not measured", "machine_seed": seed, "drops": written}, json_file, summarise
    )


def _listed(choice: str | None, known: dict[str, Any]) -> bool:
    if choice == "list":
        typer.echo("\n".join(known))
        return True
    if choice is not None and choice not in known:
        raise UsageError(f"there is no {choice!r}; choose one of {', '.join(map(repr, known))}")
    return False


def _name(speed: float, index: int, speeds: list[float]) -> str:
    """Name by speed, numbered where a speed comes more than once; no bundled recording is named so."""
    names = [f"synthetic_{round(value / 6.283185307179586):03d}Hz" for value in speeds]
    stem = names[index]
    return stem if names.count(stem) == 1 else f"{stem}_{names[: index + 1].count(stem)}"


def _faulty(drop: SyntheticDrop, fault: str | None) -> SyntheticDrop:
    from dataclasses import replace

    from rotordrop_bench import with_fault

    if fault is None:
        return drop
    tail = None if drop.tail is None else with_fault(drop.tail, fault)
    return replace(
        drop, record=with_fault(drop.record, fault), tail=tail, truth={**drop.truth, "fault": fault}
    )


def _entry(drop: SyntheticDrop, files: list[str]) -> dict[str, Any]:
    return {"name": drop.truth["name"], "outcome": drop.result.outcome, "files": files}
