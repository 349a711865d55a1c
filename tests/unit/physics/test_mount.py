"""Laws of a soft mount: forces are gradients of their energy, slip only loses, no axis is preferred."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop.elements.mount import Mount
from rotordrop.physics import columns as L
from rotordrop.physics import mount


def numbers_of(**elements):
    row = np.zeros(L.N_BEARING_COLUMNS)
    Mount.model_validate(elements).fill(row)
    return row[L.MOUNT : L.MOUNT_END]


ALL = {
    "stop": {"gap": "20 um", "stiffness": "5e8 N/m", "damping": "0.1 s/m"},
    "ribbon": {"friction_stiffness": "6e7 N/m", "slip_force": "1.5 kN", "sharpness": 8.0},
    "maxwell": [{"stiffness": "4e6 N/m", "time": "30 ms"}, {"stiffness": "9e6 N/m", "time": "0.3 ms"}],
}
STATES = 6


def force(numbers, place, velocity, stretch):
    rate = np.zeros(STATES)
    return np.array([*mount.mount_force(numbers, *place, *velocity, stretch, rate)]), rate


@pytest.fixture
def moving():
    random = np.random.default_rng(7)
    return (
        np.array([21e-6, -14e-6]),
        0.05 * random.standard_normal(2),
        np.concatenate([[12e-6, 11e-6], 5e-6 * random.standard_normal(4)]),
    )


def test_force_is_the_gradient_of_the_energy_at_rest(moving):
    numbers, (place, _, stretch), step = numbers_of(**ALL), moving, 1e-11
    stop = numbers_of(stop=ALL["stop"])
    for axis in range(2):
        ends = [
            mount.mount_energy(stop, *(place + side * step * np.eye(2)[axis]), stretch) for side in (1, -1)
        ]
        held = mount.stop_force(stop, *place, 0.0, 0.0)
        assert (ends[0] - ends[1]) / (2.0 * step) == pytest.approx(held[axis], rel=1e-5)
    for state in range(0, STATES, 2):
        moved = stretch + 1e-9 * np.eye(STATES)[state]
        rise = mount.mount_energy(numbers, *place, moved) - mount.mount_energy(numbers, *place, stretch)
        stiffness = mount.stiffness_of_state(numbers, state)
        assert rise / 1e-9 == pytest.approx(stiffness * stretch[state], rel=1e-3)


def test_power_put_in_is_stored_or_lost(moving):
    """Force on rate of deflection = rate of the energy + power lost, at any state."""
    numbers, (place, velocity, stretch) = numbers_of(**ALL), moving
    (fx, fy, lost), rate = force(numbers, place, velocity, stretch)
    step = 1e-8
    energies = [
        mount.mount_energy(numbers, *(place + side * step * velocity), stretch + side * step * rate)
        for side in (1.0, -1.0)
    ]
    stored = (energies[0] - energies[1]) / (2.0 * step)
    assert lost > 0.0
    assert fx * velocity[0] + fy * velocity[1] == pytest.approx(stored + lost, rel=1e-6)


def test_slopes_are_those_of_finite_differences(moving):
    numbers, (place, velocity, stretch) = numbers_of(**ALL), moving
    by_place, by_velocity = mount.stop_tangent(numbers, *place, *velocity)
    for axis in range(2):
        for slopes, vector, step in ((by_place, place, 1e-10), (by_velocity, velocity, 1e-6)):
            ends = []
            for side in (1.0, -1.0):
                changed = vector + side * step * np.eye(2)[axis]
                pair = (changed, velocity) if vector is place else (place, changed)
                ends.append(np.array(mount.stop_force(numbers, *pair[0], *pair[1])[:2]))
            numeric = (ends[0] - ends[1]) / (2.0 * step)
            assert [slopes[axis], slopes[2 + axis]] == pytest.approx(list(numeric), rel=1e-4)
    speed = np.array([0.03, 0.05])  # along the stretch of the ribbon: it slips
    by_stretch, by_rate = mount.ribbon_slip_gradient(numbers, *stretch[:2], *speed)
    for axis in range(2):
        one = np.eye(2)[axis]
        for slopes, change, step in (
            (by_stretch, (one, 0.0 * one), 1e-10),
            (by_rate, (0.0 * one, one), 1e-6),
        ):
            ends = [
                np.array(
                    mount.ribbon_slip(
                        numbers, *(stretch[:2] + side * step * change[0]), *(speed + side * step * change[1])
                    )
                )
                for side in (1.0, -1.0)
            ]
            numeric = (ends[0] - ends[1]) / (2.0 * step)
            assert [slopes[axis], slopes[2 + axis]] == pytest.approx(list(numeric), rel=1e-4)


@pytest.mark.parametrize("turn", [0.3, 1.9, -2.5])
def test_no_axis_is_preferred(moving, turn):
    numbers, (place, velocity, stretch) = numbers_of(**ALL), moving
    c, s = np.cos(turn), np.sin(turn)
    turned = np.array([[c, -s], [s, c]])
    (*plain, lost), _ = force(numbers, place, velocity, stretch)
    (*other, as_much), _ = force(
        numbers, turned @ place, turned @ velocity, (stretch.reshape(-1, 2) @ turned.T).ravel()
    )
    assert other == pytest.approx(list(turned @ plain), rel=1e-12)
    assert as_much == pytest.approx(lost, rel=1e-12)


def test_a_ribbon_never_holds_more_than_its_slip_force():
    numbers = numbers_of(ribbon=ALL["ribbon"])
    stretch, rate, dt = np.zeros(2), np.zeros(2), 1e-6
    for _ in range(2000):
        mount.mount_force(numbers, 0.0, 0.0, 0.06, -0.08, stretch, rate)
        stretch = stretch + dt * rate
    assert 6e7 * np.hypot(*stretch) == pytest.approx(1500.0, rel=1e-6)
    mount.mount_force(numbers, 0.0, 0.0, -0.06, 0.08, stretch, rate)
    assert list(rate) == [-0.06, 0.08]  # it holds as soon as the motion turns back
