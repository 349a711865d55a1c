"""The verbs calibrate and estimate, from files to files: what is written, refused, and left by a stop."""

import hashlib
import json
import re
import shutil
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import h5py
import jsonschema
import numpy as np
import pytest

from rotordrop import example_record_path, look, read_record
from rotordrop.cli.app import INTERRUPTED, run
from rotordrop.errors import UsageError
from rotordrop.estimate.coast_down import recorded_coast_down
from rotordrop.estimate.published import estimate_schema
from rotordrop.estimate.record_facts import COUNTED_TWICE, INCONSISTENT_CALIBRATION, facts_of
from rotordrop.evidence.evidence import Evidence
from rotordrop.known import NINETY, Known
from rotordrop.machine import example_machine, example_path, load_machine
from rotordrop.machine.calibration import CalibrationDrop, CalibrationOrigin
from rotordrop.machine.saving import machine_text
from rotordrop.spectrum.coast_down import find_settling
from rotordrop.track.calibration import BLIND_SCHEDULE, Stage
from rotordrop.track.consistency import Check
from rotordrop.twin.search import is_calibrated, track_drops

LP400 = str(example_path("lp400"))
RECORD = str(example_record_path("lp400_drop_060"))
TAIL = str(example_record_path("lp400_drop_060_tail"))
USAGE = UsageError.exit_code
SHORT = 0.03
"""Window of the tests [s]: the verbs are tested here, the estimator elsewhere."""
TRUE_IMPACTS = {
    "NDE": (7.75e-3, 15.26e-3, 22.99e-3, 32.97e-3, 43.43e-3, 52.14e-3),
    "DE": (7.11e-3, 21.70e-3, 29.24e-3, 37.94e-3),
}
"""Contacts after flights of 3.3 ms and more in the simulation behind the record [s from power-off]."""


@pytest.fixture(scope="module")
def fitted_once():
    """The fit of a calibration, made once for each machine and set of drops."""
    found = {}

    def fit(search, machine):
        drops = (str(one.record.sha256) for one in search.drops.evidence)
        key = (machine_text(machine), *drops)
        if key not in found:
            found[key] = track_drops(search, machine)
        return found[key]

    return fit


@pytest.fixture(scope="module")
def shortened():
    """The estimator with a few passes over the first impacts only."""
    with pytest.MonkeyPatch.context() as patch:
        module = "rotordrop.twin.search"
        for room in (module, "rotordrop.twin.problems"):
            patch.setattr(f"{room}.BLIND_SCHEDULE", BLIND_SCHEDULE[:4])
        patch.setattr(f"{module}.CALIBRATION_STAGE", Stage(until=SHORT, force=0.07, share=0.01, passes=1))
        patch.setattr("rotordrop.twin.problems.WINDOW", SHORT)
        yield


