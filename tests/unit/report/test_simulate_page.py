"""The report on a simulated drop says what was simulated, how well, and all its numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.estimate.bearing_drop import simulated_bearings, simulated_gap
from rotordrop.machine import example_machine
from rotordrop.report.content import ReportContent
from rotordrop.report.machine_sections import defaults_section, machine_sections, spoken_key, weight_shares
from rotordrop.report.page import render_page
from rotordrop.report.simulate_page import simulate_page
from rotordrop.simulate.result import DropResult


def headline(content: ReportContent, bearing: int, label: str) -> float:
    return next(figure.value.value for figure in content.cards[bearing].figures if figure.label == label)


def test_the_headline_numbers_are_those_of_the_result(drop_result: DropResult) -> None:
    content = simulate_page(drop_result)
    force = drop_result.bearing_force_magnitude
    for index in range(2):
        assert headline(content, index, "Peak bearing force") == pytest.approx(
            force[:, index].max(), rel=1e-4
        )
        assert headline(content, index, "Peak Hertz stress") == pytest.approx(
            drop_result.max_stress[:, index].max(), rel=1e-4
        )
        late = drop_result.time >= 0.15
        mean = headline(content, index, "Mean force, 150 to 200 ms")
        assert mean == pytest.approx(force[late, index].mean(), rel=1e-9)
    assert headline(content, 1, "Contacts") == 2
    assert headline(content, 1, "Energy lost in contact") == pytest.approx(7.8)


def test_the_page_says_that_nothing_was_measured_and_that_there_is_no_interval(
    drop_result: DropResult,
) -> None:
    content = simulate_page(drop_result)
    assert "nothing was measured" in content.simulated
    assert any("no interval" in statement.text for statement in content.verdict)
    assert "60.00 Hz (3\u202f600 rpm)" in content.subtitle


def test_a_drop_that_was_not_finished_is_a_problem(drop_result: DropResult) -> None:
    stopped = replace(drop_result, finished=False, outcome="The simulation stopped at 0.1 s.")
    first = simulate_page(stopped).verdict[0]
    assert (first.level, first.text) == ("bad", "The simulation stopped at 0.1 s.")


@pytest.mark.parametrize(("change", "level"), [(1e-3, "good"), (0.02, "warning")])
def test_a_numerical_error_above_half_a_percent_is_a_warning(
    drop_result: DropResult, change: float, level: str
) -> None:
    certificate = replace(drop_result.certificate, peak_change_tolerance=np.array([1e-5, change]))
    statement = simulate_page(replace(drop_result, certificate=certificate)).verdict[1]
    assert statement.level == level
    assert "ten times tighter tolerance" in statement.text


def test_the_peak_stress_stands_beside_the_static_limit(drop_result: DropResult) -> None:
    texts = [statement.text for statement in simulate_page(drop_result).verdict]
    share = 100 * drop_result.max_stress[:, 0].max() / 4.2e9
    assert any(f"{share:.0f} % of the 4\u202f200 MPa" in text and text.startswith("NDE") for text in texts)


def test_the_gap_and_the_first_contacts_come_from_the_result(drop_result: DropResult) -> None:
    assert [simulated_gap(drop_result, index) for index in range(2)] == pytest.approx([275e-6, 285e-6])
    nde, de = (bearing.first_contact for bearing in simulated_bearings(drop_result))
    assert nde is not None and de is not None
    assert (de.start, de.end) == (0.0077, 0.0101)
    inside = (drop_result.time >= 0.0076) & (drop_result.time <= 0.0085)
    radius = np.hypot(*drop_result.displacement[inside, 0].T)
    assert nde.indentation == pytest.approx(radius.max() - 275e-6)


def test_a_page_with_the_machine_shows_weight_friction_and_defaults(drop_result: DropResult) -> None:
    machine = example_machine("paper")
    content = simulate_page(drop_result, machine)
    headings = [section.heading for section in content.sections]
    for heading in (
        "Displacement",
        "First contact",
        "Orbit",
        "Bearing force",
        "Hertz stress",
        "Impacts",
        "Speed",
        "Friction law",
        "Values that were not given",
    ):
        assert heading in headings
    (section,) = defaults_section(machine)
    listed = {row[0] for table in section.tables for row in table.rows}
    assert listed == {spoken_key(entry[0]) for entry in (*machine.defaults_in_use, *machine.inferred)}
    shares = weight_shares(machine)
    assert shares["NDE"] == pytest.approx(174.6, abs=0.1)
    assert shares["DE"] == pytest.approx(409.1, abs=0.1)


def test_equal_friction_laws_share_a_curve() -> None:
    machine = example_machine("paper")
    assert len(machine_sections(machine)[0].figures[0].chart.data) == 2
    changed = machine.with_values({"NDE.friction.dynamic": 0.05})
    assert len(machine_sections(changed)[0].figures[0].chart.data) == 4


def test_a_name_in_the_machine_file_stays_text(drop_result: DropResult) -> None:
    evil = replace(drop_result, machine_name="<script>alert(1)</script>", bearing_names=("<b>NDE</b>", "DE"))
    html = render_page(simulate_page(evil))
    assert "<script>alert" not in html
    assert "<b>NDE" not in html
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in html


def test_a_speed_that_no_rotor_withstands_and_a_negative_one_are_told(drop_result: DropResult) -> None:
    machine = example_machine("lp400")
    quiet = " ".join(one.text for one in simulate_page(drop_result, machine).verdict)
    assert "no rotor withstands" not in quiet
    assert "clockwise" not in quiet
    turned = replace(drop_result, initial_speed=-2.0 * np.pi * 6000.0)
    said = {one.level: one.text for one in simulate_page(turned, machine).verdict}
    assert "a speed of −6000 Hz" in said["warning"].replace("-", "−")
    assert "no rotor withstands more than about 700 m/s" in said["warning"]
    assert any("clockwise seen from the DE" in one.text for one in simulate_page(turned, machine).verdict)
