"""Jobs: a look from upload to figures, cancelling, and nothing finished lost whoever is killed."""

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from rotordrop import load_machine, look
from rotordrop.cli.app import run
from rotordrop.files import digest_of_file, without_digest
from rotordrop.jobs import runner
from rotordrop.jobs.runner import Runner, publish, published_run, result_folder, state_of
from rotordrop.jobs.workspace import Job, Workspace

posix = pytest.mark.skipif(os.name != "posix", reason="locks are inherited on POSIX systems only")


@pytest.fixture(scope="module")
def looked(served, files):
    job = served.new_job(files)
    served.done(job, "look")
    return job


@pytest.fixture(scope="module")
def seen(files):
    """The look at the record in Python."""
    return look(files["record"], machine=load_machine(files["machine"]))


def test_a_look_on_the_page_says_what_a_look_in_python_says(served, looked, seen):
    document = without_digest(served.document(looked, "look"), "the page", "ask again")
    found = tuple(one for one in seen.findings if one.kind != "record ends before standstill")
    assert len(found) == len(seen.findings) - 1  # a tail was sent
    said = {**replace(seen, findings=found).as_json(), "record": "drop_060"}
    assert document == json.loads(json.dumps(said))
    page = served.ask("GET", f"/api/jobs/{looked}/look/page").told
    assert [impact["time"] for impact in page["impacts"]] == [impact.time for impact in seen.impacts]
    assert [(one["time"], one["words"]) for one in page["timeline"]] == list(seen.timeline())
    assert page["row"]["falls"]
    body = served.ask("GET", f"/api/jobs/{looked}/look/window?column=y0&start=0&end=0.01").body
    count = int(np.frombuffer(body, "<u4", 1, 8)[0])
    values = np.frombuffer(body, "<f4", count, 16 + 4 * count)
    first = int(np.searchsorted(seen.motion.time, np.frombuffer(body, "<f8", 1)[0]))
    vertical = seen.motion.paths[0].position[first : first + count, 1]
    np.testing.assert_array_equal(values, vertical.astype("f4"))


def test_a_table_holds_every_sample_of_a_window(served, looked, seen):
    text = served.ask("GET", f"/api/jobs/{looked}/look/csv?column=x0&column=y0&start=0&end=1").text
    head, *rows = text.strip().split("\n")
    assert head == "time [s],NDE x [m],NDE y [m],simulated"
    inside = (seen.motion.time >= 0) & (seen.motion.time <= 1)
    assert all(row.endswith(",yes") for row in rows)
    table = np.array([[float(cell) for cell in row.split(",")[:-1]] for row in rows])
    np.testing.assert_array_equal(table[:, 0], seen.motion.time[inside])
    np.testing.assert_allclose(table[:, 1:], seen.motion.paths[0].position[inside], rtol=1e-7, atol=1e-18)


def test_a_record_alone_is_looked_at_with_the_gap_given_until_another_comes(served, files):
    job = served.new_job({"record": files["record"]}, gap="300 um", speed="60 Hz")
    served.done(job, "look")
    document = served.document(job, "look")
    assert {plane["air_gap_m"] for plane in document["planes"]} == {300e-6}
    assert document["speed_rad_per_s"] == pytest.approx(2 * np.pi * 60)
    page = served.ask("GET", f"/api/jobs/{job}/look/page").told
    assert [place["gap"] for place in page["places"]] == [[300e-6, 300e-6]] * 2
    made, before = served.space.job(job).path / "look.made", served.space.job(job).digests()
    assert served.put(job, "record", "other.csv", b"time [s]\n").status == 201
    assert served.ask("GET", f"/api/jobs/{job}").told["states"] == {}
    assert served.ask("GET", f"/api/jobs/{job}/look/page").status == 404
    made.mkdir()
    publish(served.space.job(job), "look", "0" * 16, made, before)  # of files that were replaced meanwhile
    assert published_run(served.space.job(job), "look") is None
    assert served.ask("GET", f"/api/jobs/{job}/look/page").status == 404


@pytest.mark.slow
def test_a_waterfall_has_its_report_and_document_and_no_histories(served, files):
    job = served.new_job(files)
    served.done(job, "waterfall")
    assert set(served.document(job, "waterfall")["planes"]) == {"NDE", "DE"}
    assert "Frequencies of a coast-down of LP-400" in report_of(served, job, "waterfall")
    window = served.ask("GET", f"/api/jobs/{job}/waterfall/window?column=x0")
    assert (window.status, window.text) == (404, "this result has no histories")


