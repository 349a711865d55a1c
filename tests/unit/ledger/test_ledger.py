"""The log of drops: nothing is lost, nothing counts twice."""

import json
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

import pytest
from tests.no_file import on_posix
from tests.published import bearing, published, value, went_on

from rotordrop.cli.app import run
from rotordrop.errors import DamagedFileError, OutputError, RotordropError, UsageError
from rotordrop.ledger import LoggedDrop, Severity, _store, add_drop, allow, logged_drops, trends, used_shares
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
    verdict="The model follows the record.",
    severity=(PEAK,),
)
USES = (logged_drops, lambda log: add_drop(log, replace(DROP, sha256="9" * 64)))
"""What reads a log and what writes into it."""


@pytest.fixture
def log(tmp_path):
    return tmp_path / "drops.db"


def logged(log, *digests, **told):
    """Add drops that differ in their digest."""
    return [add_drop(log, replace(DROP, sha256=64 * digest, **told)) for digest in digests]


def changed(log, *statements):
    """Change a log without its program."""
    with closing(sqlite3.connect(log)) as connection, connection:
        for statement in statements:
            connection.execute(statement)


def test_what_is_added_comes_back(log):
    number = add_drop(log, DROP)
    ranged = replace(DROP, sha256="b" * 64, severity=(replace(PEAK, value=None),), duration=None)
    other = add_drop(log, ranged)
    assert logged_drops(log) == {number: DROP, other: ranged}


def test_one_recording_counts_once(log):
    add_drop(log, DROP)
    with pytest.raises(UsageError, match=r"drop_060\.h5 is in the log already, as drop 1 of LP-400"):
        add_drop(log, replace(DROP, cause="another"))
    with pytest.raises(UsageError, match=r"drop 1 of LP-400 with bearings 2026; .* 'rotordrop log remove"):
        add_drop(log, replace(DROP, bearing_set="2027"))
    add_drop(log, replace(DROP, machine="a second one in this recording"))
    remove_drop(log, 1)
    add_drop(log, replace(DROP, bearing_set="2027"))
    assert [drop.bearing_set for drop in logged_drops(log).values()] == ["2026", "2027"]
    for number in (99, 2**70, -1, 1.0, True):
        with pytest.raises(UsageError, match=f"the log has no drop {number}"):
            remove_drop(log, number)


def test_drops_stand_in_the_order_they_happened(log):
    for day, digest in (("2026-05-01", "a"), ("2026-01-01", "b"), ("2026-03-01", "c")):
        logged(log, digest, recorded=day)
    assert [drop.sha256[0] for drop in logged_drops(log).values()] == ["b", "c", "a"]


def test_used_share_counts_drops_and_known_seconds(log):
    for digest, lasted in (("1", 51.5), ("2", 48.5), ("3", None)):
        logged(log, digest, duration=lasted)
    logged(log, "4", machine="other")
    allow(log, "LP-400", "2026", drops=12, seconds=400.0, source="contract 17, section 4")
    used, free = used_shares(log)
    assert (used.drops, used.seconds, used.untimed) == (3, 100.0, 1)
    assert free.drops == 1


def test_a_limit_that_is_passed_is_named_with_the_drop_that_passed_it(log):
    for day, digest in (("01", "a"), ("03", "c"), ("02", "b")):  # the last of them is logged second
        logged(log, digest, recorded=f"2026-01-{day}", duration=40.0)
    allow(log, "LP-400", "2026", drops=2, seconds=60.0, source="the maker")
    used = used_shares(log)[0]
    assert (used.drops_passed_at, used.seconds_passed_at) == (2, 3)
    allow(log, "LP-400", "2026", drops=3, seconds=120.0, source="the maker")
    used = used_shares(log)[0]
    assert (used.drops_passed_at, used.seconds_passed_at) == (None, None)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, "needs a number of drops or of seconds"),
        ({"drops": 3, "source": " "}, "source is ' '"),
        ({"drops": 3, "source": "\ud800"}, "source is "),
        ({"drops": 2.5}, r"drops is '2\.5'.*valid integer"),
        ({"drops": 0}, "drops is '0'.*greater than or equal to 1"),
        ({"seconds": math.inf}, "seconds is 'inf'.*finite number"),
        ({"seconds": 0.0}, r"seconds is '0\.0'"),
    ],
)
def test_what_nobody_can_allow_is_refused_at_the_door(log, settings, message):
    with pytest.raises(UsageError, match=message):
        allow(log, "LP-400", "2026", **{"source": "contract", **settings})


