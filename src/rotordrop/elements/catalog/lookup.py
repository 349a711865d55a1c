"""Find a bearing by its designation: as its maker lists it, else inferred from its size."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import lru_cache
from importlib.resources import files
from typing import Any, Literal

from rotordrop.document import stated
from rotordrop.elements.catalog.boundary import (
    CLASSES,
    DIMENSION_SERIES,
    PRELOAD_CLASSES,
    PreloadClass,
    boundary_dimensions,
    clearance_range,
    known_bores,
)
from rotordrop.elements.catalog.designation import Designation, Kind, read_designation
from rotordrop.elements.catalog.inference import BallComplement, PairRigidity, infer_balls
from rotordrop.errors import UsageError
from rotordrop.require import require

_UNSAID_ANGLE, _UNSAID_ANGLES = math.radians(25.0), (math.radians(15.0), math.radians(30.0))
_FAMILIES = ("B", "HCB", "XCB", "HS", "HC", "XC")
_HYBRID_PRELOAD = 0.6
"""Preload of hybrid over steel bearings of one class in the catalogue [1]."""


class UnknownBearingError(UsageError, LookupError):
    """A designation that is in no catalogue, and of which nothing can be inferred."""


@dataclass(frozen=True, kw_only=True)
class CatalogueBearing:
    """A bearing as its maker lists it."""

    maker: str
    designation: str
    """Maker and full designation."""
    bore: float
    outside_diameter: float
    """Bore and outside diameter [m]."""
    width: float | None
    """Width of one bearing [m]."""
    contact_angle: float
    """Nominal contact angle [rad]."""
    preload: dict[PreloadClass, float]
    axial_rigidity: dict[PreloadClass, float]
    lift_off: dict[PreloadClass, float]
    """By preload class: preload [N], axial rigidity of the pair [N/m], lift-off force [N]."""
    ball_material: Literal["steel", "silicon nitride"]
    """"steel" or "silicon nitride"."""
    complement: BallComplement
    """Balls of one row."""
    kind: Kind = "angular contact"
    """Whether the grooves have shoulders on both sides."""
    contact_angle_range: tuple[float, float] | None = None
    """Angles [rad] it may have where the designation does not say it."""
    listed: bool = True
    """Whether its maker's list is in the catalogue; False where size and balls follow from the designation.
    """
    preload_basis: str = ""
    """What the preloads rest on, where they are not its maker's."""
    read: Designation | None = None
    """What the designation said, where it was not found in a maker's list."""

    @property
    def clearance_range(self) -> tuple[float, float] | None:
        """Radial clearance [m] of the class that a deep-groove designation names, CN where it names none."""
        if self.kind != "deep groove" or self.read is None:
            return None
        return clearance_range(self.read.clearance_class or "CN", self.bore)

    def as_json(self) -> dict[str, Any]:
        """Give it ready for JSON, in SI units."""
        return stated(
            self,
            "designation maker listed kind bore_m outside_diameter_m width_m contact_angle_rad "
            "contact_angle_range_rad ball_material ball_count=complement.ball_count "
            "ball_count_range=complement.count_range ball_diameter_m=complement.ball_diameter "
            "ball_diameter_range_m=complement.diameter_range pitch_diameter_m=complement.pitch_diameter "
            "conformity=complement.conformity conformity_range=complement.conformity_range "
            "basis=complement.basis clearance_range_m preload_N preload_basis axial_rigidity_N_per_m",
            preload_basis=self.preload_basis or None,
        )


def find_bearing(
    designation: str,
    *,
    static_load_rating: float | None = None,
    dynamic_load_rating: float | None = None,
    rigidity: PairRigidity | None = None,
) -> CatalogueBearing:
    """Find a bearing by designation, however it is written.

    A bearing of the catalogue comes with the numbers of its maker. Of any other of the series 60, 62, 618,
    619, 70, 72, 718 and 719 the boundary dimensions are those of ISO 15 and the balls are inferred from them
    and from the load ratings [N] and the axial rigidity of a pair where these are given.

    Raises
    ------
    UnknownBearingError
        When neither is possible; the message names the nearest designations.
    """
    require(designation, "designation", str, hint="Write it as a text, '7203'")
    require(static_load_rating, "static_load_rating [N]", float, above=0.0, none=True)
    require(dynamic_load_rating, "dynamic_load_rating [N]", float, above=0.0, none=True)
    require(rigidity, "rigidity", PairRigidity, none=True)
    return _found(designation, static_load_rating, dynamic_load_rating, rigidity)


