"""Document, page and intervals of a tracked estimate, whose left is no better than its right."""

import json
import math
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from rotordrop.estimate.bearing_drop import Impact, Origin, Peak
from rotordrop.estimate.document import estimate_document
from rotordrop.evidence.evidence import read_evidence
from rotordrop.evidence.impacts import shortest_flight
from rotordrop.known import NINETY, Known
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.track.forces import ForceHistory, force_history
from rotordrop.track.input_state import InputEstimate
from rotordrop.track.problem import build_problem
from rotordrop.track.smoother import PassSettings, forward, smooth
from rotordrop.twin.problems import COARSE_BASIS, recorded_drop
from rotordrop.twin.tracked_estimate import RESOLVED
from rotordrop.twin.tracked_loads import (
    _as_unsure,
    loads_of_cross_check,
    race_moved,
    widened_to,
    widened_to_cross_check,
    with_interval,
)

BEARINGS = ("NDE", "DE")


@pytest.fixture
def document(tracked):
    written: dict[str, Any] = json.loads(json.dumps(estimate_document(tracked), allow_nan=False))
    return written


def test_the_head_names_the_drop(document, tracked, workshop, synthetic):
    assert document["machine"] == workshop.problem.model.machine.name
    assert document["record_sha256"] == synthetic.record.sha256
    assert document["speed_Hz"] == pytest.approx(60.0, abs=0.05)
    off = float(synthetic.truth["t_off_in_record_s"])
    assert document["drop_instant_s"] == workshop.evidence.power_off.value == pytest.approx(off, abs=5e-4)
    assert tuple(document["drop_instant_interval_90_s"]) == workshop.evidence.power_off.interval_90
    assert document["estimated_until_s"] == workshop.problem.time[-1] == pytest.approx(0.2, abs=1e-4)
    assert (document["method"], document["quick"], document["simulated_record"]) == ("tracked", False, True)
    judged = document["consistency"]
    assert judged["nis"] == workshop.judged.nis
    assert judged["process_noise_factor"] == workshop.noise_factor
    assert [(c["name"], c["passed"], c["message"]) for c in judged["checks"]] == [
        (c.name, c.passed, c.said()) for c in workshop.checks
    ]
    assert document["verdict"] == tracked.verdict.value and judged["sentence"] == tracked.sentence


def test_peaks_and_means_are_those_of_the_filter(document, workshop):
    forces = workshop.forces
    late = (forces.time >= 0.15) & (forces.time <= 0.2)
    for b, name in enumerate(BEARINGS):
        entry = document["bearings"][name]
        for field, values in (("peak_force_N", forces.magnitude), ("peak_stress_Pa", forces.stress)):
            at = int(np.argmax(values[:, b]))
            assert values[at, b] <= entry[field]["value"] < 1.01 * values[at, b]  # between two samples
            assert entry[field]["time_s"] == pytest.approx(forces.time[at], abs=6e-5)
        assert entry["mean_force_0p15_0p2_N"]["value"] == pytest.approx(forces.magnitude[late, b].mean())
        assert entry["mean_stress_Pa"]["value"] == pytest.approx(forces.stress[:, b].mean())
        statistics = entry["stress_statistics_Pa"]
        assert statistics["maximum"] == entry["peak_stress_Pa"]["value"]
        assert statistics["mean"] == pytest.approx(forces.stress[:, b].mean(), rel=1e-3)


