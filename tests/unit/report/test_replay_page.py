"""The report on a replayed drop shows what the replay found, step by step."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.unit.report.conftest import section

from rotordrop.elements.table import parameter
from rotordrop.estimate.agreement import compare_orbits
from rotordrop.estimate.bearing_drop import Origin, Peak, simulated_bearings
from rotordrop.estimate.estimate import Estimate, FittedParameter, FrictionSweep, ReplaySteps, Verdict
from rotordrop.estimate.methods import Replay
from rotordrop.evidence.contacts import TimedContact
from rotordrop.known import Correlation, Known
from rotordrop.machine import example_machine
from rotordrop.report.estimate_page import (
    contact_time_table,
    correlation_table,
    estimate_page,
    first_contact_table,
    friction_sweep_figure,
    window_table,
)
from rotordrop.report.page import render_page
from rotordrop.report.quantity import Quantity

GAPS = np.array([275e-6, 285e-6])
CONTACT = TimedContact(
    start=0.0075,
    end=0.0095,
    timing_error=2e-5,
    impact_speed=0.07,
    mass=17.8,
    equivalent_stiffness=4.39e7,
    corrected_stiffness=3.1e7,
    standard_error=2e6,
    indentation=15.2e-6,
)
SWEEP = FrictionSweep(
    coefficients=np.array([0.05, 0.1, 0.15]),
    disagreement=np.array([9e-6, 3e-6, 7e-6]),
    best=np.array([0.11, 0.112]),
    value=Known(value=0.11, status="determined", interval_90=(0.107, 0.114), standard_error=0.002, unit="1"),
    window=(0.0075, 0.0405),
)


STIFFNESS = Known(value=7.8e7, status="determined", interval_90=(7.7e7, 7.9e7), start=1e8, unit="N/m")


def as_replayed(bearing, gap):
    """A simulated bearing with a measured motion 3 micrometres off and the drop at both limits of the gap."""
    (simulated,) = bearing.motions

    def moved(label, by, **told):
        return replace(simulated, label=label, displacement=simulated.displacement + by, **told)

    def peak(value, interval):
        known = Known(value=value, status="determined", interval_90=interval, unit="N")
        return Peak(known=known, time=0.009, origin=Origin.REPLAY)

    measured = moved("measured", 3e-6, role="measured")
    limits = (moved("simulated, lower gap", 5e-6), moved("simulated, upper gap", -5e-6))
    air_gap = Known(value=gap, status="determined", lower=gap - 5e-6, upper=gap, unit="m")
    return replace(
        bearing,
        motions=(measured, simulated),
        at_gap_limits=(measured, *limits),
        peak_force=peak(3333.0, (3000.0, 3700.0)),
        peak_stress=peak(1.8e9, None),
        values={"air_gap_m": air_gap, "support.stiffness_N_per_m": STIFFNESS},
        missing={"peak_stress_Pa": "no interval: 2 draws, at least 64 are needed"},
    )


@pytest.fixture
def agreement(drop_result):
    measured = drop_result.displacement + 3e-6
    made, names = drop_result.displacement, drop_result.bearing_names
    return compare_orbits(drop_result.time, measured, made, GAPS, names, expected_horizon=0.028)


@pytest.fixture
def drop(drop_result, agreement):
    machine = example_machine("lp400")
    record = SimpleNamespace(
        name="drop_060",
        path=None,
        sha256="",
        event_date="",
        sampling_rate=20e3,
        sensors=machine.sensors,
        speed=drop_result.speed,
        time=drop_result.time + 0.001,
        measured_speed=(drop_result.time, drop_result.speed),
    )
    slowing = Known(value=7.5, status="determined", interval_90=(7.0, 8.0), unit="s")
    speed = SimpleNamespace(initial=2 * np.pi * 60.0, profile_time_constant=5.9, aero_time_constant=slowing)
    steps = ReplaySteps(
        speed=speed,
        contacts=(CONTACT, CONTACT),
        friction=SWEEP,
        correlations=(Correlation(first="NDE.support.stiffness", second="NDE.support.mass", value=0.99),),
        speed_time=drop_result.time,
        speed_simulated=drop_result.speed,
        fixed="",
        draws=None,
        rejected=None,
        identified=machine,
        document={},
    )
    bearings = zip(simulated_bearings(drop_result), GAPS, strict=True)
    prior = Known(value=1e8, status="determined", unit="N/m")
    row = parameter("support.stiffness")
    return Estimate(
        name="drop_060",
        method=Replay(),
        machine=machine,
        record=record,
        drop_instant=SimpleNamespace(value=0.001, interval_90=(0.0009, 0.0011)),
        speed=2 * np.pi * 60.0,
        until=0.2,
        verdict=Verdict.OPEN_LOOP,
        bearings=tuple(as_replayed(bearing, float(gap)) for bearing, gap in bearings),
        parameters=(FittedParameter(row=row, owner="NDE", prior=prior, estimate=STIFFNESS),),
        agreement=agreement,
        replay=steps,
        warnings=("no standstill in the record",),
    )


def test_headline_route_warnings_and_horizon(drop):
    content = estimate_page(drop)
    force, stress = content.cards[0].figures[:2]
    assert force.value.interval_90 == (3000.0, 3700.0)
    assert " ms" not in force.note  # of a time that a replay finds no error is known
    assert stress.value.interval_90 is None
    assert stress.note == "no interval: 2 draws, at least 64 are needed"
    assert "open-loop replay" in content.verdict[0].text
    assert ("no standstill in the record", "warning") in [(one.text, one.level) for one in content.verdict]
    assert "28 ms are to be expected" in section(content, "Motion at the sensors").text[1]
    drawn = section(content, "Motion at the sensors").figures[1].chart
    names = ["simulated, lower gap", "simulated, upper gap", "measured"]  # the measured one on top
    assert [item.name for item in drawn.data if item.xaxis == "x2"] == names
    lower = next(item for item in drawn.data if item.name == names[0] and item.xaxis == "x2")
    radius = 1e6 * drop.bearings[1].at_gap_limits[1].radial.values
    assert (max(lower.y), lower.y[0], lower.y[-1]) == pytest.approx(
        (radius.max(), radius[0], radius[-1]), rel=1e-6
    )
    html = render_page(content)
    for figure in ("Figs 7, 8 and 13", "Fig. 10", "Fig. 12", "Fig. 14", "Fig. 15", "Fig. 16"):
        assert figure in html


def test_agreement_states_the_distances_of_the_windows(agreement):
    rows = {row[0]: row[1:] for row in window_table(agreement).rows}
    assert "first bounce, measured" in rows
    for window in agreement.windows:
        cells = rows[f"distance of the orbits, {window.name}"]
        assert_allclose([cell.value for cell in cells if isinstance(cell, Quantity)], [*window.rms.values()])
        assert_allclose([*window.rms.values()], 3e-6 * np.sqrt(2.0), rtol=1e-9)


def test_contact_times_stand_side_by_side_and_missing_ones_are_dashes(agreement):
    bearing = agreement.bearings["NDE"]
    fewer = bearing.model_copy(update={"simulated_contacts_s": []})
    both = {"NDE": fewer, "DE": fewer}
    first = contact_time_table(agreement.model_copy(update={"bearings": both})).rows[0]
    assert [cell.text for cell in first[1:] if isinstance(cell, Quantity)][2:] == ["–", "–"]
    assert first[1].value == bearing.measured_contacts_s[0][0]


def test_a_bounce_has_its_height_above_the_rest():
    time = np.linspace(0.0, 0.1, 2001)
    place = np.zeros((len(time), 1, 2))
    place[:, 0, 1] = -np.abs(290e-6 * np.sin(2.0 * np.pi * 20.0 * time))  # down, up to the centre, down
    found = compare_orbits(time, place, place, GAPS[:1], ("NDE",)).bearings["NDE"]
    assert found.measured_bounce_m == pytest.approx(GAPS[0], abs=1e-6)
    assert found.simulated_bounce_m == found.measured_bounce_m


def test_table_3_has_the_paper_s_value_and_the_corrected_one():
    table = first_contact_table(("NDE",), (CONTACT,))
    assert table.note.startswith("Standard error of t₁ and t₂: ")
    texts = [cell.text if isinstance(cell, Quantity) else cell for cell in table.rows[0]]
    assert texts[:5] == ["NDE", "7.500 ms", "9.500 ms", "2.00 ms", "15.2 µm"]
    assert texts[5:] == ["17.80 kg", "43.9 N/µm", "31.0 N/µm"]


def test_confounded_parameters_are_called_so():
    table = correlation_table(
        (Correlation(first="a", second="b", value=-0.35), Correlation(first="K", second="M", value=0.99))
    )
    assert [(row[0], row[2]) for row in table.rows] == [
        ("K and M", "confounded: only their combination is known"),
        ("a and b", "told apart"),
    ]


def test_supports_of_an_earlier_estimate_are_named_with_their_file(drop):
    steps = replace(drop.replay, fixed="drop_060.json", friction=None, correlations=())
    content = estimate_page(replace(drop, replay=steps))
    assert "taken from drop_060.json" in section(content, "Parameters").text[0]
    drawn = [len(section(page, "Parameters").figures) for page in (content, estimate_page(drop))]
    assert drawn == [1, 2]  # without the friction sweep, and with it
    assert ("method", "replay with the supports of drop_060.json") in section(content, "Record").facts


def test_the_friction_sweep_marks_best_and_interval():
    chart = friction_sweep_figure(SWEEP)
    assert_allclose(chart.data[0].y, (9.0, 3.0, 7.0), rtol=1e-6)
    shapes = {shape.name: (shape.x0, shape.x1) for shape in chart.layout.shapes}
    assert shapes["best"] == (0.11, 0.11)
    assert shapes["90 % interval"] == (0.107, 0.114)


def test_values_of_an_earlier_estimate_are_called_so(drop):
    taken = Known(value=2e7, status="taken over", unit="N/m")
    undetermined = replace(taken, status="the record does not determine it")
    values = {"support.stiffness_N_per_m": taken, "equivalent_stiffness_N_per_m": undetermined}
    bearing = replace(drop.bearings[1], values=values)
    steps = replace(drop.replay, fixed="a/drop_1.json")
    told = replace(drop, bearings=(drop.bearings[0], bearing), parameters=(), replay=steps)
    verdicts = {row[0]: row[-1] for row in section(estimate_page(told), "Parameters").tables[0].rows}
    assert verdicts["support stiffness"] == "DE: taken over from drop_1.json"
    assert verdicts["equivalent stiffness, bearing and support"] == "the record does not determine it"
