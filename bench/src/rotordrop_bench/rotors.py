"""Rotors of the bench, 5 kg to 6 t, as their owners know them: nominal values and guesses with ranges."""

from __future__ import annotations

from functools import lru_cache
from importlib import resources
from string import Template

from rotordrop.machine import Machine, example_machine, loads_machine

MASS_AT_ONE = 32.7
"""Mass [kg] of the scaled rotor whose touchdown bearings have a bore of 60 mm, by definition of the scale."""


def scaled_rotor(mass: float, slenderness: float, overhang: float) -> Machine:
    """A rotor with a disc and an overhung wheel, scaled to about a mass [kg].

    Lengths go with the cube root of the mass, speeds against it, so that stresses and speeds at the surface
    are those of rotors that are built; the air gap goes with the root of the length. Slenderness is the
    lengths over those of the plain rotor of this mass (diameters shrink so that the mass stays), overhang the
    share of the discs' mass that sits outside the bearings, at the DE [1].
    """
    k = (mass / MASS_AT_ONE) ** (1.0 / 3.0)
    long, wide = k * slenderness, k * slenderness**-0.5
    wheel, disc = 4.3 * k**3 * overhang, 4.3 * k**3 * (1.0 - overhang)
    discs = (
        f'{{ node = {node}, mass = "{m:.6g} kg", polar_inertia = "{m * (0.083 * k) ** 2:.6g} kg m^2", '
        f'diametral_inertia = "{m * (0.068 * k) ** 2:.6g} kg m^2" }}'
        for node, m in ((11, disc), (21, wheel))
        if m > 0.0
    )
    text = resources.files(__package__).joinpath("rotor.toml").read_text(encoding="utf-8")
    numbers = {
        "mass": f"{mass:g}",
        "speed": f"{300.0 / k:.6g}",
        "length": f"{720.0 * long:.8g}",
        "diameter": f"{80.0 * wide:.8g}",
        "discs": ", ".join(discs),
        "bearings": f"{_bearing('NDE', 3, k, 1.0)}, {_bearing('DE', 19, k, 2.5)}",
    }
    return loads_machine(Template(text).substitute(numbers))


def _guess(value: float, unit: str, spread: float) -> str:
    low, high = value / spread, value * spread
    return (
        f'{{ guess = "{value:.6g} {unit}", range = ["{low:.6g} {unit}", "{high:.6g} {unit}"], '
        'source = "first guess" }'
    )


def _bearing(name: str, node: int, k: float, stiffer: float) -> str:
    parts = (
        f'name = "{name}", node = {node}, bore_radius = "{30.0 * k:.8g} mm"',
        f"air_gap = {_guess(250.0 * k**0.5, 'um', 1.3)}",
        f'bearing = {{ ball_diameter = "{9.525 * k:.8g} mm", ball_count = 21, contact_angle = "15 deg", '
        f'pitch_diameter = "{85.0 * k:.8g} mm", preload = {_guess(150.0 * k**2, "N", 1.45)} }}',
        f"contact = {{ stiffness = {_guess(0.8e9 * k**0.9, 'N/m^1.111', 1.7)} }}",
        'friction = { dynamic = { guess = 0.1, range = [0.05, 0.2], source = "only the range is known" } }',
        f"support = {{ mass = {_guess(25.0 * k**3, 'kg', 2.0)}, "
        f"stiffness = {_guess(0.8e8 * k * stiffer, 'N/m', 2.0)}, "
        'damping_ratio = { guess = 0.03, range = [0.012, 0.08], source = "first guess" } }',
    )
    return f"{{ {', '.join(parts)} }}"


ROTORS: dict[str, str | tuple[float, float, float]] = {
    "5 kg": (5.0, 1.0, 0.0),
    "13 kg": "small",
    "30 kg": (30.0, 1.2, 0.3),
    "60 kg": "lp400",
    "140 kg": (140.0, 1.3, 0.0),
    "500 kg": (500.0, 1.0, 0.4),
    "1.6 t": (1600.0, 1.2, 0.0),
    "6 t": (6000.0, 1.0, 0.2),
}
"""Rotors in rising order of mass: an example of the package, or arguments of `scaled_rotor`."""


@lru_cache(maxsize=len(ROTORS))
def bench_rotor(name: str) -> Machine:
    """A rotor of the bench, as its owner knows it."""
    scale = ROTORS[name]
    return example_machine(scale) if isinstance(scale, str) else scaled_rotor(*scale)
