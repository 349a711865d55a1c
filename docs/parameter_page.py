"""Write the page of the parameters from the parameter table."""

from __future__ import annotations

import math

from rotordrop.elements.parameter import Parameter
from rotordrop.elements.table import STRUCTURE, rows
from rotordrop.machine import example_machine
from rotordrop.severity.numbers import LOADS

INTRODUCTION = """\
# Parameters

Every unknown of a drop, as the estimators know it before they read a record. This page is written from the
table `rotordrop.elements.table`, which priors, schema, report and score read too.

**What the machine file says of a value.** A `range` of a guess, and an `interval` of a value, is the
interval that holds the value with 90 % probability: one in twenty lies below it and one in twenty above.
The prior is a normal distribution with exactly this interval, of the logarithm for positive quantities, of
the value itself for the air gap and for gain and offset of a sensor; for the preload it is normal in the
axial offset of the ball rows. Its centre is therefore the middle of the range and not the guess: the guess
is where a search begins, and what `simulate` takes. Limits beyond which a value cannot be do not follow
from a range; an estimate may leave it when the record insists. A range from zero on has no lower limit in
the logarithm; its centre is the guess. Without range or interval the standard deviation comes from
`standard_error`, or from the columns below. A positive quantity that is described as zero, such as the
preload of a bearing with clearance, is not estimated.

The standard deviation is that of the logarithm, or a share: of the value described for the air gap, of the
smallest air gap for the offset of a sensor, of a magnet's share of the weight for its remanent force. The
drift is a random walk per square root of a second in the same measure; where two numbers stand, the second
holds late in a drop.
"""

STRUCTURE_TEXT = """\
Unknowns only of a machine whose description names them; the estimate adds them where a record asks for it
([extensions](../tracked_twin.md#extensions)). Of those of a sensor, the column of a guess is the
share of one sensor; what the sensors of a plane, or all of them, have in common has a prior of its own.
"""

BEARING = example_machine("paper").touchdown_bearings[0]

OWNERS = {
    "bearing": "Of a touchdown bearing",
    "sensor": "Of a sensor",
    "unbalance": "Of a balance plane, in every drop anew",
    "magnet": "Of a magnet, in every drop anew",
    "drop": "Of a drop",
}


def parameter_page() -> str:
    """The page as Markdown."""
    parts = [INTRODUCTION]
    for owner, title in OWNERS.items():
        parts += [f"## {title}", "", *_priors(tuple(rows(owner))), ""]  # type: ignore[arg-type]
    parts += ["## Beyond the usual model", "", STRUCTURE_TEXT, *_priors(STRUCTURE), ""]
    parts += ["## In the estimate", "", *_published(), ""]
    parts += ["## What tells two of them apart", "", *_separated(), ""]
    return "\n".join(parts)


def _priors(owned: tuple[Parameter, ...]) -> list[str]:
    lines = [
        "| parameter | path | unit | estimated by | a guess | a given value | drift | limits of the model |",
        "|---|---|---|---|---:|---:|---:|---|",
    ]
    for row in owned:
        if not row.guess_sigma:
            continue
        given = f"{row.given_sigma:g}" if row.given_sigma else "–"
        lines.append(
            f"| {row.label} | `{row.path}` | {row.unit} | {_measure(row)} | {row.guess_sigma:g} | {given} "
            f"| {_drift(row)} | {_limits(row)} |"
        )
    return lines


def _measure(row: Parameter) -> str:
    if row.estimated_by is not None:
        return row.estimated_by(BEARING).name
    if row.logarithmic:
        return "logarithm"
    return "value" if row.scale == "one" else f"value, as a share of the {row.scale}"


def _drift(row: Parameter) -> str:
    late = row.drift * row.late_drift_factor
    return f"{row.drift:g}" if late == row.drift else f"{row.drift:g}, late {late:g}"


def _limits(row: Parameter) -> str:
    if row.reach is not None:
        return f"a factor of {row.reach:g} about the prior"
    ends = (("from", row.lower), ("to", row.upper))
    return " ".join(f"{word} {end:g}" for word, end in ends if math.isfinite(end))


def _published() -> list[str]:
    lines = [
        "A nuisance is fitted beside what is sought.",
        "",
        "| field | what | unit | part |",
        "|---|---|---|---|",
    ]
    for load in LOADS:
        lines.append(f"| `{load.field}` | {load.label} | | |")
    for row in rows("bearing"):
        lines.append(f"| `{row.field}` | {row.label} | {row.unit} | {row.role.value} |")
    return lines


def _separated() -> list[str]:
    lines = ["| pair | measurement |", "|---|---|"]
    for row in rows():
        lines += [f"| `{row.path}`, `{other}` | {how} |" for other, how in row.separated_by.items()]
    return lines
