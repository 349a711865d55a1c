"""A drop followed while it is recorded, against the smoother over the whole of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from tests.unit.twin.conftest import calibrated_about

from rotordrop import (
    Known,
    Machine,
    Record,
    StreamStep,
    calibrate_machine,
    example_machine,
    example_record_path,
    read_record,
    track_stream,
)
from rotordrop.errors import IdentificationError, UsageError
from rotordrop.evidence.evidence import Evidence
from rotordrop_bench import SensorChain, hidden_machine, synthesize_drop
from rotordrop_bench.rotors import bench_rotor

AFTER = 0.1
"""Part of a drop that is followed [s]."""


@dataclass(frozen=True, kw_only=True)
class Recorded:
    """A machine, its levitated rotor, and what is read of it behind that."""

    machine: Machine
    levitated: Record
    readings: np.ndarray

    def blocks(self, size: int = 50):
        return [self.readings[i : i + size] for i in range(0, len(self.readings), size)]

    def steps(self, **options) -> list[StreamStep]:
        return list(track_stream(self.machine, self.levitated, self.blocks(), **options))


def begun(machine: Machine, record: Record, every: int = 1) -> Recorded:
    """A record in the two parts that a stream takes, at every so many samples."""
    off = Evidence(record=record, machine=machine).power_off.value
    time, signals = record.time[::every], record.signals[::every]
    cut = int(np.searchsorted(time, off)) + 1
    read = record.speed_time <= off
    levitated = replace(
        record,
        time=time[:cut],
        signals=signals[:cut],
        sampling_rate=record.sampling_rate / every,
        speed=None,
        speed_time=record.speed_time[read],
        speed_readings=record.speed_readings[read],
    )
    until = cut + round(AFTER * levitated.sampling_rate)
    return Recorded(machine=machine, levitated=levitated, readings=signals[cut:until].copy())


@pytest.fixture(scope="module")
def bundled() -> Recorded:
    """The bundled drop of 60 kg at 10 kHz, by the machine calibrated on it."""
    machine = example_machine("lp400")
    record = read_record(example_record_path("lp400_drop_060"), machine)
    tail = read_record(example_record_path("lp400_drop_060_tail"), machine)
    return begun(calibrate_machine(machine, [record], [tail]).machine, record, every=2)


@pytest.fixture(scope="module")
def small() -> Recorded:
    """A drop of 13 kg at 10 kHz, by a machine as a calibration knows it."""
    owned = bench_rotor("13 kg")
    hidden = hidden_machine(owned, 31)
    chain = SensorChain(sampling_rate=10e3)
    made = synthesize_drop(hidden, 2.0 * np.pi * 260.0, 5, sensor_chain=chain, duration=0.16, tail=False)
    return begun(calibrated_about(owned, hidden, 4, 0.7), made.record)


@pytest.fixture(params=["bundled", "small"])
def recorded(request) -> Recorded:
    return request.getfixturevalue(request.param)


def joined(steps: list[StreamStep], name: str) -> np.ndarray:
    owner = steps[0] if hasattr(steps[0], name) else steps[0].forces
    return np.concatenate([getattr(s if owner is steps[0] else s.forces, name) for s in steps])


def parts_of_interval(found: list[StreamStep], whole: list[StreamStep], name: str, sigma: str) -> np.ndarray:
    """Differences over the half width of the 90 % interval of the whole smoother [1]."""
    half = 1.645 * joined(whole, sigma)
    return np.abs(joined(found, name) - joined(whole, name)) / half


def test_at_the_lag_force_and_motion_are_those_of_the_whole_smoother(recorded: Recorded) -> None:
    found, whole = recorded.steps(), recorded.steps(delay="1 s")
    assert len(found) > 5
    assert len(whole) == 1
    force = parts_of_interval(found, whole, "magnitude", "magnitude_sigma")
    assert np.median(force) < 0.1
    # the youngest that are handed out; with no lag 95 % of them are within 1.0 on the small rotor
    ends = np.cumsum([len(step.time) for step in found[:-1]])
    assert np.quantile(np.concatenate([force[end - 20 : end] for end in ends]), 0.95) < 0.6
    np.testing.assert_allclose(
        joined(found, "magnitude").max(0), joined(whole, "magnitude").max(0), rtol=0.012
    )
    # zeros of the sensors that later contacts tell shift the motion
    motion = parts_of_interval(found, whole, "displacement", "displacement_sigma")
    assert np.median(motion) < 0.7


def test_blocks_of_any_size_give_the_same(small: Recorded) -> None:
    once = small.steps()
    for size in (1, 7):
        again = list(track_stream(small.machine, small.levitated, small.blocks(size)))
        assert [step.delay for step in again] == [step.delay for step in once]
        for name in ("time", "state", "magnitude", "magnitude_sigma", "contact_upper"):
            np.testing.assert_array_equal(joined(again, name), joined(once, name))


def test_every_sample_is_handed_out_once_and_in_time(small: Recorded) -> None:
    handed, came = [], 0

    def arriving():
        nonlocal came
        for block in small.blocks(10):
            came += len(block)
            yield block

    dt = 1.0 / small.levitated.sampling_rate
    for step in track_stream(small.machine, small.levitated, arriving()):
        assert step.delay <= 0.025
        now = step.time[0] + step.delay
        assert came * dt - now < 10 * dt + 1e-9  # no later than the block that brought what it needs
        handed.append(step.time)
    time = np.concatenate(handed)
    assert len(time) == len(small.readings) + 1  # and the sample at power-off
    np.testing.assert_allclose(np.diff(time), dt, rtol=1e-6)
    assert len(handed) > 5


def test_a_force_lies_in_its_interval_and_the_contact_has_one_too(small: Recorded) -> None:
    for step in small.steps():
        assert np.all((step.force_lower <= step.force) & (step.force <= step.force_upper))
        assert np.all(step.contact_lower <= step.forces.contact_force)
        assert np.all(step.forces.contact_force <= step.contact_upper)
        assert step.at_sensors.shape == (len(step.time), 4)
        assert step.consistent


def test_a_drop_that_the_filter_loses_is_said_to_be_lost(small: Recorded) -> None:
    readings = small.readings.copy()
    readings[300:] *= 40.0
    with pytest.raises(IdentificationError, match=r"the filter lost the drop \d+\.\d ms after power-off"):
        replace(small, readings=readings).steps()


def test_a_machine_that_does_not_fit_is_said_not_to_and_has_wider_intervals(small: Recorded) -> None:
    bearing = small.machine.touchdown_bearings[0]
    wrong = {"NDE.support.stiffness": Known(value=2.0 * float(bearing.support.stiffness), status="estimated")}
    usual, off = small.steps(), replace(small, machine=small.machine.with_values(wrong)).steps()
    assert usual[-1].consistent
    assert not off[-1].consistent
    with_it, without = joined(off, "displacement_sigma"), joined(usual, "displacement_sigma")
    assert np.median(with_it) > 1.5 * np.median(without)


def test_missing_and_held_readings_are_left_out(small: Recorded) -> None:
    usual = small.steps()
    gaps = small.readings.copy()
    gaps[100:110, 0] = np.nan
    gaps[450:475, 2] = gaps[450, 2]  # a channel that hangs
    found = replace(small, readings=gaps).steps()
    difference = np.abs(joined(found, "force") - joined(usual, "force"))
    assert np.all(np.isfinite(difference))
    assert np.median(difference / (1.645 * joined(usual, "magnitude_sigma"))) < 0.2
    assert found[-1].consistent


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        (
            lambda r: replace(r, readings=r.readings[:, :3]),
            r"block 1 has the shape \(50, 3\); expected \(samples, 4\)",
        ),
        (
            lambda r: replace(r, readings=np.where(r.readings == r.readings[60, 1], np.inf, r.readings)),
            r"block 2 has inf in sample 11 of S_NDE_B",
        ),
    ],
)
def test_readings_that_are_none_are_named(small: Recorded, changed, told) -> None:
    with pytest.raises(UsageError, match=told):
        changed(small).steps()


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"delay": "5 ms"}, r"the delay is 5 ms; a free fall .* lasts 6\.\d ms"),
        ({"power_off": 99.0}, r"power-off is 99 s; the record of the levitated rotor lasts from"),
    ],
)
def test_options_that_cannot_be_are_named(small: Recorded, options, told) -> None:
    with pytest.raises(UsageError, match=told):
        small.steps(**options)


def test_a_machine_of_guesses_is_refused(small: Recorded) -> None:
    with pytest.raises(
        UsageError, match=r"NDE\.air_gap is a guess, and a stream holds it; .* calibrate_machine"
    ):
        track_stream(bench_rotor("13 kg"), small.levitated, small.blocks())
