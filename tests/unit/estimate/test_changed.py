"""What changed between drops, how two orbits agree, and when impacts began, on truths that are known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.published import published

from rotordrop.errors import UsageError
from rotordrop.estimate.agreement import AFTER_CONTACT, TENFOLD, compare_orbits, orbit_disagreement
from rotordrop.estimate.bearing_drop import (
    AirGap,
    Band,
    BearingDrop,
    History,
    Impact,
    Motion,
    Origin,
    highest,
    when_largest,
)
from rotordrop.estimate.changed import WATCHED, changes, unlike
from rotordrop.estimate.published import Bearing, Joint, Parameter, Value
from rotordrop.evidence.impacts import shortest_flight
from rotordrop.known import NINETY, Known
from rotordrop.units import GRAVITY

TABLE = {
    "air_gap": (275e-6, 22e-6, 1.4e-6, lambda value: value + 10e-6),
    "support.stiffness": (1e8, 0.5, 0.0135, lambda value: 1.1 * value),
    "support.damping": (2e4, 0.7, 0.0135, lambda value: 1.1 * value),
    "friction.dynamic": (0.1, 0.3, 0.026, lambda value: 1.2 * value),
    "race.drag_coefficient": (0.002, 1.0, 0.098, None),
}
"""Truth, prior, standard error at which 95 of 100 changes are found (of logarithms but for the gap)."""
TRUTH, PRIOR, ERROR, CHANGED = ({path: row[k] for path, row in TABLE.items()} for k in range(4))


def entry(path, mean, sigma):
    linear = path.endswith("air_gap")
    ends = [mean - NINETY * sigma, mean, mean + NINETY * sigma]
    low, value, high = ends if linear else [math.exp(end) for end in ends]
    return Value(value=value, interval_90=[low, high])


def document(random, truth, name, spread=1.0):
    """An estimate: the record's own error, drawn together with a prior whose centre is drawn once."""
    parameters, rows = [], []
    for end in ("NDE", "DE"):
        for path, value in truth.items():
            middle, usual = (at if path == "air_gap" else math.log(at) for at in (value, TRUTH[path]))
            own = middle + ERROR[path] * random.standard_normal()
            before = usual + 0.7 * PRIOR[path]
            precision = ERROR[path] ** -2 + PRIOR[path] ** -2
            mean = (own * ERROR[path] ** -2 + before * PRIOR[path] ** -2) / precision
            prior, found = entry(path, before, PRIOR[path]), entry(path, mean, spread * precision**-0.5)
            one = Parameter(path=f"{end}.{path}", scope="machine", prior=prior, estimate=found)
            parameters.append(one)
            rows.append((one.path, mean, precision**-0.5, before, PRIOR[path]))
    paths, mean, sigma, before, wide = map(list, zip(*rows, strict=True))
    covariance = np.diag(np.square(sigma))[np.tril_indices(len(paths))].tolist()
    joint = Joint(
        paths=paths, mean=mean, covariance=covariance, prior_mean=before, prior_standard_deviation=wide
    )
    return published(record=name, parameters=parameters, joint=joint)


def pair(seed, **moved):
    """Estimates of two drops, with other values of some parameters of the second."""
    random = np.random.default_rng(seed)
    return document(random, TRUTH, "a"), document(random, TRUTH | moved, "b")


def of(found, path):
    return next(one for one in found.found if one.path == path)


def test_unchanged_pairs_give_few_false_alarms():
    random = np.random.default_rng(5)
    pairs = ((document(random, TRUTH, "a"), document(random, TRUTH, "b")) for _ in range(1000))
    assert sum(bool(changes(*both).named) for both in pairs) <= 18  # one in a hundred, and what chance adds


@pytest.mark.parametrize("path", [path for path, change in CHANGED.items() if change])
def test_changes_of_the_size_asked_for_are_found(path):
    random, found = np.random.default_rng(6), 0
    other = TRUTH | {path: CHANGED[path](TRUTH[path])}
    for _ in range(200):
        named = changes(document(random, TRUTH, "a"), document(random, other, "b")).named
        found += sum(one.path.endswith(f".{path}") for one in named)
    assert found >= 0.92 * 400


def test_a_change_is_said_with_its_interval_whatever_the_prior():
    found = changes(*pair(7, **{"support.stiffness": 1.5 * TRUTH["support.stiffness"]}))
    one = of(found, "NDE.support.stiffness")
    assert one.factor and one.interval_90[0] < 1.5 < one.interval_90[1]
    assert one.probability > 0.999
    # Both estimates lean on one prior: the difference of their values is too small, that of records not.
    random, sizes = np.random.default_rng(8), []
    other = TRUTH | {"support.damping": 1.4 * TRUTH["support.damping"]}
    for _ in range(300):
        found = changes(document(random, TRUTH, "a"), document(random, other, "b"))
        sizes.append(of(found, "NDE.support.damping").change)
    assert np.median(sizes) == pytest.approx(1.4, rel=0.02)


