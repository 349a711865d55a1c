"""The verb ``log``: add, show, allow, export, remove."""

import csv
import io
import json
from pathlib import Path

import pytest
from tests.published import bearing, published, value

from rotordrop.cli.app import run


@pytest.fixture
def estimate(tmp_path):
    peaks = {"peak_force_N": value(3300.0, 3200.0, 3400.0), "peak_stress_Pa": value(1.5e9)}
    both = {"NDE": bearing(peaks), "DE": bearing(peaks)}
    document = published(machine="LP-400", record_sha256="c" * 64, bearings=both)
    file = tmp_path / "estimate.json"
    file.write_text(json.dumps(document.as_json()))
    return str(file)


def test_a_log_from_the_command_line(tmp_path, estimate, capsys):
    log, numbers = str(tmp_path / "drops.db"), tmp_path / "log.json"
    call = ["log", "add", log, estimate, "--bearings", "2026", "--recorded", "2026-03-14", "--duration"]
    assert run([*call, "51.6 s", "--cause", "converter fault"]) == 0
    allowed = ["--machine", "LP-400", "--bearings", "2026", "--drops", "10", "--source", "contract 17"]
    assert run(["log", "allow", log, *allowed, "--json", str(numbers)]) == 0
    content = json.loads(numbers.read_text())
    assert (content["used"][0]["drops"], content["drops"]["1"]["duration"]) == (1, 51.6)
    capsys.readouterr()
    assert run(["log", "export", log]) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert [(row["bearing"], row["lower"], row["upper"]) for row in rows] == [
        ("DE", "3200.0", "3400.0"),
        ("NDE", "3200.0", "3400.0"),
    ]
    table = tmp_path / "drops.csv"
    assert run(["log", "export", log, str(table)]) == 0
    assert list(csv.DictReader(table.open())) == rows
    assert run(["log", "remove", log, "1"]) == 0


def test_a_drop_is_dated_by_its_recorder_unless_somebody_says_otherwise(tmp_path, estimate):
    log, file = str(tmp_path / "drops.db"), tmp_path / "dated.json"
    document = json.loads(Path(estimate).read_text())
    file.write_text(json.dumps({**document, "recorded": "2026-03-14T15:09:26Z", "record_sha256": "d" * 64}))
    assert run(["log", "add", log, str(file)]) == 0
    assert run(["log", "add", log, estimate, "--recorded", "2026-03-15"]) == 0
    assert run(["log", "show", log, "--json", str(tmp_path / "log.json")]) == 0
    drops = json.loads((tmp_path / "log.json").read_text())["drops"].values()
    assert [drop["recorded"] for drop in drops] == ["2026-03-14T15:09:26Z", "2026-03-15T00:00:00"]
