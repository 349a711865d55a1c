"""The paper's route, end to end, on a record whose truth is known."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from rotordrop.cli.app import run
from rotordrop.errors import IdentificationError, UsageError
from rotordrop.estimation import estimate_drop
from rotordrop.estimation.fixed_values import fixed_correlations
from rotordrop.estimation.replay import replay_document
from rotordrop.estimation.replayed import ReplayDrop
from rotordrop.estimation.schema import estimate_schema
from rotordrop.machine import Machine, example_path
from rotordrop.synthesis import SyntheticDrop
from rotordrop.synthesis.files import write_synthetic
from rotordrop.synthesis.score import score_estimate

BEARINGS = ("NDE", "DE")
LOADS = ("peak_force_N", "mean_force_0p15_0p2_N", "peak_stress_Pa", "mean_stress_Pa")


@pytest.fixture(scope="module")
def replayed(known: Machine, synthetic: SyntheticDrop) -> ReplayDrop:
    """The recorded drop replayed from its owner's guesses, with few starts and hardly a draw."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rotordrop.estimation.replay.FRICTION_DRAWS", 2)
        return estimate_drop(
            known, synthetic.record, method="replay", tail=synthetic.tail, starts=2, draws=2, threads=2
        )


@pytest.fixture(scope="module")
def document(replayed: ReplayDrop) -> dict[str, Any]:
    """What would be written of it."""
    whole: dict[str, Any] = json.loads(json.dumps(replay_document(replayed), allow_nan=False))
    return whole


def test_supports_friction_and_force_come_near_the_truth(
    document: dict[str, Any], synthetic: SyntheticDrop
) -> None:
    score = score_estimate(document, synthetic.truth)["bearings"]
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


def test_the_guesses_themselves_were_far_off(document: dict[str, Any], synthetic: SyntheticDrop) -> None:
    entry, truth = document["bearings"]["DE"]["support"]["stiffness_N_per_m"], synthetic.truth["support"][1]
    assert abs(entry["start"] / truth["K"] - 1.0) > 0.1


def test_document_follows_the_published_schema(document: dict[str, Any]) -> None:
    jsonschema.Draft202012Validator(estimate_schema()).validate(document)
    assert document["method"] == "replay" and document["fixed"] is None
    broken = {**document, "method": "guess"}
    assert not jsonschema.Draft202012Validator(estimate_schema()).is_valid(broken)


def test_few_draws_give_no_interval_and_say_why(document: dict[str, Any], replayed: ReplayDrop) -> None:
    for name in BEARINGS:
        for field in LOADS:
            entry = document["bearings"][name][field]
            assert "interval_90" not in entry
            assert (
                entry["status"] == f"no interval: {len(replayed.draws or ())} draws, at least 64 are needed"
            )
    assert any("64 are needed for intervals" in words for words in document["warnings"])


def test_the_drop_is_simulated_at_both_limits_of_the_air_gap(replayed: ReplayDrop) -> None:
    gap = replayed.gap
    assert np.all(gap.lower <= gap.value) and np.all(gap.value <= gap.upper)
    runs = (replayed.lower, replayed.middle, replayed.upper)
    early = replayed.middle.time < 9e-3
    for one, other in ((0, 1), (1, 2)):
        apart = np.abs(runs[one].force - runs[other].force)
        assert 0.0 < apart[early].max() < 0.1 * runs[1].force.max()
    assert replayed.middle.force == pytest.approx(replayed.simulated.bearing_force_magnitude)


def test_simulated_orbit_follows_the_record_over_the_first_impacts(replayed: ReplayDrop) -> None:
    names = [window.name for window in replayed.agreement.windows]
    rms = {window.name: window.rms for window in replayed.agreement.windows}
    assert names[0] == "first contact" and len(names) == 4
    assert np.all(rms["first contact"] < 1.5e-6)
    assert np.all(rms["20 ms"] < 3e-6)
    assert np.all(replayed.agreement.horizon > 0.025)
    measured = replayed.agreement.bearings[0].measured_contacts[0]
    assert replayed.agreement.bearings[0].simulated_contacts[0] == pytest.approx(measured, abs=1.5e-4)


def test_the_machine_file_may_take_over_what_was_found(replayed: ReplayDrop) -> None:
    for b, name in enumerate(BEARINGS):
        bearing = replayed.identified.touchdown_bearings[b]
        found = replayed.values[name]
        assert float(bearing.support.stiffness) == pytest.approx(found["support.stiffness_N_per_m"].value)
        assert float(bearing.air_gap) == pytest.approx(found["air_gap_m"].value)
        assert float(bearing.friction.dynamic) == pytest.approx(found["friction.dynamic"].value)


def test_fixed_takes_supports_and_friction_with_their_errors(
    known: Machine, synthetic: SyntheticDrop, document: dict[str, Any]
) -> None:
    again = estimate_drop(
        known, synthetic.record, method="replay", tail=synthetic.tail, fixed=document, draws=0
    )
    assert again.support is None and again.friction is None
    for name in BEARINGS:
        for path in ("support.stiffness_N_per_m", "support.mass_kg", "friction.dynamic"):
            part = document["bearings"][name]
            for key in path.split("."):
                part = part[key]
            assert again.values[name][path].value == pytest.approx(part["value"], rel=1e-9)
            assert again.values[name][path].status == "prior"
    assert replay_document(again)["fixed"] == "an earlier estimate"
    pairs = fixed_correlations(document)
    assert pairs["NDE.support.stiffness", "NDE.support.mass"] > 0.5


def test_an_unknown_method_is_named(known: Machine, synthetic: SyntheticDrop) -> None:
    with pytest.raises(UsageError, match="the method is 'guess'; expected 'tracked' or 'replay'"):
        estimate_drop(known, synthetic.record, method="guess")  # type: ignore[call-overload]


def test_a_record_that_ends_before_standstill_needs_a_tail(known: Machine, synthetic: SyntheticDrop) -> None:
    with pytest.raises(
        IdentificationError, match=r"shaft turning at 5\d\.\d+ Hz, before the rotor has settled"
    ):
        estimate_drop(known, synthetic.record, method="replay")
    without = replace(synthetic.record, speed=None)
    with pytest.raises(IdentificationError, match=r"no shaft speed.*tail"):
        from rotordrop.identification.air_gap import find_rest
        from rotordrop.identification.sensing import build_sensing
        from rotordrop.model.parameters import build_drop_model

        find_rest(without, None, build_sensing(build_drop_model(known, "quick"), without.sensors))


def test_fixed_that_lacks_a_support_is_refused(
    known: Machine, synthetic: SyntheticDrop, document: dict[str, Any]
) -> None:
    poorer = json.loads(json.dumps(document))
    del poorer["bearings"]["DE"]["support"]["mass_kg"]
    with pytest.raises(UsageError, match=r"has no 'support\.mass_kg' for 'DE'"):
        estimate_drop(known, synthetic.record, method="replay", tail=synthetic.tail, fixed=poorer)


@pytest.mark.slow
def test_command_writes_numbers_and_report(
    synthetic: SyntheticDrop, document: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    record, tail, *_ = write_synthetic(synthetic, tmp_path, formats=("h5",), histories=False)
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
    assert "NDE" in html and "This record is simulated" in html
    assert 'src="http' not in html
    assert str(page) in capsys.readouterr().out.replace("\n", "")


def test_fixed_belongs_to_the_replay(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    machine = str(example_path("lp400"))
    assert run(["estimate", machine, str(tmp_path / "r.csv"), "--fixed", str(tmp_path / "e.json")]) != 0
    assert "--fixed belongs to --method replay" in " ".join(capsys.readouterr().err.split())
