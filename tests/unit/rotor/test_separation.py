"""Amplification factors and margins of API 617, and the response of machines to their unbalance."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

from rotordrop.cli.app import run
from rotordrop.errors import UsageError
from rotordrop.machine import example_machine, example_path
from rotordrop.rotor.campbell import (
    Crossing,
    Separation,
    amplification_factor,
    required_margin,
    response_peaks,
    separations,
)
from rotordrop.rotor.unbalanced import machine_response, orbit_axis, resolved_response, run_up_response


@pytest.mark.parametrize(
    ("factor", "below", "above"),
    [
        (2.4, 0.0, 0.0),
        (2.5, 0.0, 0.10),
        (3.5, 0.085, 0.185),
        (10.0, 0.15, 0.25),
        (18.5, 0.16, 0.26),
        (1e9, 0.16, 0.26),
    ],
)
def test_margins_are_those_of_the_convention(factor, below, above):
    """17 (1 - 1/(AF - 1.5)) % and at most 16 below, ten more above; at AF = 10 exactly 15 and 25."""
    assert required_margin(factor, above=False) == pytest.approx(below, abs=1e-9)
    assert required_margin(factor, above=True) == pytest.approx(above, abs=1e-9)


@pytest.mark.parametrize("ratio", [0.01, 0.03, 0.1])
def test_half_power_of_a_jeffcott_rotor_is_the_factor_of_its_damping(ratio):
    """Amplitude e r² / √((1 − r²)² + (2 ζ r)²): peak at 1/√(1 − 2ζ²), e/(2ζ√(1 − ζ²)) high."""
    r = np.linspace(0.2, 3.0, 20001)
    amplitude = 1e-5 * r**2 / np.sqrt((1.0 - r**2) ** 2 + (2.0 * ratio * r) ** 2)
    (peak,) = response_peaks(100.0 * r, amplitude)
    assert peak.speed == pytest.approx(100.0 / math.sqrt(1.0 - 2.0 * ratio**2), rel=1e-3)
    assert peak.amplitude == pytest.approx(1e-5 / (2.0 * ratio * math.sqrt(1.0 - ratio**2)), rel=1e-5)
    assert peak.factor == pytest.approx(amplification_factor(ratio), rel=5.0 * ratio**2 + 1e-3)


def crossing(speed, damping_ratio=0.02, direction="forward"):
    return Crossing(speed=speed, line=0, direction=direction, damping_ratio=damping_ratio)


def test_a_critical_speed_is_set_against_the_nearer_end_of_the_range():
    below, inside, above = crossing(80.0), crossing(110.0), crossing(180.0)
    damped, backward = crossing(99.0, 0.3), crossing(100.0, direction="backward")
    diagram = SimpleNamespace(crossings=(below, inside, damped, backward, above))
    found = separations(diagram, 100.0, 120.0).values()
    assert [one.margin for one in found] == pytest.approx([0.2, 0.0, 0.01, 0.5])
    assert [one.verdict for one in found] == ["met", "not met", "critically damped", "met"]


def test_an_orbit_axis_is_the_longest_reach_of_the_motion():
    angle = np.linspace(0.0, 2.0 * np.pi, 3601)
    for x, y in ((1.0, -1j), (1.0, 0.5), (0.3 + 0.1j, -0.7j), (1.0, 1j)):
        motion = np.stack([np.real(value * np.exp(1j * angle)) for value in (x, y)])
        reach = np.max(np.hypot(*motion))
        assert orbit_axis(np.array([x, y])) == pytest.approx(reach, rel=1e-5)


def test_far_above_its_rigid_modes_a_rotor_turns_about_its_mass():
    """Static unbalance, soft magnets: the displacement is U/m against the unbalance, everywhere alike."""
    machine = example_machine("paper")
    grade = sum(float(one.amount) for one in machine.unbalances)
    response = machine_response(machine, [2.0 * np.pi * 150.0], "AMBs")
    assert response.unbalance[0][1] > 0.0
    assert response.displacement.shape == (1, len(machine.rotor.node_positions), 2)
    least, most = (edge(response.major_axis(n)[0] for _, n in response.places) for edge in (min, max))
    assert 0.05 * grade / machine.rotor.mass < least <= most < 20.0 * grade / machine.rotor.mass


def test_the_response_is_linear_in_the_unbalance():
    machine = example_machine("small")
    speeds = [300.0, 900.0]
    one = machine_response(machine, speeds, "AMBs").displacement
    more = {f"unbalance.{k}.amount": 3.0 * float(u.amount) for k, u in enumerate(machine.unbalances)}
    np.testing.assert_allclose(
        machine_response(machine.with_values(more), speeds, "AMBs").displacement, 3.0 * one, rtol=1e-9
    )


def test_a_peak_between_the_samples_is_not_put_on_one_of_them():
    """On a grid of 2 % around a peak of half-power width 6 %: within a twentieth of a step of the formula."""
    ratio, step = 0.03, 0.02
    r = np.arange(0.2, 3.0, step)
    (peak,) = response_peaks(100.0 * r, r**2 / np.sqrt((1.0 - r**2) ** 2 + (2.0 * ratio * r) ** 2))
    assert peak.speed == pytest.approx(100.0 / math.sqrt(1.0 - 2.0 * ratio**2), abs=100.0 * step / 20.0)


def test_one_mode_seen_in_many_planes_is_one_sentence(capsys):
    assert run(["critical-speeds", "--unbalance", str(example_path("lp400"))]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert said.count("API 617 asks for") == 1
    planes = said.split("problem: ")[1].split(": the peak of ")[0]
    assert set(planes.lower().split(", ")) == {
        "sensors nde",
        "sensors de",
        "touchdown bearing nde",
        "touchdown bearing de",
    }
    assert "at 550.0 Hz" not in said
    assert "the peak of sensors DE, the nearest of them, at 549.9 Hz" in said


def test_a_machine_without_unbalance_says_so():
    machine = example_machine("small").completed_with({"unbalances": ()})
    with pytest.raises(UsageError, match="has no unbalance; add"):
        machine_response(machine, [100.0], "AMBs")


def test_the_command_shows_peaks_margins_and_figures(tmp_path, capsys):
    report, data = tmp_path / "page.html", tmp_path / "data"
    arguments = [
        "critical-speeds",
        "--unbalance",
        str(example_path("lp400")),
        "--report",
        str(report),
        "--data",
        str(data),
    ]
    assert run(arguments) == 0
    text = capsys.readouterr().out
    assert "API 617 asks for" in text
    assert "(33000 rpm)" in text
    assert {"figure_bode.csv", "figure_polar.csv", "figure_deflected_shapes.csv"} <= {
        f.name for f in data.iterdir()
    }
    assert "Bode and polar plots" in report.read_text(encoding="utf-8")


def test_the_command_shows_a_run_up(tmp_path, capsys):
    data, document = tmp_path / "data", tmp_path / "rise.json"
    arguments = [
        "critical-speeds",
        "--unbalance",
        str(example_path("small")),
        "--top-speed",
        "120 Hz",
        "--run-up",
        "0.5 s",
    ]
    assert run([*arguments, "--data", str(data), "--json", str(document)]) == 0
    text = capsys.readouterr().out
    assert "in a run-up of 500.0 ms at most" in text and "steady" in text
    assert (data / "figure_run_up.csv").is_file()
    rise = json.loads(document.read_text())["run_up"]
    assert rise["duration_s"] == 0.5
    assert rise["speed_Hz"][-1] == pytest.approx(120.0)
    steady = json.loads(document.read_text())["planes"][0]["major_axis_m"]
    assert (
        0.9 * max(steady) < max(rise["planes"][0]["major_axis_m"]) < 1.1 * max(steady)
    )  # no sharp peak here
    assert run([*arguments[:-1], "2 h"]) == 64
    assert "the response to so slow a rise is the steady one" in capsys.readouterr().err
    with pytest.raises(UsageError, match=r"a run-up from 9 to 5 rad/s in 1 s is none; expected a rise"):
        run_up_response(example_machine("small"), 5.0, 1.0, "AMBs", start=9.0)


def test_a_free_rotor_has_no_response(capsys):
    assert run(["critical-speeds", "--unbalance", str(example_path("small")), "--held", "free-free"]) == 64
    assert "nothing holds a free rotor" in capsys.readouterr().err


def test_a_sharp_peak_has_the_height_and_width_of_a_grid_thirty_times_finer():
    machine = example_machine("lp400")
    top = 2.0 * np.pi * 825.0
    found = resolved_response(machine, top, "touchdown bearings")
    node = found.places[0][1]
    peak = response_peaks(found.speed, found.major_axis(node))[0]
    near = np.linspace(peak.speed - 60.0, peak.speed + 60.0, 4001)
    fine = machine_response(machine, near, "touchdown bearings")
    known = max(response_peaks(near, fine.major_axis(node)), key=lambda one: one.amplitude)
    assert known.factor > 100.0
    assert peak.amplitude == pytest.approx(known.amplitude, rel=5e-3)
    assert peak.factor == pytest.approx(known.factor, rel=1e-2)
    speeds = [one.speed for one in response_peaks(found.speed, found.major_axis(node))]
    assert np.min(np.diff(speeds)) > 2.0 * np.pi


def test_a_peak_without_a_factor_is_not_called_met():
    def judged(factor, speed):
        one = Separation.of(speed, factor, 100.0, 100.0)
        return one.asked, one.verdict

    assert judged(math.nan, 101.0) == ("–", "factor not known")
    assert judged(2.0, 101.0) == ("none", "critically damped")
    assert judged(10.0, 90.0) == ("15.0 %", "not met")
