"""The rotor: shaft sections, layers, discs, materials, and the elements they make."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, Discriminator, Field, Strict, Tag

from rotordrop.arrays import Array
from rotordrop.elements import values as V
from rotordrop.elements.description import (
    NODE_TOLERANCE,
    Description,
    Misfit,
    Name,
    Placed,
    Text,
    Usual,
    place_on_nodes,
)
from rotordrop.elements.parameter import Entry, Extension, Parameter, Rule, in_words, itself, of_one_unknown
from rotordrop.elements.values import default
from rotordrop.errors import UsageError, unknown_key

BEAM_FORCE_SIGMA = 0.08
"""Relative standard deviation of a force by a beam in place of the rotor, its form from the record [1]."""
BEAM_GAIN_SIGMA = 0.03
"""Relative standard deviation of what a beam in place of the rotor gets wrong between bearing and sensor [1]:
gains take it up. Such a gain went 5 % off on a rotor whose forces came out within 4 %."""

ELASTIC = Usual(least=20e9, most=700e9, look="E of steel is 210 GPa; check the unit")
DENSITY = Usual(least=800.0, most=2.3e4, look="steel has 7850 kg/m^3; check the unit")
POISSON = Usual(least=0.05, most=0.499, look="metals have 0.25 to 0.35")


class Material(Description):
    """Elastic constants and density of a material."""

    youngs_modulus: V.Pressure
    """Young's modulus [Pa]."""
    poisson_ratio: V.PoissonRatio
    """Poisson ratio [1]."""
    density: V.Density
    """Density [kg/m³]."""

    usual: ClassVar[Mapping[str, Usual]] = {
        "youngs_modulus": ELASTIC,
        "density": DENSITY,
        "poisson_ratio": POISSON,
    }


STEEL = {"youngs_modulus": "210 GPa", "poisson_ratio": 0.3, "density": "7850 kg/m^3"}
"""What a shaft is made of when the file names no material."""

THINNEST, THICKEST = 1e-4, 100.0
"""Diameters [m] beyond which a section is a mistake: stiffness goes with the fourth power, and beside a usual
shaft the numbers of a computer no longer hold both."""


@dataclass(frozen=True, kw_only=True)
class Element:
    """One beam element between two neighbouring nodes; plain numbers in SI units."""

    length: float
    """Length [m]."""
    outer_diameter: float
    inner_diameter: float
    """Diameters of what carries load [m]."""
    layer_diameter: float | None
    """Outer diameter [m] of a layer that adds mass and inertia but no stiffness."""
    layer_density: float
    """Density of the layer [kg/m³]."""
    material: str
    """Name of the material."""
    youngs_modulus: float
    poisson_ratio: float
    density: float
    """Material constants [Pa], [1], [kg/m³]."""
    part: str
    """What this piece of the shaft is."""

    @property
    def mass(self) -> float:
        """Mass with the layer [kg]."""
        area, layer = self.outer_diameter**2 - self.inner_diameter**2, 0.0
        if self.layer_diameter is not None:
            layer = self.layer_density * (self.layer_diameter**2 - self.outer_diameter**2)
        return 0.25 * math.pi * self.length * (self.density * area + layer)


class Section(Description):
    """What every shaft section has: diameters, a layer, a material."""

    part: Text = ""
    """What this piece of the shaft is."""
    outer_diameter: V.PositiveLength
    """Outer diameter [m]."""
    inner_diameter: V.NonNegativeLength = default(0.0, "a solid shaft")
    """Diameter of the bore [m]."""
    layer_diameter: V.PositiveLength | None = None
    """Outer diameter of a layer that adds mass and inertia but no stiffness."""
    layer_density: V.Density | None = None
    """Density of the layer."""
    material: Name | None = None
    """Material; that of the rotor when left out."""

    usual: ClassVar[Mapping[str, Usual]] = {
        "layer_density": DENSITY,
    }

    def check(self) -> None:
        """Refuse diameters that do not nest."""
        outer, inner = self.outer_diameter.value, self.inner_diameter.value
        text = V.Physical("length").text
        for key in ("outer_diameter", "layer_diameter"):
            given = getattr(self, key)
            if given is not None and not THINNEST <= given.value <= THICKEST:
                raise Misfit(
                    f"{text(given.value)} is no diameter of a rotor, which has {text(THINNEST)} to "
                    f"{text(THICKEST)}; check the unit",
                    (key,),
                )
        if inner >= outer:
            raise Misfit(
                f"the inner diameter {text(inner)} must be smaller than the outer one, {text(outer)}",
                ("inner_diameter",),
            )
        if (self.layer_diameter is None) != (self.layer_density is None):
            raise Misfit("a layer needs both 'layer_diameter' and 'layer_density'")
        if self.layer_diameter is not None and self.layer_diameter.value <= outer:
            raise Misfit(
                f"the layer reaches to {text(self.layer_diameter.value)} and must reach beyond the "
                f"outer diameter {text(outer)}",
                ("layer_diameter",),
            )


