"""A film of a drop for a letter: the rotor centre in every bearing, slowed down, as an animated GIF."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.errors import OutputError
from rotordrop.estimate.bearing_drop import BearingDrop
from rotordrop.files import atomic_path
from rotordrop.report.quantity import NO_BREAK, THIN_SPACE, Quantity, round_steps

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

SUFFIX = ".gif"
FRAMES, FRAME_TIME = 300, 0.04
"""Frames of a film, and how long each is shown [s]: twelve seconds for a drop, chosen."""
TRAIL, POINTS = 20, 8
"""Frames of which the path stays visible behind the rotor centre, and its points in each [1]; chosen."""
PANEL, HEAD, FOOT = 340, 30, 92
"""Side of a bearing's square, and heights of the text above and below it [px]."""
REACH = 0.6
"""Largest displacement or air gap over half the side of the square [1]: the arrow has room outside."""
ARROW = 0.18
"""Longest arrow over the side of the square [1]."""
FINER = 2
"""Every frame is drawn so many times finer and averaged, for even lines [1]."""
SHADES = 8
"""Steps from paper to each colour [1]; of a multiple of them there is room in a GIF."""
PAPER, INK, MUTED, PATH, ROTOR, LIMIT, FORCE = (
    "#ffffff",
    "#1c2733",
    "#5b6875",
    "#a9cdee",
    "#1c7ed6",
    "#b3261e",
    "#d9780a",
)


def require_film(path: Path) -> None:
    """Refuse a file that is no GIF, or a computer without the package that writes one."""
    if path.suffix.lower() != SUFFIX:
        raise OutputError(f"{path}: {path.suffix or 'no suffix'!r} is not a format of films; write {SUFFIX}")
    if find_spec("PIL") is None:
        raise OutputError(
            f"{path}: a film needs a package that is not installed; install it with "
            "pip install 'rotordrop[film]'"
        )


def write_film(
    bearings: Sequence[BearingDrop], path: Path, *, simulated: bool = False, certain: bool = True
) -> None:
    """Write the film of a drop: the path of the rotor centre and its load, a panel per bearing.

    Parameters
    ----------
    bearings : sequence of BearingDrop
        What happened at every bearing.
    path : Path
        The file to write, ``.gif``.
    simulated : bool
        Whether the drop or its record is simulated, which every frame then says.
    certain : bool
        Whether the peak may be stated as a number; its range stands alone otherwise.

    Raises
    ------
    OutputError
        If the file cannot be written, has another suffix, or the package Pillow is missing.
    """
    require_film(path)
    panels = [_Panel(bearing, place, certain) for place, bearing in enumerate(bearings)]
    frames = _frames(panels, "simulated" if simulated else "")
    first = next(frames)
    with atomic_path(path) as temporary:
        first.save(
            temporary,
            format="GIF",
            save_all=True,
            append_images=frames,
            duration=round(1e3 * FRAME_TIME),
            loop=0,
        )


def _frames(panels: Sequence[_Panel], mark: str) -> Iterator[Image]:
    """The frames of a film, each in a few colours."""
    from PIL.Image import Dither

    start = max(panel.time[0] for panel in panels)
    times = np.linspace(start, min(panel.time[-1] for panel in panels), FRAMES + 1)
    slower = FRAME_TIME / (times[1] - times[0])
    for panel in panels:
        panel.follow(times)
    empty, palette = _empty(panels), _palette()
    for number in range(FRAMES):
        image = empty.copy()
        draw = _drawing(image)
        for panel in panels:
            panel.draw(draw, number)
        words = f"{1e3 * times[number + 1]:.1f} ms from power-off, shown {slower:.0f} times slower"
        _text(draw, 12, HEAD + PANEL + FOOT - 24, f"{words} · {mark}" if mark else words, INK)
        yield image.reduce(FINER).quantize(palette=palette, dither=Dither.NONE)


def _palette() -> Image:
    """The colours of all frames: what stays the same keeps its bits, and is stored once."""
    from PIL import Image, ImageColor

    paper, found = np.array(ImageColor.getrgb(PAPER)), []
    for colour in (INK, MUTED, PATH, ROTOR, LIMIT, FORCE):
        for share in np.linspace(0.0, 1.0, SHADES):
            found += [round(v) for v in paper + share * (np.array(ImageColor.getrgb(colour)) - paper)]
    image = Image.new("P", (1, 1))
    image.putpalette(found)
    return image


def _empty(panels: Sequence[_Panel]) -> Image:
    """What stays the same in all frames."""
    from PIL import Image

    size = FINER * PANEL * len(panels), FINER * (HEAD + PANEL + FOOT)
    image = Image.new("RGB", size, PAPER)
    draw = _drawing(image)
    for panel in panels:
        panel.draw_ground(draw)
    return image


