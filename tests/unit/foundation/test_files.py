"""A file is there complete, or not at all, whatever ends the writing."""

from __future__ import annotations

import json
import os
import signal
import stat
import subprocess
import sys
import time

import pytest

from rotordrop.errors import OutputError
from rotordrop.files import atomic_path, make_folder, write_json, write_text


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
def test_an_exception_leaves_the_folder_as_it_was(tmp_path, error):
    target = tmp_path / "result.json"
    target.write_text("old")
    with pytest.raises(error), atomic_path(target) as temporary:
        temporary.write_text("half wri")
        raise error
    assert os.listdir(tmp_path) == ["result.json"]
    assert target.read_text() == "old"


def test_an_exception_leaves_nothing_where_nothing_was(tmp_path):
    with pytest.raises(ZeroDivisionError), atomic_path(tmp_path / "new.html") as temporary:
        temporary.write_text("<html>")
        raise ZeroDivisionError
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(os.name != "posix", reason="signals as on POSIX")
def test_ctrl_c_in_a_real_program_leaves_nothing(tmp_path):
    program = (
        "import sys, time\n"
        "from rotordrop.files import atomic_path\n"
        "with atomic_path(sys.argv[1]) as temporary:\n"
        "    temporary.write_text('half wri')\n"
        "    print('writing', flush=True)\n"
        "    time.sleep(60)\n"
    )
    child = subprocess.Popen(
        [sys.executable, "-c", program, str(tmp_path / "out.txt")],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert child.stdout is not None
    assert child.stdout.readline() == b"writing\n"
    assert len(os.listdir(tmp_path)) == 1, "the temporary file should be there while writing"
    child.send_signal(signal.SIGINT)
    started = time.monotonic()
    assert child.wait(timeout=30) != 0
    assert time.monotonic() - started < 30
    child.stdout.close()
    assert os.listdir(tmp_path) == []


def test_a_missing_folder_is_named(tmp_path):
    with (
        pytest.raises(
            OutputError, match=r"cannot write .*nowhere.out\.txt: the folder .*nowhere does not exist"
        ),
        atomic_path(tmp_path / "nowhere" / "out.txt"),
    ):
        pytest.fail("the block must not run")


def test_a_folder_is_no_file(tmp_path):
    with (
        pytest.raises(OutputError, match=r"it is a folder; name a file in it"),
        atomic_path(tmp_path),
    ):
        pytest.fail("the block must not run")


def test_a_block_that_writes_nothing_is_an_error(tmp_path):
    with (
        pytest.raises(OutputError, match=r"nothing was written for .*out\.txt"),
        atomic_path(tmp_path / "out.txt"),
    ):
        pass
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
def test_a_full_disk_is_an_output_error_that_names_the_target(tmp_path):
    target = tmp_path / "out.txt"
    with (
        pytest.raises(
            OutputError, match=r"cannot write .*out\.txt: No space left on device; choose another place"
        ),
        atomic_path(target) as temporary,
    ):
        temporary.write_text("begun")
        with open("/dev/full", "w") as full:
            full.write("x")
    assert os.listdir(tmp_path) == []


def test_an_error_about_another_file_is_not_renamed(tmp_path):
    with pytest.raises(FileNotFoundError, match="input"), atomic_path(tmp_path / "out.txt"):
        open(tmp_path / "input.csv")
    assert os.listdir(tmp_path) == []


def test_text_is_utf_8_with_plain_line_ends(tmp_path):
    write_text(tmp_path / "t.txt", "280 µm\n")
    assert (tmp_path / "t.txt").read_bytes() == b"280 \xc2\xb5m\n"


def test_json_reads_back(tmp_path):
    write_json(tmp_path / "t.json", {"bearings": {"NDE": {"value": 2.5e-4}}})
    assert json.loads((tmp_path / "t.json").read_text()) == {"bearings": {"NDE": {"value": 2.5e-4}}}


@pytest.mark.parametrize("content", [{"value": float("nan")}, {"value": object()}])
def test_what_json_cannot_hold_is_refused_before_writing(tmp_path, content):
    with pytest.raises(OutputError, match=r"cannot write .*t\.json as JSON"):
        write_json(tmp_path / "t.json", content)
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(os.name != "posix", reason="links, pipes and modes as on POSIX")
class TestWhatStandsThereIsKept:
    def test_a_link_stays_a_link_and_its_target_is_new(self, tmp_path):
        (tmp_path / "kept").mkdir()
        target = tmp_path / "kept" / "result.json"
        target.write_text("old")
        (tmp_path / "link.json").symlink_to(target)
        write_text(tmp_path / "link.json", "new")
        assert (tmp_path / "link.json").is_symlink()
        assert target.read_text() == "new"

    def test_a_link_to_nothing_makes_its_target(self, tmp_path):
        (tmp_path / "link.json").symlink_to("result.json")
        write_text(tmp_path / "link.json", "new")
        assert (tmp_path / "link.json").is_symlink()
        assert (tmp_path / "result.json").read_text() == "new"

    def test_a_pipe_takes_the_text_and_stays_a_pipe(self, tmp_path):
        pipe = tmp_path / "pipe"
        os.mkfifo(pipe)
        reader = subprocess.Popen(["cat", str(pipe)], stdout=subprocess.PIPE)
        write_text(pipe, "280 µm\n")
        assert reader.communicate(timeout=30)[0] == b"280 \xc2\xb5m\n"
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
    program = (
        "import sys, time\n"
        "from rotordrop.files import atomic_path\n"
        "with atomic_path(sys.argv[1]) as temporary:\n"
        "    temporary.write_text('half wri')\n"
        "    print(temporary.name, flush=True)\n"
        "    time.sleep(60)\n"
    )
    target = tmp_path / "out.txt"
    children = [
        subprocess.Popen([sys.executable, "-c", program, str(target)], stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    names = [child.stdout.readline().strip() for child in children]
    children[0].kill()
    children[0].wait(timeout=30)
    (tmp_path / ".other.txt").write_text("not ours")
    (tmp_path / f"{names[0].replace('.out.', '.another.')}").write_text("of another file")
    assert set(names) <= set(os.listdir(tmp_path))
    write_text(target, "whole")
    assert names[0] not in os.listdir(tmp_path)
    assert names[1] in os.listdir(tmp_path), "somebody still writes it"
    assert len(os.listdir(tmp_path)) == 4
    children[1].kill()
    children[1].wait(timeout=30)
    for child in children:
        child.stdout.close()


@pytest.mark.skipif(os.name != "posix", reason="limits as on POSIX")
def test_a_full_disk_under_hdf5_ends_with_a_sentence(tmp_path):
    program = (
        "import resource, signal, sys, numpy\n"
        "from rotordrop.files import new_hdf5\n"
        "from rotordrop.errors import OutputError\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))\n"
        "try:\n"
        "    with new_hdf5(sys.argv[1]) as file:\n"
        "        file.create_dataset('a', data=numpy.random.rand(100_000), compression='gzip')\n"
        "except OutputError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "out.h5")], capture_output=True, text=True, check=True
    )
    assert "out.h5: File too large; choose another place" in done.stdout
    assert done.stderr == ""
    assert os.listdir(tmp_path) == []


def test_a_long_name_and_a_folder_without_permission_are_told(tmp_path):
    with pytest.raises(OutputError, match=r"cannot write .*: File name too long; choose another place"):
        write_text(tmp_path / (300 * "a" + ".json"), "text")
    write_text(tmp_path / (240 * "a" + ".json"), "text")
    assert (tmp_path / (240 * "a" + ".json")).read_text() == "text"


def test_a_name_of_another_encoding_does_not_stop_the_writing(tmp_path):
    write_text(tmp_path / "t.txt", "record \udcff.csv")
    assert (tmp_path / "t.txt").read_text() == "record ?.csv"


def test_a_folder_is_made_with_those_above_it_and_one_that_cannot_be_is_named(tmp_path):
    for _ in range(2):
        make_folder(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()
    (tmp_path / "file").write_text("")
    with pytest.raises(
        OutputError, match=r"cannot make the folder .*file/deeper: Not a directory; name another"
    ):
        make_folder(tmp_path / "file" / "deeper")
