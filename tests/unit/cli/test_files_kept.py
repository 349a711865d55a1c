"""No command writes over what it reads, or twice to one place; any terminal can be printed to."""

import os
import shutil
import subprocess
import sys
from importlib import import_module
from inspect import signature
from pathlib import Path
from typing import get_args

import pytest

from rotordrop import save_machine
from rotordrop.cli import app
from rotordrop.cli._output import FILLED, OUTPUTS
from rotordrop.cli._terminal import printable
from rotordrop.cli.app import run
from rotordrop.errors import UsageError
from rotordrop.machine import example_machine, example_path


@pytest.fixture
def machine(tmp_path):
    save_machine(example_machine("small"), tmp_path / "m.toml")
    return tmp_path / "m.toml"


def linked(file, how):
    how(file)
    return file


WAYS = {
    "same name": lambda machine: machine,
    "other spelling": lambda machine: machine.parent / "." / ".." / machine.parent.name / machine.name,
    "link": lambda machine: linked(machine.parent / "link.json", lambda new: new.symlink_to(machine)),
    "hard link": lambda machine: linked(machine.parent / "hard.json", lambda new: os.link(machine, new)),
}


@pytest.mark.parametrize("option", ["--json", "--report"])
@pytest.mark.parametrize("way", WAYS)
def test_an_input_is_never_replaced(machine, option, way, capsys):
    before = machine.read_bytes()
    assert run(["check", str(machine), option, str(WAYS[way](machine))]) == UsageError.exit_code
    assert "is read by this command and would be replaced; name another" in _told(capsys)
    assert machine.read_bytes() == before


def test_the_shaft_table_of_a_machine_is_an_input_too(tmp_path, capsys):
    lp400 = example_path("lp400")
    for file in lp400.parent.glob("lp400*"):
        shutil.copy(file, tmp_path)
    (table,) = tmp_path.glob("*.csv")
    before = table.read_bytes()
    assert run(["check", str(tmp_path / lp400.name), "--json", str(table)]) == UsageError.exit_code
    assert f"{table.name} is read by this command" in _told(capsys)
    assert table.read_bytes() == before


def test_two_outputs_need_two_files(machine, capsys):
    both = str(machine.parent / "o.x")
    assert run(["check", str(machine), "--json", both, "--report", both]) == UsageError.exit_code
    assert "are one file; give each output its own" in _told(capsys)
    assert run(["check", str(machine), "--json", os.devnull, "--report", os.devnull]) == 0


@pytest.mark.parametrize("verb", app.VerbTable.verbs().values(), ids=lambda verb: verb.name)
def test_every_path_of_every_command_is_known_as_read_or_written(verb):
    function = getattr(import_module(verb.module), verb.name.replace("-", "_").replace(" ", "_"))
    for name, parameter in signature(function, eval_str=True).parameters.items():
        written = str(parameter.default) + str(parameter.annotation)
        if "Path" in str(get_args(parameter.annotation)[:1]) and "rite" in written:
            assert name in (*OUTPUTS, *FILLED), f"{verb.name} writes {name}: is it kept apart?"


def _call(verb, option, place):
    """A call of a verb with one output; what else it asks for is no file that is there."""
    words = []
    for parameter in verb.load().params:
        if parameter.required and parameter.name != option:
            named = [parameter.opts[0]] if parameter.param_type_name == "option" else []
            words += [*named, SAMPLES.get(parameter.metavar, "nothing.toml")]
        if parameter.name == option:
            words += [parameter.opts[0], place] if parameter.param_type_name == "option" else [place]
    return [*verb.name.split(), *words]


SAMPLES = {"ACTION": "show", "SPEED": "60 Hz", "COLUMN": "NDE.peak_force", "LIMIT": "12 kN"}
WRITTEN = [
    pytest.param(verb, name, id=f"{verb.name} {name}")
    for verb in app.VerbTable.verbs().values()
    for name in (parameter.name for parameter in verb.load().params)
    if name in OUTPUTS
]


