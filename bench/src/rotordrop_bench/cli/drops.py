"""Make recordings whose truth is known: around any machine, or the fixed set of DropBench."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import measured, quantity, text_option
from rotordrop.cli._output import deliver, progress_bar
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console

FolderArgument = Annotated[Path, Argument(metavar="FOLDER", help="Folder of the bench.", show_default=False)]
OnlyOption = Annotated[
    list[str] | None, Option("--only", metavar="NAME", help="A drop, a family or a rotor; repeatable.")
]


def synthesize(
    machine: options.Machine,
    speed: Annotated[list[float], measured("speed", 'Speed at power-off, such as "60 Hz"; repeatable.')],
    folder: Annotated[Path, Option("--output", "-o", metavar="FOLDER", help="Where the files go.")],
    seed: Annotated[int, Option(metavar="NUMBER", min=0, help="Seed of the hidden machine.")] = 0,
    first_drop: Annotated[
        int, Option(metavar="NUMBER", min=0, help="Seed of the first drop; the next ones follow.")
    ] = 0,
    duration: Annotated[float, measured("time", "Recorded after power-off.", "0.3 s")] = 0.3,
    sampling_rate: Annotated[
        float,
        Option(parser=quantity("frequency"), metavar="RATE", help="Sampling rate.", show_default="20 kHz"),
    ] = 20e3,
    noise: Annotated[float, measured("length", "Sensor noise, rms.", "0.45 um")] = 0.45e-6,
    bits: Annotated[int, Option(metavar="NUMBER", help="Bits of the converter; 0 for none.")] = 16,
    violation: Annotated[
        str | None, text_option("FILE", "Case file of what no description has; 'list' names its keys.")
    ] = None,
    fault: Annotated[
        str | None, text_option("NAME", "A deliberate mistake in the file; 'list' names all.")
    ] = None,
    hdf5: Annotated[bool, Option("--hdf5", help="Write the recording as HDF5 too.")] = False,
    json: options.Json = None,
) -> None:
    """Make simulated recordings of drops; the hidden truth goes into a folder of its own.

    Example: rotordrop-bench synthesize machine.toml --speed "60 Hz" --output folder
    """
    from rotordrop.machine import load_machine
    from rotordrop_bench import (
        FAULTS,
        SensorChain,
        hidden_machine,
        load_violations,
        synthesize_drop,
        with_fault,
        write_synthetic,
    )
    from rotordrop_bench.violations import KEYS

    keys = {f"{part}.{key}": row[2] for part, keys in KEYS.items() for key, row in keys.items()}
    if "list" in (violation, fault):
        typer.echo("\n".join([f"{key}: {words}" for key, words in keys.items()] if violation else FAULTS))
        return
    if fault is not None and fault not in FAULTS:
        raise UsageError(f"there is no {fault!r}; choose one of {', '.join(map(repr, FAULTS))}")
    broken = None if violation is None else load_violations(violation)
    chain = SensorChain(sampling_rate=sampling_rate, noise=noise, bits=bits)
    names = [f"synthetic_{round(value / (2.0 * math.pi)):03d}Hz" for value in speed]
    written: list[dict[str, Any]] = []
    with progress_bar("synthesizing") as report:
        hidden = hidden_machine(load_machine(machine), seed, broken)
        for index, value in enumerate(speed):
            # numbered where a speed comes more than once; no bundled recording is named so
            stem, number = names[index], names[: index + 1].count(names[index])
            name = stem if names.count(stem) == 1 else f"{stem}_{number}"
            report(name, index / len(speed))
            drop = synthesize_drop(
                hidden, value, first_drop + index, sensor_chain=chain, duration=duration, name=name
            )
            if fault is not None:
                tail = None if drop.tail is None else with_fault(drop.tail, fault)
                truth = {**drop.truth, "fault": fault}
                drop = replace(drop, record=with_fault(drop.record, fault), tail=tail, truth=truth)
            files = write_synthetic(drop, folder, formats=("csv", "h5") if hdf5 else ("csv",))
            paths = [str(file) for file in files]
            written.append({"name": drop.truth["name"], "outcome": drop.result.outcome, "files": paths})

    def summarise(out: Console) -> None:
        out.print(f"Simulated recordings of {hidden.known.name} (not measured), hidden machine {seed}")
        for entry in written:
            out.print(f"{entry['name']}: {entry['outcome']}")
            for file in entry["files"]:
                out.print(f"  written: {file}")

    deliver({"origin": "simulated, not measured", "machine_seed": seed, "drops": written}, json, summarise)


def list_drops(only: OnlyOption = None, json: options.Json = None) -> None:
    """Name the drops of the bench: rotor, speed, family, departures.

    Example: rotordrop-bench list
    """
    from rotordrop_bench import VERSION
    from rotordrop_bench.make import chosen_drops

    drops = chosen_drops(only or [])

    def summarise(out: Console) -> None:
        out.print(f"DropBench, version {VERSION}; drops: {len(drops)}")
        for drop in drops:
            kinds = " + ".join(kind for kind, _ in drop.departures)
            rate = "" if drop.sampling_rate == 20e3 else f"{drop.sampling_rate / 1e3:g} kHz"
            line = f"{drop.name}  {drop.rotor:>6}  {drop.speed:>4g} Hz  {drop.family}"
            out.print(": ".join(filter(None, (line, kinds, rate))), highlight=False)

    deliver({"bench_version": VERSION, "drops": [vars(drop) for drop in drops]}, json, summarise)


def make(folder: FolderArgument, only: OnlyOption = None, json: options.Json = None) -> None:
    """Make the drops that are missing in a folder; their truth goes into a folder of its own.

    Example: rotordrop-bench make dropbench
    """
    from rotordrop_bench.make import chosen_drops, make_bench

    with progress_bar("making drops") as report:
        made = make_bench(folder, only or [], report)
    there = len(chosen_drops(only or [])) - len(made)

    def summarise(out: Console) -> None:
        out.print(f"drops made: {len(made)}, there already: {there} (simulated, not measured)")
        out.print(f"for estimators: {folder / 'drops'}; hidden truth, not for them: {folder / 'truth'}")

    deliver({"made": made, "there": there}, json, summarise)
