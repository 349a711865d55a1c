"""The log of drops: nothing is lost, nothing counts twice."""

from __future__ import annotations

import math
import os
import shutil
import signal
import socket
import sqlite3
import subprocess
import sys
import tempfile
from contextlib import closing
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from tests.published import bearing, published, value

from rotordrop.errors import DamagedFileError, OutputError, RotordropError, UsageError
from rotordrop.ledger import LoggedDrop, Severity, _store, add_drop, allow, logged_drops, trends, used_shares
from rotordrop.ledger._store import Transaction, leave_wal
from rotordrop.ledger.book import drop_of_estimate, read_log, remove_drop

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


def test_a_log_whose_name_holds_a_nul_is_refused(tmp_path):
    with pytest.raises(UsageError, match="its name holds a NUL"):
        add_drop(f"{tmp_path}/a\0.db", DROP)
    assert list(tmp_path.iterdir()) == []


def test_one_recording_counts_once(log):
    add_drop(log, DROP)
    with pytest.raises(UsageError, match=r"drop_060\.h5 is in the log already, as drop 1 of LP-400"):
        add_drop(log, replace(DROP, cause="another"))
    assert len(logged_drops(log)) == 1
    add_drop(log, replace(DROP, bearing_set="2027"))
    remove_drop(log, 1)
    assert [drop.bearing_set for drop in logged_drops(log).values()] == ["2027"]
    add_drop(log, DROP)
    for number in (99, 2**70, -1, 1.0, True):
        with pytest.raises(UsageError, match=f"the log has no drop {number}"):
            remove_drop(log, number)  # type: ignore[arg-type]


def test_adding_a_drop_reads_no_other(log, monkeypatch):
    """Every drop used to be read and digested again: 30 ms for the 150th where 2 ms will do."""
    for k in range(3):
        add_drop(log, replace(DROP, sha256=f"{k}" * 64))
    said, whole = [], Transaction.run
    monkeypatch.setattr(Transaction, "run", lambda *given: said.append(given[1]) or whole(*given))
    add_drop(log, replace(DROP, sha256="f" * 64))
    assert said and not any("FROM severity" in statement for statement in said if "SELECT" in statement)


def test_drops_stand_in_the_order_they_happened(log):
    for day, digest in (("2026-05-01", "a"), ("2026-01-01", "b"), ("2026-03-01", "c")):
        add_drop(log, replace(DROP, recorded=day, sha256=64 * digest))
    assert [drop.sha256[0] for drop in logged_drops(log).values()] == ["b", "c", "a"]


def test_used_share_counts_drops_and_known_seconds(log):
    for digest, lasted in (("1", 51.5), ("2", 48.5), ("3", None)):
        add_drop(log, replace(DROP, sha256=64 * digest, duration=lasted))
    add_drop(log, replace(DROP, machine="other", sha256="4" * 64))
    allow(log, "LP-400", "2026", drops=12, seconds=400.0, source="contract 17, section 4")
    used, free = used_shares(log)
    assert (used.drops, used.seconds, used.untimed) == (3, 100.0, 1)
    assert used.sentence() == (
        "LP-400, bearings 2026: 3 of 12 drops (25 %); 100 s of 400 s (25 %, 1 drop without duration left "
        "out), allowed by contract 17, section 4"
    )
    assert free.sentence() == "other, bearings 2026: 1 drop; no limit given"
    allow(log, "LP-400", "2026", drops=6, source="contract 18")
    assert used_shares(log)[0].sentence().startswith("LP-400, bearings 2026: 3 of 6 drops (50 %), allowed by")


def test_a_limit_that_is_passed_is_named_with_its_value_and_the_drop_that_passed_it(log):
    for day, digest in (("01", "a"), ("03", "c"), ("02", "b")):  # the last of them is logged second
        add_drop(log, replace(DROP, recorded=f"2026-01-{day}", sha256=64 * digest, duration=40.0))
    allow(log, "LP-400", "2026", drops=2, seconds=60.0, source="the maker")
    used = used_shares(log)[0]
    assert used.sentence() == (
        "LP-400, bearings 2026: 3 of 2 drops (150 %), the limit of 2 drops is passed by 1, with drop 2; "
        "120 s of 60 s (200 %), the limit of 60 s is passed by 60 s, with drop 3, allowed by the maker"
    )
    allow(log, "LP-400", "2026", drops=3, seconds=120.0, source="the maker")
    assert "passed" not in used_shares(log)[0].sentence()


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


