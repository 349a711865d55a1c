"""From a recorded rotor drop to touchdown-bearing force and stress.

The public names below are loaded when first used, so that ``import rotordrop`` stays light.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rotordrop._version import __version__

if TYPE_CHECKING:
    from rotordrop.errors import RotordropError as RotordropError
    from rotordrop.estimated import Estimated as Estimated
    from rotordrop.estimated import IdentifiedValue as IdentifiedValue
    from rotordrop.units import format_quantity as format_quantity
    from rotordrop.units import parse_quantity as parse_quantity

_PUBLIC = {
    "Estimated": "rotordrop.estimated",
    "IdentifiedValue": "rotordrop.estimated",
    "RotordropError": "rotordrop.errors",
    "format_quantity": "rotordrop.units",
    "parse_quantity": "rotordrop.units",
}

__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'rotordrop' has no attribute {name!r}")
    value = getattr(import_module(_PUBLIC[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
