"""The force on a rotor from its recorded motion alone: no contact law, no bearing, no drop.

The rotor model, held by what the machine file or the caller names, is driven by unknown forces at chosen
nodes. Their rates are random walks; a Kalman filter and smoother finds the forces that the readings ask for.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike

from rotordrop.arrays import Array
from rotordrop.errors import RecordError, UsageError
from rotordrop.known import NINETY, Known
from rotordrop.machine import Machine
from rotordrop.one_thread import one_thread
from rotordrop.record.record import Record
from rotordrop.require import each, numbers, require
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop.rotor.reduction import Reduction, reduce_rotor
from rotordrop.rotor.suspension import SUSPENSIONS, Support, suspension_of
from rotordrop.rotor.whirl import matrices_of
from rotordrop.track.input_state import (
    TURNED,
    ForcedRotor,
    Passed,
    backward_pass,
    forward_pass,
    pass_again,
    states_under,
    transition,
)
from rotordrop.track.problem import DEFAULT_NOISE, NOISE_FLOOR, rough_noise
from rotordrop.units import in_si

MOST_SAMPLES = 20_000
"""Samples taken at once: each keeps some 10 kB for the way back; chosen, not measured."""
FEWEST_SAMPLES = 64
"""Samples from which noise and force are distinguishable at all; chosen, not measured."""
SLOWEST, FASTEST = 1.0, 6.0
"""Bandwidths that the likelihood chooses from: periods in the record at least, samples in a period at least
[1]; chosen, not measured."""
DISTINGUISHABLE = 1e-3
"""Smallest over largest singular value of what forces do to the readings, below which they count as one
[1]: the smaller one would be found with a thousand times the error; chosen, not measured."""
EVEN = 1e-3
"""Part of a time step by which samples may lie off an even clock [1]; chosen, not measured."""
START_PERIOD = 20.0
"""Samples in a period at which a force as large as any reading asks for may act at first [1]: more than any
force that is found; chosen, not measured."""
AMB_VALUES = ("stiffness", "damping")
LOOKS = 5
"""Passes that find the strength about every sample [1]: with three to five the bands of six rotors under
sharp impacts held the same; more make quiet stretches ever quieter."""
PERIODS = 0.8
"""Part of a period of the bandwidth that has one strength [1]: with 1.0 the 90 % band of a soft impact held
99 % of its force, with 0.8 95 %."""
FEW = 1e-3
"""Readings' worth of the strength before, in every window [1]: it keeps a window that says nothing."""
STEPS = 100
"""Bandwidths of the table by which a strength has one [1]."""


@dataclass(frozen=True, kw_only=True)
class ForceEstimate:
    """Forces on a rotor found from its motion; N samples, K nodes, last axis (x, y)."""

    time: Array
    """Time of the record [s], shape (N,)."""
    nodes: tuple[int, ...]
    """Nodes at which the forces act, counted from 1."""
    force: Array
    """Force on the rotor [N], shape (N, K, 2)."""
    sigma: Array
    """Its standard error [N] by noise, sensors, AMBs and the phase of the unbalance, shape (N, K, 2)."""
    displacement: Array
    """Displacement of the rotor at these nodes [m], shape (N, K, 2)."""
    bandwidth: float
    """Frequency [Hz] up to which forces are found rather than smoothed away, where they change fastest."""
    negative_log_likelihood: float
    """Negative log likelihood of the readings [1]."""
    taken_as_exact: tuple[str, ...]
    """Values of the machine file that have no range or interval, so that the band knows no error of them."""

    @property
    def lower(self) -> Array:
        """Lower end of the 90 % band of every component [N], shape (N, K, 2)."""
        return self.force - NINETY * self.sigma

    @property
    def upper(self) -> Array:
        """Upper end of the 90 % band of every component [N], shape (N, K, 2)."""
        return self.force + NINETY * self.sigma


