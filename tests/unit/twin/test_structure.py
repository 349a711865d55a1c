"""Which extension is kept, and what it says: the rule on made-up likelihoods, sentences on made-up values."""

from __future__ import annotations

import math
import re
from collections import Counter
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rotordrop.elements.parameter import derived
from rotordrop.elements.support import soft_axis, soft_over_stiff
from rotordrop.elements.table import EXTENSIONS
from rotordrop.errors import IdentificationError
from rotordrop.estimate.document import published_structure
from rotordrop.estimate.estimate import Verdict
from rotordrop.evidence.evidence import read_evidence
from rotordrop.known import Known
from rotordrop.machine import Machine, load_machine
from rotordrop.machine.saving import save_machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.unknowns import all_unknowns
from rotordrop.track.calibration import Stage, TrackedDrops, track
from rotordrop.twin import rises as rises_module
from rotordrop.twin import search as search_module
from rotordrop.twin.calibrated import with_found
from rotordrop.twin.problems import Drops
from rotordrop.twin.rises import Rises
from rotordrop.twin.search import (
    CALIBRATION_STAGE,
    FIRST_OTHER_START,
    LEAST_RISE,
    Accepted,
    Candidate,
    Checkpoint,
    Search,
    asked_for,
    best_structure,
    score_of,
)
from rotordrop_bench import SyntheticDrop


def fit_of(negative_log_likelihood: float, nis: float, factor: float = 1.0) -> Any:
    return SimpleNamespace(
        negative_log_likelihood=negative_log_likelihood,
        nis=(nis,),
        noise_factors=(factor,),
        diverged=(False,),
    )


def has(machine: Machine) -> frozenset[str]:
    """Extensions that a machine has, by the values its description names."""
    bearing, sensor = machine.touchdown_bearings[0].support, machine.sensors[0]
    marks = {
        "turned support axes": bearing.coupling,
        "cubic support": bearing.cubic,
        "hysteretic support": bearing.friction,
        "foundation mode": bearing.foundation_share,
        "sensor lag": sensor.time_constant,
        "cross-axis sensitivity": sensor.cross_axis,
        "brackets that follow the housing": sensor.follows_housing,
        "sensor planes elsewhere": sensor.plane_offset,
        "long remanence": machine.remanence_time_constant,
        "unbalance beyond its grade": machine.unbalances[0].beyond_described,
        "rotor stiffness": machine.rotor.stiffness_factor,
        "sampling clock": machine.clock_error,
        "side force": machine.side_force,
        "eccentric sleeve": machine.touchdown_bearings[0].landing_sleeve.eccentricity,
        "oval sleeve": machine.touchdown_bearings[0].landing_sleeve.oval,
    }
    return frozenset(name for name, value in marks.items() if value is not None)


class Record:
    """A record by the likelihood it gives to machines with certain extensions, whatever the window."""

    windows = 4

    def __init__(self, table: dict[frozenset[str], Any], base: Any, back: Any = None) -> None:
        self.table, self.base, self.back = table, base, back
        self.attempts: list[int] = []
        self.passed: Counter[int] = Counter()

    def fit(self, machine: Machine, start: int) -> Any:
        self.attempts.append(start)
        return self.table.get(has(machine), self.base)

    def extend(self, machine: Machine, start: int, number: int, before: Checkpoint | None) -> Checkpoint:
        assert (before is None) == (number == 0)
        self.passed[number] += 1
        fit = self.fit(machine, start)
        return Checkpoint(problems=(), trajectories=(fit,), score=score_of(fit))

    def converge(self, place: Checkpoint) -> Any:
        return place.trajectories[0]

    def relinearise(self, _known: Any, machine: Machine, _passes: int) -> Any:
        found = self.table.get(has(machine), self.base)
        return self.back if self.back is not None and not has(machine) else found


AXES, CUBIC = frozenset({"turned support axes"}), frozenset({"cubic support"})


def names(found: Candidate) -> list[str]:
    return [kept.extension.name for kept in found.accepted]


