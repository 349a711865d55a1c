"""The report on a simulated drop says what was simulated, how well, and all its numbers."""

from dataclasses import replace

import numpy as np
import pytest

from rotordrop.estimate.bearing_drop import simulated_bearings, simulated_gap
from rotordrop.machine import example_machine
from rotordrop.report.machine_content import not_given, spoken_key, weight_shares
from rotordrop.report.simulate_page import simulate_page


def test_the_headline_numbers_are_those_of_the_result(drop_result):
    content = simulate_page(drop_result)
    force, late = drop_result.bearing_force_magnitude, drop_result.time >= 0.15
    for b, card in enumerate(content.cards):
        shown = {figure.label: figure.value.value for figure in card.figures}
        assert shown["Peak bearing force"] == pytest.approx(force[:, b].max(), rel=1e-4)
        assert shown["Peak Hertz stress"] == pytest.approx(drop_result.max_stress[:, b].max(), rel=1e-4)
        assert shown["Mean force, 150 to 200 ms"] == pytest.approx(force[late, b].mean(), rel=1e-9)
    assert shown["Contacts"] == 2


def test_a_drop_that_was_not_finished_is_a_problem(drop_result):
    stopped = replace(drop_result, finished=False, outcome="The simulation stopped at 0.1 s.")
    first = simulate_page(stopped).verdict[0]
    assert (first.level, first.text) == ("bad", "The simulation stopped at 0.1 s.")


@pytest.mark.parametrize(("change", "level"), [(1e-3, "good"), (0.02, "warning")])
def test_a_numerical_error_above_half_a_percent_is_a_warning(drop_result, change, level):
    certificate = replace(drop_result.certificate, peak_change_tolerance=np.array([1e-5, change]))
    content = simulate_page(replace(drop_result, certificate=certificate))
    assert "ten times tighter tolerance" in dict(content.facts)["numerical error"]
    warned = [one.level for one in content.verdict if "ten times tighter tolerance" in one.text]
    assert warned == ([] if level == "good" else [level])


def test_the_peak_stress_stands_beside_the_static_limit(drop_result):
    texts = [statement.text for statement in simulate_page(drop_result).verdict]
    share = 100 * drop_result.max_stress[:, 0].max() / 4.2e9
    assert any(text.startswith(f"Peak stress is {share:.0f} % (NDE) and ") for text in texts)


def test_the_gap_and_the_first_contacts_come_from_the_result(drop_result):
    assert [simulated_gap(drop_result, index) for index in range(2)] == pytest.approx([275e-6, 285e-6])
    nde, de = (bearing.first_contact for bearing in simulated_bearings(drop_result))
    assert (de.start, de.end) == (0.0077, 0.0101)
    inside = (drop_result.time >= 0.0076) & (drop_result.time <= 0.0085)
    radius = np.hypot(*drop_result.displacement[inside, 0].T)
    assert nde.indentation == pytest.approx(radius.max() - 275e-6)


def test_a_page_with_the_machine_shows_weight_and_defaults():
    machine = example_machine("paper")
    listed = {
        f"{owner}, {row[0]}"
        for table in not_given(machine)
        for row in table.rows
        for owner in row[1].split(", ")
    }
    assert listed == {spoken_key(entry[0]) for entry in (*machine.defaults_in_use, *machine.inferred)}
    shares = weight_shares(machine)
    assert shares["NDE"] == pytest.approx(174.6, abs=0.1)
    assert shares["DE"] == pytest.approx(409.1, abs=0.1)


def test_balls_thrown_outwards_at_both_ends_are_one_warning(drop_result):
    fast = replace(drop_result, race_speed=40.0 * drop_result.race_speed)
    warned = [
        one.text
        for one in simulate_page(fast, example_machine("paper")).verdict
        if "thrown outwards" in one.text
    ]
    assert [text.split(":")[0] for text in warned] == ["DE (NDE likewise, less)"]
