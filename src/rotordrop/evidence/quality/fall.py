"""What a fall under gravity says about how it was read: ends exchanged, a late channel, a gain.

The rotor leaves its levitated shape as its model says. Where the described arrangement explains the fall up
to the first contact at noise level, it is confirmed. Where not, ends exchanged and single channels crossed
between the ends are tried on one and the same part of the fall. If none of them explains it clearly better,
the record does not decide.

Remanence bends to fit much: a recorder that reads a tenth too much only moves the lift that seems to remain,
by less than what is known of it. So a fault of sensors or recorder is judged by the chi square it takes away
beyond all that remanence, forces and gains within their tolerance can take, to first order (a score test). A
common gain of a tenth shows in no fall. It is a warning, no refusal: a lift that fades slowly or a sensor
that lags looks alike, and an estimate can still follow those.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.evidence.events import Beginning, CoarseDrop, find_fall
from rotordrop.evidence.levitated import LevitatedModel
from rotordrop.evidence.quality.finding import Finding, found
from rotordrop.known import NINETY
from rotordrop.record.axes import planar_of
from rotordrop.units import format_quantity

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

_POSSIBLE_LIFT = (-0.4, 0.8)
"""Remanent over static lift that a magnetic bearing can have at power-off [1]: what a fall expects of it, and
three standard deviations. With -0.15 one sound record of seven was told that its sensors are wrong."""

_POSSIBLE_SIDEWAYS = 0.6
"""Horizontal force over static lift that a magnetic bearing can have at power-off [1], by the same rule."""

_AS_FALLING = 1.0
"""Horizontal force over static lift from which on no sensors turned so little that the fall still points down
explain it [1]: the fall is too short to tell, or the rotor touched before."""

_HOPELESS = 12.0
"""Mean square over the noise that the newest samples, searched once from the release as described, may have
for another reading to be fitted in full [1]: of 43 that then fell freely, to 4, none had more than 4.2."""


@dataclass(frozen=True, kw_only=True)
class _Case:
    """The record read with channels exchanged."""

    kind: str
    words: str
    channels: tuple[str, ...]
    record: Record
    levitated: LevitatedModel

    def fitted(self, rotor: FreeRotor, coarse: CoarseDrop, until: float | None = None) -> Fall:
        """The fall of the rotor, seen by it."""
        return find_fall(self.record, rotor, Beginning(coarse=coarse, levitated=self.levitated), until=until)


def check_ends(
    record: Record,
    machine: Machine,
    rotor: FreeRotor,
    levitated: LevitatedModel,
    coarse: CoarseDrop,
    own: Fall | None = None,
) -> list[Finding]:
    """Compare the fall with the rotor model: as described, ends exchanged, channels crossed.

    `own` is the fall fitted to the record as described, where it is known already.
    """
    if len({amb.node for amb in machine.ambs}) < 2 or len(record.planes) < 2:
        return [found("undecided", why="it takes two AMB planes in the machine file and two sensor planes")]
    described = _Case(kind="", words="", channels=(), record=record, levitated=levitated)
    own = own or described.fitted(rotor, coarse)
    if own.misfit <= GOOD_FIT and own.end >= coarse.contact - _NEAR_CONTACT:
        return _as_described(own, machine)
    cases = _other_cases(record, levitated)
    if own.misfit <= GOOD_FIT:
        # the record as described explains the fall up to here: others count that explain it farther
        farther = own.end + _NEAR_CONTACT
        cases = [
            case
            for case in cases
            if own.read_as(case.record, case.levitated, farther).newest_misfit < _HOPELESS
            and case.fitted(rotor, coarse, farther).falls_freely
        ]
    grown = [case.fitted(rotor, coarse) for case in cases]
    until = max([own.end, *(fall.end for fall in grown if fall.misfit <= GOOD_FIT)])
    mine = described.fitted(rotor, coarse, until).misfit if cases else own.misfit
    if mine <= GOOD_FIT:
        return _as_described(own, machine)
    tried = [
        (case.fitted(rotor, coarse, until).misfit, number)
        for number, (case, fall) in enumerate(zip(cases, grown, strict=True))
        if fall.end >= until - _NEAR_CONTACT
    ]
    other, best = min(tried, default=(np.inf, 0))
    if other * _BETTER > mine or other > _BETTER * GOOD_FIT:
        words = f"as described, the fall deviates from the rotor model by {mine**0.5:.1f} × the noise"
        why = f"{words}, and no exchange of channels explains it clearly better"
        return read_otherwise(own) or [found("undecided", why=why)]
    # a beam in place of the rotor falls otherwise than the rotor does: no record is refused for that
    beam = "; but a beam stands for the rotor, and the deviation may be that of its bending"
    return [
        found(
            "exchanged",
            kind=cases[best].kind,
            channel=cases[best].channels,
            severity="warning" if machine.rotor.form_errs else None,
            mine=mine**0.5,
            other=other**0.5,
            words=cases[best].words,
            doubt=beam if machine.rotor.form_errs else "",
        )
    ]


def check_exchanged(
    record: Record, machine: Machine, levitated: LevitatedModel, coarse: CoarseDrop, own: Fall
) -> list[Finding]:
    """Whether a fall that fits as described fits better, beyond chance, with two ends or channels exchanged.

    An exchange has no number of its own that could take up noise: both ways seek the same ones. Of 56 clean
    falls of all rotors none gained more than 1.2 of chi square by that of two ends (0 where both are alike),
    of 33 none more than 0.5 by that of two channels.
    """
    if own.misfit > GOOD_FIT or len({amb.node for amb in machine.ambs}) < 2:
        return []
    chi_square, trusted = _chi_square(own), _trust(levitated, own)
    cases = _other_cases(record, levitated)
    near = [_chi_square(own.read_as(case.record, case.levitated, own.end)) for case in cases]
    if not cases or trusted * (chi_square - min(near)) < 0.5 * SUSPECT:
        return []
    case = cases[int(np.argmin(near))]
    gained = trusted * (chi_square - _chi_square(case.fitted(own.rotor, coarse, own.end)))
    if gained <= SUSPECT:
        return []
    said = {"words": case.words, "sure": gained**0.5}
    return [found("exchanged-likelier", said, kind=case.kind, channel=case.channels)]


def _chi_square(fall: Fall) -> float:
    """Square of the residual over the noise, with that of what was sought against what was expected."""
    residual = fall.linearised[0]
    return float(residual @ residual)


def _as_described(fall: Fall, machine: Machine) -> list[Finding]:
    """What a fall that fits as described says of gains, delays and angles, or of an impossible force.

    A fall that fits only with an impossible lift is too fast or too slow: a gain is wrong. One that leads
    aside before anything is touched has sensors that look in other directions; in a short fall a force aside
    and the turning force of the unbalance look alike, so it counts by how much it is surely too large.
    """
    named = read_otherwise(fall)
    if named:
        return named
    share = fall.remanent_force[:, 1] / fall.rotor.lift
    error = NINETY * np.sqrt(np.diag(fall.covariance)[len(share) : 2 * len(share)])
    surely = np.abs(share - np.mean(_POSSIBLE_LIFT)) - error
    worst = int(np.argmax(surely))
    if surely[worst] > 0.5 * (_POSSIBLE_LIFT[1] - _POSSIBLE_LIFT[0]):
        how = "fast" if share[worst] < 0 else "slowly"
        return [found("lift", magnet=machine.ambs[worst].name, how=how)]
    aside, error = _sideways(fall)
    size = np.abs(aside)
    worst = int(np.argmax(size))
    if size[worst] >= _AS_FALLING or size[worst] - NINETY * error[worst] < _POSSIBLE_SIDEWAYS:
        return []
    force, magnet = fall.remanent_force[worst, 0], machine.ambs[worst].name
    return [found("sideways", force=force, magnet=magnet, share=size[worst])]


def fell_as_described(record: Record, machine: Machine, fall: Fall) -> bool:
    """Whether gravity has shown, before the first contact, that the sensors look where they are said to.

    Sensors that are exchanged or inverted see gravity pull aside or upwards: the free rotor then explains the
    fall only with a force there as large as the lift that was lost. It need not be explained up to the first
    sudden acceleration, which may be the second contact: what counts is how well the force is known.
    """
    if len({amb.node for amb in machine.ambs}) < 2 or len(record.planes) < 2 or fall.misfit > GOOD_FIT:
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


def _other_cases(record: Record, levitated: LevitatedModel) -> list[_Case]:
    cases = []
    for first, second in combinations(record.planes, 2):
        if len(first.columns) == len(second.columns):
            pairs = list(zip(first.columns, second.columns, strict=True))
            cases.append(_exchanged(record, levitated, pairs, "swapped ends"))
        for pair in product(first.columns, second.columns):
            cases.append(_exchanged(record, levitated, [pair], "swapped channels"))
    return cases


def _exchanged(record: Record, levitated: LevitatedModel, pairs: list[tuple[int, int]], kind: str) -> _Case:
    order = list(range(len(record.sensors)))
    for a, b in pairs:
        order[a], order[b] = b, a
    names = record.channel_names
    amplitudes, noise = levitated.amplitudes[:, order], levitated.noise[order]
    return _Case(
        kind=kind,
        words=" and ".join(f"{names[a]} and {names[b]} exchanged" for a, b in pairs),
        channels=tuple(names[i] for pair in pairs for i in pair),
        record=replace(record, signals=record.signals[:, order]),
        levitated=replace(levitated, mean=levitated.mean[order], amplitudes=amplitudes, noise=noise),
    )


WRONG_GAIN = 0.08
"""Error of a gain from which on it is named [1]; calibrated sensors have 0.05 at most by API 670."""

SUSPECT = 20.0
"""Chi square of one fault from which on it is named [1]: of thirty ways one has as much by chance in 4,000
falls. With 14 two of 577 clean falls were named."""

_WITHIN_TOLERANCE = 0.05
"""Error of a gain that calibrated sensors may have [1]: that of the scale factor by API 670, at the largest
reading too; and tangent of the angle by which they may be mounted otherwise (chosen)."""

_SMALL = {"turned": _WITHIN_TOLERANCE, "late": 5e-5, "saturated": 3.0 * _WITHIN_TOLERANCE, "gain": 0.0}
"""Sizes below which a fault is none: tangent of an angle [1]; delay [s], that of a driver with a bandwidth of
3 kHz; square of the largest reading over where sensors saturate [1], a third of which is missing in it."""

_MODEL_ERROR = 3e-4
"""What the model of the fall leaves out, over how far the rotor falls [1]."""

_EXPLAINED = 0.5
"""Share of the chi square beyond noise that a fault has to take away where the fall is not at noise level."""

_BY_CHANCE = 3.0
"""Standard deviations up to which a chi square is that of a fall at noise level [1]."""

_LONG = (7e-4, 1.5e-3, 2.5e-3)
"""Delays that are no longer small against the fall, each tried with its own shape [s]."""


@dataclass(frozen=True, kw_only=True)
class _Fault:
    """A way in which sensors or recorder change a fall, by one number that is 0 without it."""

    row: str
    """Its row in the table of findings."""
    channels: tuple[str, ...]
    """What it hits."""
    slope: Array
    """What it adds to the readings per size, shape (T, S)."""
    long: bool = False
    """Whether it is a delay whose size does not follow from the slope."""

    def words(self, size: float, largest: float) -> str:
        """A size in words, beside the largest reading [m]."""
        names = " and ".join(self.channels) if len(self.channels) < 3 else "all channels"
        if self.row == "late":
            moved = f"about {abs(size) * 1e3:.2g} ms {'late' if size > 0 else 'early'}"
            return f"{names} {'shifted in time by about a millisecond or more' if self.long else moved}"
        if self.row == "turned":
            return f"{names} turned by about {np.degrees(np.arctan(size)):+.0f}°"
        if self.row == "gain":
            return f"{names} reading too {'much' if size > 0.0 else 'little'}"
        if size <= 0.0:
            return "sensors that read the more the farther off the rotor is"
        return f"sensors that saturate softly near {format_quantity(largest / size**0.5, 'length')}"


def read_otherwise(fall: Fall) -> list[Finding]:
    """Name what sensors or recorder did to a fall, if that takes away more chi square than chance would."""
    levitated = fall.problem.levitated
    residual, jacobian = fall.linearised
    basis = np.linalg.qr(jacobian)[0]
    sizes = [(*_gain(fault, residual, basis, levitated), fault) for fault in _faults(fall)]
    tried = sorted(sizes, key=lambda one: -one[0])
    gained, size, best = tried[0]
    beyond = float(residual @ residual) - len(residual)
    everywhere = best.row == "gain" and len(best.channels) == len(levitated.noise)
    if everywhere and beyond < _BY_CHANCE * (2.0 * len(residual)) ** 0.5:
        beyond = 0.0  # what the model leaves out seldom looks like all channels
    trusted = _trust(levitated, fall)
    if trusted * gained < max(SUSPECT, _EXPLAINED * trusted * beyond):
        return []
    if abs(size) < _SMALL[best.row] and not best.long:
        return []
    alike = [one for one in tried if one[0] > gained - 0.5 * SUSPECT]
    if any(other.row == "gain" and abs(value) < _WITHIN_TOLERANCE for _, value, other in alike):
        return []  # a gain that calibrated sensors may have explains as much
    largest = float(np.max(np.abs(fall.problem.record.signals)))
    near = dict.fromkeys(
        other.words(value, largest)
        for _, value, other in alike[1:]
        if (other.row, other.channels) != (best.row, best.channels)
    )
    # what hits one channel as well as another is as likely something that the model leaves out
    anywhere = any(
        other.row == best.row and set(other.channels).isdisjoint(best.channels) for _, _, other in alike
    )
    return [
        found(
            best.row,
            channel=best.channels,
            severity="note" if anywhere else None,
            words=best.words(size, largest),
            sure=(trusted * gained) ** 0.5,
            also=f"; or {', or '.join(near)}" if near else "",
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
    for late in _LONG:
        shifted = [np.interp(time - late, time, column, left=0.0) for column in path.T]
        lags.append((np.column_stack(shifted) - path) / late)
    names = record.channel_names
    for alone, name in zip(np.eye(len(names)), names, strict=True):
        for long, lag in enumerate(lags):
            yield _Fault(row="late", channels=(name,), slope=lag * alone, long=bool(long))
        yield _Fault(row="gain", channels=(name,), slope=path * alone)
    # sensors of a plane at other angles, all turned alike, read what goes across their direction
    gains, unit = record.gains, record.directions
    places = planar_of(path * gains, record.planes)
    across = np.column_stack([-unit[:, 1], unit[:, 0]])
    for number, plane in enumerate(record.planes):
        slope, columns = np.zeros_like(path), list(plane.columns)
        slope[:, columns] = places[:, number] @ across[columns].T / gains[columns]
        yield _Fault(row="turned", channels=plane.names, slope=slope)
    yield _Fault(row="gain", channels=names, slope=path)
    # L tanh(true / L) is less than true by true³ / (3 L²); the size is the square of the largest over L
    largest = float(np.max(np.abs(record.signals)))
    bent = -((path + levitated.mean) ** 3 - levitated.mean**3) / (3.0 * largest**2)
    yield _Fault(row="saturated", channels=names, slope=bent)
