"""Drops of a machine and a set of touchdown bearings: added, listed, counted against an allowance."""

from __future__ import annotations

import hashlib
import json
import math
import re
import secrets
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import astuple, dataclass, field, fields, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rotordrop.errors import DamagedFileError, UsageError
from rotordrop.estimate.published import Drop
from rotordrop.ledger._store import Transaction, transaction
from rotordrop.ledger._store import is_url as is_url
from rotordrop.ledger._store import name_of as name_of

QUANTITIES: Mapping[str, str] = {
    "peak_force_N": "N",
    "peak_stress_Pa": "Pa",
    "mean_force_0p15_0p2_N": "N",
    "mean_stress_Pa": "Pa",
}
"""Numbers of an estimate that are logged, by their name in its document, with their units."""

FEWEST_FOR_TREND, BY_CHANCE = 5, 0.01
"""Drops from which a trend is looked for, and how rare it must be without one [1]; chosen, not measured."""

STATEMENT = (
    "This is bookkeeping: it counts drops against an allowance that somebody agreed on. It is no verdict on "
    "the state of a bearing."
)


class LoggedAlreadyError(UsageError):
    """A recording that is in the log already, as the drop of a number."""

    def __init__(self, message: str, number: int) -> None:
        self.number = number
        super().__init__(message)


@dataclass(frozen=True, kw_only=True)
class Severity:
    """One number of a drop at one bearing with its 90 % interval [unit]; no value where only a range is."""

    bearing: str
    quantity: str
    unit: str
    value: float | None
    lower: float
    upper: float


@dataclass(frozen=True, kw_only=True)
class LoggedDrop:
    """One drop of the log."""

    machine: str
    bearing_set: str
    """Which machine, and which set of touchdown bearings it had."""
    record: str
    sha256: str
    """The recording and the digest of its file, empty where that is not known."""
    recorded: str = ""
    added: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))
    """When it happened, and when it was logged (ISO 8601); ``recorded`` may be empty."""
    speed: float
    """Speed at power-off [rad/s]."""
    duration: float | None = None
    """How long the rotor was in its touchdown bearings [s]."""
    cause: str = ""
    """Why levitation was lost."""
    method: str
    verdict: str
    simulated: bool = False
    """Whether the recording is simulated."""
    version: str = ""
    fingerprint: str = ""
    """How the severity was estimated, what the estimate says of itself, by which version, and the numeric
    fingerprint of the computer's arithmetic."""
    severity: tuple[Severity, ...] = ()
    """Force and stress per bearing."""


COLUMNS = tuple(item.name for item in fields(LoggedDrop) if item.name != "severity")
SEVERITY = tuple(item.name for item in fields(Severity))
"""What a log keeps of a drop beside its severity, and of that."""
_NO_SHA256 = "none "
"""Before a number that stands in the log for the digest of a file that is not known: such records are no
doubles of each other."""
MOST_DROPS = 2**31 - 1
"""What PostgreSQL counts up to."""


LONGEST_NAME = 255
"""Characters of a name: two with four bytes each and a digest fit into a row of an index of PostgreSQL, which
takes 2,704 bytes."""
LONGEST_TEXT = 10_000
"""Characters of any other text; chosen, not measured."""


def _text(name: str, value: Any, longest: int = LONGEST_TEXT) -> str:
    """A text that every data base takes."""
    if isinstance(value, str) and len(value) > longest:
        raise UsageError(f"{name} has {len(value)} characters ({value[:20]!r}…); expected at most {longest}")
    if not isinstance(value, str) or "\0" in value or any("\ud800" <= sign <= "\udfff" for sign in value):
        raise UsageError(f"{name} = {value!r}; expected a text without NUL and lone surrogates")
    return value


def _name(name: str, value: Any) -> str:
    """What a machine, a set of bearings or a bearing is called."""
    if not _text(name, value, LONGEST_NAME).strip():
        raise UsageError(f"{name} = {value!r}; expected a name")
    return str(value)


def _number(name: str, value: Any, least: float = -math.inf) -> float:
    """A finite number from a least one on."""
    real = isinstance(value, int | float) and not isinstance(value, bool)
    if not real or not abs(value) <= sys.float_info.max or value < least:
        start = "" if least == -math.inf else f" from {least:g} on"
        raise UsageError(f"{name} = {value!r}; expected a finite number{start}")
    return float(value)


