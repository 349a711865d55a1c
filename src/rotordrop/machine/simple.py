"""A machine from the dozen numbers that one has, or from a rotor of another program: guesses else."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

from rotordrop.elements.catalog.lookup import find_bearing
from rotordrop.elements.rotor import Rotor
from rotordrop.elements.support import REFERENCE_MASS
from rotordrop.elements.unbalance import BalanceGrade
from rotordrop.errors import UsageError
from rotordrop.json_schema import DIALECT, TEXT, closed
from rotordrop.machine.machine import Machine, reasons
from rotordrop.machine.ross_files import MAGNETIC, ImportedRotor, Spring
from rotordrop.machine.saving import machine_text
from rotordrop.machine.schema import field_meanings
from rotordrop.units import InSI, format_quantity, in_si, si_unit

STEEL_DENSITY, STEEL_MODULUS = 7850.0, 206e9
_ELEMENTS = 16
_CLOSEST = 0.02
"""Least distance of two nodes of the beam, as a share of its length [1]."""
_SUPPORTS = {"stiff": 2e8, "soft": 1e7}
"""Guess of the stiffness of a support that is only called stiff or soft, of a rotor of 60 kg [N/m]; that of
others goes with their length, by the third root of the mass."""
_SUPPORT_REACH = 7.0
"""Factor to either side within which such a support lies (chosen)."""
_GAP_RANGE, _SUPPORT_RANGE = 1.2, 2.0
_ONE_FOR_BOTH = 5.0
"""Factor to either side within which a support lies where one stiffness is given for both ends: those of one
machine differ by up to a factor of 7 (the supplied records)."""
_SUPPORT_MASS = (0.5, 0.1, 2.5)
"""Guess and range of the mass of a support as a share of the rotor's mass [1]."""
_STIFFNESS = (0.4, 0.16, 1.0)
"""Guess and range of a rotor's bending stiffness over that of the steel cylinder of its mass and length [1].

Nothing bends at higher frequencies than that cylinder: what a rotor carries weighs and stiffens little. Nine
rotors of 5 kg to 6 t have 0.36 to 0.91 of its frequencies, so 0.4 to 1.0 is taken to hold nine in ten.
"""
_FORM = {
    "mass_to_ends": (0.5, -0.8, 1.8),
    "mass_to_de": (0.0, -1.0, 1.0),
    "stiffness_to_de": (0.0, -1.0, 1.0),
    "stiffness_to_ends": (0.0, -1.15, 1.15),
}
"""Guess and range of the form of the beam [1]; the first makes 0.8 to 1.5 of the cylinder's inertia, where
those rotors have 0.88 to 1.44."""


@dataclass(frozen=True, kw_only=True)
class SimpleMachine:
    """What is known of a machine when no drawing is at hand; texts with units, or numbers in SI units."""

    mass: InSI = InSI("mass")  # noqa: RUF009 - a descriptor, read by the dataclass
    """Mass of the rotor [kg]."""
    centre: InSI = InSI("length")  # noqa: RUF009
    """Its centre of mass [m from its NDE end]."""
    length: InSI = InSI("length")  # noqa: RUF009
    """Length of the rotor [m]."""
    bearings: tuple[float | str, float | str]
    """Two planes of touchdown bearings [m from the NDE end]."""
    sensors: tuple[float | str, float | str]
    """Two planes of sensors [m from the NDE end]."""
    sensor_angle: InSI = InSI("angle")  # noqa: RUF009
    """Direction of the first sensor of each plane, from +x [rad]; the second stands 90° before it."""
    designation: str
    """Designation of the touchdown bearings."""
    gap: InSI = InSI("length")  # noqa: RUF009
    """Radial air gap [m], known to about a fifth."""
    speed: InSI = InSI("speed")  # noqa: RUF009
    """Nominal speed [rad/s]."""
    grade: str
    """Balance grade, such as "G 2.5"."""
    support: Literal["stiff", "soft"] | str
    """Support of the touchdown bearings: "stiff", "soft", a stiffness such as "1e8 N/m", or one for each end,
    "8e7 N/m, 5e8 N/m"."""
    preload: str | None = None
    """Preload of the bearings, where their designation leaves it open."""
    name: str = "my machine"
    """Name of the machine."""


