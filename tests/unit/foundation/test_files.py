"""Files whole or not at all, results that come back, values that keep what is known, series, errors."""

import json
import os
import signal
import stat
import subprocess
import sys
from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np
import pytest

from rotordrop import Known, errors
from rotordrop.arrays import Array
from rotordrop.errors import OutputError
from rotordrop.files import atomic_path, make_folder, new_hdf5, read_hdf5, write_json, write_text
from rotordrop.labelled import Stored, read, write
from rotordrop.series import curvature, median_of_five, noise_by_differences, runs_of


def test_the_file_appears_when_the_block_ends(tmp_path):
    target = tmp_path / "result.h5"
    with atomic_path(target) as temporary:
        temporary.write_bytes(b"complete")
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".h5"
        assert not target.exists()
    assert target.read_bytes() == b"complete"
    assert os.listdir(tmp_path) == ["result.h5"]


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit, GeneratorExit])
@pytest.mark.parametrize("before", [["old"], []])
def test_an_exception_leaves_the_folder_as_it_was(tmp_path, error, before):
    target = tmp_path / "result.json"
    for text in before:
        target.write_text(text)
    with pytest.raises(error), atomic_path(target) as temporary:
        temporary.write_text("half wri")
        raise error
    assert [file.read_text() for file in tmp_path.iterdir()] == before


WRITER = """
import sys, time
from rotordrop.files import atomic_path
with atomic_path(sys.argv[1]) as temporary:
    temporary.write_text('half wri')
    print(temporary.name, flush=True)
    time.sleep(3600)
"""


def writing(target):
    """A process that has begun to write a file, and the name under which it does."""
    command = [sys.executable, "-c", WRITER, str(target)]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return child, child.stdout.readline().strip()


def ended(child, number):
    child.send_signal(number)
    assert child.wait(timeout=600) != 0
    child.stdout.close()


@pytest.mark.skipif(os.name != "posix", reason="signals as on POSIX")
def test_ctrl_c_in_a_real_program_leaves_nothing(tmp_path):
    child, name = writing(tmp_path / "out.txt")
    assert os.listdir(tmp_path) == [name]
    ended(child, signal.SIGINT)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nowhere/out.txt", r"cannot write .*nowhere.out\.txt: the folder .*nowhere does not exist"),
        ("", r"it is a folder; name a file in it"),
        ("out.txt", r"nothing was written for .*out\.txt"),
    ],
)
def test_where_nothing_can_be_or_was_written_is_said(tmp_path, name, message):
    begun = []
    with pytest.raises(OutputError, match=message), atomic_path(tmp_path / name):
        begun.append(name)
    assert begun == ["out.txt"] * (name == "out.txt")
    assert os.listdir(tmp_path) == []


def test_text_is_utf_8_with_plain_line_ends_and_json_reads_back(tmp_path):
    write_text(tmp_path / "t.txt", "280 µm\n")
    assert (tmp_path / "t.txt").read_bytes() == b"280 \xc2\xb5m\n"
    write_json(tmp_path / "t.json", {"bearings": {"NDE": {"value": 2.5e-4}}})
    assert json.loads((tmp_path / "t.json").read_text()) == {"bearings": {"NDE": {"value": 2.5e-4}}}


def test_a_file_is_synced_through_what_may_write_it(tmp_path, monkeypatch):
    """Windows asks for it."""
    monkeypatch.setattr(os, "fsync", lambda fd: stat.S_ISREG(os.fstat(fd).st_mode) and os.write(fd, b""))
    write_text(tmp_path / "t.txt", "280 µm\n")


def test_an_error_about_another_file_is_not_renamed(tmp_path):
    with pytest.raises(FileNotFoundError, match="input"), atomic_path(tmp_path / "out.txt"):
        open(tmp_path / "input.csv")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("content", [{"value": float("nan")}, {"value": object()}])