def test_a_log_with_a_lost_page_is_called_damaged_and_no_other_file(tmp_path):
    log = tmp_path / "drops.db"
    add_drop(log, DROP)
    raw = bytearray(log.read_bytes())
    raw[4096:8192] = bytes(4096)  # a page of SQLite's, by default
    log.write_bytes(raw)
    with pytest.raises(DamagedFileError, match=r"drops\.db is damaged .*: put back a copy"):
        logged_drops(log)


def test_what_is_no_log_is_named(tmp_path):
    with pytest.raises(UsageError, match=r"none\.db is not there; 'rotordrop log add' makes a log"):
        logged_drops(tmp_path / "none.db")
    (tmp_path / "text.db").write_text("no data base " * 100)
    with pytest.raises(UsageError, match=r"text\.db is not a log of drops"):
        add_drop(tmp_path / "text.db", DROP)
    with pytest.raises(OutputError, match="no folder does not exist; create it first"):
        add_drop(tmp_path / "no folder" / "drops.db", DROP)
    for use in (logged_drops, lambda log: add_drop(log, DROP)):
        with pytest.raises(UsageError, match="is no file; name another one for the log"):
            use(tmp_path)


def test_a_write_that_fails_leaves_nothing(log, monkeypatch):
    add_drop(log, DROP)
    monkeypatch.setattr(Transaction, "seal", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        add_drop(log, replace(DROP, sha256="b" * 64))
    assert list(logged_drops(log).values()) == [DROP]


WRONG = [
    ({"speed": math.nan}, "speed = nan; expected a finite number from 0 on"),
    ({"speed": math.inf}, "speed = inf"),
    ({"speed": 10**400}, "speed = 1000"),
    ({"severity": None}, "severity = None; expected a tuple"),
    ({"severity": (1,)}, r"severity = \(1,\); expected a tuple"),
    ({"speed": "fast"}, "speed = 'fast'; expected a finite number"),
    ({"speed": True}, "speed = True"),
    ({"duration": -5.0}, r"duration = -5\.0; expected a finite number from 0 on"),
    ({"duration": "5 s"}, "duration = '5 s'"),
    ({"cause": "\ud800"}, "cause = .* without NUL and lone surrogates"),
    ({"machine": "a\0b"}, "machine = .* without NUL"),
    ({"record": None}, "record = None; expected a text"),
    ({"recorded": "yesterday"}, "recorded = 'yesterday'; expected a date such as 2026-03-14"),
    ({"simulated": "no"}, "simulated = 'no'; expected True or False"),
    ({"severity": (PEAK, PEAK)}, "peak_force_N at NDE is stated twice"),
    ({"severity": (replace(PEAK, lower=math.nan),)}, "peak_force_N at NDE: lower = nan"),
    ({"severity": (replace(PEAK, lower=5000.0),)}, "runs from 5000 to 3400; expected the smaller end first"),
    ({"severity": (replace(PEAK, value=3500.0),)}, "is 3500, outside of its interval from 3200 to 3400"),
    (
        {"severity": (replace(PEAK, lower=-9.0, value=-8.0, upper=-7.0),)},
        "upper = -7.0; expected .* from 0 on",
    ),
    (
        {"severity": (replace(PEAK, quantity="mass"),)},
        "mass at NDE in 'N'; expected one of peak_force_N in N,",
    ),
    ({"severity": (replace(PEAK, unit="lbf"),)}, "peak_force_N at NDE in 'lbf'; expected one of"),
    ({"severity": (replace(PEAK, bearing=" "),)}, "bearing = ' '; expected a name"),
    ({"sha256": "none of these"}, "sha256 = 'none of these'; expected the digest of the record"),
    ({"sha256": "A" * 64}, "sha256 = 'AAAA"),
    ({"cause": "x" * 10_001}, r"cause has 10001 characters \('xxx.*; expected at most 10000"),
    *(
        case
        for name in ("machine", "bearing_set")
        for case in (
            ({name: ""}, f"{name} = ''; expected a name"),
            ({name: " \n"}, f"{name} = ' .n'; expected a name"),
            ({name: "x" * 256}, f"{name} has 256 characters .*; expected at most 255"),
        )
    ),
]


@pytest.mark.parametrize(("values", "message"), WRONG)
def test_what_no_drop_can_have_is_refused_at_the_door(log, values, message):
    with pytest.raises(UsageError, match=message):
        add_drop(log, replace(DROP, **values))
    assert not log.exists()


def test_every_field_of_a_drop_is_checked_at_the_door(log):
    """What is of no kind that a log holds; a field that is new is tried too."""
    for field in fields(LoggedDrop):
        for odd in (object(), b"x", [], {}, math.nan, "\ud800", "x" * 10**6):
            with pytest.raises(UsageError):
                add_drop(log, replace(DROP, **{field.name: odd}))
    for field in fields(Severity):
        for odd in (object(), b"x", [], {}, math.nan, "\ud800", "x" * 10**6):
            with pytest.raises(UsageError):
                add_drop(log, replace(DROP, severity=(replace(PEAK, **{field.name: odd}),)))
    for drop in (None, {}, "drop"):
        with pytest.raises(UsageError, match="is no drop; expected a LoggedDrop"):
            add_drop(log, drop)
    for where in (None, 5, b"drops.db", ["drops.db"]):
        for use in (logged_drops, lambda place: add_drop(place, DROP)):
            with pytest.raises(UsageError, match="is no place for a log; expected a path, or an address"):
                use(where)
    assert not log.exists()


@pytest.mark.parametrize("where", ["drops.db", "postgresql"])
def test_the_longest_names_are_taken(tmp_path, where, request):
    log = tmp_path / where if where == "drops.db" else request.getfixturevalue(where)
    longest = "\N{OLD PERSIAN SIGN A}" * 255
    drop = replace(
        DROP, machine=longest, bearing_set=longest[::-1], severity=(replace(PEAK, bearing=longest),)
    )
    number = add_drop(log, drop)
    allow(log, longest, longest, drops=3, source="contract")
    assert logged_drops(log)[number] == drop
    remove_drop(log, number)


def test_drops_that_are_exchanged_are_both_named(log):
    for digest in "abc":
        add_drop(log, replace(DROP, sha256=64 * digest, severity=(replace(PEAK, lower=int(digest, 16)),)))
    with closing(sqlite3.connect(log)) as connection, connection:
        for table, column in (("severity", "drop_id"), ("drops", "id")):
            for old, new in ((1, 99), (3, 1), (99, 3)):
                connection.execute(f"UPDATE {table} SET {column} = {new} WHERE {column} = {old}")
    with pytest.raises(
        DamagedFileError, match=r"drop 1 is .*, but drop 3 was so, drop 3 is .*, but drop 1 was so"
    ):
        read_log(log)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"drops": 2.5}, r"allowed are 2\.5 drops; expected a whole number from 1 to 2147483647"),
        ({"drops": 2**63}, "allowed are 9223372036854775808 drops"),
        ({"seconds": math.inf}, "seconds = inf; expected a finite number"),
        ({"seconds": 0.0}, r"seconds = 0\.0"),
        ({"drops": 3, "source": "\ud800"}, "source = .* lone surrogates"),
    ],
)
def test_what_nobody_can_allow_is_refused_at_the_door(log, settings, message):
    with pytest.raises(UsageError, match=message):
        allow(log, "LP-400", "2026", **{"source": "contract", **settings})


