"""What comes in is counted while it comes, stands whole or not at all, and a limited child reads it."""

from __future__ import annotations

import asyncio
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
from tests.unit.web.serving import Served

from rotordrop.errors import UsageError
from rotordrop.files import atomic_folder, atomic_path
from rotordrop.record import readers
from rotordrop.web import connection, workspace
from rotordrop.web.workspace import Workspace, labelled, receive, stored_as


def left_over(served: Served, job: str) -> list[str]:
    return sorted(file.name for file in (served.space.jobs_folder / job / "files").iterdir())


def test_an_upload_over_the_limit_is_refused_by_its_length_alone(served, monkeypatch):
    monkeypatch.setitem(workspace.LARGEST, "record", 1000)
    job = served.new_job({})
    answer = served.ask("PUT", f"/api/jobs/{job}/files/record?name=a.csv", b"x" * 1001)
    assert answer.status == 413
    assert "a.csv is larger than the 0 MB" in answer.text
    assert left_over(served, job) == []


def test_an_upload_without_a_length_is_refused_while_it_comes(served, monkeypatch):
    monkeypatch.setitem(workspace.LARGEST, "record", 100_000)
    job = served.new_job({})
    with socket.create_connection(("127.0.0.1", served.port)) as connection:
        connection.sendall(
            f"PUT /api/jobs/{job}/files/record?name=a.csv HTTP/1.1\r\nHost: 127.0.0.1:{served.port}\r\n"
            f"X-Rotordrop-Token: {served.token}\r\nTransfer-Encoding: chunked\r\n\r\n".encode()
        )
        answer = b""
        for _ in range(100):
            try:
                connection.sendall(b"2000\r\n" + b"x" * 0x2000 + b"\r\n")
            except OSError:
                break
        answer = connection.recv(4096)
    assert b" 413 " in answer
    assert left_over(served, job) == []


def test_half_an_upload_leaves_nothing(served):
    job = served.new_job({})
    with socket.create_connection(("127.0.0.1", served.port)) as connection:
        connection.sendall(
            f"PUT /api/jobs/{job}/files/record?name=a.csv HTTP/1.1\r\nHost: 127.0.0.1:{served.port}\r\n"
            f"X-Rotordrop-Token: {served.token}\r\nContent-Length: 100000\r\n\r\n".encode()
            + b"x" * 5000
        )
    time.sleep(0.5)
    assert left_over(served, job) == []
    assert served.ask("GET", f"/api/jobs/{job}").told["files"] == {}


def test_a_full_folder_takes_nothing_more(tmp_path):
    server = Served(Workspace(tmp_path, quota=4000))
    try:
        job = server.new_job({})
        answer = server.ask("PUT", f"/api/jobs/{job}/files/record?name=a.csv", b"x" * 4500)
        assert answer.status == 413
        assert left_over(server, job) == []
    finally:
        server.stop()


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


def test_what_was_never_a_job_goes_with_the_next_start(tmp_path):
    space = Workspace(tmp_path)
    space.prepare()
    (space.jobs_folder / ("0" * 16) / "files").mkdir(parents=True)
    space.prepare()
    assert list(space.jobs_folder.iterdir()) == []
    with pytest.raises(ZeroDivisionError), atomic_folder(space.jobs_folder / ("2" * 16)):
        raise ZeroDivisionError
    assert list(space.jobs_folder.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "stored"),
    [
        ("a.csv", "record.csv"),
        ("../../x.CSV", "record.csv"),
        ("/etc/p.mat", "record.mat"),
        ("a.b.csv.gz", "record.csv.gz"),
    ],
)
def test_a_name_of_a_client_is_a_label_only(name, stored):
    assert stored_as("record", name) == stored


@pytest.mark.parametrize("name", ["", "a", "a.", "a.c/v", "a.\0csv", "a.csv\n", "a.%2e%2e"])
def test_a_record_without_a_suffix_is_refused(name):
    with pytest.raises(UsageError, match="no suffix that tells its format"):
        stored_as("record", name)


