"""The frequencies of a coast-down, recorded or simulated, named by what a machine can show."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from rotordrop.estimate.recorded_coast_down import recorded_coast_down, with_found_air_gaps
from rotordrop.estimate.simulated_coast_down import simulated_coast_down
from rotordrop.evidence.given import require_drop
from rotordrop.machine import Machine
from rotordrop.progress import Shown, shown
from rotordrop.record.record import Record
from rotordrop.require import require
from rotordrop.spectrum.candidates import machine_candidates
from rotordrop.spectrum.coast_down import CoastDownAnalysis, WaterfallChoice, analyse_coast_down


def waterfall(
    machine: Machine,
    coast_down: Record | str | Path,
    choice: WaterfallChoice | None = None,
    *,
    progress: Shown = None,
) -> CoastDownAnalysis:
    """Find and name the frequencies of a coast-down.

    Parameters
    ----------
    machine : Machine
        What lines are named by.
    coast_down : Record or path
        A recorded one, or the file that `simulate_coast_down` wrote.
    choice : WaterfallChoice, optional
        Which waterfalls; those of the paper by default.
    progress : callable or False, optional
        Called with a text and the fraction done; by default a bar in a terminal or a notebook.

    Raises
    ------
    RecordError
        If the record cannot be used.
    """
    require(machine, "machine", Machine)
    require(coast_down, "the coast-down", Record, str, PathLike)
    require(choice, "choice", WaterfallChoice, none=True)
    if isinstance(coast_down, Record):
        require_drop(coast_down, machine)
        signal = recorded_coast_down(machine, coast_down)
    else:
        signal = simulated_coast_down(Path(coast_down), machine)
    candidates = machine_candidates(
        with_found_air_gaps(machine, signal), {name: name for name in signal.planes}
    )
    with shown(progress, "frequencies") as tell:
        return analyse_coast_down(signal, candidates, choice, progress=tell)
