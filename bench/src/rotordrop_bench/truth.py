"""Read what is true about a simulated recording, ours or a supplied one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rotordrop.document import read_json
from rotordrop.elements.table import published
from rotordrop.errors import UsageError
from rotordrop.severity.numbers import LOADS

_NEEDED = ("air_gap_m", "peak_force_N")
SUPPLIED: dict[str, tuple[str, ...]] = {
    "equivalent_stiffness_N_per_m": ("equivalent_stiffness",),
    "support.stiffness_N_per_m": ("support_stiffness",),
    "support.mass_kg": ("support_mass",),
    "support.damping_N_s_per_m": ("support_damping",),
    "contact.stiffness_N_per_m_n": ("contact_K",),
    "contact.exponent": ("contact", "n"),
    "contact.damping_s_per_m": ("contact", "lam"),
    "friction.static": ("friction_static",),
    "friction.dynamic": ("friction_dynamic",),
    "friction.stribeck_speed_m_per_s": ("contact", "v_stribeck"),
    "race.mass_kg": ("ring", "m"),
    "race.inertia_kg_m2": ("ring_Ip",),
    "race.drag_coefficient": ("bearing", "drag_mu"),
    "damping_time_s": ("bearing", "Cb_over_Kb"),
    "peak_stress_Pa": ("max_stress_MPa",),
    "mean_stress_Pa": ("mean_stress_MPa",),
}
"""Where a supplied truth file has what it calls otherwise than an estimate: a number, one for each bearing,
or a list of bearings and a key."""

SEEN_AS = {"tilted machine": "side force"}
"""Kinds of violations that a drop does not tell from another one."""


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What is true about one simulated recording."""

    values: Mapping[str, Any]
    """The fields of the truth file."""
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

    def of_bearing(self, bearing: str) -> dict[str, float]:
        """True values of one bearing (SI) by path in an estimate, such as ``"support.mass_kg"``."""
        found = {}
        for path in (*published(), *(load.field for load in LOADS)):
            place = (path,) if path in self.values else SUPPLIED.get(path, (path,))
            value = self.values.get(place[0])
            if isinstance(value, Mapping):
                value = value.get(bearing)
            elif isinstance(value, Sequence):
                value = value[self.bearing_names.index(bearing)].get(place[1])
            if value is not None:
                found[path] = (1e6 if place[0].endswith("_MPa") else 1.0) * float(value)
        return found

    @property
    def violated(self) -> tuple[str, ...]:
        """Kinds of violations, by the name that an estimate has for what it sees of them."""
        return tuple(SEEN_AS.get(kind, kind) for kind in self.values.get("violated", ()))

    @property
    def structure(self) -> dict[str, float]:
        """True values of structures beyond the base model [SI], by path such as ``"NDE.support.cubic"``."""
        return {path: float(value) for path, value in self.values.get("structure", {}).items()}


def read_truth(path: str | Path) -> Truth:
    """Read a truth file, ours or a supplied one."""
    return truth_of(read_json(Path(path), "rotordrop-bench synthesize"), path=Path(path))


def truth_of(values: Any, *, path: Path | None = None) -> Truth:
    """Truth from the fields of a truth file, refused when it is none."""
    missing = [key for key in _NEEDED if not isinstance(values, Mapping) or key not in values]
    if missing:
        keys = " and no ".join(map(repr, missing))
        raise UsageError(
            f"{path or 'the given object'} is no truth file: it has no {keys}; "
            "give the .json that 'rotordrop-bench synthesize' wrote, or a supplied truth file"
        )
    return Truth(values=values, path=path)
