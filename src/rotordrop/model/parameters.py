"""From the description of a machine to the flat arrays the compiled drop model works on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.machine import Machine, TouchdownBearing
from rotordrop.model import layout as L
from rotordrop.model.assembly import RotorFE, build_rotor_fe
from rotordrop.model.layout import KernelParameters
from rotordrop.model.reduction import Reduction, RotorBasis, reduce_rotor
from rotordrop.model.statics import bearing_load_shares
from rotordrop.physics import aerodynamics
from rotordrop.physics.ball_bearing import BearingConstants, bearing_constants
from rotordrop.physics.ball_bearing_planar import planar_ball_energy, planar_ball_gradient

Array = NDArray[np.float64]
LANES = 8

LEAST_DAMPING = 1e-9
"""Share of a loaded ball's stiffness [1] added to what holds a loose race, sideways perhaps nothing."""


@dataclass(frozen=True, kw_only=True)
class DropModel:
    """A machine made ready for the time loop: finite elements, reduced basis, kernel arrays, state layout."""

    machine: Machine
    fe: RotorFE
    basis: RotorBasis
    parameters: KernelParameters
    layout: L.StateLayout
    load_shares: Array

    def with_values(self, values: Mapping[str, float]) -> DropModel:
        """The same model with other parameter values, by path such as ``"NDE.support.stiffness"`` (SI).

        Only what changes is computed again; the rotor and its basis are kept.
        """
        machine = self.machine.with_values(values)
        return replace(self, machine=machine, parameters=_with_machine(self, machine))

    def at_rest(self) -> Array:
        """State, shape (n,), of a centred rotor with all at rest; loose races lie on their lowest balls."""
        state = self.layout.zeros()
        p = self.parameters.bearing
        for b, bearing in enumerate(self.machine.touchdown_bearings):
            weight = p[b, L.RACE_WEIGHT]
            if weight > 0.0:
                seat = loose_race_seat(bearing_constants(bearing.bearing), weight)
                sag = weight / p[b, L.SUPPORT_STIFFNESS_Y]
                state[self.layout.race][2 * b : 2 * b + 2] = seat[0], seat[1] - sag
                state[self.layout.support][2 * b + 1] = -sag
        return state

    @property
    def bearing_names(self) -> tuple[str, ...]:
        """Names of the touchdown bearings, in the order of every bearing axis."""
        return tuple(bearing.name for bearing in self.machine.touchdown_bearings)


def build_drop_model(machine: Machine, reduction: str | Reduction = "accurate") -> DropModel:
    """Assemble, reduce and flatten a machine for the time loop.

    Parameters
    ----------
    machine : Machine
        What the machine is.
    reduction : str or Reduction
        ``"accurate"`` (14 modes + attachment), ``"quick"`` (6 + attachment), ``"full"`` or an own choice.
    """
    fe = build_rotor_fe(machine)
    nodes = tuple(bearing.node for bearing in machine.touchdown_bearings)
    basis = reduce_rotor(fe, reduction, nodes)
    shares = np.asarray(bearing_load_shares(machine), dtype=np.float64)
    layout = L.StateLayout(n_modes=basis.shapes.shape[1], n_bearings=len(nodes))
    return DropModel(
        machine=machine,
        fe=fe,
        basis=basis,
        parameters=_kernel_parameters(machine, fe, basis, shares),
        layout=layout,
        load_shares=shares,
    )


def _rows(basis: RotorBasis, nodes: list[int]) -> Array:
    if not nodes:
        return np.zeros((0, basis.shapes.shape[1]))
    return np.ascontiguousarray([basis.node_row(node) for node in nodes], dtype=np.float64)


def _kernel_parameters(machine: Machine, fe: RotorFE, basis: RotorBasis, shares: Array) -> KernelParameters:
    m = basis.shapes.shape[1]
    bearings = machine.touchdown_bearings
    magnet = np.zeros((len(machine.ambs), L.N_MAGNET_COLUMNS))
    for a, amb in enumerate(machine.ambs):
        magnet[a, L.AMB_STIFFNESS] = float(amb.stiffness)
        magnet[a, L.AMB_DAMPING] = float(amb.damping)
    lift = np.zeros(fe.mass.shape[0])
    lift[0::2] = 1.0
    ball_cos, ball_sin, ball_weight = _ball_arrays([bearing_constants(b.bearing) for b in bearings])
    unbalance_cos, unbalance_sin = _unbalance(machine, basis)
    return KernelParameters(
        eigenvalue=np.ascontiguousarray(basis.eigenvalues, dtype=np.float64),
        damping=np.ascontiguousarray(np.diag(basis.damping), dtype=np.float64),
        polar=np.ascontiguousarray(basis.polar, dtype=np.float64).reshape(m, m),
        gravity=-float(machine.gravity) * (basis.shapes.T @ (fe.mass @ lift)),
        unbalance_cos=unbalance_cos,
        unbalance_sin=unbalance_sin,
        bearing_shape=_rows(basis, [b.node for b in bearings]),
        bearing=_bearing_rows(machine, shares),
        ball_cos=ball_cos,
        ball_sin=ball_sin,
        ball_weight=ball_weight,
        magnet_shape=_rows(basis, [amb.node for amb in machine.ambs]),
        magnet=magnet,
        spin=_spin(machine, fe),
        flags=np.array([aerodynamics.OFF, 0], dtype=np.int64),
    )


