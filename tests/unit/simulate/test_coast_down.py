"""A whole coast-down: standstill, energy, statistics, bounded memory, kill and resume to the last bit."""

import math
import tracemalloc
from dataclasses import replace

import h5py
import numpy as np
import pytest
from tests.unit.simulate.short_drop import Killed, killed_after

from rotordrop import (
    CoastDownCase,
    DropCase,
    build_drop_model,
    example_machine,
    simulate_coast_down,
    simulate_drop,
)
from rotordrop.errors import OutputError, SimulationError
from rotordrop.physics import columns as L
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop.rotor.reduction import Reduction
from rotordrop.simulate import _coast_loop as C
from rotordrop.simulate.coast_down_certificate import compare_coast_downs
from rotordrop.simulate.coast_down_file import (
    is_coast_down,
    load_coast_down,
    open_samples,
    part_path,
    work_folder,
)

TURN = 2.0 * math.pi
DECELERATION = 0.11
"""Linear drag per polar inertia [1/s]."""


@pytest.fixture(scope="module")
def model():
    """The rigid rotor with attachment modes: small, so that seconds of coast-down cost little."""
    machine = example_machine("lp400")
    torque = DECELERATION * build_rotor_fe(machine).polar_inertia
    machine = machine.with_values({"speed.aero_linear": torque, "speed.aero_quadratic": 0.0})
    return build_drop_model(machine, Reduction(modes=2, attachment=True))


@pytest.fixture(scope="module")
def slow():
    """A rotor that hardly turns and stops soon."""
    return CoastDownCase(speed=1.2, rest=0.3)


@pytest.fixture(scope="module")
def stopped(model, slow):
    return simulate_coast_down(model, slow)


def test_the_first_instants_are_those_of_a_drop(model):
    """The same equations as simulate_drop: only the windows, the file and the events are new."""
    case = CoastDownCase(speed=60.0 * TURN, duration=0.02, settled_scheme=False)
    coast = simulate_coast_down(model, case)
    spin = model.parameters.spin.copy()
    spin[L.AERO_LINEAR] = DECELERATION
    drop = simulate_drop(
        replace(model, parameters=model.parameters._replace(spin=spin)),
        DropCase(speed=60.0 * TURN, duration=0.02, spin="function of speed", output_step=1e-6),
    )
    assert coast.peak_value[:, 1] == pytest.approx([drop.peak_force(b)[0] for b in (0, 1)], rel=1e-3)
    assert coast.peak_value[:, 0] == pytest.approx(np.max(drop.indentation, axis=0), rel=1e-3)
    assert coast.peak_value[:, 2] == pytest.approx(np.max(drop.max_stress, axis=0), rel=1e-3)
    assert coast.contacts.sum() == len(drop.contacts)
    assert coast.windows.speed[-1] == pytest.approx(drop.speed[-1], rel=1e-7)


def test_the_rotor_stops_when_dry_drag_says_and_never_runs_backwards(stopped, slow, tmp_path, model):
    """Rotor and races together under linear and dry drag: t = ln(1 + λω₀/d)/λ, from the first grip on."""
    assert stopped.finished
    assert 0.5 < stopped.standstill_time < 10.0
    assert stopped.end_time == pytest.approx(stopped.standstill_time + slow.rest, abs=slow.output_step)
    simulate_coast_down(model, slow, output=tmp_path / "c.h5")
    with h5py.File(tmp_path / "c.h5") as file:
        speed = file["speed"][()]
    assert np.all(speed >= 0.0)
    after = np.arange(speed.size) * slow.output_step > stopped.standstill_time
    assert np.all(speed[after] == 0.0)
    assert speed[~after][-1] == pytest.approx(slow.stop_speed, rel=0.2)
    parameters = model.parameters
    races = parameters.bearing
    turning = parameters.spin[0] + races[:, L.RACE_INERTIA].sum()
    arms = 0.5 * races[:, L.PITCH_DIAMETER]
    dry = float(np.sum(races[:, L.DRAG_COEFFICIENT] * model.load_shares * arms)) / turning
    linear = DECELERATION * parameters.spin[0] / turning
    gripped = slow.speed * parameters.spin[0] / turning
    expected = math.log1p(linear * gripped / dry) / linear
    assert stopped.standstill_time == pytest.approx(expected, rel=0.05)


