"""Filter and smoother against plain textbook ones, and what must hold through impacts."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import IdentificationError
from rotordrop.track import _propagation as P
from rotordrop.track import smoother
from rotordrop.track._arrays import is_covariance
from rotordrop.track.calibration import filtered_chain, prior_of_next, smoothed_chain, smoothed_means_of_chain
from rotordrop.track.problem import WATCHED, private_copy
from rotordrop.track.smoother import PassSettings, fastest_frequency, forward, smooth, smooth_means

SETTINGS = PassSettings(impulse=1e-3, share=0.01)


class PlainFilter:
    """Kalman filter as in textbooks: full matrices, readings one by one, Joseph form, nothing clever."""

    def __init__(self, problem, settings=SETTINGS):
        self.problem = problem
        dt = float(problem.time[1] - problem.time[0])
        self.numbers = settings.for_sampling(dt, fastest_frequency(problem))
        self.means, self.covariances, self.predicted, self.matrices = [], [], [], []
        self.innovations = []

    def run(self):
        mean, covariance = self.problem.mean.copy(), self.problem.covariance.copy()
        for i in range(len(self.problem.time)):
            if i > 0:
                mean, covariance = self._predicted(i, mean, covariance)
            else:
                self.matrices.append(np.eye(len(mean)))
            self.predicted.append((mean.copy(), covariance.copy()))
            for value, row, expected, variance in self._readings(i):
                mean, covariance = self._updated(mean, covariance, value, row, expected, variance)
            self.means.append(mean)
            self.covariances.append(covariance)
        return self

    def _predicted(self, i, mean, covariance):
        problem, n = self.problem, len(mean)
        s, n_p = problem.n_dynamic, len(problem.unknowns)
        y = np.zeros(problem.model.layout.size)
        y[:s] = mean[:s]
        theta, F = mean[problem.parameter_slice].copy(), np.zeros((s, s + n_p))
        impulses, p = np.zeros(problem.model.layout.n_bearings), private_copy(problem.model.parameters)
        P.apply_parameters(theta, problem.targets, p)
        P.propagate(problem.time[i - 1], y, theta, problem.targets, p, self.numbers, F, impulses)
        form = problem.sensor_form
        parts = np.arange(n - len(form.noisy), n)
        whole = np.eye(n)
        whole[:s, : s + n_p] = F
        whole[parts, parts] = form.noise_decay
        noise = np.zeros((n, n))
        noise[parts, parts] = (1.0 - form.noise_decay**2) * form.noise_variance
        sigmas = np.empty_like(impulses)
        P.unknown_impulses(self.numbers, impulses, sigmas)
        P.add_process_noise(noise, p, self.numbers, sigmas, problem.targets.drift)
        self.matrices.append(whole)
        return np.concatenate([y[:s], whole[s:, s:] @ mean[s:]]), whole @ covariance @ whole.T + noise

    def _readings(self, i):
        """Readings of a sample with the linearised measurement; taken at the mean at hand."""
        problem = self.problem
        s, n_p, n_c = problem.n_dynamic, len(problem.unknowns), problem.n_channels
        for c in range(n_c):
            if np.isfinite(problem.readings[i, c]):

                def at(mean, c=c):
                    first = s + n_p
                    gain, offset = 1.0 + mean[first + c], mean[first + n_c + c]
                    turn = np.array([np.cos(mean[s - 1]), np.sin(mean[s - 1])])
                    seen = problem.sensor_rows[c] @ mean[:s]
                    runout = mean[[first + 2 * n_c + c, first + 3 * n_c + c]] @ turn
                    row = np.zeros(len(mean))
                    row[:s] = gain * problem.sensor_rows[c]
                    row[first + c], row[first + n_c + c] = seen, 1.0
                    row[[first + 2 * n_c + c, first + 3 * n_c + c]] = turn
                    own = first + 4 * n_c + np.flatnonzero(problem.sensor_form.noisy == c)
                    row[own] = 1.0
                    return row, gain * seen + offset + runout + mean[own].sum()

                yield problem.readings[i, c], at, None, problem.white_variances[c]
        if np.isfinite(problem.speed[i]):
            place = problem.model.layout.rotor_speed

            def tacho(mean):
                return np.eye(len(mean))[place], mean[place]

            yield problem.speed[i], tacho, None, problem.speed_variance

    def _updated(self, mean, covariance, value, at, _, variance):
        row, expected = at(mean)
        size = row @ covariance @ row + variance
        gain = covariance @ row / size
        keep = np.eye(len(mean)) - np.outer(gain, row)
        self.innovations.append((value - expected, size))
        return mean + gain * (value - expected), keep @ covariance @ keep.T + variance * np.outer(gain, gain)

    def smoothed(self):
        """Rauch–Tung–Striebel, with the inverse taken in units of the predicted standard deviations."""
        mean, covariance = self.means[-1], self.covariances[-1]
        means, covariances = [mean], [covariance]
        for i in range(len(self.means) - 2, -1, -1):
            ahead, spread = self.predicted[i + 1]
            unit = np.sqrt(np.diag(spread))
            cross = (self.covariances[i] @ self.matrices[i + 1].T) / unit
            gain = np.linalg.solve(spread / np.outer(unit, unit), cross.T).T / unit
            mean = self.means[i] + gain @ (mean - ahead)
            covariance = self.covariances[i] + gain @ (covariance - spread) @ gain.T
            means.append(mean)
            covariances.append(covariance)
        return np.array(means[::-1]), np.array(covariances[::-1])


@pytest.fixture(scope="module")
def plain(flight):
    return PlainFilter(flight).run()


@pytest.fixture(scope="module")
def filtered(flight):
    return forward(flight, SETTINGS)


def deviations_of(covariance):
    """Standard deviations; one for what is known exactly (the rotor angle at the beginning)."""
    variance = np.diag(covariance)
    return np.sqrt(np.where(variance > 0.0, variance, 1.0))


def in_deviations(difference, covariance):
    """Largest difference in standard deviations of the estimate."""
    return float(np.max(np.abs(difference) / deviations_of(covariance)))


def follows(filtered, plain):
    """Whether means and covariances of a filter are those of the plain one."""
    for i in range(filtered.done):
        assert in_deviations(filtered.means[i] - plain.means[i], plain.covariances[i]) < 1e-6
        unit = deviations_of(plain.covariances[i])
        difference = (filtered.covariance(i) - plain.covariances[i]) / np.outer(unit, unit)
        assert np.abs(difference).max() < 1e-6


def smooths(smoothed, plain):
    """Whether those of a smoother are those of the plain one."""
    means, covariances = plain.smoothed()
    for i in range(0, len(means), 5):
        assert in_deviations(smoothed.means[i] - means[i], covariances[i]) < 1e-3
        unit = deviations_of(covariances[i])
        difference = (smoothed.covariance(i) - covariances[i]) / np.outer(unit, unit)
        assert np.abs(difference).max() < 1e-3


def test_forward_and_backward_pass_are_the_plain_filter_and_smoother(flight, plain, filtered):
    assert filtered.done == len(flight.time) == 60
    follows(filtered, plain)
    innovations, sizes = np.array(plain.innovations).T
    used = np.isfinite(filtered.innovations)
    np.testing.assert_allclose(filtered.innovations[used], innovations, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(filtered.innovation_variances[used], sizes, rtol=1e-6)
    expected = 0.5 * np.sum(innovations**2 / sizes + np.log(sizes))
    assert filtered.negative_log_likelihood == pytest.approx(expected, rel=1e-9)
    assert filtered.nis == pytest.approx(np.mean(innovations**2 / sizes), rel=1e-6)
    smooths(smooth(filtered, kept=range(filtered.done)), plain)


def with_slow_noise(problem):
    """The problem with two sensors whose noise is not white, one of them with two parts."""
    variances, whole = np.array([4e-13, 9e-14, 1e-13]), problem.variances.copy()
    form = problem.sensor_form._replace(
        noisy=np.array([1, 1, 3]), noise_decay=np.array([0.99, 0.6, 0.9]), noise_variance=variances
    )
    np.add.at(whole, form.noisy, variances)
    covariance = np.pad(problem.covariance, (0, 3))
    covariance[-3:, -3:] = np.diag(variances)
    return replace(
        problem,
        mean=np.append(problem.mean, np.zeros(3)),
        start=np.append(problem.start, np.zeros(3)),
        covariance=covariance,
        sensor_form=form,
        variances=whole,
    )


def test_slow_noise_is_that_of_the_plain_filter_and_smoother(flight):
    problem = with_slow_noise(flight)
    np.testing.assert_allclose(problem.white_variances, flight.variances, rtol=1e-12)
    plain, filtered = PlainFilter(problem).run(), forward(problem, SETTINGS)
    assert filtered.done == len(problem.time)
    follows(filtered, plain)
    smoothed, covariance = smooth(filtered, kept=range(filtered.done)), plain.smoothed()[1][30]
    smooths(smoothed, plain)
    # what a sample leaves of it is not nothing: with white noise in its place the same readings differ
    white = smooth(forward(flight, SETTINGS))
    assert in_deviations(smoothed.means[30, :-3] - white.means[30], covariance[:-3, :-3]) > 0.1


def all_of(smoothed):
    """Everything that a backward pass gives."""
    covariances = [smoothed.covariance(sample) for sample in smoothed.kept]
    return [
        smoothed.means,
        smoothed.watched,
        smoothed.information,
        smoothed.score_0,
        smoothed.information_0,
        *covariances,
    ]


@pytest.mark.parametrize(
    ("length", "lost"), [*((n, 60) for n in (2, 7, 29, 58, 59, 60)), *((n, 26) for n in (10, 12, 25, 26))]
)
def test_a_pass_in_segments_has_the_bits_of_a_whole_one(flight, length, lost, monkeypatch):
    """One that loses the drop too, to where it got."""
    # in its fall a reading leads the rotor astray, and one step later the race
    problem = flight if lost == 60 else lost_at(flight, lost - 1)
    whole = forward(problem, SETTINGS)
    kept = tuple(sample for sample in (0, length, 2 * length - 1, 59) if sample < min(lost, 60))
    expected = all_of(smooth(whole, watched=flight.watched, kept=kept))
    squares = whole.innovations[:lost] ** 2 / whole.innovation_variances[:lost]
    assert whole.done == lost and whole.nis == pytest.approx(np.nanmean(squares))
    monkeypatch.setattr(smoother, "_segment_length", lambda _: length)
    parts = forward(problem, SETTINGS)
    assert parts.done == lost and (lost < 60 or len(parts.checkpoints) == math.ceil(59 / length))
    found = all_of(smooth(parts, watched=flight.watched, kept=kept))
    for one, other in (
        *zip(found, expected, strict=True),
        (parts.means[:lost], whole.means[:lost]),
        (parts.innovations[:lost], whole.innovations[:lost]),
        (parts.last, whole.last),
    ):
        np.testing.assert_array_equal(one, other)


def test_memory_for_the_smoother_does_not_grow_with_the_drop(flight, monkeypatch):
    monkeypatch.setattr(smoother, "_segment_length", lambda _: 5)
    passes = [forward(flight, SETTINGS, samples=samples, memory=900_000) for samples in (20, 60)]
    assert [list(one.segments) for one in passes] == [[0, 1, 2, 3], [7, 8, 9, 10, 11]]
    assert all(0 < one.size_of_segments <= 900_000 for one in passes)
    np.testing.assert_array_equal(passes[0].means, passes[1].means[:20])


def test_watched_functions_have_the_covariance_of_the_whole(flight, filtered, random):
    with pytest.raises(IndexError, match=r"sample 7 was not kept; kept are \[0, 59\]"):
        smooth(filtered).covariance(7)
    gradients = random.standard_normal((3, len(flight.mean)))
    smoothed = smooth(filtered, watched=gradients, kept=(30,))
    np.testing.assert_allclose(
        smoothed.watched[30], gradients @ smoothed.covariance(30) @ gradients.T, rtol=1e-8
    )


def test_the_watched_rows_are_deflection_offset_displacement_and_what_parts_rotor_and_race(flight):
    name = flight.model.bearing_names[1]
    rows, layout = flight.watched_rows(name), flight.model.layout
    estimate = np.zeros(len(flight.mean))
    estimate[layout.race.start + 2], estimate[layout.support.start + 2] = 5e-6, 2e-6
    estimate[layout.race.start + 3], estimate[layout.support.start + 3] = -4e-6, 1e-6
    estimate[layout.modal_y] = 1e-5
    shape = flight.model.parameters.bearing_shape[1]
    gap = [u.path for u in flight.unknowns].index(f"{name}.air_gap")
    estimate[flight.n_dynamic + gap] = 7e-6
    moved = 1e-5 * shape.sum()
    np.testing.assert_allclose(
        rows @ estimate, [3e-6, -5e-6, 0.0, 0.0, moved, -5e-6, moved + 4e-6, 7e-6], atol=1e-18
    )
    offset = [u.path for u in flight.unknowns].index(f"{name}.preload")
    assert rows[2, flight.n_dynamic + offset] == 1.0
    np.testing.assert_array_equal(flight.watched[WATCHED:], rows)


def test_missing_readings_are_left_out(flight):
    readings = flight.readings.copy()
    readings[:, 2] = np.nan
    readings[10:20] = np.nan
    partial = replace(flight, readings=readings, speed=np.full_like(flight.speed, np.nan))
    found, plain = forward(partial, SETTINGS), PlainFilter(partial).run()
    assert found.done == len(flight.time)
    assert np.array_equal(np.isfinite(found.innovations[:, :4]), np.isfinite(readings))
    follows(found, plain)
    smooths(smooth(found, kept=range(found.done)), plain)


def test_the_covariance_stays_positive_definite_through_impacts(impacts, impacts_filtered):
    assert impacts_filtered.done == len(impacts.time)
    contacts = np.abs(np.diff(impacts_filtered.means[:, impacts.model.layout.race], axis=0)).max(axis=0)
    assert np.all(contacts > 0.2e-6)  # both races were hit
    smoothed = smooth(impacts_filtered, kept=range(0, impacts_filtered.done, 15))
    for i in range(0, impacts_filtered.done, 15):
        for covariance in (impacts_filtered.covariance(i), smoothed.covariance(i)):
            unit = deviations_of(covariance)
            assert np.all(np.isfinite(unit)) and np.all(np.diag(covariance) >= 0.0)
            lowest = np.linalg.eigvalsh(covariance / np.outer(unit, unit))[0]
            assert lowest > -2e-6  # stored with seven digits
        filtered = impacts_filtered.covariance(i)
        np.testing.assert_array_equal(filtered, filtered.T)


def test_with_a_reference_the_estimate_is_linear_in_the_readings(flight, filtered, random):
    """A pass along a given trajectory is one Gauss–Newton step, so half the change gives half the answer."""
    change = 2e-6 * random.standard_normal(flight.readings.shape)
    means = [
        smooth(
            forward(
                replace(flight, readings=flight.readings + factor * change),
                SETTINGS,
                reference=filtered.means,
            )
        ).means
        for factor in (0.0, 0.5, 1.0)
    ]
    for i in (0, 30, 59):
        whole, half = means[2][i] - means[0][i], means[1][i] - means[0][i]
        assert in_deviations(whole, filtered.covariance(i)) > 0.1
        assert in_deviations(whole - 2.0 * half, filtered.covariance(i)) < 1e-5


def quiet(problem):
    """The problem without any drift: what the drops share is a constant."""
    still = np.zeros_like(problem.targets.drift)
    return replace(problem, targets=problem.targets._replace(drift=still, late_drift=still))


NOISELESS = PassSettings(impulse=0.0, share=0.0, spin_noise=0.0, speed_noise=0.0)


def test_drops_of_a_chain_know_the_same_in_either_order(flight):
    """Shared parameters and sensors, a start of its own for every drop, nothing random: one least squares."""
    first = quiet(flight)
    shifted = first.mean.copy()
    shifted[first.model.layout.modal_x.start] += 2e-5
    change = 1.5e-6 * np.cos(np.arange(60.0))[:, None]
    drops = [first, replace(first, mean=shifted, readings=first.readings + change)]
    paths = [np.array(forward(problem, NOISELESS).means) for problem in drops]

    def told(order):
        """Means and covariances at the first sample of every drop; the means by the pass for means alone."""
        problems, references = [drops[k] for k in order], [paths[k] for k in order]
        filtered = filtered_chain(problems, NOISELESS, references, 0.003)
        alone = [means[0] for means in smoothed_means_of_chain(problems, filtered)]
        smoothed = [(one.means[0], one.covariance(0)) for one in smoothed_chain(problems, filtered)]
        return {k: (*one, other) for k, one, other in zip(order, smoothed, alone, strict=True)}

    forth, back = told((0, 1)), told((1, 0))
    shared = first.machine_indices
    for k in (0, 1):
        (mean, covariance, alone), (other, as_well, other_alone) = forth[k], back[k]
        for one in (other, alone, other_alone):
            assert in_deviations(one - mean, covariance) < 2e-3
        unit = deviations_of(covariance)
        assert np.abs((as_well - covariance) / np.outer(unit, unit)).max() < 4e-3
        lone = told((k,))[k]
        narrower = np.diag(covariance)[shared] / np.maximum(np.diag(lone[1])[shared], 1e-300)
        assert np.all(narrower < 1.0 + 1e-3) and narrower.min() < 0.99
        assert in_deviations((lone[0] - mean)[shared], covariance[np.ix_(shared, shared)]) > 0.1
    assert forth[0][0][shared] == pytest.approx(forth[1][0][shared], rel=1e-4, abs=1e-12)


def test_what_leaves_its_place_ends_the_pass(flight):
    broken = replace(flight, mean=np.full_like(flight.mean, np.inf))
    with pytest.raises(IdentificationError, match=r"diverged after 0 of 60 samples.*Check air gap"):
        filtered_chain([broken], SETTINGS, [None], 0.003)
    far = flight.mean.copy()
    far[flight.model.layout.race.start] = 5e-3
    assert forward(flight, SETTINGS, mean=far).done == 0
    assert not is_covariance(-np.eye(3))
    assert not is_covariance(np.diag([1.0, np.nan, 1.0]))
    assert is_covariance(np.eye(3))


def test_a_pass_that_loses_the_drop_is_repeated_more_loosely(flight, monkeypatch):
    asked = []

    def giving_up(problem, settings, *, mean, covariance, reference, samples, memory):
        result = forward(problem, settings, mean=mean, covariance=covariance, samples=samples, memory=memory)
        asked.append((settings.impulse, reference is not None))
        return result if settings.impulse > 2.0 * SETTINGS.impulse else replace(result, done=3)

    monkeypatch.setattr("rotordrop.track.calibration.forward", giving_up)
    found = filtered_chain([flight], SETTINGS, [np.tile(flight.mean, (20, 1))], 0.002)[0]
    impulse = SETTINGS.impulse
    assert asked == [(impulse, True), (impulse, False), (8.0 * impulse, False)]
    assert found.impulse == 8.0 * impulse


def with_gaps(problem):
    """The problem without its first and last readings, and without some of one channel."""
    readings = problem.readings.copy()
    readings[[0, -1]] = np.nan
    readings[100:140, 2] = np.nan
    return replace(problem, readings=readings)


def lost_at(problem, sample):
    """The problem with a reading that nothing follows."""
    readings = problem.readings.copy()
    readings[sample] = 1e3
    return replace(problem, readings=readings)


def unlike(means, smoothed):
    """Largest distance of means from smoothed ones, in standard deviations of the drop's parameters."""
    deviation = np.sqrt(np.diag(smoothed.covariance(smoothed.filtered.parameter_sample)))
    known = deviation > 0.0
    return float((np.abs(means - smoothed.means)[:, known] / deviation[known]).max())


