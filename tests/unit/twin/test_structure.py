"""Which extension is kept, and what it says: the rule on made-up likelihoods, sentences on made-up values."""

import math
import re
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from rotordrop import Known, build_drop_model, load_machine, save_machine
from rotordrop.elements.parameter import derived
from rotordrop.elements.support import soft_axis, soft_over_stiff
from rotordrop.elements.table import EXTENSIONS
from rotordrop.errors import IdentificationError
from rotordrop.estimate.estimate import Verdict
from rotordrop.rotor.unknowns import all_unknowns
from rotordrop.track.calibration import TrackedDrops
from rotordrop.twin import rises as rises_module
from rotordrop.twin import search as search_module
from rotordrop.twin.calibrated import with_found
from rotordrop.twin.rises import LogLikelihoodGains
from rotordrop.twin.search import (
    FIRST_OTHER_START,
    LEAST_RISE,
    Accepted,
    Candidate,
    Checkpoint,
    Search,
    best_structure,
    evidence_threshold,
    score_of,
)


def fit_of(negative_log_likelihood, nis, factor=1.0):
    return SimpleNamespace(
        negative_log_likelihood=negative_log_likelihood,
        nis=(nis,),
        noise_factors=(factor,),
        diverged=(False,),
    )


def has(machine):
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

    def __init__(self, table, base, back=None):
        self.table, self.base, self.back = table, base, back
        self.attempts: list[int] = []
        self.passed: Counter[int] = Counter()

    def fit(self, machine, start):
        self.attempts.append(start)
        return self.table.get(has(machine), self.base)

    def extend(self, machine, start, number, before):
        assert (before is None) == (number == 0)
        self.passed[number] += 1
        fit = self.fit(machine, start)
        return Checkpoint(problems=(), trajectories=(fit,), score=score_of(fit))

    def converge(self, place):
        return place.trajectories[0]

    def relinearise(self, _known, machine, _passes):
        found = self.table.get(has(machine), self.base)
        return self.back if self.back is not None and not has(machine) else found


AXES, CUBIC = frozenset({"turned support axes"}), frozenset({"cubic support"})


def names(found):
    return [kept.extension.name for kept in found.accepted]


BASE_FIT, BETTER = fit_of(1000.0, 3.0), fit_of(505.0, 0.95)
AXES_FIT, CUBIC_FIT = fit_of(500.0, 0.9), fit_of(700.0, 1.1)
ON_TOP = {AXES: fit_of(600.0, 1.6), CUBIC: fit_of(800.0, 2.0), AXES | CUBIC: fit_of(300.0, 0.9)}


@pytest.mark.parametrize(
    ("table", "back", "gains"),
    [
        ({AXES: AXES_FIT, CUBIC: CUBIC_FIT}, None, {"turned support axes": 500.0}),
        ({AXES: fit_of(1000.0 - 0.9 * LEAST_RISE, 3.0)}, None, {}),
        ({AXES: AXES_FIT}, BETTER, {}),
        (ON_TOP, None, {"turned support axes": 400.0, "cubic support": 300.0}),
        ({AXES: fit_of(100.0, 0.98, factor=8.0), CUBIC: CUBIC_FIT}, None, {"cubic support": 300.0}),
    ],
    ids=["paid for", "less than the penalty", "a better start only", "two", "at equal unknown impulses"],
)
def test_the_extensions_that_the_readings_pay_for_are_kept(lp400, table, back, gains):
    found = best_structure(Candidate(machine=lp400, fit=BASE_FIT), Record(table, BASE_FIT, back))
    assert names(found) == list(gains) and has(found.machine) == frozenset(gains)
    assert [kept.gain for kept in found.accepted] == pytest.approx(list(gains.values()))
    assert gains or (found.machine, found.fit) == (lp400, back or BASE_FIT)


def test_where_nothing_helps_the_best_of_other_starts_is_taken(lp400):
    class Elsewhere(Record):
        def fit(self, machine, start):
            if start == FIRST_OTHER_START:
                raise IdentificationError("lost")
            return fit_of(400.0, 0.9) if start == FIRST_OTHER_START + 1 else super().fit(machine, start)

    found = best_structure(Candidate(machine=lp400, fit=BASE_FIT), Elsewhere({}, BASE_FIT))
    assert names(found) == [] and found.fit.nis == (0.9,)


