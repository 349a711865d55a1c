"""What has changed in the folder of the page is named; the rest of the page works."""

from __future__ import annotations

import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import pytest
from tests.no_file import NO_FILE, on_posix
from tests.unit.web.serving import Served

from rotordrop.errors import RotordropError
from rotordrop.files import DIGEST
from rotordrop.web import commands, numbers, running
from rotordrop.web.running import Runner, result_folder
from rotordrop.web.workspace import Job, Workspace


@pytest.fixture(scope="module")
def looked(served, files) -> str:
    job = served.new_job({"record": files["record"]}, gap="300 um", speed="60 Hz")
    served.order(f"/api/jobs/{job}/look")
    assert served.settled(job, "look")["state"] == "done"
    return job


def ask_all(served: Served, job: str) -> dict[str, tuple[int, str]]:
    """Everything that shows a result or its files: status and words."""
    asked = ("page", "document", "window?column=y0&start=0&end=0.01", "csv?column=y0&start=0&end=0.01")
    answers = {what: served.ask("GET", f"/api/jobs/{job}/look/{what}") for what in asked}
    answers["record"] = served.ask("GET", f"/api/jobs/{job}/files/record")
    return {what: (one.status, one.text if one.status != 200 else "") for what, one in answers.items()}


def test_one_bit_changed_anywhere_in_a_job_is_named(served, looked):
    folder = Job(served.space.jobs_folder / looked).path
    assert {status for status, _ in ask_all(served, looked).values()} == {200}
    written = [
        file for file in folder.rglob("*") if file.is_file() and file.suffix not in (".lock", ".process")
    ]
    assert {"job.json", "look.result.json", "look.state.json", "motion.values.npy", "record.h5"} <= {
        file.name for file in written
    }
    generator = random.Random(26)
    for file in written:
        whole = file.read_bytes()
        for _ in range(5):
            bit = generator.randrange(8 * len(whole))
            raw = bytearray(whole)
            raw[bit // 8] ^= 1 << bit % 8
            file.write_bytes(raw)
            told = served.ask("GET", f"/api/jobs/{looked}").told
            said = [told.get("damaged", ""), told["states"].get("look", {}).get("error") or ""]
            said += [words for _, words in ask_all(served, looked).values()]
            assert any(f"{file.name} " in words and "is damaged" in words for words in said) or (
                file.name == "record.h5" and "drop_060.h5 is damaged" in " ".join(said)
            ), (file.name, bit, said)
            assert str(served.space.path) not in " ".join(said)
            assert served.ask("GET", "/api/jobs").status == 200
            file.write_bytes(whole)
    assert {status for status, _ in ask_all(served, looked).values()} == {200}


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"\xff", None])
def test_a_damaged_job_is_shown_as_damaged_and_can_be_removed(served, files, content):
    whole, job = served.new_job({}), served.new_job({"record": files["record"]})
    file = served.space.jobs_folder / job / "job.json"
    file.unlink() if content is None else file.write_bytes(content)
    listed = {one["id"]: one for one in served.ask("GET", "/api/jobs").told["jobs"]}
    assert "job.json is damaged" in listed[job]["damaged"]
    assert "damaged" not in listed[whole]
    for answer in (
        served.order(f"/api/jobs/{job}/look"),
        served.order(f"/api/jobs/{job}/options", {"gap": "1 mm"}),
        served.ask("PUT", f"/api/jobs/{job}/files/tail?name=a.csv", b"x"),
    ):
        assert (answer.status, "remove the drop, and send its files again" in answer.text) == (409, True)
    assert served.ask("GET", "/api/log").status == 200
    again = Served(Workspace(served.space.path))
    assert job in [one["id"] for one in again.ask("GET", "/api/jobs").told["jobs"]]
    again.stop()
    assert served.ask("DELETE", f"/api/jobs/{job}").status == 204
    assert not file.parent.exists()


def test_a_damaged_state_is_a_failure_that_is_asked_again(served, looked):
    file = served.space.jobs_folder / looked / "look.state.json"
    for content in (b"", b"[]", b'{"state": "running"}'):
        file.write_bytes(content)
        Runner(Workspace(served.space.path)).take_over()
        state = served.ask("GET", f"/api/jobs/{looked}").told["states"]["look"]
        assert (state["state"], "look.state.json is damaged" in state["error"]) == ("failed", True)
    served.order(f"/api/jobs/{looked}/look", {"gap": "300 um"})
    assert served.settled(looked, "look")["state"] == "done"


