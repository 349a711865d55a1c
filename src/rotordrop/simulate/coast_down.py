"""Simulate a whole coast-down: from power-off to standstill, with one model and bounded memory."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from rotordrop.errors import OutputError
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.simulate import _coast_loop as C
from rotordrop.simulate import _loop
from rotordrop.simulate._coast_run import (
    ENDED,
    ENERGY_AT_START,
    MOST_STEPS_PER_WINDOW,
    PARTS,
    PHASE,
    RUNNING,
    STOPPED_AT,
    WINDOW,
    WORST_BALANCE,
    Run,
    Setup,
    advance,
    begin,
    prepare,
    stored_energy_of,
)
from rotordrop.simulate._loop import N_RUN_COLUMNS
from rotordrop.simulate.checkpoint import (
    load_checkpoint,
    open_work_folder,
    part_path,
    remove_work_folder,
    run_digest,
    save_checkpoint,
    work_folder,
)
from rotordrop.simulate.coast_down_case import CoastDownCase
from rotordrop.simulate.coast_down_file import Frame, ended_run, write_coast_down, write_part
from rotordrop.simulate.coast_down_result import QUANTITIES, CoastDownResult, WindowStatistics
from rotordrop.simulate.drop import given_up

Progress = Callable[[str, float], None]


def simulate_coast_down(
    machine: Machine | DropModel,
    case: CoastDownCase,
    *,
    output: Path | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    windows_at_most: int | None = None,
) -> CoastDownResult | None:
    """Simulate a rotor from power-off to standstill on its touchdown bearings.

    Parameters
    ----------
    machine : Machine or DropModel
        The machine, or a model built before; it needs ``speed.aero_linear``, ``speed.aero_quadratic`` or a
        time constant.
    case : CoastDownCase
        Speed [rad/s], end, sampling, accuracy.
    output : Path, optional
        HDF5 file for the samples; without it only the statistics are kept.
    resume : bool
        Go on with a run to the same output that was killed; the result is the same to the last bit. A run
        that had ended is read from its output.
    progress : callable, optional
        Called with a few words and the fraction done.
    windows_at_most : int, optional
        Stop after so many windows, as if killed; the run can then be resumed. None is returned.

    Returns
    -------
    CoastDownResult or None
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
    model = machine if isinstance(machine, DropModel) else build_drop_model(machine, case.reduction)
    setup = prepare(model, case)
    digest = run_digest(model, f"{case!r} {N_RUN_COLUMNS}")
    if output is not None and resume and (ended := ended_run(output, digest)) is not None:
        remove_work_folder(work_folder(output))
        return ended
    folder = None if output is None else _folder(output, resume=resume)
    stored = None if folder is None or not resume else load_checkpoint(folder, digest)
    run = begin(setup) if stored is None else Run.of(stored)
    tell = progress or (lambda stage, fraction: None)
    while run.status[PHASE] == RUNNING:
        if windows_at_most is not None and run.status[WINDOW] >= windows_at_most:
            return None
        samples, log = advance(setup, run)
        if folder is not None:
            write_part(part_path(folder, int(run.status[PARTS])), samples, log)
            run.status[PARTS] += 1.0
            save_checkpoint(folder, digest, run.arrays())
        speed = abs(float(run.state[setup.model.layout.rotor_speed])) / (2.0 * math.pi)
        tell(f"{run.progress[_loop.TIME]:.0f} s, {speed:.2f} Hz", _fraction(setup, run))
    result = _result(setup, run, output)
    if folder is not None and output is not None:
        gaps = model.parameters.bearing[:, L.AIR_GAP]
        frame = Frame(sensor_nodes=setup.sensor_nodes, air_gap=gaps)
        write_coast_down(result, frame, digest, folder, int(run.status[PARTS]), output)
        remove_work_folder(folder)
    return result


def _folder(output: Path, *, resume: bool) -> Path:
    if not output.parent.is_dir():
        raise OutputError(
            f"cannot write {output}: the folder {output.parent} does not exist; create it first"
        )
    return open_work_folder(output, resume=resume)


