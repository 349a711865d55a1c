"""What a fall under gravity says about how it was read: a late channel, a gain, sensors that saturate.

A released rotor falls by gravity, held back for some milliseconds by what remains of the lift. Remanence
bends to fit much: a recorder that reads a tenth too much only moves the lift that seems to remain, by less
than what is known of it. So a fault is judged by the chi square it takes away beyond all that remanence,
forces and gains within their tolerance can take, to first order (a score test). A common gain of a tenth
shows in no fall. It is a warning, no refusal: a lift that fades slowly or a sensor that lags looks alike, and
an estimate can still follow those.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.evidence.levitated import LevitatedModel
from rotordrop.evidence.quality.finding import Finding, Kind
from rotordrop.record.axes import planar_of
from rotordrop.record.recording import Array
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.evidence.fall import Fall
    from rotordrop.record.record import Record

WRONG_GAIN = 0.08
"""Error of a gain from which on it is named [1]; calibrated sensors have 0.05 at most by API 670."""

SUSPECT = 14.0
"""Chi square of one fault from which on it is named: one good fall in 500 has as much by chance [1]."""

_WITHIN_TOLERANCE = 0.05
"""Error of a gain that calibrated sensors may have [1]: that of the scale factor by API 670."""

_MODEL_ERROR = 3e-4
"""What the model of the fall leaves out, over how far the rotor falls [1]."""

_EXPLAINED = 0.5
"""Share of the chi square beyond noise that a fault has to take away where the fall is not at noise level."""

_LONG = (7e-4, 1.5e-3, 2.5e-3)
"""Delays that are no longer small against the fall, each tried with its own shape [s]."""

_REMEDIES = {
    Kind.LATE_CHANNEL: "record all channels with one clock and one filter, or give the delay of the sensor",
    Kind.WRONG_GAIN: "check sensitivity, gain and unit of the channels, and the sampling rate",
    Kind.TURNED: "check the angles of the sensors at that end",
    Kind.SATURATION: "widen the range of the sensors, or linearise them, then record again",
}


@dataclass(frozen=True, kw_only=True)
class _Fault:
    """A way in which sensors or recorder change a fall, by one number that is 0 without it."""

    kind: Kind
    channels: tuple[str, ...]
    """Name of the fault and what it hits."""
    words: Callable[[float], str]
    """A size in words."""
    slope: Array
    """What it adds to the readings per size, shape (T, S)."""


def read_otherwise(record: Record, levitated: LevitatedModel, fall: Fall) -> list[Finding]:
    """Name what sensors or recorder did to a fall, if that takes away more chi square than chance would."""
    from rotordrop.evidence.fall import linearised

    residual, jacobian = linearised(record, levitated, fall)
    basis = np.linalg.qr(jacobian)[0]
    found = sorted(
        ((*_gain(fault, residual, basis, levitated), fault) for fault in _faults(record, levitated, fall)),
        key=lambda one: -one[0],
    )
    gained, size, best = found[0]
    beyond = float(residual @ residual) - len(residual)
    trusted = _trust(levitated, fall)
    if trusted * gained < max(SUSPECT, _EXPLAINED * trusted * beyond):
        return []
    alike = [one for one in found if one[0] > gained - 0.5 * SUSPECT]
    if any(other.kind == Kind.WRONG_GAIN and abs(value) < _WITHIN_TOLERANCE for _, value, other in alike):
        return []  # a gain that calibrated sensors may have explains as much
    near = [
        other.words(value)
        for _, value, other in alike[1:]
        if (other.kind, other.channels) != (best.kind, best.channels)
    ]
    also = f"; or {', or '.join(near)}" if near else ""
    return [
        Finding(
            kind=best.kind,
            message=f"the fall under gravity looks like that of {best.words(size)}, by "
            f"{(trusted * gained) ** 0.5:.1f} standard deviations{also}",
            remedy=_REMEDIES[best.kind],
            severity="warning",
            channel=", ".join(best.channels),
        )
    ]


def _trust(levitated: LevitatedModel, fall: Fall) -> float:
    """Share of the variance of a reading that is noise; the rest is what the model of the fall leaves out."""
    time = np.linspace(fall.start, fall.end, 50)
    reach = float(np.max(np.abs(fall.predicted(time) - levitated.readings(time))))
    noise = float(np.median(levitated.noise))
    return noise**2 / (noise**2 + (_MODEL_ERROR * reach) ** 2)


def _gain(fault: _Fault, residual: Array, basis: Array, levitated: LevitatedModel) -> tuple[float, float]:
    """Chi square that a fault takes away beyond what everything sought can take, and its size."""
    added = np.zeros(len(residual))
    added[: fault.slope.size] = (fault.slope / np.maximum(levitated.noise, 1e-12)).ravel()
    added -= basis @ (basis.T @ added)
    size = float(added @ residual) / max(float(added @ added), 1e-300)
    return size * float(added @ residual), size


def _faults(record: Record, levitated: LevitatedModel, fall: Fall) -> Iterator[_Fault]:
    time = record.time[(record.time >= fall.start) & (record.time <= fall.end)]
    path = fall.predicted(time) - levitated.readings(time)
    lags = [-np.gradient(path, time, axis=0)]
    lags += [(_shifted(path, time, late) - path) / late for late in _LONG]
    names = record.channel_names
    for alone, name in zip(np.eye(len(names)), names, strict=True):
        for lag, words in zip(lags, (_late_words, *[_long_words] * len(_LONG)), strict=True):
            yield _Fault(kind=Kind.LATE_CHANNEL, channels=(name,), words=words(name), slope=lag * alone)
        yield _Fault(kind=Kind.WRONG_GAIN, channels=(name,), words=_gain_words(name), slope=path * alone)
    yield from _turned(record, path)
    yield _Fault(kind=Kind.WRONG_GAIN, channels=names, words=_gain_words("all channels"), slope=path)
    # L tanh(true / L) is less than true by true³ / (3 L²); the size is the square of the largest over L
    largest = float(np.max(np.abs(record.signals)))
    bent = -((path + levitated.mean) ** 3 - levitated.mean**3) / (3.0 * largest**2)
    yield _Fault(kind=Kind.SATURATION, channels=names, words=_bend_words(largest), slope=bent)


def _turned(record: Record, path: Array) -> Iterator[_Fault]:
    """Sensors of a plane at other angles, all turned alike: they read what goes across their direction."""
    gains, unit = record.gains, record.directions
    places = planar_of(path * gains, record.planes)
    across = np.column_stack([-unit[:, 1], unit[:, 0]])
    for number, plane in enumerate(record.planes):
        slope = np.zeros_like(path)
        columns = list(plane.columns)
        slope[:, columns] = places[:, number] @ across[columns].T / gains[columns]
        yield _Fault(
            kind=Kind.TURNED, channels=plane.names, words=_turn_words(" and ".join(plane.names)), slope=slope
        )


def _turn_words(names: str) -> Callable[[float], str]:
    return lambda size: f"{names} turned by about {np.degrees(np.arctan(size)):+.0f}°"


def _shifted(path: Array, time: Array, late: float) -> Array:
    """The fall (T, S) seen later [s]."""
    return np.column_stack([np.interp(time - late, time, column, left=0.0) for column in path.T])


def _late_words(name: str) -> Callable[[float], str]:
    return lambda size: f"{name} about {abs(size) * 1e3:.2g} ms {'late' if size > 0 else 'early'}"


def _long_words(name: str) -> Callable[[float], str]:
    return lambda size: f"{name} shifted in time by about a millisecond or more"


def _gain_words(name: str) -> Callable[[float], str]:
    return lambda size: f"{name} reading about {1.0 + size:.1f} × what it should"


def _bend_words(largest: float) -> Callable[[float], str]:
    def words(size: float) -> str:
        if size <= 0.0:
            return "sensors that read the more the farther off the rotor is"
        return (
            f"sensors that saturate softly near {format_quantity(largest / float(np.sqrt(size)), 'length')}"
        )

    return words
