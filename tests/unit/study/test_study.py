"""A study gives the same numbers however it is computed, and loses nothing when it is killed."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace

import h5py
import numpy as np
import pytest
from tests.no_file import NO_FILE, in_time, on_posix
from tests.unit.simulate.looped import looped_machine

from rotordrop import DropCase, example_machine, simulate_drop
from rotordrop._version import __version__
from rotordrop.errors import DamagedFileError, OutputError, UsageError
from rotordrop.files import DIGEST, write_json
from rotordrop.report.study_page import study_numbers, study_page
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.study.folder import StudyFolder, claimed, open_folder, read_shards, study_of
from rotordrop.study.plan import Study, load_study, read_study
from rotordrop.study.quantities import columns_of
from rotordrop.study.run import compute_shard, one_drop, run_study, work_on
from rotordrop.study.sampling import independent, sobol, uniform
from rotordrop.study.summary import EarlyEnd, load_results, save_results

MACHINE = example_machine("lp400")
TABLE = {
    "drops": 12,
    "shard": 5,
    "duration": "10 ms",
    "reduction": "quick",
    "seed": 3,
    "vary": {
        "speed": {"uniform": ["60 Hz", "200 Hz"]},
        "*.friction.dynamic": {"uniform": [0.05, 0.2]},
        "NDE.support.stiffness": {"log_uniform": ["5e7 N/m", "2e8 N/m"]},
    },
}


def study_with(**changes) -> Study:
    return read_study({**TABLE, **changes}, MACHINE)


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    folder = tmp_path_factory.mktemp("serial") / "study"
    return folder, run_study(study_with(), folder, threads=1)


def same_shards(one, other):
    files = sorted(file.name for file in (one / "shards").iterdir())
    assert files == sorted(file.name for file in (other / "shards").iterdir())
    for name in files:
        assert (one / "shards" / name).read_bytes() == (other / "shards" / name).read_bytes()


def test_threads_and_order_change_no_bit(serial, tmp_path):
    run_study(study_with(), tmp_path / "threads", threads=3)
    same_shards(serial[0], tmp_path / "threads")
    open_folder(study_with(), tmp_path / "backwards")
    for shard in (2, 0, 1):
        assert work_on(tmp_path / "backwards", shard)
    same_shards(serial[0], tmp_path / "backwards")


def test_the_size_of_a_shard_changes_no_number(serial, tmp_path):
    other = run_study(study_with(shard=12), tmp_path / "one", threads=1)
    for name, values in serial[1].numbers.items():
        np.testing.assert_array_equal(values, other.numbers[name])


@pytest.mark.parametrize("design", ["random", "latin hypercube", "sobol", "grid"])
def test_values_of_a_drop_do_not_depend_on_where_a_draw_begins(design):
    vary = dict(TABLE["vary"])
    if design == "grid":
        vary["speed"] = {"grid": ["60 Hz", "100 Hz", "150 Hz"]}
    study = study_with(design=design, vary=vary, drops=64)
    whole = study.values(0, 64)
    np.testing.assert_array_equal(study.values(17, 23), whole[17:23])
    assert len(np.unique(whole[:, 0])) == 64


def test_shares_of_many_drops_are_those_of_each_alone():
    for width in (1, 7):
        alone = [uniform(2**70 + 26, drop, width) for drop in range(5, 25)]
        np.testing.assert_array_equal(independent(2**70 + 26, 5, 25, width), alone)
    assert independent(26, 4, 4, 3).shape == (0, 3)


@pytest.mark.filterwarnings("error")
def test_a_sobol_sequence_in_pieces_is_the_whole_and_warns_of_nothing():
    whole = sobol(3, 0, 7, 4)
    np.testing.assert_array_equal(np.concatenate([sobol(3, 0, 3, 4), sobol(3, 3, 7, 4)]), whole)
    assert sobol(3, 0, 0, 4).shape == (0, 4)


def test_a_grid_visits_every_cell_alike():
    vary = {"speed": {"grid": ["60 Hz", "100 Hz"]}, "*.friction.dynamic": {"grid": [0.1, 0.2, 0.3]}}
    study = study_with(design="grid", vary=vary, drops=12)
    cells, counts = np.unique(study.values(0, 12)[:, :2], axis=0, return_counts=True)
    assert len(cells) == 6
    assert set(counts) == {2}


def test_order_of_the_file_changes_no_number():
    backwards = dict(reversed(list(TABLE["vary"].items())))
    assert study_with(vary=backwards).digest == study_with().digest
    np.testing.assert_array_equal(study_with(vary=backwards).values(0, 3), study_with().values(0, 3))


def test_numbers_are_those_of_the_drop_simulated_alone(serial):
    study, results = study_with(), serial[1]
    values = {name: float(column[4]) for name, column in results.varied.items()}
    machine = MACHINE.with_values(study.machine_values(values))
    assert float(machine.touchdown_bearings[0].friction.dynamic) == values["*.friction.dynamic"]
    assert float(machine.touchdown_bearings[1].friction.dynamic) == values["*.friction.dynamic"]
    result = simulate_drop(machine, study.case(values))
    for b, name in enumerate(("NDE", "DE")):
        assert results.numbers[f"{name}.peak_force"][4] == pytest.approx(result.peak_force(b)[0], rel=1e-9)
        mine = result.contacts.bearing == b
        assert results.numbers[f"{name}.contacts"][4] == np.count_nonzero(mine)
        assert results.numbers[f"{name}.impulse"][4] == pytest.approx(result.contacts.impulse[mine].sum())
        assert results.numbers[f"{name}.peak_stress"][4] == pytest.approx(result.max_stress[:, b].max())
    assert results.numbers["final_speed"][4] == pytest.approx(result.speed[-1])


def test_a_folder_tells_its_study_and_refuses_another(serial):
    folder = serial[0]
    assert study_of(folder).digest == study_with().digest
    with pytest.raises(UsageError, match=r"holds another study .*name another folder"):
        run_study(study_with(seed=4), folder)
    with pytest.raises(UsageError, match=r"is not a study folder"):
        load_results(folder / "shards")


def test_another_study_in_the_place_of_one_before_is_the_one_computed(tmp_path):
    place = tmp_path / "study"
    open_folder(study_with(), place)
    assert work_on(place, 0)
    shutil.rmtree(place)
    other = study_with(seed=5)
    open_folder(other, place)
    assert work_on(place, 0)
    ((_, found),) = read_shards(StudyFolder(place), other, [0])
    np.testing.assert_array_equal(found["varied"], other.values(0, 5))


def test_a_changed_machine_file_is_noticed(serial, tmp_path):
    open_folder(study_with(), tmp_path / "study")
    file = tmp_path / "study" / "machine.toml"
    file.write_text(file.read_text().replace('"LP-400', '"LP-401', 1))
    with pytest.raises(DamagedFileError, match=r"plan and machine file do not belong together; remove"):
        study_of(tmp_path / "study")


def bit_flipped(file, bit):
    raw = bytearray(file.read_bytes())
    raw[bit // 8 % len(raw)] ^= 1 << bit % 8
    file.write_bytes(raw)


@pytest.mark.parametrize("part", ["shards/000001.npy", "plan.json", "machine.toml"])
def test_one_bit_changed_anywhere_is_named(serial, tmp_path, part):
    random = np.random.default_rng(26)
    for bit in random.integers(0, 8 * (serial[0] / part).stat().st_size, 25).tolist():
        place = shutil.copytree(serial[0], tmp_path / f"{bit}")
        bit_flipped(place / part, bit)
        with pytest.raises(DamagedFileError, match=rf"{part.split('/')[-1]} is damaged"):
            load_results(place)


@pytest.mark.parametrize("content", [b"", b"\x93NUMPY\x01\x00"])
def test_a_shard_that_was_sealed_as_it_was_and_holds_no_table_is_named(serial, tmp_path, content):
    """A folder of an earlier format had no digests; a later run gives what is there one."""
    place = shutil.copytree(serial[0], tmp_path / "study")
    shard, study = place / "shards" / "000001.npy", study_of(place)
    shard.write_bytes(content + hashlib.sha256(study.digest.encode() + content).digest())
    with pytest.raises(DamagedFileError, match=r"000001\.npy does not hold drops"):
        load_results(place)


def test_a_folder_without_its_machine_is_refused_in_words(serial, tmp_path):
    place = shutil.copytree(serial[0], tmp_path / "study")
    (place / "machine.toml").unlink()
    with pytest.raises(DamagedFileError, match=r"machine\.toml is gone; remove plan\.json"):
        load_results(place)


def test_a_damaged_shard_is_computed_again_and_kept(serial, tmp_path):
    place = shutil.copytree(serial[0], tmp_path / "study")
    bit_flipped(place / "shards" / "000001.npy", 40_001)
    damaged = (place / "shards" / "000001.npy").read_bytes()
    results = run_study(study_with(), place, threads=1)
    (kept,) = results.aside
    assert (place / "shards" / kept).read_bytes() == damaged
    (place / "shards" / kept).unlink()
    same_shards(serial[0], place)


def without_digests(whole, place):
    """A folder as an older version made it."""
    shutil.copytree(whole, place)
    plan = json.loads((place / "plan.json").read_text())
    del plan[DIGEST], plan["machine_sha256"]
    plan |= {"format": "rotordrop study 2", "rotordrop": "0.0.9"}
    (place / "plan.json").write_text(json.dumps(plan))
    for file in (place / "shards").iterdir():
        file.write_bytes(file.read_bytes()[:-32])
    return place


def test_a_folder_without_digests_is_given_some_by_the_next_run(serial, tmp_path):
    place = without_digests(serial[0], tmp_path / "study")
    with pytest.raises(UsageError, match=r"has format 'rotordrop study 2', which has no digests; .* gives"):
        load_results(place)
    run_study(study_of(place), place, threads=1)
    same_shards(serial[0], place)


def test_of_drops_that_were_given_digests_later_it_is_said_that_nobody_checked_them(serial, tmp_path):
    """One number of a shard without digest changed: it used to be sealed, and passed for computed."""
    place = without_digests(serial[0], tmp_path / "study")
    bit_flipped(place / "shards" / "000001.npy", 8 * 400)
    run_study(study_of(place), place, threads=1)
    results = load_results(place)
    assert "12 drops were computed by rotordrop 0.0.9, which kept no digests" in results.taken_over
    assert results.taken_over in str(study_page(results).verdict)
    assert study_numbers(results)["taken_over"] == results.taken_over
    save_results(results, tmp_path / "drops.h5")
    with h5py.File(tmp_path / "drops.h5") as file:
        assert file.attrs["taken_over"] == results.taken_over
    pytest.importorskip("pyarrow.parquet")
    save_results(results, tmp_path / "drops.parquet")
    from pyarrow import parquet

    metadata = parquet.read_schema(tmp_path / "drops.parquet").metadata
    assert metadata[b"taken_over"].decode() == results.taken_over
    assert load_results(serial[0]).taken_over == ""


def test_a_shard_without_digest_whose_values_are_not_those_drawn_is_computed_again(serial, tmp_path):
    place = without_digests(serial[0], tmp_path / "study")
    plan = json.loads((place / "plan.json").read_text())
    (place / "plan.json").write_text(json.dumps(plan | {"rotordrop": __version__}))
    file = place / "shards" / "000001.npy"
    table = np.load(file)
    table["varied"][2, 1] *= 1.0 + 1e-12
    np.save(file, table)
    results = run_study(study_of(place), place, threads=1)
    assert len(results.aside) == 1
    assert results.taken_over.startswith("7 drops were computed by rotordrop")


def test_another_version_shows_a_study_and_does_not_go_on_with_it(serial, tmp_path):
    place = shutil.copytree(serial[0], tmp_path / "study")
    plan = json.loads((place / "plan.json").read_text())
    write_json(place / "plan.json", plan | {"rotordrop": "0.0.9"}, sealed=True)
    results = run_study(study_with(), place, threads=1)
    assert len(results) == 12
    assert results.taken_over.startswith("The drops were computed by rotordrop 0.0.9; numbers may differ")
    assert results.taken_over in str(study_page(results).verdict)
    (place / "shards" / "000001.npy").unlink()
    for go_on in (lambda: run_study(study_with(), place), lambda: work_on(place, 1)):
        with pytest.raises(UsageError, match=r"begun by rotordrop 0\.0\.9, and this is .* Go on with"):
            go_on()
    del plan["study"]
    write_json(place / "plan.json", plan | {"rotordrop": "0.0.9"}, sealed=True)
    with pytest.raises(UsageError, match=r"begun by rotordrop 0\.0\.9.* makes another study of its plan"):
        study_of(place)


def test_a_folder_of_a_later_format_is_refused_and_stays_as_it_is(serial, tmp_path):
    """Every other format was taken for an older one without digests, and written over."""
    place = shutil.copytree(serial[0], tmp_path / "study")
    plan = json.loads((place / "plan.json").read_text())
    write_json(place / "plan.json", plan | {"format": "rotordrop study 99"}, sealed=True)
    before = (place / "plan.json").read_bytes()
    for read in (load_results, study_of, lambda place: run_study(study_with(), place, threads=1)):
        with pytest.raises(UsageError, match=r"format 'rotordrop study 99', .* a later version has made it"):
            read(place)
    assert (place / "plan.json").read_bytes() == before


@on_posix
@pytest.mark.parametrize("thing", NO_FILE)
def test_what_is_no_file_in_the_place_of_a_shard_is_put_aside(serial, tmp_path, thing):
    place = shutil.copytree(serial[0], tmp_path / "study")
    shard = place / "shards" / "000001.npy"
    shard.unlink()
    NO_FILE[thing](shard)
    with in_time():
        assert len(run_study(study_with(), place, threads=1).aside) == 1
    assert shard.read_bytes() == (serial[0] / "shards" / shard.name).read_bytes()


@on_posix
@pytest.mark.parametrize("thing", NO_FILE)
def test_what_is_no_claim_is_named(serial, tmp_path, thing):
    place = shutil.copytree(serial[0], tmp_path / "study")
    (place / "shards" / "000001.npy").unlink()
    NO_FILE[thing](place / "claims" / "000001.json")
    with in_time(), pytest.raises(DamagedFileError, match=r"000001\.json is damaged: .*remove it, and run"):
        run_study(study_with(), place, threads=1)


@pytest.mark.parametrize("content", [b"[]", b"{}", b'{"format": "rotordrop study 3", "study": 1}'])
def test_a_plan_that_is_none_is_named(serial, tmp_path, content):
    place = shutil.copytree(serial[0], tmp_path / "study")
    (place / "plan.json").write_bytes(content)
    with pytest.raises(DamagedFileError, match=r"plan\.json is damaged.*remove it, and run the study again"):
        load_results(place)
    (place / "plan.json").unlink()
    run_study(study_with(), place, threads=1)
    same_shards(serial[0], place)


def test_a_file_that_is_no_shard_is_left_alone(serial, tmp_path):
    place = shutil.copytree(serial[0], tmp_path / "study")
    (place / "shards" / "7x.npy").write_bytes(b"mine")
    assert len(load_results(place)) == 12


@pytest.mark.parametrize("content", ["[]", '{"process": "x"}', "7", '{"process": 1%s}' % ("0" * 30), "{"])
def test_a_damaged_claim_lapses(content, tmp_path):
    folder = open_folder(study_with(), tmp_path / "study")
    file = folder.claims / "000000.json"
    file.write_text(content)
    os.utime(file, (time.time() - 3600.0,) * 2)
    with claimed(folder, 0) as taken:
        assert taken is not None


def test_a_drop_that_fails_is_a_result_with_its_reason(monkeypatch):
    study = study_with()
    model = build_drop_model(MACHINE, "quick")
    numbers, reason = one_drop(replace(study, tolerance=1e-3), model, values_of(study) | {"speed": np.inf})
    assert np.isnan(numbers)
    assert "speed is inf" in reason
    done = compute_shard(study_with(vary={"speed": {"choices": ["60 Hz"]}}), model, 0)
    assert done.reasons == ("",) * 5


def values_of(study: Study) -> dict[str, float]:
    return dict(zip(study.varied, study.values(0, 1)[0].tolist(), strict=True))


def test_failed_drops_are_counted_with_their_reason(serial, tmp_path):
    vary = {"speed": {"uniform": ["60 Hz", "61 Hz"]}, "NDE.air_gap": {"choices": ["250 um", "100 m"]}}
    results = run_study(study_with(vary=vary, drops=8), tmp_path / "study", threads=1)
    failed = np.array([bool(reason) for reason in results.reasons])
    np.testing.assert_array_equal(failed, results.varied["NDE.air_gap"] > 1.0)
    assert 0 < failed.sum() == sum(results.failed.values()) < 8
    assert np.isnan(results.numbers["NDE.peak_force"][failed]).all()
    assert np.isfinite(results.numbers["NDE.peak_force"][~failed]).all()
    assert results.exceedance("NDE.peak_force", 0.0).drops == 8 - failed.sum()


def test_a_damaged_shard_is_named(serial, tmp_path):
    run_study(study_with(drops=5), tmp_path / "study", threads=1)
    file = tmp_path / "study" / "shards" / "000000.npy"
    whole = file.read_bytes()
    for damaged in (whole[:-10], b"", serial[0].joinpath("shards", "000001.npy").read_bytes()):
        file.write_bytes(damaged)
        with pytest.raises(OutputError, match=r"000000\.npy .*'rotordrop study run .* keeps it aside"):
            load_results(tmp_path / "study")


def test_two_never_claim_one_shard(tmp_path):
    folder = open_folder(study_with(), tmp_path / "study")
    with claimed(folder, 0) as mine:
        assert mine is not None
        with claimed(folder, 0) as other:
            assert other is None
    with claimed(folder, 0) as again:
        assert again is not None


def test_a_claim_of_a_dead_process_is_taken_over(tmp_path):
    folder = open_folder(study_with(), tmp_path / "study")
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    with claimed(folder, 0):
        file = folder.claims / "000000.json"
        owner = json.loads(file.read_text())
        file.write_text(json.dumps(owner | {"process": dead.pid}))
        with claimed(folder, 0) as taken:
            assert taken is not None
    assert not list(folder.claims.glob("*.stale"))


def test_a_claim_from_elsewhere_lapses_with_its_lease(tmp_path):
    folder = open_folder(study_with(), tmp_path / "study")
    file = folder.claims / "000000.json"
    file.write_text(json.dumps({"host": "elsewhere", "process": 1, "since": 0.0}))
    with claimed(folder, 0) as taken:
        assert taken is None
    os.utime(file, (time.time() - 3600.0,) * 2)
    with claimed(folder, 0) as taken:
        assert taken is not None


PROGRAM = """
import sys
from rotordrop.study.folder import study_of
from rotordrop.study.run import run_study
run_study(study_of(sys.argv[1]), sys.argv[1], threads=2)
"""


@pytest.mark.skipif(os.name != "posix", reason="signals as on POSIX")
def test_killed_runs_lose_no_finished_shard_and_change_no_bit(serial, tmp_path):
    study = study_with(drops=60, shard=2)
    expected = run_study(study, tmp_path / "whole", threads=2)
    open_folder(study, tmp_path / "killed")
    place = StudyFolder(tmp_path / "killed")
    finished: set[int] = set()
    for _ in range(4):
        child = subprocess.Popen([sys.executable, "-c", PROGRAM, str(place.path)])
        goal = len(finished) + 3
        while child.poll() is None and len(place.finished()) < goal:
            time.sleep(0.01)
        child.send_signal(signal.SIGKILL)
        child.wait()
        assert finished <= set(place.finished())
        finished = set(place.finished())
        assert all(len(table) == 2 for _, table in read_shards(place, study, sorted(finished)))
    resumed = run_study(study, place.path, threads=2)
    same_shards(tmp_path / "whole", place.path)
    np.testing.assert_array_equal(resumed.drop, expected.drop)
    assert not list(place.claims.iterdir())


def test_two_processes_share_one_study(serial, tmp_path):
    study = study_with(drops=40, shard=2)
    run_study(study, tmp_path / "alone", threads=1)
    open_folder(study, tmp_path / "shared")
    command = [sys.executable, "-c", PROGRAM, str(tmp_path / "shared")]
    for child in [subprocess.Popen(command) for _ in range(2)]:
        assert child.wait() == 0
    same_shards(tmp_path / "alone", tmp_path / "shared")


PROGRAM_ON_DASK = """
import sys
from rotordrop.study.folder import study_of
from rotordrop.study.run import run_study
if __name__ == "__main__":
    run_study(study_of(sys.argv[1]), sys.argv[1], dask="local")
