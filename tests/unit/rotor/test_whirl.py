"""Modes: convergence, exact rigid ones, direction and damping of whirl, supports that relax."""

import math

import numpy as np
import pytest
from tests.unit.simulate.test_mount import O_RING, RIBBON, mounted

from rotordrop.elements.table import EXTENSIONS
from rotordrop.errors import SimulationError, UsageError
from rotordrop.physics.timoshenko import Section, round_section
from rotordrop.rotor.assembly import (
    PointMass,
    assemble,
    build_rotor_fe,
    free_free_modes,
    modal_damping_matrix,
    modes_on_springs,
)
from rotordrop.rotor.campbell import campbell_diagram, critical_speeds_json
from rotordrop.rotor.critical_speeds import critical_speed_map, critical_speeds
from rotordrop.rotor.machine_summary import summarise_machine
from rotordrop.rotor.reduction import Reduction, reduce_rotor
from rotordrop.rotor.suspension import (
    Relaxing,
    Support,
    equivalent_stiffness,
    in_series,
    link,
    spring,
    touchdown_supports,
)
from rotordrop.rotor.whirl import matrices_of, unbalance_response, whirl_modes

EXACT_FREE_FREE = (228.6965036678562, 622.9134501251403, 1200.6896615980231)
CLAMPED_FREE_FREE = (4.730040744862704, 7.853204624095838, 10.995607838001671)


def uniform(section, elements, length=1.0):
    return assemble(np.linspace(0.0, length, elements + 1), [section] * elements)


def orders(errors):
    return np.log2(np.abs(errors[:-1] / errors[1:]))


def test_frequencies_converge_at_the_known_orders():
    section = round_section(0.05, 0.0, 2.1e11, 0.3, 7850.0)
    errors = np.array(
        [free_free_modes(uniform(section, n), 5).frequency[2:] / EXACT_FREE_FREE - 1 for n in (24, 48, 96)]
    )
    assert np.all(errors > 0.0)
    assert orders(errors)[-1] == pytest.approx(2.0, abs=0.1)
    assert np.max(errors[-1]) < 3e-5
    section = Section(
        bending_stiffness=1.0, shear_stiffness=math.inf, mass=1.0, diametral_inertia=0.0, polar_inertia=0.0
    )
    exact = np.square(CLAMPED_FREE_FREE)
    errors = np.array([free_free_modes(uniform(section, n), 5).omega[2:] / exact - 1 for n in (8, 16, 32)])
    assert np.all(errors > 0.0)
    assert orders(errors)[-1] == pytest.approx(4.0, abs=0.2)


def test_modes_are_orthonormal_and_the_rigid_ones_exact(paper_fe):
    modes = free_free_modes(paper_fe)
    np.testing.assert_allclose(
        modes.shapes.T @ paper_fe.mass @ modes.shapes, np.eye(paper_fe.size), atol=1e-12
    )
    assert tuple(modes.omega[:2]) == (0.0, 0.0)
    assert np.all(np.diff(modes.omega[1:]) > 0.0)
    height, slope = modes.shapes[0::2, 1], modes.shapes[1::2, 1]
    np.testing.assert_allclose(np.diff(height), np.diff(paper_fe.node_positions) * slope[0], atol=1e-14)
    bending = modes.shapes[0::2, 2:]
    assert np.all(np.max(bending, axis=0) >= np.max(-bending, axis=0))


def test_springs_free_or_pin_the_rotor_and_raise_each_frequency_up_to_its_neighbour(overhung):
    """Rayleigh: two springs raise a mode at most over the second next one of the free rotor."""
    free = free_free_modes(overhung).frequency
    assert modes_on_springs(overhung, {2: 1.0, 8: 1.0}).frequency[2:6] == pytest.approx(free[2:6], rel=1e-5)
    pinned = modes_on_springs(overhung, {2: 1e13, 8: 1e13})
    deflection = np.abs(pinned.shapes[[2, 14], :3]) / np.max(np.abs(pinned.shapes[0::2, :3]), axis=0)
    assert np.max(deflection) < 1e-4
    free = free_free_modes(overhung).omega
    softer, stiffer = (modes_on_springs(overhung, {2: k, 8: k}).omega for k in (1e6, 1e8))
    assert np.all(stiffer[:10] > softer[:10])
    assert np.all(stiffer[:10] < free[2:12])


def test_modes_are_damped_and_a_shaft_without_mass_has_rigid_ones_only(paper_fe):
    modes = free_free_modes(paper_fe)
    projected = modes.shapes.T @ modal_damping_matrix(paper_fe) @ modes.shapes
    np.testing.assert_allclose(projected, np.diag(2 * 0.005 * modes.omega), atol=1e-9)
    section = round_section(0.1, 0.0, 2e11, 0.3, 0.0)
    body = PointMass(node=2, mass=50.0, polar_inertia=1.0, diametral_inertia=2.0)
    rotor = assemble([0.0, 0.2, 0.4], [section] * 2, [body])
    assert free_free_modes(rotor, 2).shapes[0, 0] == pytest.approx(1 / math.sqrt(50.0))
    with pytest.raises(SimulationError, match="neither mass nor inertia at node 1"):
        free_free_modes(rotor)


