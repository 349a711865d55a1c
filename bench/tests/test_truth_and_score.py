"""Truth files, ours and supplied ones, and the scores of estimates against them."""

import copy
import json
import re

import numpy as np
import pytest

from rotordrop.elements.table import published
from rotordrop.errors import OutputError, UsageError
from rotordrop.record.record import read_record
from rotordrop.severity.numbers import LOADS
from rotordrop_bench import read_truth, score_estimate
from rotordrop_bench.faults import FAULTS, PLAIN, spoiled
from rotordrop_bench.recording import write_drop
from rotordrop_bench.score import truth_of


@pytest.fixture(scope="module")
def folder(synthetic, known, tmp_path_factory):
    path = tmp_path_factory.mktemp("synthetic") / "deeper"
    write_drop(synthetic, known, path, "drop_060")
    return path


@pytest.fixture
def truth(folder):
    return read_truth(folder / "truth" / "drop_060.json")


def estimate_of(truth, factor=1.01):
    """An estimate that is wrong by a factor everywhere, in the form of 'rotordrop estimate --json'."""
    bearings = {}
    for name in truth.bearing_names:
        fields = {}
        for path, value in truth.of_bearing(name).items():
            *groups, last = path.split(".")
            place = fields
            for group in groups:
                place = place.setdefault(group, {})
            wide = 0.03 if path == "peak_force_N" else 0.005
            value *= factor
            place[last] = {"value": value, "interval_90": [value * (1 - wide), value * (1 + wide)]}
        bearings[name] = fields
    instant = truth.values["t_off_in_record_s"] + 2e-5
    return {
        "drop_instant_s": instant,
        "speed_Hz": 60.0,
        "method": "tracked",
        "warnings": [],
        "bearings": bearings,
    }


def test_what_was_written_is_read_back_and_the_truth_apart(folder, synthetic, known, truth):
    record, tail = (read_record(folder / f"drops/drop_060/{name}.csv", known) for name in ("record", "tail"))
    assert record.signals == pytest.approx(synthetic.record.signals, abs=6e-10)
    assert record.time == pytest.approx(synthetic.record.time, abs=1e-9)
    assert record.speed_readings == pytest.approx(synthetic.record.speed_readings, abs=1e-3)
    assert "not measured" in record.metadata["origin"]
    assert tail.signals == pytest.approx(synthetic.tail.signals, abs=6e-10)
    beside = list((folder / "drops/drop_060").iterdir())
    assert len(beside) == 3
    stiffness = f"{synthetic.truth['support.stiffness_N_per_m']['NDE']:.6g}"
    assert not any(stiffness in file.read_text(errors="ignore") for file in beside)
    assert truth.bearing_names == ("NDE", "DE")
    assert truth.of_bearing("DE")["peak_stress_Pa"] == pytest.approx(synthetic.truth["peak_stress_Pa"]["DE"])


def test_the_numbers_of_the_truth_are_those_of_the_simulated_drop(synthetic):
    drop, truth = synthetic.result, synthetic.truth
    whole, late = drop.time <= 0.2, (drop.time >= 0.15) & (drop.time <= 0.2)
    for b, name in enumerate(("NDE", "DE")):
        force, contact = drop.bearing_force_magnitude[:, b], drop.contact_force[:, b]
        assert np.max(force[whole]) == pytest.approx(truth["peak_force_N"][name], rel=0.01)
        assert np.mean(force[late]) == pytest.approx(truth["mean_force_0p15_0p2_N"][name], rel=5e-3)
        stress = np.mean(drop.max_stress[whole, b])
        assert stress == pytest.approx(truth["mean_stress_Pa"][name], rel=2e-3)
        first = truth["first_contact_time_s"][name]
        assert np.all(contact[drop.time < first - 1e-4] == 0.0)
        assert np.max(contact[(drop.time > first) & (drop.time < first + 1e-3)]) > 100.0


def test_a_supplied_truth_is_read_by_the_paths_of_an_estimate():
    both = {"NDE": 2e-4, "DE": 3e-4}
    values = {
        "air_gap_m": both,
        "peak_force_N": both,
        "max_stress_MPa": {"NDE": 1200.0, "DE": 1300.0},
        "support_stiffness": {"NDE": 1e8, "DE": 2e8},
        "friction_dynamic": 0.12,
        "contact": [{"n": 1.1, "lam": 0.06}, {"n": 1.2, "lam": 0.07}],
    }
    assert truth_of(values).of_bearing("DE") == {
        "air_gap_m": 3e-4,
        "peak_force_N": 3e-4,
        "peak_stress_Pa": 1.3e9,
        "support.stiffness_N_per_m": 2e8,
        "friction.dynamic": 0.12,
        "contact.exponent": 1.2,
        "contact.damping_s_per_m": 0.07,
    }


def test_errors_and_coverage_of_an_estimate(truth):
    scores = score_estimate(estimate_of(truth), truth)
    peak = scores["bearings"]["NDE"]["peak_force_N"]
    assert peak["relative_error"] == pytest.approx(0.01)
    assert peak["covered"] is True
    assert peak["half_width"] == pytest.approx(0.03 * 1.01)
    stiffness = scores["bearings"]["DE"]["support.stiffness_N_per_m"]
    assert stiffness["covered"] is False
    assert stiffness["error"] == pytest.approx(0.01 * truth.values["support.stiffness_N_per_m"]["DE"])
    assert scores["drop"]["drop_instant_s"]["error"] == pytest.approx(2e-5)
    every = {*published(), *(load.field for load in LOADS)}
    assert set(scores["bearings"]["NDE"]) == every == set(scores["bearings"]["DE"])
    every = [score for fields in scores["bearings"].values() for score in fields.values()]
    assert sum(score["covered"] for score in every) == 2
    json.dumps(scores, allow_nan=False)
    scores = score_estimate(estimate_of(truth, 1.0), truth)
    every = [score for fields in scores["bearings"].values() for score in fields.values()]
    assert all(score["error"] == 0.0 and score["covered"] for score in every)