@lru_cache(maxsize=256)
def _found(
    designation: str, static: float | None, dynamic: float | None, rigidity: PairRigidity | None
) -> CatalogueBearing:
    found = _index().get(_key(designation))
    if found is not None:
        return found
    read = read_designation(designation)
    if read is None:
        raise UnknownBearingError(_unknown(designation, _nearest(designation)))
    unknown = next((one for one in read.unread if re.fullmatch(r"C\d", one.upper())), None)
    if read.kind == "deep groove" and unknown is not None:
        told = f"{designation}: {unknown} is no class of clearance; choose {', '.join(CLASSES)}"
        raise UnknownBearingError(told)
    listed = _index().get(_key(_listed_name(read)))
    if listed is not None:
        return replace(listed, read=read)
    if _is_mistyped(read):
        raise UnknownBearingError(_unknown(designation, _nearest(designation)))
    return infer_from_designation(read, static, dynamic, rigidity)


def search_bearings(text: str) -> list[CatalogueBearing]:
    """Bearings that a designation may mean: the one of that name first, then those of its size."""
    try:
        first = [find_bearing(text)]
    except LookupError:
        first = []
    read = read_designation(text)
    if read is None:
        return first or [find_bearing(name) for name in _nearest(text)]
    size = boundary_dimensions(read.series, read.bore)
    same = [b for b in _index().values() if size and _is_of_size(b, read.bore, size[0])]
    return first + [b for b in same if not first or b.designation != first[0].designation]


def _is_mistyped(read: Designation) -> bool:
    """Whether a bearing of a family of the catalogue goes on with letters that are no contact angle."""
    family = re.sub(r"^(H[CS]|XC)S$", r"\1", read.prefix)
    return family in _FAMILIES and read.contact_angle is None and read.goes_on


def _nearest(designation: str) -> list[str]:
    """Listed names like one, or the same with the digits for which O and I were typed."""
    digits = re.sub(r"[OI](?=[OI]*\d)", lambda typed: "01"["OI".index(typed[0])], designation.upper())
    if digits != designation.upper() and read_designation(digits):
        return [digits]
    close = get_close_matches(_key(designation), list(_index()), 3, 0.7)
    return [_index()[key].designation for key in close]


def _unknown(designation: str, nearest: list[str], why: str = "") -> str:
    if re.match(r"NN|N[UJP]?\s?\d", designation.upper()):
        return f"{designation!r} names a roller bearing, and the model is one of balls; give another bearing"
    series = ", ".join(sorted(DIMENSION_SERIES, key=int))
    hint = f"did you mean {' or '.join(nearest)}?" if nearest else f"it has the series {series}."
    return (
        f"the catalogue holds no bearing {designation!r}{why}; {hint} Else give the geometry: "
        "'ball_diameter', 'ball_count', 'pitch_diameter', and of deep grooves a 'clearance', of others "
        "'contact_angle' and a 'preload' in N"
    )


def _listed_name(read: Designation) -> str:
    """The name under which a maker of the catalogue would list it: family, size and letter of the angle."""
    letter = {15: "C", 25: "E"}.get(round(math.degrees(read.contact_angle or 0.0)), "")
    prefix = re.sub(r"^(H[CS]|XC)S$", r"\1", read.prefix)
    if (
        not letter and read.prefix == "S"
    ):  # spindle bearing of the maker that writes S; its letter was left out
        letter = next((c for c in "EC" if _key(f"S{read.basic}{c}") in _index()), "")
    return f"{prefix}{read.basic}{letter}"


