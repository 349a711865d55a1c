"""Friction coefficient against relative surface speed (Neisi 2020, Fig. 2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from rotordrop.physics.friction import stribeck_coefficient
from rotordrop.report.style import SERIES, axis_title, fit_legend, panels, plain, single

POINTS = 801


@dataclass(frozen=True, kw_only=True)
class FrictionLaw:
    """Stribeck friction of one bearing: coefficients [1], decay and smoothing speed [m/s]."""

    label: str
    static: float
    dynamic: float
    stribeck_speed: float
    smoothing_speed: float


def friction_curve_figure(laws: Sequence[FrictionLaw], *, highest_speed: float | None = None) -> go.Figure:
    """Draw the friction coefficient over the relative surface speed (Neisi 2020, Fig. 2).

    Parameters
    ----------
    laws : sequence of FrictionLaw
        One curve per law.
    highest_speed : float, optional
        Range of the speed [m/s]; five times the largest decay speed by default.

    Returns
    -------
    Figure
        Left the whole law, right the smoothed passage through zero.
    """
    whole = highest_speed or 5.0 * max(law.stribeck_speed for law in laws)
    near = 4.0 * max(law.smoothing_speed for law in laws)
    figure = panels(("whole law", "near zero speed"))
    for index, law in enumerate(laws):
        for column, reach in enumerate((whole, near), start=1):
            speed = np.linspace(-reach, reach, POINTS)
            figure.add_trace(
                go.Scatter(
                    x=single(speed),
                    y=single(np.array([_coefficient(law, v) for v in speed])),
                    mode="lines",
                    name=plain(law.label),
                    legendgroup=plain(law.label),
                    showlegend=column == 1,
                    line={"color": SERIES[index % len(SERIES)], "width": 1.7},
                    hovertemplate=f"%{{x:.4~g}} m/s: %{{y:.3f}}<extra>{plain(law.label)}</extra>",
                ),
                row=1,
                col=column,
            )
    figure.update_xaxes(title_text=axis_title("relative surface speed", "m/s"))
    figure.update_yaxes(title_text=axis_title("friction coefficient", "1"), col=1)
    return fit_legend(figure)


def _coefficient(law: FrictionLaw, speed: float) -> float:
    return float(
        stribeck_coefficient(
            float(speed), law.static, law.dynamic, law.stribeck_speed, max(law.smoothing_speed, 1e-12)
        )
    )
