"""Loads and an accelerating ground: against closed forms, published values and the laws of mechanics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.validation.rigid_machine import linked, rigid_model

from rotordrop.errors import MachineFileError, RecordError
from rotordrop.machine import example_machine, loads_machine
from rotordrop.machine.saving import machine_text
from rotordrop.physics.load import load_now
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.reduction import Reduction
from rotordrop.simulate.case import CentredStart, DropCase, LevitatedStart
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.levitation import start_of_drop

G = 9.81
RIGID = {
    "m": 30.0, "c": 0.25e-3, "K": 1e9, "n": 10.0 / 9.0, "lam": 0.0, "g": G,
    "ms": 3.0, "Ks": 1e8, "Cs": 0.2 * math.sqrt(1e8 * 33.0),
}  # fmt: skip


def rigid_with(more: str, **values):
    """The rigid rotor of the drop cases with more lines in its machine file."""
    machine = loads_machine(machine_text(rigid_model(RIGID | values).machine) + more)
    model = build_drop_model(machine, Reduction(modes=2, attachment=False))
    return replace(model, parameters=linked(model, 1e13, 0.5 * RIGID["ms"]))


def with_lines(machine, more):
    return loads_machine(machine_text(machine) + more)


def dropped(model, duration=0.01, **more):
    case = DropCase(speed=0.0, duration=duration, start=CentredStart(), output_step=2e-6, **more)
    return simulate_drop(model, case)


def down(force):
    return f'\n[[loads]]\nnode = 2\ndirection = "-90 deg"\n{force}\n'


@pytest.mark.parametrize(("more", "peak"), [("", 3284.0), (down('force = "147.15 N"'), 4088.0)])
def test_a_constant_load_adds_to_the_first_peak(more, peak):
    """Reference: own computation of 30 kg on a race of 3 kg, published with the scope of the physics."""
    found = dropped(rigid_with(more))
    assert float(np.max(found.contact_force)) == pytest.approx(peak, rel=1e-3)
    assert found.certificate.energy_residual < 1e-5 * found.certificate.energy_scale


def test_a_housing_that_moves_up_meets_the_rotor_earlier():
    """0.2 g at 10 Hz, phase zero at release: y = -½gt² - 0.2g (t/ω - sin ωt/ω²)."""
    base = '\n[base]\ny = "1.962 m/s^2"\nfrequency = "10 Hz"\n'
    found = dropped(rigid_with(base), tolerance=1e-9)
    first = float(found.contacts.start[0])
    # 0.35 µs late: the ground pushes the race down too, by 25 nm, which the fall alone does not know
    assert first == pytest.approx(7.03724e-3, abs=4e-7)
    w = 2.0 * math.pi * 10.0
    speed = G * first + 0.2 * G * (1.0 - math.cos(w * first)) / w
    assert speed == pytest.approx(72.038e-3, abs=5e-6)
    velocity = np.gradient(found.displacement[:, 0, 1], found.time)
    assert -velocity[np.searchsorted(found.time, first) - 2] == pytest.approx(speed, rel=2e-3)


def test_a_ground_that_accelerates_steadily_is_another_gravity():
    base = '\n[base]\nover_time = [{ time = "0 s", y = "1 m/s^2" }]\n'
    moved, heavier = dropped(rigid_with(base)), dropped(rigid_with("", g=G + 1.0))
    # a race that its balls hold has no weight in gravity, but inertia: its support gives way by 30 nm
    assert moved.displacement[:, 0, 1] == pytest.approx(heavier.displacement[:, 0, 1], abs=1e-7)


SIDEWAYS = '\n[[loads]]\nnode = 20\ndirection = "{} deg"\nforce = "200 N"\n'
SWAYS = '\n[base]\nx = "{} m/s^2"\ny = "1 m/s^2"\nfrequency = "40 Hz"\n'


@pytest.mark.parametrize(
    "more", [SIDEWAYS.format(20), SWAYS.format(2), SIDEWAYS.format(-80) + SWAYS.format(-2)]
)
def test_energy_is_kept_and_the_work_is_booked(paper, more):
    model = build_drop_model(with_lines(paper, more), "quick")
    found = simulate_drop(model, DropCase(speed=300.0, duration=0.03, tolerance=1e-8))
    assert np.max(found.indentation) > 0.0
    assert found.certificate.energy_residual < 1e-6 * found.certificate.energy_scale
    still = simulate_drop(build_drop_model(paper, "quick"), DropCase(speed=300.0, duration=0.03))
    work = [drop.state[-1, model.layout.work_in] for drop in (found, still)]
    assert abs(work[0] - work[1]) > 1e-4


def test_a_mirrored_load_mirrors_the_drop(paper):
    quiet = paper.with_values({f"unbalance.{i}.amount": 0.0 for i in range(len(paper.unbalances))})
    drops = []
    for sign, angle in ((1.0, 20), (-1.0, 160)):
        model = build_drop_model(with_lines(quiet, SIDEWAYS.format(angle) + SWAYS.format(2 * sign)), "quick")
        drops.append(simulate_drop(model, DropCase(speed=sign * 300.0, duration=0.012)))
    mirrored = drops[0].displacement * np.array([-1.0, 1.0])
    assert np.max(np.abs(mirrored[..., 0])) > 1e-5
    assert drops[1].displacement == pytest.approx(mirrored, abs=2e-8)


def test_a_course_over_time_and_over_speed(paper):
    course = 'over_time = [{ time = "0 s", force = "10 N" }, { time = "0.1 s", force = "30 N" }]'
    squared = 'force = "50 N"\nspeed_exponent = 2'
    model = build_drop_model(with_lines(paper, down(course) + down(squared)), "quick")
    p, nominal = model.parameters, float(paper.speed.nominal)
    for t, expected in ((-1.0, 10.0), (0.05, 20.0), (0.1, 30.0), (9.0, 30.0)):
        assert load_now(p.load[0], p.load_points, t, nominal)[1] == pytest.approx(-expected, rel=1e-12)
    for speed, expected in ((nominal, 50.0), (-0.5 * nominal, 12.5), (0.0, 0.0)):
        assert load_now(p.load[1], p.load_points, 0.0, speed)[1] == pytest.approx(-expected, rel=1e-12)


def test_the_magnets_hold_the_load_before_the_release(paper):
    """The rotor starts where the controller holds it, and the magnets carry the load beside the weight."""
    plain, loaded = (
        build_drop_model(with_lines(paper, more), "quick") for more in ("", down('force = "100 N"'))
    )
    case = DropCase(speed=300.0, start=LevitatedStart(delay=0.01))
    (_, one), (_, other) = (start_of_drop(model, case) for model in (plain, loaded))
    more = np.sum(other.magnet - one.magnet, axis=0)
    assert more[3] == pytest.approx(100.0, rel=1e-6)  # holding force along y
    held = simulate_drop(loaded, replace(case, duration=0.009))
    assert np.max(np.abs(held.displacement - held.displacement[0])) < 2e-5


def test_a_study_varies_a_load_by_its_number(paper):
    machine = with_lines(paper, down('force = "100 N"')).with_values({"loads.0.force": "120 N"})
    assert float(machine.loads[0].force) == pytest.approx(120.0)
    assert loads_machine(machine_text(machine)) == machine


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (down('force = "-3 N"'), r"-3\.00 N is not allowed here"),
        (down(""), "a load needs either 'force' or 'over_time'"),
        (down('force = "3 N"').replace("node = 2", "node = 99"), "node 99 is outside the rotor"),
        (
            down('force = "3 N"').replace("-90 deg", "axial"),
            r"nothing stops the rotor that this load pushes towards higher nodes",
        ),
        (
            down('over_time = [{ time = "1 s", force = "1 N" }, { time = "1 s", force = "2 N" }]'),
            "time 1 s of point 2 does not exceed 1 s before it; order them",
        ),
        ('\n[base]\ny = "1 m/s^2"\n', "the sine of a base needs 'frequency' and an amplitude"),
        (
            '\n[base]\nz = "1 m/s^2"\nfrequency = "3 Hz"\n',
            "'z' is reserved for an axial acceleration of the ground",
        ),
        ("\n[base]\n", "a base needs either a sine"),
    ],
)
def test_what_does_not_fit_is_refused(paper, more, told):
    with pytest.raises(MachineFileError, match=told):
        with_lines(paper, more)


def test_an_estimate_with_loads_is_refused_and_says_what_to_do():
    from rotordrop.evidence.evidence import read_evidence
    from rotordrop.record.examples import example_record_path
    from rotordrop.record.record import read_record

    machine = with_lines(example_machine("lp400"), down('force = "100 N"'))
    record = read_record(example_record_path("lp400_drop_060"), machine)
    with pytest.raises(
        RecordError, match=r"has \[\[loads\]\], with which a record cannot be estimated yet.*Leave"
    ):
        read_evidence(build_drop_model(machine, "quick"), record)


def test_a_side_force_is_gravity_turned_and_its_work_is_booked(paper):
    """A tenth of the weight in +x: the whole rotor, however it bends, falls by a tenth as far to the side."""
    pushed = loads_machine(machine_text(paper.with_values({"side_force": 0.1})))
    assert float(pushed.side_force) == 0.1
    case = DropCase(speed=300.0, duration=0.03, tolerance=1e-8)
    drops = [simulate_drop(build_drop_model(machine, "quick"), case) for machine in (paper, pushed)]
    falling = drops[0].time < 0.006
    aside = drops[1].displacement[falling] - drops[0].displacement[falling]
    assert aside[..., 0] == pytest.approx(
        np.broadcast_to(0.05 * G * drops[0].time[falling, None] ** 2, aside[..., 0].shape),
        rel=1e-4,
        abs=1e-10,
    )
    assert np.max(np.abs(aside[..., 1])) < 1e-10
    assert np.max(drops[1].indentation) > 0.0
    assert drops[1].certificate.energy_residual < 1e-6 * drops[1].certificate.energy_scale
