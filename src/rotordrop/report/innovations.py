"""Innovations of the filter: what the model did not foresee, sample by sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.estimate.bearing_drop import History
from rotordrop.estimate.estimate import Innovations
from rotordrop.known import NINETY
from rotordrop.report.content import Figure
from rotordrop.report.style import (
    LIMIT,
    MICRO,
    MILLI,
    SERIES,
    add_history,
    axis_title,
    curve,
    fit_legend,
    label_time,
    panels,
)

EXPECTED = "90 % expected by the filter"
LIMIT_LINE = {"color": LIMIT, "width": 1.2, "dash": "dash"}
SHOWN_SHARE = 0.995
"""Share of the innovations inside the drawn range [1]; the first ones, before anything is known, are huge."""


def innovation_figures(found: Innovations) -> tuple[Figure, ...]:
    """Innovations by channel, their size over what is expected, and their autocorrelation."""
    normalised = found.values / found.deviation
    square = np.nan_to_num(np.nanmean(normalised**2, axis=1), nan=1.0)
    step = float(found.time[1] - found.time[0])
    return (
        Figure(
            innovations_figure(found.time, found.values, found.channels, found.deviation),
            "What each reading says beyond the prediction from all readings before it.",
            "innovations",
        ),
        Figure(
            nis_figure(found.time, square, found.limits),
            "Innovations squared over what the filter expects: one where model and noise are right.",
            "innovations squared",
        ),
        Figure(
            whiteness_figure(np.nan_to_num(normalised), found.channels, step),
            "Autocorrelation of the innovations; a correct model leaves none.",
            "whiteness",
        ),
    )


def innovations_figure(
    time: Array, innovations: Array, channels: Sequence[str], standard_deviation: Array | None = None
) -> go.Figure:
    """Draw the innovation of every channel (N, S) [m] with the band in which 90 % of it should lie."""
    rows = -(-len(channels) // 2)
    figure = panels(channels, rows=rows, columns=min(2, len(channels)), height=190)
    for index in range(len(channels)):
        row, column, legend = index // 2 + 1, index % 2 + 1, index == 0
        history = History(label="innovation", time=time, values=innovations[:, index], role="measured")
        line = {"color": "#6b7785", "width": 0.8}
        add_history(figure, history, MICRO, "µm", row=row, column=column, legend=legend, line=line)
        if standard_deviation is not None:
            half = NINETY * standard_deviation[:, index]
            for sign in (1.0, -1.0):
                limit = History(label=EXPECTED, time=time, values=sign * half)
                named = legend and sign > 0.0
                add_history(figure, limit, MICRO, "µm", row=row, column=column, legend=named, line=LIMIT_LINE)
        reach = 1.1 * MICRO * float(np.nanquantile(np.abs(innovations[:, index]), SHOWN_SHARE)) or 1.0
        figure.update_yaxes(range=[-reach, reach], row=row, col=column)
    label_time(figure, row=rows)
    figure.update_yaxes(title_text=axis_title("innovation", "µm"), col=1)
    return fit_legend(figure)


def nis_figure(
    time: Array, normalised_square: Array, limits: tuple[float, float], *, window: float = 2e-3
) -> go.Figure:
    """Draw the normalised innovation squared per channel (N,) [1] as a running mean over a window [s].

    It should be about one; its mean over the whole drop counts as consistent between the limits [1].
    """
    count = max(1, round(window / float(np.median(np.diff(time)))))
    ones = np.ones(min(count, len(time)))
    summed = np.convolve(normalised_square, ones, mode="same")
    mean = summed / np.convolve(np.ones(len(time)), ones, mode="same")
    figure = panels(("normalised innovation squared",), height=230)
    history = History(label=f"mean over {MILLI * window:.3g} ms", time=time, values=mean, role="estimated")
    add_history(figure, history, 1.0, "")
    figure.add_hrect(
        y0=limits[0],
        y1=limits[1],
        fillcolor="rgba(20, 113, 61, 0.13)",
        line_width=0,
        name=f"consistent mean, {limits[0]:.3g} to {limits[1]:.3g}",
        showlegend=True,
    )
    label_time(figure)
    figure.update_yaxes(title_text=axis_title("NIS per channel", "1"), rangemode="tozero")
    return fit_legend(figure)


def whiteness_figure(innovations: Array, channels: Sequence[str], sample_interval: float) -> go.Figure:
    """Draw the autocorrelation of every channel's normalised innovation (N, S), at samples so far apart [s].

    Beyond lag zero it should stay in the strip.
    """
    lags = np.arange(1, min(61, len(innovations) // 4))
    figure = panels(("autocorrelation of the innovations",), height=230)
    for index, channel in enumerate(channels):
        curve(
            figure,
            MILLI * sample_interval * lags,
            autocorrelation(innovations[:, index], lags),
            channel,
            mode="lines+markers",
            marker={"size": 3},
            width=1,
            colour=SERIES[index % len(SERIES)],
            hover="%{x:.2f} ms: %{y:.3f}",
        )
    half = NINETY / np.sqrt(len(innovations))
    line = {"color": LIMIT, "width": 1, "dash": "dash"}
    for value in (-half, half):
        figure.add_hline(y=value, line=line, name="90 % of white noise", showlegend=bool(value > 0.0))
    figure.update_xaxes(title_text=axis_title("lag", "ms"))
    figure.update_yaxes(title_text=axis_title("autocorrelation", "1"))
    return fit_legend(figure)


def autocorrelation(values: Array, lags: NDArray[np.int64]) -> Array:
    """Autocorrelation [1] of a signal at the given lags [samples]."""
    centred = values - np.mean(values)
    power = float(centred @ centred)
    return np.array([float(centred[lag:] @ centred[:-lag]) / power for lag in lags])
