"""A study gives the same numbers however it is computed, and loses nothing when it is killed."""

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

from rotordrop import DropCase, build_drop_model, example_machine, save_machine, simulate_drop, sweep
from rotordrop.errors import DamagedFileError, OutputError, UsageError
from rotordrop.files import write_json
from rotordrop.report.study_page import study_page
from rotordrop.study import run, summary
from rotordrop.study.folder import StudyFolder, alone_in, open_folder, read_shards, study_of
from rotordrop.study.numbers import study_numbers
from rotordrop.study.plan import independent, load_study, read_study, sobol
from rotordrop.study.quantities import columns_of
from rotordrop.study.run import compute_shard, one_drop, run_study, work_on
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


def study_with(**changes):
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


@pytest.fixture
def place(serial, tmp_path):
    """A copy of the folder of the study."""
    return shutil.copytree(serial[0], tmp_path / "study")


def test_threads_order_and_size_of_shards_change_no_bit(serial, tmp_path):
    run_study(study_with(), tmp_path / "threads", threads=3)
    same_shards(serial[0], tmp_path / "threads")
    open_folder(study_with(), tmp_path / "backwards")
    for shard in (2, 0, 1):
        work_on(tmp_path / "backwards", shard)
    same_shards(serial[0], tmp_path / "backwards")
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
    """Each has a block of the counter that no other drop reaches."""
    for width in (1, 7):
        blocks = (np.random.Philox(key=2**70 + 26, counter=[0, 0, drop, 0]) for drop in range(5, 25))
        alone = [np.random.Generator(block).random(width) for block in blocks]
        np.testing.assert_array_equal(independent(2**70 + 26, 5, 25, width), alone)
    assert independent(26, 4, 4, 3).shape == (0, 3)


@pytest.mark.filterwarnings("error")
def test_a_sobol_sequence_in_pieces_is_the_whole_and_warns_of_nothing():
    whole = sobol(3, 0, 7, 4)
    np.testing.assert_array_equal(np.concatenate([sobol(3, 0, 3, 4), sobol(3, 3, 7, 4)]), whole)
    assert sobol(3, 0, 0, 4).shape == (0, 4)


def test_grids_visit_every_cell_and_files_any_order():
    vary = {"speed": {"grid": ["60 Hz", "100 Hz"]}, "*.friction.dynamic": {"grid": [0.1, 0.2, 0.3]}}
    values = study_with(design="grid", vary=vary, drops=12).values(0, 12)
    _, counts = np.unique(values[:, :2], axis=0, return_counts=True)
    assert counts.tolist() == [2] * 6
    backwards = dict(reversed(list(TABLE["vary"].items())))
    assert study_with(vary=backwards).digest == study_with().digest
    np.testing.assert_array_equal(study_with(vary=backwards).values(0, 3), study_with().values(0, 3))


def test_numbers_are_those_of_the_drop_simulated_alone(serial):
    study, results = study_with(), serial[1]
    values = {name: float(column[4]) for name, column in results.varied.items()}
    machine = MACHINE.with_values(study.machine_values(values))
    for bearing in machine.touchdown_bearings:
        assert float(bearing.friction.dynamic) == values["*.friction.dynamic"]
    result = simulate_drop(machine, study.case(values))
    for b, name in enumerate(("NDE", "DE")):
        what = "peak_force,contacts,impulse,peak_stress"
        found = {one: results.numbers[f"{name}.{one}"][4] for one in what.split(",")}
        mine = result.contacts.bearing == b
        assert found["peak_force"] == pytest.approx(result.peak_force(b)[0], rel=1e-9)
        assert found["contacts"] == np.count_nonzero(mine)
        assert found["impulse"] == pytest.approx(result.contacts.impulse[mine].sum())
        assert found["peak_stress"] == pytest.approx(result.max_stress[:, b].max())
    assert results.numbers["final_speed"][4] == pytest.approx(result.speed[-1])


def test_a_folder_tells_its_study_and_computes_no_other(serial, tmp_path):
    folder = serial[0]
    assert study_of(folder).digest == study_with().digest
    with pytest.raises(UsageError, match=r"holds another study .*name another folder"):
        run_study(study_with(seed=4), folder)
    with pytest.raises(UsageError, match=r"is not a study folder"):
        load_results(folder / "shards")
    place = tmp_path / "study"
    open_folder(study_with(), place)
    work_on(place, 0)
    shutil.rmtree(place)
    other = study_with(seed=5)
    open_folder(other, place)
    work_on(place, 0)
    ((_, found),) = read_shards(StudyFolder(place), other, [0])
    np.testing.assert_array_equal(found["varied"], other.values(0, 5))


