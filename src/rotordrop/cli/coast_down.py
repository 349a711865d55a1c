"""Simulate a whole coast-down, from power-off to standstill.

Streams the samples to disk, can be killed and resumed, and says whether 0.2 s holds the maximum.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotordrop.cli._interruption import interruptible
from rotordrop.cli._options import JsonOption, MachineArgument, quantity
from rotordrop.cli._output import console, deliver, progress_bar, require_places
from rotordrop.cli.simulate import Integrator, Reduction
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rotordrop.cli._output import Progress
    from rotordrop.machine import Machine
    from rotordrop.simulate.coast_down_case import CoastDownCase
    from rotordrop.simulate.coast_down_certificate import CoastDownCertificate
    from rotordrop.simulate.coast_down_result import CoastDownResult
    from rotordrop.spectrum.coast_down import CoastDownAnalysis

STANDSTILL = "standstill"


def coast_down(
    machine: MachineArgument,
    speed: Annotated[
        float, typer.Option(parser=quantity("speed"), metavar="SPEED", help='Speed at power-off, "60 Hz".')
    ],
    until: Annotated[
        str, typer.Option(metavar="END", help='"standstill", or a time such as "20 s".')
    ] = STANDSTILL,
    rest: Annotated[
        float,
        typer.Option(
            parser=quantity("time"), metavar="TIME", help="Go on after standstill.", show_default="0 s"
        ),
    ] = 0.0,
    drag_from: Annotated[
        Path | None,
        typer.Option(metavar="RECORD", help="Take the drag from the speed of a recorded coast-down."),
    ] = None,
    output_step: Annotated[
        float,
        typer.Option(
            parser=quantity("time"), metavar="TIME", help="Step of the samples.", show_default="50 us"
        ),
    ] = 5e-5,
    levitated: Annotated[
        bool, typer.Option("--levitated", help="Start floating in the AMBs: synchronous orbit and sag.")
    ] = False,
    reduction: Annotated[Reduction, typer.Option(help="Modes of the rotor.")] = Reduction.quick,
    tolerance: Annotated[float, typer.Option(min=1e-12, max=1e-3, help="Accuracy of a step.")] = 1e-6,
    integrator: Annotated[Integrator, typer.Option(help="Runge–Kutta pair.")] = Integrator.tsit5,
    certify: Annotated[
        bool, typer.Option("--certify", help="Also repeat it at a tighter tolerance (five times the time).")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Write the samples as HDF5.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with a run to the same output that was killed.")
    ] = False,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the report as one HTML file.")
    ] = None,
    json_file: JsonOption = None,
) -> None:
    """Simulate a coast-down to standstill: statistics, peaks with their time, whirl, energy.

    The machine needs a drag: speed.aero_linear and speed.aero_quadratic (torques as a function of speed) or
    speed.aero_time_constant in its file, or --drag-from with a recorded coast-down whose speed shows it. The
    linear and the quadratic part go to the air then, the dry part to the races. Only a race drag brings a
    rotor to standstill.

    With --output the samples go to disk second by second. A run that was stopped with Ctrl-C or killed goes
    on with --resume and the same values, to the same last bit.
    """
    from rotordrop.machine import load_machine
    from rotordrop.report.coast_down_page import coast_down_page
    from rotordrop.report.terminal import print_summary, summary_console
    from rotordrop.rotor.parameters import build_drop_model
    from rotordrop.simulate._coast_run import MOST_STEPS_PER_WINDOW
    from rotordrop.simulate.case import CentredStart, LevitatedStart
    from rotordrop.simulate.coast_down import simulate_coast_down
    from rotordrop.simulate.coast_down_case import CoastDownCase
    from rotordrop.simulate.expected_steps import long_run

    require_places(output, report, json_file)
    if resume and output is None:
        raise UsageError("--resume needs the --output of the run that was killed")
    described = load_machine(machine)
    if drag_from is not None:
        described = _with_recorded_drag(described, drag_from)
    case = CoastDownCase(
        speed=speed,
        duration=_end(until),
        rest=rest,
        output_step=output_step,
        tolerance=tolerance,
        reduction=reduction.value,
        start=LevitatedStart() if levitated else CentredStart(),
        integrator=integrator.value,
    )
    model = build_drop_model(described, case.reduction)
    warning = long_run(described, 1.0, MOST_STEPS_PER_WINDOW)
    if warning is not None:
        summary_console(sys.stderr).print(f"each second: {warning}", soft_wrap=True)
    with _resumable(output), progress_bar("coast-down") as progress:
        result = interruptible(
            lambda: simulate_coast_down(model, case, output=output, resume=resume, progress=progress)
        )
    assert result is not None
    certificate = _certificate(model, case, result) if certify else None
    numbers: dict[str, Any] = result.as_json()
    if report is not None:
        analysis = _write_report(described, result, certificate, report)
        numbers["frequencies"] = None if analysis is None else analysis.as_json()
    if certificate is not None:
        numbers["certificate"] = certificate.as_json()
    page = coast_down_page(result, described, certificate=certificate)
    deliver(numbers, json_file, lambda out: print_summary(page, out))


@contextmanager
def _resumable(output: Path | None) -> Iterator[None]:
    """Say how to go on after Ctrl-C."""
    try:
        yield
    except KeyboardInterrupt:
        if output is not None:
            console(sys.stderr).print(f"the part of {output} done so far is kept: go on with --resume")
        raise


def _end(text: str) -> float | None:
    from rotordrop.units import parse_quantity

    return None if text.strip() == STANDSTILL else parse_quantity(text, "time")


def _with_recorded_drag(machine: Machine, path: Path) -> Machine:
    """Drag as the recorded speed shows it: linear and quadratic from the air, dry from the races."""
    from rotordrop.estimate.recorded_coast_down import recorded_coast_down, with_recorded_drag
    from rotordrop.record.record import read_record

    return with_recorded_drag(machine, recorded_coast_down(machine, read_record(path, machine)))


def _certificate(model: Any, case: CoastDownCase, result: CoastDownResult) -> CoastDownCertificate:
    from rotordrop.simulate.coast_down_certificate import certify_coast_down

    with progress_bar("at a tighter tolerance") as progress:
        return certify_coast_down(model, case, result, progress=progress)


def _write_report(
    machine: Machine, result: CoastDownResult, certificate: CoastDownCertificate | None, report: Path
) -> CoastDownAnalysis | None:
    """Write the page; with samples on disk it also has waterfalls, lines and resonances, which are given."""
    from rotordrop.report.coast_down_page import coast_down_page
    from rotordrop.report.page import write_page

    analysis = None
    if result.path is not None:
        with progress_bar("frequencies") as progress:
            analysis = _analysis(machine, result.path, progress)
    write_page(coast_down_page(result, machine, analysis, certificate), report)
    return analysis


def _analysis(machine: Machine, path: Path, progress: Progress) -> CoastDownAnalysis:
    from rotordrop.estimate.simulated_coast_down import simulated_coast_down
    from rotordrop.spectrum.coast_down import analyse_coast_down
    from rotordrop.spectrum.machine_candidates import machine_candidates

    signal = simulated_coast_down(path, machine)
    return analyse_coast_down(
        signal, machine_candidates(machine, {name: name for name in signal.planes}), progress=progress
    )
