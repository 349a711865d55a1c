"""Drops with an estimate that nobody had to wait for."""

from __future__ import annotations

import json

import numpy as np
from tests.published import bearing, published, value
from tests.unit.web.serving import Served

from rotordrop.jobs.runner import publish
from rotordrop.jobs.traces import write_traces
from rotordrop.jobs.written import quantity_json
from rotordrop.report.quantity import Quantity

GAP, SPEED = 250e-6, 2.0 * np.pi * 60.0


def estimated(server: Served, name: str, sha256: str, peak: float, recorded: str = "") -> str:
    """A job whose estimate says of one bearing what is given, with a shaft that runs round its gap."""
    number = server.order("/api/jobs", {"name": name}).told["id"]
    job = server.space.job(number)
    told = job.read()
    told["files"]["record"] = {"name": name, "stored": "record.csv", "bytes": 1, "sha256": sha256}
    job.write(told)
    made = job.path / "estimate.made"
    made.mkdir()
    peaks = {"peak_force_N": value(peak, 0.9 * peak, 1.1 * peak), "peak_stress_Pa": value(1e9)}
    document = published(bearings={"DE": bearing(peaks)}, machine="LP-400", record_sha256=sha256)
    (made / "document.json").write_text(json.dumps(document.as_json()))
    time = np.linspace(0.0, 0.2, 2001)
    write_traces(made, "drop", time, {"x": GAP * np.cos(SPEED * time), "y": GAP * np.sin(SPEED * time)})
    said = {"text": "The model is consistent.", "level": "good"}
    force = Quantity(value=peak, kind="force", interval_90=(0.9 * peak, 1.1 * peak))
    row = {
        "machine": "LP-400",
        "recorded": recorded,
        "simulated": True,
        "speed": quantity_json(Quantity(value=SPEED, kind="speed")),
        "force": {"bearing": "DE", **quantity_json(force)},
        "stress": None,
        "statement": said,
    }
    page = {
        "traces": {"name": "drop", "columns": ["x", "y"], "start": 0.0, "end": 0.2},
        "places": [{"name": "DE", "gap": [0.9 * GAP, GAP], "measured": ["x", "y"]}],
        "statement": said,
        "row": row,
    }
    (made / "page.json").write_text(json.dumps(page))
    publish(job, "estimate", "0" * 16, made, job.digests())
    return str(number)
