"""What a machine amounts to, against the published numbers of the paper's rotor and by statics."""

from __future__ import annotations

import math

import pytest

from rotordrop.machine import Machine, example_machine
from rotordrop.rotor.machine_summary import (
    MachineSummary,
    MachineWarning,
    machine_warnings,
    summarise_machine,
)


@pytest.fixture(scope="module")
def machine() -> Machine:
    return example_machine("paper")


@pytest.fixture(scope="module")
def summary(machine) -> MachineSummary:
    return summarise_machine(machine)


def test_the_reference_rotor_has_its_published_numbers(summary):
    """Mass, polar inertia, map and free-free modes as published for the reference machine."""
    assert summary.fe.total_mass == pytest.approx(59.49996, rel=1e-6)
    assert summary.fe.polar_inertia == pytest.approx(0.0875213, rel=1e-6)
    assert summary.free_free[:3] == pytest.approx([187.305, 482.965, 876.980], rel=1e-5)
    assert summary.settled[:2] == pytest.approx([134.0, 235.0], rel=1e-3)


def test_the_reference_bearings_have_their_published_numbers(summary):
    nde, de = summary.bearings
    assert (nde.load, de.load) == pytest.approx((174.6, 409.1), rel=3e-4)
    stated = {figure.field: figure.value for figure in nde.figures}
    assert stated["preload_stress_Pa"] == pytest.approx(993.3556e6, rel=1e-6)
    assert (nde.tangent_stiffness, de.tangent_stiffness) == pytest.approx((509.925e6, 507.524e6), rel=1e-5)


def test_the_loads_carry_the_weight_and_balance_about_the_centre_of_gravity(machine, summary):
    z = [machine.rotor.node_positions[bearing.node - 1] for bearing in machine.touchdown_bearings]
    loads = [rest.load for rest in summary.bearings]
    assert sum(loads) == pytest.approx(summary.fe.total_mass * 9.81, rel=1e-12)
    moment = sum(load * (place - summary.fe.centre_of_gravity) for load, place in zip(loads, z, strict=True))
    assert moment == pytest.approx(0.0, abs=1e-6)


def test_bearing_and_support_in_series_are_softer_than_either(machine, summary):
    for bearing, rest in zip(machine.touchdown_bearings, summary.bearings, strict=True):
        assert 1 / rest.equivalent_stiffness == pytest.approx(
            1 / rest.tangent_stiffness + 1 / float(bearing.support.stiffness), rel=1e-12
        )


def test_a_machine_without_ambs_has_no_levitated_sag(machine, summary):
    assert summary.levitated_sag is not None
    assert summarise_machine(machine.model_copy(update={"ambs": ()})).levitated_sag is None


def warnings_of(machine: Machine, kind: str, speed_Hz: float) -> list[MachineWarning]:
    found = machine_warnings(machine, summarise_machine(machine), 2 * math.pi * speed_Hz)
    return [warning for warning in found if warning.kind == kind]


@pytest.mark.parametrize(("speed_Hz", "force"), [(60.0, 1.8), (210.0, 22.0), (550.0, 149.0)])
def test_ball_centrifugal_force_is_compared_with_preload(machine, speed_Hz, force):
    """1.8 / 22 / 149 N per ball against 53 N preload ball load: small, then near half, then dominant."""
    found = warnings_of(machine, "ball centrifugal force", speed_Hz)
    assert bool(found) == (force > 0.1 * 53.3)
    for warning in found:
        assert warning.value == pytest.approx(force, rel=0.03)
        assert warning.limit == pytest.approx(53.2925, rel=1e-4)
        assert f"at {speed_Hz:.0f} Hz ({60 * speed_Hz:.0f} rpm) of the race" in warning.message
        assert "not small against its preload of 53.3 N" in warning.message


def test_a_bearing_beyond_its_limiting_speed_is_named_with_both_speeds(machine):
    bearing = machine.touchdown_bearings[1]
    limit = bearing.bearing.preload.__class__(value=2 * math.pi * 200, unit="rad/s")
    limited = bearing.model_copy(
        update={"bearing": bearing.bearing.model_copy(update={"limiting_speed": limit})}
    )
    slow = machine.model_copy(update={"touchdown_bearings": (machine.touchdown_bearings[0], limited)})
    assert warnings_of(slow, "limiting speed", 199.0) == []
    (warning,) = warnings_of(slow, "limiting speed", 210.0)
    assert warning.bearing == "DE"
    assert "the rotor's 210 Hz (12600 rpm) turns faster than the 200 Hz (12000 rpm)" in warning.message


def test_a_support_near_a_rotor_mode_is_named_with_both_frequencies(machine):
    """A 40 kg support on 1e8 N/m resonates at 252 Hz and splits the 235 Hz mode."""
    (nde,) = [w for w in warnings_of(machine, "support resonance", 60.0) if w.bearing == "NDE"]
    assert (nde.value, nde.limit) == pytest.approx((251.6, 235.0), rel=1e-3)
    assert "resonates at 252 Hz, near the rotor's mode at 235 Hz" in nde.message
    light = machine.with_values({"NDE.support.mass": 4.0, "DE.support.mass": 4.0})
    assert warnings_of(light, "support resonance", 60.0) == []


def test_frictional_heat_matters_at_nominal_speed_and_not_in_the_papers_tests(machine):
    assert warnings_of(machine, "frictional heat", 60.0) == []
    found = warnings_of(machine, "frictional heat", 550.0)
    assert [warning.bearing for warning in found] == ["NDE", "DE"]
    assert all(warning.value > 0.1 * warning.limit for warning in found)
    assert "a table 'thermal' puts its heat into the drop model" in found[0].message


def test_no_friction_no_heat_warning(machine):
    slippery = machine.with_values({"NDE.friction.dynamic": 0.0, "DE.friction.dynamic": 0.0})
    assert warnings_of(slippery, "frictional heat", 550.0) == []


def test_a_rotor_that_lifts_out_of_a_bearing_is_named(machine):
    de = machine.touchdown_bearings[1].model_copy(update={"node": 10})
    tipped = machine.model_copy(update={"touchdown_bearings": (machine.touchdown_bearings[0], de)})
    (warning,) = warnings_of(tipped, "load direction", 60.0)
    assert warning.bearing == "NDE"
    assert warning.value < 0.0
    assert "would lift out of this bearing (-" in warning.message


def test_the_nominal_speed_is_the_default(machine, summary):
    nominal = machine_warnings(machine, summary)
    assert nominal == machine_warnings(machine, summary, float(machine.speed.nominal))


def test_a_guess_aside_of_the_middle_of_its_range_is_mentioned():
    """The estimators take the range as it stands, not one about the guess."""
    found = warnings_of(example_machine("lp400"), "guess", 60.0)
    assert [warning.bearing for warning in found] == ["NDE", "DE"]
    assert found[0].message == (
        "NDE: air gap: the guess 250 µm is not the middle of its range, 200 µm to 350 µm; an estimate takes "
        "the range for the 90 % interval about 275 µm, and the guess for where to begin"
    )
