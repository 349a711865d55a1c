"""One look for all figures: colours by origin of a history, axes with units, panels against time."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from rotordrop.arrays import Array
from rotordrop.estimate.bearing_drop import AirGap, Band, History, Peak
from rotordrop.report.quantity import written
from rotordrop.series import DRAWN_BLOCKS, peak_indices

if TYPE_CHECKING:
    from rotordrop.estimate.bearing_drop import AirGap, Band, History, Role

INK = "#1c2733"
MUTED = "#5b6875"
GRID = "#e6eaee"
LIMIT = "#b3261e"
GAP_FILL = "rgba(179, 38, 30, 0.28)"
COLOURS: dict[Role, str] = {
    "measured": "#20262d",
    "simulated": "#1c7ed6",
    "simulated, lower gap": "#e8890c",
    "estimated": "#1c7ed6",
    "cross-check": "#1a8f6f",
}
BAND_FILL = "rgba(28, 126, 214, 0.3)"
BAND_EDGE = {"width": 0.6, "color": "rgba(28, 126, 214, 0.55)"}
SERIES = ("#0b62b8", "#d9780a", "#1a8f6f", "#8e44ad", "#b3261e", "#5d6d1e", "#00838f", "#7a4a2b")
"""Colours of drops that are laid over each other."""

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', 'Liberation Sans', Arial, sans-serif"
MILLI = 1e3
MICRO = 1e6
TURN = 2.0 * math.pi
TIME_TITLE = "time from power-off [ms]"
FROM_POWER_OFF = "time from power-off [s]"
PANEL_HEIGHT = 300
LATE, EARLY = "#9cc3e8", "#0b3d73"
VISIBLE_GAP = 1.0
"""Difference of two limits [µm] from which they are drawn as a strip."""
TOP_MARGIN = 62
LEGEND_ROW = 22
LEGEND_WIDTH = 720


_ROUND = [factor * 10.0**power for power in range(-4, 7) for factor in (1, 2, 5)]
LOG_LABELS: dict[str, Any] = {
    "tickmode": "array",
    "tickvals": _ROUND,
    "ticktext": [f"{value:,.6g}".replace(",", "\u202f") for value in _ROUND],
}
"""Ticks of a logarithmic axis at 1, 2 and 5, every one with its whole number."""


def plain(text: str) -> str:
    """A name from a file, made harmless for plotly, which reads tags in its texts."""
    return html.escape(str(text), quote=False)


OVER = "rgba(255,255,255,0.85)"
"""Paper behind words that stand over curves."""


def axis_title(text: str, unit: str) -> str:
    """Title of an axis, always with its unit; a pure number has the unit 1."""
    return f"{text} [{unit or '1'}]"


_AXIS: dict[str, Any] = {
    "showline": True,
    "linecolor": "#9aa6b2",
    "mirror": True,
    "ticks": "outside",
    "ticklen": 4,
    "tickcolor": "#9aa6b2",
    "tickfont": {"size": 12},
    "gridcolor": GRID,
    "zeroline": False,
    "automargin": True,
    "title": {"font": {"size": 13}, "standoff": 8},
}
_TEMPLATE = go.layout.Template(
    layout={
        "font": {"family": FONT, "size": 12.5, "color": INK},
        "legend": {
            "orientation": "h",
            "x": 0.0,
            "y": 1.0,
            "xanchor": "left",
            "yanchor": "top",
            "yref": "container",
        },
        "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "#ffffff",
        "separators": ".\u202f",
        "hoverlabel": {"font": {"family": FONT, "size": 12}},
        "hovermode": "closest",
        "dragmode": "zoom",
        "xaxis": _AXIS,
        "yaxis": _AXIS,
    }
)
"""What all figures share: a template, for plotly takes long to check every axis of every figure."""


def panels(
    titles: Sequence[str],
    *,
    rows: int = 1,
    columns: int | None = None,
    height: int = PANEL_HEIGHT,
    spacing: float = 0.085,
) -> go.Figure:
    """An empty figure with a grid of titled panels of a height [px], row by row.

    Panels of one column zoom together in time. The horizontal space between them is a share of the width [1].
    """
    columns = columns or len(titles)
    plot_height = rows * height
    figure = make_subplots(
        rows=rows,
        cols=columns,
        subplot_titles=[plain(title) for title in titles],
        shared_xaxes="columns" if rows > 1 else False,
        horizontal_spacing=spacing if columns > 1 else 0.0,
        vertical_spacing=66 / plot_height if rows > 1 else 0.0,
    )
    figure.update_layout(
        template=_TEMPLATE, height=plot_height + 110, margin={"l": 64, "r": 16, "t": TOP_MARGIN, "b": 50}
    )
    figure.update_annotations(font={"size": 13.5, "color": INK}, yshift=2)
    return figure


def label_time(figure: go.Figure, row: int | None = None) -> None:
    """Title the time axes, of one row or all, and begin them at power-off."""
    figure.update_xaxes(title_text=TIME_TITLE, row=row)
    figure.update_xaxes(rangemode="tozero")


def in_seconds(figure: go.Figure) -> None:
    """Turn the time axes of a figure, and what is drawn along them, from milliseconds to seconds."""
    for trace in figure.data:
        trace.x = single(np.asarray(trace.x, dtype=np.float64) / MILLI)
        if trace.hovertemplate:
            trace.hovertemplate = trace.hovertemplate.replace("%{x:.2f} ms", "%{x:.4f} s")
    for mark in figure.layout.annotations:
        if mark.xref and "domain" not in mark.xref and mark.xref != "paper":
            mark.x /= MILLI
    for axis in figure.select_xaxes():
        axis.range = axis.range and [end / MILLI for end in axis.range]
    figure.for_each_xaxis(lambda axis: axis.title.update(text=FROM_POWER_OFF) if axis.title.text else None)


def line_style(role: Role, index: int | None = None) -> dict[str, Any]:
    """Colour and width of a history; an index takes the colour of a series instead of the role's."""
    colour = COLOURS[role] if index is None else SERIES[index % len(SERIES)]
    return {"color": colour, "width": 1.1 if role == "measured" and index is None else 1.5}