def test_a_machine_file_that_changed_or_is_gone_is_noticed(serial, place):
    file = place / "machine.toml"
    file.write_text(file.read_text().replace('"LP-400', '"LP-401', 1))
    with pytest.raises(DamagedFileError, match=r"plan and machine file do not belong together; remove"):
        study_of(place)
    file.unlink()
    with pytest.raises(DamagedFileError, match=r"machine\.toml is gone; remove plan\.json"):
        load_results(place)
    (place / "plan.json").write_bytes(b"{}")
    with pytest.raises(DamagedFileError, match=r"plan\.json is damaged.*remove it, and run the study again"):
        load_results(place)
    (place / "plan.json").unlink()
    run_study(study_with(), place, threads=1)
    same_shards(serial[0], place)


def test_a_shard_that_is_another_one_is_named_computed_again_and_kept(serial, place):
    """Damage of every kind: ``cli/test_written_files``."""
    shard, damaged = place / "shards" / "000001.npy", (place / "shards" / "000000.npy").read_bytes()
    shard.write_bytes(damaged)
    with pytest.raises(OutputError, match=r"000001\.npy .*'rotordrop study run .* keeps it aside"):
        load_results(place)
    (kept,) = run_study(study_with(), place, threads=1).aside
    assert shard.with_name(kept).read_bytes() == damaged
    shard.with_name(kept).unlink()
    same_shards(serial[0], place)


def test_another_version_shows_a_study_and_does_not_go_on_with_it(place):
    plan = json.loads((place / "plan.json").read_text())
    write_json(place / "plan.json", plan | {"rotordrop": "0.0.9"}, sealed=True)
    results = run_study(study_with(), place, threads=1)
    assert len(results) == 12
    assert ("rotordrop", "0.0.9") in study_page(results).facts
    (place / "shards" / "000001.npy").unlink()
    for go_on in (lambda: run_study(study_with(), place), lambda: work_on(place, 1)):
        with pytest.raises(UsageError, match=r"begun by rotordrop 0\.0\.9, and this is .* Go on with"):
            go_on()
    plan["study"]["tolerance"] *= 2.0
    write_json(place / "plan.json", plan | {"rotordrop": "0.0.9"}, sealed=True)
    with pytest.raises(UsageError, match=r"begun by rotordrop 0\.0\.9.* makes another study of its plan"):
        study_of(place)


@on_posix
@pytest.mark.parametrize("thing", NO_FILE)
def test_what_is_no_file_in_the_place_of_a_shard_is_put_aside(serial, place, thing):
    shard = place / "shards" / "000001.npy"
    shard.unlink()
    NO_FILE[thing](shard)
    with in_time():
        assert len(run_study(study_with(), place, threads=1).aside) == 1
    assert shard.read_bytes() == (serial[0] / "shards" / shard.name).read_bytes()


def test_a_file_that_is_no_shard_is_left_alone(place):
    (place / "shards" / "7x.npy").write_bytes(b"mine")
    assert len(load_results(place)) == 12


def test_a_drop_that_fails_is_a_result_with_its_reason(monkeypatch):
    study = study_with()
    model = build_drop_model(MACHINE, "quick")
    numbers, reason = one_drop(replace(study, tolerance=1e-3), model, values_of(study) | {"speed": np.inf})
    assert np.isnan(numbers)
    assert "speed is inf" in reason
    done = compute_shard(study_with(vary={"speed": {"choices": ["60 Hz"]}}), model, 0)
    assert done.reasons == ("",) * 5


def values_of(study):
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


PROGRAM = """
import sys
from rotordrop.study.folder import study_of
from rotordrop.study.run import run_study
if __name__ == "__main__":
    run_study(study_of(sys.argv[1]), sys.argv[1], {how})
"""


@pytest.mark.slow
@on_posix
def test_killed_runs_lose_no_finished_shard_and_change_no_bit(serial, tmp_path):
    study = study_with(drops=60, shard=2)
    expected = run_study(study, tmp_path / "whole", threads=2)
    open_folder(study, tmp_path / "killed")
    place = StudyFolder(tmp_path / "killed")
    finished = set()
    for _ in range(4):
        program = PROGRAM.format(how="threads=2")
        child = subprocess.Popen([sys.executable, "-c", program, str(place.path)])
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


