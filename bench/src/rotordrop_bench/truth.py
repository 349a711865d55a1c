"""Read what is true about a simulated recording: ours and the supplied truth files have the same layout."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.document import read_json
from rotordrop.elements.table import published
from rotordrop.errors import UsageError
from rotordrop.severity.numbers import LOADS

_NEEDED = ("air_gap_m", "peak_force_N")
_STRESSES = {"peak_stress_Pa": ("max_stress_MPa", 1e6), "mean_stress_Pa": ("mean_stress_MPa", 1e6)}
"""Field and unit of a truth file for the fields of an estimate that it calls otherwise."""


SEEN_AS = {"tilted machine": "side force"}
"""Kinds of violations that a drop does not tell from another one."""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What is true about one simulated recording."""

    values: Mapping[str, Any]
    """The fields of the truth file."""
    histories: Mapping[str, Array] = field(default_factory=dict, repr=False)
    """True histories, empty when there is no file of them."""
    path: Path | None = None
    """Where the truth was read."""

    @property
    def name(self) -> str:
        """Name of the recording."""
        return str(self.values.get("name", self.path.stem if self.path else "truth"))

    @property
    def bearing_names(self) -> tuple[str, ...]:
        """Names of the touchdown bearings."""
        return tuple(self.values["air_gap_m"])

    @property
    def bearing_load(self) -> float:
        """Mean weight on a bearing [N]; where it is not stated, the mean force late in the drop."""
        weight = self.values.get("rotor_weight_N")
        if weight is None:
            return float(np.mean(list(self.values.get("mean_force_0p15_0p2_N", {}).values() or [0.0])))
        return float(weight) / len(self.bearing_names)

    def of_bearing(self, bearing: str) -> dict[str, float]:
        """True values of one bearing (SI) by path in an estimate, such as ``"support.mass_kg"``."""
        found = {row.field: self._of_bearing(bearing, row.truth) for row in published().values() if row.truth}
        for load in LOADS:
            place, unit = _STRESSES.get(load.field, (load.field, 1.0))
            found[load.field] = self._of_bearing(bearing, (place,), unit)
        return {path: value for path, value in found.items() if value is not None}

    @property
    def violated(self) -> tuple[str, ...]:
        """Kinds of violations, by the name that an estimate has for what it sees of them."""
        return tuple(SEEN_AS.get(kind, kind) for kind in self.values.get("violated", ()))

    @property
    def structure(self) -> dict[str, float]:
        """True values of structures beyond the base model [SI], by path such as ``"NDE.support.cubic"``."""
        return {path: float(value) for path, value in self.values.get("structure", {}).items()}

    def _of_bearing(self, bearing: str, place: tuple[str, ...], unit: float = 1.0) -> float | None:
        """A value of one bearing [SI]; None where this truth does not have it."""
        value = self.values.get(place[0])
        if isinstance(value, Mapping):
            value = value.get(bearing)
        elif isinstance(value, Sequence):
            value = value[self.bearing_names.index(bearing)].get(place[1])
        return None if value is None else unit * float(value)

    def impacts(self, bearing: str) -> Array:
        """Start [s], end [s] and peak force [N] of every contact of a bearing, shape (R, 3)."""
        rows = self.values.get("contact_intervals_0_0p25_s", {}).get(bearing, [])
        return np.asarray(rows, dtype=np.float64).reshape(-1, 3)


def read_truth(path: str | Path) -> Truth:
    """Read a truth file, ours or a supplied one, with the histories beside it (.npz) where they exist."""
    path = Path(path)
    values = read_json(path, "rotordrop-bench synthesize")
    histories = {}
    if (beside := path.with_suffix(".npz")).is_file():
        with np.load(beside) as stored:
            histories = {name: stored[name] for name in stored.files}
    return truth_of(values, path=path, histories=histories)


def truth_of(values: Any, *, path: Path | None = None, histories: Mapping[str, Array] | None = None) -> Truth:
    """Truth from the fields of a truth file, refused when it is none."""
    missing = [key for key in _NEEDED if not isinstance(values, Mapping) or key not in values]
    if missing:
        raise UsageError(
            f"{path or 'the given object'} is no truth file: it has no "
            f"{' and no '.join(map(repr, missing))}; "
            "give the .json that 'rotordrop-bench synthesize' wrote, or a supplied truth file"
        )
    return Truth(values=values, histories=histories or {}, path=path)
