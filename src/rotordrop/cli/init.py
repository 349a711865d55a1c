"""Write a machine file to start from, or copy an example.

The template is complete and commented; an example comes with its recording where there is one.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._options import ForceOption
from rotordrop.cli._output import deliver_text
from rotordrop.errors import OutputError

TEMPLATE_FILE = Path("machine.toml")


def init(
    target: Annotated[
        Path | None,
        typer.Argument(
            metavar="[FILE or FOLDER]",
            help="Machine file to write (machine.toml; '-' prints it), or folder for the example.",
            show_default=False,
        ),
    ] = None,
    example: Annotated[
        str | None,
        typer.Option(metavar="NAME", help='Copy an example machine: "paper", or "lp400" with a recording.'),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Write a commented machine file to start from, or copy an example machine into a folder."""
    if example is not None:
        _copy_example(example, target or Path(example), overwrite=force)
        return
    from rotordrop.machine import template_text

    deliver_text(template_text(), target or TEMPLATE_FILE, overwrite=force)


def _copy_example(name: str, folder: Path, *, overwrite: bool) -> None:
    """Copy all files of an example, or none when one of them stands there already."""
    contents = _example_files(name)
    standing = [folder / file for file in contents if (folder / file).exists()]
    if standing and not overwrite:
        raise OutputError(f"{standing[0]} exists already; name another folder or add --force")
    from rotordrop.atomic_file import atomic_path

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make the folder {folder}: {error.strerror}; name another one") from error
    for file, content in contents.items():
        with atomic_path(folder / file) as temporary:
            temporary.write_bytes(content)
        typer.echo(f"written: {folder / file}")


def _example_files(name: str) -> dict[str, bytes]:
    """Read the machine file of an example and what belongs to it: its shaft table and its recordings."""
    from rotordrop.machine import example_path

    machine = example_path(name)
    contents = {"machine.toml": machine.read_bytes()}
    contents |= {table.name: table.read_bytes() for table in machine.parent.glob(f"{name}_*.csv")}
    records = files("rotordrop") / "examples" / name
    if records.is_dir():
        contents |= {record.name: record.read_bytes() for record in records.iterdir()}
    return contents
