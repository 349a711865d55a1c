"""The paper's route, end to end, on a record whose truth is known."""

import json
import math
from types import SimpleNamespace
from typing import Any

import jsonschema
import numpy as np
import pytest

from rotordrop import Known, Replay, estimate_drop
from rotordrop.cli.app import run
from rotordrop.errors import IdentificationError, UsageError
from rotordrop.estimate.document import estimate_document
from rotordrop.estimate.estimate import Verdict
from rotordrop.estimate.fixed_values import read_fixed
from rotordrop.estimate.published import estimate_schema
from rotordrop.machine import example_path
from rotordrop.replay import draws
from rotordrop.replay.draws import mean_with_draws, whole_drop, with_draws
from rotordrop_bench.files import write_drop
from rotordrop_bench.score import score_estimate

BEARINGS = ("NDE", "DE")
LOADS = ("peak_force_N", "mean_force_0p15_0p2_N", "peak_stress_Pa", "mean_stress_Pa")


@pytest.fixture
def replayed(bank):
    """The recorded drop replayed from its owner's guesses, with few starts and hardly a draw."""
    return bank("replayed")[0]


@pytest.fixture
def document(replayed):
    """What would be written of it."""
    return dict(json.loads(json.dumps(estimate_document(replayed), allow_nan=False)))


def test_supports_friction_and_force_come_near_the_truth(document, synthetic):
    score = score_estimate(document, synthetic.truth, drop="drop_1")["bearings"]
    allowed = {
        "support.stiffness_N_per_m": 0.06,
        "support.mass_kg": 0.06,
        "support.damping_N_s_per_m": 0.4,
        "friction.dynamic": 0.1,
        "peak_force_N": 0.04,
        "peak_stress_Pa": 0.02,
    }
    for name in BEARINGS:
        for path, limit in allowed.items():
            assert abs(score[name][path]["relative_error"]) < limit, (name, path)
        assert abs(score[name]["air_gap_m"]["error"]) < 3.0 * 10.5e-6
    # the guesses themselves were far off
    entry = document["bearings"]["DE"]["support"]["stiffness_N_per_m"]
    assert abs(entry["start"] / synthetic.truth["support.stiffness_N_per_m"]["DE"] - 1.0) > 0.1


def test_the_document_follows_its_schema_and_says_why_intervals_miss(document, replayed):
    jsonschema.Draft202012Validator(estimate_schema()).validate(document)
    assert document["method"] == "replay" and document["fixed"] is None
    broken = {**document, "method": "guess"}
    assert not jsonschema.Draft202012Validator(estimate_schema()).is_valid(broken)
    assert replayed.replay is not None and replayed.verdict is Verdict.OPEN_LOOP
    reason = f"no interval: {replayed.replay.draws} draws, at least 64 are needed"
    for name in BEARINGS:
        entry = document["bearings"][name]
        assert all("interval_90" not in entry[field] for field in LOADS)
        assert entry["not_stated"] == dict.fromkeys(LOADS, reason)


def test_draws_of_the_rest_position_fall_on_one_path(bank):
    _, fitted = bank("replayed")
    problem = fitted["problem"]
    best = problem.trial(fitted["x"])
    initial = problem.initial

    def orbit(fall):
        trial = best._replace(fall=fall)
        moved = whole_drop(problem, trial, duration=6e-3).displacement
        return np.asarray(moved - problem.rest_error(trial))

    for height in range(initial.unknowns.rest.start + 1, initial.unknowns.rest.stop, 2):
        column = initial.covariance[:, height]
        drawn = best.fall + column / math.sqrt(column[height])
        assert drawn[height] - best.fall[height] > 5e-6
        assert np.max(np.abs(orbit(drawn) - orbit(best.fall))) < 0.05e-6


def test_the_drop_is_simulated_at_both_limits_of_the_air_gap(replayed):
    for bearing in replayed.bearings:
        assert bearing.air_gap is not None
        assert bearing.air_gap.lower <= bearing.values["air_gap_m"].value <= bearing.air_gap.upper
        measured, lower, upper = bearing.at_gap_limits
        middle = bearing.motions[1]
        assert (measured.role, lower.role) == ("measured", "simulated, lower gap")
        early = middle.time < 9e-3
        for one in (lower, upper):
            apart = np.abs(one.displacement - middle.displacement)[early]
            assert 0.0 < apart.max() < 20e-6


