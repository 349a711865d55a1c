"""A rigid rotor in one touchdown bearing, which may have balls as good as rigid: small drop cases."""

from dataclasses import replace

import numpy as np

from rotordrop.machine import loads_machine
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.reduction import Reduction

LINK = 1e13
"""Stiffness [N/m] of the balls between race and support, which share the mass of the support of a case."""

SHAFT = np.pi / 4 * 1e-7 * 7850.0
"""Mass of the shaft [kg], which is there for its nodes."""

_BALLS = 8
_PRESS = 1e-2


def disc_in(more, mass, gravity, speed=100.0, inertia=(0.01, 0.01)):
    """Drop model of a disc at node 2, the middle of a thin shaft, in the bearings of a text.

    Its mass [kg], polar and diametral inertia [kg m²]; gravity [m/s²] and nominal speed [Hz].
    """
    machine = loads_machine(
        f"""
name = "rigid"
gravity = "{gravity} m/s^2"
speed = {{ nominal = "{speed} Hz" }}
[rotor]
sections = [{{ length = "0.1 m", elements = 2, outer_diameter = "1 mm" }}]
discs = [{{ node = 2, mass = "{mass} kg", polar_inertia = "{inertia[0]} kg m^2", \
diametral_inertia = "{inertia[1]} kg m^2" }}]
materials = {{ steel = {{ youngs_modulus = "206 GPa", poisson_ratio = 0.3, density = "7850 kg/m^3" }} }}
{more}
"""
    )
    return build_drop_model(machine, Reduction(modes=2, attachment=False))


def rigid_model(values, link=LINK, more="", inertia=(0.01, 0.01), arrangement="single"):
    """Drop model of a rigid rotor in one bearing.

    Values of `bearing_of`, m [kg], g [m/s²], where they are there me [kg m] and phase from +x [rad];
    stiffness of the balls [N/m], what the file says beside, polar and diametral inertia of the rotor [kg m²].
    """
    v = {"me": 0.0, "phase": 0.0} | values
    phase = v["phase"] - 0.5 * np.pi
    unbalance = f'[[unbalances]]\nnode = 2\namount = "{v["me"]} kg m"\nphase = "{phase} rad"\n'
    bearing = bearing_of(v, arrangement=arrangement) + more
    model = disc_in((unbalance if v["me"] else "") + bearing, v["m"] - SHAFT, v["g"], inertia=inertia)
    return replace(model, parameters=linked(model, link, 0.5 * v["ms"]))


def bearing_of(values, name="A", node=2, arrangement="single"):
    """A bearing of a file: c, K, n, lam; ms, Ks, Cs of the support; mu, I and r where they are there.

    Its balls are one row, or "X" where a race moves along its axis.
    """
    v = {"mu": 0.0, "I": 1e-3, "r": 100.0 * values["c"]} | values
    half = 0.5 * v["ms"]
    return f"""
[[touchdown_bearings]]
name = "{name}"
node = {node}
air_gap = "{v["c"]} m"
bore_radius = "{v["r"]} m"
damping_time = "0 s"
bearing = {{ ball_diameter = "{0.3 * v["r"]} m", ball_count = {_BALLS}, pitch_diameter = "{3.0 * v["r"]} m", \
contact_angle = "15 deg", preload = "100 N", arrangement = "{arrangement}" }}
contact = {{ stiffness = "{v["K"]} N/m^{v["n"]:.4f}", exponent = {v["n"]}, damping = "{v["lam"]} s/m" }}
friction = {{ static = {v["mu"]}, dynamic = {v["mu"]} }}
race = {{ mass = "{half} kg", inertia = "{v["I"]} kg m^2", drag_coefficient = 0.0 }}
support = {{ mass = "{half} kg", stiffness = "{v["Ks"]} N/m", damping = "{v["Cs"]} N s/m" }}
"""


def linked(model, link, half):
    """Balls pressed in so far that they are one stiff spring, damped against the ringing of the race."""
    bearing = model.parameters.bearing.copy()
    bearing[:, L.GROOVE_DISTANCE] = 1e-3
    bearing[:, L.RADIAL_OFFSET] = 1e-3 + _PRESS
    bearing[:, L.AXIAL_OFFSET] = 0.0
    bearing[:, L.BALL_STIFFNESS] = link / (0.75 * _BALLS * np.sqrt(_PRESS))
    bearing[:, L.BEARING_DAMPING] = np.sqrt(link * half)
    return model.parameters._replace(bearing=bearing)
