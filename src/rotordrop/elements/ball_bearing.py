"""The rolling bearing inside a touchdown bearing: by designation or by geometry."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field, Strict

from rotordrop.elements import values as V
from rotordrop.elements.catalog.boundary import (
    CLASSES,
    LISTED_BORES,
    PRELOAD_CLASSES,
    PRELOAD_FACTOR,
    ClearanceClass,
    PreloadClass,
    clearance_range,
)
from rotordrop.elements.description import Misfit, Text, Usual
from rotordrop.elements.parameter import Measure, Parameter, bearing_entries, stated_only
from rotordrop.elements.race import STEEL_DENSITY, Race
from rotordrop.elements.race_bearing import Oddity, RaceBearing
from rotordrop.elements.rotor import DENSITY, ELASTIC, POISSON
from rotordrop.elements.values import default, follows
from rotordrop.known import NINETY, Known
from rotordrop.physics import columns as L
from rotordrop.physics import ring
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.elements.bearing_numbers import BearingNumbers
    from rotordrop.elements.catalog.lookup import CatalogueBearing

BallMaterial = Literal["silicon nitride", "steel"]

_BALL_MATERIALS: dict[BallMaterial, dict[str, tuple[float, str]]] = {
    "silicon nitride": {
        "ball_youngs_modulus": (315e9, "Pa"),
        "ball_poisson_ratio": (0.26, ""),
        "ball_density": (3200.0, "kg/m^3"),
    },
    "steel": {
        "ball_youngs_modulus": (208e9, "Pa"),
        "ball_poisson_ratio": (0.3, ""),
        "ball_density": (STEEL_DENSITY, "kg/m^3"),
    },
}

_SPRUNG = ("spring_rate", "ring_mass", "ring_travel", "fit_friction", "ring_damping")
RING_STATE = "rings {}"
"""State that holds the way of the sprung rings of a bearing."""
_BALL_HEIGHT = 1.16
"""Ball diameter over half the height of the cross-section [1], 2 · 0.58 of spindle bearings."""

STATIC_STRESS = 4.2e9
"""Hertz stress [Pa] of the static load rating C0 of a ball bearing, ISO 76: the race is dented beyond it."""

_CONFORMITY = 0.53
"""Groove radius over ball diameter of a bearing in no catalogue [1], which reproduces the rigidities that FAG
and GMN publish."""
_NEEDED = ("ball_diameter", "ball_count", "pitch_diameter", "contact_angle")
_ROWS = {1: "single", 2: "X"}
_CLEARANCE = ("clearance", "clearance_class")


class BallBearing(RaceBearing):
    """A ball bearing: an angular-contact pair under preload, or one or two rows with radial clearance.

    A row of deep grooves has no contact angle of its own: the clearance leaves it one, and the load zone.
    Where a pair has a contact angle and a clearance, the clearance is the play its rows were mounted with.
    """

    designation: Text | None = None
    """Designation, for example "XCB71914-E"; where no maker's list in the catalogue has it, the balls are
    inferred from its size."""
    ball_diameter: V.PositiveLength = follows("reconstructed from the catalogue")
    """Ball diameter D_w and pitch diameter D_pw [m]."""
    ball_count: Annotated[int, Strict(), Field(ge=3)] = Field(default=0, validate_default=False)
    """Balls per row."""
    pitch_diameter: V.PositiveLength = follows("reconstructed from the catalogue")
    """Ball diameter D_w and pitch diameter D_pw [m]."""
    contact_angle: V.ContactAngle = follows("from the catalogue")
    """Nominal contact angle [rad]."""
    conformity_inner: V.Conformity = follows("0.53, a usual value for spindle bearings")
    conformity_outer: V.Conformity = follows("0.53, a usual value for spindle bearings")
    """Groove radius over ball diameter [1]."""
    ball_material: BallMaterial = Field(
        default="silicon nitride", description="Touchdown bearings usually have ceramic balls"
    )
    """Material of the balls."""
    ring_youngs_modulus: V.Pressure = default(208e9, "bearing steel")
    ring_poisson_ratio: V.PoissonRatio = default(0.3, "bearing steel")
    """Ring material [Pa], [1]."""
    ball_youngs_modulus: V.Pressure = follows("from the ball material")
    ball_poisson_ratio: V.PoissonRatio = follows("from the ball material")
    ball_density: V.Density = follows("from the ball material")
    """Ball material [Pa], [1], [kg/m³]."""
    preload: V.Force = follows("that of the preload class")
    """Axial preload force F_V of each row [N]."""
    preload_class: PreloadClass | None = None
    """Preload class of the catalogue, where the preload was given so."""
    clearance: V.NonNegativeLength | None = None
    """Radial internal clearance, from one extreme position of the inner ring to the opposite one [m]."""
    clearance_class: ClearanceClass | None = None
    """Clearance class of ISO 5753, where the clearance was given so."""
    bore_diameter: V.PositiveLength | None = None
    """Bore of the inner ring [m], which a clearance class counts from."""
    arrangement: Literal["X", "O", "tandem", "single"] = Field(
        default="X", description="Two rows face to face, as in Neisi 2020"
    )
    """Arrangement of the rows; ``rows = 1`` writes "single", ``rows = 2`` "X"."""
    first_ball_angle: V.Angle = default(0.0, "the first ball is straight up")
    """Angle of the first ball from +y, positive with the spin [rad]."""
    second_row_offset: V.Number = default(0.0, "the balls of both rows stand at the same angles")
    """Angle by which the second row is turned, as a fraction of the ball pitch [1]."""
    width: V.PositiveLength | None = None
    """Width of one row [m]."""
    row_spacing: V.PositiveLength | None = None
    """Axial distance of the middles of two rows [m], which tilt alone feels; that of their width."""
    shoulder_height: V.PositiveLength | None = None
    """Height of the shoulders of the races above the bottom of their grooves [m]; 0.2 ball diameters."""
    limiting_speed: V.PositiveSpeed | None = None
    """Speed up to which the maker allows the bearing [rad/s]."""
    static_load_rating: V.PositiveForce | None = None
    """Static load rating of one row."""
    dynamic_load_rating: V.PositiveForce | None = None
    """Dynamic load rating of one row."""
    axial_rigidity: V.Stiffness | None = None
    """Axial rigidity of the pair at its preload, as a catalogue states it [N/m]; narrows them further."""
    ball_count_range: tuple[int, int] | None = None
    """90 % interval of the number of balls, where it is inferred."""

    usual: ClassVar[Mapping[str, Usual]] = {
        "ring_youngs_modulus": ELASTIC,
        "ball_youngs_modulus": ELASTIC,
        "ring_poisson_ratio": POISSON,
        "ball_poisson_ratio": POISSON,
        "ball_density": DENSITY,
    }

    written_as: ClassVar[Mapping[str, str]] = {"preload_class": "preload", "clearance_class": "clearance"}

    displaces: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "preload": ("preload_class",),
        "clearance": ("clearance_class",),
    }

    preload_kind: Literal["rigid", "spring"] = Field(
        default="rigid", description='rigid spacers; say "spring" where springs press on the outer rings'
    )
    """How the preload is made: by spacers, which hold the rings, or by springs, which let them give way."""
    spring_rate: V.Stiffness | None = None
    """With springs: their rate at each outer ring [N/m]; a tenth of the rigidity of the pair."""
    ring_mass: V.PositiveMass | None = None
    """With springs: mass of each outer ring that they move [kg]; a steel ring of its size."""
    ring_travel: V.PositiveLength | None = None
    """With springs: way of each outer ring from its balls up to a stop [m]; 0.2 mm."""
    fit_friction: V.NonNegative | None = None
    """With springs: friction coefficient of each outer ring in its housing, on its share of the radial force
    [1]; 0.15, 0 to 0.4, which decides how much of the peak the springs take."""
    ring_damping: V.NonNegative | None = None
    """With springs: damping of each outer ring along the axis, over that of a dashpot along every line of
    contact, of which the race's own damping is made [1]; 1, 0 to 2, which nobody has measured."""

    ball_inertia: Annotated[bool, Strict()] = Field(
        default=False, description="a drop hardly gets the race up to speed before its first impacts"
    )
    """Whether the centrifugal force of the balls counts in a simulated drop."""

    states_at: ClassVar[int] = L.RING_STATES

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Read ``preload = "light"``, ``clearance = "C3"``, ``rows = 1``, one conformity for both races."""
        preload, clearance = raw.get("preload"), raw.get("clearance")
        if preload in PRELOAD_CLASSES:
            raw["preload_class"] = raw.pop("preload")
        elif isinstance(preload, str) and preload.isalpha():
            close = get_close_matches(preload, PRELOAD_CLASSES, 1, 0.5)
            hint = f"did you mean {close[0]!r}?" if close else f"classes are {', '.join(PRELOAD_CLASSES)}"
            told = f'{preload!r} is no preload class; {hint} Else give a force, "100 N"'
            raise Misfit(told, ("preload",))
        if clearance in CLASSES:
            raw["clearance_class"] = raw.pop("clearance")
        elif isinstance(clearance, str) and not any(unit in clearance for unit in ("m", "in", "thou")):
            told = f"{clearance!r} is neither a length nor a clearance class ({', '.join(CLASSES)})"
            raise Misfit(f'{told}; write for example "C3" or "40 um"', ("clearance",))
        if "rows" in raw:
            rows, arrangement = raw.pop("rows"), raw.get("arrangement")
            if rows not in _ROWS or isinstance(rows, bool):
                told = f"rows = {rows!r} is neither 1 nor 2; write rows = 1, or the arrangement of two rows"
                raise Misfit(told, ("rows",))
            if arrangement is not None and (arrangement == "single") != (rows == 1):
                told = f"rows = {rows} does not go with arrangement = {arrangement!r}; keep one"
                raise Misfit(told, ("rows",))
            raw["arrangement"] = _ROWS[rows] if arrangement is None else arrangement
        if "conformity" in raw:
            both = raw.pop("conformity")
            raw = {"conformity_inner": both, "conformity_outer": both} | raw
        return raw

    @classmethod
    def known_keys(cls) -> tuple[str, ...]:
        """Keys to suggest for a mistyped one."""
        hidden = ("preload_class", "clearance_class")
        return (*(name for name in cls.model_fields if name not in hidden), "conformity", "rows")

    def check(self) -> None:
        """Refuse a bearing that is not described, or balls that do not fit."""
        entry, known = self.catalogue_entry(), self.model_fields_set
        missing = [name for name in self._needed() if name not in known]
        if entry is None and missing:
            raise Misfit(
                f"the bearing has no {', '.join(repr(name) for name in missing)}; give its 'designation' or "
                "its geometry"
            )
        listed = entry is not None and bool(entry.preload)
        if self.preload_class is not None and "preload" in known:
            told = "the preload is given both as a force and as a class; keep one of them"
            raise Misfit(told, ("preload",))
        if not self.sprung and (said := [name for name in _SPRUNG if name in known]):
            told = f'{said[0]!r} belongs to springs, and the preload is rigid; add preload_kind = "spring"'
            raise Misfit(f"{told}, or leave it out", (said[0],))
        if self.ball_inertia and self.sprung:
            told = "ball_inertia = true goes with a rigid preload today; leave out one of it and springs"
            raise Misfit(told, ("ball_inertia",))
        if self.ball_inertia and self._has_clearance(entry):
            told = "ball_inertia = true goes with a preloaded pair today, and this bearing has a clearance"
            raise Misfit(f"{told}; leave it out", ("ball_inertia",))
        if self.preload_class is not None and not listed:
            raise Misfit(
                f"preload = {self.preload_class!r} needs a 'designation' that is in the catalogue; "
                'give the force, for example preload = "100 N"',
                ("preload",),
            )
        preloaded = self.preload_class is not None or "preload" in known or listed
        if not preloaded and not self._has_clearance(entry):
            raise Misfit(
                'the bearing has no \'preload\'; write for example preload = "100 N", or clearance = "12 um"'
            )

    @property
    def rows(self) -> int:
        """Number of rows of balls."""
        return 1 if self.arrangement == "single" else 2

    @property
    def sprung(self) -> bool:
        """Whether springs press on the outer rings."""
        return self.preload_kind == "spring"

    @property
    def no_face(self) -> str:
        """Springs, balls with inertia and rows that face one way."""
        if self.sprung:
            return "the two rings of a pair on springs would move apart from one another"
        if self.ball_inertia:
            return "the table of balls with inertia knows no axial motion"
        if self.arrangement in ("single", "tandem") and float(self.preload) > 0.0:
            return f'rows that all face one way (arrangement = "{self.arrangement}") need a counterpart'
        return ""

    @property
    def further_states(self) -> Mapping[str, int]:
        """Way and speed of outer rings that springs press on."""
        return {RING_STATE: L.POSITION, f"{RING_STATE} velocity": L.VELOCITY} if self.sprung else {}

    def _has_clearance(self, entry: CatalogueBearing | None = None) -> bool:
        """Whether the rows have play: a clearance is given, or the grooves are deep."""
        given = not self.model_fields_set.isdisjoint(_CLEARANCE)
        return given or (entry is not None and entry.kind == "deep groove")

    def _needed(self) -> tuple[str, ...]:
        """What a bearing outside the catalogue must say of itself; a clearance leaves it a contact angle."""
        return _NEEDED[:-1] if self._has_clearance() else _NEEDED

    def catalogue_entry(self) -> CatalogueBearing | None:
        """Find the bearing in the catalogue; a bearing described by its geometry need not be there."""
        if self.designation is None:
            return None
        from rotordrop.elements.catalog.inference import PairRigidity  # a thousand lines, for whom they serve
        from rotordrop.elements.catalog.lookup import find_bearing

        known, rigidity = self.model_fields_set, None
        if self.axial_rigidity is not None:
            if "preload" not in known or not self.preload.value > 0.0:
                shown = format_quantity(self.axial_rigidity.value, "stiffness")
                told = (
                    f"axial_rigidity = {shown} holds at a preload; add the force it is listed for, for "
                    'example preload = "100 N"'
                )
                raise Misfit(told, ("axial_rigidity",))
            hybrid = self.ball_material == "silicon nitride" if "ball_material" in known else None
            rigidity = PairRigidity(
                value=self.axial_rigidity.value, preload=self.preload.value, hybrid=hybrid
            )
        ratings = {
            name: getattr(self, name).value
            for name in ("static_load_rating", "dynamic_load_rating")
            if name in known
        }
        try:
            return find_bearing(self.designation, **ratings, rigidity=rigidity)
        except LookupError as error:
            described = known.issuperset(self._needed()) and ("preload" in known or self._has_clearance())
            if described:
                return None
            raise Misfit(str(error), ("designation",)) from None

    def left_out(self) -> dict[str, Any]:
        """Take what was left out from the catalogue and the material of the balls."""
        entry, known = self.catalogue_entry(), self.model_fields_set
        if entry is not None:
            values = self._from_catalogue(entry)
        else:
            why = "a usual value for spindle bearings"
            usual = Known(value=_CONFORMITY, status="default", source=why)
            values = {"conformity_inner": usual, "conformity_outer": usual}
        material = values.get("ball_material", self.ball_material)
        if "ball_material" in known:
            material = self.ball_material
        for name, (value, unit) in _BALL_MATERIALS[material].items():
            values[name] = Known(value=value, status="default", source=f"balls of {material}", unit=unit)
        loose = self._has_clearance(entry)
        if loose:
            values |= self._of_clearance(entry)
        given = values | {name: getattr(self, name) for name in known}
        ball, pitch, count = given["ball_diameter"].value, given["pitch_diameter"].value, given["ball_count"]
        if ball * count > 3.14159266 * pitch:
            raise Misfit(
                f"{count} balls of {ball * 1e3:.4g} mm do not fit on a pitch diameter of "
                f"{pitch * 1e3:.4g} mm; at most {int(3.14159266 * pitch / ball)} do",
                ("ball_count",),
            )
        if loose:
            _check_play(given)
        if self.sprung:
            values |= self._of_springs(given)
        return {name: value for name, value in values.items() if name not in known}

    def _of_springs(self, given: dict[str, Any]) -> dict[str, Any]:
        """What springs, rings and fits are where the file does not say it."""
        from rotordrop.physics.ball_bearing import bearing_constants  # compiled, as the numbers are
        from rotordrop.physics.ring import row_rigidity

        if not given["preload"].value > 0.0:
            told = 'springs press the rings together, but the preload is zero; give it, such as "100 N"'
            raise Misfit(f'{told}, or preload_kind = "rigid"', ("preload_kind",))
        whole = SimpleNamespace(**{name: getattr(self, name) for name in type(self).model_fields} | given)
        rate = 0.2 * row_rigidity(bearing_constants(whole))
        mass, _, _ = outer_ring(whole)
        rows = (
            ("spring_rate", rate, 3.0, "a tenth of the rigidity of the pair, chosen and not measured", "N/m"),
            ("ring_mass", mass, 1.3, "a steel ring from 0.6 ball diameters outside the pitch circle", "kg"),
            ("ring_travel", 0.2e-3, 2.0, "usual room of springs, chosen and not measured", "m"),
        )
        values = {
            name: Known(value=one, status="default", range=(one / by, one * by), source=why, unit=unit)
            for name, one, by, why, unit in rows
        }
        why = "nobody knows it: 0.1 to 0.2 of steel in steel, more where it tilts"
        friction = Known(value=0.15, status="default", range=(0.0, 0.4), source=why, unit="1")
        why = "dashpots along the lines of contact, as they damp the race; not measured"
        damping = Known(value=1.0, status="default", range=(0.0, 2.0), source=why, unit="1")
        return values | {"fit_friction": friction, "ring_damping": damping}

    def _of_clearance(self, entry: CatalogueBearing | None) -> dict[str, Any]:
        """Clearance of a class, and what goes without saying beside one: no preload, no contact angle."""
        known, values = self.model_fields_set, dict[str, Any]()
        preloaded = ("preload" in known and self.preload.value > 0.0) or self.preload_class is not None
        if not preloaded:
            why = "a bearing with clearance has none unless it is given"
            values["preload"] = Known(value=0.0, status="default", source=why, unit="N")
        if entry is None and "contact_angle" not in known:
            why = "deep grooves: the angle under load follows from the clearance"
            values["contact_angle"] = Known(value=0.0, status="default", source=why, unit="rad")
        if entry is not None and entry.kind == "deep groove" and not preloaded:
            values["arrangement"] = "single"
        if self.clearance_class is None and "clearance" in known:
            return values
        said = entry.read.clearance_class if entry is not None and entry.read is not None else None
        group = self.clearance_class or said or "CN"
        if "clearance" in known:
            raise Misfit("the clearance is given both as a length and as a class; keep one", ("clearance",))
        bore = self.bore_diameter.value if self.bore_diameter else entry.bore if entry else None
        if bore is None:
            raise Misfit(
                f'clearance = "{group}" depends on the bore of the bearing; add for example bore_diameter = '
                '"80 mm", or give the clearance as a length',
                ("clearance",),
            )
        bounds = clearance_range(group, bore)
        if bounds is None:
            raise Misfit(
                f"the classes of clearance are known for bores of 6 to 200 mm, not for {1e3 * bore:.4g} mm; "
                "give the clearance as a length",
                ("clearance",),
            )
        why, middle = f"middle of {group} for a bore of {1e3 * bore:.4g} mm, ISO 5753-1", 0.5 * sum(bounds)
        return values | {
            "clearance": Known(value=middle, status="inferred", range=bounds, source=why, unit="m")
        }

    def _from_catalogue(self, entry: CatalogueBearing) -> dict[str, Any]:
        """What the catalogue, or a size alone, gives or lets infer."""
        balls, read = entry.complement, entry.read
        listed = f"{entry.maker} catalogue, {entry.designation}" if entry.listed else "ISO 15"
        unsaid = "; the designation does not say it" if entry.contact_angle_range else ", the designation"
        rows = (
            ("ball_diameter", balls.ball_diameter, balls.diameter_range, balls.basis, "m"),
            ("pitch_diameter", balls.pitch_diameter, None, balls.basis, "m"),
            ("bore_diameter", entry.bore, None, listed, "m"),
            ("width", entry.width, None, listed, "m"),
            ("conformity_inner", balls.conformity, balls.conformity_range, balls.basis, ""),
            ("conformity_outer", balls.conformity, balls.conformity_range, balls.basis, ""),
            ("contact_angle", entry.contact_angle, entry.contact_angle_range, f"{listed}{unsaid}", "rad"),
        )
        values: dict[str, Any] = {
            name: Known(value=value, status="inferred", range=bounds, source=why, unit=unit)
            for name, value, bounds, why, unit in rows
            if value is not None
        }
        if balls.count_range is not None and "ball_count" not in self.model_fields_set:
            values["ball_count_range"] = balls.count_range
        values |= {"ball_count": balls.ball_count, "ball_material": entry.ball_material}
        if read is not None and read.arrangement is not None:
            values["arrangement"] = read.arrangement
        if entry.preload:
            said = self.preload_class or (None if read is None else read.preload_class)
            status: Literal["default", "inferred"] = "inferred" if said else "default"
            group = said or "light"
            force, spread = entry.preload[group], 1.0
            why = f"{entry.maker} catalogue, {group} preload of {entry.designation}"
            if entry.preload_basis:
                why, spread = f"{group} preload {entry.preload_basis}", PRELOAD_FACTOR
            if not said:  # whoever mounted the pair chose a class, and the designation does not say which
                why = f"{why}, if not heavier"
            most = force if said else max(entry.preload.values())
            bounds = None if most == force and spread == 1.0 else (force / spread, spread * most)
            values["preload"] = Known(value=force, status=status, range=bounds, source=why, unit="N")
        return values

    def numbers(self) -> BearingNumbers:
        """Give the numbers that follow from it."""
        from rotordrop.elements.bearing_numbers import BearingNumbers  # loads the laws of balls

        rings = self.ring_youngs_modulus.value, self.ring_poisson_ratio.value
        return BearingNumbers(rings, self)

    def check_bore(self, radius: float) -> None:
        """Refuse a bore [m] that reaches into the inner ring or the balls."""
        entry = self.catalogue_entry()
        if entry is not None and radius > 0.5 * entry.bore * (1.0 + 1e-9):
            raise Misfit(
                f"the bore radius {radius * 1e3:.4g} mm is larger than that of {entry.designation}, "
                f"{0.5e3 * entry.bore:.4g} mm; a diameter perhaps, or another bearing",
                ("bore_radius",),
            )
        inner = 0.5 * (self.pitch_diameter.value - self.ball_diameter.value)
        if radius >= inner:
            raise Misfit(
                f"the bore radius {radius * 1e3:.4g} mm must be smaller than the radius of the inner groove, "
                f"{inner * 1e3:.4g} mm; a diameter perhaps?",
                ("bore_radius",),
            )

    def usual_race_width(self) -> tuple[float, str]:
        """Width of all rows [m], and why."""
        rows = self.rows
        if self.width is not None:
            return rows * self.width.value, "width of all rows"
        return rows * 1.6 * self.ball_diameter.value, "1.6 ball diameters per row"

    @property
    def rim_radius(self) -> float:
        """0.3 ball diameters inside the pitch circle [m], where shoulders usually end (chosen)."""
        return 0.5 * (self.pitch_diameter.value - 0.6 * self.ball_diameter.value)

    def race_of_size(self, race: Race, width: Known, bore: float) -> Race:
        """Give the race the mass of a ring from the bore to below the balls."""
        radius = self.rim_radius
        why = "steel ring from the bore to 0.6 ball diameters inside the pitch circle"
        return race.sized(width, bore, radius, why)

    def oddities(self, bore_radius: float) -> Iterator[Oddity]:
        """A preload beyond the heavy class, balls far from the bore."""
        entry, preload = self.catalogue_entry(), self.preload.value
        if entry is not None and entry.preload and preload > entry.preload["heavy"]:
            heavy = entry.preload["heavy"]
            text = (
                f"the preload of {format_quantity(preload, 'force')} exceeds the heavy class of "
                f"{entry.designation}, {format_quantity(heavy, 'force')}; check that it is the force of one "
                "row"
            )
            yield "preload", preload, heavy, text
        pitch, least, most = self.pitch_diameter.value, 2.0 * bore_radius, 6.0 * bore_radius
        if not least <= pitch <= most:
            limit = least if pitch < least else most
            shown, bound = (format_quantity(number, "length") for number in (pitch, limit))
            side = f"{'above' if pitch > most else 'below'} {bound}"
            look = "where no machine is known; the balls run outside of the bore"
            yield "pitch diameter", pitch, limit, f"pitch diameter {shown} lies {side}, {look}"

    def reason(self, name: str) -> str:
        """Say why a value that was left out is what it is."""
        entry = self.catalogue_entry()
        if entry is not None and name in ("ball_count", "ball_count_range", "ball_material"):
            listed = f"{entry.maker} catalogue" if entry.listed else "the designation"
            return listed if name == "ball_material" else entry.complement.basis
        if name == "arrangement" and self.arrangement != type(self).model_fields[name].default:
            return "the designation"
        return super().reason(name)


def outer_ring(balls: Any) -> tuple[float, float, float]:
    """Mass [kg], outer radius and width [m] of a steel ring around the balls of a row."""
    ball, pitch = balls.ball_diameter.value, balls.pitch_diameter.value
    bore = 0.5 * balls.bore_diameter.value if balls.bore_diameter else 0.5 * pitch - ball / _BALL_HEIGHT
    width = balls.width.value if balls.width else 1.6 * ball
    mass = STEEL_DENSITY * math.pi * ((pitch - bore) ** 2 - 0.25 * (pitch + 0.6 * ball) ** 2) * width
    return mass, pitch - bore, width


def _check_play(values: dict[str, Any]) -> None:
    """Refuse a clearance that the grooves or the other values leave no room for."""
    play, preload = values["clearance"].value, values["preload"].value
    angle, ball = values["contact_angle"].value, values["ball_diameter"].value
    if angle > 0.0 and values.get("arrangement") in ("single", "tandem"):
        raise Misfit(
            f"contact angle {math.degrees(angle):.4g}° and clearance say the same of rows that face one way; "
            "keep one of them",
            ("clearance",),
        )
    if angle > 0.0 and preload > 0.0 and play > 0.0:
        raise Misfit(
            f"a pair with a contact angle has a preload ({preload:.4g} N) or a clearance "
            f"({1e6 * play:.4g} µm), not both; set one of them to zero",
            ("clearance",),
        )
    grooves = (values["conformity_inner"].value + values["conformity_outer"].value - 1.0) * ball
    most = 2.0 * grooves * (1.0 - math.cos(angle)) if angle > 0.0 else grooves
    if play > most:
        raise Misfit(
            f"a clearance of {1e6 * play:.4g} µm is more than the {1e6 * most:.4g} µm that these grooves "
            f"{f'leave at {math.degrees(angle):.4g}°' if angle > 0.0 else 'allow'}; check it",
            ("clearance",),
        )


def _offset_of_preload(balls: BallBearing, force: float) -> float:
    return balls.changed(preload=Known(value=force)).numbers().constants.axial_offset


def _by_offset(bearing: Any) -> Measure:
    """The preload by the axial offset of the rows, which is what the ball forces depend on."""
    from rotordrop.physics.ball_bearing import preload_of_offset  # compiled, as the numbers are

    constants = bearing.bearing.numbers().constants
    return Measure(
        name="axial offset of the ball rows",
        start=constants.axial_offset,
        of_value=partial(_offset_of_preload, bearing.bearing),
        value_of=partial(preload_of_offset, constants),
    )


def clearance_sigma(balls: BallBearing) -> float:
    """Standard deviation of a clearance [m]: by its range, else as a class leaves it and a fit takes away.

    As wide as CN of ISO 5753-1 for the bore, or the nearest one that it lists.
    """
    assert balls.clearance is not None
    within = balls.clearance.interval_90 or balls.clearance.range
    if within is None:
        bore = balls.pitch_diameter.value - 2.0 * balls.ball_diameter.value / _BALL_HEIGHT
        bore = balls.bore_diameter.value if balls.bore_diameter else bore
        within = clearance_range("CN", min(max(bore, LISTED_BORES[0]), LISTED_BORES[1]))
    assert within is not None
    return (within[1] - within[0]) / (2.0 * NINETY)


PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        path="preload",
        label="preload",
        kind="force",
        measured_by="the preload of the bearing at {owner}, from its drawing",
        logarithmic=False,  # by the axial offset of the ball rows, which is what the ball forces depend on
        guess_sigma=0.15,
        entries=bearing_entries(L.AXIAL_OFFSET),
        stored="bearing.preload",
        estimated_by=_by_offset,
    ),
)
"""Unknowns of a ball bearing."""

STATED: tuple[Parameter, ...] = (
    stated_only(
        "bearing.fit_friction",
        "friction of the outer rings in their housing",
        "dimensionless",
        0.1,
        L.RING + ring.FRICTION,
        logarithmic=False,
        lower=0.0,
    ),
    stated_only(
        "bearing.ring_damping",
        "damping of the outer rings by their balls",
        "dimensionless",
        0.6,
        L.RING + ring.DAMPING,
        logarithmic=False,
        lower=0.0,
    ),
    stated_only("bearing.spring_rate", "rate of the preload springs", "stiffness", 0.7, L.RING + ring.RATE),
    stated_only(
        "bearing.ring_mass",
        "mass of an outer ring",
        "mass",
        0.2,
        L.RING + ring.MASS,
        measured_by="an outer ring of {owner}, weighed",
    ),
    stated_only(
        "bearing.ring_travel", "way of the outer rings up to their stop", "length", 0.4, L.RING + ring.TRAVEL
    ),
)
"""Unknowns of rings that springs press on."""