def report_of(served, job, verb):
    """A report by its own address, which carries no token and opens nothing else."""
    address = served.ask("GET", f"/api/jobs/{job}").told["states"][verb]["report"]
    host = [("Host", f"127.0.0.1:{served.port}")]
    report = served.ask("GET", address, headers=host)
    assert report.headers["content-security-policy"].startswith("sandbox allow-scripts")
    assert report.headers["x-frame-options"] == "SAMEORIGIN"
    for other in (f"{address}0", address.replace(verb, "channels"), address[:-64] + "0" * 64):
        refused = served.ask("GET", other, headers=host)
        assert (refused.status, "no such report" in refused.text) == (404, True)
    return report.text


def test_look_and_machine_have_their_reports(served, looked):
    assert "A look at drop_060" in report_of(served, looked, "look")
    served.done(looked, "check")
    said = report_of(served, looked, "check")
    places = [said.index(part) for part in ("mass</dt>", "<h2>Rotor", "<h2>Damped critical", "share of the")]
    assert places == sorted(places)
    assert served.document(looked, "check")["machine"].startswith("LP-400")


@pytest.mark.parametrize("verb", ["estimate", "waterfall"])
def test_what_needs_a_machine_says_so(served, files, verb):
    job = served.new_job({"record": files["record"]})
    assert "needs the machine file" in served.failed(job, verb, {"method": "tracked"})


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"method": "guess"}, "the method is 'guess'; there are tracked, replay"),
        ({"path": "/etc"}, "there is no option 'path'"),
        ({"gap": 3}, "the option gap is '3'; expected a text"),
    ],
)
def test_an_option_that_is_none_is_refused(served, looked, options, words):
    answer = served.order(f"/api/jobs/{looked}/estimate", options)
    assert answer.status == 400
    assert words in answer.text


@pytest.mark.slow
@posix
def test_an_estimate_is_cancelled_with_all_it_began(served, files):
    job = served.new_job(files)
    served.order(f"/api/jobs/{job}/estimate")
    folder = served.space.jobs_folder / job
    until = time.monotonic() + 600
    while not (folder / "estimate.process").is_file() or not (folder / "estimate.process").read_text():
        assert time.monotonic() < until
        time.sleep(0.05)
    process = int((folder / "estimate.process").read_text())
    answer = served.order(f"/api/jobs/{job}/estimate/cancel")
    assert answer.told["states"]["estimate"]["state"] == "cancelled"
    with pytest.raises(ProcessLookupError):
        while time.monotonic() < until:  # what was killed has a number until its parent asks for it
            os.killpg(process, 0)
            time.sleep(0.05)
    assert [entry.name for entry in folder.iterdir() if entry.is_dir()] == ["files"]


def test_what_waits_is_cancelled_too(tmp_path, monkeypatch):
    monkeypatch.setitem(runner.AT_ONCE, "look", 0)
    space = Workspace(tmp_path)
    space.prepare()
    queue, job = Runner(space), space.new_job("drop", {})
    assert queue.ask(job, "look", {})["state"] == "waiting"
    queue.cancel(job, "look")
    assert state_of(job, "look")["state"] == "cancelled"


@pytest.mark.slow
@posix
def test_a_child_that_is_killed_is_told_of_and_the_older_result_stays(served, files):
    job = served.new_job({"record": files["record"]})
    served.order(f"/api/jobs/{job}/look")
    served.settled(job, "look")
    old, told = published_run(served.space.job(job), "look"), served.space.jobs_folder / job / "look.process"
    first = told.read_text()
    served.order(f"/api/jobs/{job}/look", {"gap": "270 um"})
    while told.read_text() in (first, ""):
        time.sleep(0.01)
    os.kill(int(told.read_text()), signal.SIGKILL)
    state = served.settled(job, "look")
    assert state["state"] == "failed"
    assert "ended from outside before it was done; start it again" in state["error"]
    assert published_run(served.space.job(job), "look") == old
    assert served.ask("GET", f"/api/jobs/{job}/look/page").status == 200


