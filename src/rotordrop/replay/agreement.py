"""Two orbits compared: distances in windows, contact times, bounces, comparable time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotordrop.estimate.agreement import Agreement, BearingAgreement, WindowAgreement
from rotordrop.evidence.first_contact import contact_intervals

Array = NDArray[np.float64]

TENFOLD = 33e-3
"""Time in which small differences of a drop grow tenfold [s]; seen on simulated drops of the 60 kg rotor."""

AFTER_CONTACT = 2e-3
"""Part of the flight after the first contacts that belongs to the first window [s]; chosen, not measured."""

WINDOWS = (0.02, 0.05, 0.2)
"""Ends of the other windows [s from power-off]."""

COMPARABLE_SHARE = 0.1
"""Two orbits are compared point by point until they differ by this share of the air gap [1]; chosen."""

RUNNING = 2e-3
"""Length of the running mean behind the horizon [s]."""

CONTACTS_LISTED = 6


def orbit_disagreement(time: Array, distance: Array, contact: float) -> float:
    """One number for how far two orbits lie apart [m rms], robust to chaos.

    Parameters
    ----------
    time : ndarray, shape (T,)
        Time from power-off [s].
    distance : ndarray, shape (T, B)
        Distance of the two orbits in each bearing [m].
    contact : float
        First contact [s]; from there on differences grow.

    Notes
    -----
    Source: own measure; root mean square with weights ``10^(−2 (t − t1) / 33 ms)``, the growth of small
    differences that the drop itself has.
    """
    weight = 10.0 ** (-2.0 * np.maximum(time - contact, 0.0) / TENFOLD)
    return float(np.sqrt(np.sum(weight[:, None] * distance**2) / (np.sum(weight) * distance.shape[1])))


def compare_orbits(
    time: Array, measured: Array, simulated: Array, gaps: Array, *, expected_horizon: float | None = None
) -> Agreement:
    """Compare a measured and a simulated orbit on the same times.

    Parameters
    ----------
    time : ndarray, shape (T,)
        From power-off [s].
    measured, simulated : ndarray, shape (T, B, 2)
        Displacements at the bearings [m].
    gaps : ndarray, shape (B,)
        Air gaps [m].
    expected_horizon : float, optional
        Horizon that the spread of draws leaves [s].
    """
    apart = np.hypot(*np.moveaxis(simulated - measured, -1, 0))
    bearings = [
        _bearing(time, measured[:, b], simulated[:, b], float(gap), apart[:, b]) for b, gap in enumerate(gaps)
    ]
    firsts = [one.measured_contacts[0] for one in bearings if len(one.measured_contacts)]
    begin = min((first[0] for first in firsts), default=float(time[0]))
    close = max((first[1] for first in firsts), default=float(time[0]))
    spans = [("first contact", begin, close + AFTER_CONTACT)]
    spans += [(f"{1e3 * end:.0f} ms", 0.0, end) for end in WINDOWS]
    windows = []
    for name, start, end in spans:
        inside = (time >= start) & (time <= end)
        if inside.any():
            rms = np.sqrt(np.mean(apart[inside] ** 2, axis=0))
            windows.append(WindowAgreement(name=name, start=start, end=min(end, float(time[-1])), rms=rms))
    touched = time >= begin
    return Agreement(
        windows=tuple(windows),
        bearings=tuple(bearings),
        disagreement=orbit_disagreement(time[touched], apart[touched], begin),
        expected_horizon=expected_horizon,
    )


def _bearing(time: Array, measured: Array, simulated: Array, gap: float, apart: Array) -> BearingAgreement:
    contacts = [contact_intervals(time, np.hypot(*orbit.T), gap) for orbit in (measured, simulated)]
    bounces = [_bounce(time, *pair, gap) for pair in zip((measured, simulated), contacts, strict=True)]
    samples = max(1, round(RUNNING / float(time[1] - time[0])))
    smooth = np.convolve(apart, np.full(samples, 1.0 / samples), mode="same")
    return BearingAgreement(
        measured_contacts=contacts[0][:CONTACTS_LISTED],
        simulated_contacts=contacts[1][:CONTACTS_LISTED],
        measured_bounce=bounces[0],
        simulated_bounce=bounces[1],
        horizon=horizon(time, smooth[:, None], np.array([gap])),
    )


def _bounce(time: Array, orbit: Array, contacts: Array, gap: float) -> float:
    """Largest height above the lowest point of the air gap between first and second contact [m]."""
    if not len(contacts):
        return float("nan")
    until = contacts[1, 0] if len(contacts) > 1 else float(time[-1])
    flight = (time >= contacts[0, 1]) & (time <= until)
    return float(orbit[flight, 1].max() + gap) if flight.any() else float("nan")


def horizon(time: Array, apart: Array, gaps: Array) -> float:
    """Time up to which distances (T, B) [m] stay within a tenth of the air gaps (B,) [s]."""
    beyond = np.flatnonzero(np.any(apart > COMPARABLE_SHARE * gaps, axis=1))
    return float(time[beyond[0]]) if len(beyond) else float(time[-1])
