"""Lines of a coast-down: which frequencies are there, do they follow the speed, what are they called."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

from rotordrop.document import stated
from rotordrop.errors import RecordError
from rotordrop.spectrum._search import LineSearch
from rotordrop.spectrum._views import HIGHEST_ORDER, Clock, FoundLine, SeenLine
from rotordrop.spectrum.candidates import (
    CONICAL,
    PENDULUM,
    Candidate,
    LineEvidence,
    Name,
    harmonic_candidates,
    mixed_candidates,
    name_line,
)
from rotordrop.spectrum.speed import FrequencyPath, SpeedProfile
from rotordrop.spectrum.waterfall import FEWEST_POINTS, PlanarSignal, reduce_rate


@dataclass(frozen=True, kw_only=True)
class Line(SeenLine, Name):
    """One line of a coast-down with its name, whose confidence is also that of the line."""

    amplitude: float
    """Zero-to-peak [m], in the plane and direction where it is largest, root mean square over its time."""
    amplitude_xy: dict[str, tuple[float, float]]
    """Zero-to-peak amplitude [m] of (x, y) in each plane, root mean square over its time."""
    forward: dict[str, float]
    backward: dict[str, float]
    """Radii of the forward and backward turning parts [m] in each plane, root mean square over its time."""
    path: FrequencyPath
    """Its frequency over time [Hz]."""

    def as_json(self) -> dict[str, Any]:
        """Everything known about the line, ready for JSON; amplitudes are zero-to-peak in m."""
        return stated(
            self,
            "kind label named confidence reason frequency_hz frequency_error_hz order order_error drift_hz "
            "width_hz amplitude_zero_to_peak_m=amplitude amplitude_xy_zero_to_peak_m=amplitude_xy forward_m "
            "backward_m floor_zero_to_peak_m=floor ratio_to_floor=ratio first_seen_s last_seen_s candidates",
            confidence=round(self.confidence, 4),
            candidates=[stated(match, "name=candidate.name probability deviation") for match in self.matches],
        )


MOST_LINES = 60
"""The search stops after so many lines [1]."""

SWING_ERROR = 0.05
"""How well the frequency of a wandering swing is known at any time [Hz] (chosen)."""


def find_lines(
    planes: Mapping[str, PlanarSignal],
    sampling_rate: float,
    profile: SpeedProfile | None,
    *,
    start_time: float = 0.0,
    skip: float = 0.0,
    candidates: Sequence[Candidate] = (),
    air_gap: float | None = None,
    highest_frequency: float = 1000.0,
    most_lines: int = MOST_LINES,
) -> tuple[Line, ...]:
    """Find the lines of a coast-down one after the other, the clearest first, and name those that can be
    named.

    The signal is looked at over frequency and, in frames of equal rotor angle, over order. The peak that
    noise explains worst is taken, followed through the whole record, taken out of the signal, and the search
    goes on with the rest: so a strong order does not appear as a steady line where it is smeared, nor a
    strong steady line as an order. Afterwards sums and differences of orders and steady lines are looked for.

    The displacement in each plane (N, 2) [m] begins with power-off. Without a profile of the speed every line
    stays undecided; ``skip`` leaves out so much of the beginning [s], since a rotor that bounces shows
    everything at once; the air gap [m] is needed to recognise whirl; lines lie up to the highest frequency
    [Hz], so many at most. The strongest line comes first.

    Source: own method; names after Neisi 2020, section 5.4.
    """
    if not planes:
        raise RecordError("lines: no plane given, at least one displacement (N, 2) is needed")
    highest = min(highest_frequency, 0.4 * sampling_rate)

    def lines_of(displacement: PlanarSignal) -> list[FoundLine]:
        thin, rate = reduce_rate(displacement, sampling_rate, highest, samples_per_turn=2.7)
        first = round(skip * rate)
        if len(thin) - first < FEWEST_POINTS:  # the record ends while the rotor bounces
            return []
        clock = Clock(
            len(thin) - first,
            rate,
            profile,
            start_time=start_time + first / rate,
            highest_frequency=highest,
        )
        return LineSearch(thin[first:], clock, most_lines).run()

    # One plane after the other: side by side they would hold twice the memory for a third less time.
    found = [(plane, line) for plane, moved in planes.items() for line in lines_of(moved)]
    bands = (highest, HIGHEST_ORDER)
    lines = _joined(name_lines(found, candidates, air_gap, bands))
    return tuple(sorted(lines, key=lambda line: -line.amplitude))


def name_lines(
    found: Sequence[tuple[str, FoundLine]],
    candidates: Sequence[Candidate],
    air_gap: float | None,
    bands: tuple[float, float],
) -> list[Line]:
    """Name fundamental lines first; those named give the candidates for their harmonics and combinations."""

    def named(plane: str, line: FoundLine, choice: Sequence[Candidate]) -> Line:
        return _line(line, plane, name_line(_evidence(line, plane, bands), choice, air_gap=air_gap))

    single = [(plane, line) for plane, line in found if line.parent is None]
    lines = [named(plane, line, candidates) for plane, line in single]
    for _ in range(2):  # the pendulum gives the conical swing its name, both give theirs to what they mix to
        swings: dict[tuple[str, str], FoundLine] = {}  # of each name the strongest of a plane
        for (plane, line), result in sorted(
            zip(single, lines, strict=True), key=lambda at: at[0][1].strength
        ):
            if result.named and result.kind in ("steady", "undecided") and (name := _swing(result)):
                swings[plane, name] = line
        lines = [
            named(plane, line, (*candidates, *of_swings(line, _parents(plane, line, swings), candidates)))
            for plane, line in single
        ]
    label = {
        line: (result.label if result.named else f"{line.frequency:.1f} Hz")
        for (_, line), result in zip(single, lines, strict=True)
    }
    return lines + [
        _line(line, plane, _combination_name(line, label[line.parent]))
        for plane, line in found
        if line.parent
    ]


def _combination_name(line: FoundLine, parent: str) -> Name:
    order = abs(line.multiple)
    sign = "+" if line.multiple > 0 else "−"
    label = f"{parent} {sign} {order:g}X"
    reason = (
        f"moves with {line.multiple:+g} times the rotor speed from the {parent} line: both modulate each "
        f"other, as in a contact that is not linear"
    )
    return Name(label=label, named=True, confidence=0.95, reason=reason, matches=())


def _joined(lines: Sequence[Line]) -> list[Line]:
    """One entry for a line seen in several planes at the same place."""
    result: list[Line] = []
    for line in lines:
        twin = next((k for k, other in enumerate(result) if _same(line, other)), None)
        if twin is None:
            result.append(line)
        else:
            result[twin] = _merged(result[twin], line)
    return result


def _same(line: Line, other: Line) -> bool:
    """Whether two entries are one line: in two planes, or in one at two times or within their errors.

    Where both ends swing at one frequency, the rotor swings as a whole.
    """
    swings = line.named and other.named and _swing(line) == _swing(other) == PENDULUM
    if line.label != other.label and (line.named or other.named) and not swings:
        return False
    apart = line.first_seen >= other.last_seen - 1.0 or other.first_seen >= line.last_seen - 1.0
    off, error = abs(line.frequency - other.frequency), line.frequency_error + other.frequency_error
    reach = 0.15 + 3.0 * error
    if line.order is not None and other.order is not None:
        off, error, reach = abs(line.order - other.order), error * line.order / line.frequency, 0.01
    if set(line.forward) & set(other.forward) and not (off <= error or (line.named and apart)):
        return False
    if "combination" in (line.kind, other.kind):
        return line.kind == other.kind
    return off <= reach and (line.kind == other.kind or "undecided" in (line.kind, other.kind))


def _merged(line: Line, other: Line) -> Line:
    strong, weak = (line, other) if line.amplitude >= other.amplitude else (other, line)
    alike = line.label == other.label or not line.named
    return replace(
        strong,
        label=strong.label if alike else f"{PENDULUM} {' and '.join({**line.forward, **other.forward})}",
        reason=strong.reason if alike else f"{line.reason}; {other.reason}",
        amplitude_xy={**weak.amplitude_xy, **strong.amplitude_xy},
        forward={**weak.forward, **strong.forward},
        backward={**weak.backward, **strong.backward},
        first_seen=min(line.first_seen, other.first_seen),
        last_seen=max(line.last_seen, other.last_seen),
        confidence=max(line.confidence, other.confidence),
    )


def _swing(line: Line) -> str:
    """What a swing or whirl is called at either end, of which multiples are seen; nothing of other lines."""
    family = line.matches[0].candidate.family if line.matches else line.label
    return family if family in (PENDULUM, CONICAL) or not line.matches else ""


def _parents(
    plane: str, line: FoundLine, swings: Mapping[tuple[str, str], FoundLine]
) -> list[tuple[str, FoundLine]]:
    """Swings that a line can be of: no weaker than it, those of its own plane where that has them."""
    return [
        (name, swing)
        for (seen, name), swing in swings.items()
        if swing.strength >= line.strength and (seen == plane or (plane, name) not in swings)
    ]


def of_swings(
    line: FoundLine, swings: Sequence[tuple[str, FoundLine]], candidates: Sequence[Candidate] = ()
) -> list[Candidate]:
    """Where what each swing leads to would be seen, as it wanders, while this line was there.

    These are its multiples, what the candidates know as a share of a pendulum, and sums and differences with
    the conical swing.
    """
    total = float(line.power.sum())
    if total == 0.0:
        return []
    others = [
        (name, float(line.power @ swing.path) / total, swing.frequency_error + SWING_ERROR)
        for name, swing in swings
        if swing is not line
    ]
    found = [one for other in others for one in harmonic_candidates(*other)]
    pendulums = [other for other in others if other[0] == PENDULUM]
    found += [
        replace(one, value=one.value * hertz, tolerance=one.tolerance * hertz, of_swing=False)
        for one in candidates
        if one.of_swing
        for _, hertz, _ in pendulums
    ]
    found += [
        mixed
        for name, hertz, _ in others
        if name == CONICAL
        for other, beside, _ in pendulums
        for mixed in mixed_candidates((name, other), (hertz, beside))
    ]
    return found


def _evidence(found: FoundLine, plane: str, bands: tuple[float, float]) -> LineEvidence:
    forward, backward = float(found.forward[0]), float(found.backward[0])
    return LineEvidence(
        kind=found.kind,
        frequency=found.frequency,
        frequency_error=found.frequency_error,
        order=found.order if found.order is not None else 0.0,
        order_error=found.order_error if found.order_error is not None else math.inf,
        roundness=(forward - backward) / max(forward + backward, 1e-300),
        radius=forward + backward,
        plane=plane,
        band=bands[0],
        order_band=bands[1],
        width=found.width,
    )


def _line(found: FoundLine, plane: str, name: Name) -> Line:
    seen = {one.name: getattr(found, one.name) for one in fields(SeenLine)}
    return Line(
        **{**seen, **vars(name), "confidence": name.confidence * found.existence},
        amplitude=float(found.amplitude.max()),
        amplitude_xy={plane: (float(found.amplitude[0]), float(found.amplitude[1]))},
        forward={plane: float(found.forward[0])},
        backward={plane: float(found.backward[0])},
        path=found.path_of_frequency(),
    )
