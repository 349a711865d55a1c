"""Drops to compare with: estimates of the page and entries of a log, with the numbers that the log keeps."""

from __future__ import annotations

import json

from tests.published import bearing, published, value
from tests.unit.web.serving import Served

from rotordrop.ledger.book import LoggedDrop, Severity, add_drop
from rotordrop.web.running import publish
from rotordrop.web.workspace import Workspace


def estimated(server: Served, name: str, sha256: str, peak: float) -> str:
    number = server.order("/api/jobs", {"name": name}).told["id"]
    job = server.space.job(number)
    made = job.path / "estimate.made"
    made.mkdir()
    peaks = {"peak_force_N": value(peak, 0.9 * peak, 1.1 * peak), "peak_stress_Pa": value(1e9)}
    document = published(machine="LP-400", record=name, record_sha256=sha256, bearings={"DE": bearing(peaks)})
    (made / "document.json").write_text(json.dumps(document.as_json()))
    publish(job, "estimate", "0" * 16, made)
    return str(number)


def test_estimates_and_the_log_without_what_is_in_both(tmp_path):
    log = tmp_path / "drops.sqlite"
    for sha256, peak in (("a" * 64, 3000.0), ("b" * 64, 2000.0)):
        severity = Severity(bearing="DE", quantity="peak_force_N", unit="N", value=peak, lower=1.0, upper=9e3)
        drop = LoggedDrop(
            machine="LP-400", bearing_set="1", record=f"drop {peak:.0f}", sha256=sha256, speed=377.0,
            recorded="2019-10-16T13:42:07", method="tracked", verdict="", severity=(severity,),
        )  # fmt: skip
        add_drop(log, drop)
    server = Served(Workspace(tmp_path / "space"), log=str(log))
    try:
        job = estimated(server, "mine", "a" * 64, 3100.0)
        told = server.ask("GET", "/api/drops").told
        assert told["log"]
        found = {drop["name"]: drop for drop in told["drops"]}
        assert list(found) == ["mine", "drop 2000"]
        assert found["mine"]["job"] == job
        (number,) = found["mine"]["numbers"]
        assert (number["value"], number["lower"], number["quantity"]) == (
            3100.0,
            2790.0,
            "peak bearing force",
        )
        assert number["SI"] == ["3\u202f100 N", "2\u202f790 to 3\u202f410 N"]
        logged = found["drop 2000"]
        assert (logged["log"], logged["recorded"]) == (2, "2019-10-16T13:42:07")
        assert "drop = logged_drops(LOG)[2]" in logged["python"]
        assert str(tmp_path) not in json.dumps(told)
    finally:
        server.stop()


def test_a_log_that_is_not_there_is_named(tmp_path):
    server = Served(Workspace(tmp_path / "space"), log="none.sqlite")
    try:
        answer = server.ask("GET", "/api/drops")
        assert (answer.status, answer.told["drops"]) == (200, [])
        assert "none.sqlite is not there" in answer.told["problem"]
    finally:
        server.stop()


def test_without_a_log_there_are_the_drops_of_the_page(served):
    job = estimated(served, "alone", "c" * 64, 1000.0)
    told = served.ask("GET", "/api/drops").told
    assert not told["log"]
    assert job in [drop["job"] for drop in told["drops"]]
