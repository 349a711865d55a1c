"""What a file holds, before anybody has said which column is which sensor of the machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_UNITS = {
    "m": "m", "mm": "mm", "um": "um", "µm": "um", "μm": "um", "micron": "um", "nm": "nm",
    "mil": "mil", "mils": "mil", "in": "in", "inch": "in",
    "v": "V", "volt": "V", "mv": "mV",
    "hz": "Hz", "rpm": "rpm", "1/min": "rpm", "u/min": "rpm", "r/min": "rpm", "min-1": "rpm",
    "min^-1": "rpm", "min⁻¹": "rpm", "/min": "rpm",
    "rad/s": "rad/s", "s": "s", "sec": "s", "ms": "ms", "us": "us", "µs": "us", "μs": "us", "min": "min",
}  # fmt: skip
_LONGEST_NAME = 200

MARKS = "mark_passages"
"""Channel of a saved record that holds when a mark of the shaft passed [s]."""


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One column, dataset or variable of a file, with its own clock."""

    name: str
    """Name without the unit."""
    label: str
    """Name as written in the file, unit in brackets removed."""
    unit: str
    """Unit as this package spells it, empty where the file names none."""
    values: Array
    """Samples, in `unit`, shape (N,)."""
    time: Array
    """Time of each sample [s], shape (N,)."""


@dataclass(frozen=True, kw_only=True)
class Recording:
    """All channels of a file and what the file says about them."""

    channels: tuple[Channel, ...]
    """In the order of the file."""
    metadata: Mapping[str, str] = field(default_factory=dict)
    """Header entries as written."""
    notes: tuple[str, ...] = ()
    """Choices the reader made, for the report."""
    warnings: tuple[str, ...] = ()
    """Damage the reader worked around; each says what is missing."""
    sensitivity: float | None = None
    """Volts per metre [V/m] stated in the file for all channels."""
    voltage_offset: float = 0.0
    """Voltage at zero displacement stated in the file [V]."""


def known_unit(text: str) -> str | None:
    """Give a unit in this package's spelling, or None when the text is not one found in recordings."""
    return _UNITS.get(text.strip().strip("[]()").lower())


def split_unit(written: str) -> tuple[str, str, str]:
    """Take a column name apart: ``"S_A [um]"`` and ``"S_A_um"`` give ``("S_A", label, "um")``.

    Returns
    -------
    name : str
        The name without its unit.
    label : str
        The name without brackets, a unit-like ending kept: ``Probe_V`` may be a vertical probe.
    unit : str
        The unit, empty when there is none.
    """
    written = " ".join(written[:_LONGEST_NAME].split())
    if written.endswith((")", "]")):
        name, mark, unit = written[:-1].rpartition("[" if written[-1] == "]" else "(")
        if mark:
            name, unit = name.strip(), unit.strip()
            return name, name, known_unit(unit) or unit
    name, mark, unit = written.rpartition("/")
    if mark and name.strip() and (name[-1] == " " or unit[:1] == " ") and known_unit(unit):
        return name.strip(), name.strip(), known_unit(unit) or ""
    name, mark, unit = written.rpartition("_")
    if name and mark and unit.isalpha() and known_unit(unit):
        return name, written, known_unit(unit) or ""
    return written, written, ""
