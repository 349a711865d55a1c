"""What looks odd in a description is told with the two numbers compared."""

import pytest

from rotordrop.machine import example_machine, example_names
from rotordrop.machine.plausibility import doubts
from rotordrop.machine.simple import SimpleMachine, simple_machine


@pytest.mark.parametrize("name", example_names())
def test_the_examples_look_normal(name):
    assert doubts(example_machine(name)) == ()


def test_a_beam_that_stands_for_a_rotor_has_no_seats_to_compare():
    told = {"mass": "59.5 kg", "length": "1.117 m", "centre": "621 mm", "bearings": ("70 mm", "857 mm")}
    told |= {"sensors": ("100 mm", "827 mm"), "sensor_angle": "135 deg", "designation": "XCB71914-E"}
    told |= {"gap": "0.25 mm", "speed": "33000 rpm", "grade": "G 1", "support": "1e8 N/m"}
    assert doubts(simple_machine(SimpleMachine(**told))) == ()


ODD = [
    ({"NDE.air_gap": 2.5e-5}, "air gap", 30e-6, "25.0 µm is unusual"),
    ({"DE.air_gap": 2.5e-3}, "air gap", 1.5e-3, "2.50 mm is unusual"),
    ({"NDE.bore_radius": 0.03}, "rotor radius", 0.0347, "29.7 mm, but the shaft there has 34.7 mm"),
    (
        {"DE.friction.static": 0.08},
        "friction",
        0.1,
        "static friction 0.08 is smaller than dynamic friction 0.1",
    ),
    ({"DE.friction.smoothing_speed": 1e-3}, "smoothing speed", 5e-3, "smoothed below 1.00 mm/s"),
    ({"NDE.damping_time": 1e-4}, "bearing damping", 2.5e-5, "100 µs, outside 2.5 to 25 µs"),
    ({"NDE.damping_time": 1e-6}, "bearing damping", 2.5e-6, "1.00 µs, outside 2.5 to 25 µs"),
    ({"NDE.preload": 1100.0}, "preload", 1026.0, "1.10 kN exceeds the heavy class of XCB71914E"),
]


@pytest.mark.parametrize(("values", "kind", "limit", "told"), ODD, ids=[told for *_, told in ODD])
def test_a_doubt_compares_two_numbers(values, kind, limit, told):
    (path, value), *_ = values.items()
    found = [doubt for doubt in doubts(example_machine("paper").with_values(values)) if doubt.kind == kind]
    assert len(found) == 1
    assert found[0].bearing == path.split(".")[0]
    assert found[0].limit == pytest.approx(limit)
    assert told in found[0].message
    assert found[0].message.startswith(f"{found[0].bearing}: ")
    if kind != "rotor radius":
        assert found[0].value == pytest.approx(value)
