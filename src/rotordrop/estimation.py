"""From a recorded drop to force and stress, with their uncertainty."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rotordrop.estimate.estimate import Method as Method
from rotordrop.estimate.estimate import Replay as Replay
from rotordrop.estimate.estimate import Tracked as Tracked
from rotordrop.one_thread import one_thread
from rotordrop.progress import Shown, shown
from rotordrop.require import require

if TYPE_CHECKING:
    from rotordrop.estimate.estimate import Estimate, Estimates
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

FOLLOWED = Tracked()
DOUBTED = "a fit against a warning can take several times as long; Ctrl-C leaves nothing half written"


def estimate_drop(
    machine: Machine,
    record: Record,
    tail: Record | None = None,
    *,
    method: Method = FOLLOWED,
    name: str | None = None,
    progress: Shown = None,
) -> Estimate:
    """Estimate force and stress of the touchdown bearings from one recorded drop.

    Parameters
    ----------
    machine : Machine
        The machine, with guesses where nothing better is known.
    record : Record
        The recorded drop.
    tail : Record, optional
        The settled tail, where it is a recording of its own.
    method : Tracked or Replay
        A drop model that follows the record, or with that the paper's open-loop replay.
    name : str, optional
        Name of the drop; the file's by default.
    progress : callable or False, optional
        Called with a text and the fraction done; by default a bar in a terminal or a notebook.

    Raises
    ------
    RecordError
        If the record cannot be used.
    IdentificationError
        If no estimate can be made of it.

    Examples
    --------
    >>> from rotordrop.estimation import Tracked
    >>> Tracked(quick=True)
    Tracked(quick=True)
    """
    from rotordrop.machine import Machine
    from rotordrop.record.record import Record

    require(machine, "machine", Machine)
    require(record, "record", Record)
    require(tail, "tail", Record, none=True)
    names = None if name is None else [name]
    return estimate_drops(machine, [record], [tail], method=method, names=names, progress=progress)[0]


@one_thread()
def estimate_drops(
    machine: Machine,
    records: Sequence[Record],
    tails: Sequence[Record | None] | None = None,
    *,
    method: Method = FOLLOWED,
    names: Sequence[str] | None = None,
    progress: Shown = None,
) -> Estimates:
    """Estimate several recorded drops of one machine; tracked ones share its parameters in one fit.

    The result is a tuple with one table of all drops, ``.to_dataframe()``. What the gate warns of is logged
    before the fit.

    Parameters
    ----------
    machine : Machine
        The machine, calibrated or with guesses.
    records, tails : sequence of Record
        The drops and their settled tails (None where there is none, or left out).
    method : Tracked or Replay
        How, with options.
    names : sequence of str, optional
        Names of the drops; file stems by default.
    progress : callable or False, optional
        Called with a text and the fraction done; by default a bar in a terminal or a notebook.

    Raises
    ------
    RecordError, IdentificationError
        As for `estimate_drop`; nothing is computed before every record has passed the gate.
    """
    from rotordrop.errors import RecordError, UsageError
    from rotordrop.estimate.estimate import Estimates
    from rotordrop.estimate.record_facts import facts_of
    from rotordrop.evidence.evidence import Evidence, insisted
    from rotordrop.evidence.given import given_drops
    from rotordrop.evidence.one_end import as_dropped, on_common_zeros

    require(method, "the method", Tracked, Replay, hint="Write Tracked() or Replay()")
    records, tails, stems = given_drops(machine, records, tails, names)
    ways = [as_dropped(record, machine) for record in records]
    held = [[amb.name for amb in way.ambs if amb.stays_on] for way in ways]
    if any(one != held[0] for one in held):
        raise UsageError(
            "some of the drops are of one end whose magnets the others did not keep on "
            f"({'; '.join(', '.join(one) or 'none stays on' for one in held)}); expected the same of all. "
            "Estimate them apart"
        )
    if isinstance(method, Replay) and any(held):
        raise RecordError(
            f"{held[0][0]} stayed held by its magnets in {stems[0]}, and the replay knows no drop of one "
            "end; estimate it with the tracked twin"
        )
    evidence = [
        Evidence(record=record, machine=way, tail=tail, name=stem)
        for record, way, tail, stem in zip(records, ways, tails, stems, strict=True)
    ]
    facts = [facts_of(one) for one in evidence]
    from rotordrop.replay.replay import replayed_drop
    from rotordrop.rotor.parameters import build_drop_model
    from rotordrop.twin.tracked import followed_drops
    from rotordrop.twin.tracked_estimate import estimate_of

    evidence = on_common_zeros(evidence)
    machine = evidence[0].machine
    model = build_drop_model(machine)
    evidence = [insisted(one.with_facts(base=model)) for one in evidence]
    doubts = [
        f"{one.name}: {finding}"
        for one, fact in zip(evidence, facts, strict=True)
        for finding in fact.findings
        if finding.severity == "warning"
    ]
    if doubts:
        logging.getLogger("rotordrop").warning("\n".join((*doubts, DOUBTED)))
    with shown(progress, "estimating") as tell:
        quick = isinstance(method, Tracked) and method.quick
        drops = followed_drops(machine, evidence, quick=quick, progress=tell)
        return Estimates(
            replayed_drop(drop, method, one) if isinstance(method, Replay) else estimate_of(drop, method, one)
            for drop, one in zip(drops, facts, strict=True)
        )
