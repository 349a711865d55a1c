"""``import rotordrop`` and ``rotordrop --help`` stay light."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time

import pytest

HEAVY = {
    "scipy",
    "scipy.signal",
    "numba",
    "llvmlite",
    "plotly",
    "pandas",
    "xarray",
    "h5py",
    "matplotlib",
    "pint",
    "pydantic",
    "jinja2",
    "numpy",
}
LIMIT_S = 0.2
CASES = [["-c", "import rotordrop"], ["-m", "rotordrop", "--help"]]


@pytest.mark.parametrize("arguments", CASES, ids=["import", "help"])
def test_no_heavy_module_is_imported(arguments):
    done = subprocess.run(
        [sys.executable, "-X", "importtime", *arguments], capture_output=True, text=True, check=True
    )
    imported = set(re.findall(r"\|\s+([\w.]+)$", done.stderr, flags=re.MULTILINE))
    assert "rotordrop" in imported, "the list of imports was not read"
    assert not imported & HEAVY


@pytest.mark.parametrize("arguments", CASES, ids=["import", "help"])
def test_it_starts_fast(arguments):
    """The best of several runs counts: the others measure how busy the machine is."""
    times = []
    for _ in range(7):
        start = time.perf_counter()
        subprocess.run(
            [sys.executable, *arguments], capture_output=True, check=True, env=os.environ | {"COLUMNS": "80"}
        )
        times.append(time.perf_counter() - start)
        if times[-1] < LIMIT_S:
            break
    assert min(times) < LIMIT_S


def test_public_names_are_loaded_on_first_use():
    program = (
        "import sys, rotordrop\n"
        "assert 'rotordrop.units' not in sys.modules\n"
        "assert round(rotordrop.parse_quantity('60 Hz', 'speed'), 2) == 376.99\n"
        "assert 'rotordrop.units' in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_every_public_name_exists():
    import rotordrop

    for name in rotordrop.__all__:
        assert getattr(rotordrop, name) is not None, name
    assert set(rotordrop.__all__) <= set(dir(rotordrop))


def test_an_unknown_name_is_an_attribute_error():
    import rotordrop

    with pytest.raises(AttributeError, match="module 'rotordrop' has no attribute 'simulate_everything'"):
        rotordrop.simulate_everything  # noqa: B018
