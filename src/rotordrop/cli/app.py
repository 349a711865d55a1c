"""The command ``rotordrop``: finds the verb, runs it, and turns errors into a sentence and an exit code.

Exit codes: 0 done, 2 machine file, 3 recording, 4 identification, 5 simulation, 6 output, 7 model and
record do not agree (everything asked for is written all the same), 64 wrong call, 130 stopped by Ctrl-C, 1
anything else.
"""

from __future__ import annotations

import atexit
import ctypes
import errno
import logging
import os
import signal
import sys
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from difflib import get_close_matches
from importlib import import_module
from inspect import getdoc
from typing import Any, ClassVar

import typer
from typer.core import TyperCommand, TyperGroup

from rotordrop._version import __version__
from rotordrop.cli import INTERRUPTED as INTERRUPTED
from rotordrop.cli import STOPPED
from rotordrop.cli._output import with_files_apart
from rotordrop.cli._terminal import open_streams, printable
from rotordrop.errors import OutputError, RotordropError, UnmatchedError, UsageError, speaking_of_options
from rotordrop.interrupts import interruptions_kept
from rotordrop.one_thread import ENVIRONMENT

BROKEN_PIPE = 141
"""Exit code when the reader has gone: 128 plus the number of the signal, the standard of shells."""

_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8
"""Numbers of the options of mallopt(3)."""
_NO_ROOM = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO, errno.EBADF)


class _Command(TyperCommand):
    """A command whose help names its arguments as they are declared, without types and braces of typer's."""

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """What the usage line says."""
        return ["[OPTIONS]", *(str(one.metavar) for one in self.params if one.param_type_name == "argument")]

    def get_params(self, ctx: Any) -> list[Any]:
        """Arguments and options; an argument needs no type beside its name."""
        found: list[Any] = super().get_params(ctx)
        for one in found:
            if one.param_type_name == "argument":
                one.display_type_rich = lambda ctx: ""
        return found


@dataclass(frozen=True)
class Verb:
    """One command; ``coast-down`` is the function ``coast_down`` of its module."""

    name: str
    line: str
    """What the help page shows."""
    module: str
    """Imported only when the verb is called."""
    function: str = ""
    """Of the module, where it is not named like the verb."""

    def load(self) -> TyperCommand:
        """Make the function of the verb a command; the example its docstring ends with ends the help."""
        name = self.function or self.name.replace("-", "_").replace(" ", "_")
        function = getattr(import_module(self.module), name)
        text, _, example = (getdoc(function) or "").partition("\n\nExample: ")
        single = typer.Typer(add_completion=False, rich_markup_mode=None)
        epilog = f"Example: {example}" if example else None
        single.command(self.name, cls=_Command, help=text, epilog=epilog)(with_files_apart(function))
        command = typer.main.get_command(single)
        assert isinstance(command, TyperCommand)
        return command


