"""Print the JSON Schema of a machine file.

Editors that know it complete and check a machine file while one types.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli._options import ForceOption
from rotordrop.cli._output import deliver_text


def schema(
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write to FILE instead of printing."),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Print the JSON Schema of a machine file, for editors and programs."""
    from rotordrop.machine import machine_schema

    text = json.dumps(machine_schema(), indent=2, ensure_ascii=False) + "\n"
    deliver_text(text, output, overwrite=force)
