"""A folder that is watched: every record is taken once, kept, judged, and reported."""

import json
import os
import shutil
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from importlib import resources
from pathlib import Path

import pytest
from tests.no_file import NO_FILE, in_time, on_posix
from tests.published import bearing, published, value

from rotordrop._version import __version__
from rotordrop.cli.app import run
from rotordrop.errors import OutputError, RotordropError, UsageError
from rotordrop.files import write_json
from rotordrop.jobs.runner import publish, write_state
from rotordrop.jobs.workspace import Workspace
from rotordrop.ledger import logged_drops
from rotordrop.watch import Kept, Watcher, read_fleet
from rotordrop.watch.fleet import Fleet
from rotordrop.watch.kept import Arrived, arrived, keep_status, parts_of, status_of

PACKAGE = Path(str(resources.files("rotordrop")))
DROP = PACKAGE / "examples" / "lp400" / "drop_060.h5"
PEAKS = {"peak_force_N": value(3300.0, 3200.0, 3400.0), "peak_stress_Pa": value(1.5e9, 1.4e9, 1.6e9)}


@pytest.fixture
def machines(tmp_path):
    folder = tmp_path / "machines"
    folder.mkdir()
    for serial in ("4711", "4711-B"):
        shutil.copy(PACKAGE / "machine" / "examples" / "lp400.toml", folder / f"{serial}.toml")
    shutil.copy(PACKAGE / "machine" / "examples" / "lp400_shaft.csv", folder)
    return folder


@pytest.fixture
def drops(tmp_path):
    folder = tmp_path / "drops"
    folder.mkdir()
    return folder


@pytest.fixture
def kept(tmp_path):
    made = Kept(Workspace(tmp_path / "kept"))
    made.prepare()
    return made


@pytest.fixture
def watcher(tmp_path, machines, drops, kept):
    """A watcher, what it says, and what its hook was told."""

    def made(**more):
        said = []
        one = Watcher(drops, machines, kept, str(tmp_path / "drops.db"), every=0.1, say=said.append, **more)
        one.prepare()
        return one, said

    return made


@pytest.fixture
def hook(tmp_path):
    """A program that keeps what it is told."""
    program = tmp_path / "told.py"
    program.write_text(f"import sys; open({str(tmp_path / 'told')!r}, 'a').write(sys.stdin.read())")
    return f"{sys.executable} {program}"


