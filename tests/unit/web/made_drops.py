"""Drops with an estimate that nobody had to wait for."""

from __future__ import annotations

import json

import numpy as np
from tests.unit.web.serving import Served

from rotordrop.jobs.results import quantity_json, shown_units
from rotordrop.jobs.runner import publish, write_state
from rotordrop.jobs.traces import write_traces
from rotordrop.jobs.workspace import Job
from rotordrop.report.quantity import Quantity

GAP, SPEED = 250e-6, 2.0 * np.pi * 60.0
SAID = {"text": "The model is consistent.", "level": "good"}


def estimated(server: Served, name: str, sha256: str, peak: float, recorded: str = "") -> str:
    """A job of a record with that digest, and its estimate."""
    number = server.order("/api/jobs", {"name": name}).told["id"]
    job = server.space.job(number)
    record = {"name": name, "stored": "record.csv", "bytes": 1, "sha256": sha256}
    job.write({**job.read(), "files": {"record": record}})
    give_estimate(job, peak, recorded)
    return str(number)


def give_estimate(job: Job, peak: float, recorded: str = "") -> None:
    """An estimate of NDE and DE with such a peak at DE; both shafts run round their gap."""
    made, time = job.path / "estimate.made", np.linspace(0.0, 0.2, 4001)
    made.mkdir()
    curves = {"x": GAP * np.cos(SPEED * time), "y": GAP * np.sin(SPEED * time)}
    curves |= {"force": peak * np.abs(np.sin(300.0 * time)), "stress": 1e9 + 0.0 * time}
    columns = {f"{name} {b}": curve for name, curve in curves.items() for b in (0, 1)}
    write_traces(made, "drop", time, columns)
    force = Quantity(value=peak, kind="force", interval_90=(0.9 * peak, 1.1 * peak))
    panels = [{"origin": "tracked", "band": None, "levels": []}] * 2
    shared = {"gap": [0.9 * GAP, GAP], "gap_is": "90 %", "peak_force": {"time": 0.005, "value": peak}}
    places = [
        {"name": name, "measured": [f"x {b}", f"y {b}"], "force": [f"force {b}"], "stress": [f"stress {b}"]}
        for b, name in enumerate(("NDE", "DE"))
    ]
    page = {
        "traces": {"name": "drop", "columns": [*columns], "start": 0.0, "end": 0.2},
        "places": [place | shared for place in places],
        "panels": {"force": panels, "stress": panels},
        "units": shown_units(),
        "zero": 0.0,
        "speed": SPEED,
        "impacts": [],
        "headline": [],
        "statement": SAID,
        "row": {
            "machine": "LP-400",
            "recorded": recorded,
            "simulated": True,
            "speed": quantity_json(Quantity(value=SPEED, kind="speed")),
            "force": {"bearing": "DE", **quantity_json(force), "interval_90": [0.9 * peak, 1.1 * peak]},
            "stress": None,
            "statement": SAID,
        },
    }
    (made / "page.json").write_text(json.dumps(page))
    publish(job, "estimate", "0" * 16, made, job.digests())
    write_state(job, "estimate", {"state": "done", "run": "0" * 16, "fraction": 1.0, "options": {}})
