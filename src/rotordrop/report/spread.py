"""How a number is spread over simulated drops, in words and for JSON: shared by all studies."""

from __future__ import annotations

import math
from typing import Any

from rotordrop._version import __version__
from rotordrop.known import Known
from rotordrop.simulate.fingerprint import fingerprint
from rotordrop.study.plan import Study
from rotordrop.units import format_quantity


def spread(known: Known, kind: str) -> str:
    """A number with its 90 % interval in words; an end that needs more drops is open."""
    value, low, high = (in_words(number, kind) for number in (known.value, known.low, known.high))
    return f"{value} ({low} to {high})"


def in_words(value: float, kind: str) -> str:
    """A number in words; what needs more drops is open."""
    return format_quantity(value, kind) if math.isfinite(value) else "open"


def percent(share: Known, form: str = "{:.3g} % (90 %: {:.3g} to {:.3g} %)") -> str:
    """A share of the drops with its 90 % interval in words."""
    return form.format(*(100 * number for number in (share.value, share.low, share.high)))


def ends(known: Known) -> dict[str, Any]:
    """A number with its interval, ready for JSON."""
    found = {"value": known.value, "interval_90": [known.low, known.high], "drops": known.drops}
    made: dict[str, Any] = finite(found)
    return made


def finite(tree: Any) -> Any:
    """The same content with nothing in place of what is not finite, which JSON cannot hold."""
    if isinstance(tree, dict):
        return {key: finite(value) for key, value in tree.items()}
    if isinstance(tree, tuple | list):
        return [finite(value) for value in tree]
    return None if isinstance(tree, float) and not math.isfinite(tree) else tree


def study_facts(study: Study) -> tuple[tuple[str, str], ...]:
    """Lines for a report on simulated drops: what makes the same ones again."""
    return (
        ("machine", study.machine.name),
        ("seed", str(study.seed)),
        ("digest", study.digest),
        ("rotordrop", __version__),
    )


def study_numbers_of(study: Study) -> dict[str, Any]:
    """What makes the same drops again, ready for JSON."""
    return {
        "study": study.document(),
        "machine": study.machine.name,
        "digest": study.digest,
        "rotordrop": __version__,
        "fingerprint": fingerprint(),
    }
