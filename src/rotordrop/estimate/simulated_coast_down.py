"""A simulated coast-down made ready for the same frequency analysis as a recorded one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rotordrop.machine import Machine
from rotordrop.simulate.coast_down_file import load_coast_down, open_samples
from rotordrop.spectrum.coast_down import CoastDownSignal
from rotordrop.spectrum.speed import exact_speed_profile
from rotordrop.spectrum.waterfall import PlanarSignal

SPEED_STEP = 0.02
"""Distance of the values [s] from which the profile of the exact speed is drawn (chosen)."""
LEAST_KNOTS = 20
"""Values of it at least, also of a coast-down of a few tenths of a second (chosen)."""


def simulated_coast_down(path: Path, machine: Machine | None = None) -> CoastDownSignal:
    """Open the samples that ``rotordrop coast-down --output`` wrote where a recording would have its sensors.

    With a machine the planes are those of its sensors, named by the end they belong to; without it, or when
    it has none, those of the bearings.
    """
    result, samples = load_coast_down(path), open_samples(path)
    planes: dict[str, PlanarSignal] = {name: samples.planes[name] for name in samples.air_gap}
    sensors = () if machine is None else machine.sensors
    ends = {sensor.bearing: samples.planes.get(f"node {sensor.node}") for sensor in sensors}
    if set(ends) == set(planes) and all(plane is not None for plane in ends.values()):
        planes = {name: plane for name, plane in ends.items() if plane is not None}
    count = len(samples.speed)
    every = max(1, min(round(SPEED_STEP * samples.sampling_rate), count // LEAST_KNOTS))
    time = np.arange(count)[::every] / samples.sampling_rate
    speed = np.abs(samples.speed[::every])
    return CoastDownSignal(
        planes=planes,
        air_gap={name: samples.air_gap[name] for name in planes},
        sampling_rate=samples.sampling_rate,
        start_time=0.0,
        profile=exact_speed_profile(time, speed),
        speed_time=time,
        speed=speed,
        recorded=False,
        standstill=result.standstill_time,
        force_and_stress=tuple(maximum.as_json() for maximum in result.maxima()),
    )
