"""What a notebook shows of a result: its words above a small figure, which needs no library."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from itertools import count, cycle
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rotordrop.series import peak_indices

COLOURS = ("#1c7ed6", "#e8590c", "#2b8a3e", "#9c36b5")
WIDTH, HEIGHT = 460, 150
"""Of the axes [px]."""


def sketch(
    words: str, across: str, up: str, curves: Mapping[str, tuple[ArrayLike, ArrayLike]], scale: float = 1.0
) -> str:
    """HTML of words and of curves (x, y) by name over shared axes, each with its smallest and largest value.

    y is multiplied by `scale`; what is not finite is left out. More curves than `COLOURS` begin again.
    """
    drawn = {}
    for name, (x, y) in curves.items():
        points = np.column_stack([x, scale * np.asarray(y, dtype=np.float64)])
        points = points[np.isfinite(points).all(axis=1)]
        drawn[name] = points[peak_indices(points[:, 1])] if len(points) else points
    every = np.concatenate([*drawn.values(), np.empty((0, 2))])
    text = f'<pre style="white-space:pre-wrap">{escape(words)}</pre>'
    if not len(every):
        return text
    low, high = every.min(axis=0), every.max(axis=0)
    span = np.where(high > low, high - low, 1.0)
    left, bottom = 60, HEIGHT + 24
    (first, last), (least, most) = np.round(np.array([low, high]) / span, 4).T * span[:, None]
    marks = [(left - 6, 32, f"{most:.4g}"), (left - 6, bottom, f"{least:.4g}"), (left + WIDTH // 2, 14, up)]
    marks += [(left + 30, bottom + 18, f"{first:.4g}"), (left + WIDTH, bottom + 18, f"{last:.4g}")]
    marks += [(left + WIDTH // 2, bottom + 18, across)]
    parts = [f'<rect x="{left}" y="24" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="#8884"/>']
    for (name, points), colour, row in zip(drawn.items(), cycle(COLOURS), count(), strict=False):
        places = (points - low) / span * (WIDTH, -HEIGHT) + (left, bottom)
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}"/>')
        parts.append(
            f'<text x="{left + WIDTH + 8}" y="{36 + 16 * row}" fill="{colour}">{escape(name)}</text>'
        )
    parts += [f'<text x="{x}" y="{y}" text-anchor="end">{escape(mark)}</text>' for x, y, mark in marks]
    style = "font:12px sans-serif;fill:currentColor"
    wide, tall = WIDTH + 200, bottom + 24
    size = f'width="{wide}" height="{tall}" viewBox="0 0 {wide} {tall}"'
    return f'{text}<svg {size} style="{style}">{"".join(parts)}</svg>'


def still(chart: Any) -> str:
    """The curves of every pair of axes of a plotly figure as a small picture, where nothing can run.

    An axis without a title shares that of the one before it, a time axis that of the lowest row.
    """
    drawn: dict[str, dict[str, Any]] = {}
    for trace in chart.data:
        if trace.type == "scatter" and trace.mode == "lines" and (trace.line.width or 0.0) > 1.0:
            drawn.setdefault(trace.yaxis or "y", {})[trace.name] = (trace.x, trace.y)
    titles = [note.text for note in chart.layout.annotations]
    below = [axis.title.text for axis in chart.select_xaxes() if axis.title.text]
    pictures, up = [], ""
    for number, axis in enumerate(chart.select_yaxes()):
        up, name = axis.title.text or up, axis.plotly_name.replace("axis", "")
        if name in drawn and axis.scaleanchor is None and axis.type != "log":
            words = titles[number] if number < len(titles) else ""
            own = chart.layout[axis.plotly_name.replace("y", "x")]
            across = own.title.text or (below[-1] if below else "")
            if own.type != "log":
                pictures.append(sketch(words, across, up, drawn[name]))
    return "".join(pictures)
