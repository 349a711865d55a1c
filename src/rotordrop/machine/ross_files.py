"""Rotors from and to the files of ROSS, without ROSS: shaft, discs, point masses, bearings at their nodes.

A file of ROSS (TOML or JSON) is a list of elements, ``ShaftElement_…``, ``DiskElement_…``, with the arguments
they are made of. Elements that share nodes lie around each other.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from rotordrop.elements.rotor import Rotor
from rotordrop.errors import MachineFileError, UsageError
from rotordrop.files import write_text
from rotordrop.machine.shaft_table import SECTION_LINE, read_shaft_table

_FORMAT_VERSION = "2.3.0"
_CONE_CUTS = 8
"""Cylinders that stand for one conical element."""
_SOFT = 1e-3
"""A layer with less than this share of the shaft's elastic modulus carries no load."""
_LAYER_MODULUS = 1.0
_COEFFICIENT = re.compile(r"[kcm](xx|xy|yx|yy|zz)|frequency")
_PASSED_OVER = ("parameters", "ross_version")
_BUILT_IN = {
    "steel": (7810.0, 211e9, 81.2e9),
    "aisi4140": (7850.0, 203.2e9, 80e9),
    "a216wcb": (7820.0, 210e9, 210e9 / 2.58),
    "brass": (8600.0, 105e9, 39.3e9),
}
"""Density [kg/m³], elastic and shear modulus [Pa] of materials that old files only name."""


@dataclass(frozen=True, kw_only=True)
class ImportedRotor:
    """A rotor from another program."""

    rotor: Rotor
    """Shaft, discs, materials."""
    springs: tuple[Spring, ...]
    """Bearings of the source."""
    source: str
    """Program and version that wrote it."""
    notes: tuple[str, ...]
    """What was changed or left out."""
    nodes: tuple[int, ...] = ()
    """The node here of every node of the source."""


def read_ross(path: str | Path) -> ImportedRotor:
    """Read a rotor from a file of ROSS; refuses a shaft that has no counterpart here."""
    path = Path(path)
    elements, version, damped = _elements(path)
    shaft = [item for kind, item in elements if kind.startswith("ShaftElement")]
    if not shaft:
        raise MachineFileError("there is no ShaftElement in it; is it a rotor saved by ROSS?", file=path)
    try:
        return _imported(elements, shaft, version, damped)
    except (KeyError, TypeError, ValueError, UsageError) as error:
        said = f"no {error} in an element" if isinstance(error, KeyError) else str(error)
        raise MachineFileError(f"cannot take the rotor over: {said}", file=path) from error


def _elements(path: Path) -> tuple[list[tuple[str, dict[str, Any]]], str, bool]:
    """Elements by kind, the version, and whether the rotor as a whole has proportional damping."""
    try:
        text = path.read_text(encoding="utf-8-sig")
        content = json.loads(text) if path.suffix.lower() == ".json" else tomllib.loads(text)
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise MachineFileError(f"cannot read it as a file of ROSS: {error}", file=path) from error
    if not isinstance(content, dict):
        raise MachineFileError("it is no file of ROSS: a table of elements is expected", file=path)
    found = [
        (name.split("_")[0], item)
        for name, item in content.items()
        if isinstance(item, dict) and name not in _PASSED_OVER
    ]
    whole = content.get("parameters")
    damped = isinstance(whole, dict) and any(whole.get(name) for name in ("alpha", "beta"))
    return found, str(content.get("ross_version", "before 2.0")), damped


