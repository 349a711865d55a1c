"""A file is there complete, or not at all, whatever ends the writing."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from rotordrop.atomic_file import atomic_path, write_json, write_text
from rotordrop.errors import OutputError


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
        "from rotordrop.atomic_file import atomic_path\n"
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
