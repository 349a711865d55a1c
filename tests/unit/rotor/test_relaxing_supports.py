"""Critical speeds and damped modes on mounts whose stiffness goes with the frequency."""

from __future__ import annotations

import numpy as np
import pytest
from tests.unit.simulate.test_mount import O_RING, RIBBON, mounted

from rotordrop.elements.table import EXTENSIONS
from rotordrop.report.critical_speeds_page import critical_speeds_json, critical_speeds_page
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop.rotor.campbell import campbell_diagram
from rotordrop.rotor.critical_speeds import critical_speed_map, critical_speeds
from rotordrop.rotor.machine_summary import summarise_machine
from rotordrop.rotor.reduction import reduce_rotor
from rotordrop.rotor.suspension import (
    Relaxing,
    Support,
    equivalent_stiffness,
    link,
    touchdown_supports,
)
from rotordrop.rotor.whirl import matrices_of, unbalance_response, whirl_modes

BRANCHES = (Relaxing(stiffness=4e7, time=3e-3), Relaxing(stiffness=6e7, time=3e-4))
SPEED = 900.0


@pytest.fixture(scope="module")
def basis(paper_fe):
    return reduce_rotor(paper_fe, "quick", [4, 26])


def held(branches, stiffness=1e8):
    return [
        Support(node=node, links=(link(5e8), link(stiffness, 1e3, branches)), masses=(20.0,))
        for node in (4, 26)
    ]


def test_modes_solve_the_problem_with_the_complex_stiffness_at_their_frequency(basis):
    supports = held(BRANCHES)
    modes, system = whirl_modes(basis, SPEED, supports, 8), matrices_of(basis, supports)
    assert np.max(modes.damping_ratio) > 0.05
    for value, vector in zip(modes.eigenvalue, modes.vectors.T, strict=True):
        inertia = value**2 * system.mass @ vector
        rest = value * (system.damping + SPEED * system.gyroscopic) @ vector
        rest = rest + system.stiffness_at(value) @ vector
        assert np.linalg.norm(inertia + rest) < 1e-7 * np.linalg.norm(inertia)


def test_branches_too_slow_are_springs_and_too_fast_are_nothing(basis):
    def frequencies(branches, stiffness=1e8):
        return whirl_modes(basis, SPEED, held(branches, stiffness), 6).frequency

    slow = frequencies((Relaxing(stiffness=4e7, time=1e4),))
    assert slow == pytest.approx(frequencies((), 1.4e8), rel=1e-6)
    fast = frequencies((Relaxing(stiffness=4e7, time=1e-12),))
    assert fast == pytest.approx(frequencies(()), rel=1e-6)


def test_the_response_has_the_stiffness_of_its_speed(basis):
    omega = 700.0
    s = sum(branch.stiffness_at(1j * omega) for branch in BRANCHES)
    plain = [
        Support(node=node, links=(link(5e8), link(1e8 + s.real, 1e3 + s.imag / omega)), masses=(20.0,))
        for node in (4, 26)
    ]
    one, other = (
        unbalance_response(basis, [omega], {10: 1e-4}, supports) for supports in (held(BRANCHES), plain)
    )
    assert one == pytest.approx(other, rel=1e-9, abs=1e-18)


def test_every_line_of_the_map_has_the_stiffness_of_its_own_frequency():
    machine = mounted(O_RING)
    found = critical_speed_map(machine, [1e8], whirl="forward", count=4)
    fe, masses = build_rotor_fe(machine), [float(b.support.mass) for b in machine.touchdown_bearings]
    rest = critical_speed_map(mounted(), [1e8], whirl="forward", count=4).at_lines["with support mass"]
    for k, hertz in enumerate(found.at_lines["with support mass"]):
        supports = [
            Support(node=p.node, links=(link(p.tangent), link(p.dynamic(hertz).real)), masses=(mass,))
            for p, mass in zip(found.lines, masses, strict=True)
        ]
        assert critical_speeds(fe, supports, whirl="forward")[k] == pytest.approx(hertz, rel=1e-7)
    assert np.max(found.at_lines["with support mass"] / rest) > 1.05


def test_a_ribbon_sticks_and_a_stop_holds_where_the_load_presses_it_shut():
    plain = equivalent_stiffness(mounted())[1]
    assert equivalent_stiffness(mounted(RIBBON))[1].support == plain.support + 6e7
    near = mounted(f'{{ kind = "stop", gap = "{0.5 * plain.load / plain.support!r} m" }}')
    assert equivalent_stiffness(near)[1].support == plain.support + 5e8
    last = touchdown_supports(near)[1].links[-1].stiffness
    assert plain.support < last[0, 0] < last[1, 1] == plain.support + 5e8
    far = mounted('{ kind = "stop", gap = "1 mm" }')
    assert equivalent_stiffness(far)[1] == plain


def test_a_stop_is_pressed_by_the_support_and_not_by_its_foundation():
    plain = equivalent_stiffness(mounted())[1]
    stop = f'{{ kind = "stop", gap = "{1.5 * plain.load / plain.support!r} m" }}'
    foundation = next(one for one in EXTENSIONS if one.name == "foundation mode").added_to(mounted(stop))
    assert equivalent_stiffness(foundation)[1].support == plain.support


@pytest.mark.parametrize("mount", [RIBBON, O_RING])
def test_the_summary_of_a_machine_has_the_stiffness_of_the_map(mount):
    machine = mounted(mount)
    summary, parts = summarise_machine(machine), equivalent_stiffness(machine)
    for told, part in zip(summary.bearings, parts, strict=True):
        assert (told.tangent_stiffness, told.equivalent_stiffness) == (part.tangent, part.equivalent())


def test_the_stiffness_at_a_frequency_is_that_of_springs_that_relax():
    """50 Hz, and branches whose times are near one radian of it."""
    part = equivalent_stiffness(mounted(O_RING))[1]
    turn = 2.0 * np.pi * 50.0
    stored, lost = part.support, 0.0
    for branch in part.branches:
        way = turn * branch.time
        stored += branch.stiffness * way**2 / (1.0 + way**2)
        lost += branch.stiffness * way / (1.0 + way**2)
    assert part.dynamic(50.0) == pytest.approx(complex(stored, lost), rel=1e-12)
    assert lost > 0.01 * stored


def test_page_and_document_say_what_the_mount_is_at_its_frequencies():
    machine = mounted(O_RING)
    maps = {w: critical_speed_map(machine, [1e7, 1e8], whirl=w) for w in ("standstill", "forward")}
    diagrams = {"touchdown bearings": campbell_diagram(machine, [0.0, 300.0, 600.0])}
    page = critical_speeds_page(machine, maps, diagrams)
    (text,) = [one.text for one in page.verdict if "the mount relaxes" in one.text]
    assert text.startswith("DE: ") and "loss factor" in text
    part = critical_speeds_json(maps, diagrams, ())["maps"]["forward"]["bearings"]["DE"]
    dynamic = maps["forward"].lines[1].dynamic(maps["forward"].at_lines["with support mass"][0])
    assert part["support_at_lines_N_m"][0] == dynamic.real > part["support_N_m"]
    assert part["loss_factor_at_lines"][0] == dynamic.imag / dynamic.real