def test_every_number_of_the_document_is_that_of_its_source(document, replayed):
    steps, agreement = replayed.replay, replayed.agreement
    assert steps is not None and agreement is not None
    speed = document["speed"]
    assert speed["friction_loss_Hz"] == pytest.approx(steps.speed.friction_loss / (2.0 * math.pi))
    assert speed["profile_time_constant_s"] == steps.speed.profile_time_constant
    assert speed["simulated_end_Hz"] == pytest.approx(steps.speed_simulated[-1] / (2.0 * math.pi))
    assert 0.0 <= speed["friction_loss_Hz"] < document["speed_Hz"] - speed["simulated_end_Hz"]
    assert document["speed_Hz"] == pytest.approx(replayed.speed / (2.0 * math.pi))
    for name, contact, compared in zip(BEARINGS, steps.contacts, agreement.bearings.values(), strict=True):
        entry, found = document["bearings"][name], document["first_contact"][name]
        bearing = replayed.bearing(name)
        assert (
            entry["peak_force_N"]["value"]
            == bearing.peak_force.value
            == pytest.approx(bearing.force.values.max(), rel=1e-3)
        )
        assert entry["peak_stress_Pa"]["time_s"] == bearing.peak_stress.time
        assert entry["stress_statistics_Pa"]["maximum"] == bearing.peak_stress.value
        assert (found["start_s"], found["end_s"]) == (contact.start, contact.end)
        assert found["half_period_stiffness_N_per_m"] == contact.equivalent_stiffness
        bounce = document["agreement"]["bearings"][name]
        assert bounce["measured_bounce_m"] == compared.measured_bounce_m
        assert bounce["measured_bounce_m"] == pytest.approx(bounce["simulated_bounce_m"], rel=0.3)
        assert 5e-6 < bounce["measured_bounce_m"] < 400e-6


def test_the_equivalent_stiffness_is_support_and_bearing_in_series(document, synthetic):
    """Not the half period of the first contact, which gravity and a second impact make 4 to 24 times off."""
    for name in BEARINGS:
        entry = document["bearings"][name]
        support = entry["support"]["stiffness_N_per_m"]["value"]
        found = entry["equivalent_stiffness_N_per_m"]["value"]
        assert 0.3 * support < found < support
        true = synthetic.truth["support.stiffness_N_per_m"][name]
        assert found < true


def test_orbit_and_found_machine_follow_the_record(replayed):
    assert replayed.agreement is not None
    names = [window.name for window in replayed.agreement.windows]
    rms = {window.name: np.array([*window.rms.values()]) for window in replayed.agreement.windows}
    assert names[0] == "first contact" and len(names) == 4
    assert np.all(rms["first contact"] < 1.5e-6)
    assert np.all(rms["20 ms"] < 3e-6)
    nde, de = replayed.agreement.bearings.values()
    assert min(nde.horizon_s, de.horizon_s) > 0.025
    measured = nde.measured_contacts_s[0]
    assert nde.simulated_contacts_s[0] == pytest.approx(measured, abs=1.5e-4)
    assert replayed.replay is not None
    for b, name in enumerate(BEARINGS):
        bearing = replayed.replay.identified.touchdown_bearings[b]
        found = replayed.bearing(name).values
        assert float(bearing.support.stiffness) == pytest.approx(found["support.stiffness_N_per_m"].value)
        assert float(bearing.air_gap) == pytest.approx(found["air_gap_m"].value)
        assert float(bearing.friction.dynamic) == pytest.approx(found["friction.dynamic"].value)


def test_fixed_takes_supports_and_friction_with_their_errors(known, synthetic, document):
    method = Replay(fixed=document, draws=0)
    again = estimate_drop(known, synthetic.record, synthetic.tail, method=method)
    assert again.replay is not None
    assert "support" not in again.replay.document["identification"] and again.replay.friction is None
    for name in BEARINGS:
        for path in ("support.stiffness_N_per_m", "support.mass_kg", "friction.dynamic"):
            part = document["bearings"][name]
            for key in path.split("."):
                part = part[key]
            value = again.bearing(name).values[path]
            assert value.value == pytest.approx(part["value"], rel=1e-9)
            assert value.status == "taken over"
            assert value.interval_90 == pytest.approx(part["interval_90"], rel=1e-6), (name, path)
    assert estimate_document(again)["fixed"] == "an earlier estimate"
    pairs = {(pair.first, pair.second): pair.value for pair in read_fixed(document)[0].correlations}
    assert pairs["NDE.support.stiffness", "NDE.support.mass"] > 0.5