def test_records_without_a_digest_are_no_doubles(log):
    for record in ("a.csv", "b.csv"):
        add_drop(log, replace(DROP, record=record, sha256=""))
    assert [(drop.record, drop.sha256) for drop in logged_drops(log).values()] == [
        ("a.csv", ""),
        ("b.csv", ""),
    ]


CHANGES = [
    ("UPDATE severity SET upper = upper + 1e-9 WHERE drop_id = 1", "drop 1 is not what was logged"),
    ("UPDATE drops SET cause = 'other' WHERE id = 2", "drop 2 is not what was logged"),
    ("UPDATE drops SET machine = x'80' WHERE id = 2", "drop 2 is not what was logged"),
    ("DELETE FROM severity WHERE drop_id = 2", "drop 2 is not what was logged"),
    ("DELETE FROM drops WHERE id = 1", "drop 1 is gone"),
    ("UPDATE allowances SET drops = 99", "allowance of LP-400, bearings 2026 is not what was logged"),
    ("DELETE FROM allowances", "allowance of LP-400, bearings 2026 is gone"),
    ("UPDATE seals SET digest = 'x' WHERE sealed = 'version'", "it has no version"),
]


@pytest.mark.parametrize(("change", "named"), CHANGES)
def test_what_has_changed_in_a_log_is_named_and_can_be_taken_out(log, change, named):
    for digest in ("a" * 64, "b" * 64):
        add_drop(log, replace(DROP, sha256=digest))
    allow(log, "LP-400", "2026", drops=12, source="contract")
    with closing(sqlite3.connect(log)) as connection, connection:
        connection.execute(change)
    for reading in (logged_drops, used_shares, trends):
        with pytest.raises(DamagedFileError, match=rf"drops\.db is damaged: {named}"):
            reading(log)
    if "drop " in named:
        remove_drop(log, int(named.split()[1]))
        assert len(logged_drops(log)) == 1
    if "allowance" in named:
        allow(log, "LP-400", "2026", drops=12, source="contract")
        assert len(logged_drops(log)) == 2


