"""A drop beside its equations: units of a case, its cost, its hash, its file, what is not estimated."""

import json
import math
import os
import subprocess
import sys
from dataclasses import fields, replace
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from tests.unit.simulate.short_drop import CASE, model
from tests.unit.simulate.test_axial import faced, push
from tests.unit.simulate.test_heat import text_of as warm_text
from tests.unit.simulate.test_loads import with_lines
from tests.unit.simulate.test_rubs import RUB
from tests.unit.simulate.test_sleeve import text_of as sleeve_text

from rotordrop import DropCase, simulate_drop
from rotordrop.errors import DamagedFileError, OutputError, RecordError, SimulationError
from rotordrop.evidence.evidence import insisted
from rotordrop.files import new_hdf5
from rotordrop.machine import example_machine, loads_machine
from rotordrop.simulate.expected_steps import MANY_STEPS, expected_steps
from rotordrop.simulate.result import (
    ContactLog,
    DropResult,
    fingerprint,
    history_hash,
    load_result,
    probe_drop,
)


def test_texts_are_read_with_their_units():
    case = DropCase(speed="3600 rpm", duration="50 ms", output_step="10 us")
    assert case.speed == pytest.approx(2.0 * math.pi * 60.0)
    assert (case.duration, case.output_step) == pytest.approx((0.05, 1e-5))
    assert replace(case, speed=1.5).speed == 1.5
    assert DropCase(speed=0).speed == 0.0


SLOW = {
    "damping time": ({"NDE.damping_time": 1e-3}, "the bearing damping of NDE on the mass of its race"),
    "support mass": ({"DE.support.mass": 1e-3}, "the bearing damping of DE on the mass of its support"),
    "race inertia": ({"NDE.race.inertia": 1e-7}, "friction on the inertia of NDE's race"),
}


@pytest.mark.parametrize(("values", "cause"), SLOW.values(), ids=SLOW)
def test_the_cause_is_named_and_the_steps_are_as_many_as_are_taken(values, cause):
    machine = example_machine("paper").with_values(values)
    expected = expected_steps(machine, 0.01)
    assert expected.cause.startswith(cause)
    taken = simulate_drop(machine, DropCase(speed=377.0, duration=0.01, reduction="quick")).steps
    assert 0.2 * taken < expected.steps < 2.0 * taken


@pytest.mark.parametrize("name", ["paper", "small"])
def test_an_ordinary_drop_is_far_from_a_warning(name):
    assert expected_steps(example_machine(name), 0.2).steps < 0.02 * MANY_STEPS


SETTINGS = {
    "linear algebra of an old processor": {"OPENBLAS_CORETYPE": "Prescott"},
    "linear algebra of another processor": {"OPENBLAS_CORETYPE": "Haswell"},
    "C library without fused multiply-add": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-AVX2"},
    "numpy without vector units": {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"},
    "compiler for any processor": {"NUMBA_CPU_NAME": "generic"},
}


def printed(**settings):
    command = [sys.executable, "-m", "rotordrop", "doctor", "--fingerprint"]
    done = subprocess.run(
        command, env={**os.environ, **settings}, capture_output=True, text=True, timeout=600, check=True
    )
    return done.stdout.strip()


@pytest.mark.slow
@pytest.mark.parametrize("name", SETTINGS)
def test_the_hash_does_not_depend_on_libraries_and_processor(name):
    assert printed(**SETTINGS[name]) == fingerprint()


def test_the_probe_touches_and_slides_and_its_hash_is_that_of_every_bit(tmp_path):
    drop = probe_drop()
    assert drop.finished
    assert set(drop.contacts.bearing.tolist()) == {0, 1}
    assert abs(drop.friction_force).max() > 1.0
    assert abs(drop.race_speed).max() > 1.0
    assert history_hash(drop) == fingerprint()
    drop.contact_force.view("uint64")[-1, 0] ^= 1
    assert history_hash(drop) != fingerprint()
    probe_drop().save(tmp_path / "drop.h5")
    with h5py.File(tmp_path / "drop.h5") as file:
        assert file.attrs["fingerprint"] == fingerprint()


SCRIPT = """
import json
from rotordrop.simulate.drop import simulate_drop
from tests.unit.simulate.short_drop import CASE, model
result = simulate_drop(model(), CASE)
last = [values.tolist() for values in (result.state[-1], result.max_stress[-1], result.contacts.impulse)]
print(json.dumps([result.steps, *last]))
"""


@pytest.mark.slow
def test_a_drop_of_2_ms_is_the_same_interpreted():
    root = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], cwd=root, env=environment, capture_output=True, text=True, timeout=240
    )
    assert done.returncode == 0, done.stderr
    steps, state, stress, impulse = json.loads(done.stdout)
    compiled = simulate_drop(model(), CASE)
    assert len(compiled.contacts) >= 2
    assert steps == compiled.steps
    assert np.array(state) == pytest.approx(compiled.state[-1], rel=1e-9, abs=1e-13)
    assert np.array(stress) == pytest.approx(compiled.max_stress[-1], rel=1e-12)
    assert np.array(impulse) == pytest.approx(compiled.contacts.impulse, rel=1e-10)


