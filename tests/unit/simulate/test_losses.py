"""Every place where a drop loses energy is found, and together they are all that is lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import UsageError
from rotordrop.machine import example_machine
from rotordrop.physics import columns as L
from rotordrop.physics.columns import RACE_INERTIA
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate.case import DropCase, LevitatedStart
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.losses import losses
from rotordrop.simulate.result import load_result

CASE = DropCase(
    speed=2.0 * np.pi * 60.0, duration=0.03, reduction="quick", start=LevitatedStart(rotor_angle=1.0)
)
FOUNDATION = {
    "NDE.support.foundation_share": 0.05,
    "NDE.support.foundation_frequency": 2.0 * np.pi * 90.0,
    "NDE.support.foundation_damping_ratio": 0.05,
}


@pytest.fixture(scope="module")
def model():
    return build_drop_model(example_machine("paper"), "quick")


@pytest.fixture(scope="module")
def drop(model):
    return simulate_drop(model, CASE)


def test_places_sum_to_the_book_of_the_time_loop(model, drop):
    found = losses(model, drop)
    book = float(drop.state[-1, model.layout.dissipated])
    assert book > 10.0
    assert found.total == pytest.approx(book, rel=1e-12)
    assert found.sliding.sum() + found.contact.sum() == pytest.approx(
        drop.contacts.dissipated_energy.sum(), rel=1e-4
    )


def test_places_close_with_a_foundation_that_gives_way():
    machine = example_machine("paper").with_values(FOUNDATION)
    model = build_drop_model(machine, "quick")
    drop = simulate_drop(model, CASE)
    found = losses(model, drop)
    assert found.total == pytest.approx(float(drop.state[-1, model.layout.dissipated]), rel=1e-12)
    layout, own = model.layout, model.layout.further_at(L.BEARING_OWN)
    mount = drop.state[:, layout.velocity_of(layout.support)][:, :2] - drop.state[:, own][:, 2:]
    damping = [
        float(getattr(machine.touchdown_bearings[0].support, f"damping{a}")) for a in ("_horizontal", "")
    ]
    by_hand = np.trapezoid(mount**2 @ damping, drop.time)
    assert 0.5 < by_hand / found.support[0] < 0.999  # the rest is the foundation's own damper


def test_a_drop_from_a_file_holds_no_energies_by_place(model, drop):
    with pytest.raises(UsageError, match=r"holds no energies by place.*simulate it"):
        losses(model, replace(drop, lost=None))


def test_each_part_follows_its_damper(model, drop):
    """Support damping of one bearing alone makes the loss of that support, and only some of the others."""
    name = "NDE.support.damping"
    damping = float(model.machine.touchdown_bearings[0].support.damping)
    dry = model.with_values({name: 1e-6 * damping, "NDE.support.damping_horizontal": 1e-6 * damping})
    found = losses(dry, simulate_drop(dry, CASE))
    assert found.support[0] < 1e-5 * losses(model, drop).support[0]
    assert found.support[1] > 0.1 * losses(model, drop).support[1]
    values = {f"{b}.friction.{k}": 1e-9 for b in ("NDE", "DE") for k in ("static", "dynamic")}
    smooth = model.with_values(values)
    without = losses(smooth, simulate_drop(smooth, CASE))
    assert np.all(without.sliding < 1e-5) and np.all(without.contact > 0.0)


def test_friction_on_the_race_becomes_spin_and_drag(model, drop):
    """Torque on the race times its spin: half of it would be kinetic energy if the drag were nothing."""
    found = losses(model, drop)
    kinetic = 0.5 * model.parameters.bearing[:, RACE_INERTIA] * drop.race_speed[-1] ** 2
    np.testing.assert_allclose(found.spin_up, kinetic + found.drag)
    bore = np.array([float(b.bore_radius) for b in model.machine.touchdown_bearings])
    work = np.trapezoid(drop.friction_force * bore * drop.race_speed, drop.time, axis=0)
    np.testing.assert_allclose(found.spin_up, work, rtol=2e-2)


def test_the_energies_by_place_come_back_from_a_file(model, drop, tmp_path):
    drop.save(tmp_path / "drop.h5")
    read = losses(model, load_result(tmp_path / "drop.h5"))
    assert read.total == losses(model, drop).total
    assert np.array_equal(read.support, losses(model, drop).support)