def test_an_index_that_is_damaged_lets_no_drop_in_twice(log):
    """One bit in an index page: the drops are whole, and the one that is looked for is not found."""
    add_drop(log, DROP)
    whole = log.read_bytes()
    digest = str(DROP.sha256).encode()
    places = [at for at in range(len(whole)) if whole.startswith(digest, at)]
    assert len(places) == 2  # the row, and the index of what counts once
    named = []
    for at in places:
        raw = bytearray(whole)
        raw[at + 5] ^= 1
        log.write_bytes(raw)
        with pytest.raises(DamagedFileError, match="is damaged") as refusal:
            read_log(log)
        named.append("REINDEX" in str(refusal.value))
        with pytest.raises(DamagedFileError, match="make its indexes anew"):
            add_drop(log, DROP)
    assert named == [False, True] or named == [True, False]


def test_a_log_of_an_older_version_is_read_and_given_digests(log):
    for digest in ("a" * 64, "b" * 64):
        add_drop(log, replace(DROP, sha256=digest))
    whole = log.read_bytes()
    for write in (
        lambda: add_drop(log, replace(DROP, sha256="c" * 64)),
        lambda: remove_drop(log, 1),
        lambda: allow(log, "LP-400", "2026", drops=12, source="contract"),
    ):
        log.write_bytes(whole)
        with closing(sqlite3.connect(log)) as connection, connection:
            connection.execute("DROP TABLE seals")
        assert not read_log(log).sealed
        write()
        assert read_log(log).sealed


def test_a_drop_without_digest_is_named(log):
    """It was not written to its end, or by an older rotordrop: nobody knows whether all of it is there."""
    add_drop(log, DROP)
    with closing(sqlite3.connect(log)) as connection, connection:
        connection.execute(
            "INSERT INTO drops SELECT 2, machine, bearing_set, record, 'c', recorded, added, speed, "
            "duration, cause, method, verdict, simulated, version, fingerprint FROM drops WHERE id = 1"
        )
    with pytest.raises(DamagedFileError, match="drop 2 has no digest: it was not written to its end, or"):
        read_log(log)
    remove_drop(log, 2)
    assert list(read_log(log).drops) == [1]