@pytest.fixture(scope="module")
def folder(shortened, fitted_once, tmp_path_factory):
    """Where a calibration has written its machine and its JSON."""
    place = tmp_path_factory.mktemp("calibration")
    arguments = ["calibrate", LP400, RECORD, "--tail", TAIL, "--output", str(place / "calibrated.toml")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rotordrop.twin.calibrated.track_drops", fitted_once)
        assert run([*arguments, "--json", str(place / "calibration.json")]) == 0
    return place


@pytest.fixture
def calibrated(folder):
    """A call for an estimate of the record on the calibrated machine."""
    return ["estimate", str(folder / "calibrated.toml"), RECORD, "--tail", TAIL]


def another_drop(place):
    """A file that reads like the bundled record and is not the same."""
    copy = place / "second.h5"
    copy.write_bytes(Path(RECORD).read_bytes())
    with h5py.File(copy, "r+") as file:
        file.attrs["remark"] = "another drop"
    return copy


def words(text):
    return " ".join(text.split())


@pytest.fixture
def interrupted(shortened, monkeypatch):
    """A progress bar during which somebody presses Ctrl-C."""

    @contextmanager
    def bar(title):
        def report(stage, fraction):
            if fraction > 0.0:
                raise KeyboardInterrupt

        yield report

    monkeypatch.setattr("rotordrop.cli.estimate.progress_bar", bar)


def test_the_calibrated_machine_loads_with_intervals_and_provenance(folder):
    before, machine = load_machine(LP400), load_machine(folder / "calibrated.toml")
    assert is_calibrated(machine) and not is_calibrated(before) and before.calibration is None
    digest = hashlib.sha256(Path(RECORD).read_bytes()).hexdigest()
    assert [(drop.name, drop.sha256) for drop in machine.calibration.drops] == [("drop_060", digest)]
    assert machine.calibration.consistent
    found = json.loads((folder / "calibration.json").read_text())["values"]
    for bearing, guess in zip(machine.touchdown_bearings, before.touchdown_bearings, strict=True):
        for path in ("stiffness", "mass", "damping"):
            quantity, entry = getattr(bearing.support, path), found[f"{bearing.name}.support.{path}"]
            assert (quantity.status, quantity.source) == ("estimated", "calibrated on drop_060")
            assert float(quantity) == pytest.approx(entry["value"])
            low, high = quantity.interval_90
            assert [low, high] == pytest.approx(entry["interval_90"])
            assert low < float(quantity) < high
        assert float(bearing.air_gap) != float(guess.air_gap)
    assert all(sensor.gain.status == "estimated" for sensor in machine.sensors)


def test_the_calibration_says_what_the_records_determine(folder):
    found = json.loads((folder / "calibration.json").read_text())
    verdicts = {entry["path"]: entry["verdict"] for entry in found["identifiability"]}
    assert verdicts["NDE.support.stiffness"] == "determined"
    assert verdicts["NDE.race.drag_coefficient"] == "the record does not determine it"
    assert found["sentence"].endswith(".")
    assert set(found["checks"]) == set(found["nis"]) == {"drop_060"}


def test_quick_estimate_writes_numbers_and_report(calibrated, tmp_path):
    out, page = tmp_path / "out.json", tmp_path / "report.html"
    assert run([*calibrated, "--quick", "--json", str(out), "--report", str(page)]) == 0
    written = json.loads(out.read_text())
    jsonschema.Draft202012Validator(estimate_schema()).validate(written)
    assert written["method"] == "tracked"
    (twice,) = (warning for warning in written["warnings"] if "its readings count twice" in warning)
    assert "calibrated on a drop named drop_060" in twice
    for name in ("NDE", "DE"):
        entry = written["bearings"][name]["peak_force_N"]
        low, high = entry["interval_90"]
        assert low < entry["value"] < high and 0.0 < entry["time_s"] < SHORT
    assert 'src="http' not in page.read_text(encoding="utf-8")


def test_look_waterfall_and_estimate_say_the_same_of_one_drop(folder, tmp_path):
    """Gap, first touch, impacts, begin of lasting contact: one rule, numbers within their intervals."""
    out = tmp_path / "out.json"
    assert run(["estimate", str(folder / "calibrated.toml"), RECORD, "--quick", "--json", str(out)]) == 0
    estimate, seen = json.loads(out.read_text()), look(RECORD)
    machine = load_machine(LP400)
    signal = recorded_coast_down(machine, read_record(RECORD, machine))
    off = estimate["drop_instant_s"]
    for plane in seen.planes:
        name = plane.plane
        known = {"air_gap": signal.air_gap[name], "start_time": signal.start_time}
        down = find_settling(signal.planes[name], signal.sampling_rate, **known)
        own = [hit.time - off for hit in seen.impacts if hit.plane == name]
        contacts = estimate["bearings"][name]["impacts"]
        begun = [contact["start_s"] for contact in contacts if contact["after_flight"]]
        assert len(contacts) >= len(begun) >= 1
        # the estimate ends after 30 ms here
        for found, until in ((down.touched, 0.25), (np.array(begun), SHORT)):
            assert abs(np.sum(found < until) - sum(time < until for time in own)) <= 1
        settled = plane.settling
        assert down.contact_from == pytest.approx(settled.contact_from - off, abs=2e-3)
        for one in (down.count_interval_90, settled.count_interval_90):
            assert one[0] <= len(TRUE_IMPACTS[name]) <= one[1]
        early, late = settled.contact_from_interval_90
        assert early - off < TRUE_IMPACTS[name][-1] < late - off
        early, starts = (
            [time for time in TRUE_IMPACTS[name] if time < SHORT],
            [c["start_s"] for c in contacts],
        )
        assert all(min(abs(start - time) for start in starts) < 0.2e-3 for time in early)
        assert abs(len(begun) - len(early)) <= 1  # one flight lasts as long as the shortest that counts
        low, high = plane.touch_interval_90
        assert low < contacts[0]["start_s"] + off < high
        gaps = [
            plane.gap_interval_90,
            estimate["bearings"][name]["air_gap_m"]["interval_90"],
            [signal.air_gap[name] + sign * NINETY * signal.air_gap_error[name] for sign in (-1, 1)],
        ]
        assert max(gap[0] for gap in gaps) < min(gap[1] for gap in gaps)


@pytest.mark.slow
def test_the_full_estimate_sets_the_cross_check_beside_it(calibrated, tmp_path):
    out = tmp_path / "out.json"
    assert run([*calibrated, "--json", str(out)]) == 0
    checks = {check["name"]: check for check in json.loads(out.read_text())["cross_check"]}
    assert set(checks) == {f"{b} peak {what}" for b in ("NDE", "DE") for what in ("force", "stress")}
    for check in checks.values():
        assert check["cross_check"] == pytest.approx(check["estimate"], rel=check["known_relative_accuracy"])
        assert check["agrees"]


INCONSISTENT = (
    Check(name="innovation size", passed=False, message="mean squared innovation 9.00 × expected"),
)


@pytest.mark.slow
def test_an_estimate_inconsistent_with_its_record_is_written_and_ends_with_its_own_code(
    calibrated, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr("rotordrop.twin.tracked.consistency_checks", lambda *_: INCONSISTENT)
    out, page = tmp_path / "out.json", tmp_path / "report.html"
    assert run([*calibrated, "--quick", "--all", "--json", str(out), "--report", str(page)]) == 7
    assert "Parameters of the machine" in capsys.readouterr().out
    written = json.loads(out.read_text())
    assert written["consistent"] is False and page.exists()


@pytest.mark.slow
def test_a_calibration_inconsistent_with_its_drops_is_not_written(
    shortened, fitted_once, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr("rotordrop.twin.calibrated.track_drops", fitted_once)
    monkeypatch.setattr("rotordrop.twin.calibrated.consistency_checks", lambda *_: INCONSISTENT)
    output = tmp_path / "calibrated.toml"
    arguments = ["calibrate", LP400, RECORD, "--tail", TAIL, "--output", str(output)]
    assert run(arguments) == 7
    told = words(capsys.readouterr().err)
    assert f"not consistent with drop_060: intervals are doubled. {output} was not written" in told
    assert not output.exists()


@pytest.mark.slow
def test_several_records_give_machine_and_drops(calibrated, tmp_path, capsys):
    copy, page = another_drop(tmp_path), tmp_path / "page.html"
    assert run([*calibrated, str(copy), "--quick", "--json", "-", "--report", str(page)]) == 0
    written = json.loads(capsys.readouterr().out)
    jsonschema.Draft202012Validator(estimate_schema()).validate(written)
    assert written["machine"] == load_machine(LP400).name
    assert set(written["drops"]) == {"drop_060", "second"}
    assert sorted(f.name for f in tmp_path.glob("*.html")) == ["page_drop_060.html", "page_second.html"]


def test_an_estimate_stopped_at_a_warning_leaves_an_earlier_one_alone(interrupted, tmp_path, caplog):
    """What the gate warns of is told before the fit, which such a record makes long."""
    earlier, faulty = tmp_path / "estimate.json", another_drop(tmp_path)
    with h5py.File(faulty, "r+") as file:
        file["displacement/S_NDE_B"].attrs["scale"] *= 1.2
    earlier.write_text("{}")
    for record, told in (
        (RECORD, ""),
        (str(faulty), "second: wrong gain S_NDE_B: .* check sensitivity.*Ctrl-C"),
    ):
        arguments = ["estimate", LP400, record, "--json", str(earlier), "--report", str(tmp_path / "r.html")]
        assert run(arguments) == INTERRUPTED
        assert re.match(told or "$", words("".join(one.getMessage() for one in caplog.records)))
        assert {*tmp_path.iterdir()} == {earlier, faulty} and earlier.read_text() == "{}"


@pytest.mark.parametrize("verb", ["estimate", "calibrate"])
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            "{record} {other} --tail {tail} --tail {tail} --tail {tail}",
            "3 tails for 2 records; expected one for all, one for each, or none.",
        ),
        ("{tail}", "drop_060_tail cannot be used: no drop in the record: the shaft moves away by"),
        (
            "{tail} --profile {profile}",
            "drop_060_tail cannot be used: missing pre-trigger: no drop in the record",
        ),
        ("{record} {copy}", "copy are the same recording (equal content)"),
        ("{record} {again}", "2 records are named 'drop_060'; expected a name of its own"),
    ],
)
def test_records_that_are_no_drops_are_refused(verb, arguments, message, tmp_path, capsys):
    (tmp_path / "profile.toml").write_text('[speed]\nconstant = "60 Hz"\n')
    (tmp_path / "again").mkdir()
    names = {"profile": "profile.toml", "copy": "copy.h5", "again": "again/drop_060.h5"}
    made = {name: tmp_path / file for name, file in names.items()}
    shutil.copy(RECORD, made["copy"])
    shutil.copy(RECORD, made["again"])
    call = arguments.format(record=RECORD, tail=TAIL, other=another_drop(tmp_path), **made).split()
    output = tmp_path / "out.toml"
    place = ["--output" if verb == "calibrate" else "--json", str(output)]
    assert run([verb, LP400, *call, *place]) == (3 if "cannot be used" in message else USAGE)
    assert message in words(capsys.readouterr().err)
    assert not output.exists()