def test_an_estimate_of_several_drops(folder, tmp_path, truth):
    one = estimate_of(truth)
    shared = {"air_gap_m", "support"}
    machine = {n: {k: v for k, v in f.items() if k in shared} for n, f in one["bearings"].items()}
    own = {n: {k: v for k, v in f.items() if k not in shared} for n, f in one["bearings"].items()}
    several = {"machine": {"bearings": machine}, "drops": {"drop_060": {**one, "bearings": own}}}
    file = tmp_path / "estimate.json"
    file.write_text(json.dumps(several))
    scores = score_estimate(file, folder / "truth" / "drop_060.json")
    assert scores["bearings"] == score_estimate(one, truth)["bearings"]
    with pytest.raises(UsageError, match="no drop 'drop_100'; it has 'drop_060': name one with --drop"):
        score_estimate(several, truth, drop="drop_100")


def test_missing_and_unusable_values_are_left_out(truth):
    estimate = copy.deepcopy(estimate_of(truth))
    del estimate["bearings"]["NDE"]["peak_force_N"]
    estimate["bearings"]["DE"]["air_gap_m"] = {"value": None, "status": "not found"}
    scores = score_estimate(estimate, truth)["bearings"]
    assert "peak_force_N" not in scores["NDE"]
    assert "air_gap_m" not in scores["DE"]
    with pytest.raises(UsageError, match=r"none of the quantities of the truth 'drop_060': it has nothing"):
        score_estimate({}, truth)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", r"is not JSON .* Give a file that .rotordrop-bench synthesize"),
        ('{"name": 1}', "no 'air_gap_m' and no 'peak"),
    ],
)
def test_what_is_no_truth_file_is_refused(tmp_path, content, message):
    file = tmp_path / "truth.json"
    file.write_text(content)
    with pytest.raises(UsageError, match=message):
        read_truth(file)


@pytest.mark.parametrize("interval", [[None, None], [1.0], "1 to 2", [2.0, 1.0], [1.0, float("nan")]])
def test_an_interval_that_is_none_is_refused_and_not_a_traceback(interval, truth):
    estimate = estimate_of(truth)
    estimate["bearings"]["NDE"]["peak_force_N"]["interval_90"] = interval
    with pytest.raises(
        UsageError, match=rf"interval_90 is {re.escape(repr(interval))}; expected two numbers"
    ):
        score_estimate(estimate, truth)


def test_what_is_no_estimate_and_no_folder_is_refused(tmp_path, folder, known, synthetic):
    file = tmp_path / "estimate.json"
    file.write_text("[1]")
    with pytest.raises(
        UsageError,
        match=r"estimate\.json holds a list; expected an object\. Give a file that .rotordrop estimate",
    ):
        score_estimate(file, folder / "truth" / "drop_060.json")
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot make the folder"):
        write_drop(synthetic, known, tmp_path / "file" / "deeper", "one")


def test_a_fault_changes_the_record_as_it_says_and_nothing_else(synthetic, known):
    record, signals = synthetic.record, synthetic.record.signals
    broken = {fault: spoiled(record, known, fault, "one")[0] for fault in list(FAULTS)[:PLAIN]}
    for one in broken.values():
        assert one.signals.shape == signals.shape and not np.array_equal(one.signals, signals)
        assert np.array_equal(one.time, record.time)
    assert np.array_equal(broken["swapped ends"].signals, signals[:, [2, 3, 0, 1]])
    assert np.array_equal(broken["swapped axes"].signals, signals[:, [1, 0, 2, 3]])
    assert np.array_equal(broken["inverted polarity"].signals, signals * [-1, 1, 1, 1])
    assert np.ptp(broken["dead channel"].signals[:, 3]) == 0.0


def test_an_estimate_of_another_recording_is_refused_by_hash_or_name(folder, truth):
    own = estimate_of(truth) | {"record": "renamed.csv"}
    ((file, sha),) = truth.values["record_sha256"].items()
    assert (folder / "drops/drop_060" / file).is_file()
    assert score_estimate(own | {"record_sha256": sha}, truth)["name"] == "drop_060"
    with pytest.raises(UsageError, match=r"SHA-256 abababababab….*'drop_060' belongs to record\.csv \("):
        score_estimate(own | {"record_sha256": "ab" * 32, "name": "drop_060"}, truth)
    truth = truth_of({key: value for key, value in truth.values.items() if key != "record_sha256"})
    own = estimate_of(truth)
    assert score_estimate(own | {"name": "drop_060"}, truth)
    assert score_estimate(own | {"record": "drop_060.h5", "name": "of Monday"}, truth)
    with pytest.raises(UsageError, match=r"recording 'repeat_3', the truth of 'drop_060'.*--drop repeat_3"):
        score_estimate(own | {"name": "repeat_3", "record": "repeat_3.csv"}, truth)
    assert score_estimate(own | {"name": "repeat_3"}, truth, drop="repeat_3")
