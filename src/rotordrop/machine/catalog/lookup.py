"""Find a bearing by its designation."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from importlib.resources import files
from typing import Any, Literal

PreloadClass = Literal["light", "medium", "heavy"]
_CLASSES: tuple[PreloadClass, ...] = ("light", "medium", "heavy")


@dataclass(frozen=True, kw_only=True)
class BallComplement:
    """Balls of one row: published, or reconstructed with what that rests on.

    Attributes
    ----------
    ball_count : int
        Balls per row.
    ball_diameter, pitch_diameter : float
        D_w and D_pw [m].
    conformity : float
        Groove radius over ball diameter of both races [1].
    basis : str
        What the numbers rest on.
    """

    ball_count: int
    ball_diameter: float
    pitch_diameter: float
    conformity: float
    basis: str


@dataclass(frozen=True, kw_only=True)
class CatalogueBearing:
    """A bearing as its maker lists it.

    Attributes
    ----------
    maker, designation : str
        Maker and full designation.
    bore, outside_diameter : float
        Bore and outside diameter [m].
    width : float or None
        Width of one bearing [m].
    contact_angle : float
        Nominal contact angle [rad].
    preload, axial_rigidity, lift_off : mapping
        By preload class: preload [N], axial rigidity of the pair [N/m], lift-off force [N].
    ball_material : str
        "steel" or "silicon nitride".
    complement : BallComplement
        Balls of one row.
    """

    maker: str
    designation: str
    bore: float
    outside_diameter: float
    width: float | None
    contact_angle: float
    preload: dict[PreloadClass, float]
    axial_rigidity: dict[PreloadClass, float]
    lift_off: dict[PreloadClass, float]
    ball_material: Literal["steel", "silicon nitride"]
    complement: BallComplement


def find_bearing(designation: str) -> CatalogueBearing:
    """Find a bearing by designation; suffixes of cage and accuracy may be left out.

    Raises
    ------
    LookupError
        When the catalogue does not hold it; the message names the nearest designations.
    """
    found = _index().get(_key(designation))
    if found is None:
        close = get_close_matches(_key(designation), list(_index()), 3, 0.7)
        nearest = ", ".join(_index()[key].designation for key in close)
        hint = f"did you mean one of {nearest}?" if close else "no designation is similar."
        raise LookupError(
            f"the catalogue holds no bearing {designation!r}; {hint} Else give the geometry: "
            "'ball_diameter', 'ball_count', 'pitch_diameter', 'contact_angle' and a 'preload' in N"
        )
    return found


def designations() -> tuple[str, ...]:
    """Every designation in the catalogue."""
    return tuple(bearing.designation for bearing in _index().values())


def _key(designation: str) -> str:
    plain = re.sub(r"[^A-Z0-9]", "", designation.upper())
    return re.sub(r"(T?P4S?|TA)(UL|DUL)?$", "", plain)


@lru_cache(maxsize=1)
def _index() -> dict[str, CatalogueBearing]:
    fag, gmn = _read("fag.json"), _read("gmn.json")
    listed = [_fag(row) for row in fag["bearings"]] + [_gmn(row) for row in gmn["bearings"]]
    return {_key(bearing.designation): bearing for bearing in listed}


def _read(name: str) -> Any:
    return json.loads((files("rotordrop.machine.catalog") / name).read_text(encoding="utf-8"))


@lru_cache(maxsize=1)
def _complements() -> dict[tuple[float, float, str], BallComplement]:
    return {
        (row["bore_mm"], row["outside_mm"], row["balls"]): BallComplement(
            ball_count=row["ball_count"],
            ball_diameter=row["ball_diameter_mm"] * 1e-3,
            pitch_diameter=row["pitch_diameter_mm"] * 1e-3,
            conformity=row["conformity"],
            basis=row["basis"],
        )
        for row in _read("complements.json")["families"]
    }


@lru_cache(maxsize=1)
def _conformities() -> dict[str, float]:
    return {row["name"]: row["conformity"] for row in _read("complements.json").get("conformities", [])}


def _by_class(values: list[float], factor: float = 1.0) -> dict[PreloadClass, float]:
    return {name: value * factor for name, value in zip(_CLASSES, values, strict=True)}


def _fag(row: dict[str, Any]) -> CatalogueBearing:
    ceramic = row["name"].startswith(("HC", "XC"))
    return CatalogueBearing(
        maker="FAG",
        designation=row["name"],
        bore=row["d"] * 1e-3,
        outside_diameter=row["D"] * 1e-3,
        width=row["B"] * 1e-3,
        contact_angle=math.radians(row["alpha"]),
        preload=_by_class(row["Fv"]),
        axial_rigidity=_by_class(row["Ca"], 1e6),
        lift_off=_by_class(row["KaE"]),
        ball_material="silicon nitride" if ceramic else "steel",
        complement=_complements()[row["d"], row["D"], ball_size(row["name"])],
    )


def _gmn(row: dict[str, Any]) -> CatalogueBearing:
    ceramic = row["name"].startswith("HY")
    return CatalogueBearing(
        maker="GMN",
        designation=row["name"],
        bore=row["d"] * 1e-3,
        outside_diameter=row["D"] * 1e-3,
        width=None,
        contact_angle=math.radians(row["alpha"]),
        preload=_by_class([pair[0] for pair in row["pre"]]),
        axial_rigidity=_by_class([pair[1] for pair in row["pre"]], 1e6),
        lift_off={},
        ball_material="silicon nitride" if ceramic else "steel",
        complement=BallComplement(
            ball_count=row["Z"],
            ball_diameter=row["Dw"] * 1e-3,
            pitch_diameter=row["dm"] * 1e-3,
            conformity=_conformities().get(row["name"], 0.53),
            basis="GMN catalogue; the conformity, not published, reproduces its axial rigidity best",
        ),
    )


def ball_size(designation: str) -> Literal["small", "standard"]:
    """Size of the balls of a FAG series: HS, HC and XC have small ones, B, HCB and XCB standard ones."""
    return "small" if re.match(r"HS|[HX]C\d", designation) else "standard"