def test_the_extension_that_the_readings_pay_for_is_kept(lp400):
    base = fit_of(1000.0, 3.0)
    record = Record({AXES: fit_of(500.0, 0.9), CUBIC: fit_of(700.0, 1.1)}, base)
    found = best_structure(Candidate(machine=lp400, fit=base), record)
    assert names(found) == ["turned support axes"] and found.accepted[0].gain == pytest.approx(500.0)
    assert has(found.machine) == AXES


def test_what_pays_less_than_the_penalty_is_not_named(lp400):
    base = fit_of(1000.0, 3.0)
    record = Record({AXES: fit_of(1000.0 - 0.9 * LEAST_RISE, 3.0)}, base)
    found = best_structure(Candidate(machine=lp400, fit=base), record)
    assert names(found) == [] and found.machine == lp400


def test_an_extension_that_only_led_to_a_better_start_is_not_named(lp400):
    """The usual model, given the place that the extension has found, follows the record as well."""
    base, better = fit_of(1000.0, 3.0), fit_of(505.0, 0.95)
    record = Record({AXES: fit_of(500.0, 0.9)}, base, back=better)
    found = best_structure(Candidate(machine=lp400, fit=base), record)
    assert names(found) == [] and found.fit is better


def test_a_second_extension_comes_on_top_of_the_first(lp400):
    base = fit_of(1000.0, 3.0)
    record = Record(
        {AXES: fit_of(600.0, 1.6), CUBIC: fit_of(800.0, 2.0), AXES | CUBIC: fit_of(300.0, 0.9)}, base
    )
    found = best_structure(Candidate(machine=lp400, fit=base), record)
    assert names(found) == ["turned support axes", "cubic support"]
    assert [kept.gain for kept in found.accepted] == pytest.approx([400.0, 300.0])


def test_likelihoods_compare_at_equal_unknown_impulses_only(lp400):
    """A structure that follows the record with eight times the impulses is no better for its likelihood."""
    base = fit_of(1000.0, 3.0)
    record = Record({AXES: fit_of(100.0, 0.98, factor=8.0), CUBIC: fit_of(700.0, 1.1)}, base)
    found = best_structure(Candidate(machine=lp400, fit=base), record)
    assert names(found) == ["cubic support"]


def test_where_nothing_helps_the_best_of_other_starts_is_taken(lp400):
    base = fit_of(1000.0, 3.0)

    class Elsewhere(Record):
        def fit(self, machine: Machine, start: int) -> Any:
            if start == FIRST_OTHER_START:
                raise IdentificationError("lost")
            return fit_of(400.0, 0.9) if start == FIRST_OTHER_START + 1 else super().fit(machine, start)

    found = best_structure(Candidate(machine=lp400, fit=base), Elsewhere({}, base))
    assert names(found) == [] and found.fit.nis == (0.9,)


