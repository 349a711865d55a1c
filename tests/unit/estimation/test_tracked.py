"""The tracked twin on a record of known truth: right within its intervals, also when much is missing."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import jsonschema
import numpy as np
import pytest

from rotordrop.errors import IdentificationError
from rotordrop.estimation import estimate_drop
from rotordrop.estimation.document import combined, tracked_document
from rotordrop.estimation.schema import estimate_schema
from rotordrop.estimation.tracked import (
    INCONSISTENT_WIDENING,
    Preparation,
    TrackedDrop,
    _tail_first,
    drop_problem,
    estimate_tracked,
    prepare,
    settled_tail,
    track_drops,
    tracked_drop,
)
from rotordrop.estimation.tracked_values import (
    INCONSISTENT,
    MODEL_FORCE_SIGMA,
    MODEL_STRESS_SIGMA,
    OF_CROSS_CHECK,
    holding,
    is_beside,
    with_cross_check,
    with_interval,
)
from rotordrop.machine import Machine, example_machine
from rotordrop.measurement.examples import example_record_path
from rotordrop.measurement.power_off import PowerOff
from rotordrop.measurement.record import Record, read_record
from rotordrop.model.parameters import build_drop_model
from rotordrop.synthesis import SyntheticDrop, hidden_machine, synthesize_drop
from rotordrop.synthesis.score import score_estimate
from rotordrop.tracking.calibration import TrackedDrops, beside_the_record
from rotordrop.tracking.consistency import Check
from rotordrop.tracking.input_state import KNOWN_PEAK_ERROR, input_state_estimate

BEARINGS = ("NDE", "DE")
SPEED = 2.0 * math.pi * 60.0
SEED = 4
NINETY = 1.6448536269514722
LIMITS = {"peak_force_N": 0.03, "peak_stress_Pa": 0.015, "mean_force_0p15_0p2_N": 0.03}


def document(drop: TrackedDrop, machine: Machine) -> dict[str, Any]:
    written: dict[str, Any] = json.loads(json.dumps(tracked_document(drop, machine), allow_nan=False))
    return written


def half_widths(drop: TrackedDrop, field: str) -> list[float]:
    intervals = [drop.values[name][field].interval_90 for name in BEARINGS]
    return [0.5 * (high - low) for low, high in intervals if low is not None]


def assert_right(drop: TrackedDrop, machine: Machine, truth: SyntheticDrop, factor: float = 1.0) -> None:
    scores = score_estimate(document(drop, machine), truth.truth)["bearings"]
    for name in BEARINGS:
        for field, limit in LIMITS.items():
            assert abs(scores[name][field]["relative_error"]) < factor * limit, (name, field)
            assert scores[name][field]["covered"], (name, field)


def assert_right_or_wide(drop: TrackedDrop, machine: Machine, truth: SyntheticDrop) -> None:
    scores = score_estimate(document(drop, machine), truth.truth)["bearings"]
    for name in BEARINGS:
        for field in LIMITS:
            assert scores[name][field]["covered"], (name, field)


def test_loads_of_a_calibrated_machine_come_within_their_intervals(
    tracked: TrackedDrop, calibrated: Machine, synthetic: SyntheticDrop
) -> None:
    assert tracked.consistent, tracked.sentence()
    assert_right(tracked, calibrated, synthetic)
    peaks = [tracked.values[name]["peak_force_N"].value for name in BEARINGS]
    assert np.all(np.array(half_widths(tracked, "peak_force_N")) < 0.08 * np.array(peaks))


def test_every_large_impact_is_found_and_half_of_them_within_five_per_cent(
    tracked: TrackedDrop, calibrated: Machine, synthetic: SyntheticDrop
) -> None:
    impacts = score_estimate(document(tracked, calibrated), synthetic.truth)["impacts"]
    for name in BEARINGS:
        found = impacts[name]
        assert found["true_impacts"] > 3 and found["found"] == found["true_impacts"]
        assert found["median_absolute_error"] < 0.05
        assert np.max(np.abs(found["relative_errors"])) < 0.25


def test_true_parameters_give_the_truth(informed: Machine, synthetic: SyntheticDrop) -> None:
    drop = estimate_drop(informed, synthetic.record, tail=synthetic.tail, quick=True)
    assert drop.consistent, drop.sentence()
    assert_right(drop, informed, synthetic)


def test_one_pass_agrees_with_three(tracked: TrackedDrop, quick: TrackedDrop) -> None:
    for name in BEARINGS:
        for field, limit in LIMITS.items():
            assert quick.values[name][field].value == pytest.approx(
                tracked.values[name][field].value, rel=limit
            )
        assert quick.peak_times[name] == pytest.approx(tracked.peak_times[name], abs=1e-4)


def test_estimated_orbit_has_the_shape_of_the_true_one_to_a_micrometre(
    tracked: TrackedDrop, synthetic: SyntheticDrop
) -> None:
    true = synthetic.histories["bearing_displacement"]
    start, rate = float(synthetic.histories["t0"]), float(synthetic.histories["fs"])
    late = tracked.drop_instant.value - float(synthetic.truth["t_off_in_record_s"])
    at = (tracked.forces.time + late - start) * rate
    for b in range(2):
        for axis in range(2):
            there = np.interp(at, np.arange(len(true)), true[:, b, axis])
            apart = tracked.forces.displacement[:, b, axis] - there
            assert np.std(apart) < 1.5e-6
            assert (
                np.mean(
                    np.abs(apart - np.mean(apart)) < 1.645 * tracked.forces.displacement_sigma[:, b, axis]
                )
                > 0.7
            )


def test_document_follows_the_published_schema(tracked: TrackedDrop, calibrated: Machine) -> None:
    validator = jsonschema.Draft202012Validator(estimate_schema())
    one = document(tracked, calibrated)
    validator.validate(one)
    several = combined({"a": one, "b": one}, calibrated)
    validator.validate(several)
    assert set(several["drops"]) == {"a", "b"} and several["machine"] == calibrated.name
    assert not validator.is_valid({**one, "method": "guess"})
    assert one["method"] == "tracked"
    for name in BEARINGS:
        for impact in one["bearings"][name]["impacts"]:
            for field in ("peak_force_N", "impulse_N_s", "dissipated_energy_J"):
                low, high = impact[field]["interval_90"]
                assert low <= impact[field]["value"] <= high


def test_intervals_hold_no_less_than_what_every_model_leaves_out(tracked: TrackedDrop) -> None:
    for field, share in (("peak_force_N", MODEL_FORCE_SIGMA), ("peak_stress_Pa", MODEL_STRESS_SIGMA)):
        for name, half in zip(BEARINGS, half_widths(tracked, field), strict=True):
            assert half >= NINETY * share * tracked.values[name][field].value


def test_impulses_of_the_impacts_add_up_to_the_impulse_of_the_force(tracked: TrackedDrop) -> None:
    """Force times time over the whole drop, from the contact force, impact by impact."""
    dt = float(tracked.forces.time[1] - tracked.forces.time[0])
    for b, name in enumerate(BEARINGS):
        whole = dt * float(np.sum(tracked.forces.contact_force[:, b]))
        parts = sum(impact.impulse.value for impact in tracked.impacts if impact.bearing == name)
        assert parts == pytest.approx(whole, rel=1e-9)


def test_vertical_impulse_carries_the_weight(tracked: TrackedDrop, calibrated: Machine) -> None:
    """Momentum: over 0.2 s the bearings give back what gravity gave, less what the rotor still moves with."""
    time, force = tracked.forces.time, tracked.forces.force
    late = time > 0.1
    dt = float(time[1] - time[0])
    down = dt * float(np.sum(force[late, :, 1]))
    weight = 9.80665 * float(tracked.problem.model.fe.total_mass)
    moving = tracked.problem.model.fe.total_mass * 0.1
    assert down == pytest.approx(weight * dt * np.count_nonzero(late), abs=moving)


def followed(machine: Machine, item: Preparation) -> TrackedDrop:
    fit = track_drops(machine, [item], quick=True)
    return tracked_drop(item, fit.problems[0], fit.smoothed[0], 1.0)


def test_a_gap_in_the_record_and_a_lost_channel_are_lived_with(
    calibrated: Machine, quick: TrackedDrop, synthetic: SyntheticDrop
) -> None:
    record = synthetic.record
    signals = record.signals.copy()
    start = int(np.searchsorted(record.time, quick.drop_instant.value + 0.06))
    signals[start : start + 40] = np.nan
    signals[:, 1] = np.nan
    worse = replace(record, signals=signals)
    drop = followed(calibrated, prepare(calibrated, worse, synthetic.tail, "worse", quick.drop_instant))
    assert not drop.can_be_cross_checked and "no independent cross-check is possible" in drop.sentence()
    assert_right(drop, calibrated, synthetic, factor=2.0)
    gap = (drop.forces.time > 0.0605) & (drop.forces.time < 0.0615)
    assert np.mean(drop.forces.displacement_sigma[gap]) > 1.5 * np.mean(quick.forces.displacement_sigma[gap])
    assert math.isfinite(drop.nis)


def test_a_machine_that_lost_a_sensor_is_still_estimated(
    calibrated: Machine, quick: TrackedDrop, synthetic: SyntheticDrop
) -> None:
    def without(record: Record) -> Record:
        return replace(record, signals=np.delete(record.signals, 1, axis=1), sensors=left)

    left = tuple(sensor for i, sensor in enumerate(calibrated.sensors) if i != 1)
    drop = estimate_drop(
        calibrated.model_copy(update={"sensors": left}),
        without(synthetic.record),
        tail=without(synthetic.tail),
    )
    assert drop.drop_instant.value == pytest.approx(quick.drop_instant.value, abs=2e-4)
    assert not drop.can_be_cross_checked and not drop.consistent, drop.sentence()
    assert_right(drop, calibrated, synthetic, factor=2.0)


def test_without_tail_and_levitated_part_less_is_known(
    calibrated: Machine, quick: TrackedDrop, synthetic: SyntheticDrop
) -> None:
    record = synthetic.record
    kept = record.time >= quick.drop_instant.value - 1e-9
    cut = replace(
        record,
        time=record.time[kept],
        signals=record.signals[kept],
        speed=None if record.speed is None else record.speed[kept],
    )
    known = quick.drop_instant
    instant = PowerOff(
        value=known.value,
        standard_error=known.standard_error,
        interval_90=known.interval_90,
        contact=known.contact,
        method="given",
        notes=(),
    )
    item = prepare(calibrated, cut, None, "cut", instant)
    assert item.evidence.levitated is None
    drop = followed(calibrated, item)
    assert_right(drop, calibrated, synthetic, factor=2.0)
    offsets = slice(drop.problem.n_dynamic + len(drop.problem.unknowns) + 4, None)
    variance = [np.diag(one.smoothed.covariance(0))[offsets][:4] for one in (drop, quick)]
    assert np.all(variance[0] > variance[1])  # of the offsets, which the tail ties


def test_sensor_planes_elsewhere_than_stated_are_flagged_and_intervals_widened(
    known: Machine, calibrated: Machine, quick: TrackedDrop
) -> None:
    elsewhere = hidden_machine(known, SEED, "sensor planes 30 mm off")
    record = synthesize_drop(elsewhere, SPEED, 10 * SEED, duration=0.22, tolerance=1e-7, name="moved")
    drop = estimate_drop(calibrated, record.record, tail=record.tail, quick=True)
    assert not drop.consistent
    assert drop.sentence().startswith("The model is not consistent with the record: ")
    assert drop.sentence().endswith("the single numbers are not to be relied on.")
    assert drop.cross_check is not None
    for b, name in enumerate(BEARINGS):
        peak = drop.values[name]["peak_force_N"]
        assert peak.status in (INCONSISTENT, OF_CROSS_CHECK)
        assert drop.values[name]["support.stiffness_N_per_m"].status == INCONSISTENT
        assert peak.interval_90 is not None
        low, high = peak.interval_90
        assert low <= (1.0 - KNOWN_PEAK_ERROR) * drop.cross_check.peak[b]
        assert high >= (1.0 + KNOWN_PEAK_ERROR) * drop.cross_check.peak[b]
    assert_right_or_wide(drop, calibrated, record)
    for name, half in zip(BEARINGS, half_widths(drop, "peak_force_N"), strict=True):
        least = NINETY * MODEL_FORCE_SIGMA * drop.values[name]["peak_force_N"].value
        assert half >= INCONSISTENT_WIDENING * least
    written = document(drop, calibrated)
    assert not written["consistency"]["consistent"]
    assert set(written["warnings"]) == {c.message for c in drop.checks if not c.passed}


def test_a_record_without_speed_is_refused(calibrated: Machine, synthetic: SyntheticDrop) -> None:
    mute = replace(synthetic.record, speed=None, speed_time=None, speed_readings=None)
    with pytest.raises(IdentificationError, match="the record mute has no rotor speed; expected one"):
        prepare(calibrated, mute, None, "mute")


def test_as_many_tails_as_records_are_needed(calibrated: Machine, synthetic: SyntheticDrop) -> None:
    with pytest.raises(ValueError, match="shorter"):
        estimate_tracked(calibrated, [synthetic.record], [])


@pytest.mark.slow
def test_a_single_drop_from_guesses_without_a_tail_is_not_led_astray() -> None:
    """Truth of the record: 3333.1 and 3618.5 N, air gaps of 275 and 288 µm against guesses of 250 µm."""
    machine = example_machine("lp400")
    drop = estimate_drop(machine, read_record(example_record_path("lp400_drop_060"), machine))
    assert drop.consistent, drop.sentence()
    for name, peak, gap in (("NDE", 3333.09, 275e-6), ("DE", 3618.52, 288e-6)):
        assert drop.values[name]["peak_force_N"].value == pytest.approx(peak, rel=0.02)
        assert drop.values[name]["air_gap_m"].value == pytest.approx(gap, abs=8e-6)


def test_gaps_without_a_tail_start_where_the_first_forces_act(
    known: Machine, synthetic: SyntheticDrop
) -> None:
    model = build_drop_model(known, "quick")
    item = prepare(known, synthetic.record, None, "start")
    started = drop_problem(model, item)
    for name in BEARINGS:
        entry = started.n_dynamic + [u.path for u in started.unknowns].index(f"{name}.air_gap")
        true = synthetic.truth["air_gap_m"][name]
        assert abs(started.mean[entry] - true) < 15e-6
        guess = known.bearing(name).air_gap
        assert started.mean[entry] != float(guess)


def test_a_tail_of_any_drop_serves_the_whole_chain(known: Machine, synthetic: SyntheticDrop) -> None:
    without = prepare(known, synthetic.record, None, "one")
    having = prepare(known, synthetic.record, synthetic.tail, "two")
    first, second = _tail_first([without, having])
    assert first.tail_level is not None
    np.testing.assert_array_equal(first.tail_level, having.tail_level)
    assert second is having
    assert _tail_first([without, without])[0].tail_level is None


@pytest.mark.parametrize(
    ("nis", "factor", "diverged", "beside"),
    [(0.95, 1.0, False, False), (1.3, 1.0, False, True), (0.95, 8.0, False, True), (0.95, 1.0, True, True)],
)
def test_a_fit_beside_the_record_is_noticed(nis: float, factor: float, diverged: bool, beside: bool) -> None:
    fit = TrackedDrops(
        problems=(), smoothed=(), nis=(0.9, nis), diverged=(False, diverged), noise_factors=(1.0, factor)
    )
    assert beside_the_record(fit) == beside


def test_a_twin_far_from_the_cross_check_gives_way_to_it(tracked: TrackedDrop) -> None:
    check = input_state_estimate(tracked.problem, tracked.smoothed)
    own = tracked.values["NDE"]
    assert not is_beside(own["peak_force_N"], check, 0)
    kept, moment = with_cross_check(own, 0.5, tracked.forces, check, 0)
    assert moment == 0.5
    assert kept["peak_force_N"].value == own["peak_force_N"].value

    wild = own | {"peak_force_N": with_interval(2.1 * float(check.peak[0]), 10.0, unit="N")}
    assert is_beside(wild["peak_force_N"], check, 0)
    given, moment = with_cross_check(wild, 0.5, tracked.forces, check, 0)
    assert moment == check.time[check.magnitude[:, 0].argmax()]
    assert given["peak_force_N"].value == check.peak[0]
    assert given["peak_force_N"].status == OF_CROSS_CHECK
    low, high = given["peak_force_N"].interval_90 or (math.nan, math.nan)
    assert (low, high) == pytest.approx((0.7 * check.peak[0], 1.3 * check.peak[0]))
    assert low < own["peak_force_N"].value < high
    assert "mean_stress_Pa" not in given
    mean = given["mean_force_0p15_0p2_N"].value
    assert mean == pytest.approx(own["mean_force_0p15_0p2_N"].value, rel=0.1)


def test_a_drop_that_nothing_can_check_is_refused(
    quick: TrackedDrop, calibrated: Machine, synthetic: SyntheticDrop, monkeypatch: pytest.MonkeyPatch
) -> None:
    failed = (
        Check(name="directions", passed=False, message="one direction"),
        Check(name="innovation size", passed=False, message="innovations 9 × expected"),
    )
    monkeypatch.setattr("rotordrop.estimation.tracked.consistency_checks", lambda *_: failed)
    item = prepare(calibrated, synthetic.record, synthetic.tail, "blind", quick.drop_instant)
    with pytest.raises(IdentificationError, match=r"record blind .*nothing can check its force"):
        tracked_drop(item, quick.problem, quick.smoothed, 1.0)


def test_a_record_until_standstill_holds_its_own_tail(synthetic: SyntheticDrop) -> None:
    time = np.arange(0.0, 25.0, 1e-3)
    signals = np.ones((len(time), synthetic.record.signals.shape[1]))
    standing = replace(synthetic.record, time=time, signals=signals, speed=np.where(time < 21.0, 300.0, 0.1))
    own = settled_tail(standing, None)
    assert own is not None and own.time[0] == pytest.approx(time[-1] - 2.0)
    assert settled_tail(standing, synthetic.tail) is synthetic.tail
    assert settled_tail(replace(standing, speed=np.full(len(time), 5.0)), None) is None
    assert settled_tail(synthetic.record, None) is None


def test_a_magnitude_has_no_interval_below_zero() -> None:
    assert with_interval(100.0, 200.0).interval_90 == pytest.approx((0.0, 100.0 + NINETY * 200.0))
    assert with_interval(-5.0, 1.0).interval_90 == pytest.approx((-5.0 - NINETY, -5.0 + NINETY))
    held = holding(with_interval(100.0, 10.0), 3.0, 0.15).interval_90
    assert held == pytest.approx((100.0 - NINETY * 10.0, 345.0))


def test_nothing_gives_way_to_a_cross_check_that_found_nothing(tracked: TrackedDrop) -> None:
    check = input_state_estimate(tracked.problem, tracked.smoothed)
    peak = tracked.values["NDE"]["peak_force_N"]
    assert not is_beside(peak, replace(check, peak=np.full(2, math.nan)), 0)
    assert not is_beside(with_interval(0.0, 1.0), check, 0)
