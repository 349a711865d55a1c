"""What a report says of a mount with a stop."""

import pytest
from tests.unit.simulate.test_mount import mounted

from rotordrop.report.simulate_page import simulate_page
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.drop import simulate_drop


@pytest.mark.parametrize(
    ("gap", "said", "level"),
    [("8 um", "reached its stop at", "warning"), ("5 mm", "did not reach its stop", "notice")],
)
def test_a_report_says_whether_a_stop_was_reached(gap, said, level):
    machine = mounted(f'{{ kind = "stop", gap = "{gap}" }}')
    result = simulate_drop(machine, DropCase(speed=300.0, duration=0.03))
    (statement,) = [one for one in simulate_page(result, machine).verdict if "stop" in one.text]
    assert said in statement.text
    assert statement.text.startswith("DE: ")
    assert statement.level == level