def _severity(given: Any) -> list[Severity]:
    """Numbers of severity that a log may hold."""
    if not isinstance(given, tuple) or not all(isinstance(one, Severity) for one in given):
        raise UsageError(f"severity = {given!r}; expected a tuple of numbers of severity")
    severity = []
    for one in given:
        bearing, quantity = _name("bearing", one.bearing), _text("quantity", one.quantity)
        who = f"{quantity} at {bearing}"
        if QUANTITIES.get(quantity) != one.unit:
            known = ", ".join(f"{quantity} in {unit}" for quantity, unit in QUANTITIES.items())
            raise UsageError(f"{who} in {one.unit!r}; expected one of {known}")
        lower, upper = _number(f"{who}: lower", one.lower), _number(f"{who}: upper", one.upper, 0.0)
        value = None if one.value is None else _number(f"{who}: value", one.value)
        if lower > upper:
            raise UsageError(f"{who} runs from {lower:g} to {upper:g}; expected the smaller end first")
        if value is not None and not lower <= value <= upper:
            raise UsageError(f"{who} is {value:g}, outside of its interval from {lower:g} to {upper:g}")
        severity.append(replace(one, value=value, lower=lower, upper=upper))
    stated = [(one.bearing, one.quantity) for one in severity]
    for bearing, quantity in stated:
        if stated.count((bearing, quantity)) > 1:
            raise UsageError(f"{quantity} at {bearing} is stated twice; leave one of them out")
    return severity


def _checked(drop: LoggedDrop) -> LoggedDrop:
    """A drop whose values a log may hold; refuses others by name."""
    if not isinstance(drop, LoggedDrop):
        raise UsageError(f"{drop!r} is no drop; expected a LoggedDrop")
    texts = {name: _text(name, getattr(drop, name)) for name in COLUMNS if name not in _NO_TEXT}
    _name("machine", drop.machine)
    _name("bearing_set", drop.bearing_set)
    if drop.sha256 and not re.fullmatch("[0-9a-f]{64}", drop.sha256):
        raise UsageError(
            f"sha256 = {drop.sha256!r}; expected the digest of the record, 64 hexadecimal digits, or nothing"
        )
    for name in ("recorded", "added"):
        try:
            if texts[name]:
                datetime.fromisoformat(texts[name])
        except ValueError:
            raise UsageError(
                f"{name} = {texts[name]!r}; expected a date such as 2026-03-14T15:09:26, or nothing"
            ) from None
    if not isinstance(drop.simulated, bool):
        raise UsageError(f"simulated = {drop.simulated!r}; expected True or False")
    return replace(
        drop,
        speed=_number("speed", drop.speed, 0.0),
        duration=None if drop.duration is None else _number("duration", drop.duration, 0.0),
        severity=tuple(sorted(_severity(drop.severity), key=lambda one: (one.bearing, one.quantity))),
    )


_NO_TEXT = ("speed", "duration", "simulated")


def _digest(*values: Any) -> str:
    """Digest of what stands in a log; of what nobody put there a text that is no digest."""
    try:
        return hashlib.sha256(json.dumps(values).encode()).hexdigest()
    except TypeError as error:
        return str(error)


def _of_drop(drop: LoggedDrop) -> str:
    return _digest([getattr(drop, name) for name in COLUMNS], [astuple(one) for one in drop.severity])


