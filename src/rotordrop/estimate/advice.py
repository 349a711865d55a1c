"""What to measure of a machine, and what it would do to the intervals of its peak forces."""

from __future__ import annotations

from dataclasses import dataclass

from rotordrop.known import Known

WORTH_SAYING = 0.95
"""Half width left over the one there is from which a further number is not worth its measurement
[1] (chosen)."""
WIDE = 0.05
"""Half a 90 % interval of a peak force over the force from which it is said why [1] (chosen)."""


def is_wide(peak: Known) -> bool:
    """Whether a peak force is known so badly that it is said why."""
    return peak.high - peak.low > 2.0 * WIDE * abs(peak.value)


@dataclass(frozen=True, kw_only=True)
class Advice:
    """A measurement and what it would do to the intervals of the peak forces."""

    measurement: str
    """What to measure."""
    paths: tuple[str, ...]
    """Parameters that it would give."""
    half_widths: dict[str, float]
    narrowed: dict[str, float]
    """Half the 90 % interval of the peak force of every bearing as it is, and as it would be [N]."""

    @property
    def left(self) -> float:
        """What would be left of the interval that narrows most [1]."""
        return min(self.narrowed[name] / half for name, half in self.half_widths.items())

    def sentence(self) -> str:
        """What to measure and what it would bring."""
        parts = [
            f"{name} from ± {half:.3g} N to ± {self.narrowed[name]:.3g} N"
            for name, half in self.half_widths.items()
            if self.narrowed[name] < WORTH_SAYING * half
        ]
        return f"{self.measurement} would narrow the peak force: {', '.join(parts)}"
