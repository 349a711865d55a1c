"""Make recordings whose truth is known: around any machine, or the fixed set of DropBench."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import measured, text_option
from rotordrop.cli._output import deliver, progress_bar

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
    duration: Annotated[float, measured("time", "Recorded after power-off.", "0.3 s")] = 0.3,
    violation: Annotated[
        str | None, text_option("FILE", "Case file of what no description has; 'list' names its keys.")
    ] = None,
    json: options.Json = None,
) -> None:
    """Make simulated recordings of drops; the hidden truth goes into a folder of its own.

    Example: rotordrop-bench synthesize machine.toml --speed "60 Hz" --output folder
    """
    from rotordrop.machine import load_machine
    from rotordrop_bench import hidden_machine, load_violations, synthesize_drop
    from rotordrop_bench.recording import write_drop
    from rotordrop_bench.violations import KEYS

    if violation == "list":
        lines = [f"{part}.{key}: {row[2]}" for part, keys in KEYS.items() for key, row in keys.items()]
        typer.echo("\n".join(lines))
        return
    broken = None if violation is None else load_violations(violation)
    written: list[dict[str, Any]] = []
    with progress_bar("synthesizing") as report:
        known = load_machine(machine)
        hidden = hidden_machine(known, seed, broken)
        for index, value in enumerate(speed):
            name = f"synthetic_{round(value / (2.0 * math.pi)):03d}Hz"  # no bundled recording is named so
            name += f"_{index + 1}" if len(speed) > 1 else ""
            report(name, index / len(speed))
            drop = synthesize_drop(hidden, value, index, duration=duration, name=name)
            place = write_drop(drop, known, folder, name)
            written.append({"name": name, "outcome": drop.result.outcome, "folder": str(place)})

    def summarise(out: Console) -> None:
        out.print(f"Simulated recordings of {known.name} (not measured), hidden machine {seed}")
        for entry in written:
            out.print(f"{entry['name']}: {entry['outcome']}; written: {entry['folder']}")
        out.print(f"hidden truth, not for estimators: {folder / 'truth'}")

    deliver({"origin": "simulated, not measured", "machine_seed": seed, "drops": written}, json, summarise)


def list_drops(only: OnlyOption = None, json: options.Json = None) -> None:
    """Name the drops of the bench: rotor, speed, family, departures.

    Example: rotordrop-bench list
    """
    from rotordrop_bench.corpus.cases import VERSION, chosen_drops

    drops = chosen_drops(only or [])

    def summarise(out: Console) -> None:
        out.print(f"DropBench, version {VERSION}; drops: {len(drops)}")
        for drop in drops:
            kinds = " + ".join(kind for kind, _ in drop.departures)
            rate = "" if drop.sampling_rate == 20e3 else f"{drop.sampling_rate / 1e3:g} kHz"
            line = f"{drop.name}  {drop.rotor:>6}  {drop.speed:>4g} Hz  {drop.group}"
            out.print(": ".join(filter(None, (line, kinds, rate))), highlight=False)

    deliver({"bench_version": VERSION, "drops": [vars(drop) for drop in drops]}, json, summarise)


def make(folder: FolderArgument, only: OnlyOption = None, json: options.Json = None) -> None:
    """Make the drops that are missing in a folder; their truth goes into a folder of its own.

    Example: rotordrop-bench make dropbench
    """
    from rotordrop_bench.corpus.cases import chosen_drops, made
    from rotordrop_bench.recording import truth_path

    drops = chosen_drops(only or [])
    missing = [drop for drop in drops if not truth_path(folder, drop.name).is_file()]
    with progress_bar("making drops") as report:
        for i, drop in enumerate(missing):
            report(drop.name, i / len(missing))
            made(drop, folder)
    there = len(drops) - len(missing)

    def summarise(out: Console) -> None:
        out.print(f"drops made: {len(missing)}, there already: {there} (simulated, not measured)")
        out.print(f"for estimators: {folder / 'drops'}; hidden truth, not for them: {folder / 'truth'}")

    deliver({"made": [drop.name for drop in missing], "there": there}, json, summarise)
