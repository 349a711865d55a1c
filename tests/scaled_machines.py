"""One machine in many sizes: a plain rotor on two touchdown bearings, scaled to a mass, longer if asked."""

from rotordrop.machine import Machine, loads_machine

MASS_AT_ONE = 32.7
"""Mass [kg] of the machine whose bearings have a bore of 60 mm."""

TWELVE_NUMBERS = {
    "mass": "60 kg",
    "length": "1.1 m",
    "centre": "520 mm",
    "bearings": ("110 mm", "980 mm"),
    "sensors": ("180 mm", "900 mm"),
    "sensor_angle": "135 deg",
    "designation": "XCB71914-E",
    "gap": "0.25 mm",
    "speed": "9000 rpm",
    "grade": "G 2.5",
    "support": "stiff",
}
"""What somebody knows who has no drawing of the rotor."""


def scaled_machine(
    mass: float, *, slenderness: float = 1.0, bearing: str = "", sensor_places: tuple[float, ...] = (0.2, 0.8)
) -> Machine:
    """The machine with about a mass [kg], lengths by the cube root of it, longer by a factor.

    Parameters
    ----------
    mass : float
        Mass of the rotor [kg].
    slenderness : float
        Lengths over those of the plain machine of this mass; diameters shrink so that the mass stays.
    bearing : str
        In place of the ball bearings of both ends, a TOML table.
    sensor_places : tuple of float
        Planes of the sensors, as parts of the length, two sensors each.
    """
    k = (mass / MASS_AT_ONE) ** (1.0 / 3.0)
    long, wide = k * slenderness, k * slenderness**-0.5
    balls = bearing or (
        f'{{ ball_diameter = "{9.525 * k} mm", ball_count = 21, pitch_diameter = "{85.0 * k} mm", '
        f'contact_angle = "15 deg", preload = "{150.0 * k**2} N" }}'
    )
    sensors = "".join(
        f'[[sensors]]\nname = "S{p}{side}"\nnode = {round(1 + 20 * place)}\nangle = "{angle} deg"\n'
        for p, place in enumerate(sensor_places)
        for side, angle in (("A", 135), ("B", 45))
    )
    ends = "".join(
        f"""
[[touchdown_bearings]]
name = "{name}"
node = {node}
air_gap = "{250.0 * k**0.5} um"
bore_radius = "{30.0 * k} mm"
bearing = {balls}
contact = {{ stiffness = "{1.0e9 * k**0.9} N/m^1.111" }}
support = {{ mass = "{25.0 * k**3} kg", stiffness = "{1.0e8 * k} N/m", damping_ratio = 0.03 }}
"""
        for name, node in (("NDE", 3), ("DE", 19))
    )
    magnets = "".join(
        f'[[ambs]]\nname = "{name}"\nnode = {node}\n' for name, node in (("NDE", 5), ("DE", 17))
    )
    return loads_machine(
        f"""
name = "scaled to {mass:g} kg"
speed = {{ nominal = "{300.0 / k} Hz", aero_time_constant = "8 s" }}
balance_grade = {{ grade = "G 2.5", at_speed = "{300.0 / k} Hz" }}

[rotor]
sections = [{{ length = "{720.0 * long} mm", elements = 20, outer_diameter = "{80.0 * wide} mm" }}]
discs = [{{ node = 11, mass = "{4.3 * k**3} kg", polar_inertia = "{0.03 * k**5} kg m^2", diametral_inertia = \
"{0.02 * k**5} kg m^2" }}]
{ends}
{magnets}
{sensors}
"""
    )
