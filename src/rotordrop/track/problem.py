"""A recorded drop put as an estimation problem: readings, sensor rows, unknowns, prior."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.elements.parameter import Rule
from rotordrop.elements.sensor import Sensor
from rotordrop.errors import IdentificationError
from rotordrop.evidence.colour import SlowNoise
from rotordrop.evidence.ends import held_bearings
from rotordrop.physics import aerodynamics
from rotordrop.physics import columns as L
from rotordrop.physics.load import load_now
from rotordrop.rotor.parameters import DropModel, race_sag, static_sag
from rotordrop.rotor.statics import rest_on, settled_sag
from rotordrop.rotor.unknowns import Target, Unknown, all_unknowns, smallest_gap
from rotordrop.series import noise_by_differences
from rotordrop.simulate.levitation import levitated_static
from rotordrop.track import _propagation as P
from rotordrop.track.prior import fall_time, prior_at_power_off, start_of
from rotordrop.track.sensor_form import SensorForm, rest_terms, sensor_form

FIRST_READINGS = 0.07
"""Time after power-off whose mean reading says where the rotor is, over the time of a free fall [1]."""
AT_STANDSTILL = 1e6
"""Time at which a load has the value that it keeps [s]."""
SPEED_READING_SIGMA = 1.0
SPEED_SPACING = 2.5e-3
"""Time between speed readings that count as independent [s]."""
AFTER_FALL = 1.4
"""Time at which parameters are read over the time of a free fall through the widest air gap [1]."""
FEWEST_DIFFERENCES = 50
"""Differences from which their median is a noise [1]."""
NOISE_FLOOR = 0.1e-6
DEFAULT_NOISE = 1e-6
TAIL_VERTICAL_SIGMA, TAIL_HORIZONTAL_SIGMA = 2.8e-3, 0.1
"""How far the resting rotor may be from where gap and sag put it, over the air gap [1]."""
WATCHED = 8
"""Functions that are watched of a bearing, see `DropProblem.watched_rows`."""
SMOOTHED_FRICTION_SPEED = 0.15
"""Sliding speed [m/s] below which the filter smooths friction: the spin of a race is not known better, so the
mean of the friction law over what is possible is what a linearisation may use."""


@dataclass(frozen=True, kw_only=True)
class RecordedDrop:
    """What a record says of a drop, as the filter takes it; N samples, C channels."""

    time: Array
    """Time from power-off [s], evenly spaced, shape (N,)."""
    readings: Array
    """Readings in the positive direction of each sensor [m], hum and 2X runout taken off; NaN where missing,
    shape (N, C)."""
    noise: Array
    """Standard deviation of the noise [m]; NaN where the record does not say, shape (C,)."""
    slow_noise: SlowNoise = field(default_factory=SlowNoise)
    """The part of it that is not white."""
    initial_speed: float
    initial_speed_error: float
    """Rotor speed at power-off and its standard error [rad/s]."""
    speed: Array
    """Measured rotor speed [rad/s], NaN where nobody measured it, shape (N,)."""
    tail_level: Array | None
    """Mean readings of the settled tail in the positive direction of each sensor [m], shape (C,)."""
    first_contact: float
    """When the rotor first touched a race [s]."""


@dataclass(frozen=True, kw_only=True)
class DropProblem:
    """One recorded drop with all the filter needs; N samples, C channels, n estimated, s dynamic."""

    model: DropModel
    unknowns: tuple[Unknown, ...]
    targets: P.ParameterTargets
    time: Array
    """Time from power-off [s], shape (N,)."""
    readings: Array
    """Readings in the positive direction of each sensor [m], hum and 2X runout removed, shape (N, C)."""
    speed: Array
    """Rotor speed [rad/s], NaN where it is not used, shape (N,)."""
    sensor_rows: Array
    """Displacement along each sensor's direction from the dynamic state, shape (C, s)."""
    variances: Array
    """Noise variance of each channel [m²], slow noise included, shape (C,)."""
    speed_variance: float
    mean: Array
    start: Array
    """Where the first pass begins: the prior mean with the guesses of the machine file, shape (n,)."""
    covariance: Array
    """Prior at the first sample."""
    sensor_form: SensorForm
    """What the sensors do beyond gain, offset and runout."""
    first_contact: float
    """When the rotor first touched a race [s]; the windows of a schedule lie around it."""

    @property
    def reading_rows(self) -> Array:
        """What the readings show of the dynamic state, shape (C, s): what a sensor that lags has got to."""
        lagging = self.sensor_form.lag
        if len(lagging) == 0:
            return self.sensor_rows
        rows = np.zeros_like(self.sensor_rows)
        rows[np.arange(len(lagging)), lagging[:, 0]] = 1.0
        return rows

    @property
    def white_variances(self) -> Array:
        """Variance of the white noise of each channel [m²], shape (C,)."""
        white = self.variances.copy()
        np.subtract.at(white, self.sensor_form.noisy, self.sensor_form.noise_variance)
        return white

    @property
    def n_dynamic(self) -> int:
        """Number of dynamic states s."""
        return self.model.layout.n_dynamic

    @property
    def parameter_sample(self) -> int:
        """Sample at which parameters are read: shortly after the first contacts, or behind the last.

        Later in a drop friction and race drift with what their laws get wrong.
        """
        gap = max(float(bearing.air_gap) for bearing in self.model.machine.touchdown_bearings)
        return int(np.searchsorted(self.time, AFTER_FALL * fall_time(self.model.machine, gap)))

    @property
    def fall_time(self) -> float:
        """Time of a free fall through the narrowest air gap [s]."""
        return fall_time(self.model.machine)

    @property
    def held(self) -> tuple[int, ...]:
        """Numbers of the bearings whose end did not fall, because its magnets stayed on."""
        held = held_bearings(self.model.machine)
        return tuple(b for b, name in enumerate(self.model.bearing_names) if name in held)

    @property
    def n_channels(self) -> int:
        """Number of sensor channels C."""
        return len(self.variances)

    @property
    def parameter_slice(self) -> slice:
        """Where the unknown parameters are in the estimate."""
        return slice(self.n_dynamic, self.n_dynamic + len(self.unknowns))

    @property
    def machine_indices(self) -> NDArray[np.int64]:
        """Entries of the estimate that all drops share: parameters of the machine, gains, offsets."""
        start = self.n_dynamic
        shared = [start + i for i, unknown in enumerate(self.unknowns) if unknown.scope == "machine"]
        first = start + len(self.unknowns)
        sensors = range(first, first + 2 * self.n_channels)
        return np.array([*shared, *sensors], dtype=np.int64)

    @property
    def gap_entries(self) -> NDArray[np.int64]:
        """Entries of the estimate that hold the air gaps, bearing by bearing."""
        bearings = range(self.model.layout.n_bearings)
        return np.array([self.entries_that_set("bearing", b, L.AIR_GAP)[0] for b in bearings], dtype=np.int64)

    def entries_that_set(self, array: str, row: int, column: int | None = None) -> list[int]:
        """Entries of the estimate whose unknowns set an entry of the kernel, or any of a row."""
        setting = (k for k, unknown in enumerate(self.unknowns) if unknown.sets(array, column, row))
        return [self.n_dynamic + k for k in setting]

    def sensor_errors(self, estimate: Array) -> tuple[Array, Array]:
        """Gain errors [1] and offsets [m] of the readings in an estimate (n,) or deviation, shape (C,)."""
        first, n_c = self.n_dynamic + len(self.unknowns), self.n_channels
        return estimate[first : first + n_c], estimate[first + n_c : first + 2 * n_c]

    def watched_rows(self, name: str) -> Array:
        """Linear functions of the estimate that forces, orbit and contacts at a bearing depend on.

        Deflection of race against support in x and y [m], axial offset of the ball rows [m], displacement of
        the rotor in x and y [m], that against the race, or the support where there is none [m], and the air
        gap [m], shape (`WATCHED`, n).
        """
        layout = self.model.layout
        b = self.model.bearing_names.index(name)
        rows = np.zeros((WATCHED, len(self.mean)))
        for axis in range(2):
            rows[axis, layout.race.start + 2 * b + axis] = 1.0
            rows[axis, layout.support.start + 2 * b + axis] = -1.0
        rows[2, self.entries_that_set("bearing", b, L.SET_UNKNOWN)] = 1.0
        if (ring := layout.bearing_at()[b, L.RING_STATES]) >= 0:  # the rows stand apart by so much less
            rows[2, ring] = -1.0
        rows[3, layout.modal_x] = self.model.parameters.bearing_shape[b]
        rows[4, layout.modal_y] = self.model.parameters.bearing_shape[b]
        race, support = layout.bearing_at()[b, [L.RACE, L.SUPPORT]]
        met = race if race >= 0 else support
        rows[5:7] = rows[3:5]
        rows[[5, 6], [met, met + 1]] = -1.0
        rows[7, self.entries_that_set("bearing", b, L.AIR_GAP)] = 1.0
        return rows

    @property
    def watched(self) -> Array:
        """The watched functions of all bearings, shape (`WATCHED` B, n)."""
        return np.concatenate([self.watched_rows(name) for name in self.model.bearing_names])


