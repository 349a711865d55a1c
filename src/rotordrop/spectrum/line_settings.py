"""Where lines are looked for, and in what frames."""

from __future__ import annotations

from dataclasses import dataclass, field

from rotordrop.spectrum.detection import DetectionSettings


@dataclass(frozen=True, kw_only=True)
class LineSettings:
    """Where lines are looked for and in frames of what length."""

    lowest_frequency: float = 5.0
    highest_frequency: float = 1000.0
    """[Hz]."""
    highest_order: float = 20.0
    """[1]."""
    frame: float = 1.6384
    """Length of a frame for steady lines [s]; 1.6384 s is the paper's."""
    turns: int = 32
    """Turns of the rotor in a frame for orders [1]."""
    bandwidth: float = 1.0
    """Amplitude changes that are followed [Hz]."""
    most_lines: int = 60
    """The search stops after so many lines [1]."""
    detection: DetectionSettings = field(default_factory=DetectionSettings)


STANDARD_SETTINGS = LineSettings()
