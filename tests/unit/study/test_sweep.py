"""Drops over a grid of values, in one call."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop import example_machine, sweep
from rotordrop.errors import UsageError


def test_every_combination_is_dropped_and_stands_in_one_table(tmp_path):
    machine = example_machine("small")
    vary = {"speed": ["200 Hz", "300 Hz", "400 Hz"], "*.friction.dynamic": [0.1, 0.3]}
    kept = sweep(machine, vary, repeats=2, folder=tmp_path / "kept", duration="4 ms", reduction="quick")
    table = kept.to_dataframe()
    assert len(table) == 12 and list(table["reason"]) == [""] * 12
    combinations = table.groupby(["speed", "*.friction.dynamic"]).size()
    assert len(combinations) == 6 and set(combinations) == {2}
    assert sorted(set(table["speed"])) == pytest.approx([2.0 * np.pi * f for f in (200.0, 300.0, 400.0)])
    again = sweep(machine, vary, repeats=2, duration="4 ms", reduction="quick")
    np.testing.assert_array_equal(again.column("NDE.largest_radius"), kept.column("NDE.largest_radius"))


def test_a_number_of_no_machine_is_named():
    with pytest.raises(UsageError, match=r"NDE\.support\.stiffnes"):
        sweep(example_machine("small"), {"NDE.support.stiffnes": ["1e8 N/m"]}, speed="300 Hz")