FAULTS = {
    "unit": (
        lambda record: replace(record, signals=1e3 * record.signals),
        r"cannot be used: wrong unit factor S_NDE_A.*span .* × the air gap of 250 µm in lp400\.toml, a drop "
        r"1 to 2\.5 ×; a unit factor of 1.* or its air_gap",
    ),
    "no speed": (
        lambda record: replace(record, speed=None),
        r'speed missing: the record has no shaft speed beside S_NDE_A.*\[speed\] constant = "60 Hz"',
    ),
}


@pytest.mark.parametrize(("change", "message"), FAULTS.values(), ids=FAULTS)
def test_a_faulty_record_is_refused_by_name_and_leaves_no_file(change, message, tmp_path, capsys):
    """What else the gate finds: ``evidence/test_gate``; what readers refuse: ``record``."""
    whole = read_record(example_record_path("lp400_drop_060"), example_machine("lp400"))
    record, file = change(whole.window(-0.1, 0.05)), tmp_path / "record.csv"
    names = ["time [s]", *(f"{name} [um]" for name in record.channel_names)]
    columns = [record.time, *(record.signals.T * 1e6)]
    if record.speed is not None:
        names, columns = [*names, "speed [Hz]"], [*columns, record.speed / (2.0 * np.pi)]
    np.savetxt(file, np.column_stack(columns), "%.6f", ",", header=",".join(names), comments="")
    outputs = ["--json", str(tmp_path / "out.json"), "--report", str(tmp_path / "out.html")]
    assert run(["estimate", LP400, str(file), *outputs]) == 3
    told = capsys.readouterr()
    assert told.out == "" and list(tmp_path.iterdir()) == [file]
    assert re.search(message, " ".join(told.err.split()).removeprefix("rotordrop: record ")), told.err


