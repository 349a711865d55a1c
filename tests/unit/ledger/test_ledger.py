"""The log of drops: nothing is lost, nothing counts twice."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import sqlite3
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import pytest
from tests.published import bearing, published, value

from rotordrop.errors import OutputError, UsageError
from rotordrop.ledger import LoggedDrop, Severity, add_drop, allow, logged_drops, used_shares
from rotordrop.ledger._store import _make_wal
from rotordrop.ledger.book import drop_of_estimate, remove_drop

PEAK = Severity(bearing="NDE", quantity="peak_force_N", unit="N", value=3300.0, lower=3200.0, upper=3400.0)
DROP = LoggedDrop(
    machine="LP-400",
    bearing_set="2026",
    record="drop_060.h5",
    sha256="a" * 64,
    recorded="2026-03-14T15:09:26",
    speed=377.0,
    duration=51.6,
    cause="converter fault",
    method="tracked",
    verdict="The model is consistent with the record.",
    severity=(PEAK,),
)


@pytest.fixture
def log(tmp_path):
    return tmp_path / "drops.db"


def test_what_is_added_comes_back(log):
    number = add_drop(log, DROP)
    ranged = replace(DROP, sha256="b" * 64, severity=(replace(PEAK, value=None),), duration=None)
    other = add_drop(log, ranged)
    assert logged_drops(log) == {number: DROP, other: ranged}


def test_one_recording_counts_once(log):
    add_drop(log, DROP)
    with pytest.raises(UsageError, match=r"drop_060\.h5 is in the log already, as drop 1 of LP-400"):
        add_drop(log, replace(DROP, cause="another"))
    assert len(logged_drops(log)) == 1
    add_drop(log, replace(DROP, bearing_set="2027"))
    remove_drop(log, 1)
    assert [drop.bearing_set for drop in logged_drops(log).values()] == ["2027"]
    add_drop(log, DROP)
    with pytest.raises(UsageError, match="the log has no drop 99"):
        remove_drop(log, 99)


def test_drops_stand_in_the_order_they_happened(log):
    for day, digest in (("2026-05-01", "x"), ("2026-01-01", "y"), ("2026-03-01", "z")):
        add_drop(log, replace(DROP, recorded=day, sha256=digest))
    assert [drop.sha256 for drop in logged_drops(log).values()] == ["y", "z", "x"]


def test_used_share_counts_drops_and_known_seconds(log):
    for digest, lasted in (("1", 51.5), ("2", 48.5), ("3", None)):
        add_drop(log, replace(DROP, sha256=digest, duration=lasted))
    add_drop(log, replace(DROP, machine="other", sha256="4"))
    allow(log, "LP-400", "2026", drops=12, seconds=400.0, source="contract 17, section 4")
    used, free = used_shares(log)
    assert (used.drops, used.seconds, used.untimed) == (3, 100.0, 1)
    assert used.sentence() == (
        "LP-400, bearings 2026: 3 of 12 drops (25 %); 100 s of 400 s (25 %, 1 drops without duration left "
        "out), allowed by contract 17, section 4"
    )
    assert free.sentence() == "other, bearings 2026: 1 drop; no limit given"
    allow(log, "LP-400", "2026", drops=6, source="contract 18")
    assert used_shares(log)[0].sentence().startswith("LP-400, bearings 2026: 3 of 6 drops (50 %), allowed by")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"source": "x"}, "needs a number of drops or of seconds"),
        ({"drops": 0, "source": "x"}, "allowed are 0 drops"),
        ({"drops": 3, "source": " "}, "needs its source"),
    ],
)
def test_an_allowance_says_how_much_and_by_whom(log, settings, message):
    with pytest.raises(UsageError, match=message):
        allow(log, "LP-400", "2026", **settings)


def test_what_is_no_log_is_named(tmp_path):
    with pytest.raises(UsageError, match=r"none\.db is not there; 'rotordrop log add' makes a log"):
        logged_drops(tmp_path / "none.db")
    (tmp_path / "text.db").write_text("no data base " * 100)
    with pytest.raises(UsageError, match=r"text\.db is not a log of drops"):
        add_drop(tmp_path / "text.db", DROP)
    with pytest.raises(OutputError, match="the log cannot be used"):
        add_drop(tmp_path / "no folder" / "drops.db", DROP)


def test_a_write_that_fails_leaves_nothing(log):
    with pytest.raises(sqlite3.IntegrityError):
        add_drop(log, replace(DROP, severity=(PEAK, PEAK)))
    assert logged_drops(log) == {}


def test_a_drop_from_the_document_of_an_estimate():
    numbers = {"peak_force_N": value(3300.0, 3200.0, 3400.0), "peak_stress_Pa": value(1.8e9)}
    estimate = published(
        machine="LP-400",
        record_sha256="c" * 64,
        verdict="fine",
        simulated_record=True,
        bearings={"NDE": bearing(numbers)},
    )
    drop = drop_of_estimate(estimate, "2026", cause="test")
    assert drop.severity == (PEAK,)
    assert drop.speed == pytest.approx(376.991, abs=1e-3)
    assert drop.simulated and drop.cause == "test"


WRITER = """
import sys
from dataclasses import replace
from tests.unit.ledger.test_ledger import DROP
from rotordrop.ledger import add_drop
for i in range(int(sys.argv[3])):
    add_drop(sys.argv[1], replace(DROP, sha256=f"{sys.argv[2]}-{i}"))
    print(i, flush=True)
