"""The first contact of rotor and touchdown bearing (Neisi 2020, Fig. 10)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from rotordrop.estimate.bearing_drop import BearingDrop, FirstContact
from rotordrop.report.style import (
    INK,
    LIMIT,
    MICRO,
    MILLI,
    MUTED,
    TIME_TITLE,
    add_gap_limits,
    add_history,
    axis_title,
    fit_legend,
    panels,
    upright,
)

SHOWN = 0.04
"""Length of the window the paper shows [s]."""

CONTACT_FILL = "rgba(217, 120, 10, 0.13)"


def first_contact_figure(bearings: Sequence[BearingDrop], *, until: float = SHOWN) -> go.Figure:
    """Draw the vertical displacement at the first contact with t1, t2 and indentation (Neisi 2020, Fig. 10).

    A bearing that was not touched is drawn without marks; the window ends at a time [s].
    """
    figure = panels([b.name for b in bearings])
    for column, bearing in enumerate(bearings, start=1):
        for motion in bearing.motions:
            history = motion.vertical.between(0.0, until)
            add_history(figure, history, MICRO, "µm", column=column, legend=column == 1)
        if bearing.air_gap is not None:
            add_gap_limits(figure, bearing.air_gap, sign=-1.0, column=column, legend=column == 1)
        if bearing.first_contact is not None:
            _mark(figure, bearing.first_contact, bearing, column)
    figure.update_xaxes(title_text=TIME_TITLE, range=[0.0, MILLI * until])
    figure.update_yaxes(title_text=axis_title("vertical displacement y", "µm"), col=1)
    return fit_legend(figure)


def _mark(figure: go.Figure, contact: FirstContact, bearing: BearingDrop, column: int) -> None:
    start, end = MILLI * contact.start, MILLI * contact.end
    # of an estimate lift-off has no known error, and the depth has that of the air gap
    exact, gap = bearing.peak_force.interval_90 is None, bearing.values.get("air_gap_m")
    beyond = (0.0,) if exact or gap is None else (gap.value - gap.high, gap.value - gap.low)
    depths = [max(MICRO * (contact.indentation + one), 0.0) for one in beyond]
    figure.add_vrect(x0=start, x1=end, fillcolor=CONTACT_FILL, line_width=0, row=1, col=column)
    for value in (start, end):
        upright(figure, value, MUTED, "dot", row=1, col=column)
    figure.add_annotation(
        x=end,
        y=1.0,
        yref="y domain" if column == 1 else f"y{column} domain",
        text=f"t₁ {start:.2f}, t₂ {end:.2f}, T {end - start:.2f} ms" if exact else "t₁ to t₂",
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
        text=f"indentation {' to '.join(f'{one:.1f}' for one in depths)} µm",
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