PLACES = {
    "missing": ("{}/none/o.json", "does not exist; create it first"),
    "deleted": ("o.json", "the folder you are in has been deleted"),
    "deleted, by its name": ("{}/o.json", "does not exist; create it first"),
    "read-only": ("{}/o.json", "is read-only; choose another"),
    "a folder": ("{}", "it is a folder; name a file in it"),
    "a long name": ("{}/" + "x" * 300, "File name too long; choose another place"),
}


@pytest.mark.parametrize(("verb", "option"), WRITTEN)
@pytest.mark.parametrize("place", PLACES)
def test_a_place_that_takes_no_file_is_said_before_anything_is_read(
    verb, option, place, tmp_path, monkeypatch, capsys
):
    folder, (file, words) = tmp_path / "place", PLACES[place]
    folder.mkdir()
    if place.startswith("deleted"):
        monkeypatch.chdir(folder)
        folder.rmdir()
    if place == "read-only":
        monkeypatch.setattr(os, "access", lambda path, mode: False)
    try:
        assert run(_call(verb, option, file.format(folder))) == 6
    finally:
        monkeypatch.undo()
    assert words in _told(capsys)


@pytest.mark.parametrize(
    "call",
    [
        "log show {long}",
        "study run {long}",
        "check {long}.toml",
        "init {long}.toml --simple",
        "watch {long} --machines {long} --once",
        "log allow l.db --machine M --drops 3 --source s",
    ],
)
def test_a_name_that_is_too_long_and_a_folder_that_is_gone_are_a_sentence(
    call, tmp_path, monkeypatch, capsys
):
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    if "{long}" not in call:
        gone.rmdir()
    assert run(call.format(long="x" * 300).split()) not in (0, 1)
    assert "Traceback" not in _told(capsys)


def called(machine, *arguments, encoding="utf-8", stdout=subprocess.PIPE):
    return subprocess.run(
        [sys.executable, "-m", "rotordrop", "check", str(machine), *arguments],
        stdout=stdout,
        stderr=subprocess.PIPE,
        check=False,
        env=os.environ | {"PYTHONIOENCODING": encoding},
    )


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-8"])
@pytest.mark.parametrize("arguments", [[], ["--json", "-"]])
def test_any_encoding_of_the_terminal_will_do(machine, encoding, arguments):
    done = called(machine, *arguments, encoding=encoding)
    assert done.returncode == 0, done.stderr
    assert b"Traceback" not in done.stderr
    assert len(done.stdout) > 500


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_standard_output_is_a_sentence(machine):
    with open("/dev/full", "w") as full:
        done = called(machine, stdout=full)
    assert done.returncode == 6
    assert done.stderr.decode() == "rotordrop: cannot write the output: No space left on device\n"


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="a shell closes the streams")
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&- <&-"])
def test_closed_streams_do_no_harm(machine, closed):
    out = machine.parent / "out.json"
    line = f"exec '{sys.executable}' -m rotordrop check '{machine}' --json '{out}' {closed}"
    done = subprocess.run(["sh", "-c", line], capture_output=True, check=False, env=os.environ)
    assert done.returncode == 0
    assert b"Traceback" not in done.stderr
    assert out.stat().st_size > 500


def test_a_name_from_a_file_cannot_command_the_terminal(tmp_path, capsys):
    bad = "\x1b]0;owned\x07 \x1b[31m \u202e"
    (tmp_path / "m.toml").write_text(f'name = "x"\n"{bad}" = 1\n', encoding="utf-8")
    shown = printable(bad)
    assert not set("\x1b\x07\u202e") & set(shown)
    assert run(["check", str(tmp_path / f"{bad}.toml")]) == 2
    assert "\x1b" not in _told(capsys)


def _told(capsys):
    return " ".join(capsys.readouterr().err.split())
