"""Drops of a machine and a set of touchdown bearings: added, listed, counted against an allowance."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, ConfigDict, Field, TypeAdapter, ValidationError

from rotordrop.document import first_fault
from rotordrop.errors import DamagedFileError, UsageError
from rotordrop.estimate.published import Drop
from rotordrop.ledger._store import Rows, append, read_rows
from rotordrop.ledger._store import is_url as is_url
from rotordrop.ledger._store import name_of as name_of
from rotordrop.require import require
from rotordrop.severity.numbers import LOADS
from rotordrop.units import si_unit

QUANTITIES = {one.field: si_unit(one.kind) for one in LOADS}
"""Numbers of an estimate that are logged, by their name in its document, with their units."""
FEWEST_FOR_TREND, BY_CHANCE = 5, 0.01
"""Drops from which a trend is looked for, and how rare it must be without one [1]; chosen, not measured."""
STATEMENT = (
    "This is bookkeeping: it counts drops against an allowance that somebody agreed on. It is no verdict on "
    "the state of a bearing."
)
DROP, ALLOWANCE, REMOVAL = "drop", "allowance", "removal"
"""Kinds of rows of a log; a removal names the row that does not count any more."""


class LoggedAlreadyError(UsageError):
    """A recording that is in the log already, as the drop of a number."""

    def __init__(self, message: str, number: int) -> None:
        self.number = number
        super().__init__(message)


def _moment(text: str) -> str:
    if text:
        datetime.fromisoformat(text)
    return text


Text = Annotated[str, Field(strict=True, max_length=10_000)]
Name = Annotated[str, Field(strict=True, max_length=255, pattern=r"\S")]
Moment = Annotated[str, Field(strict=True), AfterValidator(_moment)]
Number = Annotated[float, Field(strict=True)]
Amount = Annotated[float, Field(strict=True, ge=0.0)]
FINITE = ConfigDict(extra="forbid", allow_inf_nan=False)


@dataclass(frozen=True, kw_only=True)
class Severity:
    """One number of a drop at one bearing with its 90 % interval [unit]; no value where only a range is."""

    __pydantic_config__: ClassVar = FINITE
    bearing: Name
    quantity: Text
    unit: Text
    value: Number | None
    lower: Number
    upper: Amount


@dataclass(frozen=True, kw_only=True)
class LoggedDrop:
    """One drop of the log."""

    __pydantic_config__: ClassVar = FINITE
    machine: Name
    bearing_set: Name
    """Which machine, and which set of touchdown bearings it had."""
    record: Text
    sha256: Annotated[str, Field(strict=True, pattern="^([0-9a-f]{64})?$")]
    """The recording and the digest of its file, empty where that is not known."""
    recorded: Moment = ""
    added: Moment = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))
    """When it happened, and when it was logged (ISO 8601); ``recorded`` may be empty."""
    speed: Amount
    """Speed at power-off [rad/s]."""
    duration: Amount | None = None
    """How long the rotor was in its touchdown bearings [s]."""
    cause: Text = ""
    """Why levitation was lost."""
    method: Text
    verdict: Text
    consistent: Annotated[bool, Field(strict=True)] = True
    """Whether the model is consistent with the record; else its numbers are ranges."""
    simulated: Annotated[bool, Field(strict=True)] = False
    """Whether the recording is simulated."""
    went_on: Annotated[bool, Field(strict=True)] = False
    """Whether the rotor went further out after the part of the record that the numbers are of."""
    version: Text = ""
    fingerprint: Text = ""
    """How the severity was estimated, what the estimate says of itself, by which version, and the numeric
    fingerprint of the computer's arithmetic."""
    severity: Annotated[tuple[Severity, ...], Field(strict=True)] = ()
    """Force and stress per bearing."""


@dataclass(frozen=True, kw_only=True)
class Allowance:
    """How much a set of touchdown bearings may take, and who says so."""

    __pydantic_config__: ClassVar = FINITE
    machine: Name = ""
    bearing_set: Name = ""
    drops: Annotated[int, Field(strict=True, ge=1)] | None = None
    seconds: Annotated[float, Field(strict=True, gt=0.0)] | None = None
    """Largest number of drops and time in the bearings [s]; None where that is not limited."""
    source: Annotated[str, Field(strict=True, max_length=10_000, pattern=r"\S")] = ""


_DROP, _ALLOWANCE = TypeAdapter(LoggedDrop), TypeAdapter(Allowance)