def test_what_is_no_log_is_named(tmp_path):
    with pytest.raises(UsageError, match=r"none\.db is not there; 'rotordrop log add' makes a log"):
        logged_drops(tmp_path / "none.db")
    (tmp_path / "text.db").write_text("no data base " * 100)
    with pytest.raises(UsageError, match=r"text\.db is damaged or is not a log of drops"):
        add_drop(tmp_path / "text.db", DROP)
    with pytest.raises(UsageError, match="its name holds a NUL"):
        add_drop(f"{tmp_path}/a\0.db", DROP)
    with pytest.raises(OutputError, match="no folder does not exist; create it first"):
        add_drop(tmp_path / "no folder" / "drops.db", DROP)
    for use in USES:
        with pytest.raises(UsageError, match="is no file; name another one for the log"):
            use(tmp_path)
    changed(tmp_path / "other.db", "CREATE TABLE drops (id INTEGER)")
    with pytest.raises(UsageError, match="holds no log of drops"):
        logged_drops(tmp_path / "other.db")


def test_a_write_that_fails_leaves_nothing(log):
    add_drop(log, DROP)
    with pytest.raises(ZeroDivisionError):
        _store.append(log, lambda rows: 1 / 0)
    assert list(logged_drops(log).values()) == [DROP]


WRONG = [
    ({"speed": math.nan}, "speed is 'nan'"),
    ({"speed": math.inf}, "speed is 'inf'"),
    ({"speed": 10**400}, "speed is '1000"),
    ({"severity": None}, "severity"),
    ({"severity": (1,)}, r"severity\.0 is '1'"),
    ({"speed": "fast"}, "speed is 'fast'"),
    ({"speed": True}, "speed is 'True'"),
    ({"duration": -5.0}, r"duration is '-5\.0'"),
    ({"duration": "5 s"}, "duration is '5 s'"),
    ({"cause": "\ud800"}, "cause is "),
    ({"record": None}, "record is 'None'"),
    ({"recorded": "yesterday"}, "recorded is 'yesterday'"),
    ({"simulated": "no"}, "simulated is 'no'"),
    ({"severity": (PEAK, PEAK)}, "peak_force_N at NDE is stated twice"),
    ({"severity": (replace(PEAK, lower=math.nan),)}, r"severity\.0\.lower is 'nan'"),
    ({"severity": (replace(PEAK, lower=5000.0),)}, "is 3300.0; expected a value between 5000 and 3400"),
    ({"severity": (replace(PEAK, value=None, lower=5000.0),)}, "expected a value between 5000 and 3400"),
    ({"severity": (replace(PEAK, value=3500.0),)}, "is 3500.0; expected a value between 3200 and 3400"),
    ({"severity": (replace(PEAK, lower=-9.0, value=-8.0, upper=-7.0),)}, r"severity\.0\.upper is '-7\.0'"),
    (
        {"severity": (replace(PEAK, quantity="mass"),)},
        "mass at NDE in 'N'; expected one of peak_force_N in N,",
    ),
    ({"severity": (replace(PEAK, unit="lbf"),)}, "peak_force_N at NDE in 'lbf'; expected one of"),
    ({"severity": (replace(PEAK, bearing=" "),)}, r"severity\.0\.bearing is ' '"),
    ({"sha256": "none of these"}, "sha256 is 'none of these'"),
    ({"sha256": "A" * 64}, "sha256 is 'AAAA"),
    ({"cause": "x" * 10_001}, "cause is 'xxx.*at most 10000"),
    *(
        ({name: text}, f"{name} is ")
        for name in ("machine", "bearing_set")
        for text in ("", " \n", "x" * 256)
    ),
]