_HERE = "rotordrop.cli."
VERBS: dict[str, tuple[Verb, ...]] = {
    "See a record": (
        Verb("look", "Look at a recorded drop, with nothing known of the machine", _HERE + "records"),
        Verb("profile", "Make a profile of a recorder from one of its files", _HERE + "records"),
        Verb("clearance", "Measure the air gap: a shaft pushed round its bearings", _HERE + "records"),
        Verb("waterfall", "Name the frequencies of a recorded or simulated coast-down", _HERE + "records"),
    ),
    "Describe a machine": (
        Verb("init", "Write a machine file to start from, or copy an example", _HERE + "machine"),
        Verb("check", "Check a machine file and show what it amounts to", _HERE + "machine"),
        Verb("bearings", "Search bearings by designation, however it is written", _HERE + "machine"),
        Verb("convert", "Convert rotors between ROSS, shaft tables and machine files", _HERE + "machine"),
    ),
    "Estimate": (
        Verb("estimate", "Estimate bearing force and stress from recorded drops", _HERE + "estimate"),
        Verb("watch", "Watch a folder: estimate and log every record that arrives", _HERE + "watch"),
        Verb("calibrate", "Calibrate a machine on several recorded drops", _HERE + "estimate"),
    ),
    "Judge": (
        Verb("restart", "Show what is known before a machine runs again", _HERE + "restart"),
        Verb("compare", "Compare drops: which was worst, and how sure that is", _HERE + "compare"),
        Verb("log", "Keep the log of a machine's drops and what they are allowed", _HERE + "log"),
        Verb("study run", "Compute many drops and show how they are spread", _HERE + "study"),
        Verb("study show", "Show what is there of a study", _HERE + "study"),
        Verb("study repeat", "See what else could have happened at a recorded drop", _HERE + "study"),
    ),
    "Simulate": (
        Verb("simulate", "Simulate a drop and show forces, stresses and contacts", _HERE + "simulate"),
        Verb("coast-down", "Simulate a whole coast-down, from power-off to standstill", _HERE + "simulate"),
        Verb("critical-speeds", "Show critical speeds and damped modes against the speed", _HERE + "rotor"),
    ),
    "Serve": (
        Verb("serve", "Serve a local page: look at drops, estimate, read reports", _HERE + "computer"),
        Verb("doctor", "Say what is installed, missing and cached", _HERE + "computer"),
    ),
}
"""The verbs by what one wants to do, as the help page shows them."""

# Typer carries its own copy of click in new versions and uses the installed one in old versions.
_CallError: type[Exception] = next(c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException")


class VerbTable(TyperGroup):
    """Group of commands that lists its verbs without importing them."""

    program: ClassVar[str] = "rotordrop"
    groups: ClassVar[Mapping[str, tuple[Verb, ...]]] = VERBS

    @classmethod
    def verbs(cls) -> dict[str, Verb]:
        """Every verb by name, in the order of the work."""
        return {verb.name: verb for group in cls.groups.values() for verb in group}

    def list_commands(self, ctx: Any) -> list[str]:
        """Name the verbs."""
        return list(self.verbs())

    def get_command(self, ctx: Any, cmd_name: str) -> TyperCommand | None:
        """Give a light stand-in with the one-line description, enough for the help page."""
        verb = self.verbs().get(cmd_name)
        return None if verb is None else TyperCommand(cmd_name, short_help=verb.line, rich_markup_mode=None)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Load the verb that was called."""
        known = self.verbs()
        for words in (2, 1):
            name = " ".join(args[:words])
            if name in known:
                return name, known[name].load(), args[words:]
        family = [verb for name, verb in known.items() if args[:1] == name.split()[:-1]]
        if family and args[1:2] in ([], ["-h"], ["--help"]):
            for verb in family:
                typer.echo(f"{self.program} {verb.name}: {verb.line}")
            raise typer.Exit
        wrong = " ".join(args[: 2 if family else 1])
        close = get_close_matches(wrong, known, 1) or ["--help"]
        raise UsageError(f"there is no command {wrong!r}; try '{self.program} {close[0]}'")

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the verbs under what one wants to do."""
        for title, verbs in self.groups.items():
            with formatter.section(title):
                formatter.write_dl([(verb.name, verb.line) for verb in verbs], col_max=20)


CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 100}
app = typer.Typer(cls=VerbTable, add_completion=False, rich_markup_mode=None, context_settings=CONTEXT)


