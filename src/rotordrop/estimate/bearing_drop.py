"""What a drop did at one touchdown bearing, whoever found it: histories with bands, peaks, impacts.

A followed record, a replayed one and a simulated drop end here, so that pages and documents know one form.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.evidence.impacts import after_flights, lasting_from
from rotordrop.known import Known
from rotordrop.series import refined_peak
from rotordrop.severity.statistics import Statistics, stress_statistics

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.simulate.result import DropResult

Role: TypeAlias = Literal["measured", "simulated", "simulated, lower gap", "estimated", "cross-check"]

WIDE = 0.05
"""Half a 90 % interval of a peak over the peak from which it is said why [1] (chosen)."""
LATE = (0.15, 0.2)
"""Stretch of the late mean force [s from power-off]."""


class Origin(StrEnum):
    """Who found the loads of a bearing."""

    TWIN = "tracked twin"
    CROSS_CHECK = "independent cross-check"
    REPLAY = "open-loop replay"
    SIMULATION = "simulation"


@dataclass(frozen=True, kw_only=True)
class History:
    """A quantity against time."""

    label: str
    """Name in the legend."""
    time: Array
    """Time from power-off [s], shape (T,)."""
    values: Array
    """Values in SI units, shape (T,)."""
    role: Role = "simulated"
    """Where the history comes from; decides colour and line."""

    def between(self, start: float, end: float) -> History:
        """The part between two times [s]."""
        inside = (self.time >= start) & (self.time <= end)
        return replace(self, time=self.time[inside], values=self.values[inside])


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Movement of the rotor in the plane of one bearing."""

    label: str
    """Name in the legend."""
    time: Array
    """Time from power-off [s], shape (T,)."""
    displacement: Array
    """Displacement (x, y) from the bearing centre [m], shape (T, 2)."""
    role: Role = "simulated"
    """Where the motion comes from; decides colour and line."""

    @property
    def horizontal(self) -> History:
        """Displacement in x."""
        return self._history(self.displacement[:, 0])

    @property
    def vertical(self) -> History:
        """Displacement in y."""
        return self._history(self.displacement[:, 1])

    @property
    def radial(self) -> History:
        """Distance from the centre."""
        return self._history(np.hypot(self.displacement[:, 0], self.displacement[:, 1]))

    def _history(self, values: Array) -> History:
        return History(label=self.label, time=self.time, values=np.asarray(values), role=self.role)


@dataclass(frozen=True, kw_only=True)
class Band:
    """Lower and upper limit of a history, shape (T,) each, time [s] from power-off."""

    time: Array
    lower: Array
    upper: Array
    label: str = "90 % interval"

    def between(self, start: float, end: float) -> Band:
        """The part between two times [s]."""
        inside = (self.time >= start) & (self.time <= end)
        return replace(self, time=self.time[inside], lower=self.lower[inside], upper=self.upper[inside])


@dataclass(frozen=True, kw_only=True)
class AirGap:
    """Lower and upper limit of the air gap of one bearing [m]; equal where there is one value only."""

    lower: float
    upper: float

    @classmethod
    def of(cls, value: float) -> AirGap:
        """A gap known as one value."""
        return cls(lower=value, upper=value)


@dataclass(frozen=True, kw_only=True)
class Peak:
    """Highest point of a history: the number with its interval, when it was [s], and who found it."""

    known: Known
    time: float
    origin: Origin
    time_interval_90: tuple[float, float] | None = None
    """Interval that holds the time of the true peak with 90 % probability [s], where one is known."""

    @property
    def value(self) -> float:
        """The peak in SI units."""
        return self.known.value

    @property
    def interval_90(self) -> tuple[float, float] | None:
        """Interval that holds the true peak with 90 % probability, where one is known."""
        return self.known.interval_90

    @property
    def is_wide(self) -> bool:
        """Whether it is known so badly that it is said why."""
        return self.known.high - self.known.low > 2.0 * WIDE * abs(self.value)

    def as_json(self) -> dict[str, Any]:
        """What is known of the number and of its time, ready for JSON."""
        between = self.time_interval_90
        when = {"time_s": self.time} | ({} if between is None else {"time_interval_90_s": list(between)})
        return self.known.as_json() | when


@dataclass(frozen=True, kw_only=True)
class Impact:
    """One impact at one bearing; numbers found from a record carry their 90 % intervals."""

    start: float
    end: float
    azimuth: float
    """Direction of the contact normal at the peak [rad ccw from +x], between −π and π."""
    peak_time: float
    """Times [s] from power-off; the end is NaN where the contact still lasts."""
    peak_force: Known
    impulse: Known
    dissipated_energy: Known
    """Peak bearing force [N]; normal impulse [N s] and energy lost [J] of the contact."""