def test_what_no_record_or_machine_shows_is_not_judged():
    """The spin-up tells no drag from inertia."""
    found = changes(*pair(8, **{"race.drag_coefficient": 17.0 * TRUTH["race.drag_coefficient"]}))
    assert not any("drag" in one.path for one in found.named)
    one, other = pair(9)
    blind = [part.model_copy(update={"estimate": part.prior}) for part in one.parameters]
    found = changes(one.model_copy(update={"parameters": blind}), other)
    assert not found.named and not any(change.determined for change in found.found)
    assert len(found.found) == 2 * len(WATCHED)
    one, _ = pair(1)
    with pytest.raises(UsageError, match=r"'m' and 'n'; only drops of one machine"):
        changes(one, one.model_copy(update={"machine": "n"}))
    with pytest.raises(UsageError, match=r"a: the model is not consistent with this record"):
        changes(one.model_copy(update={"consistent": False}), one)


CONFOUNDED = ("NDE.air_gap", "NDE.support.stiffness", "NDE.friction.dynamic", "sensors.X.gain")
BEFORE = np.array([22e-6, 0.5, 0.4, 0.03])
MIDDLE = np.array([275e-6, math.log(1e8), math.log(0.1), 0.0])


def jointly(name, values, mean, covariance, before, spread):
    """An estimate whose parameters are known together."""
    paths = [*values, *CONFOUNDED[len(values) :]] if len(mean) == 4 else [*values]
    found = [
        Parameter(path=path, scope="machine", prior=None, estimate=Value(value=value))
        for path, value in values.items()
    ]
    joint = Joint(
        paths=paths,
        mean=mean.tolist(),
        covariance=covariance[np.tril_indices(len(mean))].tolist(),
        prior_mean=before.tolist(),
        prior_standard_deviation=spread.tolist(),
    )
    return published(record=name, parameters=found, joint=joint)


def joint_document(random, truth, name):
    """An estimate of a linear record that sees gap and gain as one sum, and hardly tells them apart."""
    seen = np.zeros((5, 4))
    seen[0, [0, 3]] = 1e6, 275.0  # [µm]
    seen[1, 3] = 27.5
    seen[2, 1], seen[3, 2] = 1.0 / 0.015, 1.0 / 0.03
    seen[4, 1:3] = 20.0
    read = seen @ (truth - MIDDLE) + random.standard_normal(5)
    covariance = np.linalg.inv(seen.T @ seen + np.diag(BEFORE**-2))
    mean = MIDDLE + covariance @ (seen.T @ read)
    values = dict(zip(CONFOUNDED[:3], (mean[0], *np.exp(mean[1:3])), strict=True))
    return jointly(name, values, mean, covariance, MIDDLE, BEFORE)


def hidden_truth(random):
    return MIDDLE + BEFORE * random.standard_normal(4)


def test_what_both_records_confound_alike_does_not_blur_a_change():
    """A gap known to 6 µm in each record, and its change to 2 µm, since the gain of the sensor is one."""
    random, found, held, alarms = np.random.default_rng(8), 0, 0, 0
    for _ in range(400):
        truth = hidden_truth(random)
        first, same = (joint_document(random, truth, name) for name in "ab")
        alarms += bool(changes(first, same).named)
        after = changes(first, joint_document(random, truth + np.array([10e-6, 0, 0, 0]), "c"))
        found += [one.path for one in after.named] == ["NDE.air_gap"]
        gap = of(after, "NDE.air_gap")
        held += gap.interval_90[0] <= 10e-6 <= gap.interval_90[1]
    covariance = np.zeros((4, 4))
    covariance[np.tril_indices(4)] = first.joint.covariance
    assert math.sqrt(covariance[0, 0]) > 5e-6
    assert found >= 0.9 * 400
    assert alarms <= 10  # one in a hundred, and what chance adds
    assert 0.86 * 400 <= held <= 0.94 * 400


def test_two_changes_at_once_are_both_named():
    random, moved = np.random.default_rng(9), MIDDLE + np.array([15e-6, -0.15, 0.0, 0.0])
    found = changes(joint_document(random, MIDDLE, "a"), joint_document(random, moved, "b"))
    assert {one.path for one in found.named} == {"NDE.air_gap", "NDE.support.stiffness"}
    stiffness = of(found, "NDE.support.stiffness")
    assert stiffness.factor
    assert stiffness.interval_90[0] < math.exp(-0.15) < stiffness.interval_90[1]


