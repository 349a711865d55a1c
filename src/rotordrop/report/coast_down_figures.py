"""Figures of a whole coast-down: displacement (Neisi 2020, Fig. 17), speed and its law, second by second."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from rotordrop.estimate.bearing_drop import AirGap
from rotordrop.report.style import (
    BAND_FILL,
    COLOURS,
    LOG_LABELS,
    MICRO,
    SERIES,
    add_gap_limits,
    axis_title,
    fit_legend,
    panels,
    plain,
    single,
)
from rotordrop.simulate.coast_down_result import QUANTILES, CoastDownResult
from rotordrop.spectrum.coast_down import SpeedLaw
from rotordrop.spectrum.indentation import DisplacementHistory

Array = NDArray[np.float64]
TURN = 2.0 * math.pi
NEAR = 0.97
"""Share of the air gap at which the enlarged panel begins [1]."""
TIME = axis_title("time from power-off", "s")
_MEDIAN = QUANTILES.index(0.5)
_LOW, _HIGH = QUANTILES.index(0.05), QUANTILES.index(0.95)
_SHOWN = ((0, "indentation", MICRO, "µm"), (1, "bearing force", 1.0, "N"), (2, "Hertz stress", 1e-6, "MPa"))


def displacement_history_figure(histories: Mapping[str, DisplacementHistory], role: str) -> go.Figure:
    """Draw the distance of the rotor from the centre over the whole coast-down (Neisi 2020, Fig. 17).

    Parameters
    ----------
    histories : mapping of str to DisplacementHistory
        Smallest and largest displacement per interval, by plane.
    role : {"measured", "simulated"}
        Where they come from.

    Returns
    -------
    Figure
        A band from the smallest to the largest magnitude, in µm, with the air-gap window.
    """
    titles = [title for name in histories for title in (name, f"{name}: near the air gap")]
    figure = panels(titles, rows=len(histories), columns=2, height=240, spacing=0.07)
    for row, history in enumerate(histories.values(), start=1):
        for column in (1, 2):
            _add_envelope(figure, history, role, (row, column))
        near = MICRO * np.array([NEAR * history.air_gap, history.largest + (1.0 - NEAR) * history.air_gap])
        figure.update_yaxes(range=near.tolist(), row=row, col=2)
    figure.update_yaxes(title_text=axis_title("displacement", "µm"), rangemode="tozero", col=1)
    figure.update_xaxes(title_text=TIME, row=len(histories))
    return fit_legend(figure)


def _add_envelope(figure: go.Figure, history: DisplacementHistory, role: str, place: tuple[int, int]) -> None:
    colour = COLOURS["measured" if role == "measured" else "simulated"]
    edge = {"mode": "lines", "line": {"width": 0.6, "color": colour}, "x": single(history.time)}
    shown, where = place == (1, 1), {"row": place[0], "col": place[1]}
    figure.add_trace(
        go.Scatter(y=single(MICRO * history.lowest), showlegend=False, hoverinfo="skip", **edge), **where
    )
    figure.add_trace(
        go.Scatter(
            y=single(MICRO * history.highest),
            fill="tonexty",
            name=f"{role}, smallest to largest",
            showlegend=shown,
            hovertemplate="%{x:.2f} s: up to %{y:.4~g} µm<extra></extra>",
            **edge,
        ),
        **where,
    )
    add_gap_limits(figure, AirGap.of(history.air_gap), row=place[0], column=place[1], legend=shown)
    figure.add_trace(
        go.Scatter(
            x=[history.largest_time],
            y=[MICRO * history.largest],
            mode="markers",
            marker={"color": SERIES[4], "size": 8, "symbol": "circle-open", "line": {"width": 2}},
            name="largest",
            showlegend=shown,
            hovertemplate="largest: %{y:.4~g} µm at %{x:.4f} s<extra></extra>",
        ),
        **where,
    )


def speed_law_figure(time: Array, speed: Array, law: SpeedLaw, role: str) -> go.Figure:
    """Draw the speed with the exponential fit and the drag fit, and what each leaves over.

    Parameters
    ----------
    time, speed : ndarray, shape (K,)
        Times [s] and speeds [rad/s].
    law : SpeedLaw
        Both fits.
    role : {"measured", "simulated"}
        Where the speed comes from.

    Returns
    -------
    Figure
        Speed in Hz above, residuals in Hz below.
    """
    figure = panels(("speed", "residual"), rows=2, columns=1, height=230)
    every = max(1, len(time) // 2000)
    inside = time >= law.exponential.start
    t = time[inside][::every]
    figure.add_trace(
        go.Scatter(
            x=single(time[::every]),
            y=single(speed[::every] / TURN),
            mode="lines",
            name=role,
            line={"color": COLOURS["measured"], "width": 1.1},
        ),
        row=1,
        col=1,
    )
    fits = (
        ("one time constant", law.exponential.speed_at(t), SERIES[1]),
        ("dry, linear and quadratic drag", law.drag.speed_at(t), SERIES[0]),
    )
    for name, fitted, colour in fits:
        line = {"color": colour, "width": 1.4}
        figure.add_trace(
            go.Scatter(x=single(t), y=single(fitted / TURN), mode="lines", name=name, line=line), row=1, col=1
        )
        residual = (speed[inside][::every] - fitted) / TURN
        figure.add_trace(
            go.Scatter(x=single(t), y=single(residual), mode="lines", showlegend=False, line=line),
            row=2,
            col=1,
        )
    figure.update_yaxes(title_text=f"{axis_title('speed', 'Hz')}, × 60 in rpm", row=1)
    figure.update_yaxes(title_text=axis_title("residual", "Hz"), row=2)
    figure.update_xaxes(title_text=TIME, row=2)
    return fit_legend(figure)


def statistics_figure(result: CoastDownResult) -> go.Figure:
    """Draw indentation, force and stress second by second: median, 5 to 95 %, and the largest value.

    Parameters
    ----------
    result : CoastDownResult
        Statistics of a simulated coast-down.

    Returns
    -------
    Figure
        One row per quantity, one column per bearing.
    """
    names = result.bearing_names
    titles = [f"{name}: {label}" for _, label, _, _ in _SHOWN for name in names]
    figure = panels(titles, rows=len(_SHOWN), columns=len(names), height=215, spacing=0.1)
    time = single(0.5 * (result.windows.start + result.windows.end))
    for row, (column, label, scale, unit) in enumerate(_SHOWN, start=1):
        for b in range(len(names)):
            levels = scale * result.windows.quantile[:, b, column]
            peak = scale * result.windows.peak[:, b, column]
            place, legend = {"row": row, "col": b + 1}, row == 1 and b == 0
            _add_levels(figure, time, levels, peak, place, legend=legend)
        if column == 0:
            top = scale * float(np.max(result.windows.peak[..., 0]))
            figure.update_yaxes(range=[-0.15 * top, 1.1 * top], row=row)
        else:
            figure.update_yaxes(type="log", row=row, **LOG_LABELS)
        figure.update_yaxes(title_text=axis_title(plain(label), unit), row=row, col=1)
    figure.update_xaxes(title_text=TIME, row=len(_SHOWN))
    return fit_legend(figure)


def _add_levels(
    figure: go.Figure,
    time: NDArray[np.float32],
    levels: Array,
    peak: Array,
    place: dict[str, int],
    *,
    legend: bool,
) -> None:
    hidden = {"mode": "lines", "line": {"width": 0}, "x": time}
    low = go.Scatter(y=single(levels[:, _LOW]), showlegend=False, hoverinfo="skip", **hidden)
    high = go.Scatter(
        y=single(levels[:, _HIGH]),
        fill="tonexty",
        fillcolor=BAND_FILL,
        name="5 to 95 % of the time",
        legendgroup="band",
        showlegend=legend,
        **hidden,
    )
    median = go.Scatter(
        x=time,
        y=single(levels[:, _MEDIAN]),
        mode="lines",
        name="median",
        legendgroup="median",
        showlegend=legend,
        line={"color": COLOURS["simulated"], "width": 1.5},
    )
    largest = go.Scatter(
        x=time,
        y=single(peak),
        mode="markers",
        name="largest",
        legendgroup="largest",
        showlegend=legend,
        marker={"color": SERIES[4], "size": 3.5},
    )
    for trace in (low, high, median, largest):
        figure.add_trace(trace, **place)


def coast_down_speed_figure(result: CoastDownResult) -> go.Figure:
    """Draw the speed of rotor and races of a simulated coast-down at the end of every second.

    Parameters
    ----------
    result : CoastDownResult
        Statistics of a simulated coast-down.

    Returns
    -------
    Figure
        Speeds in Hz, logarithmic: the dry drag that stops the rotor bends the curve down at the end.
    """
    figure = panels(("rotor and races",), height=280)
    time = np.concatenate([[0.0], result.windows.end])
    speeds = [("rotor", np.concatenate([[result.initial_speed], result.windows.speed]), COLOURS["simulated"])]
    for b, name in enumerate(result.bearing_names):
        race = np.concatenate([[0.0], result.windows.race_speed[:, b]])
        speeds.append((f"{name} race", race, SERIES[2 + b]))
    for label, speed, colour in speeds:
        turning = np.where(np.abs(speed) > 1e-3, np.abs(speed) / TURN, np.nan)
        figure.add_trace(
            go.Scatter(
                x=single(time),
                y=single(turning),
                mode="lines",
                name=plain(label),
                line={"color": colour, "width": 1.5},
            )
        )
    if result.standstill_time is not None:
        figure.add_vline(x=result.standstill_time, line={"color": SERIES[4], "width": 1, "dash": "dash"})
    figure.update_yaxes(title_text=f"{axis_title('speed', 'Hz')}, × 60 in rpm", type="log", **LOG_LABELS)
    figure.update_xaxes(title_text=TIME)
    return fit_legend(figure)
