"""The command ``rotordrop-bench``: simulated recordings whose truth is known, and scores on them.

Errors, exit codes and Ctrl-C are those of the command ``rotordrop``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import typer

from rotordrop.cli import app as rotordrop_command
from rotordrop.cli.app import CONTEXT, Verb, VerbTable

NAME = "rotordrop-bench"

_DROPS, _SCORES = "rotordrop_bench.cli.drops", "rotordrop_bench.cli.scores"


class BenchTable(VerbTable):
    """The verbs of the bench."""

    program: ClassVar = NAME
    groups: ClassVar = {
        "Any machine": (
            Verb("synthesize", "Make simulated recordings of drops whose truth is known", _DROPS),
            Verb("score", "Compare anybody's estimates with the truth of their recordings", _SCORES),
        ),
        "DropBench": (
            Verb("list", "Name the drops of the bench", _DROPS, "list_drops"),
            Verb("make", "Make the drops that are missing in a folder", _DROPS),
        ),
        "Versions": (
            Verb("corpus run", "Run the corpus with a version of the program", _SCORES),
            Verb("corpus compare", "Tell whether a version keeps every limit against another", _SCORES),
        ),
    }


app = typer.Typer(cls=BenchTable, add_completion=False, rich_markup_mode=None, context_settings=CONTEXT)


@app.callback(invoke_without_command=False)
def rotordrop_bench() -> None:
    """Simulated recordings of drops whose truth is known, and scores of estimators on them."""


def run(arguments: Sequence[str]) -> int:
    """Run one command and give its exit code; errors become one sentence on standard error."""
    return rotordrop_command.run(arguments, app, NAME)


def main() -> None:
    """Entry point of the command ``rotordrop-bench``."""
    rotordrop_command.main(app, NAME)
