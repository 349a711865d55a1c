"""Initial state of the drop from a fit over the whole fall: the better of the two starts.

From power-off to the first contact the rotor is a linear system. Its rigid and bending modes, the remanent
lift of the magnets and the unbalance are found together, by maximum posterior probability, from the samples
of the fall and from the orbit before it. The computed gravity sag of the levitated rotor, whose release rings
at the first bending mode, comes in as prior; the bending part of the orbit follows from the forces that hold
it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.sensor import Sensor
from rotordrop.errors import IdentificationError
from rotordrop.evidence.air_gap import AirGap, SettledRest
from rotordrop.evidence.events import DropInstant
from rotordrop.evidence.fall_fit import FallFit, FallReadings, Unknowns, unbalance_nodes
from rotordrop.evidence.free_fall import FreeFall, build_free_fall
from rotordrop.evidence.levitated import LevitatedModel
from rotordrop.evidence.power_off import PowerOff
from rotordrop.evidence.sensing import Sensing
from rotordrop.evidence.speed import SpeedFit
from rotordrop.known import NINETY
from rotordrop.record.axes import along_sensors
from rotordrop.record.record import Record
from rotordrop.record.speed import RotorAngle
from rotordrop.rotor.parameters import DropModel

Array = NDArray[np.float64]

CLEARANCE_KEPT = 0.03
"""The fall ends when the rotor has come this close to the air gap, over the gap [1]: a zero of the sensors
that is off looks like another gap."""

FEWEST_SAMPLES = 12


@dataclass(frozen=True, kw_only=True)
class InitialState:
    """Initial state with its uncertainty; m modes per plane, B bearings, A magnetic bearings, n unknowns."""

    fall: FreeFall
    """Linear model of the falling rotor."""
    sensing: Sensing
    """What the sensors see of it."""
    sensors: tuple[Sensor, ...]
    """The sensors of the record."""
    rest_along: Array
    """Displacements along the sensors at rest [m], from which deviations count, shape (S,)."""
    levitated: LevitatedModel
    """Readings before the drop: hum and 2X runout are taken off with it."""
    angle: RotorAngle
    """Rotor angle over the record."""
    unknowns: Unknowns
    """Where each unknown is in `mean`."""
    mean: Array
    covariance: Array
    """Estimate and covariance of all unknowns at power-off."""
    settled: Array
    """Displacement along the sensors at rest, from the settled radius [m], shape (S,)."""
    drop_instant: float
    drop_instant_error: float
    """Power-off in record time [s] and its standard error."""
    end: float
    """End of the free fall, from power-off [s]."""
    noise: Array
    """Noise of the displacements along the sensors [m], shape (S,)."""
    misfit: float
    """Mean square of the residual over the noise [1]; 1 is a perfect model."""
    samples: int
    """Samples of the fall that were used."""
    notes: tuple[str, ...] = ()
    """What to know about this state."""

    @property
    def decay(self) -> float:
        """Time constant of the remanent force [s]."""
        return float(np.exp(self.mean[self.unknowns.decay]))

    @property
    def remanent_force(self) -> Array:
        """Remanent force at power-off [N], shape (A, 2)."""
        return self.mean[self.fall.remanent].reshape(-1, 2).copy()

    @property
    def displacement(self) -> Array:
        """Displacement at the bearing nodes at power-off [m], shape (B, 2)."""
        return self._at_bearings(self.fall.displacement)

    @property
    def velocity(self) -> Array:
        """Velocity at the bearing nodes at power-off [m/s], shape (B, 2)."""
        return self._at_bearings(self.fall.velocity)

    def _at_bearings(self, part: slice) -> Array:
        amplitudes = self.mean[part].reshape(2, -1)
        return np.asarray(self.fall.model.parameters.bearing_shape @ amplitudes.T)

    def state_at(self, time: float, unknowns: Array | None = None) -> Array:
        """State of the fall at a time from power-off [s], shape (n_states,)."""
        values = self.mean if unknowns is None else unknowns
        decay = float(np.exp(values[self.unknowns.decay]))
        return self.fall.transition(decay, time) @ values[self.unknowns.states]

    def deviation_of(self, record: Record) -> Array:
        """Displacements along the sensors from rest, hum and 2X runout taken off [m], shape (N, S)."""
        return deviations(record, self.rest_along, self.levitated, self.angle)

    def refined(self, instant: DropInstant) -> DropInstant:
        """Power-off as this fit leaves it."""
        error = self.drop_instant_error
        return replace(
            instant,
            value=self.drop_instant,
            standard_error=error,
            interval_90=(self.drop_instant - NINETY * error, self.drop_instant + NINETY * error),
            method=f"{instant.method}; refined by the fit of the initial state",
        )

    def square_root(self) -> Array:
        """Matrix L with L Lᵀ the covariance, shape (n, n); a draw is ``mean + L @ standard_normal``."""
        return covariance_root(self.covariance)


def covariance_root(covariance: Array) -> Array:
    """Matrix L with L Lᵀ the covariance, shape (n, n): symmetric once each unknown has unit variance.

    Of all square roots this one is determined by the covariance alone. Eigenvectors as columns would not be:
    those of equal eigenvalues are arbitrary in their subspace, so draws would differ from one linear algebra
    library to the next. Unlike a triangular root it needs no variance in every direction.
    """
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray(scale[:, None] * ((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T))


def settled_along(rest: SettledRest, sensing: Sensing) -> Array:
    """Displacement along the sensors [m], shape (S,), of the rotor at the lowest point of its bearings."""
    return np.asarray(-sensing.from_bearings[..., 1] @ rest.radius + sensing.settled_bend)


def end_of_fall(time: Array, place: Array, gaps: Array) -> float:
    """Last time of the free fall [s from the first sample's clock].

    Parameters
    ----------
    time : ndarray, shape (N,)
        Time from power-off [s].
    place : ndarray, shape (N, B, 2)
        Displacement at the bearings [m].
    gaps : ndarray, shape (B,)
        Air gaps [m].
    """
    radius = np.hypot(place[..., 0], place[..., 1])
    near = np.any(radius > (1.0 - CLEARANCE_KEPT) * gaps, axis=1) & (time > 0.0)
    if not near.any():
        raise IdentificationError(
            f"the rotor comes within {1e6 * float(np.min(gaps - radius.max(axis=0))):.0f} µm of the air gap "
            f"{', '.join(f'{1e6 * g:.0f}' for g in gaps)} µm at most in the record; expected a contact. "
            "Check the settled tail, the unit and the gain of the sensors."
        )
    return float(time[int(np.argmax(near)) - 1])


def fit_initial_state(
    record: Record,
    model: DropModel,
    release: DropInstant | PowerOff,
    speed: SpeedFit,
    angle: RotorAngle,
    gap: AirGap,
    sensing: Sensing,
) -> InitialState:
    """Initial state by a fit over the fall, with covariance.

    Parameters
    ----------
    record : Record
        Readings from before power-off to the first contact at least.
    model : DropModel
        The rotor.
    release : DropInstant or PowerOff
        Power-off with the levitated motion before it.
    speed, angle : SpeedFit, RotorAngle
        Speed at power-off, and the angle over the record.
    gap : AirGap
        Air gaps, to see where the fall ends, and the rest position, from which displacements count, so that
        zero errors of the sensors drop out.
    sensing : Sensing
        What the sensors see of the rotor.

    Raises
    ------
    IdentificationError
        If the record begins with the fall, the rotor never comes near the air gap, or the fall has too few
        samples.

    Notes
    -----
    Source: own method after Neisi 2020, section 3.1. Differs from the paper: the paper expands the state at
    one instant in the rigid modes.
    """
    if not isinstance(release, DropInstant):
        raise IdentificationError(
            f"{record.name} begins with the fall; expected the levitated rotor before it. Record with "
            "pre-trigger."
        )
    levitated, rest, time = release.levitated, gap.rest, record.time - release.value
    settled = settled_along(rest, sensing)
    end = end_of_fall(time, sensing.at_bearings(record.along - rest.along + settled), gap.value)
    inside = (time > 0.0) & (time <= end)
    _check_samples(record, inside, end)
    # Deviations from rest, not readings, are compared: zeros of the sensors are in both and drop out, and
    # what is left of them is an error of the rest position, which is one of the unknowns.
    fall = build_free_fall(model, speed.initial, unbalance_nodes(model.machine))
    readings = _fall_readings(record, release, angle, rest, inside)
    problem = FallFit(fall, sensing, readings, settled, model, release.standard_error)
    mean, covariance, misfit = problem.solve()
    shift = problem.unknowns.shift
    return InitialState(
        fall=fall,
        sensing=sensing,
        sensors=record.sensors,
        rest_along=rest.along,
        levitated=levitated,
        angle=angle,
        unknowns=problem.unknowns,
        mean=mean,
        covariance=covariance * max(misfit, 1.0),
        settled=settled,
        drop_instant=release.value + 1e-3 * float(mean[shift]),
        drop_instant_error=float(1e-3 * np.sqrt(covariance[shift, shift])),
        end=end - 1e-3 * float(mean[shift]),
        noise=readings.noise,
        misfit=misfit,
        samples=int(inside.sum()),
        notes=_notes(misfit),
    )


def _check_samples(record: Record, inside: NDArray[np.bool_], end: float) -> None:
    if int(inside.sum()) < FEWEST_SAMPLES:
        raise IdentificationError(
            f"{record.name}: {int(inside.sum())} samples between power-off and the first contact at "
            f"{1e3 * end:.3g} ms; at "
            f"least {FEWEST_SAMPLES} are needed for the initial state. Sample faster, or check the air gap."
        )
    if not np.isfinite(record.signals[inside]).all():
        raise IdentificationError(f"{record.name}: readings are missing between power-off and first contact")


def _notes(misfit: float) -> tuple[str, ...]:
    if misfit <= 2.0:
        return ()
    return (
        f"the fall deviates from a free rotor by {misfit**0.5:.1f} times the sensor noise; expected about 1. "
        "Check nodes and angles of the sensors",
    )


def deviations(record: Record, rest: Array, levitated: LevitatedModel, angle: RotorAngle) -> Array:
    """Displacements along the sensors from rest (S,), hum and 2X runout taken off [m], shape (N, S).

    A levitated rotor on its orbit shows no 2X of its own: what is there is runout and turns on with the
    shaft.
    """
    return record.along - levitated.disturbance(record.time, angle) * record.gains - rest


def _fall_readings(
    record: Record, release: DropInstant, angle: RotorAngle, rest: SettledRest, inside: NDArray[np.bool_]
) -> FallReadings:
    levitated = release.levitated
    turning = 2.0 * np.pi * levitated.tones[0]
    turned = np.exp(1j * turning * release.value) * levitated.amplitudes[0]
    orbit = along_sensors((levitated.mean + turned.real)[None, :], record.sensors)[0]
    return FallReadings(
        time=(record.time - release.value)[inside],
        deviation=deviations(record, rest.along, levitated, angle)[inside],
        noise=np.maximum(levitated.noise * record.gains, 1e-9),
        orbit=orbit - rest.along,
        orbit_velocity=(1j * turning * turned).real * record.gains,
        orbit_acceleration=(-(turning**2) * turned).real * record.gains,
    )