@pytest.mark.parametrize("count", [1, 73])
def test_too_few_or_too_many_modes_are_refused(paper_fe, count):
    with pytest.raises(
        SimulationError, match=rf"{count} modes per plane .* this rotor has 72.*Choose 2 to 72"
    ):
        free_free_modes(paper_fe, count)


EVEN = [spring(2, 2e7), spring(8, 2e7)]
UNEVEN = [spring(2, (2e7, 1.2e7), (300.0, 100.0)), spring(8, [[2e7, 3e6], [1e6, 1.5e7]], 200.0)]
SPEED = 900.0


def test_spin_parts_the_undamped_pairs_into_backward_below_and_forward_above(overhung):
    modes = whirl_modes(overhung, 0.0, EVEN, 8)
    expected = modes_on_springs(overhung, {2: 2e7, 8: 2e7}, 4).omega
    assert modes.eigenvalue.imag == pytest.approx(np.repeat(expected, 2), rel=1e-8)
    assert np.max(np.abs(modes.damping_ratio)) < 1e-8
    rest, spin = (whirl_modes(overhung, speed, EVEN, 8) for speed in (0.0, SPEED))
    assert spin.direction[:4] == ("backward", "forward", "backward", "forward")
    assert np.all(spin.frequency[0:4:2] < rest.frequency[0:4:2])
    assert np.all(spin.frequency[1:4:2] > rest.frequency[1:4:2])
    assert np.abs(spin.whirl) == pytest.approx(np.ones(8), abs=1e-9)


def test_forward_is_with_the_spin_in_sign_and_shape(overhung):
    """The mirror image: the same frequencies, x turned round, forward still with the spin."""
    with_spin, against = (
        whirl_modes(overhung, speed, UNEVEN_MIRRORED[k], 8) for k, speed in enumerate((SPEED, -SPEED))
    )
    assert against.eigenvalue == pytest.approx(with_spin.eigenvalue, rel=1e-9)
    assert against.whirl == pytest.approx(with_spin.whirl, abs=1e-7)
    np.testing.assert_allclose(np.abs(against.shapes), np.abs(with_spin.shapes), atol=1e-6)
    modes = whirl_modes(overhung, SPEED, EVEN, 2)
    for sign, shape in zip((-1, 1), modes.shapes, strict=True):
        moved = shape[np.abs(shape[:, 0]) > 0.1]
        np.testing.assert_allclose(moved[:, 1] / moved[:, 0], -1j * sign, atol=1e-7)
    flat = [spring(2, (2e7, 1e7)), spring(8, (2e7, 1e7))]
    slow, fast = (whirl_modes(overhung, speed, flat, 2) for speed in (1.0, 5000.0))
    assert slow.direction == ("mixed", "mixed")
    assert fast.direction == ("backward", "forward")


UNEVEN_MIRRORED = (
    UNEVEN,
    [spring(2, (2e7, 1.2e7), (300.0, 100.0)), spring(8, [[2e7, -3e6], [-1e6, 1.5e7]], 200.0)],
)


def test_eigenpairs_solve_the_equations_of_the_full_and_the_reduced_rotor(overhung):
    modes = whirl_modes(overhung, SPEED, UNEVEN, 6)
    system = matrices_of(overhung, UNEVEN)
    coupling = system.damping + SPEED * system.gyroscopic
    for value, vector in zip(modes.eigenvalue, modes.vectors.T, strict=True):
        forces = [value**2 * system.mass @ vector, value * coupling @ vector, system.stiffness @ vector]
        assert np.linalg.norm(sum(forces)) < 1e-6 * np.linalg.norm(forces[2])
    full = whirl_modes(overhung, SPEED, UNEVEN, 6)
    reduced = whirl_modes(reduce_rotor(overhung, "accurate", (2, 8)), SPEED, UNEVEN, 6)
    assert reduced.eigenvalue == pytest.approx(full.eigenvalue, rel=1e-5)
    np.testing.assert_allclose(np.abs(reduced.shapes), np.abs(full.shapes), atol=1e-4)


def test_the_free_rotor_precesses_at_the_ratio_of_its_inertias_with_its_modal_damping(overhung, paper_fe):
    modes = whirl_modes(overhung, 20.0, (), 1)
    expected = 20.0 * overhung.polar_inertia / overhung.diametral_inertia
    assert modes.eigenvalue[0].imag == pytest.approx(expected, rel=2e-4)
    assert modes.direction == ("forward",)
    modes = whirl_modes(reduce_rotor(paper_fe, "quick", (4, 26)), 0.0)
    assert modes.damping_ratio[:8] == pytest.approx([0.005] * 8, rel=1e-6)
    assert modes.frequency[0] == pytest.approx(187.305, abs=0.01)