@dataclass(frozen=True, kw_only=True)
class FirstContact:
    """Times and depth of the first contact at one bearing."""

    start: float
    end: float
    """Beginning t1 and end t2 of the first contact [s] from power-off."""
    indentation: float
    """Largest displacement beyond the air gap during it [m]."""


@dataclass(frozen=True, kw_only=True)
class BearingMotions:
    """Motions of the rotor at one bearing, or in one plane of sensors, where no more is known."""

    name: str
    """Name of the bearing."""
    motions: tuple[Motion, ...]
    """Motions of the rotor, the measured one first where there is a record."""
    air_gap: AirGap | None = None
    """Limits of the air gap."""
    at_gap_limits: tuple[Motion, ...] = ()
    """Motions simulated with the lower and the upper air gap (Neisi 2020, Fig. 14); may be empty."""


@dataclass(frozen=True, kw_only=True)
class BearingDrop(BearingMotions):
    """Everything one touchdown bearing went through in a drop."""

    force: History
    stress: History
    """Magnitude of the ball force on the race [N] and largest Hertz stress at the inner race [Pa]."""
    peak_force: Peak
    peak_stress: Peak
    """Highest points of the two histories."""
    force_band: Band | None = None
    stress_band: Band | None = None
    """Their 90 % bands."""
    force_vector: Array | None = None
    """Ball force on the race (x, y) [N] at the times of the force, where its direction is known, shape (T,
    2)."""
    preload_stress: float | None = None
    """Stress of the preload alone [Pa]; None where there is none, or no time shows it."""
    values: Mapping[str, Known] = field(default_factory=dict)
    """Further numbers by the field names of the published document, means and parameters."""
    missing: Mapping[str, str] = field(default_factory=dict)
    """Numbers that are not stated, by field name, and why."""
    impacts: tuple[Impact, ...] = ()
    """Every contact in the order of its beginning; `after_flight` marks those that are impacts."""
    count_interval_90: tuple[int, int] | None = None
    """Interval that holds the number of impacts with 90 % probability, where one is known."""
    contact_from_interval_90: tuple[float, float] | None = None
    """The same of `contact_from` [s]."""
    largest: Known | None = None
    """Largest distance of the rotor from the centre [m], where its error is known."""
    first_contact: FirstContact | None = None
    """None where the bearing was not touched."""

    @property
    def numbers(self) -> dict[str, Known | Peak]:
        """Every number by the field names of the published document."""
        return {"peak_force_N": self.peak_force, "peak_stress_Pa": self.peak_stress, **self.values}

    @property
    def statistics(self) -> Statistics:
        """Distribution of the stress (Neisi 2020, Table 5); its maximum is the stated peak."""
        found = stress_statistics(
            self.stress.values, time=self.stress.time, preload_stress=self.preload_stress
        )
        return found.model_copy(update={"maximum": self.peak_stress.value})

    @property
    def motion(self) -> Motion:
        """The motion that the loads belong to: estimated or simulated, else as measured."""
        own = [motion for motion in self.motions if motion.role in ("estimated", "simulated")]
        return (own or self.motions)[0]

    @cached_property
    def after_flight(self) -> tuple[bool, ...]:
        """For every contact, whether it ends a flight, and is an impact by the rule that a look goes by."""
        if self.air_gap is None:
            return (False,) * len(self.impacts)
        begun, ended = (np.array([getattr(one, of) for one in self.impacts]) for of in ("start", "end"))
        gap = 0.5 * (self.air_gap.lower + self.air_gap.upper)
        return tuple(after_flights(begun, ended, gap).tolist())

    @property
    def touched(self) -> Array:
        """When each impact began [s], shape (K,)."""
        begun = [one.start for one, after in zip(self.impacts, self.after_flight, strict=True) if after]
        return np.array(begun)

    @property
    def contact_from(self) -> float | None:
        """When the last impact began, the rotor in contact from there on [s]; None where it was not."""
        return lasting_from(self.touched, float(self.force.time[-1]))


