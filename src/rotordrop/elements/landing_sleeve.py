"""The landing sleeve of the rotor, which lands in the touchdown bearing, where it is eccentric or oval."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from rotordrop.arrays import Array
from rotordrop.elements.description import Description, Misfit
from rotordrop.elements.parameter import (
    Entry,
    Extension,
    Parameter,
    Values,
    derived,
    guess,
    in_words,
)
from rotordrop.elements.values import Angle, NonNegativeLength, default
from rotordrop.known import Known
from rotordrop.physics import columns as L
from rotordrop.physics import landing_sleeve as law

_HARMONICS = {"eccentricity": 1, "oval": 2}
"""Amounts of a sleeve, and how often in a turn each raises its radius."""

LARGEST_ECCENTRICITY = 0.5
"""Largest eccentricity over the air gap [1]: far beyond what a rotor turns with (chosen)."""


class LandingSleeve(Description):
    """Part of the rotor that slides in the race, of the radius r₀ + e cos(χ - χ₁) + a cos 2(χ - χ₂)."""

    eccentricity: NonNegativeLength | None = None
    """Its centre off the axis of the rotor, e [m]; half the runout once a turn."""
    eccentricity_phase: Angle = default(0.0, "as any other")
    """Direction of that centre from +y, positive with the spin [rad], when the rotor angle is zero."""
    oval: NonNegativeLength | None = None
    """Amplitude of its radius twice a turn, a [m]: a quarter of the difference of its largest and smallest
    diameter."""
    oval_phase: Angle = default(0.0, "as any other")
    """Direction of its long axis, as that of the eccentricity [rad]."""

    @property
    def amounts(self) -> dict[str, Known]:
        """The amounts that are described, by name."""
        named = {name: getattr(self, name) for name in _HARMONICS}
        return {name: amount for name, amount in named.items() if amount is not None}

    @property
    def described(self) -> bool:
        """Whether it is more than a round and centred one."""
        return bool(self.amounts)

    def check(self) -> None:
        """Refuse a direction of nothing."""
        for name in _HARMONICS:
            if getattr(self, name) is None and f"{name}_phase" in self.model_fields_set:
                told = (
                    f"the landing sleeve has '{name}_phase' but no '{name}'; give that or leave the phase out"
                )
                raise Misfit(told, (f"{name}_phase",))

    def check_gap(self, gap: float) -> None:
        """Refuse what is too large for an air gap [m]."""
        for name, amount in self.amounts.items():
            if amount.value > _largest(name) * gap:
                raise Misfit(
                    f"the landing sleeve has {name} = {amount.value * 1e6:.4g} um, with an air gap of "
                    f"{gap * 1e6:.4g} um; expected {_largest(name) * gap * 1e6:.4g} um at most: is it a "
                    "diameter, or the unit wrong?",
                    ("landing_sleeve", name),
                )

    def fill(self, row: Array) -> None:
        """Write the columns of the sleeve."""
        numbers = row[L.LANDING_SLEEVE : L.LANDING_SLEEVE_END]
        # a neutral entry is a sleeve too: a fit that holds it at zero computes what one beside zero does
        numbers[law.PRESENT] = float(self.described)
        for name, amount in self.amounts.items():
            # the phase is measured from +y, the kernel's from +x
            turn = _HARMONICS[name] * (float(getattr(self, f"{name}_phase")) + 0.5 * math.pi)
            first = _FIRST[name]
            numbers[first], numbers[first + 1] = amount.value * math.cos(turn), amount.value * math.sin(turn)

    def reach_at_rest(self) -> float:
        """Standard deviation [m] of what it adds to the radius at the place on which a rotor comes to rest.

        Cosine and sine part of an amount have it as their standard deviation each, and so has what both reach
        in any direction.
        """
        return math.sqrt(sum(amount.value**2 for amount in self.amounts.values()))


_FIRST = {"eccentricity": law.ONCE_COSINE, "oval": law.TWICE_COSINE}


def _largest(name: str) -> float:
    return law.LARGEST_OVAL if name == "oval" else LARGEST_ECCENTRICITY


def tolerance(diameter: float) -> float:
    """Width [m] of the tolerance grade IT6 of ISO 286-1 at a diameter [m], to which such a sleeve is ground.

    ``10 (0.45 ∛D + 0.001 D)`` µm with D in mm, of the diameter itself and not of its range of diameters.
    """
    size = 1e3 * diameter
    return 1e-5 * (0.45 * math.cbrt(size) + 0.001 * size)


_USUAL = {"eccentricity": 0.5, "oval": 0.25}
"""Usual amounts over the width of grade IT6 [1]: that is the runout of an eccentric sleeve and the difference
of the diameters of an oval one (chosen)."""


def _limits(name: str, bearing: Any, _load: float) -> tuple[float, tuple[float, float]]:
    largest = math.sqrt(0.5) * _largest(name) * float(bearing.air_gap)
    return 1.0, (-largest, largest)


def _row(name: str, part: int) -> Parameter:
    word = ("cosine", "sine")[part]
    return Parameter(
        path=f"landing_sleeve.{name}_{word}",
        label=f"{'eccentricity' if name == 'eccentricity' else 'oval'} of the landing sleeve, {word} part",
        kind="length",
        logarithmic=False,
        guess_sigma=1.0,
        amount=f"landing_sleeve.{name}",
        scaled=partial(_limits, name),
        measured_by="the runout of the landing sleeve at {owner}, at slow roll",
        entries=(Entry(array="bearing", column=L.LANDING_SLEEVE + _FIRST[name] + part),),
    )


def _extension(name: str, title: str, frame: str, sign: str = "") -> Extension:
    rows = tuple(_row(name, part) for part in range(2))
    path = f"landing_sleeve.{name}"

    def neutral(bearing: Any) -> dict[str, Known]:
        width = tolerance(2.0 * (float(bearing.bore_radius) - float(bearing.air_gap)))
        largest = _largest(name) * float(bearing.air_gap)
        return {path: guess(min(_USUAL[name] * width, largest))}

    def sentence(bearing: Any, found: Values, _load: float) -> str:
        amount = derived(math.hypot, *(found[row.path] for row in rows), least=0.0)
        return f"{bearing.name} {sign}{in_words(amount, 'µm', 1e-6)}"

    return Extension(
        name=title,
        owner="bearing",
        names=(path,),
        neutral=neutral,
        sentence=sentence,
        joined=", ",
        frame=frame,
        rows=rows,
        begins_as_base_model=True,
    )


EXTENSIONS: tuple[Extension, ...] = (
    _extension("eccentricity", "eccentric sleeve", "the landing sleeve is off the rotor's axis by {}"),
    _extension("oval", "oval sleeve", "the radius of the landing sleeve varies twice a turn: {}", "± "),
)


def with_amounts(bearing: Any, said: Values) -> dict[str, Known]:
    """Amounts as large as those found, by path below a bearing, of a sleeve whose amounts were guessed.

    ``said`` is what was found, by path below it too. What was guessed was the width of a prior.
    """
    found = {}
    for name, amount in bearing.landing_sleeve.amounts.items():
        if amount.status == "guess":
            path = f"landing_sleeve.{name}"
            parts = (said[f"{path}_{word}"].value for word in ("cosine", "sine"))
            found[path] = guess(math.hypot(*parts))
    return found
