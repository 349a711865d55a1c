"""What is known before a restart: likelihood ratios of changes, the next drop, the speed, the lift."""

import json
import math
import re
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from tests.published import bearing, published, value, went_on
from tests.unit.simulate.looped import looped_machine

from rotordrop import build_drop_model, example_machine, read_document, save_machine
from rotordrop.cli.app import run
from rotordrop.cli.compare import _deliver_changes
from rotordrop.cli.restart import CHECKS
from rotordrop.errors import UsageError
from rotordrop.estimate.published import Joint, Parameter, Unbalance, Value
from rotordrop.files import write_json
from rotordrop.known import NINETY, Known
from rotordrop.report.restart_page import restart_numbers, restart_page
from rotordrop.restart import restart_card
from rotordrop.restart.card import POSITIVE, Foreseen, NextDrop
from rotordrop.restart.damages import CHECKS as KNOWN_CHECKS
from rotordrop.restart.damages import DAMAGES
from rotordrop.restart.evidence import in_order
from rotordrop.restart.next_drop import found_machine, lift_now, next_drops, speed_limit
from rotordrop.rotor.magnet_loop import carrying_currents
from rotordrop.rotor.unknowns import all_unknowns, is_of_a_bearing


def parameter(path, at, half, before):
    """A parameter with 90 % intervals of such halves, found and before."""
    prior = Value(value=at, interval_90=[at - before, at + before])
    found = Value(value=at, interval_90=[at - half, at + half])
    return Parameter(path=path, scope="machine", prior=prior, estimate=found)


def drop(stress=2e9, width=0.02, gap=275e-6, stiffness=1e8, unbalance=None, **more):
    """An estimate with a peak stress at two bearings, a gap with ±1 µm and a stiffness with ±1 %."""
    force, wide = value(3000.0, 2900.0, 3100.0), NINETY * stiffness
    numbers = {
        "peak_force_N": force,
        "peak_stress_Pa": value(stress, stress * (1 - width), stress * (1 + width)),
    }
    found = [
        one
        for end in ("NDE", "DE")
        for one in (
            parameter(f"{end}.air_gap", gap, NINETY * 1e-6, NINETY * 22e-6),
            parameter(f"{end}.support.stiffness", stiffness, 0.01 * wide, 0.5 * wide),
        )
    ]
    planes = []
    if unbalance is not None:
        amount = value(unbalance, 0.9 * unbalance, unbalance / 0.9)
        planes = [Unbalance(node=8, amount_kg_m=amount, phase_rad=None, sentence="")]
    bearings = {"NDE": bearing(numbers), "DE": bearing(numbers)}
    known = {"parameters": found, "joint": joint_of(found)}
    return published(bearings=bearings, unbalance=planes, **known | more)


def joint_of(parameters):
    """Parameters that a record knows apart from each other: a gap by itself, a stiffness by its logarithm."""

    def measured(one, known):
        low, high = known.interval_90
        if one.path.endswith("air_gap"):
            return known.value, (high - low) / (2.0 * NINETY)
        return math.log(known.value), math.log(high / low) / (2.0 * NINETY)

    found = [measured(one, one.estimate) for one in parameters]
    return Joint(
        paths=[one.path for one in parameters],
        mean=[middle for middle, _ in found],
        covariance=np.diag([sigma**2 for _, sigma in found])[np.tril_indices(len(found))].tolist(),
        prior_mean=[275e-6 if one.path.endswith("air_gap") else math.log(1e8) for one in parameters],
        prior_standard_deviation=[measured(one, one.prior)[1] for one in parameters],
    )


def ratio(card, kind, where="NDE"):
    """Likelihood ratio of a kind of damage at a bearing by what changed there."""
    return math.prod(one.ratio for one in card.indicators if (one.kind, one.bearing) == (kind, where))


def said(card, of=None):
    return [one.text for one in restart_page(card, of or drop()).verdict]


def test_a_first_drop_has_nothing_to_compare_with_and_says_so():
    card = restart_card(drop())
    assert card.indicators == () == card.since
    assert said(card)[0].startswith("No earlier estimate to compare with")


