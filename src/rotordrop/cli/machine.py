"""Describe a machine: start a file, check it, search bearings, convert rotors, print schemas."""

from __future__ import annotations

import json as json_module
import sys
from collections.abc import Sequence
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import file_option, measured, pairs, refuse_beside, text_option
from rotordrop.cli._output import STANDARD_OUTPUT, console, deliver, deliver_text, require_places
from rotordrop.errors import UsageError
from rotordrop.units import percent

TEMPLATE_FILE = Path("machine.toml")

Document = StrEnum("Document", ["machine", "numbers", "estimate", "look"])
"""Documents with a published schema."""
_SCHEMAS = {
    Document.machine: "machine.schema:machine_schema",
    Document.numbers: "machine.simple:simple_schema",
    Document.estimate: "estimate.published:estimate_schema",
    Document.look: "evidence.look:look_schema",
}


def init(
    target: Annotated[
        Path | None,
        Argument(
            metavar="[FILE or FOLDER]",
            help="Machine file to write (machine.toml; '-' prints it), or folder for the example.",
            show_default=False,
        ),
    ] = None,
    example: Annotated[
        str | None,
        text_option("NAME", 'Copy an example: "paper", "small", or "lp400" with a recording.'),
    ] = None,
    force: options.Force = False,
    simple: Annotated[
        bool, Option("--simple", help="Make it of twelve numbers; those not given are asked for.")
    ] = False,
    numbers: Annotated[
        list[str] | None,
        Option("--set", metavar="NAME=VALUE", help='A number for --simple, "mass=60 kg"; repeat it.'),
    ] = None,
    schema: Annotated[
        Document | None,
        Option(
            help="Write the JSON Schema of a document for editors and programs; it is printed by default."
        ),
    ] = None,
) -> None:
    """Write a commented machine file to start from, or copy an example machine into a folder.

    With --simple the machine is made of twelve numbers.

    Example: rotordrop init machine.toml
    """
    if schema is not None:
        deliver_text(_schema_text(schema), target, overwrite=force)
        return
    if simple:
        made = target or TEMPLATE_FILE
        deliver_text(_simple_text(numbers or ()), made, overwrite=force)
        if made != STANDARD_OUTPUT:
            console(sys.stderr).print(
                f"next: rotordrop look {made} RECORD. An estimate with it takes minutes: it seeks the "
                "form of the rotor too.",
                soft_wrap=True,
            )
        return
    if numbers:
        raise UsageError("numbers of a machine belong to --simple; add it")
    if example is not None:
        from rotordrop.examples import copy_example

        for file in copy_example(example, target or Path(example), overwrite=force):
            typer.echo(f"written: {file}")
        return
    from rotordrop.machine.examples import template_text

    deliver_text(template_text(), target or TEMPLATE_FILE, overwrite=force)


def _simple_text(numbers: Sequence[str]) -> str:
    """The machine file of twelve numbers; what was not given as an option is asked for."""
    from rotordrop.machine.simple import EXAMPLES, read_number, simple_schema, simple_text

    given = pairs(numbers, 'a number, "mass=60 kg"')
    asked = simple_schema()
    for name in given:
        if given[name] or name not in EXAMPLES:
            read_number(name, given)
    missing = [name for name in asked["required"] if not given.get(name)]
    if missing and not (sys.stdin and sys.stdin.isatty()):
        raise UsageError(
            f"--simple needs {', '.join(missing)}; nobody can be asked, because the input is no terminal: "
            f'give them, as in --set "{missing[0]}=..."'
        )
    for name in missing:

        def readable(said: str, name: str = name) -> str:
            try:
                read_number(name, given | {name: said})
            except UsageError as error:
                raise typer.BadParameter(str(error)) from None  # makes it ask again
            return said

        try:
            meaning = asked["properties"][name]["description"].rstrip(".")
            question = f"{meaning[0].lower()}{meaning[1:]}, such as {EXAMPLES[name]!r}"
            given[name] = typer.prompt(question, err=True, value_proc=readable)
        except typer.Abort:
            said = " ".join(f'--set "{one}={value}"' for one, value in given.items())
            console(sys.stderr).print(f"\ngo on with: rotordrop init --simple {said}", soft_wrap=True)
            raise
    return simple_text(given)


