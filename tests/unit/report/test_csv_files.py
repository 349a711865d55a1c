"""Tables and figures of a report as CSV: units, intervals, pairs of columns, names that do not clash."""

import csv
from dataclasses import replace

import numpy as np
import plotly.graph_objects as go
import pytest

from rotordrop.cli.app import run
from rotordrop.machine import example_path
from rotordrop.report.content import Figure, ReportContent, Section, Table
from rotordrop.report.csv_files import write_data
from rotordrop.report.quantity import Quantity
from rotordrop.report.style import panels


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.reader(stream))


def content():
    force = Quantity(value=1234.5, kind="force", interval_90=(1200.0, 1300.0))
    table = Table(columns=("what", "peak"), rows=(('NDE, "left"', force), ("DE", "–")), caption="Peaks")
    mixed = Table(
        columns=("quantity", "value"),
        rows=(("gap", Quantity(value=2.5e-4, kind="length")), ("mass", Quantity(value=60.0, kind="mass"))),
        caption="Peaks",
    )
    lines = go.Figure([go.Scatter(x=[0.0, 1.0], y=[2.0, 3.5], name="a"), go.Scatter(x=[5], y=[6], name="b")])
    lines.update_xaxes(title_text="time [s]")
    picture = go.Figure([go.Heatmap(x=[1, 2, 3], y=[10, 20], z=np.arange(6).reshape(2, 3))])
    figures = (Figure(chart=lines, caption="", name="force"), Figure(chart=picture, caption="", name="map"))
    return ReportContent(
        title="t", summary=(table,), sections=(Section(heading="s", figures=figures, tables=(mixed,)),)
    )


def test_every_table_and_figure_is_a_file(tmp_path):
    names = [path.name for path in write_data(content(), tmp_path / "there")]
    assert names == ["table_peaks.csv", "table_peaks_2.csv", "figure_force.csv", "figure_map.csv"]


def test_a_quantity_has_its_unit_and_its_interval_in_columns_of_their_own(tmp_path):
    first, second, *_ = write_data(content(), tmp_path)
    assert rows_of(first) == [
        ["what", "peak [N]", "peak 5 % [N]", "peak 95 % [N]"],
        ['NDE, "left"', "1234.5", "1200", "1300"],
        ["DE", "–", "", ""],
    ]
    assert rows_of(second)[1:] == [["gap", "0.00025 m"], ["mass", "60 kg"]]


def test_lines_stand_beside_each_other_and_a_picture_point_by_point(tmp_path):
    *_, lines, picture = write_data(content(), tmp_path)
    assert rows_of(lines) == [
        ["a: time [s]", "a: y", "b: time [s]", "b: y"],
        ["0", "2", "5", "6"],
        ["1", "3.5", "", ""],
    ]
    assert rows_of(picture)[1:3] == [["1", "10", "0"], ["2", "10", "1"]]
    assert rows_of(picture)[-1] == ["3", "20", "5"]


def test_columns_of_several_panels_name_the_panel_and_the_titles_they_share(tmp_path):
    chart = panels(["NDE & co", "DE", "", ""], rows=2, columns=2)
    for row, column in ((1, 1), (1, 2), (2, 2)):
        chart.add_trace(go.Scatter(x=[0.0], y=[1.0], name="simulated"), row=row, col=column)
    chart.update_xaxes(title_text="time [ms]", row=2)
    chart.update_yaxes(title_text="displacement x [µm]", row=1, col=1)
    chart.update_yaxes(title_text="displacement y [µm]", row=2, col=1)
    figure = Figure(chart=chart, caption="", name="displacement")
    only = ReportContent(title="t", sections=(Section(heading="s", figures=(figure,)),))
    (path,) = write_data(only, tmp_path)
    assert rows_of(path)[0] == [
        "NDE & co: simulated: time [ms]",
        "NDE & co: simulated: displacement x [µm]",
        "DE: simulated: time [ms]",
        "DE: simulated: displacement x [µm]",
        "DE: simulated: time [ms]",
        "DE: simulated: displacement y [µm]",
    ]


def test_what_was_simulated_is_marked_in_every_row(tmp_path):
    for path in write_data(replace(content(), simulated="A simulated record."), tmp_path):
        head, *rows = rows_of(path)
        assert head[-1] == "simulated" and {row[-1] for row in rows} == {"yes"}


@pytest.mark.parametrize("verb", ["critical-speeds"])
def test_a_verb_writes_them(tmp_path, verb):
    assert run([verb, str(example_path("small")), "--data", str(tmp_path / "data")]) == 0
    written = {path.name for path in (tmp_path / "data").iterdir()}
    assert {"figure_map_forward.csv", "figure_campbell_ambs.csv"} <= written
