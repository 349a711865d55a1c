"""Drops whose probes stand on other gap voltages are those of one machine."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop import calibrate_machine, estimate_drops
from rotordrop.evidence.one_end import LEVITATED
from rotordrop.twin import calibrated, tracked

BIASES = (-1200e-6, -1350e-6, 0.0)


class Followed(Exception):
    """Raised where the twin would begin to follow."""


@pytest.mark.parametrize("estimates", [False, True])
def test_drops_on_other_gap_voltages_are_read_with_the_zeros_of_one(
    estimates, machine, whole_drop, tail, monkeypatch
):
    drops, tails = (
        [replace(one, signals=one.signals + bias, sha256="") for bias in BIASES] for one in (whole_drop, tail)
    )

    def follow(machine, evidence):
        raise Followed(machine, evidence)

    def search(search, machine):
        follow(machine, search.drops.evidence)

    monkeypatch.setattr(tracked, "followed_drops", lambda machine, evidence, **_: follow(machine, evidence))
    monkeypatch.setattr(calibrated, "track_drops", search)
    run = estimate_drops if estimates else calibrate_machine
    with pytest.raises(Followed) as caught:
        run(machine, drops, tails, names=["a", "b", "c"], progress=False)
    alike, evidence = caught.value.args
    offsets = np.array([float(sensor.offset) for sensor in alike.sensors])
    assert {sensor.offset.source for sensor in alike.sensors} == {LEVITATED}
    for one in evidence:
        assert one.base.machine is alike or one.machine.sensors == alike.sensors
        floated = one.levitated.mean - offsets
        about = 1e-12 if one.name != "c" else 60e-6
        assert np.all(np.abs(floated) < about), one.name
        np.testing.assert_allclose(one.settled_level, evidence[0].settled_level, rtol=0, atol=about)
