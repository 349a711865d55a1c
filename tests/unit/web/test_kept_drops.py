"""The list of drops: rows of jobs, what people say of them, and the log with its one click."""

from __future__ import annotations

import json

import numpy as np
import pytest
from tests.unit.web.made_drops import SPEED, estimated
from tests.unit.web.serving import Served

from rotordrop.ledger.book import LoggedDrop, Severity, add_drop, allow, logged_drops
from rotordrop.web.workspace import Workspace


def listed(server: Served) -> dict[str, dict]:
    return {one["id"]: one for one in server.ask("GET", "/api/jobs").told["jobs"]}


def test_the_row_of_a_drop_says_what_its_estimate_says(server):
    number = estimated(
        server, "mine", "a" * 64, 3100.0, recorded="2019-10-16T13:42:07", simulated_record=True
    )
    row = listed(server)[number]["row"]
    assert (row["machine"], row["recorded"], row["simulated"]) == ("LP-400", "2019-10-16T13:42:07", True)
    assert row["speed"]["value"] == pytest.approx(SPEED)
    (force,) = row["numbers"]  # a stress without an interval is no evidence
    assert (force["field"], force["value"], force["lower"]) == ("peak_force_N", 3100.0, 2790.0)
    assert force["SI"] == ["3\u202f100 N", "2\u202f790 to 3\u202f410 N"]
    assert row["statement"] == {"text": "The model is consistent.", "level": "good"}


def test_the_thumbnail_is_the_orbit_in_its_clearance_circle(server):
    number = estimated(server, "round", "a" * 64, 3100.0)
    orbit = listed(server)[number]["row"]["orbit"]
    points = np.array([[float(v) for v in point.split(",")] for point in orbit["path"].split()]) - 50.0
    assert len(points) > 100
    assert np.hypot(*points.T) == pytest.approx(orbit["gap"], abs=0.8)  # whole units of a thumbnail
    angle = np.unwrap(np.arctan2(-points[:, 1], points[:, 0]))  # down the picture is down
    assert angle[-1] - angle[0] == pytest.approx(0.15 * SPEED, rel=0.02)


@pytest.mark.parametrize("harm", ["changed", "cut", "gone"])
@pytest.mark.parametrize("number", range(4))
def test_a_damaged_result_is_named_in_its_row_and_hides_no_other(server, harm, number):
    """Any file of it, one of those that the thumbnail is drawn from too."""
    broken, whole = (estimated(server, name, name * 64, 1000.0) for name in "ab")
    files = sorted((server.space.job(broken).path / f"estimate.{'0' * 16}").iterdir())
    file = files[number % len(files)]
    content = file.read_bytes()
    file.unlink()
    if harm != "gone":
        file.write_bytes(content[:-5] if harm == "cut" else content[:-1] + bytes([content[-1] ^ 1]))
    rows = listed(server)
    assert f"{file.name} of 'estimate' is damaged" in rows[broken]["row"]["damaged"]
    assert "numbers" not in rows[broken]["row"]
    assert rows[whole]["row"]["numbers"][0]["value"] == 1000.0


def test_a_drop_is_renamed_tagged_and_put_away_and_its_estimate_stays(server):
    number = estimated(server, "mine", "a" * 64, 3100.0)
    said = {"name": " March trip ", "tags": ["cold", "cold ", ""], "note": "first\nsecond", "archived": True}
    assert server.order(f"/api/jobs/{number}/label", said).status == 200
    server.order(
        f"/api/jobs/{number}/label", {"notes": [{"time": 0.2, "text": "b"}, {"time": -1, "text": "a"}]}
    )
    one = listed(server)[number]
    assert one["name"] == "March trip"
    assert one["label"] == {
        "tags": ["cold"],
        "note": "first\nsecond",
        "archived": True,
        "notes": [{"time": -1.0, "text": "a"}, {"time": 0.2, "text": "b"}],
    }
    assert one["row"]["numbers"][0]["value"] == 3100.0


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"colour": "red"}, "there is no 'colour' of a drop; there are name, note"),
        ({"archived": "yes"}, "archived is 'yes'; expected bool"),
        ({"note": "x" * 2001}, "note holds 2001 signs; at most 2000 are kept"),
        ({"tags": ["a"] * 13}, "tags holds 13 entries; at most 12 are kept"),
        ({"tags": [3]}, "'3' is no text of at most 2000 signs"),
        (
            {"notes": [{"time": True, "text": "a"}]},
            "is no note at an instant; expected a time [s] and a text",
        ),
        ({"notes": [{"time": float("nan"), "text": "a"}]}, "is no note at an instant"),
        ({"notes": [{"time": 1}]}, "'None' is no text"),
    ],
)
def test_what_cannot_be_said_of_a_drop_is_refused(server, said, words):
    number = server.order("/api/jobs", {"name": "mine"}).told["id"]
    answer = server.order(f"/api/jobs/{number}/label", said)
    assert answer.status == 400
    assert words in answer.text
    assert "label" not in listed(server)[number]


