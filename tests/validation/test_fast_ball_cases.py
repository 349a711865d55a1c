"""Balls at speed: angles, loads and stiffness of one ball between grooves under its centrifugal force."""

import math

import numpy as np
from cases import checks_of
from tests.plain_bearing import BallBearingGeometry

from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.physics.fast_balls import FastBalls, ball_equilibrium, centred_balls, offset_on_springs


def row_of(v):
    described = BallBearingGeometry(
        ball_diameter=v["ball_diameter"],
        pitch_diameter=v["pitch_diameter"],
        ball_count=v["balls"],
        contact_angle=math.radians(v["contact_angle"]),
        conformity_inner=v["conformity"],
        conformity_outer=v["conformity"],
        preload=v["preload"],
        ring_youngs_modulus=v["ring_modulus"],
        ball_youngs_modulus=v["ball_modulus"],
        ball_poisson_ratio=v["ball_poisson"],
        ball_density=v["ball_density"],
    )
    constants = bearing_constants(described)
    return constants, FastBalls.of(described, constants)


def at_speeds(v):
    constants, balls = row_of(v)
    found = {"approach by preload": constants.preload_approach}
    for speed, names in v["shown"].items():
        ball, _ = centred_balls(balls, 2.0 * math.pi * float(speed))
        inner, outer = float(ball.inner_load[0]), float(ball.outer_load[0])
        numbers = {
            "ball load": inner,
            "inner load": inner,
            "outer load": outer,
            "contact angle": math.degrees(ball.inner_angle[0]),
            "inner angle": math.degrees(ball.inner_angle[0]),
            "outer angle": math.degrees(ball.outer_angle[0]),
            "inner stress": constants.stress_coefficient_inner * math.cbrt(inner),
            "outer stress": constants.stress_coefficient_outer * math.cbrt(outer),
            "axial force of a row": v["balls"] * float(ball.axial_force[0]),
            # two rows; the sum of squared cosines around a row is half its balls
            "radial stiffness": v["balls"] * float(ball.radial_stiffness[0]),
        }
        found |= {f"{name} at {speed} Hz": numbers[name] for name in names}
    return found


def governing_speed(v):
    """Speed [Hz] at which the stress on the outer race overtakes that on the inner one."""
    constants, balls = row_of(v)
    low, high = 1.0, 600.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        ball, _ = centred_balls(balls, 2.0 * math.pi * middle)
        inner = constants.stress_coefficient_inner * math.cbrt(ball.inner_load[0])
        outer = constants.stress_coefficient_outer * math.cbrt(ball.outer_load[0])
        low, high = (middle, high) if outer < inner else (low, middle)
    return middle


def others(v):
    omega = 2.0 * math.pi * v["speed"]
    _, balls = row_of(v)
    offset = offset_on_springs(balls, v["balls"], v["preload"], omega)
    sprung, _ = centred_balls(balls, omega, offset)
    modulus, poisson, density = v["steel"]
    steel = {**v, "ball_modulus": modulus, "ball_poisson": poisson, "ball_density": density}
    heavy, _ = centred_balls(row_of(steel)[1], omega)
    return {
        "outer load on springs": float(sprung.outer_load[0]),
        "outer angle on springs": math.degrees(sprung.outer_angle[0]),
        "outer load with steel balls": float(heavy.outer_load[0]),
        "outer race governs from": governing_speed(v),
        "outer race governs from with steel balls": governing_speed(steel),
    }


def slopes(v):
    _, balls = row_of(v)
    force = np.array([0.0, v["step"]])
    ball = ball_equilibrium(balls, balls.axial_offset, balls.radial_offset, force)
    return {
        "outer load by centrifugal force": float(np.diff(ball.outer_load)[0]) / v["step"],
        "outer angle by centrifugal force": math.degrees(np.diff(ball.outer_angle)[0]) / v["step"],
    }


def gyroscopic_moment(balls, omega, inner_angle, outer_angle):
    """Moment of a ball [N m] that does not spin on the outer race, J ω_c ω_R sin β, and its orbit [rad/s].

    Jones 1960; Harris, Rolling Bearing Analysis.
    """
    share, inertia = balls.diameter / balls.pitch_diameter, 0.1 * balls.mass * balls.diameter**2
    c_i, s_i = math.cos(inner_angle), math.sin(inner_angle)
    c_o, s_o = math.cos(outer_angle), math.sin(outer_angle)
    lean = s_o / (c_o + share)  # tangent of the pitch angle β
    on_o, on_i = c_o + lean * s_o, c_i + lean * s_i
    below, above = 1.0 - share * c_i, 1.0 + share * c_o
    cosine = 1.0 / math.sqrt(1.0 + lean * lean)
    orbit = omega / (1.0 + above * on_i / (below * on_o))
    spin = omega / ((on_o / above + on_i / below) * share * cosine)
    return inertia * orbit * spin * lean * cosine, orbit


def controlled(v):
    """A thrust on one row, whose balls gyrate, held by friction at the outer race."""
    _, balls = row_of(v)
    omega = 2.0 * math.pi * v["speed"]
    low, high = balls.axial_offset - 1e-4, balls.axial_offset + 5e-5
    inner = outer = math.radians(v["contact_angle"])
    for _ in range(40):
        offset = 0.5 * (low + high)
        for _ in range(40):
            moment, orbit = gyroscopic_moment(balls, omega, inner, outer)
            force = balls.centrifugal_force(orbit)
            ball = ball_equilibrium(balls, offset, balls.radial_offset, force, v["sense"] * moment)
            change = abs(float(ball.inner_angle[0]) - inner)
            inner, outer = float(ball.inner_angle[0]), float(ball.outer_angle[0])
            if change < 1e-10:
                break
        pushed = v["balls"] * float(ball.axial_force[0])
        low, high = (offset, high) if pushed < v["preload"] else (low, offset)
    return {"inner angle": math.degrees(inner), "outer angle": math.degrees(outer)}


CASES = {"FB01": at_speeds, "FB02": others, "FB03": slopes, "FB04": controlled}

test_case, test_a_changed_input_is_noticed = checks_of(CASES)