"""


@pytest.mark.parametrize("helpers", [0, 2])
def test_a_cluster_computes_the_same_bits(helpers, serial, tmp_path):
    """Where the extra "cluster" is installed, alone and beside processes that claim in the same folder."""
    pytest.importorskip("distributed")
    open_folder(study_with(), tmp_path / "study")
    program = tmp_path / "program.py"  # workers of a cluster import the program that started it
    program.write_text(PROGRAM_ON_DASK)
    commands = [[str(program)], *[["-c", PROGRAM]] * helpers]
    children = [subprocess.Popen([sys.executable, *one, str(tmp_path / "study")]) for one in commands]
    assert [child.wait(timeout=300) for child in children] == [0] * (1 + helpers)
    same_shards(serial[0], tmp_path / "study")


def test_a_cluster_without_its_extra_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"needs the extra 'cluster'.*rotordrop\[cluster\]"):
        run_study(study_with(), tmp_path / "study", dask="local")


def test_a_study_ends_when_its_quantile_is_known_whatever_was_finished_first(tmp_path):
    until = {"column": "DE.peak_stress", "quantile": 0.5, "within": 0.01}
    study = study_with(drops=60, shard=3, until=until)
    results = run_study(study, tmp_path / "study", threads=2)
    needed = EarlyEnd(study, StudyFolder(tmp_path / "study")).shards()
    assert needed is not None and needed < study.shards
    assert len(results) == 3 * needed
    found = results.quantile("DE.peak_stress", 0.5)
    assert 0.5 * (found.high - found.low) <= 0.01 * found.value
    fewer = results.numbers["DE.peak_stress"][: 3 * (needed - 1)]
    from rotordrop.study.summary import quantile

    before = quantile(fewer, 0.5)
    assert not 0.5 * (before.high - before.low) <= 0.01 * before.value


def test_the_end_is_looked_for_without_reading_a_shard_twice(tmp_path, monkeypatch):
    from rotordrop.study import summary

    until = {"column": "DE.peak_stress", "quantile": 0.5, "within": 1e-6}
    study = study_with(drops=8, shard=2, until=until)
    place = open_folder(study, tmp_path / "study")
    end, read = EarlyEnd(study, place), []

    def counted(*arguments):
        read.extend(arguments[-1])
        return read_shards(*arguments)

    monkeypatch.setattr(summary, "read_shards", counted)
    for shard in (0, 2, 1):
        work_on(place.path, shard)
        for _ in range(3):
            assert end.shards() is None
    assert read == [0, 1, 2]


def test_a_folder_that_is_slow_to_look_at_is_looked_at_less_often(tmp_path, monkeypatch):
    """At 50,000 finished shards looks twice a second took a fifth of every worker's time."""
    from rotordrop.study import run

    looks = []
    monkeypatch.setattr(run, "LOOK_EVERY", 1e-3)
    monkeypatch.setattr(run, "_drops", lambda *_: looks.append(time.sleep(0.02)) or 0)
    monkeypatch.setattr(run, "_work", lambda *_: time.sleep(0.3) or True)
    study = study_with(drops=4, shard=2)
    run.run_study(study, tmp_path / "s", threads=1, wait_for_others=False, report=lambda _: None)
    assert 2 <= len(looks) <= 5  # begin, end, and one or two between; before, some twenty


