"""From the description of a machine to the flat arrays the compiled drop model works on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.race_bearing import numbers_of, places_of
from rotordrop.elements.support import foundation_states, support_sag
from rotordrop.machine import Machine, TouchdownBearing
from rotordrop.physics import aerodynamics
from rotordrop.physics import columns as L
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.contact import depth_at
from rotordrop.physics.elementary import sine_cosine
from rotordrop.physics.linear_algebra import product
from rotordrop.rotor.assembly import RotorFE, build_rotor_fe
from rotordrop.rotor.layout import StateLayout
from rotordrop.rotor.reduction import Reduction, RotorBasis, reduce_rotor
from rotordrop.rotor.statics import bearing_load_shares

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class DropModel:
    """A machine made ready for the time loop: finite elements, reduced basis, kernel arrays, state layout."""

    machine: Machine
    fe: RotorFE
    basis: RotorBasis
    parameters: KernelParameters
    layout: StateLayout
    load_shares: Array

    def with_values(self, values: Mapping[str, float]) -> DropModel:
        """The same model with other parameter values, by path such as ``"NDE.support.stiffness"`` (SI).

        Only what changes is computed again; the rotor and its basis are kept.
        """
        return self.with_machine(self.machine.with_values(values))

    def with_machine(self, machine: Machine) -> DropModel:
        """The same model of a machine with the same rotor and other bearings or values."""
        return replace(self, machine=machine, parameters=_with_machine(self, machine))

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
    further = tuple(foundation_states(bearing) for bearing in machine.touchdown_bearings)
    layout = StateLayout(
        n_modes=basis.shapes.shape[1],
        n_bearings=len(nodes),
        bearing_own=further if any(further) else (),
        sensor_own=sum(sensor.time_constant is not None for sensor in machine.sensors),
    )
    return DropModel(
        machine=machine,
        fe=fe,
        basis=basis,
        parameters=_kernel_parameters(machine, fe, basis, shares, layout),
        layout=layout,
        load_shares=shares,
    )


def _rows(basis: RotorBasis, nodes: list[int]) -> Array:
    if not nodes:
        return np.zeros((0, basis.shapes.shape[1]))
    return np.ascontiguousarray([basis.node_row(node) for node in nodes], dtype=np.float64)


def _kernel_parameters(
    machine: Machine, fe: RotorFE, basis: RotorBasis, shares: Array, layout: StateLayout
) -> KernelParameters:
    m = basis.shapes.shape[1]
    bearings = machine.touchdown_bearings
    magnet = np.zeros((len(machine.ambs), L.N_MAGNET_COLUMNS))
    for a, amb in enumerate(machine.ambs):
        magnet[a, L.AMB_STIFFNESS] = float(amb.stiffness)
        magnet[a, L.AMB_DAMPING] = float(amb.damping)
    lift = np.zeros(fe.mass.shape[0])
    lift[0::2] = 1.0
    unbalance_cos, unbalance_sin = _unbalance(machine, basis)
    return KernelParameters(
        eigenvalue=np.ascontiguousarray(basis.eigenvalues, dtype=np.float64),
        damping=np.ascontiguousarray(np.diag(basis.damping), dtype=np.float64),
        polar=np.ascontiguousarray(basis.polar, dtype=np.float64).reshape(m, m),
        gravity=-float(machine.gravity) * (product(basis.shapes.T, product(fe.mass, lift))),
        unbalance_cos=unbalance_cos,
        unbalance_sin=unbalance_sin,
        bearing_shape=_rows(basis, [b.node for b in bearings]),
        bearing=_bearing_rows(machine, shares),
        balls=places_of([numbers_of(b) for b in bearings]),
        magnet_shape=_rows(basis, [amb.node for amb in machine.ambs]),
        magnet=magnet,
        spin=_spin(machine, fe),
        flags=np.array([aerodynamics.OFF, 0], dtype=np.int64),
        rotor_at=layout.rotor_at(),
        bearing_at=layout.bearing_at(),
        contact_at=layout.contact_at(),
        magnet_at=layout.magnet_at(len(machine.ambs)),
        memory=np.zeros(0),
    )


def _with_machine(model: DropModel, machine: Machine) -> KernelParameters:
    bearings = machine.touchdown_bearings
    unbalance_cos, unbalance_sin = _unbalance(machine, model.basis)
    spin = _spin(machine, model.fe)
    return model.parameters._replace(
        bearing=_bearing_rows(machine, model.load_shares),
        balls=places_of([numbers_of(b) for b in bearings]),
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
        s, c = sine_cosine(angle)
        cosine += float(unbalance.amount) * c * row
        sine += float(unbalance.amount) * s * row
    return cosine, sine


def _bearing_rows(machine: Machine, shares: Array) -> Array:
    rows = np.array([bearing_row(b, w) for b, w in zip(machine.touchdown_bearings, shares, strict=True)])
    for row, bearing in zip(rows, machine.touchdown_bearings, strict=True):
        # A held race gives way to its own weight by nanometres; a loose one falls.
        if not numbers_of(bearing).held:
            row[L.RACE_WEIGHT] = row[L.RACE_MASS] * float(machine.gravity)
    return rows


def bearing_row(bearing: TouchdownBearing, static_load: float) -> Array:
    """One row of `KernelParameters.bearing` [SI], with the bearing damping from the tangent stiffness at a
    load [N].
    """
    numbers = numbers_of(bearing)
    row = np.zeros(L.N_BEARING_COLUMNS)
    gap = float(bearing.air_gap)
    row[L.AIR_GAP] = gap
    row[L.BORE_RADIUS] = float(bearing.bore_radius)
    row[L.ROTOR_RADIUS] = float(bearing.bore_radius) - gap
    row[L.BALL_SET : L.BALL_SET_END] = numbers.entries()
    row[L.PITCH_DIAMETER] = numbers.drag_diameter
    row[L.BEARING_DAMPING] = float(bearing.damping_time) * numbers.tangent_stiffness(static_load)
    for part in (bearing.contact, bearing.friction, bearing.race, bearing.support):
        part.fill(row)
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
    pairs = zip(bearings, loads, strict=True)
    return np.array([numbers_of(b).deflection(float(load))[0] for b, load in pairs])


def static_sag(rows: Array, race: Array, loads: Array) -> StaticSag:
    """Sag under static loads.

    Parameters
    ----------
    rows : ndarray, shape (B, columns)
        Bearing parameters, columns of `rotordrop.physics.columns`.
    race : ndarray, shape (B,)
        From `race_sag` [m].
    loads : ndarray, shape (B,)
        Static load of each bearing [N].
    """
    laws = rows[:, L.CONTACT : L.CONTACT_END]
    indentation = np.array([depth_at(law, float(load)) for law, load in zip(laws, loads, strict=True)])
    support = np.array([support_sag(row, float(load)) for row, load in zip(rows, loads, strict=True)])
    return StaticSag(indentation=indentation, race=race, support=support)


def sag_of_model(model: DropModel) -> StaticSag:
    """Sag of a model's rotor under its static load shares."""
    loads = np.asarray(model.load_shares)
    return static_sag(model.parameters.bearing, race_sag(model.machine.touchdown_bearings, loads), loads)