def check(
    machine: options.Machine,
    speed: Annotated[
        float | None,
        measured(
            "speed", 'Speed at the drop, such as "60 Hz", for the warnings; the nominal speed when left out.'
        ),
    ] = None,
    everything: Annotated[
        bool, Option("--all", help="Also every default and inferred value, and limits with numbers.")
    ] = False,
    report: Annotated[
        Path | None, file_option("--report", "Write the same with a drawing of the rotor as an HTML page.")
    ] = None,
    json: options.Json = None,
) -> None:
    """Check a machine file and show what it amounts to: mass, load shares, frequencies, sag, assumptions.

    Example: rotordrop check machine.toml --report machine.html
    """
    from rotordrop.machine import load_machine
    from rotordrop.report.critical_speeds_page import machine_page
    from rotordrop.report.machine_content import machine_content
    from rotordrop.rotor.machine_summary import machine_json, machine_warnings, summarise_machine

    described = load_machine(machine)
    summary = summarise_machine(described)
    warnings = machine_warnings(described, summary, speed)
    drawn = None if report is None else machine_page(described, summary, warnings)
    numbers, page = machine_json(described, summary, warnings), machine_content(described, summary, warnings)
    deliver(numbers, json, page, report=report, drawn=drawn, whole=everything)


def bearings(
    designation: Annotated[
        list[str], Argument(metavar="DESIGNATION", help="Such as 71914, 7016 ACD/HCP4A, 6016-2Z/C3.")
    ],
    everything: Annotated[bool, Option("--all", help="Also the listed bearings of this size.")] = False,
    json: options.Json = None,
) -> None:
    """Search bearings by designation: size, angle, balls listed or inferred, clearance, preload.

    Example: rotordrop bearings 7016 ACD/HCP4A
    """
    from rotordrop.elements.catalog.lookup import find_bearing, search_bearings
    from rotordrop.report.machine_content import bearing_content

    asked = " ".join(designation)
    try:
        find_bearing(asked)
    except LookupError as error:
        raise UsageError(str(error)) from None
    found = search_bearings(asked)
    content = bearing_content(asked, found)
    deliver([bearing.as_json() for bearing in found], json, content, whole=everything)


def _schema_text(document: Document) -> str:
    """The JSON Schema of a document, for editors and programs."""
    module, function = _SCHEMAS[document].split(":")
    schema_of = getattr(import_module(f"rotordrop.{module}"), function)
    return json_module.dumps(schema_of(), indent=2, ensure_ascii=False) + "\n"


Target = StrEnum("Target", ["machine", "ross"])
"""What a rotor is converted to."""


def convert(
    source: Annotated[
        Path,
        Argument(
            metavar="SOURCE",
            help="ROSS file (.toml, .json) or shaft table (.csv, .xlsx); with --to ross a machine file.",
        ),
    ],
    to: Annotated[Target, Option("--to", help="What to make of it.")] = Target.machine,
    output: Annotated[
        Path | None,
        file_option("--output", "File to write; rotor_ross.toml by default with --to ross.", "-o"),
    ] = None,
    designation: Annotated[
        str | None, text_option("NAME", "Touchdown bearings of the machine file; XCB7013C by default.")
    ] = None,
    gap: Annotated[float | None, measured("length", "Their radial air gap; 250 um by default.")] = None,
    speed: Annotated[float | None, measured("speed", "Nominal speed; 300 Hz by default.")] = None,
    force: options.Force = False,
    json: options.Json = None,
) -> None:
    """Make a machine file of a rotor of ROSS or of a shaft table, or a file for ROSS of a machine.

    Example: rotordrop convert rotor.json -o machine.toml --designation "7014 CD"
    """
    if to is Target.ross:
        others = {"--designation": designation, "--gap": gap, "--speed": speed, "--force": force or None}
        refuse_beside("--to ross", others)
        _written_for_ross(source, output or Path("rotor_ross.toml"), json)
        return
    from rotordrop.machine.ross_files import read_rotor
    from rotordrop.report.machine_content import imported_content
    from rotordrop.rotor.imported import imported_json

    imported = read_rotor(source)
    deliver(imported_json(imported), json, imported_content(imported, source.name))
    if output is None:
        return
    from rotordrop.machine.simple import imported_text

    numbers = {"designation": designation, "gap": gap, "speed": speed}
    given = {name: value for name, value in numbers.items() if value is not None}
    text, made_up = imported_text(imported, source, given)
    deliver_text(text, output, overwrite=force)
    console(sys.stderr).print(f"made up, marked in the file: {', '.join(made_up)}", soft_wrap=True)


def _written_for_ross(machine: Path, output: Path, json: Path | None) -> None:
    """Write the rotor of a machine, with its AMBs as springs and dampers."""
    from rotordrop.machine import load_machine
    from rotordrop.machine.ross_files import springs_of, write_ross

    require_places(output, json)  # the output has a name of its own by default
    described = load_machine(machine)
    write_ross(described.rotor, output, springs_of(described.ambs))
    damping = float(described.rotor.modal_damping)
    without = f"; left out: modal damping of {percent(damping, 1)}, which files of ROSS do not hold"
    without *= damping > 0.0
    elements, mass = len(described.rotor.elements), described.rotor.mass
    content = {"file": str(output), "elements": elements, "mass_kg": mass, "left_out": without[12:]}
    deliver(content, json, lambda out: out.print(f"written: {output}{without}"))
