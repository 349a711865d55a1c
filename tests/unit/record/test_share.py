"""A record for others: the same samples, and nothing of whose machine it was."""

from __future__ import annotations

import hashlib
import re
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from rotordrop.cli.app import run
from rotordrop.errors import UsageError
from rotordrop.machine import Machine, example_machine, load_machine
from rotordrop.machine.saving import save_machine
from rotordrop.record.examples import example_record_path
from rotordrop.record.record import Record, read_record, save_record
from rotordrop.record.share import share_record

SECRET = "Ormen"
"""A word that stands in every name, remark and path of the record and the machine."""


@pytest.fixture
def machine() -> Machine:
    """The machine of the supplied record, its names and remarks made telling."""
    plain = example_machine("lp400")
    names = {one.name: f"{SECRET}_{one.name}" for one in plain.touchdown_bearings}
    raw = {
        "name": f"{SECRET} compressor",
        "notes": (f"tripped at {SECRET}",),
        "touchdown_bearings": tuple(
            one.model_copy(update={"name": names[one.name]}) for one in plain.touchdown_bearings
        ),
        "ambs": tuple(one.model_copy(update={"name": f"{SECRET}_{one.name}"}) for one in plain.ambs),
        "sensors": tuple(
            one.model_copy(update={"name": f"{SECRET}_{one.name}", "bearing": names[one.bearing]})
            for one in plain.sensors
        ),
    }
    told = plain.model_copy(update=raw)
    told.__pydantic_fields_set__.add("notes")
    sourced = replace(told.touchdown_bearings[0].air_gap, source=f"lift check at {SECRET}")
    return told.with_values({f"{told.touchdown_bearings[0].name}.air_gap": sourced})


@pytest.fixture
def record(machine: Machine, tmp_path: Path) -> Path:
    """A tenth of a second of the supplied record under telling names, with header entries."""
    read = read_record(example_record_path("lp400_drop_060"), example_machine("lp400")).window(-0.02, 0.08)
    place = tmp_path / f"{SECRET}_trip.h5"
    told = replace(
        read, sensors=machine.sensors, metadata={"plant": SECRET, "trigger": "2026-03-04"}, notes=(SECRET,)
    )
    save_record(told, place)
    return place


def everything_in(file: Path) -> bytes:
    """The bytes of a file, and of an HDF5 file all that is compressed in it too."""
    text = [file.read_bytes()]
    if file.suffix == ".h5":
        with h5py.File(file) as opened:
            opened.visititems(lambda name, item: text.append(f"{name} {dict(item.attrs)}".encode()))
            text.append(str(dict(opened.attrs)).encode())
    return b"".join(text)


def test_nothing_in_the_files_says_whose_machine_it_was(machine, record, tmp_path):
    output = tmp_path / "shared.h5"
    done = share_record(record, output, "CC-BY-4.0", machine=machine)
    written = [output, output.with_suffix(".toml"), tmp_path / "shared.h5.sha256"]
    for file in written:
        content = everything_in(file)
        assert content
        for word in (SECRET, "2026-03-04", "lift check", str(tmp_path)):
            assert word.encode() not in content, (file.name, word)
    assert list(done.channels) == ["X1", "Y1", "X2", "Y2"]
    assert all(old.startswith(SECRET) for old in done.channels.values())
    assert {"entry plant", "entry trigger", record.name} <= set(done.left_out)
    for line in written[2].read_text().splitlines():
        digest, name = re.split(" +", line)
        assert (
            hashlib.sha256((tmp_path / name).read_bytes()).hexdigest()
            == digest
            == done.files[tmp_path / name]
        )


def test_what_is_shared_reads_back_to_the_same_samples_and_machine(machine, record, tmp_path):
    output = tmp_path / "shared.h5"
    share_record(record, output, "CC0-1.0", machine=machine)
    described = load_machine(output.with_suffix(".toml"))
    mine, theirs = read_record(record, machine), read_record(output, described)
    np.testing.assert_array_equal(theirs.signals, mine.signals)
    np.testing.assert_allclose(theirs.time, mine.time, atol=1e-12)
    np.testing.assert_allclose(theirs.speed, mine.speed, rtol=1e-12)
    assert theirs.metadata["licence"] == "CC0-1.0"
    assert [sensor.angle for sensor in theirs.sensors] == [sensor.angle for sensor in mine.sensors]
    assert described.rotor.mass == machine.rotor.mass
    assert described.touchdown_bearings[0].air_gap.value == machine.touchdown_bearings[0].air_gap.value
    ball, own = (one.touchdown_bearings[0].bearing for one in (described, machine))
    assert (ball.designation, ball.preload.value) == (own.designation, own.preload.value)


