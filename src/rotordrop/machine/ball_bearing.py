"""The rolling bearing inside a touchdown bearing: by designation or by geometry."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, Strict

from rotordrop.estimated import Estimated
from rotordrop.machine.catalog import BallComplement, CatalogueBearing, PreloadClass, find_bearing
from rotordrop.machine.description import Description, Misfit, Text
from rotordrop.machine.values import (
    Angle,
    Conformity,
    ContactAngle,
    Density,
    Force,
    Number,
    PoissonRatio,
    PositiveForce,
    PositiveLength,
    PositiveSpeed,
    Pressure,
    default,
    follows,
)

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

_CONFORMITY = 0.53
_NEEDED = ("ball_diameter", "ball_count", "pitch_diameter", "contact_angle")
_PRELOAD_CLASSES = ("light", "medium", "heavy")


class BallBearing(Description):
    """An angular-contact ball bearing, usually a preloaded pair.

    Attributes
    ----------
    designation : str, optional
        Designation in the catalogue, for example "XCB71914-E".
    ball_diameter, pitch_diameter : Estimated
        Ball diameter D_w and pitch diameter D_pw [m].
    ball_count : int
        Balls per row.
    contact_angle : Estimated
        Nominal contact angle [rad].
    conformity_inner, conformity_outer : Estimated
        Groove radius over ball diameter [1].
    ring_youngs_modulus, ring_poisson_ratio : Estimated
        Ring material [Pa], [1].
    ball_youngs_modulus, ball_poisson_ratio, ball_density : Estimated
        Ball material [Pa], [1], [kg/m³].
    preload : Estimated
        Axial preload force F_V of each row [N].
    preload_class : {"light", "medium", "heavy"}, optional
        Preload class of the catalogue, where the preload was given so.
    arrangement : {"X", "O", "tandem", "single"}
        Arrangement of the rows.
    first_ball_angle : Estimated
        Angle of the first ball from +y, positive with the spin [rad].
    second_row_offset : Estimated
        Angle by which the second row is turned, as a fraction of the ball pitch [1].
    width : Estimated, optional
        Width of one row [m].
    limiting_speed : Estimated, optional
        Speed up to which the maker allows the bearing [rad/s].
    static_load_rating : Estimated, optional
        Static load rating C_0 of one row [N].
    """

    designation: Text | None = Field(
        default=None, description="Designation in the catalogue, such as XCB71914-E"
    )
    ball_diameter: PositiveLength = follows("reconstructed from the catalogue")
    ball_count: Annotated[int, Strict(), Field(ge=3)] = Field(
        default=0, validate_default=False, description="Balls per row; reconstructed from the catalogue"
    )
    pitch_diameter: PositiveLength = follows("reconstructed from the catalogue")
    contact_angle: ContactAngle = follows("from the catalogue")
    conformity_inner: Conformity = follows("0.53, a usual value for spindle bearings")
    conformity_outer: Conformity = follows("0.53, a usual value for spindle bearings")
    ball_material: BallMaterial = Field(
        default="silicon nitride", description="Touchdown bearings usually have ceramic balls"
    )
    ring_youngs_modulus: Pressure = default(208e9, "bearing steel")
    ring_poisson_ratio: PoissonRatio = default(0.3, "bearing steel")
    ball_youngs_modulus: Pressure = follows("from the ball material")
    ball_poisson_ratio: PoissonRatio = follows("from the ball material")
    ball_density: Density = follows("from the ball material")
    preload: Force = follows("that of the preload class")
    preload_class: PreloadClass | None = Field(default=None, description='Written as preload = "light"')
    arrangement: Literal["X", "O", "tandem", "single"] = Field(
        default="X", description="Two rows face to face, as in Neisi 2020"
    )
    first_ball_angle: Angle = default(0.0, "the first ball is straight up")
    second_row_offset: Number = default(0.0, "the balls of both rows stand at the same angles")
    width: PositiveLength | None = Field(default=None, description="Width of one row")
    limiting_speed: PositiveSpeed | None = Field(default=None, description="Highest speed the maker allows")
    static_load_rating: PositiveForce | None = Field(
        default=None, description="Static load rating of one row"
    )

    displaces: ClassVar[Mapping[str, tuple[str, ...]]] = {"preload": ("preload_class",)}

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Read ``preload = "light"`` and a conformity common to both races."""
        preload = raw.get("preload")
        if preload in _PRELOAD_CLASSES:
            raw["preload_class"] = raw.pop("preload")
        elif isinstance(preload, str) and preload.isalpha():
            close = get_close_matches(preload, _PRELOAD_CLASSES, 1, 0.5)
            hint = f"did you mean {close[0]!r}?" if close else f"classes are {', '.join(_PRELOAD_CLASSES)}"
            told = f'{preload!r} is no preload class; {hint} Else give a force, "100 N"'
            raise Misfit(told, ("preload",))
        if "conformity" in raw:
            both = raw.pop("conformity")
            raw = {"conformity_inner": both, "conformity_outer": both} | raw
        return raw

    @classmethod
    def known_keys(cls) -> tuple[str, ...]:
        """Keys to suggest for a mistyped one."""
        return (*(name for name in cls.model_fields if name != "preload_class"), "conformity")

    def check(self) -> None:
        """Refuse a bearing that is not described, or balls that do not fit."""
        catalogued = self.catalogue_entry()
        missing = [name for name in _NEEDED if name not in self.model_fields_set]
        if catalogued is None and missing:
            raise Misfit(
                f"the bearing has no {', '.join(repr(name) for name in missing)}; give its 'designation' or "
                "its geometry"
            )
        if self.preload_class is not None:
            self._check_preload_class(catalogued)
        elif catalogued is None and "preload" not in self.model_fields_set:
            raise Misfit("the bearing has no 'preload'; write for example preload = \"100 N\"")

    def _check_preload_class(self, catalogued: CatalogueBearing | None) -> None:
        if "preload" in self.model_fields_set:
            raise Misfit(
                "the preload is given both as a force and as a class; keep one of them", ("preload",)
            )
        if catalogued is None:
            raise Misfit(
                f"preload = {self.preload_class!r} needs a 'designation' that is in the catalogue; "
                'give the force, for example preload = "100 N"',
                ("preload",),
            )

    def catalogue_entry(self) -> CatalogueBearing | None:
        """Find the bearing in the catalogue; a bearing described by its geometry need not be there."""
        if self.designation is None:
            return None
        described = all(name in self.model_fields_set for name in (*_NEEDED, "preload"))
        try:
            return find_bearing(self.designation)
        except LookupError as error:
            if described:
                return None
            raise Misfit(str(error), ("designation",)) from None

    def left_out(self) -> dict[str, Any]:
        """Take what was left out from the catalogue and the material of the balls."""
        values: dict[str, Any] = {}
        entry = self.catalogue_entry()
        if entry is not None:
            values = self._from_catalogue(entry)
        else:
            why = "a usual value for spindle bearings"
            values |= {
                f"conformity_{race}": Estimated(value=_CONFORMITY, status="default", source=why)
                for race in ("inner", "outer")
            }
        material = values.get("ball_material", self.ball_material)
        if "ball_material" in self.model_fields_set:
            material = self.ball_material
        for name, (value, unit) in _BALL_MATERIALS[material].items():
            values[name] = Estimated(value=value, status="default", source=f"balls of {material}", unit=unit)
        given = values | {name: getattr(self, name) for name in self.model_fields_set}
        self._check_fill(given)
        return {name: value for name, value in values.items() if name not in self.model_fields_set}

    def _from_catalogue(self, entry: CatalogueBearing) -> dict[str, Any]:
        complement = entry.complement
        preload_class = self.preload_class or "light"
        status: Literal["default", "inferred"] = "default" if self.preload_class is None else "inferred"
        why = f"{entry.maker} catalogue, {preload_class} preload of {entry.designation}"
        return _inferred(entry, complement) | {
            "preload": Estimated(
                value=entry.preload[preload_class],
                status=status,
                source=why,
                unit="N",
            )
        }

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

    def reason(self, name: str) -> str:
        """Say why a value that was left out is what it is."""
        entry = self.catalogue_entry()
        if entry is not None and name in ("ball_count", "ball_material"):
            return entry.complement.basis if name == "ball_count" else f"{entry.maker} catalogue"
        return super().reason(name)


def _inferred(entry: CatalogueBearing, complement: BallComplement) -> dict[str, Any]:
    """What the catalogue gives or lets infer of the geometry."""
    listed = f"{entry.maker} catalogue, {entry.designation}"
    lengths = (
        ("ball_diameter", complement.ball_diameter, complement.basis),
        ("pitch_diameter", complement.pitch_diameter, complement.basis),
        ("width", entry.width, listed),
    )
    values: dict[str, Any] = {
        name: Estimated(value=value, status="inferred", source=why, unit="m")
        for name, value, why in lengths
        if value is not None
    }
    for race in ("inner", "outer"):
        values[f"conformity_{race}"] = Estimated(
            value=complement.conformity, status="inferred", source=complement.basis
        )
    values["contact_angle"] = Estimated(
        value=entry.contact_angle, status="inferred", source=listed, unit="rad"
    )
    return values | {"ball_count": complement.ball_count, "ball_material": entry.ball_material}
