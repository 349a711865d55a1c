"""Contact, friction and whirl cases by the kernels with scipy's integrators; small drops by `simulate_drop`.

The integrators restart nothing: their steps are short enough for make and break of a contact whose force
starts at zero, and the times of make and break are the roots of the gap.
"""

import math

import numpy as np
import pytest
from cases import checks_of
from rigid_machine import rigid_model
from scipy.integrate import solve_ivp
from tests.reference import impact

from rotordrop import DropCase, PlacedStart, simulate_drop
from rotordrop.physics import whirl
from rotordrop.physics.friction import stribeck_coefficient
from rotordrop.physics.spin import surface_speed


def integrate(motion, start, end, events, max_step, method="DOP853"):
    return solve_ivp(
        motion,
        (0.0, end),
        np.array(start),
        method=method,
        events=events,
        max_step=max_step,
        rtol=1e-10,
        atol=1e-15,
        dense_output=True,
    )


def sphere_contact_points(inputs):
    """Simbody's own combination of two bodies and friction law around the library's normal force."""
    s_1, s_2 = (k ** (2 / 3) for k in inputs["stiffness_k"])
    d_1, d_2 = inputs["dissipation"]
    K = 4 / 3 * (s_1 * s_2 / (s_1 + s_2)) ** 1.5 * math.sqrt(inputs["radius"])
    lam = (d_1 * s_2 + d_2 * s_1) / (s_1 + s_2)
    mu_s, mu_d, mu_v = (
        2 * a * b / (a + b) for a, b in (inputs[f"mu_{kind}"] for kind in ("static", "dynamic", "viscous"))
    )

    def normal(rate):
        return impact.hunt_crossley_force(0.5, rate, K, 1.5, lam)

    def friction(slip):
        vr = slip / inputs["transition_velocity"]
        return normal(0.0) * (min(vr, 1) * (mu_d + 2 * (mu_s - mu_d) / (1 + vr**2)) + mu_v * abs(slip))

    return {
        "elastic force at depth 0.5": normal(0.0),
        "force at depth 0.5, approach 0.4 m/s": normal(0.4),
        "force at depth 0.5, separation 1.0 m/s (clamped >=0)": normal(-1.0),
        "friction force at slip 0.0005 m/s, depth 0.5": friction(0.0005),
        "friction force at slip 0.002 m/s, depth 0.5": friction(0.002),
        "friction force at slip 0.5 m/s, depth 0.5": friction(0.5),
    }


def restitution(inputs):
    """The integrated kernel; the closed form must agree with it too."""
    numbers = {}
    for a_v0 in inputs["a_v0"]:
        lam = a_v0 / inputs["v0"] / 1.5
        e = impact.strike(inputs["m"], inputs["K"], inputs["n"], lam, inputs["v0"])[1] / inputs["v0"]
        assert e == pytest.approx(impact.restitution(lam, inputs["v0"]), abs=1e-7)
        numbers[f"restitution at a*v0={a_v0}"] = e
    return numbers


def bouncing_ball(inputs):
    """One drop from each height, onto a ground that stands still, with the λ that asks for e at its speed."""
    e, g = inputs["e"], inputs["g"]
    heights, times = [inputs["h"]], []
    for _ in range(3):
        h = heights[-1]
        lam = impact.damping_for_restitution(e, math.sqrt(2 * g * h))
        ground = {"ms": 1e6, "Ks": 1e12, "Cs": 1e9}
        model = rigid_model({"m": 1.0, "c": h, "K": 1e15, "n": 1.0, "lam": lam, "g": g} | ground, link=1e15)
        case = DropCase(
            speed=0.0,
            duration=(1.1 + 2 * e) * impact.fall_time(h, g),
            output_step=1e-6,
            tolerance=1e-9,
            spin="constant",
        )
        result = simulate_drop(model, case)
        log = result.contacts
        if not times:
            times.append(float(log.start[0]))
        times.append(times[-1] + float(log.start[1] - log.start[0]))
        flight = (result.time > log.end[0]) & (result.time < log.start[1])
        heights.append(h + float(np.max(result.displacement[flight, 0, 1])))
    ratio = math.sqrt(heights[3] / heights[2])
    numbers = {
        "first impact time": times[0],
        "time to rest": times[3] + (times[3] - times[2]) * ratio / (1 - ratio),
    }
    numbers |= {f"impact time {k}": times[k - 1] for k in (2, 3, 4)}
    return numbers | {f"bounce height {k}": heights[k] for k in (1, 2, 3)}


