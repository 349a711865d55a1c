"""The contact between rotor and inner race."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

from rotordrop.arrays import Array
from rotordrop.elements import values as V
from rotordrop.elements.description import Description, Misfit, Usual
from rotordrop.elements.parameter import Entry, Parameter, Rule, Values, bearing_entries
from rotordrop.elements.values import default, follows
from rotordrop.known import Known
from rotordrop.physics import columns as L
from rotordrop.physics.contact import contact_law, depth_at

LINE_CONTACT = 10.0 / 9.0
"""Exponent of a line contact (Palmgren)."""

WITH_LENGTH = 0.8 * LINE_CONTACT
"""Exponent by which the stiffness of a line contact grows with its length (Palmgren)."""
REFERENCE_WIDTH = 0.032
"""Width of the race of the reference machine [m] (Neisi 2020)."""

TYPICAL_LOADS = 5.0
"""Contact force at whose indentation the stiffness keeps its meaning when the exponent differs, over the mean
static load of a bearing [1]: impacts that say something of the contact have it and more."""

_UNIT_EXPONENT = re.compile(r"m\s*(?:\^|\*\*)\s*([\d.]+)\s*$")


class Contact(Description):
    """Contact between rotor and inner race, F = K δⁿ (1 + 1.5 λ δ̇)."""

    stiffness: V.ContactStiffness = follows(
        "a fifth of Palmgren's line contact over the width of the race, or all of it over 'length'"
    )
    """Contact stiffness K [N/m^n]."""
    exponent: V.ContactExponent = default(LINE_CONTACT, "line contact (Palmgren), as in Neisi 2020")
    """Exponent n [1]."""
    damping: V.ContactDamping = default(0.08, "contact damping of steel at low speed", (0.0, 0.5))
    """Contact damping λ [s/m]."""
    length: V.PositiveLength | None = None
    """Length of the line contact [m], from which Palmgren's formula gives the stiffness."""

    usual: ClassVar[Mapping[str, Usual]] = {
        "damping": Usual(
            least=0.0, most=20.0, look="steel has 0.05 to 0.5 s/m at low speed", label="contact damping"
        ),
    }

    displaces: ClassVar[Mapping[str, tuple[str, ...]]] = {"stiffness": ("length",)}

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Refuse a stiffness whose unit holds another exponent than the contact."""
        refuse_other_unit(raw, LINE_CONTACT)
        return raw

    @property
    def law(self) -> Array:
        """The law for the functions of `physics.contact`."""
        return contact_law(float(self.stiffness), float(self.exponent), float(self.damping))

    def typical_depth(self, load: float) -> float:
        """Indentation [m] by which the stiffness keeps its meaning, for the mean load of a bearing [N]."""
        return depth_at(self.law, TYPICAL_LOADS * load)

    def fill(self, row: Array) -> None:
        """Write the columns of the contact."""
        row[L.CONTACT : L.CONTACT_END] = self.law

    def check(self) -> None:
        """Refuse a stiffness given twice."""
        if self.length is None:
            return
        if "stiffness" in self.model_fields_set:
            raise Misfit("the contact has both 'stiffness' and 'length'; keep one of them", ("length",))
        if abs(self.exponent.value - LINE_CONTACT) > 1e-3:
            raise Misfit(
                f"the stiffness of a line contact goes with the exponent 10/9, not {self.exponent.value:g}; "
                "leave out 'exponent' or give the 'stiffness'",
                ("exponent",),
            )

    def left_out(self) -> dict[str, Any]:
        """Give a stiffness that was left out."""
        if "stiffness" in self.model_fields_set:
            return {}
        if self.length is not None:
            value = palmgren_stiffness(self.length.value)
            why = f"Palmgren line contact over {self.length.value * 1e3:.4g} mm"
            return {"stiffness": Known(value=value, status="inferred", source=why, unit="N/m^n")}
        return {"stiffness": _usual_stiffness(REFERENCE_WIDTH)}

    def over(self, width: float) -> Contact:
        """The contact over the width of a race [m], for a stiffness that was left out."""
        if "stiffness" in self.model_fields_set or self.length is not None:
            return self
        return self.completed_with({"stiffness": _usual_stiffness(width)})


def _usual_stiffness(width: float) -> Known:
    value, low, high = ((width / REFERENCE_WIDTH) ** WITH_LENGTH * one for one in (8e8, 2e8, 4e9))
    why = (
        f"about a fifth of Palmgren's value for {width * 1e3:.3g} mm: edges and waviness leave part of the "
        "length"
    )
    return Known(value=value, status="default", range=(low, high), source=why, unit="N/m^n")


def refuse_other_unit(raw: Mapping[str, Any], usual: float) -> None:
    """Refuse a stiffness whose unit holds another exponent than its contact; ``usual`` where none is said."""
    exponent, written = raw.get("exponent", usual), raw.get("stiffness")
    if isinstance(written, Mapping):
        written = written.get("value", written.get("guess"))
    found = _UNIT_EXPONENT.search(written) if isinstance(written, str) else None
    if found and isinstance(exponent, int | float) and abs(float(found.group(1)) - exponent) > 0.01:
        raise Misfit(
            f"{written!r} belongs to the exponent {found.group(1)}, but the contact has the exponent "
            f"{exponent:.4g}; change the unit or give 'exponent'",
            ("stiffness",),
        )


def palmgren_stiffness(length: float) -> float:
    """Contact stiffness [N/m^(10/9)] of a line contact [m]: δ = 3.84e-5 Q^0.9 / l^0.8 in mm and N."""
    per_mm = math.pow(3.84e-5, -LINE_CONTACT) * math.pow(1e3 * length, WITH_LENGTH)
    return per_mm * math.pow(1e3, LINE_CONTACT)


def pair_of_the_file(bearing: Any, found: Values, load: float) -> Values:
    """Contact of a bearing as a machine file has it, by path below it: from fitted values and mean load [N].

    Exponent within its limits, and the stiffness that belongs to it. The fit, and what is reported, gives
    the stiffness [N/m^n] of the exponent in the machine description, to be compared with it; a description
    holds one pair, with the same force at a typical indentation.
    """
    exponent, stiffness = found.get("contact.exponent"), found.get("contact.stiffness")
    if exponent is None or stiffness is None or stiffness.interval_90 is None:
        return {}
    ends = EXPONENT.within(exponent.low), EXPONENT.within(exponent.high)
    exponent = replace(exponent, value=EXPONENT.within(exponent.value), interval_90=ends)
    depth = bearing.contact.typical_depth(load)
    factor = depth ** (float(bearing.contact.exponent) - exponent.value)
    low, high = stiffness.interval_90
    stiffness = replace(stiffness, value=factor * stiffness.value, interval_90=(factor * low, factor * high))
    return {"contact.exponent": exponent, "contact.stiffness": stiffness}


EXPONENT = Parameter(
    path="contact.exponent",
    label="contact exponent",
    kind="dimensionless",
    measured_by="a static push with a known force at {owner}",
    guess_sigma=0.1,  # from 10/9 of a line to 3/2 of a point
    least_sigma=0.01,  # an interval that ends at a limit may have no width, and no drop says more
    lower=1.0,
    upper=2.0,
    entries=(
        Entry(array="bearing", column=L.CONTACT_EXPONENT),
        Entry(array="bearing", column=L.CONTACT_STIFFNESS, rule=Rule.AT_TYPICAL_DEPTH),
    ),
)

PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        path="contact.stiffness",
        label="contact stiffness",
        kind="contact_stiffness",
        measured_by="a static push with a known force at {owner}",
        guess_sigma=0.3,
        drift=0.2,
        entries=bearing_entries(L.CONTACT_STIFFNESS),
        separated_by={"air_gap": "a static push with a known force gives the contact stiffness"},
    ),
    EXPONENT,
    Parameter(
        path="contact.damping",
        label="contact damping",
        kind="contact_damping",
        guess_sigma=0.6,
        entries=bearing_entries(L.CONTACT_DAMPING),
    ),
)
"""Unknowns of a contact."""
