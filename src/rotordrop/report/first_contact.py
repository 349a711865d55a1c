"""The first contact of rotor and touchdown bearing (Neisi 2020, Figs 10 and 11)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import plotly.graph_objects as go

from rotordrop.report.history import AirGap, BearingMotions, History, between
from rotordrop.report.style import (
    INK,
    LIMIT,
    MICRO,
    MILLI,
    MUTED,
    SERIES,
    TIME_TITLE,
    add_gap_limits,
    add_history,
    axis_title,
    fit_legend,
    panels,
    plain,
)

SHOWN = 0.04
"""Length of the window the paper shows [s]."""

CONTACT_FILL = "rgba(217, 120, 10, 0.13)"


@dataclass(frozen=True, kw_only=True)
class FirstContact:
    """Times and depth of the first contact at one bearing.

    Attributes
    ----------
    start, end : float
        Beginning t1 and end t2 of the first contact [s] from power-off.
    indentation : float
        Largest displacement beyond the air gap during it [m].
    deepest_time : float
        Time of the largest displacement [s].
    """

    start: float
    end: float
    indentation: float
    deepest_time: float


@dataclass(frozen=True, kw_only=True)
class OverlaidDrop:
    """Vertical displacement in one drop by bearing, measured and simulated, to be overlaid with others."""

    label: str
    measured: Mapping[str, History]
    simulated: Mapping[str, History]


def first_contact_figure(
    bearings: Sequence[BearingMotions], contacts: Mapping[str, FirstContact], *, until: float = SHOWN
) -> go.Figure:
    """Draw the vertical displacement at the first contact with t1, t2 and indentation (Neisi 2020, Fig. 10).

    Parameters
    ----------
    bearings : sequence of BearingMotions
        One panel per bearing.
    contacts : mapping
        First contact by name of the bearing; a bearing without one is drawn without marks.
    until : float
        End of the window [s].
    """
    figure = panels([b.bearing for b in bearings])
    for column, bearing in enumerate(bearings, start=1):
        for motion in bearing.motions:
            history = between(motion.vertical, 0.0, until)
            add_history(figure, history, MICRO, "µm", column=column, legend=column == 1)
        if bearing.air_gap is not None:
            add_gap_limits(figure, bearing.air_gap, sign=-1.0, column=column, legend=column == 1)
        contact = contacts.get(bearing.bearing)
        if contact is not None:
            _mark(figure, contact, bearing, column)
    figure.update_xaxes(title_text=TIME_TITLE, range=[0.0, MILLI * until])
    figure.update_yaxes(title_text=axis_title("vertical displacement y", "µm"), col=1)
    return fit_legend(figure)


def _mark(figure: go.Figure, contact: FirstContact, bearing: BearingMotions, column: int) -> None:
    start, end = MILLI * contact.start, MILLI * contact.end
    figure.add_vrect(x0=start, x1=end, fillcolor=CONTACT_FILL, line_width=0, row=1, col=column)
    for value in (start, end):
        figure.add_vline(x=value, line={"color": MUTED, "width": 1, "dash": "dot"}, row=1, col=column)
    figure.add_annotation(
        x=end,
        y=1.0,
        yref="y domain" if column == 1 else f"y{column} domain",
        text=f"t₁ {start:.2f}, t₂ {end:.2f}, T {end - start:.2f} ms",
        showarrow=False,
        xanchor="left",
        yanchor="top",
        xshift=3,
        font={"size": 11.5, "color": INK},
        row=1,
        col=column,
    )
    drawn = bearing.motions[0].vertical
    depth = float(np.interp(contact.deepest_time, drawn.time, drawn.values))
    figure.add_annotation(
        x=MILLI * contact.deepest_time,
        y=MICRO * depth,
        text=f"indentation {MICRO * contact.indentation:.1f} µm",
        showarrow=True,
        arrowhead=2,
        arrowcolor=LIMIT,
        ax=70,
        ay=-4,
        xanchor="left",
        font={"size": 11.5, "color": INK},
        row=1,
        col=column,
    )


def first_contacts_figure(
    drops: Sequence[OverlaidDrop],
    bearings: Sequence[str],
    air_gaps: Mapping[str, float] | None = None,
    *,
    until: float = SHOWN,
) -> go.Figure:
    """Lay the first contacts of several drops over each other (Neisi 2020, Fig. 11).

    Parameters
    ----------
    drops : sequence of OverlaidDrop
        Drops; solid lines are simulated, dashed ones measured, as in the paper.
    bearings : sequence of str
        Names of the bearings, one panel each.
    air_gaps : mapping, optional
        Air gap by bearing [m], as a horizontal limit.
    until : float
        End of the window [s].
    """
    figure = panels(bearings)
    for column, bearing in enumerate(bearings, start=1):
        for index, drop in enumerate(drops):
            if bearing in drop.measured:
                _overlay(figure, drop.label, "measured", drop.measured[bearing], index, column, until)
            if bearing in drop.simulated:
                _overlay(figure, drop.label, "simulated", drop.simulated[bearing], index, column, until)
        if air_gaps and bearing in air_gaps:
            add_gap_limits(figure, AirGap.of(air_gaps[bearing]), sign=-1.0, column=column, legend=column == 1)
    figure.update_xaxes(title_text=TIME_TITLE, range=[0.0, MILLI * until])
    figure.update_yaxes(title_text=axis_title("vertical displacement y", "µm"), col=1)
    return fit_legend(figure)


def _overlay(
    figure: go.Figure, drop: str, kind: str, history: History, index: int, column: int, until: float
) -> None:
    """Draw one drop in its colour, simulated solid and in the legend, measured dashed."""
    simulated = kind == "simulated"
    shown = replace(between(history, 0.0, until), label=drop if simulated else f"{drop}, measured (dashed)")
    legend = column == 1 and simulated
    line = {
        "color": SERIES[index % len(SERIES)],
        "width": 1.5 if simulated else 1.2,
        "dash": "solid" if simulated else "5px,3px",
    }
    add_history(
        figure,
        shown,
        MICRO,
        "µm",
        column=column,
        legend=legend,
        line=line,
        group=plain(drop),
    )