@pytest.fixture
def reported(tmp_path):
    """What the hook was told."""
    file = tmp_path / "told"
    return lambda: [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


@pytest.fixture
def taken(drops, kept):
    """Let a record be taken, with what a computation found of it, as the child leaves it; its number."""

    def made(name, verb, content, serial="", words="x"):
        (drops / name).write_text(words)
        number = kept.take(Arrived.at(drops / name))
        job = kept.job(number)
        if content is None:
            sha256 = job.read()["files"]["record"]["sha256"]
            peaks = {"NDE": bearing(PEAKS), "DE": bearing(PEAKS)}
            told = {"machine": "LP-400", "bearings": peaks, "rotordrop_version": __version__}
            content = published(record_sha256=sha256, warnings=WARNINGS.get(name, []), **told).as_json()
        keep_status(job, status_of(job) | {"verb": verb, "serial": serial, "why": ""})
        write_state(job, verb, {"state": "done", "run": "abc", "options": {}, "asked": time.time()})
        place = job.path / f"{verb}.part"
        place.mkdir()
        write_json(place / "document.json", content, sealed=True)
        publish(job, verb, "abc", place, job.digests())
        return number

    return made


LOOKED = {"findings": [], "speed_rad_per_s": None}
CUT = "the file ends within line 9, after 4 of 6 columns: the file is truncated, 7 complete rows are used"
WARNINGS = {"4711-cut.csv": [CUT]}


@pytest.fixture
def estimated(taken):
    """A kept drop of the machine 4711 with its estimate."""
    return taken("4711.csv", "estimate", None, "4711")


@pytest.mark.parametrize(
    ("name", "head", "serial", "why"),
    [
        ("2026-03-14_4711_drop.csv", "", "4711", ""),
        ("4711-B drop.csv", "", "4711-B", ""),
        ("4711/drop.csv", "", "4711", ""),
        ("drop.csv", "Anlage: 4711\nt;x\n0,1;2", "4711", ""),
        ("14711.csv", "x", None, "neither its name nor its head"),
        ("drop.csv", "t;x\n4711;2\n", None, "neither its name nor its head"),
        ("drop.csv", "Anlagen 4711 und 9", "4711", ""),
    ],
)
def test_the_machine_of_a_record_is_found_by_name_folder_or_head(name, head, serial, why, machines, drops):
    record = drops / name
    record.parent.mkdir(exist_ok=True)
    record.write_text(head)
    found, said = read_fleet(machines).of(Path(name), record)
    assert (found and found.serial) == serial
    assert why in said


def test_two_serial_numbers_in_one_name_are_not_guessed_between(machines, drops):
    shutil.copy(machines / "4711.toml", machines / "0815.toml")
    found, said = read_fleet(machines).of(Path("4711_0815.csv"), drops)
    assert found is None
    assert "its name holds the serial numbers 0815 and 4711" in said


def test_limits_and_bearings_of_a_machine(machines):
    limits = machines / "4711.limits.toml"
    limits.write_text('bearings = "2026"\npeak_stress = "2.5 GPa"\n')
    fleet = read_fleet(machines)
    assert fleet.machines["4711"].limits == {"peak_stress_Pa": 2.5e9}
    assert [one.bearings for one in fleet.machines.values()] == ["4711-B", "2026"]
    limits.write_text('peak_strain = "2"\n')
    with pytest.raises(UsageError, match=r"4711.limits.toml.*peak_strain"):
        read_fleet(machines)
    with pytest.raises(UsageError, match="holds no machine file"):
        read_fleet(machines.parent)


def test_what_is_no_record_is_left_where_it_is(drops, kept):
    for name in ("a.csv", "a_tail.csv", ".b.csv", "c.csv.part", "d.cfg", "d.dat", "e.dat", "Thumbs.db"):
        (drops / name).write_text("x")
    inside = drops / "kept"
    inside.mkdir()
    (inside / "f.csv").write_text("x")
    assert sorted(one.path.name for one in arrived(drops, inside)) == ["a.csv", "d.cfg", "e.dat"]
    job = kept.job(kept.take(Arrived.at(drops / "a.csv")))
    assert sorted(job.read()["files"]) == ["record", "tail"]


def test_many_who_take_one_record_keep_it_once(drops, kept):
    for k in range(8):
        (drops / f"{k}.csv").write_text("one and the same content")
    with ThreadPoolExecutor(8) as pool:
        numbers = set(pool.map(lambda k: kept.take(Arrived.at(drops / f"{k}.csv")), range(8)))
    assert kept.numbers() == [*numbers]


def test_a_record_that_changed_since_it_was_seen_is_not_taken(drops, kept):
    file = drops / "a.csv"
    file.write_text("half")
    seen = Arrived.at(file)
    file.write_text("half and half")
    with pytest.raises(OutputError, match="changed while it was copied"):
        kept.take(seen)
    assert kept.numbers() == []


def test_records_of_unknown_machines_are_looked_at_and_bad_ones_are_quarantined(
    drops, kept, watcher, hook, reported
):
    def watched():
        one, said = watcher(hook=hook)
        one.run(once=True)
        return said

    shutil.copy(DROP, drops / "good.h5")
    (drops / "empty.csv").write_bytes(b"")
    watched()
    found = {one["record"]: one for one in reported()}
    assert found["good.h5"]["outcome"] == "looked"
    assert found["good.h5"]["speed_Hz"] == pytest.approx(60.0, abs=0.1)
    assert "the machine is not known" in found["good.h5"]["needs_person"]
    assert found["empty.csv"]["outcome"] == "quarantined"
    assert all(len(one) <= 15 for one in found.values())
    assert not any(isinstance(value, dict | list) for one in found.values() for value in one.values())
    (reason,) = kept.path.glob("quarantine/*/why.txt")
    assert reason.read_text() == "empty.csv is empty (0 bytes); export the recording again\n"
    assert watched() == [] and len(reported()) == 2
    shutil.rmtree(reason.parent)  # somebody wants it to be tried again
    why = "empty.csv is empty (0 bytes); export the recording again"
    assert watched() == [f"empty.csv: unknown machine, quarantined: {why}"]


def test_what_a_killed_watcher_left_is_done_by_the_next(drops, kept, watcher):
    (drops / "a.csv").write_bytes(b"")
    kept.take(Arrived.at(drops / "a.csv"))  # and killed here
    (drops / "a.csv").unlink()
    one, said = watcher()
    one.run(once=True)
    assert len(said) == 1 and "quarantined" in said[0]


def test_a_record_that_another_one_took_the_place_of_counts_too(drops, kept, watcher, taken):
    taken("a.csv", "look", LOOKED, words=" ")
    (drops / "a.csv").write_bytes(b"x")
    watcher()[0].run(once=True)
    outcomes = {status_of(kept.job(name))["outcome"] for name in kept.numbers()}
    assert outcomes == {"looked", "quarantined"}


def test_a_record_that_grew_replaces_what_was_taken_of_it(drops, kept, watcher, hook, reported):
    file, whole = drops / "a.csv", b"t;x\n0,1;2\n"

    def watched(content):
        file.write_bytes(content)
        one, said = watcher(hook=hook)
        one.run(once=True)
        return said

    watched(whole[:5])
    assert [one["outcome"] for one in reported()] == ["quarantined"]
    assert len(list(kept.path.glob("quarantine/*"))) == 1
    (cut,) = kept.numbers()
    watched(whole)
    replaced = ["quarantined", "replaced", "quarantined"]
    assert [one["outcome"] for one in reported()] == replaced
    assert reported()[1]["sha256"] == reported()[0]["sha256"]
    assert not (kept.path / "quarantine" / cut).exists()
    watched(whole[:5])  # and cut again: another copy that broke
    assert status_of(kept.job(cut))["outcome"] == "replaced"
    assert not (kept.path / "quarantine" / cut).exists()
    assert [one["outcome"] for one in reported()] == replaced


def test_a_cut_drop_that_was_logged_leaves_the_log_when_its_file_grows(
    tmp_path, kept, watcher, estimated, taken
):
    def logged():
        watcher()[0].run(once=True)
        return [drop.sha256 for drop in logged_drops(str(tmp_path / "drops.db")).values()]

    def digest(number):
        return kept.job(number).read()["files"]["record"]["sha256"]

    assert logged() == [digest(estimated)]
    whole = taken("4711.csv", "estimate", None, "4711", words="x and more")
    assert logged() == [digest(whole)]
    assert status_of(kept.job(estimated))["outcome"] == "replaced"


def test_a_record_that_ends_too_early_needs_a_person(tmp_path, watcher, taken, hook, reported):
    taken("4711-cut.csv", "estimate", None, "4711")
    watcher(hook=hook)[0].run(once=True)
    (news,) = reported()
    assert news["needs_person"] == f"{CUT}."
    assert (tmp_path / "told").read_bytes().endswith(b"}\n")


def test_an_estimate_is_logged_once_and_judged_by_the_limits(
    tmp_path, machines, watcher, estimated, hook, reported
):
    (machines / "4711.limits.toml").write_text('bearings = "2026"\npeak_stress = "1.2 GPa"\n')
    one, said = watcher(hook=f"{sys.executable} -c 'import sys; sys.exit(3)'")
    one.run(once=True)
    assert said == []  # logged, but the hook has not taken it
    log = str(tmp_path / "drops.db")
    assert [drop.bearing_set for drop in logged_drops(log).values()] == ["2026"]
    one, said = watcher(hook=hook)
    one.run(once=True)
    assert len(logged_drops(log)) == 1
    assert "drop 1 of the log; needs a person: By the limits given: peak Hertz stress" in said[0]
    (news,) = reported()
    assert (news["peak_force_N"], news["peak_force_lower_N"]) == (3300.0, 3200.0)
    assert news["machine"] == "4711" and "passed" in news["needs_person"]
    assert one.kept.job(estimated).read()["judged"]["text"] == news["needs_person"]


@on_posix
@pytest.mark.parametrize("thing", ["folder", "pipe", "link that leads nowhere"])
@pytest.mark.parametrize(
    "place",
    [
        "machines/4712.toml",
        "drops/b.csv",
        "kept/overview.html",
        "kept/jobs/0123456789abcdef",
        "kept/jobs/{}/watch.json",
        "kept/jobs/{}/watch.lock",
        "kept/jobs/{}/job.json",
        "kept/jobs/{}/estimate.result.json",
        "kept/jobs/{}/estimate.state.json",
        "kept/jobs/{}/estimate.abc/document.json",
        "kept/quarantine/{}",
    ],
)
def test_what_is_no_file_keeps_no_watcher_waiting(tmp_path, watcher, estimated, place, thing):
    """Where the estimate can be logged it is; where it cannot, the thing is named."""
    file = tmp_path / place.format(estimated)
    shutil.rmtree(file) if file.is_dir() else file.unlink(missing_ok=True)
    NO_FILE[thing](file)
    complaints = []
    with in_time():
        try:
            one, said = watcher(complain=complaints.append)
            one.turn()
        except RotordropError as refusal:
            complaints.append(str(refusal))
            said = []
    overview = tmp_path / "kept" / "overview.html"
    complaints += [overview.read_text()] if overview.is_file() else []
    named = any(file.name in one for one in complaints + said)
    logged = (tmp_path / "drops.db").exists() and len(logged_drops(tmp_path / "drops.db")) == 1
    assert named or logged, (complaints, said)


def test_a_machine_file_that_comes_later_is_used(machines, kept, watcher, taken):
    number = taken("9000.csv", "look", LOOKED)
    watcher()[0].run(once=True)
    assert status_of(kept.job(number))["outcome"] == "looked"
    shutil.copy(machines / "4711.toml", machines / "9000.toml")
    watcher()[0].run(once=True)
    told = status_of(kept.job(number))
    assert (told["serial"], told["outcome"]) == ("9000", "quarantined")  # an x is no record


def test_a_watcher_that_begins_anew_asks_no_head_again_while_the_machines_stay(
    machines, watcher, taken, monkeypatch
):
    """With thousands of records it did nothing else for half a minute; the next kill came before."""
    taken("9000.csv", "look", LOOKED)
    watcher()[0].run(once=True)
    asked = []
    monkeypatch.setattr(Fleet, "of", lambda _, name, record: asked.append(name) or (None, "unknown"))
    watcher()[0].run(once=True)
    assert not asked
    os.utime(machines / "4711.toml", (time.time() + 60.0,) * 2)
    watcher()[0].run(once=True)
    assert len(asked) == 1


def test_the_tail_of_a_record_is_found_in_whatever_case(drops):
    for name in ("Drop.csv", "drop_TAIL.csv", "drop_tail2.csv", "other_tail.csv"):
        (drops / name).write_text("x")
    assert parts_of(drops / "Drop.csv") == {"record": drops / "Drop.csv", "tail": drops / "drop_TAIL.csv"}


def test_the_command_says_what_is_missing(tmp_path, machines, drops, capsys):
    call = ["watch", str(drops), "--machines", str(machines), "--once", "--log"]
    assert run([*call, "postgresql://nobody@nowhere/log"]) == 64
    assert "name one for the records with --keep" in capsys.readouterr().err
    assert run(["watch", str(tmp_path / "no"), *call[2:], str(tmp_path / "drops.db")]) == 64
    assert "is no folder" in capsys.readouterr().err
    assert run([*call, str(tmp_path / "drops.db")]) == 0
    assert (tmp_path / "drops.kept" / "overview.html").exists()
