"""The progress of an estimate is that of the whole, and never falls."""

from __future__ import annotations

import pytest

from rotordrop.twin.steps import GUESSES, LASTS, WEIGHED, WHOLE, Steps


def test_steps_add_up_to_the_whole_and_a_fit_that_begins_again_does_not_fall_back():
    """Every fit of an estimate had begun at nothing again: 0 to 84 %, and 0 to 33 %, and done."""
    told: list[tuple[str, float]] = []
    steps = Steps(lambda words, share: told.append((words, share)))
    steps.begin(GUESSES)
    for share in (0.0, 0.5, 0.9):
        steps("fitting the first 59 ms", share)
    steps.begin(WHOLE)
    for share in (0.0, 0.5, 0.0, 0.3):  # in another minimum
        steps("fitting the first 200 ms", share)
    steps.begin(WEIGHED)
    steps.begin("trying extensions of the base model")
    steps("fitting the first 200 ms", 1.0)
    shares = [share for _, share in told]
    assert shares == sorted(shares) and shares[0] == 0.0 and shares[-1] == pytest.approx(1.0)
    assert told[2] == ("step 1 of 3, fitting the first 59 ms", pytest.approx(0.5 * LASTS[GUESSES]))
    assert told[6][1] == told[7][1] == told[8][1] == pytest.approx(LASTS[GUESSES] + 0.5 * LASTS[WHOLE])
    assert told[-2][0] == "beyond the usual steps, trying extensions of the base model"


def test_a_calibrated_machine_has_fewer_steps_and_a_quick_one_is_not_counted():
    told: list[tuple[str, float]] = []
    steps = Steps(lambda words, share: told.append((words, share)))
    steps.begin(WHOLE, (WHOLE, WEIGHED))
    steps("a", 1.0)
    assert told[-1] == ("step 1 of 2, a", pytest.approx(LASTS[WHOLE] / (LASTS[WHOLE] + LASTS[WEIGHED])))
    steps.begin(WHOLE, (WHOLE,))
    steps("a", 1.0)
    assert told[-1] == ("a", 1.0)