def test_the_half_that_follows_the_record_worse_stays_behind_window_by_window(lp400):
    base = fit_of(1000.0, 3.0)
    record = Record({AXES: fit_of(500.0, 0.9)}, base)
    best_structure(Candidate(machine=lp400, fit=base), record)
    ways = 2 * sum(bool(one.values(lp400)) for one in EXTENSIONS)
    assert [record.passed[k] for k in range(4)] == [ways, ways, ways, ways // 2]


def test_an_extension_that_loses_the_record_is_no_candidate(lp400):
    base = fit_of(1000.0, 3.0)

    class Lost(Record):
        def fit(self, machine: Machine, start: int) -> Any:
            if has(machine):
                raise IdentificationError("lost")
            return super().fit(machine, start)

    found = best_structure(Candidate(machine=lp400, fit=base), Lost({AXES: fit_of(1.0, 0.9)}, base))
    assert names(found) == [] and found.machine == lp400


ASKED = asked_for(1)


class Weighed:
    """A search that weighs extensions by made-up negative log likelihoods of the machines that have them.

    ``first`` are those of the first impacts and of the whole drop, linearised beside the fit; ``rest`` those
    of a fit at rest.
    What ``rest`` does not hold is lost; ``back`` is that of a base model fitted once more, and lost where
    it is infinite.
    """

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, first: Any, rest: Any, back: float | None = None
    ) -> None:
        self.fitted: list[frozenset[str]] = []
        self.rest, self.back = rest, back
        monkeypatch.setattr(search_module, "forward_passes", lambda problems, *_: problems)
        monkeypatch.setattr(
            Rises, "_unlikelihood", lambda _, machine: first.get(has(machine), first[frozenset()])
        )
        monkeypatch.setattr(Rises, "at_once", Rises.apart)
        monkeypatch.setattr(search_module, "likelihood_of", lambda _: first[frozenset()])
        monkeypatch.setattr(search_module, "converged", lambda problems, *_, **__: self.fit(problems))
        monkeypatch.setattr(search_module, "likeliest_noise", lambda *_: 0.125)
        monkeypatch.setattr(rises_module, "transferred", lambda _one, _two, means: means)
        monkeypatch.setattr(search_module, "parameters", lambda *_, **__: ())

    def problems(self, machine: Machine) -> Any:
        return (SimpleNamespace(machine=machine, first_contact=0.007, fall_time=0.007, time=np.zeros(3)),)

    def fit(self, problems: Any) -> Any:
        self.fitted.append(has(problems[0].machine))
        again = self.back is not None and self.fitted.count(BASE) > 1 and self.fitted[-1] == BASE
        unlikelihood = self.back if again else self.rest.get(self.fitted[-1], math.inf)
        if unlikelihood == math.inf:
            raise IdentificationError("lost")
        found = fit_of(unlikelihood, 0.9)
        found.problems, found.trajectories = problems, [np.zeros((3, 2))]
        found.smoothed = [SimpleNamespace(filtered=None)]
        return found

    def found(self, machine: Machine) -> Candidate:
        drops = SimpleNamespace(fine=self.problems, calibrate_only=False)
        search = Search(drops=drops, progress=None)  # type: ignore[arg-type]
        return search.weighed(Candidate(machine=machine, fit=self.fit(self.problems(machine))))


BASE, CROSS, SOFTER = frozenset[str](), frozenset({"cross-axis sensitivity"}), frozenset({"rotor stiffness"})


def test_what_the_readings_ask_for_beside_a_model_that_fits_is_added(lp400, monkeypatch):
    """The one that raises the likelihood most first; what falls is not fitted at all."""
    first = {BASE: 100.0, CROSS: 97.0, SOFTER: 88.0, AXES: 111.0}
    weighed = Weighed(monkeypatch, first, {BASE: 1000.0, SOFTER: 980.0, SOFTER | CROSS: 979.0, CROSS: 990.0})
    found = weighed.found(lp400)
    assert names(found) == ["rotor stiffness"] and found.accepted[0].gain == pytest.approx(20.0)
    assert has(found.machine) == SOFTER and found.alternatives == ()
    assert not any(AXES & one for one in weighed.fitted)


def test_a_second_departure_is_found_beside_the_first(lp400, monkeypatch):
    first = {BASE: 100.0, CROSS: 97.0, SOFTER: 88.0, SOFTER | CROSS: 80.0}
    found = Weighed(monkeypatch, first, {BASE: 1000.0, SOFTER: 980.0, SOFTER | CROSS: 970.0}).found(lp400)
    assert names(found) == ["rotor stiffness", "cross-axis sensitivity"]


@pytest.mark.parametrize(("share", "kept"), [(0.9, []), (1.1, ["cross-axis sensitivity"])])
def test_an_extension_is_kept_from_even_odds_on(lp400, monkeypatch, share, kept):
    rest = {BASE: 1000.0, CROSS: 1000.0 - share * ASKED}
    found = Weighed(monkeypatch, {BASE: 100.0, CROSS: 90.0}, rest).found(lp400)
    assert names(found) == kept
    (other,) = found.alternatives
    assert other.name == ("the base model" if kept else "cross-axis sensitivity")
    assert other.odds == pytest.approx(math.exp(-0.1 * ASKED))


@pytest.mark.parametrize("rise", [ASKED - 3.1, ASKED + 3.1])
def test_a_model_of_less_than_five_per_cent_is_left_out(lp400, monkeypatch, rise):
    rest = {BASE: 1000.0, CROSS: 1000.0 - rise}
    assert Weighed(monkeypatch, {BASE: 100.0, CROSS: 90.0}, rest).found(lp400).alternatives == ()