class SectionByLength(Section):
    """A shaft section given by its length, cut into equal elements."""

    length: V.PositiveLength
    elements: Annotated[int, Strict(), Field(ge=1, le=10_000, description="Number of equal elements")] = 1

    @property
    def count(self) -> int:
        """Number of elements it is cut into."""
        return self.elements


class SectionByNodes(Section):
    """A shaft section from one node to another."""

    nodes: tuple[Annotated[int, Strict()], Annotated[int, Strict()]]
    """First and last node of the section, counted from 1."""

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Refuse a section given in both ways."""
        if "length" in raw:
            raise Misfit("a section has either 'length' or 'nodes', not both", ("length",))
        return raw

    def check(self) -> None:
        """Refuse a section that runs backwards."""
        super().check()
        if not 1 <= self.nodes[0] < self.nodes[1]:
            raise Misfit(
                f"nodes = {list(self.nodes)} is no section; write the first and the last node, "
                "counted from 1",
                ("nodes",),
            )

    @property
    def count(self) -> int:
        """Number of elements it is cut into."""
        return self.nodes[1] - self.nodes[0]


AnySection = Annotated[
    Annotated[SectionByLength, Tag("by_length")] | Annotated[SectionByNodes, Tag("by_nodes")],
    Discriminator(
        lambda raw: (
            "by_nodes"
            if isinstance(raw, SectionByNodes) or (isinstance(raw, Mapping) and "nodes" in raw)
            else "by_length"
        )
    ),
]


class Disc(Placed):
    """A disc or point mass at a node: impeller, thrust disc, coupling."""

    name: Text = ""
    """What it is."""
    mass: V.PositiveMass
    """Mass [kg]."""
    polar_inertia: V.Inertia = default(0.0, "a point mass")
    diametral_inertia: V.Inertia = default(0.0, "a point mass")
    """Moments of inertia [kg m²] about the shaft axis and about a diameter."""

    def check(self) -> None:
        """Refuse inertias no body can have."""
        super().check()
        polar, diametral = self.polar_inertia.value, self.diametral_inertia.value
        if polar > 2.0 * diametral * (1.0 + 1e-9) and diametral > 0.0:
            raise Misfit(
                f"polar_inertia {polar:.4g} kg m² is more than twice diametral_inertia {diametral:.4g} "
                "kg m², "
                "which no body can have; check both (perhaps they are interchanged)",
                ("polar_inertia",),
            )


def _node_positions(raw: Any) -> Any:
    """Read node positions: a list of lengths, or ``{unit = "mm", values = [0, 23.3, …]}``."""
    if isinstance(raw, Mapping):
        unit, values = raw.get("unit"), raw.get("values")
        if (
            set(raw) != {"unit", "values"}
            or not isinstance(unit, str)
            or not isinstance(values, list | tuple)
        ):
            raise UsageError("node positions as a table need exactly 'unit' and 'values'")
        raw = [f"{value!r} {unit}" for value in values]
    if not isinstance(raw, list | tuple):
        raise UsageError(f'{raw!r} is not a list; write {{unit = "mm", values = [0, 25, 50]}}')
    if all(isinstance(entry, float) for entry in raw) and isinstance(raw, tuple):
        return raw
    return tuple(V.Physical("length").number(entry) for entry in raw)


NodePositions = Annotated[tuple[float, ...], BeforeValidator(_node_positions)]


class Rotor(Description):
    """The rotor as built: shaft, discs, materials."""

    material: Name = Field(default="steel", description="Material of all sections that name no other")
    """Name of the material of all sections that name no other."""
    materials: dict[Name, Material] = Field(default_factory=dict)
    """Materials by name."""
    modal_damping: V.NonNegative = default(0.005, "0.5 % of critical on every free-free flexible mode")
    """Damping ratio of the free-free flexible modes [1]."""
    axial: Annotated[bool, Strict()] | None = None
    """Whether it moves along its axis; it does where a face, an axial load or an axial AMB is described."""
    stiffness_factor: V.Positive | None = None
    """Bending stiffness over the one that sections and materials give [1]."""
    mass_to_ends: V.Number | None = None
    """Of a beam in place of a rotor: mass moved from its middle to its ends."""
    mass_to_de: V.Number | None = None
    """Of a beam: mass moved towards the DE; its centre of mass stays."""
    stiffness_to_de: V.Number | None = None
    """Of a beam: logarithm of bending stiffness, more towards the DE."""
    stiffness_to_ends: V.Number | None = None
    """Of a beam: logarithm of bending stiffness, more at the ends."""
    node_positions: NodePositions = Field(default=(), validate_default=False)
    """Distance of every node from node 1 [m], NDE to DE."""
    sections: tuple[AnySection, ...] = Field(min_length=1)
    """Shaft sections, as lengths one after the other or from node to node."""
    discs: tuple[Disc, ...] = ()
    """Discs and point masses."""

    usual: ClassVar[Mapping[str, Usual]] = {
        "modal_damping": Usual(least=0.0, most=0.3, look="a shaft has 0.001 to 0.05; is it in percent?"),
    }

    @classmethod
    def known_keys(cls) -> tuple[str, ...]:
        """Keys to suggest for a mistyped one, with the shaft table of the file."""
        return (*cls.model_fields, "shaft_table")

    def check(self) -> None:
        """Lay out the nodes and refuse sections, materials and discs that do not fit them."""
        by_nodes = [isinstance(section, SectionByNodes) for section in self.sections]
        if any(by_nodes) != all(by_nodes):
            raise Misfit("some sections have 'length' and others 'nodes'; use one of the two", ("sections",))
        if all(by_nodes):
            self._check_nodes()
        elif "node_positions" in self.model_fields_set:
            raise Misfit(
                "sections given by 'length' make their own nodes; leave out 'node_positions' or give "
                "every section its 'nodes'",
                ("node_positions",),
            )
        else:
            positions = [0.0]
            for section in self.sections:
                assert isinstance(section, SectionByLength)
                start, step = positions[-1], section.length.value / section.elements
                positions.extend(start + step * k for k in range(1, section.elements + 1))
            self.__dict__["node_positions"] = tuple(positions)
        known = tuple({*self.materials, "steel"})
        named = [(section.material, ("sections", k, "material")) for k, section in enumerate(self.sections)]
        for name, place in [*named, (self.material, ("material",))]:
            if name is not None and name not in known:
                told = unknown_key(name, known).replace("key", "material", 1).removesuffix("?")
                end = (
                    f"{'?' if 'did you mean' in told else ''} Else describe it under [rotor.materials.{name}]"
                )
                raise Misfit(f"{told}{end}", place)
        place_on_nodes(self.discs, self.node_positions, "discs")

    def cut_at(self, places: Sequence[float]) -> tuple[AnySection, ...]:
        """Sections with a node at each of the places [m]; those that are given by nodes as they are."""
        cut: list[AnySection] = []
        start = 0.0
        for section in self.sections:
            if not isinstance(section, SectionByLength):
                return self.sections
            step = section.length.value / section.elements
            nodes = [start + step * k for k in range(section.elements + 1)]
            new = {
                p for p in places if start < p < nodes[-1] and min(abs(p - z) for z in nodes) > NODE_TOLERANCE
            }
            ends = pairwise(sorted({*nodes, *new}))
            cut += [section.changed(length=f"{b - a!r} m", elements=1) for a, b in ends] if new else [section]
            start = nodes[-1]
        return tuple(cut)

    def _check_nodes(self) -> None:
        positions, expected = self.node_positions, 1
        if len(positions) < 2:
            told = "sections given by 'nodes' need 'node_positions = {unit = \"mm\", values = [0, …]}'"
            raise Misfit(told, ("sections",))
        for number, (left, right) in enumerate(pairwise(positions), start=1):
            if not right > left:
                raise Misfit(
                    f"node {number + 1} at {right * 1e3:.7g} mm does not lie beyond node {number} at "
                    f"{left * 1e3:.7g} mm; node positions must increase",
                    ("node_positions", "values", number),
                )
        for index, section in enumerate(self.sections):
            assert isinstance(section, SectionByNodes)
            if section.nodes[0] != expected:
                raise Misfit(
                    f"the section begins at node {section.nodes[0]}, but the one before ends at "
                    f"node {expected}; sections must follow each other without gap",
                    ("sections", index, "nodes"),
                )
            expected = section.nodes[1]
        if expected != len(positions):
            told = f"the last section ends at node {expected}, but there are {len(positions)} nodes"
            raise Misfit(told, ("sections", len(self.sections) - 1, "nodes"))

    def material_named(self, name: str | None) -> Material:
        """Find a material; ``"steel"`` is known without being described."""
        wanted = self.material if name is None else name
        return self.materials[wanted] if wanted in self.materials else Material.model_validate(STEEL)

    @cached_property
    def is_beam(self) -> bool:
        """Whether it is a beam in place of a rotor that nobody has described."""
        return any(row.stated(self) is not None for row in FORM)

    @property
    def form_errs(self) -> bool:
        """Whether its form may be what does not fit a record, before gains, extensions or small impulses."""
        return self.force_sigma > 0.0

    @property
    def force_sigma(self) -> float:
        """Relative standard deviation of a force by its form [1]."""
        return BEAM_FORCE_SIGMA if self.is_beam else 0.0

    @property
    def gain_sigma(self) -> float:
        """Standard deviation of the gains of sensors by its form [1]."""
        return BEAM_GAIN_SIGMA if self.is_beam else 0.0

    def sought(self) -> list[Parameter]:
        """What of its form is only guessed, with a range: a record shows it before any contact law."""
        if not self.is_beam:
            return []
        rows = [*(row for extension in EXTENSIONS for row in extension.rows), *FORM]
        stated = [(row, row.stated(self)) for row in rows]
        return [row for row, one in stated if one and one.status in ("guess", "default") and one.range]

    @property
    def uses_builtin_steel(self) -> bool:
        """Tell whether some section is made of the steel that the file does not describe."""
        names = {section.material or self.material for section in self.sections}
        return "steel" in names and "steel" not in self.materials

    @cached_property
    def elements(self) -> tuple[Element, ...]:
        """Beam elements; element i joins nodes i+1 and i+2 (counted from 1)."""
        lengths = [right - left for left, right in pairwise(self.node_positions)]
        owners = [section for section in self.sections for _ in range(section.count)]
        found = []
        for length, section in zip(lengths, owners, strict=True):
            material, layer = self.material_named(section.material), section.layer_diameter
            element = Element(
                length=length,
                outer_diameter=section.outer_diameter.value,
                inner_diameter=section.inner_diameter.value,
                layer_diameter=None if layer is None else layer.value,
                layer_density=0.0 if section.layer_density is None else section.layer_density.value,
                material=section.material or self.material,
                youngs_modulus=material.youngs_modulus.value,
                poisson_ratio=material.poisson_ratio.value,
                density=material.density.value,
                part=section.part,
            )
            found.append(element)
        return tuple(found)

    def radii_at(self, node: int) -> list[float]:
        """Outer radii [m] on both sides of a node, counted from 1, with laminations and sleeves."""
        beside = self.elements[max(0, node - 2) : node]
        return [0.5 * (one.layer_diameter or one.outer_diameter) for one in beside]

    @cached_property
    def mass(self) -> float:
        """Mass of shaft, layers and discs [kg]."""
        return math.fsum(mass for mass, _ in self._masses())

    @cached_property
    def centre_of_gravity(self) -> float:
        """Distance of the centre of gravity from node 1 [m]."""
        return math.fsum(mass * position for mass, position in self._masses()) / self.mass

    def _masses(self) -> list[tuple[float, float]]:
        shaft = [
            (element.mass, 0.5 * (left + right))
            for element, (left, right) in zip(self.elements, pairwise(self.node_positions), strict=True)
        ]
        return shaft + [(disc.mass.value, self.node_positions[disc.node - 1]) for disc in self.discs]


EXTENSIONS: tuple[Extension, ...] = (
    of_one_unknown(
        Parameter(
            path="stiffness_factor",
            owner="rotor",
            label="bending stiffness of the rotor over the described one",
            kind="dimensionless",
            measured_by="the first bending frequency of the free rotor, from a hammer test",
            guess_sigma=0.03,
            given_sigma=0.01,
            reach=1.3,
            entries=(Entry(array="modes", column=0, rule=Rule.RATIO),),
        ),
        "rotor stiffness",
        1.0,
        lambda _, found, __: (
            "the rotor bends as if its stiffness were "
            f"{in_words(itself(found['stiffness_factor']), '')} × the described one"
        ),
    ),
)


STATED: tuple[Parameter, ...] = (
    Parameter(
        path="modal_damping",
        owner="rotor",
        label="damping ratio of the bending modes of the rotor",
        kind="dimensionless",
        measured_by="the free rotor, ringing after a hammer blow",
        guess_sigma=0.5,
        given_sigma=0.2,
        entries=(Entry(array="modes", column=1, rule=Rule.RATIO),),
    ),
)
"""Unknown wherever it is not zero: above its first bending mode a rotor rings for most of a drop."""


def _form(path: str, label: str, sigma: float) -> Parameter:
    return Parameter(
        path=path,
        owner="rotor",
        label=label,
        kind="dimensionless",
        logarithmic=False,
        guess_sigma=sigma,
        given_sigma=0.1,
        scale="one",
    )


FORM: tuple[Parameter, ...] = (
    _form("mass_to_ends", "mass at the ends of the beam over that at its middle", 0.8),
    _form("mass_to_de", "mass towards the DE of the beam, its centre of mass as it is", 0.6),
    _form("stiffness_to_de", "bending stiffness of the beam towards the DE", 0.6),
    _form("stiffness_to_ends", "bending stiffness at the ends of the beam over that at its middle", 0.7),
)
"""Rows of the form of a beam; found from a record before any contact law, and held from then on."""


def element_factors(rotor: Rotor) -> tuple[Array, Array]:
    """Factors on density and bending stiffness of the elements by the form of the beam, shapes (E,), (E,); 1
    without.

    Refuses a form that leaves some element no mass.
    """
    ends, de, stiff_de, stiff_ends = (
        0.0 if (value := row.stated(rotor)) is None else float(value) for row in FORM
    )
    middles = np.array([0.5 * (a + b) for a, b in pairwise(rotor.node_positions)])
    s = 2.0 * middles / rotor.node_positions[-1] - 1.0
    masses = np.array([element.mass for element in rotor.elements])
    density = 1.0 + ends * _without_moment(s**2, s, masses) + de * _without_moment(s**3, s, masses)
    if density.min() <= 0.0:
        raise UsageError(
            f"rotor.mass_to_ends = {ends:.3g} and mass_to_de = {de:.3g} leave no mass at "
            f"{1e3 * middles[int(density.argmin())]:.4g} mm from the NDE end; expected smaller ones"
        )
    # a third is the mean of s² along the beam: the ends stiffen against the middle, not the whole beam
    return density, np.exp(stiff_de * s + stiff_ends * (s**2 - 1.0 / 3.0))


def _without_moment(shape: Array, s: Array, masses: Array) -> Array:
    """A shape along the beam less what would change its mass or move its centre of mass."""
    rigid = np.stack([np.ones_like(s), s], axis=1)
    gram = rigid.T @ (masses[:, None] * rigid)
    return np.asarray(shape - rigid @ np.linalg.solve(gram, rigid.T @ (masses * shape)))
