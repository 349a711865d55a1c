"""What the studies of the replay share: hidden machines, and what the owner is told of them."""

from __future__ import annotations

import json
import math
import os
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.known import Known
from rotordrop.machine import Machine, example_machine
from rotordrop_bench import HiddenMachine, SensorChain

RESULTS = Path(os.environ.get("STUDY_RESULTS", Path(__file__).parent / "results"))
SPEEDS_HZ = (60.0, 100.0, 150.0, 210.0)
WITHOUT_ZERO_AND_GAIN_ERRORS = replace(SensorChain(), gain_error=0.0, offset=0.0)
"""An ordinary measuring chain (noise, hum, runout, 16 bits) whose zeros and gains are right."""

SUPPORT = ("support.stiffness", "support.mass", "support.damping")
NUISANCE = (
    "contact.stiffness",
    "contact.damping",
    "friction.dynamic",
    "friction.static",
    "friction.stribeck_speed",
    "race.mass",
    "race.inertia",
    "race.drag_coefficient",
    "damping_time",
    "preload",
    "bearing.first_ball_angle",
)


def speed_of(place: int) -> float:
    """Speed of the drop at a place of the list [Hz]."""
    return SPEEDS_HZ[place % len(SPEEDS_HZ)]


def radians(hertz: float) -> float:
    """Frequency [Hz] as speed [rad/s]."""
    return 2.0 * math.pi * hertz


def known_machine() -> Machine:
    """The machine of the supplied records, as its owner knows it."""
    return example_machine("lp400")


def value_of(bearing: TouchdownBearing, path: str) -> float:
    """Value of a bearing by its path."""
    part: Any = bearing.bearing if path == "preload" else bearing
    for name in path.split("."):
        part = getattr(part, name)
    return float(part)


def informed(known: Machine, hidden: HiddenMachine, *, supports: bool = False) -> Machine:
    """The owner's machine that knows everything but supports, air gap, unbalance and magnets.

    With ``supports``, the supports and the air gap are the true ones too.
    """
    true, values = hidden.machine, dict[str, Known | float]()
    paths = (*NUISANCE, *SUPPORT, "air_gap") if supports else NUISANCE
    for bearing in true.touchdown_bearings:
        values |= {f"{bearing.name}.{path}": exactly(value_of(bearing, path)) for path in paths}
    values["rotor.modal_damping"] = float(true.rotor.modal_damping)
    return known.with_values(values)


def with_right_sensors(machine: Machine) -> Machine:
    """The same machine, whose owner knows that zeros and gains of the sensors are right."""
    values: dict[str, Known] = {}
    for sensor in machine.sensors:
        values[f"sensors.{sensor.name}.gain"] = exactly(1.0, 1e-5)
        values[f"sensors.{sensor.name}.offset"] = exactly(0.0, 1e-8)
    return machine.with_values(values)


def exactly(value: float, error: float | None = None) -> Known:
    """A value known to a thousandth, or to an error in its own unit."""
    own = max(1e-3 * abs(value), 1e-15) if error is None else error
    return Known(value=value, status="estimated", standard_error=own)


def size_of(errors: Any) -> dict[str, float]:
    """Median, 90th percentile, root mean square and worst of absolute errors."""
    size = np.abs(np.asarray(errors, dtype=float)).ravel()
    size = size[np.isfinite(size)]
    return {
        "median": float(np.median(size)),
        "p90": float(np.quantile(size, 0.9)),
        "rms": float(np.sqrt(np.mean(size**2))),
        "worst": float(size.max()),
        "count": len(size),
    }


def write(name: str, content: Any) -> None:
    """Write results as JSON, with the state of the code they come from."""
    RESULTS.mkdir(exist_ok=True)
    version = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    ).stdout.strip()
    text = json.dumps({"version": version, "cores": os.cpu_count(), **content}, indent=1)
    (RESULTS / name).write_text(text + "\n", encoding="utf-8")
