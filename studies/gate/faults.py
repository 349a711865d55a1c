"""Kinds of semantic fault of a record, its tail or its machine file, each of a fixed size.

A place in time, a channel and a sign are drawn; the sizes stand in `FAULTS`. Nothing here knows how the gate
finds a fault.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, lfilter, sosfilt

from rotordrop.arrays import Array
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.record.record import Record
from rotordrop_bench.rotors import bench_rotor

Random = np.random.Generator
Change = Callable[[Array, Record, Random], Array | None]


@dataclass(frozen=True, kw_only=True)
class Given:
    """What is handed to the gate."""

    record: Record
    tail: Record
    machine: Machine


Make = Callable[[Given, Random], Given]


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A way to spoil what is given, and the names under which it is found rightly."""

    make: Make
    names: tuple[str, ...]


def _of(record: Record, signals: Array) -> Record:
    return replace(record, signals=np.ascontiguousarray(signals))


def readings(change: Change, *, tail: bool = False) -> Make:
    """Change the readings of the record, and alike those of the tail where `tail` says so."""

    def make(given: Given, random: Random) -> Given:
        seed = int(random.integers(2**32))
        done = []
        for one in (given.record, given.tail)[: 1 + tail]:
            signals = one.signals.copy()
            changed = change(signals, one, np.random.default_rng(seed))
            done.append(_of(one, signals if changed is None else changed))
        return replace(given, record=done[0], tail=done[1] if tail else given.tail)

    return make


def of_tail(change: Change) -> Make:
    """Change the readings of the tail alone."""

    def make(given: Given, random: Random) -> Given:
        signals = given.tail.signals.copy()
        changed = change(signals, given.tail, random)
        return replace(given, tail=_of(given.tail, signals if changed is None else changed))

    return make


def _column(random: Random, signals: Array) -> int:
    return int(random.integers(0, signals.shape[1]))


def _place(record: Record, random: Random, count: int, since: float = 0.0, until: float = 0.2) -> int:
    """A sample between two record times, from which `count` samples are there."""
    first, last = np.searchsorted(record.time, [since, until])
    return int(random.integers(first, min(last, len(record.time) - count - 1)))


def block(count: int, value: float | None, *, every: bool = False) -> Make:
    """A block of one channel, or of all, holds a value, or its first reading for None."""

    def change(s: Array, record: Record, random: Random) -> None:
        at, column = _place(record, random, count), _column(random, s)
        where = slice(None) if every else column
        s[at : at + count, where] = s[at, where] if value is None else value

    return readings(change)


def dead(noise: float) -> Make:
    def change(s: Array, record: Record, random: Random) -> None:
        column = _column(random, s)
        s[:, column] = s[0, column] + random.normal(0.0, noise, len(s))

    return readings(change)


def clipped(share: float, noise: float) -> Make:
    def change(s: Array, record: Record, random: Random) -> Array:
        level = np.mean(s[record.time < -0.02], axis=0)
        reach = share * np.max(np.abs(s - level), axis=0)
        return np.asarray(np.clip(s, level - reach, level + reach) + random.normal(0.0, noise, s.shape))

    return readings(change)


def saturated(level: float) -> Make:
    """Soft saturation at a level over the largest reading."""

    def make(given: Given, random: Random) -> Given:
        limit = level * float(np.max(np.abs(given.record.signals)))
        bent = [_of(one, limit * np.tanh(one.signals / limit)) for one in (given.record, given.tail)]
        return replace(given, record=bent[0], tail=bent[1])

    return make


def spikes(count: int, size: float) -> Make:
    def change(s: Array, record: Record, random: Random) -> None:
        at = random.choice(np.arange(10, len(s) - 10), count, replace=False)
        s[at, _column(random, s)] += size * random.choice([-1.0, 1.0], count)

    return readings(change)


def bridged(length: float, *, every: bool = False) -> Make:
    def change(s: Array, record: Record, random: Random) -> None:
        count = int(length * record.sampling_rate)
        at, column = _place(record, random, count + 1), _column(random, s)
        for c in range(s.shape[1]) if every else [column]:
            s[at : at + count, c] = np.linspace(s[at, c], s[at + count, c], count)

    return readings(change)


