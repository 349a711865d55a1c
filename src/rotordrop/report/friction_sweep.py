"""Agreement of simulated and measured orbit over the friction coefficient (Neisi 2020, section 5.2)."""

from __future__ import annotations

import plotly.graph_objects as go

from rotordrop.identification.friction import FrictionSweep
from rotordrop.report.style import BAND_FILL, MICRO, SERIES, axis_title, fit_legend, panels, single


def friction_sweep_figure(sweep: FrictionSweep) -> go.Figure:
    """Draw how far the simulated orbit lies from the measured one over the dynamic friction coefficient.

    Parameters
    ----------
    sweep : FrictionSweep
        The sweep; its best value is marked with its 90 % interval.
    """
    figure = panels(("orbit agreement over friction",), height=250)
    figure.add_trace(
        go.Scatter(
            x=single(sweep.coefficients),
            y=single(MICRO * sweep.disagreement),
            mode="lines+markers",
            marker={"size": 6},
            line={"color": SERIES[0], "width": 1.5},
            name="distance of the orbits",
            hovertemplate="μ %{x:.3f}: %{y:.2f} µm<extra></extra>",
        )
    )
    figure.add_vline(
        x=sweep.value.value, line={"color": SERIES[4], "width": 1.3}, name="best", showlegend=True
    )
    if sweep.value.interval_90 is not None:
        low, high = sweep.value.interval_90
        figure.add_vrect(
            x0=low, x1=high, fillcolor=BAND_FILL, line_width=0, name="90 % interval", showlegend=True
        )
    figure.update_xaxes(title_text=axis_title("dynamic friction coefficient", "1"))
    figure.update_yaxes(title_text=axis_title("orbit distance, weighted rms", "µm"), rangemode="tozero")
    return fit_legend(figure)
