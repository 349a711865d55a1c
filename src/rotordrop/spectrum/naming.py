"""Giving a line its name: by comparing every candidate with the chance that it is none of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from rotordrop.spectrum.candidates import Candidate
from rotordrop.units import percent

LineKind = Literal["order", "steady", "combination", "undecided"]

SURE = 0.9
"""Probability from which a line is given a candidate's name [1] (chosen)."""

WORTH_LISTING = 0.05
"""Probability from which a candidate is listed [1] (chosen)."""
UNKNOWN_WEIGHT = 10.0
"""Weight of "something not on the list", anywhere in the band, against one candidate of weight 1: with 10 a
mode known to ± 20 Hz in a band of 1 kHz is only a question, one known to ± 3 Hz a name."""

NARROW = 0.3
"""Width [Hz] up to which a line can come from a source that holds its frequency: a power grid keeps within
± 0.05 Hz."""
STEADY_ERROR = 0.1
"""Error of its mean frequency [Hz] up to which it can."""

ROUND_ORBIT = 0.8
"""Roundness of the orbit of a whirl at least [1] (chosen); 1 is a circle, 0 a line."""
FLAT_ORBIT = 0.6
"""Roundness of the path of a swing at most [1] (chosen)."""


@dataclass(frozen=True, kw_only=True)
class LineEvidence:
    """What is known about a line when it is named."""

    kind: LineKind
    """Whether it follows the speed."""
    frequency: float
    frequency_error: float
    """[Hz]; at ``speed`` for an order."""
    order: float
    order_error: float
    """[1]."""
    roundness: float
    """(forward − backward) / (forward + backward) of its orbit [1]: 0 flat, +1 forward circle, −1 backward
    circle."""
    radius: float
    """Largest half axis of its orbit over its time [m]."""
    plane: str
    """Where it is largest."""
    band: float
    """Width of the frequency band searched [Hz]."""
    order_band: float
    """Width of the band of orders searched [1]."""
    width: float = 0.0
    """Of the line itself [Hz]."""


@dataclass(frozen=True, kw_only=True)
class Match:
    """How well a candidate explains a line."""

    candidate: Candidate
    probability: float
    """That this candidate made the line, among all candidates and none of them [1]."""
    deviation: float
    """Found minus expected [Hz], or order [1] for an order."""


@dataclass(frozen=True, kw_only=True)
class Name:
    """The name given to a line."""

    label: str
    """The name, "unnamed", or "unnamed (A or B?)"."""
    named: bool
    confidence: float
    """Probability of the name [1]; of the most likely candidate when unnamed."""
    reason: str
    matches: tuple[Match, ...]
    """Candidates worth considering, most likely first."""


def name_line(line: LineEvidence, candidates: Sequence[Candidate], *, air_gap: float | None = None) -> Name:
    """Name a line if one candidate (or one family of candidates) explains it far better than everything else.

    Every candidate's chance to put a line where this one was found is compared with that of a source not on
    the list, which could be anywhere in the band. A candidate known to ± 20 Hz therefore never names a line
    alone, one known to ± 0.2 Hz does.

    With an air gap [m] a round orbit of such size that does not follow the speed is called whirl.
    """
    whirl = _whirl(line, air_gap)
    if whirl is not None:
        return whirl
    weighed = [(c, density_of(line, c)) for c in candidates if _possible(line, c)]
    nothing = UNKNOWN_WEIGHT / (line.order_band if line.kind == "order" else line.band)
    total = nothing + sum(density for _, density in weighed)
    matches = sorted(
        (
            Match(candidate=c, probability=d / total, deviation=_found(line, c)[0] - c.value)
            for c, d in weighed
        ),
        key=lambda match: -match.probability,
    )
    listed = tuple(match for match in matches if match.probability >= WORTH_LISTING)
    if not listed:
        why = f"{_place(line)}: no candidate fits"
        if line.kind == "undecided":
            why += "; the speed changes too little to say if the line follows it"
        return Name(label="unnamed", named=False, confidence=0.0, reason=why, matches=())
    family = listed[0].candidate.family
    together = [match for match in listed if match.candidate.family == family]
    share = sum(match.probability for match in together)
    if share >= SURE:
        first, unit = together[0], "" if together[0].candidate.kind == "order" else " Hz"
        return Name(
            label=_label(together),
            named=True,
            confidence=share,
            reason=f"{_place(line)}, {first.deviation:+.3g}{unit} from expected: {first.candidate.reason}",
            matches=listed,
        )
    options = " or ".join(dict.fromkeys(match.candidate.name for match in listed))
    return Name(
        label=f"unnamed ({options}?)",
        named=False,
        confidence=share,
        reason=f"{_place(line)} fits {options}, but not surely ({percent(share)})",
        matches=listed,
    )


def _whirl(line: LineEvidence, air_gap: float | None) -> Name | None:
    if air_gap is None or line.kind == "order" or line.radius < 0.3 * air_gap:
        return None
    if abs(line.roundness) < ROUND_ORBIT:
        return None
    direction = "forward" if line.roundness > 0.0 else "backward"
    if direction == "forward" and line.kind == "undecided" and abs(line.order - 1.0) < 0.1:
        return None
    return Name(
        label=f"{direction} whirl",
        named=True,
        confidence=0.95,
        reason=(
            f"round {direction} orbit of {line.radius * 1e6:.0f} µm in an air gap of {air_gap * 1e6:.0f} µm "
            f"at {line.frequency:.2f} Hz, not locked to the rotor speed"
        ),
        matches=(),
    )


def _possible(line: LineEvidence, candidate: Candidate) -> bool:
    if candidate.of_swing or (line.kind != "undecided" and line.kind != candidate.kind):
        return False
    if candidate.narrow and (line.width > NARROW or line.frequency_error > STEADY_ERROR):
        return False
    if candidate.flat and abs(line.roundness) > FLAT_ORBIT:
        return False
    return not candidate.planes or line.plane in candidate.planes


def _found(line: LineEvidence, candidate: Candidate) -> tuple[float, float]:
    if candidate.kind == "order":
        return line.order, line.order_error
    return line.frequency, line.frequency_error


def density_of(line: LineEvidence, candidate: Candidate) -> float:
    """Weighted probability density that the candidate puts a line here [1/Hz or 1/order]."""
    value, error = _found(line, candidate)
    sigma = max(error, 1e-9)
    tolerance = max(candidate.tolerance, sigma)
    high = (value - candidate.value + tolerance) / (sigma * math.sqrt(2.0))
    low = (value - candidate.value - tolerance) / (sigma * math.sqrt(2.0))
    density = 0.5 * (math.erf(high) - math.erf(low)) / (2.0 * tolerance)
    if line.kind == "undecided" and candidate.kind == "order":
        density *= line.order / max(line.frequency, 1e-9)
    return candidate.weight * density


def _place(line: LineEvidence) -> str:
    return f"order {line.order:.4g}" if line.kind == "order" else f"{line.frequency:.2f} Hz"


def _label(together: Sequence[Match]) -> str:
    first = together[0]
    rivals = [m for m in together[1:] if m.probability > 0.2 * first.probability]
    return " or ".join(dict.fromkeys([first.candidate.name, *(m.candidate.name for m in rivals)]))
