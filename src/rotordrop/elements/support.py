"""What carries the outer ring of a touchdown bearing, with the axes and the spring that it may have."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

from rotordrop.arrays import Array
from rotordrop.elements import values as V
from rotordrop.elements.description import Description, Misfit
from rotordrop.elements.parameter import (
    Entry,
    Extension,
    Parameter,
    Role,
    Rule,
    Values,
    bearing_entries,
    derived,
    guess,
    in_words,
    itself,
    of_one_unknown,
    quotient,
)
from rotordrop.elements.values import default, follows, scaled
from rotordrop.known import Known
from rotordrop.physics import columns as L
from rotordrop.physics import mount as mount_law
from rotordrop.physics import support as law
from rotordrop.units import percent

_DAMPING_RATIO = 0.025
REFERENCE_MASS = 60.0
"""Mass of the rotor for which the usual mass and stiffness of a support hold [kg]: that of the reference
machine. The mass goes with it, the stiffness with its length, by the third root."""

_PRESENT = L.SUPPORT_FORM + law.PRESENT
_COUPLING = L.SUPPORT_FORM + law.COUPLING
_CUBIC = L.SUPPORT_FORM + law.CUBIC
_SHARE = L.SUPPORT_FORM + law.FOUNDATION_SHARE
_SPEED = L.SUPPORT_FORM + law.FOUNDATION_SPEED
_DAMPING = L.SUPPORT_FORM + law.FOUNDATION_DAMPING
_FRICTION = L.SUPPORT_FORM + law.FRICTION
_STOP_GAP, _STOP = L.MOUNT + mount_law.GAP, L.MOUNT + mount_law.STOP

_FOUNDATION = ("foundation_share", "foundation_frequency", "foundation_damping_ratio")
_FORM = ("coupling", "cubic", "friction", *_FOUNDATION)
"""What a support may have beyond a spring and a damper on two axes."""

TURNED_ANISOTROPY = 0.4
"""Prior standard deviation of the logarithm of horizontal over vertical stiffness of turned axes."""

PEAK_LOADS = 10.0
"""Force of a hard impact over the mean static load of a bearing [1]: where a cubic term counts."""


class Support(Description):
    """What carries the outer ring: mass on a spring and a damper, vertical (y) and horizontal (x)."""

    mass: V.PositiveMass = default(
        40.0, "the housing parts around a bearing go with the mass of the rotor: 40 kg of 60 kg", (4.0, 400.0)
    )
    stiffness: V.Stiffness = default(
        1e8, "a bearing housing of a rotor of 60 kg, with the length of others", (1e7, 2e9)
    )
    damping: V.Damping = follows("2.5 % of critical, or from the damping ratio")
    """Vertical support mass [kg], stiffness [N/m] and damping [N s/m]."""
    damping_ratio: V.NonNegative | None = None
    """In place of the damping: C = 2 ζ √(K m)."""
    mass_horizontal: V.PositiveMass = follows("equal to the vertical one")
    stiffness_horizontal: V.Stiffness = follows("equal to the vertical one")
    damping_horizontal: V.Damping = follows("from the damping ratio, or equal to the vertical one")
    """The same in the horizontal direction; equal to the vertical ones when left out."""
    damping_ratio_horizontal: V.NonNegative | None = None
    """In place of the horizontal damping."""
    coupling: V.Coupling | None = None
    """Coupling of x and y over the geometric mean of horizontal and vertical stiffness [1]: principal axes
    that are turned."""
    cubic: V.CubicTerm | None = None
    """Cubic term k₃ of the spring, F = K h (1 + k₃ h²) along x and along y [1/m²]."""
    friction: V.Force | None = None
    """Coulomb friction of the support, such as of a housing that slides on its seat [N]."""
    foundation_share: V.NonNegative | None = None
    """Support mass over modal mass of a foundation that gives way under the support [1]."""
    foundation_frequency: V.PositiveSpeed | None = None
    """Natural frequency of that foundation."""
    foundation_damping_ratio: V.Positive | None = None
    """Damping ratio of that foundation."""

    columns: ClassVar[Mapping[str, int]] = {
        "mass_horizontal": L.SUPPORT_MASS_X,
        "mass": L.SUPPORT_MASS_Y,
        "stiffness_horizontal": L.SUPPORT_STIFFNESS_X,
        "stiffness": L.SUPPORT_STIFFNESS_Y,
        "damping_horizontal": L.SUPPORT_DAMPING_X,
        "damping": L.SUPPORT_DAMPING_Y,
        "coupling": _COUPLING,
        "cubic": _CUBIC,
        "friction": _FRICTION,
        "foundation_share": _SHARE,
        "foundation_frequency": _SPEED,
        "foundation_damping_ratio": _DAMPING,
    }

    displaces: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "damping": ("damping_ratio",),
        "damping_ratio": ("damping",),
        "damping_horizontal": ("damping_ratio_horizontal",),
        "damping_ratio_horizontal": ("damping_horizontal",),
    }

    def check(self) -> None:
        """Refuse damping given twice."""
        for end in ("", "_horizontal"):
            if {f"damping{end}", f"damping_ratio{end}"} <= self.model_fields_set:
                raise Misfit(
                    f"the support has both 'damping{end}' and 'damping_ratio{end}'; keep one of them",
                    (f"damping_ratio{end}",),
                )
        given = [name for name in _FOUNDATION if getattr(self, name) is not None]
        if given and len(given) < len(_FOUNDATION):
            missing = next(name for name in _FOUNDATION if name not in given)
            raise Misfit(
                f"the support has {given[0]!r} but no {missing!r}; a foundation needs "
                f"{', '.join(_FOUNDATION)}",
                (given[0],),
            )

    def left_out(self) -> dict[str, Any]:
        """Let damping follow its ratio and the horizontal values follow the vertical ones."""
        values: dict[str, Any] = {}
        given, same = self.model_fields_set, "equal to the vertical one"
        for name in ("mass", "stiffness"):
            if f"{name}_horizontal" not in given:
                vertical = getattr(self, name)
                values[f"{name}_horizontal"] = scaled(vertical, 1.0, same, vertical.unit)
        if "damping" not in given:
            values["damping"] = _from_ratio(self.damping_ratio, self.mass, self.stiffness)
        if "damping_horizontal" in given:
            return values
        mass = values.get("mass_horizontal", self.mass_horizontal)
        stiffness = values.get("stiffness_horizontal", self.stiffness_horizontal)
        damping = scaled(self.damping, 1.0, same, "N s/m")
        if self.damping_ratio_horizontal is not None:
            damping = _from_ratio(self.damping_ratio_horizontal, mass, stiffness)
        elif "damping" not in given:
            why = "the damping ratio of the vertical direction"
            damping = replace(_from_ratio(self.damping_ratio, mass, stiffness), status="default", source=why)
        return values | {"damping_horizontal": damping}

    def under(self, rotor_mass: float) -> Support:
        """The support under a rotor of a mass [kg], for a mass and a stiffness that were left out."""
        size, values = rotor_mass / REFERENCE_MASS, {}
        for name, factor in (("mass", size), ("stiffness", size ** (1.0 / 3.0))):
            if name not in self.model_fields_set:
                usual: Known = type(self).model_fields[name].default
                values[name] = scaled(usual, factor, str(usual.source), usual.unit)
        if not values:
            return self
        copy = self.completed_with(values)
        return copy.completed_with(copy.left_out())

    states_at: ClassVar[int] = L.BEARING_OWN

    @property
    def further_states(self) -> Mapping[str, int]:
        """Displacement and velocity (x, y) of its foundation, or none."""
        ends = ("x", "y", "x velocity", "y velocity") if self.foundation_share is not None else ()
        return {f"foundation {{}} {end}": L.INTERNAL for end in ends}

    @property
    def has_guessed_axes(self) -> bool:
        """Whether its axes are turned by what no estimate has found."""
        return self.coupling is not None and self.coupling.status != "estimated"

    def fill(self, row: Array) -> None:
        """Write the columns of the support, after those of its mount."""
        super().fill(row)
        # a neutral entry is a form too: a fit that holds it at zero computes what one beside zero does
        form = any(getattr(self, name) is not None for name in _FORM)
        row[_PRESENT] = float(form or row[L.MOUNT] != 0.0)


def _from_ratio(ratio: Known | None, mass: Known, stiffness: Known) -> Known:
    critical = 2.0 * math.sqrt(stiffness.value * mass.value)
    if ratio is None:
        why = f"{percent(_DAMPING_RATIO, 1)} of critical"
        value = _DAMPING_RATIO * critical
        bounds = (0.1 * value, 10.0 * value)
        return Known(value=value, status="default", range=bounds, source=why, unit="N s/m")
    known = scaled(ratio, critical, f"damping ratio {ratio.value:g}", "N s/m")
    return replace(known, status=ratio.status)


def support_sag(row: Array, load: float) -> float:
    """Deflection [m] of a support under a static load [N], its foundation included."""
    deflection = support_deflection(row, load)
    if row[_PRESENT] == 0.0:
        return deflection
    speed, share = float(row[_SPEED]), max(float(row[_SHARE]), 0.0)
    return deflection + (0.0 if share == 0.0 else load * share / (float(row[L.SUPPORT_MASS_Y]) * speed**2))


def support_deflection(row: Array, load: float) -> float:
    """Deflection [m] of a support against its foundation under a static load [N]."""
    stiffness = float(row[L.SUPPORT_STIFFNESS_Y])
    sag = load / stiffness
    if row[_PRESENT] == 0.0:
        return sag
    gap = float(row[_STOP_GAP])
    if 0.0 < gap < sag:  # relaxed branches and a slipped ribbon carry nothing; a stop shares the rest
        stop = float(row[_STOP])
        sag = (load + stop * gap) / (stiffness + stop)
    cubic = float(row[_CUBIC])
    # what a support is deflected by is its compliance: coupling to the side, which is free, takes 1 - κ²
    coupled = sag / (1.0 - float(row[_COUPLING]) ** 2)
    return coupled / (1.0 + cubic * sag**2)  # next order: a few parts in ten thousand of 3 µm


def _cubic_scale(bearing: Any, load: float) -> tuple[float, tuple[float, float]]:
    """Scale of a cubic term, and its limits: hard impacts at most double the stiffness, or take a fifth."""
    scale = (float(bearing.support.stiffness) / (PEAK_LOADS * load)) ** 2
    return scale, (-0.2 * scale, 2.0 * scale)


def soft_axis(ratio: float, coupling: float) -> float:
    """Angle of the soft axis from horizontal [°], between -90 and 90, of a support with turned axes.

    It follows from horizontal over vertical stiffness and the coupling over the geometric mean of both [1].
    """
    # The stiff axis stands at half the angle of (k_x - k_y, 2 k_xy); the soft one across.
    stiff = 0.5 * math.atan2(2.0 * coupling * math.sqrt(ratio), ratio - 1.0)
    turned = math.degrees(stiff) + 90.0
    return turned - 180.0 if turned > 90.0 else turned


def soft_over_stiff(ratio: float, coupling: float) -> float:
    """Stiffness along the soft axis over that along the stiff one [1]; arguments as of `soft_axis`."""
    middle, apart = 0.5 * (ratio + 1.0), math.hypot(0.5 * (ratio - 1.0), coupling * math.sqrt(ratio))
    return (middle - apart) / (middle + apart)


def _axes(bearing: Any, found: Values, _load: float) -> str:
    both = found["support.anisotropy"], found["support.coupling"]
    angle, ratio = derived(soft_axis, *both), derived(soft_over_stiff, *both, least=0.0, most=1.0)
    return (
        f"the soft axis of the {bearing.name} support stands {in_words(angle, '°')} from horizontal, with "
        f"{in_words(ratio, '')} × the stiffness across"
    )


def _growth(bearing: Any, found: Values, load: float) -> str:
    deflection = PEAK_LOADS * load / found["support.stiffness"].value
    growth = derived(lambda k_3: k_3 * deflection * deflection, found["support.cubic"])
    return f"{bearing.name} {in_words(growth, '%', 0.01)}"


PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        path="support.stiffness",
        label="support stiffness",
        kind="stiffness",
        measured_by="a hammer test of the touchdown-bearing housing at {owner}",
        role=Role.SOUGHT,
        guess_sigma=0.5,
        given_sigma=0.05,
        drift=0.02,
        entries=bearing_entries(L.SUPPORT_STIFFNESS_Y, L.SUPPORT_STIFFNESS_X),
        separated_by={
            "support.mass": (
                "a hammer test of the touchdown-bearing housing gives support frequency and stiffness"
            )
        },
    ),
    Parameter(
        path="support.anisotropy",
        label="horizontal over vertical support stiffness",
        kind="dimensionless",
        guess_sigma=0.03,
        entries=(Entry(array="bearing", column=L.SUPPORT_STIFFNESS_X, rule=Rule.SCALE),),
        ratio=("support.stiffness_horizontal", "support.stiffness"),
    ),
    Parameter(
        path="support.mass",
        label="support mass",
        kind="mass",
        measured_by="a hammer test of the touchdown-bearing housing at {owner}",
        role=Role.SOUGHT,
        guess_sigma=0.4,
        given_sigma=0.05,
        drift=0.02,
        entries=bearing_entries(L.SUPPORT_MASS_Y, L.SUPPORT_MASS_X),
    ),
    Parameter(
        path="support.damping",
        label="support damping",
        kind="damping",
        measured_by="a hammer test of the touchdown-bearing housing at {owner}",
        role=Role.SOUGHT,
        guess_sigma=0.7,
        given_sigma=0.3,
        drift=0.1,
        entries=bearing_entries(L.SUPPORT_DAMPING_Y, L.SUPPORT_DAMPING_X),
    ),
)
"""Unknowns of a support."""


FOUNDATION_FREQUENCY = 0.4
"""Natural frequency of a foundation over that of the support on it, to begin with [1]."""


def _neutral(bearing: Any) -> dict[str, Known]:
    natural = math.sqrt(float(bearing.support.stiffness) / float(bearing.support.mass))
    return {
        "support.foundation_share": guess(0.02),
        "support.foundation_damping_ratio": guess(0.03),
        "support.foundation_frequency": guess(FOUNDATION_FREQUENCY * natural),
    }


def _mode(bearing: Any, found: Values, _load: float) -> str:
    frequency = itself(found["support.foundation_frequency"])
    modal = quotient(found["support.mass"], found["support.foundation_share"])
    return (
        f"under {bearing.name} a foundation mode at {in_words(frequency, 'Hz', 2.0 * math.pi)} with a modal "
        f"mass of {in_words(modal, 'kg')}"
    )


EXTENSIONS: tuple[Extension, ...] = (
    of_one_unknown(
        Parameter(
            path="support.coupling",
            label="coupling of horizontal and vertical support stiffness",
            kind="dimensionless",
            logarithmic=False,
            guess_sigma=0.25,
            given_sigma=0.05,
            lower=-0.85,
            upper=0.85,
            entries=bearing_entries(_COUPLING),
        ),
        "turned support axes",
        0.0,
        _axes,
        alone=False,  # their ratio is free with it
    ),
    of_one_unknown(
        Parameter(
            path="support.cubic",
            label="cubic term of the support stiffness",
            kind="cubic_term",
            logarithmic=False,
            guess_sigma=0.4,
            given_sigma=0.1,
            scale="one over the deflection under ten mean loads, squared",
            scaled=_cubic_scale,
            entries=bearing_entries(_CUBIC),
        ),
        "cubic support",
        0.0,
        _growth,
        f"supports whose stiffness changes with load, at the deflection of {PEAK_LOADS:g} mean loads by {{}}",
    ),
    of_one_unknown(
        Parameter(
            path="support.friction",
            label="friction in the support",
            kind="force",
            logarithmic=False,
            guess_sigma=0.3,
            given_sigma=0.1,
            lower=0.0,
            scale="mean load of a bearing",
            scaled=lambda _, load: (load, (0.0, 3.0 * load)),
            entries=bearing_entries(_FRICTION),
        ),
        "hysteretic support",
        0.0,
        ("N", 1.0),
        "friction in the supports: {}",
    ),
    Extension(
        name="foundation mode",
        owner="bearing",
        names=("support.foundation_share", "support.foundation_damping_ratio"),
        neutral=_neutral,
        sentence=_mode,
        rows=(
            Parameter(
                path="support.foundation_share",
                label="support mass over foundation mass",
                kind="dimensionless",
                logarithmic=False,
                guess_sigma=0.06,
                given_sigma=0.01,
                lower=0.0,
                entries=bearing_entries(_SHARE),
            ),
            Parameter(
                path="support.foundation_frequency",
                label="natural frequency of the foundation",
                kind="speed",
                guess_sigma=0.3,
                given_sigma=0.05,
                reach=5.0,
                entries=bearing_entries(_SPEED),
            ),
            Parameter(
                path="support.foundation_damping_ratio",
                label="damping ratio of the foundation",
                kind="dimensionless",
                guess_sigma=0.5,
                given_sigma=0.2,
                reach=8.0,
                entries=bearing_entries(_DAMPING),
            ),
        ),
    ),
)