@pytest.mark.parametrize(
    ("now", "kind", "where"),
    [
        ({"gap": 295e-6}, "worn", "NDE"),
        ({"stiffness": 0.7e8}, "loose", "DE"),
        ({"unbalance": 5e-5}, "unbalance", ""),
    ],
)
def test_a_change_speaks_of_its_damage_and_none_against_it(now, kind, where):
    before = drop(unbalance=1.5e-5)
    same = restart_card(drop(unbalance=1.5e-5), earlier=[before])
    moved = restart_card(drop(**{"unbalance": 1.5e-5} | now), earlier=[before])
    assert ratio(same, kind, where) < 0.5 and not same.positive
    assert ratio(moved, kind, where) > 100.0
    assert {one.kind for one in moved.positive} == {kind}
    assert moved.since == ("drop.h5",)
    others = {one.kind: one.ratio for one in moved.indicators if one.kind != kind}
    assert others == {one.kind: one.ratio for one in same.indicators if one.kind != kind}


def test_unbalances_found_at_two_speeds_are_not_compared():
    """What a plane takes of an unbalance spread along the shaft goes with the speed."""
    before = drop(unbalance=1.5e-5)
    assert ratio(restart_card(drop(unbalance=5e-5, speed_Hz=62.0), earlier=[before]), "unbalance", "") > 100.0
    faster = restart_card(drop(unbalance=5e-5, speed_Hz=70.0), earlier=[before])
    assert "unbalance" not in {one.kind for one in faster.indicators}


def test_a_stiffer_support_is_no_loose_one():
    stiffer = restart_card(drop(stiffness=1.3e8), earlier=[drop()])
    assert ratio(stiffer, "loose") < 0.01


def test_likelihood_ratio_is_the_integral_over_the_sizes_of_the_effect():
    effect = DAMAGES["worn"].moves["air_gap"]
    found = ratio(restart_card(drop(gap=281e-6), earlier=[drop()]), "worn")
    own = math.sqrt(2.0) / math.sqrt(1e12 - 1 / 22e-6**2)  # the prior is taken out of both
    width = math.hypot(own, math.sqrt(2.0) * effect.healthy)

    def normal(x):
        return math.exp(-0.5 * (x / width) ** 2)

    def integrand(z):
        return normal(6e-6 - effect.median * math.exp(effect.spread * z)) * math.exp(-0.5 * z * z)

    damaged = quad(integrand, -8, 8)[0] / math.sqrt(2 * math.pi)
    assert found == pytest.approx(damaged / normal(6e-6), rel=0.02)


def test_a_sound_machine_has_a_ratio_of_one_on_average_and_seldom_a_large_one():
    """Drawn as the denominator says, a likelihood ratio has mean one, and is above k once in k at most."""
    width = math.sqrt(2.0) * math.hypot(DAMAGES["worn"].moves["air_gap"].healthy, 1e-6)
    draws = np.random.default_rng(8).standard_normal(400)
    cards = (restart_card(drop(gap=275e-6 + width * z), earlier=[drop()]) for z in draws[draws > -3.0])
    found = np.array([ratio(card, "worn") for card in cards])
    assert found.mean() < 1.0 + 4.0 * found.std() / math.sqrt(len(found))
    assert np.mean(found > POSITIVE) < 1.0 / POSITIVE


def test_damage_is_dated_by_the_estimates_between():
    """Of four drops the gap grew before the last or before the second: the ratio says with which drop."""
    sound, worn = drop(), drop(gap=290e-6)
    late, early = (
        next(one for one in restart_card(worn, earlier=before).indicators if one.kind == "worn")
        for before in ([sound] * 3, [sound, worn, worn])
    )
    assert (late.ratios[0], early.ratios[0]) == pytest.approx((1.0, 1.0))
    assert np.argmax(late.ratios) == 3 and np.argmax(early.ratios) == 1
    assert late.ratio == pytest.approx(np.mean(late.ratios[1:]))


def test_an_earlier_drop_of_another_machine_is_said_and_concludes_nothing():
    """The support of the other one has twice the mass; a stiffness "x 2.1" had called for a replacement."""

    def supported(mass):
        path, estimated = "NDE.support.mass", value(mass, 0.97 * mass, mass / 0.97)
        own = Parameter(path=path, scope="machine", prior=None, estimate=estimated)
        found = drop(gap=285e-6 if mass > 40.0 else 275e-6)
        before = {"prior_mean": [math.log(40.0)], "prior_standard_deviation": [0.4]}
        joint = Joint(paths=[path], mean=[math.log(mass)], covariance=[4e-4], **before)
        return found.model_copy(update={"parameters": [*found.parameters, own], "joint": joint})

    card = restart_card(supported(56.0), earlier=[supported(28.0)])
    assert card.indicators == () == card.since


