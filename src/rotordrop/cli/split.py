"""Cut a recording with several drops into one record for each.

Finds every fall from levitation; a drop ends where the rotor is lifted again.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._options import MachineArgument, ProfileOption
from rotordrop.cli._output import console, require_places


def split(
    machine: MachineArgument,
    record: Annotated[Path, typer.Argument(metavar="RECORD", help="Recording with several drops.")],
    folder: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="FOLDER", help="Where the records go, as HDF5.", file_okay=False
        ),
    ],
    profile: ProfileOption = None,
) -> None:
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