def test_a_simulated_record_stays_simulated(tmp_path):
    source = example_record_path("lp400_drop_060")
    share_record(source, tmp_path / "shared.h5", "CC0-1.0", machine=example_machine("lp400"))
    described = load_machine(tmp_path / "shared.toml")
    assert read_record(source, example_machine("lp400")).is_simulated
    assert read_record(tmp_path / "shared.h5", described).is_simulated


def test_a_clock_that_tells_the_date_begins_at_zero(machine, tmp_path):
    count = 400
    time = 1.77e9 + np.arange(count) * 1e-3
    rng = np.random.default_rng(1)
    record = Record(
        time=time,
        signals=1e-5 * rng.standard_normal((count, 4)),
        sensors=machine.sensors,
        sampling_rate=1000.0,
        marks=time[::50],
        speed_time=time[::100],
        speed_readings=np.full(4, 100.0),
    )
    save_record(record, tmp_path / "dated.h5")
    share_record(tmp_path / "dated.h5", tmp_path / "shared.h5", "CC0-1.0", machine=machine)
    read = read_record(tmp_path / "shared.h5", load_machine(tmp_path / "shared.toml"))
    assert read.time[0] == 0.0 and read.time[-1] == pytest.approx(0.399, abs=1e-6)
    assert read.marks is not None and read.marks[0] == pytest.approx(0.0, abs=1e-5)


def test_the_command_shares_what_was_chosen(machine, record, tmp_path, capsys):
    save_machine(machine, tmp_path / "mine.toml")
    output = tmp_path / "shared.h5"
    kept = [sensor.name for sensor in machine.sensors[:3]]
    call = ["look", str(record), str(tmp_path / "mine.toml"), "--share", str(output)]
    assert run([*call, "--licence", "CC-BY-4.0", *(f"--channel={name}" for name in kept)]) == 0
    told = capsys.readouterr().out
    assert f"X1 (here {kept[0]})" in told and f"left out: channel {machine.sensors[3].name}" in told
    described = load_machine(tmp_path / "shared.toml")
    assert read_record(output, described).channel_names == ("X1", "Y1", "X2")

    assert run(["look", str(record), "--share", str(output)]) == 64
    assert "--share needs a licence: --licence CC-BY-4.0" in capsys.readouterr().err
    assert run(["look", str(record), "--licence", "CC-BY-4.0"]) == 64
    assert "give --share FILE.h5 too" in capsys.readouterr().err
    assert run([*call, "--licence", "CC-BY-4.0", "--report", str(tmp_path / "a.html")]) == 64
    assert "--share does not go with --report" in capsys.readouterr().err
    onto = ["look", str(record), str(tmp_path / "mine.toml"), "--share", str(tmp_path / "mine.h5")]
    before = (tmp_path / "mine.toml").read_bytes()
    assert run([*onto, "--licence", "CC-BY-4.0"]) != 0
    assert (tmp_path / "mine.toml").read_bytes() == before
    assert run(["share", str(record)]) == 64
    assert "it is rotordrop look RECORD --share FILE" in capsys.readouterr().err


def test_without_a_machine_the_record_is_shared_alone(tmp_path, capsys):
    output = tmp_path / "shared.h5"
    source = str(example_record_path("lp400_drop_060"))
    assert run(["look", source, "--share", str(output), "--licence", "CC0-1.0"]) == 0
    assert output.is_file() and not output.with_suffix(".toml").exists()
    assert run(["look", str(output), "--json", "-"]) == 0


def test_what_cannot_be_shared_is_refused(machine, record, tmp_path):
    with pytest.raises(UsageError, match=r"the licence is 'GPL'; choose one of CC0-1\.0, CC-BY-4\.0"):
        share_record(record, tmp_path / "a.h5", "GPL", machine=machine)
    with pytest.raises(UsageError, match=r"a shared record is HDF5; name it a\.h5, not a\.csv"):
        share_record(record, tmp_path / "a.csv", "CC0-1.0", machine=machine)
    with pytest.raises(UsageError, match=r"has no channel 'Q'; it has Ormen_"):
        share_record(record, tmp_path / "a.h5", "CC0-1.0", machine=machine, channels=["Q"])
    assert not list(tmp_path.glob("a.*"))
