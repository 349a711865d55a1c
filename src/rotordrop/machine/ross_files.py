"""Rotors from and to the files of ROSS, without ROSS: shaft, discs, point masses, bearings at their nodes.

A file of ROSS (TOML or JSON) is a list of elements, ``ShaftElement_…``, ``DiskElement_…``, with the arguments
they are made of. Elements that share nodes lie around each other.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any

from rotordrop.document import parse_toml
from rotordrop.elements.magnet import ActiveMagneticBearing
from rotordrop.elements.rotor import Rotor
from rotordrop.errors import MachineFileError, UsageError
from rotordrop.files import write_text
from rotordrop.machine.shaft_table import SECTION_LINE, read_shaft_table

_FORMAT_VERSION = "2.3.0"
_CONE_CUTS = 8
"""Cylinders that stand for one conical element (chosen)."""
_SOFT = 1e-3
"""A layer with less than this share of the shaft's elastic modulus carries no load (chosen)."""
_LAYER_MODULUS = 1.0
_COEFFICIENT = re.compile(r"[kcm](xx|xy|yx|yy|zz)|frequency")
_DISCS = ("DiskElement", "PointMass")
_AXES = ("xx", "xy", "yx", "yy")
MAGNETIC = "MagneticBearingElement"
_PASSED_OVER = ("parameters", "ross_version")
_BUILT_IN = {
    "steel": (7810.0, 211e9, 81.2e9),
    "aisi4140": (7850.0, 203.2e9, 80e9),
    "a216wcb": (7820.0, 210e9, 210e9 / 2.58),
    "brass": (8600.0, 105e9, 39.3e9),
}
"""Density [kg/m³], elastic and shear modulus [Pa] of materials that old files only name."""


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
    """What it is in the source; seals and magnetic bearings are held in the same way."""
    support: Spring | None = None
    """What carries it from the ground; none where it ends at the ground itself."""
    support_mass: tuple[float, float] = (0.0, 0.0)
    """Mass of that support in x and y [kg]."""
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


def _matrix(
    own: tuple[float, float], cross: tuple[float, float]
) -> tuple[tuple[float, float], tuple[float, float]]:
    return (own[0], cross[0]), (cross[1], own[1])


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
    try:
        text = path.read_text(encoding="utf-8-sig")
        content = json.loads(text) if path.suffix.lower() == ".json" else parse_toml(text)
    except (OSError, ValueError, RecursionError) as error:
        raise MachineFileError(f"cannot read it as a file of ROSS: {error}", file=path) from error
    if not isinstance(content, dict):
        raise MachineFileError("it is no file of ROSS: a table of elements is expected", file=path)
    elements = [
        (name.split("_")[0], item)
        for name, item in content.items()
        if isinstance(item, dict) and name not in _PASSED_OVER
    ]
    if not any(kind.startswith("ShaftElement") for kind, _ in elements):
        raise MachineFileError("there is no ShaftElement in it; is it a rotor saved by ROSS?", file=path)
    whole = content.get("parameters")
    damped = isinstance(whole, dict) and any(whole.get(name) for name in ("alpha", "beta"))
    notes = ["proportional damping of the rotor is left out"] if damped else []
    try:
        return _imported(elements, str(content.get("ross_version", "before 2.0")), notes)
    except (KeyError, TypeError, ValueError, UsageError) as error:
        said = f"no {error} in an element" if isinstance(error, KeyError) else str(error)
        raise MachineFileError(f"cannot take the rotor over: {said}", file=path) from error


