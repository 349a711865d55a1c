"""The page of a replayed drop: simulated curves beside the measured ones, whatever clocks they have."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tests.unit.report.conftest import drop_result as drop_result
from tests.unit.report.test_replay_page import agreement as agreement
from tests.unit.report.test_replay_page import drop as drop
from tests.unit.web.test_same_numbers import NAMES

from rotordrop.estimate.estimate import Estimate
from rotordrop.web.drawn import write_estimate
from rotordrop.web.traces import open_traces
from rotordrop.web.workspace import Workspace


def test_a_replayed_drop_is_drawn_with_its_residual(drop: Estimate, tmp_path: Path) -> None:
    space = Workspace(tmp_path)
    space.prepare()
    job = space.new_job("drop_060", {})
    job.write({**job.read(), "files": NAMES})
    made = job.path / "estimate.made"
    made.mkdir()
    write_estimate(drop, job, made, {"method": "replay"})
    page = json.loads((made / "page.json").read_text(encoding="utf-8"))
    traces = open_traces(made, "drop", tuple(page["traces"]["columns"]))
    place = page["places"][0]
    measured, simulated, residual = (
        traces.values[traces.chosen((place[role][1],))[0]] for role in ("measured", "estimated", "residual")
    )
    assert place["labels"] == {"measured": "measured", "estimated": "simulated"}
    known = np.isfinite(measured)
    assert known.any()
    np.testing.assert_allclose(residual[known], (measured - simulated)[known], atol=1e-9)
    assert page["cards"][0]["figures"][0]["value"]["value"] == drop.bearings[0].peak_force.value
    assert "--method replay" in dict(page["facts"])["command"]
    assert page["verdict"][0]["text"].startswith(drop.verdict.value[:40])


def test_a_place_without_a_band_has_none(drop: Estimate, tmp_path: Path) -> None:
    from dataclasses import replace

    from rotordrop.web.drawn import histories_of

    bare = replace(drop, bearings=tuple(replace(one, force_band=None) for one in drop.bearings))
    names, _, columns = histories_of(bare)
    assert names[0]["force"] == ["force 0"]
    assert "force lower 0" not in columns
    assert pytest.approx(bare.bearings[0].force.values) == columns["force 0"]
