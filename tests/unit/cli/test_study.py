"""The verb ``study``: run, help, show."""

import json

import pytest

from rotordrop import example_machine, save_machine
from rotordrop.cli.app import run


@pytest.fixture(scope="module")
def study_file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    save_machine(example_machine("lp400"), folder / "machine.toml")
    file = folder / "speeds.toml"
    file.write_text(
        'machine = "machine.toml"\ndrops = 12\nshard = 5\nduration = "10 ms"\nreduction = "quick"\n'
        'vary.speed = {uniform = ["60 Hz", "200 Hz"]}\n'
    )
    return file


def test_a_study_runs_shows_and_helps(study_file, tmp_path, capsys):
    numbers, page, drops, again = (tmp_path / name for name in ("s.json", "s.html", "s.h5", "again.json"))
    call = ["study", "run", str(study_file), "--by", "speed", "--threads", "1"]
    assert run([*call, "--json", str(numbers), "--report", str(page), "--output", str(drops)]) == 0
    content = json.loads(numbers.read_text())
    assert content["drops"] == 12
    assert content["maps"]["speed"]["NDE.peak_force"][0]["from"] >= 60 * 6.283
    median = content["quantiles"]["NDE.peak_force"]["0.5"]
    low, high = median["interval_90"]
    assert 1000.0 < low < median["value"] < high < 6000.0
    folder = study_file.with_suffix("")
    before = (folder / "shards" / "000000.npy").read_bytes()
    assert run(["study", "run", str(folder), "--by", "speed", "--json", str(again)]) == 0
    assert json.loads(again.read_text()) == content
    assert (folder / "shards" / "000000.npy").read_bytes() == before
    assert run(["study", "show", str(folder)]) == 0
    assert run([*call[:3], "--by", "spead"]) == 64
    assert "did you mean 'speed'" in capsys.readouterr().err