def build_problem(model: DropModel, drop: RecordedDrop, *, until: float = 0.2) -> DropProblem:
    """Put a recorded drop as an estimation problem, up to a time [s].

    The sensors of the model define the channels.

    Raises
    ------
    IdentificationError
        If the rotor does not rest on every touchdown bearing.
    """
    _refuse_unloaded(model)
    unknowns = all_unknowns(model)
    inside = (drop.time >= 0.0) & (drop.time <= until)
    readings = drop.readings[inside]
    rows = sensor_rows(model)
    level = first_level(drop.time[drop.time >= 0.0], readings, FIRST_READINGS * fall_time(model.machine))
    speed = drop.initial_speed, drop.initial_speed_error
    mean, covariance = prior_at_power_off(model, unknowns, rows, level, speed, drop.slow_noise)
    problem = DropProblem(
        model=_prepared(model, drop.initial_speed),
        unknowns=unknowns,
        targets=parameter_targets(model, unknowns),
        time=drop.time[inside],
        readings=readings,
        speed=_thinned(drop.time[inside], drop.speed[inside]),
        sensor_rows=rows,
        variances=_variances(drop.noise, readings),
        speed_variance=SPEED_READING_SIGMA**2,
        mean=mean,
        start=start_of(mean, model, unknowns),
        covariance=covariance,
        sensor_form=sensor_form(model, unknowns, rows, drop.slow_noise, float(drop.time[1] - drop.time[0])),
        first_contact=drop.first_contact,
    )
    if drop.tail_level is not None:
        apply_tail(problem, drop.tail_level, problem.start, problem.covariance.copy())
        apply_tail(problem, drop.tail_level, problem.mean, problem.covariance)
    return problem