def test_energy_is_balanced_to_standstill_and_windows_hold_the_paper_window_and_then_seconds(stopped):
    assert stopped.energy_residual < 1e-5 * abs(stopped.energy_scale)
    assert stopped.dissipated == pytest.approx(float(np.sum(stopped.windows.dissipated)), rel=1e-3)
    assert 0.0 < stopped.contact_energy.sum() < stopped.dissipated
    windows = stopped.windows
    assert windows.start[:3] == pytest.approx([0.0, 0.2, 1.0], abs=1e-12)
    assert np.all(np.diff(windows.quantile, axis=-1) >= 0.0)
    assert np.all(windows.peak >= windows.quantile[..., -1])
    assert windows.contacts.sum(axis=0) == pytest.approx(stopped.contacts)
    assert np.all(stopped.peak_value >= 0.999 * windows.peak.max(axis=0))
    found = stopped.maxima()
    assert len(found) == 6
    assert all(maximum.in_first_window for maximum in found)


def test_the_settled_scheme_agrees_with_the_runge_kutta_pair_and_is_given_up_when_it_errs(model, slow):
    case = replace(slow, speed=8.0, duration=2.0)
    cheap = simulate_coast_down(model, case)
    exact = simulate_coast_down(model, replace(case, settled_scheme=False))
    assert np.array_equal(cheap.windows.quantile[:2], exact.windows.quantile[:2])
    assert cheap.windows.settled[2, 0] == 1.0
    assert 0.0 < cheap.windows.settled[2, 1] < case.settled_error
    assert not exact.windows.settled.any()
    difference = compare_coast_downs(cheap, exact)
    assert difference.median_force_change < 5e-5
    assert difference.high_force_change < 1e-4
    assert difference.speed_change < 1e-6
    assert difference.agrees
    strict = simulate_coast_down(model, replace(slow, duration=1.1, settled_error=1e-16))
    assert not strict.windows.settled.any()


def test_kill_and_resume_is_bit_identical_and_another_run_is_refused(model, slow, tmp_path):
    whole, cut = tmp_path / "whole.h5", tmp_path / "cut.h5"
    simulate_coast_down(model, slow, output=whole)
    with pytest.raises(Killed):
        simulate_coast_down(model, slow, output=cut, progress=killed_after(1))
    assert not cut.exists() and work_folder(cut).is_dir()
    part_path(work_folder(cut), 1).write_bytes(b"half a part that a kill left behind")
    with pytest.raises(Killed):
        simulate_coast_down(model, slow, output=cut, resume=True, progress=killed_after(2))
    simulate_coast_down(model, slow, output=cut, resume=True)
    assert not work_folder(cut).exists()
    assert whole.read_bytes() == cut.read_bytes()
    output = tmp_path / "c.h5"
    with pytest.raises(Killed):
        simulate_coast_down(model, slow, output=output, progress=killed_after(1))
    with pytest.raises(OutputError, match=r"c\.h5\.partial holds an unfinished run; add --resume"):
        simulate_coast_down(model, slow, output=output)
    with pytest.raises(SimulationError, match="belongs to another run"):
        simulate_coast_down(model, replace(slow, speed=1.3), output=output, resume=True)
    with pytest.raises(OutputError, match=r"nothing to resume: .*other\.h5\.partial does not exist"):
        simulate_coast_down(model, slow, output=tmp_path / "other.h5", resume=True)


def test_memory_does_not_grow_with_the_time_simulated(model, slow, tmp_path):
    peaks = []
    for duration in (2.0, 4.0):
        case = replace(slow, speed=20.0, duration=duration, output_step=1e-4)
        tracemalloc.start()
        simulate_coast_down(model, case, output=tmp_path / f"{duration}.h5")
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0]


