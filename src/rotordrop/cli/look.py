"""Look at a recorded drop, with nothing known of the machine.

What was read, the quality gate, what happened when, impacts and whirl from displacement alone.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._options import (
    JsonOption,
    PlanesOption,
    ProfileOption,
    ReportOption,
    quantity,
    refuse_beside,
)
from rotordrop.cli._output import console, deliver, require_places
from rotordrop.errors import UsageError


def look(
    record: Annotated[Path, typer.Argument(metavar="RECORD", help="Recorded drop.", show_default=False)],
    machine: Annotated[
        Path | None, typer.Argument(metavar="[MACHINE]", help="Machine description, if there is one.")
    ] = None,
    gap: Annotated[
        float | None,
        typer.Option(parser=quantity("length"), metavar="LENGTH", help='Radial air gap, "250 um".'),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(parser=quantity("speed"), metavar="SPEED", help='Speed at the drop, "9000 rpm".'),
    ] = None,
    mapping: PlanesOption = None,
    profile: ProfileOption = None,
    split: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Write one record for each of several drops there, as HDF5, and look no further.",
            file_okay=False,
        ),
    ] = None,
    report: ReportOption = None,
    json: JsonOption = None,
) -> None:
    """Look at a recorded drop: what was read, its quality, what happened when, impacts, whirl, indices."""
    if split is not None:
        if machine is None:
            raise UsageError(
                "--split needs the machine file too: rotordrop look both.h5 machine.toml --split parts"
            )
        others = {"--gap": gap, "--speed": speed, "--map": mapping, "--report": report, "--json": json}
        refuse_beside("--split", others)
        _split(record, machine, split, profile)
        return
    from rotordrop.evidence.look import look as look_at
    from rotordrop.report.look_page import look_page
    from rotordrop.report.terminal import print_summary

    described = None
    if machine is not None:
        from rotordrop.machine import load_machine

        described = load_machine(machine)
    seen = look_at(record, machine=described, gap=gap, speed=speed, mapping=mapping or (), profile=profile)
    if report is not None:
        from rotordrop.report.page import write_page

        write_page(look_page(seen), report)
    page = look_page(seen, drawn=False)
    deliver(seen.as_json(), json, lambda out: print_summary(page, out))


def _split(record: Path, machine: Path, folder: Path, profile: Path | None) -> None:
    """Cut a recording with several drops into one record for each; no sample is changed."""
    from rotordrop.evidence.splitting import split_drops
    from rotordrop.files import make_folder
    from rotordrop.machine import load_machine
    from rotordrop.record.record import read_record, save_record

    parts = split_drops(read_record(record, load_machine(machine), profile=profile))
    places = [folder / f"{part.name}.h5" for part in parts]
    if len(parts) == 1:
        console().print(f"{record} holds one drop; nothing to split.")
        return
    make_folder(folder)
    require_places(*places)
    for part, place in zip(parts, places, strict=True):
        save_record(part, place)
        console().print(f"{place}: {part.time[0]:.6g} to {part.time[-1]:.6g} s, {len(part.time)} samples")
