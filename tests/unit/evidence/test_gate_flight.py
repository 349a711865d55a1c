"""Between impacts gravity alone pulls a rotor: a gain shows by how fast the readings fall then."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.evidence.events import coarse_drop
from rotordrop.evidence.free_rotor import GRID, Responses, free_rotor
from rotordrop.evidence.levitated import fit_levitated
from rotordrop.evidence.quality import check_record
from rotordrop.evidence.quality.flight import Weighed, check_flights, weighed
from rotordrop.record.axes import sensor_planes
from rotordrop_bench import hidden_machine, synthesize_drop


@pytest.fixture(scope="module")
def hopping(machine):
    """A drop of a machine of the kind described, with flights of milliseconds."""
    found = synthesize_drop(
        hidden_machine(machine, 946), 2.0 * np.pi * 249.0, 946, duration=0.4, tolerance=1e-6
    )
    return found.record, found.tail


def in_flight(record, machine):
    coarse = coarse_drop(record, machine)
    levitated = fit_levitated(record, coarse.instant - 3e-3, speed=coarse.speed)
    rotor = free_rotor(machine, record.planes)
    seen = weighed(record, machine, rotor, levitated, coarse.instant)
    return seen, [] if seen is None else check_flights(seen, record)


def test_a_good_record_falls_with_gravity(hopping, machine):
    seen, found = in_flight(hopping[0], machine)
    assert found == []
    error = np.sqrt(np.diag(seen.covariance))
    assert np.all(error < 0.15)
    assert np.all(np.abs(seen.share - 1.0) < 3.0 * error)


@pytest.mark.parametrize("gain", [0.75, 0.85, 1.2, 1.4])
def test_a_common_gain_is_weighed(gain, hopping, machine):
    record = replace(hopping[0], signals=gain * hopping[0].signals)
    (found,) = in_flight(record, machine)[1]
    assert found.kind == "wrong gain"
    assert found.channel == ", ".join(record.channel_names)
    said, error = (float(found.message.split(before)[1].split()[0]) for before in ("reading ", "± "))
    assert abs(said - gain) < 2.0 * error < 0.4 * abs(gain - 1.0)


@pytest.mark.parametrize("channel", [1, 3])
def test_the_gain_of_one_channel_is_weighed(channel, hopping, machine):
    scale = np.ones(4)
    scale[channel] = 1.35
    record = replace(hopping[0], signals=hopping[0].signals * scale)
    seen, (found,) = in_flight(record, machine)
    assert (found.kind, found.channel) == ("wrong gain", record.channel_names[channel])
    # a touch that was not seen looks like this in a single flight
    assert (len(seen.each), found.severity) == (1, "note")
    (twice,) = check_flights(replace(seen, each=2 * seen.each), record)
    assert twice.severity == "warning"


def test_the_gate_tells_a_common_gain_that_the_first_fall_hides(hopping, machine):
    record, tail = hopping
    assert not [found for found in check_record(record, machine, tail) if found.severity != "note"]
    found = check_record(
        replace(record, signals=0.85 * record.signals), machine, replace(tail, signals=0.85 * tail.signals)
    )
    assert "wrong gain" in [one.kind for one in found if one.severity == "warning"]


def test_a_fading_force_is_answered_as_by_stepping(hopping, machine):
    """The closed form of a force that fades is the response stepped through time."""
    rotor = free_rotor(machine, sensor_planes(hopping[0].sensors))
    for decay in (1e-4, 5e-3, 3e-2):
        stepped = rotor.table(600.0, 1.0 / decay, 0.02)
        stepped = stepped[:-1]  # what lies beyond the table is held at its end
        since = np.arange(len(stepped)) * GRID
        responses = Responses.of(rotor, 600.0, 0.02)
        closed = responses.fading(decay, since, responses.at(since)[0])
        np.testing.assert_allclose(closed, stepped, rtol=0.0, atol=1e-9 * np.max(np.abs(stepped)))


@pytest.mark.parametrize(("by_chance", "severity"), [(0.2, "warning"), (1e-3, "note")])
@pytest.mark.parametrize("channels", [[1], [0, 1, 2, 3]])
def test_flights_that_contradict_each_other_ask_and_do_not_warn(by_chance, severity, channels, hopping):
    share, precision = np.ones(4), np.eye(4) / 0.02**2
    share[channels] = 0.8
    seen = Weighed(
        share=share,
        covariance=0.5 * 0.02**2 * np.eye(4),
        each=((share, precision), (share, precision)),
        scatter=3.0,
        by_chance=by_chance,
        beside=frozenset(),
    )
    (found,) = check_flights(seen, hopping[0])
    assert (found.kind, found.severity) == ("wrong gain", severity)
    assert ("contradict each other" in found.message) == (severity == "note")


def test_only_a_fault_of_all_channels_outweighs_what_a_touch_left(hopping):
    """A touch looks like a gain of one channel, not of all."""
    precision = np.eye(4) / 0.02**2
    for share, kinds in (
        (np.array([0.8, 0.78, 0.86, 0.74]), ["wrong gain"]),
        (np.array([1.1, 0.6, 1.2, 1.0]), []),
    ):
        seen = Weighed(
            share=share,
            covariance=0.02**2 * np.eye(4),
            each=((share, precision),),
            scatter=1.0,
            by_chance=1.0,
            beside=frozenset(),
        )
        found = check_flights(seen, hopping[0])
        assert [(one.kind, one.severity) for one in found] == [(kind, "note") for kind in kinds]