def compared_style(role: Role) -> dict[str, Any]:
    """Line of a history beside others: what was measured is thin and on top, the rest broad and pale."""
    if role == "measured":
        return {"color": COLOURS[role], "width": 0.9}
    return {"color": faded(COLOURS[role], 0.6), "width": 3.2}


def colour_of_time(figure: go.Figure, start: float, end: float) -> None:
    """Let marks of the ``coloraxis`` be the darker the earlier, beside a bar of the time [ms]."""
    heading = {"text": "time [ms]", "side": "right", "font": {"size": 12}}
    figure.update_layout(
        coloraxis={
            "colorscale": [[0.0, EARLY], [1.0, LATE]],
            "cmin": start,
            "cmax": end,
            "colorbar": {"title": heading, "thickness": 12, "outlinewidth": 0},
        }
    )


def faded(colour: str, share: float) -> str:
    """A colour such as ``"#1c7ed6"`` of which only a share covers what lies below."""
    red, green, blue = (int(colour[at : at + 2], 16) for at in (1, 3, 5))
    return f"rgba({red}, {green}, {blue}, {share})"


def curve(
    figure: go.Figure,
    x: Any,
    y: Any,
    name: str = "",
    *,
    row: int = 1,
    column: int = 1,
    colour: str = SERIES[0],
    width: float = 1.5,
    dash: str | None = None,
    mode: str = "lines",
    hover: str | None = "",
    legend: bool | None = None,
    **more: Any,
) -> None:
    """Draw one curve or a set of marks into a panel; curves of one name are switched together by the legend.

    ``hover`` is what is shown at a point, before the name; None for nothing. A curve without a name is not
    in the legend. ``more`` goes to plotly as it is.
    """
    label = plain(name)
    if "line" not in more and "lines" in mode:
        more["line"] = {"color": colour, "width": width, **({"dash": dash} if dash else {})}
    if hover is None:
        more["hoverinfo"] = "skip"
    elif hover:
        more["hovertemplate"] = f"{hover}<extra>{label}</extra>"
    trace = go.Scatter(
        x=x if isinstance(x, list) else single(x),
        y=y if isinstance(y, list) else single(y),
        mode=mode,
        name=label or None,
        legendgroup=label or None,
        showlegend=bool(name) if legend is None else legend,
        **more,
    )
    figure.add_trace(trace, row=row, col=column)