def test_lost_extensions_and_worse_halves_stay_behind(lp400):
    record = Record({AXES: AXES_FIT}, BASE_FIT)
    best_structure(Candidate(machine=lp400, fit=BASE_FIT), record)
    ways = 2 * sum(bool(one.values(lp400)) for one in EXTENSIONS)
    assert [record.passed[k] for k in range(4)] == [ways, ways, ways, ways // 2]

    class Lost(Record):
        def fit(self, machine, start):
            if has(machine):
                raise IdentificationError("lost")
            return super().fit(machine, start)

    found = best_structure(Candidate(machine=lp400, fit=BASE_FIT), Lost({AXES: fit_of(1.0, 0.9)}, BASE_FIT))
    assert names(found) == [] and found.machine == lp400


CARRIED, *OTHERS = sorted(EXTENSIONS, key=lambda one: not one.inferred)
ASKED = evidence_threshold(OTHERS[0], 1)


class Weighed:
    """A search that weighs extensions by made-up negative log likelihoods of the machines that have them.

    ``first`` are those of the first impacts and of the whole drop, linearised beside the fit; ``rest`` those
    of a fit at rest.
    What ``rest`` does not hold is lost; ``back`` is that of a base model fitted once more, and lost where
    it is infinite.
    """

    def __init__(self, monkeypatch, first, rest, back=None):
        self.fitted: list[frozenset[str]] = []
        self.rest, self.back = rest, back
        monkeypatch.setattr(search_module, "forward_passes", lambda problems, *_: problems)
        monkeypatch.setattr(
            LogLikelihoodGains,
            "_negative_log_likelihood",
            lambda _, machine: first.get(has(machine), first[frozenset()]),
        )
        monkeypatch.setattr(LogLikelihoodGains, "at_once", LogLikelihoodGains.apart)
        monkeypatch.setattr(search_module, "likelihood_of", lambda _: first[frozenset()])
        monkeypatch.setattr(search_module, "converged", lambda problems, *_, **__: self.fit(problems))
        monkeypatch.setattr(search_module, "likeliest_noise", lambda *_: 0.125)
        monkeypatch.setattr(rises_module, "transferred", lambda _one, _two, means: means)

    def problems(self, machine):
        return (SimpleNamespace(machine=machine, first_contact=0.007, fall_time=0.007, time=np.zeros(3)),)

    def fit(self, problems):
        self.fitted.append(has(problems[0].machine))
        again = self.back is not None and self.fitted.count(BASE) > 1 and self.fitted[-1] == BASE
        unlikelihood = self.back if again else self.rest.get(self.fitted[-1], math.inf)
        if unlikelihood == math.inf:
            raise IdentificationError("lost")
        found = fit_of(unlikelihood, 0.9)
        found.problems, found.trajectories = problems, [np.zeros((3, 2))]
        found.smoothed = [SimpleNamespace(filtered=None)]
        return found

    def found(self, machine):
        drops = SimpleNamespace(fine=self.problems, calibrate_only=False)
        search = Search(drops=drops, progress=None)
        return search.weighed(Candidate(machine=machine, fit=self.fit(self.problems(machine))))


BASE, CROSS, SOFTER = frozenset[str](), frozenset({"cross-axis sensitivity"}), frozenset({"rotor stiffness"})
LEFT_OPEN = {"the base model": math.exp(-1.5), "rotor stiffness": math.exp(-1.8)}
PALER = {"cross-axis sensitivity": math.exp(-1.5), "rotor stiffness": math.exp(-0.3)}


@pytest.mark.parametrize(
    ("first", "rest", "back", "gains", "odds"),
    [
        (
            {CROSS: 97.0, SOFTER: 88.0, AXES: 111.0},
            {SOFTER: 980.0, SOFTER | CROSS: 979.0, CROSS: 990.0},
            None,
            {"rotor stiffness": 20.0},
            {},
        ),
        (
            {CROSS: 97.0, SOFTER: 88.0, SOFTER | CROSS: 80.0},
            {SOFTER: 980.0, SOFTER | CROSS: 970.0},
            None,
            {"rotor stiffness": 20.0, "cross-axis sensitivity": 10.0},
            None,
        ),
        ({CROSS: 90.0}, {CROSS: 1000.0 - 0.9 * ASKED}, None, {}, {"cross-axis sensitivity": -0.1}),
        (
            {CROSS: 90.0},
            {CROSS: 1000.0 - 1.1 * ASKED},
            None,
            {"cross-axis sensitivity": 1.1 * ASKED},
            {"the base model": -0.1},
        ),
        ({CROSS: 90.0}, {CROSS: 1003.1 - ASKED}, None, {}, {}),
        ({CROSS: 90.0}, {CROSS: 996.9 - ASKED}, None, {"cross-axis sensitivity": ASKED + 3.1}, {}),
        (
            {SOFTER: 90.0, CROSS: 91.0},
            {SOFTER: 1000.3 - ASKED, CROSS: 998.5 - ASKED},
            None,
            {"cross-axis sensitivity": ASKED + 1.5},
            LEFT_OPEN,
        ),
        ({CROSS: 90.0, SOFTER: 80.0}, {CROSS: 980.0}, None, {"cross-axis sensitivity": 20.0}, None),
        ({CROSS: 90.0}, {CROSS: 965.0}, 969.0, {}, None),
        ({CROSS: 90.0}, {CROSS: 965.0}, 985.0, {"cross-axis sensitivity": 20.0}, None),
        ({CROSS: 90.0}, {CROSS: 965.0}, math.inf, {"cross-axis sensitivity": 35.0}, None),
        ({SOFTER: 91.0, CROSS: 90.0}, {CROSS: 1000.5 - ASKED, SOFTER: 999.3 - ASKED}, 999.0, {}, PALER),
    ],
    ids=[
        "the one that raises the likelihood most",
        "a second beside the first",
        "below even odds",
        "from even odds on",
        "less than five per cent",
        "more than 95 per cent",
        "left open beside the first counts against the stated one",
        "one that loses the record gives way",
        "a better start only",
        "better than from its start",
        "the base model loses the record from there",
        "left open beside a worse start",
    ],
)
def test_what_the_readings_ask_for_beside_a_model_that_fits_is_added(
    lp400, monkeypatch, first, rest, back, gains, odds
):
    weighed = Weighed(monkeypatch, {BASE: 100.0} | first, {BASE: 1000.0} | rest, back)
    found = weighed.found(lp400)
    assert names(found) == list(gains) and has(found.machine) == frozenset(gains)
    assert [kept.gain for kept in found.accepted] == pytest.approx(list(gains.values()))
    assert not any(AXES & one for one in weighed.fitted)
    if odds is not None:
        told = {one.name: one.odds for one in found.alternatives}
        assert told == pytest.approx({k: math.exp(v * ASKED) if v < 0.0 else v for k, v in odds.items()})
    if back is not None and back < math.inf:
        assert found.sized_score[1] == (rest[CROSS] if gains else back)


def test_rises_odds_and_verdicts_of_extensions():
    assert 0.0 < ASKED < evidence_threshold(OTHERS[0], 2) < 2.0 * ASKED
    assert evidence_threshold(CARRIED, 1) == 0.0 and not any(one.inferred for one in OTHERS)
    one, two = (Known(value=v, interval_90=(v - half, v + half)) for v, half in ((3.0, 0.3), (4.0, 0.4)))
    assert derived(lambda a, b: a + b, one, two) == pytest.approx((7.0, 6.5, 7.5))
    assert Verdict.EXTENDED.holds and not Verdict.WIDENED.holds and not Verdict.REPLACED.holds


# sentences


@pytest.mark.parametrize(("turn", "ratio"), [(30.0, 0.65), (-20.0, 0.8), (80.0, 0.5)])
def test_the_soft_axis_is_that_of_the_stiffness_matrix(turn, ratio):
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    axes = np.array([[c, -s], [s, c]])
    k = axes @ np.diag([ratio, 1.0]) @ axes.T
    coupling = k[0, 1] / math.sqrt(k[0, 0] * k[1, 1])
    assert soft_axis(k[0, 0] / k[1, 1], coupling) == pytest.approx(turn, abs=1e-9)
    assert soft_over_stiff(k[0, 0] / k[1, 1], coupling) == pytest.approx(ratio, rel=1e-9)


@pytest.mark.parametrize("extension", EXTENSIONS, ids=lambda one: one.name)
def test_every_extension_says_what_was_found_with_its_interval(lp400, extension):
    machine = extension.added_to(lp400)
    values = {
        u.path: Known(
            value=u.value_of(middle), interval_90=(u.value_of(middle - half), u.value_of(middle + half))
        )
        for u in all_unknowns(build_drop_model(machine, "quick"))
        for middle in (u.begin + 2e-6,)
        for half in (0.1 * abs(middle) + 1e-6,)
    }
    said = Accepted(extension=extension, gain=math.inf).structure(machine, values, believed=True)
    assert said.sentence.startswith("Found: ") and " to " in said.sentence
    assert said.as_json() == {
        "name": extension.name,
        "log_likelihood_rise": None,
        "sentence": said.sentence,
        "probability": None,
    }


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
    value = Known(value=0.5 * (low + high), interval_90=(low, high))
    assert words in sentence_of(lp400, "long remanence", {"remanence.time_constant": value})


def sentence_of(machine, name, values, *, believed=True):
    extension = next(one for one in EXTENSIONS if one.name == name)
    return Accepted(extension=extension, gain=50.0).structure(machine, values, believed=believed).sentence


@pytest.mark.parametrize(
    ("half", "begins"), [(4.9e-9, "Found: "), (5.1e-9, "Tried, and not told from none: ")]
)
def test_an_extension_whose_interval_holds_zero_is_not_found(lp400, half, begins):
    machine = next(one for one in EXTENSIONS if one.name == "oval sleeve").added_to(lp400)
    values = {
        f"{name}.landing_sleeve.oval_{part}": Known(value=value, interval_90=(value - half, value + half))
        for name in ("NDE", "DE")
        for part, value in (("cosine", 5e-9), ("sine", 0.0))
    }
    words = sentence_of(machine, "oval sleeve", values)
    assert words.startswith(f"{begins}the radius of the landing sleeve")
    assert ("(0.000 to" in words) == (begins != "Found: ")


def foundation(low, middle, high):
    """Values of a foundation mode with such a share of the support mass in that of the foundation."""
    found = {}
    for name in ("NDE", "DE"):
        found |= {
            f"{name}.support.mass": Known(value=50.0, interval_90=(49.0, 51.0)),
            f"{name}.support.foundation_frequency": Known(value=500.0, interval_90=(450.0, 560.0)),
            f"{name}.support.foundation_share": Known(value=middle, interval_90=(low, high)),
        }
    return found


def test_a_found_number_has_an_interval_that_makes_sense(lp400):
    words = sentence_of(lp400, "foundation mode", foundation(0.1, 0.125, 0.15))
    mass, low, high = map(float, re.findall(r"modal mass of (\d+) kg \((\d+) to (\d+)\)", words)[0])
    assert (mass, low, high) == pytest.approx((400.0, 50.0 / 0.15, 50.0 / 0.1), rel=0.02)
    assert "modal mass of more than" in sentence_of(lp400, "foundation mode", foundation(0.0, 0.0, 0.15))
    assert "modal mass of more than" in sentence_of(lp400, "foundation mode", foundation(0.0, 0.125, 0.15))
    value = Known(value=4.9, interval_90=(2.0, 11.0))
    words = sentence_of(lp400, "long remanence", {"remanence.time_constant": value})
    assert "decays in 4900 ms (2000 to 11000)" in words
    words = sentence_of(lp400, "foundation mode", foundation(0.1, 0.125, 0.15), believed=False)
    assert words == "Tried beyond the base model, and not enough: foundation mode."


def test_no_unbalance_is_sought_beside_a_magnet_that_stays_on(lp400):
    unbalance = next(one for one in EXTENSIONS if one.name == "unbalance beyond its grade")
    assert unbalance.values(lp400) and not unbalance.values(lp400.with_magnets_on([lp400.ambs[0].name]))


@pytest.mark.parametrize(("gain", "named"), [(19.0, False), (23.0, True), (math.inf, True)])
def test_an_extension_that_explains_little_keeps_its_unknowns_and_is_not_named(lp400, gain, named):
    lag = next(one for one in EXTENSIONS if one.name == "sensor lag")
    fit = SimpleNamespace(problems=(None,), filtered=(SimpleNamespace(done=1, means=np.zeros((1, 1))),))
    search = Search(drops=SimpleNamespace(evidence=(None,)), progress=None)
    machine = lag.added_to(lp400)
    found = Candidate(machine=machine, fit=fit, accepted=(Accepted(extension=lag, gain=gain),))
    told = search.followed(found)
    assert bool(told.accepted) == named
    assert told.machine is machine


def moved_fit(score, way, *, further=0, sigma=1.0, limit=9.0):
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
        problems=(problem,),
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
    begun: list[float] = []

    def converged(_problems, _stage, references, **_):
        begun.append(references[0][0][-1])
        return moved_fit(1000.0 if len(begun) <= 2 else other, further=2, **case)

    monkeypatch.setattr(search_module, "converged", converged)
    monkeypatch.setattr(rises_module, "transferred", lambda _one, _two, means: means)
    monkeypatch.setattr(search_module, "likeliest_noise", lambda *_: 0.125)
    monkeypatch.setattr(search_module, "forward_passes", lambda *_: [SimpleNamespace(nll=2000.0)])
    monkeypatch.setattr(search_module, "likelihood_of", lambda one: one.nll)
    drops = SimpleNamespace(calibrate_only=False, fine=lambda _: (None,))
    search = Search(drops=drops, progress=None)
    first = Candidate(machine=lp400, fit=moved_fit(2000.0, 0.0))
    assert search.refine(first).sized_score == (False, best)
    assert len(begun) == windows
    assert windows == 2 or begun[2] == 2.0
