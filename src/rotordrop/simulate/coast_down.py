"""Simulate a whole coast-down: from power-off to standstill, with one model and bounded memory."""

from __future__ import annotations

import math
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import SimulationError
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.elementary import magnitude
from rotordrop.progress import Shown, shown
from rotordrop.require import require
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.simulate import _coast_loop as C
from rotordrop.simulate import _histories as H
from rotordrop.simulate import _loop
from rotordrop.simulate._run import (
    ENDED,
    ENERGY_AT_START,
    PHASE,
    RUNNING,
    SAMPLE,
    STOPPED_AT,
    WINDOW,
    WORST_BALANCE,
    Run,
    Setup,
    Window,
    energies,
    follow,
    given_up,
    present,
    setup_of,
)
from rotordrop.simulate.case import CoastDownCase
from rotordrop.simulate.coast_down_file import (
    ended_run,
    load_checkpoint,
    open_work_folder,
    part_path,
    remove_work_folder,
    run_digest,
    save_checkpoint,
    work_folder,
    write_coast_down,
    write_part,
)
from rotordrop.simulate.coast_down_result import QUANTILES, QUANTITIES, CoastDownResult, WindowStatistics
from rotordrop.simulate.levitation import start_of_drop

MOST_STEPS_PER_WINDOW = 5_000_000


def simulate_coast_down(
    machine: Machine | DropModel,
    case: CoastDownCase,
    *,
    output: str | Path | None = None,
    resume: bool = False,
    progress: Shown = None,
) -> CoastDownResult:
    """Simulate a rotor from power-off to standstill on its touchdown bearings.

    Parameters
    ----------
    machine : Machine or DropModel
        The machine, or a model built before; it needs ``speed.aero_linear``, ``speed.aero_quadratic`` or a
        time constant.
    case : CoastDownCase
        Speed [rad/s], end, sampling, accuracy.
    output : path-like, optional
        HDF5 file for the samples; without it only the statistics are kept.
    resume : bool
        Go on with a run to the same output that was killed; the result is the same to the last bit. A run
        that had ended is read from its output.
    progress : callable or False, optional
        Called with a few words and the fraction done; by default a bar in a terminal or a notebook.

    Returns
    -------
    CoastDownResult
        Statistics, peaks with their time, and how it ended.

    Raises
    ------
    SimulationError
        If the machine has no aerodynamic drag, or the run to resume is another one.

    Notes
    -----
    Source: Neisi 2020, section 5.4, which measures 48 to 75 s and simulates 0.2 s. Differs from the paper:
    drag is a function of speed. The race drag acts down to the stop speed instead of fading below
    ``drag_speed`` (dry friction stops a rotor, a regularised law only slows it for ever); when the rotor
    turns no faster than the stop speed it sticks, while races, supports and the swing go on.
    Not validated: after standstill the rotor is held; a real one still rocks with its swing.
    """
    require(machine, "machine", Machine, DropModel)
    require(case, "case", CoastDownCase)
    require(output, "output", str, PathLike, none=True)
    require(resume, "resume", bool)
    output = None if output is None else Path(output)
    model = machine if isinstance(machine, DropModel) else build_drop_model(machine, case.reduction)
    setup, run = _begun(model, case)
    nodes = tuple(sorted({sensor.node for sensor in model.machine.sensors}))
    digest = run_digest(model, f"{case!r} {_loop.N_RUN_COLUMNS}")
    if output is not None and resume and (ended := ended_run(output, digest)) is not None:
        remove_work_folder(work_folder(output))
        return ended
    folder = None if output is None else open_work_folder(output, resume=resume)
    stored = None if folder is None or not resume else load_checkpoint(folder, digest)
    run = run if stored is None else Run.of(stored)
    with shown(progress, "coast-down") as tell:
        while run.going:
            samples, log = _advance(model, case, setup, run, nodes)
            if folder is not None:
                write_part(part_path(folder, int(run.status[WINDOW]) - 1), samples, log)
                save_checkpoint(folder, digest, run.arrays())
            speed = abs(float(run.state[model.layout.rotor_speed]))
            tell(f"{run.time:.0f} s, {speed / (2.0 * math.pi):.2f} Hz", _fraction(case, run, speed))
    result = _result(model, case, run, setup, nodes, output)
    if folder is not None and output is not None:
        write_coast_down(result, digest, folder, int(run.status[WINDOW]), output)
        remove_work_folder(folder)
    return result


