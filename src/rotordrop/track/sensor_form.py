"""What sensors do beyond gain, offset and runout: reading, derivative, lag, slow noise, further terms."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rotordrop.arrays import Array, Integers
from rotordrop.elements.sensor import LAG
from rotordrop.elements.support import support_sag
from rotordrop.errors import UsageError
from rotordrop.evidence.colour import SlowNoise, decay
from rotordrop.physics._compile import by_reference, kernel, lean_kernel
from rotordrop.physics.elementary import exp, sine_cosine
from rotordrop.rotor.layout import StateLayout
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.unknowns import Unknown
from rotordrop.track._arrays import fill

CATCHING_UP_SIGMA = 1e-6
"""How far [m] a sensor may lag behind at power-off."""


@by_reference
class SensorForm(NamedTuple):
    """What sensors do beyond gain, offset and runout; T terms, G sensors that lag behind, M parts of noise
    that outlast a sample, s dynamic.

    A sensor sees ``(its row + Σ value of the unknown · row of the term) · state``: ``term`` (T, 2) holds
    sensor and unknown, ``term_row`` (T, s) its row. ``lag`` (G, 2) holds for each sensor the state with what
    it has got to and the unknown that is the logarithm of its time constant, between ``shortest`` and
    ``longest`` (G,); ``lag_row`` (G, s) is what it sees. The last M of the estimate are slow noise of the
    sensors ``noisy`` (M,), each with the variance ``noise_variance`` (M,) [m²], of which a sample leaves
    ``noise_decay`` (M,). All are empty for plain sensors.
    """

    term: Integers
    term_row: Array
    lag: Integers
    lag_row: Array
    shortest: Array
    longest: Array
    noisy: Integers
    noise_decay: Array
    noise_variance: Array


@lean_kernel
def add_seen(
    c: int, at: Array, sensor_row: Array, form: SensorForm, s: int, weight: float, row: Array
) -> float:
    """Add ``weight`` times the derivative of what sensor ``c`` sees to ``row``; returns what it sees [m].

    ``at`` and ``row`` begin with the dynamic state (s,), its unknowns follow.
    """
    seen = 0.0
    for j in range(s):
        seen += sensor_row[j] * at[j]
        row[j] += weight * sensor_row[j]
    for t in range(form.term.shape[0]):
        if form.term[t, 0] == c:
            along, unknown = 0.0, s + form.term[t, 1]
            for j in range(s):
                along += form.term_row[t, j] * at[j]
                row[j] += weight * at[unknown] * form.term_row[t, j]
            row[unknown] += weight * along
            seen += at[unknown] * along
    return seen


@kernel
def lag_step(before: Array, after: Array, form: SensorForm, dt: float, F: Array) -> None:
    """Advance what the sensors have got to by one sample, in ``after`` (s + P,) and ``F`` (s, s + P).

    A first-order lag follows a straight line between two samples exactly, so that no time constant, however
    short, asks for a shorter step. ``before`` (s + P,) is state and unknowns at the sample before.
    """
    s, columns = F.shape
    by_state = np.empty(columns)
    for c in range(form.lag.shape[0]):
        i, k = form.lag[c, 0], form.lag[c, 1]
        q = dt / exp(min(max(before[s + k], form.shortest[c]), form.longest[c]))
        a = exp(-q)
        b = (1.0 - a) / q
        fill(F[i], 0.0)
        first = add_seen(c, before, form.lag_row[c], form, s, b - a, F[i])
        fill(by_state, 0.0)
        last = add_seen(c, after, form.lag_row[c], form, s, 1.0, by_state)
        # What it sees now depends on the sample before by way of the state now.
        for e in range(s, columns):
            F[i, e] += (1.0 - b) * by_state[e]
        for j in range(s):
            if by_state[j] != 0.0:
                for e in range(columns):
                    F[i, e] += (1.0 - b) * by_state[j] * F[j, e]
        F[i, i] += a
        F[i, s + k] += a * q * before[i] + (b - a - a * q) * first - (b - a) * last
        after[i] = a * before[i] + (b - a) * first + (1.0 - b) * last


@lean_kernel
def measurement_row(
    c: int, at: Array, angle: float, sensor_row: Array, first: int, n_c: int, form: SensorForm, row: Array
) -> float:
    """Reading of sensor ``c`` predicted at an estimate [m] and its derivative ``row`` (n,).

    The reading is ``(1 + gain error) · (sensor row · state) + offset + runout at the rotor angle``. The gains
    begin at ``first``, the offsets, cosines and sines follow, ``n_c`` of each, and the slow noise, which is
    read beside all that. A sensor that lags behind reads its own state, and its terms act on what it lags
    behind of.
    """
    fill(row, 0.0)
    k = first + c
    sine, cosine = sine_cosine(angle)
    growth = 1.0 + at[k]
    s = sensor_row.shape[0]
    if form.lag.shape[0] == 0:
        seen = add_seen(c, at, sensor_row, form, s, growth, row)
    else:
        seen = 0.0
        for j in range(s):
            seen += sensor_row[j] * at[j]
            row[j] = growth * sensor_row[j]
    row[k] = seen
    row[k + n_c] = 1.0
    row[k + 2 * n_c] = cosine
    row[k + 3 * n_c] = sine
    predicted: float = growth * seen + at[k + n_c] + at[k + 2 * n_c] * cosine + at[k + 3 * n_c] * sine
    for m in range(form.noisy.shape[0]):
        if form.noisy[m] == c:
            row[first + 4 * n_c + m] = 1.0
            predicted += at[first + 4 * n_c + m]
    return predicted


@kernel
def noise_step(mean: Array, P: Array, form: SensorForm) -> None:
    """Advance the slow noise, the last of the estimate, by one sample: mean (n,) and covariance (n, n)."""
    n, parts = mean.shape[0], form.noisy.shape[0]
    for m in range(parts):
        i, a = n - parts + m, form.noise_decay[m]
        mean[i] *= a
        for j in range(n):
            P[i, j] *= a
        for j in range(n):
            P[j, i] *= a
        P[i, i] += (1.0 - a * a) * form.noise_variance[m]


def sensor_form(
    model: DropModel, unknowns: tuple[Unknown, ...], rows: Array, noise: SlowNoise, dt: float
) -> SensorForm:
    """What the sensors of a machine do beyond gain, offset and runout, as the filter takes it."""
    names = [sensor.name for sensor in model.machine.sensors]
    terms = [(names.index(u.owner), k) for k, u in enumerate(unknowns) if u.parameter.seen is not None]
    lagging = [k for name in names for k, u in enumerate(unknowns) if u.parameter is LAG and u.owner == name]
    first = model.layout.sensors.start
    s = rows.shape[1]
    return SensorForm(
        term=np.array(terms, dtype=np.int64).reshape(-1, 2),
        term_row=np.array([_term_row(model, unknowns[k], c) for c, k in terms]).reshape(-1, s),
        lag=np.array([(first + c, k) for c, k in enumerate(lagging)], dtype=np.int64).reshape(-1, 2),
        lag_row=rows[: len(lagging)],
        shortest=np.array([unknowns[k].bounds[0] for k in lagging]),
        longest=np.array([unknowns[k].bounds[1] for k in lagging]),
        noisy=noise.channel,
        noise_decay=decay(noise.frequency, dt),
        noise_variance=noise.variance,
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
        (seen.of_slope, _slope(model, sensor.node, unknown.begin)),
    ):
        if along is not None:
            row[layout.modal_x], row[layout.modal_y] = along[0] * shape, along[1] * shape
    return row


def _slope(model: DropModel, node: int, offset: float) -> Array:
    """Rise of the mode shapes from a node to a place beside it over their distance [m], shape (m,) [1/m].

    Over some centimetres a shaft is not its tangent, which is taken where the distance is zero.
    """
    from scipy.interpolate import CubicSpline  # slow to load, and few machines have such a sensor

    z = model.fe.node_positions
    shapes = CubicSpline(z, [model.basis.node_row(k) for k in range(1, len(z) + 1)])
    at = z[node - 1]
    return np.asarray(shapes(at, 1) if offset == 0.0 else (shapes(at + offset) - shapes(at)) / offset)


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