def test_what_json_cannot_hold_is_refused_before_writing(tmp_path, content):
    with pytest.raises(OutputError, match=r"cannot write .*t\.json as JSON"):
        write_json(tmp_path / "t.json", content)
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(os.name != "posix", reason="links, pipes and modes as on POSIX")
class TestWhatStandsThereIsKept:
    @pytest.mark.parametrize("before", [["old"], []])
    def test_a_link_stays_a_link_and_its_target_is_new(self, tmp_path, before):
        (tmp_path / "kept").mkdir()
        target, link = tmp_path / "kept" / "result.json", tmp_path / "link.json"
        for text in before:
            target.write_text(text)
        link.symlink_to(target if before else "kept/result.json")
        write_text(link, "new")
        assert link.is_symlink() and target.read_text() == "new"

    def test_a_pipe_takes_the_text_and_stays_a_pipe(self, tmp_path):
        pipe = tmp_path / "pipe"
        os.mkfifo(pipe)
        reader = subprocess.Popen(["cat", str(pipe)], stdout=subprocess.PIPE)
        write_text(pipe, "280 µm\n")
        assert reader.communicate(timeout=600)[0] == b"280 \xc2\xb5m\n"
        assert stat.S_ISFIFO(pipe.stat().st_mode)

    @pytest.mark.parametrize("mode", [0o600, 0o640, 0o755])
    def test_permissions_stay(self, tmp_path, mode):
        target = tmp_path / "result.json"
        target.write_text("old")
        target.chmod(mode)
        write_text(target, "new")
        assert stat.S_IMODE(target.stat().st_mode) == mode

    def test_a_device_that_is_full_stays_a_device(self, tmp_path):
        device = tmp_path / "full"
        try:
            os.mknod(device, stat.S_IFCHR | 0o666, os.makedev(1, 7))
            device.open("wb").close()
        except OSError:
            pytest.skip("devices cannot be made here")
        with pytest.raises(OutputError, match=r"cannot write .*full: No space left"):
            write_text(device, "text")
        assert stat.S_ISCHR(device.stat().st_mode)


@pytest.mark.skipif(os.name != "posix", reason="processes are asked for as on POSIX")
def test_what_a_killed_run_left_is_removed_and_a_running_one_is_left_alone(tmp_path):
    target = tmp_path / "out.txt"
    (killed, left), (running, begun) = writing(target), writing(target)
    ended(killed, signal.SIGKILL)
    (tmp_path / ".other.txt").write_text("not ours")
    (tmp_path / left.replace(".out.", ".another.")).write_text("of another file")
    assert {left, begun} <= set(os.listdir(tmp_path))
    write_text(target, "whole")
    assert left not in os.listdir(tmp_path)
    assert begun in os.listdir(tmp_path), "somebody still writes it"
    assert len(os.listdir(tmp_path)) == 4
    ended(running, signal.SIGKILL)


