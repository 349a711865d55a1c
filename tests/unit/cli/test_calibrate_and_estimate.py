"""The verbs calibrate and estimate, from files to files: what is written, refused, and left by a stop."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import jsonschema
import numpy as np
import pytest

from rotordrop.cli.app import INTERRUPTED, run
from rotordrop.errors import ConsistencyError, UsageError
from rotordrop.estimate.published import estimate_schema
from rotordrop.estimate.record_facts import COUNTED_TWICE, INCONSISTENT_CALIBRATION, facts_of
from rotordrop.estimate.recorded_coast_down import recorded_coast_down
from rotordrop.evidence.evidence import Evidence
from rotordrop.evidence.look import look
from rotordrop.known import NINETY, Known
from rotordrop.machine import Machine, example_path, load_machine
from rotordrop.machine.calibration import CalibrationDrop, CalibrationOrigin
from rotordrop.machine.saving import machine_text
from rotordrop.record.examples import example_record_path
from rotordrop.record.record import read_record
from rotordrop.spectrum.indentation import find_settling
from rotordrop.track.calibration import BLIND_SCHEDULE, Stage
from rotordrop.track.consistency import Check
from rotordrop.twin.search import Candidate, Search, is_calibrated, track_drops

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
def fitted_once() -> Callable[[Search, Machine], Candidate]:
    """The fit of a calibration, made once for each machine and set of drops."""
    found: dict[tuple[str, ...], Candidate] = {}

    def fit(search: Search, machine: Machine) -> Candidate:
        drops = (str(one.record.sha256) for one in search.drops.evidence)
        key = (machine_text(machine), *drops)
        if key not in found:
            found[key] = track_drops(search, machine)
        return found[key]

    return fit


@pytest.fixture(scope="module")
def shortened() -> Iterator[None]:
    """The estimator with a few passes over the first impacts only."""
    with pytest.MonkeyPatch.context() as patch:
        module = "rotordrop.twin.search"
        for room in (module, "rotordrop.twin.problems"):
            patch.setattr(f"{room}.BLIND_SCHEDULE", BLIND_SCHEDULE[:4])
        patch.setattr(f"{module}.CALIBRATION_STAGE", Stage(until=SHORT, force=0.07, share=0.01, passes=1))
        patch.setattr("rotordrop.twin.problems.WINDOW", SHORT)
        yield


@pytest.fixture(scope="module")
def folder(
    shortened: None,
    fitted_once: Callable[[Search, Machine], Candidate],
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    """Where a calibration has written its machine and its JSON."""
    place = tmp_path_factory.mktemp("calibration")
    arguments = ["calibrate", LP400, RECORD, "--tail", TAIL, "--output", str(place / "calibrated.toml")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rotordrop.twin.calibrated.track_drops", fitted_once)
        assert run([*arguments, "--json", str(place / "calibration.json")]) == 0
    return place


def another_drop(place: Path) -> Path:
    """A file that reads like the bundled record and is not the same."""
    copy = place / "second.h5"
    copy.write_bytes(Path(RECORD).read_bytes())
    with h5py.File(copy, "r+") as file:
        file.attrs["remark"] = "another drop"
    return copy


def words(text: str) -> str:
    return " ".join(text.split())


def interrupted(title: str) -> Any:
    """A progress bar during which somebody presses Ctrl-C."""

    @contextmanager
    def bar(title: str) -> Iterator[Any]:
        def report(stage: str, fraction: float) -> None:
            if fraction > 0.0:
                raise KeyboardInterrupt

        yield report

    return bar(title)


def test_the_calibrated_machine_loads_with_intervals_and_provenance(folder: Path) -> None:
    before, machine = load_machine(LP400), load_machine(folder / "calibrated.toml")
    assert is_calibrated(machine) and not is_calibrated(before)
    assert machine.calibration is not None and before.calibration is None
    digest = hashlib.sha256(Path(RECORD).read_bytes()).hexdigest()
    assert [(drop.name, drop.sha256) for drop in machine.calibration.drops] == [("drop_060", digest)]
    assert machine.calibration.consistent
    found = json.loads((folder / "calibration.json").read_text())["values"]
    for b, bearing in enumerate(machine.touchdown_bearings):
        for path in ("stiffness", "mass", "damping"):
            quantity = getattr(bearing.support, path)
            entry = found[f"{bearing.name}.support.{path}"]
            assert quantity.status == "estimated"
            assert float(quantity) == pytest.approx(entry["value"])
            assert quantity.interval_90 == pytest.approx(entry["interval_90"])
            low, high = quantity.interval_90
            assert low < float(quantity) < high
            assert quantity.source == "calibrated on drop_060"
        assert float(bearing.air_gap) != float(before.touchdown_bearings[b].air_gap)
    assert all(sensor.gain.status == "estimated" for sensor in machine.sensors)


def test_the_calibration_says_what_the_records_determine(folder: Path) -> None:
    found = json.loads((folder / "calibration.json").read_text())
    verdicts = {entry["path"]: entry["verdict"] for entry in found["identifiability"]}
    assert verdicts["NDE.support.stiffness"] == "determined"
    assert verdicts["NDE.race.drag_coefficient"] == "the record does not determine it"
    assert found["sentence"].endswith(".")
    assert set(found["checks"]) == set(found["nis"]) == {"drop_060"}


def test_quick_estimate_writes_numbers_and_report(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, page, film = tmp_path / "out.json", tmp_path / "report.html", tmp_path / "drop.gif"
    arguments = ["estimate", str(folder / "calibrated.toml"), RECORD, "--tail", TAIL, "--quick"]
    assert run([*arguments, "--json", str(out), "--report", str(page), "--film", str(film)]) == 0
    assert film.read_bytes().startswith(b"GIF89a")
    written = json.loads(out.read_text())
    jsonschema.Draft202012Validator(estimate_schema()).validate(written)
    assert written["method"] == "tracked"
    twice = [warning for warning in written["warnings"] if "its readings count twice" in warning]
    assert len(twice) == 1 and "calibrated on a drop named drop_060" in twice[0]
    for name in ("NDE", "DE"):
        entry = written["bearings"][name]["peak_force_N"]
        low, high = entry["interval_90"]
        assert low < entry["value"] < high and 0.0 < entry["time_s"] < SHORT
    html = page.read_text(encoding="utf-8")
    assert "This record is simulated" in html and 'src="http' not in html
    assert "Quick estimate: one pass over the record" in html
    for heading in ("Impacts", "Parameters", "Consistency", "Orbit", "Hertz stress"):
        assert f">{heading}<" in html
    told = words(capsys.readouterr().out)
    assert f"Film: {film}" in told
    assert written["consistency"]["sentence"] in told
    assert str(page) in told.replace(" ", "")


def test_look_waterfall_and_estimate_say_the_same_of_one_drop(folder: Path, tmp_path: Path) -> None:
    """Gap, first touch, impacts, begin of lasting contact: one rule, numbers within their intervals."""
    out = tmp_path / "out.json"
    assert run(["estimate", str(folder / "calibrated.toml"), RECORD, "--quick", "--json", str(out)]) == 0
    estimate, seen = json.loads(out.read_text()), look(RECORD)
    machine = load_machine(LP400)
    signal = recorded_coast_down(machine, read_record(RECORD, machine))
    off = estimate["drop_instant_s"]
    assert signal.air_gap_error is not None
    for plane in seen.planes:
        name = plane.plane
        down = find_settling(
            signal.planes[name],
            signal.sampling_rate,
            air_gap=signal.air_gap[name],
            start_time=signal.start_time,
        )
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
        assert begun == pytest.approx([time for time in TRUE_IMPACTS[name] if time < SHORT], abs=0.2e-3)
        assert plane.touch_interval_90 is not None
        low, high = plane.touch_interval_90
        assert low < contacts[0]["start_s"] + off < high
        gaps = [
            plane.gap_interval_90,
            estimate["bearings"][name]["air_gap_m"]["interval_90"],
            [signal.air_gap[name] + sign * NINETY * signal.air_gap_error[name] for sign in (-1, 1)],
        ]
        assert max(gap[0] for gap in gaps) < min(gap[1] for gap in gaps)


def test_the_full_estimate_sets_the_cross_check_beside_it(folder: Path, tmp_path: Path) -> None:
    out, page = tmp_path / "out.json", tmp_path / "report.html"
    arguments = ["estimate", str(folder / "calibrated.toml"), RECORD, "--tail", TAIL]
    assert run([*arguments, "--json", str(out), "--report", str(page)]) == 0
    checks = {check["name"]: check for check in json.loads(out.read_text())["cross_check"]}
    assert set(checks) == {f"{b} peak {what}" for b in ("NDE", "DE") for what in ("force", "stress")}
    for check in checks.values():
        assert check["cross_check"] == pytest.approx(check["estimate"], rel=check["known_relative_accuracy"])
        assert check["agrees"]
    html = page.read_text(encoding="utf-8")
    assert ">Independent cross-check<" in html and "Quick estimate" not in html


def inconsistent(*_: object) -> tuple[Check, ...]:
    return (Check(name="innovation size", passed=False, message="mean squared innovation 9.00 × expected"),)


def test_an_estimate_inconsistent_with_its_record_is_written_and_ends_with_its_own_code(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("rotordrop.twin.tracked.consistency_checks", inconsistent)
    out, page = tmp_path / "out.json", tmp_path / "report.html"
    arguments = ["estimate", str(folder / "calibrated.toml"), RECORD, "--tail", TAIL, "--quick"]
    code = run([*arguments, "--json", str(out), "--report", str(page)])
    assert code == ConsistencyError.exit_code == 7
    written = json.loads(out.read_text())
    assert written["consistent"] is False and written["verdict"].startswith("The model is not consistent")
    assert page.exists()
    streams = capsys.readouterr()
    told = words(streams.out)
    assert told.index("problem: The model is not consistent") < told.index("peak bearing force")
    assert "drop_060: The model is not consistent with the record" in words(streams.err)
    assert "9.00 × expected" in words(streams.err)


def test_a_calibration_inconsistent_with_its_drops_is_not_written(
    shortened: None,
    fitted_once: Callable[[Search, Machine], Candidate],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("rotordrop.twin.calibrated.track_drops", fitted_once)
    monkeypatch.setattr("rotordrop.twin.calibrated.consistency_checks", inconsistent)
    output = tmp_path / "calibrated.toml"
    arguments = ["calibrate", LP400, RECORD, "--tail", TAIL, "--output", str(output)]
    assert run(arguments) == ConsistencyError.exit_code
    told = words(capsys.readouterr().err)
    assert f"not consistent with drop_060: intervals are doubled. {output} was not written" in told
    assert "--even-if-inconsistent writes the file all the same" in told and not output.exists()
    assert run([*arguments, "--even-if-inconsistent"]) == ConsistencyError.exit_code
    origin = load_machine(output).calibration
    assert origin is not None and not origin.consistent and origin.drops[0].name == "drop_060"


def test_several_records_give_machine_and_drops(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = another_drop(tmp_path)
    page = tmp_path / "page.html"
    arguments = ["estimate", str(folder / "calibrated.toml"), RECORD, str(copy), "--tail", TAIL, "--quick"]
    assert run([*arguments, "--json", "-", "--report", str(page)]) == 0
    written = json.loads(capsys.readouterr().out)
    jsonschema.Draft202012Validator(estimate_schema()).validate(written)
    assert written["machine"] == load_machine(LP400).name
    assert set(written["drops"]) == {"drop_060", "second"}
    assert sorted(f.name for f in tmp_path.glob("*.html")) == ["page_drop_060.html", "page_second.html"]


def test_a_stopped_calibration_leaves_no_file(
    shortened: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("rotordrop.cli.estimate.progress_bar", interrupted)
    output = tmp_path / "calibrated.toml"
    assert run(["calibrate", LP400, RECORD, "--tail", TAIL, "--output", str(output)]) == INTERRUPTED
    assert "stopped; nothing was left half written" in words(capsys.readouterr().err)
    assert list(tmp_path.iterdir()) == []


def test_a_stopped_estimate_leaves_an_earlier_one_alone(
    shortened: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rotordrop.cli.estimate.progress_bar", interrupted)
    earlier = tmp_path / "estimate.json"
    earlier.write_text("{}")
    arguments = ["estimate", LP400, RECORD, "--json", str(earlier), "--report", str(tmp_path / "r.html")]
    assert run(arguments) == INTERRUPTED
    assert [file.name for file in tmp_path.iterdir()] == ["estimate.json"]
    assert earlier.read_text() == "{}"


def test_tails_must_fit_the_records(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tails = ["--tail", TAIL, "--tail", TAIL, "--tail", TAIL]
    expected = "3 tails for 2 records; expected one for all, one for each, or none."
    second = another_drop(tmp_path)
    assert run(["estimate", LP400, RECORD, str(second), *tails]) == USAGE
    assert expected in words(capsys.readouterr().err)
    output = tmp_path / "out.toml"
    assert run(["calibrate", LP400, RECORD, str(second), *tails, "--output", str(output)]) == USAGE
    assert expected in words(capsys.readouterr().err)
    assert not output.exists()


@pytest.mark.parametrize("option", ["--json", "--report"])
def test_an_unwritable_place_is_refused_before_anything_is_read(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nowhere = tmp_path / "nowhere" / "out"
    assert run(["estimate", LP400, str(tmp_path / "no_record.csv"), option, str(nowhere)]) != 0
    told = words(capsys.readouterr().err)
    assert f"the folder {nowhere.parent} does not exist; create it first" in told
    assert "no_record" not in told


def test_calibrate_refuses_an_unwritable_output(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["calibrate", LP400, RECORD, "--output", str(tmp_path)]) != 0
    assert f"cannot write {tmp_path}: it is a folder; name a file in it" in words(capsys.readouterr().err)


@pytest.mark.parametrize("verb", ["estimate", "calibrate"])
@pytest.mark.parametrize(
    ("profile", "message"),
    [
        ("", "drop_060_tail cannot be used: no drop in the record: the shaft moves away by"),
        (
            '[speed]\nconstant = "60 Hz"\n',
            "drop_060_tail cannot be used: missing pre-trigger: no drop in the record",
        ),
    ],
)
def test_a_record_without_speed_or_drop_is_refused(
    verb: str, profile: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    channels = tmp_path / "profile.toml"
    channels.write_text(profile)
    output = tmp_path / "out.toml"
    arguments = [verb, LP400, TAIL, *(["--profile", str(channels)] if profile else [])]
    assert run([*arguments, *(["--output", str(output)] if verb == "calibrate" else [])]) != 0
    assert message in words(capsys.readouterr().err)
    assert not output.exists()


def test_quick_needs_a_calibrated_machine(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["estimate", LP400, RECORD, "--quick"]) == USAGE
    told = words(capsys.readouterr().err)
    assert "--quick needs a calibrated machine" in told and "rotordrop calibrate" in told


@pytest.mark.parametrize("verb", ["estimate", "calibrate"])
def test_one_recording_under_two_names_is_refused(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy, output = tmp_path / "copy.h5", tmp_path / "out.toml"
    copy.write_bytes(Path(RECORD).read_bytes())
    place = ["--output" if verb == "calibrate" else "--json", str(output)]
    assert run([verb, LP400, RECORD, str(copy), *place]) == USAGE
    assert "are the same recording (equal content)" in words(capsys.readouterr().err)
    assert not output.exists()


@pytest.mark.parametrize("verb", ["estimate", "calibrate"])
def test_two_records_of_one_name_are_refused(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = ["--output", str(tmp_path / "out.toml")] if verb == "calibrate" else []
    assert run([verb, LP400, "a/drop_060.csv", "b/drop_060.csv", *output]) == USAGE
    assert "2 records are named 'drop_060'; expected a name of its own" in words(capsys.readouterr().err)


def warnings_for(machine: Machine, name: str) -> set[str]:
    """Warnings that the bundled record, under a name, gets for the calibration of a machine."""
    known = {
        INCONSISTENT_CALIBRATION,
        *(COUNTED_TWICE.format(drop) for drop in ("drop_060", "first", "first, second")),
    }
    return known & set(
        facts_of(
            Evidence(record=read_record(RECORD, machine), machine=machine, tail=None, name=name)
        ).warnings
    )


def test_what_a_user_writes_as_a_source_is_not_taken_for_a_calibration() -> None:
    text = "calibrated on drop_060 (not consistent with them)"
    written = Known(value=1e8, status="estimated", interval_90=(9e7, 1.1e8), source=text)
    machine = load_machine(LP400).with_values({f"{end}.support.stiffness": written for end in ("NDE", "DE")})
    assert warnings_for(machine, "drop_060") == set()


def test_a_drop_of_the_calibration_is_known_by_its_whole_name_or_its_hash() -> None:
    """A comma does not make two drops of it, and a copy under another name is the same recording."""
    digest = hashlib.sha256(Path(RECORD).read_bytes()).hexdigest()
    twice = {COUNTED_TWICE.format("first, second")}
    for sha256, name, told in (("", "first, second", twice), ("", "first", set()), (digest, "copy", twice)):
        drop = CalibrationDrop(name="first, second", sha256=sha256)
        machine = load_machine(LP400).calibrated_on(CalibrationOrigin(drops=(drop,), consistent=True))
        assert warnings_for(machine, name) == told, (sha256, name)