def upright(figure: go.Figure, x: float, colour: str = LIMIT, dash: str = "dash", **more: Any) -> None:
    """Draw a thin upright line, through all panels or one of them."""
    width = 1.2 if colour == LIMIT else 1.0
    figure.add_vline(x=x, line={"color": colour, "width": width, "dash": dash}, **more)


def words(
    figure: go.Figure,
    x: float,
    y: float,
    text: str,
    *,
    row: int = 1,
    column: int = 1,
    size: float = 11.0,
    colour: str = INK,
    **more: Any,
) -> None:
    """Write words of a size [px] into a panel; ``more`` goes to plotly as it is."""
    look: dict[str, Any] = {"showarrow": False, "font": {"size": size, "color": colour}} | more
    figure.add_annotation(x=x, y=y, text=text, row=row, col=column, **look)


def bars(ends: Sequence[tuple[float, float, float]], size: float, **style: Any) -> dict[str, Any]:
    """Error bars from value, lower and upper end [SI] in a unit of some size; an open end has none."""

    def reach(length: float) -> float:
        return length / size if np.isfinite(length) else 0.0

    above = [reach(high - value) for value, _, high in ends]
    return {"array": above, "arrayminus": [reach(value - low) for value, low, _ in ends], **style}


def square(figure: go.Figure, column: int, reach: float) -> None:
    """Show as much of both axes of a panel, from minus to plus a reach, at one scale."""
    anchor = "x" if column == 1 else f"x{column}"
    figure.update_yaxes(scaleanchor=anchor, constrain="domain", range=[-reach, reach], col=column)
    figure.update_yaxes(constraintoward="top", col=column)
    figure.update_xaxes(constrain="domain", range=[-reach, reach], col=column)


def add_history(figure: go.Figure, history: History, scale: float, unit: str, **more: Any) -> None:
    """Draw a history over time in milliseconds, with as few points as show all its peaks.

    ``more`` goes to `curve`: row, column, legend, and a line in place of that of its role.
    """
    chosen = peak_indices(history.values)
    time, values = MILLI * history.time[chosen], scale * history.values[chosen]
    look = {"line": line_style(history.role), "hover": f"%{{x:.2f}} ms: %{{y:.4~g}} {unit}"} | more
    curve(figure, time, values, history.label, **look)


def add_band(figure: go.Figure, band: Band, scale: float, unit: str, *, legend: bool, **place: Any) -> None:
    """Draw a band between two limits; thinned out, the drawn band still contains the whole one."""
    index, lower, upper = block_envelope(band.lower, band.upper)
    time, edge = MILLI * band.time[index], dict[str, Any](line=BAND_EDGE)
    curve(figure, time, scale * lower, band.label, **place, legend=False, hover=None, **edge)
    hover = f"%{{x:.2f}} ms: up to %{{y:.4~g}} {unit}"
    filled: dict[str, Any] = {"fill": "tonexty", "fillcolor": BAND_FILL, **edge}
    curve(figure, time, scale * upper, band.label, **place, legend=legend, hover=hover, **filled)


def add_gap_limits(
    figure: go.Figure, gap: AirGap, *, sign: float = 1.0, row: int = 1, column: int = 1, legend: bool = False
) -> None:
    """Draw the air gap as a horizontal limit, or as a strip where its limits differ visibly."""
    lower, upper = sorted((sign * MICRO * gap.lower, sign * MICRO * gap.upper))
    if upper - lower >= VISIBLE_GAP:
        figure.add_hrect(
            y0=lower,
            y1=upper,
            fillcolor=GAP_FILL,
            line_width=0,
            name="air gap, lower to upper limit",
            showlegend=legend,
            row=row,
            col=column,
        )
    else:
        add_level(figure, 0.5 * (lower + upper), "air gap", row=row, column=column, legend=legend)


def add_level(figure: go.Figure, value: float, name: str, *, row: int, column: int, legend: bool) -> None:
    """Draw a horizontal limit with an entry in the legend."""
    line = {"color": LIMIT, "width": 1, "dash": "dash"}
    figure.add_hline(y=value, line=line, name=plain(name), showlegend=legend, row=row, col=column)


