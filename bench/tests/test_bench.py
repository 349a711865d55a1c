"""DropBench: a list that stays, recordings that come back the same, a table that counts what is missing."""

import hashlib
import json
import math

import pytest

from rotordrop.errors import UsageError
from rotordrop.files import digest_of_file, write_json
from rotordrop.machine import load_machine
from rotordrop_bench import DROPS, VERSION, Violations, chosen_drops, made, read_truth, score_all
from rotordrop_bench.cli.app import run
from rotordrop_bench.corpus.table import quantities, silent
from rotordrop_bench.departures import departures
from rotordrop_bench.rotors import ROTORS, bench_rotor
from rotordrop_bench.score import Truth
from rotordrop_bench.true_values import KINDS, violated_kinds

MADE = ("drop_004", "drop_034")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("bench")
    for drop in chosen_drops(MADE):
        assert made(drop, path) == path / "drops" / drop.name
    return path


@pytest.mark.parametrize(
    ("drops", "expected"),
    [(DROPS[:73], "461267f655696cb7"), (DROPS[73:99], "a126008bda1fe9ac"), (DROPS[99:], "c12c3dc2e1ebf476")],
)
def test_the_list_is_fixed(drops, expected):
    digest = hashlib.sha256()
    for drop in drops:
        digest.update(repr(drop).encode())
        parts = departures(bench_rotor(drop.rotor), 2.0 * math.pi * drop.speed, drop.departures)
        digest.update(repr(parts).encode())
    for rotor in ROTORS:
        machine = bench_rotor(rotor)
        numbers = [machine.rotor.mass, *machine.rotor.node_positions]
        for b in machine.touchdown_bearings:
            numbers += [
                float(v) for v in (b.air_gap, b.support.mass, b.support.stiffness, b.contact.stiffness)
            ]
        digest.update(" ".join(f"{number:.6g}" for number in numbers).encode())
    assert digest.hexdigest()[:16] == expected


def test_the_list_spans_what_it_promises():
    assert len({drop.name for drop in DROPS}) == len(DROPS) >= 60
    assert (min(d.speed for d in DROPS), max(d.speed for d in DROPS)) == (20.0, 550.0)
    masses = {name: bench_rotor(name).rotor.mass for name in ROTORS}
    for name, mass in masses.items():
        stated = float(name.split()[0]) * (1000.0 if name.endswith(" t") else 1.0)
        assert mass == pytest.approx(stated, rel=0.08), name
    assert min(masses.values()) < 5.2 < 5800.0 < max(masses.values())
    assert {drop.rotor for drop in DROPS} == set(ROTORS)
    assert {drop.sampling_rate for drop in DROPS} == {10e3, 20e3, 50e3, 100e3}
    kinds = [kind for drop in DROPS for kind, _ in drop.departures]
    assert set(kinds) == set(KINDS) - {"one end held"}
    assert {len(drop.departures) for drop in DROPS} == {0, 1, 2, 3}
    assert len({drop.seeds for drop in DROPS}) == len(DROPS)
    later = [drop for drop in DROPS if drop.group.startswith("later kinds")]
    assert {drop.rotor for drop in later} == set(ROTORS)
    assert len({drop.departures[0] for drop in later}) == len(later)


@pytest.mark.parametrize("drop", DROPS, ids=lambda drop: drop.name)
def test_a_hidden_machine_has_the_departures_of_the_list(drop):
    parts = departures(bench_rotor(drop.rotor), 2.0 * math.pi * drop.speed, drop.departures)
    broken = Violations.of(parts)
    assert set(violated_kinds(broken)) == {kind for kind, _ in drop.departures}
    broken.check_names(bench_rotor(drop.rotor))


def test_no_drop_says_what_is_hidden(folder):
    files = sorted(str(p.relative_to(folder / "drops")) for p in (folder / "drops").rglob("*.*"))
    assert files == [
        "drop_004/machine.toml",
        "drop_004/record.csv",
        "drop_034/machine.toml",
        "drop_034/record.csv",
        "drop_034/tail.csv",
    ]
    for file in (folder / "drops").rglob("*.*"):
        text = file.read_text().lower()
        for word in ("violat", "departure", "remanence", "truth", "seed"):
            assert word not in text, (file, word)
    assert load_machine(folder / "drops/drop_034/machine.toml") == bench_rotor("13 kg")


def test_what_is_cut_off_comes_back_the_same_and_the_truth_says_where_it_belongs(folder, capsys):
    record = folder / "drops/drop_004/record.csv"
    truth = folder / "truth/drop_004.json"
    before, when = (record.read_bytes(), truth.read_bytes()), record.stat().st_mtime_ns
    assert run(["make", str(folder), "--only", "drop_004", "--only", "drop_034"]) == 0
    assert "drops made: 0, there already: 2" in capsys.readouterr().out
    assert record.stat().st_mtime_ns == when
    truth.unlink()
    record.write_text("half")
    assert run(["make", str(folder), "--only", "drop_004", "--only", "drop_034"]) == 0
    assert "drops made: 1, there already: 1" in capsys.readouterr().out
    assert (record.read_bytes(), truth.read_bytes()) == before
    truth = read_truth(folder / "truth/drop_034.json")
    assert truth.values["bench_version"] == VERSION
    assert truth.values["violated"] == ["long remanence"]
    assert truth.structure["remanence.time_constant"] == 0.01
    assert all(rows[0][0] < 0.1 for rows in truth.values["contact_intervals_0_0p25_s"].values())
    assert Truth(values={"violated": ["tilted machine", "wear"]}).violated == ("side force", "wear")


