"""Kept records estimated again by this version, and what moved beyond its interval in the log."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from rotordrop._version import __version__
from rotordrop.errors import RotordropError
from rotordrop.estimate.published import Drop, read_drop
from rotordrop.ledger.book import LoggedDrop, Severity, logged_drops
from rotordrop.watch.kept import DIGITS, Kept
from rotordrop.web.running import Runner, result_folder, state_of
from rotordrop.web.workspace import Job

PAUSE_S = 0.2
"""Pause between two looks at a computation [s]; chosen, not measured."""


@dataclass(frozen=True, kw_only=True)
class Again:
    """One logged number beside what this version estimates; no value where it is not stated any more."""

    number: int
    """Of the drop in the log."""
    record: str
    logged: Severity
    value: float | None
    lower: float | None
    upper: float | None
    """Estimate of this version with its 90 % interval [unit of the logged number]."""

    @property
    def moved(self) -> bool:
        """Whether it lies outside the logged interval, or is not stated any more."""
        return self.value is None or not self.logged.lower <= self.value <= self.logged.upper


@dataclass(frozen=True, kw_only=True)
class Reestimated:
    """A whole log estimated again."""

    numbers: tuple[Again, ...]
    left_out: dict[int, str]
    """Drops that could not be estimated again, and why."""

    def sentences(self) -> tuple[str, ...]:
        """What moved, and what was left out."""
        said = [
            f"drop {one.number}, {one.record}: {one.logged.quantity} at {one.logged.bearing} was "
            f"{one.logged.lower:.4g} to {one.logged.upper:.4g} {one.logged.unit} and is "
            + ("not stated now" if one.value is None else f"{one.value:.4g} {one.logged.unit} now")
            for one in self.numbers
            if one.moved
        ]
        drops = len({one.number for one in self.numbers})
        said.append(
            f"{len(said)} of {len(self.numbers)} numbers of {drops} drops moved beyond the logged interval"
        )
        said += [f"drop {number} was left out: {why}" for number, why in self.left_out.items()]
        return tuple(said)


def reestimate(
    log: str, kept: Kept, machine: str | None = None, say: Callable[[str], None] = lambda line: None
) -> Reestimated:
    """Estimate every logged drop whose record is kept, unless this version has done so already.

    The log stays as it is. What was done before an interruption is not done again.
    """
    runner, numbers, left_out = Runner(kept.space), [], {}
    for number, logged in logged_drops(log, machine=machine).items():
        job = kept.job(logged.sha256[:DIGITS] or "none")
        if not job.path.is_dir():
            left_out[number] = f"{logged.record} is not in {kept.path}"
            continue
        try:
            drop = _of_this_version(job, runner, lambda name=logged.record: say(name))  # type: ignore[misc]
        except RotordropError as error:
            left_out[number] = str(error)
            continue
        numbers += [_beside(number, logged, one, drop) for one in logged.severity]
    return Reestimated(numbers=tuple(numbers), left_out=left_out)


def _of_this_version(job: Job, runner: Runner, begin: Callable[[], None]) -> Drop:
    """The estimate of a drop by this version, made in the limited child where there is none."""
    folder = result_folder(job, "estimate", "document.json")
    if folder is not None:
        made = read_drop(folder / "document.json")
        if made.rotordrop_version == __version__:
            return made
    begin()
    options = (state_of(job, "estimate") or {}).get("options", {})
    state = runner.ask(job, "estimate", options)
    while state["state"] in ("waiting", "running"):
        time.sleep(PAUSE_S)
        runner.tend()
        state = state_of(job, "estimate") or state
    if state["state"] != "done" or (folder := result_folder(job, "estimate", "document.json")) is None:
        raise RotordropError(state.get("error") or f"the computation was {state['state']}")
    return read_drop(folder / "document.json")


def _beside(number: int, logged: LoggedDrop, one: Severity, drop: Drop) -> Again:
    bearing = drop.bearings.get(one.bearing)
    found = None if bearing is None else bearing.numbers.get(one.quantity)
    lower, upper = (found and found.interval) or (None, None)
    return Again(
        number=number,
        record=logged.record,
        logged=one,
        value=None if found is None else found.value,
        lower=lower,
        upper=upper,
    )