def test_every_impact_lasts_as_long_as_the_indentation(document, workshop):
    forces = workshop.forces
    dt = float(forces.time[1] - forces.time[0])
    for b, name in enumerate(BEARINGS):
        impacts = document["bearings"][name]["impacts"]
        inside = forces.indentation[:, b] > 0.0
        covered = np.zeros_like(inside)
        for impact in impacts:
            end = (
                forces.time[-1] if impact["end_s"] is None else impact["end_s"]
            )  # cut by the end of the window
            first, last = np.searchsorted(forces.time, np.array([impact["start_s"], end]) - 1e-9)
            covered[first : last + 1] = True
            part = slice(first, last + 1)
            force, lost = forces.contact_force[part, b], forces.contact_power[part, b]
            assert impact["impulse_N_s"]["value"] == pytest.approx(dt * force.sum())
            assert impact["dissipated_energy_J"]["value"] == pytest.approx(dt * lost.sum())
            assert impact["azimuth_rad"] == forces.azimuth[first + int(np.argmax(force)), b]
            near = forces.magnitude[max(first - 1, 0) : last + 3, b]
            assert near.max() <= impact["peak_force_N"]["value"] < 1.1 * near.max()  # between two samples
            assert impact["start_s"] - dt <= impact["peak_time_s"] <= end + 2.0 * dt
        assert np.array_equal(covered, inside)


def test_innovations_are_those_of_the_displacement_channels(tracked, workshop):
    """Reading minus prediction over its deviation: squares near one where the model fits."""
    found, filtered = tracked.innovations, workshop.judged
    assert found is not None
    sensors = workshop.problem.model.machine.sensors
    assert found.channels == tuple(sensor.name for sensor in sensors)
    assert found.values.shape == found.deviation.shape == (filtered.done, len(sensors))
    for c in range(len(sensors)):
        squares = (found.values[:, c] / found.deviation[:, c]) ** 2
        assert 0.7 < np.nanmean(squares) < 1.3
        assert found.values[:, c] == pytest.approx(filtered.innovations[: filtered.done, c], nan_ok=True)
        noise = next(one.noise for one in tracked.sensors if one.sensor == sensors[c].name)
        assert np.nanmin(found.deviation[:, c]) >= noise * (1.0 - 1e-9)


def test_the_rest_of_the_record_is_compared_above_the_noise(document, tracked):
    noise = math.sqrt(np.mean([one.noise**2 for one in tracked.sensors]))
    assert {one["bearing"] for one in document["later_motion"]} == set(BEARINGS)
    for one in document["later_motion"]:
        assert one["resolved"] == pytest.approx(RESOLVED * noise)
        radius = tracked.bearing(one["bearing"]).motions[0].radial.values
        assert one["first"] == pytest.approx(
            np.nanmax(radius), abs=15e-6
        )  # the rotor bends beside its sensors
        assert 0.2 < one["later_time"] < 0.23
        assert one["larger"] == (one["later"] > one["first"] + one["resolved"])


def test_the_cross_check_stands_beside_what_it_checks(document, tracked):
    assert len(document["cross_check"]) == len(tracked.cross_check) == 3 * len(BEARINGS)
    for entry, one in zip(document["cross_check"], tracked.cross_check, strict=True):
        assert (entry["name"], entry["estimate"], entry["cross_check"]) == (
            one.name,
            one.estimate.value,
            one.check,
        )
        apart = abs(entry["cross_check"] / entry["estimate"] - 1.0)
        assert entry["agrees"] == (apart <= entry["known_relative_accuracy"])
        name, what = entry["name"].split(" ", 1)
        field = {"peak force": "peak_force_N", "peak stress": "peak_stress_Pa"}.get(what)
        if field is not None:
            assert entry["estimate"] == document["bearings"][name][field]["value"]


def test_magnitudes_end_at_zero_and_hold_what_the_model_leaves_out():
    assert with_interval(100.0, 200.0).interval_90 == pytest.approx((0.0, 100.0 + NINETY * 200.0))
    assert with_interval(-5.0, 1.0).interval_90 == pytest.approx((-5.0 - NINETY, -5.0 + NINETY))
    held = widened_to(with_interval(100.0, 10.0), 3.0, 0.15).interval_90
    assert held == pytest.approx((100.0 - NINETY * 10.0, 345.0))
    known = with_interval(100.0, 5.0, 2.0, "N", left_out=3.0)
    assert known.allowance_90 == pytest.approx(2.0 * NINETY * 3.0)
    assert with_interval(100.0, 5.0).allowance_90 is None
    assert widened_to(known, 3.0, 0.15).allowance_90 is None  # the cross-check made it as wide as it is


