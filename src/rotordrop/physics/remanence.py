"""What the magnets still do after power-off: a delay, then a remanent force that decays (Neisi 2020, section
5.1).
"""

from __future__ import annotations

from rotordrop.physics._compile import kernel
from rotordrop.physics.elementary import exp


@kernel
def remanent_fraction(t: float, delay: float, tau: float) -> float:
    """Fraction [1] of the remanent force left at a time [s] after the command.

    One at the end of the delay [s], decaying with the time constant [s]; zero during the delay.

    Source: the "small lift right after the AMB shutdown" of Neisi 2020, section 5.1; the exponential law is
    ours.
    """
    if t < delay or tau <= 0.0:
        return 0.0
    return exp(-(t - delay) / tau)