def when_largest(history: History, band: Band, doubt: float) -> tuple[float, float]:
    """Interval of the time of a peak [s], 90 %: from the first to the last value that may be the largest.

    Each value has the error that its band shows, independent of that of the peak; ``doubt`` is half the
    interval of the instant from which the times count [s].
    """
    at = int(np.argmax(history.values))
    half = band.upper - history.values
    times = history.time[history.values + np.hypot(half, half[at]) >= history.values[at]]
    moment = history.time[at]
    return (
        float(moment - math.hypot(moment - times[0], doubt)),
        float(moment + math.hypot(times[-1] - moment, doubt)),
    )


def deepest(motion: Motion, start: float, end: float, gap: float) -> FirstContact:
    """First contact between two times [s]: how far beyond the gap [m] the rotor went."""
    radius = motion.radial
    begun = float(np.interp(start, radius.time, radius.values))  # a contact may lie between two samples
    reached = float(np.max(radius.between(start, end).values, initial=begun))
    return FirstContact(start=start, end=end, indentation=reached - gap)


def simulated_bearings(result: DropResult, machine: Machine | None = None) -> tuple[BearingDrop, ...]:
    """What happened at every bearing in a simulated drop; its numbers have no intervals.

    The machine tells which races nothing but their weight presses on the balls.
    """
    return tuple(_simulated_bearing(result, b, machine) for b in range(len(result.bearing_names)))


def _simulated_bearing(result: DropResult, b: int, machine: Machine | None) -> BearingDrop:
    name, log = result.bearing_names[b], result.contacts.of_bearing(b)
    gap = simulated_gap(result, b)
    motion = Motion(label="simulated", time=result.time, displacement=result.displacement[:, b])
    force = History(label="simulated", time=result.time, values=result.bearing_force_magnitude[:, b])
    stress = History(label="simulated", time=result.time, values=result.max_stress[:, b])
    first = None
    if len(log):
        end = float(np.nan_to_num(log.end[0], nan=result.time[-1]))
        first = deepest(motion, float(log.start[0]), end, gap)
    held = machine is None or numbers_of(machine.touchdown_bearings[b]).held
    free = held and result.indentation[0, b] < 0.0  # it shows what the preload alone does
    impacts = []
    for i in range(len(log)):
        begun, ended = np.searchsorted(force.time, (log.start[i], np.nan_to_num(log.end[i], nan=np.inf)))
        around = slice(max(int(begun) - 1, 0), int(ended) + 2)
        peak, moment = refined_peak(force.time[around], force.values[around])
        impacts.append(
            Impact(
                start=float(log.start[i]),
                end=float(log.end[i]),
                azimuth=float(np.angle(np.exp(1j * log.azimuth[i]))),
                peak_time=moment,
                peak_force=Known(value=peak, status="determined", unit="N"),
                impulse=Known(value=float(log.impulse[i]), status="determined", unit="N s"),
                dissipated_energy=Known(value=float(log.dissipated_energy[i]), status="determined", unit="J"),
            )
        )
    return BearingDrop(
        name=name,
        motions=(motion,),
        air_gap=AirGap.of(gap),
        force=force,
        force_vector=result.bearing_force[:, b],
        stress=stress,
        preload_stress=float(result.max_stress[0, b]) if free else None,
        peak_force=highest(force, "N", Origin.SIMULATION),
        peak_stress=highest(stress, "Pa", Origin.SIMULATION),
        values=mean_values(force, stress),
        impacts=tuple(impacts),
        first_contact=first,
    )


def simulated_gap(result: DropResult, b: int) -> float:
    """Air gap [m] of one bearing, from the motion and the indentation of the first instant."""
    relative = result.displacement[0, b] - result.race_displacement[0, b]
    return float(np.hypot(relative[0], relative[1]) - result.indentation[0, b])


def highest(history: History, unit: str, origin: Origin) -> Peak:
    """Highest point of a history between its samples, without an interval."""
    value, time = refined_peak(history.time, history.values)
    return Peak(known=Known(value=value, status="determined", unit=unit), time=time, origin=origin)


def mean_values(force: History, stress: History) -> dict[str, Known]:
    """Mean stress over the drop, and the late mean force where the history reaches its end."""
    values = {"mean_stress_Pa": Known(value=float(np.mean(stress.values)), status="determined", unit="Pa")}
    if late_mean := mean_late(force):
        values["mean_force_0p15_0p2_N"] = Known(value=late_mean, status="determined", unit="N")
    return values


def mean_late(force: History) -> float | None:
    """Mean of a history over the late stretch; None where it ends more than 1 ms before."""
    if force.time[-1] < LATE[1] - 1e-3:
        return None
    late = force.between(*LATE).values
    return float(np.mean(late)) if len(late) else None
