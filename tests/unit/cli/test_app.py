"""The command line: help without imports, stable exit codes, sentences instead of tracebacks."""

import os
import signal
import subprocess
import sys
import time

import pytest

import rotordrop
from rotordrop import errors
from rotordrop.cli import app as command_line

VERBS = command_line.VerbTable.verbs()


def call(*arguments, **environment):
    return subprocess.run(
        [sys.executable, "-m", "rotordrop", *arguments],
        capture_output=True,
        text=True,
        env=os.environ | environment,
        timeout=600,
    )


def test_help_lists_every_verb_with_its_line():
    done = call("--help")
    assert done.returncode == 0
    for name, verb in VERBS.items():
        assert f"  {name}" in done.stdout and verb.line.split()[0] in done.stdout
    assert call().stdout == done.stdout
    assert call("--version").stdout == f"rotordrop {rotordrop.__version__}\n"


@pytest.mark.parametrize("verb", VERBS)
def test_each_verb_has_help_and_a_line_that_fits(verb):
    command = VERBS[verb].load()
    assert command.name == verb
    assert command.help, "the function of the verb needs a docstring"
    assert 10 < len(VERBS[verb].line) <= 60, "one line of the help page"
    for parameter in command.params:
        if parameter.name != "help":
            assert getattr(parameter, "help", None), f"{verb}: {parameter.name} has no help text"
    options = [name for parameter in command.params for name in parameter.opts]
    assert "--json" in options or verb in {"init", "profile", "serve", "watch"}, "it computes nothing"


@pytest.fixture
def verb_folder(tmp_path, monkeypatch):
    """Let the command line have verbs whose modules lie in a folder of the test."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(command_line.VerbTable, "groups", {"Try": ()})
    yield tmp_path
    for name in [name for name in sys.modules if name.startswith("try_")]:
        del sys.modules[name]


def write_verb(folder, name, body):
    (folder / f"{name}.py").write_text("from rotordrop import errors\n" + body)
    command_line.VerbTable.groups = {"Try": (command_line.Verb(name.replace("_", "-"), "Try it out", name),)}


ERRORS = ("MachineFile", "Record", "Identification", "Simulation", "Output", "Usage", "DamagedFile")


@pytest.mark.parametrize("error", ERRORS)
def test_each_error_becomes_its_exit_code_and_one_line(verb_folder, capsys, error):
    raises = f"def try_it() -> None:\n    'Try.'\n    raise errors.{error}Error('the gap is -3 µm')\n"
    write_verb(verb_folder, "try_it", raises)
    assert command_line.run(["try-it"]) == getattr(errors, f"{error}Error").exit_code
    assert capsys.readouterr() == ("", "rotordrop: the gap is -3 µm\n")


def test_an_error_of_ours_is_not_hidden(verb_folder):
    write_verb(verb_folder, "try_bug", "def try_bug() -> None:\n    'Try.'\n    1 / 0\n")
    with pytest.raises(ZeroDivisionError):
        command_line.run(["try-bug"])


def test_a_missing_argument_is_a_wrong_call(verb_folder, capsys):
    write_verb(verb_folder, "try_gap", "def try_gap(gap: str) -> None:\n    'Try.'\n")
    assert command_line.run(["try-gap"]) == 64
    assert "Missing argument" in (message := capsys.readouterr().err)
    assert "See 'rotordrop try-gap --help'." in message


def test_the_help_page_does_not_import_the_verbs(verb_folder, capsys):
    write_verb(verb_folder, "try_heavy", "raise RuntimeError('was imported')\n")
    assert command_line.run(["--help"]) == 0
    assert "try-heavy  Try it out" in capsys.readouterr().out


@pytest.mark.parametrize(
    "environment", [{}, {"FORCE_COLOR": "1"}, {"NO_COLOR": "1"}, {"GITHUB_ACTIONS": "true"}]
)
def test_no_escape_sequences_where_there_is_no_terminal(environment):
    done = call("--help", **environment)
    assert "\x1b" not in done.stdout + done.stderr


COMMAND = """
import ctypes, os, signal, sys
class Interrupted:
    def find_spec(self, name, *rest):
        if name == 'typer':
            raise KeyboardInterrupt
def stop():
    os.kill(os.getpid(), signal.SIGINT)
def verb(of):
    {verb}
{loading}
from rotordrop.cli import app
app.Verb.load = verb
sys.argv = ['rotordrop', 'simulate']
from rotordrop.__main__ import main
main()
"""
IGNORED = "ctypes.CFUNCTYPE(None)(stop)()"


@pytest.mark.skipif(os.name != "posix", reason="signals as on POSIX")
@pytest.mark.parametrize(
    ("verb", "loading"),
    [
        ("stop()", ""),
        ("exec('raise KeyboardInterrupt', {})", ""),
        ("exec('try: stop()\\nfinally: raise RuntimeError', globals())", ""),
        pytest.param(f"{IGNORED}; raise RuntimeError", "", marks=pytest.mark.slow),
        pytest.param(f"{IGNORED}\n    while True: pass", "", marks=pytest.mark.slow),
        ("pass", "sys.meta_path.insert(0, Interrupted())\nimport rotordrop.__main__ as m; m.main()"),
    ],
    ids=["plain", "generated", "caught", "foreign, then a fault", "foreign, then goes on", "while loading"],
)
def test_ctrl_c_ends_with_130_wherever_it_comes(verb, loading):
    """Python kills itself with SIGINT after one inside an exec; foreign code, as the compiler, ignores it."""
    program = COMMAND.format(verb=verb, loading=loading)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=600)
    assert (done.returncode, done.stderr) == (130, "rotordrop: stopped; nothing was left half written\n")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals as on POSIX")
@pytest.mark.parametrize("seconds", [0.5, 3.0, 6.0])
def test_ctrl_c_while_a_cold_cache_is_compiled_ends_with_130(tmp_path, seconds):
    machine = str(tmp_path / "machine.toml")
    assert command_line.run(["init", machine]) == 0
    output = tmp_path / "drop.h5"
    process = subprocess.Popen(
        [sys.executable, "-m", "rotordrop", "simulate", machine, "--speed=60 Hz", "--output", str(output)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "NUMBA_DISABLE_JIT": "0"},
    )
    while not (tmp_path / "cache").exists():  # busy computers take their time to begin
        assert process.poll() is None
        time.sleep(0.02)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(timeout=seconds)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=600)
    assert (process.returncode, out) == (130, "")
    assert err.strip().splitlines()[-1] == "rotordrop: stopped; nothing was left half written"
    assert "Traceback" not in err
    assert [path.name for path in tmp_path.iterdir() if path.suffix != ".toml"] == ["cache"]
