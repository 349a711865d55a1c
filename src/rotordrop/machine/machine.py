"""A machine: rotor, bearings, magnets, sensors, and what was given, defaulted or inferred."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import Field, PrivateAttr

from rotordrop.elements.air import SpeedDescription
from rotordrop.elements.description import Description, Misfit, Text, place_on_nodes
from rotordrop.elements.magnet import ActiveMagneticBearing
from rotordrop.elements.rotor import Rotor
from rotordrop.elements.sensor import Sensor, check_sensors_resolve_motion
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.elements.unbalance import BalanceGrade, Unbalance, from_grade
from rotordrop.elements.values import Acceleration, PositiveTime, default
from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.machine.calibration import CalibrationOrigin
from rotordrop.machine.parameter_paths import changed_machine_parts, reasons_of
from rotordrop.machine.provenance import Mention, mentions

RESERVED_NAMES = ("speed", "unbalance", "rotor", "gravity", "sensors", "ambs", "machine", "calibration")


class Machine(Description):
    """A machine whose rotor can drop onto its touchdown bearings; immutable.

    Attributes
    ----------
    name : str
        Name of the machine.
    gravity : Known
        Acceleration of gravity, acting towards -y [m/s²].
    rotor : Rotor
        Shaft, discs, materials.
    unbalances : tuple of Unbalance
        Unbalances; from the balance grade where none is given.
    balance_grade : BalanceGrade, optional
        Balance quality after ISO 21940-11.
    touchdown_bearings : tuple of TouchdownBearing
        Touchdown bearings, any number, NDE first.
    ambs : tuple of ActiveMagneticBearing
        Radial active magnetic bearings.
    remanence_time_constant : Known, optional
        Time in which the remanent force of the magnets decays [s]; 2 ms, to a factor of two, when left out.
    sensors : tuple of Sensor
        Displacement sensors.
    speed : SpeedDescription
        Nominal speed and aerodynamic drag.
    notes : tuple of str
        Remarks of the file's author.
    calibration : CalibrationOrigin, optional
        Recorded drops that its estimates come from.
    """

    name: Text
    notes: tuple[Text, ...] = ()
    gravity: Acceleration = default(9.81, "usual value")
    speed: SpeedDescription
    rotor: Rotor
    balance_grade: BalanceGrade | None = None
    unbalances: tuple[Unbalance, ...] = ()
    touchdown_bearings: tuple[TouchdownBearing, ...] = Field(min_length=1)
    ambs: tuple[ActiveMagneticBearing, ...] = ()
    remanence_time_constant: PositiveTime | None = Field(
        default=None, description="Time in which the remanent force of the magnets decays"
    )
    sensors: tuple[Sensor, ...] = ()
    calibration: CalibrationOrigin | None = Field(
        default=None, description="Drops it was calibrated on, written by 'rotordrop calibrate'"
    )

    _source_path: Path | None = PrivateAttr(default=None)

    @classmethod
    def rewritten(cls, raw: dict[str, Any]) -> dict[str, Any]:
        """Refuse a direction of gravity, which a later version will know."""
        if isinstance(raw.get("gravity"), list | tuple):
            raise Misfit(
                "gravity as a direction is reserved and not yet supported; it acts towards -y: give its "
                'acceleration alone, gravity = "9.81 m/s^2"',
                ("gravity",),
            )
        return raw

    def check(self) -> None:
        """Refuse parts that do not fit together."""
        nodes = self.rotor.node_positions
        for key in ("unbalances", "touchdown_bearings", "ambs", "sensors"):
            place_on_nodes(getattr(self, key), nodes, key)
        self._check_names()
        self._check_bearing_nodes()
        working = tuple(sensor for sensor in self.sensors if not sensor.lost)
        if working or self.sensors:
            check_sensors_resolve_motion(working, nodes)

    def _check_names(self) -> None:
        for key in ("touchdown_bearings", "ambs", "sensors"):
            seen: set[str] = set()
            for index, part in enumerate(getattr(self, key)):
                if part.name in seen:
                    raise Misfit(
                        f"the name {part.name!r} is used twice; names must differ", (key, index, "name")
                    )
                if key == "touchdown_bearings" and part.name in RESERVED_NAMES:
                    raise Misfit(
                        f"a touchdown bearing cannot be called {part.name!r}; choose another "
                        'name, such as "NDE"',
                        (key, index, "name"),
                    )
                seen.add(part.name)
        names = {bearing.name for bearing in self.touchdown_bearings}
        for index, sensor in enumerate(self.sensors):
            if "bearing" in sensor.model_fields_set and sensor.bearing not in names:
                raise Misfit(
                    f"sensor {sensor.name} belongs to touchdown bearing {sensor.bearing!r}, which does "
                    f"not exist; "
                    f"there are {', '.join(sorted(names))}",
                    ("sensors", index, "bearing"),
                )

    def _check_bearing_nodes(self) -> None:
        """Refuse two touchdown bearings at one node: the weight cannot be shared out between them."""
        first: dict[int, str] = {}
        for index, bearing in enumerate(self.touchdown_bearings):
            if bearing.node in first:
                raise Misfit(
                    f"touchdown bearing {bearing.name} sits at node {bearing.node}, where "
                    f"{first[bearing.node]} sits already; give it another node, or describe the two rows as "
                    "one bearing",
                    ("touchdown_bearings", index, "node" if bearing.position is None else "position"),
                )
            first[bearing.node] = bearing.name

    def left_out(self) -> dict[str, Any]:
        """Share out the balance grade, complete the AMBs, assign the sensors to bearings."""
        values: dict[str, Any] = {"ambs": self._completed_ambs(), "sensors": self._assigned_sensors()}
        if self.balance_grade is not None and "unbalances" not in self.model_fields_set:
            rotor = self.rotor
            values["unbalances"] = from_grade(
                self.balance_grade, rotor.mass, rotor.centre_of_gravity, self._balance_planes()
            )
        return values

    def _balance_planes(self) -> tuple[tuple[int, float], ...]:
        carriers = self.ambs if len(self.ambs) >= 2 else self.touchdown_bearings
        nodes = sorted({carrier.node for carrier in carriers})
        return tuple((node, self.rotor.node_positions[node - 1]) for node in nodes)

    def _completed_ambs(self) -> tuple[ActiveMagneticBearing, ...]:
        carried = self.rotor.mass / max(1, len(self.ambs))
        return tuple(amb.completed_with(amb.completed(carried)) for amb in self.ambs)

    def _assigned_sensors(self) -> tuple[Sensor, ...]:
        return tuple(
            sensor
            if "bearing" in sensor.model_fields_set
            else sensor.completed_with({"bearing": self._nearest_bearing(sensor.node)})
            for sensor in self.sensors
            if not sensor.lost
        )

    def _nearest_bearing(self, node: int) -> str:
        nodes = self.rotor.node_positions
        return min(self.touchdown_bearings, key=lambda b: abs(nodes[b.node - 1] - nodes[node - 1])).name

    def __repr__(self) -> str:
        """Name, mass and parts."""
        bearings = ", ".join(bearing.name for bearing in self.touchdown_bearings)
        nodes = len(self.rotor.node_positions)
        return (
            f"<Machine {self.name}: rotor of {self.rotor.mass:.4g} kg with {nodes} nodes, "
            f"touchdown bearings {bearings}, {len(self.ambs)} AMBs, {len(self.sensors)} sensors>"
        )

    __str__ = __repr__

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
        parts = changed_machine_parts(self, values)
        copy = self.completed_with(parts)
        copy.__pydantic_fields_set__.update(parts)
        if parts.keys() - {"touchdown_bearings", "speed"}:
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
            raise UsageError(f"{name} cannot have a bearing {designation!r}: {reasons_of(error)}") from error
        others = tuple(changed if one.name == name else one for one in self.touchdown_bearings)
        return self.completed_with({"touchdown_bearings": others})

    def calibrated_on(self, origin: CalibrationOrigin) -> Machine:
        """Give the same machine, with the drops that its estimates come from."""
        copy = self.completed_with({"calibration": origin})
        copy.__pydantic_fields_set__.add("calibration")
        return copy

    @cached_property
    def _mentions(self) -> tuple[Mention, ...]:
        return tuple(self._all_mentions())

    def _all_mentions(self) -> Iterator[Mention]:
        if self.rotor.uses_builtin_steel:
            steel = self.rotor.material_named("steel")
            text = f"{steel.youngs_modulus.value / 1e9:g} GPa, {steel.density.value:g} kg/m³"
            yield Mention("rotor.materials.steel", text, "no material 'steel' is described", "default")
        yield from mentions(self)

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