LEFT_BY_A_KILLED_PROGRAM = """
import os, signal, sqlite3, sys
from dataclasses import replace
from rotordrop.ledger import _store, add_drop
from tests.unit.ledger.test_ledger import DROP
log, left = sys.argv[1:]
if left == "wal":
    with sqlite3.connect(log) as reader:  # keeps open what an older rotordrop kept
        reader.execute("PRAGMA journal_mode = WAL")
        _store.leave_wal = lambda connection: None
        reader.execute("SELECT * FROM drops").fetchall()
    for number in range(3, 6):
        add_drop(log, replace(DROP, sha256=str(number) * 64))
    os.kill(os.getpid(), signal.SIGKILL)
run = _store.Transaction.run
def spilling(self, statement, values=()):
    if statement.startswith("INSERT INTO drops"):
        run(self, "PRAGMA cache_size = 1")  # pages are written before the end, as in a long transaction
    return run(self, statement, values)
def to_the_end(self, what, digest):
    if what != "version":
        run(self, "INSERT INTO seals (sealed, digest) VALUES (?, ?)", (what, digest))
        run(self, "UPDATE drops SET cause = 'half written'")
        run(self, "UPDATE severity SET upper = 0")
        os.kill(os.getpid(), signal.SIGKILL)
_store.Transaction.run, _store.Transaction.seal = spilling, to_the_end
add_drop(log, replace(DROP, sha256="3" * 64))
"""


@pytest.fixture(scope="module")
def left_behind(tmp_path_factory):
    """Logs beside what a killed program left of its transaction, and how many drops were acknowledged."""
    made = {}
    for left, acknowledged in (("journal", 3), ("wal", 6)):
        log = tmp_path_factory.mktemp(left) / "drops.db"
        for number in range(3):
            add_drop(log, replace(DROP, sha256=str(number) * 64))
        before = log.read_bytes()
        command = [sys.executable, "-c", LEFT_BY_A_KILLED_PROGRAM, str(log), left]
        assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
        assert log.read_bytes() != before and log.with_name(f"drops.db-{left}").stat().st_size > 0
        made[left] = (log, acknowledged)
    return made


