"""A drop of one end; and between impacts, where gravity alone pulls, how a gain shows."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rotordrop import Replay, check_record, estimate_drops, look
from rotordrop.errors import RecordError, UsageError
from rotordrop.evidence.events import coarse_drop
from rotordrop.evidence.evidence import Evidence, Missing
from rotordrop.evidence.free_rotor import GRID, Responses, free_rotor
from rotordrop.evidence.levitated import fit_levitated
from rotordrop.evidence.one_end import as_dropped, one_end
from rotordrop.evidence.quality.flight import Weighed, check_flights, weighed
from rotordrop.physics import columns as L
from rotordrop.record.axes import sensor_planes
from rotordrop.track.input_state import corrections_by_record, rotor_of
from rotordrop.twin.problems import Drops
from rotordrop_bench import hidden_machine, synthesize_drop
from rotordrop_bench.violations import Violations

SPEED = 2.0 * math.pi * 60.0
HELD, FELL = "NDE", "DE"


@pytest.fixture(scope="module")
def drop(lp400):
    """A recorded drop of a hidden machine whose NDE magnet stays on."""
    hidden = hidden_machine(lp400, 14, Violations.of({"magnets": {"stays_on": [HELD]}}))
    made = synthesize_drop(hidden, SPEED, 140, duration=0.22, name="one end")
    assert made.tail is None
    assert made.truth["violated"] == ["one end held"]
    return made


@pytest.fixture(scope="module")
def evidence(lp400, drop):
    return Evidence(record=drop.record, machine=as_dropped(drop.record, lp400), name="one end")


def test_the_record_shows_which_end_was_held(lp400, drop, synthetic):
    found = one_end(drop.record)
    assert found is not None
    assert found.held == (True, False)
    assert [amb.stays_on for amb in as_dropped(drop.record, lp400).ambs] == [True, False]
    still = synthetic.record.signals.copy()
    still[:, 0] = 0.0  # a dead channel says nothing of its end
    seen = look(replace(synthetic.record, signals=still))
    assert one_end(seen.record) is None and [one.plane for one in seen.planes] == [FELL]
    assert one_end(synthetic.record) is None
    assert as_dropped(synthetic.record, lp400) is lp400


def test_the_gate_takes_what_a_machine_file_says_of_its_magnets(drop, lp400):
    said = lp400.with_magnets_on([FELL])
    assert as_dropped(drop.record, said) is said
    found = check_record(drop.record, lp400)
    assert [one.severity for one in found if one.kind == "one end held"] == ["warning"]
    assert not [one for one in found if one.severity == "stop"]
    assert "wrong unit factor" not in {one.kind for one in found}


@pytest.mark.parametrize("with_machine", [False, True])
def test_a_look_is_of_the_end_that_fell_and_says_so(drop, lp400, with_machine):
    seen = look(drop.record, machine=lp400 if with_machine else None)
    assert [plane.plane for plane in seen.planes] == [FELL]
    assert seen.impacts
    assert {impact.plane for impact in seen.impacts} == {FELL}
    assert seen.drops[0].release == pytest.approx(drop.truth["t_off_in_record_s"], abs=3e-3)


def test_the_fall_knows_that_one_magnet_holds_on(evidence, drop):
    """Release and lift of the end that fell; the loop of the other is known to a factor of two only."""
    fall, truth = evidence.free_fall, drop.truth
    assert not isinstance(fall, Missing)
    assert fall.misfit < 1.5
    assert fall.instant == pytest.approx(truth["t_off_in_record_s"], abs=6e-5)
    assert fall.remanent_force[0] == pytest.approx([0.0, 0.0])
    assert np.isnan(evidence.reach).tolist() == [True, False]
    gap = {b.name: float(b.air_gap) for b in evidence.machine.touchdown_bearings}[FELL]
    assert evidence.reach[1] == pytest.approx(gap, rel=0.3)


def test_the_twin_seeks_the_loop_of_that_magnet_and_not_its_lift(evidence):
    (problem,) = Drops(evidence=(evidence,), calibrate_only=False).fine(evidence.machine)
    paths = [unknown.path for unknown in problem.unknowns]
    for path in ("stiffness", "damping", "reference.x", "reference.y"):
        assert f"{HELD}.{path}" in paths
        assert f"{FELL}.{path}" not in paths
    lifts = [path for path in paths if "remanent_force" in path]
    assert {path.partition(".")[0] for path in lifts} == {FELL}
    assert problem.held == (0,)
    # it holds the rotor where it was, but for the orbit
    layout, p = problem.model.layout, problem.model.parameters
    apart = np.zeros(len(problem.mean))
    apart[layout.modal_y] = p.magnet_shape[0]
    apart[layout.n_dynamic + paths.index(f"{HELD}.reference.y")] = -1.0
    assert apart @ problem.mean == pytest.approx(0.0, abs=1e-12)
    assert math.sqrt(apart @ problem.covariance @ apart) < 2e-5
    assert p.magnet[0, L.HOLDING_Y] > 0.0


def test_the_cross_check_has_the_magnet_as_described_and_no_gate_there(evidence):
    (problem,) = Drops(evidence=(evidence,), calibrate_only=False).fine(evidence.machine)
    assert corrections_by_record(problem).reach[0] == 0.0
    assert corrections_by_record(problem).reach[1] > 0.0
    rotor = rotor_of(problem)
    free = SimpleNamespace(**vars(rotor))
    # without forces the held end stays, the other falls
    state = rotor.start.copy()
    m = problem.model.layout.n_modes
    at = problem.model.parameters.magnet_shape
    begun = at @ state[m : 2 * m]
    for _ in range(round(8e-3 / rotor.dt)):
        state = free.F @ state + free.gravity
    moved = at @ state[m : 2 * m] - begun
    assert abs(moved[0]) < 0.4 * abs(moved[1])
    assert moved[1] < -1.5e-4


def test_drops_that_do_not_go_together_are_refused(drop, lp400, synthetic):
    with pytest.raises(UsageError, match="drops are of one end"):
        estimate_drops(lp400, [drop.record, synthetic.record])
    with pytest.raises(RecordError, match="the replay knows no drop of one end"):
        estimate_drops(lp400, [drop.record], method=Replay())


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


def test_a_good_record_falls_with_gravity_and_a_common_gain_shows(hopping, machine):
    seen, found = in_flight(hopping[0], machine)
    assert found == []
    error = np.sqrt(np.diag(seen.covariance))
    assert np.all(error < 0.15)
    assert np.all(np.abs(seen.share - 1.0) < 3.0 * error)
    record, tail = hopping
    assert not [found for found in check_record(record, machine, tail) if found.severity != "note"]
    found = check_record(
        replace(record, signals=0.85 * record.signals), machine, replace(tail, signals=0.85 * tail.signals)
    )
    assert "wrong gain" in [one.kind for one in found if one.severity == "warning"]


@pytest.mark.parametrize("gain", [0.75, 0.85, 1.2, 1.4])
def test_a_common_gain_is_weighed(gain, hopping, machine):
    record = replace(hopping[0], signals=gain * hopping[0].signals)
    (found,) = in_flight(record, machine)[1]
    assert found.kind == "wrong gain"
    assert found.channel == ", ".join(record.channel_names)
    said, error = (float(found.message.split(before)[1].split()[0]) for before in ("reading ", "± "))
    assert abs(said - gain) < 2.0 * error < 0.4 * abs(gain - 1.0)


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


@pytest.mark.parametrize(
    ("share", "scatter", "said"),
    [
        ([0.8, 0.8, 0.8, 0.8], 1.0, ["warning"]),
        ([0.8, 0.8, 0.8, 0.8], 5.0, ["note"]),
        ([0.8, 0.78, 0.86, 0.74], 1.0, ["note"]),
        ([1.1, 0.6, 1.2, 1.0], 1.0, []),
        ([1.0, 0.8, 1.0, 1.0], 1.0, []),
    ],
)
def test_only_a_gain_of_all_channels_outweighs_what_a_touch_left(share, scatter, said, hopping):
    """A touch looks like a gain of one channel, not of all; flights that contradict each other only ask."""
    seen = Weighed(share=np.array(share), covariance=0.02**2 * np.eye(4), flights=2, scatter=scatter)
    found = check_flights(seen, hopping[0])
    assert [one.severity for one in found] == said
    assert {one.kind for one in found} <= {"wrong gain"}
    assert ["contradict each other" in one.message for one in found] == [one == "note" for one in said]
