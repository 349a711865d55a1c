"""How bearings warmed in a drop or coast-down: temperatures and preload over time, one row a bearing."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from rotordrop.report.content import Column, Figure, Section, table
from rotordrop.report.style import FROM_POWER_OFF, SERIES, axis_title, curve, fit_legend, panels
from rotordrop.simulate.heat import NODES, Heat

WARMTHS = (
    Column("bearing", lambda row: row["name"]),
    Column("race", lambda row: row["race_K"]["largest"], "temperature", 3),
    Column("at", lambda row: row["race_K"]["time_s"], "duration", 3),
    Column("preload", lambda row: row["preload_N"]["start"], "force"),
    Column("largest", lambda row: row["preload_N"]["largest"], "force"),
    Column("at the end", lambda row: row["preload_N"]["end"], "force"),
    Column("air gap then", lambda row: row["air_gap_end_m"], "length", 4),
    Column("heat", lambda row: row["heat_J"]["taken"], "energy", 3),
    Column("gone outwards", lambda row: row["heat_J"]["gone"], "energy", 3),
)


def heat_sections(heat: Heat | None, names: tuple[str, ...]) -> tuple[Section, ...]:
    """Temperatures, preload and where the heat went, of a machine whose bearings warm."""
    if heat is None:
        return ()
    caption = (
        "Temperatures above the start, and the axial force of a row of balls with the race in the middle. "
        "Capacities and conductances are values by size unless the machine file gives them."
    )
    rows = [{"name": name} | one for name, one in heat.as_json(names).items()]
    figure = Figure(heat_figure(heat, names), caption, "heat")
    return (Section("Heat", figures=(figure,), tables=(table(rows, WARMTHS),)),)


def heat_figure(heat: Heat, names: tuple[str, ...]) -> go.Figure:
    """Draw the temperatures of all nodes and the preload of every bearing that warms."""
    titles = [f"{names[b]}: {what}" for what in ("temperatures", "preload of a row") for b in heat.warmed]
    figure = panels(titles, rows=2, columns=len(heat.warmed), height=230)
    for column, b in enumerate(heat.warmed, start=1):
        for node, called in enumerate(NODES):
            colour = SERIES[node % len(SERIES)]
            over, first = heat.temperature[:, b, node], column == 1
            curve(figure, heat.time, over, called, column=column, colour=colour, legend=first)
        curve(figure, heat.time, heat.preload[:, b], row=2, column=column)
    figure.update_yaxes(title_text=axis_title("above the start", "K"), row=1, col=1)
    figure.update_yaxes(title_text=axis_title("axial force", "N"), row=2, col=1)
    figure.update_yaxes(rangemode="tozero")
    figure.update_xaxes(title_text=FROM_POWER_OFF, range=[0.0, float(np.max(heat.time))], row=2)
    return fit_legend(figure)