def _begun(model: DropModel, case: CoastDownCase) -> tuple[Setup, Run]:
    start, parameters = start_of_drop(model, case)
    setup = setup_of(model, case, _with_drag(parameters, model, case), MOST_STEPS_PER_WINDOW)
    run = Run.begun(setup, start, math.ceil(case.last_time / case.output_step - 1e-9))
    for row, (x, y) in zip(run.whirl, _against_races(model, run.state[None])[0], strict=True):
        C.start_whirl(0.0, x, y, row)
    run.status[ENERGY_AT_START] = energies(present(setup, run), np.zeros(1), run.state[None])[1][0]
    return setup, run


def _against_races(model: DropModel, states: Array) -> Array:
    """Displacement of the rotor against the races, shape (T, B, 2) [m]."""
    return H.node_displacements(states, model.parameters.bearing_shape) - model.layout.bore(states)


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


def _advance(
    model: DropModel, case: CoastDownCase, setup: Setup, run: Run, nodes: tuple[int, ...]
) -> tuple[dict[str, NDArray[Any]], Array]:
    """Simulate to the end of the present window; returns its samples and the contacts that ended."""
    number = int(run.status[WINDOW])
    times = np.arange(run.status[SAMPLE], case.window_end(number) + 1) * case.output_step
    before, already = (run.time, float(run.state[model.layout.dissipated])), int(run.progress[_loop.LOGGED])
    shares = run.rows["contact_share"]
    # settled: every bearing was in contact all through the window before
    lies = setup.settled_parts > 0 and len(shares) > 1 and bool(np.all(shares[-1] == 1.0))
    window = follow(setup, run, times, may_settle=lies)
    ended, began = _ended_contacts(setup, run, window.log, already if number else 0)
    C.follow_whirl(window.times, _against_races(model, window.states), run.whirl)
    _keep_statistics(model, setup, run, before, window, began)
    run.status[WINDOW] += 1.0
    return _samples(model, window, nodes), ended


def _ended_contacts(setup: Setup, run: Run, log: Array, already: int) -> tuple[Array, Array]:
    """Contacts that ended in this window, with those still open at the end of the run; and how many began at
    each bearing, behind those that were ``already`` open.
    """
    count = min(int(run.progress[_loop.LOGGED]), len(log))
    entries = log[:count]
    owner = _loop.bearings_logged(entries, setup.parameters)
    fresh = owner[already:]
    began = np.bincount(fresh[fresh >= 0], minlength=len(run.whirl))
    done = np.full(count, not run.going) | ~np.isnan(entries[:, _loop.LOG_END])
    ended = entries[done & (owner >= 0)]  # of rotor and races; stops and housing are not kept
    for b in range(len(run.whirl)):
        run.totals[b, 1] += float(np.sum(entries[done & (owner == b)][:, _loop.LOG_DISSIPATED]))
        run.totals[b, 0] += float(began[b])
    kept = C.carry_open_contacts(log, run.running)
    run.log[:] = 0.0
    run.log[:kept] = log[:kept]
    run.progress[_loop.LOGGED] = kept
    return ended, began.astype(np.float64)


def _keep_statistics(
    model: DropModel, setup: Setup, run: Run, before: tuple[float, float], window: Window, began: Array
) -> None:
    """Keep the statistics of a window that began ``before`` [s], with the energy dissipated by then [J]."""
    layout, values = model.layout, H.peak_values(window.histories)
    balance = energies(present(setup, run), np.array([run.time]), run.state[None])[1][0]
    residual = balance - run.status[ENERGY_AT_START]
    run.status[WORST_BALANCE] = max(run.status[WORST_BALANCE], abs(residual))
    kept = {
        "start": before[0],
        "end": run.time,
        "speed": run.state[layout.rotor_speed],
        "race_speed": run.state[layout.race_spin].copy(),
        "dissipated": run.state[layout.dissipated] - before[1],
        "contacts": began,
        "contact_share": np.mean(values[..., 0] > 0.0, axis=0),
        "peak": values.max(axis=0),
        "quantile": np.moveaxis(np.quantile(values, QUANTILES, axis=0), 0, -1),
        "energy_residual": residual,
        "settled": window.settled,
    }
    for name, value in kept.items():
        run.rows[name].append(value)