@pytest.mark.skipif(os.name != "posix", reason="signals as on POSIX")
@pytest.mark.parametrize("left", ["journal", "wal"])
@pytest.mark.parametrize("part", ["log", "left"])
def test_no_bit_of_what_a_killed_program_left_loses_a_drop_without_a_word(left_behind, left, part, tmp_path):
    """SQLite left out acknowledged drops of a write-ahead log with one bit changed, 100 times of 100."""
    log, acknowledged = left_behind[left]
    place = tmp_path / "drops.db"
    damaged = place if part == "log" else tmp_path / f"drops.db-{left}"
    promised = {f"{number}" * 64 for number in range(acknowledged)}
    random, named = np.random.default_rng(26), 0
    for bit in [None, *random.integers(0, 2**31, 60).tolist()]:
        for file in tmp_path.glob("drops.db*"):
            file.unlink()
        for file in (log, log.with_name(f"drops.db-{left}")):
            shutil.copy(file, tmp_path / file.name)
        if bit is not None:
            raw = bytearray(damaged.read_bytes())
            raw[bit // 8 % len(raw)] ^= 1 << bit % 8
            damaged.write_bytes(raw)
        try:
            found = list(logged_drops(place).values())
        except RotordropError:
            assert bit is not None
            named += 1
            continue
        assert {drop.sha256 for drop in found} == promised
        assert {drop.severity for drop in found} == {DROP.severity}
        assert {drop.cause for drop in found} == {DROP.cause}
    assert named > 0


@pytest.mark.skipif(os.name != "posix", reason="signals as on POSIX")
def test_a_log_with_a_write_ahead_log_gets_a_journal_when_it_is_written_to(left_behind, tmp_path):
    log, acknowledged = left_behind["wal"]
    for file in log.parent.glob("drops.db*"):
        shutil.copy(file, tmp_path / file.name)
    log = tmp_path / "drops.db"
    add_drop(log, replace(DROP, sha256="f" * 64))
    assert [file.name for file in tmp_path.iterdir()] == ["drops.db"]
    assert len(logged_drops(log)) == acknowledged + 1
    assert log.read_bytes()[18:20] == b"\1\1"


def test_a_log_of_a_later_version_is_refused(log):
    add_drop(log, DROP)
    with closing(sqlite3.connect(log)) as connection, connection:
        connection.execute("UPDATE seals SET digest = '3' WHERE sealed = 'version'")
    for use in (logged_drops, lambda log: add_drop(log, replace(DROP, sha256="b" * 64))):
        with pytest.raises(UsageError, match="written by a later rotordrop: its tables have version 3"):
            use(log)


READER = """
import os, sys
from dataclasses import replace
from rotordrop.errors import OutputError
from rotordrop.ledger import add_drop, logged_drops
from tests.unit.ledger.test_ledger import DROP
os.setgid(65534); os.setuid(65534)
for use in (lambda log: len(logged_drops(log)), lambda log: add_drop(log, replace(DROP, sha256="f" * 64))):
    try:
        print(use(sys.argv[1]))
    except OutputError as error:
        print(error)
"""


@pytest.mark.skipif(os.name != "posix" or os.geteuid() != 0, reason="another user is needed")
@pytest.mark.parametrize("modes", [(0o555, 0o444), (0o777, 0o444), (0o555, 0o666)])
@pytest.mark.parametrize("left", ["", "journal", "wal", "wal that was closed"])
def test_who_may_only_read_a_log_reads_all_of_it_or_learns_how(left_behind, left, modes):
    folder = Path(tempfile.mkdtemp(prefix="log"))  # the folders of pytest are closed to other users
    source, acknowledged = left_behind[left.split()[0] if left else "journal"]
    for file in source.parent.glob("drops.db*"):
        shutil.copy(file, folder)
    log = folder / "drops.db"
    if left not in ("journal", "wal"):
        with closing(sqlite3.connect(log)) as connection:
            assert connection.execute("SELECT count(*) FROM drops").fetchone() == (acknowledged,)
    for path, mode in [*((path, modes[1]) for path in folder.iterdir()), (folder, modes[0])]:
        path.chmod(mode)
    command = [sys.executable, "-c", READER, str(log)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    read, written = done.stdout.splitlines()
    assert "read-only; choose another" in written or "drops.db may only be read; copy it" in written
    if left == "journal":
        assert "What it left, drops.db-journal, is put right where file and folder may be written" in read
        log = Path(shutil.copytree(folder, f"{folder} copied")) / "drops.db"
        for path in (log.parent, *log.parent.iterdir()):
            path.chmod(0o777)
        read = str(len(logged_drops(log)))
        shutil.rmtree(log.parent)
    assert read == str(acknowledged)
    shutil.rmtree(folder)


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
    add_drop(sys.argv[1], replace(DROP, sha256=f"{sys.argv[2]}{i:063d}"))
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
    told = writers[0].stdout.read()  # what `readline` read ahead is not in `communicate`
    for writer in writers[1:]:
        writer.communicate(timeout=120)
    assert [writer.returncode for writer in writers[1:]] == [0, 0, 0]
    there = {drop.sha256 for drop in logged_drops(log).values()}
    promised = {f"0{i:063d}" for i in range(5 + len(told.split()))}
    promised |= {f"{k}{i:063d}" for k in (1, 2, 3) for i in range(40)}
    assert promised <= there
    assert len(there - promised) <= 1  # added, and killed before it could say so
    assert all(len(drop.severity) == 1 for drop in logged_drops(log).values())


def test_a_reader_is_not_kept_waiting_by_a_writer(log):
    add_drop(log, DROP)
    with sqlite3.connect(log, isolation_level=None) as writer:
        writer.execute("BEGIN IMMEDIATE")
        assert len(logged_drops(log)) == 1  # a reader that waited would be told that the log is locked
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


def test_a_role_that_may_only_read_reads_and_writes_nothing(postgresql):
    import psycopg

    number = add_drop(postgresql, replace(DROP, machine="other", sha256="e" * 64))
    with psycopg.connect(postgresql) as connection:
        connection.execute("CREATE ROLE reader LOGIN")
        connection.execute("GRANT SELECT ON ALL TABLES IN SCHEMA public TO reader")
    reader = postgresql.replace("rotordrop@", "reader@")
    assert number in logged_drops(reader)
    for write in (lambda: add_drop(reader, DROP), lambda: remove_drop(reader, number)):
        with pytest.raises(OutputError, match=r"127\.0\.0\.1:\d+/postgres cannot be used: permission denied"):
            write()
    with psycopg.connect(postgresql) as connection:
        connection.execute("UPDATE drops SET speed = 1 WHERE id = %s", (number,))
    with pytest.raises(DamagedFileError, match=f"drop {number} is not what was logged"):
        logged_drops(reader)
    remove_drop(postgresql, number)


@pytest.mark.parametrize(
    "damage",
    [
        "ALTER TABLE drops DROP COLUMN cause",
        "DROP TABLE severity",
        "DROP TABLE allowances",
        "DROP TABLE drops CASCADE",
    ],
)
def test_a_postgresql_that_holds_other_tables_is_said(postgresql, damage):
    import psycopg

    with psycopg.connect(postgresql, autocommit=True) as connection:
        connection.execute("DROP DATABASE IF EXISTS other")
        connection.execute("CREATE DATABASE other")
    other = postgresql.replace("/postgres", "/other")
    with pytest.raises(UsageError, match="holds no log of drops; 'rotordrop log add' makes one"):
        logged_drops(other)
    add_drop(other, DROP)
    with psycopg.connect(other) as connection:
        connection.execute(damage)
    for use in (logged_drops, lambda log: add_drop(log, replace(DROP, sha256="b" * 64))):
        with pytest.raises(
            RotordropError, match=r":\d+/other (cannot be used|holds no log|is damaged: its \w+ are gone)"
        ):
            use(other)


@pytest.mark.parametrize(
    "url",
    [
        "postgresql://rotordrop@127.0.0.1/postgres?foo=bar",
        "postgresql://rotordrop@127.0.0.1/a%00b",
        "postgresql://rotordrop@[::1/postgres",
        "postgresql://rotordrop@127.0.0.1/a\0b",
        "postgresql://rotordrop@127.0.0.1/\ud800",
        "postgresql://rotordrop@127.0.0.1:99999/postgres",
    ],
)
def test_an_address_that_is_none_is_said(url):
    pytest.importorskip("psycopg")
    for use in (logged_drops, lambda log: add_drop(log, DROP)):
        with pytest.raises(RotordropError, match=r"the log at .* cannot be used"):
            use(url)


def test_a_postgresql_that_is_not_there_is_named():
    pytest.importorskip("psycopg")
    with pytest.raises(OutputError, match=r"the log at 127\.0\.0\.1:1/none cannot be used"):
        logged_drops("postgresql://someone@127.0.0.1:1/none")


class Busy:
    """A connection to a log that others use: refused, not changed, then changed."""

    def __init__(self, refusal="database is locked"):
        self.asked, self.refusal = 0, refusal

    def execute(self, statement):
        self.asked += 1
        if self.asked == 1:
            raise sqlite3.OperationalError(self.refusal)
        return self

    def fetchone(self):
        return ("wal" if self.asked == 2 else "delete",)


def test_a_log_that_others_use_is_waited_for(monkeypatch):
    busy = Busy()
    leave_wal(busy)
    assert busy.asked == 3
    with pytest.raises(sqlite3.OperationalError, match="disk"):
        leave_wal(Busy("disk I/O error"))
    monkeypatch.setattr(_store, "WAIT", 0.0)
    with pytest.raises(sqlite3.OperationalError, match="locked"):
        leave_wal(Busy())


def test_a_log_that_others_keep_is_said(log, monkeypatch):
    add_drop(log, DROP)
    monkeypatch.setattr(_store, "WAIT", 0.1)
    with sqlite3.connect(log, isolation_level=None) as other:
        other.execute("BEGIN EXCLUSIVE")
        for use in (logged_drops, lambda log: add_drop(log, replace(DROP, sha256="b" * 64))):
            with pytest.raises(OutputError, match=r"others have used the log for 0\.1 s; try again later"):
                use(log)
        other.execute("ROLLBACK")
    assert len(logged_drops(log)) == 1


def test_a_trend_is_told_and_chance_is_not(log):
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