def test_foundations_are_ground_or_a_series_and_overdamped_ones_no_mode(overhung):
    soft, stiff = link(3e7), link(6e7)
    heavy = [Support(node=n, links=(soft, stiff), masses=(1e9,)) for n in (2, 8)]
    light = [Support(node=n, links=(soft, stiff), masses=(1e-4,)) for n in (2, 8)]
    on_ground = whirl_modes(overhung, SPEED, [spring(n, 3e7) for n in (2, 8)], 4)
    in_row = whirl_modes(overhung, SPEED, [spring(n, in_series(3e7, 6e7)) for n in (2, 8)], 4)
    # the foundation itself swings slower than 0.05 Hz and is left out
    assert whirl_modes(overhung, SPEED, heavy, 4).frequency == pytest.approx(on_ground.frequency, rel=1e-6)
    assert whirl_modes(overhung, SPEED, light, 4).frequency == pytest.approx(in_row.frequency, rel=1e-5)
    section = round_section(0.1, 0.0, 2e11, 0.3, 0.0)
    body = PointMass(node=2, mass=50.0, polar_inertia=1.0, diametral_inertia=1.0)
    rotor = reduce_rotor(
        assemble([0.0, 0.2, 0.4], [section] * 2, [body]), Reduction(modes=2, attachment=False)
    )
    assert len(whirl_modes(rotor, 0.0, [spring(1, 1e5), spring(3, 1e5)]).frequency) == 4
    assert len(whirl_modes(rotor, 0.0, [spring(1, 1e5, 1e5), spring(3, 1e5, 1e5)]).frequency) == 0


def test_what_cannot_whirl_is_refused():
    section = round_section(0.1, 0.0, 2e11, 0.3, 0.0)
    rotor = assemble([0.0, 0.2, 0.4], [section] * 2, [PointMass(node=2, mass=1.0)], modal_damping=0.0)
    with pytest.raises(SimulationError, match="nodes without mass or inertia"):
        whirl_modes(rotor, 0.0, [spring(1, 1e5), spring(3, 1e5)])
    with pytest.raises(UsageError, match="node 3 has 2 links and 0 masses"):
        Support(node=3, links=(link(1.0), link(1.0)))
    with pytest.raises(UsageError, match=r"node 3 has the masses \(0\.0,\) kg; they must be positive"):
        Support(node=3, links=(link(1.0), link(1.0)), masses=(0.0,))
    with pytest.raises(UsageError, match=r"not by shape \(3,\)"):
        link([1.0, 2.0, 3.0])
    assert in_series(2.0, 0.0) == 0.0


BRANCHES = (Relaxing(stiffness=4e7, time=3e-3), Relaxing(stiffness=6e7, time=3e-4))


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


def test_branches_give_their_stiffness_at_each_frequency(basis):
    def frequencies(branches, stiffness=1e8):
        return whirl_modes(basis, SPEED, held(branches, stiffness), 6).frequency

    slow = frequencies((Relaxing(stiffness=4e7, time=1e4),))
    assert slow == pytest.approx(frequencies((), 1.4e8), rel=1e-6)
    fast = frequencies((Relaxing(stiffness=4e7, time=1e-12),))
    assert fast == pytest.approx(frequencies(()), rel=1e-6)
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


def test_a_ribbon_sticks_and_a_stop_holds_where_the_support_is_pressed_shut():
    plain = equivalent_stiffness(mounted())[1]
    assert equivalent_stiffness(mounted(RIBBON))[1].support == plain.support + 6e7
    near = mounted(f'{{ kind = "stop", gap = "{0.5 * plain.load / plain.support!r} m" }}')
    assert equivalent_stiffness(near)[1].support == plain.support + 5e8
    last = touchdown_supports(near)[1].links[-1].stiffness
    assert plain.support < last[0, 0] < last[1, 1] == plain.support + 5e8
    far = mounted('{ kind = "stop", gap = "1 mm" }')
    assert equivalent_stiffness(far)[1] == plain
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


def test_the_document_says_what_the_mount_is_at_its_frequencies():
    machine = mounted(O_RING)
    maps = {w: critical_speed_map(machine, [1e7, 1e8], whirl=w) for w in ("standstill", "forward")}
    diagrams = {"touchdown bearings": campbell_diagram(machine, [0.0, 300.0, 600.0])}
    part = critical_speeds_json(maps, diagrams)["maps"]["forward"]["bearings"]["DE"]
    dynamic = maps["forward"].lines[1].dynamic(maps["forward"].at_lines["with support mass"][0])
    assert part["support_at_lines_N_m"][0] == dynamic.real > part["support_N_m"]
    assert part["loss_factor_at_lines"][0] == dynamic.imag / dynamic.real