@pytest.mark.parametrize("verb", ["estimate", "calibrate"])
def test_a_tail_of_another_recorder_has_a_profile_of_its_own(verb, tmp_path, capsys, monkeypatch):
    """Also one without a speed, as recorders of slow data have none."""
    other, rules = tmp_path / "slow.csv", tmp_path / "slow.toml"
    other.write_text(Path(TAIL).read_text().replace("S_NDE_A", "X1").replace("S_DE_B", "Y2"))
    rules.write_text('[channels]\nS_NDE_A = "X1"\nS_DE_B = "Y2"\n')
    seen = []

    def noted(_machine, _records, tails, **_others):
        seen.extend(tails)
        raise UsageError("seen")

    monkeypatch.setattr("rotordrop.estimation.estimate_drops", noted)
    monkeypatch.setattr("rotordrop.twin.calibrated.calibrate_machine", noted)
    call = [verb, LP400, RECORD, "--tail", str(other)]
    call += ["--output", str(tmp_path / "m.toml")] if verb == "calibrate" else []
    assert run(call) == 3
    assert "no channel 'S_NDE_A' for sensor S_NDE_A (2 sensors have none)" in capsys.readouterr().err
    assert run([*call, "--tail-profile", str(rules)]) == USAGE
    assert seen[0].channel_names == ("S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B")
    assert seen[0].speed is None


def warnings_for(machine, name):
    """Warnings that the bundled record, under a name, gets for the calibration of a machine."""
    twice = {COUNTED_TWICE.format(drop) for drop in ("drop_060", "first", "first, second")}
    evidence = Evidence(record=read_record(RECORD, machine), machine=machine, tail=None, name=name)
    return {INCONSISTENT_CALIBRATION, *twice} & set(facts_of(evidence).warnings)


def test_what_a_user_writes_as_a_source_is_not_taken_for_a_calibration():
    text = "calibrated on drop_060 (not consistent with them)"
    written = Known(value=1e8, status="estimated", interval_90=(9e7, 1.1e8), source=text)
    machine = load_machine(LP400).with_values({f"{end}.support.stiffness": written for end in ("NDE", "DE")})
    assert warnings_for(machine, "drop_060") == set()


def test_a_drop_of_the_calibration_is_known_by_its_whole_name_or_its_hash():
    """A comma does not make two drops of it, and a copy under another name is the same recording."""
    digest = hashlib.sha256(Path(RECORD).read_bytes()).hexdigest()
    twice = {COUNTED_TWICE.format("first, second")}
    for sha256, name, told in (("", "first, second", twice), ("", "first", set()), (digest, "copy", twice)):
        drop = CalibrationDrop(name="first, second", sha256=sha256)
        machine = load_machine(LP400).calibrated_on(CalibrationOrigin(drops=(drop,), consistent=True))
        assert warnings_for(machine, name) == told, (sha256, name)
