"""How a simulated drop starts, from what was written on the command line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rotordrop.errors import UsageError
from rotordrop.units import parse_quantity

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rotordrop.machine import Machine
    from rotordrop.simulate.case import LevitatedStart, PlacedStart

_EXAMPLES = {"length": "10 um, -20 um", "velocity": "0 mm/s, -5 mm/s", "force": "0 N, 40 N"}


def named_pairs(texts: Sequence[str], kind: str, names: Sequence[str]) -> NDArray[np.float64]:
    """Read entries such as ``"NDE: 10 um, -20 um"`` into SI values, shape (names, 2), zero where not named.

    Parameters
    ----------
    texts : sequence of str
        A name, a colon, and a horizontal and a vertical quantity.
    kind : str
        Kind of both quantities, as in `rotordrop.units.KINDS`.
    names : sequence of str
        All names there are.

    Examples
    --------
    >>> from rotordrop.cli._start import named_pairs
    >>> named_pairs(["DE: 10 um, -20 um"], "length", ["NDE", "DE"]).tolist()
    [[0.0, 0.0], [1e-05, -2e-05]]
    """
    import numpy as np

    if texts and not names:
        raise UsageError(f"{texts[0]!r} names a part of the machine, which has none of this kind")
    values = np.zeros((len(names), 2))
    for text in texts:
        name, _, pair = text.rpartition(":")
        parts = pair.split(",")
        if name.strip() not in names or len(parts) != 2:
            raise UsageError(
                f"{text!r} is not 'NAME: horizontal, vertical' with a name out of {', '.join(names)}; "
                f"write for example '{names[0]}: {_EXAMPLES[kind]}'"
            )
        values[list(names).index(name.strip())] = [parse_quantity(part, kind) for part in parts]
    return values


def placed_start(machine: Machine, displacements: Sequence[str], velocities: Sequence[str]) -> PlacedStart:
    """Start from given displacements and velocities at the touchdown bearings; zero where not given."""
    from rotordrop.simulate.case import PlacedStart

    names = [bearing.name for bearing in machine.touchdown_bearings]
    return PlacedStart(
        displacement=named_pairs(displacements, "length", names),
        velocity=named_pairs(velocities, "velocity", names),
    )


def levitated_start(
    machine: Machine, rotor_angle: float, delay: float, remanent_force: Sequence[str], decay: float
) -> LevitatedStart:
    """Start on the synchronous orbit in the AMBs, with what the magnets still do after power-off."""
    from rotordrop.simulate.case import LevitatedStart

    names = [amb.name for amb in machine.ambs]
    return LevitatedStart(
        rotor_angle=rotor_angle,
        delay=delay,
        remanent_force=named_pairs(remanent_force, "force", names) if remanent_force else None,
        remanence_time_constant=decay,
    )