def _estimates(folder, factor=1.0, half=0.02):
    """Estimates that are the truth times a factor, in the least form that is scored."""
    for name in MADE:
        truth = read_truth(folder.parent / "bench_truth" / f"{name}.json")
        bearings = {}
        for bearing in truth.bearing_names:
            peak = factor * truth.values["peak_force_N"][bearing]
            interval = [peak * (1.0 - half), peak * (1.0 + half)]
            bearings[bearing] = {"peak_force_N": {"value": peak, "interval_90": interval}}
        named = [{"name": "long remanence"}]
        document = {"consistent": True, "bearings": bearings, "structure": named}
        (folder / f"{name}.json").write_text(json.dumps(document))


@pytest.fixture
def estimates(folder, tmp_path):
    (tmp_path / "bench_truth").symlink_to(folder / "truth")
    place = tmp_path / "estimates"
    place.mkdir()
    return place


def _row(groups, quantity, family="all drops"):
    return next(r for r in quantities(groups) if (r.group, r.name) == (family, quantity))


def test_true_estimates_have_no_error(folder, estimates):
    _estimates(estimates)
    groups, _ = score_all(estimates, folder / "truth")
    row = _row(groups, "force")
    assert (row.values, row.missing, row.covered[0.9], row.lost) == (4, 0, 1.0, 0.0)
    assert row.worst == pytest.approx(0.0, abs=1e-12)
    assert row.half_width == pytest.approx(0.02)
    told = [(row.named, row.violated) for row in groups["all drops"]]
    assert told == [(("long remanence",), ()), (("long remanence",), ("long remanence",))]


def test_an_estimate_counts_for_the_recording_it_was_made_of(folder, estimates):
    _estimates(estimates)
    for name in MADE:
        file = estimates / f"{name}.json"
        recorded = {
            "record": "record.csv",
            "record_sha256": digest_of_file(folder / "drops" / MADE[0] / "record.csv"),
        }
        file.write_text(json.dumps(json.loads(file.read_text()) | recorded))
    _, scores = score_all(estimates, folder / "truth")
    assert [isinstance(one, str) for one in scores.values()] == [False, True]
    assert "belongs to record.csv" in scores[MADE[1]]


def test_a_wrong_and_a_missing_estimate_are_lost(folder, estimates):
    _estimates(estimates, factor=1.15)
    (estimates / "drop_034.json").unlink()
    only, _ = score_all(*(place / f"{MADE[0]}.json" for place in (estimates, folder / "truth")))
    assert [row.code for row in only["all drops"]] == [0]
    groups, scores = score_all(estimates, folder / "truth")
    assert scores["drop_034"] == "there is no drop_034.json"
    assert [(row.named, row.violated) for row in groups["all drops"]][1] == ((), ("long remanence",))
    row = _row(groups, "force")
    assert (row.values, row.missing, row.covered[0.9], row.lost) == (2, 2, 0.0, 1.0)
    assert row.median_error == pytest.approx(0.15)
    assert _row(groups, "force", "right, without tail").missing == 0
    assert _row(groups, "gap").missing == 4
    assert [row.code for row in groups["all drops"]] == [0, None]
    assert [silent(row) for row in groups["all drops"]] == [True, False]


def test_parameters_of_a_lost_drop_are_missing_if_the_estimator_states_them_elsewhere(folder, estimates):
    _estimates(estimates)
    for name in MADE:
        document = json.loads((estimates / f"{name}.json").read_text())
        for fields in document["bearings"].values():
            fields["support"] = {"mass_kg": {"value": 20.0, "interval_90": [1.0, 1e4]}}
        (estimates / f"{name}.json").write_text(json.dumps(document))
    (estimates / "drop_034.json").write_text("no estimate")
    row = _row(score_all(estimates, folder / "truth")[0], "parameters")
    assert (row.values, row.missing) == (2, 2)
    assert row.lost >= 0.5


def test_what_the_bench_does_not_have_is_refused(folder, estimates, tmp_path):
    (tmp_path / "old/truth").mkdir(parents=True)
    old = json.loads((folder / "truth/drop_004.json").read_text()) | {"bench_version": "0"}
    write_json(tmp_path / "old/truth/drop_004.json", old, sealed=True)
    with pytest.raises(UsageError, match="is of version '0' of the bench, this is version '2026'; make"):
        score_all(estimates, tmp_path / "old/truth")
    assert {drop.rotor for drop in chosen_drops(["6 t"])} == {"6 t"}