def check_of(force, time):
    """A cross-check of one bearing that found this force (N, 2) [N]."""
    magnitude, one = np.hypot(*force.T)[:, None], np.ones(1)
    late = (time >= 0.15) & (time <= 0.2)
    return InputEstimate(
        time=time,
        turn=1e4,
        force=force[:, None, :],
        sigma=np.zeros((len(time), 1, 2)),
        magnitude=magnitude,
        peak=magnitude.max(axis=0),
        reinserted=0.0 * one,
        peak_error=0.1 * one,
        stress=1e9 * np.cbrt(magnitude / 1e3),
        peak_stress=1e9 * np.cbrt(magnitude.max(axis=0) / 1e3),
        stress_error=0.1 * one,
        mean_late=np.hypot(*force[late].mean(axis=0)) * one,
        mean_magnitude_late=magnitude[late].mean(axis=0),
    )


def test_means_widen_by_preload_and_not_by_noise():
    time = np.arange(0.0, 0.2005, 5e-5)
    noisy = np.array([0.0, 23.0]) + 20.0 * np.random.default_rng(0).standard_normal((len(time), 2))
    stated = loads_of_cross_check(check_of(noisy, time), 0).means["mean_force_0p15_0p2_N"]
    assert stated.value > 30.0 and stated.low < 23.0 < stated.high
    turning = 30.0 * np.column_stack([np.cos(300.0 * time), np.sin(300.0 * time)])
    whirl = loads_of_cross_check(check_of(turning, time), 0).means["mean_force_0p15_0p2_N"]
    assert whirl.high > 30.0  # with a mean vector near zero, all of it may be noise
    assert whirl.low == pytest.approx(0.95 * float(check_of(turning, time).mean_late[0]))
    time = np.arange(0.0, 0.2005, 5e-5)
    check = check_of(np.tile([0.0, 23.0], (len(time), 1)), time)
    own = loads_of_cross_check(check, 0)
    preload = Known(value=679.0, interval_90=(42.0, 1046.0), unit="N")
    stress = widened_to_cross_check(own, check, 0, preload).means["mean_stress_Pa"]
    value = own.means["mean_stress_Pa"].value
    assert stress.low == pytest.approx(0.9 * (42.0 / 679.0) ** (1 / 3) * value)
    assert stress.high >= 1.1 * (1046.0 / 679.0) ** (1 / 3) * value * (1.0 - 1e-9)


def test_an_impact_is_sure_whose_flight_is_one_with_the_race_nearer_and_farther():
    gap, step, error = Known(value=300e-6, unit="m"), 5e-5, 0.5e-6
    time = np.arange(0.0, 0.1, step)
    flight = shortest_flight(gap.value)
    touching = np.zeros(len(time), dtype=bool)
    begins = (0.008, 0.009 + flight, 0.010 + 3.0 * flight)
    for begin in begins:
        touching |= (time >= begin) & (time < begin + 1e-3)
    off = np.minimum.reduce([np.abs(time - at) for begin in begins for at in (begin, begin + 1e-3)])
    blank = {one.name: np.zeros((len(time), 1)) for one in fields(ForceHistory)}
    place = np.zeros((len(time), 1, 2))
    place[:, 0, 1] = -np.linspace(0.0, 310e-6, len(time))
    forces = ForceHistory(
        **{
            **blank,
            "substeps": 1,
            "time": time,
            "displacement": place,
            "displacement_sigma": np.full_like(place, 2e-6),
            # the rotor nears the race and leaves it by 10 mm/s
            "indentation": (np.where(touching, 1.0, -1.0) * 0.01 * (off + 0.3 * step))[:, None],
            "indentation_sigma": np.full((len(time), 1), error),
        }
    )
    seen = race_moved(forces, 0, gap, 1.0, 0.0)
    assert seen["count_interval_90"] == (2, 3)
    low, high = seen["contact_from_interval_90"]
    moved = NINETY * error / 0.01 + step
    assert begins[2] - moved - step < low < begins[2] < high <= begins[2] + moved + step
    assert seen["largest"].value == pytest.approx(310e-6)
    assert seen["largest"].high == pytest.approx(310e-6 + NINETY * math.hypot(2e-6, 0.008 * 310e-6))
    sharp = replace(forces, indentation_sigma=np.zeros((len(time), 1)))
    assert race_moved(sharp, 0, gap, 1.0, 0.0)["count_interval_90"] in ((2, 3), (2, 2))
    assert race_moved(forces, 0, gap, 20.0, 0.0)["count_interval_90"][1] >= 3


