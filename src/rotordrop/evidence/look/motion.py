"""From readings to the path of the shaft in its clearance circle: where down is, and the centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.errors import RecordError
from rotordrop.evidence.events import FALLEN_SHARE, fall_accelerations
from rotordrop.record.record import Record
from rotordrop.record.recording import Array
from rotordrop.series import noise_by_differences, runs_of

GRAVITY = 9.81
_SLOWEST_FALL = 0.2
"""Share of gravity with which the fastest end of a dropped rotor falls at least [1]."""

SMOOTHING = 1e-3
"""Window of velocities [s]."""


@dataclass(frozen=True, kw_only=True)
class Path:
    """Where the shaft is in one sensor plane."""

    name: str
    """Plane, by its touchdown bearing or by the names of its channels."""
    position: Array
    """Displacement from the centre of the clearance circle [m], y up, shape (N, 2)."""
    levitated: Array
    """Mean levitated position [m], shape (2,)."""
    gap: float
    """Radius of the clearance circle [m]."""
    noise: float
    """Standard deviation of the readings beside their motion [m]."""

    @property
    def radius(self) -> Array:
        """Distance from the centre [m], shape (N,)."""
        return np.hypot(self.position[:, 0], self.position[:, 1])


@dataclass(frozen=True, kw_only=True)
class Motion:
    """The paths in all planes, and what had to be guessed."""

    time: Array
    rate: float
    paths: tuple[Path, ...]
    floats: NDArray[np.bool_]
    notes: tuple[str, ...]


def motion_of(record: Record, *, gaps: tuple[float | None, ...], angles_known: bool) -> Motion:
    """Find down, centre and gap in every plane.

    Parameters
    ----------
    record : Record
        Readings in metres.
    gaps : tuple of float or None, length P
        Air gap of every plane [m]; None where it has to come from the record: the depth at which the rotor
        rests below where it floated, taken as the centre.
    angles_known : bool
        Whether the angles of the sensors are known. Where not, the fall shows where down is, and which way
        round the plane is seen follows from the orbit before it, taken as running counter-clockwise.

    Raises
    ------
    RecordError
        When nothing falls.
    """
    planes, raw = record.planes, record.motion
    begin, sunk = _first_fall(raw, record.sampling_rate)
    notes: list[str] = []
    rest = np.median(raw[_rest_from(raw, sunk, record) :], axis=0)
    levitated = np.mean(raw[:begin], axis=0)
    paths = []
    for number, plane in enumerate(planes):
        position, low, floated = raw[:, number], rest[number], levitated[number]
        if not angles_known:
            turn = _upright(position[:begin], low - floated)
            position, low, floated = position @ turn.T, turn @ low, turn @ floated
        depth = float(np.hypot(*(low - floated)))
        given = gaps[number]
        gap = given if given is not None else depth
        centre = low + np.array([0.0, gap])
        if given is None:
            centre = floated
            notes.append(
                f"{plane.bearing}: air gap {1e6 * gap:.0f} µm taken from where the rotor floated to where "
                "it lies; give it with --gap"
            )
        paths.append(
            Path(
                name=plane.bearing,
                position=position - centre,
                levitated=floated - centre,
                gap=gap,
                noise=_noise(position),
            )
        )
    if not angles_known:
        notes.append("down is where the rotor fell; counter-clockwise is how it ran before the fall")
    floats = _floating(paths, record.sampling_rate)
    return Motion(
        time=record.time, rate=record.sampling_rate, paths=tuple(paths), floats=floats, notes=tuple(notes)
    )


def _first_fall(raw: Array, rate: float) -> tuple[int, int]:
    """Last sample of the levitated part and first sample by which the rotor lies away from it.

    No gap is known yet: every plane is scaled by how far it strays in all.
    """
    first = max(int(0.01 * rate), 8)
    away = np.linalg.norm(raw - np.mean(raw[:first], axis=0), axis=2)
    reach = np.percentile(away, 98, axis=0)
    usual = np.max(away[:first], axis=0)
    if np.any(reach < 4.0 * usual) or np.any(reach < 5e-6):
        raise RecordError(
            f"nothing falls in the record: the shaft strays by {1e6 * float(np.min(reach)):.3g} µm and moved "
            f"by {1e6 * float(np.max(usual)):.3g} µm in its first 10 ms; check that it begins before the drop"
        )
    moved = np.min(away / reach, axis=1) > FALLEN_SHARE
    sunk = int(np.argmax(moved))
    fastest = max(fall_accelerations(path, far, rate).max() for path, far in zip(away.T, reach, strict=True))
    if fastest < _SLOWEST_FALL * GRAVITY:
        raise RecordError(
            f"nothing falls in the record: the shaft moves away by {1e6 * float(np.max(reach)):.3g} µm, but "
            f"with {fastest:.2g} m/s², a rotor falls with up to {GRAVITY:g} m/s²; a rotor that lies on its "
            "bearings swings like that: give the recording of the drop (a settled tail belongs to "
            "'estimate --tail'), or check unit and sampling rate"
        )
    back = int(np.sqrt(2.0 * float(np.max(reach)) / GRAVITY) * rate) + int(3e-3 * rate)
    return max(sunk - back, first), sunk


def _rest_from(raw: Array, sunk: int, record: Record) -> int:
    """First sample of the part that shows where the rotor lies: the last quarter after the fall."""
    return sunk + max(3 * (len(raw) - sunk) // 4, 1) if len(raw) - sunk > 8 else len(raw) - 1


def _upright(levitated: Array, fall: Array) -> Array:
    """Rotation, or rotation with reflection, that brings the fall down and the levitated orbit forward."""
    down = fall / np.hypot(*fall)
    turn = np.array([[-down[1], down[0]], [-down[0], -down[1]]])
    path = (levitated - np.mean(levitated, axis=0)) @ turn.T
    swept = float(np.sum(path[:-1, 0] * np.diff(path[:, 1]) - path[:-1, 1] * np.diff(path[:, 0])))
    return turn if swept >= 0 else np.diag([-1.0, 1.0]) @ turn


def _noise(position: Array) -> float:
    """Scatter of neighbouring samples about the parabola through them [m]."""
    return noise_by_differences(position, 3)


def _floating(paths: list[Path], rate: float) -> NDArray[np.bool_]:
    """Samples at which all planes stay near where they floated for longer than any flight between impacts."""
    near = np.ones(len(paths[0].position), dtype=np.bool_)
    for path in paths:
        size = max(0.5 * path.gap, 2.0 * float(np.hypot(*path.levitated)) if path.gap else 0.0)
        away = np.hypot(*(path.position - path.levitated).T)
        near &= away < min(size, 0.7 * path.gap)
    flight = 2.0 * np.sqrt(8.0 * max(path.gap for path in paths) / GRAVITY)
    for start, length in zip(*runs_of(near), strict=True):
        if start > 0 and length < flight * rate:
            near[start : start + length] = False
    return near


def slope(values: Array, rate: float) -> Array:
    """Velocity by a straight line through `SMOOTHING` around every sample [m/s], shape of the values."""
    half = max(int(0.5 * SMOOTHING * rate), 1)
    index = np.arange(-half, half + 1)
    weights = -index * rate / float(np.sum(index**2))  # numpy turns the kernel round
    columns = [
        np.convolve(np.pad(column, half, mode="edge"), weights, mode="valid")
        for column in np.atleast_2d(values.T)
    ]
    return np.stack(columns, axis=-1).reshape(values.shape)