@dataclass(frozen=True, kw_only=True)
class UsedShare:
    """How much of an allowance is used; None where nothing is allowed or known."""

    machine: str
    bearing_set: str
    drops: int
    allowed_drops: int | None
    """Drops logged and allowed."""
    seconds: float
    allowed_seconds: float | None
    """Time in the touchdown bearings logged and allowed [s]."""
    untimed: int
    """Drops whose duration is not known: they count as drops, not as seconds."""
    source: str
    """Who allowed it; by API 617 and ISO 14839-5 it is a matter of agreement."""
    drops_passed_at: int | None = None
    seconds_passed_at: int | None = None
    """Drops of the log with which a limit was passed."""

    def sentence(self) -> str:
        """The share in words."""
        who = f"{self.machine}, bearings {self.bearing_set}"
        if self.allowed_drops is None and self.allowed_seconds is None:
            return f"{who}: {self.drops} {'drop' if self.drops == 1 else 'drops'}; no limit given"
        parts = []
        if self.allowed_drops is not None:
            share = self.drops / self.allowed_drops
            over = str(self.drops - self.allowed_drops)
            beyond = _beyond(f"{self.allowed_drops} drops", over, self.drops_passed_at)
            parts.append(f"{self.drops} of {self.allowed_drops} drops ({100 * share:.3g} %){beyond}")
        if self.allowed_seconds is not None:
            share = self.seconds / self.allowed_seconds
            untimed = (
                f", {self.untimed} {'drop' if self.untimed == 1 else 'drops'} without duration left out"
                if self.untimed
                else ""
            )
            over = f"{self.seconds - self.allowed_seconds:.3g} s"
            beyond = _beyond(f"{self.allowed_seconds:g} s", over, self.seconds_passed_at)
            done = f"{self.seconds:.4g} s of {self.allowed_seconds:g} s ({100 * share:.3g} %{untimed})"
            parts.append(f"{done}{beyond}")
        return f"{who}: {'; '.join(parts)}, allowed by {self.source}"


def _beyond(limit: str, over: str, drop: int | None) -> str:
    return "" if drop is None else f", the limit of {limit} is passed by {over}, with drop {drop}"


def add_drop(where: str | Path, drop: LoggedDrop) -> int:
    """Add a drop to a log and give its number; a recording that is in the log already is refused."""
    drop = _checked(drop)
    kept = replace(drop, sha256=drop.sha256 or f"{_NO_SHA256}{secrets.token_hex(8)}")
    values = [getattr(kept, name) for name in COLUMNS]
    with _writing(where) as log:
        log.refuse_damaged(where)
        key = (kept.machine, kept.bearing_set, kept.sha256)
        there = log.run("SELECT id FROM drops WHERE machine = ? AND bearing_set = ? AND sha256 = ?", key)
        if there:
            raise LoggedAlreadyError(
                f"{drop.record} is in the log already, as drop {there[0][0]} of {drop.machine} with bearings "
                f"{drop.bearing_set}; a recording counts once. Remove that entry first to replace it",
                there[0][0],
            )
        number = int(
            log.run(
                f"INSERT INTO drops ({', '.join(COLUMNS)}) VALUES ({', '.join('?' * len(values))}) "
                "RETURNING id",
                values,
            )[0][0]
        )
        # of a drop of this number that was not written to its end
        log.run("DELETE FROM severity WHERE drop_id = ?", (number,))
        for one in kept.severity:
            log.run("INSERT INTO severity VALUES (?, ?, ?, ?, ?, ?, ?)", (number, *astuple(one)))
        log.seal(f"drop {number}", _of_drop(drop))
    return number


def remove_drop(where: str | Path, number: int) -> None:
    """Take a drop out of a log by its number, whether it is damaged or not."""
    with _writing(where) as log:
        known = f"drop {number}" in log.seals
        possible = type(number) is int and 0 < number < 2**63
        if not known and not (possible and log.run("SELECT id FROM drops WHERE id = ?", (number,))):
            raise UsageError(f"the log has no drop {number}; 'rotordrop log show' lists them")
        log.run("DELETE FROM severity WHERE drop_id = ?", (number,))
        log.run("DELETE FROM drops WHERE id = ?", (number,))
        log.seal(f"drop {number}", None)


@dataclass(frozen=True, kw_only=True)
class Log:
    """All that a log holds."""

    drops: Mapping[int, LoggedDrop]
    """Drops by number, in the order they happened."""
    allowances: Mapping[tuple[str, str], tuple[int | None, float | None, str]]
    """Drops, seconds and source by machine and set of bearings."""
    sealed: bool
    """Whether it has digests; an older rotordrop gave it none."""


def read_log(where: str | Path | Log) -> Log:
    """Everything in a log, compared with its digests; what is damaged or gone is named.

    A log that is read already is given back, so that whoever asks it several things reads it once.
    """
    if isinstance(where, Log):
        return where
    with transaction(where, writing=False) as log:
        found, seals = _read(log), log.seals
        there = _digests(found)
        wrong = [f"{what} is gone" for what in seals.keys() - there]
        logged_as = {digest: what for what, digest in seals.items()}
        for what, digest in there.items() if log.sealed else ():
            if what not in seals:
                wrong.append(f"{what} has no digest: it was not written to its end, or by an older rotordrop")
            elif seals[what] != digest:
                other = logged_as.get(digest)
                wrong.append(f"{what} is not what was logged" + (f", but {other} was so" if other else ""))
        if wrong:
            raise DamagedFileError(
                f"{name_of(where)} is damaged: {', '.join(sorted(wrong))}. Take a damaged drop out with "
                "'rotordrop log remove' and add its estimate again; state a damaged allowance again"
            )
        log.refuse_damaged(where)
    return replace(found, sealed=log.sealed)


