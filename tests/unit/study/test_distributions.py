"""What a study draws from and what it states: calibrated machines, the next draw, repeats, quantiles."""

import json
import math

import numpy as np
import pytest
from scipy.special import ndtr, ndtri
from scipy.stats import kstest, norm
from tests.published import bearing, published, value

from rotordrop import Known, example_machine, save_machine
from rotordrop.cli.app import run
from rotordrop.errors import MachineFileError, UsageError
from rotordrop.machine import loads_machine
from rotordrop.machine.calibration import CalibrationDrop, CalibrationOrigin, JointSpread, RecordedLift
from rotordrop.machine.saving import machine_text
from rotordrop.study.distributions import normal_score
from rotordrop.study.folder import open_folder, study_of
from rotordrop.study.numbers import influences
from rotordrop.study.plan import read_study
from rotordrop.study.repeat import next_draw, place_among, recorded_numbers, repeat_study, repeats
from rotordrop.study.summary import StudyResults, exceedance, quantile

PATHS = ("NDE.air_gap", "NDE.support.stiffness", "NDE.support.mass", "NDE.friction.dynamic")
SIGMA = np.array([1.5e-6, 0.01, 0.012, 0.03])
CORRELATION = np.array(
    [[1.0, 0.2, 0.1, 0.0], [0.2, 1.0, 0.97, 0.0], [0.1, 0.97, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
COVARIANCE = SIGMA[:, None] * CORRELATION * SIGMA


def calibrated():
    covariance = tuple(COVARIANCE[np.tril_indices(4)].tolist())
    spread = JointSpread(paths=PATHS, logarithmic=(False, True, True, True), covariance=covariance)
    drops = (CalibrationDrop(name="a"),)
    origin = CalibrationOrigin(drops=drops, consistent=True, joint=spread)
    return example_machine("lp400").calibrated_on(origin)


def study(machine, **changes):
    table = {"drops": 4000, "calibrated": True, "speed": "100 Hz", "start": "centred", **changes}
    return read_study(table, machine)


def test_the_distribution_comes_back_from_file_and_folder(tmp_path):
    again = loads_machine(machine_text(calibrated()))
    assert again == calibrated()
    np.testing.assert_allclose(again.calibration.joint.matrix, COVARIANCE, rtol=1e-12)
    one = study(calibrated())
    folder = open_folder(one, tmp_path / "study")
    np.testing.assert_array_equal(study_of(folder.path).values(0, 5), one.values(0, 5))


@pytest.mark.parametrize("design", ["random", "latin hypercube", "sobol"])
def test_values_have_middle_spread_and_correlation_of_the_calibration(design):
    machine = calibrated()
    drawn = study(machine, design=design, drops=4096).values(0, 4096)
    names = list(study(machine).varied)
    y = np.column_stack([drawn[:, names.index(path)] for path in PATHS])
    y[:, 1:] = np.log(y[:, 1:])
    bearing = machine.touchdown_bearings[0]
    middle = [float(bearing.air_gap), float(bearing.support.stiffness), float(bearing.support.mass)]
    np.testing.assert_allclose(y.mean(axis=0)[0], middle[0], rtol=1e-3)
    np.testing.assert_allclose(np.exp(y.mean(axis=0)[1:3]), middle[1:], rtol=2e-3)
    np.testing.assert_allclose(y.std(axis=0), SIGMA, rtol=0.05)
    assert np.corrcoef(y.T)[1, 2] == pytest.approx(0.97, abs=0.01)
    assert ndtr((y[:, 0] - middle[0]) / SIGMA[0]).mean() == pytest.approx(0.5, abs=0.02)


def test_static_friction_follows_and_what_is_no_distribution_is_refused():
    machine = calibrated()
    one = study(machine)
    found = one.machine_values(dict(zip(one.varied, one.values(3, 4)[0].tolist(), strict=True)))
    friction = machine.touchdown_bearings[0].friction
    ratio = found["NDE.friction.static"] / found["NDE.friction.dynamic"]
    assert ratio == pytest.approx(float(friction.static) / float(friction.dynamic))
    assert "DE.friction.static" not in found
    with pytest.raises(UsageError, match=r"holds no joint distribution .*rotordrop calibrate"):
        study(example_machine("lp400"))
    with pytest.raises(UsageError, match=r"NDE.air_gap: drawn in two ways"):
        study(calibrated(), vary={"*.air_gap": {"uniform": ["200 um", "300 um"]}})
    text = machine_text(calibrated())
    broken = text.replace("logarithmic = [false, ", "logarithmic = [")
    with pytest.raises(MachineFileError, match=r"3 entries; 4 paths need 4 of them"):
        loads_machine(broken)


SPREAD = 0.2
MACHINE = example_machine("lp400")


def posterior(value, error):
    """Estimate and error that a record with a given error leaves of a value with the prior about zero."""
    sure = 1.0 / (error**-2 + SPREAD**-2)
    return value * sure / error**2, math.sqrt(sure)


def test_records_take_over_from_the_prior_as_they_are_exact():
    assert next_draw([], SPREAD).numbers == (0.0, SPREAD)
    assert next_draw([(0.0, SPREAD)], SPREAD).numbers == (0.0, SPREAD)
    # The mean common share of a uniform one is a half, and one value alone says nothing of it.
    mean, sigma = next_draw([(0.2, 1e-9)], SPREAD).numbers
    assert mean == pytest.approx(0.5 * 0.2, rel=1e-3)
    shares = (np.arange(64) + 0.5) / 64
    expected = np.mean(SPREAD**2 * (1.0 - shares**2) + (0.2 * shares) ** 2) - mean**2
    assert sigma == pytest.approx(math.sqrt(expected), rel=1e-6)
    equal = next_draw([posterior(0.15, 0.005)] * 12, SPREAD).numbers
    assert equal[0] == pytest.approx(0.15, abs=0.01)
    assert equal[1] < 0.04
    random = np.random.default_rng(1).normal(0.0, SPREAD, 200)
    mean, sigma = next_draw([posterior(x, 0.01) for x in random], SPREAD).numbers
    assert mean == pytest.approx(random.mean(), abs=0.01)
    assert sigma == pytest.approx(SPREAD, rel=0.08)


@pytest.mark.parametrize("error", [0.01, 0.1])
def test_the_next_value_lies_anywhere_in_its_distribution(error):
    """Common share, common part and scatter drawn as the model has them: places of the next are uniform."""
    random, places = np.random.default_rng(3), []
    for _ in range(2000):
        share = random.uniform()
        common = SPREAD * math.sqrt(share) * random.standard_normal()
        values = common + SPREAD * math.sqrt(1.0 - share) * random.standard_normal(5)
        told = [posterior(x + error * random.standard_normal(), error) for x in values[:4]]
        mean, sigma = next_draw(told, SPREAD).numbers
        places.append(float(ndtr((values[4] - mean) / sigma)))
    inside = np.mean(np.abs(np.array(places) - 0.5) < 0.45)
    assert inside == pytest.approx(0.9, abs=0.02)
    assert kstest(places, "uniform").statistic < 0.035


def test_a_virtual_repeat_lifts_as_the_recorded_drops_did():
    found = {"sideways": 0.0, "sideways_error": 0.05, "up": 0.17, "up_error": 0.05}
    lift = tuple(RecordedLift(magnet=amb.name, **found) for amb in MACHINE.ambs)
    drops = tuple(CalibrationDrop(name=f"drop {k}", lift=lift) for k in range(2))
    machine = MACHINE.calibrated_on(CalibrationOrigin(drops=drops, consistent=True))
    again = loads_machine(machine_text(machine))
    assert again == machine
    name, vary = MACHINE.ambs[0].name, repeat_study(again, 600.0, duration=0.2).vary
    up, sideways = (vary[f"{name}.{part}"].numbers for part in ("remanent_share", "remanent_share_x"))
    assert up == next_draw([(0.17, 0.05)] * 4, SPREAD).numbers
    assert up[0] > 0.12
    assert sideways[0] == pytest.approx(0.0, abs=1e-12)
    assert max(up[1], sideways[1]) < SPREAD
    unknown = repeat_study(MACHINE, 600.0, duration=0.2).vary[f"{name}.remanent_share"]
    assert unknown.numbers == (0.0, SPREAD)


def test_a_further_draw_lies_anywhere_and_an_uncertain_number_has_an_uncertain_place():
    share = np.concatenate([np.logspace(-15.5, -1, 500), np.linspace(0.001, 0.999, 999)])
    np.testing.assert_allclose(normal_score(share), ndtri(share), rtol=2e-15, atol=1e-17)
    random = np.random.default_rng(2)
    draws = ((random.gamma(3.0, 1.0, 400), random.gamma(3.0, 1.0)) for _ in range(300))
    places = [place_among(among, Known(value=one)).value for among, one in draws]
    assert kstest(places, "uniform").pvalue > 0.01
    random, held = np.random.default_rng(3), 0
    for _ in range(300):
        share = random.uniform(0.02, 0.98)
        found = place_among(random.uniform(0.0, 1.0, 200), Known(value=share))
        held += found.low <= share <= found.high
    assert held >= 0.88 * 300
    values = np.linspace(0.0, 1.0, 1001)
    sharp = place_among(values, Known(value=0.5, interval_90=(0.5, 0.5)))
    vague = place_among(values, Known(value=0.5, interval_90=(0.3, 0.7)))
    assert sharp.value == pytest.approx(vague.value, abs=1e-3)
    assert vague.high - vague.low > 0.35 > 0.1 > sharp.high - sharp.low


PEAKS = {"peak_force_N": value(2500.0, 2450.0, 2550.0), "peak_stress_Pa": value(1.5e9)}
DROP = published(
    speed_Hz=100.0,
    estimated_until_s=0.009,
    bearings={"NDE": bearing({**PEAKS, "severity.impulse_N_s": value(2.0)}), "DE": bearing(PEAKS)},
)


def test_the_worst_of_a_hundred():
    """Half of all sets of a hundred uniform numbers have a maximum above 0.5 ** 0.01."""
    study = read_study({"drops": 4000, "speed": "60 Hz"}, MACHINE)
    values = np.random.default_rng(1).uniform(size=4000)
    quantities = ("peak_force", "peak_stress", "impulse", "contact_energy")
    numbers = {f"{b}.{n}": values for b in ("NDE", "DE") for n in quantities}
    results = StudyResults(
        study=study, drop=np.arange(4000), varied={}, numbers=numbers, reasons=("",) * 4000
    )
    one = repeats(results, worst_of=100)[0]
    assert one.worst.value == pytest.approx(0.5**0.01, abs=3e-3)
    assert one.worst.low < 0.5**0.01 < one.worst.high
    assert (one.low.value, one.high.value) == pytest.approx((0.05, 0.95), abs=0.015)
    with pytest.raises(UsageError, match="worst of 1; expected two drops or more"):
        repeats(results, worst_of=1)


def test_numbers_of_an_estimate_are_found_by_their_column():
    found = recorded_numbers(DROP)
    assert found["NDE.peak_force"] == Known(value=2500.0, interval_90=(2450.0, 2550.0))
    assert found["NDE.impulse"] == Known(value=2.0)
    peaks = {f"{end}.peak_{what}" for end in ("NDE", "DE") for what in ("force", "stress")}
    assert set(found) == {"NDE.impulse", *peaks}


def test_chances_are_those_of_a_drop():
    study = repeat_study(MACHINE, 2.0 * math.pi * 100.0, duration=0.2)
    planes = {f"unbalance.{k}.{part}" for k in range(len(MACHINE.unbalances)) for part in ("amount", "phase")}
    assert planes
    parts = ("remanent_share", "remanent_share_x", "offset_x", "offset_y", "orbit", "orbit_phase")
    magnets = {f"{amb.name}.{part}" for amb in MACHINE.ambs for part in parts}
    assert set(study.varied) == {"remanence_time", "rotor_angle", *planes, *magnets}
    values = dict(zip(study.varied, study.values(0, 1)[0].tolist(), strict=True))
    start = study.case(values).start
    first = MACHINE.ambs[0].name
    weight = MACHINE.rotor.mass * float(MACHINE.gravity) / len(MACHINE.ambs)
    assert start.remanent_force[0, 1] == pytest.approx(values[f"{first}.remanent_share"] * weight)
    assert start.offset[0, 0] == values[f"{first}.offset_x"]
    assert abs(start.orbit[0]) == pytest.approx(values[f"{first}.orbit"])
    assert study.machine_values(values).keys() == planes
    drawn = study.values(0, 4000)[:, list(study.varied).index("unbalance.0.amount")]
    described = float(MACHINE.unbalances[0].amount)
    expected = described * np.sqrt(2.0 * np.log(2.0))  # of the length of a normal vector
    assert np.median(drawn) == pytest.approx(expected, rel=0.05)
    assert not study.calibrated


def test_the_verb(tmp_path):
    save_machine(MACHINE, tmp_path / "machine.toml")
    (tmp_path / "drop.json").write_text(json.dumps(DROP.as_json()))
    call = ["study", "repeat", str(tmp_path / "machine.toml"), str(tmp_path / "drop.json"), "--threads", "1"]
    out = tmp_path / "r.json"
    assert run([*call, "--drops", "20", "--folder", str(tmp_path / "study"), "--json", str(out)]) == 0
    first = json.loads(out.read_text())["quantities"][0]
    assert first["column"] == "NDE.peak_force" and 0.0 <= first["place"]["value"] <= 1.0


def test_a_study_runs_shows_and_helps(tmp_path, capsys):
    save_machine(MACHINE, tmp_path / "machine.toml")
    study_file = tmp_path / "speeds.toml"
    study_file.write_text(
        'machine = "machine.toml"\ndrops = 12\nshard = 5\nduration = "10 ms"\nreduction = "quick"\n'
        'vary.speed = {uniform = ["60 Hz", "200 Hz"]}\n'
    )
    numbers, page, drops, again = (tmp_path / name for name in ("s.json", "s.html", "s.h5", "again.json"))
    call = ["study", "run", str(study_file), "--by", "speed", "--threads", "1"]
    assert run([*call, "--json", str(numbers), "--report", str(page), "--output", str(drops)]) == 0
    content = json.loads(numbers.read_text())
    assert content["drops"] == 12
    assert content["maps"]["speed"]["NDE.peak_force"][0]["from"] >= 60 * 6.283
    median = content["quantiles"]["NDE.peak_force"]["0.5"]
    low, high = median["interval_90"]
    assert 1000.0 < low < median["value"] < high < 6000.0
    folder = study_file.with_suffix("")
    before = (folder / "shards" / "000000.npy").read_bytes()
    assert run(["study", "run", str(folder), "--by", "speed", "--json", str(again)]) == 0
    assert json.loads(again.read_text()) == content
    assert (folder / "shards" / "000000.npy").read_bytes() == before
    assert run(["study", "show", str(folder)]) == 0
    assert run([*call[:3], "--by", "spead"]) == 64
    assert "did you mean 'speed'" in capsys.readouterr().err


ISHIGAMI = {"a": (0.3139, 0.5576), "b": (0.4424, 0.4424), "c": (0.0, 0.2437)}
"""First-order and total indices of sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1, Ishigami and Homma 1990."""
PLACES = dict(zip("abc", ("*.friction.dynamic", "NDE.air_gap", "speed"), strict=True))


def results_of(design, drops):
    """Results whose only quantity is the Ishigami function of the shares of three varied values."""
    vary = {
        "*.friction.dynamic": {"uniform": [0.05, 0.2]},
        "NDE.air_gap": {"uniform": ["200 um", "300 um"]},
        "speed": {"uniform": ["60 Hz", "200 Hz"]},
    }
    plan = {"drops": drops, "design": design, "start": "centred", "vary": vary}
    study = read_study(plan, MACHINE)
    values = study.values(0, drops)
    low, high = np.array([spread.numbers for spread in study.varied.values()]).T
    x = np.pi * (2.0 * (values - low) / (high - low) - 1.0)
    column = {name: x[:, j] for j, name in enumerate(study.varied)}
    x1, x2, x3 = (column[PLACES[letter]] for letter in "abc")
    y = np.sin(x1) + 7.0 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)
    varied = {name: values[:, j] for j, name in enumerate(study.varied)}
    return StudyResults(
        study=study, drop=np.arange(drops), varied=varied, numbers={"y": y}, reasons=("",) * drops
    )


def test_indices_of_the_ishigami_function():
    found = {one.name: one for one in influences(results_of("sensitivity", 5 * 2048), "y")}
    for letter, (alone, total) in ISHIGAMI.items():
        one = found[PLACES[letter]]
        assert one.alone.value == pytest.approx(alone, abs=0.03)
        assert one.total.value == pytest.approx(total, abs=0.03)
        assert one.total.low < total < one.total.high or abs(one.total.value - total) < 0.01


@pytest.mark.parametrize("design", ["random", "sobol"])
def test_indices_of_any_study(design):
    found = {one.name: one for one in influences(results_of(design, 4096), "y")}
    for letter, (alone, _) in ISHIGAMI.items():
        assert found[PLACES[letter]].alone.value == pytest.approx(alone, abs=0.04)
        assert found[PLACES[letter]].total is None


def test_blocks_differ_in_one_value_and_need_their_drops():
    study = results_of("sensitivity", 25).study
    values = study.values(0, 25).reshape(5, 5, 3)
    for block in values:
        for j in range(3):
            changed = block[2 + j] != block[0]
            assert changed.tolist() == [k == j for k in range(3)]
            assert block[2 + j][j] == block[1][j]
    np.testing.assert_array_equal(study.values(7, 19), values.reshape(25, 3)[7:19])
    with pytest.raises(UsageError, match=r"5 whole blocks of 5 drops have y; at least 20 are needed"):
        influences(results_of("sensitivity", 25), "y")


@pytest.mark.parametrize(("share", "drops"), [(0.5, 21), (0.9, 100), (0.99, 1000), (0.05, 200)])
def test_the_interval_of_a_quantile_holds_nine_times_of_ten(share, drops):
    random = np.random.default_rng(5)
    true = norm.ppf(share)
    held = 0
    for _ in range(2000):
        known = quantile(random.standard_normal(drops), share)
        held += known.low <= true <= known.high
    assert 0.89 <= held / 2000 <= 0.97  # order statistics are discrete: at least 90 %, a little more


def test_quantiles_and_chances_of_few_drops_are_open():
    known = quantile(np.arange(10.0), 0.99)
    assert known.high == np.inf and np.isfinite(known.low)
    assert quantile([np.nan], 0.5).drops == 0
    with pytest.raises(UsageError, match=r"quantile 99; expected a number between 0 and 1"):
        quantile([1.0, 2.0], 99)
    known = quantile([5.0, 1.0, 3.0, 2.0, 4.0], 0.5)
    assert (known.value, known.low, known.high) == (3.0, 1.0, 5.0)  # P(1 to 5 holds it) = 1 - 2/32
    known = exceedance(np.zeros(10), 1.0)
    assert (known.value, known.low) == (0.0, 0.0)
    assert known.high == pytest.approx(1.0 - 0.05**0.1)


@pytest.mark.parametrize("probability", [0.01, 0.3, 0.97])
def test_the_interval_of_a_probability_holds_nine_times_of_ten(probability):
    random = np.random.default_rng(6)
    held = 0
    for _ in range(2000):
        known = exceedance(random.random(100) < probability, 0.5)
        held += known.low <= probability <= known.high
    assert held / 2000 >= 0.89