def low_pass(corner: float) -> Make:
    def change(s: Array, record: Record, random: Random) -> Array:
        level = np.mean(s[:200], axis=0)
        sections = butter(2, corner, fs=record.sampling_rate, output="sos")
        return np.asarray(level + sosfilt(sections, s - level, axis=0))

    return readings(change)


def coupled(corner: float) -> Make:
    def change(s: Array, record: Record, random: Random) -> Array:
        upper, lower = butter(1, corner, btype="high", fs=record.sampling_rate)
        return np.asarray(lfilter(upper, lower, s - np.mean(s[:50], axis=0), axis=0))

    return readings(change, tail=True)


def hum(mains: float, size: float) -> Make:
    return readings(lambda s, r, _: s + size * np.sin(2 * np.pi * mains * r.time)[:, None], tail=True)


def drift(size: float, *, every: bool = False) -> Make:
    """A reading wanders by a size per second."""

    def change(s: Array, record: Record, random: Random) -> None:
        where = slice(None) if every else _column(random, s)
        moved = size * (record.time - record.time[0])
        s[:, where] += moved[:, None] if every else moved

    return readings(change)


def noisy(size: float, *, every: bool = False) -> Make:
    def change(s: Array, record: Record, random: Random) -> None:
        where = slice(None) if every else slice(column := _column(random, s), column + 1)
        s[:, where] += random.normal(0.0, size, s[:, where].shape)

    return readings(change)


def lost(count: int | float, since: float, until: float) -> Make:
    """All channels lose samples (an integer) or seconds; the clock runs on."""

    def make(given: Given, random: Random) -> Given:
        record = given.record
        number = count if isinstance(count, int) else round(count * record.sampling_rate)
        at = _place(record, random, number, since, until)
        left = len(record.time) - number
        signals = np.delete(record.signals, np.s_[at : at + number], axis=0)
        speed = None if record.speed is None else record.speed[:left]
        return replace(given, record=replace(record, signals=signals, time=record.time[:left], speed=speed))

    return make


def twice(length: float) -> Make:
    def change(s: Array, record: Record, random: Random) -> Array:
        count = int(length * record.sampling_rate)
        at = _place(record, random, 2 * count)
        return np.vstack([s[: at + count], s[at:-count]])

    return readings(change)


def exchanged_blocks(count: int, *, every: bool) -> Make:
    """Two neighbouring blocks change places."""

    def change(s: Array, record: Record, random: Random) -> None:
        at, column = _place(record, random, 2 * count), _column(random, s)
        where = slice(None) if every else column
        first, second = s[at : at + count, where].copy(), s[at + count : at + 2 * count, where].copy()
        s[at : at + count, where], s[at + count : at + 2 * count, where] = second, first

    return readings(change)


def jittered_readings(share: float) -> Make:
    """Readings taken a share of an interval (rms) early or late under an even clock."""

    def change(s: Array, record: Record, random: Random) -> Array:
        when = record.time + share / record.sampling_rate * random.normal(0.0, 1.0, len(s))
        return np.column_stack([np.interp(when, record.time, column) for column in s.T])

    return readings(change)


def clock(change: Callable[[Array, Record, Random], Array], rate: float = 1.0) -> Make:
    """Change the times of the readings, and the rate by a factor; the speed keeps to the new clock."""

    def make(given: Given, random: Random) -> Given:
        record = given.record
        time = change(record.time.copy(), record, random)
        assert record.speed_time is not None
        moved = np.interp(record.speed_time, record.time, time)
        spoilt = replace(record, time=time, sampling_rate=record.sampling_rate * rate, speed_time=moved)
        return replace(given, record=spoilt)

    return make


def faster(factor: float) -> Make:
    return clock(lambda t, r, _: t[0] + (t - t[0]) / factor, factor)


def _uneven(time: Array, record: Record, random: Random) -> Array:
    return np.asarray(time + 0.1 / record.sampling_rate * random.normal(0.0, 1.0, len(time)))


def stepped(samples: int) -> Make:
    """The clock jumps by a number of samples, back for a negative one."""

    def change(time: Array, record: Record, random: Random) -> Array:
        time[_place(record, random, 10) :] += samples / record.sampling_rate
        return time

    return clock(change)


