"""The rolling bearing inside a touchdown bearing: by designation or by geometry."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import Field, Strict

from rotordrop.elements.catalog import (
    PRELOAD_FACTOR,
    BallComplement,
    CatalogueBearing,
    PairRigidity,
    PreloadClass,
    find_bearing,
)
from rotordrop.elements.catalog.boundary import CLASSES, ClearanceClass, clearance_range
from rotordrop.elements.description import Misfit, Text, Usual
from rotordrop.elements.race_bearing import Oddity, RaceBearing
from rotordrop.elements.rotor import DENSITY, ELASTIC, POISSON
from rotordrop.elements.values import (
    Angle,
    Conformity,
    ContactAngle,
    Density,
    Force,
    NonNegativeLength,
    Number,
    PoissonRatio,
    PositiveForce,
    PositiveLength,
    PositiveSpeed,
    Pressure,
    Stiffness,
    default,
    follows,
)
from rotordrop.known import Known
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.elements.ball_numbers import BallNumbers

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
        "ball_density": (7800.0, "kg/m^3"),
    },
}

STATIC_STRESS = 4.2e9
"""Hertz stress [Pa] of the static load rating C0 of a ball bearing, ISO 76: the race is dented beyond it."""

_CONFORMITY = 0.53
_NEEDED = ("ball_diameter", "ball_count", "pitch_diameter", "contact_angle")
_ROWS = {1: "single", 2: "X"}
_CLEARANCE = ("clearance", "clearance_class")
_PRELOAD_CLASSES = ("light", "medium", "heavy")


class BallBearing(RaceBearing):
    """A ball bearing: an angular-contact pair under preload, or one or two rows with radial clearance.

    A row of deep grooves has no contact angle of its own: the clearance leaves it one, and the load zone.
    Where a pair has a contact angle and a clearance, the clearance is the play its rows were mounted with.
    """

    designation: Text | None = None
    """Designation, for example "XCB71914-E"; where no maker's list in the catalogue has it, the balls are
    inferred from its size."""
    ball_diameter: PositiveLength = follows("reconstructed from the catalogue")
    """Ball diameter D_w and pitch diameter D_pw [m]."""
    ball_count: Annotated[int, Strict(), Field(ge=3)] = Field(default=0, validate_default=False)
    """Balls per row."""
    pitch_diameter: PositiveLength = follows("reconstructed from the catalogue")
    """Ball diameter D_w and pitch diameter D_pw [m]."""
    contact_angle: ContactAngle = follows("from the catalogue")
    """Nominal contact angle [rad]."""
    conformity_inner: Conformity = follows("0.53, a usual value for spindle bearings")
    conformity_outer: Conformity = follows("0.53, a usual value for spindle bearings")
    """Groove radius over ball diameter [1]."""
    ball_material: BallMaterial = Field(
        default="silicon nitride", description="Touchdown bearings usually have ceramic balls"
    )
    """Material of the balls."""
    ring_youngs_modulus: Pressure = default(208e9, "bearing steel")
    ring_poisson_ratio: PoissonRatio = default(0.3, "bearing steel")
    """Ring material [Pa], [1]."""
    ball_youngs_modulus: Pressure = follows("from the ball material")
    ball_poisson_ratio: PoissonRatio = follows("from the ball material")
    ball_density: Density = follows("from the ball material")
    """Ball material [Pa], [1], [kg/m³]."""
    preload: Force = follows("that of the preload class")
    """Axial preload force F_V of each row [N]."""
    preload_class: PreloadClass | None = None
    """Preload class of the catalogue, where the preload was given so."""
    clearance: NonNegativeLength | None = None
    """Radial internal clearance, from one extreme position of the inner ring to the opposite one [m]."""
    clearance_class: ClearanceClass | None = None
    """Clearance class of ISO 5753, where the clearance was given so."""
    bore_diameter: PositiveLength | None = None
    """Bore of the inner ring [m], which a clearance class counts from."""
    arrangement: Literal["X", "O", "tandem", "single"] = Field(
        default="X", description="Two rows face to face, as in Neisi 2020"
    )
    """Arrangement of the rows; ``rows = 1`` writes "single", ``rows = 2`` "X"."""
    first_ball_angle: Angle = default(0.0, "the first ball is straight up")
    """Angle of the first ball from +y, positive with the spin [rad]."""
    second_row_offset: Number = default(0.0, "the balls of both rows stand at the same angles")
    """Angle by which the second row is turned, as a fraction of the ball pitch [1]."""
    width: PositiveLength | None = None
    """Width of one row [m]."""
    limiting_speed: PositiveSpeed | None = None
    """Speed up to which the maker allows the bearing [rad/s]."""
    static_load_rating: PositiveForce | None = None
    """Static load rating of one row."""
    dynamic_load_rating: PositiveForce | None = None
    """Dynamic load rating of one row."""
    axial_rigidity: Stiffness | None = None
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

    reserved: ClassVar[Mapping[str, str]] = {
        "preload_kind": "a preload by springs (rigid today)",
        "row_spacing": "the axial distance of two rows, which only tilt would feel",
    }

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Read ``preload = "light"``, ``clearance = "C3"``, ``rows = 1``, one conformity for both races."""
        preload = raw.get("preload")
        if preload in _PRELOAD_CLASSES:
            raw["preload_class"] = raw.pop("preload")
        elif isinstance(preload, str) and preload.isalpha():
            close = get_close_matches(preload, _PRELOAD_CLASSES, 1, 0.5)
            hint = f"did you mean {close[0]!r}?" if close else f"classes are {', '.join(_PRELOAD_CLASSES)}"
            told = f'{preload!r} is no preload class; {hint} Else give a force, "100 N"'
            raise Misfit(told, ("preload",))
        clearance = raw.get("clearance")
        if clearance in CLASSES:
            raw["clearance_class"] = raw.pop("clearance")
        elif isinstance(clearance, str) and not any(unit in clearance for unit in ("m", "in", "thou")):
            told = f"{clearance!r} is neither a length nor a clearance class ({', '.join(CLASSES)})"
            raise Misfit(f'{told}; write for example "C3" or "40 um"', ("clearance",))
        if "rows" in raw:
            raw["arrangement"] = _arrangement(raw.pop("rows"), raw.get("arrangement"))
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
        catalogued = self.catalogue_entry()
        missing = [name for name in self._needed() if name not in self.model_fields_set]
        if catalogued is None and missing:
            raise Misfit(
                f"the bearing has no {', '.join(repr(name) for name in missing)}; give its 'designation' or "
                "its geometry"
            )
        if self.preload_class is not None:
            self._check_preload_class(catalogued)
        elif not self._has_preload(catalogued) and not self._has_clearance(catalogued):
            raise Misfit(
                'the bearing has no \'preload\'; write for example preload = "100 N", or clearance = "12 um"'
            )

    def _has_preload(self, entry: CatalogueBearing | None) -> bool:
        return "preload" in self.model_fields_set or (entry is not None and bool(entry.preload))

    def _has_clearance(self, entry: CatalogueBearing | None = None) -> bool:
        """Whether the rows have play: a clearance is given, or the grooves are deep."""
        given = not self.model_fields_set.isdisjoint(_CLEARANCE)
        return given or (entry is not None and entry.kind == "deep groove")

    def _needed(self) -> tuple[str, ...]:
        """What a bearing outside the catalogue must say of itself; a clearance leaves it a contact angle."""
        return _NEEDED[:-1] if self._has_clearance() else _NEEDED

    def _check_preload_class(self, catalogued: CatalogueBearing | None) -> None:
        if "preload" in self.model_fields_set:
            raise Misfit(
                "the preload is given both as a force and as a class; keep one of them", ("preload",)
            )
        if catalogued is None or not catalogued.preload:
            raise Misfit(
                f"preload = {self.preload_class!r} needs a 'designation' that is in the catalogue; "
                'give the force, for example preload = "100 N"',
                ("preload",),
            )

    def catalogue_entry(self) -> CatalogueBearing | None:
        """Find the bearing in the catalogue; a bearing described by its geometry need not be there."""
        if self.designation is None:
            return None
        known = self.model_fields_set
        described = all(name in known for name in self._needed()) and (
            "preload" in known or self._has_clearance()
        )
        ratings = {
            name: getattr(self, name).value
            for name in ("static_load_rating", "dynamic_load_rating")
            if name in known
        }
        try:
            return find_bearing(self.designation, **ratings, rigidity=self._stated_rigidity())
        except LookupError as error:
            if described:
                return None
            raise Misfit(str(error), ("designation",)) from None

    def _stated_rigidity(self) -> PairRigidity | None:
        """The axial rigidity that is given, with the preload and the balls it holds for."""
        if self.axial_rigidity is None:
            return None
        known = self.model_fields_set
        if "preload" not in known or not self.preload.value > 0.0:
            shown = format_quantity(self.axial_rigidity.value, "stiffness")
            told = (
                f"axial_rigidity = {shown} holds at a preload; add the force it is listed for, for example "
                'preload = "100 N"'
            )
            raise Misfit(told, ("axial_rigidity",))
        hybrid = self.ball_material == "silicon nitride" if "ball_material" in known else None
        return PairRigidity(value=self.axial_rigidity.value, preload=self.preload.value, hybrid=hybrid)

    def left_out(self) -> dict[str, Any]:
        """Take what was left out from the catalogue and the material of the balls."""
        values: dict[str, Any] = {}
        entry = self.catalogue_entry()
        if entry is not None:
            values = self._from_catalogue(entry)
        else:
            why = "a usual value for spindle bearings"
            values |= {
                f"conformity_{race}": Known(value=_CONFORMITY, status="default", source=why)
                for race in ("inner", "outer")
            }
        material = values.get("ball_material", self.ball_material)
        if "ball_material" in self.model_fields_set:
            material = self.ball_material
        for name, (value, unit) in _BALL_MATERIALS[material].items():
            values[name] = Known(value=value, status="default", source=f"balls of {material}", unit=unit)
        if self._has_clearance(entry):
            values |= self._of_clearance(entry)
        given = values | {name: getattr(self, name) for name in self.model_fields_set}
        self._check_fill(given)
        if self._has_clearance(entry):
            _check_play(given)
        return {name: value for name, value in values.items() if name not in self.model_fields_set}

    def _of_clearance(self, entry: CatalogueBearing | None) -> dict[str, Any]:
        """Clearance of a class, and what goes without saying beside one: no preload, no contact angle."""
        why = "a bearing with clearance has none unless it is given"
        values: dict[str, Any] = {}
        if "preload" not in self.model_fields_set and self.preload_class is None:
            values["preload"] = Known(value=0.0, status="default", source=why, unit="N")
        if entry is None and "contact_angle" not in self.model_fields_set:
            why = "deep grooves: the angle under load follows from the clearance"
            values["contact_angle"] = Known(value=0.0, status="default", source=why, unit="rad")
        preloaded = self.preload_class is not None or "preload" in self.model_fields_set
        if entry is not None and entry.kind == "deep groove" and not preloaded:
            values["arrangement"] = "single"
        if self.clearance_class is not None or "clearance" not in self.model_fields_set:
            values["clearance"] = self._clearance_of_class(entry)
        return values

    def _clearance_of_class(self, entry: CatalogueBearing | None) -> Known:
        said = entry.read.clearance_class if entry is not None and entry.read is not None else None
        group = self.clearance_class or said or "CN"
        if "clearance" in self.model_fields_set:
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
        why = f"middle of {group} for a bore of {1e3 * bore:.4g} mm, ISO 5753-1"
        middle = 0.5 * (bounds[0] + bounds[1])
        return Known(value=middle, status="inferred", range=bounds, source=why, unit="m")

    def _from_catalogue(self, entry: CatalogueBearing) -> dict[str, Any]:
        complement = entry.complement
        said = entry.read.preload_class if entry.read is not None else None
        preload_class = self.preload_class or said or "light"
        values = _inferred(entry, complement)
        if entry.read is not None and entry.read.arrangement is not None:
            values["arrangement"] = entry.read.arrangement
        if not entry.preload:
            return values
        status: Literal["default", "inferred"] = "inferred" if self.preload_class or said else "default"
        force = entry.preload[preload_class]
        why, bounds = f"{entry.maker} catalogue, {preload_class} preload of {entry.designation}", None
        if entry.preload_basis:
            why = f"{preload_class} preload {entry.preload_basis}"
            bounds = (force / PRELOAD_FACTOR, PRELOAD_FACTOR * force)
        values["preload"] = Known(value=force, status=status, range=bounds, source=why, unit="N")
        return values

    @staticmethod
    def _check_fill(values: dict[str, Any]) -> None:
        """Refuse more balls than fit on the pitch circle, and balls as large as the circle itself."""
        ball, pitch = values["ball_diameter"].value, values["pitch_diameter"].value
        count = values["ball_count"]
        if ball * count > 3.14159266 * pitch:
            raise Misfit(
                f"{count} balls of {ball * 1e3:.4g} mm do not fit on a pitch diameter of "
                f"{pitch * 1e3:.4g} mm; "
                f"at most {int(3.14159266 * pitch / ball)} do",
                ("ball_count",),
            )

    def numbers(self) -> BallNumbers:
        """Give the numbers that follow from it."""
        from rotordrop.elements.ball_numbers import BallNumbers  # compiled: a description needs no compiler

        return BallNumbers(self)

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
        rows = 1 if self.arrangement == "single" else 2
        if self.width is not None:
            return rows * self.width.value, "width of all rows"
        return rows * 1.6 * self.ball_diameter.value, "1.6 ball diameters per row"

    def race_radius(self) -> tuple[float, str]:
        """Outer radius of what spins with the inner race [m], and why."""
        radius = 0.5 * (self.pitch_diameter.value - 0.6 * self.ball_diameter.value)
        return radius, "steel ring from the bore to 0.6 ball diameters inside the pitch circle"

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
        if entry is not None and name in ("ball_count", "ball_material"):
            listed = f"{entry.maker} catalogue" if entry.listed else "the designation"
            return entry.complement.basis if name == "ball_count" else listed
        return super().reason(name)


