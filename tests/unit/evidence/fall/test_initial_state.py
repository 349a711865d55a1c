"""The fit over the fall finds where the rotor was and how fast, with an error that is true."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.errors import IdentificationError
from rotordrop.evidence.evidence import known, read_evidence
from rotordrop.evidence.initial_state import end_of_fall, initial_state_of
from rotordrop.replay.modal_expansion import expand_initial_state
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.reduction import Reduction

BASIS = Reduction(modes=6, attachment=True)
OFFSET = 8e-6


def bearing_state(initial, time):
    """Displacement and velocity (2, B, 2) at the bearings by the fall."""
    state = initial.state_at(time)
    fall = initial.fall
    shape = fall.model.parameters.bearing_shape
    parts = [state[part].reshape(2, -1) for part in (fall.displacement, fall.velocity)]
    return np.array([shape @ part.T for part in parts])


def errors_of(initial, time):
    """Standard errors (B, 2) of the places at the bearings."""
    turn, states = initial.fall.transition(initial.decay, time), initial.unknowns.states
    covariance = turn @ initial.covariance[states, states] @ turn.T
    shape, m = initial.fall.model.parameters.bearing_shape, initial.fall.n_modes
    parts = (covariance[:m, :m], covariance[m : 2 * m, m : 2 * m])
    return np.sqrt([np.diag(shape @ part @ shape.T) for part in parts]).T


def true_state(drop, time):
    k = round(time / 1e-5)
    displacement = drop.result.displacement
    return np.array([displacement[k], (displacement[k + 1] - displacement[k - 1]) / 2e-5])


def test_state_power_off_and_remanent_lift_are_found_and_leave_noise(initial, drop, contacts):
    late = float(round((contacts.min() - 3e-4) / 1e-5) * 1e-5)
    place, velocity = bearing_state(initial, late) - true_state(drop, late)
    assert np.abs(place).max() < 0.6e-6
    assert np.abs(velocity).max() < 1.5e-3
    assert initial.drop_instant == pytest.approx(drop.truth["t_off_in_record_s"], abs=5e-5)
    assert 0.7 < initial.misfit < 1.3
    true = np.array([[f["x_N"], f["vertical_N"]] for f in drop.truth["remanent_force"]])
    assert initial.remanent_force == pytest.approx(true, abs=15.0)
    assert np.all(np.abs(place) < 4.0 * errors_of(initial, late) + 0.05e-6)


def test_zeros_of_the_sensors_make_the_rest_as_unsure_as_they_are(evidence, sensing):
    """What no reading tells stays as the machine file says it."""
    unsure = replace(sensing, offset_sigma=np.full(4, OFFSET))
    gap, speed, off = known(evidence.gap), evidence.speed.initial, evidence.power_off
    found = initial_state_of(evidence.record, evidence.model, off, speed, evidence.angle, gap, unsure)
    sigma = np.sqrt(np.diag(found.covariance))
    zeros = OFFSET * np.random.default_rng(4).standard_normal((20000, 4))
    vertical = np.std(sensing.at_bearings(zeros)[..., 1], axis=0)
    assert sigma[found.unknowns.rest][1::2] == pytest.approx(vertical, rel=0.03)


def test_without_amb_planes_the_fall_ends_where_it_did(drop, truth, contacts):
    """No magnet carries a remanent force then: the state is the one that leads to the end of the fall."""
    bare = build_drop_model(truth.changed(ambs=()), BASIS)
    initial = known(read_evidence(bare, drop.record, drop.tail).fall)
    assert not len(initial.remanent_force)
    late = float(round((contacts.min() - 3e-4) / 1e-5) * 1e-5)
    place, velocity = bearing_state(initial, late) - true_state(drop, late)
    assert np.abs(place).max() < 8e-6
    assert np.abs(velocity).max() < 15e-3
    assert np.all(np.abs(place) < 3.0 * errors_of(initial, late))


def test_modal_expansion_misses_the_sag_that_the_fit_finds(drop, initial, rest, model, sensing):
    along = drop.record.along - rest.along + rest.settled
    expanded = expand_initial_state(drop.record.time, along, initial.drop_instant, model, sensing)
    true = true_state(drop, 1e-5)[0]
    by_fit = np.abs(initial.displacement - true).max()
    assert np.abs(expanded.at_bearings - true).max() < 6e-6
    assert by_fit < 1.2e-6
    assert not np.any(expanded.displacement[2:])


def test_the_fall_ends_where_the_gap_is_near():
    time = np.linspace(-1e-3, 9e-3, 201)
    place = np.zeros((201, 1, 2))
    place[:, 0, 1] = -0.5 * 9.81 * np.maximum(time, 0.0) ** 2
    expected = np.sqrt(2.0 * (0.97 * 250e-6) / 9.81)
    assert end_of_fall(time, place, np.array([250e-6])) == pytest.approx(expected, abs=6e-5)
    time = np.linspace(0.0, 5e-3, 101)
    place = np.zeros((101, 1, 2))
    place[:, 0, 1] = -0.5 * 9.81 * time**2
    with pytest.raises(IdentificationError, match=r"within 127 µm of the air gap 250 µm at most"):
        end_of_fall(time, place, np.array([250e-6]))


def test_fall_with_too_few_samples_is_refused(evidence, sensing):
    record = evidence.record
    coarse = replace(
        record,
        time=record.time[::16],
        signals=record.signals[::16],
        speed=None if record.speed is None else record.speed[::16],
        sampling_rate=1250.0,
    )
    with pytest.raises(IdentificationError, match=r"\d samples between power-off and the first contact"):
        initial_state_of(
            coarse,
            evidence.model,
            evidence.power_off,
            evidence.speed.initial,
            evidence.angle,
            known(evidence.gap),
            sensing,
        )
