"""Tables and sentences of the report: impacts, parameters, cross-check, data quality, stress distribution."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rotordrop.estimate.bearing_drop import History, Origin, highest, simulated_bearings
from rotordrop.estimate.estimate import CrossCheck
from rotordrop.evidence.quality.finding import Finding
from rotordrop.known import Known
from rotordrop.report.content import Column, Table, table
from rotordrop.report.drop_sections import (
    impact_table,
    quality_statements,
    record_quality_section,
    stress_box_figure,
    stress_table,
)
from rotordrop.report.estimate_page import (
    ParameterRow,
    cross_check_statements,
    cross_check_table,
    parameter_table,
)
from rotordrop.report.quantity import Quantity


def texts(row):
    return [cell.text if isinstance(cell, Quantity) else str(cell) for cell in row]


def test_a_row_of_the_wrong_length_is_refused():
    with pytest.raises(
        ValueError, match=r"table 'gaps': a row has 1 cells for 2 columns.*give as many cells"
    ):
        Table(columns=("a", "b"), rows=(("x",),), caption="gaps")


def test_impacts_are_listed_in_the_order_of_time(drop_result):
    table = impact_table(simulated_bearings(drop_result))
    assert [texts(row)[:3] for row in table.rows] == [
        ["NDE", "8.550 ms", "−90.0°"],
        ["DE", "9.000 ms", "−95.0°"],
        ["DE", "29.95 ms", "−110°"],
    ]
    assert texts(table.rows[1])[3:7] == ["5\u202f298 N", "6.40 N s", "7.60 J", "2.40 ms"]
    assert texts(table.rows[2])[6] == "–"


def test_a_tiny_number_of_an_impact_is_read_beside_the_large_ones(drop_result):
    nde, de = simulated_bearings(drop_result)
    tiny = Known(value=8.854e-5, interval_90=(8.211e-5, 9.496e-5), unit="J")
    soft = replace(nde, impacts=(replace(nde.impacts[0], dissipated_energy=tiny),))
    rows = impact_table([soft, de]).rows
    energies = [row[5] for row in rows if isinstance(row[5], Quantity)]
    assert [one.text for one in energies] == ["< 0.01 J", "7.60 J", "0.20 J"]
    assert energies[0].interval_text == ""


def test_a_unit_that_all_numbers_of_a_column_share_stands_above_it():
    columns = (Column("bearing", lambda row: row[0]), Column("force", lambda row: row[1], "force"))
    made = table((("NDE", 3333.0), ("DE", None)), columns)
    shown = made.with_units_above()
    assert shown.columns == ("bearing", "force [N]")
    assert [texts(row) for row in shown.rows] == [["NDE", "3\u202f333"], ["DE", "–"]]
    assert texts(made.rows[0]) == ["NDE", "3\u202f333 N"]
    mixed = Table(("a", "b"), (("x", Quantity.of(1.0, "force")), ("y", Quantity.of(1.0, "length"))))
    assert mixed.with_units_above().columns == ("a", "b")


def test_the_weakest_impacts_are_left_out_and_counted(drop_result):
    table = impact_table(simulated_bearings(drop_result), listed=2)
    assert [texts(row)[1] for row in table.rows] == ["8.550 ms", "9.000 ms"]
    assert table.caption == "Contacts (2 of 3), 3 of them impacts"


def row(name, prior, estimate, interval):
    return ParameterRow(
        name=name,
        prior=Quantity(value=prior, kind="stiffness"),
        estimate=Quantity(value=estimate, kind="stiffness", interval_90=interval),
        verdict="determined" if interval else "the record does not determine it",
    )


def test_parameters_show_prior_estimate_interval_and_verdict():
    known, open_ = row("K", 1e8, 1.4e8, (1.38e8, 1.42e8)), row("M", 4e7, 4e7, None)
    assert "verdict" not in parameter_table([known, known]).columns  # where all are determined
    both = parameter_table([known, open_])
    assert texts(both.rows[0])[:3] == ["K", "100.0 N/µm", "140.0 N/µm"]
    assert both.rows[0][2].interval_text == "138.0 to 142.0 N/µm"
    assert [line[both.columns.index("verdict")] for line in both.rows] == ["", open_.verdict]


def check(estimate, other):
    known = Known(value=estimate, status="determined", unit="N")
    return CrossCheck(name="NDE peak force", estimate=known, check=other, accuracy=0.15)


def test_a_disagreeing_cross_check_is_a_warning_with_both_numbers():
    both = [check(3000.0, 3100.0), check(3000.0, 2400.0)]
    (statement,) = cross_check_statements(both)
    assert statement.level == "warning"
    for words in ("2\u202f400 N against 3\u202f000 N", "−20 %", "± 15 %"):
        assert words in statement.text
    (agreed,) = cross_check_statements([both[0], check(3000.0, 2900.0)])
    assert agreed.level == "good"
    rows = [texts(cells)[3:] for cells in cross_check_table(both).rows]
    assert rows == [["3.3 %", "± 15 %", "agrees"], ["−20 %", "± 15 %", "disagrees"]]


def test_findings_tell_channel_time_and_remedy_the_serious_ones_first():
    hum = {"kind": "hum", "channel": "S_DE_B", "message": "50 Hz hum of 1.2 µm peak", "remedy": "ground it"}
    cut = {"kind": "clipping", "channel": "S_NDE_A", "message": "clipped at 500 µm", "remedy": "widen it"}
    found = [Finding(**hum, severity="warning"), Finding(**cut, severity="stop", time=0.0082)]
    assert [one.level for one in quality_statements(found)] == ["bad", "warning"]
    assert record_quality_section(found).tables[0].rows[1][2] == "8.200 ms"
    (sound,) = record_quality_section([]).statements
    assert sound.level == "good"


STRESS = 993e6 + 2e8 * np.random.default_rng(6).exponential(size=4001)


@pytest.fixture
def stressed(drop_result):
    """Two bearings, the second with twice the stress; the preload alone does 993 MPa."""
    time = np.linspace(0.0, 0.2, len(STRESS))
    bearings = zip(simulated_bearings(drop_result), (STRESS, 2.0 * STRESS), strict=True)
    return [
        replace(
            one,
            stress=(drawn := History(label="simulated", time=time, values=stress)),
            peak_stress=highest(drawn, "Pa", Origin.SIMULATION),
            preload_stress=993e6,
        )
        for one, stress in bearings
    ]


def test_the_box_plot_draws_the_numbers_of_the_statistics(stressed):
    told = stressed[0].statistics
    drawn = stress_box_figure(stressed)
    first, outliers = drawn.data[0], drawn.data[1]
    shown = (first.lowerfence, first.q1, first.median, first.mean, first.q3, first.upperfence)
    quartiles = (told.lower_quartile, told.median, told.mean, told.upper_quartile)
    expected = (told.lower_whisker, *quartiles, told.upper_whisker)
    assert_allclose(np.ravel(shown), 1e-6 * np.array(expected))
    assert 1 < len(set(outliers.y)) == len(outliers.y) <= told.beyond_whiskers
    assert max(outliers.y) == round(1e-6 * STRESS.max())
    assert min(outliers.y) >= round(1e-6 * told.upper_whisker)
    assert (list(first.x), list(drawn.data[2].x)) == (["NDE"], ["DE"])
    assert "[MPa]" in drawn.layout.yaxis.title.text


def test_the_stress_table_states_the_statistics_names_the_rules_and_the_preload(stressed):
    table = stress_table(stressed)
    names = "mean,median,lower quartile,upper quartile,lower whisker,upper whisker,standard deviation,maximum"
    for column, bearing in enumerate(stressed, start=1):
        told = bearing.statistics
        rows = {cells[0]: cells[column].value for cells in table.rows}
        expected = {name: getattr(told, name.replace(" ", "_")) for name in names.split(",")}
        expected["samples beyond the whiskers"] = told.beyond_whiskers
        expected["samples above mean + 3 σ"] = told.above_three_sigma
        expected["preload's share of the mean"] = 993e6 / told.mean
        for name, value in expected.items():
            assert rows[name] == value, name
