"""The verbs init, check and doctor: right files, none that overwrite another, numbers, what is here."""

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

from rotordrop.cli import computer
from rotordrop.cli.app import run
from rotordrop.machine import example_machine, example_path, load_machine
from rotordrop.machine.schema import machine_schema

PAPER = str(example_path("paper"))
ROOT = Path(__file__).parents[3]
MAKING = ("docs", "dev")


@pytest.fixture(autouse=True)
def in_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_the_template_is_a_commented_machine_that_passes_the_check(capsys):
    assert run(["init"]) == 0
    assert capsys.readouterr().err == "written: machine.toml\n"
    assert load_machine("machine.toml").touchdown_bearings
    assert run(["check", "machine.toml"]) == 0
    assert sum("#" in line for line in Path("machine.toml").read_text(encoding="utf-8").splitlines()) > 30


def test_nothing_is_overwritten_unasked(capsys):
    Path("machine.toml").write_text("mine")
    assert run(["init"]) == 6
    assert "machine.toml exists already; name another file or add --force" in capsys.readouterr().err
    assert Path("machine.toml").read_text() == "mine"
    assert run(["init", "--force"]) == 0
    assert load_machine("machine.toml")


@pytest.mark.parametrize("name", ["paper", "lp400"])
def test_an_example_is_copied_whole(name):
    assert run(["init", "--example", name, "there"]) == 0
    assert load_machine("there/machine.toml") == example_machine(name)


def test_the_schema_goes_to_the_screen_or_to_a_file(capsys):
    assert run(["init", "--schema", "machine"]) == 0
    assert json.loads(capsys.readouterr().out) == machine_schema()
    assert run(["init", "--schema", "machine", "machine.schema.json"]) == 0
    assert json.loads(Path("machine.schema.json").read_text()) == machine_schema()
    assert machine_schema()["title"] == "rotordrop machine file"


def test_the_schema_of_an_estimate_knows_its_fields(capsys):
    assert run(["init", "--schema", "estimate"]) == 0
    schema = json.loads(capsys.readouterr().out)
    jsonschema.Draft202012Validator.check_schema(schema)
    value = {"value": 2907.0}
    bearing = {"$defs": schema["$defs"], **schema["$defs"]["Bearing"]["properties"]["peak_force_N"]}
    jsonschema.validate(value | {"time_s": 0.009, "interval_90": [2800.0, 3000.0]}, bearing)
    for broken in (2907.0, {"peek": 2907.0}, value | {"time_s": "now"}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(broken, bearing)
    for part in ("Drop", "Bearing"):
        assert schema["$defs"][part]["additionalProperties"] is False


def test_the_summary_names_the_numbers(tmp_path, capsys):
    files = [tmp_path / "m.json", tmp_path / "m.html"]
    assert run(["check", PAPER, "--all", "--json", str(files[0]), "--report", str(files[1])]) == 0
    text = capsys.readouterr().out
    for expected in ("59.50 kg", "621.3 mm", "0.08752 kg m²", "187.3", "134.0", "mode 1 [Hz]", "174.6 N"):
        assert expected in text
    assert json.loads(files[0].read_text())["machine"] == example_machine("paper").name
    assert "touchdown bearing" in files[1].read_text() and "59.50" in files[1].read_text()
    assert run(["check", PAPER]) == 0
    first = capsys.readouterr().out
    assert "free-free 187.3, 483, 877 Hz; on massless supports " in first and first.count("\n") <= 18


def test_json_on_standard_output_is_json_and_nothing_else(capsys):
    assert run(["check", PAPER, "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["mass_kg"] == pytest.approx(59.49996, rel=1e-6)
    assert found["bearings"]["DE"]["load_N"] == pytest.approx(409.08, rel=1e-4)
    assert len(found["levitated_sag_m"]) == 36
    assert found["defaults"]


def test_it_names_what_is_installed(capsys):
    assert run(["doctor", "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["packages"]["numpy"]
    assert all(found["packages"].values())
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = {name: needs for name, needs in stated["optional-dependencies"].items() if name not in MAKING}
    told = {name: sorted(one["packages"]) for name, one in found["extras"].items()}
    assert told == {
        name: sorted(computer.bare(text).lower() for text in needs) for name, needs in extras.items()
    }


def test_requirements_lose_their_versions():
    texts = ("npTDMS>=1.9", "tree-sitter-toml>=0.7", "psycopg[binary]>=3.1")
    assert [*map(computer.bare, texts)] == ["npTDMS", "tree-sitter-toml", "psycopg"]