def _drawing(image: Image) -> ImageDraw:
    from PIL import ImageDraw

    return ImageDraw.Draw(image)


def _text(draw: ImageDraw, x: float, y: float, words: str, colour: str) -> None:
    from PIL import ImageFont

    plain = words.replace(THIN_SPACE, " ").replace(NO_BREAK, " ")  # the font of Pillow has neither
    draw.text((FINER * x, FINER * y), plain, fill=colour, font=ImageFont.load_default(13.0 * FINER))


class _Panel:
    """One bearing in a film."""

    def __init__(self, bearing: BearingDrop, place: int, certain: bool) -> None:
        self.bearing, self.motion, self.certain = bearing, bearing.motion, certain
        self.time = self.motion.time
        self.left = PANEL * place
        gap = 0.0 if bearing.air_gap is None else bearing.air_gap.upper
        self.reach = max(gap, float(np.nanmax(self.motion.radial.values)))
        self.scale = 0.5 * PANEL * REACH / self.reach

    def follow(self, times: np.ndarray) -> None:
        """Take the path up to the end of every frame, and the force there."""
        finer = np.linspace(times[0], times[-1], POINTS * FRAMES + 1)
        at = [np.interp(finer, self.time, self.motion.displacement[:, axis]) for axis in (0, 1)]
        self.path = np.stack(at, axis=1)
        time, vector = self.bearing.force.time, self.bearing.force_vector
        if vector is not None:
            # the balls push the race back where the rotor presses it away
            along = [np.interp(times[1:], time, -vector[:, axis]) for axis in (0, 1)]
            self.push = np.stack(along, axis=1) / self.bearing.peak_force.value

    def point(self, place: np.ndarray) -> tuple[float, float]:
        """Where a displacement [m] lies in a frame [px]."""
        x, y = self.left + 0.5 * PANEL + self.scale * place[0], HEAD + 0.5 * PANEL - self.scale * place[1]
        return FINER * float(x), FINER * float(y)

    def draw_ground(self, draw: ImageDraw) -> None:
        """The name, the clearance circles, a scale and what the arrow means."""
        _text(draw, self.left + 12, 8, f"{self.bearing.name}, gravity downwards", INK)
        gap = self.bearing.air_gap
        for radius in () if gap is None else {gap.lower, gap.upper}:
            corner = np.array([radius, -radius])
            draw.ellipse((*self.point(-corner), *self.point(corner)), outline=LIMIT, width=FINER)
        length, left, foot = round_steps(self.reach)[0], self.left + 12, HEAD + PANEL
        ends = (FINER * left, FINER * foot), (FINER * (left + self.scale * length), FINER * foot)
        draw.line(ends, fill=INK, width=2 * FINER)
        _text(draw, left, foot + 4, Quantity(value=length, kind="dimension", digits=1).text, MUTED)
        if self.bearing.force_vector is not None:
            peak = Quantity.of(self.bearing.peak_force.known, "force", range_only=not self.certain)
            arrow = FINER * ARROW * PANEL
            _arrow(draw, (FINER * left, FINER * (foot + 33)), (FINER * left + arrow, FINER * (foot + 33)))
            beside = left + ARROW * PANEL + 8
            _text(draw, beside, foot + 24, f"largest bearing force, {peak.text}", FORCE)
            if peak.interval_text:
                _text(draw, beside, foot + 42, f"(90 %: {peak.interval_text})", FORCE)

    def draw(self, draw: ImageDraw, number: int) -> None:
        """The path so far, the rotor centre, and the force where its direction is known."""
        chosen = self.path[POINTS * max(0, number + 1 - TRAIL) : POINTS * (number + 1) + 1]
        trail = [self.point(place) for place in chosen]
        draw.line(trail, fill=PATH, width=2 * FINER, joint="curve")
        x, y = trail[-1]
        if self.bearing.force_vector is not None:
            push = self.push[number]
            _arrow(draw, (x, y), (x + FINER * ARROW * PANEL * push[0], y - FINER * ARROW * PANEL * push[1]))
        size = 5 * FINER
        draw.ellipse((x - size, y - size, x + size, y + size), fill=ROTOR)


def _arrow(draw: ImageDraw, start: tuple[float, float], end: tuple[float, float]) -> None:
    """A line with a head that is no longer than it."""
    way = end[0] - start[0], end[1] - start[1]
    length = math.hypot(*way)
    if length < FINER:
        return
    along, head = (way[0] / length, way[1] / length), min(10.0 * FINER, length)
    draw.line((start, end), fill=FORCE, width=3 * FINER)
    back = end[0] - head * along[0], end[1] - head * along[1]
    side = -0.5 * head * along[1], 0.5 * head * along[0]
    corners = [end, (back[0] + side[0], back[1] + side[1]), (back[0] - side[0], back[1] - side[1])]
    draw.polygon(corners, fill=FORCE)
