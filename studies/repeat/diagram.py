"""Draw how reliable the ranking and the virtual repeat are: what was said against what was true.

    python studies/repeat/diagram.py --out docs/_static/reliability.svg

Left: pairs of drops by the probability with which one was called worse; bars are Wilson intervals (90 %) as
if pairs were independent. Right: share of the true drops below each predicted quantile; the grey band holds
90 % of the curves that independent uniform places give (Kolmogorov and Smirnov).
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from scipy.stats import binomtest, kstwo

HERE = Path(__file__).parent
SIZE, LEFT, TOP, WIDTH = 300, 56, 40, 820
COLOURS = ("#0b62b8", "#d9780a", "#1a8f6f", "#8e44ad")


def wilson(share: float, count: int) -> tuple[float, float]:
    """90 % interval of a share."""
    found = binomtest(round(share * count), count).proportion_ci(0.9, "wilson")
    return float(found.low), float(found.high)


class Panel:
    """A square with both axes in per cent."""

    def __init__(self, left: float, low: float, title: str, x: str, y: str) -> None:
        self.left, self.low = left, low
        self.parts = [
            f'<text x="{left}" y="{TOP - 18}" font-weight="600">{title}</text>',
            f'<text x="{left + SIZE / 2}" y="{TOP + SIZE + 36}" text-anchor="middle">{x}</text>',
            f'<text transform="translate({left - 40},{TOP + SIZE / 2}) rotate(-90)" '
            f'text-anchor="middle">{y}</text>',
        ]
        for tick in np.linspace(low, 1.0, 6):
            at_x, at_y = self.at(float(tick), float(tick))
            self.parts += [
                f'<path d="M{at_x:.1f} {TOP}V{TOP + SIZE}M{left} {at_y:.1f}H{left + SIZE}" '
                'stroke="#e6eaee"/>',
                f'<text x="{at_x:.1f}" y="{TOP + SIZE + 16}" text-anchor="middle">{100 * tick:.0f}</text>',
                f'<text x="{left - 6}" y="{at_y + 4:.1f}" text-anchor="end">{100 * tick:.0f}</text>',
            ]
        self.curve([low, 1.0], [low, 1.0], "#5b6875", dashed=True)

    def at(self, x: float, y: float) -> tuple[float, float]:
        span = 1.0 - self.low
        return self.left + SIZE * (x - self.low) / span, TOP + SIZE * (1.0 - y) / span

    def curve(self, x: list[float], y: list[float], colour: str, *, dashed: bool = False) -> None:
        points = "L".join("{:.1f} {:.1f}".format(*self.at(a, b)) for a, b in zip(x, y, strict=True))
        dash = ' stroke-dasharray="4 4"' if dashed else ""
        self.parts.append(f'<path d="M{points}" fill="none" stroke="{colour}" stroke-width="1.6"{dash}/>')

    def word(self, line: int, text: str, colour: str, *, below: bool = False) -> None:
        x, y = (
            (self.left + 66, TOP + SIZE - 34 + 16 * line) if below else (self.left + 12, TOP + 18 + 16 * line)
        )
        self.parts.append(f'<text x="{x}" y="{y}" fill="{colour}">{text}</text>')


def ranking() -> Panel:
    """Pairs of drops."""
    found = json.loads((HERE / "ranking.json").read_text())
    title = "Worse than another: said and true"
    panel = Panel(LEFT, 0.4, title, "said [%]", "true [%]")
    shift = 0.004
    for line, (name, colour) in enumerate(
        zip(("usual impulses", "likeliest impulses"), COLOURS, strict=False)
    ):
        told = found[name]["worse_than_another"]
        panel.word(line, f"{name}: {found[name]['drops']} drops, {told['pairs']} pairs", colour, below=True)
        rows = told["diagram"]
        panel.curve([one["said"] for one in rows], [one["true"] for one in rows], colour)
        for one in rows:
            low, high = wilson(one["true"], one["pairs"])
            x, y_low = panel.at(one["said"] + shift * (2 * line - 1), max(low, panel.low))
            y_high, y = panel.at(0.0, high)[1], panel.at(0.0, one["true"])[1]
            panel.parts.append(
                f'<path d="M{x:.1f} {y_low:.1f}V{y_high:.1f}" stroke="{colour}"/>'
                f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{colour}"/>'
            )
    return panel


def prediction() -> Panel:
    """Places of the true drops among the predicted ones."""
    found = json.loads((HERE / "prediction.json").read_text())
    panel = Panel(
        LEFT + SIZE + 110,
        0.0,
        "Next drop at 210 Hz: said and true",
        "predicted quantile [%]",
        "true drops below [%]",
    )
    count = sum(len(one["places"]["NDE.peak_force"][:25]) for one in found["machines"])
    band = float(kstwo.ppf(0.9, count))
    grid = np.linspace(0.0, 1.0, 51)
    upper = ["{:.1f} {:.1f}".format(*panel.at(x, min(x + band, 1.0))) for x in grid]
    lower = ["{:.1f} {:.1f}".format(*panel.at(x, max(x - band, 0.0))) for x in grid[::-1]]
    panel.parts.append(f'<path d="M{"L".join(upper + lower)}Z" fill="#5b6875" fill-opacity="0.16"/>')
    for line, (name, colour) in enumerate(zip(found["quantities"], COLOURS, strict=True)):
        places = np.sort(np.concatenate([one["places"][name][:25] for one in found["machines"]]))
        below = [float(np.mean(places <= x)) for x in grid]
        panel.curve(grid.tolist(), below, colour)
        panel.word(line, name.replace(".", ", ").replace("_", " "), colour)
    return panel


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    body = "\n".join(part for panel in (ranking(), prediction()) for part in panel.parts)
    asked.out.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {TOP + SIZE + 50}" '
        f'font-family="system-ui, sans-serif" font-size="12" fill="#1c2733">\n'
        f'<rect width="{WIDTH}" height="{TOP + SIZE + 50}" fill="#fff"/>\n{body}\n</svg>\n',
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
