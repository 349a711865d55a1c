"""Case files of violations: what they may hold, what they refuse, and what becomes of sensors and magnets."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rotordrop.errors import UsageError
from rotordrop.machine import example_machine
from rotordrop.physics.columns import POSITION
from rotordrop_bench import Violations, hidden_machine, load_violations, score_estimate, synthesize_drop
from rotordrop_bench.departing import departures_in
from rotordrop_bench.event import drop_conditions
from rotordrop_bench.score import truth_of
from rotordrop_bench.sensor_chain import PERFECT, lagging
from rotordrop_bench.true_values import violated_kinds

SPEED = 2.0 * np.pi * 60.0

CASE = (Path(__file__).parent / "violated.toml").read_text(encoding="utf-8")


def violations(**parts):
    return Violations.of(parts)


def test_a_case_file_says_what_is_violated(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    case = load_violations(path)
    assert case.of_bearing("NDE")["support.axes_angle"] == pytest.approx(np.pi / 6)
    assert case.of_bearing("NDE")["foundation.mass"] is None
    assert case.of_bearing("DE")["foundation.mass"] == 400.0
    assert case["contact.law"][1] == {"depth": pytest.approx(4e-6), "force": 1600.0}
    kinds = ("turned support axes", "foundation mode", "contact law", "sensor lag", "unbalance jump")
    assert violated_kinds(case) == kinds


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[support]\naxes_angel = "3 deg"', r"support.axes_angel: unknown key .* mean 'axes_angle'"),
        ("[support]\naxes_angle = 30", r"support.axes_angle: 30 has no unit; an angle needs one"),
        ("[support]\nhardening = 0.5", r"support.hardening: 'hardening' needs 'hardening_force' beside it"),
        ('[foundation]\nfrequency = "85 Hz"', r"'frequency' needs 'mass' beside it; add it or leave"),
        ('[bearing.DE.foundation]\nmass = "-4 kg"', r"DE.foundation.mass: -4.00 kg is not"),
        ('[gap]\ndrift = "-10 um"', r"gap.drift: 'drift' needs 'drift_time' beside it"),
        ("[sensors]\ncross_axis = 0.7", r"sensors.cross_axis: 0.700 is not allowed here; at most 0.5"),
        ('[[contact.law]]\ndepth = "1 um"\nforce = "9 N"', r"a law has 2 to 9 points, not 1"),
        (CASE.replace("1.6 kN", "80 N"), r"force 80 at point 2 does not exceed 90 before it; order"),
        (CASE + "\n[contact]\nexponent = 1.5", r"the contact has both 'law' and 'exponent'"),
        ('[supports]\naxes_angle = "3 deg"', r"supports: unknown key .* mean 'support'"),
        ("[unbalance_jump]\nnode = 3.5", r"unbalance_jump.node: 3.5 is no int"),
        ("[support", r"cannot read the case file .*case.toml: Expected"),
        (None, r"cannot read the case file .*case.toml: .* No such file"),
        ('[unbalance_jump]\namount = "3 g mm"', r"'amount' needs 'node' beside it; add it"),
    ],
)  # fmt: skip
def test_a_case_file_is_refused_with_place_value_and_way_out(text, message, tmp_path):
    path = tmp_path / "case.toml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(UsageError, match=message):
        load_violations(path)


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"bearing": {"XX": {"gap": {}}}}, "the bearing 'XX', which the machine does not have; it has NDE"),
        ({"unbalance_jump": {"node": 999, "amount": "1 g mm"}}, "at node 999, outside the rotor; its nodes"),
        ({"magnets": {"stays_on": ["A"]}}, "no AMB 'A'"),
    ],
)  # fmt: skip
def test_what_a_machine_does_not_have_or_the_bench_cannot_make_is_refused(known, parts, message):
    with pytest.raises(UsageError, match=message):
        hidden_machine(known, 3, violations(**parts))


@pytest.fixture(scope="module")
def perfect(known):
    return _recorded(known)


def _recorded(known, chain=PERFECT, **parts):
    hidden = hidden_machine(known, 3, violations(**parts), drawn=False)
    return synthesize_drop(hidden, SPEED, 8, sensor_chain=chain, duration=0.03)


def test_cross_axis_sensitivity_reads_the_motion_across(known, perfect):
    drop = _recorded(known, sensors={"cross_axis": 0.02})
    drawn = np.array(drop.truth["sensor_cross_axis"])
    assert len(set(drawn)) == len(drawn)
    assert np.all((np.abs(drawn) >= 0.01) & (np.abs(drawn) <= 0.02))
    angle = [float(s.angle) for s in known.sensors[:2]]
    assert known.sensors[0].node == known.sensors[1].node
    sign = np.sign(np.sin(angle[1] - angle[0]))
    for record, plain in ((drop.record, perfect.record), (drop.tail, perfect.tail)):
        extra = record.signals - plain.signals
        polarity = known.sensors[0].polarity * known.sensors[1].polarity * sign
        assert extra[:, 0] == pytest.approx(drawn[0] * polarity * plain.signals[:, 1], abs=1e-12)
    assert drop.truth["structure"][f"sensors.{known.sensors[0].name}.cross_axis"] == drawn[0]


def test_a_bracket_on_the_housing_takes_its_motion_off_the_reading(known, perfect):
    drop = _recorded(known, sensors={"follows_housing": 0.3})
    x = [i for i, s in enumerate(known.sensors) if abs(np.sin(float(s.angle))) < 1e-9]
    y = [i for i in range(len(known.sensors)) if i not in x]
    layout_of = {b.name: k for k, b in enumerate(known.touchdown_bearings)}
    extra = drop.record.signals - perfect.record.signals
    time, at = drop.result.time, drop.record.time - drop.truth["t_off_in_record_s"]
    inside = (at > 0.0) & (at < time[-1])
    for i in y or range(len(known.sensors)):
        sensor = known.sensors[i]
        moved = drop.result.support_displacement[:, layout_of[sensor.bearing]]
        along = np.array([np.cos(float(sensor.angle)), np.sin(float(sensor.angle))])
        expected = -0.3 * sensor.polarity * np.interp(at[inside], time, moved @ along)
        assert extra[inside, i] == pytest.approx(expected, abs=1e-12)
        assert np.max(np.abs(expected)) > 1e-7


LATER = {
    "race": {"mass": 2.3},
    "side_force": {"node": 17, "force": "80 N"},
    "stand": {"tilt": "3 deg"},
    "magnets": {"pull": 0.2, "pull_time": "10 ms"},
    "rotor": {"bow": "10 um", "bow_speed": "60 Hz"},
    "seal": {"node": 17, "gap": 1.02, "stiffness": "20 N/um"},
    "sleeve": {"eccentricity": "12 um", "ovality": "5 um"},
    "friction": {"wear": 0.6, "wear_heat": "20 J"},
    "sensors": {"curvature": 0.03, "curvature_at": "300 um"},
}


@pytest.mark.parametrize("part", LATER)
def test_what_came_later_moves_the_readings(known, perfect, part):
    drop = _recorded(known, **{part: LATER[part]})
    assert np.max(np.abs(drop.record.signals - perfect.record.signals)) > 0.2e-6


def test_curved_sensors_read_too_little_and_flicker_noise_has_its_size(known, perfect):
    drop = _recorded(known, sensors=LATER["sensors"])
    shaft = perfect.record.signals
    assert drop.record.signals == pytest.approx(shaft - 0.03 * shaft**3 / 300e-6**2, abs=1e-15)
    drop = _recorded(known, sensors={"flicker": "1 um"})
    noise = drop.record.signals - perfect.record.signals
    assert np.sqrt(np.mean(noise**2, axis=0)) == pytest.approx(1e-6, rel=1e-6)
    power = np.mean(np.abs(np.fft.rfft(noise, axis=0)) ** 2, axis=1)
    low, high = np.mean(power[10:100]), np.mean(power[100:1000])
    assert low / high == pytest.approx(10.0, rel=0.3)


def test_a_clock_and_a_late_speed_signal_move_what_is_read_in_time(known, perfect):
    drop = _recorded(known, sensors={"clock_error": 0.005, "speed_delay": "20 ms"})
    off = drop.truth["t_off_in_record_s"]
    when = 1.005 * (drop.record.time - off) + off
    inside = (when > perfect.record.time[0]) & (when < 0.01)
    for read, shaft in zip(drop.record.signals.T, perfect.record.signals.T, strict=True):
        expected = np.interp(when[inside], perfect.record.time, shaft)
        assert read[inside] == pytest.approx(expected, abs=0.2e-6)
        assert np.max(np.abs(read - shaft)) > 1e-6
    held = drop.record.speed_time < off + 0.02
    assert np.ptp(drop.record.speed_readings[held]) < 1e-9
    assert np.array_equal(drop.result.state, perfect.result.state)


@pytest.mark.parametrize("rate", [10e3, 100e3])
def test_a_lagging_sensor_reads_the_shaft_of_a_while_ago(known, rate):
    chain = replace(PERFECT, sampling_rate=rate)
    lagged, plain = (_recorded(known, chain, **v) for v in ({"sensors": {"time_constant": "80 us"}}, {}))
    read, shaft = lagged.record.signals, plain.record.signals
    falling = (plain.record.time > 1e-3) & (plain.record.time < 4e-3)
    back = read + 80e-6 * np.gradient(read, 1.0 / rate, axis=0)
    assert back[falling] == pytest.approx(shaft[falling], abs=0.05e-6)
    assert np.max(np.abs(read - shaft)[falling]) > 1e-6
    assert np.array_equal(lagged.result.state, plain.result.state)
    ramp = np.arange(4000)[:, None] / rate  # straight lines are followed exactly, a time constant late
    assert lagging(ramp, np.array([80e-6]), rate)[2000:] == pytest.approx(ramp[2000:] - 80e-6, abs=1e-12)


def test_remanence_and_unbalance_leave_their_ranges(known):
    v = violations(magnets={"remanence_time": "50 ms"}, rotor={"unbalance": 1.6})
    hidden, plain = hidden_machine(known, 3, v), hidden_machine(known, 3)
    start, other = (drop_conditions(h, SPEED, 5).start for h in (hidden, plain))
    assert start.remanence_time_constant == 0.05
    assert np.array_equal(start.remanent_force, other.remanent_force)
    for mine, drawn in zip(hidden.machine.unbalances, plain.machine.unbalances, strict=True):
        assert float(mine.amount) == pytest.approx(1.6 * float(drawn.amount))


def test_a_law_takes_the_place_of_stiffness_and_exponent(known):
    law = [{"depth": "1 um", "force": "90 N"}, {"depth": "4 um", "force": "1.6 kN"}]
    truth = _recorded(known, bearing={"DE": {"contact": {"law": law}}}).truth
    assert list(truth["contact.stiffness_N_per_m_n"]) == list(truth["contact.exponent"]) == ["NDE"]
    true = truth_of(truth)
    assert "contact.exponent" in true.of_bearing("NDE")
    assert not {"contact.exponent", "contact.stiffness_N_per_m_n"} & set(true.of_bearing("DE"))
    assert true.of_bearing("DE")["contact.damping_s_per_m"] > 0.0


def test_the_truth_holds_what_structures_are(known):
    drop = _recorded(
        known,
        support={"axes_angle": "30 deg", "stiffness_ratio": 0.65},
        bearing={"DE": {"foundation": {"mass": "400 kg", "frequency": "85 Hz"}}},
    )
    structure, truth = drop.truth["structure"], drop.truth
    for b in known.touchdown_bearings:
        k = float(b.support.stiffness)
        xx, xy, yy = k * (0.65 * 0.75 + 0.25), -0.35 * k * np.sqrt(3.0) / 4.0, k * (0.65 * 0.25 + 0.75)
        assert structure[f"{b.name}.support.coupling"] == pytest.approx(xy / np.sqrt(xx * yy))
        assert truth["support.stiffness_N_per_m"][b.name] == pytest.approx(yy)
        assert truth["support.anisotropy"][b.name] == pytest.approx(xx / yy)
    assert structure["NDE.support.foundation_share"] == 0.0
    mass = float(known.touchdown_bearings[1].support.mass)
    assert structure["DE.support.foundation_share"] == pytest.approx(mass / 400.0)
    assert truth["violated"] == ["turned support axes", "foundation mode"]
    value = {"value": 540.0, "interval_90": [500.0, 560.0]}
    found = {
        "structure": [{"name": "foundation mode"}],
        "parameters": [{"path": "DE.support.foundation_frequency", "estimate": value}],
    }
    scored = score_estimate(found, truth)
    assert scored["structure"]["DE.support.foundation_frequency"]["covered"] is True
    assert scored["named"] == ["foundation mode"]
    assert scored["violated"] == ["turned support axes", "foundation mode"]


def test_what_a_machine_file_says_is_not_lost_beside_violations():
    machine = example_machine("small")
    branch = {"stiffness": "4e7 N/m", "time": "3 ms"}
    bearings = tuple(one.changed(mount={"maxwell": [branch]}) for one in machine.touchdown_bearings)
    mounted = machine.changed(touchdown_bearings=bearings)
    assert hidden_machine(mounted, 1).model.layout.further[0][1] == ((POSITION,) * 2,) * 2
    with pytest.raises(UsageError, match=r"states NDE\.mount, .* leave it out of the machine file"):
        hidden_machine(mounted, 1, Violations.of({"support": {"axes_angle": "20 deg"}}))
    coupled = example_machine("small").with_values({"NDE.support.coupling": 0.4})
    assert not len(departures_in(hidden_machine(coupled, 1).model))
    with pytest.raises(UsageError, match=r"states NDE\.support\.coupling, .*support\.axes_angle"):
        hidden_machine(coupled, 1, Violations.of({"support": {"axes_angle": "20 deg"}}))


def test_a_magnet_that_stays_on_holds_its_end_and_leaves_no_tail(known):
    broken = violations(magnets={"stays_on": ["DE"]})
    hidden = hidden_machine(known, 3, broken)
    assert violated_kinds(broken) == ("one end held",)
    assert [amb.stays_on for amb in hidden.machine.ambs] == [False, True]
    assert not any(amb.stays_on for amb in hidden.known.ambs)
    made = synthesize_drop(hidden, SPEED, 8, duration=0.05)
    assert made.tail is None
    assert set(made.truth["first_contact_time_s"]) == {"NDE"}