def test_the_file_tells_everything_again(model, slow, stopped, tmp_path):
    path = tmp_path / "c.h5"
    simulate_coast_down(model, slow, output=path)
    assert is_coast_down(path)
    again = load_coast_down(path)
    assert again.standstill_time == stopped.standstill_time
    assert np.array_equal(again.windows.quantile, stopped.windows.quantile)
    assert again.outcome == stopped.outcome
    samples = open_samples(path)
    assert set(samples.planes) == {"NDE", "DE", "node 5", "node 25"}
    plane = samples.planes["DE"]
    assert plane.shape == (samples.speed.size, 2)
    settled = np.asarray(plane[plane.shape[0] - 100 : plane.shape[0]])
    assert np.hypot(*settled.T) == pytest.approx(samples.air_gap["DE"], abs=10e-6)
    with pytest.raises(SimulationError, match=r"missing\.h5 cannot be read as a coast-down"):
        load_coast_down(tmp_path / "missing.h5")


def test_whirl_counts_whole_turns_in_both_senses_and_no_swing():
    def time_of(azimuth):
        times = np.linspace(0.0, 1.0, azimuth.size)
        whirl = np.zeros((1, C.N_WHIRL))
        C.start_whirl(0.0, math.cos(azimuth[0]), math.sin(azimuth[0]), whirl[0])
        C.follow_whirl(times, np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)[:, None], whirl)
        C.close_sweep(whirl[0])
        return whirl[0, C.FORWARD_TIME], whirl[0, C.BACKWARD_TIME]

    t = np.linspace(0.0, 1.0, 2000)
    assert time_of(TURN * 5.0 * t) == pytest.approx((1.0, 0.0), abs=0.06)
    assert time_of(-TURN * 5.0 * t) == pytest.approx((0.0, 1.0), abs=0.06)
    assert time_of(2.5 * np.sin(TURN * 5.0 * t)) == (0.0, 0.0)
    there_and_back = TURN * 4.0 * np.minimum(t, 1.0 - t)
    assert time_of(there_and_back) == pytest.approx((0.5, 0.5), abs=0.07)
    shivering = TURN * 3.0 * t + 0.5 * np.sin(TURN * 200.0 * t)
    assert time_of(shivering) == pytest.approx((1.0, 0.0), abs=0.1)


def test_machines_without_any_drag_are_refused_and_without_that_of_races_slow_for_ever(slow, model):
    with pytest.raises(SimulationError, match=r"has no aerodynamic drag: speed\.aero_linear.*--drag-from"):
        simulate_coast_down(example_machine("lp400"), slow)
    free = model.with_values({"NDE.race.drag_coefficient": 0.0, "DE.race.drag_coefficient": 0.0})
    result = simulate_coast_down(free, CoastDownCase(speed=2.0, longest=0.4))
    assert not result.finished
    assert "still turned at" in result.outcome and "0.4 s" in result.outcome


def test_drag_is_a_torque_whichever_way_it_is_given(model):
    """A time constant and the linear torque I_p/τ are one law; a quadratic torque slows most at speed."""
    inertia = model.fe.polar_inertia
    case = CoastDownCase(speed=300.0, duration=0.05)

    def slowed(**values):
        machine = example_machine("lp400").with_values({f"speed.{k}": v for k, v in values.items()})
        result = simulate_coast_down(build_drop_model(machine, Reduction(modes=2, attachment=True)), case)
        return result.windows.speed[-1]

    linear = slowed(aero_linear=inertia / 2.0)
    assert linear == pytest.approx(slowed(aero_time_constant=2.0), rel=1e-12)
    # A quadratic torque of I_p/(2 s · 300 rad/s) begins as strong and fades with the speed.
    assert 0.0 < slowed(aero_quadratic=inertia / 600.0) - linear < 0.3
    assert slowed(aero_quadratic=inertia / 300.0) < linear - 2.0