_KILLED_SERVER = """
import sys, time
from pathlib import Path
from rotordrop.jobs.runner import Runner
from rotordrop.jobs.workspace import Job, Workspace
space = Workspace(Path(sys.argv[1])); space.prepare()
runner = Runner(space); runner.take_over()
for job in space.jobs():
    runner.ask(job, "look", {})
while True:
    runner.tend(); time.sleep(0.01)
"""


@posix
@pytest.mark.slow
def test_no_finished_job_is_lost_whenever_server_or_child_is_killed(tmp_path, files):
    """A hundred deaths at random moments: what was published before is there after, whole."""
    generator = random.Random(5)
    space = Workspace(tmp_path)
    space.prepare()
    job = space.new_job("drop", {})
    (job.path / "files" / "record.h5").write_bytes(files["record"].read_bytes())
    digest = digest_of_file(files["record"])
    entry = {"name": "a.h5", "stored": "record.h5", "bytes": 1, "sha256": digest}
    job.write({**job.read(), "files": {"record": entry}})
    runner, begun = Runner(space), time.monotonic()
    runner.ask(job, "look", {})
    while state_of(job, "look")["state"] == "running":
        runner.tend()
        time.sleep(0.02)
    usual, published = time.monotonic() - begun, 0
    for turn in range(100):
        before = published_run(job, "look")
        server = subprocess.Popen(
            [sys.executable, "-c", _KILLED_SERVER, str(tmp_path)],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
        time.sleep(usual * generator.uniform(0.1, 1.3))
        if turn % 2 and (job.path / "look.process").is_file():
            with contextlib.suppress(ProcessLookupError, ValueError):
                os.killpg(int((job.path / "look.process").read_text()), signal.SIGKILL)
        server.kill()
        server.wait()
        after = published_run(job, "look")
        assert before is None or after is not None
        published += after != before
        # so that deaths fall into all parts of a look on any computer, however busy it is meanwhile
        usual *= 0.9 if after != before else 1.05
        if after is not None:
            page = result_folder(job, "look") / "page.json"
            assert json.loads(page.read_text())["statement"]["text"]
    assert published > 10
    until = time.monotonic() + 600
    runner = Runner(space)
    runner.take_over()
    while state_of(job, "look")["state"] == "running" and time.monotonic() < until:
        runner.tend()
        time.sleep(0.05)
    runner.tend()
    assert state_of(job, "look")["state"] in ("done", "failed")


def test_the_first_page_loads_no_compiler():
    program = (
        "import sys, tempfile; from pathlib import Path; from rotordrop.jobs.workspace import Workspace;"
        "from rotordrop.web.app import make_app; make_app(Workspace(Path(tempfile.mkdtemp())), port=1);"
        "print([name for name in ('numba', 'numpy', 'scipy', 'plotly', 'h5py') if name in sys.modules])"
    )
    env = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    assert subprocess.check_output([sys.executable, "-c", program], env=env).strip() == b"[]"


@posix
def test_the_folder_of_the_page_is_the_users_own(served):
    for place in (served.space.path, served.space.path / "token"):
        assert place.stat().st_mode & 0o077 == 0


@posix
def test_a_folder_with_other_things_keeps_its_permissions_and_its_jobs_are_closed(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    tmp_path.chmod(0o755)
    space = Workspace(tmp_path)
    space.prepare()
    modes = [folder.stat().st_mode & 0o777 for folder in (space.path, space.jobs_folder)]
    assert modes == [0o755, 0o700]


def test_what_cannot_be_the_folder_is_named(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert run(["serve", "--folder", str(tmp_path / "file"), "--port", "0"]) == 6
    told = " ".join(capsys.readouterr().err.split())
    assert "file cannot be the folder of the page: Not a directory; name another one with --folder" in told


def test_a_damaged_token_is_replaced(tmp_path):
    (tmp_path / "token").write_bytes(b"\xff\xfe")
    space = Workspace(tmp_path)
    made = space.token()
    assert len(made) == 43
    assert space.token() == made


def test_a_job_removed_meanwhile_hides_no_other(served, monkeypatch):
    kept, gone, read = served.new_job({}), served.new_job({}), Job.read

    def removed_before_it_is_read(job):
        if job.number == gone:
            raise FileNotFoundError(job.path)
        return read(job)

    monkeypatch.setattr(Job, "read", removed_before_it_is_read)
    found = served.ask("GET", "/api/jobs")
    assert found.status == 200
    numbers = [one["id"] for one in found.told["jobs"]]
    assert kept in numbers and gone not in numbers