def test_what_is_left_open_beside_the_first_extension_counts_against_the_one_that_is_stated(
    lp400, monkeypatch
):
    """A third model that was as probable as the base model pales with it."""
    first = {BASE: 100.0, SOFTER: 90.0, CROSS: 91.0}
    rest = {BASE: 1000.0, SOFTER: 1000.3 - ASKED, CROSS: 998.5 - ASKED}
    found = Weighed(monkeypatch, first, rest).found(lp400)
    assert names(found) == ["cross-axis sensitivity"]
    odds = {one.name: one.odds for one in found.alternatives}
    assert odds == pytest.approx({"the base model": math.exp(-1.5), "rotor stiffness": math.exp(-1.8)})


def test_an_extension_that_loses_the_record_gives_way_to_the_next(lp400, monkeypatch):
    first = {BASE: 100.0, CROSS: 90.0, SOFTER: 80.0}
    assert names(Weighed(monkeypatch, first, {BASE: 1000.0, CROSS: 980.0}).found(lp400)) == [
        "cross-axis sensitivity"
    ]


@pytest.mark.parametrize(("back", "kept"), [(969.0, []), (985.0, ["cross-axis sensitivity"])])
def test_an_extension_that_only_led_to_a_better_start_is_not_kept(lp400, monkeypatch, back, kept):
    """On a drop of a foreign code a lag raised it by 22, to a place that serves the base model as well."""
    rest = {BASE: 1000.0, CROSS: 965.0}
    found = Weighed(monkeypatch, {BASE: 100.0, CROSS: 90.0}, rest, back).found(lp400)
    assert names(found) == kept
    assert found.sized_score[1] == (965.0 if kept else back)
    assert not kept or found.accepted[0].gain == pytest.approx(back - 965.0)


def test_an_extension_is_kept_where_the_base_model_loses_the_record_from_there(lp400, monkeypatch):
    rest = {BASE: 1000.0, CROSS: 965.0}
    found = Weighed(monkeypatch, {BASE: 100.0, CROSS: 90.0}, rest, math.inf).found(lp400)
    assert names(found) == ["cross-axis sensitivity"] and found.accepted[0].gain == pytest.approx(35.0)


def test_what_was_left_open_beside_a_worse_start_pales_beside_the_better_one(lp400, monkeypatch):
    """Cross-axis sensitivity was nearly as probable as a base model that turns out likelier by a factor e."""
    first = {BASE: 100.0, SOFTER: 91.0, CROSS: 90.0}
    rest = {BASE: 1000.0, CROSS: 1000.5 - ASKED, SOFTER: 999.3 - ASKED}
    found = Weighed(monkeypatch, first, rest, back=999.0).found(lp400)
    assert names(found) == [] and found.sized_score[1] == 999.0
    odds = {one.name: one.odds for one in found.alternatives}
    assert odds == pytest.approx(
        {"cross-axis sensitivity": math.exp(-1.5), "rotor stiffness": math.exp(-0.3)}
    )


def test_a_long_remanence_is_compared_with_a_fall_of_the_same_process_noise(lp400, monkeypatch):
    """Heavy rotors rose by 10 to 30 with a remanence "not to be told from the usual 2 ms"."""
    long = frozenset({"long remanence"})
    weighed = Weighed(monkeypatch, {BASE: 1000.0, long: 900.0}, {BASE: 1000.0, long: 900.0})
    assert names(weighed.found(lp400)) == []


def test_more_drops_ask_for_a_larger_rise():
    """What a model leaves out adds up from drop to drop."""
    assert 0.0 < asked_for(1) < asked_for(2) < 2.0 * asked_for(1)


# sentences