def _refuse_unloaded(model: DropModel) -> None:
    """Refuse a rotor that would lift off at one end, of which the filter knows nothing."""
    machine = model.machine
    z = machine.rotor.node_positions
    for bearing, share in zip(machine.touchdown_bearings, model.load_shares, strict=True):
        if share <= 0.0:
            places = ", ".join(f"{z[one.node - 1]:.3f}" for one in machine.touchdown_bearings)
            raise IdentificationError(
                f"the rotor does not rest on the touchdown bearing {bearing.name} ({share:.0f} N of its "
                f"weight of {machine.rotor.mass * float(machine.gravity):.0f} N): its centre of gravity at "
                f"{machine.rotor.centre_of_gravity:.3f} m lies beside the bearings at {places} m; expected "
                "it between them. Check nodes or positions of the bearings and the sections of the rotor"
            )


def _prepared(model: DropModel, omega: float) -> DropModel:
    p = private_copy(model.parameters)
    p.spin[L.INITIAL_SPEED], p.spin[L.POWER_OFF_DELAY] = omega, 0.0
    p.flags[L.SPIN_MODE], p.flags[L.MAGNETS_ACT] = aerodynamics.EXPONENTIAL_IN_TIME, 1
    smoothing = p.bearing[:, L.SMOOTHING_SPEED]
    np.maximum(smoothing, SMOOTHED_FRICTION_SPEED, out=smoothing)
    if np.any(p.magnet[:, L.AMB_STAYS] != 0.0):
        p.magnet[:, L.HOLDING_X : L.HOLDING_Y + 1] = levitated_static(model, None, omega)[1]
    return replace(model, parameters=p)


