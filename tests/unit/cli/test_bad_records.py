"""Records that cannot be used: each is told with value, expectation and way out, and leaves no file."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rotordrop.cli.app import INTERRUPTED, run
from rotordrop.machine import example_machine, example_path
from rotordrop.record.examples import example_record_path
from rotordrop.record.record import Record, read_record

LP400 = str(example_path("lp400"))


@pytest.fixture(scope="module")
def drop() -> Record:
    """The bundled drop from 0.1 s before to 0.05 s after power-off."""
    whole = read_record(example_record_path("lp400_drop_060"), example_machine("lp400"))
    return whole.window(-0.1, 0.05)


def written(record: Record, path: Path, *, speed: bool = True) -> list[str]:
    """Write the record as a recorder does; give the lines."""
    names = ["time [s]", *(f"{name} [um]" for name in record.channel_names), *["speed [Hz]"][:speed]]
    columns = [record.time, *(record.signals.T * 1e6), *[record.speed / (2.0 * np.pi)][:speed]]
    lines = [",".join(names), *(",".join(f"{v:.6f}" for v in row) for row in zip(*columns, strict=True))]
    path.write_text("\n".join(lines) + "\n")
    return lines


def not_a_number(record: Record) -> Record:
    signals = record.signals.copy()
    signals[2200, 2] = np.nan
    return replace(record, signals=signals)


def backwards(record: Record) -> Record:
    time = record.time.copy()
    time[500] -= 0.01
    return replace(record, time=time)


def factors(*values: float) -> Callable[[Record], Record]:
    return lambda record: replace(record, signals=record.signals * np.array(values))


FAULTS = {
    "NaN": (not_a_number, r"missing samples S_DE_A at 0\.01 s: 1 of 3001 samples are NaN.*export the recor"),
    "time": (backwards, r"non-monotonic time at -0\.085 s: sample 501 is at -0\.085 s after.*export again"),
    "no drop": (
        lambda record: record.window(-0.1, -0.01),
        r"no drop in the record: the vertical displacement spans 2\d\.?\d* µm.*by more than 35 %.*give a rec",
    ),
    "polarity": (factors(-1, 1, 1, 1), r"inverted polarity S_NDE_A: .* leans 8\d° from .*correct polari"),
    "axes": (
        lambda record: replace(record, signals=record.signals[:, [1, 0, 2, 3]]),
        r"swapped axes S_NDE_A, S_NDE_B: .*orbit at NDE runs against the spin.*correct pol",
    ),
    "unit": (
        factors(1e3, 1e3, 1e3, 1e3),
        r"wrong unit factor S_NDE_A.*span .* × the air gap of 250 µm in lp400\.toml, a drop 1 to 2\.5 ×; "
        r"a unit factor of 1.* or its air_gap",
    ),
    "clipping": (
        lambda record: replace(record, signals=np.clip(record.signals, -150e-6, None)),
        r"clipping S_NDE_A at 0\.00685 s: it stays at its lower limit -150 µm for up to.*widen the input",
    ),
    "dead": (factors(1, 0, 1, 1), r"dead channel S_NDE_B: it moves by 0 m around 0 m while.*check cable"),
}


def refused(folder: Path, record: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """What the command says to a record; the folder is as before."""
    before = sorted(folder.iterdir())
    outputs = ["--json", str(folder / "out.json"), "--report", str(folder / "out.html")]
    assert run(["estimate", LP400, str(record), *outputs]) == 3
    told = capsys.readouterr()
    assert told.out == ""
    assert sorted(folder.iterdir()) == before
    return " ".join(told.err.split())


@pytest.mark.parametrize(("change", "message"), FAULTS.values(), ids=FAULTS)
def test_a_faulty_record_is_refused_by_name(change, message, drop, tmp_path, capsys):
    written(change(drop), tmp_path / "record.csv")
    told = refused(tmp_path, tmp_path / "record.csv", capsys)
    assert told.startswith("rotordrop: record cannot be used")
    assert re.search(message, told), told


def test_a_record_without_speed_says_where_to_give_it(drop, tmp_path, capsys):
    written(drop, tmp_path / "record.csv", speed=False)
    told = refused(tmp_path, tmp_path / "record.csv", capsys)
    assert "speed missing: the record has no shaft speed beside S_NDE_A" in told
    assert '[speed] constant = "60 Hz"' in told


def test_a_row_with_a_column_missing_is_named_by_its_line(drop, tmp_path, capsys):
    lines = written(drop, tmp_path / "record.csv")
    lines[9] = lines[9].rpartition(",")[0]
    (tmp_path / "record.csv").write_text("\n".join(lines))
    told = refused(tmp_path, tmp_path / "record.csv", capsys)
    assert "record.csv, line 10: 5 columns where 6 are expected" in told
    assert "repair the line or export again" in told


def test_half_an_hdf5_file_is_refused_with_its_size(tmp_path, capsys):
    content = example_record_path("lp400_drop_060").read_bytes()
    (tmp_path / "record.h5").write_bytes(content[: len(content) // 2])
    told = refused(tmp_path, tmp_path / "record.h5", capsys)
    assert re.search(
        rf"record\.h5 is no intact HDF5 file .*{len(content) // 2} bytes\); copy or export", told
    )


@pytest.mark.parametrize(
    ("option", "file"), [("--json", "drop.json"), ("--report", "drop.html"), ("-o", "drop.h5")]
)
def test_ctrl_c_while_a_file_is_written_leaves_the_earlier_one(option, file, tmp_path, monkeypatch, capsys):
    """The key is pressed when the temporary file is complete and not yet in its place."""

    def pressed(self: Path, target: Path) -> None:
        assert self.stat().st_size > 100
        raise KeyboardInterrupt

    (tmp_path / file).write_text("earlier")
    monkeypatch.setattr(Path, "replace", pressed)
    arguments = ["simulate", LP400, "--speed", "60 Hz", "--duration", "2 ms", "--reduction", "quick"]
    assert run([*arguments, option, str(tmp_path / file)]) == INTERRUPTED
    assert "stopped; nothing was left half written" in " ".join(capsys.readouterr().err.split())
    assert [(found.name, found.read_text()) for found in tmp_path.iterdir()] == [(file, "earlier")]


def test_ctrl_c_while_a_machine_file_is_written_leaves_nothing(tmp_path, monkeypatch):
    def pressed(self: Path, target: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", pressed)
    assert run(["init", str(tmp_path / "machine.toml")]) == INTERRUPTED
    assert list(tmp_path.iterdir()) == []


def test_two_records_are_not_taken_for_a_machine_and_its_record(tmp_path, capsys):
    """The second one was said to be no valid TOML."""
    files = [tmp_path / "drop.csv", tmp_path / "tail.csv"]
    for file in files:
        file.write_text("t;x\n0;1\n")
    assert run(["look", *map(str, files)]) == 64
    told = " ".join(capsys.readouterr().err.split())
    assert "takes one record and its machine file (.toml)" in told and "are two records" in told


def test_a_record_in_place_of_an_estimate_is_said_to_be_no_text(tmp_path, capsys):
    record = tmp_path / "drop.csv"
    record.write_bytes("Zeit;µm\n".encode("latin-1"))
    assert run(["restart", LP400, str(record)]) == 64
    told = " ".join(capsys.readouterr().err.split())
    assert "is not JSON (it is no UTF-8 text)" in told and "codec" not in told