def mass_caught_by_a_spring(inputs):
    """Drop of a rigid rotor of the case's mass; race and support stand as good as still."""
    values = {"m": inputs["m"], "c": inputs["gap"], "K": inputs["k"], "n": 1.0, "lam": 0.0, "g": inputs["g"]}
    model = rigid_model(values | {"ms": 2.0, "Ks": 1e9, "Cs": 4e4}, link=1e10)
    start = PlacedStart(displacement=np.zeros((1, 2)), velocity=np.array([[0.0, inputs["v0"]]]))
    case = DropCase(speed=0.0, duration=1.1, output_step=1e-3, start=start, tolerance=1e-9, spin="constant")
    result = simulate_drop(model, case)
    log, height = result.contacts, result.displacement[:, 0, 1]
    return {
        "time of first contact": float(log.start[0]),
        "time of lift-off": float(log.end[0]),
        "z at 1.0 s": float(height[1000]),
        "z at 1.1 s": float(height[1100]),
        "peak force": float(log.peak_force[0]),
    }


def friction_oscillator(inputs):
    m, k, mu, N = inputs["m"], inputs["k"], inputs["mu"], inputs["N"]

    def motion(_, state):
        friction = N * stribeck_coefficient(state[1], mu, mu, 0.5, inputs["smoothing_speed"])
        return state[1], (-k * state[0] - friction) / m

    def standstill(t, state):
        return float(state[1]) if t > 0 else -1.0

    half_period = math.pi * math.sqrt(m / k)
    solution = integrate(
        motion, [inputs["u0"], 0.0], 4.5 * half_period, standstill, half_period / 50, "LSODA"
    )
    times = solution.t_events[0][:4]
    numbers = {
        f"turning point {i + 1} (x cos45)": solution.sol(t)[0] * math.cos(math.pi / 4)
        for i, t in enumerate(times)
    }
    return numbers | {"time between turning points (half period)": float(np.mean(np.diff(times[:3])))}


def ring_spin_up(inputs):
    """The race integrated under the friction kernel until it runs with the rotor's surface."""
    r, torque_arm = inputs["r"], inputs["N"] * inputs["r"]

    def slip(omega_i):
        return surface_speed(0.0, inputs["Omega"], r, omega_i, r)

    def motion(_, state):
        mu = stribeck_coefficient(slip(state[0]), inputs["mu"], inputs["mu"], 0.5, 5e-3)
        return (mu * torque_arm / inputs["I"],)

    def synchronous(_, state):
        return slip(state[0]) - 5e-3

    closed = whirl.race_spin_up_time(inputs["I"], inputs["mu"], inputs["N"], r, inputs["Omega"])
    solution = integrate(motion, [0.0], 1.1 * closed, synchronous, closed / 50)
    time = float(solution.t_events[0][0])
    assert time == pytest.approx(closed, rel=1e-3)
    return {"time to synchronism": time}


def vertical_drop(inputs):
    """Drop of a rigid rotor; the case counts downwards, we upwards."""
    case = DropCase(speed=0.0, duration=0.03, output_step=1e-6, tolerance=1e-9, spin="constant")
    result = simulate_drop(rigid_model(dict(inputs)), case)
    log, time = result.contacts, result.time
    rotor, support = -result.displacement[:, 0, 1], -result.race_displacement[:, 0, 1]
    touch, release, again = log.start[0], log.end[0], log.start[1]
    flight = (time > release) & (time < again)
    return {
        "first contact": float(touch),
        "end of first contact": float(release),
        "start of second contact": float(again),
        "peak contact force": float(log.peak_force[0]),
        "max rotor travel": float(rotor.max()),
        "max support travel": float(support.max()),
        "top of first rebound (min y)": float(rotor[flight].min()),
        "y at 30 ms": float(rotor[-1]),
        "K from omega=pi/T (paper sect 5.1) on this record": impact.half_period_stiffness(
            inputs["m"], release - touch
        ),
    }


def planar_drop(inputs):
    """Drop of a rigid rotor; the case smooths friction otherwise, below a slip that does not occur."""
    values = dict(inputs) | {"me": inputs["m"] * inputs["e"]}
    case = DropCase(speed=inputs["Om"], duration=0.015, output_step=1e-6, tolerance=1e-9, spin="constant")
    result = simulate_drop(rigid_model(values), case)
    log, last = result.contacts, result.displacement[-1, 0]
    return {
        "contact event 1": float(log.start[0]),
        "contact event 2": float(log.end[0]),
        "peak normal force": float(log.peak_force[0]),
        "ring speed at 15 ms": float(result.race_speed[-1, 0]),
        "x at 15 ms": float(last[0]),
        "z at 15 ms": float(last[1]),
    }


CASES = {
    "C01": sphere_contact_points,
    "C02a": restitution,
    "C05": bouncing_ball,
    "C06": mass_caught_by_a_spring,
    "C08": friction_oscillator,
    "C11": ring_spin_up,
    "D01": vertical_drop,
    "D03": planar_drop,
}

test_case, test_a_changed_input_is_noticed = checks_of(CASES)
