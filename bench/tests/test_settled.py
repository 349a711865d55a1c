"""The rotor at rest in its touchdown bearings, whatever it weighs."""

from __future__ import annotations

import numpy as np
import pytest
from tests.scaled_machines import scaled_machine

from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate._rhs import drop_derivative, scratch_of
from rotordrop_bench import hidden_machine, synthesize_drop
from rotordrop_bench.settled import settled_coordinates

SIZES = [(5.0, 1.0), (36.0, 1.0), (60.0, 1.2), (130.0, 1.5), (6000.0, 1.0), (6000.0, 1.3)]


@pytest.mark.parametrize(("mass", "slenderness"), SIZES)
def test_a_rotor_of_any_mass_finds_its_rest(mass, slenderness):
    machine = scaled_machine(mass, slenderness=slenderness)
    assert machine.rotor.mass == pytest.approx(mass, rel=0.03)
    model = build_drop_model(machine)
    layout, p = model.layout, model.parameters
    state = layout.zeros()
    state[: layout.n_coordinates] = settled_coordinates(model)
    change, work = layout.zeros(), scratch_of(p)
    drop_derivative(0.0, state, p, change, work)
    left = change[layout.velocity_of(layout.modal_y)]
    assert np.max(np.abs(left)) < 1e-8 * np.max(np.abs(p.gravity))
    carried = -state[layout.support].reshape(-1, 2)[:, 1] * p.bearing[:, L.SUPPORT_STIFFNESS_Y]
    assert np.sum(carried) == pytest.approx(9.81 * machine.rotor.mass, rel=1e-8)
    assert carried == pytest.approx(model.load_shares, rel=1e-3)


def test_a_heavy_slender_rotor_is_synthesized_with_its_tail():
    machine = scaled_machine(130.0, slenderness=1.5)
    drop = synthesize_drop(hidden_machine(machine, 1), float(machine.speed.nominal), 1, duration=0.02)
    assert drop.tail is not None
    depth = np.hypot(*np.mean(drop.tail.signals.reshape(-1, 2, 2), axis=0).T)
    gaps = [float(bearing.air_gap) for bearing in machine.touchdown_bearings]
    assert depth == pytest.approx(gaps, rel=0.3)