def _with_machine(model: DropModel, machine: Machine) -> KernelParameters:
    bearings = machine.touchdown_bearings
    ball_cos, ball_sin, ball_weight = _ball_arrays([bearing_constants(b.bearing) for b in bearings])
    unbalance_cos, unbalance_sin = _unbalance(machine, model.basis)
    spin = _spin(machine, model.fe)
    return model.parameters._replace(
        bearing=_bearing_rows(machine, model.load_shares),
        ball_cos=ball_cos,
        ball_sin=ball_sin,
        ball_weight=ball_weight,
        unbalance_cos=unbalance_cos,
        unbalance_sin=unbalance_sin,
        spin=spin,
    )


def _spin(machine: Machine, fe: RotorFE) -> Array:
    spin = np.zeros(L.N_SPIN_ENTRIES)
    spin[L.POLAR_INERTIA] = fe.polar_inertia
    speed = machine.speed
    spin[L.AERO_TIME_CONSTANT] = (
        np.inf if speed.aero_time_constant is None else float(speed.aero_time_constant)
    )
    # The machine file gives torques, the kernel wants them per polar inertia.
    spin[L.AERO_LINEAR] = float(speed.aero_linear or 0.0) / fe.polar_inertia
    spin[L.AERO_QUADRATIC] = float(speed.aero_quadratic or 0.0) / fe.polar_inertia
    return spin


def _unbalance(machine: Machine, basis: RotorBasis) -> tuple[Array, Array]:
    """Modal unbalance vectors; the phase is measured from +y, so 90° is added to get it from +x."""
    cosine = np.zeros(basis.shapes.shape[1])
    sine = np.zeros_like(cosine)
    for unbalance in machine.unbalances:
        angle = float(unbalance.phase) + 0.5 * math.pi
        row = basis.node_row(unbalance.node)
        cosine += float(unbalance.amount) * math.cos(angle) * row
        sine += float(unbalance.amount) * math.sin(angle) * row
    return cosine, sine