@one_thread()
def estimate_force(
    machine: Machine,
    record: Record,
    *,
    nodes: Sequence[int] | None = None,
    held: str = "AMBs",
    supports: Sequence[Support] = (),
    known_forces: Mapping[int, ArrayLike] | None = None,
    bandwidth: float | str | None = None,
    reduction: str | Reduction = "accurate",
) -> ForceEstimate:
    """Estimate the forces that moved a rotor as recorded, without any law of contact.

    For a rub, a contact without a drop, a magnet that pulls. The forces are those besides what holds the
    rotor, about the position at which its sensors read zero. Gain, offset, direction and polarity of the
    sensors enter; a lag, cross-axis sensitivity or a moving bracket does not.

    Parameters
    ----------
    machine : Machine
        Rotor and AMBs. Their stiffness and damping must be in the file; a range or interval widens the band.
    record : Record
        The motion, evenly sampled. It carries its sensors, which may be fewer than a drop needs.
    nodes : sequence of int, optional
        Where the unknown forces act, counted from 1; at the touchdown bearings when left out.
    held : str
        What holds the rotor: "AMBs", "touchdown bearings", or "free-free" for one that falls by its weight.
    supports : sequence of Support, optional
        Springs and dampers to the ground besides these, by `rotordrop.rotor.suspension.spring`: a joint, a
        seal.
    known_forces : mapping, optional
        Measured forces on the rotor by node [N], each of shape (N, 2): of a magnet, say.
    bandwidth : float or str, optional
        Frequency [Hz], or a text such as "100 Hz", up to which forces are sought everywhere. Left out, the
        likelihood of the readings chooses it about every sample; it takes the noise of the sensors as white,
        and takes for force whatever else it finds in them.
    reduction : str or Reduction
        Basis of the rotor, as for `build_drop_model`.

    Raises
    ------
    UsageError
        If the sensors do not distinguish the forces, or the AMBs are not described.
    RecordError
        If the record is too short, too long or unevenly sampled.

    Notes
    -----
    Not validated: records with more than one unknown force per direction, sensors that are not calibrated.
    Measured once, on a rig with a known magnet force; see the page *Measured*.

    Examples
    --------
    A drop, simulated: the largest forces on the rotor at its touchdown bearings.

    >>> from rotordrop import estimate_force, example_machine, example_record_path, read_record
    >>> machine = example_machine("lp400")
    >>> record = read_record(example_record_path("lp400_drop_060"), machine).window(0.0, 0.03)
    >>> found = estimate_force(machine, record, held="free-free", bandwidth=400.0)
    >>> [f"{peak:.1e} N" for peak in np.linalg.norm(found.force, axis=2).max(axis=0)]
    ['1.5e+03 N', '2.5e+03 N']
    """
    last = len(require(machine, "machine", Machine).rotor.node_positions)
    for sensor in require(record, "record", Record).sensors:  # it may have others than the machine file
        require(sensor.node, f"the node of sensor {sensor.name} of the record", int, least=1, most=last)
    if not np.isfinite(record.signals).any(axis=0).all():
        raise RecordError("a channel of the record holds no reading at all; leave its sensor out")
    require(known_forces, "known_forces", Mapping, none=True, hint="Write {node: force}")
    chosen = _nodes_of(machine, nodes)
    dt = _time_step(record)
    holding = _held_values(machine, held)
    known = {
        node: _known_force(node, force, len(record.time)) for node, force in (known_forces or {}).items()
    }
    speed = float(machine.speed.nominal) if record.speed is None else float(np.nanmean(record.speed))
    require(speed, "mean speed of the record [rad/s]", float)

    def posed(described: Machine) -> _Posed:
        holding = [*suspension_of(described, held), *supports]
        acting = (*chosen, *known, *(one.node for one in machine.unbalances))
        rotor = _held_rotor(described, holding, acting, reduction, speed, falls=held == "free-free")
        return _Posed(*rotor, record=record, nodes=chosen, known=known, dt=dt)

    problem = posed(machine)
    problem.refuse_one_for_another()
    if bandwidth is None:
        strength = problem.likeliest_strength()
        width = float(problem.bandwidths(strength).max())
    else:
        width = problem.checked_bandwidth(bandwidth)
        strength = problem.strength(width)
    best = problem.passed(strength)
    found, variance, _ = backward_pass(problem.rotor, best)
    moved, exact = [], []
    for path, value in holding.items():
        error = _spread(value)
        if error == 0.0:
            exact.append(path)
            continue
        other = posed(machine.with_values({path: float(value) + error}))
        moved.append(backward_pass(other.rotor, other.passed(strength), variances=False)[0] - found)
    shifts = chain(_sensor_errors(record), problem.of_unbalance(machine, speed))
    moved += [pass_again(problem.rotor, best, shift) for shift in shifts]
    k = 2 * len(chosen)
    variance = np.maximum(variance, 0.0) + sum(one[:, :k] ** 2 for one in moved)
    shape = (len(record.time), len(chosen), 2)
    return ForceEstimate(
        time=record.time,
        nodes=chosen,
        force=found[:, :k].reshape(shape),
        sigma=np.sqrt(variance).reshape(shape),
        displacement=(found[:, -k:] + problem.pushed @ problem.rows(chosen).T).reshape(shape),
        bandwidth=width,
        negative_log_likelihood=best.negative_log_likelihood,
        taken_as_exact=tuple(exact),
    )


