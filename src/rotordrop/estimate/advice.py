"""What to measure of a machine, and what it would do to the intervals of its peak forces."""

from __future__ import annotations

from dataclasses import dataclass

WORTH_SAYING = 0.95
"""Half width left over the one there is from which a further number is not worth its measurement
[1] (chosen)."""


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
    at_most: bool = False
    """Whether the interval may become narrower than said, because the model does not fit without it."""

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
        less = " or less; the model may well fit then" if self.at_most else ""
        return f"{self.measurement} would narrow the peak force: {', '.join(parts)}{less}"
