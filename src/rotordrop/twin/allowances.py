"""What the model of the tracked twin leaves out, as standard deviations that its intervals add."""

from __future__ import annotations

# What the model leaves out is set so that 90 % intervals held 90 % of the truths of one ensemble, right and
# wrong structures of rotors of 5 kg to 6 t, and was checked on another: study `coverage`.
MODEL_FORCE_SIGMA = 0.006
"""Relative standard deviation of a force peak by what the model leaves out (basis, sampling) [1]."""
MODEL_STRESS_SIGMA = 0.002
MODEL_MEAN_STRESS_SIGMA = 0.015
"""The same for the mean stress: preload sets it, known only through the ball stiffness [1]."""
MODEL_MEAN_FORCE_SIGMA = 0.002
"""Relative standard deviation of a mean force by what the model leaves out [1]; readings alone fix it,
by the momentum at both ends."""
