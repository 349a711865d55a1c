"""The report on a replayed drop shows what the replay found, step by step."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rotordrop.estimated import IdentifiedValue
from rotordrop.estimation.agreement import compare_orbits
from rotordrop.estimation.replayed import ReplayDrop, Replayed
from rotordrop.identification.first_contact import FirstContact
from rotordrop.identification.friction import FrictionSweep
from rotordrop.machine import example_machine
from rotordrop.report.agreement_tables import contact_time_table, window_table
from rotordrop.report.estimate_numbers import identified_table
from rotordrop.report.friction_sweep import friction_sweep_figure
from rotordrop.report.page import render_page
from rotordrop.report.quantity import Quantity
from rotordrop.report.replay_page import replay_page
from rotordrop.report.replay_sections import gap_limit_motions, support_section
from rotordrop.report.replay_tables import correlation_table, first_contact_table
from rotordrop.simulation.result import DropResult

GAPS = np.array([275e-6, 285e-6])
CONTACT = FirstContact(
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
    value=IdentifiedValue(value=0.11, interval_90=(0.107, 0.114), standard_error=0.002, unit="1"),
    window=(0.0075, 0.0405),
)


def shifted(result: DropResult, by: float) -> Replayed:
    return Replayed(
        time=result.time,
        displacement=result.displacement + by,
        force=result.bearing_force_magnitude,
        stress=result.max_stress,
    )


@pytest.fixture
def drop(drop_result: DropResult) -> ReplayDrop:
    machine = example_machine("lp400")
    values = {
        name: {
            "air_gap_m": IdentifiedValue(value=float(gap), lower=float(gap) - 5e-6, upper=float(gap)),
            "support.stiffness_N_per_m": IdentifiedValue(
                value=7.8e7, interval_90=(7.7e7, 7.9e7), start=1e8, unit="N/m"
            ),
            "peak_force_N": IdentifiedValue(value=3333.0, interval_90=(3000.0, 3700.0), unit="N"),
            "peak_stress_Pa": IdentifiedValue(value=1.8e9, status="prior", unit="Pa"),
        }
        for name, gap in zip(("NDE", "DE"), GAPS, strict=True)
    }
    measured = drop_result.displacement + 3e-6
    known = {
        "machine": machine,
        "identified": machine,
        "record": SimpleNamespace(
            name="drop_060",
            path=None,
            sha256="",
            sampling_rate=20e3,
            sensors=machine.sensors,
            metadata={},
            notes=(),
            speed=drop_result.speed,
            time=drop_result.time + 0.001,
        ),
        "drop_instant": SimpleNamespace(value=0.001, interval_90=(0.0009, 0.0011)),
        "gap": SimpleNamespace(value=GAPS, lower=GAPS - 5e-6, upper=GAPS),
        "speed": SimpleNamespace(
            initial=2 * np.pi * 60.0,
            profile_time_constant=5.9,
            aero_time_constant=IdentifiedValue(value=7.5, interval_90=(7.0, 8.0), unit="s"),
            note="",
        ),
        "initial": None,
        "expanded": None,
        "support": SimpleNamespace(
            values={"NDE.support.stiffness": values["NDE"]["support.stiffness_N_per_m"]},
            correlations={"NDE.support.stiffness ~ NDE.support.mass": 0.99},
        ),
        "draws": None,
    }
    return ReplayDrop(
        contacts=(CONTACT, CONTACT),
        friction=SWEEP,
        simulated=drop_result,
        middle=shifted(drop_result, 0.0),
        lower=shifted(drop_result, 5e-6),
        upper=shifted(drop_result, -5e-6),
        measured_time=drop_result.time,
        measured=measured,
        agreement=compare_orbits(
            drop_result.time, measured, drop_result.displacement, GAPS, expected_horizon=0.028
        ),
        values=values,
        peak_times={"NDE": 0.009, "DE": 0.009},
        fixed="",
        warnings=("no standstill in the record",),
        **cast(Any, known),
    )


def test_headline_intervals_and_why_there_is_none(drop: ReplayDrop) -> None:
    card = replay_page(drop, drop.machine).cards[0]
    force, stress = card.figures[0], card.figures[1]
    assert force.value.interval_90 == (3000.0, 3700.0)
    assert "at 9.00 ms" in force.note
    assert stress.value.interval_90 is None
    assert stress.note == "no interval: prior"


def test_the_route_warnings_and_horizon_are_named(drop: ReplayDrop) -> None:
    content = replay_page(drop, drop.machine)
    assert "open-loop replay" in content.verdict[0].text
    assert any(s.level == "warning" and s.text == "no standstill in the record" for s in content.verdict)
    agreement = next(
        section for section in content.sections if section.heading == "Agreement with the record"
    )
    assert "28 ms are to be expected" in agreement.text[0]


def test_agreement_states_the_distances_of_the_windows(drop: ReplayDrop) -> None:
    table = window_table(drop.agreement, ("NDE", "DE"))
    rows = {str(row[0]): row[1:] for row in table.rows}
    for window in drop.agreement.windows:
        cells = rows[f"distance of the orbits, {window.name}"]
        assert_allclose([cell.value for cell in cells if isinstance(cell, Quantity)], window.rms)
        assert_allclose(window.rms, 3e-6 * np.sqrt(2.0), rtol=1e-9)


def test_contact_times_stand_side_by_side_and_missing_ones_are_dashes(drop: ReplayDrop) -> None:
    bearing = drop.agreement.bearings[0]
    fewer = replace(bearing, simulated_contacts=bearing.simulated_contacts[:0])
    table = contact_time_table(replace(drop.agreement, bearings=(fewer, fewer)), ("NDE", "DE"))
    first = [cell.text for cell in table.rows[0][1:] if isinstance(cell, Quantity)]
    assert first[2:] == ["–", "–"]
    assert table.rows[0][1].value == bearing.measured_contacts[0, 0]  # type: ignore[union-attr]


def test_both_limits_of_the_gap_are_drawn_beside_the_measurement(drop: ReplayDrop) -> None:
    motions = gap_limit_motions(drop)[1].motions
    assert [motion.label for motion in motions] == [
        "measured",
        "simulated, lower gap",
        "simulated, upper gap",
    ]
    assert_allclose(motions[1].displacement, drop.lower.displacement[:, 1])
    assert_allclose(motions[2].displacement, drop.upper.displacement[:, 1])


def test_table_3_has_the_paper_s_value_and_the_corrected_one() -> None:
    table = first_contact_table({"NDE": CONTACT})
    assert table.note.startswith("Standard error of t₁ and t₂: ")
    row = table.rows[0]
    texts = [cell.text if isinstance(cell, Quantity) else cell for cell in row]
    assert texts == [
        "NDE",
        "7.500 ms",
        "9.500 ms",
        "2.00 ms",
        "15.2 µm",
        "17.80 kg",
        "43.9 N/µm",
        "31.0 N/µm",
    ]


def test_confounded_parameters_are_called_so() -> None:
    table = correlation_table({"a ~ b": -0.35, "K ~ M": 0.99})
    assert [(row[0], row[2]) for row in table.rows] == [
        ("K ~ M", "confounded: only their combination is known"),
        ("a ~ b", "told apart"),
    ]


def test_supports_of_an_earlier_estimate_are_named_with_their_file(drop: ReplayDrop) -> None:
    section = support_section(replace(drop, support=None, fixed="drop_060.json"))
    assert "taken from drop_060.json" in section.statements[0].text
    content = replay_page(replace(drop, support=None, friction=None, fixed="drop_060.json"), drop.machine)
    assert "Friction" not in [part.heading for part in content.sections]
    assert ("method", "replay with the supports of drop_060.json") in content.facts


def test_the_friction_sweep_marks_best_and_interval() -> None:
    chart = friction_sweep_figure(SWEEP)
    assert_allclose(chart.data[0].y, (9.0, 3.0, 7.0), rtol=1e-6)
    shapes = {shape.name: (shape.x0, shape.x1) for shape in chart.layout.shapes}
    assert shapes["best"] == (0.11, 0.11)
    assert shapes["90 % interval"] == (0.107, 0.114)


def test_the_page_is_complete(drop: ReplayDrop) -> None:
    html = render_page(replay_page(drop, drop.machine))
    for figure in ("Figs 7 and 8", "Fig. 10", "Fig. 12", "Fig. 13", "Fig. 14", "Fig. 15", "Fig. 16"):
        assert figure in html
    assert len(html.encode()) < 6_000_000


def test_values_of_an_earlier_estimate_are_not_called_a_prior() -> None:
    prior = IdentifiedValue(value=2e7, status="prior", unit="N/m")
    values = {"support.stiffness_N_per_m": prior, "equivalent_stiffness_N_per_m": prior}
    verdicts = {row[0]: row[2] for row in identified_table({"DE": values}, taken_over="a/drop_1.json").rows}
    assert verdicts["support stiffness"] == "taken over from drop_1.json"
    assert verdicts["equivalent stiffness, bearing and support"] == "prior"
