"""Mounts, springs of preload and landing sleeves against closed forms."""

import math
from dataclasses import replace

import numpy as np
from cases import checks_of
from rigid_machine import disc_in, rigid_model
from scipy.integrate import solve_ivp

from rotordrop import DropCase, PlacedStart, simulate_drop
from rotordrop.elements.mount import Mount
from rotordrop.physics import columns as L
from rotordrop.physics import mount
from rotordrop.physics.ball_set import ball_set_gradient
from rotordrop.physics.ring import seat_on_springs
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop.simulate._sensitivity import drop_jacobian


def numbers_of(**elements):
    """The numbers of a mount of described elements, given in SI units."""
    row = np.zeros(L.N_BEARING_COLUMNS)
    Mount.model_validate(elements).fill(row)
    return row[L.MOUNT : L.MOUNT_END]


def cycle(inputs):
    """The second cycle of a harmonic deflection along a slant: loss, and what is in phase with it."""
    ribbon = {
        "friction_stiffness": f"{inputs['k_d']!r} N/m",
        "slip_force": f"{inputs['slip_force']!r} N",
        "sharpness": inputs["sharpness"],
    }
    numbers, X = numbers_of(ribbon=ribbon), inputs["amplitude"]
    along = np.array([0.6, 0.8])

    def motion(t, e):
        rate, v = np.zeros(2), X * np.cos(t) * along
        x = X * np.sin(t) * along
        mount.mount_force(numbers, x[0], x[1], v[0], v[1], e, rate)
        return rate

    end = 4.0 * np.pi
    t = np.linspace(0.5 * end, end, 20001)
    path = solve_ivp(motion, (0.0, end), np.zeros(2), t_eval=t, rtol=1e-8, atol=1e-13, max_step=2e-3).y
    force = inputs["k_1"] * X * np.sin(t) + inputs["k_d"] * along @ path
    return {
        "loss of a cycle": float(np.trapezoid(force * X * np.cos(t), t)),
        "harmonic stiffness": float(np.trapezoid(force * np.sin(t), t) / (np.pi * X)),
    }


def branches(inputs):
    """The answer of the states to a harmonic deflection, from their rates as the filter sees them."""
    elements = [
        {"stiffness": f"{k!r} N/m", "time": f"{tau!r} s"}
        for k, tau in zip(inputs["stiffness"], inputs["time"], strict=True)
    ]
    numbers, none = numbers_of(maxwell=elements), np.zeros(2 * len(elements))

    def answer(velocity, stretch):
        rate = np.zeros_like(stretch)
        return mount.mount_force(numbers, 0.0, 0.0, velocity, 0.0, stretch, rate)[0], rate

    def dynamic(frequency):
        total, omega = complex(inputs["k_0"]), 2.0 * np.pi * frequency
        for state in range(0, 2 * len(elements), 2):
            stiffness, relaxing = answer(0.0, np.eye(len(none))[state])
            stretch = answer(1.0, none)[1][state] * 1j * omega / (1j * omega - relaxing[state])
            total += stiffness * stretch
        return total

    middle = dynamic(100.0)
    return {
        "stiffness at 5 Hz": dynamic(5.0).real,
        "stiffness at 1 kHz": dynamic(1000.0).real,
        "loss factor at 100 Hz": middle.imag / middle.real,
    }


def caught(inputs, stop):
    """Peak force under a mass that falls onto the mount, by integration."""
    numbers = numbers_of(
        **(
            {
                "stop": {
                    "gap": f"{inputs['stop_gap']!r} m",
                    "stiffness": f"{inputs['stop_stiffness']!r} N/m",
                    "damping": "0 s/m",
                }
            }
            if stop
            else {}
        )
    )
    none = np.zeros(0)

    def held(y, v):
        return inputs["k"] * y + mount.mount_force(numbers, 0.0, y, 0.0, v, none, none)[1]

    def motion(_t, state):
        return [state[1], inputs["g"] - held(*state) / inputs["m"]]

    start = [0.0, np.sqrt(2.0 * inputs["g"] * inputs["height"])]
    path = solve_ivp(motion, (0.0, 0.03), start, method="DOP853", rtol=1e-10, atol=1e-14, max_step=1e-5).y
    return max(held(y, v) for y, v in path.T)


def stopped(inputs):
    return {
        "peak force without a stop": caught(inputs, stop=False),
        "peak force with the stop": caught(inputs, stop=True),
    }


FREE = 'preload_kind = "spring", spring_rate = "1 N/m", fit_friction = 0.0, ring_travel = "1 mm", '


def model_of(v, springs=""):
    """A rigid rotor in one pair, whose first ball stands on the line of the load."""
    pair = f"""
[[touchdown_bearings]]
name = "A"
node = 2
air_gap = "{v["gap"]} m"
bore_radius = "40 mm"
bearing = {{ {springs}ball_diameter = "{v["ball_diameter"]} m", ball_count = {v["balls"]}, \
pitch_diameter = "{v["pitch_diameter"]} m", contact_angle = "25 deg", preload = "{v["preload"]} N", \
conformity = {v["conformity"]}, first_ball_angle = "180 deg" }}
contact = {{ stiffness = "{v["contact"]} N/m^1.111", exponent = {10.0 / 9.0!r}, damping = "0 s/m" }}
friction = {{ static = 0.0, dynamic = 0.0 }}
race = {{ mass = "{v["race_mass"]} kg", inertia = "4e-4 kg m^2", drag_coefficient = 0.0 }}
support = {{ mass = "{v["support_mass"]} kg", stiffness = "{v["support_stiffness"]} N/m", \
damping_ratio = {v["support_damping_ratio"]} }}
"""
    model = disc_in(pair, v["m"], v["g"])
    bearing = model.parameters.bearing.copy()
    bearing[:, L.BEARING_DAMPING] = v["race_damping"]
    bearing[:, L.LINES] = 0.0  # rings follow freely
    return replace(model, parameters=model.parameters._replace(bearing=bearing))


