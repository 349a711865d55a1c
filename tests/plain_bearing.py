"""A ball bearing by plain numbers [SI]; steel rings and silicon nitride balls unless others are given."""

from dataclasses import field, make_dataclass

GIVEN = "ball_diameter ball_count pitch_diameter contact_angle conformity_inner conformity_outer"
USUAL = {
    "ring_youngs_modulus": 208e9,
    "ring_poisson_ratio": 0.3,
    "ball_youngs_modulus": 315e9,
    "ball_poisson_ratio": 0.26,
    "ball_density": 3200.0,
    "preload": 0.0,
    "clearance": None,
    "arrangement": "X",
    "first_ball_angle": 0.0,
    "second_row_offset": 0.0,
}
FIELDS = [*GIVEN.split(), *((name, object, field(default=value)) for name, value in USUAL.items())]
BallBearingGeometry = make_dataclass("BallBearingGeometry", FIELDS, frozen=True)
