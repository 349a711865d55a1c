"""The command ``rotordrop``: finds the verb, runs it, and turns errors into a sentence and an exit code.

Exit codes: 0 done, 2 machine file, 3 recording, 4 identification, 5 simulation, 6 output, 7 model and
record do not agree (everything asked for is written all the same), 64 wrong call, 130 stopped by Ctrl-C, 1
anything else.
"""

from __future__ import annotations

import atexit
import errno
import os
import signal
import sys
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import typer
from typer.core import TyperCommand, TyperGroup

from rotordrop._version import __version__
from rotordrop.cli import INTERRUPTED as INTERRUPTED
from rotordrop.cli import STOPPED
from rotordrop.cli._examples import EXAMPLES
from rotordrop.cli._interruption import interruptions_kept
from rotordrop.cli._output import read_by_this_command, require_places
from rotordrop.cli._streams import open_streams, printable
from rotordrop.errors import OutputError, RotordropError, UsageError

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Our matrices are small: threads inside linear algebra cost more than they give, above all on busy cores."""

BROKEN_PIPE = 141

_OUTPUTS = ("json", "json_file", "report", "output")
"""Parameters of the verbs that name files to write; other paths are read."""

_NEITHER = ("target", "folder", "data")
"""Parameters that name a folder to fill, or a file that is never replaced unasked."""

_NO_ROOM = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO, errno.EBADF)

GROUPS = {
    "See a record": ("look", "profile", "clearance", "waterfall"),
    "Estimate": ("estimate", "calibrate"),
    "Judge": ("compare", "log", "study run", "study show", "study repeat", "study rare", "study design"),
    "Simulate": ("simulate", "coast-down", "critical-speeds", "unbalance-response"),
    "Describe a machine": ("init", "check", "bearings", "convert", "schema"),
    "Serve": ("serve", "doctor"),
}
"""The verbs by what one wants to do, as the help page shows them."""

OF_TWO_WORDS = ("study",)
"""First words of verbs that have a second one: ``study_run.py`` is ``rotordrop study run``."""

NOW = {
    "fingerprint": "rotordrop doctor --fingerprint",
    "changed": "rotordrop compare BEFORE AFTER --changes",
    "split": "rotordrop look RECORD MACHINE --split FOLDER",
    "rare": "rotordrop study rare",
    "design": "rotordrop study design",
    "repeat": "rotordrop study repeat",
    "import-rotor": "rotordrop convert",
    "export-rotor": "rotordrop convert --to ross",
    "synthesize": "rotordrop-bench synthesize",
    "score": "rotordrop-bench score",
    "bench": "rotordrop-bench list, make or score-all",
}
"""What has another name now."""

# Typer carries its own copy of click in new versions and uses the installed one in old versions.
_CallError: type[Exception] = next(c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException")


def verbs() -> dict[str, str]:
    """List the verbs with their one-line descriptions, in the order of the work, without importing them."""
    files = [file for file in Path(__file__).parent.glob("[a-z]*.py") if file.stem != "app"]
    found = {_spelled(file.stem): _first_line(file) for file in files}
    ordered = [name for names in GROUPS.values() for name in names if name in found]
    return {name: found[name] for name in [*ordered, *sorted(found.keys() - set(ordered))]}


def _spelled(stem: str) -> str:
    first, _, rest = stem.partition("_")
    return f"{first} {rest.replace('_', '-')}" if first in OF_TWO_WORDS and rest else stem.replace("_", "-")


def load_verb(name: str) -> TyperCommand:
    """Import the file of a verb and make its function a command."""
    stem = name.replace("-", "_").replace(" ", "_")
    module = import_module(f"rotordrop.cli.{stem}")
    single = typer.Typer(add_completion=False, rich_markup_mode=None)
    example = f"Example: {EXAMPLES[name]}" if name in EXAMPLES else None
    single.command(name, epilog=example)(with_files_apart(getattr(module, stem)))
    command = typer.main.get_command(single)
    assert isinstance(command, TyperCommand)
    return command


def with_files_apart(verb: Callable[..., None]) -> Callable[..., None]:
    """Make a verb refuse to write over what it reads, and two outputs of one name, before it begins."""

    @wraps(verb)
    def called(**values: Any) -> None:
        read = [
            path
            for name, value in values.items()
            if name not in (*_OUTPUTS, *_NEITHER)
            for path in (value if isinstance(value, list) else [value])
            if isinstance(path, Path)
        ]
        read_by_this_command(read)
        require_places(*(values[name] for name in _OUTPUTS if name in values))
        verb(**values)

    return called


class VerbTable(TyperGroup):
    """Group of commands that lists its verbs without importing them."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Name the verbs."""
        return list(verbs())

    def get_command(self, ctx: Any, cmd_name: str) -> TyperCommand | None:
        """Give a light stand-in with the one-line description, enough for the help page."""
        line = verbs().get(cmd_name)
        return None if line is None else TyperCommand(cmd_name, short_help=line, rich_markup_mode=None)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Load the verb that was called."""
        known = verbs()
        for words in (2, 1):
            name = " ".join(args[:words])
            if name in known:
                return name, load_verb(name), args[words:]
        if args[:1] and args[0] in OF_TWO_WORDS and (len(args) == 1 or args[1] in ("-h", "--help")):
            for name, line in known.items():
                if name.startswith(f"{args[0]} "):
                    typer.echo(f"rotordrop {name}: {line}")
            raise typer.Exit
        wrong = " ".join(args[:2]) if args[:1] and args[0] in OF_TWO_WORDS else "".join(args[:1])
        if wrong in NOW:
            raise UsageError(f"there is no command {wrong!r}; it is {NOW[wrong]} now")
        close = get_close_matches(wrong, known, 1) or ["--help"]
        raise UsageError(f"there is no command {wrong!r}; try 'rotordrop {close[0]}'")

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the verbs under what one wants to do."""
        known = verbs()
        grouped = {title: [name for name in names if name in known] for title, names in GROUPS.items()}
        rest = [name for name in known if not any(name in names for names in grouped.values())]
        for title, names in (*grouped.items(), ("Other", rest)):
            if names:
                with formatter.section(title):
                    formatter.write_dl([(name, known[name]) for name in names], col_max=20)


