"""The paper's route, end to end, on a record whose truth is known."""

import json
import math
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from rotordrop import Replay, estimate_drop
from rotordrop.cli.app import run
from rotordrop.errors import IdentificationError, UsageError
from rotordrop.estimate.changed import changes
from rotordrop.estimate.document import estimate_document, published_drop
from rotordrop.estimate.estimate import Verdict
from rotordrop.estimate.published import estimate_schema
from rotordrop.estimate.record_facts import facts_of
from rotordrop.machine import example_path
from rotordrop.replay.replay import replayed_drop
from rotordrop_bench.recording import write_drop
from rotordrop_bench.score import score_estimate

BEARINGS = ("NDE", "DE")
LOADS = ("peak_force_N", "mean_force_0p15_0p2_N", "peak_stress_Pa", "mean_stress_Pa")


@pytest.fixture
def replayed(bank):
    """The recorded drop replayed."""
    return bank("replayed")


@pytest.fixture
def document(replayed):
    """What would be written of it."""
    return dict(json.loads(json.dumps(estimate_document(replayed), allow_nan=False)))


def test_supports_friction_and_force_come_near_the_truth(document, synthetic):
    score = score_estimate(document, synthetic.truth, drop="hidden_060")["bearings"]
    allowed = {
        "support.stiffness_N_per_m": 0.03,
        "support.mass_kg": 0.03,
        "support.damping_N_s_per_m": 0.1,
        "friction.dynamic": 0.05,
        "peak_force_N": 0.02,
        "peak_stress_Pa": 0.01,
    }
    for name in BEARINGS:
        for path, limit in allowed.items():
            assert abs(score[name][path]["relative_error"]) < limit, (name, path)
        assert abs(score[name]["air_gap_m"]["error"]) < 3e-6


def test_the_document_follows_its_schema_and_states_no_interval_of_a_load(document, replayed):
    jsonschema.Draft202012Validator(estimate_schema()).validate(document)
    assert document["method"] == "replay"
    assert replayed.replay is not None and replayed.verdict is Verdict.OPEN_LOOP
    for name in BEARINGS:
        entry = document["bearings"][name]
        assert all("interval_90" not in entry[field] for field in LOADS)
        assert "interval_90" in entry["support"]["mass_kg"]


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


def test_every_number_of_the_document_is_that_of_its_source(document, replayed, bank):
    steps, agreement = replayed.replay, replayed.agreement
    assert steps is not None and agreement is not None
    assert document["speed_Hz"] == pytest.approx(replayed.speed / (2.0 * math.pi))
    started = bank("workshop").forces.displacement[0]
    for b, name in enumerate(BEARINGS):
        start = document["initial_state"]["displacement_m"][name]
        assert start == pytest.approx(started[b].tolist(), abs=1e-9)
        expanded = document["initial_state"]["modal_expansion"]["displacement_m"][name]
        assert expanded == pytest.approx(start, abs=6e-6)
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
        assert found < synthetic.truth["support.stiffness_N_per_m"][name]


def test_the_orbit_follows_the_record(replayed):
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


def test_a_replay_and_the_twin_of_one_record_know_of_no_change(replayed, bank):
    assert not changes(published_drop(bank("tracked")), published_drop(replayed)).named


def test_what_the_model_does_not_follow_is_not_replayed(bank, lp400, synthetic):
    with pytest.raises(UsageError, match=r"the method is 'guess'; expected Tracked\(...\) or Replay\(...\)"):
        estimate_drop(lp400, synthetic.record, method="guess")
    drop = bank("workshop")
    failed = replace(drop, checks=(replace(drop.checks[0], passed=False), *drop.checks[1:]))
    with pytest.raises(IdentificationError, match=r"does not follow the record hidden_060 .*tracked twin"):
        replayed_drop(failed, Replay(), facts_of(drop.evidence))


@pytest.mark.slow
def test_command_writes_numbers_and_report(lp400, synthetic, tmp_path):
    place = write_drop(synthetic, lp400, tmp_path, "drop_1")
    record, tail = place / "record.csv", place / "tail.csv"
    out, page = tmp_path / "out.json", tmp_path / "report.html"
    arguments = ["estimate", str(example_path("lp400")), str(record), "--tail", str(tail)]
    arguments += ["--method", "replay", "--json", str(out), "--report", str(page)]
    assert run(arguments) == 0
    written = json.loads(out.read_text())
    jsonschema.Draft202012Validator(estimate_schema()).validate(written)
    for name in BEARINGS:
        entry = written["bearings"][name]["peak_force_N"]
        assert 0.0 < entry["time_s"] < 0.2
        assert math.isfinite(entry["value"])
    html = page.read_text(encoding="utf-8")
    assert 'src="http' not in html