def _held_rotor(
    machine: Machine,
    holding: Sequence[Support],
    nodes: Sequence[int],
    reduction: str | Reduction,
    speed: float,
    *,
    falls: bool,
) -> tuple[Array, Array, Array, Array]:
    """Stiffness, damping, weight and shapes of `_Posed`, the gyroscopic terms at a speed [rad/s]."""
    from scipy.linalg import eigh

    fe = build_rotor_fe(machine)
    basis = reduce_rotor(fe, reduction, [*nodes, *(support.node for support in holding)])
    full = matrices_of(basis, holding)
    # cross-coupled springs make the stiffness unsymmetric: its symmetric part gives the coordinates
    modes = eigh(0.5 * (full.stiffness + full.stiffness.T), full.mass)[1]
    m, n = basis.size, full.plane_size
    of_node = np.zeros((len(fe.node_positions), 2, 2 * n))
    of_node[:, 0, :m] = of_node[:, 1, n : n + m] = basis.shapes[0::2]
    weight = np.zeros(2 * n)
    if falls:
        weight[n : n + m] = -float(machine.gravity) * (basis.shapes.T @ fe.mass @ fe.rigid_shapes[:, 0])
    damping = full.damping + speed * full.gyroscopic
    return modes.T @ full.stiffness @ modes, modes.T @ damping @ modes, modes.T @ weight, of_node @ modes