def _imported(elements: list[tuple[str, dict[str, Any]]], version: str, notes: list[str]) -> ImportedRotor:
    spans: dict[int, list[dict[str, Any]]] = {}
    following = 0
    for kind, item in elements:
        if kind.startswith("ShaftElement"):  # one without a node follows the one before
            n = following if item.get("n") is None else int(item["n"])
            following = n + 1
            spans.setdefault(n, []).append(item | {"n": n})
    if sorted(spans) != list(range(len(spans))):
        joined = [int(item["n"]) for kind, item in elements if kind == "CouplingElement"]
        if joined:
            raise ValueError(
                f"a CouplingElement joins two shafts between nodes {joined[0]} and {joined[0] + 1}; save the "
                "shaft that drops as a rotor of its own, its half of the coupling as a disc"
            )
        raise ValueError("the shaft elements do not follow each other from node 0 on")
    positions, nodes = [0.0], [1]
    sections: list[dict[str, Any]] = []
    materials: dict[str, tuple[float, float, float]] = {}
    for n in range(len(spans)):
        for piece in _span(spans[n], materials, notes):
            positions.append(positions[-1] + piece.pop("length"))
            if sections and sections[-1] == piece | {"nodes": sections[-1]["nodes"]}:
                sections[-1]["nodes"][1] = len(positions)  # the same shaft goes on
            else:
                sections.append(piece | {"nodes": [len(positions) - 1, len(positions)]})
        nodes.append(len(positions))
    beside = [(kind, item) for kind, item in elements if int(item.get("n") or 0) >= len(nodes)]
    elements = [one for one in elements if one not in beside]
    springs = tuple(
        _supported(_spring(k, kind, item, nodes[int(item["n"])]), item.get("n_link"), beside)
        for k, (kind, item) in enumerate(elements)
        if _is_spring(kind)
    )
    linked = {item.get("n_link") for kind, item in elements if _is_spring(kind)}
    for kind, item in beside:
        if int(item["n"]) not in linked:
            raise ValueError(f"{kind} at node {item['n']}: the shaft has nodes 0 to {len(nodes) - 1}")
    rotor = Rotor.model_validate(
        {
            "material": next(iter(materials)),
            "materials": {
                name: {
                    "youngs_modulus": f"{E!r} Pa",
                    "poisson_ratio": E / (2.0 * G) - 1.0,
                    "density": f"{rho!r} kg/m^3",
                }
                for name, (rho, E, G) in materials.items()
            },
            "node_positions": tuple(positions),
            "sections": sections,
            "discs": [_disc(kind, item, nodes) for kind, item in elements if kind in _DISCS],
        }
    )
    others = [k for k, _ in elements if not (k.startswith("ShaftElement") or k in _DISCS or _is_spring(k))]
    notes += [f"{others.count(kind)} {kind} left out" for kind in dict.fromkeys(others)]
    return ImportedRotor(
        rotor=rotor,
        springs=springs,
        source=f"ROSS {version}",
        notes=tuple(dict.fromkeys(notes)),
        nodes=tuple(nodes),
    )


def _span(
    around: list[dict[str, Any]], materials: dict[str, tuple[float, float, float]], notes: list[str]
) -> list[dict[str, Any]]:
    """Pieces of the shaft between two nodes of the source, from the elements that lie around each other."""
    ordered = sorted(around, key=lambda item: float(item["odl"]))
    stiffest = max(_material(item)[1][1] for item in ordered)
    stiff = [item for item in ordered if _material(item)[1][1] > _SOFT * stiffest]
    core, layers = stiff[0], [item for item in ordered if item not in stiff]
    cone = any(float(item[f"{end}l"]) != float(item[f"{end}r"]) for item in ordered for end in ("id", "od"))
    for outer in stiff[1:]:
        gap = abs(float(outer["idl"]) - float(core["odl"]))
        if _material(outer)[1] != _material(core)[1] or gap > 1e-9:
            raise ValueError(
                f"elements of different materials lie around each other at node {core['n']}; only layers "
                f"without stiffness can (elastic modulus below {_SOFT:g} of the shaft's)"
            )
        core = core | {"odl": outer["odl"], "odr": outer["odr"]}
    name, constants = _material(core)
    if materials.setdefault(name, constants) != constants:
        name = f"{name}_{len(materials)}"
        materials[name] = constants
    for switch in ("shear_effects", "rotary_inertia", "gyroscopic"):
        if core.get(switch) is False:
            notes.append(f"the source switched {switch.replace('_', ' ')} off; it acts here")
    for load in ("axial_force", "torque", "alpha", "beta"):
        if core.get(load):
            notes.append(f"{load.replace('_', ' ')} of shaft elements is left out")
    if core.get("shear_method_calc", "cowper") != "cowper":
        notes.append(f"the source has shear by {core['shear_method_calc']}; here it is Cowper's")
    cuts = _CONE_CUTS if cone else 1
    if cone:
        notes.append(f"conical elements stand as {_CONE_CUTS} cylinders each")
    return [_piece(core, layers, (k + 0.5) / cuts, float(core["L"]) / cuts, name) for k in range(cuts)]


