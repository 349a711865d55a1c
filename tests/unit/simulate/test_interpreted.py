"""Every kernel also runs as plain Python and gives the same drop."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from tests.unit.simulate.short_drop import CASE, model

from rotordrop.simulate.drop import simulate_drop

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