def test_an_estimate_that_does_not_fit_is_no_evidence():
    one = drop(gap=295e-6, consistent=False)
    card = restart_card(one, earlier=[drop()])
    assert not card.indicators
    assert not restart_card(drop(gap=295e-6), earlier=[drop(consistent=False)]).indicators


def test_a_gap_that_became_smaller_is_named_as_a_contradiction_and_no_evidence():
    card = restart_card(drop(gap=255e-6), earlier=[drop()])
    assert any(one.startswith("A contradiction") for one in said(card))
    assert ratio(card, "worn") == 1.0
    scattered = restart_card(drop(gap=272e-6), earlier=[drop()])
    assert not any("contradiction" in one for one in said(scattered))


def test_drops_count_by_their_dates():
    now = drop(recorded="2026-03-14T15:09")
    early, late = drop(recorded="2025-01-01", record="a"), drop(recorded="2026-02-01", record="b")
    assert [one.record for one in in_order(now, [late, early])] == ["a", "b"]
    assert [one.record for one in in_order(now, [late, drop(record="c"), early])] == ["b", "c", "a"]
    with pytest.raises(UsageError, match=r"b is of 2026-02-01, later than drop.h5 of 2025-06-01"):
        in_order(drop(recorded="2025-06-01"), [late])


def test_a_check_that_was_made_is_not_open_and_a_bad_one_says_what_it_shows():
    card = restart_card(drop(), checks={"lift": "good", "turning": "bad"})
    assert set(card.checks) == {"tail", "borescope", "coast-down"}
    fresh = restart_card(drop())
    assert set(fresh.checks) == set(KNOWN_CHECKS)
    assert any("(expect NDE 273 to 277 µm, DE 273 to 277 µm; more is wear)" in one for one in said(fresh))
    assert {kind for one in KNOWN_CHECKS.values() for kind in one.shows} == set(DAMAGES)


@pytest.mark.parametrize(
    ("checks", "message"),
    [
        ({"x-ray": "bad"}, "there is no check 'x-ray'; there are lift"),
        ({"lift": "fine"}, "check lift = 'fine'; expected good or bad"),
    ],
)
def test_unknown_checks_and_outcomes_are_named(checks, message):
    with pytest.raises(UsageError, match=message):
        restart_card(drop(), checks=checks)


def test_the_checks_that_are_asked_for_are_those_of_the_package():
    assert tuple(KNOWN_CHECKS) == CHECKS


def foreseen(*beyond, lowest=280.0):
    """Drops from 400 rad/s and from lower speeds down to the lowest, with the chances to pass a limit."""
    high, after = Known(value=4e3, drops=24, interval_90=(3.5e3, math.inf)), []
    for speed, share in zip(np.linspace(400.0, lowest, len(beyond)).tolist(), beyond, strict=True):
        count = 12 if after else 24
        peaks = dict.fromkeys(("NDE", "DE"), (Known(value=3e3, drops=count), high))
        chance = Known(value=share, interval_90=(share, max(share, 0.22)), drops=count)
        after.append(NextDrop(speed=speed, peak_force=peaks, peak_stress=peaks, beyond_limit=chance))
    limit = speed_limit(after, 0.05)
    return Foreseen(
        drops=tuple(after), speed_limit=limit, chance=0.05, limits={"peak_stress_Pa": 2.5e9}, of_estimate=True
    )


@pytest.mark.parametrize(
    ("beyond", "limit", "words"),
    [
        ((0.0, 0.9, 0.0, 0.0), 200.0, "Speed limit 31.8 Hz"),  # a resonance between; a fit said "none"
        ((1.0, 0.9, 0.5, 0.04), 100.0, "up to 22 %), from 31.8 Hz"),
        ((0.04, 0.0, 0.0, 0.0), 400.0, "No speed limit is needed"),
        ((0.0, 0.0, 0.0, 0.2), None, "it passes even from 15.9 Hz"),
        ((1.0, 1.0, 1.0, 1.0), None, "No simulated speed brings that chance to 5 %"),
        ((0.0, 0.0, 0.0, math.nan), None, "it passes even from 15.9 Hz"),  # each drop there failed
    ],
)
def test_the_speed_limit_is_one_below_which_the_simulated_drops_keep_the_limit(beyond, limit, words):
    after = foreseen(*beyond, lowest=100.0)
    assert after.speed_limit == limit
    assert any(words in text for text in said(restart_card(drop(), foreseen=after)))