def late(by: float, *, end: bool = False) -> Make:
    """One channel, or those of one end, are late [s]; the record begins as much later."""

    def change(s: Array, record: Record, random: Random) -> None:
        column = _column(random, s)
        node = record.sensors[column].node
        columns = [c for c, one in enumerate(record.sensors) if one.node == node] if end else [column]
        for c in columns:
            s[:, c] = np.interp(record.time - by, record.time, s[:, c])

    def make(given: Given, random: Random) -> Given:
        spoilt = readings(change)(given, random)
        return replace(spoilt, record=spoilt.record.window(float(given.record.time[0]) + by, np.inf))

    return make


def speed(change: Callable[[Array, Record], Array] | None) -> Make:
    """Change the speed readings; None takes them away."""

    def make(given: Given, random: Random) -> Given:
        record, when = given.record, given.record.speed_time
        if change is None:
            return replace(given, record=replace(record, speed=None, speed_time=None, speed_readings=None))
        assert record.speed_readings is not None and when is not None
        read = change(record.speed_readings.copy(), record)
        spoilt = replace(record, speed_readings=read, speed=np.interp(record.time, when, read))
        return replace(given, record=spoilt)

    return make


def _tacho_lost(read: Array, record: Record) -> Array:
    read[5::7] *= 0.5
    return read


def _dies(read: Array, record: Record) -> Array:
    assert record.speed_time is not None
    return np.where(record.speed_time < 0.0, read, 0.0)


def wired(order: Callable[[Sequence[int]], Sequence[int]], *, tail: bool = True) -> Make:
    """Exchange channels; `order` gets the nodes of the sensors and names the columns that are read."""

    def change(s: Array, record: Record, random: Random) -> Array:
        return s[:, list(order([one.node for one in record.sensors]))]

    return readings(change, tail=True) if tail else of_tail(change)


def _axes(nodes: Sequence[int], planes: int) -> list[int]:
    chosen, order = list(dict.fromkeys(nodes))[:planes], list(range(len(nodes)))
    for node in chosen:
        own = [i for i, one in enumerate(nodes) if one == node]
        for a, b in zip(own, own[::-1], strict=True):
            order[a] = b
    return order


def _ends(nodes: Sequence[int], channels: int = 2) -> list[int]:
    first, last = ([i for i, one in enumerate(nodes) if one == node] for node in (nodes[0], max(nodes[:4])))
    order = list(range(len(nodes)))
    for a, b in list(zip(first, last, strict=True))[:channels]:
        order[a], order[b] = b, a
    return order


def inverted(*, every: bool = False) -> Make:
    return scaled(-1.0, which="all" if every else "one")


def scaled(factor: float, which: str) -> Make:
    """One channel, those of one end or all read a factor of what they should, tail included."""

    def change(s: Array, record: Record, random: Random) -> Array:
        column = _column(random, s)
        nodes = np.array([one.node for one in record.sensors])
        hit = {"one": np.arange(len(nodes)) == column, "end": nodes == nodes[column], "all": nodes > 0}
        return np.asarray(s * np.where(hit[which], factor, 1.0))

    return readings(change, tail=True)


def turned(degrees: float) -> Make:
    """The sensors of one end look in other directions."""

    def change(s: Array, record: Record, random: Random) -> None:
        node = record.sensors[_column(random, s)].node
        own = [i for i, one in enumerate(record.sensors) if one.node == node]
        turn = np.radians(degrees) * random.choice([-1.0, 1.0])
        c, sine = np.cos(turn), np.sin(turn)
        s[:, own] = s[:, own] @ np.array([[c, sine], [-sine, c]])

    return readings(change, tail=True)


def part(since: float, until: float) -> Make:
    return lambda given, _: replace(given, record=given.record.window(since, until))


def second_drop(given: Given, random: Random) -> Given:
    record = given.record
    once = record.signals[record.time < 0.35]
    count = int(0.1 * record.sampling_rate)
    ramp = np.linspace(0.0, 1.0, count)[:, None]
    first = record.signals[0]
    lift = once[-1] * (1.0 - ramp) + first * ramp + random.normal(0.0, 0.4e-6, (count, once.shape[1]))
    again = record.signals + random.normal(0.0, 0.2e-6, record.signals.shape)
    signals = np.vstack([once, lift, again])
    assert record.speed_readings is not None
    time = record.time[0] + np.arange(len(signals)) / record.sampling_rate
    read = np.full(len(time[::200]), record.speed_readings[0])
    held = np.full(len(time), read[0])
    twice = replace(
        record, signals=signals, time=time, speed=held, speed_time=time[::200], speed_readings=read
    )
    return replace(given, record=twice)


