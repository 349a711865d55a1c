"""A simulated drop as what the figures draw."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotordrop.report.first_contact import FirstContact
from rotordrop.report.force import Peak
from rotordrop.report.history import AirGap, BearingHistories, BearingMotions, History, Motion, Role
from rotordrop.report.quantity import Quantity
from rotordrop.report.stress_box import StressBox, stress_box
from rotordrop.simulation.certificate import refined_peak
from rotordrop.simulation.result import DropResult

Array = NDArray[np.float64]


def drop_motion(
    result: DropResult, bearing: int, label: str = "simulated", role: Role = "simulated"
) -> Motion:
    """Motion of the rotor at one bearing."""
    return Motion(label=label, time=result.time, displacement=result.displacement[:, bearing], role=role)


def air_gap(result: DropResult, bearing: int) -> float:
    """Air gap [m] of one bearing, from the motion and the indentation of the first instant."""
    relative = result.displacement[0, bearing] - result.race_displacement[0, bearing]
    return float(np.hypot(relative[0], relative[1]) - result.indentation[0, bearing])


def peak_stress(result: DropResult, bearing: int) -> tuple[float, float]:
    """Peak Hertz stress [Pa] of one bearing and its time [s]."""
    return refined_peak(result.time, result.max_stress[:, bearing])


def drop_motions(result: DropResult) -> tuple[BearingMotions, ...]:
    """Motion of the rotor at every bearing, with its air gap."""
    motions = []
    for index, name in enumerate(result.bearing_names):
        motion = drop_motion(result, index)
        gap = AirGap.of(air_gap(result, index))
        motions.append(BearingMotions(bearing=name, motions=(motion,), air_gap=gap))
    return tuple(motions)


def first_contacts(result: DropResult) -> dict[str, FirstContact]:
    """First contact of every bearing that was touched, from the contact log."""
    found = {}
    for index, name in enumerate(result.bearing_names):
        log = result.contacts.of_bearing(index)
        if not len(log):
            continue
        start, end = float(log.start[0]), float(np.nan_to_num(log.end[0], nan=result.time[-1]))
        radius = np.hypot(result.displacement[:, index, 0], result.displacement[:, index, 1])
        inside = (result.time >= start) & (result.time <= end)
        deepest = int(np.argmax(np.where(inside, radius, -np.inf)))
        found[name] = FirstContact(
            start=start,
            end=end,
            indentation=float(radius[deepest]) - air_gap(result, index),
            deepest_time=float(result.time[deepest]),
        )
    return found


def force_histories(result: DropResult) -> tuple[BearingHistories, ...]:
    """Magnitude of the bearing force at every bearing."""
    return _histories(result, result.bearing_force_magnitude)


def stress_histories(result: DropResult) -> tuple[BearingHistories, ...]:
    """Largest Hertz stress at every bearing."""
    return _histories(result, result.max_stress)


def _histories(result: DropResult, values: Array) -> tuple[BearingHistories, ...]:
    return tuple(
        BearingHistories(
            bearing=name, histories=(History(label="simulated", time=result.time, values=values[:, index]),)
        )
        for index, name in enumerate(result.bearing_names)
    )


def force_peaks(result: DropResult) -> dict[str, Peak]:
    """Peak bearing force and its time at every bearing."""
    peaks = {}
    for index, name in enumerate(result.bearing_names):
        value, time = result.peak_force(index)
        peaks[name] = Peak(time=time, value=value)
    return peaks


def stress_peaks(result: DropResult) -> dict[str, Peak]:
    """Peak Hertz stress and its time at every bearing."""
    peaks = {}
    for index, name in enumerate(result.bearing_names):
        value, time = peak_stress(result, index)
        peaks[name] = Peak(time=time, value=value)
    return peaks


def stress_boxes(result: DropResult, label: str | None = None) -> tuple[StressBox, ...]:
    """Distribution of the Hertz stress at every bearing, with the preload's share if the drop starts free."""
    label = label or Quantity(value=result.initial_speed / (2 * np.pi), kind="frequency", digits=3).text
    boxes = []
    for index, name in enumerate(result.bearing_names):
        free = result.indentation[0, index] < 0.0
        preload = float(result.max_stress[0, index]) if free else None
        boxes.append(stress_box(label, name, result.max_stress[:, index], preload))
    return tuple(boxes)
