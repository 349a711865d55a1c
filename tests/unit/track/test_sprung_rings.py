"""The filter on a machine whose preload springs make: rings that no sensor sees."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from rotordrop.machine import example_path, loads_machine
from rotordrop.physics.ring import row_rigidity
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.drop import simulate_drop
from rotordrop.track.calibration import BLIND_SCHEDULE, is_inconsistent, track
from rotordrop.track.forces import force_history
from rotordrop.track.problem import RecordedDrop, build_problem, sensor_rows
from rotordrop.track.smoother import fastest_frequency
from rotordrop.twin.problems import COARSE_BASIS

SPRINGS = 'preload_kind = "spring"\nspring_rate = "1e5 N/m"\nfit_friction = 0.0\npreload = { guess'
SPEED, NOISE = 900.0, 0.3e-6


def test_rings_without_friction_in_their_fits_are_followed():
    """The swing that an impact leaves in the rings decays; where it did not, the filter lost the drop."""
    text = example_path("small").read_text(encoding="utf-8").replace("preload = { guess", SPRINGS)
    model = build_drop_model(loads_machine(text), COARSE_BASIS)
    case = DropCase(speed=SPEED, duration=0.03, output_step=50e-6)
    drop = simulate_drop(model, case)
    seen = drop.state[:, : model.layout.n_dynamic] @ sensor_rows(model).T
    noise = NOISE * np.random.default_rng(1).standard_normal(seen.shape)
    touched = np.any(drop.contact_force > 0.0, axis=1)
    recorded = RecordedDrop(
        time=drop.time,
        readings=seen + noise,
        noise=np.full(seen.shape[1], NOISE),
        initial_speed=SPEED,
        initial_speed_error=1.0,
        speed=np.full(len(drop.time), np.nan),
        tail_level=None,
        first_contact=float(drop.time[touched][0]),
    )
    problem = build_problem(model, recorded, until=0.03)
    fit = track([problem], BLIND_SCHEDULE[:4])
    assert not is_inconsistent(fit)
    forces = force_history(problem, fit.smoothed[0])
    for b in range(2):
        window = drop.time <= forces.time[-1]
        peak = np.max(drop.bearing_force_magnitude[window, b])
        assert np.max(forces.magnitude[:, b]) == pytest.approx(peak, rel=0.1)


def test_a_light_ring_sets_the_steps_of_the_filter():
    """Its frequency on balls at eight times their load; a heavy one is slower than the race."""
    text = example_path("small").read_text(encoding="utf-8")

    def fastest(*lines: str) -> float:
        machine = loads_machine(text.replace("preload = { guess", "\n".join((*lines, "preload = { guess"))))
        return fastest_frequency(SimpleNamespace(model=build_drop_model(machine, COARSE_BASIS)))

    spring = 'preload_kind = "spring"'
    light = fastest(spring, 'ring_mass = "4 g"')
    assert fastest(spring, 'ring_mass = "1 g"') == pytest.approx(2.0 * light, rel=1e-6)
    assert light > fastest() == fastest(spring, 'ring_mass = "4 kg"')
    stiffness = row_rigidity(loads_machine(text).touchdown_bearings[0].bearing.numbers().constants)
    assert light == pytest.approx((2.0 * stiffness / 4e-3) ** 0.5, rel=1e-6)
