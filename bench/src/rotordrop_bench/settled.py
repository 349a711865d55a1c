"""Where the rotor lies after the drop, at standstill, and the small swing it keeps."""

from __future__ import annotations

import math

import numpy as np

from rotordrop.arrays import Array, Integers
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.errors import SimulationError
from rotordrop.physics import columns as L
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.load import load_now
from rotordrop.physics.pendulum import small_frequency
from rotordrop.rotor.parameters import DropModel, sag_of_model
from rotordrop.simulate._histories import stored_energy
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop.simulate.levitation import rigid_amplitudes
from rotordrop_bench import departing as D
from rotordrop_bench.departing import STATES_AT, DepartingParameters, departing, departures_in

MOST_ITERATIONS = 100
SMALLEST_CHANGE = 1e-15
LONG_AFTER = 1e9
"""Time [s] at which all that drifts has come to its end."""
DIFFERENCE = 1e-9
"""Step of the difference quotients [√kg m, m]; small against every indentation."""
LEAST_DAMPING = 1e-6
"""Damping of the steps that is always there [weight over gap], for a direction in which nothing holds."""


def settled_coordinates(model: DropModel, angle: float = 0.0) -> Array:
    """Coordinates (modal amplitudes, races, supports), shape (n_q,), of the rotor at rest in its bearings.

    The lowest energy near the rotor lying straight down, by Newton steps damped until the energy falls. Of a
    machine that departs from its model the one nearest to that: slip in a support has crept to nothing, the
    cage stands where it stood. The rotor stands at an angle [rad].
    """
    parameters, layout, rows = without_magnets(model), model.layout, departures_in(model)
    n_q, departs = layout.n_coordinates, len(rows) > 0
    if departs:
        state, parameters = layout.zeros(), _on_one_place_of_sleeves(parameters, angle)
        at, mass, start = _departing_start(model)
    else:
        state = model.at_rest()
        state[layout.modal_y] = _guess(model)
        at, mass, start = np.arange(n_q), _masses(model), state[:n_q].copy()
    state[layout.rotor_angle] = angle
    velocities = np.where(at < n_q, at + n_q, at + 2)
    work, form = scratch_of(parameters), parameters.form
    derivative, stored = form.of(drop_derivative), form.of(stored_energy)

    def completed(place: Array) -> Array:
        whole = state.copy()
        whole[at] = place
        return whole

    def energy_at(place: Array) -> float:
        stands = float(stored(LONG_AFTER, completed(place), parameters, False))
        return stands - load_potential(model, place)

    def force_at(place: Array) -> Array:
        rates = layout.zeros()
        derivative(LONG_AFTER, completed(place), parameters, rates, work)
        return np.asarray(mass * rates[velocities])

    def stiffness_at(place: Array) -> Array:
        steps = DIFFERENCE * np.eye(len(place))
        found = np.array([(force_at(place - s) - force_at(place + s)) / (2.0 * DIFFERENCE) for s in steps])
        return np.asarray(0.5 * (found + found.T))

    # Damping by mass holds a step back by the energy it costs, so that no step needs a limit of its own: not
    # that of a heavy rotor, which sags far, nor one that nothing holds, as of a rotor just off its race.
    least = float(np.max(np.abs(parameters.gravity))) / float(np.max(np.abs(start)))
    place, energy = start, energy_at(start)
    rounding = 1e-12 * energy
    damping = LEAST_DAMPING * least
    for _ in range(MOST_ITERATIONS):
        step = np.linalg.solve(stiffness_at(place) + damping * np.diag(mass), force_at(place))
        tried = energy_at(place + step)
        if tried > energy + abs(rounding):
            damping = max(4.0 * damping, least)
            continue
        place, energy = place + step, tried
        moved = float(np.max(np.abs(step)))
        smallest = max(SMALLEST_CHANGE, 1e-12 * float(np.max(np.abs(place))))
        if damping <= LEAST_DAMPING * least and moved < smallest:
            return place[:n_q]
        damping = max(0.1 * damping, LEAST_DAMPING * least)
    raise SimulationError(
        f"no position of rest was found for the rotor of {model.machine.name!r} in {MOST_ITERATIONS} "
        f"iterations; the last step still moved it by {moved:.3g} √kg m. Check that its touchdown bearings "
        "carry it (rotordrop check shows the load shares)"
    )


def without_magnets(model: DropModel) -> KernelParameters:
    """Parameters of a machine whose magnets no longer act and whose rotor does not turn."""
    flags = np.zeros(L.N_FLAGS, dtype=np.int64)
    flags[L.LOADS_ACT] = model.parameters.flags[L.LOADS_ACT]
    return model.parameters._replace(flags=flags)


def _rigid(model: DropModel, ways: Array) -> Array:
    """Modal amplitudes of a rotor that moves rigidly by ways (B, k) [m] at its bearings, shape (m, k)."""
    nodes = np.array([bearing.node for bearing in model.machine.touchdown_bearings])
    return rigid_amplitudes(model, np.asarray(model.fe.node_positions)[nodes - 1], ways)