@pytest.mark.parametrize(("turn", "ratio"), [(30.0, 0.65), (-20.0, 0.8), (80.0, 0.5)])
def test_the_soft_axis_is_that_of_the_stiffness_matrix(turn, ratio):
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    axes = np.array([[c, -s], [s, c]])
    k = axes @ np.diag([ratio, 1.0]) @ axes.T
    coupling = k[0, 1] / math.sqrt(k[0, 0] * k[1, 1])
    assert soft_axis(k[0, 0] / k[1, 1], coupling) == pytest.approx(turn, abs=1e-9)
    assert soft_over_stiff(k[0, 0] / k[1, 1], coupling) == pytest.approx(ratio, rel=1e-9)


def test_a_derived_number_has_the_interval_of_what_it_follows_from():
    one, two = (Known(value=v, interval_90=(v - half, v + half)) for v, half in ((3.0, 0.3), (4.0, 0.4)))
    assert derived(lambda a, b: a + b, one, two) == pytest.approx((7.0, 6.5, 7.5))


@pytest.mark.parametrize("extension", EXTENSIONS, ids=lambda one: one.name)
def test_every_extension_says_what_was_found_with_its_interval(lp400, extension):
    machine = extension.added_to(lp400)
    values = {
        u.path: Known(value=u.value_of(u.begin), interval_90=(0.9 * u.begin, 1.1 * u.begin + 1e-6))
        for u in all_unknowns(build_drop_model(machine, "quick"))
    }
    said = Accepted(extension=extension, gain=math.inf).structure(machine, values, believed=True)
    assert said.sentence.startswith("Found: ") and " to " in said.sentence
    assert [one.as_json() for one in published_structure([said])] == [
        {
            "name": extension.name,
            "log_likelihood_rise": None,
            "sentence": said.sentence,
            "probability": None,
        }
    ]


def test_consistent_with_an_extension_holds():
    assert Verdict.EXTENDED.holds and not Verdict.WIDENED.holds and not Verdict.REPLACED.holds


def test_an_unbalance_beyond_its_grade_is_known_by_its_field_and_outlives_the_file(lp400, tmp_path):
    extension = next(one for one in EXTENSIONS if one.name == "unbalance beyond its grade")
    beyond = extension.added_to(lp400)
    assert float(beyond.unbalances[0].amount) == pytest.approx(3.0 * float(lp400.unbalances[0].amount))
    save_machine(beyond, tmp_path / "machine.toml")
    text = (tmp_path / "machine.toml").read_text()
    (tmp_path / "machine.toml").write_text(re.sub(r'source = ".*?"', 'source = "other words"', text))
    back = load_machine(tmp_path / "machine.toml")
    assert float(back.unbalances[0].beyond_described) == 3.0
    assert extension.values(back) == {}
    said = {f"unbalance.{i}.{p}": Known(value=2e-5) for i in range(2) for p in ("cosine", "sine")}
    found = with_found(back, said).unbalances[0]
    assert float(found.amount) == pytest.approx(np.hypot(2e-5, 2e-5))
    assert float(found.beyond_described) == pytest.approx(
        float(found.amount) / float(lp400.unbalances[0].amount)
    )
    assert with_found(lp400, said) == lp400


def test_a_landing_sleeve_found_is_said_by_its_amount_and_goes_into_the_calibrated_file(lp400):
    oval = next(one for one in EXTENSIONS if one.name == "oval sleeve")
    machine = oval.added_to(lp400)
    said = {
        f"{b.name}.landing_sleeve.oval_{part}": Known(value=value, interval_90=(value - 1e-7, value + 1e-7))
        for b in machine.touchdown_bearings
        for part, value in (("cosine", 3e-6), ("sine", -4e-6))
    }
    words = oval.found(machine, said, 300.0)
    assert words.startswith(
        "the radius of the landing sleeve varies twice a turn: NDE ± 5.00 µm (4.90 to 5.10)"
    )
    found = with_found(machine, said)
    assert [float(b.landing_sleeve.oval) for b in found.touchdown_bearings] == pytest.approx([5e-6, 5e-6])
    given = lp400.with_values({f"{b.name}.landing_sleeve.oval": 3e-6 for b in lp400.touchdown_bearings})
    assert with_found(given, said) == given  # a measured amount stays


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [(5e-3, 9e-3, "longer than the usual 2 ms"), (1e-4, 1e-3, "shorter than the usual 2 ms")],
)
def test_the_lift_of_the_magnets_is_longer_or_shorter_and_not_both(lp400, low, high, words):
    extension = next(one for one in EXTENSIONS if one.name == "long remanence")
    middle = 0.5 * (low + high)
    value = Known(value=middle, interval_90=(low, high))
    accepted = Accepted(extension=extension, gain=50.0)
    assert words in accepted.structure(lp400, {"remanence.time_constant": value}, believed=True).sentence