def test_results_are_written_as_parquet(serial, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    save_results(serial[1], tmp_path / "results.parquet")
    table = parquet.read_table(tmp_path / "results.parquet")
    assert table.num_rows == 12
    np.testing.assert_array_equal(table["NDE.peak_force"].to_numpy(), serial[1].numbers["NDE.peak_force"])
    assert json.loads(table.schema.metadata[b"units"])["NDE.peak_force"] == "N"


def test_a_full_disk_is_said_and_the_study_goes_on_later(serial, tmp_path):
    """A limit on the size of files stands for the disk."""
    folder = tmp_path / "study"
    open_folder(study_with(), folder)
    assert work_on(folder, 0)
    before = (folder / "shards" / "000000.npy").read_bytes()
    limited = (
        "import resource, sys\n"
        "from rotordrop.errors import OutputError\n"
        "from rotordrop.study.folder import study_of\n"
        "from rotordrop.study.run import run_study\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n"
        "try:\n"
        "    run_study(study_of(sys.argv[1]), sys.argv[1], threads=1)\n"
        "except OutputError as error:\n"
        "    sys.exit(str(error))\n"
    )
    done = subprocess.run([sys.executable, "-c", limited, str(folder)], capture_output=True, text=True)
    assert done.returncode == 1
    assert "000001.npy" in done.stderr
    assert sorted(file.name for file in (folder / "shards").iterdir()) == ["000000.npy"]
    assert (folder / "shards" / "000000.npy").read_bytes() == before
    run_study(study_with(), folder, threads=1)
    same_shards(serial[0], folder)


def test_results_are_written_with_units(serial, tmp_path):
    import h5py

    save_results(serial[1], tmp_path / "results.h5")
    with h5py.File(tmp_path / "results.h5") as file:
        assert len(file["drop"]) == 12
        assert file["NDE.peak_force"].attrs["units"] == "N"
        np.testing.assert_array_equal(file["NDE.peak_force"][()], serial[1].numbers["NDE.peak_force"])
    first = (tmp_path / "results.h5").read_bytes()
    save_results(serial[1], tmp_path / "again.h5")
    assert (tmp_path / "again.h5").read_bytes() == first


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"drop": 3}, r"unknown key 'drop'; did you mean 'drops'"),
        ({"drops": 0}, r"drops = 0; expected a whole number above zero"),
        ({"drops": 1.5}, r"drops = 1.5; expected a whole number"),
        ({"design": "latin"}, r"design = 'latin'; expected one of random"),
        ({"vary": {}}, r"has no speed"),
        ({"vary": {"speed": {"uniform": ["60", "70 Hz"]}}}, r"speed: '60' has no unit"),
        ({"vary": {"speed": {"uniform": ["70 Hz", "60 Hz"]}}}, r"runs from 439.823 to 376.991"),
        ({"vary": {"speed": {"even": ["70 Hz", "60 Hz"]}}}, r"expected one of uniform"),
        ({"speed": "60 Hz", "vary": {"NDE.gap": {"uniform": ["1 um", "2 um"]}}}, r"'gap' is not known"),
        ({"speed": "60 Hz", "vary": {"NDE.air_gap": {"normal": ["1 um", "0 um"]}}}, r"deviation of 0"),
        ({"design": "grid"}, r"'grid' with 0 values varied by 'grid'"),
        ({"start": "floating"}, r"start = 'floating'; expected \"levitated\""),
        ({"tolerance": 0.5}, r"tolerance = 0.5; expected a number up to 1e-3"),
        ({"until": {"quantile": 0.9}}, r"until = .*expected \{column"),
    ],
)
def test_a_wrong_study_says_what_was_expected(changes, message):
    with pytest.raises(UsageError, match=message):
        study_with(**changes)


