"""The restart card: probabilities by Bayes' rule, costs by states, sentences that hold."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from hashlib import sha256
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from tests.published import bearing, published, value

from rotordrop.cli.app import run
from rotordrop.cli.compare import _deliver_changes
from rotordrop.cli.restart import CHECKS, _checks
from rotordrop.document import read_document
from rotordrop.errors import UsageError
from rotordrop.estimate.published import Joint, Parameter, Unbalance, Value
from rotordrop.files import write_json
from rotordrop.known import NINETY, Known
from rotordrop.machine import example_machine
from rotordrop.machine.saving import save_machine
from rotordrop.report.restart_page import restart_numbers, restart_page
from rotordrop.report.terminal import print_summary
from rotordrop.restart import load_assumptions, restart_card
from rotordrop.restart.assumptions import assumptions_of
from rotordrop.restart.card import ANSWERS, COSTS, FLIPS_WITHIN, SHARES, Flip, answer_in
from rotordrop.restart.evidence import indicators, suspicions
from rotordrop.restart.foreseen import Foreseen, NextDrop, SpeedLimit
from rotordrop.restart.next_drop import found_machine, next_drops, speed_limit
from rotordrop.restart.order import EarlierDrop, MadeCheck, earlier_drop, in_order, with_checks
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.unknowns import all_unknowns, is_of_a_bearing
from rotordrop.units import format_amount

ASSUMED = assumptions_of({}, "here")
BY_COST = assumptions_of({"most_doubt": 1.0}, "here")
"""Nothing but the costs decides."""


def drop(stress=2e9, width=0.02, gap=275e-6, stiffness=1e8, unbalance=None, **more):
    """An estimate with a peak stress at two bearings, a gap with ±1 µm and a stiffness with ±1 %."""
    numbers = {
        "peak_force_N": value(3000.0, 2900.0, 3100.0),
        "peak_stress_Pa": value(stress, stress * (1 - width), stress * (1 + width)),
    }
    found = []
    for end in ("NDE", "DE"):
        for path, at, one, before in (
            ("air_gap", gap, NINETY * 1e-6, 22e-6),
            ("support.stiffness", stiffness, NINETY * 0.01 * stiffness, 0.5 * stiffness),
        ):
            found.append(
                Parameter(
                    path=f"{end}.{path}",
                    scope="machine",
                    prior=Value(value=at, interval_90=[at - NINETY * before, at + NINETY * before]),
                    estimate=Value(value=at, interval_90=[at - one, at + one]),
                )
            )
    planes = []
    if unbalance is not None:
        amount = value(unbalance, 0.9 * unbalance, unbalance / 0.9)
        planes = [Unbalance(node=8, amount_kg_m=amount, phase_rad=None, sentence="")]
    return published(
        bearings={"NDE": bearing(numbers), "DE": bearing(numbers)},
        parameters=found,
        unbalance=planes,
        **more,
    )


def inspected(one, **checks):
    """An earlier drop after which the machine was inspected and found sound."""
    return replace(earlier_drop(one), checks=checks or {"inspection": "good"})


def chance(card, kind, where="NDE"):
    return next(one.probability for one in card.suspicions if (one.kind, one.bearing) == (kind, where))


def test_a_mild_first_drop_rests_on_the_assumptions_and_says_so():
    card = restart_card(drop(), ASSUMED)
    assert card.prior_alone
    assert card.statements[0].startswith("The assumptions alone decide this: there is no earlier estimate")
    assert chance(card, "worn") == pytest.approx(0.02)


def test_a_gap_that_grew_speaks_of_wear_and_one_that_did_not_against_it():
    same = restart_card(drop(), ASSUMED, earlier=[inspected(drop())])
    grown = restart_card(drop(gap=295e-6), ASSUMED, earlier=[inspected(drop())])
    assert chance(same, "worn") < 0.01 < 0.9 < chance(grown, "worn")
    assert not grown.prior_alone
    assert chance(grown, "loose") == pytest.approx(chance(same, "loose"))


def test_a_softer_support_is_a_loose_one_and_a_stiffer_one_is_not():
    soft = restart_card(drop(stiffness=0.7e8), ASSUMED, earlier=[inspected(drop())])
    stiff = restart_card(drop(stiffness=1.3e8), ASSUMED, earlier=[inspected(drop())])
    assert chance(soft, "loose") > 0.9
    assert chance(stiff, "loose") < 0.01
    assert soft.answer == "inspect first"


def test_an_unbalance_that_grew_is_seen_on_the_rotor():
    card = restart_card(drop(unbalance=5e-5), ASSUMED, earlier=[inspected(drop(unbalance=1.5e-5))])
    assert chance(card, "unbalance", "") > 0.9
    assert next(one.what for one in card.indicators if one.kind == "unbalance").startswith(
        "unbalance at node 8 × 3.33"
    )


def test_likelihood_ratio_is_the_integral_over_the_sizes_of_the_effect():
    card = restart_card(drop(gap=281e-6), ASSUMED, earlier=[inspected(drop())])
    effect = ASSUMED.damages["worn"].moves["air_gap"]
    found = next(one for one in card.indicators if (one.kind, one.bearing) == ("worn", "NDE"))
    own = math.sqrt(2.0) / math.sqrt(1e12 - 1 / 22e-6**2)  # the prior is taken out of both
    width = math.hypot(own, math.sqrt(2.0) * effect.healthy)

    def normal(x):
        return math.exp(-0.5 * (x / width) ** 2)

    def integrand(z):
        return normal(6e-6 - effect.median * math.exp(effect.spread * z)) * math.exp(-0.5 * z * z)

    damaged = quad(integrand, -8, 8)[0] / math.sqrt(2 * math.pi)
    assert found.ratio == pytest.approx(damaged / normal(6e-6), rel=0.02)


def test_stress_near_the_dent_limit_replaces_and_its_own_width_counts():
    assert restart_card(drop(stress=6.5e9), ASSUMED).answer == "replace"
    narrow, wide = (restart_card(drop(stress=4.5e9, width=w), ASSUMED) for w in (0.01, 0.3))
    assert chance(narrow, "brinelled") < chance(wide, "brinelled")


def test_costs_are_those_of_a_sum_over_all_states():
    card = restart_card(
        drop(gap=283e-6), BY_COST, earlier=[EarlierDrop(record="x")] * 3 + [inspected(drop())]
    )
    kinds = list(ASSUMED.damages)
    absent = dict.fromkeys(kinds, 1.0)
    for one in card.suspicions:
        absent[one.kind] *= 1.0 - one.probability
    expected = dict.fromkeys(ANSWERS, 0.0)
    for present in product((False, True), repeat=len(kinds)):
        there = {kind for kind, yes in zip(kinds, present, strict=True) if yes}
        weight = math.prod(1 - absent[kind] if kind in there else absent[kind] for kind in kinds)
        a = ASSUMED
        sound = a.machine_cost * a.sound_risk
        kept = math.prod(1 - a.damages[kind].risk for kind in there)
        limited = math.prod(1 - a.limited_risk * a.damages[kind].risk for kind in there)
        on_rotor = math.prod(1 - a.damages[kind].risk for kind in there & {"unbalance"})
        new = bool(there & {"worn", "brinelled", "dragging"})
        mended = bool(there & {"loose", "unbalance"})
        expected["restart"] += weight * a.machine_cost * (1 - (1 - a.sound_risk) * kept)
        expected["restart with limits"] += weight * (
            a.machine_cost * (1 - (1 - a.sound_risk) * limited) + a.limited_days
        )
        expected["inspect first"] += weight * (
            a.inspection_days
            + new * (a.bearing_set_cost + a.exchange_days)
            + mended * a.exchange_days
            + sound
        )
        expected["replace"] += weight * (
            a.replace_days
            + a.bearing_set_cost
            + ("loose" in there) * a.exchange_days
            + a.machine_cost * (1 - (1 - a.sound_risk) * on_rotor)
        )
    assert card.costs == pytest.approx(expected)
    assert sum(card.right.values()) == pytest.approx(1.0)


@pytest.mark.parametrize("name", ASSUMED.checks)
def test_a_check_never_costs_more_than_itself_and_its_outcomes_average_to_what_was_known(name):
    before = restart_card(drop(), ASSUMED)
    check = next(one for one in before.checks if one.name == name)
    assert check.value >= -check.cost - 1e-9
    good, bad = (restart_card(drop(), ASSUMED, checks={name: how}) for how in ("good", "bad"))
    share = (before.sound - good.sound) / (bad.sound - good.sound)
    assert 0.0 < share < 0.3
    for kind, where in (("worn", "DE"), ("dragging", "NDE"), ("unbalance", "")):
        mixed = share * chance(bad, kind, where) + (1 - share) * chance(good, kind, where)
        assert mixed == pytest.approx(chance(before, kind, where))
    assert name not in {one.name for one in bad.checks}


def test_a_flip_changes_the_answer_and_a_little_less_does_not():
    card = restart_card(drop(), BY_COST)
    costs = [one for one in card.flips if one.of == "a damaged machine"]
    assert costs, "half a day decides here"
    for flip in costs:
        beyond, short = flip.factor, flip.factor**0.95
        for factor, same in ((beyond, False), (short, True)):
            moved = BY_COST.model_copy(update={"machine_cost": BY_COST.machine_cost * factor})
            assert (restart_card(drop(), moved).answer == card.answer) is same


@pytest.mark.parametrize(("name", "label"), list(COSTS.items()))
def test_every_cost_that_can_change_the_answer_is_tried(name, label):
    """Each cost at the end of its range: where the answer is another one there, a flip says so."""
    card = restart_card(drop(), BY_COST)
    value = getattr(BY_COST, name)
    ends = [value * factor for factor in (FLIPS_WITHIN, 1.0 / FLIPS_WITHIN)]
    if name in SHARES:
        ends = [min(end, 1.0) for end in ends]
    answers = {restart_card(drop(), BY_COST.model_copy(update={name: end})).answer for end in ends}
    if answers != {card.answer}:
        assert label in {flip.of for flip in card.flips}


def test_earlier_drops_and_a_limit_that_the_next_drop_passes_count():
    assert chance(
        restart_card(drop(), ASSUMED, earlier=[EarlierDrop(record="x")] * 9), "worn"
    ) == pytest.approx(1 - 0.98**10)
    known = {"NDE": (Known(value=3e3), Known(value=4e3))}
    after = [
        NextDrop(speed=s, peak_force=known, peak_stress=known, beyond_limit=Known(value=v))
        for s, v in ((400.0, 0.5), (280.0, 0.1))
    ]
    with_limit, without = (
        restart_card(drop(), ASSUMED, foreseen=Foreseen(drops=tuple(after))),
        restart_card(drop(), ASSUMED),
    )
    exchange = ASSUMED.bearing_set_cost + ASSUMED.exchange_days
    for answer, share in (("restart", 0.5), ("restart with limits", 0.1)):
        more = with_limit.costs[answer] - without.costs[answer]
        assert more == pytest.approx(ASSUMED.another_drop * share * exchange)


def test_an_earlier_drop_of_another_machine_is_said_and_concludes_nothing():
    """The support of the other one has twice the mass; a stiffness "x 2.1" had called for a replacement."""

    def supported(mass):
        path = "NDE.support.mass"
        own = Parameter(
            path=path, scope="machine", prior=None, estimate=value(mass, 0.97 * mass, mass / 0.97)
        )
        found = drop(gap=285e-6 if mass > 40.0 else 275e-6)
        joint = Joint(
            paths=[path], mean=[math.log(mass)], covariance=[4e-4], prior_mean=[math.log(40.0)],
            prior_standard_deviation=[0.4],
        )  # fmt: skip
        return found.model_copy(update={"parameters": [*found.parameters, own], "joint": joint})

    earlier = inspected(supported(28.0))
    card = restart_card(supported(56.0), ASSUMED, earlier=[earlier])
    assert any("not of one machine" in one and "Nothing is concluded" in one for one in card.statements)
    blind = restart_card(supported(56.0), ASSUMED, earlier=[replace(earlier, estimate=None)])
    assert chance(card, "worn") == pytest.approx(chance(blind, "worn"))


def test_damage_that_an_earlier_estimate_would_have_shown_counts_no_more():
    """Ten drops of which the last but one was still sound: only the last can have done it."""
    first, open_ = inspected(drop()), [replace(earlier_drop(drop()), estimate=None)] * 9
    at_once = restart_card(drop(), ASSUMED, earlier=[first, *open_])
    step_by_step = restart_card(drop(), ASSUMED, earlier=[first, *[earlier_drop(drop())] * 9])
    assert chance(step_by_step, "worn") < 0.5 * chance(at_once, "worn")
    assert chance(step_by_step, "brinelled") == pytest.approx(chance(at_once, "brinelled"))
    worn = drop(gap=285e-6)
    early = restart_card(worn, ASSUMED, earlier=[first, *[earlier_drop(worn)] * 9])
    late = restart_card(worn, ASSUMED, earlier=[first, *[earlier_drop(drop())] * 9])
    assert min(chance(early, "worn"), chance(late, "worn")) > 0.9


def test_the_stress_of_earlier_drops_counts():
    hard = {"NDE": Value(value=5.5e9, interval_90=[5.4e9, 5.6e9])}
    card = restart_card(drop(), ASSUMED, earlier=[EarlierDrop(record="x", stresses=hard)])
    assert chance(card, "brinelled") > 0.5 > 0.05 > chance(card, "brinelled", "DE")


def test_it_runs_without_limits_only_where_the_chance_of_a_damaged_bearing_is_small_enough():
    free, held = (restart_card(drop(), a, earlier=[inspected(drop())]) for a in (BY_COST, ASSUMED))
    assert free.answer == "restart"
    assert held.costs == free.costs
    assert 1.0 - held.sound > ASSUMED.most_doubt
    assert held.answer != "restart"
    by = "up to 1 % it may restart (the doubt that is allowed, whatever it costs)"
    assert any(by in text for text in held.statements)
    assert any("it may restart (by the costs)" in text for text in free.statements)
    good = dict.fromkeys(("turning", "borescope", "coast-down", "lift"), "good")
    turned = restart_card(drop(), ASSUMED, earlier=[inspected(drop())], checks=good)
    assert 1.0 - turned.sound < ASSUMED.most_doubt
    assert turned.answer == "restart"


def test_an_estimate_that_does_not_fit_is_no_evidence():
    card = restart_card(drop(gap=295e-6, consistent=False), ASSUMED, earlier=[inspected(drop())])
    assert not card.indicators
    assert any("not consistent with this record" in text for text in card.statements)


def test_owner_states_what_differs_and_the_rest_stays(tmp_path):
    file = tmp_path / "owner.toml"
    file.write_text('machine_cost = 900\nunit = "kEUR"\nsource = "works"\n[damages.worn]\nprior = 0.1\n')
    assumed = load_assumptions(file)
    assert (assumed.machine_cost, assumed.damages["worn"].prior) == (900.0, 0.1)
    assert assumed.damages["worn"].risk == ASSUMED.damages["worn"].risk
    card = restart_card(drop(), assumed)
    assert "kEUR" in card.statements[1]
    assert "those of: works" in card.statements[-1]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("machine_cost = -1", r"machine_cost is '-1'.*greater than 0"),
        ("machine_price = 1", r"machine_price"),
        ("[damages.worn]\nprior = 1.5", r"damages\.worn\.prior is '1\.5'.*less than 1"),
        (
            "[checks.lift.shows]\nrust = 0.5",
            r"checks\.lift\.shows\.rust: there is no such damage; there are worn",
        ),
        ("[checks.lift.shows]\nworn = 2.0", r"checks\.lift\.shows\.worn = 2; expected a chance from 0 to 1"),
        ("machine_cost = nan", r"machine_cost is 'nan'"),
        ("machine_cost =", r"not valid TOML"),
    ],
)
def test_bad_assumptions_are_named(tmp_path, text, message):
    file = tmp_path / "owner.toml"
    file.write_text(text)
    with pytest.raises(UsageError, match=message):
        load_assumptions(file)
    with pytest.raises(UsageError, match=r"none\.toml: cannot read the assumptions file"):
        load_assumptions(tmp_path / "none.toml")


def test_unknown_checks_and_outcomes_are_named():
    with pytest.raises(UsageError, match="there is no check 'x-ray'; there are lift"):
        restart_card(drop(), ASSUMED, checks={"x-ray": "bad"})
    with pytest.raises(UsageError, match="check lift = 'fine'; expected good or bad"):
        restart_card(drop(), ASSUMED, checks={"lift": "fine"})


def test_page_json_and_terminal_say_the_same(capsys):
    one = drop(gap=295e-6, simulated_record=True)
    card = restart_card(one, ASSUMED, earlier=[inspected(drop())], checks={"turning": "good"})
    page = restart_page(card, one)
    assert page.title.endswith(card.answer)
    assert "simulated" in page.simulated
    content = json.loads(json.dumps(restart_numbers(card), allow_nan=False))
    assert content["answer"] == card.answer
    assert content["costs"] == pytest.approx(card.costs)
    from rotordrop.cli._output import console

    print_summary(page, console())
    out = capsys.readouterr().out
    assert card.answer in out
    assert "made: turning the rings by hand (good)" in out


def test_costs_and_chances_are_written_one_way_in_sentences_and_tables():
    """ "replace 1.3e+02" stood beside 128, "100.0 %" beside "> 99 %", and "1 days of standstill"."""
    for scale in (1.0, 40.0, 4e4, 4e8):
        costs = {"day_cost": scale, "bearing_set_cost": 1.5 * scale, "machine_cost": 62.5 * scale}
        assumed = assumptions_of({**costs, "unit": "EUR"}, "here")
        for one, earlier in ((drop(), []), (drop(gap=310e-6), [inspected(drop())])):
            card = restart_card(one, assumed, earlier=earlier)
            page = restart_page(card, one)
            tables = [*page.summary, *(table for section in page.sections for table in section.tables)]
            cells = [
                str(getattr(cell, "text", cell)) for table in tables for row in table.rows for cell in row
            ]
            written = " ".join(
                [*card.statements, *cells, *(f.value.text for c in page.cards for f in c.figures)]
            )
            assert not re.search(r"\de[+-]\d", written)
            assert "100.0 %" not in written and "0.0 %" not in re.sub(r"\d0\.0 %", "", written)
            for answer, row in zip(ANSWERS, page.summary[0].rows, strict=True):
                assert str(row[1]) in card.statements[int(card.prior_alone)]
                assert answer in str(row[0])
    assert ASSUMED.cost(1.0) == "1 day of standstill"
    assert ASSUMED.cost(1.5) == "1.5 days of standstill"


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (0.0, "0"),
        (127.6, "128"),
        (1111.0, "1110"),
        (9.36e-14, "< 0.001"),
        (-2e-9, "> −0.001"),
        (2.98e6, "2.98 million"),
        (999_999.9, "1 million"),
        (1.07e13, "10.7 trillion"),
        (-0.0993, "−0.0993"),
    ],
)
def test_an_amount_is_written_as_one_says_it(number, text):
    assert format_amount(number) == text


def test_probabilities_are_reliable_where_the_world_is_as_assumed():
    """Of the states drawn as the assumptions say, the stated share is damaged."""
    random = np.random.default_rng(8)
    stated, true = [], []
    effect = ASSUMED.damages["worn"].moves["air_gap"]
    own = math.sqrt(2.0) * 1e-6
    often = ASSUMED.damages["worn"].model_copy(update={"prior": 0.3})
    world = ASSUMED.model_copy(update={"damages": {**ASSUMED.damages, "worn": often}})
    for _ in range(400):
        worn = random.random() < 0.3
        moved = math.sqrt(2.0) * effect.healthy * random.standard_normal() + own * random.standard_normal()
        moved += worn * effect.median * math.exp(effect.spread * random.standard_normal())
        one = drop(gap=275e-6 + moved)
        found = suspicions(one, indicators(one, [inspected(drop())], world), [inspected(drop())], world)
        stated.append(next(s.probability for s in found if (s.kind, s.bearing) == ("worn", "NDE")))
        true.append(worn)
    error = math.sqrt(sum(p * (1 - p) for p in stated))
    assert abs(sum(stated) - sum(true)) < 3.0 * error


def test_next_drops_are_at_their_speeds_and_pass_limits_as_they_say():
    machine = example_machine("small")
    full, slower = next_drops(
        *(machine, 2 * math.pi * 100.0, {"peak_force_N": 1.0}),
        chance=0.05,
        drops=20,
        duration=0.01,
        shares=(1.0, 0.7),
    ).drops
    assert (full.speed, slower.speed) == pytest.approx((2 * math.pi * 100.0, 2 * math.pi * 70.0))
    for name in full.peak_force:
        middle, high = full.peak_force[name]
        assert 0.0 < middle.value <= high.value
    assert full.beyond == 1.0, "a newton is passed by every drop"
    between = 0.5 * sum(known[0].value for known in full.peak_force.values()) / len(full.peak_force)
    high = {"peak_force_N": 1e9, "peak_stress_Pa": 1e12}
    (none,) = next_drops(
        machine, 2 * math.pi * 100.0, high, chance=0.05, drops=20, duration=0.01, shares=(1.0,)
    ).drops
    assert none.beyond == 0.0 < between
    (unasked,) = next_drops(machine, 2 * math.pi * 100.0, {}, chance=0.05, drops=20, duration=0.01).drops
    assert unasked.beyond_limit is None


def test_the_command_reads_hertz_and_simulates_radians(tmp_path):
    machine = example_machine("small")
    one = drop(machine=machine.name, speed_Hz=80.0)
    estimate, file, out = (tmp_path / name for name in ("drop.json", "m.toml", "card.json"))
    write_json(estimate, one.as_json(), sealed=True)
    save_machine(machine, file)
    call = ["restart", str(file), str(estimate), "--drops", "2", "--json", str(out), "--check", "lift=good"]
    assert run([*call, "--report", str(tmp_path / "card.html")]) == 0
    card = read_document(out)
    assert card["foreseen"]["drops"][0]["speed"] == pytest.approx(2 * math.pi * 80.0)
    assert card["made"] == {"lift": "good"}
    assert f"Restart of {machine.name}" in (tmp_path / "card.html").read_text()
    save_machine(example_machine("lp400"), file)
    assert run(call) == UsageError.exit_code


def test_the_command_counts_the_stress_of_logged_drops_and_every_earlier_estimate(tmp_path, capsys):
    machine = example_machine("small")
    places = {}
    for name, stress in (("first", 2e9), ("hard", 6e9), ("now", 2e9)):
        places[name] = tmp_path / f"{name}.json"
        one = drop(stress=stress, machine=machine.name, record_sha256=sha256(name.encode()).hexdigest())
        write_json(places[name], one.as_json(), sealed=True)
    file, log, out = (str(tmp_path / name) for name in ("m.toml", "drops.db", "card.json"))
    save_machine(machine, Path(file))
    call = ["restart", file, str(places["now"]), "--drops", "0", "--json", out]
    assert run(call) == 0
    alone = read_document(out)
    for name in ("first", "hard"):
        assert run(["log", "add", log, str(places[name])]) == 0
        call += ["--since", str(places[name])]
    assert run([*call, "--log", log]) == 0
    card = read_document(out)
    dents = [
        max(one["probability"] for one in of["suspicions"] if one["kind"] == "brinelled")
        for of in (alone, card)
    ]
    assert dents[0] < 0.05 < 0.8 < dents[1]
    assert {len(one["ratios"]) for one in card["indicators"]} == {3}
    assert run([*call, "--since", str(places["now"])]) == UsageError.exit_code
    assert "are of one recording" in capsys.readouterr().err
    assert run([*call, "--log", log, "--bearings", "3"]) == UsageError.exit_code
    assert "with this set of bearings; there are 1" in capsys.readouterr().err


HARDER = {"restart": 0, "restart with limits": 1, "inspect first": 2, "replace": 2}
"""Answers by how far they go; opening and replacing both stop the machine."""
COSTLY = (
    {},
    {"most_doubt": 1.0},
    {"limited_days": 0.2, "inspection_days": 3.0},
    {"machine_cost": 400.0, "most_doubt": 0.3},
    {"limited_days": 0.5, "inspection_days": 2.0, "most_doubt": 0.05, "limited_risk": 0.1},
)


@pytest.mark.parametrize("owner", COSTLY)
@pytest.mark.parametrize("seed", range(2))
def test_worse_evidence_never_gives_a_milder_answer(owner, seed):
    """Checks from good over not made to bad, and sizes of what changed, each alone and with the others."""
    random, assumed = np.random.default_rng(seed), assumptions_of(owner, "here")
    names = list(assumed.checks)
    seen = set()
    for _ in range(5):
        sizes = random.uniform(0.0, 1.0, 3) * (random.random(3) < 0.6)
        at = {name: int(random.integers(3)) for name in names}

        def answer(sizes, at):
            one = drop(
                gap=(275 + 25 * sizes[0]) * 1e-6,
                stiffness=1e8 * (1 - 0.4 * sizes[1]),
                unbalance=1.5e-5 * math.exp(1.2 * sizes[2]),
            )
            made = {name: ("good", "", "bad")[how] for name, how in at.items() if how != 1}
            card = restart_card(one, assumed, earlier=[inspected(drop(unbalance=1.5e-5))], checks=made)
            seen.add(card.answer)
            return HARDER[card.answer], 1.0 - card.sound

        before = answer(sizes, at)
        name = names[random.integers(len(names))]
        place = random.integers(3)
        worse = [answer(sizes, at | {name: min(at[name] + 1, 2)})]
        worse.append(answer(np.where(np.arange(3) == place, np.minimum(sizes + 0.3, 1.5), sizes), at))
        for after in worse:
            assert after[0] >= before[0] and after[1] >= before[1] - 1e-9
    assert seen


def test_a_bad_check_at_a_worn_gap_stops_the_machine_too():
    """At the costs of the package running with limits was cheaper than new bearings, and so the answer."""
    worn = drop(gap=284e-6)
    for checks in ({}, {"lift": "bad"}, {"lift": "bad", "tail": "bad"}):
        assert HARDER[restart_card(worn, ASSUMED, earlier=[inspected(drop())], checks=checks).answer] == 2


def test_a_gap_that_became_smaller_is_named_as_a_contradiction_and_no_evidence():
    card = restart_card(drop(gap=255e-6), ASSUMED, earlier=[inspected(drop())])
    (said, _) = [
        text
        for text in card.statements
        if text.startswith("A contradiction: NDE") or "DE.air_gap -20" in text
    ]
    assert "NDE.air_gap -20 µm since then, where a bearing only wears wider" in said
    assert chance(card, "worn") == pytest.approx(0.02)
    scattered = restart_card(drop(gap=272e-6), ASSUMED, earlier=[inspected(drop())])
    assert not any("contradiction" in text for text in scattered.statements)


def logged(recorded, name="old", stress=6e9):
    return EarlierDrop(record=name, recorded=recorded, stresses={"NDE": value(stress)})


def test_drops_count_by_their_dates():
    now = drop(recorded="2026-03-14T15:09")
    early, late = drop(recorded="2025-01-01", record="a"), drop(recorded="2026-02-01", record="b")
    earlier, said = in_order(now, [late, early], [logged("2026-03-01"), logged("2026-04-01", name="new")])
    assert [one.record for one in earlier] == ["a", "b", "old"]
    assert said == ["Later than this drop and left out: 1 of the log, new (2026-04-01)."]
    earlier, said = in_order(now, [], [logged(""), logged("2026-03-01")])
    assert len(earlier) == 2
    assert said == ["Of 2 earlier drops of the log 1 has no date and counts as earlier."]
    earlier, said = in_order(now, [], [logged("2026-03-01", stress=2e9), logged("2026-02-01", stress=1e9)])
    assert [one.stresses["NDE"].value for one in earlier] == [1e9, 2e9]
    assert not said
    _, said = in_order(drop(), [early, drop()], [logged("2026-03-01")])
    assert said == [
        "Not all earlier estimates have a date: they count in the order they are given.",
        "This drop has no date: the other one of the log counts as earlier.",
    ]
    with pytest.raises(UsageError, match=r"--since b is of 2026-02-01, later than drop.h5 of 2025-06-01"):
        in_order(drop(recorded="2025-06-01"), [late], [])


@pytest.mark.parametrize("seed", range(4))
def test_the_speed_limit_is_found_with_an_interval_that_holds_it(seed):
    """Peaks that grow with the speed to the power 0.8 and scatter by 15 %: 5 % pass where they should."""
    random = np.random.default_rng(seed)
    speeds = 100.0 * np.array([1.0, 0.85, 0.7, 0.55, 0.4, 0.25])
    scatter = np.exp(0.15 * random.standard_normal(24))
    ratios = 1.5 * (speeds / 100.0)[:, None] ** 0.8 * scatter * np.exp(0.05 * random.standard_normal((6, 24)))
    true = 100.0 * (math.exp(-1.645 * math.hypot(0.15, 0.05)) / 1.5) ** (1 / 0.8)
    found = speed_limit(speeds, ratios, 0.05)
    low, high = found.interval_90
    assert low <= found.speed <= high
    assert 0.9 * low < true < 1.1 * high
    assert found.needed
    assert speed_limit(speeds, 0.1 * ratios, 0.05).speed == 100.0
    assert not speed_limit(speeds, 0.1 * ratios, 0.05).needed
    assert speed_limit(speeds, 10.0 * ratios, 0.05).speed is None
    failed = np.where(np.arange(len(ratios[0])) < 3, np.nan, ratios)
    assert speed_limit(speeds, failed, 0.05).drops == found.drops - 3 * len(speeds)
    assert speed_limit(speeds, np.full_like(ratios, np.nan), 0.05) is None


def test_the_answer_says_the_next_drop_and_the_speed_limit():
    high = Known(value=4e3, drops=24, interval_90=(3.5e3, math.inf))
    known = {"NDE": (Known(value=3e3, drops=24), high)}
    after = tuple(
        NextDrop(
            speed=s, peak_force=known, peak_stress=known, beyond_limit=Known(value=v, interval_90=(v, v))
        )
        for s, v in ((400.0, 0.9), (280.0, 0.1))
    )
    limit = SpeedLimit(speed=250.0, interval_90=(220.0, 270.0), chance=0.05, tried=(100.0, 400.0), drops=144)
    foreseen = Foreseen(drops=after, speed_limit=limit, limits={"peak_stress_Pa": 2.5e9}, of_estimate=True)
    card = restart_card(drop(), ASSUMED, foreseen=foreseen)
    said = " ".join(card.statements)
    assert "as this estimate found the machine, by 24 simulated ones; it passes the limit, " in said
    assert "peak Hertz stress of 2500 MPa, with 90 % (90 %: 90 % to 90 %)" in said
    assert "NDE: force below 3" in said
    assert re.search(r"\([^()]* or more\) in 95 %", said)
    assert "A speed limit of 39.8 Hz" in said and "take the lower end" in said
    full, limited = (card.costs[name] for name in ("restart", "restart with limits"))
    plain = restart_card(drop(), ASSUMED).costs
    exchange = ASSUMED.bearing_set_cost + ASSUMED.exchange_days
    assert full - plain["restart"] == pytest.approx(ASSUMED.another_drop * 0.9 * exchange)
    assert limited - plain["restart with limits"] == pytest.approx(ASSUMED.another_drop * 0.05 * exchange)


def test_the_next_drops_are_counted_by_speed_and_no_more_is_said_than_they_tell():
    """24 at full speed and 12 at each lower one were "24 a speed", and "5 % or less" stood beside 22 %."""
    few = tuple(
        NextDrop(
            speed=speed,
            peak_force=dict.fromkeys(("NDE", "DE"), (Known(value=3e3, drops=count),) * 2),
            peak_stress=dict.fromkeys(("NDE", "DE"), (Known(value=2e9, drops=count),) * 2),
            beyond_limit=Known(value=0.0, interval_90=(0.0, high), drops=count),
        )
        for speed, count, high in ((400.0, 24, 0.22), (200.0, 12, 0.3))
    )
    limit = SpeedLimit(speed=400.0, interval_90=(300.0, 400.0), chance=0.05, tried=(100.0, 400.0), drops=60)
    foreseen = Foreseen(drops=few, speed_limit=limit, limits={"peak_stress_Pa": 2.5e9})
    card = restart_card(drop(), ASSUMED, foreseen=foreseen)
    (said,) = (text for text in card.statements if "speed limit" in text)
    assert "about 5 % at most, and these drops cannot rule out 22 %" in said
    next_ = next(
        s
        for s in restart_page(card, drop()).sections
        if s.tables and s.tables[0].caption == "The next drop by speed"
    )
    (shown,) = next_.tables
    assert "24" not in shown.note
    assert [row[-1] for row in shown.rows] == ["24", "12"]
    assert shown.columns[-2] == "passes peak Hertz stress of 2500 MPa"
    assert shown.rows[0][-2] == "< 1 % (< 1 % to 22 %)"
    many = replace(few[0], beyond_limit=Known(value=0.0, interval_90=(0.0, 0.03), drops=24))
    sure = restart_card(drop(), ASSUMED, foreseen=replace(foreseen, drops=(many, *few[1:])))
    assert any("passed with 5 % at most." in text for text in sure.statements)


def test_next_drops_are_of_the_machine_that_the_estimate_found():
    """Its gaps and friction with their intervals, as a calibrated machine would have them."""
    machine = example_machine("small")
    model = build_drop_model(machine)
    unknowns = [one for one in all_unknowns(model) if is_of_a_bearing(one)]
    found, mean = [], []
    for one in unknowns:
        at = one.mean + (math.log(1.1) if one.path == "NDE.friction.dynamic" else 0.0)
        mean.append(at)
        middle, low, high = (one.value_of(at + k * NINETY * 0.1 * one.sigma) for k in (0, -1, 1))
        ends = sorted((low, high))
        number = Value(value=middle, status="determined", interval_90=ends, unit="")
        found.append(Parameter(path=one.path, scope="machine", prior=None, estimate=number))
    size = len(unknowns)
    covariance = np.diag([(0.1 * one.sigma) ** 2 for one in unknowns])[np.tril_indices(size)].tolist()
    joint = Joint(
        paths=[one.path for one in unknowns],
        mean=mean,
        covariance=covariance,
        prior_mean=mean,
        prior_standard_deviation=[0.1] * size,
    )
    estimate = published(machine=machine.name, parameters=found, joint=joint)
    after = found_machine(machine, estimate)
    before = machine.touchdown_bearings[0].friction.dynamic
    assert float(after.touchdown_bearings[0].friction.dynamic) == pytest.approx(1.1 * float(before), rel=1e-6)
    spread = after.calibration.joint
    at = spread.paths.index("NDE.friction.dynamic")
    friction = next(one for one in unknowns if one.path == "NDE.friction.dynamic")
    assert math.sqrt(spread.matrix[at, at]) == pytest.approx(0.1 * friction.sigma, rel=1e-6)
    assert found_machine(machine, published(machine=machine.name)) is None
    (one,) = next_drops(machine, 600.0, {}, chance=0.05, drop=estimate, drops=3, duration=0.01).drops
    assert next_drops(machine, 600.0, {}, chance=0.05, drop=estimate, drops=2, duration=0.005).of_estimate
    assert one.beyond_limit is None


def by_hand(assumed, odds, checks):
    """Chance of each kind by the sum over every drop that may have done each of them, none included."""
    kinds, drops = list(assumed.damages), len(checks)
    total, there = 0.0, dict.fromkeys(kinds, 0.0)
    for when in product(range(drops + 1), repeat=len(kinds)):
        weight = math.prod(
            1.0 if at == drops else odds[kind][at] for kind, at in zip(kinds, when, strict=True)
        )
        for k, made in enumerate(checks):
            for name, outcome in made.items():
                check = assumed.checks[name]
                unseen = (1.0 - check.false_alarm) * math.prod(
                    1.0 - check.shows.get(kind, 0.0) for kind, at in zip(kinds, when, strict=True) if at <= k
                )
                weight *= unseen if outcome == "good" else 1.0 - unseen
        total += weight
        for kind, at in zip(kinds, when, strict=True):
            there[kind] += weight * (at < drops)
    return {kind: share / total for kind, share in there.items()}


def test_checks_of_earlier_drops_count_as_a_sum_over_the_drops_that_did_the_damage():
    """A check sees what was there when it was made; the drops are those of one bearing."""
    one, two, now = (drop(gap=gap, unbalance=1.5e-5) for gap in (275e-6, 276e-6, 280e-6))
    for each in (one, two, now):
        each.bearings.pop("DE")
    checks = [{"lift": "good", "turning": "bad"}, {"tail": "bad"}, {"lift": "bad", "coast-down": "good"}]
    earlier = [inspected(one, **checks[0]), inspected(two, **checks[1])]
    card = restart_card(now, ASSUMED, earlier=earlier, checks=checks[2])
    odds = {one.kind: one.odds for one in card.suspicions}
    expected = by_hand(ASSUMED, odds, checks)
    assert {one.kind: one.probability for one in card.suspicions} == pytest.approx(expected)
    assert card.sound < 1.0 - max(expected.values())


def test_a_bad_check_of_an_earlier_drop_is_not_forgotten_and_a_good_one_counts_less_than_now():
    plain, bad, good = (
        restart_card(
            drop(), ASSUMED, earlier=[inspected(drop(), inspection="good"), inspected(drop(), **checks)]
        )
        for checks in ({"lift": "good"}, {"turning": "bad"}, {"turning": "good"})
    )
    assert chance(bad, "brinelled") > 5.0 * chance(plain, "brinelled")
    assert chance(good, "brinelled") < chance(plain, "brinelled")
    assert any("turning bad after drop.h5" in text for text in bad.statements)
    now = restart_card(
        drop(),
        ASSUMED,
        earlier=[inspected(drop()), inspected(drop(), lift="good")],
        checks={"turning": "good"},
    )
    assert chance(now, "brinelled") < chance(good, "brinelled")


def test_damage_of_the_first_drop_stays_possible_where_nothing_looked_for_it():
    """No change since an estimate says nothing of what was there at it; an inspection does."""
    unseen = restart_card(drop(), ASSUMED, earlier=[earlier_drop(drop())])
    assert chance(unseen, "worn") == pytest.approx(0.02, abs=0.003)
    assert chance(restart_card(drop(), ASSUMED, earlier=[inspected(drop())]), "worn") < 0.01
    looked_over = restart_card(drop(stress=6.5e9), ASSUMED, checks={"inspection": "good"})
    assert looked_over.sound == 1.0
    assert looked_over.answer == "restart"
    with pytest.raises(UsageError, match="check inspection = 'bad'; state inspection=good once"):
        restart_card(drop(), ASSUMED, checks={"inspection": "bad"})


@pytest.mark.parametrize("seed", range(3))
def test_a_worse_earlier_check_never_gives_a_milder_answer(seed):
    random, names = np.random.default_rng(seed), list(ASSUMED.checks)
    for _ in range(4):
        made = [
            {name: ("good", "bad")[random.integers(2)] for name in names if random.random() < 0.4}
            for _ in range(3)
        ]

        def answer(made):
            earlier = [
                inspected(drop(unbalance=1.5e-5), **of) if of else earlier_drop(drop()) for of in made[:2]
            ]
            card = restart_card(drop(gap=277e-6), ASSUMED, earlier=earlier, checks=made[2])
            return HARDER[card.answer], 1.0 - card.sound

        k, name = random.integers(3), names[random.integers(len(names))]
        grades = []
        for outcome in ("good", "", "bad"):
            of = {key: how for key, how in made[k].items() if key != name} | (
                {name: outcome} if outcome else {}
            )
            grades.append(answer([*made[:k], of, *made[k + 1 :]]))
        for milder, harder in pairwise(grades):
            assert harder[0] >= milder[0] and harder[1] >= milder[1] - 1e-9


def test_a_check_with_a_date_belongs_to_the_last_drop_before_it():
    now = drop(recorded="2026-03-14T15:09")
    earlier = [logged("2026-01-05T10:00", name="a"), logged("2026-02-01", name="b")]

    def placed(*made):
        found, of_now = with_checks(
            now, earlier, [MadeCheck(name="lift", outcome="bad", day=day) for day in made]
        )
        return [dict(one.checks) for one in found], of_now

    bad = {"lift": "bad"}
    assert placed("2026-01-05") == ([bad, {}], {}), "a day ends at midnight"
    assert placed("2026-02-20", "") == ([{}, bad], bad)
    assert placed("2026-03-14") == ([{}, {}], bad)
    with pytest.raises(UsageError, match="'2025-12-01 lift=bad' was before every drop that has a date"):
        placed("2025-12-01")
    with pytest.raises(UsageError, match="'soon' is no date; expected one such as 2026-03-14"):
        placed("soon")
    with pytest.raises(UsageError, match="--check lift is given twice"):
        placed("", "2026-03-15")
    now = drop()
    with pytest.raises(UsageError, match=r"has a date, and .* has none"):
        placed("2026-02-20")


def test_the_checks_of_the_package_are_named_where_they_are_asked_for(capsys):
    """Help and error named none of them."""
    names = tuple(assumptions_of({}, "the assumptions").checks)
    assert names == CHECKS
    assert run(["restart", "--help"]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert all(name in told.replace("- ", "-") for name in names)  # a terminal breaks after a hyphen
    with pytest.raises(UsageError, match="expected one of lift, coast-down, turning"):
        _checks(["turning"])


def test_no_check_is_asked_for_where_none_pays_and_no_speed_limit_offered_where_none_was_found():
    """ "Make one" stood beside "none of the checks pays", limits beside "no speed limit"."""
    limit = SpeedLimit(speed=None, interval_90=None, chance=0.01, tried=(60.0, 600.0), drops=20)
    card = restart_card(drop(), assumptions_of({}, "the assumptions"), foreseen=Foreseen(speed_limit=limit))
    assert card.prior_alone
    assert ("Make one" in card.statements[0]) == (card.best_check is not None)
    free = restart_card(drop(), assumptions_of({"machine_cost": 1e-3, "most_doubt": 1.0}, "mine"))
    assert free.best_check is None and free.prior_alone and "Make one" not in free.statements[0]
    flip = Flip(of="a day of standstill", factor=2.0, answer="restart with limits")
    assert answer_in(card, flip) == "restart with limits (no speed limit was found)"
    assert answer_in(free, flip) == "restart with limits"


def test_changes_of_one_recording_are_refused(tmp_path):
    """Two estimates of one recording were compared without a word."""
    places = [str(tmp_path / f"{name}.json") for name in "ab"]
    for place in places:
        write_json(Path(place), drop(record_sha256=sha256(b"one").hexdigest()).as_json(), sealed=True)
    with pytest.raises(UsageError, match="are of one recording, so nothing changed"):
        _deliver_changes([Path(place) for place in places], None)
