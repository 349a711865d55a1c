"""What a replayed drop says: identified values, simulated drops, agreement with the record, intervals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.estimated import IdentifiedValue
from rotordrop.estimation.agreement import Agreement
from rotordrop.estimation.uncertainty import Draws
from rotordrop.identification.air_gap import AirGap
from rotordrop.identification.first_contact import FirstContact
from rotordrop.identification.friction import FrictionSweep
from rotordrop.identification.initial_state import InitialState
from rotordrop.identification.modal_expansion import ExpandedState
from rotordrop.identification.speed import SpeedFit
from rotordrop.identification.support import SupportFit
from rotordrop.machine import Machine
from rotordrop.measurement.events import DropInstant
from rotordrop.measurement.record import Record
from rotordrop.simulation.result import DropResult

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Replayed:
    """One simulated drop beside the record; T times, B bearings.

    Attributes
    ----------
    time : ndarray, shape (T,)
        Time from power-off [s].
    displacement : ndarray, shape (T, B, 2)
        Rotor at the bearings as the sensors would show it, along the straight rotor [m].
    force, stress : ndarray, shape (T, B)
        Magnitude of the ball force on the race [N] and largest Hertz stress at the inner race [Pa].
    """

    time: Array
    displacement: Array
    force: Array
    stress: Array


@dataclass(frozen=True, kw_only=True)
class ReplayDrop:
    """One recorded drop, estimated by replaying it with the drop model (Neisi 2020, Fig. 4).

    Attributes
    ----------
    machine : Machine
        The machine as it was given.
    identified : Machine
        The machine with what was identified.
    record : Record
        The record.
    drop_instant : DropInstant
        Power-off in record time.
    gap : AirGap
        Air gaps with their limits.
    speed : SpeedFit
        Speed at power-off and how it falls.
    initial : InitialState
        Initial state, by the fit over the fall.
    expanded : ExpandedState
        Initial state by the paper's modal expansion, for comparison.
    contacts : tuple of FirstContact
        First contact of every bearing in the record.
    support : SupportFit or None
        Fit of the supports; None when they were taken from an earlier estimate.
    friction : FrictionSweep or None
        Sweep of the friction coefficient; None when it was taken from an earlier estimate.
    simulated : DropResult
        Simulation with the identified values, from power-off.
    middle, lower, upper : Replayed
        The same beside the record, for the air gap and for its lower and upper limit.
    measured_time : ndarray, shape (N,)
        Samples of the record in the simulated window [s from power-off].
    measured : ndarray, shape (N, B, 2)
        Measured displacement at the bearings, along the straight rotor, from the rest position [m].
    agreement : Agreement
        How far simulation and record agree.
    draws : Draws or None
        Draws behind the intervals.
    values : dict of dict
        Per bearing, identified values by the field names of the estimate's document.
    peak_times : dict
        Time of the peak force [s] per bearing.
    fixed : str
        Where support and friction were taken from; empty when they were identified.
    warnings : tuple of str
        What to know about this estimate.
    """

    machine: Machine
    identified: Machine
    record: Record
    drop_instant: DropInstant
    gap: AirGap
    speed: SpeedFit
    initial: InitialState
    expanded: ExpandedState
    contacts: tuple[FirstContact, ...]
    support: SupportFit | None
    friction: FrictionSweep | None
    simulated: DropResult
    middle: Replayed
    lower: Replayed
    upper: Replayed
    measured_time: Array
    measured: Array
    agreement: Agreement
    draws: Draws | None
    values: dict[str, dict[str, IdentifiedValue]]
    peak_times: dict[str, float]
    fixed: str
    warnings: tuple[str, ...]

    @property
    def name(self) -> str:
        """Short name of the drop."""
        return self.record.name
