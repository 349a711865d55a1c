"""Faults of the time axis, and of blocks of samples that are missing or there twice."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rotordrop.evidence.quality.finding import Finding, Kind
from rotordrop.record.recording import Array

if TYPE_CHECKING:
    from rotordrop.record.record import Record

SLOWEST = 2000.0
"""Sampling rate a drop should have at least [Hz]."""

_GAP, _JITTERED_GAP = 1.5, 2.5
"""Interval over the usual one from which a sample is missing [1]; the second where all intervals scatter."""

_JITTER = 0.02
_SHORTEST_COPY = 24
_AROUND = 20
"""Samples on both sides of a jump that say what is usual there."""

_RATE_KEYS = re.compile(r"^(fs|sampl\w*[ _-]*(rate|frequency)|abtast(rate|frequenz))", re.IGNORECASE)


def check_clock(record: Record, *, drop: bool = True) -> list[Finding]:
    """Find backward, jittered or wrong clocks and gaps in them."""
    steps = np.diff(record.time)
    if not 0.0 < record.sampling_rate < np.inf:
        return [
            Finding(
                kind=Kind.WRONG_RATE,
                message=f"the sampling rate is {record.sampling_rate:g} Hz",
                remedy="give the true rate with the record",
                severity="stop",
            )
        ]
    usual = float(np.median(steps))
    findings = _backward(record, steps)
    if findings:
        return findings
    even = steps[steps < _GAP * usual]
    jitter = float(np.std(even)) / usual
    findings += _gaps(record, steps, usual, _JITTERED_GAP if jitter > _JITTER else _GAP)
    if jitter > _JITTER:
        worst = int(np.argmax(np.abs(steps - usual)))
        findings.append(
            Finding(
                kind=Kind.JITTERED_CLOCK,
                message=f"the sampling interval of {usual * 1e6:.4g} µs scatters by {jitter:.1%}",
                remedy="export the recording with the recorder's own sample clock",
                severity="warning",
                time=float(record.time[worst]),
            )
        )
    findings += _stated_rate(record)
    if drop and record.sampling_rate < SLOWEST:
        findings.append(
            Finding(
                kind=Kind.SLOW_SAMPLING,
                message=f"{record.sampling_rate:.6g} Hz leaves {record.sampling_rate * 1e-3:.2g} samples per "
                "millisecond of "
                "contact",
                remedy=f"record at {SLOWEST:.0f} Hz or faster, better 20000 Hz",
                severity="warning",
            )
        )
    return findings


def _backward(record: Record, steps: Array) -> list[Finding]:
    wrong = np.flatnonzero(~(steps > 0))
    if not len(wrong):
        return []
    at = int(wrong[0])
    return [
        Finding(
            kind=Kind.BACKWARD_TIME,
            message=f"sample {at + 2} is at {record.time[at + 1]:.7g} s after sample {at + 1} at "
            f"{record.time[at]:.7g} s "
            f"({len(wrong)} such steps)",
            remedy="export again, or delete the repeated rows",
            severity="stop",
            time=float(record.time[at + 1]),
        )
    ]


def _gaps(record: Record, steps: Array, usual: float, limit: float) -> list[Finding]:
    gaps = np.flatnonzero(steps > limit * usual)
    if not len(gaps):
        return []
    at = int(gaps[0])
    missing = round(steps[at] / usual) - 1
    return [
        Finding(
            kind=Kind.DROPPED_BLOCK,
            message=f"{missing} samples are missing after {record.time[at]:.6g} s ({len(gaps)} gaps in the "
            "clock)",
            remedy="export the recording without gaps; do not fill them",
            severity="stop",
            time=float(record.time[at]),
        )
    ]


def _stated_rate(record: Record) -> list[Finding]:
    for key, text in record.metadata.items():
        number = re.match(r"([\d.,]+)\s*(k?Hz)?", text) if _RATE_KEYS.match(key) else None
        if not number:
            continue
        stated = float(number.group(1).replace(",", ".")) * (1e3 if number.group(2) == "kHz" else 1.0)
        if stated > 0 and abs(record.sampling_rate / stated - 1.0) > 1e-3:
            return [
                Finding(
                    kind=Kind.WRONG_RATE,
                    message=f"the header says {stated:.6g} Hz, the time column {record.sampling_rate:.6g} Hz",
                    remedy="find out which is right; name the true interval in the profile (time.step)",
                    severity="stop",
                )
            ]
    return []


def check_blocks(record: Record) -> list[Finding]:
    """Find blocks of samples that are there twice, and jumps of all channels at once."""
    return _copies(record) or _jumps(record)


def _copies(record: Record) -> list[Finding]:
    """Rows that repeat earlier rows one after the other: noise never does that."""
    label = _row_hashes(record.signals)
    order = np.argsort(label, kind="stable")
    same = label[order][1:] == label[order][:-1]
    later, earlier = order[1:][same], order[:-1][same]
    lag = np.zeros(len(label), dtype=np.int64)
    lag[later] = later - earlier
    still = np.append(False, np.all(record.signals[1:] == record.signals[:-1], axis=1))
    lag[still] = 0
    start, length = _longest_run(lag)
    if length < _SHORTEST_COPY:
        return []
    return [
        Finding(
            kind=Kind.DUPLICATE_BLOCK,
            message=f"{length} samples from {record.time[start]:.6g} s on repeat those from "
            f"{record.time[start - lag[start]]:.6g} s exactly",
            remedy="export again; the times after the copy are wrong",
            severity="stop",
            time=float(record.time[start]),
        )
    ]


def _row_hashes(signals: Array) -> NDArray[np.uint64]:
    """One number per row, the same for the same readings; far faster to sort than the rows."""
    odd = np.random.default_rng(0).integers(1, 2**62, signals.shape[1], dtype=np.uint64) * np.uint64(
        2
    ) + np.uint64(1)
    bits = np.ascontiguousarray(signals + 0.0).view(np.uint64)
    mixed = (bits ^ (bits >> np.uint64(29))) * odd
    return np.asarray(np.bitwise_xor.reduce(mixed ^ (mixed >> np.uint64(32)), axis=1))


def _longest_run(lag: NDArray[np.int64]) -> tuple[int, int]:
    """Start and length of the longest run of one and the same lag above zero."""
    edges = np.flatnonzero(np.diff(lag)) + 1
    starts = np.concatenate([[0], edges])
    lengths = np.diff(np.concatenate([starts, [len(lag)]]))
    lengths = np.where(lag[starts] > 0, lengths, 0)
    best = int(np.argmax(lengths))
    return int(starts[best]), int(lengths[best])


def _jumps(record: Record) -> list[Finding]:
    """Steps of most channels between two samples that no rotor can make: samples are missing there."""
    signals = record.signals
    if len(signals) < 50:
        return []
    step = np.diff(signals, axis=0)
    near = np.stack([step[:-4], step[1:-3], step[3:-1], step[4:]])
    # the median of four, several times faster than by sorting
    around = 0.5 * (np.sum(near, axis=0) - np.max(near, axis=0) - np.min(near, axis=0))
    kink = np.abs(step[2:-2] - around)
    usual = np.maximum(1.4826 * np.median(kink, axis=0), 1e-12)
    finest = np.array([np.min(np.diff(np.unique(column)), initial=np.inf) for column in signals.T])
    limit = np.maximum(np.maximum(12.0 * usual, 2e-6), 4.0 * np.where(np.isfinite(finest), finest, 0.0))
    enough = max(2, signals.shape[1] // 2 + 1)
    many = np.sum(kink > limit, axis=1) >= enough
    # where the rotor moves along one sensor, one channel jumps far and the others less
    far = np.max(kink / np.maximum(8.0 * np.percentile(kink, 99.9, axis=0), limit), axis=1) > 1.0
    for jump in np.flatnonzero(far & ~many).tolist():
        nearby = np.median(kink[max(jump - _AROUND, 0) : jump + _AROUND], axis=0)
        many[jump] = np.sum(kink[jump] > 6.0 * np.maximum(nearby, usual)) >= enough
    beside = np.append(many[1:], False) | np.append(False, many[:-1])
    alone = np.flatnonzero(many & ~beside)  # a spike makes two such steps in a row
    if not len(alone):
        return []
    at = int(alone[0]) + 2
    size = float(np.max(np.abs(step[at])))
    return [
        Finding(
            kind=Kind.DROPPED_BLOCK,
            message=f"{len(alone)} jump(s) of most channels at once, the first by "
            f"{size * 1e6:.3g} µm from one "
            f"sample to the next at {record.time[at]:.6g} s",
            remedy="samples are missing though the clock runs on; export again",
            severity="stop",
            time=float(record.time[at]),
        )
    ]