UNTIL = 0.025


def mirrored(machine):
    """The machine seen in a mirror: a sensor at 45° looks along 135°."""
    sensors = []
    for sensor in machine.sensors:
        across = -math.cos(float(sensor.angle))
        plane = (other for other in machine.sensors if other.node == sensor.node)
        (angle,) = (other.angle for other in plane if math.isclose(math.cos(float(other.angle)), across))
        sensors.append(sensor.model_copy(update={"angle": angle}))
    return machine.model_copy(update={"sensors": tuple(sensors)})


def first_impacts(machine, seen, spin):
    """Forces over the first impacts."""
    turned = replace(seen, initial_speed=spin * seen.initial_speed, speed=spin * seen.speed)
    problem = build_problem(build_drop_model(machine, COARSE_BASIS), turned, until=UNTIL)
    smoothed = smooth(forward(problem, PassSettings(impulse=3e-3, share=0.03)), watched=problem.watched)
    return force_history(problem, smoothed)


def test_a_mirrored_record_gives_the_mirrored_force(calibrated, synthetic):
    """x to -x with the spin reversed: no law knows left from right."""
    evidence = read_evidence(build_drop_model(calibrated), synthetic.record, synthetic.tail)
    seen = recorded_drop(evidence, UNTIL)
    one = first_impacts(calibrated, seen, 1.0)
    other = first_impacts(mirrored(calibrated), seen, -1.0)
    peak = one.magnitude.max()
    assert peak > 1000.0
    assert np.abs(one.force[..., 0]).max() > 100.0
    assert other.force[..., 0] == pytest.approx(-one.force[..., 0], abs=1e-5 * peak)
    assert other.force[..., 1] == pytest.approx(one.force[..., 1], abs=1e-5 * peak)
    # of the variance of a race in flight, which nothing makes to ring, rounding leaves some 0.3 N
    assert other.magnitude_sigma == pytest.approx(one.magnitude_sigma, abs=1e-4 * peak)
    same_spin = first_impacts(mirrored(calibrated), seen, 1.0)
    assert np.abs(same_spin.force[..., 0] + one.force[..., 0]).max() > 1e-3 * peak


def test_a_contact_is_as_unsure_as_the_stated_peak_and_its_own_row_is_that_peak():
    """Other models stood in the peak alone: one force had two intervals."""

    def force(value, low, high):
        return Known(value=value, status="determined", interval_90=(low, high), unit="N")

    nothing = force(1.0, 1.0, 1.0)
    largest, other, loose = (
        Impact(
            start=start,
            end=start + 1e-3,
            azimuth=0.0,
            peak_time=start,
            peak_force=known,
            impulse=nothing,
            dissipated_energy=nothing,
        )
        for start, known in (
            (0.01, force(3000.0, 2900.0, 3200.0)),
            (0.02, force(1000.0, 990.0, 1010.0)),
            (0.03, force(100.0, 50.0, 150.0)),
        )
    )
    peak = Peak(known=force(3000.0, 2700.0, 3100.0), time=0.0105, origin=Origin.TWIN)
    found = [_as_unsure(one, peak).peak_force.interval_90 for one in (largest, other, loose)]
    assert found == [pytest.approx(ends) for ends in ((2700.0, 3100.0), (900.0, 3100.0 / 3.0), (50.0, 150.0))]