def show_version(wanted: bool) -> None:
    """Print the version and stop."""
    if wanted:
        typer.echo(f"rotordrop {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=False)
def rotordrop(
    version: bool = typer.Option(
        False, "--version", is_eager=True, callback=show_version, help="Print the version and stop."
    ),
) -> None:
    """From a recorded rotor drop to touchdown-bearing force and stress.

    Begin with 'rotordrop init --example lp400', then look, check, estimate; each has a --help.
    """


def run(arguments: Sequence[str], program: typer.Typer = app, name: str = "rotordrop") -> int:
    """Run one command of a program and give its exit code; errors become one sentence on standard error."""

    def fail(message: str, code: int) -> int:
        typer.echo(f"{name}: {printable(message)}", err=True)
        return code

    try:
        command = typer.main.get_command(program)
        opened = command.make_context(name, list(arguments) or ["--help"])
        with speaking_of_options(), opened as context:
            command.invoke(context)
        sys.stdout.flush()
        return 0
    except typer.Exit as stop:
        return stop.exit_code
    except RotordropError as error:
        code = fail(str(error), error.exit_code)
        return code if not _likeliest_wanted(error) else run([*arguments, "--map", "likely"], program, name)
    except _CallError as error:
        called: Any = getattr(error, "ctx", None)
        path = called.command_path if called else name
        text = error.format_message()  # type: ignore[attr-defined]
        return fail(f"{text}\nSee '{path} --help'.", UsageError.exit_code)
    except (KeyboardInterrupt, typer.Abort):
        return fail(STOPPED, INTERRUPTED)
    except BrokenPipeError:
        _discard_standard_output()
        return BROKEN_PIPE
    except MemoryError:
        return fail("there is not enough memory for this; free some, or give a shorter record", 1)
    except OSError as error:
        if error.errno in _NO_ROOM and error.filename is None:
            _discard_standard_output()
            return fail(f"cannot write the output: {error.strerror}", OutputError.exit_code)
        place = error.filename or "the current folder"
        return fail(f"{place}: {error.strerror or error}", OutputError.exit_code)


def _likeliest_wanted(error: RotordropError) -> bool:
    """Whether somebody at a terminal takes the likeliest channels where no names tell."""
    if not (isinstance(error, UnmatchedError) and "likeliest" in error.remedy and sys.stdin.isatty()):
        return False
    try:
        return typer.confirm("Use the likeliest?", default=True, err=True)
    except typer.Abort:  # nobody answers
        typer.echo(err=True)
        return False


def _discard_standard_output() -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class _ToStandardError(logging.Handler):
    """Writes above a progress bar, which replaces the stream."""

    def emit(self, record: logging.LogRecord) -> None:
        with suppress(OSError, ValueError):  # whoever read it has gone
            print(printable(record.getMessage()), file=sys.stderr)


def _print_log() -> None:
    """Show on standard error what the package logs, such as that kernels are compiled."""
    log = logging.getLogger("rotordrop")
    log.addHandler(_ToStandardError())
    log.setLevel(logging.INFO)


def main(program: typer.Typer = app, name: str = "rotordrop") -> None:
    """Entry point of the command ``rotordrop``, or of another program with verbs of its own."""
    if sys.platform == "linux":  # else glibc keeps what a fit once needed
        with suppress(AttributeError):  # another C library
            for option, value in ((_MMAP_THRESHOLD, 1 << 24), (_TRIM_THRESHOLD, 1 << 26), (_ARENA_MAX, 1)):
                ctypes.CDLL(None).mallopt(option, value)
    for variable, number in ENVIRONMENT.items():
        os.environ.setdefault(variable, number)
    open_streams()
    _print_log()
    # a search that steps where its model has no value comes back by itself
    warnings.filterwarnings("ignore", category=RuntimeWarning, module=r"scipy\.optimize")
    with interruptions_kept() as was_pressed:
        try:
            code = run(sys.argv[1:], program, name)
        except Exception:
            if not was_pressed():  # the compiler turns an interrupt into an error of its own
                raise
            typer.echo(f"{name}: {STOPPED}", err=True)
            code = INTERRUPTED
        if code == INTERRUPTED:
            # Python remembers a KeyboardInterrupt that passed through an exec, as in imports that build
            # classes, and then kills itself with SIGINT although it was caught: what is registered for the
            # end runs here.
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            atexit._run_exitfuncs()
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(INTERRUPTED)
    sys.exit(code)
