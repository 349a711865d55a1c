"""What public functions are called with: as it is meant, or refused with a way out that works from Python."""

from __future__ import annotations

import math
import sys
from collections.abc import Collection, Iterable, Mapping
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotordrop.arrays import Array
from rotordrop.errors import RecordError, RotordropError, UsageError

LARGEST = sys.float_info.max
"""Beyond it a whole number of Python is no float."""

_WAYS = {
    "Machine": "load_machine('machine.toml') gives one",
    "Record": "read_record('drop.csv', machine) or Record.from_arrays(machine, ...) gives one",
    "DropCase": "write DropCase(speed='60 Hz')",
    "Study": "load_study('study.toml') gives one",
    "Profile": "write the name of its file",
}
_SPOKEN = {"int": "a whole number", "float": "a finite number", "bool": "True or False", "str": "a text"}
_SPOKEN |= {"Tracked": "Tracked(...)", "Replay": "Replay(...)", "PathLike": "a path"}


def require(
    value: Any,
    name: str,
    *kinds: type,
    none: bool = False,
    among: Collection[str] = (),
    least: float = -math.inf,
    above: float = -math.inf,
    most: float = math.inf,
    hint: str = "",
    error: type[RotordropError] = UsageError,
) -> Any:
    """Give an argument of one of some kinds, or ``error``; a number of numpy counts as one of Python.

    ``among`` are the texts it may be, ``least``, ``above`` and ``most`` bounds of a number, which is finite;
    ``hint`` is the way out, where the kinds do not tell it.
    """
    value = value.item() if isinstance(value, np.generic) else value
    fits = isinstance(value, (*kinds, int) if float in kinds else kinds) or (none and value is None)
    fits = (
        fits
        and (not isinstance(value, bool) or bool in kinds)
        and (not among or value is None or value in among)
    )
    if isinstance(value, int | float):
        fits = fits and abs(value) <= LARGEST and least <= value <= most and value > above
    elif isinstance(value, str | PathLike) and PathLike in kinds:
        fits = fits and "\0" not in str(value)
    if fits:
        return value
    expected = " or ".join(dict.fromkeys(_SPOKEN.get(kind.__name__, f"a {kind.__name__}") for kind in kinds))
    if above == 0.0:
        expected = f"a positive, {expected.removeprefix('a ')}"
    expected = f"one of {', '.join(among)}" if among else expected
    expected += f" of at least {least:g}" if least > -math.inf else ""
    expected += f" up to {most:g}" if most < math.inf else ""
    hint = hint or "; ".join(_WAYS[kind.__name__] for kind in kinds if kind.__name__ in _WAYS)
    raise error(f"{name} is {_shown(value)}; expected {expected}. {hint or 'Give another value'}.")


def each(
    values: Any, name: str, *kinds: type, none: bool = False, records: int | None = None
) -> tuple[Any, ...]:
    """Give a list of one of some kinds each, as many as there are records."""
    if not isinstance(values, Iterable) or isinstance(values, str | bytes | Mapping):
        raise UsageError(f"{name} is {_shown(values)}; expected a list, also of one: {name}=[...].")
    found = tuple(np.atleast_1d(values)) if isinstance(values, np.ndarray) else tuple(values)
    if records is not None and len(found) != records:
        wanted = "one, or None, for each" if none else "one for each"
        raise UsageError(f"{len(found)} {name} for {records} records; expected {wanted}.")
    return tuple(require(one, f"{name}[{i}]", *kinds, none=none) for i, one in enumerate(found))


def numbers(
    values: ArrayLike, name: str, shape: tuple[int, ...] | None = None, *, finite: bool = False
) -> Array:
    """Give real numbers as an array of their own; what is masked is missing (nan).

    An array that nobody can write to is taken as it is.
    """
    if type(values) is np.ndarray and values.dtype == np.float64 and not values.flags.writeable:
        array = values
    else:
        try:
            given = np.asanyarray(values)
            if given.dtype.kind not in "fiuO":
                raise TypeError(f"they are of the kind {given.dtype}")
            array = np.array(np.ma.filled(given.astype(np.float64, copy=False), np.nan), subok=False)
        except (TypeError, ValueError, OverflowError) as error:
            raise UsageError(
                f"{name} is {_shown(values)} that is no array of real numbers ({error}). "
                "Give numbers, np.nan where one is missing."
            ) from error
    if shape is not None and array.shape != shape:
        raise RecordError(f"{name} has the shape {array.shape}; expected {shape}.")
    if finite and not np.isfinite(array).all():
        raise RecordError(f"{name} holds {np.sum(~np.isfinite(array))} values that are no finite numbers.")
    return array


def _shown(value: object) -> str:
    """A number or a text as it is written, anything else by its kind."""
    if value is None or isinstance(value, str | bool | int | float):
        written = repr(value)
        return written if len(written) <= 60 else f"{written[:60]}…"
    return f"a {type(value).__name__}"