def _imported(
    elements: list[tuple[str, dict[str, Any]]], shaft: list[dict[str, Any]], version: str, damped: bool
) -> ImportedRotor:
    notes = ["proportional damping of the rotor is left out"] if damped else []
    spans: dict[int, list[dict[str, Any]]] = {}
    for item in _numbered(shaft):
        spans.setdefault(item["n"], []).append(item)
    if sorted(spans) != list(range(len(spans))):
        raise ValueError("the shaft elements do not follow each other from node 0 on")
    positions, nodes = [0.0], [1]
    sections: list[dict[str, Any]] = []
    materials: dict[str, tuple[float, float, float]] = {}
    for n in range(len(spans)):
        pieces = _span(spans[n], materials, notes)
        for piece in pieces:
            positions.append(positions[-1] + piece.pop("length"))
            sections.append(piece | {"nodes": [len(positions) - 1, len(positions)]})
        nodes.append(len(positions))
    rotor = Rotor.model_validate(
        {
            "material": next(iter(materials)),
            "materials": {
                name: {
                    "youngs_modulus": f"{E!r} Pa",
                    "poisson_ratio": E / (2.0 * G) - 1.0,
                    "density": _density(rho),
                }
                for name, (rho, E, G) in materials.items()
            },
            "node_positions": tuple(positions),
            "sections": _joined(sections),
            "discs": [
                _disc(kind, item, nodes) for kind, item in elements if kind in ("DiskElement", "PointMass")
            ],
        }
    )
    springs = tuple(
        _spring(k, kind, item, nodes) for k, (kind, item) in enumerate(elements) if _is_spring(kind)
    )
    notes += _left_out(elements)
    return ImportedRotor(
        rotor=rotor,
        springs=springs,
        source=f"ROSS {version}",
        notes=tuple(dict.fromkeys(notes)),
        nodes=tuple(nodes),
    )


