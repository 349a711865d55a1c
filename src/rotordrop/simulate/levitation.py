"""The rotor before the drop: floating in its AMBs, and other ways to set the start state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import SimulationError
from rotordrop.physics import aerodynamics
from rotordrop.physics import columns as L
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import cos_each, sin_each
from rotordrop.physics.linear_algebra import least_squares, product, solve
from rotordrop.physics.load import load_now
from rotordrop.require import numbers
from rotordrop.rotor.parameters import FASTEST, DropModel, pushes
from rotordrop.simulate.case import CentredStart, LevitatedStart, PlacedStart, Simulated, StateStart
from rotordrop.simulate.magnets import start_loop, with_springs_of
from rotordrop.units import format_quantity

DEEPEST = 1.1
"""Distance over the air gap up to which a rotor starts [1], pressed into a race as by an impact;
beyond it a unit is mistyped (chosen)."""

_SPIN_MODES = {
    "dynamic": aerodynamics.EXPONENTIAL_IN_TIME,
    "prescribed": aerodynamics.PRESCRIBED_SPEED,
    "function of speed": aerodynamics.FUNCTION_OF_SPEED,
    "coasting": aerodynamics.OFF,
    "constant": aerodynamics.PRESCRIBED_SPEED,
}


def start_of_drop(model: DropModel, case: Simulated) -> tuple[Array, KernelParameters]:
    """State at power-off, shape (n,), and the kernel parameters with what the case adds (speed mode,
    magnets).
    """
    looped = case.magnets is not None
    if looped != bool(model.layout.magnet_own):
        have, want = ("springs and dampers", "in the loop") if looped else ("in the loop", "no events")
        raise SimulationError(
            f"the model has its magnets {have} and the case {want}; build it with loops={looped}"
        )
    if looped and any(amb.stays_on for amb in model.machine.ambs):
        raise SimulationError(
            "the machine has a magnet that stays on, as a spring and a damper, and the case has magnets in "
            "the loop; say by an event which of them is switched off, or leave the events out"
        )
    if looped:
        model = with_springs_of(model, case)
    state, parameters = _started(model, case)
    if isinstance(case.start, LevitatedStart | PlacedStart):
        _refuse_depth(model, state)
    if looped:
        _static, holding = levitated_static(model, getattr(case.start, "offset", None), case.speed)
        parameters = start_loop(model, case, holding, state, parameters)
    return state, parameters


def _refuse_depth(model: DropModel, state: Array) -> None:
    """Refuse a rotor that starts deeper in a race than an impact drives it."""
    rows = model.parameters.bearing_shape
    away = np.hypot(rows @ state[model.layout.modal_x], rows @ state[model.layout.modal_y])
    for bearing, distance in zip(model.machine.touchdown_bearings, away, strict=True):
        gap = float(bearing.air_gap)
        if distance > DEEPEST * gap:
            begins, air = format_quantity(float(distance), "length"), format_quantity(gap, "length")
            raise SimulationError(
                f"the rotor starts {begins} from the centre of {bearing.name}, whose air gap is {air}; "
                "expected a start inside it. Give offset, orbit or displacement in metres"
            )


def _started(model: DropModel, case: Simulated) -> tuple[Array, KernelParameters]:
    """State and parameters of a start, before any loop of the magnets."""
    parameters = _with_spin(model.parameters, case)
    _refuse_overspeed(model, case.speed)
    start = case.start
    if not isinstance(start, LevitatedStart) and any(amb.stays_on for amb in model.machine.ambs):
        parameters = _with_magnets(parameters, LevitatedStart(), levitated_static(model, None, case.speed)[1])
    if isinstance(start, StateStart):
        given = numbers(start.state, "state, of another layout or reduction,", (model.layout.size,))
        return given.copy(), parameters
    state = model.at_rest()
    state[model.layout.rotor_speed] = case.speed
    if isinstance(start, CentredStart):
        return state, parameters
    if isinstance(start, PlacedStart):
        return _placed(model, start, state), parameters
    return _levitated(model, case.speed, start, state, parameters)


def _refuse_overspeed(model: DropModel, speed: float) -> None:
    """Refuse a speed [rad/s] beyond the table of balls with inertia."""
    most = FASTEST * float(model.machine.speed.nominal)
    if len(model.parameters.ball_table) and abs(speed) > most:
        shown = [format_quantity(one, "speed") for one in (abs(speed), most)]
        raise SimulationError(
            f"{shown[0]} is beyond the {shown[1]} up to which balls with inertia are tabulated, {FASTEST:g} "
            "times the nominal speed; raise speed.nominal, or leave out ball_inertia"
        )


def _with_spin(parameters: KernelParameters, case: Simulated) -> KernelParameters:
    spin = parameters.spin.copy()
    spin[L.INITIAL_SPEED] = case.speed
    if case.spin == "constant":
        spin[L.AERO_TIME_CONSTANT] = np.inf  # a prescribed profile that never falls
    # axial AMBs hold the rotor in the middle against what pushes at the beginning
    axial = parameters.load[parameters.load[:, L.LOAD_AXIAL] != 0.0]
    spin[L.AXIAL_HOLDING] = -sum(load_now(row, parameters.load_points, 0.0, case.speed)[0] for row in axial)
    flags = parameters.flags.copy()
    flags[L.SPIN_MODE] = _SPIN_MODES[case.spin]
    return parameters._replace(spin=spin, flags=flags)


def rigid_amplitudes(model: DropModel, positions: Array, values: Array) -> Array:
    """Amplitudes (m, 2) of the two rigid modes of a straight rotor through values (P, 2) at positions z (P,)
    [m].
    """
    line = np.column_stack([np.ones_like(positions), positions])
    coefficients = least_squares(line, values)
    z = np.asarray(model.fe.node_positions)
    shape = np.zeros((2 * len(z), 2))
    shape[0::2] = coefficients[0] + np.outer(z, coefficients[1])
    shape[1::2] = coefficients[1]
    return product(model.basis.shapes.T, product(model.fe.mass, shape))


def _placed(model: DropModel, start: PlacedStart, state: Array) -> Array:
    nodes = [bearing.node for bearing in model.machine.touchdown_bearings]
    positions = np.asarray(model.fe.node_positions)[np.array(nodes) - 1]
    layout = model.layout
    for values, x, y in (
        (start.displacement, layout.modal_x, layout.modal_y),
        (start.velocity, layout.velocity_of(layout.modal_x), layout.velocity_of(layout.modal_y)),
    ):
        given = numbers(values, "displacement or velocity of the start", (len(nodes), 2))
        amplitudes = rigid_amplitudes(model, positions, given)
        state[x], state[y] = amplitudes[:, 0], amplitudes[:, 1]
    return state


def levitated_orbit(
    model: DropModel, speed: float, orbit: NDArray[np.complex128] | None = None
) -> NDArray[np.complex128]:
    """Complex synchronous response (m, 2), in x and y: amplitudes are ``Re(q e^(jθ))`` at rotor angle θ.

    The response to the unbalance of the rotor in its AMBs (stiffness and damping in every direction alike);
    with a given orbit at the AMBs (A,) [m] the magnets also apply the synchronous forces it takes.
    """
    p = model.parameters
    m = p.eigenvalue.shape[0]
    square = speed * speed
    force = square * np.column_stack([p.unbalance_cos, p.unbalance_sin])
    dynamic = np.diag(p.eigenvalue) - square * np.eye(m) + square * p.polar
    damping = speed * np.diag(p.damping)
    if orbit is None:
        rows = p.magnet_shape.T
        dynamic += product(rows * p.magnet[:, L.AMB_STIFFNESS], p.magnet_shape)
        damping += speed * product(rows * p.magnet[:, L.AMB_DAMPING], p.magnet_shape)
        forward = _complex_solution(dynamic, damping, force)
    else:
        n_a = p.magnet_shape.shape[0]
        if np.shape(orbit) != (n_a,):
            raise SimulationError(
                f"the orbit has shape {np.shape(orbit)}; expected ({n_a},): "
                "one complex amplitude for each AMB."
            )
        given = np.asarray(orbit, dtype=np.complex128)
        held = np.block([[dynamic, -p.magnet_shape.T], [p.magnet_shape, np.zeros((n_a, n_a))]])
        turning = np.zeros_like(held)
        turning[:m, :m] = damping
        right = np.vstack([force, np.column_stack([given.real, given.imag])])
        forward = _complex_solution(held, turning, right)[:m]
    whole = np.empty((m, 2), dtype=np.complex128)
    whole.real, whole.imag = (
        np.column_stack([forward[:, 0], forward[:, 1]]),
        np.column_stack([forward[:, 1], -forward[:, 0]]),
    )
    return whole


def _complex_solution(real: Array, imaginary: Array, right: Array) -> Array:
    """Real and imaginary part (n, 2) of the solution of a complex system, given by its parts.

    In real numbers, because a product of complex ones is rounded otherwise where the processor fuses it.
    """
    system = np.block([[real, -imaginary], [imaginary, real]])
    return solve(system, np.concatenate([right[:, 0], right[:, 1]])).reshape(2, -1).T


def levitated_static(model: DropModel, offset: Array | None, speed: float = 0.0) -> tuple[Array, Array]:
    """Static amplitudes (m, 2) of the levitated rotor and the holding force of each AMB (A, 2) [N].

    Loads act as they do at power-off, at a speed [rad/s]. With integral action the controller holds the rotor
    at its reference in each AMB plane.
    """
    p = model.parameters
    n_a, m = p.magnet_shape.shape
    target = np.zeros((n_a, 2)) if offset is None else numbers(offset, "offset", (n_a, 2))
    load = pushes(p, speed)
    border = p.magnet_shape.T
    matrix = np.block([[np.diag(p.eigenvalue), -border], [p.magnet_shape, np.zeros((n_a, n_a))]])
    # rows of stiff modes are divided by their stiffness: its range would pass for a loss of rank
    size = np.concatenate([np.maximum(p.eigenvalue, 1.0), np.ones(n_a)])[:, None]
    solution = least_squares(matrix / size, np.vstack([load, target]) / size)
    return solution[:m], solution[m:]


def _levitated(
    model: DropModel, speed: float, start: LevitatedStart, state: Array, parameters: KernelParameters
) -> tuple[Array, KernelParameters]:
    n_a = parameters.magnet.shape[0]
    if n_a < 2:
        raise SimulationError(
            "a levitated start needs at least two radial AMBs; "
            f"the machine {model.machine.name!r} has {n_a}. "
            "Add [[amb]] entries with node, stiffness and damping, or use another start."
        )
    static, holding = levitated_static(model, start.offset, speed)
    orbit = np.zeros(static.shape, dtype=np.complex128)
    if speed != 0.0:
        orbit = levitated_orbit(model, speed, start.orbit)
    sine, cosine = sin_each(start.rotor_angle), cos_each(start.rotor_angle)
    position = static + (orbit.real * cosine - orbit.imag * sine)
    velocity = -speed * (orbit.real * sine + orbit.imag * cosine)
    layout = model.layout
    state[layout.modal_x], state[layout.modal_y] = position[:, 0], position[:, 1]
    state[layout.velocity_of(layout.modal_x)] = velocity[:, 0]
    state[layout.velocity_of(layout.modal_y)] = velocity[:, 1]
    state[layout.rotor_angle] = start.rotor_angle
    return state, _with_magnets(parameters, start, holding)


def _with_magnets(parameters: KernelParameters, start: LevitatedStart, holding: Array) -> KernelParameters:
    n_a = parameters.magnet.shape[0]
    magnet, spin, flags = parameters.magnet.copy(), parameters.spin.copy(), parameters.flags.copy()
    magnet[:, L.HOLDING_X : L.HOLDING_Y + 1] = holding
    if start.offset is not None:
        magnet[:, L.AMB_REFERENCE_X : L.AMB_REFERENCE_Y + 1] = start.offset
    if start.remanent_force is not None:
        force = numbers(start.remanent_force, "remanent_force", (n_a, 2))
        magnet[:, L.REMANENT_X : L.REMANENT_Y + 1] = force
    # a magnet that stays on has its whole force, and no remanent one beside it
    stays = magnet[:, L.AMB_STAYS] != 0.0
    magnet[stays, L.REMANENT_X : L.REMANENT_Y + 1] = 0.0
    spin[L.POWER_OFF_DELAY] = start.delay
    spin[L.REMANENCE_TIME_CONSTANT] = start.remanence_time_constant
    acts = start.delay > 0.0 or start.remanent_force is not None or bool(stays.any())
    flags[L.MAGNETS_ACT] = int(acts)
    return parameters._replace(magnet=magnet, spin=spin, flags=flags)