def test_names_too_long_or_of_another_encoding_and_folders_that_cannot_be_made_are_told(tmp_path):
    with pytest.raises(OutputError, match=r"cannot write .*: File name too long; choose another place"):
        write_text(tmp_path / (300 * "a" + ".json"), "text")
    write_text(tmp_path / (240 * "a" + ".json"), "text")
    assert (tmp_path / (240 * "a" + ".json")).read_text() == "text"
    write_text(tmp_path / "t.txt", "record \udcff.csv")
    assert (tmp_path / "t.txt").read_text() == "record ?.csv"
    for _ in range(2):
        make_folder(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()
    (tmp_path / "file").write_text("")
    with pytest.raises(
        OutputError, match=r"cannot make the folder .*file/deeper: Not a directory; name another"
    ):
        make_folder(tmp_path / "file" / "deeper")


@dataclass(frozen=True, kw_only=True)
class Part:
    start: Array
    count: int


@dataclass(frozen=True, kw_only=True)
class Whole:
    time: Annotated[Array, Stored("time", "s", "time from power-off")]
    force: Annotated[Array, Stored("time bearing axis", "N", "ball force")]
    bearing_names: Annotated[tuple[str, ...], Stored("bearing", name="bearing")]
    bare: Array
    title: str
    speed: float
    finished: bool
    contacts: Annotated[Part, Stored("contact", prefix="contact_")]
    heat: Annotated[Part | None, Stored(prefix="heat/")] = None
    stress: Annotated[Array | None, Stored("time", "Pa", "stress")] = None
    further: tuple[str, ...] = ()


def whole(**more):
    part = Part(start=np.array([0.1, np.nan]), count=2)
    force = np.arange(12.0).reshape(3, 2, 2)
    return Whole(
        time=np.arange(3.0), force=force, bearing_names=("NDE", "Ö"), bare=np.arange(4), title="a drop",
        speed=1.5, finished=True, contacts=part, **more,
    )  # fmt: skip


@pytest.mark.parametrize(
    "more", [{}, {"heat": Part(start=np.zeros(0), count=0), "stress": np.ones(3), "further": ("a", "b")}]
)
def test_a_result_comes_back_as_it_was(tmp_path, more):
    made, path = whole(**more), tmp_path / "made.h5"
    with new_hdf5(path) as file:
        write(made, file)
    with read_hdf5(path, "") as file:
        found = Whole(**read(Whole, file))
        for item in fields(Whole):
            one, other = getattr(found, item.name), getattr(made, item.name)
            assert type(one) is type(other) and repr(one) == repr(other), item.name
        assert [scale.name for dim in file["force"].dims for scale in dim.values()] == [
            "/time", "/bearing", "/axis",
        ]  # fmt: skip
        assert dict(file["force"].attrs)["units"] == "N" and file["force"].attrs["long_name"] == "ball force"
        assert file["axis"].asstr()[()].tolist() == ["x", "y"] and file["contact_start"].dims[0].keys()


def test_what_every_result_has_is_missed(tmp_path):
    with new_hdf5(tmp_path / "made.h5") as file:
        write(whole(), file)
        del file["force"]
        with pytest.raises(KeyError, match="force"):
            read(Whole, file)


AT_BOUND = {
    "status": "at its bound",
    "standard_error": 2e6,
    "interval_90": (0.9e8, 1.1e8),
    "bounds": (1e6, 1e8),
}
GUESS = {"status": "guess", "range": (5e7, 3e8), "source": "maker's leaflet"}


@pytest.mark.parametrize("known", [AT_BOUND, GUESS])
def test_json_holds_what_is_known_and_nothing_else(known):
    listed = {key: list(one) if isinstance(one, tuple) else one for key, one in known.items()}
    value = Known(value=1e8, **known)
    assert json.loads(json.dumps(value.as_json())) == {"value": 1e8} | listed
    assert (float(value), Known(value=1.0).status) == (1e8, "given")


def test_runs_are_found_with_starts_and_lengths_at_the_ends_too():
    mask = np.array([True, True, False, True, False, False, True, True, True])
    starts, lengths = runs_of(mask)
    assert starts.tolist() == [0, 3, 6]
    assert lengths.tolist() == [2, 1, 3]
    for nothing in (np.zeros(4, dtype=np.bool_), np.empty(0, dtype=np.bool_)):
        assert [part.size for part in runs_of(nothing)] == [0, 0]


@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("shape", [(20_000,), (20_000, 2)])
def test_the_noise_is_found_beside_a_motion_and_a_few_jumps(order, shape):
    rng = np.random.default_rng(order)
    time = np.arange(shape[0]) / 20e3
    motion = 2e-4 * np.sin(2.0 * np.pi * 60.0 * time)
    motion[::500] += 1e-4
    values = (motion if len(shape) == 1 else motion[:, None]) + rng.normal(0.0, 0.4e-6, shape)
    assert noise_by_differences(values, order) == pytest.approx(0.4e-6, rel=0.04)


def test_missing_samples_are_left_out_of_noise_and_curvature():
    values = np.random.default_rng(4).normal(0.0, 0.4e-6, 20_000)
    values[100:4000:7] = np.nan
    assert noise_by_differences(values, 3) == pytest.approx(0.4e-6, rel=0.05)
    rate = 1000.0
    time = np.arange(200)[:, None] / rate + np.array([0.2, -0.1])
    values = time**3
    assert curvature(values, rate, 11)[5:-5] == pytest.approx(6.0 * time[5:-5], abs=1e-9)
    assert not curvature(values, rate, 11)[[*range(5), *range(-5, 0)]].any()
    assert not curvature(values[:8], rate, 11).any()


@pytest.mark.parametrize("count", [1, 2, 4, 5, 101])
def test_the_median_of_five_is_that_of_each_value_with_its_neighbours(count):
    values = np.random.default_rng(count).normal(size=count)
    padded = np.pad(values, 2, mode="edge")
    assert median_of_five(values).tolist() == [np.median(padded[i : i + 5]) for i in range(count)]


def test_exit_codes_are_those_documented_and_all_different():
    kinds = [value for value in vars(errors).values() if isinstance(value, type)]
    codes = {one.__name__: one.exit_code for one in kinds if issubclass(one, errors.RotordropError)}
    assert codes == {
        "RotordropError": 1,
        "MachineFileError": 2,
        "RecordError": 3,
        "NoDropError": 3,
        "NothingFallsError": 3,
        "UnmatchedError": 3,
        "UnpairedError": 3,
        "UnsettledError": 3,
        "IdentificationError": 4,
        "SimulationError": 5,
        "OutputError": 6,
        "DamagedFileError": 6,
        "ConsistencyError": 7,
        "UsageError": 64,
    }
    assert issubclass(errors.UsageError, ValueError)  # so that validators pass it on


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        ({"file": "m.toml", "line": 7, "column": 3}, "m.toml:7:3: node 99 does not exist"),
        ({"file": "m.toml"}, "m.toml: node 99 does not exist"),
        ({}, "node 99 does not exist"),
    ],
)
def test_machine_file_error_says_where(place, expected):
    error = errors.MachineFileError("node 99 does not exist", **place)
    assert str(error) == expected
    assert (error.line, error.column) == (place.get("line"), place.get("column"))
    assert error.message == "node 99 does not exist"
