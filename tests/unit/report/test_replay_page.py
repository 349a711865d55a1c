"""The report on a replayed drop shows what the replay found, step by step."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.unit.report.conftest import section

from rotordrop.estimate.agreement import compare_orbits
from rotordrop.evidence.contacts import TimedContact
from rotordrop.report.estimate_page import estimate_page, first_contact_table
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


@pytest.fixture
def agreement(drop_result):
    measured = drop_result.displacement + 3e-6
    made, names = drop_result.displacement, drop_result.bearing_names
    return compare_orbits(drop_result.time, measured, made, GAPS, names)


@pytest.fixture
def drop(bank):
    """The recorded drop replayed."""
    return bank("replayed")


def test_headline_route_warnings_and_horizon(drop):
    content = estimate_page(drop)
    for figure in content.cards[0].figures[:2]:
        assert figure.value.interval_90 is None
        assert " ms" not in figure.note  # of a time that a replay finds no error is known
    assert "open-loop replay" in content.verdict[0].text
    assert set(drop.warnings) <= {one.text for one in content.verdict if one.level == "warning"}
    motion = section(content, "Motion at the sensors")
    horizon = min(one.horizon_s for one in drop.agreement.bearings.values())
    assert any(f"for {1e3 * horizon:.0f} ms" in text for text in motion.text)
    drawn = motion.figures[1].chart
    limits = drop.bearings[1].at_gap_limits
    names = [one.label for one in limits[1:]] + [limits[0].label]  # the measured one on top
    assert [item.name for item in drawn.data if item.xaxis == "x2"] == names
    lower = next(item for item in drawn.data if item.name == names[0] and item.xaxis == "x2")
    radius = 1e6 * limits[1].radial.values
    assert (max(lower.y), lower.y[0], lower.y[-1]) == pytest.approx(
        (radius.max(), radius[0], radius[-1]), rel=1e-6
    )


def test_agreement_states_the_distances_of_the_windows(agreement):
    for window in agreement.windows:
        assert_allclose([*window.rms.values()], 3e-6 * np.sqrt(2.0), rtol=1e-9)


def test_a_bounce_has_its_height_above_the_rest():
    time = np.linspace(0.0, 0.1, 2001)
    place = np.zeros((len(time), 1, 2))
    place[:, 0, 1] = -np.abs(290e-6 * np.sin(2.0 * np.pi * 20.0 * time))  # down, up to the centre, down
    found = compare_orbits(time, place, place, GAPS[:1], ("NDE",)).bearings["NDE"]
    assert found.measured_bounce_m == pytest.approx(GAPS[0], abs=1e-6)
    assert found.simulated_bounce_m == found.measured_bounce_m


def test_table_3_has_the_paper_s_value_and_the_corrected_one():
    table = first_contact_table(("NDE",), (CONTACT,))
    texts = [cell.text if isinstance(cell, Quantity) else cell for cell in table.rows[0]]
    assert texts[:5] == ["NDE", "7.500 ms", "9.500 ms", "2.00 ms", "15.2 µm"]
    assert texts[5:] == ["17.80 kg", "43.9 N/µm", "31.0 N/µm"]