def blind_to_friction(drop):
    n, joint = len(CONFOUNDED), drop.joint
    covariance = np.zeros((n, n))
    covariance[np.tril_indices(n)] = joint.covariance
    covariance[2, :], covariance[:, 2] = 0.0, 0.0
    covariance[2, 2] = BEFORE[2] ** 2
    mean = [*joint.mean[:2], MIDDLE[2], *joint.mean[3:]]
    changed = {"covariance": covariance[np.tril_indices(n)].tolist(), "mean": mean}
    return drop.model_copy(update={"joint": joint.model_copy(update=changed)})


def test_what_a_record_says_nothing_of_is_no_change():
    random = np.random.default_rng(10)
    first, second = (blind_to_friction(joint_document(random, MIDDLE, name)) for name in "ab")
    assert not of(changes(first, second), "NDE.friction.dynamic").determined
    # The linearised fit of a parameter that stays in its prior names what has not changed.
    random, path = np.random.default_rng(11), "NDE.friction.dynamic"
    moved = MIDDLE + np.array([0.0, 0.0, 1.0, 0.0])
    both = joint_document(random, MIDDLE, "a"), joint_document(random, moved, "b")
    assert [one.path for one in changes(*both).named] == [path]
    wide = Value(value=0.1, interval_90=[0.05, 0.2])

    def unknown(one):
        return one.model_copy(update={"prior": wide, "estimate": wide}) if one.path == path else one

    found = changes(
        *(drop.model_copy(update={"parameters": [*map(unknown, drop.parameters)]}) for drop in both)
    )
    assert not found.named
    assert not of(found, path).determined and of(found, path).may_hide


@pytest.mark.parametrize(("place", "size"), [(0, 1e-6), (1, 0.01), (2, 0.01)])
def test_the_smallest_change_that_shows_is_found_in_19_of_20_pairs(place, size):
    """Of each parameter the change that is said to show, made: a smaller one is found less often."""
    random, found = np.random.default_rng(12), []
    for share in (1.0, 0.6):
        hits = 0
        for _ in range(300):
            truth = hidden_truth(random)
            first, same = (joint_document(random, truth, name) for name in "ab")
            told = of(changes(first, same), CONFOUNDED[place])
            least = told.smallest - 1.0 if told.factor else told.smallest
            assert least > size
            moved = truth + share * least * np.eye(4)[place]
            named = changes(first, joint_document(random, moved, "c")).named
            hits += any(one.path == CONFOUNDED[place] for one in named)
        found.append(hits)
    assert 0.91 * 300 <= found[0] <= 0.98 * 300
    assert found[1] < 0.6 * 300


def supported(name, stiffness, mass):
    """An estimate that tells stiffness [N/m] and mass [kg] of a support to 1.5 and 2 %."""
    sharp, wide, before = np.array([0.015, 0.02]), np.array([0.5, 0.4]), np.log([1e8, 40.0])
    covariance = np.diag(1.0 / (sharp**-2 + wide**-2))
    mean = covariance @ (np.log([stiffness, mass]) / sharp**2 + before / wide**2)
    values = {"NDE.support.stiffness": stiffness, "NDE.support.mass": mass}
    return jointly(name, values, mean, covariance, before, wide)


def test_drops_of_two_machines_by_one_file_show_no_change():
    """The mass beside a stiffness is not taken for one that cannot change."""
    first, other, same = (
        supported("a", 0.8e8, 56.0),
        supported("b", 0.88e8, 28.0),
        supported("c", 1.2e8, 57.0),
    )
    with pytest.raises(UsageError, match=r"not of one machine.*NDE\.support\.mass is 56 kg in one and 28 kg"):
        changes(first, other)
    assert unlike(first, same) == ""
    assert [one.path for one in changes(first, same).named] == ["NDE.support.stiffness"]


GAP = 300e-6
times = np.arange(0.0, 0.2, 5e-5)
GAPS = np.array([GAP, GAP])
NAMES = ("NDE", "DE")


def orbit(contacts, *, sideways=0.0):
    """Vertical motion that hangs at half the gap, and beyond the gap in the contacts; shape (T, 2)."""
    place = np.zeros((len(times), 2))
    place[:, 0], place[:, 1] = sideways, -0.5 * GAP
    for start, end in contacts:
        place[(times >= start) & (times <= end), 1] = -GAP - 10e-6
    return place


