"""One drop has the same bits whatever arithmetic the libraries choose, and result files carry its hash."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import h5py
import pytest

from rotordrop.simulate.fingerprint import fingerprint, history_hash, probe_drop

SETTINGS = {
    "linear algebra of an old processor": {"OPENBLAS_CORETYPE": "Prescott"},
    "linear algebra of another processor": {"OPENBLAS_CORETYPE": "Haswell"},
    "C library without fused multiply-add": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-AVX2"},
    "numpy without vector units": {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"},
}
GENERIC = {"NUMBA_CPU_NAME": "generic"}


def printed(**settings: str) -> str:
    command = [sys.executable, "-m", "rotordrop", "doctor", "--fingerprint"]
    done = subprocess.run(
        command, env={**os.environ, **settings}, capture_output=True, text=True, timeout=600, check=True
    )
    return done.stdout.strip()


@pytest.mark.parametrize("name", SETTINGS)
def test_the_hash_does_not_depend_on_the_libraries(name: str) -> None:
    assert printed(**SETTINGS[name]) == fingerprint()


@pytest.mark.slow
def test_the_hash_does_not_depend_on_the_compilers_processor(tmp_path: Path) -> None:
    assert printed(**GENERIC) == fingerprint()


def test_the_probe_touches_and_slides() -> None:
    drop = probe_drop()
    assert drop.finished
    assert set(drop.contacts.bearing.tolist()) == {0, 1}
    assert abs(drop.friction_force).max() > 1.0
    assert abs(drop.race_speed).max() > 1.0


def test_one_bit_gives_another_hash() -> None:
    drop = probe_drop()
    assert history_hash(drop) == fingerprint()
    drop.contact_force.view("uint64")[-1, 0] ^= 1
    assert history_hash(drop) != fingerprint()


def test_a_result_file_carries_it(tmp_path: Path) -> None:
    probe_drop().save(tmp_path / "drop.h5")
    with h5py.File(tmp_path / "drop.h5") as file:
        assert file.attrs["fingerprint"] == fingerprint()
