"""Drops on soft mounts: the description reaches the kernel, the derivative is right, energy closes."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.unit.simulate.test_right_hand_side import SPEED, a_state, assert_jacobian

from rotordrop import DropCase, Known, simulate_drop
from rotordrop.cli.app import run
from rotordrop.errors import MachineFileError, UsageError
from rotordrop.estimate.simulated_drop import simulation_numbers
from rotordrop.machine import example_path, load_machine, loads_machine
from rotordrop.machine.plausibility import doubts
from rotordrop.machine.saving import machine_text, save_machine
from rotordrop.physics import columns as L
from rotordrop.report.simulate_page import simulate_summary
from rotordrop.rotor.machine_summary import summarise_machine
from rotordrop.rotor.parameters import build_drop_model, sag_of_model
from rotordrop.rotor.unknowns import structure_unknowns
from rotordrop.simulate.losses import losses
from rotordrop.simulate.used import ribbon_uses
from rotordrop.twin.tracked_parameters import never_used_up

STOP = '{ kind = "stop", gap = "8 um", stiffness = "5e8 N/m" }'
RIBBON = '{ kind = "ribbon", friction_stiffness = "6e7 N/m", slip_force = "1.5 kN" }'
O_RING = (
    '{ kind = "maxwell", branches = [{ stiffness = "4e7 N/m", time = "3 ms" }, '
    '{ stiffness = "6e7 N/m", time = "0.3 ms" }] }'
)
FOUNDATION = {"share": 0.1, "frequency": 600.0, "damping_ratio": 0.03}
FOUNDATION = {f"DE.support.foundation_{name}": value for name, value in FOUNDATION.items()}
TEXT = example_path("small").read_text(encoding="utf-8")
HEAD = '[[touchdown_bearings]]\nname = "DE"'


def mounted(*elements, text=TEXT):
    """The small machine with a mount under its DE bearing."""
    assert HEAD in text
    return loads_machine(text.replace(HEAD, f"{HEAD}\nmount = [{', '.join(elements)}]"))


ELEMENT = r"touchdown_bearings\[2\]\.mount\[1\]"


def relaxing(*times):
    """Branches of equal stiffness with relaxation times [ms]."""
    branches = ", ".join(f'{{ stiffness = "4e6 N/m", time = "{time} ms" }}' for time in times)
    return f'{{ kind = "maxwell", branches = [{branches}] }}'


@pytest.fixture(scope="module")
def small():
    return load_machine(example_path("small"))


@pytest.mark.parametrize("elements", [(STOP,), (RIBBON,), (O_RING,), (STOP, RIBBON, O_RING)])
@pytest.mark.parametrize("foundation", [False, True])
def test_jacobian_agrees_with_finite_differences(elements, foundation):
    machine = mounted(*elements)
    if foundation:
        machine = machine.with_values(FOUNDATION)
    model = build_drop_model(machine, "quick")
    state = a_state(model, np.array([-40e-6, 15e-6]), 0.98)
    state[model.layout.support][-2:] = 9e-6, -4e-6  # beyond the stop
    states = model.layout.further_at(L.MOUNT_STATES)
    state[states] = np.resize([4e-6, -3e-6, 2e-6, 1e-6], states.stop - states.start)
    assert_jacobian(model, state)


def test_energy_closes_a_stop_takes_what_the_spring_leaves_and_out_of_reach_changes_nothing(small):
    case = DropCase(speed=SPEED, duration=0.03)
    plain = simulate_drop(small, case)
    far = simulate_drop(mounted('{ kind = "stop", gap = "5 mm" }'), case)
    near = simulate_drop(mounted(STOP, RIBBON, O_RING), case)
    assert np.array_equal(plain.displacement, far.displacement)
    assert not np.array_equal(plain.displacement, near.displacement)
    assert near.certificate.energy_residual < 1e-6 * near.certificate.energy_scale
    load = float(build_drop_model(small, "quick").load_shares[1])
    spring = float(small.touchdown_bearings[1].support.stiffness)
    gap = 0.5 * load / spring
    held = sag_of_model(build_drop_model(mounted(f'{{ kind = "stop", gap = "{gap!r} m" }}'), "quick"))
    assert spring * held.support[1] + 5e8 * (held.support[1] - gap) == pytest.approx(load, rel=1e-12)


def test_mounts_are_read_again_varied_and_estimated():
    machine = mounted(STOP, RIBBON, O_RING)
    assert loads_machine(machine_text(machine)).touchdown_bearings == machine.touchdown_bearings
    machine = mounted('{ kind = "stop", gap = { guess = "20 um", range = ["10 um", "40 um"] } }')
    (gap,) = [one for one in structure_unknowns(build_drop_model(machine, "quick")) if "gap" in one.path]
    assert gap.path == "DE.mount.stop.gap"
    assert np.exp(gap.mean + 1.645 * gap.sigma) == pytest.approx(40e-6, rel=1e-3)
    machine = mounted(O_RING.replace('"3 ms"', '{ guess = "3 ms", range = ["2 ms", "4 ms"] }'))
    model = build_drop_model(machine, "quick")
    paths = {one.path: one for one in structure_unknowns(model) if "maxwell" in one.path}
    assert sorted(paths) == [f"DE.mount.maxwell.{k}.{name}" for k in (0, 1) for name in ("stiffness", "time")]
    assert paths["DE.mount.maxwell.0.time"].sigma > 100.0 * paths["DE.mount.maxwell.1.time"].sigma
    other = model.with_values({"DE.mount.maxwell.1.stiffness": 5e7})
    changed = np.flatnonzero(other.parameters.bearing[1] != model.parameters.bearing[1])
    assert changed == paths["DE.mount.maxwell.1.stiffness"].targets[0].entry.column
    with pytest.raises(UsageError, match="counted from 0"):
        machine.with_values({"DE.mount.maxwell.2.time": 1e-3})


@pytest.mark.parametrize("foundation", [False, True])
def test_a_stop_that_was_never_reached_is_larger_than_the_way_seen(foundation):
    machine = mounted('{ kind = "stop", gap = { guess = "20 um", range = ["10 um", "40 um"] } }')
    if foundation:
        machine = machine.with_values(FOUNDATION)
    model = build_drop_model(machine, "quick")
    unknowns = {one.path: one for one in structure_unknowns(model)}
    gap, means = unknowns["DE.mount.stop.gap"], np.zeros((5, model.layout.size))
    means[2, model.layout.support] = 90e-6, 0.0, 9e-6, -12e-6
    if foundation:
        means[2, model.layout.further_at(L.BEARING_OWN)] = 3e-6, -4e-6, 0.0, 0.0
    fitted = Known(value=19e-6, status="determined", interval_90=(8e-6, 35e-6), unit="m")
    found = never_used_up(SimpleNamespace(model=model), means, gap, fitted)
    assert found.status == "the record does not determine it"
    assert found.lower == pytest.approx(10e-6 if foundation else 15e-6, rel=1e-12)
    assert found.interval_90 == (found.lower, 35e-6) and found.value == 19e-6
    means[2] *= 2.0
    assert never_used_up(SimpleNamespace(model=model), means, gap, fitted) is fitted
    other = unknowns["DE.mount.stop.stiffness"]
    assert never_used_up(SimpleNamespace(model=model), means, other, fitted) is fitted


@pytest.mark.parametrize(
    ("element", "message"),
    [
        ('{ kind = "stop" }', r"gap"),
        ('{ kind = "stop", gap = "0 um" }', rf"^142:33: {ELEMENT}\.gap: .*a length must be positive"),
        ('\n{ kind = "stop", gap = "9 um" },\n{ kind = "ribbon", slip_force = "0 N" }', r"^144:33: .*515 N"),
        (
            '\n{ kind = "maxwell", branches = [\n{ stiffness = "4e6 N/m", time = "30 ms" },\n'
            '{ stiffness = "4e6 N/m", time = "40 ms" }] }',
            r"^145:33: touchdown_bearings\[2\]\.mount\[1\]\.branches\[2\]\.time: .*descend",
        ),
        (relaxing(8, 4, 2, 1), r"4 branches; 3 .* are the most: join the two whose times are closest"),
        ('{ kind = "stop", gap = "9 um" }, { kind = "stop", gap = "8 um" }', "two elements 'stop'; keep one"),
        ('{ kind = "rubber" }', "'rubber' is no element of a mount; its kind is one of spring, ribbon"),
        ('{ kind = "spring", gap = "20 um" }', r"a spring has no 'gap'"),
        ('{ kind = "ribbon", stiffness = "2e7 N/m" }', r"has a 'stiffness' already, and so does this ribbon"),
        (relaxing(3, 30), r"the relaxation times do not descend: .*3.00 ms and 30.0 ms"),
    ],
)
def test_mounts_that_cannot_be_are_refused(element, message):
    with pytest.raises(MachineFileError, match=message):
        mounted(element)


def test_mounts_are_read_where_they_stand_and_name_their_states():
    start = TEXT.index(HEAD)
    lines = [line for line in TEXT[start:].splitlines() if not line.startswith('stiffness = { guess = "8e7')]
    with pytest.raises(MachineFileError, match=r"'slip_force' but no stiffness; give its 'friction_st"):
        mounted('{ kind = "ribbon", slip_force = "1.5 kN" }', text=TEXT[:start] + "\n".join(lines))
    with pytest.raises(MachineFileError, match=rf"^142:41: {ELEMENT}\.stiffness: -10"):
        mounted('{ kind = "spring", stiffness = "-10 MN/m" }', text=TEXT[:start] + "\n".join(lines))
    at = TEXT.index("[touchdown_bearings.support]", TEXT.index(HEAD)) + len("[touchdown_bearings.support]\n")
    told = (
        r"'mount' is no key of 'support'; .* 'touchdown_bearings': write it above the header of .* 'support'"
    )
    with pytest.raises(MachineFileError, match=told):
        loads_machine(f"{TEXT[:at]}mount = [{STOP}]\n{TEXT[at:]}")
    machine = mounted(RIBBON, O_RING)
    machine = machine.with_values(FOUNDATION)
    names = build_drop_model(machine, "quick").layout.names(machine.touchdown_bearings)
    assert not [name for name in names if name.startswith("further state")]
    for name in ("mount DE ribbon x", "mount DE branch 2 y", "foundation DE y velocity"):
        assert names.count(name) == 1


def test_ribbons_say_what_they_bore_and_whether_they_slipped():
    slack = RIBBON.replace("1.5 kN", "150 N")
    machine = mounted(slack)
    drop = simulate_drop(machine, DropCase(speed=SPEED, duration=0.03, output_step=2e-6, reduction="quick"))
    (use,) = ribbon_uses(machine, drop)
    model = build_drop_model(machine, "quick")
    support, v = machine.bearing("DE").support, drop.state[:, model.layout.velocity_of(model.layout.support)]
    damped = support.damping_horizontal.value * v[:, 2] ** 2 + support.damping.value * v[:, 3] ** 2
    by_damper = float(np.trapezoid(damped, drop.time))
    assert use.dissipated > 0.1 * by_damper
    assert use.dissipated + by_damper == pytest.approx(losses(model, drop).support[1], rel=5e-3)
    assert 0.95 < use.share < 1.001 and 0.0 < use.slipped < 0.03 and use.first_slip > 0.0
    numbers = simulation_numbers(drop, machine)["ribbons"]["DE"]
    assert numbers["dissipated_J"] == use.dissipated and numbers["slip_force_N"] == pytest.approx(150.0)
    (said,) = [one.text for one in simulate_summary(drop, machine).verdict if "ribbon" in one.text]
    assert said.startswith("DE: the ribbon of the mount bore at most ") and " and slipped for " in said
    machine = mounted(RIBBON.replace("1.5 kN", "15 kN"))
    drop = simulate_drop(machine, DropCase(speed=SPEED, duration=0.02, reduction="quick"))
    (use,) = ribbon_uses(machine, drop)
    assert use.slipped == 0.0 and np.isnan(use.first_slip)
    assert simulation_numbers(drop, machine)["ribbons"]["DE"]["first_slip_s"] is None


MISTYPED = RIBBON.replace("6e7", "2e12").replace("1.5 kN", "300 N")


def test_a_mistyped_ribbon_is_doubted_and_a_drop_breaks_off(tmp_path):
    machine = mounted(MISTYPED, STOP)
    kinds = {doubt.kind: doubt for doubt in doubts(machine)}
    assert kinds["slip of the ribbon"].value == pytest.approx(1.5e-10)
    assert "ribbon stiffness" in kinds
    assert not doubts(mounted(RIBBON, O_RING, STOP))
    file = tmp_path / "machine.toml"
    save_machine(machine, file)
    out = ["--report", str(tmp_path / "drop.html"), "--duration", "100 ms"]
    assert run(["simulate", str(file), "--speed", "300 Hz", *out]) == 5
    assert (tmp_path / "drop.html").exists()


def test_a_summary_counts_a_ribbon_with_its_support_and_a_stop_pressed_shut():
    machine = mounted(RIBBON, STOP.replace("8 um", "80 um"))
    summary = summarise_machine(machine)
    support, rest = machine.bearing("DE").support, summary.bearings[1]
    stiffness = support.stiffness.value + 6e7
    assert rest.support_frequency == pytest.approx(np.sqrt(stiffness / support.mass.value) / (2.0 * np.pi))
    in_series = 1.0 / (1.0 / stiffness + 1.0 / rest.tangent_stiffness)
    assert rest.equivalent_stiffness == pytest.approx(in_series)
    pressed = summarise_machine(mounted('{ kind = "stop", gap = "0.3 um" }')).bearings[1]
    assert pressed.beside_support == ("a stop pressed shut",)