def test_every_window_has_the_distance_of_its_own_time():
    """3 µm apart before the first contact, 4 µm in it and until 2 ms later, 20 µm from there on."""
    measured = np.stack([orbit(((0.010, 0.012),)), orbit(((0.011, 0.015),))], axis=1)
    apart = np.where(times < 0.0099, 3e-6, np.where(times < 0.0171, 4e-6, 20e-6))
    simulated = measured + apart[:, None, None] * np.array([1.0, 0.0])
    found = {
        window.name: window for window in compare_orbits(times, measured, simulated, GAPS, NAMES).windows
    }
    assert list(found) == ["first contact", "20 ms", "50 ms", "200 ms"]
    first = found["first contact"]
    assert (first.start, first.end) == pytest.approx((0.010, 0.015 + AFTER_CONTACT), abs=6e-5)
    assert [*first.rms.values()] == pytest.approx([4e-6, 4e-6], rel=1e-9)
    for name, end in (("20 ms", 0.02), ("50 ms", 0.05), ("200 ms", 0.2)):
        expected = np.sqrt(np.mean(apart[times <= end] ** 2))
        assert [*found[name].rms.values()] == pytest.approx([expected, expected], rel=1e-9), name
        assert found[name].end == pytest.approx(end, abs=1e-4)


def test_an_orbit_apart_sideways_and_in_height_is_apart_by_both():
    measured = np.stack([orbit(((0.01, 0.012),))] * 2, axis=1)
    simulated = measured + np.array([3e-6, 4e-6])
    found = compare_orbits(times, measured, simulated, GAPS, NAMES)
    assert all([*window.rms.values()] == pytest.approx([5e-6, 5e-6]) for window in found.windows)


def test_contacts_bounces_and_horizon_belong_to_their_orbit():
    measured = np.stack([orbit(((0.010, 0.012), (0.020, 0.022)))] * 2, axis=1)
    simulated = np.stack([orbit(((0.010, 0.012), (0.020, 0.022)))] * 2, axis=1)
    flight = (times > 0.0125) & (times < 0.0195)
    measured[flight, 0, 1] = -0.4 * GAP
    simulated[flight, 0, 1] = -0.45 * GAP
    simulated[times >= 0.030, 0, 0] = 0.2 * GAP  # a fifth of the gap apart: beyond the horizon
    simulated[(times >= 0.040) & (times <= 0.041), 0, 1] = -GAP - 10e-6
    near, other = compare_orbits(times, measured, simulated, GAPS, NAMES).bearings.values()
    assert np.array(near.measured_contacts_s) == pytest.approx(
        np.array([[0.010, 0.012], [0.020, 0.022]]), abs=6e-5
    )
    assert np.array(near.simulated_contacts_s) == pytest.approx(
        np.array([[0.010, 0.012], [0.020, 0.022], [0.040, 0.041]]), abs=6e-5
    )
    assert near.measured_bounce_m == pytest.approx(0.6 * GAP)
    assert near.simulated_bounce_m == pytest.approx(0.55 * GAP)
    assert near.horizon_s == pytest.approx(0.030, abs=1.1e-3)  # half of the running mean
    assert other.horizon_s == pytest.approx(times[-1])


def test_drops_are_compared_at_the_times_of_the_record():
    """The measured orbit touches once, the simulated one, on a grid of its own, twice."""
    fine = np.arange(0.0, 0.2, 1.25e-5)
    measured = np.stack([orbit(((0.010, 0.012),))] * 2, axis=1)
    simulated = np.stack([orbit(((0.010, 0.012), (0.050, 0.052)))] * 2, axis=1)
    columns = simulated.reshape(len(times), -1).T
    finer = np.column_stack([np.interp(fine, times, column) for column in columns]).reshape(-1, 2, 2)
    found = compare_orbits(times, measured, finer, GAPS, NAMES, at=fine)
    for one in found.bearings.values():
        assert (len(one.measured_contacts_s), len(one.simulated_contacts_s)) == (1, 2)


def test_a_difference_counts_ten_times_less_33_ms_later():
    """1 µm apart at the first contact is as much as 10 µm 33 ms later, and as 1 µm before it."""
    contact, time = 0.01, np.linspace(0.0, 0.1, 1001)

    def one_moment(at, size):
        distance = np.zeros((len(time), 2))
        distance[int(np.argmin(np.abs(time - at)))] = size
        return orbit_disagreement(time, distance, contact)

    first = one_moment(contact, 1e-6)
    assert one_moment(contact + TENFOLD, 10e-6) == pytest.approx(first, rel=1e-2)
    assert one_moment(0.002, 1e-6) == pytest.approx(first)
    assert orbit_disagreement(time, np.full((1001, 2), 3e-6), contact) == pytest.approx(3e-6)


