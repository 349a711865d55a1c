"""Bearings of the physics tests."""

import math

import pytest
from tests.plain_bearing import BallBearingGeometry


@pytest.fixture(scope="session")
def touchdown_bearing():
    """The reference machine's touchdown bearing (23 ceramic balls, 25°, 530 N per row), with changes."""
    reference = {
        "ball_diameter": 0.009525,
        "ball_count": 23,
        "pitch_diameter": 0.085,
        "contact_angle": math.radians(25.0),
        "conformity_inner": 0.53,
        "conformity_outer": 0.53,
        "preload": 530.0,
    }

    def changed(**changes):
        return BallBearingGeometry(**(reference | changes))

    return changed