def _thinned(time: Array, speed: Array) -> Array:
    """Speed as a measurement now and then: its error is not white, so not every sample counts."""
    thin = np.full_like(speed, np.nan)
    every = max(1, round(SPEED_SPACING / float(time[1] - time[0])))
    thin[::every] = speed[::every]
    return thin


def _variances(noise: Array, readings: Array) -> Array:
    """Noise variance of each channel [m²]: from the levitated part, else from their roughness."""
    noise = np.where(np.isfinite(noise), noise, rough_noise(readings))
    noise[~np.isfinite(noise)] = DEFAULT_NOISE
    return np.asarray(noise**2 + NOISE_FLOOR**2)


def rough_noise(readings: Array) -> Array:
    """Standard deviation of white noise on smooth motion, shape (C,) [m]; NaN where too little is read.

    Third differences take the motion away; their median leaves the few at contacts aside.
    """
    found = np.full(readings.shape[1], np.nan)
    for c in range(readings.shape[1]):
        if np.count_nonzero(np.isfinite(np.diff(readings[:, c], 3))) > FEWEST_DIFFERENCES:
            found[c] = noise_by_differences(readings[:, c], 3)
    return found


def sensor_rows(model: DropModel) -> Array:
    """Displacement along each sensor's direction from the dynamic state, shape (C, s) [m per state]."""
    layout = model.layout
    rows = np.zeros((len(model.machine.sensors), layout.n_dynamic))
    for c, sensor in enumerate(model.machine.sensors):
        shape = model.basis.node_row(sensor.node)
        angle = float(sensor.angle)
        rows[c, layout.modal_x] = np.cos(angle) * shape
        rows[c, layout.modal_y] = np.sin(angle) * shape
    return rows


def first_level(time: Array, readings: Array, until: float) -> Array:
    """Mean of the first readings of every channel [m]; NaN where there is none."""
    first = readings[time[: len(readings)] < time[0] + until]
    known = np.isfinite(first)
    count = known.sum(axis=0)
    total = np.where(known, first, 0.0).sum(axis=0)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def settled_displacement(problem: DropProblem, theta: Array) -> Array:
    """Displacement [m] of the resting rotor in x and y at each sensor, shape (2, C), for parameter values.

    Gap, indentation, race and support sag under the weight and the loads at standstill, in their direction;
    the line between the bearings, and the bending of the rotor on its touchdown bearings.
    """
    model = problem.model
    p = parameters_at(problem, theta)
    bearings = model.machine.touchdown_bearings
    nodes = [bearing.node for bearing in bearings]
    pull = np.array([np.zeros(len(nodes)), -np.asarray(model.load_shares)])
    bend = np.array([np.zeros(model.fe.size), settled_sag(model.fe, model.machine)])
    for load, row in zip(model.machine.loads, p.load, strict=False):  # the ground comes last
        if load.along is None:
            force = load_now(row, p.load_points, AT_STANDSTILL, 0.0)
            shape, held = rest_on(model.fe, nodes, 0.0, beside=model.fe.node_row(load.node))
            pull, bend = pull - np.outer(force, held), bend + np.outer(force, shape)
    size = np.hypot(*pull)
    sag = static_sag(p.bearing, race_sag(bearings, size), size)
    level = sag.depth(p.bearing[:, L.AIR_GAP]) * pull / np.maximum(size, 1e-12)
    sensors = np.array([sensor.node for sensor in model.machine.sensors]) - 1
    line = np.vander(np.asarray(model.fe.node_positions), min(2, len(nodes)))
    lines = level @ np.linalg.pinv(line[np.array(nodes) - 1]).T @ line[sensors].T
    return np.asarray(lines + bend[:, 0::2][:, sensors], dtype=np.float64)


