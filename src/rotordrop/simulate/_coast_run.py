"""Where a coast-down stands, and how it is taken one window of time further."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import SimulationError
from rotordrop.physics import aerodynamics
from rotordrop.physics import columns as L
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import atan2, magnitude
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.suspension import touchdown_supports
from rotordrop.simulate import _coast_loop as C
from rotordrop.simulate import _histories as H
from rotordrop.simulate import _loop
from rotordrop.simulate import _settled_loop as S
from rotordrop.simulate._rhs import N_PLACES
from rotordrop.simulate.coast_down_case import CoastDownCase
from rotordrop.simulate.coast_down_result import QUANTILES
from rotordrop.simulate.drop import FIRST_STEP, LOG_ROWS_PER_SECOND, error_scale, tableau_of
from rotordrop.simulate.heat import Warming, warmed, warms
from rotordrop.simulate.levitation import start_of_drop

Single = NDArray[np.float32]

MOST_STEPS_PER_WINDOW = 5_000_000
WINDOW_ROWS = (
    "window_rows",
    "window_peak",
    "window_quantile",
    "window_contacts",
    "window_share",
    "window_race",
    "window_method",
    "heat_rows",
)
"""Names of what is kept of every window, and of every instant at which bearings that warm were looked at."""
HEAT_STEP = 0.01
"""Least distance of these instants [s]."""
SETTLED_STEP = 0.92
CHECKED = 2e-3
"""Part of every settled window [s] that is also done with the Runge–Kutta pair."""
RUNNING, ENDED = 0.0, 1.0
"""Phases of a run; one that was given up has less the outcome of the loop."""
# Entries of `Run.status`.
PHASE, WINDOW, SAMPLE, STOPPED_AT, LAST_SAMPLE, PARTS, ENERGY_AT_START, WORST_BALANCE = range(8)


@dataclass(frozen=True)
class Setup:
    """What does not change during a run."""

    model: DropModel
    case: CoastDownCase
    parameters: KernelParameters
    scale: Array
    sensor_rows: Array
    sensor_nodes: tuple[int, ...]
    settled_parts: int
    warming: Warming | None
    """What goes on beside the time loop where bearings warm."""


@dataclass(frozen=True)
class Run:
    """Where a run stands: arrays that change in place, and nothing else, so a checkpoint is just these."""

    state: Array
    progress: Array
    running: Array
    open_log: Array
    peaks: Array
    whirl: Array
    totals: Array
    status: Array
    memory: Array
    windows: dict[str, list[Array]]

    def arrays(self) -> dict[str, Array]:
        kept = {name: value for name, value in vars(self).items() if name != "windows"}
        return kept | {name: np.array(rows) for name, rows in self.windows.items()}

    @classmethod
    def of(cls, arrays: dict[str, Array]) -> Run:
        windows = {name: list(arrays.pop(name)) for name in WINDOW_ROWS}
        return cls(**arrays, windows=windows)


def prepare(model: DropModel, case: CoastDownCase) -> Setup:
    _, parameters = start_of_drop(model, case.as_drop())
    nodes = tuple(sorted({sensor.node for sensor in model.machine.sensors}))
    rows = np.array([model.basis.node_row(node) for node in nodes]).reshape(len(nodes), model.layout.n_modes)
    parameters = _with_drag(parameters, model, case)
    return Setup(
        model=model,
        case=case,
        parameters=parameters,
        warming=Warming(cold=parameters) if warms(parameters).size else None,
        scale=error_scale(model),
        sensor_rows=rows,
        sensor_nodes=nodes,
        settled_parts=_settled_parts(model, case.output_step),
    )


def _settled_parts(model: DropModel, output_step: float) -> int:
    """Steps per sample that keep the settled scheme stable: what the rotor lies on swings 0.92 rad in one."""
    fastest = 0.0
    for support in touchdown_supports(model.machine):
        inner, outer = (float(link.stiffness[1, 1]) for link in support.links[:2])
        fastest = max(fastest, math.sqrt((inner + outer) / support.masses[0]))
    return max(1, math.ceil(output_step * fastest / SETTLED_STEP))


def _with_drag(parameters: KernelParameters, model: DropModel, case: CoastDownCase) -> KernelParameters:
    """Aerodynamic drag as a function of speed, and race drag that stays dry down to the stop speed."""
    speed = model.machine.speed
    spin, bearing = parameters.spin.copy(), parameters.bearing.copy()
    if speed.aero_linear is None and speed.aero_quadratic is None:
        if speed.aero_time_constant is None:
            raise SimulationError(
                f"the machine {model.machine.name!r} has no aerodynamic drag: speed.aero_linear, "
                "speed.aero_quadratic and speed.aero_time_constant are all missing. Give one of them under "
                '[speed], such as aero_time_constant = "8 s", or take the drag from the speed of a recorded '
                "coast-down: --drag-from RECORD, in Python with_recorded_drag."
            )
        spin[L.AERO_LINEAR] = 1.0 / float(speed.aero_time_constant)
    bearing[:, L.DRAG_SPEED] = np.minimum(bearing[:, L.DRAG_SPEED], case.stop_speed)
    return parameters._replace(spin=spin, bearing=bearing)


def begin(setup: Setup) -> Run:
    start, _ = start_of_drop(setup.model, setup.case.as_drop())
    n_b = setup.model.layout.n_bearings
    progress = np.zeros(_loop.N_PROGRESS)
    progress[_loop.STEP] = FIRST_STEP
    progress[_loop.PREVIOUS_ERROR] = 1.0
    n_watched = _loop.number_watched(setup.parameters)
    running = np.zeros((n_watched, _loop.N_RUN_COLUMNS))
    log = np.zeros((n_watched, _loop.N_LOG_COLUMNS))
    progress[_loop.LOGGED] = _loop.start_running(start, 0.0, setup.parameters, running, log)
    whirl = np.zeros((n_b, C.N_WHIRL))
    relative = relative_displacement(setup, start[None, :])[0]
    for b in range(n_b):
        C.start_whirl(0.0, relative[b, 0], relative[b, 1], whirl[b])
    status = np.zeros(8)
    status[STOPPED_AT] = np.nan
    status[LAST_SAMPLE] = math.ceil(setup.case.last_time / setup.case.output_step - 1e-9)
    now = warmed(setup.parameters, setup.parameters.memory, start)
    stored = float(H.stored_energy(0.0, start, now, True))
    status[ENERGY_AT_START] = stored - start[setup.model.layout.work_in]
    windows: dict[str, list[Array]] = {name: [] for name in WINDOW_ROWS}
    if setup.warming is not None:
        windows["heat_rows"].append(setup.warming.row(setup.parameters.memory, 0.0, start, now))
    return Run(
        state=start,
        progress=progress,
        running=running,
        open_log=log,
        peaks=np.zeros((n_b, _loop.N_PEAKS)),
        whirl=whirl,
        totals=np.zeros((n_b, 2)),
        status=status,
        memory=setup.parameters.memory.copy(),
        windows=windows,
    )


def stored_energy_of(setup: Setup, run: Run) -> float:
    """Energy [J] of the state that a run has got to."""
    now = warmed(setup.parameters, run.memory, run.state)
    return float(H.stored_energy(float(run.progress[_loop.TIME]), run.state, now, True))


def relative_displacement(setup: Setup, states: Array) -> Array:
    """Displacement of the rotor relative to the races, shape (T, B, 2) [m]."""
    moved = displacement_at(states, setup.parameters.bearing_shape)
    return moved - setup.model.layout.bore(states)


def displacement_at(states: Array, rows: Array) -> Array:
    return H.node_displacements(np.ascontiguousarray(states), np.ascontiguousarray(rows))


def advance(setup: Setup, run: Run) -> tuple[dict[str, Single], Array]:
    """Simulate to the end of the present window; returns its samples and the contacts that ended."""
    case, status = setup.case, run.status
    first, window_end = int(status[SAMPLE]), case.window_end(int(status[WINDOW]))
    rows = window_end - first + 1
    states = np.empty((rows, len(run.state)))
    histories = np.empty((rows, len(run.whirl), H.N_HISTORIES))
    states[0] = run.state
    _, now = present_drive(setup, run)
    H.bearing_histories(_grid(first, first + 1, case.output_step), states[:1], now, histories[:1])
    before = (float(run.progress[_loop.TIME]), float(run.state[setup.model.layout.dissipated]))
    already_open, opened = (
        int(run.progress[_loop.LOGGED]),
        int(LOG_ROWS_PER_SECOND * (rows * case.output_step)),
    )
    log = np.zeros((len(run.open_log) + 100 + opened, _loop.N_LOG_COLUMNS))
    log[: len(run.open_log)] = run.open_log
    # the scheme for settled rotors does not hold axial motion back
    settles = case.settled_scheme and setup.model.layout.axial < 0
    method, filled, try_settled = np.zeros(3), 1, settles and may_be_settled(run)
    whole = min(window_end, int(status[LAST_SAMPLE])) - first
    while status[PHASE] == RUNNING:
        last = min(window_end, int(status[LAST_SAMPLE]))
        if setup.warming is not None:
            stretch = setup.warming.stretch(run.memory) / case.output_step
            last = min(last, first + filled - 1 + max(1, int(stretch)))
        wanted = slice(filled, last - first + 1)
        if first + filled > last:
            break
        (_, now), books = present_drive(setup, run), np.zeros((len(run.whirl) + 1, N_PLACES))
        begun = float(run.progress[_loop.TIME]), float(run.state[setup.model.layout.dissipated])
        if try_settled:
            got, error = settled_piece(setup, run, states[wanted], histories[wanted], log, books)
            outcome = _loop.FINISHED
            if got:
                method = np.array([method[0] + got / whole, *np.maximum(method[1:], error)])
            # a stretch of constant temperatures is not the whole window
            try_settled = setup.warming is not None and got == wanted.stop - wanted.start
        else:
            times = _grid(first + filled, last + 1, case.output_step)
            outcome = integrate(setup, run, times, states[wanted], log, books)
            got = int(run.progress[_loop.SAMPLES])
            fresh = slice(filled, filled + got)
            H.bearing_histories(times[:got], states[fresh], now, histories[fresh])
        filled += got
        if setup.warming is not None and run.progress[_loop.TIME] > begun[0]:
            _warm(setup.warming, run, begun, now, books)
        _after(setup, run, outcome, first + filled - 1)
    ended, began = _ended_contacts(run, log, already_open, setup.parameters)
    kept = filled if status[PHASE] != RUNNING else filled - 1
    times = _grid(first, first + kept, case.output_step)
    C.follow_whirl(times, relative_displacement(setup, states[:kept]), run.whirl)
    keep_statistics(setup, run, before, histories[:kept], began)
    run.windows["window_method"].append(method)
    status[SAMPLE] = first + kept
    status[WINDOW] += 1.0
    return samples_of(setup, states[:kept], histories[:kept]), ended


def _warm(
    warming: Warming, run: Run, begun: tuple[float, float], now: KernelParameters, books: Array
) -> None:
    """Warm the nodes by what a stretch lost, and let preload and gap follow.

    ``begun`` is its first instant [s] with the energy dissipated by then [J].
    """
    t, total = float(run.progress[_loop.TIME]), float(np.sum(books))
    # the scheme for settled rotors books by the powers at its samples: what it lost in all is exact
    if total > 0.0:
        books *= (float(run.state[now.rotor_at[L.DISSIPATED]]) - begun[1]) / total
    warming.take(run.memory, books, t - begun[0])
    grown = warming.grow(run.memory, t, run.state, now)
    run.peaks[:, _loop.PEAK_TRAVEL] = 0.0  # the same travel makes another force now
    rows = run.windows["heat_rows"]
    if t >= rows[-1][0] + HEAT_STEP:
        rows.append(warming.row(run.memory, t, run.state, grown))


def _grid(first: int, last: int, step: float) -> Array:
    return np.asarray(np.arange(first, last, dtype=np.float64) * step)


def integrate(setup: Setup, run: Run, times: Array, states: Array, log: Array, books: Array) -> int:
    """One call of the compiled loop: until the last of the times, or until the rotor stands.

    What it loses by place is added to ``books`` (B + 1, 5) [J].
    """
    spinning, parameters = present_drive(setup, run)
    case = setup.case
    control = _loop.Control(
        scale=setup.scale,
        tolerance=float(case.tolerance),
        largest_step=float(case.largest_step),
        most_steps=MOST_STEPS_PER_WINDOW,
        stop_speed=float(case.stop_speed) if spinning else -1.0,
        end=float(times[-1]),
        snap=1e-9,
        logarithmic=False,
    )
    return int(
        _loop.integrate(
            run.state,
            times,
            parameters._replace(memory=run.memory),
            tableau_of(case.as_drop()),
            control,
            states[: len(times)],
            log,
            run.running,
            books,
            run.peaks,
            run.progress,
        )
    )


def present_drive(setup: Setup, run: Run) -> tuple[bool, KernelParameters]:
    """Whether the rotor still turns, and the kernel parameters that go with it and with the temperatures."""
    spinning, now = math.isnan(run.status[STOPPED_AT]), warmed(setup.parameters, run.memory, run.state)
    return spinning, now if spinning else held(now)


def held(parameters: KernelParameters) -> KernelParameters:
    """The same machine with the rotor held at zero speed."""
    flags, spin = parameters.flags.copy(), parameters.spin.copy()
    flags[L.SPIN_MODE] = aerodynamics.PRESCRIBED_SPEED
    spin[L.INITIAL_SPEED] = 0.0
    spin[L.AERO_TIME_CONSTANT] = 1.0
    return parameters._replace(flags=flags, spin=spin)


def _after(setup: Setup, run: Run, outcome: int, sample: int) -> None:
    """Decide how the run goes on after a call of the loop that ended at a sample."""
    status, layout = run.status, setup.model.layout
    if outcome == _loop.STANDSTILL:
        status[STOPPED_AT] = run.progress[_loop.TIME]
        turning = 0.5 * setup.parameters.spin[L.POLAR_INERTIA] * run.state[layout.rotor_speed] ** 2
        run.state[layout.rotor_speed] = 0.0
        run.state[layout.dissipated] += turning
        if setup.case.duration is None:
            end = run.progress[_loop.TIME] + setup.case.rest
            status[LAST_SAMPLE] = math.ceil(end / setup.case.output_step - 1e-9)
            if setup.case.rest == 0.0:
                status[PHASE] = ENDED
                return
    elif outcome != _loop.FINISHED:
        status[PHASE] = -outcome
    if status[PHASE] == RUNNING and sample >= status[LAST_SAMPLE]:
        status[PHASE] = ENDED


def _ended_contacts(run: Run, log: Array, already_open: int, p: KernelParameters) -> tuple[Array, Array]:
    """Contacts that ended in this window, with those still open at the end of the run; and how many began at
    each bearing.
    """
    count = min(int(run.progress[_loop.LOGGED]), len(log))
    entries = log[:count]
    n_b = len(run.whirl)
    owner = _loop.bearings_logged(entries, p)
    fresh = owner[already_open if run.windows["window_rows"] else 0 :]
    began = np.bincount(fresh[fresh >= 0], minlength=n_b)
    done = np.full(count, run.status[PHASE] != RUNNING) | ~np.isnan(entries[:, _loop.LOG_END])
    ended = entries[done & (owner >= 0)]  # of rotor and races; stops and housing are not kept
    for b in range(n_b):
        mine = entries[done & (owner == b)]
        run.totals[b, 1] += float(np.sum(mine[:, _loop.LOG_DISSIPATED]))
        run.totals[b, 0] += float(began[b])
    kept = C.carry_open_contacts(log, count, run.running)
    run.open_log[:] = 0.0
    run.open_log[:kept] = log[:kept]
    run.progress[_loop.LOGGED] = kept
    return ended, began.astype(np.float64)


def keep_statistics(
    setup: Setup, run: Run, before: tuple[float, float], histories: Array, began: Array
) -> None:
    layout, windows = setup.model.layout, run.windows
    force = magnitude(histories[..., H.H_BEARING_FORCE_X], histories[..., H.H_BEARING_FORCE_Y])
    depth = histories[..., H.H_DELTA]
    values = np.stack([depth, force, histories[..., H.H_STRESS]], axis=-1)
    stored = stored_energy_of(setup, run)
    balance = stored + run.state[layout.dissipated] - run.state[layout.work_in]
    residual = balance - run.status[ENERGY_AT_START]
    run.status[WORST_BALANCE] = max(run.status[WORST_BALANCE], abs(residual))
    speed = float(run.state[layout.rotor_speed])
    lost = float(run.state[layout.dissipated]) - before[1]
    windows["window_rows"].append(np.array([before[0], run.progress[_loop.TIME], speed, lost, residual]))
    windows["window_peak"].append(values.max(axis=0))
    windows["window_quantile"].append(np.moveaxis(np.quantile(values, QUANTILES, axis=0), 0, -1))
    windows["window_contacts"].append(began)
    windows["window_share"].append(np.mean(depth > 0.0, axis=0))
    windows["window_race"].append(run.state[layout.race_spin].copy())


def samples_of(setup: Setup, states: Array, histories: Array) -> dict[str, NDArray[np.float32]]:
    layout = setup.model.layout
    columns = {
        "displacement": displacement_at(states, setup.parameters.bearing_shape),
        "race_displacement": layout.bore(states),
        "sensor_displacement": displacement_at(states, setup.sensor_rows),
        "indentation": histories[..., H.H_DELTA],
        "contact_force": histories[..., H.H_CONTACT_FORCE],
        "bearing_force": magnitude(histories[..., H.H_BEARING_FORCE_X], histories[..., H.H_BEARING_FORCE_Y]),
        "max_stress": histories[..., H.H_STRESS],
        "race_speed": states[:, layout.race_spin],
    }
    samples = {name: values.astype(np.float32) for name, values in columns.items()}
    samples["speed"] = states[:, layout.rotor_speed].copy()  # type: ignore[assignment]
    return samples


def may_be_settled(run: Run) -> bool:
    """Whether every bearing was in contact all through the window before."""
    shares = run.windows["window_share"]
    return len(shares) > 1 and bool(np.all(shares[-1] == 1.0))


def settled_piece(
    setup: Setup, run: Run, states: Array, histories: Array, log: Array, books: Array
) -> tuple[int, tuple[float, float]]:
    """Try a stretch with the scheme for settled rotors; returns samples done, and its errors.

    The first 2 ms are done with the Runge–Kutta pair too, and the stretch is given up, nothing changed, if
    the two differ by more than the case allows or if any bearing loses contact.
    """
    case = setup.case
    spinning, parameters = present_drive(setup, run)
    start, begun = run.state.copy(), float(run.progress[_loop.TIME])
    reference = _reference(setup, run, begun, len(states))
    got = S.integrate_settled(
        run.state,
        begun,
        case.output_step,
        setup.settled_parts,
        parameters,
        case.stop_speed if spinning else -1.0,
        states,
        books,
    )
    sample = round(begun / case.output_step) + 1
    times = _grid(sample, sample + len(states), case.output_step)
    H.bearing_histories(times[:got], states[:got], parameters, histories[:got])
    done = histories[:got]
    error = _difference(parameters, times, states[:got], done, reference)
    lost = not np.all(np.isfinite(states[:got])) or bool(np.any(done[..., H.H_DELTA] <= 0.0))
    if got == 0 or lost or not error[0] <= case.settled_error:
        run.state[:], books[:] = start, 0.0
        return 0, (0.0, 0.0)
    run.progress[_loop.TIME] = (sample - 1 + got) * case.output_step
    _carry_contacts(run, done, begun, case.output_step, log)
    return got, error


def _reference(setup: Setup, run: Run, begun: float, available: int) -> Array:
    """The first 2 ms from the same state with the Runge–Kutta pair, shape (K, n)."""
    case = setup.case
    count = min(max(1, round(CHECKED / case.output_step)), available)
    sample = round(begun / case.output_step) + 1
    times = _grid(sample, sample + count, case.output_step)
    states = np.full((count, len(run.state)), np.nan)
    copy = Run.of({name: array.copy() for name, array in run.arrays().items()})
    books = np.zeros((len(run.whirl) + 1, N_PLACES))
    integrate(setup, copy, times, states, np.zeros((100, _loop.N_LOG_COLUMNS)), books)
    return states


def _difference(
    parameters: KernelParameters, times: Array, states: Array, histories: Array, reference: Array
) -> tuple[float, float]:
    """Largest difference of displacement at the bearings [m] and of ball force [N] over the checked time."""
    count = min(len(reference), len(states))
    if count == 0:
        return math.inf, math.inf
    rows = parameters.bearing_shape
    moved = displacement_at(states[:count], rows) - displacement_at(reference[:count], rows)
    exact = np.empty((count, *histories.shape[1:]))
    H.bearing_histories(times[:count], np.ascontiguousarray(reference[:count]), parameters, exact)
    force = slice(H.H_BEARING_FORCE_X, H.H_BEARING_FORCE_Y + 1)
    return float(np.max(np.abs(moved))), float(
        np.max(np.abs(histories[:count, :, force] - exact[..., force]))
    )


def _carry_contacts(run: Run, histories: Array, begun: float, step: float, log: Array) -> None:
    """Bring the open contacts and the peaks up to the end of a settled stretch."""
    force = magnitude(histories[..., H.H_BEARING_FORCE_X], histories[..., H.H_BEARING_FORCE_Y])
    values = (histories[..., H.H_DELTA], force, histories[..., H.H_STRESS])
    for b in range(len(run.whirl)):
        row = log[int(run.running[b, _loop.RUN_IN_CONTACT]) - 1]
        normal, power = histories[:, b, H.H_CONTACT_FORCE], histories[:, b, H.H_CONTACT_POWER]
        row[_loop.LOG_IMPULSE] += step * float(np.sum(normal))
        row[_loop.LOG_DISSIPATED] += step * float(np.sum(power))
        row[_loop.LOG_SLIDING] += step * float(np.sum(power))  # settled: the normal force loses nothing
        best = int(np.argmax(normal))
        if normal[best] > row[_loop.LOG_PEAK_FORCE]:
            row[_loop.LOG_PEAK_FORCE] = normal[best]
            row[_loop.LOG_PEAK_TIME] = begun + (best + 1) * step
            row[_loop.LOG_AZIMUTH] = atan2(histories[best, b, H.H_NORMAL_Y], histories[best, b, H.H_NORMAL_X])
        run.running[b, _loop.RUN_FORCE] = normal[-1]
        run.running[b, _loop.RUN_POWER] = run.running[b, _loop.RUN_SLIDING] = power[-1]
        run.running[b, _loop.RUN_DELTA] = histories[-1, b, H.H_DELTA]
        for column, quantity in zip(
            (_loop.PEAK_INDENTATION, _loop.PEAK_FORCE, _loop.PEAK_STRESS), values, strict=True
        ):
            best = int(np.argmax(quantity[:, b]))
            if quantity[best, b] > run.peaks[b, column]:
                run.peaks[b, column] = quantity[best, b]
                run.peaks[b, column + 1] = begun + (best + 1) * step
