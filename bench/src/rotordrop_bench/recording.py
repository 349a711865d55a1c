"""Make a recording of a drop of a hidden machine together with its truth, and write both apart."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop._version import __version__
from rotordrop.errors import SimulationError
from rotordrop.files import digest_of_file, make_folder, write_json, write_text
from rotordrop.machine import Machine
from rotordrop.machine.saving import save_machine
from rotordrop.record.record import Record, as_recording
from rotordrop.simulate.case import DropCase, UnbalanceJump
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.result import DropResult
from rotordrop_bench.event import LARGEST_JITTER, DropConditions, HiddenMachine, drop_conditions, stream
from rotordrop_bench.sensor_chain import (
    SensorChain,
    SensorErrors,
    along_sensors,
    drawn_errors,
    fitted_to,
    oversampling,
    readings,
    speed_readings,
)
from rotordrop_bench.settled import settled_coordinates, swinging_amplitudes
from rotordrop_bench.true_values import housing_motion, true_motion, true_values
from rotordrop_bench.violations import CHAIN, SENSORS

TRUE_TOLERANCE = 1e-8
"""Tolerance of the true simulation, that of the reference [1]."""
TAIL_START, TAIL_DURATION, TAIL_RATE = 54.0, 3.0, 1000.0
"""When the settled tail begins, how long it is [s], and its samples per second [Hz]; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class SyntheticDrop:
    """A simulated recording with everything that is true about it."""

    record: Record
    """The recording, with the sensors as the owner knows them; time 0 is the trigger."""
    tail: Record | None
    """The settled tail at standstill."""
    truth: dict[str, Any]
    """True parameters, sensor errors, forces and stresses, ready for JSON."""
    result: DropResult = field(repr=False)
    """The simulated drop itself, with true forces and motions on the clock of the true power-off."""

    def reached(self, latest: float) -> bool:
        """Whether the rotor touched every bearing within this time of power-off [s]."""
        first = [self.result.contacts.of_bearing(b).start for b in range(len(self.result.bearing_names))]
        return all(len(start) > 0 and float(np.min(start)) <= latest for start in first)


def synthesize_drop(
    hidden: HiddenMachine,
    speed: float,
    seed: int,
    *,
    sensor_chain: SensorChain | None = None,
    duration: float = 0.3,
    before: float = 0.25,
    tail: bool = True,
    conditions: DropConditions | None = None,
    tolerance: float = TRUE_TOLERANCE,
    name: str = "synthetic",
) -> SyntheticDrop:
    """Simulate a drop of a hidden machine and record it.

    The speed is that at power-off [rad/s], ``duration`` and ``before`` the length of the recording after and
    before the trigger [s], the tolerance that of the true simulation [1]. The seed is that of start, noise
    and trigger; the sensor errors belong to the machine. Conditions take the place of a drawn start.
    """
    wrong = hidden.violations.given.get("sensors", {})
    chain = fitted_to(sensor_chain or SensorChain(), hidden.known)
    chain = replace(chain, **{key: wrong[key] for key in CHAIN if key in wrong})
    conditions = conditions or drop_conditions(hidden, speed, seed)
    case = DropCase(
        speed=conditions.speed,
        duration=duration + 2.0 * LARGEST_JITTER,
        start=conditions.start,
        tolerance=tolerance,
    )
    result = true_drop(hidden, case)
    errors = _true_errors(hidden, chain)
    record = _record(hidden, result, conditions, chain, errors, seed, before, duration, name)
    held = hidden.violations["magnets.stays_on"]  # a rotor with one end held does not settle
    return SyntheticDrop(
        record=record,
        tail=_tail(hidden, chain, errors, seed, name) if tail and not held else None,
        truth=true_values(hidden, result, conditions, chain, errors, name),
        result=result,
    )


def true_drop(hidden: HiddenMachine, case: DropCase) -> DropResult:
    """The drop of a hidden machine, with an unbalance that comes at its time or at the first contact."""
    node, amount, phase, time = (
        hidden.violations[f"unbalance_jump.{key}"] for key in ("node", "amount", "phase", "time")
    )
    if node is not None:
        if time is None:
            plain = simulate_drop(hidden.model, case)
            time = float(next(iter(plain.time[np.any(plain.indentation > 0.0, axis=1)]), np.inf))
        case = replace(case, jump=UnbalanceJump(node=node, amount=amount, phase=phase, time=time))
    result = simulate_drop(hidden.model, case)
    if not result.finished:
        raise SimulationError(
            f"the drop of the hidden machine {hidden.machine.name!r} stopped at {result.time[-1]:.6g} s of "
            f"{case.duration:g} s; a violation is too extreme for it: give a milder one"
        )
    return result


def _true_errors(hidden: HiddenMachine, chain: SensorChain) -> SensorErrors:
    """Errors of the sensors of a hidden machine: those of its chain, and what is violated beside."""
    count = len(hidden.machine.sensors)
    errors = drawn_errors(chain, count, stream(hidden.seed, "sensors"))
    wrong = {key: np.full(count, hidden.violations[f"sensors.{key}"]) for key in SENSORS}
    random = stream(hidden.seed, "cross axis")
    wrong["cross_axis"] *= random.uniform(0.5, 1.0, count) * random.choice([-1.0, 1.0], count)
    wrong["curvature"] /= wrong.pop("curvature_at") ** 2
    return replace(errors, **wrong)


