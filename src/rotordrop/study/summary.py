"""What a study says: quantiles, probabilities and maps, each with the interval its drops allow."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import beta, binom

from rotordrop.arrays import Array
from rotordrop.errors import DamagedFileError, OutputError, UsageError, needing, unknown_key
from rotordrop.known import Known
from rotordrop.require import require
from rotordrop.sketch import sketch
from rotordrop.study.folder import StudyFolder, read_plan, read_shards, study_of
from rotordrop.study.plan import Study
from rotordrop.study.quantities import Quantity, columns_of

if TYPE_CHECKING:
    import pandas

COVER = 0.90
"""Probability with which every interval here holds [1], the standard of the package."""


@dataclass(frozen=True, kw_only=True)
class StudyResults:
    """Finished drops of a study, in order; N drops, V varied values, Q quantities."""

    study: Study
    """What was computed."""
    drop: NDArray[np.int64]
    """Number of each drop, shape (N,)."""
    varied: Mapping[str, Array]
    """Values drawn [SI], by path or case name, shape (N,)."""
    numbers: Mapping[str, Array]
    """Quantities [SI] by column, NaN where a drop has none, shape (N,)."""
    reasons: tuple[str, ...]
    """Why a drop failed; empty where it did not."""
    aside: tuple[str, ...] = ()
    """Files of damaged shards that were kept and computed again."""
    version: str = ""
    """Version of rotordrop that computed them."""

    def __len__(self) -> int:
        return len(self.drop)

    def __repr__(self) -> str:
        """Name of the study, drops, what was varied."""
        lost = sum(self.failed.values())
        return f"<StudyResults {self.study.name}: {len(self)} drops, {lost} failed; {', '.join(self.varied)}>"

    def _repr_html_(self) -> str:
        found = {n: np.sort(v[np.isfinite(v)]) for n, v in self.numbers.items() if n.endswith(".peak_force")}
        forces = {name: (v, np.arange(1, len(v) + 1) / max(len(v), 1)) for name, v in found.items()}
        return sketch(repr(self), "peak force [N]", "share below [1]", forces)

    @property
    def columns(self) -> tuple[Quantity, ...]:
        """Quantities with unit and meaning."""
        return columns_of(self.study.machine)

    @property
    def failed(self) -> Mapping[str, int]:
        """How many drops failed, by reason."""
        return Counter(reason for reason in self.reasons if reason)

    def to_dataframe(self) -> pandas.DataFrame:
        """One row per drop: number, what was varied [SI], quantities (units in ``attrs``), why it failed."""
        with needing("tables"):
            import pandas

        table = pandas.DataFrame({"drop": self.drop, **self.varied, **self.numbers, "reason": self.reasons})
        table.attrs["units"] = {quantity.name: quantity.unit for quantity in self.columns}
        return table

    def column(self, name: str) -> Array:
        """A quantity or a varied value of every drop, shape (N,) [SI]."""
        if require(name, "column", str) in self.numbers:
            return self.numbers[name]
        if name in self.varied:
            return self.varied[name]
        raise UsageError(unknown_key(name, (*self.numbers, *self.varied)))

    def quantile(self, name: str, share: float) -> Known:
        """Quantile of a quantity over all drops that have it."""
        return quantile(self.column(name), share)

    def exceedance(self, name: str, limit: float) -> Known:
        """Probability that a quantity is above a limit [SI], among drops that were computed."""
        return exceedance(self.column(name)[self._computed], limit)

    @property
    def _computed(self) -> NDArray[np.bool_]:
        return np.array([not reason for reason in self.reasons], dtype=bool)

    def map(
        self, name: str, by: str, *, cells: int = 10, share: float = 0.5, above: float | None = None
    ) -> list[dict[str, Any]]:
        """Quantile of a quantity, or the probability that it exceeds a limit [SI], against a varied value.

        Over cells with equal numbers of drops; a value with fewer distinct values has one cell for each.
        Every cell has ``from``, ``to`` [SI of the varied value] and ``known``, a `Known`; a probability
        counts among the drops that were computed. Too few drops for either end give no interval, and
        ``source`` says how many do.
        """
        x, y = self.column(by), self.column(name)
        place, done = cells_of(x, cells), self._computed
        groups = [place == k for k in range(int(place.max(initial=-1)) + 1)]

        def known(group: NDArray[np.bool_]) -> Known:
            if above is None:
                unit = next((one.unit for one in self.columns if one.name == name), "")
                found = replace(quantile(y[group], share), unit=unit)
                if math.isfinite(found.low) or math.isfinite(found.high):
                    return found
                least = math.ceil(math.log(0.5 * (1.0 - COVER)) / math.log(max(share, 1.0 - share)))
                text = f"an interval needs {least} drops in a cell, there are {found.drops}"
                return replace(found, interval_90=None, source=text)
            return exceedance(y[group & done], above)

        return [
            {"from": float(x[g].min()), "to": float(x[g].max()), "known": known(g)} for g in groups if g.any()
        ]


def cells_of(x: Array, cells: int) -> NDArray[np.int64]:
    """Number of the cell of every value: cells of equal numbers; one for each of a few distinct values."""
    levels = np.unique(x)
    if len(levels) <= cells:
        return np.searchsorted(levels, x).astype(np.int64)
    rank = np.argsort(np.argsort(x, kind="stable"), kind="stable")
    return np.asarray(rank * cells // len(x))


def quantile(values: ArrayLike, share: float) -> Known:
    """Quantile with a 90 % interval from order statistics, free of any assumption about the distribution.

    NaN among the values are left out; an end that the number of values cannot give is infinite, a quantile
    beyond the outermost of them NaN.
    Source: David and Nagaraja, Order Statistics, 2003, section 7.1: the number of values below the quantile
    is binomial.
    """
    if not 0.0 < require(share, "share", float) < 1.0:
        raise UsageError(f"quantile {share!r}; expected a number between 0 and 1, such as 0.99")
    x = np.sort(np.asarray(values, dtype=np.float64))
    x = x[np.isfinite(x)]
    n = len(x)
    if n == 0:
        return _counted(math.nan, (-math.inf, math.inf), 0)
    tail = 0.5 * (1.0 - COVER)
    low = int(binom.ppf(tail, n, share))  # at least so many lie below the quantile, but for `tail`
    if binom.cdf(low - 1, n, share) > tail:
        low -= 1
    high = int(binom.isf(tail, n, share)) + 1
    lower = float(x[low - 1]) if low >= 1 else -math.inf
    upper = float(x[high - 1]) if high <= n else math.inf
    beyond = min(share, 1.0 - share) < 0.5 / n
    return _counted(math.nan if beyond else float(np.quantile(x, share, method="hazen")), (lower, upper), n)


def exceedance(values: ArrayLike, limit: float) -> Known:
    """Probability to lie above a limit, with its exact binomial 90 % interval.

    Source: Clopper and Pearson, Biometrika 26, 1934. Values that are NaN count as not above.
    """
    x = np.asarray(values, dtype=np.float64)
    n, k = len(x), int(np.count_nonzero(x > require(limit, "limit", float)))
    if n == 0:
        return share_of(math.nan, 0, 0, 0)
    return share_of(k / n, k, k, n)


def share_of(value: float, least: int, most: int, drops: int) -> Known:
    """A share of drops with the interval of Clopper and Pearson, for a count between two ends."""
    tail = 0.5 * (1.0 - COVER)
    lower = float(beta.ppf(tail, least, drops - least + 1)) if least else 0.0
    upper = float(beta.isf(tail, most + 1, drops - most)) if most < drops else 1.0
    return _counted(value, (lower, upper), drops)


def _counted(value: float, interval: tuple[float, float], drops: int) -> Known:
    return Known(value=value, status="estimated", interval_90=interval, drops=drops)


def load_results(folder: str | Path) -> StudyResults:
    """Read the finished drops of a study folder, in order; the work may still go on.

    Of a study that ended early only the drops that ended it: which others were finished by then is chance.
    """
    study, place, plan = study_of(folder), StudyFolder(Path(folder)), read_plan(folder)
    enough = EarlyEnd(study, place).shards()
    shards = place.finished() if enough is None else list(range(enough))
    found = [table for _, table in read_shards(place, study, shards)]
    damaged = [table for table in found if isinstance(table, DamagedFileError)]
    if damaged:
        more = f" (and {len(damaged) - 1} more)" if len(damaged) > 1 else ""
        raise DamagedFileError(f"{damaged[0]}{more}")
    tables = [table for table in found if not isinstance(table, DamagedFileError)]
    varied = [table["varied"] for table in tables] or [np.zeros((0, len(study.varied)))]
    columns = columns_of(study.machine)
    numbers = [table["numbers"] for table in tables] or [np.zeros((0, len(columns)))]
    together, drawn = np.concatenate(numbers), np.concatenate(varied)
    return StudyResults(
        study=study,
        drop=np.concatenate([table["drop"] for table in tables] or [np.zeros(0, dtype=np.int64)]),
        varied={name: drawn[:, j] for j, name in enumerate(study.varied)},
        numbers={q.name: together[:, j] for j, q in enumerate(columns)},
        reasons=tuple(text.decode() for table in tables for text in table["reason"]),
        aside=tuple(place.aside()),
        version=plan["rotordrop"],
    )


class EarlyEnd:
    """Looks whether the quantile that ends a study early is known; reads every shard once, however often.

    Only the unbroken row of shards since the first counts, looked at after 1, 2, 3, … shards and then in
    steps of about an eighth, so that the answer does not depend on which shard was finished first.
    """

    def __init__(self, study: Study, place: StudyFolder) -> None:
        self._study = study
        self._place = place
        self._values: list[Array] = []
        self._next_look = 1
        self._needed: int | None = None

    def shards(self) -> int | None:
        """Number of shards from the first on that are enough; None while they are not."""
        study, until = self._study, self._study.until
        if until is None or self._needed is not None:
            return self._needed
        column = [q.name for q in columns_of(study.machine)].index(until.column)
        while (k := len(self._values)) < study.shards and self._place.shard_path(k).exists():
            ((_, found),) = read_shards(self._place, study, [k])
            if isinstance(found, DamagedFileError):
                raise found
            self._values.append(found["numbers"][:, column])
            if k + 1 < self._next_look:
                continue
            self._next_look = max(self._next_look + 1, self._next_look * 9 // 8)
            known = quantile(np.concatenate(self._values), until.quantile)
            if 0.5 * (known.high - known.low) <= until.within * abs(known.value):
                self._needed = k + 1
                break
        return self._needed


def save_results(results: StudyResults, path: str | Path) -> None:
    """Write all drops as one columnar file, complete or not at all: ``.parquet``, else HDF5 (NetCDF4)."""
    from rotordrop.files import new_hdf5
    from rotordrop.labelled import Stored, put

    if not len(results):
        raise OutputError(f"{path}: the study has no finished drops yet; run it first")
    if Path(path).suffix.lower() == ".parquet":
        _save_parquet(results, Path(path))
        return
    with new_hdf5(path, track_order=True) as file:
        file.attrs["format"] = "rotordrop study results 1"
        file.attrs["study"] = results.study.name
        file.attrs["digest"] = results.study.digest
        file.attrs["rotordrop"] = results.version
        put(file, "drop", results.drop, Stored("drop"))
        units = {q.name: (q.unit, q.meaning) for q in results.columns}
        for name, values in {**results.varied, **results.numbers}.items():
            unit, meaning = units.get(name, ("SI", "varied value"))
            put(file, name, values, Stored("drop", unit, meaning))
        reasons = np.array([reason.encode() for reason in results.reasons], dtype="S160")
        put(file, "failure", reasons, Stored("drop"))


def _save_parquet(results: StudyResults, path: Path) -> None:
    """One column a value; units and digest in the metadata of the file."""
    from rotordrop.files import atomic_path

    with needing("tables"):
        import pyarrow
        from pyarrow import parquet

    columns = {"drop": results.drop, **results.varied, **results.numbers, "failure": list(results.reasons)}
    units = {q.name: q.unit for q in results.columns}
    metadata = {"study": results.study.name, "digest": results.study.digest, "units": json.dumps(units)}
    with atomic_path(path) as temporary:
        parquet.write_table(pyarrow.table(columns).replace_schema_metadata(metadata), temporary)