def _piece(
    core: dict[str, Any], layers: list[dict[str, Any]], share: float, length: float, material: str
) -> dict[str, Any]:
    def at(item: Mapping[str, Any], end: str) -> float:
        left, right = float(item[f"{end}l"]), float(item[f"{end}r"])
        return left + share * (right - left)

    inner, outer = at(core, "id"), at(core, "od")
    diameters = {"outer_diameter": f"{outer!r} m", "inner_diameter": f"{inner!r} m"}
    piece: dict[str, Any] = {"length": length, **diameters, "material": material}
    if layers:
        top = max(at(layer, "od") for layer in layers)
        mass = sum(_material(layer)[1][0] * (at(layer, "od") ** 2 - at(layer, "id") ** 2) for layer in layers)
        if any(at(layer, "id") < outer - 1e-9 for layer in layers):
            raise ValueError(f"a layer without stiffness lies inside the shaft at node {core['n']}")
        density = mass / (top**2 - outer**2)
        piece |= {"layer_diameter": f"{top!r} m", "layer_density": f"{density!r} kg/m^3"}
    return piece


def _material(item: Mapping[str, Any]) -> tuple[str, tuple[float, float, float]]:
    """Name as one word, and density [kg/m³], elastic and shear modulus [Pa]."""
    told = item["material"]
    if isinstance(told, str):
        if told.lower() not in _BUILT_IN:
            raise ValueError(f"the material {told!r} is only named and not known here")
        return told, _BUILT_IN[told.lower()]
    name = re.sub(r"\W+", "_", str(told["name"])).strip("_") or "material"
    rho, E, G = float(told["rho"]), float(told["E"]), told.get("G_s")
    return name, (rho, E, E / (2.0 * (1.0 + float(told["Poisson"]))) if G is None else float(G))


def _disc(kind: str, item: Mapping[str, Any], nodes: list[int]) -> dict[str, Any]:
    disc: dict[str, Any] = {"name": str(item.get("tag") or kind), "node": nodes[int(item["n"])]}
    if kind == "PointMass":
        x, y = _point_mass(item)
        if x != y:
            raise ValueError(f"the point mass at node {item['n']} differs between the directions")
        return disc | {"mass": f"{x!r} kg"}
    disc["mass"] = f"{float(item['m'])!r} kg"
    if float(item["Id"]) or float(item["Ip"]):
        disc["polar_inertia"] = f"{float(item['Ip'])!r} kg m^2"
        disc["diametral_inertia"] = f"{float(item['Id'])!r} kg m^2"
    return disc


def _point_mass(item: Mapping[str, Any]) -> tuple[float, float]:
    """Mass in x and y [kg]; one that is not given is the general one, or that of the other direction."""
    x, y = (float(item.get(key) or item.get("m") or 0.0) for key in ("mx", "my"))
    if not x + y:
        raise ValueError(f"the point mass at node {item['n']} has no mass")
    return x or y, y or x


def _is_spring(kind: str) -> bool:
    return "Bearing" in kind or kind == "SealElement"


def _supported(spring: Spring, link: int | None, beside: list[tuple[str, dict[str, Any]]]) -> Spring:
    """A bearing with what stands between its link node and the ground: one bearing, one point mass."""
    if link is None:
        return spring
    there = [(kind, item) for kind, item in beside if int(item["n"]) == int(link)]
    grounds = [one for one in there if _is_spring(one[0]) and one[1].get("n_link") is None]
    masses = [item for kind, item in there if kind == "PointMass"]
    if len(there) != 2 or len(grounds) != 1 or len(masses) != 1:
        raise ValueError(
            f"bearing {spring.name!r} is linked to node {link}, where one point mass and one bearing to the "
            "ground are expected, beside the shaft"
        )
    below = _spring(0, *grounds[0], spring.node)
    return replace(spring, support=below, support_mass=_point_mass(masses[0]))