def test_one_run_a_folder_and_a_dead_one_leaves_it(tmp_path):
    folder = open_folder(study_with(), tmp_path / "study")
    holds = "import sys, time\nfrom pathlib import Path\nfrom rotordrop.study.folder import *\n"
    holds += "with alone_in(StudyFolder(Path(sys.argv[1]))):\n    print(flush=True)\n    time.sleep(300)\n"
    with subprocess.Popen([sys.executable, "-c", holds, str(folder.path)], stdout=subprocess.PIPE) as other:
        assert other.stdout is not None and other.stdout.readline()
        with pytest.raises(UsageError, match=r"another run computes the study in .*wait for it"):
            run_study(study_with(), folder.path, threads=1)
        other.kill()
    with alone_in(folder):
        pass


@pytest.mark.slow
def test_a_cluster_computes_the_same_bits(serial, tmp_path):
    pytest.importorskip("distributed")
    open_folder(study_with(), tmp_path / "study")
    program = tmp_path / "program.py"  # workers of a cluster import the program that started it
    program.write_text(PROGRAM.format(how="dask='local'"))
    subprocess.run([sys.executable, str(program), str(tmp_path / "study")], timeout=300, check=True)
    same_shards(serial[0], tmp_path / "study")


@pytest.mark.slow
@on_posix
def test_a_worker_of_a_cluster_that_is_killed_changes_no_bit(tmp_path):
    """Dask gives the shards of a dead worker to another one; what it had published stays."""
    distributed = pytest.importorskip("distributed")
    study = study_with(drops=120, shard=2)
    run_study(study, tmp_path / "whole", threads=2)
    place = open_folder(study, tmp_path / "killed")
    killed = []

    def kill_one(_text, fraction):
        running = sorted({nanny.pid for nanny in cluster.workers.values()} - {None, *killed})
        if running and 120 * fraction >= 10 * (len(killed) + 1) and len(killed) < 3:
            killed.append(running[0])
            os.kill(killed[-1], signal.SIGKILL)

    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        run_study(study, place.path, dask=cluster.scheduler_address, progress=kill_one)
    assert len(killed) == 3
    same_shards(tmp_path / "whole", place.path)


def test_a_cluster_without_its_extra_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"distributed is not installed.*rotordrop\[cluster\]"):
        run_study(study_with(), tmp_path / "study", dask="local")


def test_a_study_ends_when_its_quantile_is_known_whatever_was_finished_first(tmp_path):
    until = {"column": "DE.peak_stress", "quantile": 0.5, "within": 0.01}
    study = study_with(drops=60, shard=3, until=until)
    results = run_study(study, tmp_path / "study", threads=2)
    needed = EarlyEnd(study, StudyFolder(tmp_path / "study")).shards()
    assert needed is not None and needed < study.shards
    assert len(results) == 3 * needed

    def known(found):
        return 0.5 * (found.high - found.low) <= 0.01 * found.value

    assert known(results.quantile("DE.peak_stress", 0.5))
    assert not known(summary.quantile(results.numbers["DE.peak_stress"][: 3 * (needed - 1)], 0.5))


def test_the_end_is_looked_for_without_reading_a_shard_twice(tmp_path, monkeypatch):
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
    looks = []

    def look(*_):
        looks.append(time.monotonic())
        time.sleep(0.02)
        return 0

    monkeypatch.setattr(run, "LOOK_EVERY", 1e-3)
    monkeypatch.setattr(run, "_drops", look)
    monkeypatch.setattr(run, "_work", lambda *_: time.sleep(0.3))
    study = study_with(drops=4, shard=2)
    run.run_study(study, tmp_path / "s", threads=1, progress=lambda *_: None)
    pauses = np.diff(looks)[1:-2]  # the first comes at once, the last two as soon as the work is done
    assert len(looks) >= 4 and np.all(pauses > 0.02 / run.LOOK_SHARE)