def sentence_of(machine: Machine, name: str, values: dict[str, Known], *, believed: bool = True) -> str:
    extension = next(one for one in EXTENSIONS if one.name == name)
    return Accepted(extension=extension, gain=50.0).structure(machine, values, believed=believed).sentence


def foundation(low: float, middle: float, high: float) -> dict[str, Known]:
    """Values of a foundation mode with such a share of the support mass in that of the foundation."""
    found = {}
    for name in ("NDE", "DE"):
        found |= {
            f"{name}.support.mass": Known(value=50.0, interval_90=(49.0, 51.0)),
            f"{name}.support.foundation_frequency": Known(value=500.0, interval_90=(450.0, 560.0)),
            f"{name}.support.foundation_share": Known(value=middle, interval_90=(low, high)),
        }
    return found


def test_a_modal_mass_has_no_interval_through_infinity(lp400):
    """ "400 kg (-16763129503 to 16763130303)" came of a straight line through a share of zero."""
    words = sentence_of(lp400, "foundation mode", foundation(0.1, 0.125, 0.15))
    mass, low, high = map(float, re.findall(r"modal mass of (\d+) kg \((\d+) to (\d+)\)", words)[0])
    assert (mass, low, high) == pytest.approx((400.0, 50.0 / 0.15, 50.0 / 0.1), rel=0.02)
    assert "modal mass of more than" in sentence_of(lp400, "foundation mode", foundation(0.0, 0.0, 0.15))
    assert "modal mass of more than" in sentence_of(lp400, "foundation mode", foundation(0.0, 0.125, 0.15))


def test_the_interval_of_a_time_ends_above_zero(lp400):
    """ "Decays in 4900 ms (-200 to 9999)" came of an interval made symmetric."""
    value = Known(value=4.9, interval_90=(2.0, 11.0))
    words = sentence_of(lp400, "long remanence", {"remanence.time_constant": value})
    assert "decays in 4900 ms (2000 to 11000)" in words


def test_no_number_of_a_model_that_is_not_believed_is_said(lp400):
    words = sentence_of(lp400, "foundation mode", foundation(0.1, 0.125, 0.15), believed=False)
    assert words == "Tried beyond the base model, and not enough: foundation mode."


@pytest.mark.parametrize("name", [one.name for one in EXTENSIONS if one.nothing])
def test_values_that_hold_the_neutral_one_say_nothing(lp400, name):
    """Four brackets at 0.1 % (-0.6 to 0.7), 0.3 % (-0.3 to 1.0), ... were said to be found."""
    extension = next(one for one in EXTENSIONS if one.name == name)
    machine = extension.added_to(lp400)
    unknowns = {u.path: u for u in all_unknowns(build_drop_model(machine, "quick"))}
    (nothing,) = set(extension.nothing.values())
    values = {
        path: Known(value=nothing, interval_90=(nothing - 1e-3, nothing + 1e-3))
        for path in unknowns
        if path.endswith(tuple(extension.nothing))
    }
    assert values and extension.says_nothing(machine, values)
    one = next(iter(values))
    telling = values | {one: Known(value=nothing + 3e-3, interval_90=(nothing + 1e-3, nothing + 5e-3))}
    assert not extension.says_nothing(machine, telling)


