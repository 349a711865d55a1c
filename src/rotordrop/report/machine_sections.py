"""The parts of a report that describe the machine: drawing, friction law, weight shares, defaults in use."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import plotly.graph_objects as go

from rotordrop.physics.friction import stribeck_coefficient
from rotordrop.report.content import Column, Figure, Section, table
from rotordrop.report.style import SERIES, axis_title, curve, fit_legend, panels

if TYPE_CHECKING:
    from rotordrop.machine import Machine

POINTS = 801
NOT_GIVEN = "These values were not in the machine file. Give them there if they are known."
DRAWN = "The rotor to scale. Bearings, AMBs and sensors stand at their nodes."
FRICTION = "Friction between rotor and race; a cubic replaces the jump at zero speed (Neisi 2020, Fig. 2)."


def machine_sections(machine: Machine) -> tuple[Section, ...]:
    """Friction law, and the values that were not given."""
    figure = Figure(friction_curve_figure(machine), FRICTION)
    return (Section("Friction law", figures=(figure,)), *defaults_section(machine))


def friction_curve_figure(machine: Machine) -> go.Figure:
    """Draw friction over the relative surface speed (Neisi 2020, Fig. 2); equal laws share one curve.

    Left the whole law, right the smoothed passage through zero.
    """
    laws: dict[tuple[float, float, float, float], list[str]] = {}
    for bearing in machine.touchdown_bearings:
        rub = bearing.friction
        numbers = (rub.static, rub.dynamic, rub.stribeck_speed, rub.smoothing_speed)
        static, dynamic, stribeck, smoothing = map(float, numbers)
        key = (static, dynamic, stribeck, smoothing)
        laws.setdefault(key, []).append(bearing.name)
    whole = 5.0 * max(stribeck for _, _, stribeck, _ in laws)
    near = 4.0 * max(smoothing for *_, smoothing in laws)
    figure = panels(("whole law", "near zero speed"))
    for index, ((static, dynamic, stribeck, smoothing), names) in enumerate(laws.items()):
        law = (static, dynamic, stribeck, max(smoothing, 1e-12))
        for column, reach in enumerate((whole, near), start=1):
            speed = np.linspace(-reach, reach, POINTS)
            curve(
                figure,
                speed,
                np.array([stribeck_coefficient(float(v), *law) for v in speed]),
                ", ".join(names),
                column=column,
                colour=SERIES[index % len(SERIES)],
                width=1.7,
                legend=column == 1,
                hover="%{x:.4~g} m/s: %{y:.3f}",
            )
    figure.update_xaxes(title_text=axis_title("relative surface speed", "m/s"))
    figure.update_yaxes(title_text=axis_title("friction coefficient", "1"), col=1)
    return fit_legend(figure)


def drawing_section(machine: Machine) -> Section:
    """The rotor to scale with everything that sits on it."""
    from rotordrop.report.rotor_drawing import rotor_figure

    return Section("Rotor", figures=(Figure(rotor_figure(machine), DRAWN),))


def defaults_section(machine: Machine) -> tuple[Section, ...]:
    """Values of the machine that were defaulted or inferred, with the reason; empty where all were given."""
    columns = (
        Column("value of the machine", lambda row: spoken_key(row[0])),
        Column("used", lambda row: row[1]),
        Column("why", lambda row: row[2]),
    )
    tables = tuple(
        table(found, columns, caption)
        for caption, found in (("Defaults in use", machine.defaults_in_use), ("Inferred", machine.inferred))
        if found
    )
    return (Section("Values that were not given", (NOT_GIVEN,), tables=tables),) if tables else ()


def spoken_key(key: str) -> str:
    """A key of the machine file in words; entries of a list count from one."""
    words: list[str] = []
    for part in key.replace("_", " ").split("."):
        if part == "*" and words:
            words[-1] = f"every one of {words[-1]}"
        elif part.isdigit() and words:
            words[-1] = f"{words[-1]} {int(part) + 1}"
        else:
            words.append(part)
    return ", ".join(words)


def weight_shares(machine: Machine | None) -> dict[str, float]:
    """Share of the weight [N] by name of the bearing; empty without a machine."""
    if machine is None:
        return {}
    from rotordrop.rotor.statics import bearing_load_shares

    shares = bearing_load_shares(machine)
    return {
        bearing.name: float(share) for bearing, share in zip(machine.touchdown_bearings, shares, strict=True)
    }
