"""Shares of the variance of functions for which they are known."""

from __future__ import annotations

import numpy as np
import pytest

from rotordrop import example_machine
from rotordrop.errors import UsageError
from rotordrop.study.plan import read_study
from rotordrop.study.sensitivity import influences
from rotordrop.study.summary import StudyResults

MACHINE = example_machine("lp400")
ISHIGAMI = {"a": (0.3139, 0.5576), "b": (0.4424, 0.4424), "c": (0.0, 0.2437)}
"""First-order and total indices of sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1, Ishigami and Homma 1990."""
PLACES = dict(zip("abc", ("*.friction.dynamic", "NDE.air_gap", "speed"), strict=True))


def results_of(design, drops):
    """Results whose only quantity is the Ishigami function of the shares of three varied values."""
    study = read_study(
        {
            "drops": drops,
            "design": design,
            "start": "centred",
            "vary": {
                "*.friction.dynamic": {"uniform": [0.05, 0.2]},
                "NDE.air_gap": {"uniform": ["200 um", "300 um"]},
                "speed": {"uniform": ["60 Hz", "200 Hz"]},
            },
        },
        MACHINE,
    )
    values = study.values(0, drops)
    low = np.array([spread.numbers[0] for spread in study.varied.values()])
    high = np.array([spread.numbers[1] for spread in study.varied.values()])
    x = np.pi * (2.0 * (values - low) / (high - low) - 1.0)
    column = {name: x[:, j] for j, name in enumerate(study.varied)}
    x1, x2, x3 = (column[PLACES[letter]] for letter in "abc")
    y = np.sin(x1) + 7.0 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)
    return StudyResults(
        study=study,
        drop=np.arange(drops),
        varied={name: values[:, j] for j, name in enumerate(study.varied)},
        numbers={"y": y},
        reasons=("",) * drops,
    )


def test_indices_of_the_ishigami_function():
    found = {one.name: one for one in influences(results_of("sensitivity", 5 * 2048), "y")}
    for letter, (alone, total) in ISHIGAMI.items():
        one = found[PLACES[letter]]
        assert one.alone.value == pytest.approx(alone, abs=0.03)
        assert one.total.value == pytest.approx(total, abs=0.03)
        assert one.total.low < total < one.total.high or abs(one.total.value - total) < 0.01


@pytest.mark.parametrize("design", ["random", "sobol"])
def test_indices_of_any_study(design):
    found = {one.name: one for one in influences(results_of(design, 4096), "y")}
    for letter, (alone, _) in ISHIGAMI.items():
        assert found[PLACES[letter]].alone.value == pytest.approx(alone, abs=0.04)
        assert found[PLACES[letter]].total is None


def test_a_block_differs_in_one_value_at_a_time():
    study = results_of("sensitivity", 25).study
    values = study.values(0, 25).reshape(5, 5, 3)
    for block in values:
        for j in range(3):
            changed = block[2 + j] != block[0]
            assert changed.tolist() == [k == j for k in range(3)]
            assert block[2 + j][j] == block[1][j]
    np.testing.assert_array_equal(study.values(7, 19), values.reshape(25, 3)[7:19])


def test_too_few_drops_are_refused():
    with pytest.raises(UsageError, match=r"5 whole blocks of 5 drops have y; at least 20 are needed"):
        influences(results_of("sensitivity", 25), "y")