def parameters_at(problem: DropProblem, theta: Array) -> L.KernelParameters:
    """Kernel arrays of a problem with values of its unknown parameters, shape (P,)."""
    p = private_copy(problem.model.parameters)
    P.apply_parameters(np.asarray(theta, dtype=np.float64).copy(), problem.targets, p)
    return p


def private_copy(p: L.KernelParameters) -> L.KernelParameters:
    """Kernel arrays that may be written to."""
    return L.KernelParameters._make(array.copy() for array in p)


def apply_tail(problem: DropProblem, tail_level: Array, mean: Array, covariance: Array) -> None:
    """Tie gap, gains and offsets to the settled tail: update mean (n,) and covariance (n, n) in place.

    Vertically the rotor rests where gap and sag put it; horizontally it may be held aside by friction.
    """
    # Noise slower than the levitated part moves the zero until the tail; it is taken to be as large as the
    # slowest part of what is seen there, as that of 1/f noise is.
    form, wander = problem.sensor_form, np.zeros(problem.n_channels)
    wander[form.noisy[::-1]] = form.noise_variance[::-1]
    machine = problem.model.machine
    # on which place of its landing sleeves a rotor comes to rest is anybody's guess
    reach = max(bearing.landing_sleeve.reach_at_rest() for bearing in machine.touchdown_bearings)
    weights, sigma = _tail_combinations(machine.sensors, tail_level)
    R = np.diag((sigma * smallest_gap(machine)) ** 2 + reach**2 + weights**2 @ wander)
    observed, prior = weights @ np.nan_to_num(tail_level), mean.copy()
    for _ in range(3):  # gain times gap and the sag under the weight are no straight lines
        level, slopes = _rest_readings(problem, mean)
        H = weights @ slopes
        shown = H @ covariance
        K = np.linalg.solve(shown @ H.T + R, shown).T
        mean[:] = prior + K @ (observed - weights @ level - H @ (prior - mean))
    covariance -= K @ shown


def _rest_readings(problem: DropProblem, mean: Array) -> tuple[Array, Array]:
    """Readings of the settled rotor [m], shape (C,), and their slopes by an estimate, shape (C, n)."""
    start, n_p, n_c = problem.n_dynamic, len(problem.unknowns), problem.n_channels
    gain, offset = (slice(start + n_p + k * n_c, start + n_p + (k + 1) * n_c) for k in range(2))
    theta, model = mean[problem.parameter_slice].copy(), problem.model
    angles = np.array([float(sensor.angle) for sensor in model.machine.sensors])
    axes, slopes = np.array([np.cos(angles), np.sin(angles)]), np.zeros((n_c, len(mean)))
    place = settled_displacement(problem, theta)
    along, growth = np.sum(axes * place, axis=0), 1.0 + mean[gain]
    for k, step in enumerate(problem.targets.step):
        kinds = problem.targets.target[problem.targets.target[:, 0] == k, 1]
        if P.ON_BEARING in kinds or P.ON_LOAD in kinds:
            trial = theta.copy()
            trial[k] += step
            moved = settled_displacement(problem, trial) - place
            slopes[:, start + k] = growth * np.sum(axes * moved, axis=0) / step
    for c in range(n_c):
        for k, per_unit in rest_terms(model, problem.unknowns, c, float(place[1, c])):
            along[c] += theta[k] * per_unit
            slopes[c, start + k] += growth[c] * per_unit
    slopes[:, gain], slopes[:, offset] = np.diag(along), np.eye(n_c)
    return growth * along + mean[offset], slopes