def _moving_tail(given: Given, random: Random) -> Given:
    """The tail is the record from 0.02 s on, in which the rotor still moves."""
    moving = given.record.window(0.02, 0.6)
    return replace(given, tail=replace(moving, speed=None, speed_time=None, speed_readings=None))


def _levitated_tail(given: Given, random: Random) -> Given:
    floating = given.record.window(-np.inf, -0.01)
    return replace(given, tail=replace(floating, speed=None, speed_time=None, speed_readings=None))


def tail_offset(size: float, *, every: bool = False) -> Make:
    def change(s: Array, record: Record, random: Random) -> None:
        column = _column(random, s)
        s[:, slice(None) if every else column] += size * random.choice([-1.0, 1.0])

    return of_tail(change)


def file(change: Callable[[Machine], Machine]) -> Make:
    """A wrong machine file; the sensors of the record are those of the file."""

    def make(given: Given, random: Random) -> Given:
        machine = change(given.machine)
        names = [one.name for one in given.record.sensors]
        columns = [names.index(one.name) for one in machine.sensors]
        record, tail = (
            replace(one, signals=one.signals[:, columns].copy(), sensors=machine.sensors)
            for one in (given.record, given.tail)
        )
        return Given(record=record, tail=tail, machine=machine)

    return make


def _ambs_exchanged(machine: Machine) -> Machine:
    first, *_, last = machine.ambs
    moved = [first.model_copy(update={"node": last.node}), last.model_copy(update={"node": first.node})]
    return machine.model_copy(update={"ambs": tuple(moved)})


def _sensors_exchanged(machine: Machine) -> Machine:
    nodes = [one.node for one in machine.sensors]
    swap = {min(nodes): max(nodes), max(nodes): min(nodes)}
    sensors = [one.model_copy(update={"node": swap.get(one.node, one.node)}) for one in machine.sensors]
    return machine.model_copy(update={"sensors": tuple(sensors)})


def _no_disc(machine: Machine) -> Machine:
    """Without the heaviest disc."""
    discs = sorted(machine.rotor.discs, key=lambda disc: float(disc.mass))[:-1]
    return machine.model_copy(update={"rotor": machine.rotor.model_copy(update={"discs": tuple(discs)})})


def _gaps(factor: float) -> Callable[[Machine], Machine]:
    def change(machine: Machine) -> Machine:
        bearings = [
            one.model_copy(update={"air_gap": Known(value=factor * float(one.air_gap))})
            for one in machine.touchdown_bearings
        ]
        return machine.model_copy(update={"touchdown_bearings": tuple(bearings)})

    return change


def _other_machine(machine: Machine) -> Machine:
    """The file of the rotor with the next larger mass, with channels named alike."""
    order = ["5 kg", "13 kg", "30 kg", "60 kg", "140 kg", "500 kg", "1.6 t", "6 t"]
    masses = [_mass(bench_rotor(name)) for name in order]
    mine = int(np.argmin([abs(np.log(mass / _mass(machine))) for mass in masses]))
    other = bench_rotor(order[mine + 1] if mine + 1 < len(order) else order[mine - 1])
    named = [
        sensor.model_copy(update={"name": own.name, "angle": own.angle, "polarity": own.polarity})
        for sensor, own in zip(other.sensors, machine.sensors[:4], strict=True)
    ]
    return other.model_copy(update={"sensors": tuple(named)})


def _mass(machine: Machine) -> float:
    from rotordrop.evidence.free_rotor import build_rotor_fe

    return float(build_rotor_fe(machine).total_mass)