def test_a_bearing_with_clearance_is_replayed_without_a_preload(known, synthetic, document):
    paired = known.touchdown_bearings[0].bearing
    given = {name: getattr(paired, name) for name in paired.model_fields_set - {"preload"}}
    row = type(paired).model_validate(given | {"clearance": "10 um", "contact_angle": "0 deg"})
    loose = known.model_copy(
        update={"touchdown_bearings": tuple(one.changed(bearing=row) for one in known.touchdown_bearings)}
    )
    earlier = json.loads(json.dumps(document))
    for bearing in earlier["bearings"].values():
        del bearing["preload_N"]
    method = Replay(fixed=earlier, draws=0)
    found = estimate_drop(loose, synthetic.record, synthetic.tail, method=method)
    for name in BEARINGS:
        values = found.bearing(name).values
        assert "preload_N" not in values and values["equivalent_stiffness_N_per_m"].value > 0.0
        assert values["support.stiffness_N_per_m"].status == "taken over"


def test_replays_and_correlations_that_cannot_be_are_refused(document, known, synthetic):
    changed = json.loads(json.dumps(document))
    changed["identification"]["support"]["correlations"] = {"K ~ M": 0.9}
    with pytest.raises(UsageError, match=r"an earlier estimate: identification\.support\.correlations is"):
        read_fixed(changed)
    with pytest.raises(UsageError, match=r"the method is 'guess'; expected Tracked\(...\) or Replay\(...\)"):
        estimate_drop(known, synthetic.record, method="guess")
    with pytest.raises(IdentificationError, match=r"the shaft still turns at 5\d\.\d+ Hz .*settled tail"):
        estimate_drop(known, synthetic.record, method=Replay())
    poorer = json.loads(json.dumps(document))
    del poorer["bearings"]["DE"]["support"]["mass_kg"]
    with pytest.raises(UsageError, match=r"has no 'support\.mass_kg' for 'DE'"):
        estimate_drop(known, synthetic.record, synthetic.tail, method=Replay(fixed=poorer))


@pytest.mark.slow
def test_command_writes_numbers_and_report(known, synthetic, document, tmp_path):
    place = write_drop(synthetic, known, tmp_path, "drop_1")
    record, tail = place / "record.csv", place / "tail.csv"
    earlier, out, page = tmp_path / "earlier.json", tmp_path / "out.json", tmp_path / "report.html"
    earlier.write_text(json.dumps(document))
    arguments = ["estimate", str(example_path("lp400")), str(record), "--tail", str(tail)]
    arguments += ["--method", "replay", "--fixed", str(earlier), "--json", str(out), "--report", str(page)]
    assert run(arguments) == 0
    written = json.loads(out.read_text())
    jsonschema.Draft202012Validator(estimate_schema()).validate(written)
    for name in BEARINGS:
        entry = written["bearings"][name]["peak_force_N"]
        low, high = entry["interval_90"]
        assert low < high and 0.0 < entry["time_s"] < 0.2
        assert math.isfinite(entry["value"])
    assert written["fixed"] == str(earlier)
    assert written["identification"]["draws"]["count"] >= 64
    html = page.read_text(encoding="utf-8")
    assert 'src="http' not in html


def test_fixed_belongs_to_the_replay(tmp_path, capsys):
    machine = str(example_path("lp400"))
    assert run(["estimate", machine, str(tmp_path / "r.csv"), "--fixed", str(tmp_path / "e.json")]) != 0
    assert "--fixed belongs to --method replay" in " ".join(capsys.readouterr().err.split())


def test_no_number_lies_outside_its_own_interval():
    sample = np.linspace(400.0, 430.0, 64)
    mean = mean_with_draws(Known(value=415.0, status="determined", unit="N"), sample, 0.01)
    assert mean.value == np.median(sample)
    peak = with_draws(Known(value=470.0, status="determined", unit="N"), sample, 0.01)
    for value in (mean, peak):
        low, high = value.interval_90 or (math.nan, math.nan)
        assert low < value.value < high
    assert high == pytest.approx(470.0 + 1.6448536 * 4.7)


def test_a_fit_whose_draws_do_not_keep_to_the_record_is_no_basis():
    best = np.zeros(2)

    def residual(x, window):
        if np.any(x != best):
            raise IdentificationError("beside the record")
        return np.zeros(3)

    table = SimpleNamespace(lower=np.full(2, -9.0), upper=np.full(2, 9.0), sigma=np.ones(2))
    problem: Any = SimpleNamespace(
        residual=residual, table=table, directions=SimpleNamespace(remaining=np.zeros((1, 1)))
    )
    message = r"of 64 draws of the uncertain values only 0 keep to the record up to 7.5 ms"
    with pytest.raises(IdentificationError, match=message):
        draws.draw_drops(problem, best, np.eye(2), window=7.5e-3, duration=0.2, count=16)