EXAMPLES = {
    "mass": "60 kg",
    "length": "1.1 m",
    "centre": "520 mm",
    "bearings": "110 mm, 980 mm",
    "sensors": "180 mm, 900 mm",
    "sensor_angle": "135 deg",
    "designation": "7014 ACD/HCP4A",
    "gap": "0.25 mm",
    "speed": "9000 rpm",
    "grade": "G 2.5",
    "support": "stiff",
    "preload": "300 N",
}


def simple_schema() -> dict[str, Any]:
    """Give the JSON Schema (draft 2020-12) of the twelve numbers, as texts with units."""
    meanings = field_meanings(SimpleMachine)
    texts = {name: TEXT | {"description": meanings[name], "examples": [of]} for name, of in EXAMPLES.items()}
    content = closed(texts) | {"required": [name for name in EXAMPLES if name != "preload"]}
    return {"$schema": DIALECT, "title": "rotordrop machine of twelve numbers", **content}


def simple_machine(known: SimpleMachine) -> Machine:
    """A machine of twelve numbers: a beam of that mass, length and centre of mass stands for the rotor.

    Both halves of the beam have the stiffness of a steel cylinder and densities that put the centre of mass
    where it is. The magnets stand at the sensors. What is not known stands as guesses with ranges.
    """
    planes = _planes(known.bearings, known.length, "bearings")
    sensed = _planes(known.sensors, known.length, "sensors")
    positions = beam_nodes(known.length, [*planes, *sensed])
    node = {place: positions.index(place) + 1 for place in (*planes, *sensed)}
    notes = (
        "made of twelve numbers: a beam of the rotor's mass and length stands for the rotor",
        "its bending frequencies are 0.4 to 1.0 of a steel cylinder's, its transverse inertia 0.8 to 1.5; an "
        "estimate finds them, and where along it mass and stiffness lie, from the record",
        "the planes of the magnets are taken to be those of the sensors; an estimate leaves their remanent "
        "forces and moments free",
    )
    return drafted_machine(
        rotor=Rotor.model_validate(_beam(known, positions)),
        bearings=[("NDE", node[planes[0]]), ("DE", node[planes[1]])],
        sensors=[("NDE", node[sensed[0]]), ("DE", node[sensed[1]])],
        known=known,
        notes=notes,
    )


def simple_text(given: Mapping[str, str]) -> str:
    """The machine file of twelve numbers, each a text with a unit; two planes have a comma between them.

    Raises
    ------
    UsageError
        If one is missing, is none of them, or they make no machine.
    """
    known = [name for name in EXAMPLES if name != "preload"]
    said: dict[str, Any] = {name: " ".join(value.split()) for name, value in given.items() if value.strip()}
    if missing := [name for name in known if name not in said]:
        raise UsageError(f"of the twelve numbers {', '.join(missing)} are missing")
    said |= {name: read_number(name, said) for name in said}
    try:
        made = simple_machine(SimpleMachine(**said))
    except ValidationError as error:
        raise UsageError(f"these numbers make no machine: {reasons(error)}") from None
    weight = f"both halves together: {said['mass']}, centre at {said['centre']}"
    remarks = {
        "speed.nominal": said["speed"],
        "balance_grade.at_speed": said["speed"],
        "rotor.sections.outer_diameter": f"a steel cylinder of {said['mass']} and {said['length']}",
        "rotor.materials.NDE_half.density": weight,
        "rotor.materials.DE_half.density": weight,
        "touchdown_bearings.node": f"the planes at {', '.join(said['bearings'])}",
        "sensors.node": f"the planes at {', '.join(said['sensors'])}",
        "ambs.node": "taken to be the planes of the sensors",
        "touchdown_bearings.support.stiffness": said["support"],
        "touchdown_bearings.support.mass": "not given: a share of the rotor's mass",
    }
    return machine_text(made, remarks)


