"""Simulated drops over a grid of values, in one call."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rotordrop.machine import Machine
from rotordrop.study.plan import read_study
from rotordrop.study.run import Report, run_study
from rotordrop.study.summary import StudyResults

Values = Sequence[float | str]


def sweep(
    machine: Machine,
    vary: Mapping[str, Values],
    *,
    repeats: int = 1,
    folder: str | Path | None = None,
    threads: int | None = None,
    report: Report | None = None,
    **settings: Any,
) -> StudyResults:
    """Simulate a drop for every combination of values of a machine or of its drops.

    Parameters
    ----------
    machine : Machine
        The machine around which values vary.
    vary : mapping
        Values by path (``"NDE.support.stiffness"``, ``"*.friction.dynamic"`` for all touchdown bearings with
        one value) or by name of the case (``"speed"``); texts with units, or numbers in SI units.
    repeats : int
        Drops of each combination; they differ in what is left to chance, above all the rotor angle.
    folder : path, optional
        Folder of the study, which can be resumed; left out, nothing is kept but the results.
    threads, report : optional
        As for `run_study`.
    **settings
        Further keys of a study file, such as ``speed="60 Hz"``, ``duration="0.1 s"`` or ``seed=2``.

    Returns
    -------
    StudyResults
        Values and quantities of every drop; ``results.to_dataframe()`` is one table.
    """
    spreads = {name: {"grid": list(values)} for name, values in vary.items()}
    drops = repeats * math.prod(len(one["grid"]) for one in spreads.values())
    study = read_study({"drops": drops, "design": "grid", "vary": spreads} | settings, machine)
    with TemporaryDirectory() if folder is None else nullcontext(folder) as place:
        own = Path(place) / "study" if folder is None else place
        return run_study(study, own, threads=threads, report=report)