@on_posix
@pytest.mark.parametrize("kind", NO_FILE)
def test_what_is_no_file_is_named_where_one_should_be_and_the_rest_works(served, looked, tmp_path, kind):
    """Whatever the page reads of its folder; a file that is new is tried too."""
    space = Workspace(tmp_path / "served")
    space.prepare()
    job = Job(space.jobs_folder / looked)
    shutil.copytree(served.space.jobs_folder / looked, job.path)
    written = sorted(str(file.relative_to(job.path)) for file in job.path.rglob("*") if file.is_file())
    server = Served(space)
    whole = server.new_job({})
    for name in written:
        shutil.rmtree(job.path)
        shutil.copytree(served.space.jobs_folder / looked, job.path)
        (job.path / name).unlink()
        NO_FILE[kind](job.path / name)
        listed = {one["id"]: one for one in server.ask("GET", "/api/jobs").told["jobs"]}
        assert listed.keys() == {looked, whole}
        told = server.ask("GET", f"/api/jobs/{looked}").told
        answers = ask_all(server, looked)
        said = [told.get("damaged", ""), told["states"].get("look", {}).get("error") or ""]
        said += [words for _, words in answers.values()]
        if not name.endswith((".lock", ".process")):
            outside = "drop_060.h5 lies outside the folder of this drop"
            label = "drop_060.h5" if name == "files/record.h5" else Path(name).name
            assert any(
                f"{label} is damaged" in words or f"{label} of 'look' is damaged" in words or outside in words
                for words in said
            ), (name, said)
        assert str(space.path) not in " ".join(said)
        asked = [
            server.order(f"/api/jobs/{looked}/look"),
            server.order(f"/api/jobs/{looked}/options", {"gap": "1 mm"}),
            server.ask("PUT", f"/api/jobs/{looked}/files/tail?name=a.csv", b"x"),
            server.ask("PUT", f"/api/jobs/{looked}/files/record?name=a.h5", b"x"),
        ]
        assert asked[-1].status == (409 if name == "job.json" else 201)
        statuses = [status for status, _ in answers.values()] + [answer.status for answer in asked]
        assert max(statuses) < 500, (name, statuses, [answer.text for answer in asked])
        again = Served(Workspace(space.path))
        assert {one["id"] for one in again.ask("GET", "/api/jobs").told["jobs"]} == {looked, whole}
        again.stop()
        assert server.ask("DELETE", f"/api/jobs/{looked}").status == 204
        assert not job.path.exists()
        job.path.mkdir()
    server.stop()


@on_posix
@pytest.mark.parametrize("kind", NO_FILE)
@pytest.mark.parametrize("name", ["token", "jobs have digests", "drops.db", "jobs/0123456789abcdef"])
def test_what_is_no_file_beside_the_jobs_keeps_no_page_from_being_served(tmp_path, kind, name):
    space = Workspace(tmp_path / "served")
    space.prepare()
    space.token()
    (space.path / name).unlink(missing_ok=True)
    NO_FILE[kind](space.path / name)
    try:
        server = Served(Workspace(space.path))
    except RotordropError as refusal:
        assert name == "token" and "token is no file" in str(refusal)
        return
    asked = [server.ask("GET", path) for path in ("/api/jobs", "/api/log")]
    asked.append(server.order("/api/jobs", {"name": "drop"}))
    server.stop()
    assert [answer.status for answer in asked] == [200, 200, 201]
    no_log = name == "drops.db" and kind != "link that leads nowhere"
    assert ("drops.db is no file" in asked[1].text) == no_log


def test_a_record_that_leads_out_of_its_folder_is_not_served(served, files, tmp_path):
    (tmp_path / "secret.csv").write_text("secret")
    job = Job(served.space.jobs_folder / served.new_job({"record": files["record"]}))
    record = job.path / "files" / "record.h5"
    record.unlink()
    record.symlink_to(tmp_path / "secret.csv")
    refusals = [served.ask("GET", f"/api/jobs/{job.number}/files/record")]
    told = job.read()
    told["files"]["record"]["stored"] = "../../../../secret.csv"
    job.write(told)
    refusals.append(served.ask("GET", f"/api/jobs/{job.number}/files/record"))
    for answer in refusals:
        assert (answer.status, "drop_060.h5 lies outside the folder of this drop" in answer.text) == (
            409,
            True,
        )


def test_a_folder_of_an_earlier_version_is_given_digests_once(served, looked, tmp_path):
    space = Workspace(tmp_path)
    space.prepare()
    (tmp_path / "jobs have digests").unlink()
    job = Job(space.jobs_folder / looked)
    shutil.copytree(served.space.jobs_folder / looked, job.path)
    for file in job.path.glob("*.json"):
        told = json.loads(file.read_text())
        for key in (DIGEST, "files") if file.name == "look.result.json" else (DIGEST,):
            told.pop(key)
        file.write_text(json.dumps(told))
    space.prepare()
    assert result_folder(job, "look") is not None
    (job.path / "job.json").write_text("{}")
    space.prepare()
    assert json.loads((job.path / "job.json").read_text()) == {}


def test_a_log_that_is_damaged_hides_no_estimate(tmp_path):
    (tmp_path / "drops.db").write_text("no data base " * 100)
    server = Served(Workspace(tmp_path / "served"), log=str(tmp_path / "drops.db"))
    answer = server.ask("GET", "/api/log").told
    server.stop()
    assert (answer["drops"], "is not a log of drops" in answer["problem"]) == ([], True)
    assert str(tmp_path) not in answer["problem"]