def read_number(name: str, said: Mapping[str, str]) -> str | tuple[str, str]:
    """One of the numbers said as `SimpleMachine` takes it; a place has to lie on the rotor.

    Raises
    ------
    UsageError
        If it cannot be read.
    """
    if name not in EXAMPLES:
        raise UsageError(f"there is no number {name!r}; there are {', '.join(EXAMPLES)}")
    length = math.inf
    if name in ("centre", "bearings", "sensors") and "length" in said:
        length = in_si(read_number("length", said), "length", "length")
    try:
        return _read(name, said[name], length)
    except (UsageError, LookupError, ValidationError) as error:
        reason = reasons(error).removeprefix(f"{name}: ")
        raise UsageError(f"{name}, such as {EXAMPLES[name]!r}: {reason}") from None


def _read(name: str, text: str, length: float) -> str | tuple[str, str]:
    kind = getattr(vars(SimpleMachine).get(name), "kind", None)
    if name in ("bearings", "sensors"):
        first, *others = (place.strip() for place in text.replace(";", ",").split(","))
        if len(others) != 1:
            raise UsageError(f"{text!r} are not two planes")
        _planes((first, others[0]), length, name)
        return first, others[0]
    if name == "designation":
        find_bearing(text)
    elif name == "grade":
        BalanceGrade.model_validate({"grade": text, "at_speed": "1 Hz"})
    elif name == "support":
        _supports(text, REFERENCE_MASS, 2)
    elif kind:
        if re.search(r"[,;]\s", text):
            raise UsageError(f"{text!r} are several values; give one")
        value = in_si(text, kind, name)
        if value <= 0.0 and kind != "angle":
            raise UsageError(f"{text!r} is not allowed here; it must be positive")
        if name == "centre" and math.isfinite(length):
            _share_at_de(value, length)
    return text


def drafted_machine(
    *,
    rotor: Rotor,
    bearings: Sequence[tuple[str, int]],
    sensors: Sequence[tuple[str, int]],
    known: SimpleMachine,
    notes: Sequence[str],
    supports: Mapping[int, Mapping[str, Any]] | None = None,
) -> Machine:
    """A machine of a rotor with bearings, sensors, known supports at nodes, else as ``known`` and guesses."""
    try:
        entry = find_bearing(known.designation)
    except LookupError as error:
        raise UsageError(str(error)) from None
    bearing: dict[str, Any] = {"designation": known.designation}
    if known.preload is not None:
        bearing["preload"] = known.preload
    described = {
        "air_gap": _guess(known.gap, known.gap / _GAP_RANGE, known.gap * _GAP_RANGE, "m"),
        "bore_radius": f"{0.5 * entry.bore!r} m",
        "bearing": bearing,
    }
    guesses = _supports(known.support, rotor.mass, len(bearings))
    degrees = math.degrees(known.sensor_angle)
    return Machine.model_validate(
        {
            "name": known.name,
            "notes": list(notes),
            "speed": {"nominal": f"{known.speed / (2.0 * math.pi):.12g} Hz"},
            "rotor": rotor,
            "balance_grade": {
                "grade": known.grade,
                "at_speed": f"{known.speed / (2.0 * math.pi):.12g} Hz",
            },
            "touchdown_bearings": [
                described | {"name": name, "node": node, "support": (supports or {}).get(node, guess)}
                for (name, node), guess in zip(bearings, guesses, strict=True)
            ],
            "ambs": [{"name": name, "node": node} for name, node in sensors],
            "sensors": [
                {"name": f"{name}_{letter}", "node": node, "angle": f"{degrees - turn:.12g} deg"}
                for name, node in sensors
                for letter, turn in (("A", 0.0), ("B", 90.0))
            ],
        }
    )