def _read(log: Transaction) -> Log:
    """What stands in a log, whole or not. Nothing is looked for by an index, which may be damaged too."""
    of_drop: dict[Any, list[Severity]] = {}
    for number, *severity in log.run(f"SELECT drop_id, {', '.join(SEVERITY)} FROM severity"):
        of_drop.setdefault(number, []).append(Severity(**dict(zip(SEVERITY, severity, strict=True))))
    drops = {}
    for number, *row in log.run(f"SELECT id, {', '.join(COLUMNS)} FROM drops"):
        values = dict(zip(COLUMNS, row, strict=True))
        if values["simulated"] in (0, 1):
            values["simulated"] = bool(values["simulated"])  # SQLite keeps 0 and 1
        if str(values["sha256"]).startswith(_NO_SHA256):
            values["sha256"] = ""
        severity = sorted(of_drop.pop(number, []), key=lambda one: (str(one.bearing), str(one.quantity)))
        drops[number] = LoggedDrop(**values, severity=tuple(severity))
    rows = log.run("SELECT machine, bearing_set, drops, seconds, source FROM allowances")
    return Log(
        drops=dict(sorted(drops.items(), key=lambda e: (str(e[1].recorded or e[1].added), e[0]))),
        allowances={(row[0], row[1]): row[2:] for row in rows},
        sealed=True,
    )


def _digests(found: Log) -> dict[str, str]:
    """Digest of every drop and every allowance, by what it is of."""
    return {f"drop {number}": _of_drop(drop) for number, drop in found.drops.items()} | {
        _allowance(*key): _digest(*allowed) for key, allowed in found.allowances.items()
    }


def _allowance(machine: str, bearing_set: str) -> str:
    """What the digest of an allowance is of."""
    return f"allowance of {machine}, bearings {bearing_set}"


@contextmanager
def _writing(where: str | Path) -> Iterator[Transaction]:
    """A log to write to; one that an older rotordrop made is given digests, once.

    What has none later was not written to its end.
    """
    with transaction(where, writing=True) as log:
        if not log.sealed:
            for what, digest in _digests(_read(log)).items():
                log.seal(what, digest)
        yield log


def logged_drops(
    where: str | Path | Log, *, machine: str | None = None, bearing_set: str | None = None
) -> dict[int, LoggedDrop]:
    """Drops of a log by number, in the order they happened."""
    return {
        number: drop
        for number, drop in read_log(where).drops.items()
        if machine in (None, drop.machine) and bearing_set in (None, drop.bearing_set)
    }


def allow(
    where: str | Path,
    machine: str,
    bearing_set: str,
    *,
    drops: int | None = None,
    seconds: float | None = None,
    source: str,
) -> None:
    """State how many drops or how many seconds a set of touchdown bearings may take, and who says so."""
    if drops is None and seconds is None:
        raise UsageError("an allowance needs a number of drops or of seconds")
    if drops is not None and (type(drops) is not int or not 1 <= drops <= MOST_DROPS):
        raise UsageError(f"allowed are {drops!r} drops; expected a whole number from 1 to {MOST_DROPS}")
    seconds = None if seconds is None else _number("seconds", seconds, math.ulp(0.0))
    if not _text("source", source).strip():
        raise UsageError("an allowance needs its source: who agreed on it, in which document")
    key = (_name("machine", machine), _name("bearing_set", bearing_set))
    with _writing(where) as log:
        log.run("DELETE FROM allowances WHERE machine = ? AND bearing_set = ?", key)
        log.run("INSERT INTO allowances VALUES (?, ?, ?, ?, ?)", (*key, drops, seconds, source))
        log.seal(_allowance(*key), _digest(drops, seconds, source))


