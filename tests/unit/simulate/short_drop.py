"""A drop of 2 ms with a contact at both bearings, short enough for the interpreter."""

import numpy as np

from rotordrop import DropCase, PlacedStart, build_drop_model, example_machine

START = PlacedStart(
    displacement=np.array([[20e-6, -270e-6], [-30e-6, -278e-6]]),
    velocity=np.array([[0.01, -0.07], [0.0, -0.06]]),
)
CASE = DropCase(speed=2.0 * np.pi * 60.0, duration=0.002, output_step=1e-4, start=START)


class Killed(Exception):
    """What `killed_after` raises."""


def killed_after(windows):
    """The progress of a coast-down that is killed when so many more windows are kept."""
    left = iter(range(windows - 1, -1, -1))

    def progress(*_):
        if next(left) == 0:
            raise Killed

    return progress


def model():
    """The reference machine with 6 + 2 modes per plane."""
    return build_drop_model(example_machine("paper"), "quick")