_MADE_UP = {
    "": {
        "balance_grade.grade": "balance grade",
        "rotor.modal_damping": "modal damping",
        "sensors.node": "planes of the sensors",
        "sensors.angle": "angles of the sensors",
    },
    "designation": {
        "touchdown_bearings.bearing.designation": "touchdown bearings",
        "touchdown_bearings.bore_radius": "their bores",
    },
    "gap": {"touchdown_bearings.air_gap": "air gap"},
    "speed": {
        "speed.nominal": "nominal speed",
        "balance_grade.at_speed": "speed of the balance grade",
    },
}
"""What a rotor of another program does not tell, by the number that gives it; the first never."""


def imported_text(
    imported: ImportedRotor, source: Path, given: Mapping[str, Any]
) -> tuple[str, tuple[str, ...]]:
    """The machine file of a rotor from a file of another program, and what in it is made up and marked so.

    ``given`` are designation, gap [m] and nominal speed [rad/s] as far as they are known.
    """
    made_up = {p: what for name, of in _MADE_UP.items() if name not in given for p, what in of.items()}
    magnets, ends = (
        sorted({spring.node for spring in imported.springs if spring.kind == kind})
        for kind in (MAGNETIC, "BearingElement")
    )
    last = len(imported.rotor.node_positions)
    if len(ends) < 2:
        ends = magnets if len(magnets) > 1 else [max(1, round(0.1 * last)), min(last, round(0.9 * last))]
        made_up["touchdown_bearings.node"] = "planes of the touchdown bearings"
    if len(magnets) < 2:
        magnets = ends
        made_up["ambs.node"] = "planes of the magnets"
    if ends[0] == ends[-1]:
        raise UsageError("the rotor has too few nodes for two bearings; cut it into more elements")
    supports = {s.node: _support(s, source.name) for s in imported.springs if s.support is not None}
    if not {ends[0], ends[-1]} <= set(supports):
        made_up["touchdown_bearings.support"] = "supports"
    known: dict[str, Any] = {"designation": "XCB7013C", "gap": 250e-6, "speed": 600.0 * math.pi, **given}
    rotor, length = imported.rotor, imported.rotor.node_positions[-1]
    machine = drafted_machine(
        rotor=rotor.changed(modal_damping=float(rotor.modal_damping)),
        bearings=[("NDE", ends[0]), ("DE", ends[-1])],
        sensors=[("NDE", magnets[0]), ("DE", magnets[-1])],
        known=SimpleMachine(
            mass=rotor.mass,
            centre=rotor.centre_of_gravity,
            length=length,
            bearings=(0.0, length),
            sensors=(0.0, length),
            sensor_angle="135 deg",
            grade="G 2.5",
            support="1e8 N/m",
            name=source.stem,
            **known,
        ),
        notes=[f"rotor from {source.name} ({imported.source})", *imported.notes],
        supports=supports,
    )
    marked = [*made_up, "touchdown_bearings.support.stiffness", "touchdown_bearings.support.mass"]
    return machine_text(machine, dict.fromkeys(marked, "made up: put yours here")), tuple(made_up.values())


def _support(spring: Spring, source: str) -> dict[str, Any]:
    """The support of a bearing of another program, as a machine file describes it."""
    below = spring.support or spring
    pairs = {"mass": spring.support_mass, "stiffness": below.stiffness, "damping": below.damping}
    return {
        f"{name}{end}": {"value": f"{value!r} {si_unit(name)}", "source": source}
        for name, pair in pairs.items()
        for end, value in zip(("_horizontal", ""), pair, strict=True)
    }


