"""Drops in which the rotor touches its housing, and mounts their stops: forces, energy, log, what is said."""

import numpy as np
import pytest
from tests.unit.simulate.test_right_hand_side import mirrored_drops

from rotordrop import DropCase, build_drop_model, load_result, simulate_drop
from rotordrop.errors import MachineFileError
from rotordrop.estimate.simulated_drop import simulation_numbers
from rotordrop.machine import example_path, loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.physics import touch
from rotordrop.report.simulate_page import simulate_summary
from rotordrop.simulate.losses import losses
from rotordrop.simulate.used import clearance_uses

TEXT = example_path("small").read_text(encoding="utf-8")
HEAD = '[[touchdown_bearings]]\nname = "DE"'
SPEED = 2.0 * np.pi * 200.0
CASE = DropCase(speed=SPEED, duration=0.03, reduction="quick")
RUB = 'stiffness = "4e7 N/m"'


def sealed(*lines, gap=None, text=TEXT):
    """The small machine with a seal in the middle, by default 5 µm wider than the air gap."""
    machine = loads_machine(text)
    node = (machine.touchdown_bearings[0].node + machine.touchdown_bearings[1].node) // 2
    widest = max(float(bearing.air_gap) for bearing in machine.touchdown_bearings)
    gap = widest + 5e-6 if gap is None else gap
    of = f'\n[[clearances]]\nname = "seal"\nnode = {node}\ngap = "{gap} m"\n'
    return loads_machine(text + of + "\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def rubbed():
    return sealed(RUB)


@pytest.fixture(scope="module")
def drop(rubbed):
    return simulate_drop(build_drop_model(rubbed, "quick"), CASE)


def test_energy_closes_by_place_and_the_log_is_that_of_the_motion_and_of_the_file(rubbed, drop, tmp_path):
    assert drop.certificate.energy_residual < 1e-6 * drop.certificate.energy_scale
    found = losses(build_drop_model(rubbed, "quick"), drop)
    assert found.total == pytest.approx(
        drop.state[-1, drop.state_names.index("dissipated energy")], rel=1e-12
    )
    logged = float(np.sum(drop.contacts_at("seal").dissipated_energy))
    assert 0.0 < found.rubbing == pytest.approx(logged, rel=1e-3)
    (use,) = clearance_uses(rubbed, drop)
    radius = np.linalg.norm(drop.at_nodes([use.node])[:, 0], axis=-1)
    log = use.contacts
    assert len(log) > 1
    assert use.peak_force == pytest.approx(4e7 * (use.travel - use.gap), rel=0.05)
    inside = np.zeros(len(drop.time), dtype=bool)
    for start, end in zip(log.start, log.end, strict=True):
        inside |= (drop.time > start) & ~(drop.time >= end)
    assert np.array_equal(inside, radius > use.gap)
    drop.save(tmp_path / "drop.h5")
    again = load_result(tmp_path / "drop.h5")
    assert again.further_names == ("seal",)
    assert np.array_equal(again.contacts_at("seal").impulse, drop.contacts_at("seal").impulse)
    assert np.array_equal(again.contacts.impulse, drop.contacts.impulse)


def test_a_housing_out_of_reach_changes_nothing_and_one_in_reach_is_said(rubbed, drop):
    plain = simulate_drop(loads_machine(TEXT), CASE)
    far = simulate_drop(sealed(RUB, gap=5e-3), CASE)
    assert np.array_equal(plain.displacement, far.displacement)
    assert np.array_equal(plain.contacts.impulse, far.contacts.impulse)
    assert len(far.contacts_at("seal")) == 0
    entry = simulation_numbers(drop, rubbed)["clearances"]["seal"]
    assert entry["contacts"] == len(drop.contacts_at("seal"))
    assert entry["peak_force_N"] == np.max(drop.contacts_at("seal").peak_force)
    assert entry["first_contact_s"] == drop.contacts_at("seal").start[0]


def test_friction_brakes_the_rotor_and_a_mirrored_drop_is_the_mirror(rubbed):
    one, other = mirrored_drops(rubbed, SPEED)
    assert one.contacts_at("seal").peak_force == pytest.approx(other.contacts_at("seal").peak_force, rel=1e-4)
    assert one.speed == pytest.approx(-other.speed, rel=1e-9)
    smooth, _ = mirrored_drops(rubbed.with_values({"clearances.seal.friction": 0.0}), SPEED)
    assert abs(one.speed[-1]) < smooth.speed[-1]


def test_a_stop_is_logged_and_told_with_its_force():
    def stopped(gap):
        mount = f'mount = [{{ kind = "stop", gap = "{gap} um" }}]'
        machine = loads_machine(TEXT.replace(HEAD, f"{HEAD}\n{mount}"))
        drop = simulate_drop(machine, CASE)
        (use,) = clearance_uses(machine, drop)
        verdict = simulate_summary(drop, machine).verdict
        (said,) = [one for one in verdict if one.text.startswith("DE: the mount")]
        return machine, drop, use, said, simulation_numbers(drop, machine)["stops"]["DE"]

    machine, drop, use, said, entry = stopped(8)
    moved = np.hypot(*drop.support_displacement[:, 1].T)
    assert use.travel == moved.max() > use.gap
    assert use.peak_force == pytest.approx(5e8 * (use.travel - use.gap), rel=0.15)
    assert drop.time[np.argmax(moved > use.gap)] == pytest.approx(use.contacts.start[0], abs=2e-5)
    assert said.level == "warning"
    figures = {figure.label: figure for figure in simulate_summary(drop, machine).cards[1].figures}
    assert figures["Peak force on the stop"].value.value == use.peak_force
    assert entry["contacts"] == len(use.contacts) and entry["travel_over_gap"] == use.share
    assert len(drop.contacts) == len(drop.contacts.of_bearing(0)) + len(drop.contacts.of_bearing(1))
    *_, use, said, entry = stopped(500)
    assert said.level == "good"
    assert entry["contacts"] == 0 and entry["peak_force_N"] == 0.0


def test_the_contact_is_written_and_varied_by_name(rubbed):
    assert loads_machine(machine_text(rubbed)) == rubbed
    other = rubbed.with_values({"clearances.seal.friction": 0.1})
    friction = [touch.FRICTION_STATIC, touch.FRICTION_DYNAMIC]
    assert np.all(build_drop_model(other, "quick").parameters.rub[0, friction] == 0.1)
    assert float(rubbed.clearances[0].friction) == 0.2
    node = rubbed.clearances[0].node
    beside = rubbed.rotor.elements[max(node - 2, 0) : node]
    outer = max(float(one.layer_diameter or one.outer_diameter) for one in beside)
    assert float(rubbed.clearances[0].radius) == 0.5 * outer


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("friction = 0.2", r"'friction' but no 'stiffness'"),
        ('radius = "20 mm"', r"'radius' but no 'stiffness'"),
        ('stiffness = "0 N/m"', r"must be positive"),
        (f"{RUB}\nfriction = -0.1", r"must not be negative"),
    ],
)
def test_contacts_that_cannot_be_are_refused(line, message):
    with pytest.raises(MachineFileError, match=message):
        sealed(line)
    with pytest.raises(MachineFileError, match=r"'seal' .* is used up before the rotor reaches"):
        sealed(RUB, gap=50e-6)