def _arrangement(rows: Any, arrangement: Any) -> Any:
    if rows not in _ROWS or isinstance(rows, bool):
        raise Misfit(
            f"rows = {rows!r} is neither 1 nor 2; write rows = 1, or the arrangement of two rows", ("rows",)
        )
    if arrangement is None:
        return _ROWS[rows]
    if (arrangement == "single") != (rows == 1):
        raise Misfit(f"rows = {rows} does not go with arrangement = {arrangement!r}; keep one", ("rows",))
    return arrangement


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


def _inferred(entry: CatalogueBearing, complement: BallComplement) -> dict[str, Any]:
    """What the catalogue, or a size alone, gives or lets infer of the geometry."""
    listed = f"{entry.maker} catalogue, {entry.designation}" if entry.listed else "ISO 15"
    lengths = (
        ("ball_diameter", complement.ball_diameter, complement.diameter_range, complement.basis),
        ("pitch_diameter", complement.pitch_diameter, None, complement.basis),
        ("bore_diameter", entry.bore, None, listed),
        ("width", entry.width, None, listed),
    )
    values: dict[str, Any] = {
        name: Known(value=value, status="inferred", range=bounds, source=why, unit="m")
        for name, value, bounds, why in lengths
        if value is not None
    }
    for race in ("inner", "outer"):
        values[f"conformity_{race}"] = Known(
            value=complement.conformity,
            status="inferred",
            range=complement.conformity_range,
            source=complement.basis,
        )
    angle, angles = entry.contact_angle, entry.contact_angle_range
    why = f"{listed}; the designation does not say it" if angles else f"{listed}, the designation"
    values["contact_angle"] = Known(value=angle, status="inferred", range=angles, source=why, unit="rad")
    if complement.count_range is not None:
        values["ball_count_range"] = complement.count_range
    return values | {"ball_count": complement.ball_count, "ball_material": entry.ball_material}