@pytest.mark.parametrize(
    "name", ["..", ".ssh", "../a.csv", "a\\b.csv", "C:a.csv", "CON", "machine.toml", "a/b", "x" * 121]
)
def test_a_file_beside_needs_a_plain_name(name):
    with pytest.raises(UsageError, match="cannot be the name of a file beside"):
        stored_as("beside", name)


def test_a_label_is_one_printable_line():
    assert labelled("a\nb\x1b[31m") == "a\ufffdb\ufffd[31m"
    assert len(labelled("x" * 1000)) == workspace.LONGEST_NAME


class Wicked:
    def __reduce__(self):
        return (open, ("/tmp/rotordrop-was-unpickled", "w"))


def _packed_objects() -> bytes:
    stream = BytesIO()
    np.save(stream, np.array([Wicked()], dtype=object), allow_pickle=True)
    return stream.getvalue()


def _bomb() -> bytes:
    return gzip.compress(b"0;" * 400_000_000, compresslevel=1)


def _zip_bomb() -> bytes:
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/workbook.xml", b"<a>" * 100_000_000)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.npy", _packed_objects()),
        ("a.npz", pickle.dumps(Wicked())),
        ("a.mat", pickle.dumps(Wicked())),
        ("a.csv", b"\x00" * 5000),
        ("a.csv", b"time [s];X1 [um];Y1 [um]\n" + b"0;0;0\n" * 3),
        ("a.h5", b"\x89HDF\r\n\x1a\n" + b"\xff" * 3000),
        ("a.csv.gz", _bomb()),
        ("a.xlsx", _zip_bomb()),
        ("a.exe", b"MZ"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_file_that_is_no_record_ends_in_a_sentence(served, tmp_path, name, content):
    from pathlib import Path

    job = served.new_job({"record": (name, content)})
    served.order(f"/api/jobs/{job}/look")
    state = served.settled(job, "look")
    assert state["state"] == "failed"
    assert len(state["error"]) > 20
    assert "this should not happen" not in state["error"]
    assert str(served.space.path) not in state["error"]
    assert not Path("/tmp/rotordrop-was-unpickled").exists()
    folders = [entry.name for entry in (served.space.jobs_folder / job).iterdir() if entry.is_dir()]
    assert folders == ["files"]


def test_a_machine_file_may_name_no_file_elsewhere(served, files):
    text = files["machine"].read_text().replace('"lp400_shaft.csv"', '"/etc/hostname"')
    job = served.new_job({"record": files["record"], "machine": ("m.toml", text.encode())})
    served.order(f"/api/jobs/{job}/look")
    state = served.settled(job, "look")
    assert state["state"] == "failed"
    assert "needs the shaft table '/etc/hostname'" in state["error"]


def test_the_page_takes_what_its_readers_take():
    assert workspace.LARGEST["record"] == workspace.LARGEST["tail"] == readers.LARGEST


def test_whoever_sends_too_much_reads_why(served, monkeypatch):
    """The answer used to be lost: the connection was reset while the sender still sent."""
    monkeypatch.setitem(workspace.LARGEST, "record", 1000)
    job = served.new_job({})
    answer = served.ask("PUT", f"/api/jobs/{job}/files/record?name=a.csv", b"x" * 50_000_000)
    assert answer.status == 413
    assert "a.csv is larger than the 0 MB that may still be sent" in answer.text
    assert served.ask("GET", "/api/formats").told["largest"]["record"] == 1000


@pytest.mark.parametrize(
    ("limits", "words"),
    [({"STALLED_S": 0.2}, r"nothing of a\.csv came for 0\.2 s"), ({"SLOWEST": 1e9}, "comes too slowly")],
)
def test_an_upload_that_stalls_ends_and_gives_its_room_back(tmp_path, monkeypatch, limits, words):
    monkeypatch.setattr(workspace, "STALLED_S", 0.0 if "SLOWEST" in limits else 0.2)
    for name, value in limits.items():
        monkeypatch.setattr(workspace, name, value)
    space = Workspace(tmp_path)
    space.prepare()
    job = space.new_job("drop", {})

    async def stalled():
        yield b"x"
        await asyncio.sleep(0 if "SLOWEST" in limits else 30)
        yield b"x"

    with pytest.raises(UsageError, match=words):
        asyncio.run(receive(space, job, "record", "a.csv", 2**30, stalled()))
    assert space.room.coming == {}
    assert list((job.path / "files").iterdir()) == []


def test_uploads_side_by_side_do_not_outgrow_the_folder(tmp_path):
    space = Workspace(tmp_path, quota=10_000)
    space.prepare()
    jobs = [space.new_job("drop", {}) for _ in range(2)]

    async def slow():
        for _ in range(6):
            await asyncio.sleep(0.01)
            yield b"x" * 1000

    async def both():
        coming = [receive(space, job, "record", "a.csv", None, slow()) for job in jobs]
        return await asyncio.gather(*coming, return_exceptions=True)

    told = asyncio.run(both())
    assert sorted(type(one).__name__ for one in told) == ["TooLargeError", "dict"]
    assert space.used() <= 10_000


def test_a_record_of_another_format_replaces_the_one_before(served):
    job = served.new_job({"record": ("a.csv", b"old")})
    assert served.ask("PUT", f"/api/jobs/{job}/files/record?name=b.txt", b"new").status == 201
    assert left_over(served, job) == ["record.txt"]


@pytest.mark.parametrize("order", [("record", "beside"), ("beside", "record")])
def test_two_files_that_would_lie_under_one_name_are_refused(served, order):
    job = served.new_job({})
    answers = [served.ask("PUT", f"/api/jobs/{job}/files/{role}?name={role}.dat", b"x") for role in order]
    assert [answer.status for answer in answers] == [201, 400]
    assert f"{order[1]}.dat would lie where {order[0]}.dat lies" in answers[1].text
    assert left_over(served, job) == ["record.dat"]


@pytest.mark.parametrize(
    "said",
    [b"", b"GET / HT", b"GET /api/jobs HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: ", b"GET / HTTP/1.1\r\n" * 3],
    ids=["nothing", "part of a line", "part of a header", "many lines"],
)
@pytest.mark.parametrize("after_another", [False, True])
def test_a_head_that_never_ends_is_closed(served, monkeypatch, said, after_another):
    """Connections that said nothing, or half a header, stayed open for ever."""
    monkeypatch.setattr(connection, "HEAD_S", 0.5)
    with socket.create_connection(("127.0.0.1", served.port), timeout=10) as slow:
        if after_another:
            slow.sendall(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{served.port}\r\n\r\n".encode())
            assert b"200 OK" in slow.recv(100)
        for letter in said:  # a piece now and then must not give it more time
            slow.sendall(bytes([letter]))
        while slow.recv(65536):  # one that stays open ends in the time-out of the socket
            pass
    assert served.ask("GET", "/api/jobs").status == 200


def test_an_order_that_stalls_ends_with_a_sentence(served, monkeypatch):
    monkeypatch.setattr(workspace, "STALLED_S", 0.3)
    head = (
        f"POST /api/jobs HTTP/1.1\r\nHost: 127.0.0.1:{served.port}\r\nX-Rotordrop-Token: {served.token}\r\n"
    )
    with socket.create_connection(("127.0.0.1", served.port), timeout=10) as slow:
        slow.sendall(f"{head}Content-Length: 50\r\n\r\n{{".encode())
        answer = slow.recv(4096)
        assert b" 400 " in answer
        assert b"nothing of the order came for 0.3 s" in answer + slow.recv(4096)
