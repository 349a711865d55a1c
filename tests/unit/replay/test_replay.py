"""The paper's route, end to end, on a record whose truth is known."""

import json
import math

import jsonschema
import numpy as np
import pytest

from rotordrop import Replay, estimate_drop
from rotordrop.cli.app import run
from rotordrop.errors import IdentificationError, UsageError
from rotordrop.estimate.document import estimate_document
from rotordrop.estimate.estimate import Verdict
from rotordrop.estimate.fixed_values import read_fixed
from rotordrop.estimate.published import estimate_schema
from rotordrop.machine import example_path
from rotordrop_bench.files import write_drop
from rotordrop_bench.score import score_estimate

BEARINGS = ("NDE", "DE")
LOADS = ("peak_force_N", "mean_force_0p15_0p2_N", "peak_stress_Pa", "mean_stress_Pa")


@pytest.fixture
def replayed(bank):
    """The recorded drop replayed from its owner's guesses, with few starts."""
    return bank("replayed")


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


def test_the_document_follows_its_schema_and_gives_loads_without_intervals(document, replayed):
    jsonschema.Draft202012Validator(estimate_schema()).validate(document)
    assert document["method"] == "replay" and document["fixed"] is None
    broken = {**document, "method": "guess"}
    assert not jsonschema.Draft202012Validator(estimate_schema()).is_valid(broken)
    assert replayed.replay is not None and replayed.verdict is Verdict.OPEN_LOOP
    for name in BEARINGS:
        entry = document["bearings"][name]
        assert all(entry[field]["value"] > 0.0 and "interval_90" not in entry[field] for field in LOADS)


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
    method = Replay(fixed=document)
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
    method = Replay(fixed=earlier)
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
        assert math.isfinite(entry["value"]) and 0.0 < entry["time_s"] < 0.2
    assert written["fixed"] == str(earlier)
    html = page.read_text(encoding="utf-8")
    assert 'src="http' not in html


def test_fixed_belongs_to_the_replay(tmp_path, capsys):
    machine = str(example_path("lp400"))
    assert run(["estimate", machine, str(tmp_path / "r.csv"), "--fixed", str(tmp_path / "e.json")]) != 0
    assert "--fixed belongs to --method replay" in " ".join(capsys.readouterr().err.split())