RADIUS, RATE = 300e-6, 20000.0
FALL = math.sqrt(2.0 * RADIUS / GRAVITY)
CONTACT, HOP = 1e-3, 6e-3
"""How long every contact and the flight between two of them last [s]."""
BEGUN = (FALL, FALL + CONTACT + HOP)
"""When the two contacts begin [s]."""


def fallen(*contacts):
    """A rotor that falls, hops once and stays; with such contacts in its list [s]."""
    time = np.arange(0.0, 0.1, 1.0 / RATE)
    height = -0.5 * GRAVITY * time**2
    for begun in BEGUN:
        speed = GRAVITY * (FALL if begun == FALL else 0.5 * HOP)
        inside = (time >= begun) & (time < begun + CONTACT)
        phase = math.pi * (time[inside] - begun) / CONTACT
        height[inside] = -RADIUS - speed * CONTACT / math.pi * np.sin(phase)
        flown = time[time >= begun + CONTACT] - begun - CONTACT
        height[time >= begun + CONTACT] = -RADIUS + np.maximum(0.5 * GRAVITY * flown * (HOP - flown), 0.0)
    height[time >= BEGUN[1] + CONTACT] = -RADIUS
    nothing = Known(value=1.0, status="determined")
    loads = dict.fromkeys(("peak_force", "impulse", "dissipated_energy"), nothing)
    force = History(label="estimated", time=time, values=1.0 + time)
    peak = highest(force, "N", Origin.TWIN)
    place = np.stack([0.0 * time, height], axis=1)
    return BearingDrop(
        name="NDE",
        motions=(Motion(label="estimated", time=time, displacement=place),),
        air_gap=AirGap.of(RADIUS),
        force=force,
        stress=force,
        peak_force=peak,
        peak_stress=peak,
        impacts=tuple(
            Impact(start=start, end=end, azimuth=0.0, peak_time=start, **loads) for start, end in contacts
        ),
    )


def test_an_impact_ends_a_flight_between_contacts():
    """By the contacts, which the estimate knows better than its displacement shows them."""
    first, second = BEGUN
    assert fallen().touched.tolist() == [] and fallen().contact_from is None
    listed = fallen((first, first + CONTACT), (second, second + CONTACT))
    assert listed.touched.tolist() == [first, second]
    assert listed.contact_from == second
    chatter = shortest_flight(RADIUS) - 0.1e-3
    bounced = fallen((first, first + CONTACT), (first + CONTACT + chatter, second), (second + HOP, math.nan))
    assert bounced.after_flight == (True, False, True)
    assert bounced.contact_from == second + HOP


def test_a_peak_may_be_wherever_the_force_may_be_largest():
    """Two impacts of 100 and 96 N: errors of 5 N leave open which was larger, of 1 N do not."""
    time = np.arange(0.0, 0.05, 1e-4)
    values = sum(size * np.exp(-(((time - at) / 1e-3) ** 2)) for size, at in ((100.0, 0.01), (96.0, 0.03)))
    force = History(label="estimated", time=time, values=values)

    def within(error, doubt=0.0):
        return when_largest(force, Band(time=time, lower=values - error, upper=values + error), doubt)

    low, high = within(5.0)
    assert 0.009 < low < 0.01 and 0.03 <= high < 0.031
    low, high = within(1.0)
    # a share of √2 % below the top lies √(√2 %) widths beside it
    assert (low, high) == pytest.approx((0.01 - 0.119e-3, 0.01 + 0.119e-3), abs=0.5e-4)
    assert within(1.0, 1e-3) == pytest.approx((0.009, 0.011), abs=0.02e-3)


def test_times_and_counts_are_published_with_their_intervals():
    drop = fallen((BEGUN[0], BEGUN[0] + CONTACT))
    plain = Bearing.of_result(drop).model_dump(exclude_none=True)
    assert not {"impacts_interval_90", "contact_from_interval_90_s"} & plain.keys()
    peak = replace(drop.peak_force, time_interval_90=(0.01, 0.02))
    known = replace(drop, peak_force=peak, count_interval_90=(1, 3), contact_from_interval_90=(0.007, 0.03))
    told = Bearing.of_result(known).model_dump(exclude_none=True)
    assert told["peak_force_N"]["time_interval_90_s"] == [0.01, 0.02]
    assert told["impacts_interval_90"] == [1, 3]
    assert told["contact_from_interval_90_s"] == [0.007, 0.03]