def used_shares(where: str | Path | Log) -> tuple[UsedShare, ...]:
    """How much every machine and set of bearings has used of what it is allowed."""
    found = read_log(where)
    logged: dict[tuple[str, str], dict[int, float | None]] = {key: {} for key in found.allowances}
    for number, drop in found.drops.items():
        logged.setdefault((drop.machine, drop.bearing_set), {})[number] = drop.duration
    shares = []
    for key, lasted in sorted(logged.items()):
        drops, seconds, source = found.allowances.get(key, (None, None, ""))
        known = [one for one in lasted.values() if one is not None]
        total, over = math.fsum(known), None
        if seconds is not None and total > seconds:
            times = [one or 0.0 for one in lasted.values()]
            over = next(n for k, n in enumerate(lasted, start=1) if math.fsum(times[:k]) > seconds)
        shares.append(
            UsedShare(
                machine=key[0],
                bearing_set=key[1],
                drops=len(lasted),
                allowed_drops=drops,
                seconds=total,
                allowed_seconds=seconds,
                untimed=len(lasted) - len(known),
                source=source,
                drops_passed_at=None if drops is None else next(iter([*lasted][drops:]), None),
                seconds_passed_at=over,
            )
        )
    return tuple(shares)


def drop_of_estimate(drop: Drop, bearing_set: str, **known: Any) -> LoggedDrop:
    """A drop as its published estimate tells it, beside which set of touchdown bearings it was.

    ``known`` is what the estimate does not know: ``duration`` [s], ``cause``, and ``recorded``, where its
    recorder wrote no date or a wrong one.
    """
    severity = [
        Severity(bearing=name, quantity=quantity, unit=unit, value=found.value, lower=ends[0], upper=ends[1])
        for name, bearing in drop.bearings.items()
        for quantity, unit in QUANTITIES.items()
        # a number without an interval is no evidence
        if (found := bearing.numbers.get(quantity)) is not None and (ends := found.interval) is not None
    ]
    return LoggedDrop(
        machine=drop.machine,
        bearing_set=bearing_set,
        record=drop.record,
        sha256=drop.record_sha256,
        speed=2.0 * math.pi * drop.speed_Hz,
        method=drop.method,
        verdict=drop.verdict,
        simulated=drop.simulated_record,
        version=drop.rotordrop_version,
        fingerprint=drop.fingerprint,
        severity=tuple(severity),
        **{**known, "recorded": known.get("recorded") or drop.recorded},
    )


@dataclass(frozen=True, kw_only=True)
class Trend:
    """Whether a number rises from drop to drop of one set of touchdown bearings."""

    machine: str
    bearing_set: str
    bearing: str
    quantity: str
    """What of whom."""
    drops: int
    """Drops that state it."""
    tau: float
    """Kendall's rank correlation with the order of the drops [1]."""
    by_chance: float
    """Probability of one as large without any trend [1]."""

    def sentence(self) -> str:
        """The trend in words."""
        sense = "rises" if self.tau > 0.0 else "falls"
        return (
            f"{self.machine}, bearings {self.bearing_set}: {self.quantity} at {self.bearing} {sense} over "
            f"{self.drops} drops (Kendall {self.tau:+.2f}, by chance {100 * self.by_chance:.2g} %); "
            "speeds differ, and one drop is one draw"
        )


def trends(where: str | Path | Log, *, machine: str | None = None) -> tuple[Trend, ...]:
    """Numbers that rise or fall from drop to drop beyond chance, of drops in the order they happened.

    Source: Kendall 1938; exact for few drops. Five drops at least, and one in a hundred by chance.
    """
    series: dict[tuple[str, str, str, str], list[float]] = {}
    for drop in logged_drops(where, machine=machine).values():
        for one in drop.severity:
            value = 0.5 * (one.lower + one.upper) if one.value is None else one.value
            key = (drop.machine, drop.bearing_set, one.bearing, one.quantity)
            series.setdefault(key, []).append(value)
    found = []
    for (name, bearings, bearing, quantity), values in series.items():
        if len(values) < FEWEST_FOR_TREND:
            continue
        from scipy.stats import kendalltau  # half a second, for those who have that many drops

        tau, chance = kendalltau(range(len(values)), values)
        if chance < BY_CHANCE:
            found.append(
                Trend(
                    machine=name,
                    bearing_set=bearings,
                    bearing=bearing,
                    quantity=quantity,
                    drops=len(values),
                    tau=float(tau),
                    by_chance=float(chance),
                )
            )
    return tuple(found)