def _record(
    hidden: HiddenMachine,
    result: DropResult,
    conditions: DropConditions,
    chain: SensorChain,
    errors: SensorErrors,
    seed: int,
    before: float,
    duration: float,
    name: str,
) -> Record:
    dense, rate = oversampling(chain, errors), chain.sampling_rate
    start, stop = -round(before * rate), round(duration * rate)
    time = np.arange(start * dense, stop * dense + 1) / (rate * dense)
    true_time = (1.0 + chain.clock_error) * (time - conditions.jitter)
    amplitudes, angle, speed = true_motion(hidden, result, conditions, true_time)
    along = along_sensors(hidden.model, errors, amplitudes, housing_motion(result, true_time))
    signals = readings(along, time, angle, chain, errors, stream(seed, "noise"))
    time, speed = time[::dense], speed[::dense]
    if chain.speed_delay > 0.0:
        speed = np.interp(time - chain.speed_delay, time, speed)
    when, read = speed_readings(time, speed, chain, stream(seed, "tacho"))
    return Record(
        time=time,
        signals=signals,
        sensors=hidden.known.sensors,
        sampling_rate=rate,
        speed=np.interp(time, when, read),
        speed_time=when,
        speed_readings=read,
        metadata=_metadata(hidden, name),
    )


def _tail(hidden: HiddenMachine, chain: SensorChain, errors: SensorErrors, seed: int, name: str) -> Record:
    random, swinging = stream(seed, "tail"), stream(seed, "swing")
    count = len(hidden.machine.touchdown_bearings)
    at = float(random.uniform(0.0, 2.0 * np.pi))
    rest = settled_coordinates(hidden.model, at)
    amplitude = np.exp(swinging.uniform(np.log(0.003), np.log(0.1), count))
    phase, decay = swinging.uniform(0.0, 2.0 * np.pi, count), float(swinging.uniform(2.0, 20.0))
    slow = replace(chain, sampling_rate=TAIL_RATE, anti_alias_frequency=None)
    time = np.arange(round(TAIL_DURATION * TAIL_RATE)) / TAIL_RATE
    true_time = (1.0 + chain.clock_error) * time
    amplitudes = swinging_amplitudes(hidden.model, rest, amplitude, phase, decay, true_time)
    angle = np.full(len(time), at)
    supports = rest[hidden.model.layout.support].reshape(1, -1, 2)
    along = along_sensors(hidden.model, errors, amplitudes, supports)
    # a swing of some hertz is no matter for a lag that a drop survives
    prompt = replace(errors, time_constant=np.zeros(len(errors.gain)))
    signals = readings(along, TAIL_START + time, angle, slow, prompt, random)
    return Record(
        time=TAIL_START + time,
        signals=signals,
        sensors=hidden.known.sensors,
        sampling_rate=TAIL_RATE,
        metadata=_metadata(hidden, f"{name}_tail") | {"event": "settled tail, standstill"},
    )


def _metadata(hidden: HiddenMachine, name: str) -> dict[str, str]:
    return {
        "machine": hidden.known.name,
        "name": name,
        "origin": f"simulated by rotordrop {__version__}, not measured",
        "event": "AMB power off",
    }


def drop_path(folder: Path, name: str) -> Path:
    """Where an estimator finds a drop."""
    return folder / "drops" / name


def truth_path(folder: Path, name: str) -> Path:
    """Where the truth of a drop stands."""
    return folder / "truth" / f"{name}.json"


def write_drop(drop: SyntheticDrop, known: Machine, folder: str | Path, name: str, **more: Any) -> Path:
    """Write a drop into a folder, its truth last, and give the folder for an estimator.

    That is ``drops/NAME`` with ``machine.toml``, ``record.csv`` and ``tail.csv``; ``truth/NAME.json`` gets
    ``more`` too.
    """
    place, truth = drop_path(Path(folder), name), truth_path(Path(folder), name)
    make_folder(place)
    make_folder(truth.parent)
    save_machine(known, place / "machine.toml")
    write_record(drop.record, place / "record.csv")
    if drop.tail is not None:
        write_record(drop.tail, place / "tail.csv")
    sums = {"record.csv": digest_of_file(place / "record.csv")}
    write_json(truth, {**drop.truth, **more, "name": name, "record_sha256": sums}, sealed=True)
    return place


def write_record(record: Record, path: Path) -> None:
    """Write a record as text, displacements in micrometres; a speed that is read less often is held."""
    recording = as_recording(replace(record, marks=None, notes=(), warnings=()))
    clock = recording.channels[0].time
    step = float(np.median(np.diff(clock)))
    # two digits beyond the step, so that the even clock is found again on reading
    names, columns, formats = ["Time [s]"], [clock], [f"%.{max(int(np.ceil(-np.log10(step))) + 2, 3)}f"]
    for channel in recording.channels:
        length = channel.unit == "m"
        held = np.clip(np.searchsorted(channel.time, clock, side="right") - 1, 0, len(channel.time) - 1)
        names.append(f"{channel.name} [{'um' if length else channel.unit}]")
        columns.append(channel.values[held] * (1e6 if length else 1.0))
        formats.append("%.3f" if length else "%.4f")
    lines = [";".join(formats) % tuple(row) for row in np.column_stack(columns)]
    header = [f"# {key}: {value}" for key, value in recording.metadata.items()]
    write_text(path, "\n".join([*header, ";".join(names), *lines]) + "\n")