def _tail_combinations(sensors: Sequence[Sensor], tail_level: Array) -> tuple[Array, Array]:
    """Weights of readings, shape (K, C), and how far a resting rotor may be from them, over the gap, (K,).

    Two directions of a plane give what friction may hold the rotor aside and the height; one sees a mixture.
    """
    angles, nodes = (np.array([float(getattr(one, of)) for one in sensors]) for of in ("angle", "node"))
    weights, sigma = np.zeros((0, len(sensors))), []
    for node in np.unique(nodes):
        chosen = (nodes == node) & np.isfinite(tail_level)
        directions = np.column_stack([np.cos(angles), np.sin(angles)]) * chosen[:, None]
        if np.linalg.matrix_rank(directions, tol=0.05) == 2:
            weights = np.vstack([weights, np.linalg.pinv(directions)])
            sigma += [TAIL_HORIZONTAL_SIGMA, TAIL_VERTICAL_SIGMA]
        elif chosen.any():
            own = directions[chosen]
            weights = np.vstack([weights, np.sign(directions @ own[0]) / len(own)])
            sigma.append(float(np.mean(np.hypot(*(own * (TAIL_HORIZONTAL_SIGMA, TAIL_VERTICAL_SIGMA)).T))))
    return weights, np.array(sigma)


_KIND_OF_ARRAY = {
    "bearing": P.ON_BEARING,
    "spin": P.ON_SPIN,
    "magnet": P.ON_MAGNET,
    "unbalance": P.ON_UNBALANCE,
    "load": P.ON_LOAD,
    "modes": P.SCALE_MODES,
}
_KIND_OF_RULE = {Rule.SCALE: P.SCALE_BEARING, Rule.AT_TYPICAL_DEPTH: P.AT_TYPICAL_DEPTH}


def _acts(targets: list[tuple[int, Target]], count: int, bearings: int) -> NDArray[np.bool_]:
    """Which of ``count`` parameters act on each bearing and, in the last column, on the rotor itself."""
    acts = np.zeros((count, bearings + 1), dtype=np.bool_)
    for k, target in targets:
        acts[k, target.row if target.entry.array == "bearing" else bearings] = True
    return acts


