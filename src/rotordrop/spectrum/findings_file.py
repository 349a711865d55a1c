"""What a coast-down shows as numbers in one HDF5 file: everything that the figures of the report draw."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.files import new_hdf5

if TYPE_CHECKING:
    from rotordrop.spectrum.coast_down import CoastDownAnalysis, PlaneAnalysis

FORMAT = "rotordrop frequencies 1"


def write_findings(analysis: CoastDownAnalysis, path: Path) -> None:
    """Write waterfalls, displacement envelopes, tracked orders and speed; the file appears complete or not.

    Every data set carries its ``units``, a waterfall its ``amplitude_kind``. Lines, resonances and statements
    are in the JSON.
    """
    with new_hdf5(path) as file:
        file.attrs["format"] = FORMAT
        file.attrs["recorded"] = analysis.signal.recorded
        for name, plane in analysis.planes.items():
            _write_plane(file.create_group(f"planes/{name}"), plane)
        time, speed = analysis.signal.speed_time, analysis.signal.speed
        if time is not None and speed is not None:
            _put(file, "speed/time", time, "s")
            _put(file, "speed/speed", speed, "rad/s")
            law = analysis.speed_law
            for name, fit in () if law is None else (("exponential", law.exponential), ("drag", law.drag)):
                inside = (time >= fit.start) & (time <= fit.end)
                fitted = np.full(len(time), np.nan)
                fitted[inside] = fit.speed_at(time[inside])
                _put(file, f"speed/{name}_fit", fitted, "rad/s")


def _put(group: Any, name: str, values: Any, unit: str) -> None:
    group.create_dataset(name, data=np.asarray(values)).attrs["units"] = unit


def _write_plane(group: Any, plane: PlaneAnalysis) -> None:
    history, track = plane.history, plane.track
    for name, values, unit in (
        ("time", history.time, "s"),
        ("smallest", history.lowest, "m"),
        ("largest", history.highest, "m"),
        ("smallest_xy", history.lowest_xy, "m"),
        ("largest_xy", history.highest_xy, "m"),
        ("air_gap", history.air_gap, "m"),
    ):
        _put(group, f"displacement/{name}", values, unit)
    for fall in plane.waterfalls:
        place = group.create_group(f"waterfall_{fall.component}")
        place.attrs["points"], place.attrs["overlap"] = fall.settings.points, fall.settings.overlap
        _put(place, "time", fall.time, "s")
        _put(place, "frequency", fall.frequency, "Hz")
        _put(place, "amplitude", fall.amplitude, "m")
        place["amplitude"].attrs["amplitude_kind"] = fall.amplitude_kind
        if fall.speed is not None:
            _put(place, "speed", fall.speed, "rad/s")
    if track is not None:
        _put(group, "orders/time", track.time, "s")
        _put(group, "orders/speed", track.speed, "rad/s")
        _put(group, "orders/order", track.orders, "1")
        _put(group, "orders/major_axis", track.major_axis, "m")
        _put(group, "orders/separable", track.separable, "1")
        group["orders/major_axis"].attrs["amplitude_kind"] = "zero-to-peak"
