"""One run of a machine in windows of time: a drop is one window, a coast-down many, until the rotor stands.

Everything that a run carries from one window to the next stands in `Run`, so a run that is stopped between
two windows and taken up again takes the very same steps.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple

import numpy as np

from rotordrop.arrays import Array
from rotordrop.machine import Machine
from rotordrop.machine.plausibility import doubts
from rotordrop.physics import aerodynamics
from rotordrop.physics import columns as L
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import atan2
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.suspension import touchdown_supports
from rotordrop.simulate import _coast_loop as C
from rotordrop.simulate import _histories as H
from rotordrop.simulate import _loop
from rotordrop.simulate import _settled_loop as S
from rotordrop.simulate._rhs import N_PLACES
from rotordrop.simulate._tableau import Tableau, dp5, tsit5
from rotordrop.simulate.case import CoastDownCase, Simulated
from rotordrop.simulate.heat import Warming, warmed, warms

TYPICAL = np.full(L.N_KINDS, np.inf)
"""Typical size of a state by its kind, in its unit; angle and audit follow without control."""
TYPICAL[[L.POSITION, L.VELOCITY, L.SPIN, L.INTERNAL, L.HEAT]] = 1e-4, 0.1, 10.0, 1.0, 10.0
FIRST_STEP = 1e-6
LOG_ROWS_PER_SECOND = 20_000
HEAT_STEP = 0.01
"""Least distance [s] of the instants at which the bearings of a coast-down are looked at."""
SETTLED_STEP = 0.92
CHECKED = 2e-3
"""Part of every settled window [s] that is also done with the Runge–Kutta pair."""
RUNNING, ENDED = 0.0, 1.0
"""Phases of a run; one that was given up has less the outcome of the loop."""
# Entries of `Run.status`.
PHASE, WINDOW, SAMPLE, STOPPED_AT, LAST_SAMPLE, ENERGY_AT_START, WORST_BALANCE = range(7)


def error_scale(model: DropModel) -> Array:
    """Typical size of every state, shape (n,), in its unit; infinite where the step control does not look.

    Modal amplitudes are scaled so that a mode counts by what it moves at the bearings.
    """
    layout = model.layout
    reach = np.max(np.abs(model.parameters.bearing_shape), axis=0)
    floor = 0.05 * np.max(reach)
    modal = 1.0 / np.maximum(reach, floor)
    scale = TYPICAL[layout.kinds]
    for part in (layout.modal_x, layout.modal_y):
        scale[part] *= modal
        scale[layout.velocity_of(part)] *= modal
    return scale


@dataclass(frozen=True, kw_only=True)
class Setup:
    """What does not change during a run."""

    parameters: KernelParameters
    """Of the cold machine, with what the case adds."""
    control: _loop.Control
    """How it is stepped through; its end is that of each call."""
    tableau: Tableau = field(default_factory=tsit5)
    stepped: Callable[..., int] = _loop.integrate
    """The compiled loop, or what takes its place."""
    jump: tuple[float, KernelParameters] | None = None
    """When [s] the parameters become others."""
    coast: CoastDownCase | None = None
    """Rule by which the rotor stops and sticks; a drop has none."""
    settled_parts: int = 0
    """Steps per sample of the scheme for settled rotors; zero where it does not hold."""
    warming: Warming | None = field(init=False)
    """What goes on beside the time loop where bearings warm."""

    def __post_init__(self) -> None:
        cold = self.parameters
        object.__setattr__(self, "warming", Warming(cold=cold) if warms(cold).size else None)


def setup_of(
    model: DropModel, case: Simulated, parameters: KernelParameters, most_steps: int, **more: Any
) -> Setup:
    """A run of a model from the parameters of its start, in windows of so many steps at most."""
    coast = case if isinstance(case, CoastDownCase) else None
    control = _loop.Control(
        scale=error_scale(model),
        tolerance=float(case.tolerance),
        largest_step=float(case.largest_step),
        most_steps=most_steps,
        stop_speed=-1.0 if coast is None else float(coast.stop_speed),
        end=0.0,
        snap=0.0 if coast is None else 1e-9,
        logarithmic=coast is None,
    )
    tableau = tsit5() if case.integrator == "tsit5" else dp5()
    # the scheme for settled rotors does not hold axial motion back
    settles = coast is not None and coast.settled_scheme and model.layout.axial < 0
    parts = _settled_parts(model, coast.output_step) if coast is not None and settles else 0
    return Setup(
        parameters=parameters, control=control, tableau=tableau, coast=coast, settled_parts=parts, **more
    )


def _settled_parts(model: DropModel, output_step: float) -> int:
    """Steps per sample that keep the settled scheme stable: what the rotor lies on swings 0.92 rad in one."""
    fastest = 0.0
    for support in touchdown_supports(model.machine):
        inner, outer = (float(link.stiffness[1, 1]) for link in support.links[:2])
        fastest = max(fastest, math.sqrt((inner + outer) / support.masses[0]))
    return max(1, math.ceil(output_step * fastest / SETTLED_STEP))


@dataclass(frozen=True, kw_only=True)
class Run:
    """Where a run stands: arrays that change in place, and nothing else, so a checkpoint is just these."""

    state: Array
    progress: Array
    running: Array
    log: Array
    """Contacts still open."""
    peaks: Array
    whirl: Array
    totals: Array
    """Of each bearing of a coast-down: peaks, sweeps of the azimuth, contacts and their energy [J]."""
    books: Array
    """Energy lost by place [J], (B + 1, 5): of a drop, or of the last stretch of a coast-down."""
    memory: Array
    status: Array
    rows: defaultdict[str, list[Any]] = field(default_factory=lambda: defaultdict(list))
    """What is kept of every window, by name, and of instants at which bearings that warm were looked at."""

    @classmethod
    def begun(cls, setup: Setup, state: Array, last_sample: int) -> Run:
        """A run from a state (n,) at time zero."""
        p, y = setup.parameters, np.array(state, dtype=np.float64)
        progress, watched, n_b = np.zeros(_loop.N_PROGRESS), _loop.number_watched(p), len(p.bearing)
        progress[_loop.STEP] = min(FIRST_STEP, setup.control.largest_step)
        progress[_loop.PREVIOUS_ERROR] = float(not setup.control.logarithmic)
        running, log = np.zeros((watched, _loop.N_RUN_COLUMNS)), np.zeros((watched, _loop.N_LOG_COLUMNS))
        status = np.zeros(7)
        status[[STOPPED_AT, LAST_SAMPLE]] = np.nan, last_sample
        run = cls(
            state=y,
            progress=progress,
            running=running,
            log=log,
            peaks=np.zeros((0 if setup.coast is None else n_b, _loop.N_PEAKS)),
            whirl=np.zeros((n_b, C.N_WHIRL)),
            totals=np.zeros((n_b, 2)),
            books=np.zeros((n_b + 1, N_PLACES)),
            memory=p.memory.copy(),
            status=status,
        )
        if setup.warming is not None:
            run.rows["heat"].append(setup.warming.row(run.memory, 0.0, y, warmed(p, run.memory, y)))
        return run

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return float(self.progress[_loop.TIME])

    @property
    def going(self) -> bool:
        """Whether it has not ended."""
        return bool(self.status[PHASE] == RUNNING)

    @property
    def spinning(self) -> bool:
        """Whether the rotor does not stand and stick yet."""
        return math.isnan(self.status[STOPPED_AT])

    def arrays(self) -> dict[str, Array]:
        """What a checkpoint holds."""
        own = {name: value for name, value in vars(self).items() if name != "rows"}
        return own | {name: np.array(rows) for name, rows in self.rows.items()}

    @classmethod
    def of(cls, arrays: dict[str, Array]) -> Run:
        """The run that a checkpoint holds."""
        own = {item.name: arrays.pop(item.name) for item in fields(cls) if item.name != "rows"}
        return cls(**own, rows=defaultdict(list, {name: list(rows) for name, rows in arrays.items()}))


class Window(NamedTuple):
    """What a run did in a window; samples T, the first of them where the window before ended."""

    times: Array
    """Samples [s], shape (T,)."""
    states: Array
    histories: Array
    """Shapes (T, n) and (T, B, 12), see `_histories`."""
    log: Array
    """Contacts: those open at its begin, then those that began, columns as in `_loop`."""
    parts: list[tuple[slice, KernelParameters]]
    """Samples and the parameters that they were integrated with, in order."""
    settled: Array
    """Share done with the scheme for settled rotors [1], and its errors [m], [N]."""


def present(setup: Setup, run: Run) -> KernelParameters:
    """Parameters as the time, the temperatures and a rotor that stands make them."""
    now = setup.parameters
    if setup.jump is not None and run.time >= setup.jump[0]:
        now = setup.jump[1]
    if setup.warming is not None:
        now = now._replace(bearing=warmed(setup.parameters, run.memory, run.state).bearing)
    now = now._replace(memory=run.memory)
    return now if run.spinning else held(now)


def held(parameters: KernelParameters) -> KernelParameters:
    """The same machine with the rotor held at zero speed."""
    flags, spin = parameters.flags.copy(), parameters.spin.copy()
    flags[L.SPIN_MODE] = aerodynamics.PRESCRIBED_SPEED
    spin[L.INITIAL_SPEED] = 0.0
    spin[L.AERO_TIME_CONSTANT] = 1.0
    return parameters._replace(flags=flags, spin=spin)


def follow(setup: Setup, run: Run, times: Array, *, may_settle: bool = False) -> Window:
    """Take a run to the last of the times (T,) [s], the first being that of the sample it has got to.

    The window is shorter where the run ends before. ``may_settle``: with the scheme for settled rotors.
    """
    status, first, dissipated = run.status, int(run.status[SAMPLE]), setup.parameters.rotor_at[L.DISSIPATED]
    states, settled = np.empty((len(times), len(run.state))), np.zeros(3)
    histories = np.empty((len(times), len(run.whirl), H.N_HISTORIES))
    rows = len(run.log) + 100 + int(LOG_ROWS_PER_SECOND * (times[-1] - times[0]))
    log = np.zeros((rows, _loop.N_LOG_COLUMNS))
    log[: len(run.log)] = run.log

    def fill(part: slice, now: KernelParameters) -> None:
        now.form.of(H.bearing_histories)(times[part], states[part], now, histories[part])

    states[0], parts, filled = run.state, [(slice(0, 1), present(setup, run))], 1
    fill(*parts[0])
    whole = min(len(times) - 1, int(status[LAST_SAMPLE]) - first)
    while run.going and filled <= (last := min(len(times) - 1, int(status[LAST_SAMPLE]) - first)):
        now, begun = present(setup, run), (run.time, float(run.state[dissipated]))
        end = _end(setup, run, times[: last + 1], filled)
        wanted = slice(filled, int(np.searchsorted(times[: last + 1], end, side="right")))
        if setup.coast is not None:
            run.books[:] = 0.0
        before = run.books.copy()
        if may_settle and setup.coast is not None:
            outcome = _loop.FINISHED
            got, error = _settled_piece(
                setup, setup.coast, run, now, times[wanted], states[wanted], histories[wanted], log
            )
            if got:
                settled = np.array([settled[0] + got / whole, *np.maximum(settled[1:], error)])
            # a stretch of constant temperatures is not the whole window
            may_settle = setup.warming is not None and got == wanted.stop - wanted.start
        else:
            outcome = step(setup, run, now, times[wanted], states[wanted], log, end)
            got = int(run.progress[_loop.SAMPLES])
            fill(slice(filled, filled + got), now)
        parts.append((slice(filled, filled + got), now))
        filled += got
        if setup.warming is not None and run.time > begun[0]:
            _warm(setup, setup.warming, run, begun, now, run.books - before)
        _after(setup, run, outcome, first + filled - 1)
    kept = filled - run.going
    status[SAMPLE] = first + kept
    return Window(times[:kept], states[:kept], histories[:kept], log, parts, settled)


def step(
    setup: Setup, run: Run, now: KernelParameters, times: Array, states: Array, log: Array, end: float
) -> int:
    """One call of the compiled loop: until an end [s], or until the rotor stands."""
    stop_speed = setup.control.stop_speed if run.spinning else -1.0
    control = setup.control._replace(end=float(end), stop_speed=stop_speed)
    arrays = (states, log, run.running, run.books, run.peaks, run.progress)
    return int(now.form.of(setup.stepped)(run.state, times, now, setup.tableau, control, *arrays))


def _end(setup: Setup, run: Run, times: Array, filled: int) -> float:
    """Until when [s] the parameters may stand still, at most to the last of the times (T,)."""
    end = float(times[-1])
    if setup.jump is not None and run.time < setup.jump[0] < end:
        end = setup.jump[0]
    if setup.warming is None:
        return end
    if setup.coast is None:
        return setup.warming.until(run.memory, run.time, end)
    samples = max(1, int(setup.warming.stretch(run.memory) / setup.coast.output_step))
    return float(times[min(len(times) - 1, filled - 1 + samples)])


def _warm(
    setup: Setup, warming: Warming, run: Run, begun: tuple[float, float], now: KernelParameters, lost: Array
) -> None:
    """Warm the nodes by what a stretch ``lost`` (B + 1, 5) [J], and let preload and gap follow.

    ``begun`` is its first instant [s] with the energy dissipated by then [J].
    """
    total = float(np.sum(lost))
    # the scheme for settled rotors books by the powers at its samples: what it lost in all is exact
    if setup.coast is not None and total > 0.0:
        lost *= (float(run.state[now.rotor_at[L.DISSIPATED]]) - begun[1]) / total
    warming.take(run.memory, lost, run.time - begun[0])
    grown, rows = warming.grow(run.memory, run.time, run.state, now), run.rows["heat"]
    run.peaks[:, _loop.PEAK_TRAVEL] = 0.0  # the same travel makes another force now
    if setup.coast is None or run.time >= rows[-1][0] + HEAT_STEP:
        rows.append(warming.row(run.memory, run.time, run.state, grown))


def _after(setup: Setup, run: Run, outcome: int, sample: int) -> None:
    """Decide how the run goes on after a call of the loop that ended at a sample."""
    status, p, coast = run.status, setup.parameters, setup.coast
    if outcome == _loop.STANDSTILL and coast is not None:
        status[STOPPED_AT] = run.time
        i_w = p.rotor_at[L.ROTOR_SPEED]
        turning = 0.5 * p.spin[L.POLAR_INERTIA] * run.state[i_w] ** 2
        run.state[i_w] = 0.0
        run.state[p.rotor_at[L.DISSIPATED]] += turning
        if coast.duration is None:
            status[LAST_SAMPLE] = math.ceil((run.time + coast.rest) / coast.output_step - 1e-9)
            if coast.rest == 0.0:
                status[PHASE] = ENDED
    elif outcome != _loop.FINISHED:
        status[PHASE] = -outcome
    if run.going and sample >= status[LAST_SAMPLE]:
        status[PHASE] = ENDED


def energies(p: KernelParameters, times: Array, states: Array) -> tuple[Array, Array]:
    """Energy [J] of states (T, n), and with it what was dissipated less what was put in: constant."""
    stored = np.empty(len(times))
    p.form.of(H.stored_energies)(times, states, p, True, stored)
    return stored, stored + states[:, p.rotor_at[L.DISSIPATED]] - states[:, p.rotor_at[L.WORK_IN]]


def given_up(machine: Machine, run: Run, too_few: str, remedy: str) -> str:
    """Why a run was given up, and the way out; of steps as the caller says."""
    why, way_out = {
        _loop.STEP_TOO_SMALL: (
            "the step fell below 1e-14 s",
            "Check for a friction law with a tiny smoothing speed or an extreme stiffness",
        ),
        _loop.TOO_MANY_STEPS: (too_few, f"{remedy} a smaller reduction"),
    }.get(
        -int(run.status[PHASE]), ("a value became infinite", "Check the start and the machine's parameters")
    )
    odd = "".join(f" {doubt.message}." for doubt in doubts(machine))
    return f"The simulation stopped at {run.time:.6g} s: {why}. {way_out}.{odd}"


def _settled_piece(
    setup: Setup,
    case: CoastDownCase,
    run: Run,
    now: KernelParameters,
    times: Array,
    states: Array,
    histories: Array,
    log: Array,
) -> tuple[int, tuple[float, float]]:
    """Try a stretch with the scheme for settled rotors; returns samples done, and its errors.

    The first 2 ms are done with the Runge–Kutta pair too, and the stretch is given up, nothing changed, if
    the two differ by more than the case allows or if any bearing loses contact.
    """
    start, begun = run.state.copy(), run.time
    exact = _reference(setup, run, now, times[: max(1, round(CHECKED / case.output_step))])
    stop_speed = case.stop_speed if run.spinning else -1.0
    got = now.form.of(S.integrate_settled)(
        run.state, begun, case.output_step, setup.settled_parts, now, stop_speed, states, run.books
    )
    done = histories[:got]
    now.form.of(H.bearing_histories)(times[:got], states[:got], now, done)
    error = _difference(now, times, states[:got], done, exact)
    lost = not np.all(np.isfinite(states[:got])) or bool(np.any(done[..., H.H_DELTA] <= 0.0))
    if got == 0 or lost or not error[0] <= case.settled_error:
        run.state[:], run.books[:] = start, 0.0
        return 0, (0.0, 0.0)
    run.progress[_loop.TIME] = times[got - 1]
    _carry_contacts(run, done, begun, case.output_step, log)
    return got, error


def _reference(setup: Setup, run: Run, now: KernelParameters, times: Array) -> Array:
    """States (K, n) at times (K,) from the same one with the Runge–Kutta pair."""
    states = np.full((len(times), len(run.state)), np.nan)
    changed = ("state", "progress", "running", "books", "peaks")
    copy = replace(run, **{name: getattr(run, name).copy() for name in changed})
    step(setup, copy, now, times, states, np.zeros((100, _loop.N_LOG_COLUMNS)), times[-1])
    return states


def _difference(
    p: KernelParameters, times: Array, states: Array, histories: Array, reference: Array
) -> tuple[float, float]:
    """Largest difference of displacement at the bearings [m] and of ball force [N] over the checked time."""
    count = min(len(reference), len(states))
    if count == 0:
        return math.inf, math.inf
    moved, exactly = (H.node_displacements(one[:count], p.bearing_shape) for one in (states, reference))
    exact = np.empty((count, *histories.shape[1:]))
    p.form.of(H.bearing_histories)(times[:count], reference[:count], p, exact)
    force = slice(H.H_BEARING_FORCE_X, H.H_BEARING_FORCE_Y + 1)
    return float(np.max(np.abs(moved - exactly))), float(
        np.max(np.abs(histories[:count, :, force] - exact[..., force]))
    )


def _carry_contacts(run: Run, histories: Array, begun: float, step: float, log: Array) -> None:
    """Bring the open contacts and the peaks up to the end of a settled stretch."""
    values = H.peak_values(histories)
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
        for column, of_one in zip(
            (_loop.PEAK_INDENTATION, _loop.PEAK_FORCE, _loop.PEAK_STRESS), values[:, b].T, strict=True
        ):
            best = int(np.argmax(of_one))
            if of_one[best] > run.peaks[b, column]:
                run.peaks[b, column : column + 2] = of_one[best], begun + (best + 1) * step