def _spring(k: int, kind: str, item: Mapping[str, Any], node: int) -> Spring:
    told: dict[str, tuple[float, ...]] = {}
    for key, value in item.items():
        key = "frequency" if key == "speed" else key  # version 3 calls the speeds of a table what they are
        listed = value if isinstance(value, list) else [] if value is None else [value]
        if _COEFFICIENT.fullmatch(key) and listed:
            told[key] = tuple(map(float, listed))
    for letter in ("k", "c"):  # what is not given in y is as in x, at every speed
        if f"{letter}xx" in told:
            told.setdefault(f"{letter}yy", told[f"{letter}xx"])

    def pair(first: str, second: str) -> tuple[float, float]:
        return told.get(first, (0.0,))[0], told.get(second, (0.0,))[0]

    says_more = any(  # coefficients change with speed, or act along the axis or as a mass
        len(values) > 1 or ((key[0] == "m" or key[1:] == "zz") and any(values))
        for key, values in told.items()
    )
    return Spring(
        node=node,
        name=str(item.get("tag") or f"bearing {k + 1}"),
        stiffness=pair("kxx", "kyy"),
        damping=pair("cxx", "cyy"),
        cross_stiffness=pair("kxy", "kyx"),
        cross_damping=pair("cxy", "cyx"),
        kind=kind if kind in ("SealElement", MAGNETIC) else "BearingElement",
        told=told if says_more else {},
    )


def springs_of(ambs: Iterable[ActiveMagneticBearing]) -> list[Spring]:
    """AMBs as springs and dampers, alike in x and y."""
    return [
        Spring(
            node=amb.node,
            name=f"AMB {amb.name}",
            stiffness=(amb.stiffness.value, amb.stiffness.value),
            damping=(amb.damping.value, amb.damping.value),
        )
        for amb in ambs
    ]


def write_ross(rotor: Rotor, path: str | Path, springs: Iterable[Spring] = ()) -> None:
    """Write a rotor as a file that ROSS loads, TOML or JSON by its suffix; `read_ross` gives it back.

    A layer becomes an element around the shaft that carries no load. ROSS wants materials without blanks.
    """
    path = Path(path)
    content: dict[str, Any] = {"ross_version": _FORMAT_VERSION, "parameters": {}}

    def add(key: str, entry: dict[str, Any]) -> None:
        # discs and bearings of one name are still several
        content[key if key not in content else f"{key}_{len(content)}"] = entry

    for n, element in enumerate(rotor.elements):
        shear = element.youngs_modulus / (2.0 * (1.0 + element.poisson_ratio))
        core = (element.material, element.density, element.youngs_modulus, shear)
        rings = [("", element.inner_diameter, element.outer_diameter, core)]
        if element.layer_diameter is not None:
            name, density = f"layer_{element.layer_density:g}", element.layer_density
            soft = (name, density, _LAYER_MODULUS, _LAYER_MODULUS / 2.6)
            rings.append((" layer", element.outer_diameter, element.layer_diameter, soft))
        for suffix, inner, outer, (name, rho, E, G) in rings:
            tag = f"Shaft Element {n}{suffix}"
            material = {"name": "_".join(name.split()), "rho": rho, "E": E, "G_s": G, "color": "#525252"}
            content[f"ShaftElement_{tag}"] = {
                "L": element.length,
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
                "material": material,
            }
    for k, disc in enumerate(rotor.discs):
        tag = disc.name or f"Disk {k}"
        inertia = {"Id": disc.diametral_inertia.value, "Ip": disc.polar_inertia.value}
        shown = {"tag": tag, "scale_factor": 1.0, "color": "Firebrick"}
        add(f"DiskElement_{tag}", {"n": disc.node - 1, "m": disc.mass.value, **inertia, **shown})
    further = len(rotor.node_positions)
    for spring in springs:
        kind = "SealElement" if spring.kind == "SealElement" else "BearingElement"
        entry = _written(spring, spring.node - 1)
        if spring.support is not None:
            entry["n_link"] = further
            add(f"BearingElement_{spring.support.name}", _written(spring.support, further))
            tag, (mx, my) = f"support of {spring.name}", spring.support_mass
            add(f"PointMass_{tag}", {"n": further, "mx": mx, "my": my, "tag": tag})
            further += 1
        add(f"{kind}_{spring.name}", entry)
    if path.suffix.lower() == ".json":
        write_text(path, json.dumps(content, indent=2))
        return
    import tomlkit

    write_text(path, tomlkit.dumps(content))


def _written(spring: Spring, node: int) -> dict[str, Any]:
    """Entry of a bearing at a node of ROSS."""
    told: dict[str, list[float]] = {key: list(values) for key, values in spring.told.items()}
    if not spring.told:
        for letter, matrix in (("k", spring.stiffness_matrix), ("c", spring.damping_matrix)):
            told |= {f"{letter}{axes}": [value] for axes, value in zip(_AXES, chain(*matrix), strict=True)}
    return {"n": node, "tag": spring.name, **told}


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
