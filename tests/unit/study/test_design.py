"""Designs: the front of known points, equal chances for all candidates, and a small search."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from rotordrop import example_machine, save_machine
from rotordrop.cli.app import run
from rotordrop.elements.catalog.lookup import find_bearing
from rotordrop.errors import UsageError
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.study.design import Aim, best_designs, front_of, read_design
from rotordrop.study.folder import study_of
from rotordrop.study.run import one_drop
from rotordrop.study.summary import load_results

MACHINE = example_machine("lp400")
TABLE = {
    "candidates": 4,
    "repeats": 2,
    "again": 3,
    "duration": "9 ms",
    "reduction": "quick",
    "speed": "100 Hz",
    "seed": 5,
    "vary": {"*.friction.dynamic": {"uniform": [0.05, 0.25]}},
    "choose": {"*.support.stiffness": {"log_uniform": ["3e7 N/m", "3e8 N/m"]}},
}


def test_the_front_of_points():
    points = np.array([[1.0, 5.0], [2.0, 2.0], [5.0, 1.0], [3.0, 3.0], [1.0, 6.0], [2.0, 2.0]])
    assert front_of(points).tolist() == [True, True, True, False, False, True]


def test_every_candidate_meets_the_same_chances():
    study = read_design(TABLE, MACHINE).study
    names = list(study.varied)
    values = study.values(0, 8).reshape(4, 2, len(names))
    chosen = names.index("*.support.stiffness")
    for j in range(len(names)):
        if j == chosen:
            assert len(np.unique(values[:, :, j])) == 4
            assert np.all(values[:, 0, j] == values[:, 1, j])
        else:
            assert np.all(values[:, :, j] == values[0, :, j])
            assert len(np.unique(values[0, :, j])) == 2
    np.testing.assert_array_equal(study.values(3, 7), values.reshape(8, -1)[3:7])


def test_a_search_ends_with_a_front_drawn_again(tmp_path):
    plan = read_design({**TABLE, "aims": [{"column": "*.peak_force", "quantile": 0.5}]}, MACHINE)
    found = best_designs(plan, tmp_path / "design", threads=1)
    assert len(found.candidates) == 4 + 2
    low, high = 3e7, 3e8
    assert all(low <= one.values["*.support.stiffness"] <= high for one in found.candidates)
    best = min(found.candidates, key=lambda one: one.aims[0].value)
    assert best.on_front and len(found.front) == 1
    assert found.front[0].values == best.values
    assert found.front[0].aims[0].drops == 3 and best.aims[0].drops == 2
    assert found.described.values["*.support.stiffness"] == pytest.approx(
        float(MACHINE.touchdown_bearings[0].support.stiffness)
    )
    again = best_designs(plan, tmp_path / "design", threads=1)
    assert again == found


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"choose": {}}, r"nothing to choose"),
        ({"aims": [{"column": "*.peak_strss", "quantile": 0.5}]}, r"did you mean '\*\.peak_stress'"),
        ({"aims": [{"column": "*.peak_stress"}]}, r"either a 'quantile' or a limit 'above'"),
        ({"aims": [{"column": "*.peak_stress", "quantile": 1.5}]}, r"quantile = 1.5; expected"),
        ({"vary": TABLE["choose"]}, r"NDE.support.stiffness: drawn in two ways"),
        ({"candidates": 0}, r"candidates = 0; expected a whole number"),
        ({"drops": 5}, r"how many 'candidates' and 'repeats'"),
    ],
)
def test_what_cannot_be_designed_is_said(change, message):
    with pytest.raises(UsageError, match=message):
        read_design({**TABLE, **change}, MACHINE)


def test_an_aim_with_a_limit_counts_drops_beyond_it():
    aim = Aim(column="NDE.peak_stress", above=2.0)
    assert aim.of(np.array([1.0, 3.0, 4.0, 1.0])).value == 0.5


def test_the_verb(tmp_path, capsys):
    save_machine(MACHINE, tmp_path / "machine.toml")
    (tmp_path / "design.toml").write_text(
        'machine = "machine.toml"\ncandidates = 2\nrounds = 0\nrepeats = 2\nagain = 2\nduration = "9 ms"\n'
        'reduction = "quick"\nspeed = "100 Hz"\n'
        '[choose]\n"*.support.damping" = {log_uniform = ["2e3 N s/m", "5e4 N s/m"]}\n'
    )
    call = ["study", "design", str(tmp_path / "design.toml"), "--threads", "1"]
    assert run([*call, "--json", str(tmp_path / "d.json"), "--report", str(tmp_path / "d.html")]) == 0
    assert "as described" in capsys.readouterr().out
    content = json.loads((tmp_path / "d.json").read_text())
    assert content["aims"] == [
        "90 % quantile of peak stress at the worst bearing",
        "P(backward whirl at the worst bearing > 0)",
    ]
    assert len(content["candidates"]) == 2
    call = ["study", "rare", str(tmp_path / "design.toml"), "--column", "NDE.peak_forc", "--above", "1 kN"]
    assert run(call) == 64


BEARINGS = ["HCB71914-E", "XCB71914-E", "B7014-C"]


def test_a_chosen_bearing_is_that_of_the_machine_file(tmp_path):
    table = {**TABLE, "choose": {**TABLE["choose"], "*.bearing": {"choices": BEARINGS}}}
    plan = read_design({**table, "aims": [{"column": "*.peak_stress", "quantile": 0.5}]}, MACHINE)
    found = best_designs(plan, tmp_path / "design", threads=1)
    tried = [one.chosen(plan.study)["*.bearing"] for one in found.candidates]
    assert set(tried[:4]) <= set(BEARINGS) and len(set(tried)) > 1
    assert found.described.chosen(plan.study)["*.bearing"] == "as described"
    assert found.front[0].aims[0].drops == 3
    kept = load_results(tmp_path / "design" / "again").study
    assert kept.digest == study_of(tmp_path / "design" / "again").digest
    assert kept.choose["*.bearing"].names == tuple(BEARINGS)


def test_a_drop_with_a_chosen_bearing_is_that_of_its_machine_file():
    study = read_design({**TABLE, "choose": {"*.bearing": {"choices": BEARINGS}}}, MACHINE).study
    values = dict(zip(study.varied, study.values(0, 1)[0].tolist(), strict=True)) | {"*.bearing": 2.0}
    machine = MACHINE.with_bearing("NDE", "B7014-C").with_bearing("DE", "B7014-C")
    alone = replace(study, machine=machine, choose={}, design="random")
    of_study, reason = one_drop(study, build_drop_model(MACHINE, "quick"), values)
    of_file, _ = one_drop(alone, build_drop_model(machine, "quick"), values)
    assert not reason
    np.testing.assert_array_equal(of_study, of_file)
    as_described, _ = one_drop(study, build_drop_model(MACHINE, "quick"), values | {"*.bearing": -1.0})
    assert np.any(as_described != of_study)


def test_another_bearing_keeps_how_it_is_mounted():
    before, after = (m.bearing("DE") for m in (MACHINE, MACHINE.with_bearing("DE", "B7014-C")))
    assert (after.bearing.designation, after.bearing.ball_count) == ("B7014-C", 17)
    assert after.bearing.preload.value == find_bearing("B7014-C").preload["light"]
    assert after.bearing.arrangement == before.bearing.arrangement
    assert (after.air_gap, after.support, after.friction) == (before.air_gap, before.support, before.friction)
    ring = [one.changed(race={}).race for one in (before, after)]
    for name in ("mass", "inertia"):
        old, new = (getattr(one.race, name).value for one in (before, after))
        assert new / old == pytest.approx(
            getattr(ring[1], name).value / getattr(ring[0], name).value, rel=1e-12
        )
    assert MACHINE.with_bearing("DE", "XCB71914-E") is MACHINE


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ({"choices": ["B7014-E", "B71913-E"]}, r"DE cannot have a bearing 'B71913-E': the bore radius 35 mm"),
        (
            {"choices": ["B7014-E", "B7914-EE"]},
            r"NDE cannot have a bearing 'B7914-EE': the catalogue holds no",
        ),
        ({"choices": ["B7014-E", "B7014-E"]}, r"\*\.bearing: B7014-E listed twice"),
        ({"choices": ["B7014-E"]}, r"expected designations, as in"),
        ({"uniform": [1, 2]}, r"\*\.bearing is chosen from \{'uniform': \[1, 2\]\}; expected designations"),
    ],
)
def test_a_bearing_that_does_not_fit_is_said(choice, message):
    with pytest.raises(UsageError, match=message):
        read_design({**TABLE, "choose": {"*.bearing": choice}}, MACHINE)
