"""The first steps of an estimate: air gap, speed, initial state, first contact (Neisi 2020, Fig. 4)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.estimated import NINETY
from rotordrop.identification.air_gap import AirGap, SettledRest, find_rest, identify_air_gap
from rotordrop.identification.evidence import read_evidence
from rotordrop.identification.first_contact import FirstContact, identify_first_contacts
from rotordrop.identification.initial_state import InitialState, fit_initial_state
from rotordrop.identification.modal_expansion import ExpandedState, expand_initial_state
from rotordrop.identification.sensing import build_sensing
from rotordrop.identification.speed import SpeedFit
from rotordrop.machine import Machine
from rotordrop.measurement.events import DropInstant, find_drop_instant
from rotordrop.measurement.record import Record
from rotordrop.model.parameters import DropModel, build_drop_model

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class RecordedFall:
    """What a record says up to the first contact; N samples, B bearings.

    Attributes
    ----------
    record : Record
        The record.
    instant : DropInstant
        Power-off in record time, as the fit of the fall leaves it.
    speed : SpeedFit
        Speed at power-off and how it falls.
    model : DropModel
        Drop model of the machine with the identified speed law.
    rest : SettledRest
        Where the rotor rests at the end.
    gap : AirGap
        Air gaps with the sag of the machine's supports.
    initial : InitialState
        Initial state by the fit over the fall.
    expanded : ExpandedState
        Initial state by the paper's modal expansion.
    contacts : tuple of FirstContact
        First contact of every bearing.
    """

    record: Record
    instant: DropInstant
    speed: SpeedFit
    model: DropModel
    rest: SettledRest
    gap: AirGap
    initial: InitialState
    expanded: ExpandedState
    contacts: tuple[FirstContact, ...]

    @property
    def first_contact(self) -> float:
        """Earliest first contact [s from power-off]."""
        return min(contact.start for contact in self.contacts)

    @property
    def later_contact(self) -> float:
        """Latest first contact [s from power-off]."""
        return max(contact.start for contact in self.contacts)


def recorded_fall(machine: Machine, record: Record, tail: Record | None) -> RecordedFall:
    """Air gap, speed, initial state and first contact of a recorded drop.

    Parameters
    ----------
    machine : Machine
        The machine.
    record : Record
        The recorded drop.
    tail : Record, optional
        The settled tail; needed when the record does not reach standstill.

    Raises
    ------
    IdentificationError, RecordError
        If a step finds nothing to work on; says which and why.
    """
    instant = find_drop_instant(record, machine)
    evidence = read_evidence(build_drop_model(machine), record, power_off=instant)
    speed = evidence.speed
    slowed = {"speed.aero_time_constant": min(speed.aero_time_constant.value, 1e6)}
    model = build_drop_model(machine.with_values(slowed))
    sensing = build_sensing(model, record.sensors)
    rest = find_rest(record, tail, sensing)
    gap = identify_air_gap(rest, model, sensing)
    initial = fit_initial_state(evidence, rest, gap.value, model, sensing)
    from_rest = initial.deviation_of(record) + initial.settled
    return RecordedFall(
        record=record,
        instant=_refined(instant, initial),
        speed=speed,
        model=model,
        rest=rest,
        gap=gap,
        initial=initial,
        expanded=expand_initial_state(record.time, from_rest, initial.drop_instant, model, sensing),
        contacts=identify_first_contacts(
            record.time - initial.drop_instant,
            sensing.at_bearings(from_rest),
            gap.value,
            np.asarray(model.load_shares),
            float(machine.gravity),
            float(np.mean(initial.noise)),
        ),
    )


def measured_drop(fall: RecordedFall, duration: float) -> tuple[Array, Array]:
    """Samples from power-off [s], shape (N,), and displacement at the bearings [m], shape (N, B, 2).

    As the sensors show it: the straight rotor through them, counted from the rest position.
    """
    initial = fall.initial
    time = fall.record.time - initial.drop_instant
    inside = (time >= 0.0) & (time <= duration)
    along = initial.deviation_of(fall.record)[inside] + initial.settled
    return time[inside], initial.sensing.at_bearings(along)


def _refined(instant: DropInstant, initial: InitialState) -> DropInstant:
    error = initial.drop_instant_error
    return replace(
        instant,
        value=initial.drop_instant,
        standard_error=error,
        interval_90=(initial.drop_instant - NINETY * error, initial.drop_instant + NINETY * error),
        method=f"{instant.method}; refined by the fit of the initial state",
    )
