"""The parts of a report that describe the machine: friction law, weight shares, defaults in use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rotordrop.report.content import Figure, Section, Table
from rotordrop.report.friction_curve import FrictionLaw, friction_curve_figure

if TYPE_CHECKING:
    from rotordrop.machine import Machine


def machine_sections(machine: Machine) -> tuple[Section, ...]:
    """Friction law, and the values that were not given."""
    return (friction_section(machine), *defaults_section(machine))


def friction_section(machine: Machine) -> Section:
    """Friction law of every bearing (Neisi 2020, Fig. 2); equal laws share one curve."""
    laws: dict[tuple[float, float, float, float], list[str]] = {}
    for bearing in machine.touchdown_bearings:
        friction = bearing.friction
        numbers = (friction.static, friction.dynamic, friction.stribeck_speed, friction.smoothing_speed)
        key = (float(numbers[0]), float(numbers[1]), float(numbers[2]), float(numbers[3]))
        laws.setdefault(key, []).append(bearing.name)
    curves = [
        FrictionLaw(
            label=", ".join(names),
            static=law[0],
            dynamic=law[1],
            stribeck_speed=law[2],
            smoothing_speed=law[3],
        )
        for law, names in laws.items()
    ]
    caption = "Friction between rotor and race; a cubic replaces the jump at zero speed (Neisi 2020, Fig. 2)."
    figure = Figure(chart=friction_curve_figure(curves), caption=caption)
    return Section(heading="Friction law", figures=(figure,))


def drawing_section(machine: Machine) -> Section:
    """The rotor to scale with everything that sits on it."""
    from rotordrop.report.rotor_drawing import rotor_figure

    caption = "The rotor to scale. Bearings, AMBs and sensors stand at their nodes."
    return Section(heading="Rotor", figures=(Figure(chart=rotor_figure(machine), caption=caption),))


def defaults_section(machine: Machine) -> tuple[Section, ...]:
    """Values of the machine that were defaulted or inferred, with the reason; empty where all were given."""
    tables = tuple(
        Table(
            columns=("value of the machine", "used", "why"),
            rows=tuple((spoken_key(key), *told) for key, *told in found),
            caption=caption,
        )
        for caption, found in (("Defaults in use", machine.defaults_in_use), ("Inferred", machine.inferred))
        if found
    )
    text = "These values were not in the machine file. Give them there if they are known."
    return (Section(heading="Values that were not given", text=(text,), tables=tables),) if tables else ()


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
