"""What sensors do beyond gain, offset and runout: lag, cross-axis sensitivity, moving bracket, plane."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.support import support_sag
from rotordrop.errors import UsageError
from rotordrop.rotor.layout import StateLayout
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.unknowns import Unknown
from rotordrop.track._filter import SensorForm

Array = NDArray[np.float64]

CATCHING_UP_SIGMA = 1e-6
"""How far [m] a sensor may lag behind at power-off."""


def sensor_form(model: DropModel, unknowns: tuple[Unknown, ...], rows: Array) -> SensorForm:
    """What the sensors of a machine do beyond gain, offset and runout, as the filter takes it."""
    names = [sensor.name for sensor in model.machine.sensors]
    own = [k for k, unknown in enumerate(unknowns) if unknown.parameter.owner == "sensor"]
    terms = [(names.index(unknowns[k].owner), k) for k in own if unknowns[k].parameter.seen is not None]
    lagging = [k for name in names for k in own if unknowns[k].parameter.lag and unknowns[k].owner == name]
    first = model.layout.sensors.start
    s = rows.shape[1]
    return SensorForm(
        term=np.array(terms, dtype=np.int64).reshape(-1, 2),
        term_row=np.array([_term_row(model, unknowns[k], c) for c, k in terms]).reshape(-1, s),
        lag=np.array([(first + c, k) for c, k in enumerate(lagging)], dtype=np.int64).reshape(-1, 2),
        lag_row=rows[: len(lagging)],
        shortest=np.array([unknowns[k].bounds[0] for k in lagging]),
        longest=np.array([unknowns[k].bounds[1] for k in lagging]),
    )


def _term_row(model: DropModel, unknown: Unknown, c: int) -> Array:
    """What a sensor sees per unit of one of its unknowns, shape (s,) [m per state]."""
    layout, sensor = model.layout, model.machine.sensors[c]
    assert unknown.parameter.seen is not None
    row, seen = np.zeros(layout.n_dynamic), unknown.parameter.seen(sensor)
    if seen.of_housing is not None:
        support = layout.support.start + 2 * model.bearing_names.index(sensor.bearing)
        row[support : support + 2] = seen.of_housing
    for along, shape in (
        (seen.of_rotor, model.basis.node_row(sensor.node)),
        (seen.of_slope, _slope(model, sensor.node)),
    ):
        if along is not None:
            row[layout.modal_x], row[layout.modal_y] = along[0] * shape, along[1] * shape
    return row


def _slope(model: DropModel, node: int) -> Array:
    """Change of the mode shapes along the rotor at a node, shape (m,) [1/m per amplitude]."""
    z = model.fe.node_positions
    left, right = max(node - 1, 1), min(node + 1, len(z))
    rise = model.basis.node_row(right) - model.basis.node_row(left)
    return np.asarray(rise / (z[right - 1] - z[left - 1]))


def share_in_groups(model: DropModel, unknowns: tuple[Unknown, ...], block: Array) -> None:
    """Add to the prior covariance of the unknowns (P, P) what sensors of a group have in common."""
    node = {sensor.name: sensor.node for sensor in model.machine.sensors}
    for i, one in enumerate(unknowns):
        for k, other in enumerate(unknowns):
            same = i != k and one.parameter is other.parameter and one.common_variance != 0.0
            if same and (one.parameter.group == "machine" or node[one.owner] == node[other.owner]):
                block[i, k] = one.common_variance


def begin_caught_up(layout: StateLayout, rows: Array, mean: Array, covariance: Array) -> None:
    """Let the sensors begin at what they see: a levitated rotor moves little within a time constant.

    Raises
    ------
    UsageError
        If some sensors have a time constant and others none.
    """
    s = layout.n_dynamic
    if layout.sensor_own < len(rows):
        raise UsageError(
            f"{layout.sensor_own} of {len(rows)} sensors have a 'time_constant'; give it for all of them or "
            "for none"
        )
    spread = np.eye(s)
    spread[layout.sensors] = rows
    mean[:s] = spread @ mean[:s]
    covariance[:s, :s] = spread @ covariance[:s, :s] @ spread.T
    lagging = np.arange(layout.sensors.start, layout.sensors.stop)
    covariance[lagging, lagging] += CATCHING_UP_SIGMA**2


def rest_terms(
    model: DropModel, unknowns: tuple[Unknown, ...], c: int, height: float
) -> Iterator[tuple[int, float]]:
    """Unknowns of sensor ``c`` and what it sees per unit of each of the rotor at rest [m]; it lies level."""
    sensor = model.machine.sensors[c]
    for k, unknown in enumerate(unknowns):
        if unknown.parameter.seen is None or unknown.owner != sensor.name:
            continue
        seen = unknown.parameter.seen(sensor)
        if seen.of_rotor is not None:
            yield k, seen.of_rotor[1] * height
        if seen.of_housing is not None:
            b = model.bearing_names.index(sensor.bearing)
            sag = support_sag(model.parameters.bearing[b], float(model.load_shares[b]))
            yield k, -seen.of_housing[1] * sag