def _checked(given: Any, adapter: TypeAdapter[Any]) -> str:
    """A drop or an allowance as JSON; refuses one that no log may hold by the name of its fault."""
    if not isinstance(given, LoggedDrop | Allowance):
        raise UsageError(f"{given!r} is no drop; expected a LoggedDrop")
    made = asdict(given)
    try:
        adapter.validate_python(made)
    except ValidationError as error:
        raise UsageError(first_fault(error)) from None
    stated = [(one["quantity"], one["bearing"]) for one in made.get("severity", ())]
    for one in made.get("severity", ()):
        who, low, high = f"{one['quantity']} at {one['bearing']}", one["lower"], one["upper"]
        if QUANTITIES.get(one["quantity"]) != one["unit"]:
            known = ", ".join(f"{quantity} in {unit}" for quantity, unit in QUANTITIES.items())
            raise UsageError(f"{who} in {one['unit']!r}; expected one of {known}")
        if not low <= (high if one["value"] is None else one["value"]) <= high:
            raise UsageError(f"{who} is {one['value']}; expected a value between {low:g} and {high:g}")
        if stated.count((one["quantity"], one["bearing"])) > 1:
            raise UsageError(f"{who} is stated twice; leave one of them out")
    return json.dumps(made, allow_nan=False)


@dataclass(frozen=True, kw_only=True)
class Log:
    """All that a log holds."""

    drops: Mapping[int, LoggedDrop]
    """Drops by number, in the order they happened."""
    allowances: Mapping[tuple[str, str], Allowance]
    """By machine and set of bearings."""


def read_log(where: str | Path | Log) -> Log:
    """Everything in a log, compared with its digests.

    A log that is read already is given back, so that whoever asks it several things reads it once.

    Raises
    ------
    DamagedFileError
        If something was changed or is gone; names its number.
    UsageError, OutputError
        If there is no log, or it cannot be used.
    """
    return where if isinstance(where, Log) else _log(read_rows(where), where)


def _removed(found: Rows) -> set[int]:
    return {json.loads(content)["number"] for kind, content in found.whole.values() if kind == REMOVAL}


def _log(found: Rows, where: str | Path) -> Log:
    removed = _removed(found)
    wrong = [f"entry {number} {what}" for number, what in found.wrong.items() if number not in removed]
    if wrong:
        raise DamagedFileError(
            f"{name_of(where)} is damaged: {', '.join(wrong)}. Put back a copy of it, or take the entry out "
            "with 'rotordrop log remove' and add its estimate, or state its allowance, again"
        )
    counted = {number: row for number, row in found.whole.items() if number not in removed}
    drops = {n: _DROP.validate_json(content) for n, (kind, content) in counted.items() if kind == DROP}
    allowed = [_ALLOWANCE.validate_json(content) for kind, content in counted.values() if kind == ALLOWANCE]
    return Log(
        drops=dict(sorted(drops.items(), key=lambda one: (one[1].recorded or one[1].added, one[0]))),
        allowances={(one.machine, one.bearing_set): one for one in allowed},
    )


def add_drop(where: str | Path, drop: LoggedDrop) -> int:
    """Add a drop to a log and give its number; a recording that is in the log already is refused."""
    content = _checked(drop, _DROP)

    def made(found: Rows) -> tuple[str, str]:
        for number, other in _log(found, where).drops.items():
            if other.machine == drop.machine and drop.sha256 and other.sha256 == drop.sha256:
                raise LoggedAlreadyError(
                    f"{drop.record} is in the log already, as drop {number} of {drop.machine} with bearings "
                    f"{other.bearing_set}; a recording counts once. 'rotordrop log remove LOG {number}' "
                    "takes that entry out, and this one can be added",
                    number,
                )
        return DROP, content

    return append(where, made)


def remove_drop(where: str | Path, number: int) -> None:
    """Let an entry of a log count no more, whether it is damaged or not."""

    def made(found: Rows) -> tuple[str, str]:
        rows = {one for one, (kind, _) in found.whole.items() if kind != REMOVAL}
        known = (rows | set(found.wrong)) - _removed(found)
        if type(number) is not int or number not in known:
            raise UsageError(f"the log has no drop {number}; 'rotordrop log show' lists them")
        return REMOVAL, json.dumps({"number": number})

    read_rows(where)  # a log that is not there is not made
    append(where, made)


def logged_drops(where: str | Path | Log, *, machine: str | None = None) -> dict[int, LoggedDrop]:
    """Drops of a log by number, in the order they happened."""
    require(machine, "name of a machine", str, none=True)
    return {n: drop for n, drop in read_log(where).drops.items() if machine in (None, drop.machine)}


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
    allowed = Allowance(machine=machine, bearing_set=bearing_set, drops=drops, seconds=seconds, source=source)
    content = _checked(allowed, _ALLOWANCE)
    append(where, lambda found: (ALLOWANCE, content))


