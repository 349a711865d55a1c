"""How deep a resting rotor lies below the centre of its bearings: gap, indentation, race and support."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.support import support_sag
from rotordrop.machine import TouchdownBearing
from rotordrop.physics import columns as L
from rotordrop.physics.contact import depth_at
from rotordrop.rotor.parameters import DropModel

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class StaticSag:
    """What gives way under the rotor at rest, below the air gap."""

    indentation: Array
    """Contact indentation under the static load shares [m], shape (B,)."""
    race: Array
    """Deflection of the bearing [m], shape (B,)."""
    support: Array
    """Deflection of the support [m], shape (B,)."""

    @property
    def total(self) -> Array:
        """Their sum [m], shape (B,): the radius at rest less the air gap."""
        return self.indentation + self.race + self.support

    def depth(self, gap: Array) -> Array:
        """How deep [m] the rotor lies below the centre with an air gap (B,) [m]."""
        return gap + self.indentation + self.race + self.support


def race_sag(bearings: Sequence[TouchdownBearing], loads: Array) -> Array:
    """Deflection [m] of every bearing, shape (B,), under static loads (B,) [N]."""
    pairs = zip(bearings, loads, strict=True)
    return np.array([numbers_of(b).deflection(float(load))[0] for b, load in pairs])


def static_sag(rows: Array, race: Array, loads: Array) -> StaticSag:
    """Sag under static loads.

    Parameters
    ----------
    rows : ndarray, shape (B, columns)
        Bearing parameters, columns of `rotordrop.physics.columns`.
    race : ndarray, shape (B,)
        From `race_sag` [m].
    loads : ndarray, shape (B,)
        Static load of each bearing [N].
    """
    laws = rows[:, L.CONTACT : L.CONTACT_END]
    indentation = np.array([depth_at(law, float(load)) for law, load in zip(laws, loads, strict=True)])
    support = np.array([support_sag(row, float(load)) for row, load in zip(rows, loads, strict=True)])
    return StaticSag(indentation=indentation, race=race, support=support)


def sag_of_model(model: DropModel) -> StaticSag:
    """Sag of a model's rotor under its static load shares."""
    loads = np.asarray(model.load_shares)
    return static_sag(model.parameters.bearing, race_sag(model.machine.touchdown_bearings, loads), loads)
