"""Drops with magnets in the control loop: they hold, fail, lift again; energy closes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.simulate.looped import CONTROLLER, MAGNET, looped_machine

from rotordrop import build_drop_model, example_machine, load_result, simulate_drop
from rotordrop.errors import SimulationError, UsageError
from rotordrop.physics import magnet as law
from rotordrop.physics.magnet_loop import sampled_pid
from rotordrop.rotor.magnet_loop import stability
from rotordrop.simulate import _sampled
from rotordrop.simulate._loop import Control
from rotordrop.simulate._run import Run, Setup, error_scale, follow
from rotordrop.simulate.case import CentredStart, DropCase, LevitatedStart, MagnetEvent
from rotordrop.simulate.losses import losses

OFF, AGAIN = MagnetEvent(action="off", time=0.01), MagnetEvent(action="levitate", time=0.1)


@pytest.fixture(scope="module")
def model():
    return build_drop_model(looped_machine(), loops=True)


def case_of(*events, duration=0.02, **more):
    known = {"speed": "60 Hz", "start": LevitatedStart(), "output_step": 5e-5}
    return DropCase(duration=duration, magnets=events, **known | more)


def test_controllers_hold_the_rotor_alike_with_shorter_steps_and_as_a_state_space(model):
    levitated = simulate_drop(model, case_of())
    assert len(levitated.contacts) == 0
    weight = model.machine.rotor.mass * float(model.machine.gravity)
    up = np.mean(levitated.magnets.force[:, :, 1].sum(axis=1))
    assert up == pytest.approx(weight, rel=0.01)
    assert np.max(np.abs(levitated.displacement)) < 10e-6
    result = simulate_drop(model, case_of(largest_step=7e-6))
    assert result.steps > 1.5 * levitated.steps
    assert result.displacement == pytest.approx(levitated.displacement, abs=2e-9)
    pid = sampled_pid((14600.0, 3e5, 30.0), 2.0 * math.pi * 5000.0, 5e-5, 0.0)
    matrices = {"kind": "state_space", "a": pid.step.tolist(), "b": pid.input.tolist()}
    matrices |= {"c": pid.output.tolist(), "d": pid.direct, "sample_time": "50 us", "delay": "50 us"}
    paper = example_machine("paper")
    machine = paper.changed(ambs=tuple(amb.changed(magnet=MAGNET, controller=matrices) for amb in paper.ambs))
    result = simulate_drop(machine, case_of())
    assert result.displacement == pytest.approx(levitated.displacement, abs=1e-12)


def test_a_released_rotor_falls_is_lifted_again_and_the_books_close(model, tmp_path):
    lifted = simulate_drop(model, case_of(OFF, AGAIN, duration=0.3))
    assert lifted.certificate.energy_residual < 1e-6 * lifted.certificate.energy_scale
    split = losses(model, lifted)
    assert split.coils > 1.0
    assert split.total == pytest.approx(lifted.state[-1, model.layout.dissipated], rel=1e-9)
    before = lifted.time < 0.1
    assert np.max(np.abs(lifted.displacement[before])) > 275e-6
    assert lifted.magnets.event_time == pytest.approx([0.01, 0.1], abs=1e-12)
    lift = lifted.lift
    assert lift.succeeded
    assert 0.1 <= lift.free_from < 0.2
    assert np.max(np.abs(lifted.displacement[-1])) < 60e-6
    lifted.save(tmp_path / "drop.h5")
    read = load_result(tmp_path / "drop.h5")
    assert read.magnets.events == ("off", "levitate")
    assert read.lift == lifted.lift
    assert np.array_equal(read.magnets.current, lifted.magnets.current)


def test_a_lift_needs_time_and_from_dead_coils_no_release(model):
    result = simulate_drop(model, case_of(OFF, AGAIN, duration=0.102))
    assert not result.lift.succeeded
    result = simulate_drop(
        model, case_of(MagnetEvent(action="levitate", time=0.005), start=CentredStart(), duration=0.05)
    )
    assert result.magnets.current[0] == pytest.approx(np.zeros((2, 2, 2)))
    assert result.lift.succeeded


def test_coils_that_are_lost_or_shorted_lose_their_current(model):
    lost = MagnetEvent(action="lost", time=0.0, magnet="DE", axis="y")
    result = simulate_drop(model, case_of(lost))
    gone, other = result.magnets.current[-1, 1, 1], result.magnets.current[-1, 0, 1]
    assert gone == pytest.approx([4.0, 4.0], abs=1e-3)
    assert abs(other[0] - other[1]) > 0.1
    assert np.min(result.displacement[:, 1, 1]) < -100e-6
    hold = MagnetEvent(action="hold", time=0.003)
    result = simulate_drop(model, case_of(hold, duration=0.01))
    after = result.magnets.current[result.time > 0.005]
    assert np.ptp(after, axis=0) == pytest.approx(np.zeros((2, 2, 2)), abs=1e-4)
    assert after[0, 0, 1, 0] - after[0, 0, 1, 1] > 0.1  # not the bias alone
    result = simulate_drop(model, case_of(MagnetEvent(action="bias decays", time=0.0)))
    total = result.magnets.current[:, 0, 0].sum(axis=1)
    constant = model.machine.ambs[0].magnet.inductance / 0.5
    # the rotor falls and moves the flux of y; across it hardly moves
    assert total[-1] / total[0] == pytest.approx(math.exp(-result.time[-1] / constant), rel=0.01)


def test_events_by_speed_and_at_rest_happen_on_a_sample(model):
    slow = MagnetEvent(action="lost", below_speed=2.0 * math.pi * 59.9)
    quiet = MagnetEvent(action="levitate", rest_velocity=10.0)
    result = simulate_drop(model, case_of(OFF, slow, quiet, duration=0.06))
    released, slowed, rested = result.magnets.event_time
    assert released == 0.01
    reached = round(slowed / 5e-5)
    assert result.speed[reached] <= 2.0 * math.pi * 59.9 < result.speed[reached - 1]
    assert rested == pytest.approx(slowed + 0.02, abs=6e-5)
    assert slowed == pytest.approx(5e-5 * reached, abs=1e-9)


def test_tracking_bounds_the_integral_of_a_rotor_that_lies_on_its_race():
    def integral_after(tracking):
        controller = sampled_pid((14600.0, 3e6, 0.0), 3e4, 1e-4, tracking)
        numbers, axis = np.zeros(law.N_NUMBERS), np.zeros(law.N_AXIS)
        numbers[law.ORDER], numbers[law.DIRECT], numbers[law.OUTPUT_LIMIT] = 2, controller.direct, 4.0
        numbers[law.INPUT : law.INPUT + 2] = controller.input
        numbers[law.OUTPUT : law.OUTPUT + 2] = controller.output
        numbers[law.UNWIND : law.UNWIND + 2] = controller.unwind
        numbers[law.STEP : law.N_NUMBERS].reshape(8, 8)[:2, :2] = controller.step
        law.begin(axis, law.LEVITATES)
        for count in range(5000):
            law.take_sample(numbers, axis, 0.0, 2.75e-4, count)
        return 3e6 * axis[law.STATES]

    assert integral_after(0.0) == pytest.approx(3e6 * 2.75e-4 * 0.5, rel=1e-6)
    # it settles where what is left over balances what comes in: limit - P e + I e tracking
    assert integral_after(0.01) == pytest.approx(4.0 - 14600.0 * 2.75e-4 + 3e6 * 2.75e-4 * 0.01, rel=0.02)


def test_an_unstable_loop_is_refused_with_its_margin_which_parts_stable_from_unstable():
    model = build_drop_model(looped_machine(controller={"delay": "150 us"}), loops=True)
    longest = stability(model, 0.0).longest_delay
    assert 20e-6 < longest < 150e-6
    with pytest.raises(SimulationError, match=r"unstable: .* delay of 150 µs; .*stable up to a delay of \d"):
        simulate_drop(model, case_of())
    with pytest.raises(SimulationError, match="no shorter delay makes it stable"):
        simulate_drop(looped_machine(controller={"derivative": "0 A s/m"}), case_of())
    longest = stability(build_drop_model(looped_machine(), loops=True), 0.0).longest_delay
    for factor, stable in ((0.99, True), (1.01, False)):
        delay = f"{factor * longest} s"
        model = build_drop_model(looped_machine(controller={"delay": delay}), loops=True)
        assert stability(model, 0.0).stable is stable


def test_a_growing_motion_of_the_loop_is_that_of_the_simulation():
    model = build_drop_model(looped_machine(controller={"delay": "100 us"}), loops=True)
    found = stability(model, 0.0)
    case = case_of(speed=0.0, duration=0.15, start=CentredStart())
    start = model.at_rest()
    start[model.layout.magnets] = 4.0
    rng = np.random.default_rng(1)
    start[model.layout.velocity_of(model.layout.modal_y)] = 1e-7 * rng.standard_normal(model.layout.n_modes)
    p = model.parameters
    p = p._replace(memory=p.memory.copy(), gravity=0.0 * p.gravity)
    for a in range(2):
        for axis in range(2):
            p.memory[p.magnet_at[a, 1] + axis * law.N_AXIS] = law.LEVITATES
    times, events = case.output_times, np.zeros((0, 6))

    def stepped(*arguments):
        return _sampled.integrate_sampled(events, *arguments)

    control = Control(1e-6 * error_scale(model), 1e-6, 1e-3, 10**7, -1.0, 0.0, 0.0, True)
    setup = Setup(parameters=p, control=control, stepped=stepped)
    states = follow(setup, Run.begun(setup, start, len(times) - 1), times).states
    size = np.linalg.norm(states[:, model.layout.modal_y], axis=1)
    half = len(size) // 2
    rate = math.log(np.max(size[half:]) / np.max(size[half // 2 : half])) / (times[-1] - times[half])
    assert found.growth > 5.0
    assert rate == pytest.approx(found.growth, rel=0.05)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"start": LevitatedStart(delay=0.01)}, "say when the magnets go off as an event"),
        ({"magnets": (replace(OFF, magnet="X"),)}, "names the magnet 'X'; the machine has NDE"),
    ],
)
def test_what_does_not_fit_the_loop_is_refused(model, change, told):
    with pytest.raises(SimulationError, match=told):
        simulate_drop(model, replace(case_of(), **change))


def test_model_case_and_magnets_must_agree_with_the_loop(model):
    with pytest.raises(SimulationError, match="give one of time, below_speed and rest_velocity"):
        MagnetEvent(action="off", time=0.1, below_speed=1.0)
    with pytest.raises(SimulationError, match="build it with loops=False"):
        simulate_drop(model, replace(case_of(), magnets=None))
    with pytest.raises(
        UsageError, match="takes a magnet and a controller in every AMB, and its AMB 'NDE' lacks one"
    ):
        simulate_drop(example_machine("paper"), case_of())
    weak = looped_machine({"current_limit": "0.2 A"})
    with pytest.raises(SimulationError, match=r"magnet of AMB NDE pulls .* N at most and has .* to hold"):
        simulate_drop(weak, case_of())


def test_estimates_and_plain_drops_know_nothing_of_the_loop():
    plain, looped = example_machine("paper"), looped_machine({}, CONTROLLER)
    same = plain.changed(
        ambs=tuple(
            amb.changed(stiffness=f"{other.stiffness.value} N/m", damping=f"{other.damping.value} N s/m")
            for amb, other in zip(plain.ambs, looped.ambs, strict=True)
        )
    )
    case = DropCase(speed="60 Hz", duration=0.01, start=LevitatedStart(), reduction="quick")
    assert looped.not_estimated == ""
    one, other = simulate_drop(looped, case), simulate_drop(same, case)
    assert np.array_equal(one.state, other.state)
