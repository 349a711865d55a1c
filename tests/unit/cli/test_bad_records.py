"""Records that cannot be used: each is told with value, expectation and way out, and leaves no file."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rotordrop import example_record_path, read_record
from rotordrop.cli.app import INTERRUPTED, run
from rotordrop.machine import example_machine, example_path

LP400 = str(example_path("lp400"))


def not_a_number(record):
    signals = record.signals.copy()
    signals[2200:2300, 2] = np.nan
    return replace(record, signals=signals)


FAULTS = {
    "NaN": (
        not_a_number,
        r"cannot be used: missing samples S_DE_A at 0\.01 s: 100 of 3001 samples are NaN.*export the",
    ),
    "unit": (
        lambda record: replace(record, signals=1e3 * record.signals),
        r"cannot be used: wrong unit factor S_NDE_A.*span .* × the air gap of 250 µm in lp400\.toml, a drop "
        r"1 to 2\.5 ×; a unit factor of 1.* or its air_gap",
    ),
    "no speed": (
        lambda record: replace(record, speed=None),
        r'speed missing: the record has no shaft speed beside S_NDE_A.*\[speed\] constant = "60 Hz"',
    ),
}


@pytest.mark.parametrize(("change", "message"), FAULTS.values(), ids=FAULTS)
def test_a_faulty_record_is_refused_by_name_and_leaves_no_file(change, message, tmp_path, capsys):
    """What else the gate finds: ``evidence/test_gate``; what readers refuse: ``record``."""
    whole = read_record(example_record_path("lp400_drop_060"), example_machine("lp400"))
    record, file = change(whole.window(-0.1, 0.05)), tmp_path / "record.csv"
    names = ["time [s]", *(f"{name} [um]" for name in record.channel_names)]
    columns = [record.time, *(record.signals.T * 1e6)]
    if record.speed is not None:
        names, columns = [*names, "speed [Hz]"], [*columns, record.speed / (2.0 * np.pi)]
    np.savetxt(file, np.column_stack(columns), "%.6f", ",", header=",".join(names), comments="")
    outputs = ["--json", str(tmp_path / "out.json"), "--report", str(tmp_path / "out.html")]
    assert run(["estimate", LP400, str(file), *outputs]) == 3
    told = capsys.readouterr()
    assert told.out == "" and list(tmp_path.iterdir()) == [file]
    assert re.search(message, " ".join(told.err.split()).removeprefix("rotordrop: record ")), told.err


@pytest.mark.parametrize(
    ("option", "file"), [("--json", "drop.json"), ("--report", "drop.html"), ("-o", "drop.h5")]
)
def test_ctrl_c_while_a_file_is_written_leaves_the_earlier_one(option, file, tmp_path, monkeypatch, capsys):
    """The key is pressed when the temporary file is complete and not yet in its place."""

    def pressed(self, target):
        assert self.stat().st_size > 100
        raise KeyboardInterrupt

    (tmp_path / file).write_text("earlier")
    monkeypatch.setattr(Path, "replace", pressed)
    arguments = ["simulate", LP400, "--speed", "60 Hz", "--duration", "2 ms", "--reduction", "quick"]
    assert run([*arguments, option, str(tmp_path / file)]) == INTERRUPTED
    assert "stopped; nothing was left half written" in " ".join(capsys.readouterr().err.split())
    assert [(found.name, found.read_text()) for found in tmp_path.iterdir()] == [(file, "earlier")]