def _samples(model: DropModel, window: Window, nodes: tuple[int, ...]) -> dict[str, NDArray[Any]]:
    """Samples of a window for the file; single precision but for the speed, whose integral is an angle."""
    rows = np.array([model.basis.node_row(node) for node in nodes]).reshape(len(nodes), model.layout.n_modes)
    columns = H.named(model, window.states, window.histories)
    speed, force = columns.pop("speed").copy(), columns["bearing_force"]
    columns["bearing_force"] = magnitude(force[..., 0], force[..., 1])
    columns["sensor_displacement"] = H.node_displacements(window.states, rows)
    return {name: values.astype(np.float32) for name, values in columns.items()} | {"speed": speed}


def _fraction(case: CoastDownCase, run: Run, speed: float) -> float:
    """Share of the run that is done; until standstill it is judged by the speed [rad/s] that is lost."""
    if case.duration is not None:
        return run.time / case.duration
    stop = case.stop_speed
    return 1.0 - math.log(max(speed, stop) / stop) / math.log(abs(case.speed) / stop)


def _result(
    model: DropModel, case: CoastDownCase, run: Run, setup: Setup, nodes: tuple[int, ...], output: Path | None
) -> CoastDownResult:
    layout, whirl, rows = model.layout, run.whirl.copy(), dict(run.rows)
    for row in whirl:
        C.close_sweep(row)
    heat, stopped = rows.pop("heat", []), float(run.status[STOPPED_AT])
    left, _ = energies(present(setup, run), np.array([run.time]), run.state[None])
    peaks = run.peaks[:, : 2 * len(QUANTITIES)].reshape(-1, len(QUANTITIES), 2)
    result = CoastDownResult(
        machine_name=model.machine.name,
        bearing_names=model.bearing_names,
        initial_speed=case.speed,
        tolerance=case.tolerance,
        reduction=model.basis.description,
        output_step=case.output_step,
        end_time=run.time,
        standstill_time=None if run.spinning else stopped,
        finished=bool(run.status[PHASE] == ENDED) and (case.duration is not None or not run.spinning),
        outcome="",
        windows=WindowStatistics(**{name: np.array(kept) for name, kept in rows.items()}),
        peak_value=peaks[..., 0].copy(),
        peak_time=peaks[..., 1].copy(),
        whirl_time=whirl[:, C.FORWARD_TIME : C.BACKWARD_TIME + 1].copy(),
        contacts=run.totals[:, 0].copy(),
        contact_energy=run.totals[:, 1].copy(),
        dissipated=float(run.state[layout.dissipated]),
        air_work=float(run.state[layout.work_in]),
        energy_residual=float(run.status[WORST_BALANCE]),
        energy_scale=float(run.status[ENERGY_AT_START] - left[0]),
        steps=int(run.progress[_loop.ACCEPTED]),
        rejected_steps=int(run.progress[_loop.REJECTED]),
        sensor_nodes=np.array(nodes, dtype=np.int64),
        air_gap=model.parameters.bearing[:, L.AIR_GAP].copy(),
        path=output,
        heat=None if setup.warming is None else setup.warming.heat_of(heat, run.memory),
    )
    return replace(result, outcome=_sentence(model.machine, case, run, result))


def _sentence(machine: Machine, case: CoastDownCase, run: Run, result: CoastDownResult) -> str:
    reached = f"{result.end_time:.4g} s"
    if run.status[PHASE] < RUNNING:
        few = f"{MOST_STEPS_PER_WINDOW} steps were not enough for one second", "Loosen the tolerance or use"
        return given_up(machine, run, *few)
    counted = f"{result.steps} steps, {int(np.sum(result.contacts))} contacts"
    if result.standstill_time is not None:
        rest = result.end_time - result.standstill_time
        after = f" and was followed for another {rest:.3g} s at rest" if rest > 1e-6 else ""
        return f"The rotor stood still after {result.standstill_time:.4g} s{after} ({counted})."
    left = abs(float(result.windows.speed[-1])) / (2.0 * math.pi)
    if case.duration is None:
        return (
            f"The rotor still turned at {left:.3g} Hz after {reached} ({counted}). Raise the longest time, "
            "or give the races a drag that can stop it."
        )
    return f"The coast-down was simulated to {reached}, where the rotor turns at {left:.3g} Hz ({counted})."
