"""How far the whole of an estimate has come, from the shares of its steps."""

from __future__ import annotations

from rotordrop.progress import Progress

FORM = "the form of the rotor"
GUESSES, WHOLE, WEIGHED = "from the guesses", "fitting the whole drop", "weighing extensions"
BEYOND = "beyond the usual steps"
LASTS = {FORM: 0.36, GUESSES: 0.18, WHOLE: 0.37, WEIGHED: 0.05, BEYOND: 0.40}
"""Time of the steps of an estimate, over that of one without the first [1]; some need no more than three.

Source: 7.3, 15 and 1.7 s of the bundled drop, kernels compiled; of a flexible rotor half lies beyond. The
form of a rotor of 386 kg took 27 s where the next three took 45.
"""
DESCRIBED: tuple[str, ...] = (GUESSES, WHOLE, WEIGHED, BEYOND)
"""Steps where the rotor is described."""


class Steps:
    """Tells the progress of the whole; it never falls, though a fit of a step may begin again."""

    def __init__(self, tell: Progress) -> None:
        self._tell, self._steps = tell, DESCRIBED
        self._named, self._begun, self._ends, self._done = "", 0.0, 0.0, 0.0

    def begin(self, step: str, of: tuple[str, ...] | None = None) -> None:
        """Go on to a step of these, or beyond them, where there is no telling how many there are."""
        self._steps = of or self._steps
        if step in self._steps:
            number, whole = self._steps.index(step), sum(LASTS[one] for one in self._steps)
            count = len(self._steps) - (BEYOND in self._steps)
            self._begun, self._ends = (
                sum(LASTS[one] for one in self._steps[:end]) / whole for end in (number, number + 1)
            )
            self._named = f"step {number + 1} of {count}, " if count > 1 else ""
        else:
            whole = sum(LASTS[one] for one in self._steps)
            usual = 1.0 - LASTS[BEYOND] / whole if BEYOND in self._steps else 0.0
            self._begun, self._ends, self._named = max(self._done, usual), 1.0, f"{BEYOND}, "
        self(step, 0.0)

    def __call__(self, words: str, share: float) -> None:
        """Say what is done, and that a share of the step is done."""
        self._done = max(self._done, self._begun + (self._ends - self._begun) * share)
        self._tell(f"{self._named}{words}", self._done)
