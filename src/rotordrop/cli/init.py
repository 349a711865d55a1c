"""Write a machine file to start from, or copy an example.

The template is complete and commented; an example comes with its recording where there is one.
"""

from __future__ import annotations

import sys
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

import typer

from rotordrop.cli._options import ForceOption
from rotordrop.cli._output import deliver_text
from rotordrop.errors import OutputError, UsageError

TEMPLATE_FILE = Path("machine.toml")

_QUESTIONS = {
    "mass": 'mass of the rotor, such as "60 kg"',
    "length": 'length of the rotor, "1.1 m"',
    "centre": 'centre of mass from its NDE end, "520 mm"',
    "bearings": 'touchdown bearings from the NDE end, "110 mm, 980 mm"',
    "sensors": 'sensor planes from the NDE end, "180 mm, 900 mm"',
    "sensor_angle": 'angle of the first sensor of a plane, "135 deg" (the second stands 90° before it)',
    "designation": 'designation of the touchdown bearings, "7014 ACD/HCP4A"',
    "gap": 'radial air gap, "0.25 mm"',
    "speed": 'nominal speed, "9000 rpm"',
    "grade": 'balance grade, "G 2.5"',
    "support": 'support of the touchdown bearings: "stiff", "soft" or a stiffness, "1e8 N/m"',
}


def _number(name: str) -> Any:
    return typer.Option(metavar="TEXT", help=f"For --simple: {_QUESTIONS[name]}.", show_default=False)


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
        typer.Option(metavar="NAME", help='Copy an example: "paper", "small", or "lp400" with a recording.'),
    ] = None,
    force: ForceOption = False,
    simple: Annotated[
        bool, typer.Option("--simple", help="Make it of twelve numbers; those not given are asked for.")
    ] = False,
    mass: Annotated[str | None, _number("mass")] = None,
    length: Annotated[str | None, _number("length")] = None,
    centre: Annotated[str | None, _number("centre")] = None,
    bearings: Annotated[str | None, _number("bearings")] = None,
    sensors: Annotated[str | None, _number("sensors")] = None,
    sensor_angle: Annotated[str | None, _number("sensor_angle")] = None,
    designation: Annotated[str | None, _number("designation")] = None,
    gap: Annotated[str | None, _number("gap")] = None,
    speed: Annotated[str | None, _number("speed")] = None,
    grade: Annotated[str | None, _number("grade")] = None,
    support: Annotated[str | None, _number("support")] = None,
    preload: Annotated[
        str | None, typer.Option(metavar="TEXT", help="For --simple: preload of a row.", show_default=False)
    ] = None,
) -> None:
    """Write a commented machine file to start from, or copy an example machine into a folder.

    With --simple the machine is made of twelve numbers.
    """
    given = {
        "mass": mass,
        "length": length,
        "centre": centre,
        "bearings": bearings,
        "sensors": sensors,
        "sensor_angle": sensor_angle,
        "designation": designation,
        "gap": gap,
        "speed": speed,
        "grade": grade,
        "support": support,
    }
    if simple:
        text = _simple_text(given, preload)
        deliver_text(text, target or TEMPLATE_FILE, overwrite=force)
        return
    if any(value is not None for value in (*given.values(), preload)):
        raise UsageError("numbers of a machine belong to --simple; add it")
    if example is not None:
        _copy_example(example, target or Path(example), overwrite=force)
        return
    from rotordrop.machine import template_text

    deliver_text(template_text(), target or TEMPLATE_FILE, overwrite=force)


def _simple_text(given: dict[str, str | None], preload: str | None) -> str:
    """The machine file of twelve numbers; what was not given as an option is asked for."""
    from pydantic import ValidationError

    from rotordrop.machine import machine_text
    from rotordrop.machine.simple import SimpleMachine, simple_machine

    missing = [f"--{name.replace('_', '-')}" for name, value in given.items() if not value]
    if missing and not (sys.stdin and sys.stdin.isatty()):
        raise UsageError(
            f"--simple needs {', '.join(missing)}; nobody can be asked, because the input is no terminal: "
            "give them as options"
        )
    said = {name: value or typer.prompt(_QUESTIONS[name], err=True).strip() for name, value in given.items()}
    numbers: dict[str, Any] = dict(said)
    for name in ("bearings", "sensors"):
        places = [place.strip() for place in said[name].replace(";", ",").split(",")]
        if len(places) != 2:
            raise UsageError(f'--{name} needs two planes, such as "110 mm, 980 mm"')
        numbers[name] = tuple(places)
    try:
        machine = simple_machine(SimpleMachine(**numbers, preload=preload))
    except ValidationError as error:
        reasons = "; ".join(str(e["msg"]).removeprefix("Value error, ") for e in error.errors())
        raise UsageError(f"these numbers make no machine: {reasons}") from None
    return machine_text(machine)


def _copy_example(name: str, folder: Path, *, overwrite: bool) -> None:
    """Copy all files of an example, or none when one of them stands there already."""
    contents = _example_files(name)
    standing = [folder / file for file in contents if (folder / file).exists()]
    if standing and not overwrite:
        raise OutputError(f"{standing[0]} exists already; name another folder or add --force")
    from rotordrop.files import atomic_path, make_folder

    make_folder(folder)
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