@pytest.mark.parametrize("files", [True, False])
def test_the_empty_folder_of_a_job_that_was_never_made_goes(tmp_path, files):
    place = tmp_path / "served" / "jobs" / ("0" * 16)
    (place / "files" if files else place).mkdir(parents=True)
    Workspace(tmp_path / "served").prepare()
    assert not place.exists()


def test_port_80_is_the_page_too(tmp_path):
    from rotordrop.web.guard import Guard

    for port, hosts in ((80, [b"127.0.0.1", b"127.0.0.1:80", b"localhost"]), (81, [b"127.0.0.1:81"])):
        guard = Guard(None, port=port, token="t")
        for host in (b"127.0.0.1", b"127.0.0.1:80", b"localhost", b"127.0.0.1:81", b"other"):
            scope = {
                "path": "/",
                "method": "GET",
                "headers": [(b"host", host), (b"origin", b"http://" + host)],
            }
            assert (guard.refusal(scope) is None) == (host in hosts), (port, host)


def test_few_machines_are_made_at_once(monkeypatch):
    running, most, lock = [0], [0], threading.Lock()

    def slow(*_, **__):
        with lock:
            running[0] += 1
            most[0] = max(most[0], running[0])
        threading.Event().wait(0.05)
        with lock:
            running[0] -= 1
        return subprocess.CompletedProcess([], 0, b"{}", b"")

    monkeypatch.setattr(commands.subprocess, "run", slow)
    threads = [threading.Thread(target=numbers._said_by, args=([],)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most[0] == 2


def test_a_process_that_makes_a_machine_has_limits(monkeypatch):
    monkeypatch.setattr(numbers, "MEMORY", 2**20)
    numbers.schema_of_numbers.cache_clear()
    with pytest.raises(Exception, match=r"Memory|memory|make no machine"):
        numbers.schema_of_numbers()


READ_ONLY = """
import json, os, sys
from pathlib import Path
from rotordrop.web.workspace import Workspace
from tests.unit.web.serving import Served
job = sys.argv[2]
server = Served(Workspace(Path(sys.argv[1])))
asked = [("POST", "/api/jobs", b"{}"), ("POST", f"/api/jobs/{job}/options", b'{"gap": "1 mm"}'),
         ("DELETE", f"/api/jobs/{job}", None), ("PUT", f"/api/jobs/{job}/files/tail?name=a.csv", b"x"),
         ("POST", f"/api/jobs/{job}/look", b"{}"), ("GET", "/api/jobs", None)]
print(json.dumps([[answer.status, answer.text] for answer in (server.ask(*one) for one in asked)]))
server.stop()
"""


@pytest.mark.skipif(shutil.which("setpriv") is None, reason="a right must be given up")
def test_a_folder_that_may_only_be_read_is_shown_and_refuses_in_words():
    folder = Path(tempfile.mkdtemp(prefix="page"))  # the folders of pytest are closed to other users
    space = Workspace(folder)
    space.prepare()
    space.token()
    job = space.new_job("drop", {})
    job.write({**job.read(), "files": {"record": {"name": "a.csv", "stored": "record.csv", "sha256": ""}}})
    places = [folder, *folder.rglob("*")]
    for place in places:
        place.chmod(0o555 if place.is_dir() else 0o444)
    command = [sys.executable, "-c", READ_ONLY, str(folder), job.number]
    if os.geteuid() == 0:  # who may write whatever the mode says
        command = ["setpriv", "--bounding-set=-dac_override", *command]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    *refused, (status, listed) = json.loads(done.stdout)
    assert status == 200 and job.number in listed
    for status, words in refused:
        assert (status, "the folder of the page cannot be written" in words) == (400, True), words
        assert str(folder) not in words
    for place in places:
        place.chmod(0o755)
    shutil.rmtree(folder)


def test_a_computation_that_goes_on_is_said(served, files, monkeypatch):
    monkeypatch.setattr(running, "_locked", lambda job, verb: verb == "estimate")
    served.new_job({})
    assert set(running.running(served.space)) == {"estimate"}


def test_a_file_that_is_removed_while_it_is_asked_for_is_no_error_of_the_server(served, monkeypatch):
    """Six clients that read and removed at once met a traceback."""
    job = served.new_job({"record": ("a.csv", b"x" * 3_000_000)})
    assert served.ask("GET", f"/api/jobs/{job}/files/record").body == b"x" * 3_000_000
    whole = Job.file

    def removed_meanwhile(self, role):
        found = whole(self, role)
        found.unlink()
        return found

    monkeypatch.setattr(Job, "file", removed_meanwhile)
    answer = served.ask("GET", f"/api/jobs/{job}/files/record")
    assert (answer.status, "it has been removed" in answer.text) == (404, True)