@dataclass(frozen=True)
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

    @property
    def passed(self) -> bool:
        """Whether a limit is passed."""
        return self.drops_passed_at is not None or self.seconds_passed_at is not None

    def sentence(self) -> str:
        """The share in words."""
        who = f"{self.machine}, bearings {self.bearing_set}"
        if self.allowed_drops is None and self.allowed_seconds is None:
            return f"{who}: {_drops(self.drops)}; no allowance given"
        left_out = f", {_drops(self.untimed)} without duration left out" if self.untimed else ""
        parts = [
            _share(self.drops, self.allowed_drops, " drops", "", self.drops_passed_at),
            _share(self.seconds, self.allowed_seconds, " s", left_out, self.seconds_passed_at),
        ]
        return f"{who}: {'; '.join(part for part in parts if part)}, allowed by {self.source}"


def _drops(count: int) -> str:
    return f"{count} {'drop' if count == 1 else 'drops'}"


def _share(used: float, allowed: float | None, unit: str, note: str, passed: int | None) -> str:
    """What is used of one limit, and which drop passed it."""
    if allowed is None:
        return ""
    own = "" if unit == " drops" else f"{unit}"
    beyond = f", the limit of {allowed:g}{unit} is passed by {used - allowed:.3g}{own}, with drop {passed}"
    share = f"{used:.4g}{own} of {allowed:g}{unit} ({100 * used / allowed:.3g} %{note})"
    return share if passed is None else share + beyond


def used_shares(where: str | Path | Log) -> tuple[UsedShare, ...]:
    """How much every machine and set of bearings has used of what it is allowed."""
    found = read_log(where)
    logged: dict[tuple[str, str], dict[int, float | None]] = {key: {} for key in found.allowances}
    for number, drop in found.drops.items():
        logged.setdefault((drop.machine, drop.bearing_set), {})[number] = drop.duration
    shares = []
    for key, lasted in sorted(logged.items()):
        allowed = found.allowances.get(key, Allowance())
        known = [one for one in lasted.values() if one is not None]
        times = [one or 0.0 for one in lasted.values()]
        most, longest = allowed.drops, math.inf if allowed.seconds is None else allowed.seconds
        passed = (n for k, n in enumerate(lasted, start=1) if math.fsum(times[:k]) > longest)
        shares.append(
            UsedShare(
                *(*key, len(lasted), most, math.fsum(known), allowed.seconds),
                untimed=len(lasted) - len(known),
                source=allowed.source,
                drops_passed_at=None if most is None else next(iter([*lasted][most:]), None),
                seconds_passed_at=next(passed, None),
            )
        )
    return tuple(shares)


def drop_of_estimate(drop: Drop, bearing_set: str, **known: Any) -> LoggedDrop:
    """A drop as its published estimate tells it, beside which set of touchdown bearings it was.

    ``known`` is what the estimate does not know: ``duration`` [s], ``cause``, and ``recorded``, where its
    recorder wrote no date or a wrong one.
    """
    require(drop, "drop", Drop)
    severity = [
        Severity(bearing=name, quantity=quantity, unit=unit, value=found.value, lower=ends[0], upper=ends[1])
        for name, bearing in sorted(drop.bearings.items())
        for quantity, unit in sorted(QUANTITIES.items())
        # a number without an interval is no evidence
        if (found := bearing.stated(quantity)) is not None and (ends := found.interval) is not None
    ]
    return LoggedDrop(
        machine=drop.machine,
        bearing_set=bearing_set,
        record=drop.record,
        sha256=drop.record_sha256,
        speed=2.0 * math.pi * drop.speed_Hz,
        method=drop.method,
        verdict=drop.verdict,
        consistent=drop.consistent,
        simulated=drop.simulated_record,
        went_on=bool(drop.went_on),
        version=drop.rotordrop_version,
        fingerprint=drop.fingerprint,
        severity=tuple(severity),
        **{**known, "recorded": known.get("recorded") or drop.recorded},
    )


@dataclass(frozen=True)
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
    for key, values in series.items():
        if len(values) < FEWEST_FOR_TREND:
            continue
        from scipy.stats import kendalltau  # half a second, for those who have that many drops

        tau, chance = kendalltau(range(len(values)), values)
        if chance < BY_CHANCE:
            found.append(Trend(*key, len(values), float(tau), float(chance)))
    return tuple(found)
