"""What a study says: quantiles, probabilities and maps, each with the interval its drops allow."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import beta, binom

from rotordrop.errors import OutputError, UsageError
from rotordrop.machine.description import unknown_key
from rotordrop.study.folder import StudyFolder, read_shard, study_of
from rotordrop.study.plan import Study
from rotordrop.study.quantities import Quantity, columns_of

Array = NDArray[np.float64]

COVER = 0.90
"""Probability with which every interval here holds [1]."""


@dataclass(frozen=True, kw_only=True)
class Known:
    """A number with its 90 % interval and the drops behind it; an open end is infinite."""

    value: float
    lower: float
    upper: float
    drops: int


@dataclass(frozen=True, kw_only=True)
class StudyResults:
    """Finished drops of a study, in order; N drops, V varied values, Q quantities.

    Attributes
    ----------
    study : Study
        What was computed.
    drop : ndarray, shape (N,)
        Number of each drop.
    varied : dict of ndarray, shape (N,)
        Values drawn [SI], by path or case name.
    numbers : dict of ndarray, shape (N,)
        Quantities [SI] by column, NaN where a drop has none.
    reasons : tuple of str, length N
        Why a drop failed; empty where it did not.
    """

    study: Study
    drop: NDArray[np.int64]
    varied: Mapping[str, Array]
    numbers: Mapping[str, Array]
    reasons: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.drop)

    @property
    def columns(self) -> tuple[Quantity, ...]:
        """Quantities with unit and meaning."""
        return columns_of(self.study.machine)

    @property
    def failed(self) -> Mapping[str, int]:
        """How many drops failed, by reason."""
        counts: dict[str, int] = {}
        for reason in self.reasons:
            if reason:
                counts[reason] = counts.get(reason, 0) + 1
        return counts

    def column(self, name: str) -> Array:
        """A quantity or a varied value of every drop, shape (N,) [SI]."""
        if name in self.numbers:
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

    def map(self, name: str, by: str, *, cells: int = 10, share: float = 0.5) -> list[dict[str, Any]]:
        """Quantile of a quantity against a varied value, cell by cell.

        Parameters
        ----------
        name : str
            Quantity.
        by : str
            Varied value.
        cells : int
            Cells with equal numbers of drops; a value with fewer distinct values has one cell for each.
        share : float
            Which quantile [1].

        Returns
        -------
        list of dict
            ``from``, ``to`` [SI of the varied value] and ``known``, a `Known`.
        """
        x, y = self.column(by), self.column(name)
        levels = np.unique(x)
        if len(levels) <= cells:
            groups = [x == level for level in levels]
        else:
            place = np.argsort(np.argsort(x, kind="stable"), kind="stable") * cells // len(x)
            groups = [place == k for k in range(cells)]
        return [
            {"from": float(x[g].min()), "to": float(x[g].max()), "known": quantile(y[g], share)}
            for g in groups
            if g.any()
        ]


def quantile(values: ArrayLike, share: float) -> Known:
    """Quantile with a 90 % interval from order statistics, free of any assumption about the distribution.

    Parameters
    ----------
    values : ndarray, shape (N,)
        Any unit; NaN are left out.
    share : float
        Which quantile [1].

    Notes
    -----
    Source: David and Nagaraja, Order Statistics, 2003, section 7.1: the number of values below the quantile
    is binomial. An end that the number of values cannot give is infinite.
    """
    if not 0.0 < share < 1.0:
        raise UsageError(f"quantile {share!r}; expected a number between 0 and 1, such as 0.99")
    x = np.sort(np.asarray(values, dtype=np.float64))
    x = x[np.isfinite(x)]
    n = len(x)
    if n == 0:
        return Known(value=math.nan, lower=-math.inf, upper=math.inf, drops=0)
    tail = 0.5 * (1.0 - COVER)
    low = int(binom.ppf(tail, n, share))  # at least so many lie below the quantile, but for `tail`
    if binom.cdf(low - 1, n, share) > tail:
        low -= 1
    high = int(binom.isf(tail, n, share)) + 1
    return Known(
        value=float(np.quantile(x, share, method="hazen")),
        lower=float(x[low - 1]) if low >= 1 else -math.inf,
        upper=float(x[high - 1]) if high <= n else math.inf,
        drops=n,
    )


def exceedance(values: ArrayLike, limit: float) -> Known:
    """Probability to lie above a limit, with its exact binomial 90 % interval.

    Source: Clopper and Pearson, Biometrika 26, 1934. Values that are NaN count as not above.
    """
    x = np.asarray(values, dtype=np.float64)
    n, k = len(x), int(np.count_nonzero(x > limit))
    if n == 0:
        return Known(value=math.nan, lower=0.0, upper=1.0, drops=0)
    tail = 0.5 * (1.0 - COVER)
    return Known(
        value=k / n,
        lower=float(beta.ppf(tail, k, n - k + 1)) if k else 0.0,
        upper=float(beta.isf(tail, k + 1, n - k)) if k < n else 1.0,
        drops=n,
    )


def load_results(folder: str | Path) -> StudyResults:
    """Read the finished drops of a study folder, in order; the work may still go on.

    Of a study that ended early only the drops that ended it: which others were finished by then is chance.
    """
    study, place = study_of(folder), StudyFolder(Path(folder))
    enough = shards_needed(study, place)
    return _joined(study, place, place.finished() if enough is None else range(enough))


def _joined(study: Study, place: StudyFolder, shards: Sequence[int]) -> StudyResults:
    tables = [read_shard(place, study, shard) for shard in shards]
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
    )


def shards_needed(study: Study, place: StudyFolder) -> int | None:
    """Number of shards from the first on that make the quantile known that ends a study early, or None.

    Only the unbroken row of shards since the first counts, looked at after 1, 2, 3, … shards and then in
    steps of about an eighth, so that the answer does not depend on which shard was finished first.
    """
    if study.until is None:
        return None
    finished = set(place.finished())
    row = next((k for k in range(study.shards) if k not in finished), study.shards)
    place_of = [q.name for q in columns_of(study.machine)].index(study.until.column)
    values: list[Array] = []
    looked = 1
    for k in range(row):
        values.append(read_shard(place, study, k)["numbers"][:, place_of])
        if k + 1 < looked:
            continue
        looked = max(looked + 1, looked * 9 // 8)
        found = quantile(np.concatenate(values), study.until.quantile)
        if 0.5 * (found.upper - found.lower) <= study.until.within * abs(found.value):
            return k + 1
    return None


def save_results(results: StudyResults, path: str | Path) -> None:
    """Write all drops as one columnar HDF5 file that opens as NetCDF4, complete or not at all.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    import h5py

    from rotordrop.atomic_file import atomic_path

    if not len(results):
        raise OutputError(f"{path}: the study has no finished drops yet; run it first")
    with atomic_path(Path(path)) as temporary, h5py.File(temporary, "w", track_order=True) as file:
        file.attrs["format"] = "rotordrop study results 1"
        file.attrs["study"] = results.study.name
        file.attrs["digest"] = results.study.digest
        file["drop"] = results.drop
        file["drop"].make_scale("drop")
        units = {q.name: (q.unit, q.meaning) for q in results.columns}
        for name, values in {**results.varied, **results.numbers}.items():
            unit, meaning = units.get(name, ("SI", "varied value"))
            dataset = file.create_dataset(name, data=values, compression="gzip", shuffle=True)
            dataset.attrs["units"], dataset.attrs["long_name"] = unit, meaning
            dataset.dims[0].attach_scale(file["drop"])
        reasons = np.array([reason.encode() for reason in results.reasons], dtype="S160")
        file.create_dataset("failure", data=reasons, compression="gzip").dims[0].attach_scale(file["drop"])
