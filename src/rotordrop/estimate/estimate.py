"""The estimate of one recorded drop: one frozen result for every method; pages and documents draw from it.

Nothing in here points into a filter: the arrays of a pass are hundreds of megabytes and go when the estimate
is made.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.parameter import Parameter
from rotordrop.errors import needing
from rotordrop.estimate.bearing_drop import BearingDrop
from rotordrop.estimate.bearing_values import with_severity
from rotordrop.estimate.published import (
    Advice,
    Agreement,
    InitialState,
    Joint,
    LaterMotion,
    Structure,
    later_warning,
    peak_text,
)
from rotordrop.evidence.contacts import TimedContact as TimedContact
from rotordrop.evidence.events import PowerOff
from rotordrop.evidence.quality.finding import Finding
from rotordrop.files import write_json
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.record.record import Record
from rotordrop.require import require
from rotordrop.sketch import sketch
from rotordrop.track.consistency import Check

if TYPE_CHECKING:
    import pandas
    import xarray


@dataclass(frozen=True, kw_only=True)
class PlaneUnbalance:
    """Unbalance of one plane as a drop shows it."""

    node: int
    """Where it sits, counted from 1."""
    amount: Known
    """Mass times radius [kg m]."""
    phase: Known | None
    """Direction of the heavy spot when the mark passes, from +y, positive with the spin [rad]; None where the
    record has no mark, or does not tell a direction."""
    reason: str = ""
    """Why there is no phase; empty where there is one."""

    def sentence(self) -> str:
        """Amount and phase with their 90 % intervals, or why there is no phase."""
        low, high = self.amount.interval_90 or (self.amount.value,) * 2
        size = f"{1e6 * self.amount.value:.3g} g mm (90 %: {1e6 * low:.3g} to {1e6 * high:.3g})"
        begin = f"unbalance at node {self.node}: {size}, its phase "
        if self.phase is None:
            return begin + self.reason
        at, (first, last) = math.degrees(self.phase.value), self.phase.interval_90 or (self.phase.value,) * 2
        spread = f"{math.degrees(first):.0f} to {math.degrees(last):.0f}°"
        return f"{begin}{at:.0f}° ({spread}) from +y with the spin when the mark of the shaft passes"


def unbalance_notes(planes: Sequence[PlaneUnbalance]) -> tuple[str, ...]:
    """What the planes say, or in one line why none of them has a phase."""
    if any(one.phase is not None for one in planes):
        return tuple(one.sentence() for one in planes)
    return tuple(
        f"the phase of the unbalance is {reason}" for reason in dict.fromkeys(p.reason for p in planes)
    )


@dataclass(frozen=True, kw_only=True)
class Tracked:
    """Follow the record with the drop model, by a filter and a smoother."""

    quick: bool = False
    """One pass instead of three; for a calibrated machine only."""

    def __post_init__(self) -> None:
        require(self.quick, "quick", bool)


@dataclass(frozen=True, kw_only=True)
class Replay:
    """Replay the drop open loop with what the twin identified of it (Neisi 2020, Fig. 4)."""


Method: TypeAlias = Tracked | Replay


class Verdict(Enum):
    """What model and record say of each other; the values are the sentences a reader sees first."""

    CONSISTENT = "The model follows the record."
    EXTENDED = "With an extension of the base model, the model follows the record."
    ONE_DIRECTION = (
        "Not every plane shows both directions: forces across the missing one rest on the model alone. "
        "Intervals are 2 × as wide, and no independent cross-check is possible."
    )
    WIDENED = (
        "The model does not follow the record. Only ranges are stated: they hold the independent "
        "cross-check too."
    )
    REPLACED = (
        "The model does not follow the record and lost it at a bearing. Loads there are those of the "
        "independent cross-check, as ranges."
    )
    UNDETERMINED = (
        "The model does not follow the record, and the record says that sensors are not as described: force "
        "and stress are not determined."
    )
    OPEN_LOOP = (
        "This is the paper's route, an open-loop replay: one drop like the recorded one, without intervals. "
        "The tracked twin follows the record and states them."
    )

    @property
    def holds(self) -> bool:
        """Whether single numbers may be relied on within their intervals."""
        return self not in (Verdict.WIDENED, Verdict.REPLACED, Verdict.UNDETERMINED)


@dataclass(frozen=True, kw_only=True)
class CrossCheck:
    """One number found in two ways."""

    name: str
    """What is compared, for example ``"NDE peak force"``."""
    estimate: Known
    """The number of the tracked twin."""
    check: float
    """The number of the estimate without contact law, in the same unit."""
    accuracy: float
    """Known accuracy of the latter, relative [1]; a larger difference is a warning."""
    replaced: bool = False
    """Whether the cross-check stands in place of the estimate."""

    @property
    def difference(self) -> float:
        """Relative difference of the cross-check from the twin [1]."""
        return self.check / self.estimate.value - 1.0 if self.estimate.value else math.nan

    @property
    def agrees(self) -> bool:
        """Whether the difference stays within the known accuracy."""
        return abs(self.difference) <= self.accuracy


@dataclass(frozen=True, kw_only=True)
class FittedParameter:
    """One unknown: its row in the parameter table, what was known before, and what the record made of it.

    ``owner`` is the bearing, magnet or unbalance it belongs to; ``prior`` None where nothing was known.
    """

    row: Parameter
    owner: str
    prior: Known | None
    estimate: Known

    @property
    def path(self) -> str:
        """Path in the machine, such as ``"NDE.support.stiffness"``."""
        return self.row.path_of(self.owner)

    @property
    def scope(self) -> str:
        """Whether it belongs to the machine or to this drop alone."""
        return "machine" if self.row.shared else "drop"


@dataclass(frozen=True, kw_only=True)
class SensorErrors:
    """Gain error [1] and offset [m] of one sensor as estimated, and its noise (standard deviation) [m]."""

    sensor: str
    gain_error: Known
    offset: Known
    noise: float


@dataclass(frozen=True, kw_only=True)
class Innovations:
    """What every reading said beyond the prediction from all before it; N samples, C channels."""

    channels: tuple[str, ...]
    """Names of the sensors."""
    time: Array
    """Time from power-off [s], shape (N,)."""
    values: Array
    deviation: Array
    """Reading minus prediction and its expected standard deviation [m]; NaN where nothing was read, shape (N,
    C)."""
    limits: tuple[float, float]
    """Mean normalised squares between which model and record count as consistent [1]."""


@dataclass(frozen=True, kw_only=True)
class SensorMotion:
    """Displacement along every sensor as it was read and as the estimate gives it; N samples, C channels."""

    channels: tuple[str, ...]
    """Names of the sensors."""
    time: Array
    """Time from power-off [s], shape (N,)."""
    measured: Array
    estimated: Array
    """Readings, NaN where nothing was read, and those of the estimated motion, gain and offset as found [m],
    shape (N, C)."""

    @property
    def rms(self) -> Array:
        """Root mean square of their difference [m], shape (C,)."""
        return np.asarray(np.sqrt(np.nanmean((self.measured - self.estimated) ** 2, axis=0)))


@dataclass(frozen=True, kw_only=True)
class ReplaySteps:
    """The steps of the paper's route beside the common result."""

    contacts: tuple[TimedContact, ...]
    """First contact of every bearing in the record, with the stiffness of eq. (17)."""
    initial_state: InitialState
    """Where it starts."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Estimate:
    """Force and stress of one recorded drop, with everything a page or a document says of it."""

    name: str
    """Name of the drop."""
    method: Method
    """How it was made."""
    machine: Machine
    """The machine as it was given."""
    record: Record
    """The recording."""
    drop_instant: PowerOff
    """Power-off in record time."""
    speed: float
    """Speed at power-off [rad/s]."""
    until: float
    """End of the estimated part [s from power-off]."""
    verdict: Verdict
    """What model and record say of each other."""
    bearings: tuple[BearingDrop, ...]
    """Histories, peaks, impacts and values of every bearing."""
    parameters: tuple[FittedParameter, ...]
    """Every unknown with prior and estimate."""
    checks: tuple[Check, ...] = ()
    """The consistency checks behind it; empty for a replay."""
    sensors: tuple[SensorErrors, ...] = ()
    """Gain, offset and noise of every sensor; empty for a replay."""
    joint: Joint | None = None
    """How the errors of parameters and sensors hang together; None where they are not held together."""
    unbalance: tuple[PlaneUnbalance, ...] = ()
    """Amount and phase of the unbalance of every plane; empty for a replay."""
    structure: tuple[Structure, ...] = ()
    """What the machine has beyond the base model; empty where that does."""
    cross_check: tuple[CrossCheck, ...] = ()
    """Comparisons with the estimate without contact law; empty where none was made."""
    innovations: Innovations | None = None
    """What the filter did not foresee; None for a replay."""
    at_sensors: SensorMotion | None = None
    """Measured beside estimated motion where it was measured; None for a replay."""
    nis: float | None = None
    noise_factor: float | None = None
    """Mean normalised innovation squared [1], and size of the process noise over the usual one [1]."""
    agreement: Agreement | None = None
    """How far the replayed drop follows the record."""
    replay: ReplaySteps | None = None
    """The steps of the paper's route."""
    advice: tuple[Advice, ...] = ()
    """Further numbers that would narrow the peak forces of a machine that is known by few; the best first."""
    later: tuple[LaterMotion, ...] = ()
    """What the rest of the record shows; empty where it has none."""
    findings: tuple[Finding, ...] = ()
    """What the gate found in the record."""
    warnings: tuple[str, ...] = field(default=())
    notes: tuple[str, ...] = field(default=())
    """What makes the numbers less certain, and what is worth knowing and does not."""
    assumed: Mapping[str, str] = field(default_factory=dict)
    """What a machine file leaves to assumption, in a few words, by the note that says more."""
    simulated_record: bool = False
    """Whether the record is known to be simulated."""

    @property
    def consistent(self) -> bool:
        """Whether single numbers may be relied on within their intervals."""
        return self.verdict.holds

    @cached_property
    def rated(self) -> tuple[BearingDrop, ...]:
        """The bearings with the fields of `severity.numbers.SEVERITY` among their values."""
        return tuple(with_severity(self, bearing) for bearing in self.bearings)

    @property
    def later_warning(self) -> str:
        """That the largest force may lie after the part that was estimated; empty where nothing says so."""
        return later_warning(self.later, self.until)

    @property
    def sentence(self) -> str:
        """The verdict, with what failed."""
        return self.verdict_in(str)

    def verdict_in(self, name_of: Callable[[str], str]) -> str:
        """The verdict, with what failed and with unknowns by the names that are given for their paths."""
        failed = "; ".join(dict.fromkeys(check.said(name_of) for check in self.checks if check.failed))
        said = " ".join((self.verdict.value, *(one.sentence for one in self.structure)))
        return f"{said} {failed[:1].upper()}{failed[1:]}." if failed else said

    def bearing(self, name: str) -> BearingDrop:
        """What happened at the bearing of a name.

        Raises
        ------
        UsageError
            If the machine has no such bearing; names those it has.
        """
        names = [one.name for one in self.bearings]
        return self.bearings[names.index(require(name, "bearing", str, among=names))]

    def ball_loads(self, bearing: str) -> Array:
        """Load of every ball of a bearing [N], shape (T, rows, Z), at the times of its force."""
        from rotordrop.estimate.histories import loads_of_balls

        return loads_of_balls(self, bearing)

    def to_dataframe(self) -> pandas.DataFrame:
        """Histories as a table with columns (bearing, quantity) against time [s]; units in ``attrs``."""
        from rotordrop.estimate.histories import as_dataframe

        return as_dataframe(self)

    def to_xarray(self) -> xarray.Dataset:
        """Histories as a labelled data set with units and long names (needs ``rotordrop[tables]``)."""
        from rotordrop.estimate.histories import as_dataset

        return as_dataset(self)

    def to_dict(self) -> dict[str, Any]:
        """The estimate as the command line writes it as JSON."""
        from rotordrop.estimate.document import estimate_document

        return estimate_document(self)

    def save(self, path: str | Path) -> None:
        """Write the numbers (``.json``) or histories (``.h5``, ``.nc``, ``.csv``, ``.mat``, ``.parquet``).

        Raises
        ------
        OutputError
            If the suffix names no format, or the file cannot be written.
        """
        if Path(require(path, "path", str, PathLike)).suffix.lower() == ".json":
            write_json(path, self.to_dict(), sealed=True)
            return
        from rotordrop.estimate.histories import write_histories

        write_histories(self, path)

    def report(self, path: str | Path) -> None:
        """Write the report, one offline HTML file."""
        page = _above("rotordrop.report.estimate_page", "estimate_page")(self)
        _above("rotordrop.report.page", "write_page")(page, path)

    def rows(self) -> list[dict[str, Any]]:
        """One row per bearing: peaks, mean force and air gap with their intervals [SI]."""
        from rotordrop.estimate.document import published_drop

        return [row | {"drop": self.name} for row in published_drop(self).rows()]

    def __repr__(self) -> str:
        """Drop, machine and the peak force of every bearing."""
        peaks = "; ".join(f"{b.name} {peak_text(b.peak_force.known)}" for b in self.bearings)
        return f"<Estimate {self.name} of {self.machine.name}: {peaks}. {self.verdict.value}>"

    def summary(self) -> str:
        """What a terminal shows first: verdict, loads with intervals, what limits them, what to do next."""
        screen = _above("rotordrop.report.estimate_page", "estimate_screen")(self)
        return str(_above("rotordrop.report.terminal", "summary_text")(screen))

    def _repr_html_(self) -> str:
        forces = {b.name: (b.force.time, b.force.values) for b in self.bearings}
        return sketch(self.summary(), "time from power-off [s]", "force [kN]", forces, 1e-3)


class Estimates(tuple[Estimate, ...]):
    """Estimates of several drops; a tuple with one table."""

    __slots__ = ()

    def to_dataframe(self) -> pandas.DataFrame:
        """One row per drop and bearing: verdict, and `Estimate.rows` [SI]."""
        with needing("tables"):
            import pandas

        return pandas.DataFrame([row for estimate in self for row in estimate.rows()])

    def _repr_html_(self) -> str:
        return "".join(estimate._repr_html_() for estimate in self)


def _above(module: str, name: str) -> Any:
    """Something of the layer above: pages draw from estimates; who holds one asks it for its page.

    The only place where a lower layer reaches up; by name, so that nothing here depends on how pages look.
    """
    return getattr(import_module(module), name)
