"""Many drops: ensembles and sweeps, resumable, with the same numbers however they are computed."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotordrop.study.plan import Study as Study
    from rotordrop.study.plan import load_study as load_study
    from rotordrop.study.run import StudyProgress as StudyProgress
    from rotordrop.study.run import run_study as run_study
    from rotordrop.study.run import sweep as sweep
    from rotordrop.study.summary import StudyResults as StudyResults
    from rotordrop.study.summary import load_results as load_results

_PUBLIC = {
    "Study": "rotordrop.study.plan",
    "StudyProgress": "rotordrop.study.run",
    "StudyResults": "rotordrop.study.summary",
    "load_results": "rotordrop.study.summary",
    "load_study": "rotordrop.study.plan",
    "run_study": "rotordrop.study.run",
    "sweep": "rotordrop.study.run",
}

__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'rotordrop.study' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)
