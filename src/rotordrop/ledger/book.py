"""Drops of a machine and a set of touchdown bearings: added, listed, counted against an allowance."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import astuple, dataclass, field, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rotordrop.errors import UsageError
from rotordrop.estimate.published import Drop
from rotordrop.ledger._store import transaction

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
    """The recording and the digest of its file."""
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

    def sentence(self) -> str:
        """The share in words."""
        who = f"{self.machine}, bearings {self.bearing_set}"
        if self.allowed_drops is None and self.allowed_seconds is None:
            return f"{who}: {self.drops} {'drop' if self.drops == 1 else 'drops'}; no limit given"
        parts = []
        if self.allowed_drops is not None:
            share = self.drops / self.allowed_drops
            parts.append(f"{self.drops} of {self.allowed_drops} drops ({100 * share:.3g} %)")
        if self.allowed_seconds is not None:
            share = self.seconds / self.allowed_seconds
            untimed = f", {self.untimed} drops without duration left out" if self.untimed else ""
            parts.append(f"{self.seconds:.4g} s of {self.allowed_seconds:g} s ({100 * share:.3g} %{untimed})")
        return f"{who}: {'; '.join(parts)}, allowed by {self.source}"


def add_drop(where: str | Path, drop: LoggedDrop) -> int:
    """Add a drop to a log and give its number; a recording that is in the log already is refused."""
    values = [getattr(drop, name) for name in COLUMNS]
    with transaction(where, writing=True) as log:
        key = (drop.machine, drop.bearing_set, drop.sha256)
        there = log.run("SELECT id FROM drops WHERE machine = ? AND bearing_set = ? AND sha256 = ?", key)
        if there:
            raise UsageError(
                f"{drop.record} is in the log already, as drop {there[0][0]} of {drop.machine} with bearings "
                f"{drop.bearing_set}; a recording counts once. Remove that entry first to replace it"
            )
        number = int(
            log.run(
                f"INSERT INTO drops ({', '.join(COLUMNS)}) VALUES ({', '.join('?' * len(values))}) "
                "RETURNING id",
                values,
            )[0][0]
        )
        for one in drop.severity:
            log.run("INSERT INTO severity VALUES (?, ?, ?, ?, ?, ?, ?)", (number, *astuple(one)))
    return number


def remove_drop(where: str | Path, number: int) -> None:
    """Take a drop out of a log by its number."""
    with transaction(where, writing=True) as log:
        if not log.run("SELECT id FROM drops WHERE id = ?", (number,)):
            raise UsageError(f"the log has no drop {number}; 'rotordrop log show' lists them")
        log.run("DELETE FROM severity WHERE drop_id = ?", (number,))
        log.run("DELETE FROM drops WHERE id = ?", (number,))


def logged_drops(
    where: str | Path, *, machine: str | None = None, bearing_set: str | None = None
) -> dict[int, LoggedDrop]:
    """Drops of a log by number, in the order they happened."""
    wanted = [(name, value) for name, value in (("machine", machine), ("bearing_set", bearing_set)) if value]
    condition = " AND ".join(f"{name} = ?" for name, _ in wanted)
    with transaction(where, writing=False) as log:
        rows = log.run(
            f"SELECT id, {', '.join(COLUMNS)} FROM drops {'WHERE ' + condition if wanted else ''} "
            "ORDER BY CASE WHEN recorded = '' THEN added ELSE recorded END, id",
            [value for _, value in wanted],
        )
        severities = log.run(
            f"SELECT drop_id, {', '.join(SEVERITY)} FROM severity ORDER BY drop_id, bearing, quantity"
        )
    of_drop: dict[int, list[Severity]] = {}
    for number, *severity in severities:
        of_drop.setdefault(number, []).append(Severity(**dict(zip(SEVERITY, severity, strict=True))))
    found = {}
    for number, *row in rows:
        values = dict(zip(COLUMNS, row, strict=True))
        values["simulated"] = bool(values["simulated"])  # SQLite keeps 0 and 1
        found[number] = LoggedDrop(**values, severity=tuple(of_drop.get(number, ())))
    return found


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
    if (drops is not None and drops < 1) or (seconds is not None and not seconds > 0.0):
        raise UsageError(f"allowed are {drops} drops and {seconds} s; expected numbers above zero")
    if not source.strip():
        raise UsageError("an allowance needs its source: who agreed on it, in which document")
    with transaction(where, writing=True) as log:
        log.run("DELETE FROM allowances WHERE machine = ? AND bearing_set = ?", (machine, bearing_set))
        values = (machine, bearing_set, drops, seconds, source)
        log.run("INSERT INTO allowances VALUES (?, ?, ?, ?, ?)", values)


def used_shares(where: str | Path) -> tuple[UsedShare, ...]:
    """How much every machine and set of bearings has used of what it is allowed."""
    with transaction(where, writing=False) as log:
        durations = log.run("SELECT machine, bearing_set, duration FROM drops")
        allowances = log.run("SELECT machine, bearing_set, drops, seconds, source FROM allowances")
    logged: dict[tuple[str, str], list[float | None]] = {(row[0], row[1]): [] for row in allowances}
    for machine, bearings, duration in durations:
        logged.setdefault((machine, bearings), []).append(duration)
    allowed = {(row[0], row[1]): row[2:] for row in allowances}
    found = []
    for key, lasted in sorted(logged.items()):
        drops, seconds, source = allowed.get(key, (None, None, ""))
        known = [one for one in lasted if one is not None]
        found.append(
            UsedShare(
                machine=key[0],
                bearing_set=key[1],
                drops=len(lasted),
                allowed_drops=drops,
                seconds=math.fsum(known),
                allowed_seconds=seconds,
                untimed=len(lasted) - len(known),
                source=source,
            )
        )
    return tuple(found)


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


def trends(where: str | Path, *, machine: str | None = None) -> tuple[Trend, ...]:
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
