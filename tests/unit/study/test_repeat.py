"""The virtual repeat: a drop lies anywhere among its repeats, and the worst of many is far out."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.stats import kstest
from tests.published import bearing, published, value

from rotordrop import example_machine, save_machine
from rotordrop.cli.app import run
from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.study.plan import read_study
from rotordrop.study.repeat import place_among, recorded_numbers, repeat_study, repeats
from rotordrop.study.summary import StudyResults

MACHINE = example_machine("lp400")
PEAKS = {"peak_force_N": value(2500.0, 2450.0, 2550.0), "peak_stress_Pa": value(1.5e9)}
DROP = published(
    speed_Hz=100.0,
    estimated_until_s=0.009,
    bearings={"NDE": bearing({**PEAKS, "severity.impulse_N_s": value(2.0)}), "DE": bearing(PEAKS)},
)


def test_a_further_draw_lies_anywhere_with_equal_probability():
    random = np.random.default_rng(2)
    places = [
        place_among(random.gamma(3.0, 1.0, 400), Known(value=random.gamma(3.0, 1.0))).value
        for _ in range(300)
    ]
    assert kstest(places, "uniform").pvalue > 0.01


def test_the_interval_of_a_place_holds_the_true_share():
    random, held = np.random.default_rng(3), 0
    for _ in range(300):
        share = random.uniform(0.02, 0.98)
        found = place_among(random.uniform(0.0, 1.0, 200), Known(value=share))
        held += found.low <= share <= found.high
    assert held >= 0.88 * 300


def test_an_uncertain_number_has_an_uncertain_place():
    values = np.linspace(0.0, 1.0, 1001)
    sharp = place_among(values, Known(value=0.5, interval_90=(0.5, 0.5)))
    vague = place_among(values, Known(value=0.5, interval_90=(0.3, 0.7)))
    assert sharp.value == pytest.approx(vague.value, abs=1e-3)
    assert vague.high - vague.low > 0.35 > 0.1 > sharp.high - sharp.low


def test_the_worst_of_a_hundred():
    """Half of all sets of a hundred uniform numbers have a maximum above 0.5 ** 0.01."""
    study = read_study({"drops": 4000, "speed": "60 Hz"}, MACHINE)
    values = np.random.default_rng(1).uniform(size=4000)
    names = [
        f"{b}.{n}" for b in ("NDE", "DE") for n in ("peak_force", "peak_stress", "impulse", "contact_energy")
    ]
    results = StudyResults(
        study=study,
        drop=np.arange(4000),
        varied={},
        numbers=dict.fromkeys(names, values),
        reasons=("",) * 4000,
    )
    one = repeats(results, worst_of=100)[0]
    assert one.worst.value == pytest.approx(0.5**0.01, abs=3e-3)
    assert one.worst.low < 0.5**0.01 < one.worst.high
    assert (one.low.value, one.high.value) == pytest.approx((0.05, 0.95), abs=0.015)
    with pytest.raises(UsageError, match="worst of 1; expected two drops or more"):
        repeats(results, worst_of=1)


def test_numbers_of_an_estimate_are_found_by_their_column():
    found = recorded_numbers(DROP)
    assert found["NDE.peak_force"] == Known(value=2500.0, interval_90=(2450.0, 2550.0))
    assert found["NDE.impulse"] == Known(value=2.0)
    peaks = {f"{end}.peak_{what}" for end in ("NDE", "DE") for what in ("force", "stress")}
    assert set(found) == {"NDE.impulse", *peaks}


def test_chances_are_those_of_a_drop():
    study = repeat_study(MACHINE, 2.0 * math.pi * 100.0, duration=0.2)
    planes = {f"unbalance.{k}.{part}" for k in range(len(MACHINE.unbalances)) for part in ("amount", "phase")}
    assert planes
    parts = ("remanent_share", "remanent_share_x", "offset_x", "offset_y", "orbit", "orbit_phase")
    magnets = {f"{amb.name}.{part}" for amb in MACHINE.ambs for part in parts}
    assert set(study.varied) == {"remanence_time", "rotor_angle", *planes, *magnets}
    values = dict(zip(study.varied, study.values(0, 1)[0].tolist(), strict=True))
    start = study.case(values).start
    first = MACHINE.ambs[0].name
    weight = MACHINE.rotor.mass * float(MACHINE.gravity) / len(MACHINE.ambs)
    assert start.remanent_force[0, 1] == pytest.approx(values[f"{first}.remanent_share"] * weight)
    assert start.offset[0, 0] == values[f"{first}.offset_x"]
    assert abs(start.orbit[0]) == pytest.approx(values[f"{first}.orbit"])
    assert study.machine_values(values).keys() == planes
    drawn = study.values(0, 4000)[:, list(study.varied).index("unbalance.0.amount")]
    described = float(MACHINE.unbalances[0].amount)
    assert np.median(drawn) == pytest.approx(
        np.median(np.hypot(*np.random.default_rng(1).normal(0, described, (2, 40_000)))), rel=0.05
    )
    assert not study.calibrated


def test_the_verb(tmp_path, capsys):
    save_machine(MACHINE, tmp_path / "machine.toml")
    (tmp_path / "drop.json").write_text(json.dumps(DROP.as_json()))
    call = ["study", "repeat", str(tmp_path / "machine.toml"), str(tmp_path / "drop.json"), "--threads", "1"]
    out = tmp_path / "r.json"
    assert run([*call, "--drops", "20", "--folder", str(tmp_path / "study"), "--json", str(out)]) == 0
    said = capsys.readouterr().out
    assert "holds no joint distribution" in said and "milder" in said
    first = json.loads(out.read_text())["quantities"][0]
    assert first["column"] == "NDE.peak_force" and 0.0 <= first["place"]["value"] <= 1.0
    assert run(["study", "repeat", str(tmp_path / "machine.toml"), "--folder", str(tmp_path / "x")]) == 64
    assert "neither an estimate nor a speed" in capsys.readouterr().err