_CLIP = ("clipping",)
_TORN = ("damaged block", "dropped block", "spikes")
_LOST = ("dropped block",)
_RATE = ("wrong sampling rate", "wrong speed", "wrong speed unit")
_AXES = ("swapped axes", "inverted polarity")
_ENDS = ("swapped ends", "swapped channels")
_GAIN = ("wrong gain", "wrong unit factor", "wrong air gap")
_TURNED = ("turned sensors", "leaning fall", "leaning rest")
_LATE = ("late channel",)
_MACHINE = ("machine file", "wrong unit factor", "wrong air gap")

FAULTS: dict[str, Fault] = {
    name: Fault(make=make, names=names)
    for name, make, names in (
        ("1 sample NaN", block(1, np.nan), ("missing samples",)),
        ("20 samples NaN in all", block(20, np.nan, every=True), ("missing samples",)),
        ("1 sample infinite", block(1, np.inf), ("missing samples",)),
        ("channel constant", dead(0.0), ("dead channel",)),
        ("channel dead, 0.2 µm noise", dead(0.2e-6), ("dead channel",)),
        ("6 samples stuck", block(6, None), ("stuck channel", "clipping")),
        ("20 samples stuck", block(20, None), ("stuck channel", "clipping")),
        ("200 samples stuck", block(200, None), ("stuck channel", "clipping")),
        ("20 samples stuck in all", block(20, None, every=True), ("stuck channel", "clipping")),
        ("4 zeros in one channel", block(4, 0.0), ("zeroed block",)),
        ("8 zeros in one channel", block(8, 0.0), ("zeroed block",)),
        ("512 zeros in one channel", block(512, 0.0), ("zeroed block",)),
        ("64 zeros in all", block(64, 0.0, every=True), ("zeroed block",)),
        ("clipped at 80 %", clipped(0.8, 0.0), _CLIP),
        ("clipped at 50 %", clipped(0.5, 0.0), _CLIP),
        ("clipped at 70 %, 0.2 µm noise", clipped(0.7, 0.2e-6), _CLIP),
        ("saturates softly at 1.0 × the largest", saturated(1.0), ("soft saturation",)),
        ("saturates softly at 1.5 × the largest", saturated(1.5), ("soft saturation",)),
        ("1 spike of 100 µm", spikes(1, 100e-6), ("spikes",)),
        ("10 spikes of 50 µm", spikes(10, 50e-6), ("spikes",)),
        ("steps of 2 µm", readings(lambda s, r, _: 2e-6 * np.round(s / 2e-6)), ("coarse quantisation",)),
        ("steps of 8 µm", readings(lambda s, r, _: 8e-6 * np.round(s / 8e-6)), ("coarse quantisation",)),
        ("5 ms bridged in one", bridged(5e-3), ("bridged gap",)),
        ("5 ms bridged in all", bridged(5e-3, every=True), ("bridged gap",)),
        ("low-pass 100 Hz", low_pass(100.0), ("recorder low-pass",)),
        ("low-pass 400 Hz", low_pass(400.0), ("recorder low-pass", "late channel")),
        ("AC coupling 1 Hz", coupled(1.0), ("AC coupling",)),
        ("AC coupling 3 Hz", coupled(3.0), ("AC coupling",)),
        ("hum 10 µm, 50 Hz", hum(50.0, 10e-6), ("hum",)),
        ("hum 100 µm, 60 Hz", hum(60.0, 100e-6), ("hum",)),
        ("drift of one by 100 µm/s", drift(100e-6), ("drift",)),
        ("drift of all by 100 µm/s", drift(100e-6, every=True), ("drift",)),
        ("noise 10 µm in one", noisy(10e-6), ("noise",)),
        ("noise 5 µm in all", noisy(5e-6, every=True), ("noise",)),
        ("1 sample lost", lost(1, 0.0, 0.2), _LOST),
        ("5 samples lost", lost(5, 0.0, 0.2), _LOST),
        ("5 samples lost in the first 5 ms", lost(5, 2e-3, 5e-3), _LOST),
        ("5 samples lost before the drop", lost(5, -0.12, -0.02), _LOST),
        ("20 ms lost before the drop", lost(20e-3, -0.12, -0.04), _LOST),
        ("20 ms lost", lost(20e-3, 0.0, 0.2), _LOST),
        ("5 ms there twice", twice(5e-3), ("duplicate block",)),
        ("blocks of 8 exchanged in one", exchanged_blocks(8, every=False), _TORN),
        ("blocks of 64 exchanged in one", exchanged_blocks(64, every=False), _TORN),
        ("blocks of 64 exchanged in all", exchanged_blocks(64, every=True), _TORN),
        ("jitter of 0.3 samples, even clock", jittered_readings(0.3), ("jittered clock",)),
        ("jitter of 0.1 samples in the clock", clock(_uneven), ("jittered clock", "non-monotonic time")),
        ("clock 20 samples back", stepped(-20), ("non-monotonic time",)),
        ("clock 20 samples on", stepped(20), ("dropped block",)),
        ("ms as s", clock(lambda t, r, _: 1e3 * t, 1e-3), _RATE),
        ("rate + 2 %", faster(1.02), _RATE),
        ("rate + 10 %", faster(1.1), _RATE),
        ("rate doubled", faster(2.0), _RATE),
        ("rate halved", faster(0.5), _RATE),
        ("channel 0.3 ms late", late(0.3e-3), _LATE),
        ("channel 1 ms late", late(1e-3), _LATE),
        ("end 1 ms late", late(1e-3, end=True), _LATE),
        ("speed missing", speed(None), ("speed missing",)),
        ("speed zero", speed(lambda read, _: 0.0 * read), ("dead speed",)),
        ("speed dies at the drop", speed(_dies), ("dead speed",)),
        ("speed negative", speed(lambda read, _: -read), ("negative speed",)),
        ("rpm as Hz", speed(lambda read, _: 60.0 * read), _RATE),
        ("Hz as rad/s", speed(lambda read, _: read / (2 * np.pi)), _RATE),
        ("two pulses per turn", speed(lambda read, _: 2.0 * read), _RATE),
        ("speed + 3 %", speed(lambda read, _: 1.03 * read), _RATE),
        ("tacho pulses lost", speed(_tacho_lost), ("speed readings",)),
        ("axes exchanged in one plane", wired(lambda n: _axes(n, 1)), _AXES),
        ("axes exchanged in all planes", wired(lambda n: _axes(n, 9)), _AXES),
        ("one channel inverted", inverted(), _AXES),
        ("all channels inverted", inverted(every=True), _AXES),
        ("ends exchanged", wired(_ends), _ENDS),
        ("a channel of both ends exchanged", wired(lambda n: _ends(n, 1)), _ENDS),
        ("sensors of an end turned by 20°", turned(20.0), _TURNED),
        ("gain of one + 20 %", scaled(1.2, "one"), _GAIN),
        ("gain of one − 20 %", scaled(0.8, "one"), _GAIN),
        ("gain of an end + 20 %", scaled(1.2, "end"), _GAIN),
        ("gain of all + 20 %", scaled(1.2, "all"), _GAIN),
        ("gain of all − 20 %", scaled(0.8, "all"), _GAIN),
        ("mil as µm", scaled(1 / 25.4, "all"), _GAIN),
        ("begins 30 ms after the drop", part(0.03, np.inf), ("missing pre-trigger",)),
        ("no drop", part(-np.inf, -0.01), ("no drop in the record",)),
        ("second drop", second_drop, ("second drop",)),
        ("ends 50 ms after the drop", part(-np.inf, 0.05), ("short record",)),
        ("tail: ends exchanged", wired(_ends, tail=False), _ENDS),
        ("tail: axes exchanged", wired(lambda n: _axes(n, 9), tail=False), _AXES),
        (
            "tail: one offset by 40 µm",
            tail_offset(40e-6),
            ("tail offset", "leaning rest", "wrong unit factor"),
        ),
        ("tail: not at rest", _moving_tail, ("not settled",)),
        ("tail: still levitated", _levitated_tail, ("AC coupling", "not settled", "wrong unit factor")),
        ("file: AMB nodes exchanged", file(_ambs_exchanged), ("machine file", "ends")),
        ("file: sensor nodes exchanged", file(_sensors_exchanged), ("machine file", *_ENDS)),
        ("file: the next larger rotor", file(_other_machine), _MACHINE),
        ("file: heaviest disc missing", file(_no_disc), _MACHINE),
        ("file: gaps × 2", file(_gaps(2.0)), _MACHINE),
    )
}