def _fraction(setup: Setup, run: Run) -> float:
    """Share of the run that is done; until standstill it is judged by the speed that is lost."""
    if setup.case.duration is not None:
        return float(run.progress[_loop.TIME] / setup.case.duration)
    speed = abs(float(run.state[setup.model.layout.rotor_speed]))
    begun, stop = abs(setup.case.speed), setup.case.stop_speed
    return 1.0 - math.log(max(speed, stop) / stop) / math.log(begun / stop)


def _result(setup: Setup, run: Run, output: Path | None) -> CoastDownResult:
    model, case, layout = setup.model, setup.case, setup.model.layout
    whirl = run.whirl.copy()
    for row in whirl:
        C.close_sweep(row)
    rows = np.array(run.windows["window_rows"])
    stopped, end = float(run.status[STOPPED_AT]), float(run.progress[_loop.TIME])
    peaks = run.peaks[:, : 2 * len(QUANTITIES)].reshape(-1, len(QUANTITIES), 2)
    result = CoastDownResult(
        machine_name=model.machine.name,
        bearing_names=model.bearing_names,
        initial_speed=case.speed,
        tolerance=case.tolerance,
        reduction=model.basis.description,
        output_step=case.output_step,
        end_time=end,
        standstill_time=None if math.isnan(stopped) else stopped,
        finished=bool(run.status[PHASE] == ENDED) and (case.duration is not None or not math.isnan(stopped)),
        outcome="",
        windows=WindowStatistics(
            start=rows[:, 0],
            end=rows[:, 1],
            speed=rows[:, 2],
            race_speed=np.array(run.windows["window_race"]),
            dissipated=rows[:, 3],
            contacts=np.array(run.windows["window_contacts"]),
            contact_share=np.array(run.windows["window_share"]),
            peak=np.array(run.windows["window_peak"]),
            quantile=np.array(run.windows["window_quantile"]),
            energy_residual=rows[:, 4],
            settled=np.array(run.windows["window_method"]),
        ),
        peak_value=peaks[..., 0].copy(),
        peak_time=peaks[..., 1].copy(),
        whirl_time=whirl[:, C.FORWARD_TIME : C.BACKWARD_TIME + 1].copy(),
        contacts=run.totals[:, 0].copy(),
        contact_energy=run.totals[:, 1].copy(),
        dissipated=float(run.state[layout.dissipated]),
        air_work=float(run.state[layout.work_in]),
        energy_residual=float(run.status[WORST_BALANCE]),
        energy_scale=float(run.status[ENERGY_AT_START] - stored_energy_of(setup, run)),
        steps=int(run.progress[_loop.ACCEPTED]),
        rejected_steps=int(run.progress[_loop.REJECTED]),
        path=output,
        heat=None if setup.warming is None else setup.warming.heat_of(run.windows["heat_rows"], run.memory),
    )
    return replace(result, outcome=_sentence(setup, run, result))


def _sentence(setup: Setup, run: Run, result: CoastDownResult) -> str:
    reached = f"{result.end_time:.4g} s"
    if run.status[PHASE] < RUNNING:
        few = f"{MOST_STEPS_PER_WINDOW} steps were not enough for one second", "Loosen the tolerance or use"
        return given_up(setup.model.machine, -int(run.status[PHASE]), result.end_time, *few)
    counted = f"{result.steps} steps, {int(np.sum(result.contacts))} contacts"
    if result.standstill_time is not None:
        rest = result.end_time - result.standstill_time
        after = f" and was followed for another {rest:.3g} s at rest" if rest > 1e-6 else ""
        return f"The rotor stood still after {result.standstill_time:.4g} s{after} ({counted})."
    left = abs(float(result.windows.speed[-1])) / (2.0 * math.pi)
    if setup.case.duration is None:
        return (
            f"The rotor still turned at {left:.3g} Hz after {reached} ({counted}). Raise the longest time, "
            "or give the races a drag that can stop it."
        )
    return f"The coast-down was simulated to {reached}, where the rotor turns at {left:.3g} Hz ({counted})."
