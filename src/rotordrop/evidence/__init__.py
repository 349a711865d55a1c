"""What a record says: facts of a drop, the quality gate, a first look, the lift check."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotordrop.evidence.contacts import EarlyForces as EarlyForces
    from rotordrop.evidence.contacts import FirstForce as FirstForce
    from rotordrop.evidence.contacts import early_forces as early_forces
    from rotordrop.evidence.contacts import first_forces as first_forces
    from rotordrop.evidence.contacts import local_polynomial as local_polynomial
    from rotordrop.evidence.events import DropInstant as DropInstant
    from rotordrop.evidence.evidence import Evidence as Evidence
    from rotordrop.evidence.levitated import LevitatedModel as LevitatedModel
    from rotordrop.evidence.levitated import fit_levitated as fit_levitated
    from rotordrop.evidence.quality import Finding as Finding
    from rotordrop.evidence.quality import check_record as check_record
    from rotordrop.evidence.quality import refuse_unusable as refuse_unusable
    from rotordrop.evidence.rest import SettledTail as SettledTail
    from rotordrop.evidence.rest import settled_tail as settled_tail

_PUBLIC = {
    "contacts": ("EarlyForces", "FirstForce", "early_forces", "first_forces", "local_polynomial"),
    "events": ("DropInstant",),
    "evidence": ("Evidence",),
    "levitated": ("LevitatedModel", "fit_levitated"),
    "quality": ("Finding", "check_record", "refuse_unusable"),
    "rest": ("SettledTail", "settled_tail"),
}
_HOME = {name: module for module, names in _PUBLIC.items() for name in names}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'rotordrop.evidence' has no attribute {name!r}")
    return getattr(import_module(f"rotordrop.evidence.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(_HOME)
