"""What a terminal shows of an estimate first: verdict, loads of every bearing, limits, what to do next."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from textwrap import shorten

import numpy as np

from rotordrop.elements.ball_bearing import STATIC_STRESS
from rotordrop.estimate.bearing_drop import BearingDrop
from rotordrop.estimate.estimate import Estimate
from rotordrop.report.content import SIMULATED_RECORD, Column, ReportContent, Statement, Table, table
from rotordrop.report.estimate_numbers import static_limit_statement
from rotordrop.report.estimate_page import estimate_verdict, names_in
from rotordrop.report.quantity import Quantity, shown
from rotordrop.report.record_quality import unseen_in

LONGEST_VERDICT, LONGEST = 270, 185
"""Characters of the verdict and of another statement: three lines and two of a terminal of 100 columns."""
MOST_LIMITS = 3
MORE = " … (--all)"
MEAN = "mean_force_0p15_0p2_N"


def estimate_screen(estimate: Estimate) -> ReportContent:
    """The first screen of an estimate: 25 lines of a terminal of 100 columns; the page says the rest."""
    judgement, _part, *others = estimate_verdict(estimate)
    later = {one.sentence() for one in estimate.later if one.larger}
    static = [static_limit_statement(b, certain=estimate.consistent) for b in estimate.bearings]
    unseen = unseen_in(estimate.notes)
    elsewhere = {*estimate.assumed, *unseen, *(one.text for one in static)}
    limits = [one for one in others if one.level != "good" and one.text not in elsewhere]
    # what hides a loss first, then what is a warning
    limits.sort(key=lambda one: (one.text not in later, one.level not in ("bad", "warning")))
    said = limits[: MOST_LIMITS if estimate.consistent else MOST_LIMITS - 1]
    peaks = [Quantity.of(b.peak_stress.known, "pressure") for b in estimate.bearings]
    stresses = [one.value if estimate.consistent else one.ends[1] for one in peaks]
    shares = ", ".join(f"{100.0 * one / STATIC_STRESS:.0f}" for one in stresses)
    rated = f"peak stress {shares} % of the {shown(STATIC_STRESS, 'pressure')} of C0 (ISO 76)"
    assumed = ", ".join(dict.fromkeys((*estimate.assumed.values(), rated)))
    remedies = dict.fromkeys(_remedies(estimate))
    closing = (
        f"{len(limits) - len(said)} more with --all" if len(limits) > len(said) else "",
        f"assumed: {assumed}",
        *unseen,
        f"to do next: {'; '.join(remedies)}" if remedies else "",
    )
    return ReportContent(
        title=f"{estimate.machine.name}, {estimate.name}, dropped from {shown(estimate.speed, 'speed')}",
        simulated=SIMULATED_RECORD if estimate.simulated_record else "",
        verdict=(
            _short(judgement, LONGEST_VERDICT),
            *(_short(one, LONGEST) for one in said),
            *(_short(Statement(text), LONGEST) for text in closing if text),
        ),
        screen=_loads(estimate),
    )


def _remedies(estimate: Estimate) -> Iterator[str]:
    """What to do next, first what may well let the model fit."""
    yield from (one.measurement for one in estimate.advice if one.at_most)
    name_of = names_in(estimate)
    yield from (check.advised(name_of) for check in estimate.checks if check.failed and check.remedy)


def _short(one: Statement, longest: int) -> Statement:
    return Statement(shorten(one.text, longest, placeholder=MORE), one.level)


def _loads(estimate: Estimate) -> Table:
    """Loads of every bearing, one line each."""
    certain = estimate.consistent

    def number(known: object, kind: str) -> str:
        one = Quantity.of(known, kind, range_only=not certain)
        return f"{one.text} ({one.interval_text})" if one.interval_text else one.text

    def mean(b: BearingDrop) -> str:
        known = b.values.get(MEAN)
        return b.missing.get(MEAN, "–") if known is None else number(known, "force")

    lines: dict[str, Callable[[BearingDrop], str]] = {
        "peak bearing force": lambda b: number(b.peak_force.known, "force"),
        "at (from power-off), towards": _moment,
        "peak Hertz stress": lambda b: number(b.peak_stress.known, "pressure"),
        "impacts (contacts)": _impacts,
        "largest displacement": lambda b: _displacement(b, certain=certain),
        "mean force, 150 to 200 ms": mean,
    }
    what = "90 % intervals" if certain else "90 % ranges"
    columns = [Column(f"first {1e3 * estimate.until:.0f} ms, {what}", str)]
    for bearing in estimate.bearings:
        values = {name: of(bearing) for name, of in lines.items()}
        columns.append(Column(bearing.name, values.__getitem__))
    return table(lines, columns)


def _impacts(b: BearingDrop) -> str:
    """How many impacts and contacts, and from when on the rotor stayed in contact."""
    lasts = "" if b.contact_from is None else f", in contact from {shown(b.contact_from, 'time', 3)}"
    return b.missing.get("impacts", f"{len(b.touched)} ({len(b.impacts)}){lasts}")


def _moment(b: BearingDrop) -> str:
    """When the force is largest, and where the rotor presses then."""
    when = shown(b.peak_force.time, "time", 4)
    if b.force_vector is None:
        return when
    x, y = -b.force_vector[int(np.argmin(np.abs(b.force.time - b.peak_force.time)))]
    return f"{when}, {math.degrees(math.atan2(y, x)):.0f}° (bottom −90°)"


def _displacement(b: BearingDrop, *, certain: bool) -> str:
    """The largest distance from the centre, over the air gap, too; that alone, as a range, if not certain.

    A gain error is in displacement and gap alike, and not in their ratio.
    """
    farthest = float(np.nanmax(b.motions[-1].radial.values))
    known = b.values.get("air_gap_m")
    if known is not None and not certain:
        return f"{farthest / known.high:.2f} to {farthest / max(known.low, 1e-9):.2f} × the air gap"
    if known is None:
        return shown(farthest, "length")
    return f"{shown(farthest, 'length')}, {farthest / known.value:.2f} × the air gap"
