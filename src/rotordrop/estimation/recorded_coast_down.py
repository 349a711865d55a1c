"""A recorded coast-down made ready for the frequency analysis: power-off, centre, planes, speed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import RecordError
from rotordrop.machine import Machine
from rotordrop.measurement.axes import along_sensors, planar_of, sensor_planes
from rotordrop.measurement.events import find_drop_instant
from rotordrop.measurement.record import Record
from rotordrop.model.assembly import build_rotor_fe
from rotordrop.model.statics import bearing_load_shares
from rotordrop.spectrum.coast_down import RACES_SPUN_UP, SHORTEST_LAW, CoastDownSignal
from rotordrop.spectrum.coast_down_law import fit_drag
from rotordrop.spectrum.machine_candidates import swing_ranges
from rotordrop.spectrum.speed_profile import SpeedProfile, fit_speed_profile

Array = NDArray[np.float64]

REST = 1.0
"""Length of the end of a record [s] whose distance from the centre gives the air-gap window."""
LARGEST_SHARE = 0.3
"""How far the settled radius may be from the machine's gap, as a share of it, to replace it."""


def recorded_coast_down(machine: Machine, record: Record) -> CoastDownSignal:
    """Cut a record at power-off, centre it on the levitated rotor, and resolve x and y in each sensor plane.

    The air-gap window of a plane is the distance of the settled rotor from the centre less what contact, race
    and support give way under the weight; the machine's own gap where the rotor has not settled.

    Parameters
    ----------
    machine : Machine
        The machine.
    record : Record
        Begins while the rotor floats.
    """
    planes = sensor_planes(record.sensors)
    off = float(find_drop_instant(record, machine))
    moved = planar_of(along_sensors(record.signals, record.sensors), planes)
    before = record.time < off
    if not np.any(before):
        raise RecordError(
            "the record begins at power-off: the centre of the rotor is not known; give an earlier start"
        )
    centred = moved[~before] - np.mean(moved[before], axis=0)
    rest = max(1, int(REST * record.sampling_rate))
    gaps, sags = _known_gaps(machine), _sags(machine)
    signals, windows = {}, {}
    for index, plane in enumerate(planes):
        signals[plane.bearing] = np.ascontiguousarray(centred[:, index])
        radius = float(np.median(np.hypot(*centred[-rest:, index].T)))
        windows[plane.bearing] = _window(radius - sags[plane.bearing], gaps[plane.bearing])
    time, speed = _speed(record, off)
    return CoastDownSignal(
        planes=signals,
        air_gap=windows,
        sampling_rate=record.sampling_rate,
        start_time=float(record.time[~before][0]) - off,
        profile=_profile(time, speed),
        speed_time=time,
        speed=speed,
        recorded=True,
    )


def _known_gaps(machine: Machine) -> dict[str, float]:
    return {bearing.name: float(bearing.air_gap) for bearing in machine.touchdown_bearings}


def _sags(machine: Machine) -> dict[str, float]:
    gaps = _known_gaps(machine)
    return {swing.bearing: swing.length - gaps[swing.bearing] for swing in swing_ranges(machine)}


def _window(settled: float, known: float) -> float:
    return settled if abs(settled - known) <= LARGEST_SHARE * known else known


def _speed(record: Record, off: float) -> tuple[Array | None, Array | None]:
    # A speed given by hand says from where the rotor fell, not how it slowed down.
    measured = record.measured_speed
    return (None, None) if measured is None else (measured[0] - off, measured[1])


def _profile(time: Array | None, speed: Array | None) -> SpeedProfile | None:
    if time is None or speed is None:
        return None
    return fit_speed_profile(time, speed, power_off=0.0)


def with_recorded_drag(machine: Machine, signal: CoastDownSignal) -> Machine:
    """Give a machine the drag that a recorded coast-down shows.

    The linear and the quadratic part of the fit go to the air, the dry part to the races: their drag
    coefficient becomes the one whose torque under the weight stops the rotor as recorded. The exponential
    time constant, which would count the same drag twice, is left alone; it does not act in a coast-down once
    these values are there.

    Parameters
    ----------
    machine : Machine
        The machine.
    signal : CoastDownSignal
        Its coast-down, long enough for a fit.
    """
    if signal.speed_time is None or signal.speed is None:
        raise RecordError(
            "the record has no speed, so it shows no drag; give a record with a speed channel, or a drag "
            "under [speed] in the machine file"
        )
    least = RACES_SPUN_UP + SHORTEST_LAW
    known = float(signal.speed_time[-1])
    if known < least:
        raise RecordError(
            f"the speed is recorded for {known:.2f} s after power-off; at least {least:g} s are needed to "
            "tell its drag. Give a longer record, or a drag under [speed] in the machine file"
        )
    drag = fit_drag(signal.speed_time, signal.speed, start=RACES_SPUN_UP)
    shares = bearing_load_shares(machine)
    lever = sum(
        float(share) * 0.5 * float(bearing.bearing.pitch_diameter)
        for bearing, share in zip(machine.touchdown_bearings, shares, strict=True)
    )
    races = sum(float(bearing.race.inertia) for bearing in machine.touchdown_bearings)
    turning = build_rotor_fe(machine).polar_inertia + races
    values = {
        "speed.aero_linear": drag.linear.value * turning,
        "speed.aero_quadratic": drag.quadratic.value * turning,
    }
    for bearing in machine.touchdown_bearings:
        values[f"{bearing.name}.race.drag_coefficient"] = drag.constant.value * turning / lever
    return machine.with_values(values)