def moved_fit(score: float, way: float, *, further: int = 0, sigma: float = 1.0, limit: float = 9.0) -> Any:
    """A fit of one drop with two parameters of standard deviation 0.1, the second one moved by a way from
    its prior, whose standard deviation is ``sigma``, and at most by ``limit``.

    Further ones come before them: those of sensor planes that a coarse fit leaves out.
    """
    paths = [*(f"sensors.{k}.cross_axis" for k in range(further)), "NDE.preload", "DE.preload"]
    limits = [*([np.inf] * (further + 1)), 2.0 + limit]
    problem = SimpleNamespace(
        parameter_slice=slice(1, 1 + len(paths)),
        unknowns=[
            SimpleNamespace(path=path, sigma=sigma, bounds=(-np.inf, most))
            for path, most in zip(paths, limits, strict=True)
        ],
        mean=np.array([5.0, *([99.0] * further), 1.0, 2.0]),
    )
    smoothed = SimpleNamespace(
        means=np.array([[5.0, *([99.0] * further), 1.0, 2.0 + way]]),
        covariance=lambda _: np.diag([9.0, *([0.01] * len(paths))]),
        filtered=SimpleNamespace(
            parameter_sample=0, negative_log_likelihood=score, done=1, means=range(1), nis=1.0
        ),
    )
    fit = TrackedDrops(
        problems=(problem,),  # type: ignore[arg-type]
        filtered=(smoothed.filtered,),
        trajectories=(smoothed.means,),
        noise_factors=(1.0,),
    )
    vars(fit)["smoothed"] = (smoothed,)
    return fit


@pytest.mark.parametrize(
    ("case", "other", "windows", "best"),
    [
        ({"way": 0.2}, 900.0, 2, 1000.0),
        ({"way": 0.3}, 900.0, 4, 900.0),
        ({"way": -0.3}, 1100.0, 4, 1000.0),
        ({"way": 0.2, "sigma": 0.07}, 900.0, 4, 900.0),
        ({"way": 0.2, "limit": 0.2}, 900.0, 4, 900.0),
    ],
)
def test_a_fit_that_its_prior_or_the_first_impacts_hardly_allow_is_begun_again_from_the_prior(
    lp400, monkeypatch, case, other, windows, best
):
    """Two standard deviations are no reason, three and a bound are; the likelier fit is taken."""
    begun: list[float] = []

    def converged(_problems: Any, _stage: Stage, references: Any, **_: Any) -> Any:
        begun.append(references[0][0][-1])
        return moved_fit(1000.0 if len(begun) <= 2 else other, further=2, **case)

    monkeypatch.setattr(search_module, "converged", converged)
    monkeypatch.setattr(rises_module, "transferred", lambda _one, _two, means: means)
    monkeypatch.setattr(search_module, "likeliest_noise", lambda *_: 0.125)
    monkeypatch.setattr(search_module, "forward_passes", lambda *_: [SimpleNamespace(nll=2000.0)])
    monkeypatch.setattr(search_module, "likelihood_of", lambda one: one.nll)
    drops = SimpleNamespace(calibrate_only=False, fine=lambda _: (None,))
    search = Search(drops=drops, progress=None)  # type: ignore[arg-type]
    first = Candidate(machine=lp400, fit=moved_fit(2000.0, 0.0))
    assert search.refine(first).sized_score == (False, best)
    assert len(begun) == windows
    assert windows == 2 or begun[2] == 2.0


@pytest.mark.slow
def test_an_extension_that_says_nothing_is_taken_off_and_the_rest_refined(
    calibrated: Machine, synthetic: SyntheticDrop
) -> None:
    """On a drop of a machine whose brackets stand still."""
    extension = next(one for one in EXTENSIONS if one.name == "brackets that follow the housing")
    machine = extension.added_to(calibrated)
    item = read_evidence(build_drop_model(calibrated), synthetic.record, synthetic.tail, name="hidden_060")
    drops = Drops(evidence=(item,), calibrate_only=True)
    search = Search(drops=drops, progress=None)
    fit = track(drops.fine(machine), (CALIBRATION_STAGE,))
    found = Candidate(machine=machine, fit=fit, accepted=(Accepted(extension=extension, gain=60.0),))
    without = search.without_silent(found, calibrated)
    assert without.accepted == () and without.machine == calibrated
    assert (
        without.fit.problems[0].n_dynamic + len(without.fit.problems[0].unknowns)
        < len(fit.problems[0].unknowns) + fit.problems[0].n_dynamic
    )
    assert not without.inconsistent