@pytest.mark.parametrize(("values", "message"), WRONG)
def test_what_no_drop_can_have_is_refused_at_the_door(log, values, message):
    with pytest.raises(UsageError, match=message):
        add_drop(log, replace(DROP, **values))
    assert not log.exists()


ODD = (object(), b"x", [], {}, math.nan, "\ud800", "x" * 10**6)


def test_every_field_of_a_drop_is_checked_at_the_door(log):
    """What is of no kind that a log holds; a field that is new is tried too."""
    wrong = [replace(DROP, **{field.name: odd}) for field in fields(LoggedDrop) for odd in ODD]
    peaks = [replace(PEAK, **{field.name: odd}) for field in fields(Severity) for odd in ODD]
    for drop in wrong + [replace(DROP, severity=(peak,)) for peak in peaks]:
        with pytest.raises(UsageError):
            add_drop(log, drop)
    for drop in (None, {}, "drop"):
        with pytest.raises(UsageError, match="is no drop; expected a LoggedDrop"):
            add_drop(log, drop)
    for where in (None, 5, b"drops.db", ["drops.db"]):
        for use in USES:
            with pytest.raises(UsageError, match="is no place for a log; expected a path, or an address"):
                use(where)
    assert not log.exists()


def test_any_sign_is_taken_and_the_longest_names(log):
    longest = "\N{OLD PERSIAN SIGN A}" * 255
    odd = "NUL \0, new\nline, quote ' \" % ?"
    drop = replace(DROP, machine=longest, cause=odd, severity=(replace(PEAK, bearing=longest),))
    number = add_drop(log, drop)
    allow(log, longest, longest, drops=3, source="contract")
    assert logged_drops(log)[number] == drop


def test_drops_that_are_exchanged_are_both_named(log):
    for digest in "abc":
        logged(log, digest, severity=(replace(PEAK, lower=int(digest, 16)),))
    moves = ((1, 99), (3, 1), (99, 3))
    changed(log, *(f"UPDATE rotordrop_log SET number = {new} WHERE number = {old}" for old, new in moves))
    with pytest.raises(DamagedFileError, match=r"entry 1 is not what was logged, .*entry 3 is not what"):
        read_log(log)


def test_records_without_a_digest_are_no_doubles(log):
    records = ["a.csv", "b.csv"]
    for record in records:
        logged(log, "", record=record)
    assert [drop.record for drop in logged_drops(log).values()] == records


CHANGES = [
    ("UPDATE rotordrop_log SET content = replace(content, '3400.0', '3401.0') WHERE number = 1", 1),
    ("UPDATE rotordrop_log SET content = x'80' WHERE number = 2", 2),
    ("UPDATE rotordrop_log SET kind = 'allowance' WHERE number = 2", 2),
    ("UPDATE rotordrop_log SET digest = 'x' WHERE number = 2", 2),
    ("DELETE FROM rotordrop_log WHERE number = 1", 1),
    ("DELETE FROM rotordrop_log WHERE number = 3", 3),
    ("UPDATE rotordrop_log SET content = replace(content, '12', '99') WHERE number = 3", 3),
    ("INSERT INTO rotordrop_log SELECT 4, kind, content, digest, 'x' FROM rotordrop_log WHERE number = 1", 4),
]


