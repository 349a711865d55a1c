"""The list of drops and their results; what has changed in the folder is named, and the rest works."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from tests.no_file import NO_FILE, on_posix
from tests.unit.web.made_drops import estimated
from tests.unit.web.serving import Served

from rotordrop.jobs.runner import Runner, result_folder
from rotordrop.jobs.workspace import Job, Workspace
from rotordrop.web.app import make_app
from rotordrop.web.guard import Guard


@pytest.fixture(scope="module")
def looked(served, files):
    job = served.new_job({"record": files["record"]}, gap="300 um", speed="60 Hz")
    served.done(job, "look")
    return job


def ask_all(served, job):
    """Everything that shows a result or its files: status and words."""
    asked = ("page", "document", "window?column=y0&start=0&end=0.01", "csv?column=y0&start=0&end=0.01")
    answers = {what: served.ask("GET", f"/api/jobs/{job}/look/{what}") for what in asked}
    answers["record"] = served.ask("GET", f"/api/jobs/{job}/files/record")
    return {what: (one.status, one.text if one.status != 200 else "") for what, one in answers.items()}


def listed(server):
    return {one["id"]: one for one in server.ask("GET", "/api/jobs").told["jobs"]}


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"\xff", None])
def test_a_damaged_job_is_shown_as_damaged_and_can_be_removed(served, files, content):
    whole, job = served.new_job({}), served.new_job({"record": files["record"]})
    file = served.space.jobs_folder / job / "job.json"
    file.unlink() if content is None else file.write_bytes(content)
    assert "job.json is damaged" in listed(served)[job]["damaged"]
    assert "damaged" not in listed(served)[whole]
    for answer in (
        served.order(f"/api/jobs/{job}/look"),
        served.order(f"/api/jobs/{job}/options", {"gap": "1 mm"}),
        served.put(job, "tail", "a.csv", b"x"),
    ):
        assert (answer.status, "remove the drop, and send its files again" in answer.text) == (409, True)
    make_app(Workspace(served.space.path), port=1)  # as another server begins
    assert job in listed(served)
    assert served.ask("DELETE", f"/api/jobs/{job}").status == 204
    assert not file.parent.exists() and served.ask("GET", f"/api/jobs/{job}").status == 404


def test_a_damaged_state_is_a_failure_that_is_asked_again(served, looked):
    file = served.space.jobs_folder / looked / "look.state.json"
    for content in (b"", b"[]", b'{"state": "running"}'):
        file.write_bytes(content)
        Runner(Workspace(served.space.path)).take_over()
        state = served.ask("GET", f"/api/jobs/{looked}").told["states"]["look"]
        assert (state["state"], "look.state.json is damaged" in state["error"]) == ("failed", True)
    served.done(looked, "look", {"gap": "300 um"})


@pytest.fixture(scope="module")
def copied(looked, served, tmp_path_factory):
    """A server of a folder of its own for copies of the job."""
    server = Served(Workspace(tmp_path_factory.mktemp("copied") / "served"))
    yield server
    server.stop()


@on_posix
@pytest.mark.parametrize("kind", NO_FILE)
def test_what_is_no_file_is_named_where_one_should_be_and_the_rest_works(served, looked, copied, kind):
    """Whatever the page reads of its folder; a file that is new is tried too."""
    original, job = served.space.jobs_folder / looked, Job(copied.space.jobs_folder / looked)
    written = sorted(str(file.relative_to(original)) for file in original.rglob("*") if file.is_file())
    expected = {
        "job.json",
        "look.result.json",
        "look.state.json",
        f"{result_folder(Job(original), 'look').name}/motion.values.npy",
        "files/record.h5",
    }
    assert expected <= {*written}
    whole = copied.new_job({})
    for name in written:
        shutil.copytree(original, job.path)
        (job.path / name).unlink()
        NO_FILE[kind](job.path / name)
        assert {looked, whole} <= listed(copied).keys()
        told = copied.ask("GET", f"/api/jobs/{looked}").told
        answers = ask_all(copied, looked)
        said = [told.get("damaged", ""), told["states"].get("look", {}).get("error") or ""]
        said += [words for _, words in answers.values()]
        if not name.endswith((".lock", ".process")):
            label = "drop_060.h5" if name == "files/record.h5" else Path(name).name
            named = rf"{label} (of 'look' )?is damaged|drop_060\.h5 lies outside the folder of this drop"
            assert any(re.search(named, words) for words in said), (name, said)
        assert str(copied.space.path) not in " ".join(said)
        asked = [
            copied.order(f"/api/jobs/{looked}/look"),
            copied.order(f"/api/jobs/{looked}/options", {"gap": "1 mm"}),
            copied.put(looked, "tail", "a.csv", b"x"),
            copied.put(looked, "record", "a.h5", b"x"),
        ]
        assert asked[-1].status == (409 if name == "job.json" else 201)
        statuses = [status for status, _ in answers.values()] + [answer.status for answer in asked]
        assert max(statuses) < 500, (name, statuses, [answer.text for answer in asked])
        make_app(Workspace(copied.space.path), port=1)  # as another server begins
        assert {looked, whole} <= listed(copied).keys()
        assert copied.ask("DELETE", f"/api/jobs/{looked}").status == 204
        assert not job.path.exists()


def test_a_record_that_was_changed_or_leads_out_of_its_folder_is_not_served(served, files, tmp_path):
    (tmp_path / "secret.csv").write_text("secret")
    job = Job(served.space.jobs_folder / served.new_job({"record": files["record"]}))
    record = job.path / "files" / "record.h5"

    def refused(words):
        answer = served.ask("GET", f"/api/jobs/{job.number}/files/record")
        assert (answer.status, words in answer.text) == (409, True), answer.text

    record.write_bytes(record.read_bytes()[:-1] + b"x")
    refused("drop_060.h5 is damaged")
    record.unlink()
    record.symlink_to(tmp_path / "secret.csv")
    refused("drop_060.h5 lies outside the folder of this drop")
    told = job.read()
    told["files"]["record"]["stored"] = "../../../../secret.csv"
    job.write(told)
    refused("drop_060.h5 lies outside the folder of this drop")


def test_port_80_is_the_page_too():
    for port, hosts in ((80, [b"127.0.0.1", b"127.0.0.1:80", b"localhost"]), (81, [b"127.0.0.1:81"])):
        guard = Guard(None, port=port, token="t")
        for host in (b"127.0.0.1", b"127.0.0.1:80", b"localhost", b"127.0.0.1:81", b"other"):
            headers = [(b"host", host), (b"origin", b"http://" + host)]
            refusal = guard.refusal({"path": "/", "method": "GET", "headers": headers})
            assert (refusal is None) == (host in hosts), (port, host)


READ_ONLY = """
import json, os, sys
from pathlib import Path
from rotordrop.jobs.workspace import Workspace
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


@pytest.mark.parametrize("harm", ["changed", "cut", "gone"])
@pytest.mark.parametrize("number", range(4))
def test_a_damaged_result_is_named_in_its_row_and_hides_no_other(server, harm, number):
    """Any file of it, one of those that the figures are drawn from too."""
    broken, whole = (estimated(server, name, name * 64, 1000.0) for name in "ab")
    files = sorted((server.space.job(broken).path / f"estimate.{'0' * 16}").iterdir())
    file = files[number % len(files)]
    content = file.read_bytes()
    file.unlink()
    if harm != "gone":
        file.write_bytes(content[:-5] if harm == "cut" else content[:-1] + bytes([content[-1] ^ 1]))
    rows = listed(server)
    assert f"{file.name} of 'estimate' is damaged" in rows[broken]["row"]["damaged"]
    assert "force" not in rows[broken]["row"]
    assert rows[whole]["row"]["force"]["value"] == 1000.0