def fit_legend(figure: go.Figure) -> go.Figure:
    """Make room above the panels for as many rows as the legend needs."""
    shown = [trace.name for trace in figure.data if trace.showlegend is not False and trace.name]
    shown += [shape.name for shape in figure.layout.shapes if shape.showlegend and shape.name]
    row, used = 1, 0.0
    for name in shown:
        width = 48 + 7.0 * len(name)
        row, used = (row + 1, width) if used and used + width > LEGEND_WIDTH else (row, used + width)
    extra = (row - 1) * LEGEND_ROW
    figure.update_layout(height=figure.layout.height + extra, margin_t=TOP_MARGIN + extra)
    return figure


def finished(figure: go.Figure, x: str = "", y: str = "", row: int | None = None) -> go.Figure:
    """Title the horizontal axes, of one row or all, and those of the first column; fit the legend.

    Titles have their units, as in ``"speed [Hz]"``.
    """
    if x:
        figure.update_xaxes(title_text=x, row=row)
    if y:
        figure.update_yaxes(title_text=y, col=1)
    return fit_legend(figure)


def single(values: Array) -> NDArray[np.float32]:
    """Values in single precision: seven digits are plenty for a figure and halve the page."""
    return np.asarray(values, dtype=np.float32)


def block_envelope(
    lower: Array, upper: Array, blocks: int = DRAWN_BLOCKS
) -> tuple[NDArray[np.int64], Array, Array]:
    """Indices at which a thinned band is drawn, and its limits there, which contain the whole band."""
    count = len(lower)
    if count <= 2 * blocks:
        return np.arange(count, dtype=np.int64), lower, upper
    edges = np.linspace(0, count, blocks + 1).astype(np.int64)
    lowest = np.minimum.reduceat(lower, edges[:-1])
    highest = np.maximum.reduceat(upper, edges[:-1])
    return (edges[:-1] + edges[1:] - 1) // 2, np.asarray(lowest), np.asarray(highest)


