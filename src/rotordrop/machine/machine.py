"""A machine: rotor, bearings, magnets, sensors, and what was given, defaulted or inferred."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, PrivateAttr, ValidationError

from rotordrop.elements.air import SpeedDescription
from rotordrop.elements.clearance import Clearance, check_clearances
from rotordrop.elements.description import Description, Misfit, Text, place_on_nodes
from rotordrop.elements.load import Base, Load
from rotordrop.elements.magnet import ActiveMagneticBearing, AxialMagneticBearing
from rotordrop.elements.rotor import Rotor
from rotordrop.elements.sensor import Sensor, check_sensors_resolve_motion
from rotordrop.elements.table import keys_of
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.elements.unbalance import BalanceGrade, Unbalance, from_grade
from rotordrop.elements.values import Acceleration, Number, PositiveTime, default
from rotordrop.errors import UsageError
from rotordrop.known import Known, Status
from rotordrop.machine.calibration import CalibrationOrigin
from rotordrop.require import each, require
from rotordrop.sketch import sketch
from rotordrop.units import GRAVITY, format_quantity, in_si

RESERVED_NAMES = ("speed", "unbalance", "rotor", "gravity", "sensors", "ambs", "machine", "calibration")

_WEIGHTLESS = (
    "has no gravity across its axis",
    ": the fall before the first contact is taken as one under gravity. Simulations and studies know "
    "such a machine",
)


class Machine(Description):
    """A machine whose rotor can drop onto its touchdown bearings; immutable."""

    name: Text
    """Name of the machine."""
    serial_number: Text = ""
    """Serial number, which reports repeat."""
    notes: tuple[Text, ...] = ()
    """Remarks of the file's author."""
    gravity: Acceleration = default(GRAVITY, "usual value")
    """Acceleration of gravity, acting towards -y [m/s²]."""
    speed: SpeedDescription
    """Nominal speed and aerodynamic drag."""
    rotor: Rotor
    """Shaft, discs, materials."""
    balance_grade: BalanceGrade | None = None
    """Balance quality after ISO 21940-11."""
    unbalances: tuple[Unbalance, ...] = ()
    """Unbalances; from the balance grade where none is given."""
    touchdown_bearings: tuple[TouchdownBearing, ...] = Field(min_length=1)
    """Touchdown bearings, any number, NDE first."""
    ambs: tuple[ActiveMagneticBearing, ...] = ()
    """Radial active magnetic bearings."""
    axial_ambs: tuple[AxialMagneticBearing, ...] = ()
    """Axial active magnetic bearings."""
    remanence_time_constant: PositiveTime | None = None
    """Time in which the remanent force of the magnets decays [s]; 2 ms, to a factor of two, when left out."""
    sensors: tuple[Sensor, ...] = ()
    """Displacement sensors."""
    clock_error: Number | None = None
    """How much longer a second of their records lasts than a second [1]; right when left out."""
    loads: tuple[Load, ...] = ()
    """Forces on the rotor beside gravity."""
    side_force: Number | None = None
    """Steady force in +x all along the rotor over its weight [1]; of a machine out of level the tangent of
    the angle, with `gravity` times its cosine; none when left out."""
    base: Base | None = None
    """Acceleration of the ground on which the machine stands."""
    clearances: tuple[Clearance, ...] = ()
    """Narrow places beside the touchdown bearings, such as seals."""
    calibration: CalibrationOrigin | None = None
    """Recorded drops that its estimates come from."""

    _source_path: Path | None = PrivateAttr(default=None)

    def __init__(self, **values: Any) -> None:
        """Describe a machine by its parts, as a machine file does; `UsageError` says what does not fit."""
        try:
            super().__init__(**values)
        except ValidationError as error:
            from rotordrop.machine.loading import TomlPositions, refusal  # it makes machines

            raise UsageError(str(refusal(error, TomlPositions(""), None, None))) from None

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # what validates goes past it

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Refuse a direction of gravity, for a later version, and a side force with a unit."""
        if isinstance(raw.get("gravity"), list | tuple):
            raise Misfit(
                "gravity as a direction is reserved and not yet supported; it acts towards -y: give its "
                'acceleration alone, gravity = "9.81 m/s^2"',
                ("gravity",),
            )
        push = raw.get("side_force")
        if isinstance(push, str) and re.search(r"[A-Za-z]\s*$", push):
            raise Misfit(
                f"{push!r} has a unit; side_force is the steady force across over the weight of the rotor, "
                "or the tangent of the angle by which the machine is out of level: side_force = 0.01",
                ("side_force",),
            )
        return raw

    def check(self) -> None:
        """Refuse parts that do not fit together."""
        keys = ("unbalances", "touchdown_bearings", "ambs", "sensors", "loads", "clearances")
        parts = [*self.rotor.discs, *(part for key in keys for part in getattr(self, key))]
        places = [part.position.value for part in parts if part.position is not None]
        if len(places) == len(parts):  # no number of a node goes astray
            self.__dict__["rotor"] = self.rotor.changed(sections=self.rotor.cut_at(places))
        nodes = self.rotor.node_positions
        for key in keys:
            place_on_nodes(getattr(self, key), nodes, key)
        self._check_names()
        first: dict[int, str] = {}
        for index, bearing in enumerate(self.touchdown_bearings):
            if bearing.node in first:  # the weight could not be shared out between them
                raise Misfit(
                    f"touchdown bearing {bearing.name} sits at node {bearing.node}, where "
                    f"{first[bearing.node]} sits already; give it another node, or describe the two rows as "
                    "one bearing",
                    ("touchdown_bearings", index, "node" if bearing.position is None else "position"),
                )
            first[bearing.node] = bearing.name
        self._check_axial()
        self._check_loops()
        check_clearances(self.clearances, self.touchdown_bearings, nodes)
        if self.sensors:
            check_sensors_resolve_motion(tuple(one for one in self.sensors if not one.lost), nodes)

    @property
    def axial(self) -> bool:
        """Whether the rotor moves along its axis."""
        described = bool(self.axial_ambs) or any(load.along for load in self.loads)
        described = described or any(bearing.face for bearing in self.touchdown_bearings)
        return described if self.rotor.axial is None else self.rotor.axial

    @property
    def looped_ambs(self) -> tuple[ActiveMagneticBearing, ...]:
        """The radial AMBs, all with magnet and controller; refuses a machine where one lacks them."""
        lacking = [amb.name for amb in self.ambs if amb.magnet is None or amb.controller is None]
        if lacking or not self.ambs:
            which = f"its AMB {lacking[0]!r} lacks one" if lacking else "it has no AMB"
            raise UsageError(
                f"the control loop of {self.name!r} takes a magnet and a controller in every AMB, and "
                f"{which}; "
                "add the tables 'magnet' and 'controller', or have the magnets as springs and dampers"
            )
        return self.ambs

    @property
    def has_loops(self) -> bool:
        """Whether every radial AMB has magnet and controller, and there is one."""
        known = [amb.magnet is not None and amb.controller is not None for amb in self.ambs]
        return bool(known) and all(known)

    def measured_node(self, amb: ActiveMagneticBearing) -> int:
        """Node of the plane that the controller of an AMB measures."""
        name = None if amb.controller is None else amb.controller.sensor
        return next((sensor.node for sensor in self.sensors if sensor.name == name), amb.node)

    def _check_loops(self) -> None:
        """Refuse magnets closer than the touchdown bearings, unknown sensors, controllers of another beat."""
        widest = max(bearing.air_gap.value for bearing in self.touchdown_bearings)
        beats: dict[tuple[float, float], str] = {}
        for index, amb in enumerate(self.ambs):
            if amb.magnet is not None and amb.magnet.gap.value <= widest:
                gap, room = (format_quantity(one, "length") for one in (amb.magnet.gap.value, widest))
                raise Misfit(
                    f"the magnet of AMB {amb.name} has a gap of {gap}, and a touchdown bearing lets the "
                    f"rotor move by {room}: it would strike the poles; check both",
                    ("ambs", index, "magnet", "gap"),
                )
            if amb.controller is None:
                continue
            names = [sensor.name for sensor in self.sensors]
            if amb.controller.sensor is not None and amb.controller.sensor not in names:
                raise Misfit(
                    f"the controller of AMB {amb.name} measures with sensor {amb.controller.sensor!r}, which "
                    f"does not exist; there are {', '.join(sorted(names)) or 'none'}",
                    ("ambs", index, "controller", "sensor"),
                )
            beat = (amb.controller.sample_time.value, amb.controller.delay.value)
            if beats and beat not in beats:
                raise Misfit(
                    f"the controllers of AMBs {amb.name} and {next(iter(beats.values()))} have another "
                    "sample time or delay; one device samples all magnets: give both the same",
                    ("ambs", index, "controller"),
                )
            beats[beat] = amb.name

    @property
    def pushed(self) -> bool:
        """Whether loads act across its axis, beside its weight."""
        return any(load.along is None for load in self.loads)

    @property
    def not_estimated(self) -> str:
        """Why no record of it can be estimated yet; empty where one can."""
        machine = f"the machine {self.name!r}"
        parts: list[tuple[str, tuple[str, str] | None]] = [
            (machine, _WEIGHTLESS if float(self.gravity) <= 0.0 else None),
            (machine, self.base.beyond_estimates if self.base else None),
            *((f"the clearance {one.name!r} of {machine}", one.beyond_estimates) for one in self.clearances),
        ]
        for bearing in self.touchdown_bearings:
            who = f"the touchdown bearing {bearing.name!r} of {machine}"
            parts += [(who, part.beyond_estimates) for part in bearing.parts]
        found = ((who, *said) for who, said in parts if said is not None)
        return next(
            (f"{w} {what}, with which a record cannot be estimated yet{more}" for w, what, more in found), ""
        )

    def _check_axial(self) -> None:
        """Refuse what acts along the axis of a rotor that does not move there, or that nothing stops."""
        faces = [bearing.face for bearing in self.touchdown_bearings if bearing.face is not None]
        loads = [(index, load) for index, load in enumerate(self.loads) if load.along]
        if self.rotor.axial is False and (faces or loads or self.axial_ambs):
            key = "a face" if faces else "an axial load" if loads else "an axial AMB"
            raise Misfit(
                f"the rotor has axial = false, and the machine has {key}; leave out one of them",
                ("rotor", "axial"),
            )
        for index, load in loads:
            if not any(face.stops(load.sense) for face in faces):
                towards, side = ("higher", "+z") if load.sense > 0.0 else ("lower", "-z")
                wrong = [one.name for one in self.touchdown_bearings if one.face is not None]
                way_out = (
                    f'the face of {" and ".join(wrong)} stops motion the other way: give it side = "{side}" '
                    'or "both"'
                    if wrong
                    else 'give a touchdown bearing a face there, such as face = { gap = "0.25 mm", '
                    'inner_radius = "35 mm", outer_radius = "39 mm" }'
                )
                raise Misfit(
                    f"nothing stops the rotor that this load pushes towards {towards} nodes; {way_out}, "
                    "or leave the load out",
                    ("loads", index, "direction"),
                )

    def _check_names(self) -> None:
        for key in ("touchdown_bearings", "ambs", "axial_ambs", "sensors", "clearances"):
            seen: set[str] = set()
            for index, part in enumerate(getattr(self, key)):
                place = (key, index, "name")
                if part.name in seen:
                    raise Misfit(f"the name {part.name!r} is used twice; names must differ", place)
                if key == "touchdown_bearings" and part.name in RESERVED_NAMES:
                    raise Misfit(
                        f"a touchdown bearing cannot be called {part.name!r}; choose another "
                        'name, such as "NDE"',
                        place,
                    )
                seen.add(part.name)
        names = {bearing.name for bearing in self.touchdown_bearings}
        for index, sensor in enumerate(self.sensors):
            if "bearing" in sensor.model_fields_set and sensor.bearing not in names:
                raise Misfit(
                    f"sensor {sensor.name} belongs to touchdown bearing {sensor.bearing!r}, which does "
                    f"not exist; there are {', '.join(sorted(names))}",
                    ("sensors", index, "bearing"),
                )

    def left_out(self) -> dict[str, Any]:
        """Share out the balance grade, complete supports and AMBs, assign the sensors to bearings."""
        rotor, nodes = self.rotor, self.rotor.node_positions
        carried = rotor.mass / max(1, len(self.ambs))

        def assigned(sensor: Sensor) -> Sensor:
            if "bearing" in sensor.model_fields_set:
                return sensor
            at = nodes[sensor.node - 1]
            nearest = min(self.touchdown_bearings, key=lambda bearing: abs(nodes[bearing.node - 1] - at))
            return sensor.completed_with({"bearing": nearest.name})

        values: dict[str, Any] = {
            "touchdown_bearings": tuple(one.under(rotor.mass) for one in self.touchdown_bearings),
            "clearances": tuple(one.completed_with(one.completed(rotor)) for one in self.clearances),
            "ambs": tuple(amb.completed_with(amb.completed(carried)) for amb in self.ambs),
            "sensors": tuple(assigned(sensor) for sensor in self.sensors if not sensor.lost),
        }
        if self.balance_grade is not None and "unbalances" not in self.model_fields_set:
            carriers = self.ambs if len(self.ambs) >= 2 else self.touchdown_bearings
            planes = tuple((node, nodes[node - 1]) for node in sorted({one.node for one in carriers}))
            values["unbalances"] = from_grade(self.balance_grade, rotor.mass, rotor.centre_of_gravity, planes)
        return values

    def __repr__(self) -> str:
        """Name, mass and parts."""
        bearings = ", ".join(bearing.name for bearing in self.touchdown_bearings)
        nodes = len(self.rotor.node_positions)
        return (
            f"<Machine {self.name}: rotor of {self.rotor.mass:.4g} kg with {nodes} nodes, "
            f"touchdown bearings {bearings}, {len(self.ambs)} AMBs, {len(self.sensors)} sensors>"
        )

    __str__ = __repr__

    def _repr_html_(self) -> str:
        ends = np.repeat(self.rotor.node_positions, 2)[1:-1]
        radii = np.repeat([0.5 * element.outer_diameter for element in self.rotor.elements], 2)
        z, r = np.concatenate([ends, ends[::-1]]), np.concatenate([radii, -radii[::-1]])
        places = [self.rotor.node_positions[bearing.node - 1] for bearing in self.touchdown_bearings]
        top = 1.2 * float(np.max(radii))
        marks = {b.name: ([x, x], [-top, top]) for b, x in zip(self.touchdown_bearings, places, strict=True)}
        return sketch(repr(self), "position [m]", "radius [mm]", {"shaft": (z, r), **marks}, 1e3)

    @property
    def source_path(self) -> Path | None:
        """File the machine was read from."""
        return self._source_path

    def bearing(self, name: str) -> TouchdownBearing:
        """Find a touchdown bearing by name."""
        for bearing in self.touchdown_bearings:
            if bearing.name == name:
                return bearing
        names = ", ".join(bearing.name for bearing in self.touchdown_bearings)
        raise UsageError(f"the machine has no touchdown bearing {name!r}; there are {names}")

    def with_values(self, values: Mapping[str, float | str | Known]) -> Machine:
        """Give the same machine with other values, by path such as ``"NDE.support.stiffness"``.

        A number is in SI units, a text has its own: ``{"NDE.air_gap": "350 um"}``.

        What follows from a changed value (the horizontal support, say) follows again. Unbalances are counted
        from 0, as in `unbalances`: ``"unbalance.0.amount"``.
        """
        tree: dict[str, Any] = {}
        for path, value in require(values, "values", Mapping).items():
            *keys, last = _resolved(self, require(path, "a path", str))
            branch = tree
            for key in keys:
                branch = branch.setdefault(key, {})
            read = (
                value
                if isinstance(value, Known)
                else Known(value=in_si(value, kind_of_path(self, path), path))
            )
            branch[last] = read
        parts: dict[str, Any] = {}
        for key, branch in tree.items():
            physical = type(self).physical(key)
            try:
                parts[key] = (
                    _changed(getattr(self, key), branch) if physical is None else physical.read(branch)
                )
            except ValueError as error:
                stated = ", ".join(
                    f"{path} = {value if isinstance(value, str) else f'{float(value):g}'}"
                    for path, value in values.items()
                )
                raise UsageError(f"cannot set {stated} (SI units): {reasons(error)}") from error
        copy = self.completed_with(parts)
        copy.__pydantic_fields_set__.update(parts)
        if parts.keys() - {"speed"}:
            copy.__dict__.update(copy.left_out())
        return copy

    def with_bearing(self, name: str, designation: str) -> Machine:
        """Give the same machine with another rolling bearing in the touchdown bearing of that name.

        Its values are those of the catalogue; see `TouchdownBearing.with_designation`.
        """
        if self.bearing(name).bearing.designation == designation:
            return self
        try:
            changed = self.bearing(name).with_designation(designation)
        except ValueError as error:
            raise UsageError(f"{name} cannot have a bearing {designation!r}: {reasons(error)}") from error
        others = tuple(changed if one.name == name else one for one in self.touchdown_bearings)
        return self.completed_with({"touchdown_bearings": others})

    def with_magnets_on(self, names: Iterable[str]) -> Machine:
        """Give the same machine, some of whose AMBs stay on when the others let go.

        Raises
        ------
        UsageError
            If it has no AMB of a name, or none is left to let go.
        """
        chosen, known = each(names, "names", str), [amb.name for amb in self.ambs]
        if not chosen:
            return self
        for name in chosen:
            if name not in known:
                raise UsageError(
                    f"the machine {self.name!r} has no AMB {name!r} that could stay on; expected one of "
                    f"{', '.join(known) or 'none'}. Name it as the machine file does"
                )
        if set(chosen) == set(known):
            raise UsageError(
                f"every AMB of the machine {self.name!r} stays on, so that nothing falls; expected one at "
                "least that lets go. Name fewer"
            )
        stay = (amb.completed_with({"stays_on": amb.stays_on or amb.name in chosen}) for amb in self.ambs)
        return self.completed_with({"ambs": tuple(stay)})

    def calibrated_on(self, origin: CalibrationOrigin) -> Machine:
        """Give the same machine, with the drops that its estimates come from."""
        copy = self.completed_with({"calibration": origin})
        copy.__pydantic_fields_set__.add("calibration")
        return copy

    @cached_property
    def _mentions(self) -> tuple[Mention, ...]:
        found = mentions(self)
        if not self.rotor.uses_builtin_steel:
            return found
        steel = self.rotor.material_named("steel")
        text = f"{steel.youngs_modulus.value / 1e9:g} GPa, {steel.density.value:g} kg/m³"
        why = "no material 'steel' is described"
        return Mention("rotor.materials.steel", text, why, "default"), *found

    @property
    def defaults_in_use(self) -> tuple[tuple[str, str, str], ...]:
        """Path, value and reason of everything that was left out of the file and has a default."""
        return tuple((m.path, m.text, m.why) for m in self._mentions if m.status == "default")

    @property
    def inferred(self) -> tuple[tuple[str, str, str], ...]:
        """Path, value and reason of everything that was inferred from other facts."""
        return tuple((m.path, m.text, m.why) for m in self._mentions if m.status == "inferred")

    def __eq__(self, other: object) -> bool:
        """Compare what the machines are, not where they were read from."""
        if not isinstance(other, Machine):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in type(self).model_fields)

    def __hash__(self) -> int:
        """Hash by the parts that tell machines apart in practice."""
        return hash((self.name, self.rotor.node_positions, self.touchdown_bearings))


def kind_of_path(machine: Machine, path: str) -> str:
    """Kind of quantity of a value by path, one of `KINDS`; refuses a path it does not have."""
    *keys, last = _resolved(machine, path)
    part: Any = machine
    for key in keys:
        part = _step(part, key, path)
    physical = type(part).physical(last)
    assert physical is not None, path
    return str(physical.kind)


def value_of_path(machine: Machine, path: str) -> float:
    """Value [SI] by path, such as ``"NDE.support.stiffness"``; refuses one that the machine leaves out."""
    part: Any = machine
    for key in _resolved(machine, path):
        part = _step(part, key, path)
    if part is None:
        raise UsageError(f"{machine.name!r} leaves {path!r} out; describe it to vary it")
    return float(part)


def reasons(error: Exception) -> str:
    """Why a description was refused, without the places pydantic names."""
    if not isinstance(error, ValidationError):
        return str(error)
    return "; ".join(str(e["msg"]).removeprefix("Value error, ") for e in error.errors())


def _changed(part: Any, branch: Any) -> Any:
    if isinstance(branch, Known):
        return branch
    if isinstance(part, tuple):
        return tuple(_changed(item, branch[i]) if i in branch else item for i, item in enumerate(part))
    assert isinstance(part, Description)
    return part.changed(**{key: _changed(getattr(part, key), sub) for key, sub in branch.items()})


def _resolved(machine: Machine, path: str) -> tuple[Any, ...]:
    """Turn a path into keys and indices from the machine down to one physical value."""
    head, *rest = path.split(".")
    keys: tuple[Any, ...] = (head, *rest)
    bearings = [bearing.name for bearing in machine.touchdown_bearings]
    if head in bearings:
        below = [int(key) if key.isdecimal() else key for key in keys_of(rest)]
        keys = ("touchdown_bearings", bearings.index(head), *below)
    elif head in ("unbalance", "loads"):
        what, value = ("unbalances", "amount") if head == "unbalance" else ("loads", "force")
        if rest and not rest[0].removeprefix("-").isdecimal():
            raise UsageError(f"{path!r}: {what} are counted from 0, as in '{head}.0.{value}'")
        keys = (what, *map(int, rest[:1]), *rest[1:])
    elif head in ("sensors", "ambs", "clearances") and rest:
        names = [part.name for part in getattr(machine, head)]
        if rest[0] in names:
            keys = (head, names.index(rest[0]), *rest[1:])
    part: Any = machine
    for key in keys:
        part = _step(part, key, path)
    if not (isinstance(part, Known) or part is None):
        raise UsageError(
            f"{path!r} is not a single physical value; write for example '<bearing>.support.stiffness' with "
            f"one of the bearings {', '.join(bearings)} (given: {path})"
        )
    return keys


def _step(part: Any, key: Any, path: str) -> Any:
    if isinstance(part, tuple) and isinstance(key, int) and 0 <= key < len(part):
        return part[key]
    if isinstance(part, Description) and key in type(part).model_fields:
        return getattr(part, key)
    if isinstance(part, tuple):
        raise UsageError(f"the machine has no value {path!r}: there are {len(part)} of them, counted from 0")
    known = list(type(part).model_fields) if isinstance(part, Description) else []
    close = get_close_matches(str(key), known, 1, 0.5)
    listed = ", ".join(known) or "no further names"
    way_out = f"did you mean {close[0]!r}?" if close else f"known there are {listed}"
    raise UsageError(f"the machine has no value {path!r}: {key!r} is not known; {way_out}")


@dataclass(frozen=True)
class Mention:
    """A value worth mentioning: where it is, what it is and why."""

    path: str
    text: str
    why: str
    status: Status


_ENTRY = re.compile(r"(rotor\.sections|rotor\.discs|sensors|ambs)\..+\.(?!bearing$)(\w+)$")
_SILENT = {"position", "notes", "unbalances", "node_positions", "sections", "elements", "part", "materials"}
_PLAIN_INFERRED = {"ball_count", "ball_count_range", "ball_material"}


def mentions(part: Description) -> tuple[Mention, ...]:
    """Mention every default and inference in a description, once where list entries share it."""
    merged: dict[tuple[str, str, str, Status], list[Mention]] = {}
    for mention in _walk(part, ""):
        match = _ENTRY.match(mention.path)
        common = match.expand(r"\1.*.\2") if match else mention.path
        merged.setdefault((common, mention.text, mention.why, mention.status), []).append(mention)
    return tuple(found[0] if len(found) == 1 else Mention(*shared) for shared, found in merged.items())


def _walk(part: Description, path: str) -> Iterator[Mention]:
    for name in type(part).model_fields if getattr(part, "described", True) else ():  # of nothing, nothing
        value = getattr(part, name)
        here = f"{path}.{name}" if path else name
        if isinstance(value, Known):
            if value.status in ("default", "inferred"):
                physical = type(part).physical(name)
                assert physical is not None
                text = format_quantity(value.value, physical.kind)
                yield Mention(here, text, part.reason(name), value.status)
        elif isinstance(value, Description):
            yield from _walk(value, here)
        elif isinstance(value, tuple) and value and isinstance(value[0], Description):
            for index, item in enumerate(value):
                label = getattr(item, "name", "")
                shown = {"touchdown_bearings": str(label), "unbalances": f"unbalance.{index}"}
                yield from _walk(item, shown.get(name, f"{here}.{label or index}"))
        elif isinstance(value, dict):
            for key, item in value.items():
                yield from _walk(item, f"{here}.{key}")
        elif not (name in part.model_fields_set | _SILENT | {"node"} or value in (None, "", ())):
            inferred = name in _PLAIN_INFERRED and getattr(part, "designation", None) is not None
            text = {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)
            status: Status = "inferred" if inferred or name == "bearing" else "default"
            yield Mention(here, text, part.reason(name), status)