def beam_nodes(length: float, planes: Sequence[float]) -> list[float]:
    """Nodes of a beam [m]: ends, middle, every plane, and even ones that are not too close to these."""
    fixed = sorted({0.0, 0.5 * length, length, *planes})
    even = [round(length * k / _ELEMENTS, 6) for k in range(1, _ELEMENTS)]
    free = [place for place in even if min(abs(place - one) for one in fixed) > _CLOSEST * length]
    return sorted({*fixed, *free})


def _planes(given: tuple[float | str, float | str], length: float, name: str) -> tuple[float, float]:
    first, second = (in_si(place, "length", name) for place in given)
    if not 0.0 <= first < second <= length:
        raise UsageError(
            f"{name}: {_mm(first)} and {_mm(second)} are no two planes of a rotor of {_mm(length)}; "
            "give both from its NDE end, the NDE one first"
        )
    return first, second


def _share_at_de(centre: float, length: float) -> float:
    """Share of the mass in the half at the DE [1]."""
    share = 2.0 * centre / length - 0.5
    if not 0.02 < share < 0.98:
        raise UsageError(
            f"the centre of mass at {_mm(centre)} is too far from the middle of a rotor of {_mm(length)} for "
            f"a beam; expected {_mm(0.26 * length)} to {_mm(0.74 * length)}: describe the rotor by sections"
        )
    return share


def _beam(known: SimpleMachine, positions: list[float]) -> dict[str, Any]:
    """Two halves of one diameter; their densities carry mass and centre of mass."""
    share = _share_at_de(known.centre, known.length)
    area = known.mass / (STEEL_DENSITY * known.length)
    diameter = f"{1e3 * math.sqrt(4.0 * area / math.pi):.6g} mm"
    middle = positions.index(0.5 * known.length) + 1
    halves = (("NDE_half", 1.0 - share, 1, middle), ("DE_half", share, middle, len(positions)))
    return {
        "material": "NDE_half",
        "materials": {
            name: {
                "youngs_modulus": f"{STEEL_MODULUS!r} Pa",
                "poisson_ratio": 0.3,
                "density": f"{part * known.mass / (0.5 * known.length * area):.6g} kg/m^3",
            }
            for name, part, _, _ in halves
        },
        "stiffness_factor": _ranged(*_STIFFNESS),
        **{name: _ranged(*numbers) for name, numbers in _FORM.items()},
        "node_positions": tuple(positions),
        "sections": [
            {"part": name, "nodes": [first, last], "outer_diameter": diameter, "material": name}
            for name, _, first, last in halves
        ],
    }


def _supports(said: str, mass: float, ends: int) -> list[dict[str, Any]]:
    """The support of each bearing; one stiffness for all is known less well than one for each."""
    texts = [text.strip() for text in said.split(",")]
    if len(texts) not in (1, ends):
        raise UsageError(
            f"support = {said!r} has {len(texts)} values; give one, or one for each of {ends} ends"
        )
    share, lowest, highest = _SUPPORT_MASS
    supports = []
    for text in texts * (ends // len(texts)):
        if text in _SUPPORTS:
            guess, factor = _SUPPORTS[text] * (mass / REFERENCE_MASS) ** (1.0 / 3.0), _SUPPORT_REACH
        else:
            guess = in_si(text, "stiffness", "support")
            factor = _ONE_FOR_BOTH if len(texts) < ends else _SUPPORT_RANGE
        supports.append(
            {
                "stiffness": _guess(guess, guess / factor, guess * factor, "N/m"),
                "mass": _guess(share * mass, lowest * mass, highest * mass, "kg"),
            }
        )
    return supports


def _guess(value: float, low: float, high: float, unit: str) -> dict[str, Any]:
    return {"guess": f"{value:.6g} {unit}", "range": [f"{low:.6g} {unit}", f"{high:.6g} {unit}"]}


def _ranged(value: float, low: float, high: float) -> dict[str, Any]:
    return {"guess": value, "range": [low, high]}


def _mm(value: float) -> str:
    return format_quantity(value, "length")
