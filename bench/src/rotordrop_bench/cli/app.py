"""The command ``rotordrop-bench``: simulated recordings whose truth is known, and scores on them.

Errors, exit codes and Ctrl-C are those of the command ``rotordrop``.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import typer

from rotordrop.cli import app as rotordrop_command
from rotordrop.cli._options import ForceOption
from rotordrop.cli._output import deliver_text
from rotordrop_bench.cli.bench import list_drops, make, score_all
from rotordrop_bench.cli.score import score
from rotordrop_bench.cli.synthesize import synthesize

EXAMPLES = {
    "synthesize": 'rotordrop-bench synthesize machine.toml --speed "60 Hz" --output folder',
    "score": "rotordrop-bench score estimate.json truth.json",
    "list": "rotordrop-bench list",
    "make": "rotordrop-bench make dropbench",
    "score-all": "rotordrop-bench score-all dropbench estimates",
    "schema": "rotordrop-bench schema > violations.schema.json",
}


def schema(
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write to FILE instead of printing."),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Print the JSON Schema of the violations that 'synthesize --violation' reads."""
    from rotordrop_bench.violations import violations_schema

    text = json.dumps(violations_schema(), indent=2, ensure_ascii=False) + "\n"
    deliver_text(text, output, overwrite=force)


app = typer.Typer(
    name="rotordrop-bench",
    help="Simulated recordings of drops whose truth is known, and scores of estimators on them.",
    add_completion=False,
    rich_markup_mode=None,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
VERBS: dict[str, Callable[..., None]] = {
    "synthesize": synthesize,
    "score": score,
    "list": list_drops,
    "make": make,
    "score-all": score_all,
    "schema": schema,
}
for name, verb in VERBS.items():
    app.command(name, epilog=f"Example: {EXAMPLES[name]}")(rotordrop_command.with_files_apart(verb))


def run(arguments: Sequence[str]) -> int:
    """Run one command and give its exit code; errors become one sentence on standard error."""
    return rotordrop_command.run(arguments, typer.main.get_command(app))


def main() -> None:
    """Entry point of the command ``rotordrop-bench``."""
    rotordrop_command.main(typer.main.get_command(app))