@dataclass(frozen=True, eq=False)
class _Posed:
    """A record of a held rotor as a problem of unknown forces at nodes.

    The rotor moves in the m coordinates of its undamped modes, whose masses are one.
    """

    stiffness: Array
    damping: Array
    """Shape (m, m)."""
    weight: Array
    """Force of the weight on every coordinate, zero unless the rotor falls, shape (m,)."""
    shapes: Array
    """Displacement (x, y) at every node per coordinate, shape (N, 2, m)."""
    record: Record
    nodes: tuple[int, ...]
    known: Mapping[int, Array]
    dt: float

    def rows(self, nodes: Sequence[int]) -> Array:
        """Displacement at nodes in the order x, y of each, shape (2 K, m)."""
        return self.shapes[[node - 1 for node in nodes]].reshape(2 * len(nodes), -1)

    def response(self, forces: Mapping[int, Array]) -> Array:
        """Coordinates (N, m) under forces (N, 2) at nodes, straight between the samples, from rest."""
        if not forces:
            return np.zeros((len(self.record.time), len(self.stiffness)))
        push = self.rows(tuple(forces)).T
        F, _, n = transition(self.stiffness, self.damping, push, np.zeros(len(push)), self.dt)
        return states_under(F, n, np.hstack(list(forces.values())), self.dt)[:, : n // 2]

    @cached_property
    def pushed(self) -> Array:
        """Coordinates under the known forces, shape (N, m)."""
        return self.response(self.known)

    @cached_property
    def seen(self) -> Array:
        """Displacement along every sensor per coordinate, shape (C, m)."""
        at = self.shapes[[sensor.node - 1 for sensor in self.record.sensors]]
        return np.asarray(np.einsum("ca,cam->cm", self.record.directions, at))

    @cached_property
    def readings(self) -> Array:
        """Displacement along every sensor less what the known forces make of it [m], NaN where it is missing,
        shape (N, C).
        """
        read = self.record.along - self.pushed @ self.seen.T
        return read if self.record.missing is None else np.where(self.record.missing, np.nan, read)

    @cached_property
    def noise(self) -> Array:
        """Standard deviation of the noise of every channel [m], shape (C,)."""
        rough = rough_noise(self.record.along)
        return np.hypot(np.where(np.isfinite(rough), rough, DEFAULT_NOISE), NOISE_FLOOR)

    @cached_property
    def rotor(self) -> ForcedRotor:
        """The rotor under the unknown forces; where and how fast it is at first is left to the readings."""
        push = self.rows(self.nodes)
        F, weight, n = transition(self.stiffness, self.damping, push.T, self.weight, self.dt)
        k, beyond = len(push), ((0, 0), (0, len(F) - n // 2))
        reach = float(np.nanmax(np.abs(self.readings)))
        fastest = float(np.nanmax(np.abs(np.diff(self.readings, axis=0)))) / self.dt
        size = np.abs(self.shapes).max(axis=(0, 1))
        omega = np.sqrt(np.maximum(np.diag(self.stiffness), 0.0))
        at_most = np.minimum(reach, fastest / np.maximum(omega, fastest / reach))
        turn = 2.0 * math.pi / (START_PERIOD * self.dt)
        force = reach / np.linalg.norm(self.answer(turn), axis=0)
        variances = np.concatenate([at_most / size, fastest / size, force, turn * force]) ** 2
        return ForcedRotor(
            dt=self.dt,
            F=F,
            gravity=weight,
            forces=slice(n, n + k),
            H=np.pad(self.seen, beyond),
            start=np.zeros(len(F)),
            start_covariance=np.diag(variances),
            variances=self.noise**2,
            weight=np.zeros(k),
            places=np.pad(push, beyond),
        )

    def answer(self, turn: float) -> Array:
        """Readings per force (C, 2 K) [m/N] at an angular frequency [rad/s], complex."""
        dynamic = self.stiffness - turn**2 * np.eye(len(self.seen.T)) + 1j * turn * self.damping
        return np.asarray(self.seen @ np.linalg.solve(dynamic, self.rows(self.nodes).T))

    def refuse_one_for_another(self) -> None:
        """Refuse forces that the sensors do not distinguish."""
        low, high = self.limits
        answer = self.answer(2.0 * math.pi * math.sqrt(low * high)) / self.noise[:, None]
        size = np.linalg.norm(answer, axis=0)
        values = np.linalg.svd(answer / np.maximum(size, 1e-9 * size.max()), compute_uv=False)
        if len(values) < len(size) or values[-1] < DISTINGUISHABLE * values[0]:
            raise UsageError(
                f"{len(self.seen)} sensors do not distinguish the forces at nodes {list(self.nodes)}, x and "
                f"y each; choose at most {np.count_nonzero(values > DISTINGUISHABLE * values[0]) // 2} of "
                "them with nodes=…, or give measured ones as known_forces"
            )

    def of_unbalance(self, machine: Machine, speed: float) -> Iterator[Array]:
        """What every unbalance makes of the readings [m], cosine and sine, each of shape (N, C).

        Its phase in the record is not known: either part has its root mean square.
        """
        angle = speed * self.record.time
        for one in machine.unbalances:
            size = float(one.amount) * speed**2 / math.sqrt(2.0)
            for turned in (angle, angle - 0.5 * math.pi):
                force = size * np.column_stack([np.cos(turned), np.sin(turned)])
                path = self.response({one.node: force})
                yield path @ self.seen.T

    def strength(self, bandwidth: float) -> Array:
        """Density of the random walk of every rate [N/s^1.5], shape (2 K,).

        At the bandwidth [Hz] what the force makes of the readings is as large as their noise.
        """
        turn = 2.0 * math.pi * bandwidth
        answer = np.linalg.norm(self.answer(turn) / self.noise[:, None], axis=0)
        return np.asarray(turn**2 * math.sqrt(self.dt) / answer)

    def bandwidths(self, strength: Array) -> Array:
        """Bandwidth [Hz] at every node that has a strength (N, 2 K), shape (N, K)."""
        tried = np.geomspace(*self.limits, STEPS)
        table = np.maximum.accumulate([self.strength(bandwidth) for bandwidth in tried]).T
        found = [np.interp(one, row, tried) for one, row in zip(strength.T, table, strict=True)]
        return np.asarray(np.reshape(found, (-1, 2, len(strength))).max(axis=1).T)

    def likeliest_strength(self) -> Array:
        """Strength of the random walks about every sample, alike in x and y, shape (N, 2 K) [N/s^1.5].

        It makes the readings likeliest, as one number for `PERIODS` of its bandwidth about each sample: an
        impact has another one than the quiet before it.

        Source: the ratio of MacKay 1992, Bayesian interpolation, with the evidence of `backward_pass`.
        """
        low, high = self.limits
        bounds, count = (self.strength(low), self.strength(high)), len(self.readings)
        strength = np.tile(self.strength(math.sqrt(low * high)), (count, 1))
        for _ in range(LOOKS):
            evidence = backward_pass(self.rotor, self.passed(strength))[2] * strength**2
            sums = np.cumsum(evidence.reshape(2, count, -1, 2).sum(axis=3), axis=1)
            sums = np.pad(sums, ((0, 0), (1, 0), (0, 0)))
            half = np.ceil(0.5 * PERIODS / (self.bandwidths(strength) * self.dt)).astype(int)
            at = np.arange(count)[:, None]
            first, last = np.maximum(at - half, 0), np.minimum(at + half + 1, count)
            asked, expected = (
                np.take_along_axis(one, last, axis=0) - np.take_along_axis(one, first, axis=0) + FEW
                for one in sums
            )
            strength = np.clip(strength * np.sqrt(asked / expected).repeat(2, axis=1), *bounds)
        return strength

    def passed(self, strength: Array) -> Passed:
        """Filter the readings with random walks of that strength, (2 K,) or (N, 2 K)."""
        local = np.broadcast_to(strength / TURNED, (len(self.readings), strength.shape[-1]))
        return forward_pass(self.rotor, self.readings, np.zeros(local.shape, dtype=bool), local, 1.0)

    @property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest bandwidth [Hz] of which the record can tell."""
        return SLOWEST / (self.dt * len(self.record.time)), 1.0 / (FASTEST * self.dt)

    def checked_bandwidth(self, given: float | str) -> float:
        """The bandwidth [Hz], if the record allows it."""
        bandwidth = in_si(given, "frequency", "bandwidth")
        low, high = self.limits
        if not low <= bandwidth <= high:
            raise UsageError(
                f"bandwidth is {bandwidth:g} Hz; {self.dt * len(self.record.time):.4g} s at "
                f"{1.0 / self.dt:.6g} Hz allow {low:.4g} to {high:.4g} Hz"
            )
        return bandwidth


def _nodes_of(machine: Machine, nodes: Sequence[int] | None) -> tuple[int, ...]:
    at_bearings = [bearing.node for bearing in machine.touchdown_bearings]
    chosen = each(at_bearings if nodes is None else nodes, "nodes", int)
    last = len(machine.rotor.node_positions)
    wrong = [node for node in chosen if not 1 <= node <= last]
    if not chosen or wrong or len(set(chosen)) < len(chosen):
        raise UsageError(f"nodes = {list(chosen)}; expected different nodes of the rotor, 1 to {last}")
    return chosen


def _time_step(record: Record) -> float:
    count = len(record.time)
    if not FEWEST_SAMPLES <= count <= MOST_SAMPLES:
        raise RecordError(
            f"the record has {count} samples; a force is estimated from {FEWEST_SAMPLES} to {MOST_SAMPLES}: "
            "cut it with record.window(start, end)"
        )
    steps = np.diff(record.time)
    dt = float(np.mean(steps))
    if float(np.max(np.abs(steps - dt))) >= EVEN * dt:
        raise RecordError(
            f"the samples lie {steps.min():.6g} to {steps.max():.6g} s apart; expected an even clock"
        )
    return dt


def _known_force(node: int, force: ArrayLike, count: int) -> Array:
    array = numbers(force, f"the known force at node {node}")
    if array.shape != (count, 2) or not np.all(np.isfinite(array)):
        raise UsageError(
            f"the known force at node {node} has the shape {array.shape}; expected ({count}, 2), all finite "
            "[N]: one row for every sample of the record"
        )
    return array


def _held_values(machine: Machine, held: str) -> dict[str, Known]:
    """Stiffness and damping of the AMBs by path; refuses a guess of the program, as the force hangs on it."""
    if require(held, "held", str, among=SUSPENSIONS) != "AMBs":
        return {}
    values = {f"ambs.{amb.name}.{name}": getattr(amb, name) for amb in machine.ambs for name in AMB_VALUES}
    for path, value in values.items():
        if value.status == "default":
            raise UsageError(
                f"{path} is left out of the machine file, and the force depends on it ({value.value:.3g} "
                f"{value.unit} would be a guess of the program); give it with a range, or say "
                "held='free-free' for a rotor that nothing holds"
            )
    return values


def _spread(value: Known) -> float:
    """Standard error of a value by its error, interval or range; zero where none is stated."""
    ends = value.interval_90 or value.range
    if value.standard_error is not None or ends is None:
        return value.standard_error or 0.0
    return (ends[1] - ends[0]) / (2.0 * NINETY)


def _sensor_errors(record: Record) -> Iterator[Array]:
    """What one standard error of every gain and offset makes of the readings [m], each of shape (N, C)."""
    readings = record.along
    for c, sensor in enumerate(record.sensors):
        gain = float(sensor.gain)
        for shift in (_spread(sensor.gain) / gain * readings[:, c], _spread(sensor.offset) * gain):
            if np.any(shift != 0.0):
                shifts = np.zeros_like(readings)
                shifts[:, c] = shift
                yield shifts