"""


@pytest.mark.skipif(os.name != "posix", reason="signals as on POSIX")
def test_many_writers_and_a_killed_one_lose_nothing(log):
    writers = [
        subprocess.Popen(
            [sys.executable, "-c", WRITER, str(log), str(k), "40"], stdout=subprocess.PIPE, text=True
        )
        for k in range(4)
    ]
    assert writers[0].stdout is not None
    for _ in range(5):
        writers[0].stdout.readline()
    writers[0].send_signal(signal.SIGKILL)
    said = [writer.communicate(timeout=120)[0] for writer in writers]
    assert [writer.returncode for writer in writers[1:]] == [0, 0, 0]
    there = {drop.sha256 for drop in logged_drops(log).values()}
    promised = {f"0-{i}" for i in range(5 + len(said[0].split()))}
    promised |= {f"{k}-{i}" for k in (1, 2, 3) for i in range(40)}
    assert promised <= there
    assert len(there - promised) <= 1  # added, and killed before it could say so
    assert all(len(drop.severity) == 1 for drop in logged_drops(log).values())


def test_a_reader_is_not_kept_waiting_by_a_writer(log):
    add_drop(log, DROP)
    with sqlite3.connect(log, isolation_level=None) as writer:
        writer.execute("BEGIN IMMEDIATE")
        began = time.monotonic()
        assert len(logged_drops(log)) == 1
        assert time.monotonic() - began < 5.0
        writer.execute("ROLLBACK")


@pytest.fixture(scope="module")
def postgresql(tmp_path_factory):
    """A PostgreSQL server of our own on loopback; where none is installed its tests are left out."""
    pytest.importorskip("psycopg")
    programs = sorted(Path("/usr/lib/postgresql").glob("*/bin"))
    if not programs:
        pytest.skip("no PostgreSQL server is installed")
    folder = Path(tempfile.mkdtemp(prefix="pg"))  # short: the socket's path may have 107 characters
    as_user: list[str] = []
    if os.geteuid() == 0:  # the server refuses to run as root
        folder.chmod(0o777)
        as_user = ["runuser", "-u", "postgres", "--"]
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    data = folder / "data"

    def call(program, *arguments):
        command = [*as_user, str(programs[-1] / program), *arguments]
        subprocess.run(command, check=True, cwd="/", stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    call("initdb", "-D", str(data), "-U", "rotordrop", "-A", "trust", "--no-sync")
    options = f"-p {port} -c listen_addresses=127.0.0.1 -c unix_socket_directories={folder}"
    call("pg_ctl", "-D", str(data), "-o", options, "-l", str(folder / "log"), "-w", "start")
    yield f"postgresql://rotordrop@127.0.0.1:{port}/postgres"
    call("pg_ctl", "-D", str(data), "-m", "immediate", "stop")
    shutil.rmtree(folder, ignore_errors=True)


def test_the_same_log_in_postgresql(postgresql):
    number = add_drop(postgresql, DROP)
    assert logged_drops(postgresql) == {number: DROP}
    with pytest.raises(UsageError, match="is in the log already"):
        add_drop(postgresql, DROP)
    allow(postgresql, "LP-400", "2026", drops=4, source="contract")
    assert used_shares(postgresql)[0].drops == 1
    writers = [
        subprocess.Popen([sys.executable, "-c", WRITER, postgresql, str(k), "25"], stdout=subprocess.DEVNULL)
        for k in range(4)
    ]
    assert [writer.wait(timeout=120) for writer in writers] == [0, 0, 0, 0]
    assert len(logged_drops(postgresql)) == 101
    remove_drop(postgresql, number)
    assert len(logged_drops(postgresql, machine="LP-400")) == 100


def test_a_postgresql_that_is_not_there_is_named():
    pytest.importorskip("psycopg")
    with pytest.raises(OutputError, match=r"the log at 127\.0\.0\.1:1/none cannot be used"):
        logged_drops("postgresql://someone@127.0.0.1:1/none")


class Busy:
    """A connection to a log that others are making: refused twice, then open."""

    def __init__(self, refusal="database is locked", mode="delete"):
        self.asked, self.refusal, self.mode = [], refusal, mode

    def execute(self, statement):
        self.asked.append(statement)
        if len(self.asked) <= 2:
            raise sqlite3.OperationalError(self.refusal)
        return self

    def fetchone(self):
        return (self.mode,)


def test_a_log_that_others_are_making_is_waited_for():
    """Of writers that were killed and started again some were refused at once, whatever they would wait."""
    busy = Busy()
    _make_wal(busy)
    assert busy.asked[-1] == "PRAGMA journal_mode = WAL" and len(busy.asked) == 4
    there = Busy(mode="wal")
    _make_wal(there)
    assert there.asked[-1] == "PRAGMA journal_mode"
    with pytest.raises(sqlite3.OperationalError, match="disk"):
        _make_wal(Busy("disk I/O error"))


def test_a_trend_is_told_and_chance_is_not(log):
    from rotordrop.ledger import trends

    steady = (5.0, 3.0, 6.0, 2.0, 7.0, 4.0, 5.5, 3.5)
    for k in range(8):
        severity = (
            replace(PEAK, value=3000.0 + 100.0 * k, lower=2900.0, upper=4000.0),
            replace(PEAK, bearing="DE", value=steady[k], lower=0.0, upper=9.0),
        )
        recorded = f"2026-01-{1 + k:02d}"
        add_drop(log, replace(DROP, sha256=f"{k:064d}", recorded=recorded, severity=severity))
    (one,) = trends(log)
    assert (one.bearing, one.quantity, one.drops, one.tau) == ("NDE", "peak_force_N", 8, pytest.approx(1.0))
    assert "peak_force_N at NDE rises over 8 drops" in one.sentence()
    assert trends(log, machine="another") == ()