def _ball_arrays(constants: list[BearingConstants]) -> tuple[Array, Array, Array]:
    """Directions of the balls, rows that coincide merged by weight, padded to whole lanes."""
    entries = [_merged_angles(c) for c in constants]
    longest = max((len(angles) for angles, _ in entries), default=0)
    width = LANES * max(1, -(-longest // LANES))
    cosine = np.ones((len(entries), width))
    sine = np.zeros((len(entries), width))
    weight = np.zeros((len(entries), width))
    for b, (angles, counts) in enumerate(entries):
        cosine[b, : len(angles)] = np.cos(angles)
        sine[b, : len(angles)] = np.sin(angles)
        weight[b, : len(angles)] = counts
    return cosine, sine, weight


def _merged_angles(constants: BearingConstants) -> tuple[Array, Array]:
    first = np.asarray(constants.ball_angles, dtype=np.float64)
    if len(constants.axial_signs) == 1:
        return first, np.ones(len(first))
    if constants.second_row_offset == 0.0:
        return first, np.full(len(first), float(len(constants.axial_signs)))
    shift = constants.second_row_offset * 2.0 * math.pi / len(first)
    both = np.concatenate([first, first + shift])
    return both, np.ones(len(both))


def _bearing_rows(machine: Machine, shares: Array) -> Array:
    rows = np.array([bearing_row(b, w) for b, w in zip(machine.touchdown_bearings, shares, strict=True)])
    for row, bearing in zip(rows, machine.touchdown_bearings, strict=True):
        # Preloaded balls give way to the weight of the race by nanometres; loose ones let it fall.
        if not bearing_constants(bearing.bearing).preloaded:
            row[L.RACE_WEIGHT] = row[L.RACE_MASS] * float(machine.gravity)
    return rows


def bearing_row(bearing: TouchdownBearing, static_load: float) -> Array:
    """One row of `KernelParameters.bearing` [SI], with the bearing damping from the tangent stiffness at a
    load [N].
    """
    constants = bearing_constants(bearing.bearing)
    row = np.zeros(L.N_BEARING_COLUMNS)
    gap = float(bearing.air_gap)
    row[L.AIR_GAP] = gap
    row[L.BORE_RADIUS] = float(bearing.bore_radius)
    row[L.ROTOR_RADIUS] = float(bearing.bore_radius) - gap
    row[L.CONTACT_STIFFNESS] = float(bearing.contact.stiffness)
    row[L.CONTACT_EXPONENT] = float(bearing.contact.exponent)
    row[L.CONTACT_DAMPING] = float(bearing.contact.damping)
    row[L.FRICTION_STATIC] = float(bearing.friction.static)
    row[L.FRICTION_DYNAMIC] = float(bearing.friction.dynamic)
    row[L.STRIBECK_SPEED] = float(bearing.friction.stribeck_speed)
    row[L.SMOOTHING_SPEED] = float(bearing.friction.smoothing_speed)
    row[L.RACE_MASS] = float(bearing.race.mass)
    row[L.RACE_INERTIA] = float(bearing.race.inertia)
    row[L.DRAG_COEFFICIENT] = float(bearing.race.drag_coefficient)
    row[L.DRAG_SPEED] = float(bearing.race.drag_speed)
    row[L.PITCH_DIAMETER] = float(bearing.bearing.pitch_diameter)
    row[L.BALL_STIFFNESS] = constants.ball_stiffness
    row[L.GROOVE_DISTANCE] = constants.groove_distance
    row[L.RADIAL_OFFSET] = constants.radial_offset
    row[L.AXIAL_OFFSET] = constants.axial_offset
    row[L.STRESS_COEFFICIENT] = constants.stress_coefficient_inner
    row[L.BEARING_DAMPING] = float(bearing.damping_time) * static_bearing_stiffness(constants, static_load)
    support = bearing.support
    row[L.SUPPORT_MASS_X] = float(support.mass_horizontal)
    row[L.SUPPORT_MASS_Y] = float(support.mass)
    row[L.SUPPORT_STIFFNESS_X] = float(support.stiffness_horizontal)
    row[L.SUPPORT_STIFFNESS_Y] = float(support.stiffness)
    row[L.SUPPORT_DAMPING_X] = float(support.damping_horizontal)
    row[L.SUPPORT_DAMPING_Y] = float(support.damping)
    return row


def static_deflection(constants: BearingConstants, load: float) -> tuple[float, float]:
    """Downward deflection [m] of the race under a vertical load [N], and tangent stiffness there [N/m]."""
    geometry = _ball_geometry(constants)
    if not constants.preloaded:
        return _loose_deflection(constants, geometry, load)
    dy = 0.0
    for _ in range(50):
        _, force, _, _, stiffness = planar_ball_gradient(0.0, dy, *geometry)
        step = (-load - force) / stiffness
        dy += step
        if abs(step) < 1e-18:
            break
    return -dy, float(planar_ball_gradient(0.0, dy, *geometry)[4])


def loose_race_seat(constants: BearingConstants, load: float) -> tuple[float, float]:
    """Where a race without preload comes to rest on its balls under a downward load [N]: x and y [m].

    The lowest energy; the race rolls sideways into the gap of its lowest balls wherever the first one stands.
    """
    return _loose_seat(constants, _ball_geometry(constants), load)


def _loose_deflection(
    constants: BearingConstants, geometry: tuple[Any, ...], load: float
) -> tuple[float, float]:
    if load == 0.0:
        return constants.radial_play, 0.0
    dx, dy = _loose_seat(constants, geometry, load)
    _, _, k_xx, k_xy, k_yy = planar_ball_gradient(dx, dy, *geometry)
    # The race is free to give way sideways; on a single ball nothing holds it there, and nothing couples.
    aside = k_xy * k_xy / k_xx if k_xx > LEAST_DAMPING * k_yy else 0.0
    return -dy, float(k_yy - aside)


def _loose_seat(constants: BearingConstants, geometry: tuple[Any, ...], load: float) -> tuple[float, float]:
    """Newton steps on the convex energy of the balls and the load, damped until it falls."""
    single = (abs(load) / constants.ball_stiffness) ** (2.0 / 3.0)
    # Deep enough for the two lowest balls of any bearing (three balls: twice the play) to be loaded at once.
    at = np.array([0.0, -math.copysign(2.0 * constants.radial_play + 4.0 * single, load)])

    def energy_at(place: Array) -> float:
        return float(planar_ball_energy(place[0], place[1], *geometry)) + load * float(place[1])

    # The spring of one loaded ball: the size of stiffness a step is damped with.
    spring = 1.5 * abs(load) / single
    damping, energy = LEAST_DAMPING, energy_at(at)
    for _ in range(200):
        f_x, f_y, k_xx, k_xy, k_yy = planar_ball_gradient(at[0], at[1], *geometry)
        left = np.array([-f_x, -load - f_y])
        if np.hypot(*left) <= 1e-13 * abs(load):
            break
        tangent = np.array([[k_xx, k_xy], [k_xy, k_yy]]) + damping * spring * np.eye(2)
        trial = at + np.linalg.solve(tangent, left)
        if energy_at(trial) <= energy + 1e-13 * abs(load * at[1]):
            at, energy, damping = trial, energy_at(trial), max(0.1 * damping, LEAST_DAMPING)
        else:
            damping = max(4.0 * damping, 1e-3)
    return float(at[0]), float(at[1])


def _ball_geometry(constants: BearingConstants) -> tuple[Any, ...]:
    """What the planar kernels take after the displacement."""
    cosine, sine, weight = (array[0] for array in _ball_arrays([constants]))
    offsets = (constants.radial_offset, constants.axial_offset, constants.groove_distance)
    return (*offsets, constants.ball_stiffness, cosine, sine, weight)


def static_bearing_stiffness(constants: BearingConstants, load: float) -> float:
    """Tangent radial stiffness [N/m] of the ball set at the deflection of a static load [N] downwards."""
    return static_deflection(constants, load)[1]
