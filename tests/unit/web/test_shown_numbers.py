"""What the page draws and lists of a drop is what its estimate, its document and its look say."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.unit.report.conftest import drop_result as drop_result
from tests.unit.report.conftest import estimate as estimate
from tests.unit.report.test_replay_page import agreement as agreement
from tests.unit.report.test_replay_page import drop as drop

from rotordrop.jobs.results import histories_of, write_estimate
from rotordrop.jobs.traces import open_traces
from rotordrop.jobs.workspace import Workspace

NAMES = {
    role: {"name": name, "stored": f"{role}{Path(name).suffix}", "bytes": 1, "sha256": digit * 64}
    for role, name, digit in (
        ("machine", "lp400.toml", "a"),
        ("record", "drop_060.h5", "b"),
        ("tail", "drop_060_tail.csv", "c"),
    )
}


def job_with_names(folder):
    """A job that knows its files, and where its estimate is made."""
    space = Workspace(folder)
    space.prepare()
    job = space.new_job("drop_060", {})
    job.write({**job.read(), "files": NAMES})
    (job.path / "estimate.made").mkdir()
    return job, job.path / "estimate.made"


@pytest.fixture(scope="module")
def written(bank, tmp_path_factory):
    job, made = job_with_names(tmp_path_factory.mktemp("same"))
    write_estimate(bank("begun"), job, made, {})
    return made


@pytest.fixture(scope="module")
def page(written):
    return dict(json.loads((written / "page.json").read_text(encoding="utf-8")))


@pytest.fixture(scope="module")
def document(written):
    return dict(json.loads((written / "document.json").read_text(encoding="utf-8")))


def test_headline_row_and_arrow_are_the_peaks_of_the_estimate(estimate, page, document):
    for told, place, bearing in zip(page["headline"], page["places"], estimate.bearings, strict=True):
        in_json = document["bearings"][bearing.name]["peak_force_N"]
        assert (told["name"], told["label"]) == (bearing.name, "peak bearing force")
        assert told["number"]["value"] == in_json["value"] == bearing.peak_force.value
        assert place["peak_force"] == {"time": in_json["time_s"], "value": bearing.peak_force.value}
        assert place["gap"] == list(bearing.values["air_gap_m"].interval_90)
        assert place["gap_is"] == "90 %"
    worst = max(estimate.bearings, key=lambda one: one.peak_force.interval_90[1])
    row = page["row"]
    assert (row["force"]["bearing"], row["force"]["value"]) == (worst.name, worst.peak_force.value)
    assert row["force"]["interval_90"] == list(worst.peak_force.interval_90)
    assert row["statement"] == page["statement"]


def test_every_impact(estimate, page, document):
    on_page = [
        (one["time"], one["place"], *(number["value"] for number in one["numbers"][:2]), one["azimuth"])
        for one in page["impacts"]
    ]
    in_json, in_python = [], []
    for bearing in estimate.bearings:
        hits = zip(bearing.impacts, document["bearings"][bearing.name]["impacts"], strict=True)
        for (hit, told), after in zip(hits, bearing.after_flight, strict=True):
            assert told["after_flight"] == after
            loads = hit.peak_force.value, hit.impulse.value
            in_python.append((hit.peak_time, bearing.name, *loads, hit.azimuth))
            loads = told["peak_force_N"]["value"], told["impulse_N_s"]["value"]
            in_json.append((told["peak_time_s"], bearing.name, *loads, told["azimuth_rad"]))
    assert sorted(in_json) == sorted(on_page) == sorted(in_python)
    forces = [force for _, _, force, *_ in on_page]
    assert forces == sorted(forces, reverse=True)
    assert forces[0] == pytest.approx(max(bearing.peak_force.value for bearing in estimate.bearings))
    assert sum(one["impact"] for one in page["impacts"]) == sum(len(b.touched) for b in estimate.bearings)


def test_the_unit_of_a_column_of_impacts_stands_in_its_heading_alone(page):
    assert page["impact_columns"][0] == {"SI": "peak force [N]", "US": "peak force [lbf]"}
    for k, head in enumerate(page["impact_columns"]):
        for system in ("SI", "US"):
            unit = head[system].partition("[")[2].rstrip("]")
            texts = [text for one in page["impacts"] for text in one["numbers"][k][system]]
            assert unit and not any(text.endswith(f" {unit}") for text in texts)


def test_the_curves_are_those_of_the_estimate(estimate, page, written):
    traces = open_traces(written, "drop", tuple(page["traces"]["columns"]))
    np.testing.assert_array_equal(traces.time, estimate.bearings[0].force.time)
    for b, bearing in enumerate(estimate.bearings):
        rows = traces.chosen((f"force {b}", f"stress {b}", f"estimated_y {b}"))
        wanted = [bearing.force.values, bearing.stress.values, bearing.motion.vertical.values]
        for row, values in zip(rows, wanted, strict=True):
            if len(values) == len(traces.time):
                np.testing.assert_array_equal(traces.values[row], values.astype("f4"))


def test_a_replayed_drop_is_drawn_beside_its_record(drop, tmp_path):
    job, made = job_with_names(tmp_path)
    write_estimate(drop, job, made, {"method": "replay"})
    page = json.loads((made / "page.json").read_text(encoding="utf-8"))
    traces = open_traces(made, "drop", tuple(page["traces"]["columns"]))
    place = page["places"][0]
    assert place["labels"] == {"measured": "measured", "estimated": "simulated"}
    for role, motion in (("measured", "measured"), ("estimated", "simulated")):
        shown = traces.values[traces.chosen((place[role][1],))[0]]
        (drawn,) = (one for one in drop.bearings[0].motions if one.role == motion)
        known = np.isfinite(shown)
        assert known.any()
        read = np.interp(traces.time[known], drawn.time, drawn.vertical.values)
        np.testing.assert_allclose(shown[known], read, atol=1e-9)
    assert page["headline"][0]["number"]["value"] == drop.bearings[0].peak_force.value
    assert "--method replay" in (made / "report.html").read_text(encoding="utf-8")
    assert page["statement"]["text"].startswith(drop.verdict.value[:40])


def test_a_place_without_a_band_has_none(drop):
    bare = replace(drop, bearings=tuple(replace(one, force_band=None) for one in drop.bearings))
    names, _, columns = histories_of(bare)
    assert names[0]["force"] == ["force 0"] and "force_lower 0" not in columns
    assert pytest.approx(bare.bearings[0].force.values) == columns["force 0"].values