def _numbered(shaft: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Give every shaft element its node; those without one follow the one before."""
    numbered, following = [], 0
    for item in shaft:
        n = following if item.get("n") is None else int(item["n"])
        following = n + 1
        numbered.append(item | {"n": n})
    return numbered


def _span(
    around: list[dict[str, Any]], materials: dict[str, tuple[float, float, float]], notes: list[str]
) -> list[dict[str, Any]]:
    """Pieces of the shaft between two nodes of the source, from the elements that lie around each other."""
    ordered = sorted(around, key=lambda item: float(item["odl"]))
    stiff = [
        item for item in ordered if _material(item)[1][1] > _SOFT * max(_material(i)[1][1] for i in ordered)
    ]
    core, layers = stiff[0], [item for item in ordered if item not in stiff]
    cone = any(_diameters(item)[0] != _diameters(item)[1] for item in ordered)
    for outer in stiff[1:]:
        if _material(outer)[1] != _material(core)[1] or _gap(core, outer) > 1e-9:
            raise ValueError(
                f"elements of different materials lie around each other at node {core['n']}; only layers "
                f"without stiffness can (elastic modulus below {_SOFT:g} of the shaft's)"
            )
        core = core | {"odl": outer["odl"], "odr": outer["odr"]}
    name, constants = _material(core)
    if materials.setdefault(name, constants) != constants:
        name = f"{name}_{len(materials)}"
        materials[name] = constants
    _check_switches(core, notes)
    cuts = _CONE_CUTS if cone else 1
    if cone:
        notes.append(f"conical elements stand as {_CONE_CUTS} cylinders each")
    return [_piece(core, layers, (k + 0.5) / cuts, float(core["L"]) / cuts, name) for k in range(cuts)]


def _piece(
    core: dict[str, Any], layers: list[dict[str, Any]], at: float, length: float, material: str
) -> dict[str, Any]:
    inner, outer = _at(core, "id", at), _at(core, "od", at)
    piece: dict[str, Any] = {
        "length": length,
        "outer_diameter": _metres(outer),
        "inner_diameter": _metres(inner),
        "material": material,
    }
    if layers:
        top = max(_at(layer, "od", at) for layer in layers)
        mass = sum(
            _material(layer)[1][0] * (_at(layer, "od", at) ** 2 - _at(layer, "id", at) ** 2)
            for layer in layers
        )
        if any(_at(layer, "id", at) < outer - 1e-9 for layer in layers):
            raise ValueError(f"a layer without stiffness lies inside the shaft at node {core['n']}")
        piece |= {"layer_diameter": _metres(top), "layer_density": _density(mass / (top**2 - outer**2))}
    return piece


def _at(item: Mapping[str, Any], end: str, share: float) -> float:
    left, right = float(item[f"{end}l"]), float(item[f"{end}r"])
    return left + share * (right - left)


def _diameters(item: Mapping[str, Any]) -> tuple[tuple[float, float], tuple[float, float]]:
    return (float(item["idl"]), float(item["odl"])), (float(item["idr"]), float(item["odr"]))


def _gap(core: Mapping[str, Any], outer: Mapping[str, Any]) -> float:
    return abs(float(outer["idl"]) - float(core["odl"]))


def _material(item: Mapping[str, Any]) -> tuple[str, tuple[float, float, float]]:
    """Name, and density [kg/m³], elastic and shear modulus [Pa]."""
    told = item["material"]
    if isinstance(told, str):
        if told.lower() not in _BUILT_IN:
            raise ValueError(f"the material {told!r} is only named and not known here")
        return told, _BUILT_IN[told.lower()]
    rho, E = float(told["rho"]), float(told["E"])
    if told.get("G_s") is not None:
        return _name(told), (rho, E, float(told["G_s"]))
    return _name(told), (rho, E, E / (2.0 * (1.0 + float(told["Poisson"]))))


def _name(material: Mapping[str, Any]) -> str:
    """Name of a material as one word."""
    return re.sub(r"\W+", "_", str(material["name"])).strip("_") or "material"


def _check_switches(item: Mapping[str, Any], notes: list[str]) -> None:
    for name in ("shear_effects", "rotary_inertia", "gyroscopic"):
        if item.get(name) is False:
            notes.append(f"the source switched {name.replace('_', ' ')} off; it acts here")
    for name in ("axial_force", "torque", "alpha", "beta"):
        if item.get(name):
            notes.append(f"{name.replace('_', ' ')} of shaft elements is left out")
    if item.get("shear_method_calc", "cowper") != "cowper":
        notes.append(f"the source has shear by {item['shear_method_calc']}; here it is Cowper's")


def _joined(sections: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Join neighbouring sections of the same shaft."""
    joined: list[dict[str, Any]] = []
    for section in sections:
        rest = {key: value for key, value in section.items() if key != "nodes"}
        if joined and {key: value for key, value in joined[-1].items() if key != "nodes"} == rest:
            joined[-1]["nodes"][1] = section["nodes"][1]
        else:
            joined.append(section | {"nodes": list(section["nodes"])})
    return joined


def _disc(kind: str, item: Mapping[str, Any], nodes: list[int]) -> dict[str, Any]:
    disc: dict[str, Any] = {"name": str(item.get("tag") or kind), "node": nodes[int(item["n"])]}
    if kind == "PointMass":
        masses = {float(item[key]) for key in ("m", "mx", "my") if item.get(key)}
        if len(masses) != 1:
            raise ValueError(f"the point mass at node {item['n']} differs between the directions")
        return disc | {"mass": f"{masses.pop()!r} kg"}
    disc["mass"] = f"{float(item['m'])!r} kg"
    if float(item["Id"]) or float(item["Ip"]):
        disc["polar_inertia"] = f"{float(item['Ip'])!r} kg m^2"
        disc["diametral_inertia"] = f"{float(item['Id'])!r} kg m^2"
    return disc


def _is_spring(kind: str) -> bool:
    return "Bearing" in kind or kind == "SealElement"


def _spring(k: int, kind: str, item: Mapping[str, Any], nodes: list[int]) -> Spring:
    # Version 3 calls the speeds of a table what they are.
    item = {("frequency" if key == "speed" else key): value for key, value in item.items()}
    told = {key: _numbers(item[key]) for key in item if _COEFFICIENT.fullmatch(key) and item[key] is not None}
    told = {key: values for key, values in told.items() if values}
    for letter in ("k", "c"):  # what is not given in y is as in x, at every speed
        if f"{letter}xx" in told:
            told.setdefault(f"{letter}yy", told[f"{letter}xx"])

    def both(kind: str, first: str, second: str, otherwise: str) -> tuple[float, float]:
        one = told.get(f"{kind}{first}", (0.0,))[0]
        return one, told.get(f"{kind}{second}", (one if otherwise == "same" else 0.0,))[0]

    return Spring(
        node=nodes[int(item["n"])],
        name=str(item.get("tag") or f"bearing {k + 1}"),
        stiffness=both("k", "xx", "yy", "same"),
        damping=both("c", "xx", "yy", "same"),
        cross_stiffness=both("k", "xy", "yx", "zero"),
        cross_damping=both("c", "xy", "yx", "zero"),
        kind="SealElement" if kind == "SealElement" else "BearingElement",
        told=told if _says_more(told) else {},
    )


def _says_more(told: Mapping[str, tuple[float, ...]]) -> bool:
    """Whether coefficients change with speed, or act along the axis or as a mass."""
    return any(
        len(values) > 1 or ((key[0] == "m" or key[1:] == "zz") and any(values))
        for key, values in told.items()
    )


def _numbers(value: Any) -> tuple[float, ...]:
    return tuple(float(one) for one in value) if isinstance(value, list) else (float(value),)


def _left_out(elements: Iterable[tuple[str, dict[str, Any]]]) -> list[str]:
    kinds = [kind for kind, _ in elements]
    known = ("DiskElement", "PointMass")
    others = [k for k in kinds if not k.startswith("ShaftElement") and k not in known and not _is_spring(k)]
    return [f"{others.count(kind)} {kind} left out" for kind in dict.fromkeys(others)]


def _metres(value: float) -> str:
    return f"{value!r} m"


def _density(value: float) -> str:
    return f"{value!r} kg/m^3"


def write_ross(rotor: Rotor, path: str | Path, springs: Iterable[Spring] = ()) -> None:
    """Write a rotor as a file that ROSS loads, TOML or JSON by its suffix; `read_ross` gives it back.

    A layer becomes an element around the shaft that carries no load. ROSS wants materials without blanks.
    """
    path = Path(path)
    content: dict[str, Any] = {"ross_version": _FORMAT_VERSION, "parameters": {}}
    for n, element in enumerate(rotor.elements):
        shear = element.youngs_modulus / (2.0 * (1.0 + element.poisson_ratio))
        core = (element.material, element.density, element.youngs_modulus, shear)
        content |= _shaft_entry(n, element.length, element.inner_diameter, element.outer_diameter, core)
        if element.layer_diameter is not None:
            soft = (
                f"layer_{element.layer_density:g}",
                element.layer_density,
                _LAYER_MODULUS,
                _LAYER_MODULUS / 2.6,
            )
            sizes = (element.outer_diameter, element.layer_diameter)
            content |= _shaft_entry(n, element.length, *sizes, soft, " layer")
    for k, disc in enumerate(rotor.discs):
        tag = disc.name or f"Disk {k}"
        content[_free(f"DiskElement_{tag}", content)] = {
            "n": disc.node - 1,
            "m": disc.mass.value,
            "Id": disc.diametral_inertia.value,
            "Ip": disc.polar_inertia.value,
            "tag": tag,
            "scale_factor": 1.0,
            "color": "Firebrick",
        }
    for spring in springs:
        content[_free(f"{spring.kind}_{spring.name}", content)] = {
            "n": spring.node - 1,
            "tag": spring.name,
            **(
                {key: list(values) for key, values in spring.told.items()}
                or {
                    "kxx": [spring.stiffness[0]],
                    "kxy": [spring.cross_stiffness[0]],
                    "kyx": [spring.cross_stiffness[1]],
                    "kyy": [spring.stiffness[1]],
                    "cxx": [spring.damping[0]],
                    "cxy": [spring.cross_damping[0]],
                    "cyx": [spring.cross_damping[1]],
                    "cyy": [spring.damping[1]],
                }
            ),
        }
    write_text(path, json.dumps(content, indent=2) if path.suffix.lower() == ".json" else _toml(content))


def _free(key: str, content: Mapping[str, Any]) -> str:
    """The key, or one that is not taken: discs and bearings of one name are still several."""
    return key if key not in content else f"{key}_{len(content)}"


def _shaft_entry(
    n: int,
    length: float,
    inner: float,
    outer: float,
    material: tuple[str, float, float, float],
    suffix: str = "",
) -> dict[str, Any]:
    tag = f"Shaft Element {n}{suffix}"
    name, rho, E, G = material
    return {
        f"ShaftElement_{tag}": {
            "L": length,
            "idl": inner,
            "odl": outer,
            "idr": inner,
            "odr": outer,
            "n": n,
            "axial_force": 0,
            "torque": 0,
            "shear_effects": True,
            "rotary_inertia": True,
            "gyroscopic": True,
            "shear_method_calc": "cowper",
            "tag": tag,
            "alpha": 0.0,
            "beta": 0.0,
            "material": {"name": "_".join(name.split()), "rho": rho, "E": E, "G_s": G, "color": "#525252"},
        }
    }


def _toml(content: Mapping[str, Any]) -> str:
    import tomlkit

    return tomlkit.dumps(content)


@dataclass(frozen=True, kw_only=True)
class Spring:
    """A bearing of the source."""

    node: int
    """Node here."""
    name: str
    """Its name."""
    stiffness: tuple[float, float]
    damping: tuple[float, float]
    """In x and y [N/m], [N s/m]; where the source has them by speed, the first of its table."""
    cross_stiffness: tuple[float, float] = (0.0, 0.0)
    cross_damping: tuple[float, float] = (0.0, 0.0)
    """Force in x against motion in y, and in y against motion in x."""
    kind: str = "BearingElement"
    """What it is in the source; seals are held in the same way."""
    told: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """All coefficients of the source by its own names, over ``frequency`` [rad/s]; written back as they are.
    """

    @property
    def stiffness_matrix(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Force in (x, y) against displacement in (x, y) [N/m]."""
        return _matrix(self.stiffness, self.cross_stiffness)

    @property
    def damping_matrix(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Force in (x, y) against velocity in (x, y) [N s/m]."""
        return _matrix(self.damping, self.cross_damping)

    def at_speed(self, speed: float) -> Spring:
        """The bearing with its coefficients at a speed [rad/s], straight between those of its table."""
        speeds = self.told.get("frequency", ())
        if len(speeds) < 2:
            return self

        def between(key: str, otherwise: float) -> float:
            values = self.told.get(key)
            return otherwise if values is None or len(values) < 2 else _between(speed, speeds, values)

        def pair(kind: str, keys: tuple[str, str], now: tuple[float, float]) -> tuple[float, float]:
            first, second = (between(f"{kind}{key}", value) for key, value in zip(keys, now, strict=True))
            return first, second

        own, cross = ("xx", "yy"), ("xy", "yx")
        return replace(
            self,
            stiffness=pair("k", own, self.stiffness),
            damping=pair("c", own, self.damping),
            cross_stiffness=pair("k", cross, self.cross_stiffness),
            cross_damping=pair("c", cross, self.cross_damping),
        )


def _between(at: float, places: tuple[float, ...], values: tuple[float, ...]) -> float:
    """Value on the straight line between two of a table; the end one beyond it."""
    for (a, u), (b, v) in pairwise(zip(places, values, strict=True)):
        if at <= b:
            return u if at <= a else u + (v - u) * (at - a) / (b - a)
    return values[-1]


def _matrix(
    own: tuple[float, float], cross: tuple[float, float]
) -> tuple[tuple[float, float], tuple[float, float]]:
    return (own[0], cross[0]), (cross[1], own[1])


TABLES = (".csv", ".txt", ".tsv", ".xlsx", ".xlsm")


def read_rotor(path: str | Path) -> ImportedRotor:
    """Read a rotor from a file of ROSS (.toml, .json) or a shaft table (.csv, .txt, .xlsx)."""
    path = Path(path)
    if not path.is_file():
        raise MachineFileError("there is no such file", file=path)
    if path.suffix.lower() in (".toml", ".json"):
        return read_ross(path)
    if path.suffix.lower() not in TABLES:
        raise MachineFileError(
            f"{path.suffix or 'no suffix'!r} is no format of a rotor; give a file of ROSS (.toml, .json) or "
            f"a shaft table ({', '.join(TABLES)})",
            file=path,
        )
    table = read_shaft_table(path)
    for section in table["sections"]:
        section.pop(SECTION_LINE, None)
    notes = tuple(table.pop("notes", ()))
    try:
        rotor = Rotor.model_validate(table)
    except ValueError as error:
        raise MachineFileError(f"the table describes no rotor: {error}", file=path) from error
    return ImportedRotor(rotor=rotor, springs=(), source=f"shaft table {path.name}", notes=notes)