def test_next_drops_are_at_their_speeds_and_pass_limits_as_they_say():
    """A machine that whirls at 112 Hz and not below: at 84 Hz each drop stays below the limit."""
    machine, full, shares = example_machine("paper"), 2.0 * math.pi * 140.0, (1.0, 0.8, 0.6, 0.25)

    def simulated(force, **told):
        return next_drops(machine, full, {"peak_force_N": force}, shares=shares, drops=20, **told)

    whirling = simulated(5200.0)
    always, never = (simulated(force, duration=0.01) for force in (1.0, 1e9))
    assert [one.speed for one in whirling.drops] == pytest.approx([share * full for share in shares])
    assert all(0.0 < half.value <= high.value for half, high in whirling.drops[0].peak_force.values())
    assert [one.beyond_limit.value > 0.0 for one in whirling.drops] == [False, True, False, False]
    assert whirling.speed_limit == pytest.approx(0.6 * full)
    assert always.speed_limit is None and always.drops[-1].beyond_limit.value == 1.0
    assert never.speed_limit == pytest.approx(full)
    unasked = next_drops(machine, full, {}, drops=2, duration=0.01)
    assert unasked.speed_limit is None and [one.beyond_limit for one in unasked.drops] == [None]


def test_the_next_drops_are_counted_by_speed_and_no_more_is_said_than_they_tell():
    """24 at full speed and 12 at each lower one were "24 a speed", and "5 % or less" stood beside 22 %."""
    after = foreseen(0.0, 0.0)
    card = restart_card(drop(), foreseen=after)
    assert any("No speed limit" in text and "up to 22 %" in text for text in said(card, drop()))
    (shown,) = restart_page(card, drop()).sections[-1].tables
    assert "24" not in shown.note
    assert [row[-1] for row in shown.rows] == ["24", "12"]
    assert shown.columns[-2] == "passes peak Hertz stress of 2500 MPa"
    assert shown.rows[0][-2] == "< 1 % (90 %: < 1 % to 22 %)"
    assert re.search(r"\([^()]* or more\)", shown.rows[0][1])


def test_a_drop_that_went_on_is_said_and_the_next_are_simulated_past_it():
    gone = drop(later_motion=[went_on("DE", at=0.2)], joint=None)
    assert any("DE went 60.0 µm further out at 200 ms" in text for text in said(restart_card(gone), gone))
    after = next_drops(example_machine("small"), 100.0, {}, drop=gone, drops=2)
    assert after.duration == pytest.approx(0.25)


def test_json_says_what_the_card_holds():
    one = drop(gap=295e-6, simulated_record=True)
    card = restart_card(one, earlier=[drop()], checks={"turning": "bad"}, foreseen=foreseen(0.9, 0.0))
    content = json.loads(json.dumps(restart_numbers(card), allow_nan=False))
    assert content["format"] == "rotordrop restart 1"
    assert [one["ratio"] for one in content["indicators"]] == [one.ratio for one in card.indicators]
    assert content["foreseen"]["speed_limit"] == 280.0


def written(file, **told):
    """An estimate of its own recording in a file."""
    digest = sha256(file.stem.encode()).hexdigest()
    write_json(file, drop(**{"record": file.stem, "record_sha256": digest} | told).as_json(), sealed=True)
    return str(file)


def test_the_command_reads_hertz_and_simulates_radians(tmp_path):
    machine = example_machine("small")
    estimate = written(tmp_path / "drop.json", machine=machine.name, speed_Hz=80.0, joint=None)
    file, out, page = (tmp_path / name for name in ("m.toml", "card.json", "card.html"))
    save_machine(machine, file)
    call = ["restart", str(file), estimate, "--drops", "20", "--json", str(out), "--check", "lift=good"]
    assert run([*call, "--report", str(page)]) == 0
    card = read_document(out)
    assert card["foreseen"]["drops"][0]["speed"] == pytest.approx(2 * math.pi * 80.0)
    assert card["made"] == {"lift": "good"}
    assert f"Restart of {machine.name}" in page.read_text()
    assert run([*call[:3], "--drops", "8"]) == UsageError.exit_code  # too few for 95 %
    save_machine(example_machine("lp400"), file)
    assert run(call) == UsageError.exit_code


