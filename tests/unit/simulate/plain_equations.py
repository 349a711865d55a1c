"""The equations of motion once more, in plain numpy and straight from the description of the machine.

Slow, without any flat array of the kernel, ball by ball with the angles the paper prints; checks the compiled
right-hand side and the flattening of the parameters.
"""

import math

import numpy as np

from rotordrop.physics.ball_bearing import bearing_constants


def derivative(model, case, t, state):
    """Derivative of a state up to and including the rotor angle, for a rotor without magnets."""
    machine, basis, layout = model.machine, model.basis, model.layout
    m, bearings = layout.n_modes, machine.touchdown_bearings
    omega, angle = state[layout.rotor_speed], state[layout.rotor_angle]
    tau = float(machine.speed.aero_time_constant)
    air = -case.speed / tau * math.exp(-t / tau)
    rate = np.zeros(layout.rotor_angle + 1)
    rate[: layout.n_coordinates] = state[layout.n_coordinates : 2 * layout.n_coordinates]
    q = state[: 2 * m].reshape(2, m)
    v = rate[: 2 * m].reshape(2, m)
    force = np.zeros((2, m))
    torque = 0.0
    for b, bearing in enumerate(bearings):
        row = basis.node_row(bearing.node)
        torque += bearing_motion(model, b, row, q @ row, v @ row, state, rate, force)
    omega_dot = air + torque / model.fe.polar_inertia
    lift = np.zeros(len(basis.shapes))
    lift[0::2] = 1.0
    force[1] -= float(machine.gravity) * basis.shapes.T @ model.fe.mass @ lift
    for unbalance in machine.unbalances:
        a = angle + float(unbalance.phase) + math.pi / 2
        pull = np.array(
            [
                omega**2 * math.cos(a) + omega_dot * math.sin(a),
                omega**2 * math.sin(a) - omega_dot * math.cos(a),
            ]
        )
        force += float(unbalance.amount) * pull[:, None] * basis.node_row(unbalance.node)
    polar = basis.shapes.T @ model.fe.polar @ basis.shapes
    damping = np.diag(np.diag(basis.damping))
    force[0] -= polar @ (omega * v[1] + omega_dot * q[1])
    force[1] += polar @ (omega * v[0] + omega_dot * q[0])
    acceleration = force - q * basis.eigenvalues - v @ damping
    start = layout.n_coordinates
    rate[start : start + 2 * m] = acceleration.ravel()
    rate[layout.rotor_speed] = omega_dot
    rate[layout.rotor_angle] = omega
    return rate


def bearing_motion(model, b, row, place, velocity, state, rate, force):
    """Add what one bearing does to rotor, race and support; returns the torque on the rotor [N m]."""
    bearing, layout = model.machine.touchdown_bearings[b], model.layout
    race, support = layout.race.start + 2 * b, layout.support.start + 2 * b
    shift = layout.n_coordinates
    race_place, race_velocity = state[race : race + 2], state[race + shift : race + shift + 2]
    support_place, support_velocity = (
        state[support : support + 2],
        state[support + shift : support + shift + 2],
    )
    omega, omega_i = state[layout.rotor_speed], state[layout.race_spin][b]
    on_race, friction = contact(bearing, place - race_place, velocity - race_velocity, omega, omega_i)
    force -= on_race[:, None] * row
    balls = ball_force(bearing, race_place - support_place)
    stiffness = vertical_stiffness(bearing, model.load_shares[b])
    through = balls - float(bearing.damping_time) * stiffness * (race_velocity - support_velocity)
    s = bearing.support
    spring = np.array([float(s.stiffness_horizontal), float(s.stiffness)])
    damper = np.array([float(s.damping_horizontal), float(s.damping)])
    mass = np.array([float(s.mass_horizontal), float(s.mass)])
    rate[race + shift : race + shift + 2] = (on_race + through) / float(bearing.race.mass)
    rate[support + shift : support + shift + 2] = (
        -through - damper * support_velocity - spring * support_place
    ) / mass
    drag = (
        float(bearing.race.drag_coefficient)
        * np.linalg.norm(balls)
        * float(bearing.bearing.pitch_diameter)
        / 2
    )
    drag *= math.tanh(omega_i / float(bearing.race.drag_speed))
    bore = float(bearing.bore_radius)
    rate[layout.race_spin.start + b] = (friction * bore - drag) / float(bearing.race.inertia)
    return -friction * (bore - float(bearing.air_gap))


def contact(bearing, place, velocity, omega, omega_i):
    """Force of the rotor on the race [N] and friction force [N], positive if it drives the race."""
    radius = math.hypot(*place)
    depth = radius - float(bearing.air_gap)
    if depth <= 0.0:
        return np.zeros(2), 0.0
    phi = math.atan2(place[1], place[0])
    normal = np.array([math.cos(phi), math.sin(phi)])
    tangent = np.array([-math.sin(phi), math.cos(phi)])
    law = bearing.contact
    elastic = float(law.stiffness) * depth ** float(law.exponent)
    pressing = max(0.0, elastic * (1.0 + 1.5 * float(law.damping) * float(velocity @ normal)))
    bore = float(bearing.bore_radius)
    slip = float(velocity @ tangent) + omega * (bore - float(bearing.air_gap)) - omega_i * bore
    friction = coefficient(bearing.friction, slip) * pressing
    return pressing * normal + friction * tangent, friction


def coefficient(law, slip):
    """Stribeck coefficient with the sign of the slip; the cubic near zero from its conditions."""
    static, dynamic = float(law.static), float(law.dynamic)
    speed, smooth, decay = abs(slip), float(law.smoothing_speed), float(law.stribeck_speed)
    if speed >= smooth:
        value = dynamic + (static - dynamic) * math.exp(-(speed - smooth) / decay)
    else:
        slope = -(static - dynamic) / decay
        conditions = np.array([[smooth, smooth**3], [1.0, 3.0 * smooth**2]])
        first, third = np.linalg.solve(conditions, [static, slope])
        value = first * speed + third * speed**3
    return math.copysign(value, slip)


def ball_force(bearing, shift):
    """Elastic force of all balls on the race [N], ball by ball with its contact angle."""
    constants = bearing_constants(bearing.bearing)
    total = np.zeros(2)
    for angles in constants.row_ball_angles:
        for beta in angles:
            across = constants.radial_offset + shift[0] * math.cos(beta) + shift[1] * math.sin(beta)
            length = math.hypot(across, constants.axial_offset)
            squeeze = length - constants.groove_distance
            if squeeze <= 0.0:
                continue
            angle = math.atan(constants.axial_offset / across)
            load = constants.ball_stiffness * squeeze**1.5 * math.cos(angle)
            total -= load * np.array([math.cos(beta), math.sin(beta)])
    return total


def vertical_stiffness(bearing, weight):
    """Tangent stiffness [N/m] straight down under a weight [N], by bisection and a central difference."""
    low, high = 0.0, 50e-6
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (
            (low, middle) if ball_force(bearing, np.array([0.0, -middle]))[1] > weight else (middle, high)
        )
    step = 2e-9
    upper, lower = (ball_force(bearing, np.array([0.0, -low + s]))[1] for s in (step, -step))
    return float((lower - upper) / (2 * step))
