"""Steps between record and parameters, each against what is known of its input."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rotordrop.errors import IdentificationError
from rotordrop.evidence.air_gap import LARGEST_SWAY, _rest


def test_a_rotor_that_swings_in_one_bearing_alone_is_not_at_rest() -> None:
    time = np.arange(0.0, 4.0, 1e-3)
    along = np.zeros((len(time), 4))
    along[:, [1, 3]] = -280e-6
    sensing: Any = SimpleNamespace(
        settled_bend=np.zeros(4),
        offset_sigma=np.full(4, 1e-6),
        to_bearings=np.zeros((2, 2, 4)),
        from_bearings=np.zeros((4, 2, 2)),
        at_bearings=lambda values: values.reshape(*values.shape[:-1], 2, 2),
    )
    found = _rest("tail", time, along, sensing)
    assert found.radius == pytest.approx([280e-6, 280e-6])
    along[:, 2] = 1.5 * LARGEST_SWAY * 280e-6 * np.sin(2.0 * math.pi * 8.0 * time)
    with pytest.raises(IdentificationError, match=r"tail: the rotor is not at rest on its bearings"):
        _rest("tail", time, along, sensing)