def load_potential(model: DropModel, coordinates: Array) -> float:
    """Work [J] that the loads have done on the way to a place of rest."""
    p, layout = model.parameters, model.layout
    work = 0.0
    for row, shape in zip(p.load, p.load_shape, strict=True):
        x, y = load_now(row, p.load_points, LONG_AFTER, 0.0)
        work += float(x * (shape @ coordinates[layout.modal_x]) + y * (shape @ coordinates[layout.modal_y]))
    return work


def _masses(model: DropModel) -> Array:
    """Mass behind each coordinate, shape (n_q,): 1 for modal amplitudes, [kg] for races and supports."""
    layout, bearing = model.layout, model.parameters.bearing
    mass = np.ones(layout.n_coordinates)
    mass[layout.race] = np.repeat(bearing[:, L.RACE_MASS], 2)
    mass[layout.support] = bearing[:, [L.SUPPORT_MASS_X, L.SUPPORT_MASS_Y]].ravel()
    return mass


def _on_one_place_of_sleeves(parameters: KernelParameters, angle: float) -> KernelParameters:
    """A rotor rests on one place of an oval sleeve, as it would on an eccentric one."""
    parameters = parameters._replace(bearing=parameters.bearing.copy())
    assert isinstance(parameters, DepartingParameters)
    for row in parameters.departure:
        if row[D.SLEEVE_OVAL] != 0.0:
            off_x, off_y, _, _ = D.sleeve(row, angle, 0.0, -1.0)
            row[[D.SLEEVE_OFF, D.SLEEVE_OVAL]] = math.hypot(off_x, off_y), 0.0
            row[D.SLEEVE_ANGLE] = math.atan2(off_y, off_x) - angle
    return parameters


def _departing_start(model: DropModel) -> tuple[Integers, Array, Array]:
    """Places in the state of what a departing machine comes to rest with, masses and a start."""
    p, n_q, rows = model.parameters, model.layout.n_coordinates, departures_in(model)
    found = _on_their_tables(model, settled_coordinates(departing(model, rows[:0])))
    entries = list(zip(range(n_q), _masses(model), found, strict=True))
    for b, row in enumerate(rows):
        first = p.bearing_at[b, STATES_AT]
        for mode, place in ((D.FOUNDATION_MODE, D.FOUNDATION), (D.TILT_MODE, D.TILT)):
            if (compliance := row[mode + D.COMPLIANCE]) > 0.0:
                entries += [(first + place + axis, 1.0 / compliance, 0.0) for axis in range(2)]
    at, mass, start = (np.array(column) for column in zip(*entries, strict=True))
    return at, mass, start


def _on_their_tables(model: DropModel, coordinates: Array) -> Array:
    """Rest of the model that does not depart, let down to where tables of balls carry its static loads.

    Within the play of a seat nothing holds a race: no step would lead out of it.
    """
    layout, rows = model.layout, departures_in(model)
    down = np.zeros(len(model.machine.touchdown_bearings))
    ways = (coordinates[layout.support] - coordinates[layout.race])[1::2]
    for b, load in enumerate(model.load_shares):
        if rows[b, D.LOOSE_WAY] > 0.0:
            places = np.linspace(0.0, rows[b, D.TABLE_WAY_STEP] * (D.TABLE_POINTS - 3), 10 * D.TABLE_POINTS)
            forces = [D.from_table(rows[b], D.TABLE_FORCE, way) for way in places]
            down[b] = max(np.interp(load, forces, places) - ways[b], 0.0)
    found = coordinates.copy()
    found[layout.race][1::2] -= down
    found[layout.modal_y] += _rigid(model, -down[:, None])[:, 0]
    return found


def _guess(model: DropModel) -> Array:
    """Straight rotor, pressed into the contacts by its weight, loose races at the end of their play."""
    p = model.parameters.bearing
    play = np.array([numbers_of(bearing).play for bearing in model.machine.touchdown_bearings])
    down = p[:, L.AIR_GAP] + sag_of_model(model).indentation + play
    return _rigid(model, -down[:, None])[:, 0]


def swinging_amplitudes(
    model: DropModel, coordinates: Array, amplitude: Array, phase: Array, decay_time: float, time: Array
) -> Array:
    """Modal amplitudes, shape (N, 2m), of a settled rotor whose ends swing like pendulums.

    Each with an amplitude and a phase (B,) [rad], which decay with a time constant [s].
    """
    layout = model.layout
    rest = coordinates[layout.modal_y]
    shape = model.parameters.bearing_shape
    depth, aside = np.abs(shape @ rest), np.zeros(len(shape))
    if len(model.parameters.load):  # the swing is about where the rotor lies, not about straight below
        across = shape @ coordinates[layout.modal_x]
        depth, aside = np.hypot(depth, across), np.arctan2(across, depth)
    decay = np.exp(-time / decay_time)[:, None]
    turn = 2.0 * np.pi * np.array([small_frequency(d, float(model.machine.gravity)) for d in depth])
    angle = amplitude * decay * np.cos(turn * time[:, None] + phase)
    per_end = _rigid(model, np.eye(len(shape)))
    x = coordinates[layout.modal_x] + (depth * (np.sin(aside + angle) - np.sin(aside))) @ per_end.T
    y = rest + (depth * (np.cos(aside) - np.cos(aside + angle))) @ per_end.T
    return np.hstack([x, y])
