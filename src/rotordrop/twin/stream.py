"""Force and motion while a drop is still being recorded: filter and smoother over the last flights.

The filter goes on with every stretch of readings that arrives, and the smoother runs back over those that are
kept: what it says of a sample at least one flight old is handed out. The parameters of the machine are held;
what belongs to the drop and to the sensors is estimated.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from operator import attrgetter

import numpy as np
from numpy.typing import ArrayLike

from rotordrop.arrays import Array
from rotordrop.errors import IdentificationError, UsageError
from rotordrop.evidence.events import PowerOff
from rotordrop.evidence.evidence import Evidence, Missing
from rotordrop.evidence.levitated import fit_levitated
from rotordrop.known import NINETY
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.record.record import Record
from rotordrop.record.speed import speed_at_drop
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.rotor.reduction import reduction_for_contact
from rotordrop.rotor.unknowns import Unknown, all_unknowns
from rotordrop.track.calibration import FITTING_NIS, QUICK_SCHEDULE, stage_settings
from rotordrop.track.forces import ForceHistory, force_history
from rotordrop.track.prior import fall_time
from rotordrop.track.problem import DropProblem
from rotordrop.track.smoother import Forward, PassSettings, Smoothed, Storage, forward, smooth
from rotordrop.twin.allowances import MODEL_FORCE_SIGMA, MODEL_STRESS_SIGMA
from rotordrop.twin.problems import COARSE_REACH, drop_problem
from rotordrop.twin.tracked_loads import with_form_error
from rotordrop.units import parse_quantity

FEWEST_MODES = 4
"""Modes of the rotor at least, two rigid ones included; the reach of the coarse basis of the search asks for
more where they lie low. With four a rotor of 5 kg, whose fifth lies at four times its contact frequency, has
the peaks of seven within 0.2 %; one of 60 kg gets six."""
STAGE = replace(QUICK_SCHEDULE[0], substeps=2)
"""That of a calibrated machine in one pass, with fewer integration steps where its fastest mode allows: on a
rotor of 6 t the forces are those of three per 50 µs within 0.04 of their interval; one makes it 9 % less."""
CONTEXT = 400
"""Samples before new ones with which these are looked at for readings that hang or stand out [1] (chosen)."""
GUESSED = ("guess", "default")
HELD = ("air_gap", "support.stiffness", "support.mass", "contact.stiffness")
"""Numbers of a bearing that set its force, which a stream holds and a guess will not do for."""


@dataclass(frozen=True, kw_only=True)
class StreamStep:
    """What is known of some samples of a drop that goes on; N samples, B bearings, C sensors."""

    forces: ForceHistory
    """Force, stress, contact and motion at the bearings, with standard deviations."""
    contact_lower: Array
    contact_upper: Array
    """Ends of the 90 % interval of the normal force of the contact [N], shape (N, B)."""
    at_sensors: Array
    """Displacement of the rotor along every sensor [m], shape (N, C)."""
    state: Array
    """The whole state of the drop model in its reduced coordinates, shape (N, s)."""
    delay: float
    """Age of the oldest sample when the last reading needed for it came [s]."""
    nis: float
    """Mean normalised innovation squared from power-off to the last reading [1], about one where the machine
    fits; above one, all intervals are wider by its root."""

    @property
    def time(self) -> Array:
        """Time from power-off [s], shape (N,)."""
        return self.forces.time

    @property
    def force(self) -> Array:
        """Magnitude of the ball force on the race [N], shape (N, B)."""
        return self.forces.magnitude

    @property
    def force_lower(self) -> Array:
        """Lower end of its 90 % interval [N], shape (N, B)."""
        return np.maximum(self.force - NINETY * self.forces.magnitude_sigma, 0.0)

    @property
    def force_upper(self) -> Array:
        """Upper end of its 90 % interval [N], shape (N, B)."""
        return self.force + NINETY * self.forces.magnitude_sigma

    @property
    def consistent(self) -> bool:
        """Whether the machine fits the readings so far, as the tracked twin judges it."""
        return self.nis <= FITTING_NIS


def track_stream(
    machine: Machine,
    levitated: Record,
    blocks: Iterable[ArrayLike],
    *,
    power_off: float | str | None = None,
    delay: float | str = "25 ms",
    noise_factor: float = 1.0,
) -> Iterator[StreamStep]:
    """Force and motion of a drop while its readings arrive, from readings at most 25 ms younger.

    The lag is a free fall through the widest air gap: what a contact says of the flight before it has then
    been read. The parameters of the machine are held; unbalance, remanent lift, drag of the air, gains,
    offsets and runout are estimated. The speed after power-off is that of the model.

    Parameters
    ----------
    machine : Machine
        The machine, calibrated or with known air gaps, supports and contacts.
    levitated : Record
        The record of the levitated rotor until power-off, with its speed: it gives noise, hum, runout and
        speed. It may end later.
    blocks : iterable of array_like
        Readings behind it as they arrive, each of any number of samples, shape (n, S), with the unit, sensors
        and sampling rate of the record [m]; NaN where one is missing. Each is asked for when what came
        before has been computed.
    power_off : float or str, optional
        When the magnets let go, in the time of the record [s] or a text such as "0.25 s"; its last sample by
        default. A few milliseconds do not matter: the first readings say where the rotor is.
    delay : float or str
        Longest age of a sample when it is handed out [s]; the longer, the less there is to compute.
    noise_factor : float
        Size of the process noise over the usual one [1]. Larger than one where the machine does not fit.

    Yields
    ------
    StreamStep
        The samples that have come of age, in order, and at the end of the blocks all others.

    Raises
    ------
    UsageError
        If the machine is guessed, a block does not fit the record, or the delay is shorter than the lag.
    RecordError
        If the record has no speed or too little of the levitated rotor.
    IdentificationError
        If the filter loses the drop; nothing behind what was handed out before is known then.

    Notes
    -----
    A whole estimate finds the size of its process noise by the likelihood, and tries larger ones where the
    filter loses the drop; a stream keeps to its size, and says by `StreamStep.consistent` whether the machine
    fits. What is left of an error of a held parameter is in no interval but by the innovations.

    Examples
    --------
    >>> from rotordrop import example_machine, example_record_path, read_record, track_stream
    >>> machine = example_machine("lp400")
    >>> record = read_record(example_record_path("lp400_drop_060"), machine)
    >>> track_stream(machine, record, [])
    Traceback (most recent call last):
    rotordrop.errors.UsageError: NDE.air_gap is a guess...
    """
    _refuse_guesses(machine)
    off = float(levitated.time[-1])
    if power_off is not None:
        off = parse_quantity(power_off, "time") if isinstance(power_off, str) else float(power_off)
    if not levitated.time[0] < off <= levitated.time[-1]:
        raise UsageError(
            f"power-off is {off:g} s; the record of the levitated rotor lasts from {levitated.time[0]:g} to "
            f"{levitated.time[-1]:g} s. Expected a time within it, before the blocks"
        )
    longest = parse_quantity(delay, "time") if isinstance(delay, str) else float(delay)
    gap = max(float(bearing.air_gap) for bearing in machine.touchdown_bearings)
    flight, rate = fall_time(machine, gap), levitated.sampling_rate
    lag = math.ceil(flight * rate)
    fresh = math.floor(longest * rate) - lag
    if fresh < 1:
        raise UsageError(
            f"the delay is {1e3 * longest:.3g} ms; a free fall through the air gap of {1e6 * gap:.0f} µm "
            f"lasts {1e3 * flight:.1f} ms, and as long a sample waits. Expected "
            f"{math.ceil(1e4 * (lag + 1) / rate) / 10:.1f} ms or more"
        )
    stream = _Stream(
        machine=machine,
        evidence=_levitated_evidence(machine, levitated, off),
        lag=lag,
        noise_factor=noise_factor,
    )
    return _steps(stream, _checked(blocks, levitated), fresh)


def _refuse_guesses(machine: Machine) -> None:
    if machine.not_estimated:
        raise UsageError(machine.not_estimated)
    for bearing in machine.touchdown_bearings:
        for path in HELD:
            if attrgetter(path)(bearing).status in GUESSED:
                raise UsageError(
                    f"{bearing.name}.{path} is a guess, and a stream holds it; expected a known or estimated "
                    "value. Find it from a recorded drop with calibrate_machine, or give it without a range"
                )


def _levitated_evidence(machine: Machine, record: Record, power_off: float) -> Evidence:
    """What a record says up to a given power-off [s]."""
    turning = abs(speed_at_drop(record, power_off).value)
    instant = PowerOff(
        value=power_off, standard_error=0.0, contact=power_off + fall_time(machine), method="given"
    )
    missing = Missing(reason="the drop has only begun")
    return Evidence(record=record, machine=machine, name=record.name).with_facts(
        power_off=instant,
        levitated=fit_levitated(record, power_off, speed=turning),
        settled_level=missing,
        reach=missing,
    )


def _checked(blocks: Iterable[ArrayLike], record: Record) -> Iterator[Array]:
    """The blocks as arrays (n, S) of numbers."""
    sensors, names = len(record.sensors), ", ".join(sensor.name for sensor in record.sensors)
    for number, given in enumerate(blocks, start=1):
        block = np.asarray(given, dtype=np.float64)
        if block.ndim != 2 or block.shape[1] != sensors:
            raise UsageError(
                f"block {number} has the shape {block.shape}; expected (samples, {sensors}), a column for "
                f"each of {names}"
            )
        if np.isinf(block).any():
            row, column = np.argwhere(np.isinf(block))[0]
            raise UsageError(
                f"block {number} has {block[row, column]} in sample {row + 1} of "
                f"{record.sensors[column].name}; expected readings [m], NaN where one is missing"
            )
        yield block


def _steps(stream: _Stream, blocks: Iterator[Array], fresh: int) -> Iterator[StreamStep]:
    """Hand readings on in stretches of ``fresh`` samples, whatever the size of the blocks."""
    waiting, count = [], 0
    for block in blocks:
        waiting.append(block)
        count += len(block)
        while count >= fresh:
            readings = np.concatenate(waiting)
            waiting, count = [readings[fresh:]], count - fresh
            stream.take(readings[:fresh])
            if (step := stream.smoothed(stream.count - stream.lag)) is not None:
                yield step
    if count:
        stream.take(np.concatenate(waiting))
    if (step := stream.smoothed(stream.count)) is not None:
        yield step


@dataclass(frozen=True, kw_only=True)
class _Stretch:
    """A filtered stretch: its pass from sample ``first`` of the drop on, its own samples from ``since``."""

    first: int
    since: int
    filtered: Forward
    storage: Storage

    @property
    def stop(self) -> int:
        """The sample behind its last."""
        return self.first + len(self.filtered.means)


@dataclass(kw_only=True)
class _Stream:
    """A drop that goes on: the stretches that are kept, and what was handed out."""

    machine: Machine
    evidence: Evidence
    lag: int
    noise_factor: float
    kept: deque[_Stretch] = field(default_factory=deque)
    unused: list[Storage] = field(default_factory=list)
    problem: DropProblem | None = None
    settings: PassSettings | None = None
    given: int = 0
    squares: float = 0.0
    innovations: int = 0

    @property
    def count(self) -> int:
        """Samples filtered."""
        return self.kept[-1].stop if self.kept else 0

    def take(self, readings: Array) -> None:
        """Filter readings (n, S)."""
        record, count = self.evidence.record, len(readings)
        after = record.time[-1] + np.arange(1, count + 1) / record.sampling_rate
        time, signals = np.append(record.time, after), np.vstack([record.signals, readings])
        if self.problem is not None:
            time, signals = time[-count - CONTEXT :], signals[-count - CONTEXT :]
        record = replace(record, time=time, signals=signals, speed=None)
        self.evidence = self.evidence.with_facts(record=record)
        if self.problem is None:
            basis = reduction_for_contact(self.machine, least=FEWEST_MODES, reach=COARSE_REACH)
            model = build_drop_model(self.machine, basis)
            self.problem = drop_problem(model, self.evidence, math.inf, _estimated(model))
            self.settings = stage_settings(self.problem, STAGE, self.noise_factor)
            self._filter(self.problem)
            return
        last = self.kept[-1].filtered.course.problem
        problem = replace(
            self.problem,
            time=np.append(last.time[-1], self.evidence.time[-count:]),
            readings=np.vstack([last.readings[-1], self.evidence.readings(math.inf)[-count:]]),
            speed=np.full(count + 1, np.nan),
        )
        self._filter(problem)

    def _filter(self, problem: DropProblem) -> None:
        assert self.settings is not None
        storage = self.unused.pop() if self.unused else Storage()
        before = self.kept[-1] if self.kept else None
        filtered = forward(
            problem, self.settings, after=None if before is None else before.filtered, storage=storage
        )
        if filtered.done < len(problem.time):
            raise IdentificationError(
                f"the filter lost the drop {1e3 * problem.time[filtered.done]:.1f} ms after power-off, and "
                "nothing behind what was handed out before is known. Calibrate the machine anew, or estimate "
                "the whole record with estimate_drop"
            )
        seen = np.isfinite(filtered.innovation_variances)
        self.squares += float(np.sum(filtered.innovations[seen] ** 2 / filtered.innovation_variances[seen]))
        self.innovations += int(np.count_nonzero(seen))
        since = 0 if before is None else before.stop
        self.kept.append(_Stretch(first=max(since - 1, 0), since=since, filtered=filtered, storage=storage))

    def smoothed(self, stop: int) -> StreamStep | None:
        """What the smoother says of the samples before one that were not handed out yet."""
        if stop <= self.given:
            return None
        found: list[tuple[Array, Array, Array]] = []
        score = information = None
        for stretch in reversed(self.kept):
            # behind the last sample that is wanted only what later readings say is carried back
            for begin, end, watched in (
                (max(stop, stretch.since), stretch.stop, None),
                (
                    max(self.given, stretch.since),
                    min(stop, stretch.stop),
                    stretch.filtered.course.problem.watched,
                ),
            ):
                if begin >= end:
                    continue
                part = begin - stretch.first, end - stretch.first
                back = smooth(
                    stretch.filtered,
                    score,
                    information,
                    watched=watched,
                    kept=(),
                    storage=stretch.storage,
                    part=part,
                    carried=watched is None,
                )
                score, information = back.score_0, back.information_0
                if watched is not None:
                    inside, problem = slice(*part), stretch.filtered.course.problem
                    found.insert(0, (problem.time[inside], back.means[inside], back.watched[inside]))
        time, means, blocks = (np.concatenate(arrays) for arrays in zip(*found, strict=True))
        age = float(self.kept[-1].filtered.course.problem.time[-1] - time[0])
        self.given = stop
        while self.kept[0].stop <= stop and len(self.kept) > 1:
            self.unused.append(self.kept.popleft().storage)
        return self._step(replace(back, means=means, watched=blocks), time, age)

    def _step(self, smoothed: Smoothed, time: Array, delay: float) -> StreamStep:
        assert self.problem is not None
        problem, nis = replace(self.problem, time=time), self.squares / max(self.innovations, 1)
        widening = math.sqrt(max(nis, 1.0))
        forces = with_form_error(force_history(problem, smoothed), self.machine.rotor.force_sigma)
        forces = replace(
            forces,
            magnitude_sigma=np.hypot(widening * forces.magnitude_sigma, MODEL_FORCE_SIGMA * forces.magnitude),
            stress_sigma=np.hypot(widening * forces.stress_sigma, MODEL_STRESS_SIGMA * forces.stress),
            indentation_sigma=widening * forces.indentation_sigma,
            displacement_sigma=widening * forces.displacement_sigma,
        )
        lower, upper = _contact_interval(problem, forces)
        state = smoothed.means[:, : problem.n_dynamic]
        return StreamStep(
            forces=forces,
            contact_lower=lower,
            contact_upper=upper,
            at_sensors=state @ problem.sensor_rows.T,
            state=state,
            delay=delay,
            nis=nis,
        )


def _estimated(model: DropModel) -> tuple[Unknown, ...]:
    """What a stream estimates: what belongs to the drop, what sensors do beyond gain, offset and runout."""
    return tuple(
        one
        for one in all_unknowns(model)
        if one.scope == "drop" or one.parameter.lag or one.parameter.seen is not None
    )


def _contact_interval(problem: DropProblem, forces: ForceHistory) -> tuple[Array, Array]:
    """Ends of the 90 % interval of the normal force [N] by that of the indentation, shape (N, B)."""
    bearing = problem.model.parameters.bearing
    half = NINETY * forces.indentation_sigma

    def elastic(depth: Array) -> Array:
        return np.asarray(
            bearing[:, L.CONTACT_STIFFNESS] * np.maximum(depth, 0.0) ** bearing[:, L.CONTACT_EXPONENT]
        )

    now = elastic(forces.indentation)
    return (
        np.maximum(forces.contact_force + elastic(forces.indentation - half) - now, 0.0),
        forces.contact_force + elastic(forces.indentation + half) - now,
    )