@pytest.mark.parametrize(("change", "entry"), CHANGES)
def test_what_has_changed_in_a_log_is_named_and_can_be_taken_out(log, change, entry):
    """Damage of the file: ``cli/test_written_files``."""
    logged(log, "a", "b")
    allow(log, "LP-400", "2026", drops=12, source="contract")
    changed(log, change)
    for use in (*USES, used_shares, trends):
        with pytest.raises(DamagedFileError, match=rf"drops\.db is damaged: .*entry {entry} is "):
            use(log)
    whole = set()
    while not whole:
        try:
            whole = set(logged_drops(log))
        except DamagedFileError as error:
            remove_drop(log, int(str(error).split("entry ")[1].split()[0]))
    assert entry not in whole
    logged(log, "c")
    assert set(logged_drops(log)) > whole


KILLED = """
import os, signal, sys
from dataclasses import replace
from tests.unit.ledger.test_ledger import DROP
from rotordrop.ledger import _store, add_drop
def killed(rows):
    os.kill(os.getpid(), signal.SIGKILL)
add_drop(sys.argv[1], replace(DROP, sha256="e" * 64))
print("acknowledged", flush=True)
digest = _store._digest
_store._digest = lambda *values: digest(*values) if values[1] == "drop" and values[0] <= 2 else killed(values)
add_drop(sys.argv[1], replace(DROP, sha256="f" * 64))
"""