def test_a_study_file_names_itself_and_finds_its_machine(tmp_path):
    from rotordrop import save_machine

    save_machine(MACHINE, tmp_path / "machine.toml")
    file = tmp_path / "study.toml"
    file.write_text('machine = "machine.toml"\ndrops = 4\nspeed = "3600 rpm"\n')
    study = load_study(file)
    assert study.case(values_of(study)).speed == pytest.approx(DropCase(speed=2 * np.pi * 60).speed)
    file.write_text('machine = "machine.toml"\ndrops = 4\nspeed = "3600"\n')
    with pytest.raises(UsageError, match=r"study\.toml: speed: '3600' has no unit"):
        load_study(file)


def test_every_column_has_a_unit_and_a_meaning():
    names = [q.name for q in columns_of(MACHINE)]
    assert len(set(names)) == len(names)
    assert all(q.unit and q.meaning for q in columns_of(MACHINE))


def test_a_study_of_lifts_counts_those_that_succeed(tmp_path):
    machine = looped_machine()
    plan = {"drops": 3, "duration": "0.09 s", "output_step": "0.1 ms", "relevitate": "30 ms", "seed": 7}
    plan["vary"] = {
        "speed": {"uniform": ["20 Hz", "60 Hz"]},
        "ambs.DE.magnet.current_limit": {"choices": ["2 A", "4 A"]},
    }
    study = read_study(plan, machine)
    results = run_study(study, tmp_path / "lifts", threads=1)
    strong = results.varied["ambs.DE.magnet.current_limit"] > 3.0
    assert 0 < np.count_nonzero(strong) < 3
    assert results.numbers["lift"] == pytest.approx(strong.astype(float))
    assert np.array_equal(np.isfinite(results.numbers["lift_time"]), strong)
    said = " ".join(statement.text for statement in study_page(results, ["speed"]).verdict)
    assert "The magnets lift the rotor again in" in said
    assert study_numbers(results, ["speed"])["maps"]["speed"]["lift > 0.5"]
    assert read_study({**plan, "relevitate": "40 ms"}, machine).digest != study.digest
    with pytest.raises(
        UsageError, match=r"relevitate = 0.1 s; expected a time within the duration of 0.09 s"
    ):
        read_study({**plan, "relevitate": "0.1 s"}, machine)
