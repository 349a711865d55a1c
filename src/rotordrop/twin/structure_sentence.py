"""What an extension that was kept says of the machine, in one sentence with intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from rotordrop.elements.magnet import REMANENCE_TIME
from rotordrop.estimate.estimate import Structure
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop.rotor.unknowns import PEAK_LOADS
from rotordrop.twin.structure_search import Kept

Values = Mapping[str, Known]
"""Values found, by path."""


def structure_of(kept: Kept, machine: Machine, values: Values) -> Structure:
    """What an extension that was kept says of the machine, with 90 % intervals in brackets."""
    name = kept.extension.name
    return Structure(name=name, gain=kept.gain, sentence=f"Found: {_SENTENCES[name](machine, values)}.")


def derived(function: Callable[..., float], *known: Known) -> tuple[float, float, float]:
    """A number that follows from values, with its 90 % interval; their errors count as independent."""
    middle = [one.value for one in known]
    square = 0.0
    for k, one in enumerate(known):
        low, high = one.interval_90 or (one.value, one.value)
        ends = [function(*middle[:k], end, *middle[k + 1 :]) for end in (low, high)]
        square += (0.5 * (ends[1] - ends[0])) ** 2
    value, half = function(*middle), math.sqrt(square)
    return value, value - half, value + half


def _text(number: tuple[float, float, float], unit: str, scale: float = 1.0) -> str:
    value, low, high = (one / scale for one in number)
    gap = "" if unit in ("", "°") else " "
    digits = max(0, min(4, 1 - math.floor(math.log10(max(high - low, 1e-12)))))
    return f"{value:.{digits}f}{gap}{unit} ({low:.{digits}f} to {high:.{digits}f})"


def _same(value: float) -> float:
    return value


def soft_axis(ratio: float, coupling: float) -> float:
    """Angle of the soft axis from horizontal [°], between -90 and 90, of a support with turned axes.

    Parameters
    ----------
    ratio : float
        Horizontal over vertical stiffness [1].
    coupling : float
        Coupling over the geometric mean of both [1].
    """
    # The stiff axis stands at half the angle of (k_x - k_y, 2 k_xy); the soft one across.
    stiff = 0.5 * math.atan2(2.0 * coupling * math.sqrt(ratio), ratio - 1.0)
    turned = math.degrees(stiff) + 90.0
    return turned - 180.0 if turned > 90.0 else turned


def soft_over_stiff(ratio: float, coupling: float) -> float:
    """Stiffness along the soft axis over that along the stiff one [1]; arguments as of `soft_axis`."""
    middle, apart = 0.5 * (ratio + 1.0), math.hypot(0.5 * (ratio - 1.0), coupling * math.sqrt(ratio))
    return (middle - apart) / (middle + apart)


def _axes(machine: Machine, values: Values) -> str:
    parts = []
    for bearing in machine.touchdown_bearings:
        own = values[f"{bearing.name}.support.anisotropy"], values[f"{bearing.name}.support.coupling"]
        angle, ratio = derived(soft_axis, *own), derived(soft_over_stiff, *own)
        parts.append(
            f"the soft axis of the {bearing.name} support stands {_text(angle, '°')} from horizontal, with "
            f"{_text(ratio, '')} × the stiffness across"
        )
    return "; ".join(parts)


def _cubic(machine: Machine, values: Values) -> str:
    load = PEAK_LOADS * float(sum(bearing_load_shares(machine))) / len(machine.touchdown_bearings)
    parts = []
    for bearing in machine.touchdown_bearings:
        stiffness = values[f"{bearing.name}.support.stiffness"].value
        growth = derived(lambda k_3, h=load / stiffness: k_3 * h * h, values[f"{bearing.name}.support.cubic"])
        parts.append(f"{bearing.name} {_text(growth, '%', 0.01)}")
    return (
        f"supports whose stiffness changes with load, at the deflection of {PEAK_LOADS:g} mean loads by "
        f"{', '.join(parts)}"
    )


def _foundation(machine: Machine, values: Values) -> str:
    parts = []
    for bearing in machine.touchdown_bearings:
        path = f"{bearing.name}.support"
        frequency = derived(_same, values[f"{path}.foundation_frequency"])
        share, mass = values[f"{path}.foundation_share"], values[f"{path}.mass"]
        modal = derived(lambda m, part: m / max(part, 1e-9), mass, share)
        parts.append(
            f"under {bearing.name} a foundation mode at {_text(frequency, 'Hz', 2.0 * math.pi)} with a modal "
            f"mass of {_text(modal, 'kg')}"
        )
    return "; ".join(parts)


def _sensors(key: str, unit: str, scale: float, text: str) -> Callable[[Machine, Values], str]:
    def said(machine: Machine, values: Values) -> str:
        found = {s.name: values.get(f"sensors.{s.name}.{key}") for s in machine.sensors}
        parts = [f"{n} {_text(derived(_same, v), unit, scale)}" for n, v in found.items() if v is not None]
        return text.format(", ".join(parts))

    return said


def _remanence(_machine: Machine, values: Values) -> str:
    time = derived(_same, values["remanence.time_constant"])
    usual = f"the usual {1e3 * REMANENCE_TIME:g} ms"
    side = f"longer than {usual}" if time[1] > REMANENCE_TIME else f"shorter than {usual}"
    if time[1] <= REMANENCE_TIME <= time[2]:
        side = f"not to be told from {usual}"
    return f"the lift of the magnets decays in {_text(time, 'ms', 1e-3)}, {side}"


def _unbalance(machine: Machine, values: Values) -> str:
    parts = []
    for i, unbalance in enumerate(machine.unbalances):
        along = (values[f"unbalance.{i}.cosine"], values[f"unbalance.{i}.sine"])
        parts.append(f"{_text(derived(math.hypot, *along), 'g mm', 1e-6)} at node {unbalance.node}")
    return f"an unbalance beyond the described one: {', '.join(parts)}"


def _modulus(_machine: Machine, values: Values) -> str:
    factor = derived(_same, values["rotor.stiffness_factor"])
    return f"the rotor bends as if its stiffness were {_text(factor, '')} × the described one"


_SENTENCES: dict[str, Callable[[Machine, Values], str]] = {
    "turned support axes": _axes,
    "cubic support": _cubic,
    "foundation mode": _foundation,
    "sensor lag": _sensors("time_constant", "µs", 1e-6, "sensors that lag behind by {}"),
    "cross-axis sensitivity": _sensors(
        "cross_axis", "%", 0.01, "sensors that read part of the motion across: {}"
    ),
    "brackets that follow the housing": _sensors(
        "follows_housing",
        "%",
        0.01,
        "brackets that make part of the motion of the housing: {}",
    ),
    "sensor planes elsewhere": _sensors(
        "plane_offset", "mm", 1e-3, "sensors that stand beside their node: {}"
    ),
    "long remanence": _remanence,
    "unbalance beyond its grade": _unbalance,
    "rotor stiffness": _modulus,
}