def test_results_are_written_as_parquet(serial, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    save_results(serial[1], tmp_path / "results.parquet")
    table = parquet.read_table(tmp_path / "results.parquet")
    assert table.num_rows == 12
    np.testing.assert_array_equal(table["NDE.peak_force"].to_numpy(), serial[1].numbers["NDE.peak_force"])
    assert json.loads(table.schema.metadata[b"units"])["NDE.peak_force"] == "N"


def test_results_are_written_with_units(serial, tmp_path):
    files = [tmp_path / name for name in ("results.h5", "again.h5")]
    for path in files:
        save_results(serial[1], path)
    assert files[0].read_bytes() == files[1].read_bytes()
    with h5py.File(files[0]) as file:
        assert len(file["drop"]) == 12
        assert file["NDE.peak_force"].attrs["units"] == "N"
        np.testing.assert_array_equal(file["NDE.peak_force"][()], serial[1].numbers["NDE.peak_force"])


LIMITED = """
import resource, sys
from rotordrop.errors import OutputError
from rotordrop.study.folder import study_of
from rotordrop.study.run import run_study
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    run_study(study_of(sys.argv[1]), sys.argv[1], threads=1)
except OutputError as error:
    sys.exit(str(error))
"""


def test_a_full_disk_is_said_and_the_study_goes_on_later(serial, tmp_path):
    """A limit on the size of files stands for the disk."""
    folder = tmp_path / "study"
    open_folder(study_with(), folder)
    work_on(folder, 0)
    before = (folder / "shards" / "000000.npy").read_bytes()
    done = subprocess.run([sys.executable, "-c", LIMITED, str(folder)], capture_output=True, text=True)
    assert done.returncode == 1 and "000001.npy" in done.stderr
    (left,) = (folder / "shards").iterdir()
    assert (left.name, left.read_bytes()) == ("000000.npy", before)
    run_study(study_with(), folder, threads=1)
    same_shards(serial[0], folder)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"drop": 3}, r"unknown key 'drop'; did you mean 'drops'"),
        ({"drops": 0}, r"drops = 0; expected a whole number from 1 to 1e8"),
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


def test_a_study_file_finds_its_machine_and_columns_have_units(tmp_path):
    save_machine(MACHINE, tmp_path / "machine.toml")
    file = tmp_path / "study.toml"
    file.write_text('machine = "machine.toml"\ndrops = 4\nspeed = "3600 rpm"\n')
    study = load_study(file)
    assert study.case(values_of(study)).speed == pytest.approx(DropCase(speed=2 * np.pi * 60).speed)
    file.write_text('machine = "machine.toml"\ndrops = 4\nspeed = "3600"\n')
    with pytest.raises(UsageError, match=r"study\.toml: speed: '3600' has no unit"):
        load_study(file)
    names = [q.name for q in columns_of(MACHINE)]
    assert len(set(names)) == len(names)
    assert all(q.unit and q.meaning for q in columns_of(MACHINE))


def test_a_study_of_lifts_counts_those_that_succeed(tmp_path):
    machine = looped_machine()
    plan = {"drops": 3, "duration": "0.09 s", "output_step": "0.1 ms", "relevitate": "30 ms", "seed": 7}
    limit = {"ambs.DE.magnet.current_limit": {"choices": ["2 A", "4 A"]}}
    plan["vary"] = {"speed": {"uniform": ["20 Hz", "60 Hz"]}, **limit}
    study = read_study(plan, machine)
    results = run_study(study, tmp_path / "lifts", threads=1)
    strong = results.varied["ambs.DE.magnet.current_limit"] > 3.0
    assert 0 < np.count_nonzero(strong) < 3
    assert results.numbers["lift"] == pytest.approx(strong.astype(float))
    assert np.array_equal(np.isfinite(results.numbers["lift_time"]), strong)
    assert study_numbers(results, ["speed"])["maps"]["speed"]["lift > 0.5"]
    assert read_study({**plan, "relevitate": "40 ms"}, machine).digest != study.digest
    late = r"relevitate = 0.1 s; expected a time within the duration of 0.09 s"
    with pytest.raises(UsageError, match=late):
        read_study({**plan, "relevitate": "0.1 s"}, machine)


def test_combinations_stand_in_one_table_and_unknown_numbers_are_named(tmp_path):
    machine = example_machine("small")
    vary = {"speed": ["200 Hz", "300 Hz", "400 Hz"], "*.friction.dynamic": [0.1, 0.3]}
    kept = sweep(machine, vary, repeats=2, folder=tmp_path / "kept", duration="4 ms", reduction="quick")
    table = kept.to_dataframe()
    assert len(table) == 12 and list(table["reason"]) == [""] * 12
    combinations = table.groupby(["speed", "*.friction.dynamic"]).size()
    assert len(combinations) == 6 and set(combinations) == {2}
    assert sorted(set(table["speed"])) == pytest.approx([2.0 * np.pi * f for f in (200.0, 300.0, 400.0)])
    few = kept.map("NDE.largest_radius", "speed")[0]["known"]
    assert few.interval_90 is None and few.source == "an interval needs 5 drops in a cell, there are 4"
    again = sweep(machine, vary, repeats=2, duration="4 ms", reduction="quick")
    np.testing.assert_array_equal(again.column("NDE.largest_radius"), kept.column("NDE.largest_radius"))
    with pytest.raises(UsageError, match=r"NDE\.support\.stiffnes"):
        sweep(example_machine("small"), {"NDE.support.stiffnes": ["1e8 N/m"]}, speed="300 Hz")
