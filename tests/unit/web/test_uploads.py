"""What comes in is counted while it comes, stands whole or not at all, and a limited child reads it."""

import gzip
import pickle
import socket
import subprocess
import sys
import time
import zipfile
from io import BytesIO

import numpy as np
import pytest

from rotordrop.errors import UsageError
from rotordrop.files import atomic_path
from rotordrop.jobs import workspace
from rotordrop.jobs.workspace import Workspace, labelled, stored_as


def left_over(served, job):
    return sorted(file.name for file in (served.space.jobs_folder / job / "files").iterdir())


def test_half_an_upload_leaves_nothing(served):
    job, until = served.new_job({}), time.monotonic() + 600.0
    with socket.create_connection(("127.0.0.1", served.port)) as connection:
        head = f"PUT /api/jobs/{job}/files/record?name=a.csv HTTP/1.1\r\nHost: 127.0.0.1:{served.port}\r\n"
        head += f"X-Rotordrop-Token: {served.token}\r\nContent-Length: 100000\r\n\r\n"
        connection.sendall(head.encode() + b"x" * 5000)
        while not left_over(served, job) and time.monotonic() < until:
            time.sleep(0.05)  # until it has begun
    while left_over(served, job) and time.monotonic() < until:
        time.sleep(0.05)
    assert left_over(served, job) == []
    assert served.ask("GET", f"/api/jobs/{job}").told["files"] == {}


def test_what_a_killed_server_left_is_removed_by_the_next(tmp_path):
    space = Workspace(tmp_path)
    space.prepare()
    job = space.new_job("drop", {})
    command = (
        "import os, sys; from pathlib import Path; from rotordrop.files import atomic_path\n"
        "with atomic_path(Path(sys.argv[1])) as place: place.write_bytes(b'half'); os.kill(os.getpid(), 9)"
    )
    subprocess.run([sys.executable, "-c", command, str(job.path / "files" / "record.csv")], check=False)
    assert len(list((job.path / "files").iterdir())) == 1
    with atomic_path(job.path / "files" / "tail.csv") as place:
        place.write_bytes(b"of a server that lives")
        Workspace(tmp_path).prepare()
    assert [file.name for file in (job.path / "files").iterdir()] == ["tail.csv"]


@pytest.mark.parametrize("files", ["", "files"])
def test_what_was_never_a_job_goes_with_the_next_start(tmp_path, files):
    space = Workspace(tmp_path)
    space.prepare()
    (space.jobs_folder / ("0" * 16) / files).mkdir(parents=True)
    space.prepare()
    assert list(space.jobs_folder.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "suffix"),
    [("a.csv", ".csv"), ("../../x.CSV", ".csv"), ("/etc/p.mat", ".mat"), ("a.b.csv.gz", ".csv.gz")],
)
def test_a_name_of_a_client_is_a_label_only(name, suffix):
    assert stored_as("record", name) == f"record{suffix}"


@pytest.mark.parametrize(
    ("role", "names", "words"),
    [
        ("record", ["", "a", "a.", "a.c/v", "a.\0csv", "a.csv\n", "a.%2e%2e"], "no suffix that tells its"),
        (
            "beside",
            ["..", ".ssh", "../a.csv", "a\\b.csv", "C:a.csv", "CON", "machine.toml", "a/b", "x" * 121],
            "cannot be the name of a file beside",
        ),
    ],
)
def test_a_name_that_no_file_may_have_is_refused(role, names, words):
    for name in names:
        with pytest.raises(UsageError, match=words):
            stored_as(role, name)


def test_a_label_is_one_printable_line():
    assert labelled("a\nb\x1b[31m") == "a\ufffdb\ufffd[31m"
    assert len(labelled("x" * 1000)) == workspace.LONGEST_NAME


class Wicked:
    """Whoever unpickles it makes a file."""

    def __init__(self, place):
        self.place = place

    def __reduce__(self):
        return (open, (str(self.place), "w"))


def _packed_objects(place):
    stream = BytesIO()
    np.save(stream, np.array([Wicked(place)], dtype=object), allow_pickle=True)
    return stream.getvalue()


def _zip_bomb():
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("xl/workbook.xml", b"<a>" * 100_000_000)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.npy", _packed_objects),
        ("a.npz", lambda place: pickle.dumps(Wicked(place))),
        ("a.mat", lambda place: pickle.dumps(Wicked(place))),
        ("a.csv", lambda _: b"\x00" * 5000),
        ("a.csv", lambda _: b"time [s];X1 [um];Y1 [um]\n" + b"0;0;0\n" * 3),
        ("a.h5", lambda _: b"\x89HDF\r\n\x1a\n" + b"\xff" * 3000),
        ("a.csv.gz", lambda _: gzip.compress(b"0;" * 4_000_000) * 100),
        ("a.xlsx", lambda _: _zip_bomb()),
        ("a.exe", lambda _: b"MZ"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_file_that_is_no_record_ends_in_a_sentence(served, tmp_path, name, content):
    job = served.new_job({"record": (name, content(tmp_path / "unpickled"))})
    error = served.failed(job, "look")
    assert len(error) > 20 and "this should not happen" not in error
    assert str(served.space.path) not in error
    assert not (tmp_path / "unpickled").exists()
    folders = [entry.name for entry in (served.space.jobs_folder / job).iterdir() if entry.is_dir()]
    assert folders == ["files"]


def test_a_machine_file_may_name_no_file_elsewhere(served, files):
    text = files["machine"].read_text().replace('"lp400_shaft.csv"', '"/etc/hostname"')
    job = served.new_job({"record": files["record"], "machine": ("m.toml", text.encode())})
    assert "needs the shaft table '/etc/hostname'" in served.failed(job, "look")


def test_a_record_of_another_format_replaces_the_one_before(served):
    job = served.new_job({"record": ("a.csv", b"old")})
    assert served.put(job, "record", "b.txt", b"new").status == 201
    assert left_over(served, job) == ["record.txt"]


@pytest.mark.parametrize("order", [("record", "beside"), ("beside", "record")])
def test_two_files_that_would_lie_under_one_name_are_refused(served, order):
    job = served.new_job({})
    answers = [served.put(job, role, f"{role}.dat", b"x") for role in order]
    assert [answer.status for answer in answers] == [201, 400]
    assert f"{order[1]}.dat would lie where {order[0]}.dat lies" in answers[1].text
    assert left_over(served, job) == ["record.dat"]