@pytest.fixture(scope="module")
def saved(drop, tmp_path_factory):
    path = tmp_path_factory.mktemp("drop") / "drop.h5"
    drop.save(path)
    return path


def test_a_result_survives_the_disk(drop, saved):
    again = load_result(saved)
    for item in fields(DropResult):
        one, two = getattr(drop, item.name), getattr(again, item.name)
        if isinstance(one, np.ndarray):
            assert np.array_equal(one, two), item.name
        elif item.name not in ("contacts", "certificate"):
            assert one == two, item.name
    for item in fields(ContactLog):
        one, two = getattr(drop.contacts, item.name), getattr(again.contacts, item.name)
        assert np.array_equal(one, two, equal_nan=True), item.name
    assert again.certificate.sentence() == drop.certificate.sentence()


def test_the_certificate_of_a_checked_drop_is_kept(quick, tmp_path):
    result = simulate_drop(quick, DropCase(speed=300.0, duration=0.012), certify=True)
    assert result.certificate.peak_change_tolerance is not None
    assert np.all(result.certificate.peak_change_tolerance < 5e-3)
    assert np.all(result.certificate.peak_change_truncation < 0.05)
    result.save(tmp_path / "drop.h5")
    again = load_result(tmp_path / "drop.h5").certificate
    assert again.peak_change_truncation == pytest.approx(result.certificate.peak_change_truncation)


def test_readers_of_netcdf_and_xarray_see_names_units_and_axes(drop, saved):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    with xarray.open_dataset(saved, engine="h5netcdf") as data:
        assert data["bearing_force"].dims == ("time", "bearing", "axis")
        assert data["bearing_force"].attrs["units"] == "N"
        assert list(data["bearing"].values) == ["NDE", "DE"]
        chosen = data["bearing_force"].sel(bearing="DE", axis="y")
        assert chosen.values == pytest.approx(drop.bearing_force[:, 1, 1])
    data = drop.to_xarray()
    assert data["max_stress"].sel(bearing="NDE").max() == np.max(drop.max_stress[:, 0])
    assert data.attrs["outcome"] == drop.outcome


def test_files_of_another_kind_and_missing_ones_are_refused(tmp_path):
    import h5py

    path = tmp_path / "other.h5"
    with new_hdf5(path) as file:
        file["time"] = [0.0, 1.0]
    with pytest.raises(SimulationError, match=r"other\.h5 has format None; expected 'rotordrop drop 2'"):
        load_result(path)
    with h5py.File(path, "w") as file:
        file["time"] = [0.0, 1.0]
    with pytest.raises(DamagedFileError, match=r"other\.h5 is no file of rotordrop, or was changed"):
        load_result(path)
    with pytest.raises(SimulationError, match=r"gone\.h5 cannot be read"):
        load_result(tmp_path / "gone.h5")


def test_bearing_nodes_move_by_the_displacement_and_without_a_folder_nothing_is_left(drop, quick, tmp_path):
    nodes = [bearing.node for bearing in quick.machine.touchdown_bearings]
    assert drop.at_nodes(nodes) == pytest.approx(drop.displacement, abs=1e-18)
    with pytest.raises(OutputError, match="nowhere"):
        drop.save(tmp_path / "nowhere" / "drop.h5")
    assert list(tmp_path.iterdir()) == []


SEAL = f'[[clearances]]\nname = "seal"\nnode = 9\ngap = "1 mm"\n{RUB}\n'
MACHINES = {
    r"clearance 'seal' of the machine .* has a 'stiffness'.* Leave it": lambda lp400: with_lines(lp400, SEAL),
    r"has \[base\], with which a record cannot be .*Leave": lambda lp400: with_lines(
        lp400, '\n[base]\ny = "1 m/s^2"\nfrequency = "3 Hz"\n'
    ),
    r"'DE' of the machine .* is a sleeve, with which a record cannot": lambda _: loads_machine(
        sleeve_text("DE")
    ),
    r"has no gravity across its axis, with which a record cannot be estimated yet": lambda _: faced(
        push(300.0)
    ).with_values({"gravity": 0.0}),
    r"bearing 'NDE' of the machine .* warms, with which a record cannot be estimated yet: a drop": lambda _: (
        loads_machine(warm_text())
    ),
}


@pytest.mark.parametrize(("message", "machine"), MACHINES.items())
def test_a_record_is_not_estimated_with_them(message, machine):
    with pytest.raises(RecordError, match=message):
        insisted(SimpleNamespace(machine=machine(example_machine("lp400"))))