def infer_from_designation(
    read: Designation,
    static: float | None = None,
    dynamic: float | None = None,
    rigidity: PairRigidity | None = None,
) -> CatalogueBearing:
    """A bearing of which only the designation, and perhaps its load ratings [N] or rigidity, are known."""
    size = boundary_dimensions(read.series, read.bore)
    if size is None:
        near = sorted(known_bores(read.series), key=lambda bore: abs(bore - read.bore))[:3]
        names = [replace(read, bore=bore).basic for bore in sorted(near)]
        at = f"series {read.series} at a bore of {1e3 * read.bore:g} mm"
        why = f": the boundary dimensions of {at} are not known"
        raise UnknownBearingError(_unknown(read.written, names, why))
    angle, angles = read.contact_angle, None
    if read.kind == "deep groove":
        angle = 0.0
    elif angle is None:
        angle, angles = _UNSAID_ANGLE, _UNSAID_ANGLES
    balls = infer_balls(
        kind=read.kind,
        dimension_series=DIMENSION_SERIES[read.series],
        bore=read.bore,
        outside_diameter=size[0],
        contact_angle=angle,
        small_balls=read.balls == "small",
        static_load_rating=static,
        dynamic_load_rating=dynamic,
        rigidity=rigidity
        if rigidity is None or rigidity.hybrid is not None
        else replace(rigidity, hybrid=read.hybrid),
    )
    preload, basis = _usual_preload(read, size[0], angle)
    return CatalogueBearing(
        maker=read.maker or "ISO 15",
        designation=read.written,
        bore=read.bore,
        outside_diameter=size[0],
        width=size[1],
        contact_angle=angle,
        preload=preload,
        axial_rigidity={},
        lift_off={},
        ball_material="silicon nitride" if read.hybrid else "steel",
        complement=balls,
        kind=read.kind,
        contact_angle_range=angles,
        listed=False,
        preload_basis=basis,
        read=read,
    )


def _usual_preload(read: Designation, outside: float, angle: float) -> tuple[dict[PreloadClass, float], str]:
    """Preloads [N] of the listed bearings of that size, carried to its angle and balls; empty without any."""
    same = [
        b
        for b in _index().values()
        if _is_of_size(b, read.bore, outside) and ball_size(b.designation) == read.balls
    ]
    if read.kind == "deep groove" or not same:
        return {}, ""
    factors = [
        math.sin(angle)
        / math.sin(b.contact_angle)
        * (
            1.0
            if read.hybrid == (b.ball_material != "steel")
            else _HYBRID_PRELOAD ** (1 if read.hybrid else -1)
        )
        for b in same
    ]
    preload = {
        name: math.exp(
            sum(math.log(f * b.preload[name]) for f, b in zip(factors, same, strict=True)) / len(same)
        )
        for name in PRELOAD_CLASSES
    }
    names = ", ".join(b.designation for b in same[:3]) + (" and others" if len(same) > 3 else "")
    return preload, f"carried over from listed bearings of the same size ({names}), within a factor of two"


def _is_of_size(bearing: CatalogueBearing, bore: float, outside: float) -> bool:
    return abs(bearing.bore - bore) < 1e-6 and abs(bearing.outside_diameter - outside) < 1e-6


def designations() -> tuple[str, ...]:
    """Every designation in the catalogue."""
    return tuple(bearing.designation for bearing in _index().values())


def _key(designation: str) -> str:
    """Letters and digits, without cage, accuracy and universal matching."""
    plain = re.sub(r"[^A-Z0-9]", "", designation.upper())
    return re.sub(r"(T?P4S?|TA)(UL|DUL)?$", "", plain)


@lru_cache(maxsize=1)
def _index() -> dict[str, CatalogueBearing]:
    fag, gmn = _read("fag.json"), _read("gmn.json")
    listed = [_fag(row) for row in fag["bearings"]] + [_gmn(row) for row in gmn["bearings"]]
    return {_key(bearing.designation): bearing for bearing in listed}


def _read(name: str) -> Any:
    return json.loads((files("rotordrop.elements.catalog") / name).read_text(encoding="utf-8"))


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
    return {name: value * factor for name, value in zip(PRELOAD_CLASSES, values, strict=True)}


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
    """Size of the balls of a series: HS, HC, XC of FAG and KH of GMN have small ones, all others standard."""
    return "small" if re.match(r"HS|[HX]C\d|(HY ?)?KH", designation) else "standard"
