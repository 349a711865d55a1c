"""Print the JSON Schema of a file, an estimate or a look.

Editors that know the first complete and check a machine file while one types; programs that read an estimate
find its fields in the second.
"""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._options import ForceOption
from rotordrop.cli._output import deliver_text


class Document(StrEnum):
    """Documents with a published schema."""

    machine = "machine"
    numbers = "numbers"
    estimate = "estimate"
    look = "look"


def schema(
    document: Annotated[
        Document,
        typer.Argument(
            help="A machine file, the numbers of 'init --simple', or what 'rotordrop estimate --json' writes."
        ),
    ] = Document.machine,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write to FILE instead of printing."),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Print the JSON Schema of a file or of an estimate, for editors and programs."""
    if document is Document.machine:
        from rotordrop.machine import machine_schema as schema_of
    elif document is Document.numbers:
        from rotordrop.machine.simple import simple_schema as schema_of
    elif document is Document.look:
        from rotordrop.evidence.look.schema import look_schema as schema_of
    else:
        from rotordrop.estimate.schema import estimate_schema as schema_of

    text = json.dumps(schema_of(), indent=2, ensure_ascii=False) + "\n"
    deliver_text(text, output, overwrite=force)