def test_the_command_compares_with_every_earlier_estimate(tmp_path, capsys):
    machine, file, out = example_machine("small"), tmp_path / "m.toml", tmp_path / "card.json"
    save_machine(machine, file)
    gaps = {"first": 275e-6, "second": 275e-6, "now": 290e-6}
    places = [written(tmp_path / f"{name}.json", gap=gaps[name], machine=machine.name) for name in gaps]
    call = ["restart", str(file), places[2], "--drops", "0", "--json", str(out)]
    call += ["--since", places[0], "--since", places[1]]
    assert run(call) == 0
    card = read_document(out)
    assert card["since"] == ["first", "second"]
    assert {len(one["ratios"]) for one in card["indicators"]} == {3}
    assert max(one["ratio"] for one in card["indicators"]) > POSITIVE
    assert run([*call, "--since", places[2]]) == UsageError.exit_code
    assert "are of one recording" in capsys.readouterr().err


def test_next_drops_are_of_the_machine_that_the_estimate_found():
    """Its gaps and friction with their intervals, as a calibrated machine would have them."""
    machine, path = example_machine("small"), "NDE.friction.dynamic"
    unknowns = [one for one in all_unknowns(build_drop_model(machine)) if is_of_a_bearing(one)]
    mean = [one.mean + (math.log(1.1) if one.path == path else 0.0) for one in unknowns]
    found = []
    for one, at in zip(unknowns, mean, strict=True):
        middle, *ends = (one.value_of(at + k * NINETY * 0.1 * one.sigma) for k in (0, -1, 1))
        number = Value(value=middle, status="determined", interval_90=sorted(ends), unit="")
        found.append(Parameter(path=one.path, scope="machine", prior=None, estimate=number))
    covariance = np.diag([(0.1 * one.sigma) ** 2 for one in unknowns])[np.tril_indices(len(unknowns))]
    joint = Joint(
        paths=[one.path for one in unknowns],
        mean=mean,
        covariance=covariance.tolist(),
        prior_mean=mean,
        prior_standard_deviation=[0.1] * len(unknowns),
    )
    estimate = published(machine=machine.name, parameters=found, joint=joint)
    after = found_machine(machine, estimate)
    frictions = [float(one.touchdown_bearings[0].friction.dynamic) for one in (after, machine)]
    assert frictions[0] == pytest.approx(1.1 * frictions[1], rel=1e-6)
    spread = after.calibration.joint
    at = spread.paths.index(path)
    sigma = next(one.sigma for one in unknowns if one.path == path)
    assert math.sqrt(spread.matrix[at, at]) == pytest.approx(0.1 * sigma, rel=1e-6)
    assert found_machine(machine, published(machine=machine.name)) is None
    foreseen = next_drops(machine, 600.0, {}, drop=estimate, drops=3, duration=0.01)
    assert foreseen.of_estimate and foreseen.drops[0].beyond_limit is None


def test_changes_of_one_recording_are_refused(tmp_path):
    places = [Path(written(tmp_path / f"{name}.json", record_sha256="1" * 64)) for name in "ab"]
    with pytest.raises(UsageError, match="are of one recording, so nothing changed"):
        _deliver_changes(places, None)


def test_strong_magnets_lift_every_time_and_weak_ones_never():
    strong, weak = (lift_now(looped_machine({"current_limit": limit}), lifts=2) for limit in ("4 A", "0.5 A"))
    assert strong.probability.value == 1.0 and strong.probability.drops == 2
    assert 0.0 < strong.took[0] <= strong.took[1] < 0.1
    assert weak.probability.value == 0.0 and weak.took is None
    assert set(weak.current.values()) == {None} and set(weak.limit.values()) == {0.5}
    assert lift_now(example_machine("paper")) is None  # a magnet that is a spring is not lifted with


def test_the_current_that_carries_pulls_with_the_weight():
    machine = looped_machine()
    model = build_drop_model(machine)
    depth = max(float(bearing.air_gap) for bearing in machine.touchdown_bearings)
    needed = carrying_currents(machine, model.fe)
    pulls = [amb.magnet.pull(-depth, needed[amb.name]) for amb in machine.ambs]
    assert sum(pulls) == pytest.approx(machine.rotor.mass * float(machine.gravity))