CASES = ("plain", "slow noise", "gaps", "late drift", "lost")


@pytest.mark.parametrize(
    ("case", "length"),
    [
        *(("plain", length) for length in (7, 60, 142)),
        *((case, 60) for case in CASES[1:]),
        *(pytest.param(case, length, marks=pytest.mark.slow) for case in CASES[1:] for length in (7, 142)),
    ],
)
def test_means_alone_are_those_of_the_whole_smoother(impacts, case, length, monkeypatch):
    changed = {"slow noise": with_slow_noise, "gaps": with_gaps, "lost": lambda one: lost_at(one, 300)}
    problem = changed.get(case, lambda one: one)(impacts)
    settings = replace(SETTINGS, learning_end=0.012) if case == "late drift" else SETTINGS
    score = np.full(len(problem.mean), 0.3) / np.sqrt(np.diag(problem.covariance) + 1e-30)
    score[np.diag(problem.covariance) == 0.0] = 0.0
    monkeypatch.setattr(smoother, "_segment_length", lambda _: length)
    reference = None
    for _ in range(1 if case == "lost" else 2):
        whole = smooth(forward(problem, settings, reference=reference), score)
        for memory in (64_000_000, 0, None):
            kept = forward(problem, settings, reference=reference, memory=memory)
            assert kept.done == (300 if case == "lost" else len(problem.time))
            for _again in range(2):
                means, before = smooth_means(kept, score)
                assert unlike(means, whole) < 2e-3
                size = np.abs(whole.score_0).max()
                assert before == pytest.approx(whole.score_0, rel=1e-6, abs=1e-6 * size)
        reference = whole.means


def test_means_of_a_chain_are_those_of_its_smoother(impacts, monkeypatch):
    monkeypatch.setattr(smoother, "_segment_length", lambda _: 60)
    drops = [lost_at(impacts, 300), impacts]
    filtered = filtered_chain(drops, SETTINGS, [None, None], 0.025)
    alone = smoothed_means_of_chain(drops, filtered)
    for means, smoothed in zip(alone, smoothed_chain(drops, filtered), strict=True):
        assert unlike(means, smoothed) < 2e-3
    whole = filtered_chain([impacts], SETTINGS, [None], 0.025)[0]
    shared = impacts.machine_indices
    handed = prior_of_next(filtered[0], impacts)[1]
    known = whole.covariance(filtered[0].done - 1)
    assert filtered[0].done == 300
    np.testing.assert_allclose(np.diag(handed)[shared], np.diag(known)[shared], rtol=1e-6)
