"""From the description of a machine to the flat arrays the compiled drop model works on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.ball_bearing import clearance_sigma
from rotordrop.elements.bearing_numbers import numbers_of, places_of
from rotordrop.elements.description import Placed
from rotordrop.elements.support import support_sag
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.physics import aerodynamics, magnet, touch
from rotordrop.physics import columns as L
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.contact import depth_at
from rotordrop.physics.elementary import cos_each, sin_each
from rotordrop.physics.linear_algebra import product
from rotordrop.physics.load import load_now
from rotordrop.require import require
from rotordrop.rotor.assembly import RotorFE, build_rotor_fe
from rotordrop.rotor.layout import StateLayout
from rotordrop.rotor.reduction import Reduction, RotorBasis, reduce_rotor
from rotordrop.rotor.statics import bearing_load_shares, rotor_on_race


@dataclass(frozen=True, kw_only=True)
class DropModel:
    """A machine made ready for the time loop: finite elements, reduced basis, kernel arrays, state layout."""

    machine: Machine
    fe: RotorFE
    basis: RotorBasis
    parameters: KernelParameters
    layout: StateLayout
    load_shares: Array
    play: Array | None = None
    """Play that counts in the gap, and its standard deviation [m], shape (2, B), where loose races are held;
    zero where a race has none."""

    def play_sigma(self, b: int) -> float:
        """Standard deviation of the play in the gap of a bearing [m]: above zero where its race is loose."""
        return 0.0 if self.play is None else float(self.play[1, b])

    def with_values(self, values: Mapping[str, float]) -> DropModel:
        """The same model with other parameter values, by path such as ``"NDE.support.stiffness"`` (SI).

        Only what changes is computed again; the rotor and its basis are kept.
        """
        return self.with_machine(self.machine.with_values(values))

    def with_machine(self, machine: Machine) -> DropModel:
        """The same model of a machine with the same rotor and other bearings or values."""
        nodes = require(machine, "machine", Machine).rotor.node_positions
        if not np.array_equal(nodes, self.machine.rotor.node_positions):
            raise UsageError(
                f"{machine.name} has another rotor than {self.machine.name}; build its own model"
            )
        values = _of_values(machine, self.fe, self.basis, self.load_shares)
        if self.layout.magnet_own:
            values["magnet"] = _magnet_rows(machine, self.basis, loops=True)
        else:  # the rows also hold what a start put there
            values["magnet"] = self.parameters.magnet.copy()
            for row, amb in zip(values["magnet"], machine.ambs, strict=True):
                amb.fill(row)
        return replace(self, machine=machine, parameters=self.parameters._replace(**values))

    def at_rest(self) -> Array:
        """State, shape (n,), of a centred rotor with all at rest; loose races lie where they fall."""
        state = self.layout.zeros()
        p = self.parameters.bearing
        for b, bearing in enumerate(self.machine.touchdown_bearings):
            weight = p[b, L.RACE_WEIGHT]
            if weight > 0.0:
                seat = numbers_of(bearing).seat(weight)
                sag = weight / p[b, L.SUPPORT_STIFFNESS_Y]
                state[self.layout.race][2 * b : 2 * b + 2] = seat[0], seat[1] - sag
                state[self.layout.support][2 * b + 1] = -sag
        return state

    @property
    def bearing_names(self) -> tuple[str, ...]:
        """Names of the touchdown bearings, in the order of every bearing axis."""
        return tuple(bearing.name for bearing in self.machine.touchdown_bearings)


HELD_BY = 0.01
"""Preload of a race that is held lightly over its share of the weight [1]: without any, nothing holds a race
in flight, and one of 500 kg was led to 59 kN there; with 0.1 to 0.2 none of three records was followed."""

FASTEST = 1.25
"""Largest speed of a race over the nominal speed for which balls with inertia are tabulated [1]: chosen."""


def build_drop_model(
    machine: Machine, reduction: str | Reduction = "accurate", *, loops: bool = False
) -> DropModel:
    """Assemble, reduce and flatten a machine for the time loop.

    Parameters
    ----------
    machine : Machine
        What the machine is.
    reduction : str or Reduction
        ``"accurate"`` (14 modes + attachment), ``"quick"`` (6 + attachment), ``"full"`` or an own choice.
    loops : bool
        Whether coils and controllers of the magnets are part of it; else magnets are springs and dampers.

    Raises
    ------
    UsageError
        With ``loops``, where a magnet has no coils or no controller.
    """
    fe = build_rotor_fe(require(machine, "machine", Machine))
    nodes = tuple(bearing.node for bearing in machine.touchdown_bearings)
    if require(loops, "loops", bool):
        # what a few modes leave out of the planes of the loop would shift its fast modes
        nodes += tuple(node for amb in machine.looped_ambs for node in (amb.node, machine.measured_node(amb)))
    basis = reduce_rotor(fe, reduction, nodes)
    shares = np.asarray(bearing_load_shares(machine, fe), dtype=np.float64)
    layout = StateLayout.of_machine(machine, basis.size, loops=loops)
    return DropModel(
        machine=machine,
        fe=fe,
        basis=basis,
        parameters=_kernel_parameters(machine, fe, basis, shares, layout),
        layout=layout,
        load_shares=shares,
    )


def held_lightly(model: DropModel) -> DropModel:
    """The model by which a record is followed: a loose race is held lightly, its play part of the gap.

    Nobody knows the play of a mounted bearing and where its balls stand to a micron, on which every flight of
    a race through its play depends, and no sensor sees the race: ``docs/model.md`` has what either way gives.
    """
    bearings, shares = model.machine.touchdown_bearings, np.abs(model.load_shares).tolist()
    held, play = list(bearings), np.zeros((2, len(bearings)))
    for b, (bearing, load) in enumerate(zip(bearings, shares, strict=True)):
        numbers, balls = numbers_of(bearing), bearing.bearing
        if numbers.held:
            continue
        tight = {"clearance": Known(value=0.0), "preload": Known(value=HELD_BY * load)}
        held[b] = bearing.changed(bearing=balls.changed(**tight, arrangement=balls.arrangement))
        below = math.hypot(*numbers.seat(load)) - numbers_of(held[b]).deflection(load)[0]
        play[:, b] = below, 0.5 * clearance_sigma(balls)
    if not play.any():
        return model
    followed = model.with_machine(model.machine.changed(touchdown_bearings=tuple(held)))
    rows = followed.parameters.bearing
    rows[:, L.AIR_GAP] += play[0]
    rows[:, L.ROTOR_RADIUS] -= play[0]
    return replace(followed, play=play)


def _kernel_parameters(
    machine: Machine, fe: RotorFE, basis: RotorBasis, shares: Array, layout: StateLayout
) -> KernelParameters:
    m, loops = basis.size, bool(layout.magnet_own)

    def shapes_at(parts: Sequence[Placed]) -> Array:
        rows = [basis.node_row(part.node) for part in parts]
        return np.ascontiguousarray(rows, dtype=np.float64) if rows else np.zeros((0, m))

    parts = [part for bearing in machine.touchdown_bearings for part in bearing.parts]
    kept = sum(part.remembered for part in parts) + (magnet.N_CLOCK if loops else 0)
    by_magnets = tuple(amb.remembered if loops else 0 for amb in machine.ambs)
    return KernelParameters(
        eigenvalue=np.ascontiguousarray(basis.eigenvalues, dtype=np.float64),
        damping=np.ascontiguousarray(np.diag(basis.damping), dtype=np.float64),
        polar=np.ascontiguousarray(basis.polar, dtype=np.float64).reshape(m, m),
        gravity=-float(machine.gravity) * (product(basis.shapes.T, product(fe.mass, fe.rigid_shapes[:, 0]))),
        bearing_shape=shapes_at(machine.touchdown_bearings),
        magnet_shape=shapes_at(machine.ambs),
        magnet=_magnet_rows(machine, basis, loops=loops),
        flags=np.array([aerodynamics.OFF, 0, bool(machine.loads or machine.base), loops], dtype=np.int64),
        rotor_at=layout.rotor_at(),
        bearing_at=layout.bearing_at(),
        contact_at=layout.contact_at(),
        magnet_at=layout.magnet_at(by_magnets, kept),
        memory=np.zeros(kept + sum(by_magnets)),
        **_of_values(machine, fe, basis, shares),
    )


def _magnet_rows(machine: Machine, basis: RotorBasis, *, loops: bool) -> Array:
    """Rows of `KernelParameters.magnet`; with ``loops`` also coils, controllers and measured planes."""
    rows = np.zeros((len(machine.ambs), L.LOOP_END + basis.size if loops else L.N_MAGNET_COLUMNS))
    for row, amb in zip(rows, machine.ambs, strict=True):
        amb.fill(row)
        if loops:
            amb.fill_loop(row[L.LOOP : L.LOOP_END])
            row[L.LOOP_END :] = basis.node_row(machine.measured_node(amb))
    return rows


def _of_values(machine: Machine, fe: RotorFE, basis: RotorBasis, shares: Array) -> dict[str, Any]:
    """The kernel arrays that change with the values of a machine whose rotor stays."""
    bearings = machine.touchdown_bearings
    rows = np.array([bearing_row(bearing, load) for bearing, load in zip(bearings, shares, strict=True)])
    for row, bearing in zip(rows, bearings, strict=True):
        if row[L.STRESS_COEFFICIENT] == 0.0:  # without rolling elements the rotor stresses what it lies in
            row[L.STRESS_COEFFICIENT] = float(rotor_on_race(machine, bearing).maximum_pressure(1.0))
        # A held race gives way to its own weight by nanometres; a loose one falls.
        if not numbers_of(bearing).held:
            row[L.RACE_WEIGHT] = row[L.RACE_MASS] * float(machine.gravity)
    cosine, sine = np.zeros(basis.size), np.zeros(basis.size)
    for unbalance in machine.unbalances:
        # The phase is measured from +y, so 90° is added to get it from +x.
        angle = float(unbalance.phase) + 0.5 * math.pi
        s, c = sin_each(angle), cos_each(angle)
        shape = basis.node_row(unbalance.node)
        cosine += float(unbalance.amount) * c * shape
        sine += float(unbalance.amount) * s * shape
    spin, speed = np.zeros(L.N_SPIN_ENTRIES), machine.speed
    spin[L.POLAR_INERTIA], spin[L.ROTOR_MASS] = fe.polar_inertia, machine.rotor.mass
    for amb in machine.axial_ambs:
        spin[[L.AXIAL_STIFFNESS, L.AXIAL_DAMPING]] += float(amb.stiffness), float(amb.damping)
    slowed = speed.aero_time_constant
    spin[L.AERO_TIME_CONSTANT] = np.inf if slowed is None else float(slowed)
    # The machine file gives torques, the kernel wants them per polar inertia.
    spin[L.SIDE_FORCE] = float(machine.side_force or 0.0)
    spin[L.AERO_LINEAR] = float(speed.aero_linear or 0.0) / fe.polar_inertia
    spin[L.AERO_QUADRATIC] = float(speed.aero_quadratic or 0.0) / fe.polar_inertia
    uniform = product(basis.shapes.T, product(fe.mass, fe.rigid_shapes[:, 0]))
    return {
        **_loads(machine, basis, uniform),
        **_rubs(machine, basis),
        "bearing": rows,
        "balls": places_of(bearings),
        **_of_fast_balls(machine, rows),
        "unbalance_cos": cosine,
        "unbalance_sin": sine,
        "spin": spin,
    }


def _of_fast_balls(machine: Machine, rows: Array) -> dict[str, Array]:
    """Tables of balls whose inertia counts, and their entries in the rows of the bearings."""
    fastest = FASTEST * float(machine.speed.nominal)
    tables = [numbers_of(bearing).speed_table(fastest) for bearing in machine.touchdown_bearings]
    shapes = [table.values.shape for table in tables if table is not None]
    if not shapes:
        return {"ball_table": np.zeros((0, 1, 1, 1, 1))}
    values = np.zeros((len(tables), *shapes[0]))
    for row, one, table in zip(rows, values, tables, strict=True):
        if table is not None:
            row[L.FAST : L.FAST_END], one[:] = table.entries, table.values
    return {"ball_table": values}


def _loads(machine: Machine, basis: RotorBasis, uniform: Array) -> dict[str, Array]:
    """Rows, shapes and points of what pushes the rotor; ``uniform`` (m,) is the inertia of its modes."""
    courses = [load.course(float(machine.speed.nominal)) for load in machine.loads]
    # an axial load moves no mode
    shapes = [(0.0 if load.along else 1.0) * basis.node_row(load.node) for load in machine.loads]
    if machine.base is not None:
        courses.append(machine.base.course())
        shapes.append(-uniform)
    rows, points = np.zeros((len(courses), L.N_LOAD_COLUMNS)), np.zeros((0, 3))
    for row, (entries, course) in zip(rows, courses, strict=True):
        row[:] = entries
        row[[L.LOAD_FIRST, L.LOAD_END]] = len(points), len(points) + len(course)
        points = np.vstack([points, course])
    return {
        "load": rows,
        "load_shape": np.ascontiguousarray(np.array(shapes).reshape(len(shapes), basis.size)),
        "load_points": points,
    }


def pushes(p: KernelParameters, speed: float) -> Array:
    """Modal forces (m, 2) of gravity and of what pushes the rotor across its axis at power-off, at a speed
    [rad/s].
    """
    found = np.column_stack([np.zeros(len(p.gravity)), p.gravity])
    for row, shape in zip(p.load, p.load_shape, strict=True):
        found += np.outer(shape, load_now(row, p.load_points, 0.0, speed))
    return found


def _rubs(machine: Machine, basis: RotorBasis) -> dict[str, Any]:
    """Numbers and shapes of the contacts of rotor and housing; bearings that have a stop, or a face."""
    rubbing = [one for one in machine.clearances if one.stiffness is not None]
    stops = [b for b, bearing in enumerate(machine.touchdown_bearings) if bearing.mount.stop is not None]
    faces = [b for b, bearing in enumerate(machine.touchdown_bearings) if bearing.face is not None]
    rows = [np.concatenate([one.touch(), basis.node_row(one.node)]) for one in rubbing]
    rub = np.array(rows).reshape(len(rubbing), touch.N_ENTRIES + basis.size)
    return {
        "rub": rub,
        "stops": np.array(stops, dtype=np.int64),
        "faces": np.array(faces, dtype=np.int64),
    }


def bearing_row(bearing: TouchdownBearing, static_load: float) -> Array:
    """One row of `KernelParameters.bearing` [SI], with the bearing damping from the tangent stiffness at a
    load [N].
    """
    numbers = numbers_of(bearing)
    row = np.zeros(L.N_BEARING_COLUMNS)
    row[L.BALL_SET : L.BALL_SET_END] = numbers.entries()
    row[L.RING : L.RING_END] = numbers.rings()
    row[L.PITCH_DIAMETER], row[L.LINES] = numbers.drag_diameter, numbers.lines_of_contact
    row[L.BEARING_DAMPING] = numbers.damping(float(bearing.damping_time), static_load)
    bearing.fill(row)
    return row


@dataclass(frozen=True, kw_only=True)
class StaticSag:
    """What gives way under the rotor at rest, below the air gap."""

    indentation: Array
    """Contact indentation under the static load shares [m], shape (B,)."""
    race: Array
    """Deflection of the bearing [m], shape (B,)."""
    support: Array
    """Deflection of the support [m], shape (B,)."""

    @property
    def total(self) -> Array:
        """Their sum [m], shape (B,): the radius at rest less the air gap."""
        return self.indentation + self.race + self.support

    def depth(self, gap: Array) -> Array:
        """How deep [m] the rotor lies below the centre with an air gap (B,) [m]."""
        return gap + self.indentation + self.race + self.support


def race_sag(bearings: Sequence[TouchdownBearing], loads: Array) -> Array:
    """Deflection [m] of every bearing, shape (B,), under static loads (B,) [N]."""
    return np.array([_race_sag(b, float(load)) for b, load in zip(bearings, loads, strict=True)])


@lru_cache(maxsize=64)
def _race_sag(bearing: TouchdownBearing, load: float) -> float:
    """Found once for equal bearings and loads: a fit asks for them hundreds of times."""
    return numbers_of(bearing).deflection(load)[0]


def static_sag(rows: Array, race: Array, loads: Array) -> StaticSag:
    """Sag of bearings with kernel rows (B, columns) and race sags (B,) [m] under static loads (B,) [N]."""
    laws = rows[:, L.CONTACT : L.CONTACT_END]
    indentation = np.array([depth_at(law, float(load)) for law, load in zip(laws, loads, strict=True)])
    support = np.array([support_sag(row, float(load)) for row, load in zip(rows, loads, strict=True)])
    return StaticSag(indentation=indentation, race=race, support=support)


def sag_of_model(model: DropModel) -> StaticSag:
    """Sag of a model's rotor under its static load shares."""
    loads = np.asarray(model.load_shares)
    return static_sag(model.parameters.bearing, race_sag(model.machine.touchdown_bearings, loads), loads)