def _together(targets: list[tuple[int, Target]], count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """For each of ``count`` parameters the targets that write where it writes, and where its list begins."""
    # All unbalances add up in the same entries; a gap is also the radius of the rotor.
    places = [
        (t.entry.array,) if t.entry.array == "unbalance" else (t.entry.array, t.row, t.entry.column)
        for _, t in targets
    ]
    lists = []
    for k in range(count):
        own = {place for place, (j, _) in zip(places, targets, strict=True) if j == k}
        lists.append([i for i, place in enumerate(places) if place in own])
    starts = np.cumsum([0, *map(len, lists)])
    return np.array([i for chosen in lists for i in chosen], dtype=np.int64), starts.astype(np.int64)


def parameter_targets(model: DropModel, unknowns: tuple[Unknown, ...]) -> P.ParameterTargets:
    """Flat table of what the unknowns set in the kernel, in the order given."""
    targets = [(k, target) for k, unknown in enumerate(unknowns) for target in unknown.targets]
    # What changes an entry comes after what sets it.
    targets.sort(key=lambda item: item[1].entry.rule in _KIND_OF_RULE)
    planes = [model.basis.node_row(unbalance.node) for unbalance in model.machine.unbalances]
    shape = np.array(planes) if planes else np.zeros((0, model.layout.n_modes))
    drift = np.array([u.drift for u in unknowns])
    kinds = [_KIND_OF_RULE.get(t.entry.rule, _KIND_OF_ARRAY[t.entry.array]) for _, t in targets]
    rows = [(k, kind, t.row, t.entry.column) for kind, (k, t) in zip(kinds, targets, strict=True)]
    together, starts = _together(targets, len(unknowns))
    return P.ParameterTargets(
        target=np.array(rows, dtype=np.int64).reshape(-1, 4),
        acts=_acts(targets, len(unknowns), len(model.parameters.bearing)),
        together=together,
        starts=starts,
        factor=np.array([t.factor for _, t in targets]),
        shift=np.array([t.shift for _, t in targets]),
        logarithmic=np.array([int(u.logarithmic) for u in unknowns], dtype=np.int64),
        drift=drift,
        late_drift=drift * np.array([u.parameter.late_drift_factor for u in unknowns]),
        step=np.array([1e-5 if u.logarithmic else max(1e-3 * u.sigma, 1e-12) for u in unknowns]),
        plane_shape=np.ascontiguousarray(shape),
        lower=np.array([u.bounds[0] for u in unknowns]),
        upper=np.array([u.bounds[1] for u in unknowns]),
        mean=np.array([u.begin for u in unknowns]),
        eigenvalue=model.parameters.eigenvalue,
        damping=model.parameters.damping,
    )


def transferred(coarse: DropProblem, fine: DropProblem, means: Array) -> Array:
    """Trajectory (N, n) of a coarse problem in the coordinates of a fine one, by projecting the modes.

    Sensors that the coarse problem leaves out start at what is known of them beforehand.
    """
    one, two = coarse.model.layout, fine.model.layout
    result = np.zeros((len(means), len(fine.mean)))
    project = (fine.model.basis.shapes.T @ (fine.model.fe.mass @ coarse.model.basis.shapes)).T
    for part in ("modal_x", "modal_y"):
        source, target = getattr(one, part), getattr(two, part)
        result[:, target] = means[:, source] @ project
        result[:, two.velocity_of(target)] = means[:, one.velocity_of(source)] @ project
    for part in ("race", "support"):
        source, target = getattr(one, part), getattr(two, part)
        result[:, target] = means[:, source]
        result[:, two.velocity_of(target)] = means[:, one.velocity_of(source)]
    # spins and parameters do not depend on the basis
    own, wanted = coarse.n_dynamic + len(coarse.unknowns), fine.n_dynamic + len(fine.unknowns)
    result[:, two.race_spin] = means[:, one.race_spin]
    for place, states in one.further:
        if (place, states) in two.further:
            result[:, two.further_at(place)] = means[:, one.further_at(place)]
    if two.moves_axially and one.moves_axially:
        result[:, two.axial : two.axial + 2] = means[:, one.axial : one.axial + 2]
    result[:, two.rotor_speed : two.n_dynamic] = means[:, one.rotor_speed : one.n_dynamic]
    _carry_unknowns(coarse, fine, means, result)
    if two.sensor_own:
        result[:, two.sensors] = result[:, : two.n_dynamic] @ fine.sensor_rows.T
    result[:, wanted:] = fine.mean[wanted:]
    names = [sensor.name for sensor in coarse.model.machine.sensors]
    for c, sensor in enumerate(fine.model.machine.sensors):
        if sensor.name in names:
            kinds = np.arange(4)  # gain, offset, cosine and sine of the runout
            source = own + kinds * coarse.n_channels + names.index(sensor.name)
            result[:, wanted + kinds * fine.n_channels + c] = means[:, source]
    return result


def _carry_unknowns(coarse: DropProblem, fine: DropProblem, means: Array, result: Array) -> None:
    """Carry the unknowns by name; what the coarse problem does not have begins at what is known of it.

    So does what another prior holds now: where the old one held it is no place to begin.
    """
    source = {unknown.path: k for k, unknown in enumerate(coarse.unknowns)}
    for k, unknown in enumerate(fine.unknowns):
        at = source.get(unknown.path)
        if at is not None and not math.isclose(coarse.unknowns[at].sigma, unknown.sigma):
            at = None
        values = fine.start[fine.n_dynamic + k] if at is None else means[:, coarse.n_dynamic + at]
        result[:, fine.n_dynamic + k] = values