@on_posix
def test_a_program_killed_in_its_transaction_loses_nothing_that_it_acknowledged(log):
    add_drop(log, DROP)
    done = subprocess.run([sys.executable, "-c", KILLED, str(log)], capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (-signal.SIGKILL, "acknowledged")
    assert [drop.sha256[0] for drop in logged_drops(log).values()] == ["a", "e"]


def test_a_drop_from_the_document_of_an_estimate():
    numbers = {"peak_force_N": value(3300.0, 3200.0, 3400.0), "peak_stress_Pa": value(1.8e9)}
    told = {"machine": "LP-400", "record_sha256": "c" * 64, "verdict": "fine", "simulated_record": True}
    drop = drop_of_estimate(published(bearings={"NDE": bearing(numbers)}, **told), "2026", cause="test")
    assert drop.severity == (PEAK,)
    assert drop.speed == pytest.approx(376.991, abs=1e-3)
    assert drop.simulated and drop.cause == "test" and not drop.went_on
    later = published(bearings={"NDE": bearing(numbers)}, later_motion=[went_on("NDE")], **told)
    assert drop_of_estimate(later, "2026").went_on


WRITER = """
import sys
from dataclasses import replace
from tests.unit.ledger.test_ledger import DROP
from rotordrop.ledger import add_drop
for i in range(int(sys.argv[3])):
    add_drop(sys.argv[1], replace(DROP, sha256=f"{sys.argv[2]}{i:063d}"))
    print(i, flush=True)
"""


def writer(log, name, drops):
    """A process that adds drops and says so."""
    command = [sys.executable, "-c", WRITER, str(log), str(name), str(drops)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)


def killed_after(process, drops):
    """The digests of what a writer had said when it was killed."""
    for _ in range(drops):
        process.stdout.readline()
    process.kill()
    told = drops + len(process.stdout.read().split())  # what `readline` read ahead is not in `communicate`
    return {f"{process.args[4]}{i:063d}" for i in range(told)}


@pytest.mark.slow
@on_posix
def test_many_writers_and_a_killed_one_lose_nothing(log):
    first, *others = (writer(log, k, 40) for k in range(4))
    promised = killed_after(first, 5)
    for one in others:
        one.communicate(timeout=600)
    assert [one.returncode for one in others] == [0, 0, 0]
    promised |= {f"{k}{i:063d}" for k in (1, 2, 3) for i in range(40)}
    there = {drop.sha256 for drop in logged_drops(log).values()}
    assert promised <= there
    assert len(there - promised) <= 1  # added, and killed before it could say so
    assert all(len(drop.severity) == 1 for drop in logged_drops(log).values())


@pytest.fixture
def postgresql():
    """A PostgreSQL server of our own on loopback; where none is installed its tests are left out."""
    programs = sorted(Path("/usr/lib/postgresql").glob("*/bin"))
    if not programs:
        pytest.skip("no PostgreSQL server is installed (Debian: apt-get install postgresql)")
    folder = Path(tempfile.mkdtemp(prefix="pg"))  # short: the socket's path may have 107 characters
    folder.chmod(0o777)
    as_user = ["runuser", "-u", "postgres", "--"] if os.geteuid() == 0 else []  # it refuses to run as root
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]

    def call(program, *arguments):
        command = [*as_user, str(programs[-1] / program), "-D", str(folder / "data"), *arguments]
        subprocess.run(command, check=True, cwd="/", stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    call("initdb", "-U", "rotordrop", "-A", "trust", "--no-sync")
    options = f"-p {port} -c listen_addresses=127.0.0.1 -c unix_socket_directories={folder}"
    call("pg_ctl", "-o", options, "-l", str(folder / "log"), "-w", "start")
    yield f"postgresql://rotordrop@127.0.0.1:{port}/postgres"
    call("pg_ctl", "-m", "immediate", "stop")
    shutil.rmtree(folder, ignore_errors=True)


@pytest.mark.slow
def test_the_same_log_in_postgresql(postgresql):
    number = add_drop(postgresql, DROP)
    assert logged_drops(postgresql) == {number: DROP}
    with pytest.raises(UsageError, match="is in the log already"):
        add_drop(postgresql, DROP)
    allow(postgresql, "LP-400", "2026", drops=4, source="contract")
    assert used_shares(postgresql)[0].drops == 1
    writers = [writer(postgresql, k, 25) for k in range(4)]
    assert [one.wait(timeout=600) for one in writers] == [0, 0, 0, 0]
    assert len(logged_drops(postgresql)) == 101
    remove_drop(postgresql, number)
    assert len(logged_drops(postgresql, machine="LP-400")) == 100


@pytest.mark.parametrize(
    "url",
    [
        "nosuchbase://rotordrop@127.0.0.1/postgres",
        "postgresql://rotordrop@127.0.0.1/postgres?foo=bar",
        "postgresql://rotordrop@127.0.0.1/a%00b",
        "postgresql://rotordrop@[::1/postgres",
        "postgresql://rotordrop@127.0.0.1/a\0b",
        "postgresql://rotordrop@127.0.0.1/\ud800",
        "postgresql://rotordrop@127.0.0.1:99999/postgres",
        "postgresql://someone@127.0.0.1:1/none",
    ],
)
def test_an_address_that_is_none_is_said(url):
    for use in USES:
        with pytest.raises(RotordropError, match=r"the log at .* cannot be used"):
            use(url)


def test_a_log_that_others_keep_is_said(log, monkeypatch):
    add_drop(log, DROP)
    monkeypatch.setattr(_store, "WAIT", 0.1)
    with sqlite3.connect(log, isolation_level=None) as other:
        other.execute("BEGIN IMMEDIATE")
        assert len(logged_drops(log)) == 1  # a reader is not kept waiting by a writer
        other.execute("ROLLBACK")
        other.execute("BEGIN EXCLUSIVE")
        for use in USES:
            with pytest.raises(OutputError, match=r"others have used the log for 0\.1 s; try again later"):
                use(log)
        other.execute("ROLLBACK")
    assert len(logged_drops(log)) == 1


def test_a_trend_is_told_and_chance_is_not(log):
    for k, steady in enumerate((5.0, 3.0, 6.0, 2.0, 7.0, 4.0, 5.5, 3.5)):
        rising = replace(PEAK, value=3000.0 + 100.0 * k, lower=2900.0, upper=4000.0)
        severity = (rising, replace(PEAK, bearing="DE", value=steady, lower=0.0, upper=9.0))
        logged(log, str(k), recorded=f"2026-01-{1 + k:02d}", severity=severity)
    (one,) = trends(log)
    assert (one.bearing, one.quantity, one.drops, one.tau) == ("NDE", "peak_force_N", 8, pytest.approx(1.0))
    assert trends(log, machine="another") == ()


@pytest.fixture
def estimate(tmp_path):
    peaks = {"peak_force_N": value(3300.0, 3200.0, 3400.0), "peak_stress_Pa": value(1.5e9)}
    both = {"NDE": bearing(peaks), "DE": bearing(peaks)}
    document = published(machine="LP-400", record_sha256="c" * 64, bearings=both)
    file = tmp_path / "estimate.json"
    file.write_text(json.dumps(document.as_json()))
    return str(file)


def test_a_log_from_the_command_line(tmp_path, estimate, capsys):
    log, numbers = str(tmp_path / "drops.db"), tmp_path / "log.json"
    call = ["log", "add", log, estimate, "--bearings", "2026", "--recorded", "2026-03-14", "--duration"]
    assert run([*call, "51.6 s", "--cause", "converter fault"]) == 0
    allowed = ["--machine", "LP-400", "--bearings", "2026", "--drops", "10", "--source", "contract 17"]
    assert run(["log", "allow", log, *allowed, "--json", str(numbers)]) == 0
    content = json.loads(numbers.read_text())
    assert (content["used"][0]["drops"], content["drops"]["1"]["duration"]) == (1, 51.6)
    capsys.readouterr()
    rows = content["drops"]["1"]["severity"]
    assert [(row["bearing"], row["lower"], row["upper"]) for row in rows] == [
        ("DE", 3200.0, 3400.0),
        ("NDE", 3200.0, 3400.0),
    ]
    assert run(["log", "allow", log, *allowed[:4], "--seconds", "50 s", "--source", "contract 17"]) == 0
    assert "problem: LP-400" in capsys.readouterr().out
    assert run(["log", "remove", log, "1"]) == 0


def test_a_drop_is_dated_by_its_recorder_unless_somebody_says_otherwise(tmp_path, estimate):
    log, file = str(tmp_path / "drops.db"), tmp_path / "dated.json"
    document = json.loads(Path(estimate).read_text())
    file.write_text(json.dumps({**document, "recorded": "2026-03-14T15:09:26Z", "record_sha256": "d" * 64}))
    assert run(["log", "add", log, str(file)]) == 0
    assert run(["log", "add", log, estimate, "--recorded", "2026-03-15"]) == 0
    assert run(["log", "show", log, "--json", str(tmp_path / "log.json")]) == 0
    drops = json.loads((tmp_path / "log.json").read_text())["drops"].values()
    assert [drop["recorded"] for drop in drops] == ["2026-03-14T15:09:26Z", "2026-03-15T00:00:00"]


@pytest.mark.slow
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
        connection.execute("UPDATE rotordrop_log SET kind = 'x' WHERE number = %s", (number,))
    with pytest.raises(DamagedFileError, match=f"entry {number} is not what was logged"):
        logged_drops(reader)
    remove_drop(postgresql, number)
    assert number not in logged_drops(reader)


@pytest.mark.slow
def test_a_server_that_stops_in_between_keeps_what_was_acknowledged(postgresql):
    import psycopg

    before, one = {add_drop(postgresql, DROP)}, writer(postgresql, 7, 400)
    for _ in range(20):
        one.stdout.readline()
    with psycopg.connect(postgresql, autocommit=True) as connection:
        connection.execute(
            "SELECT pg_terminate_backend(pid) FROM pg_stat_activity "
            "WHERE pid <> pg_backend_pid() AND datname = 'postgres'"
        )
    told = killed_after(one, 0) | {f"7{i:063d}" for i in range(20)}
    there = {drop.sha256 for n, drop in logged_drops(postgresql).items() if n not in before}
    assert told <= there and len(there) <= len(told) + 1
