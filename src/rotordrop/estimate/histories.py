"""Histories of an estimate as columns against one time, and as files of the usual programs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.errors import OutputError, UsageError, needing
from rotordrop.estimate.bearing_drop import BearingDrop, Motion
from rotordrop.files import atomic_path, new_hdf5
from rotordrop.labelled import Stored, put

if TYPE_CHECKING:
    import pandas
    import xarray

    from rotordrop.estimate.estimate import Estimate
    from rotordrop.machine import Machine

FORMATS = (".h5", ".nc", ".csv", ".mat", ".parquet")
"""Suffixes of the files that histories can be written to."""
SIMULATED_COLUMN = "simulated"
"""Heading of the last column of a CSV file with numbers of a simulated record; it says yes in every row."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """One quantity of one bearing against time."""

    quantity: str
    bearing: str
    """What it is, such as "force", and where."""
    unit: str
    text: str
    """SI unit and name for people."""
    values: Array
    """Values; NaN where the history does not reach, shape (T,)."""

    @property
    def label(self) -> str:
        """Heading of a column, such as "NDE force [N]"."""
        return f"{self.bearing} {self.quantity.replace('_', ' ')} [{self.unit}]"


def finest_time(estimate: Estimate) -> Array:
    """Times of the force that has the most [s], shape (T,): one of the cross-check has samples alone."""
    return max((bearing.force.time for bearing in estimate.bearings), key=len)


def history_columns(estimate: Estimate) -> tuple[Array, tuple[Column, ...]]:
    """Whole steps of time [s], shape (T,), and every history of every bearing against it.

    Zero is the instant nearest to power-off, which is known no better than to half a step.
    """
    own = finest_time(estimate)
    step = (own[-1] - own[0]) / (len(own) - 1)
    return step * (round(own[0] / step) + np.arange(len(own))), tuple(
        column for bearing in estimate.bearings for column in columns_of(bearing, estimate.machine, own)
    )


def columns_of(bearing: BearingDrop, machine: Machine, time: Array) -> Iterator[Column]:
    """Every history of a bearing at some times [s], shape (T,)."""

    def column(quantity: str, unit: str, text: str, at: Array, values: Array) -> Column:
        on_time = values if at is time else np.interp(time, at, values, left=np.nan, right=np.nan)
        return Column(quantity=quantity, bearing=bearing.name, unit=unit, text=text, values=on_time)

    for name, unit, text, history, band in (
        ("force", "N", "ball force on the race", bearing.force, bearing.force_band),
        ("stress", "Pa", "largest Hertz stress at the inner race", bearing.stress, bearing.stress_band),
    ):
        yield column(name, unit, text, history.time, history.values)
        if band is not None:
            yield column(f"{name}_lower", unit, f"{text}, lower end of 90 %", band.time, band.lower)
            yield column(f"{name}_upper", unit, f"{text}, upper end of 90 %", band.time, band.upper)
    if bearing.force_vector is not None:
        for k, axis in enumerate("xy"):
            text = f"ball force on the race along {axis}"
            yield column(f"force_{axis}", "N", text, bearing.force.time, bearing.force_vector[:, k])
    for motion in bearing.motions:
        for k, axis in enumerate("xy"):
            text = f"displacement of the rotor along {axis}, {motion.label}"
            yield column(f"{quantity_of(motion)}_{axis}", "m", text, motion.time, motion.displacement[:, k])
    load = numbers_of(machine.bearing(bearing.name)).load_of_stress(bearing.stress.values)
    yield column("largest_ball_load", "N", "load of the most loaded ball", bearing.stress.time, load)


def quantity_of(motion: Motion) -> str:
    """What the columns of a motion are called, before their axis."""
    return motion.role.replace(", ", " ").replace(" ", "_")


def loads_of_balls(estimate: Estimate, name: str) -> Array:
    """Load of every ball of a bearing [N], shape (T, rows, Z), against the time of its force.

    Raises
    ------
    UsageError
        Where the direction of the force is not known: a bearing whose loads are those of the cross-check.
    """
    bearing = estimate.bearing(name)
    if bearing.force_vector is None:
        raise UsageError(
            f"the loads of single balls at {name} are not known: its force comes from the "
            f"{bearing.peak_force.origin}, which gives no direction; take the largest load"
        )
    return numbers_of(estimate.machine.bearing(name)).element_loads_under(bearing.force_vector)


def _by_quantity(columns: tuple[Column, ...], names: Sequence[str]) -> Iterator[tuple[Column, Array]]:
    """A column of every quantity, and its values at all bearings, NaN where one has none, shape (T, B)."""
    for quantity in dict.fromkeys(c.quantity for c in columns):
        found = {c.bearing: c for c in columns if c.quantity == quantity}
        one = next(iter(found.values()))
        missing = replace(one, values=np.full(len(one.values), np.nan))
        yield one, np.stack([found.get(name, missing).values for name in names], axis=1)


def _marks(estimate: Estimate) -> dict[str, str]:
    """What every file says of a simulated record; nothing of a measured one."""
    return {"simulated_record": "yes"} if estimate.simulated_record else {}


def as_dataframe(estimate: Estimate) -> pandas.DataFrame:
    """Histories as a table with columns (bearing, quantity), indexed by time [s]; units in ``attrs``."""
    with needing("tables"):
        import pandas

    time, columns = history_columns(estimate)
    frame = pandas.DataFrame(
        {(c.bearing, c.quantity): c.values for c in columns}, index=pandas.Index(time, name="time")
    )
    frame.columns.names = ["bearing", "quantity"]
    frame.attrs = {"units": {c.quantity: c.unit for c in columns}, "drop": estimate.name} | _marks(estimate)
    return frame


def as_dataset(estimate: Estimate) -> xarray.Dataset:
    """Histories as a labelled data set over time and bearing; every variable has units and a long name."""
    with needing("tables"):
        import xarray

    time, columns = history_columns(estimate)
    names = [bearing.name for bearing in estimate.bearings]
    variables = {
        one.quantity: (("time", "bearing"), values, {"units": one.unit, "long_name": one.text})
        for one, values in _by_quantity(columns, names)
    }
    attributes = {"drop": estimate.name, "machine": estimate.machine.name, "verdict": estimate.sentence}
    attributes |= _marks(estimate)
    data = xarray.Dataset(variables, coords={"time": time, "bearing": names}, attrs=attributes)
    data["time"].attrs = {"units": "s", "long_name": "time from power-off, to half a step"}
    return data


def write_histories(estimate: Estimate, path: str | Path) -> None:
    """Write the histories to a file whose suffix says the format: .h5, .nc, .csv, .mat or .parquet."""
    path = Path(path)
    suffix = require_format(path)
    time, columns = history_columns(estimate)
    {".csv": _csv, ".mat": _mat, ".parquet": _parquet}.get(suffix, _hdf5)(estimate, time, columns, path)


def require_format(path: Path) -> str:
    """Suffix of a file for histories; refuse one that names no format, or whose package is missing."""
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise OutputError(
            f"{path}: {suffix or 'no suffix'!r} is not a format of histories; "
            f"write one of {', '.join(FORMATS)}"
        )
    if suffix == ".parquet":
        with needing("tables"):
            import pyarrow  # noqa: F401
    return suffix


def _csv(estimate: Estimate, time: Array, columns: tuple[Column, ...], path: Path) -> None:
    """Comma and decimal point; the first line says the columns with their units."""
    table = np.column_stack([time, *(c.values for c in columns)])
    header = ",".join(["time [s]", *(c.label for c in columns)])
    row = ",".join(["%.9g"] * table.shape[1])
    if estimate.simulated_record:
        header, row = f"{header},{SIMULATED_COLUMN}", f"{row},yes"
    with atomic_path(path) as temporary:
        np.savetxt(temporary, table, header=header, comments="", fmt=row, encoding="utf-8")


def _mat(estimate: Estimate, time: Array, columns: tuple[Column, ...], path: Path) -> None:
    """MATLAB 5: ``time`` and one struct per bearing; ``about`` and ``units`` say what is in which unit."""
    from scipy.io import savemat

    content: dict[str, Any] = {"time": time, "drop": estimate.name, "machine": estimate.machine.name}
    content |= _marks(estimate)
    for c in columns:
        content.setdefault(re.sub(r"\W", "_", f"b_{c.bearing}"), {})[c.quantity[:31]] = c.values
    content["about"] = "b_NAME: histories at the touchdown bearing NAME; units says in which unit"
    content["units"] = {c.quantity[:31]: c.unit for c in columns} | {"time": "s"}
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        savemat(stream, content, do_compression=True, oned_as="column")


def _parquet(estimate: Estimate, time: Array, columns: tuple[Column, ...], path: Path) -> None:
    import pyarrow
    from pyarrow import parquet

    fields = {"time [s]": time} | {c.label: c.values for c in columns}
    with atomic_path(path) as temporary:
        marked = pyarrow.table(fields).replace_schema_metadata(_marks(estimate))
        parquet.write_table(marked, temporary)


def _hdf5(estimate: Estimate, time: Array, columns: tuple[Column, ...], path: Path) -> None:
    """HDF5 that opens as NetCDF4: every quantity over time and bearing, with units and long name."""
    names = tuple(bearing.name for bearing in estimate.bearings)
    with new_hdf5(path, track_order=True) as file:
        file.attrs["Conventions"] = "CF-1.8"
        file.attrs["format"] = "rotordrop histories 1"
        file.attrs["drop"], file.attrs["machine"] = estimate.name, estimate.machine.name
        file.attrs["verdict"] = estimate.sentence
        file.attrs.update(_marks(estimate))
        file.attrs["record_sha256"] = estimate.record.sha256
        put(file, "time", time, Stored("time", "s", "time from power-off, to half a step"))
        put(file, "bearing", names, Stored("bearing"))
        for one, values in _by_quantity(columns, names):
            put(file, one.quantity, values, Stored("time bearing", one.unit, one.text))
