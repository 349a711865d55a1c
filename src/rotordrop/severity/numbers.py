"""The numbers that say what a drop did to one bearing, declared once for documents, pages and limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rotordrop.document import without_unit
from rotordrop.errors import UsageError, unknown_key
from rotordrop.units import parse_quantity


@dataclass(frozen=True)
class Number:
    """What a drop did to a bearing: field of a document, name for people, kind, whether more is worse."""

    field: str
    label: str
    kind: str
    more_is_worse: bool = True
    only_worsens: bool = True
    """Whether what a drop does after the part that was estimated can only make it worse."""
    places: int | None = None
    """Decimal places of a number that is shown as a share; what lies below them is "< 0.001 %"."""

    @property
    def shown_as(self) -> str:
        """Kind in which a report shows it."""
        return self.kind if self.places is None else "share"


LOADS = (
    Number("peak_force_N", "peak bearing force", "force"),
    Number("peak_stress_Pa", "peak Hertz stress", "pressure"),
    Number("mean_force_0p15_0p2_N", "mean force, 150 to 200 ms", "force", only_worsens=False),
    Number("mean_stress_Pa", "mean Hertz stress, 0 to 200 ms", "pressure", only_worsens=False),
)
"""Force and stress, which every estimate states, in the order in which they are shown."""
NOT_DETERMINED = "not determined"
"""In their place where sensors are not as described."""

_PURE = "dimensionless"
_PLACES = 3
"""Of a share of the rating life in per cent: a hundred thousand drops of 0.001 % would make one life."""
SEVERITY = (
    Number("severity.static_safety", "static safety factor by the peak stress", _PURE, more_is_worse=False),
    Number("severity.static_safety_of_rating", "static safety factor by C0", _PURE, more_is_worse=False),
    Number("severity.impulse_N_s", "impulse of all impacts", "impulse"),
    Number("severity.skid_energy_J", "energy lost in the contact", "energy"),
    Number("severity.position_index", "position index (mean distance over gap)", _PURE, only_worsens=False),
    Number(
        "severity.velocity_index", "velocity index (velocity over speed times gap)", _PURE, only_worsens=False
    ),
    Number("severity.fatigue_by_16281", "share of rating life, ISO/TS 16281", _PURE, places=_PLACES),
)
"""Severity of a drop at a bearing, in the order in which it is shown."""

NUMBERS = (*LOADS, *SEVERITY)
"""Every number by which drops are compared."""

NOTE = (
    "Static safety (ISO 76): by the peak stress, which counts the preload, against 4 200 MPa; by C0 over the "
    "peak force. Share of the basic rating life (at one a tenth of new bearings fails): ISO/TS 16281 at "
    "every instant, as if the race turned with the rotor from the first impact on, as an upper end. None is "
    "a limit."
)
"""What stands beneath a table of these numbers."""


def read_limits(written: Sequence[str]) -> dict[str, float]:
    """Limits [SI] by field of an estimate document, of texts such as ``"peak_stress=2.5 GPa"``.

    Raises
    ------
    UsageError
        If there is no such number, or its limit has another unit.
    """
    known = {without_unit(number.field.rpartition(".")[2]): number for number in NUMBERS}
    found = {}
    for text in written:
        name, equals, limit = (part.strip() for part in text.partition("="))
        if not equals:
            raise UsageError(f'limit {text!r}; expected a number and its limit, "peak_stress=2.5 GPa"')
        if name not in known:
            raise UsageError(f"limit: {unknown_key(name, tuple(known))}")
        found[known[name].field] = parse_quantity(limit, known[name].kind)
    return found
