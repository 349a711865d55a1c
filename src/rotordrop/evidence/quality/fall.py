"""What a fall under gravity says about how it was read: ends exchanged, a late channel, a gain.

The rotor leaves its levitated shape as its model says. Where the described arrangement explains the fall up
to the first contact at noise level, it is confirmed. Where not, ends exchanged, single channels crossed
between the ends and wrong gains are tried on one and the same part of the fall. If none of them explains it
clearly better, the record does not decide.

Remanence bends to fit much: a recorder that reads a tenth too much only moves the lift that seems to remain,
by less than what is known of it. So a fault of sensors or recorder is judged by the chi square it takes away
beyond all that remanence, forces and gains within their tolerance can take, to first order (a score test). A
common gain of a tenth shows in no fall. It is a warning, no refusal: a lift that fades slowly or a sensor
that lags looks alike, and an estimate can still follow those.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.evidence.events import Beginning, CoarseDrop, find_fall
from rotordrop.evidence.levitated import LevitatedModel
from rotordrop.evidence.quality.finding import Finding, Kind
from rotordrop.known import NINETY, Known
from rotordrop.record.axes import planar_of
from rotordrop.units import format_quantity, percent

if TYPE_CHECKING:
    from rotordrop.evidence.fall import Fall
    from rotordrop.evidence.free_rotor import FreeRotor
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

GOOD_FIT = 2.0
"""Mean square of the residual over the noise up to which the arrangement counts as confirmed [1] (chosen)."""

_BETTER = 3.0
"""Ratio of two such mean squares from which the smaller one decides [1] (chosen)."""
_NEAR_CONTACT = 6e-4
"""The fit should reach this close to the first sudden acceleration [s] (chosen)."""

_POSSIBLE_LIFT = (-0.15, 0.8)
"""Remanent over static lift that a magnetic bearing can have at power-off [1] (chosen)."""

_POSSIBLE_SIDEWAYS = 0.25
"""Horizontal force over static lift that a magnetic bearing can have at power-off [1] (chosen)."""

_AS_FALLING = 1.0
"""Horizontal force over static lift from which on no sensors turned so little that the fall still points down
explain it [1]: the fall is too short to tell, or the rotor touched before."""

_ANY_GAIN = (0.2, 1.8)
"""Range of a gain that nobody knows [1] (chosen)."""

_HOPELESS = 12.0
"""Mean square over the noise that the newest samples, searched once from the release as described, may have
for another reading to be fitted in full [1]: of 43 that then fell freely, to 4, none had more than 4.2."""


@dataclass(frozen=True, kw_only=True)
class _Case:
    """The record read another way."""

    words: str
    kind: Kind
    channels: tuple[str, ...]
    record: Record
    levitated: LevitatedModel


def check_ends(
    record: Record,
    machine: Machine,
    rotor: FreeRotor,
    levitated: LevitatedModel,
    coarse: CoarseDrop,
    own: Fall | None = None,
) -> list[Finding]:
    """Compare the fall with the rotor model: as described, ends exchanged, channels crossed, gain wrong.

    `own` is the fall fitted to the record as described, where it is known already.
    """
    if len({amb.node for amb in machine.ambs}) < 2 or len(record.planes) < 2:
        return [undecided("it takes two AMB planes in the machine file and two sensor planes")]

    def fitted(read: Record, floats: LevitatedModel, until: float | None = None) -> Fall:
        return find_fall(read, rotor, Beginning(coarse=coarse, levitated=floats), until=until)

    own = own or fitted(record, levitated)
    if own.misfit <= GOOD_FIT and own.end >= coarse.contact - _NEAR_CONTACT:
        return _as_described(own, machine)
    cases = _other_cases(record, levitated)
    if not machine.rotor.form_errs:
        cases.append(_any_gain(record, levitated))
    if own.misfit <= GOOD_FIT:
        # the record as described explains the fall up to here: others count that explain it farther
        farther = own.end + _NEAR_CONTACT
        cases = [
            case
            for case in cases
            if own.read_as(case.record, case.levitated, farther).newest_misfit < _HOPELESS
            and fitted(case.record, case.levitated, farther).falls_freely
        ]
        if not cases:
            return _as_described(own, machine)
    grown = [fitted(case.record, case.levitated) for case in cases]
    until = max([own.end, *(fall.end for fall in grown if fall.misfit <= GOOD_FIT)])
    mine = fitted(record, levitated, until).misfit
    if mine <= GOOD_FIT:
        return _as_described(own, machine)
    finals = [
        fitted(case.record, case.levitated, until)
        if case.kind == Kind.WRONG_GAIN or fall.end >= until - _NEAR_CONTACT
        else None
        for case, fall in zip(cases, grown, strict=True)
    ]
    decided = _decide(mine, cases, finals)
    if machine.rotor.form_errs and decided.severity == "stop":
        return [_doubted(decided)]
    if decided.kind not in (Kind.UNDECIDED_ENDS, Kind.WRONG_GAIN):
        return [decided]
    named = read_otherwise(own)
    stop = decided.severity == "stop"
    return [replace(found, severity="stop") if stop else found for found in named] or [decided]


def check_exchanged(
    record: Record, machine: Machine, levitated: LevitatedModel, coarse: CoarseDrop, own: Fall
) -> list[Finding]:
    """Whether a fall that fits as described fits better, beyond chance, with two ends exchanged.

    An exchange has no number of its own that could take up noise: both ways seek the same ones. Of 32 clean
    falls of all rotors none gained more than 0.4 of chi square by it; of two ends alike it is always 0.
    """
    if own.misfit > GOOD_FIT or len({amb.node for amb in machine.ambs}) < 2:
        return []
    chi_square, trusted = _chi_square(own), _trust(levitated, own)
    for case in _other_cases(record, levitated):
        if case.kind != Kind.SWAPPED_ENDS:
            continue
        near = own.read_as(case.record, case.levitated, own.end)
        if trusted * (chi_square - _chi_square(near)) < 0.5 * SUSPECT:
            continue
        begun = Beginning(coarse=coarse, levitated=case.levitated)
        gained = chi_square - _chi_square(find_fall(case.record, own.rotor, begun, until=own.end))
        if trusted * gained > SUSPECT:
            return [
                Finding(
                    kind=Kind.SWAPPED_ENDS,
                    message=f"the fall is that of the rotor model with {case.words}, by "
                    f"{(trusted * gained) ** 0.5:.1f} standard deviations more than as described",
                    remedy="correct the channel map, or the nodes of the sensors in the machine file",
                    severity="warning",
                    channel=", ".join(case.channels),
                )
            ]
    return []


def _chi_square(fall: Fall) -> float:
    """Square of the residual over the noise, with that of what was sought against what was expected."""
    residual = fall.linearised[0]
    return float(residual @ residual)


def _as_described(fall: Fall, machine: Machine) -> list[Finding]:
    """What a fall that fits as described still says of gains, delays and angles."""
    return read_otherwise(fall) or _implausible_lift(fall, machine)


def _implausible_lift(fall: Fall, machine: Machine) -> list[Finding]:
    """A fall that fits only with an impossible remanent lift is too fast or too slow: a gain is wrong."""
    share = fall.remanent_force[:, 1] / fall.rotor.lift
    error = NINETY * np.sqrt(np.diag(fall.covariance)[len(share) : 2 * len(share)])
    surely = np.abs(share - np.mean(_POSSIBLE_LIFT)) - error
    worst = int(np.argmax(surely))
    if surely[worst] <= 0.5 * (_POSSIBLE_LIFT[1] - _POSSIBLE_LIFT[0]):
        return _implausible_sideways(fall, machine)
    return [
        Finding(
            kind=Kind.WRONG_GAIN,
            message=f"the fall fits only with a remanent lift of {fall.remanent_force[worst, 1]:.3g} N at "
            f"AMB {machine.ambs[worst].name}, {percent(share[worst])} of its static lift: the rotor seems to "
            f"fall too {'fast' if share[worst] < 0 else 'slowly'} there",
            remedy="check sensitivity and gain of the sensors at that end, and the sampling rate",
            severity="warning",
        )
    ]


def fell_as_described(record: Record, machine: Machine, fall: Fall) -> bool:
    """Whether gravity has shown, before the first contact, that the sensors look where they are said to.

    Sensors that are exchanged or inverted see gravity pull aside or upwards: the free rotor then explains the
    fall only with a force there as large as the lift that was lost. It need not be explained up to the first
    sudden acceleration, which may be the second contact: what counts is how well the force is known.
    """
    if len({amb.node for amb in machine.ambs}) < 2 or len(record.planes) < 2:
        return False
    if fall.misfit > GOOD_FIT:
        return False
    let_go = fall.rotor.lift != 0.0
    upwards = fall.remanent_force[let_go, 1] / fall.rotor.lift[let_go]
    if np.any(upwards < _POSSIBLE_LIFT[0]) or np.any(upwards > _POSSIBLE_LIFT[1]):
        return False
    aside, error = _sideways(fall)
    return bool(np.all(np.abs(aside) + NINETY * error < 0.5 * _AS_FALLING))


def _sideways(fall: Fall) -> tuple[Array, Array]:
    """Horizontal force at the release over static lift, per magnetic bearing, and its standard error [1]."""
    let_go = fall.rotor.lift != 0.0
    share = fall.remanent_force[let_go, 0] / fall.rotor.lift[let_go]
    return share, np.sqrt(np.diag(fall.covariance)[: len(let_go)][let_go])


def _implausible_sideways(fall: Fall, machine: Machine) -> list[Finding]:
    """A fall that leads aside before anything is touched: the sensors look in other directions.

    In a short fall a force aside and the turning force of the unbalance look alike: what counts is by how
    much the force is larger than a magnet's at least.
    """
    share, error = _sideways(fall)
    worst = int(np.argmax(np.abs(share)))
    if not _POSSIBLE_SIDEWAYS < abs(share[worst]) < _AS_FALLING:
        return []
    if abs(share[worst]) - NINETY * error[worst] < _POSSIBLE_SIDEWAYS:
        return []
    return [
        Finding(
            kind=Kind.TURNED,
            message=f"the fall fits only with {fall.remanent_force[worst, 0]:.3g} N sideways at AMB "
            f"{machine.ambs[worst].name}, {percent(abs(share[worst]))} of its static lift: the rotor seems "
            "to fall aside there before it touches anything",
            remedy="check the angles of the sensors at that end",
            severity="warning",
        )
    ]


def _decide(mine: float, cases: list[_Case], falls: list[Fall | None]) -> Finding:
    tried = [(case, fall) for case, fall in zip(cases, falls, strict=True) if fall is not None]
    best = min(tried, key=lambda pair: pair[1].misfit, default=None)
    if best is None or best[1].misfit * _BETTER > mine or best[1].misfit > _BETTER * GOOD_FIT:
        return undecided(
            f"as described, the fall deviates from the rotor model by {mine**0.5:.1f} × the noise, and no "
            "exchange of channels explains it clearly better"
        )
    case, fall = best
    words = case.words
    if case.kind == Kind.WRONG_GAIN:
        errors = fall.gain_errors
        index = int(np.argmax(np.abs(errors)))
        if abs(errors[index]) < WRONG_GAIN:
            return undecided(
                f"as described, the fall deviates from the rotor model by {mine**0.5:.1f} × the noise"
            )
        name = case.record.channel_names[index]
        words = f"{name} reading {1.0 + errors[index]:.3g} × what the fall under gravity gives"
        case = replace(case, channels=(name,))
    return Finding(
        kind=case.kind,
        message=f"the fall deviates from the rotor model by {mine**0.5:.1f} × the noise as described and by "
        f"{fall.misfit**0.5:.1f} × with {words}",
        remedy="correct the channel map, or node and sensitivity of the sensor in the machine file",
        severity="stop",
        channel=", ".join(case.channels),
    )


def _other_cases(record: Record, levitated: LevitatedModel) -> list[_Case]:
    cases = []
    for first, second in combinations(record.planes, 2):
        if len(first.columns) == len(second.columns):
            pairs = list(zip(first.columns, second.columns, strict=True))
            cases.append(_exchanged(record, levitated, pairs, Kind.SWAPPED_ENDS))
        for pair in product(first.columns, second.columns):
            cases.append(_exchanged(record, levitated, [pair], Kind.SWAPPED_CHANNELS))
    return cases


def _any_gain(record: Record, levitated: LevitatedModel) -> _Case:
    """The record with gains that nobody knows. A beam in place of the rotor falls otherwise than the rotor
    does, and gains would take that up: a good channel of a machine of 60 kg then read -2.3 ×.
    """
    free = tuple(
        sensor.model_copy(update={"gain": Known(value=float(sensor.gain), range=_ANY_GAIN)})
        for sensor in record.sensors
    )
    loose = replace(record, sensors=free)
    return _Case(words="", kind=Kind.WRONG_GAIN, channels=(), record=loose, levitated=levitated)


def _exchanged(record: Record, levitated: LevitatedModel, pairs: list[tuple[int, int]], kind: Kind) -> _Case:
    order = list(range(len(record.sensors)))
    for a, b in pairs:
        order[a], order[b] = b, a
    names = record.channel_names
    return _Case(
        words=" and ".join(f"{names[a]} and {names[b]} exchanged" for a, b in pairs),
        kind=kind,
        channels=tuple(names[i] for pair in pairs for i in pair),
        record=replace(record, signals=record.signals[:, order]),
        levitated=replace(
            levitated,
            mean=levitated.mean[order],
            amplitudes=levitated.amplitudes[:, order],
            noise=levitated.noise[order],
        ),
    )


def _doubted(found: Finding) -> Finding:
    """What no record is refused for: a beam in place of the rotor falls otherwise than the rotor does."""
    why = "; but a beam stands for the rotor, and the deviation may be that of its bending"
    return replace(found, message=found.message + why, severity="warning")


def undecided(why: str) -> Finding:
    """That nothing tells the two ends apart, and why."""
    return Finding(
        kind=Kind.UNDECIDED_ENDS,
        message=f"whether the two ends are exchanged cannot be decided: {why}",
        remedy="make sure by moving one end by hand; check rotor model, sensor nodes and AMB nodes",
        severity="note",
    )


WRONG_GAIN = 0.08
"""Error of a gain from which on it is named [1]; calibrated sensors have 0.05 at most by API 670."""

SUSPECT = 20.0
"""Chi square of one fault from which on it is named [1]: of thirty ways one has as much by chance in 4,000
falls. With 14 two of 577 clean falls were named."""

_WITHIN_TOLERANCE = 0.05
"""Error of a gain that calibrated sensors may have [1]: that of the scale factor by API 670, at the largest
reading too; and tangent of the angle by which they may be mounted otherwise (chosen)."""

_USUAL_DELAY = 5e-5
"""Delay that sensors may have [s]: that of a driver with a bandwidth of 3 kHz."""

_MODEL_ERROR = 3e-4
"""What the model of the fall leaves out, over how far the rotor falls [1]."""

_EXPLAINED = 0.5
"""Share of the chi square beyond noise that a fault has to take away where the fall is not at noise level."""

_BY_CHANCE = 3.0
"""Standard deviations up to which a chi square is that of a fall at noise level [1]."""

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
    long: bool = False
    """Whether it is a delay whose size does not follow from the slope."""


def read_otherwise(fall: Fall) -> list[Finding]:
    """Name what sensors or recorder did to a fall, if that takes away more chi square than chance would."""
    levitated = fall.problem.levitated
    residual, jacobian = fall.linearised
    basis = np.linalg.qr(jacobian)[0]
    found = sorted(
        ((*_gain(fault, residual, basis, levitated), fault) for fault in _faults(fall)),
        key=lambda one: -one[0],
    )
    gained, size, best = found[0]
    beyond = float(residual @ residual) - len(residual)
    everywhere = best.kind == Kind.WRONG_GAIN and len(best.channels) == len(levitated.noise)
    if everywhere and beyond < _BY_CHANCE * (2.0 * len(residual)) ** 0.5:
        beyond = 0.0  # what the model leaves out seldom looks like all channels
    trusted = _trust(levitated, fall)
    if trusted * gained < max(SUSPECT, _EXPLAINED * trusted * beyond):
        return []
    small = {
        Kind.TURNED: _WITHIN_TOLERANCE,
        Kind.LATE_CHANNEL: _USUAL_DELAY,
        Kind.SATURATION: 3.0 * _WITHIN_TOLERANCE,  # a third of it is missing in the largest reading
    }.get(best.kind, 0.0)
    if abs(size) < small and not best.long:
        return []
    alike = [one for one in found if one[0] > gained - 0.5 * SUSPECT]
    if any(other.kind == Kind.WRONG_GAIN and abs(value) < _WITHIN_TOLERANCE for _, value, other in alike):
        return []  # a gain that calibrated sensors may have explains as much
    near = [
        other.words(value)
        for _, value, other in alike[1:]
        if (other.kind, other.channels) != (best.kind, best.channels)
    ]
    # what hits one channel as well as another is as likely something that the model leaves out
    anywhere = any(
        other.kind == best.kind and set(other.channels).isdisjoint(best.channels) for _, _, other in alike
    )
    also = f"; or {', or '.join(near)}" if near else ""
    return [
        Finding(
            kind=best.kind,
            message=f"the fall under gravity looks like that of {best.words(size)}, by "
            f"{(trusted * gained) ** 0.5:.1f} standard deviations{also}",
            remedy=_REMEDIES[best.kind],
            severity="note" if anywhere else "warning",
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


def _faults(fall: Fall) -> Iterator[_Fault]:
    record, levitated, time = fall.problem.record, fall.problem.levitated, fall.problem.time
    path = fall.predicted(time) - levitated.readings(time)
    lags = [-np.gradient(path, time, axis=0)]
    lags += [(_shifted(path, time, late) - path) / late for late in _LONG]
    names = record.channel_names
    for alone, name in zip(np.eye(len(names)), names, strict=True):
        for long, lag in enumerate(lags):
            yield _Fault(
                kind=Kind.LATE_CHANNEL,
                channels=(name,),
                words=_long_words(name) if long else _late_words(name),
                slope=lag * alone,
                long=bool(long),
            )
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
