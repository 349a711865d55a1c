"""Air gap from where the first forces set in: a start for records without a settled tail."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotordrop.identification.sensing import build_sensing
from rotordrop.measurement.axes import along_sensors
from rotordrop.measurement.contacts import first_contacts
from rotordrop.measurement.events import DropInstant
from rotordrop.measurement.record import Record
from rotordrop.model.parameters import DropModel

Array = NDArray[np.float64]


def reach_at_first_contact(record: Record, model: DropModel, instant: DropInstant) -> Array:
    """Distance from the bearing centre at which the first force acts on the rotor [m], shape (B,).

    The fitted fall says where the rotor is when a force first makes it leave that fall; no contact law
    enters. The zeros of the sensors shift the result one to one, so it is a place to start from and not a
    measurement of the gap.

    Parameters
    ----------
    record : Record
        The record.
    model : DropModel
        Drop model of the machine.
    instant : DropInstant
        The drop with its fitted fall.

    Returns
    -------
    ndarray, shape (B,)
        NaN for bearings that are not touched soon after the end of the free fall.

    Raises
    ------
    IdentificationError, RecordError
        If the sensors cannot resolve the rigid motions, or the forces cannot be told apart.
    """
    sensing = build_sensing(model, record.sensors)
    reached = np.full(len(model.bearing_names), np.nan)
    for contact in first_contacts(record, model.machine, instant):
        b = model.bearing_names.index(contact.bearing)
        along = along_sensors(instant.fall.predicted(np.array([contact.start])), record.sensors)
        reached[b] = np.hypot(*sensing.at_bearings(along)[0, b])
    return reached