app = typer.Typer(
    cls=VerbTable,
    add_completion=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"rotordrop {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=False)
def rotordrop(
    version: bool = typer.Option(
        False, "--version", is_eager=True, callback=_show_version, help="Print the version and stop."
    ),
) -> None:
    """From a recorded rotor drop to touchdown-bearing force and stress."""


def run(arguments: Sequence[str], command: Any = None) -> int:
    """Run one command and give its exit code; errors become one sentence on standard error.

    Another program with verbs of its own passes its ``command``.
    """
    try:
        program = typer.main.get_command(app) if command is None else command
        name = "rotordrop" if command is None else command.name
        with program.make_context(name, list(arguments) or ["--help"]) as context:
            program.invoke(context)
        sys.stdout.flush()
        return 0
    except typer.Exit as stop:
        return stop.exit_code
    except RotordropError as error:
        return _fail(str(error), error.exit_code)
    except _CallError as error:
        return _fail(_call_message(error), UsageError.exit_code)
    except (KeyboardInterrupt, typer.Abort):
        return _fail(STOPPED, INTERRUPTED)
    except BrokenPipeError:
        _discard_standard_output()
        return BROKEN_PIPE
    except MemoryError:
        return _fail("there is not enough memory for this; free some, or give a shorter record", 1)
    except OSError as error:
        if error.errno not in _NO_ROOM or error.filename is not None:
            raise
        _discard_standard_output()
        return _fail(f"cannot write the output: {error.strerror}", OutputError.exit_code)


def _discard_standard_output() -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def main(command: Any = None) -> None:
    """Entry point of the command ``rotordrop``, or of another program with its ``command``."""
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    open_streams()
    with interruptions_kept() as was_pressed:
        try:
            code = run(sys.argv[1:], command)
        except Exception:
            if not was_pressed():  # the compiler turns an interrupt into an error of its own
                raise
            code = _fail(STOPPED, INTERRUPTED)
    if code == INTERRUPTED:
        _leave_interrupted()
    sys.exit(code)


def _leave_interrupted() -> NoReturn:
    """End with 130 whatever was interrupted.

    Python remembers a KeyboardInterrupt that passed through an ``exec``, as in imports that build
    classes, and then kills itself with SIGINT although it was caught. So what is registered for the
    end runs here.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(INTERRUPTED)


def _fail(message: str, code: int) -> int:
    typer.echo(f"rotordrop: {printable(message)}", err=True)
    return code


def _call_message(error: Any) -> str:
    context = getattr(error, "ctx", None)
    path = context.command_path if context else "rotordrop"
    return f"{error.format_message()}\nSee '{path} --help'."


def _first_line(file: Path) -> str:
    with file.open(encoding="utf-8") as text:
        return text.readline().strip().strip('"').rstrip(".")
