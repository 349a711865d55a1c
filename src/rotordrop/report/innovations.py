"""Innovations of the filter: what the model did not foresee, sample by sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray

from rotordrop.estimate.bearing_drop import History
from rotordrop.known import NINETY
from rotordrop.report.style import (
    LIMIT,
    MICRO,
    MILLI,
    SERIES,
    add_history,
    axis_title,
    fit_legend,
    label_time,
    panels,
    plain,
    single,
)

Array = NDArray[np.float64]

EXPECTED = "90 % expected by the filter"
LIMIT_LINE = {"color": LIMIT, "width": 1.2, "dash": "dash"}
SHOWN_SHARE = 0.995
"""Share of the innovations inside the drawn range [1]; the first ones, before anything is known, are huge."""


def innovations_figure(
    time: Array, innovations: Array, channels: Sequence[str], standard_deviation: Array | None = None
) -> go.Figure:
    """Draw the innovation of every channel with the band in which 90 % of it should lie.

    Parameters
    ----------
    time : ndarray, shape (N,)
        Time from power-off [s].
    innovations : ndarray, shape (N, S)
        Reading minus prediction [m].
    channels : sequence of str
        Names of the channels.
    standard_deviation : ndarray, shape (N, S), optional
        What the filter expects [m].
    """
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
                shown = legend and sign > 0.0
                add_history(figure, limit, MICRO, "µm", row=row, column=column, legend=shown, line=LIMIT_LINE)
        reach = 1.1 * MICRO * float(np.nanquantile(np.abs(innovations[:, index]), SHOWN_SHARE)) or 1.0
        figure.update_yaxes(range=[-reach, reach], row=row, col=column)
    label_time(figure, row=rows)
    figure.update_yaxes(title_text=axis_title("innovation", "µm"), col=1)
    return fit_legend(figure)


def nis_figure(
    time: Array, normalised_square: Array, limits: tuple[float, float], *, window: float = 2e-3
) -> go.Figure:
    """Draw the normalised innovation squared per channel as a running mean; it should be about one.

    Parameters
    ----------
    time : ndarray, shape (N,)
        Time from power-off [s].
    normalised_square : ndarray, shape (N,)
        Normalised innovation squared divided by the number of channels [1].
    limits : tuple of float
        Limits within which its mean over the whole drop counts as consistent [1].
    window : float
        Length of the running mean [s].
    """
    count = max(1, round(window / float(np.median(np.diff(time)))))
    window_of_ones = np.ones(min(count, len(time)))
    summed = np.convolve(normalised_square, window_of_ones, mode="same")
    mean = summed / np.convolve(np.ones(len(time)), window_of_ones, mode="same")
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
    """Draw the autocorrelation of every channel's innovation; beyond lag zero it should stay in the strip.

    Parameters
    ----------
    innovations : ndarray, shape (N, S)
        Innovations divided by their expected standard deviation [1].
    channels : sequence of str
        Names of the channels.
    sample_interval : float
        Time between samples [s].
    """
    lags = np.arange(1, min(61, len(innovations) // 4))
    figure = panels(("autocorrelation of the innovations",), height=230)
    for index, channel in enumerate(channels):
        figure.add_trace(
            go.Scatter(
                x=single(np.asarray(MILLI * sample_interval * lags, dtype=np.float64)),
                y=single(autocorrelation(innovations[:, index], lags)),
                mode="lines+markers",
                marker={"size": 3},
                line={"width": 1, "color": SERIES[index % len(SERIES)]},
                name=plain(channel),
                hovertemplate=f"%{{x:.2f}} ms: %{{y:.3f}}<extra>{plain(channel)}</extra>",
            )
        )
    half = NINETY / np.sqrt(len(innovations))
    for value in (-half, half):
        figure.add_hline(
            y=value,
            line={"color": LIMIT, "width": 1, "dash": "dash"},
            name="90 % of white noise",
            showlegend=bool(value > 0.0),
        )
    figure.update_xaxes(title_text=axis_title("lag", "ms"))
    figure.update_yaxes(title_text=axis_title("autocorrelation", "1"))
    return fit_legend(figure)


def autocorrelation(values: Array, lags: NDArray[np.int64]) -> Array:
    """Autocorrelation [1] of a signal at the given lags [samples]."""
    centred = values - np.mean(values)
    power = float(centred @ centred)
    return np.array([float(centred[lag:] @ centred[:-lag]) / power for lag in lags])
