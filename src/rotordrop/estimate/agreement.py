"""How far a simulated drop follows the record: distances in windows, contact times, bounces, horizon."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotordrop.arrays import Array
from rotordrop.estimate.published import Agreement, BearingAgreement, Window
from rotordrop.evidence.contacts import contact_intervals

AFTER_CONTACT = 2e-3
"""What of the flight after the first contacts belongs to the first window [s] (chosen)."""

WINDOWS = (0.02, 0.05, 0.2)
"""Ends of the other windows [s from power-off]: before two drops part, while they do, and all (chosen)."""

COMPARABLE_SHARE = 0.1
"""Two orbits are compared point by point until they differ by this share of the air gap [1]
(chosen)."""

RUNNING = 2e-3
"""Length of the running mean behind the horizon [s] (chosen)."""

CONTACTS_LISTED = 6
"""First contacts of a bearing that are shown beside each other (chosen)."""

TENFOLD = 33e-3
"""Time in which small differences of two drops grow tenfold [s]."""


def compare_orbits(
    time: Array,
    measured: Array,
    simulated: Array,
    gaps: Array,
    names: Sequence[str],
    *,
    at: Array | None = None,
) -> Agreement:
    """Compare a measured and a simulated orbit, shapes (T, B, 2) [m], at the times of the measured one.

    Times (T,) count from power-off [s], ``at`` are those of the simulated orbit where they differ; the
    bearings have these gaps (B,) [m] and names.
    """
    if at is not None:
        columns = simulated.reshape(len(at), -1).T
        simulated = np.column_stack([np.interp(time, at, column) for column in columns])
        simulated = simulated.reshape(measured.shape)
    apart = np.hypot(*np.moveaxis(simulated - measured, -1, 0))
    contacts = [
        tuple(contact_intervals(time, np.hypot(*one[:, b].T), float(gap)) for one in (measured, simulated))
        for b, gap in enumerate(gaps)
    ]
    firsts = [seen[0] for seen, _ in contacts if len(seen)]
    begin = min((first[0] for first in firsts), default=float(time[0]))
    close = max((first[1] for first in firsts), default=float(time[0]))
    inside = time >= begin
    return Agreement(
        windows=_windows(time, apart, begin, close, names),
        bearings={
            names[b]: BearingAgreement(
                measured_contacts_s=seen[:CONTACTS_LISTED].tolist(),
                simulated_contacts_s=made[:CONTACTS_LISTED].tolist(),
                measured_bounce_m=_bounce(time, measured[:, b], seen, float(gaps[b])),
                simulated_bounce_m=_bounce(time, simulated[:, b], made, float(gaps[b])),
                horizon_s=horizon(time, apart[:, b], float(gaps[b])),
            )
            for b, (seen, made) in enumerate(contacts)
        },
        orbit_disagreement_m=orbit_disagreement(time[inside], apart[inside], begin),
    )


def _windows(time: Array, apart: Array, begin: float, close: float, names: Sequence[str]) -> list[Window]:
    spans = [("first contact", begin, close + AFTER_CONTACT)]
    spans += [(f"{1e3 * end:.0f} ms", 0.0, end) for end in WINDOWS]
    found = []
    for name, start, end in spans:
        inside = (time >= start) & (time <= end)
        if inside.any():
            rms = dict(zip(names, np.sqrt(np.mean(apart[inside] ** 2, axis=0)).tolist(), strict=True))
            found.append(Window(name=name, start=start, end=min(end, float(time[-1])), rms=rms))
    return found


def _bounce(time: Array, place: Array, contacts: Array, gap: float) -> float | None:
    """Largest height above the lowest point of the air gap between first and second contact [m]."""
    if not len(contacts):
        return None
    until = contacts[1, 0] if len(contacts) > 1 else float(time[-1])
    flight = (time >= contacts[0, 1]) & (time <= until)
    return float(place[flight, 1].max() + gap) if flight.any() else None


def horizon(time: Array, apart: Array, gap: float) -> float:
    """Time up to which orbits stay within a tenth of the air gap of each other [s], by a running mean."""
    samples = max(1, round(RUNNING / float(time[1] - time[0])))
    smooth = np.convolve(apart, np.full(samples, 1.0 / samples), mode="same")
    beyond = np.flatnonzero(smooth > COMPARABLE_SHARE * gap)
    return float(time[beyond[0]]) if len(beyond) else float(time[-1])


def orbit_disagreement(time: Array, distance: Array, contact: float) -> float:
    """One number for how far two orbits lie apart [m rms], from their distance (T, B) [m], robust to chaos.

    Times (T,) and the first contact, from which on differences grow, count from power-off [s].

    Notes
    -----
    Source: own measure; root mean square with weights ``10^(−2 (t − t1) / 33 ms)``, the growth of small
    differences that the drop itself has.
    """
    weight = 10.0 ** (-2.0 * np.maximum(time - contact, 0.0) / TENFOLD)
    return float(np.sqrt(np.sum(weight[:, None] * distance**2) / (np.sum(weight) * distance.shape[1])))