def pushed(v):
    """Force against a push, with rings held and with rings that springs of a constant force follow."""
    p = model_of(v).parameters
    entries = p.bearing[0, L.BALL_SET : L.BALL_SET_END]
    held = -ball_set_gradient(entries, p.balls[0], 0.0, -v["push"])[1]
    (sprung,) = model_of(v, FREE).machine.touchdown_bearings
    numbers = sprung.bearing.numbers()
    low, high = 0.0, held
    for _ in range(60):
        middle = 0.5 * (low + high)
        seat = seat_on_springs(numbers.constants, numbers.rings(), np.array([[0.0, middle]]))[0]
        low, high = (middle, high) if -seat[1] < v["push"] else (low, middle)
    return {"force with rigid spacers": held, "force with springs": middle}


def impact(v):
    """Contact force and stress of the first impact."""
    light = f'{FREE}ring_mass = "{v["ring_mass"]} kg", '
    found = {}
    for kind, springs in (("rigid spacers", ""), ("springs", light)):
        case = DropCase(speed=0.0, duration=v["duration"], output_step=1e-6, tolerance=1e-8, spin="constant")
        result = simulate_drop(model_of(v, springs), case)
        found[f"peak contact force with {kind}"] = float(np.max(result.contact_force))
        found[f"peak stress with {kind}"] = float(np.max(result.max_stress))
    return found


STEPS = 20


def sleeved(v):
    """A rigid rotor in one sleeve on a support as good as rigid."""
    sleeve = f"""
[[touchdown_bearings]]
kind = "sleeve"
name = "A"
node = 2
air_gap = "{v["gap"]} m"
bore_radius = "{v["radius"] + v["gap"]!r} m"
contact = {{ stiffness = "{v["contact"]} N/m^1", exponent = 1.0, damping = "0 s/m" }}
friction = {{ static = {v["mu"]}, dynamic = {v["mu"]} }}
support = {{ mass = "1e6 kg", stiffness = "1e14 N/m", damping = "0 N s/m" }}
"""
    return disc_in(sleeve, v["m"], v["g"], v["speed"], (v["polar_inertia"], 1))


def sliding(v):
    """Mean angle and force, and the torque by which the speed falls."""
    phi, weight = math.atan(v["mu"]), v["m"] * v["g"]
    radius = v["gap"] + weight * math.cos(phi) / v["contact"]
    place = radius * np.array([[-math.sin(phi), -math.cos(phi)]])
    start = PlacedStart(displacement=place, velocity=np.zeros((1, 2)))
    omega, duration = 2.0 * math.pi * v["speed"], 0.1
    case = DropCase(speed=omega, duration=duration, tolerance=1e-9, spin="coasting", start=start)
    drop = simulate_drop(sleeved(v), case)
    x, y = drop.displacement[:, 0].T
    torque = v["polar_inertia"] * (drop.speed[0] - drop.speed[-1]) / drop.time[-1]
    return {
        "angle against the motion": float(np.degrees(np.mean(np.arctan2(-x, -y)))),
        "normal force": float(np.mean(drop.contact_force)),
        "friction torque": float(torque),
        "time to standstill": float(v["polar_inertia"] * omega / torque),
    }


def resting(v):
    """Place of the rotor at rest, and the torque that its contact force is about its axis."""
    stiff = {"n": 1.0, "lam": 0.0, "ms": 1.0, "Ks": 1e13, "Cs": 0.0}
    amounts = f'eccentricity = "{v["eccentricity"]} m", oval = "{v["oval"]} m"'
    phases = f'eccentricity_phase = "{v["eccentricity_phase"]} rad", oval_phase = "{v["oval_phase"]} rad"'
    model = rigid_model(stiff | v, more=f"landing_sleeve = {{ {amounts}, {phases} }}")
    layout, state = model.layout, model.layout.zeros()
    shape = model.parameters.bearing_shape[0]
    state[layout.modal_y] = -(v["c"] + v["m"] * v["g"] / v["K"]) * shape / (shape @ shape)
    state[layout.rotor_angle] = v["angle"]
    p, n_q = model.parameters, layout.n_coordinates
    rates, slopes = layout.zeros(), np.zeros((layout.n_dynamic, layout.n_dynamic))
    for _ in range(STEPS):  # of Newton's; nothing holds the tilt of the rotor, which stays zero
        drop_derivative(0.0, state, p, rates, scratch_of(p))
        drop_jacobian(0.0, state, p, slopes)
        stiffness = slopes[n_q : 2 * n_q, :n_q]
        state[:n_q] -= np.linalg.lstsq(stiffness, rates[n_q : 2 * n_q], rcond=1e-14)[0]
    x, y = (model.parameters.bearing_shape[0] @ state[part] for part in (layout.modal_x, layout.modal_y))
    return {
        "place across": 1e6 * float(x),
        "place along": 1e6 * float(y),
        "torque": 1e3 * model.fe.polar_inertia * float(rates[layout.rotor_speed]),
    }


CASES = {
    "MT01": cycle,
    "MT02": branches,
    "MT03": stopped,
    "PL01": pushed,
    "PL02": impact,
    "SL01": sliding,
    "LS01": resting,
}

test_case, test_a_changed_input_is_noticed = checks_of(CASES)