LONG = 3.0
"""Time [s] from which on an axis counts seconds."""


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One panel of a figure against time."""

    title: str
    """Above the panel."""
    axis: str
    """What the vertical axis shows."""
    histories: tuple[History, ...]
    """The curves."""
    band: Band | None = None
    """The 90 % band of the first."""
    air_gap: AirGap | None = None
    """Drawn as horizontal limits, with the signs in ``gap_signs``."""
    gap_signs: tuple[float, ...] = (1.0,)
    """1 above zero, −1 below."""
    levels: tuple[tuple[str, float], ...] = ()
    """Further horizontal limits with their names."""
    peak: Peak | None = None
    """Marked with its value, time and interval."""
    certain: bool = True
    """Whether the value of the peak holds; else it is marked with its interval alone."""
    span: tuple[float, float] | None = None
    """Ends of the time axis [s], where they are not those of what is drawn."""
    series: bool = False
    """Whether the curves take the colours of a series instead of those of their roles."""

    def around(self, before: float, after: float) -> Panel:
        """The panel around its peak, from so long before it to so long after it [s]."""
        assert self.peak is not None
        start, end = self.peak.time - before, self.peak.time + after
        return replace(
            self,
            histories=tuple(history.between(start, end) for history in self.histories),
            band=None if self.band is None else self.band.between(start, end),
            levels=(),
            span=(start, end),
        )


def time_panels(
    rows: Sequence[Sequence[Panel]],
    scale: float,
    unit: str,
    *,
    height: int = 240,
    from_zero: bool = False,
    together: bool = False,
    from_power_off: bool = True,
) -> go.Figure:
    """Draw rows of panels of a height [px] against the time from power-off, scaled from SI to a unit.

    The vertical axes begin at zero with ``from_zero``; all panels zoom ``together`` in time, else those of a
    column; without ``from_power_off`` every panel begins at its own first sample.
    """
    columns = len(rows[0])
    titles = [panel.title for row in rows for panel in row]
    figure = panels(titles, rows=len(rows), columns=columns, height=height)
    legend: dict[str, int] = {}
    for i, row in enumerate(rows, start=1):
        for j, panel in enumerate(row, start=1):
            _draw(figure, panel, scale, unit, i, j, legend)
            if j == 1 or panel.axis != row[j - 2].axis:  # one title for neighbours that show the same
                figure.update_yaxes(title_text=axis_title(panel.axis, unit), row=i, col=j)
            if panel.span is not None:  # else the words beside a peak would stretch it
                figure.update_xaxes(range=[MILLI * end for end in panel.span], row=i, col=j)
    label_time(figure, row=len(rows))
    drawn = [history.time for row in rows for panel in row for history in panel.histories]
    if any(float(np.ptp(time)) > LONG for time in drawn if len(time)):
        in_seconds(figure)
    if not from_power_off:
        figure.update_xaxes(rangemode="normal", matches=None, showticklabels=True)
    figure.update_yaxes(rangemode="tozero" if from_zero else "normal")
    if together:  # the panels of a column follow its lowest one; the lowest ones follow the first of them
        first = (len(rows) - 1) * columns + 1
        for number in range(first + 1, first + columns):
            figure.layout[f"xaxis{number}"].matches = "x" if first == 1 else f"x{first}"
    return fit_legend(figure)


def drawn_together(
    time: Array, curves: Mapping[str, Mapping[str, Array]], axis: str, unit: str, **more: Any
) -> go.Figure:
    """Draw curves of one time (T,) [s] by title of their panel and by name, each (T,) in SI.

    ``more`` goes to `time_panels`.
    """
    row = [
        Panel(
            title=title,
            axis=axis,
            histories=tuple(History(label=name, time=time, values=one) for name, one in named.items()),
            series=True,
        )
        for title, named in curves.items()
    ]
    return time_panels([row], 1.0, unit, **more)


def _draw(
    figure: go.Figure, panel: Panel, scale: float, unit: str, row: int, column: int, legend: dict[str, int]
) -> None:
    def first(name: str) -> bool:
        """Whether a name stands in the legend for the first time."""
        new = name not in legend
        legend.setdefault(name, len(legend))
        return new

    place: dict[str, Any] = {"row": row, "column": column}
    if not panel.certain and panel.histories[0].role == "estimated":
        histories = tuple(replace(one, label=f"{one.label}, not believed") for one in panel.histories)
        band = panel.band and replace(panel.band, label=f"{panel.band.label}, not believed")
        panel = replace(panel, histories=histories, band=band)
    if panel.band is not None:
        add_band(figure, panel.band, scale, unit, **place, legend=first(panel.band.label))
    compared = len({history.role for history in panel.histories}) > 1
    for history in sorted(panel.histories, key=lambda one: compared and one.role == "measured"):
        look = compared_style(history.role) if compared else line_style(history.role)
        if panel.series:
            look = line_style(history.role, legend.get(history.label, len(legend)))
        add_history(figure, history, scale, unit, **place, legend=first(history.label), line=look)
    if panel.air_gap is not None:
        for sign in panel.gap_signs:
            add_gap_limits(figure, panel.air_gap, sign=sign, **place, legend=first("air gap"))
    for name, level in panel.levels:
        add_level(figure, scale * level, name, **place, legend=first(name))
    if panel.peak is not None:
        _mark(figure, panel.peak, scale, unit, row, column, certain=panel.certain)


def _mark(
    figure: go.Figure, peak: Peak, scale: float, unit: str, row: int, column: int, *, certain: bool
) -> None:
    """Mark a peak with its value, time and 90 % interval, or with the interval alone."""
    said = [f"peak {written(scale * peak.value, 0)} {unit} at {MILLI * peak.time:.2f} ms"] if certain else []
    if peak.interval_90 is not None:
        low, high = (written(scale * limit, 0) for limit in peak.interval_90)
        said.append(f"{'' if certain else 'peak, '}90 %: {low} to {high} {unit}")
    if not said:
        return
    # above the largest value, where no other peak is
    look = {"showarrow": True, "arrowhead": 2, "arrowcolor": MUTED, "ax": -25, "ay": -24, "bgcolor": OVER}
    above: dict[str, Any] = {"xanchor": "left", "yanchor": "bottom", "align": "left", **look}
    top = peak.value if certain or peak.interval_90 is None else peak.interval_90[1]
    words(figure, MILLI * peak.time, scale * top, "<br>".join(said), row=row, column=column, **above)
