"""A small machine, as text of a file, for tests that change it."""

import pytest

SMALL = """
name = "small"

[speed]
nominal = "300 Hz"

[rotor]

[[rotor.sections]]
length = "0.2 m"
elements = 2
outer_diameter = "60 mm"

[[rotor.sections]]
length = "0.4 m"
elements = 4
outer_diameter = "80 mm"
inner_diameter = "20 mm"

[[rotor.sections]]
length = "0.2 m"
elements = 2
outer_diameter = "60 mm"

[[rotor.discs]]
name = "wheel"
node = 5
mass = "5 kg"
polar_inertia = "0.02 kg m^2"
diametral_inertia = "0.0125 kg m^2"

[[touchdown_bearings]]
name = "NDE"
node = 2
air_gap = "250 um"
bore_radius = "30.25 mm"
bearing = { designation = "XCB71914-E" }

[[touchdown_bearings]]
name = "DE"
position = "0.7 m"
air_gap = "250 um"
bore_radius = "30.25 mm"
bearing = { designation = "XCB71914-E", preload = "heavy" }
""" + "".join(
    f'\n[[sensors]]\nname = "{name}"\nnode = {node}\nangle = "{angle} deg"\n'
    for name, node, angle in (("A", 2, 135), ("B", 2, 45), ("C", 8, 135), ("D", 8, 45))
)


@pytest.fixture(scope="session")
def small_text():
    """Text of the small machine."""
    return SMALL


@pytest.fixture(scope="session")
def changed():
    """Text of the small machine with replacements, each where its text stands first."""

    def replaced(*changes):
        text = SMALL
        for old, new in changes:
            assert old in text, f"{old!r} is not in the text"
            text = text.replace(old, new, 1)
        return text

    return replaced
