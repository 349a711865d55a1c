"""The start of a simulated drop from what the user writes, such as ``--place "NDE: 10 um, -5 um"``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rotordrop.errors import UsageError
from rotordrop.units import parse_quantity

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.simulation.case import Start

_STARTS = ("centred", "levitated", "given")


def start_of(name: str, machine: Machine, places: list[str], velocities: list[str]) -> Start:
    """The start a user asks for: by name, with places and velocities at the bearings when given."""
    from rotordrop.simulation.case import CentredStart, LevitatedStart, PlacedStart

    if name not in _STARTS:
        raise UsageError(f"--start is {name!r}; choose one of {', '.join(_STARTS)}")
    if name != "given":
        if places or velocities:
            raise UsageError(f"--place and --velocity belong to '--start given', not to '--start {name}'")
        return CentredStart() if name == "centred" else LevitatedStart()
    if not places:
        raise UsageError(f"'--start given' needs a --place for each bearing: {_bearing_names(machine)}")
    return PlacedStart(
        displacement=_per_bearing("--place", places, machine, "length", needed=True),
        velocity=_per_bearing("--velocity", velocities, machine, "velocity", needed=False),
    )


def _bearing_names(machine: Machine) -> str:
    return ", ".join(bearing.name for bearing in machine.touchdown_bearings)


def _per_bearing(option: str, texts: list[str], machine: Machine, kind: str, *, needed: bool) -> Any:
    """Values (B, 2) from texts such as ``"NDE: 10 um, -5 um"``."""
    import numpy as np

    found: dict[str, tuple[float, float]] = {}
    for text in texts:
        name, colon, rest = text.partition(":")
        parts = rest.split(",")
        if not colon or len(parts) != 2:
            raise UsageError(f'{option} {text!r} is not of the form "NDE: x, y" with two values and units')
        found[name.strip()] = (parse_quantity(parts[0].strip(), kind), parse_quantity(parts[1].strip(), kind))
    names = [bearing.name for bearing in machine.touchdown_bearings]
    unknown = sorted(found.keys() - set(names))
    if unknown:
        raise UsageError(f"{option} names the bearing {unknown[0]!r}; the machine has {', '.join(names)}")
    missing = [name for name in names if name not in found]
    if needed and missing:
        raise UsageError(
            f"{option} is missing for the bearing {missing[0]}; give one for each of {', '.join(names)}"
        )
    return np.array([found.get(name, (0.0, 0.0)) for name in names])
