"""What a terminal shows of an estimate first: verdict, loads of every bearing, limits, what to do next."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from textwrap import shorten

import numpy as np

from rotordrop.elements.ball_bearing import STATIC_STRESS
from rotordrop.estimate.bearing_drop import BearingDrop
from rotordrop.estimate.estimate import Estimate
from rotordrop.known import Known
from rotordrop.record.impacts import CONTACT_FROM
from rotordrop.report.content import SIMULATED_RECORD, Column, ReportContent, Statement, Table, table
from rotordrop.report.estimate_numbers import static_limit_statement
from rotordrop.report.estimate_page import estimate_verdict, names_in
from rotordrop.report.quantity import NO_INTERVAL, Quantity, shown, with_interval
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
    shares = ", ".join(
        " to ".join(dict.fromkeys(f"{100.0 * end / STATIC_STRESS:.0f}" for end in (peak.low, peak.high)))
        for peak in (b.peak_stress.known for b in estimate.bearings)
    )
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

    def number(known: Known | None, kind: str) -> str:
        if known is None or known.interval_90 is None:
            return NO_INTERVAL
        one = Quantity.of(known, kind, range_only=not certain)
        return f"{one.text} ({one.interval_text})" if one.interval_text else one.text

    def load(b: BearingDrop, field: str, known: Known | None, kind: str = "force") -> str:
        return b.missing.get(field) or number(known, kind)

    lines: dict[str, Callable[[BearingDrop], str]] = {
        "peak bearing force": lambda b: load(b, "peak_force_N", b.peak_force.known),
        "at (from power-off)": lambda b: with_interval(
            b.peak_force.time, "time", b.peak_force.time_interval_90
        ),
        "peak Hertz stress": lambda b: load(b, "peak_stress_Pa", b.peak_stress.known, "pressure"),
        "impacts": lambda b: (
            b.missing.get("impacts") or with_interval(len(b.touched), "count", b.count_interval_90)
        ),
        CONTACT_FROM: lambda b: with_interval(b.contact_from, "time", b.contact_from_interval_90),
        **({"largest displacement": lambda b: number(b.largest, "length")} if certain else {}),
        "over the air gap": lambda b: _over_gap(b, certain=certain),
        "mean force, 150 to 200 ms": lambda b: load(b, MEAN, b.values.get(MEAN)),
    }
    what = "90 % intervals" if certain else "90 % ranges"
    columns = [Column(f"first {1e3 * estimate.until:.0f} ms, {what}", str)]
    cells = [{name: of(bearing) for name, of in lines.items()} for bearing in estimate.bearings]
    columns += [Column(b.name, own.__getitem__) for b, own in zip(estimate.bearings, cells, strict=True)]
    return table([name for name in lines if any(own[name] != NO_INTERVAL for own in cells)], columns)


def _over_gap(b: BearingDrop, *, certain: bool) -> str:
    """The largest distance from the centre over the air gap; as a range, if not certain.

    A gain error is in displacement and gap alike, and not in their ratio: of an estimate that is not certain
    the gap alone has an error that counts, of one that is they count as independent.
    """
    gap = b.values.get("air_gap_m")
    if gap is None or (certain and b.largest is None):
        return NO_INTERVAL
    if not certain or b.largest is None:
        farthest = float(np.nanmax(b.motions[-1].radial.values))
        return f"{farthest / gap.high:.2f} to {farthest / max(gap.low, 1e-9):.2f}"
    ratio = b.largest.value / gap.value
    doubt = ratio * math.hypot(
        0.5 * (b.largest.high - b.largest.low) / b.largest.value, 0.5 * (gap.high - gap.low) / gap.value
    )
    return with_interval(ratio, "dimensionless", (ratio - doubt, ratio + doubt))
