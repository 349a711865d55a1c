"""What README, Makefile and documentation promise exists: files, verbs, options, public names."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

import rotordrop
from rotordrop.cli.app import VerbTable, run

ROOT = Path(__file__).resolve().parents[2]
VERBS = VerbTable.verbs()
TEXTS = [ROOT / "README.md", ROOT / "Makefile", *sorted((ROOT / "docs").glob("*.md"))]
TEXTS += sorted((ROOT / "src" / "rotordrop").rglob("*.md"))
COMMAND = re.compile(r"^(?:\s*@\$\(BIN\)/)?rotordrop ((?:study )?[a-z-]+)((?:.*\\\n)*.*)$", re.MULTILINE)


def _commands():
    """Give every command line of the texts: file, verb, options."""
    found = []
    for file in TEXTS:
        for match in COMMAND.finditer(file.read_text(encoding="utf-8")):
            verb, rest = match.group(1), match.group(2).split("  #")[0]
            options = re.findall(r"(?<=\s)(--?[a-z][a-z-]*)", rest)
            found.append((file.name, verb, options))
    return found


COMMANDS = _commands()


def test_the_texts_show_commands():
    assert {"init", "check", "simulate", "estimate"} <= {verb for _, verb, _ in COMMANDS}
    assert ("Makefile", "estimate", ["--tail", "--json", "--report"]) in COMMANDS


@pytest.mark.parametrize(("file", "verb", "options"), COMMANDS)
def test_every_command_shown_exists_with_its_options(file, verb, options):
    assert verb in VERBS, f"{file} shows 'rotordrop {verb}'"
    known = {name for parameter in VERBS[verb].load().params for name in parameter.opts}
    assert set(options) <= known, f"{file} shows 'rotordrop {verb}' with options it does not have"


def test_the_help_of_every_verb_ends_with_an_example_that_has_its_options():
    for verb, row in VERBS.items():
        command = row.load()
        line = str(command.epilog).removeprefix("Example: ")
        assert line.startswith(f"rotordrop {verb}")
        known = {name for parameter in command.params for name in parameter.opts}
        options = set(re.findall(r"(?<=\s)(--?[a-z][a-z-]*)", line))
        assert options <= known or verb == "log", line


def test_the_files_of_the_demo_exist_and_make_lists_its_commands():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    variables = dict(re.findall(r"^([A-Z]+) :?= (\S+)$", makefile, re.MULTILINE))
    demo = makefile.split("\ndemo:")[1].split("\n\n")[0]
    for name in re.findall(r"\$\((MACHINE|RECORDS)\)(\S*)", demo):
        assert (ROOT / (variables[name[0]] + name[1])).is_file(), name
    done = subprocess.run(["make", "-C", str(ROOT), "-s", "help"], capture_output=True, text=True, check=True)
    listed = re.findall(r"^make (\w+) - \w+", done.stdout, re.MULTILINE)
    assert listed[:2] == ["help", "demo"]
    assert {"test", "lint", "docs", "lock", "clean"} <= set(listed)


def test_every_link_leads_somewhere_and_what_the_readme_imports_is_public():
    for file in TEXTS:
        for target in re.findall(r"\]\((?!https?://|#)([^)#\s]+)", file.read_text(encoding="utf-8")):
            if not target.startswith("generated/"):
                assert (file.parent / target).exists(), f"{file.name} links to {target}"
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert blocks
    for names in re.findall(r"from rotordrop import ([^\n]+)", "\n".join(blocks)):
        assert {name.strip() for name in names.split(",")} <= set(rotordrop.__all__)


def test_the_commands_of_the_readme_name_files_that_are_there_by_then(tmp_path, monkeypatch):
    """They named files that nobody had written, such as drop3.json."""
    monkeypatch.chdir(tmp_path)
    assert run(["init", "--example", "lp400"]) == 0
    written = {file.name for file in Path("lp400").iterdir()}
    listed = re.findall(r"^\| `(\S+)`", Path("lp400/README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert written == {*listed, "README.md"}
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    block = next(one for one in re.findall(r"```console\n(.*?)```", text, re.DOTALL) if "lp400" in one)
    for line in block.splitlines():
        words = line.split("#")[0].split()
        outputs = {words[k + 1] for k, word in enumerate(words) if word in ("--report", "--json")}
        named = {word for word in words if re.fullmatch(r"\w+\.(toml|csv|h5|json|html)", word)}
        assert named - outputs <= written, line
        written |= outputs
    assert {"drop.html", "drop.json"} <= written


def test_bundled_recordings_are_called_simulated_everywhere():
    for name in ("README.md", "src/rotordrop/examples/lp400/README.md", "docs/getting_started.md"):
        assert re.search("simulated|by simulation", (ROOT / name).read_text(encoding="utf-8"))
    assert "The recording is simulated" in (ROOT / "Makefile").read_text(encoding="utf-8")


def test_an_old_python_is_refused_with_the_way_out(tmp_path):
    """A folder with an old python3 first on the path, and no newer one beside."""
    (tmp_path / "python3").write_text("#!/bin/sh\n[ \"$1\" = -V ] && echo 'Python 3.9.2' && exit 0\nexit 1\n")
    (tmp_path / "python3").chmod(0o755)
    clone = tmp_path / "clone"
    (clone / "bench").mkdir(parents=True)
    for name in ("Makefile", "requirements.lock", "pyproject.toml", "bench/pyproject.toml"):
        (clone / name).write_bytes((ROOT / name).read_bytes())
    make = shutil.which("make")
    assert make is not None
    told = {"capture_output": True, "text": True, "env": {"PATH": str(tmp_path)}}
    done = subprocess.run([make, "-s", "test", "SHELL=/bin/sh"], cwd=clone, **told)
    assert done.returncode != 0
    assert "rotordrop needs Python 3.11 or newer, and the python3 found here is Python 3.9.2" in done.stderr
    assert "make PYTHON=/path/to/python3" in done.stderr
    assert not (clone / ".venv").exists()