def test_one_click_logs_a_drop_and_another_takes_it_out(server):
    told = server.ask("GET", "/api/log").told
    assert (told["drops"], told["problem"]) == ([], "")
    first, second = estimated(server, "one", "a" * 64, 3100.0), estimated(server, "two", "b" * 64, 2000.0)
    server.order(f"/api/jobs/{first}/label", {"bearings": "set 7"})
    assert server.order(f"/api/jobs/{first}/log").told == {"number": 1, "bearings": "set 7"}
    assert server.order(f"/api/jobs/{second}/log").told == {
        "number": 2,
        "bearings": "set 7",
    }  # as the last one
    again = server.order(f"/api/jobs/{first}/log")
    assert (again.status, "is in the log already, as drop 1" in again.text) == (400, True)
    log = server.space.path / "drops.db"
    allow(log, "LP-400", "set 7", drops=4, source="the maker")
    told = server.ask("GET", "/api/log").told
    assert [(one["log"], one["name"], one["numbers"][0]["value"]) for one in told["drops"]] == [
        (1, "one", 3100.0),
        (2, "two", 2000.0),
    ]
    assert [(one["drops"], one["allowed"]) for one in told["used"]] == [(2, 4)]
    assert server.ask("DELETE", f"/api/jobs/{first}/log").status == 204
    assert list(logged_drops(log)) == [2]
    assert "no entry of this record" in server.ask("DELETE", f"/api/jobs/{first}/log").text


def test_a_drop_without_an_estimate_is_not_logged(server):
    number = server.order("/api/jobs", {"name": "mine"}).told["id"]
    answer = server.order(f"/api/jobs/{number}/log")
    assert (answer.status, "make an estimate first" in answer.text) == (400, True)


def test_a_log_that_is_named_is_shown_with_drops_that_are_not_on_the_page(tmp_path):
    log = tmp_path / "plant.sqlite"
    severity = Severity(bearing="DE", quantity="peak_force_N", unit="N", value=None, lower=1.0, upper=9e3)
    drop = LoggedDrop(
        machine="LP-400", bearing_set="1", record="elsewhere", sha256="b" * 64, speed=377.0,
        recorded="2019-10-16T13:42:07", method="tracked", verdict="", severity=(severity,), duration=51.0,
    )  # fmt: skip
    add_drop(log, drop)
    server = Served(Workspace(tmp_path / "space"), log=str(log))
    try:
        told = server.ask("GET", "/api/log").told
        (one,) = told["drops"]
        assert (one["log"], one["name"], one["recorded"]) == (1, "elsewhere", "2019-10-16T13:42:07")
        assert (one["numbers"][0]["value"], one["numbers"][0]["SI"][1]) == (None, "1 to 9\u202f000 N")
        assert one["duration"]["SI"][0] == "51.00 s"
        assert "drop = logged_drops('plant.sqlite')[1]" in one["python"]
        assert str(tmp_path) not in json.dumps(told)
    finally:
        server.stop()


def test_a_log_that_is_named_and_not_there_is_said(tmp_path):
    server = Served(Workspace(tmp_path / "space"), log="none.sqlite")
    try:
        told = server.ask("GET", "/api/log").told
        assert "none.sqlite is not there" in told["problem"]
    finally:
        server.stop()
