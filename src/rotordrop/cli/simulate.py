"""Simulate a drop or a whole coast-down."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

from typer import Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import file_option, measured, text_option
from rotordrop.cli._output import console, deliver, progress_bar
from rotordrop.errors import UsageError
from rotordrop.interrupts import interruptible
from rotordrop.units import parse_quantity

STANDSTILL = "standstill"


def simulate(
    machine: options.Machine,
    speed: options.PowerOffSpeed,
    duration: Annotated[float, measured("time", "How long to simulate.", "0.2 s")] = 0.2,
    output_step: Annotated[float, measured("time", "Step of the histories.", "10 us")] = 1e-5,
    levitated: options.Levitated = False,
    stays_on: Annotated[
        list[str] | None,
        text_option("AMB", 'Magnet that stays on, "NDE" (one end falls).'),
    ] = None,
    magnets: Annotated[
        list[str] | None,
        text_option(
            "EVENT",
            'Magnets with their controllers: "20 ms: off", "speed 50 Hz: levitate", "rest: levitate", '
            '"0 s: lost NDE x".',
        ),
    ] = None,
    reduction: options.ReductionChoice = options.Reduction.accurate,
    tolerance: options.Tolerance = 1e-6,
    certify: Annotated[
        bool, Option("--certify", help="Also measure the numerical error (three times the time).")
    ] = False,
    output: Annotated[
        Path | None, file_option("--output", "Write all histories as HDF5 (NetCDF4).", "-o")
    ] = None,
    report: options.Report = None,
    json: options.Json = None,
) -> None:
    """Simulate a drop and show forces, stresses and contacts of every touchdown bearing.

    Example: rotordrop simulate machine.toml --speed "60 Hz" --report drop.html
    """
    from rotordrop.estimate.simulated_drop import simulation_numbers
    from rotordrop.machine import load_machine
    from rotordrop.report.simulate_page import simulate_summary
    from rotordrop.simulate.case import CentredStart, DropCase, LevitatedStart, MagnetEvent
    from rotordrop.simulate.drop import model_for, simulate_drop
    from rotordrop.simulate.expected_steps import long_run

    if stays_on and magnets:
        raise UsageError(
            "--stays-on has the spring and damper of a magnet and cannot go with --magnets, which follow "
            "its control loop; choose one"
        )
    described = load_machine(machine).with_magnets_on(stays_on or ())
    case = DropCase(
        speed=speed,
        duration=duration,
        output_step=output_step,
        tolerance=tolerance,
        reduction=reduction.value,
        start=LevitatedStart() if levitated else CentredStart(),
        magnets=tuple(map(MagnetEvent.read, magnets)) if magnets else None,
    )
    warning = long_run(described, duration, case.most_steps)
    if warning is not None:
        console(sys.stderr).print(warning, soft_wrap=True)
    model = interruptible(lambda: model_for(described, case))
    result = interruptible(lambda: simulate_drop(model, case, certify=certify))
    if output is not None:
        result.save(output)
    if report is None:
        said = simulate_summary(result, described)  # draws nothing: plotly takes half a second to load
    else:
        from rotordrop.report.simulate_page import simulate_page

        said = simulate_page(result, described)
    deliver(simulation_numbers(result, described), json, said, report=report, written=[output])
    result.check_finished()


def coast_down(
    machine: options.Machine,
    speed: options.PowerOffSpeed,
    until: Annotated[str, Option(metavar="END", help='"standstill", or a time such as "20 s".')] = STANDSTILL,
    drag_from: Annotated[
        Path | None, text_option("RECORD", "Take the drag from the speed of a recorded coast-down.")
    ] = None,
    output_step: Annotated[float, measured("time", "Step of the samples.", "50 us")] = 5e-5,
    levitated: options.Levitated = False,
    reduction: options.ReductionChoice = options.Reduction.quick,
    tolerance: options.Tolerance = 1e-6,
    certify: Annotated[
        bool, Option("--certify", help="Also repeat it at a tighter tolerance (five times the time).")
    ] = False,
    output: Annotated[Path | None, file_option("--output", "Write the samples as HDF5.", "-o")] = None,
    resume: Annotated[
        bool, Option("--resume", help="Go on with a run to the same output that was killed.")
    ] = False,
    report: options.Report = None,
    json: options.Json = None,
) -> None:
    """Simulate a coast-down to standstill: statistics, peaks with their time, whirl, energy.

    The machine needs a drag: speed.aero_linear and speed.aero_quadratic (torques as a function of speed) or
    speed.aero_time_constant in its file, or --drag-from with a recorded coast-down whose speed shows it. The
    linear and the quadratic part go to the air then, the dry part to the races. Only a race drag brings a
    rotor to standstill.

    With --output the samples go to disk second by second. A run that was stopped with Ctrl-C or killed goes
    on with --resume and the same values, to the same last bit.

    Example: rotordrop coast-down machine.toml --speed "60 Hz" --report coast.html
    """
    from rotordrop.estimate.coast_down import recorded_coast_down, waterfall, with_recorded_drag
    from rotordrop.machine import load_machine
    from rotordrop.record.record import read_record
    from rotordrop.report.simulate_page import coast_down_page
    from rotordrop.rotor.parameters import build_drop_model
    from rotordrop.simulate.case import CentredStart, CoastDownCase, LevitatedStart
    from rotordrop.simulate.coast_down import MOST_STEPS_PER_WINDOW, simulate_coast_down
    from rotordrop.simulate.coast_down_certificate import certify_coast_down
    from rotordrop.simulate.expected_steps import long_run

    if resume and output is None:
        raise UsageError("--resume needs the --output of the run that was killed")
    described = load_machine(machine)
    if drag_from is not None:
        recorded = recorded_coast_down(described, read_record(drag_from, described))
        described = with_recorded_drag(described, recorded)
    case = CoastDownCase(
        speed=speed,
        duration=None if until.strip() == STANDSTILL else parse_quantity(until, "time"),
        output_step=output_step,
        tolerance=tolerance,
        reduction=reduction.value,
        start=LevitatedStart() if levitated else CentredStart(),
    )
    model = build_drop_model(described, case.reduction)
    warning = long_run(described, 1.0, MOST_STEPS_PER_WINDOW)
    if warning is not None:
        console(sys.stderr).print(f"each second: {warning}", soft_wrap=True)
    try:
        with progress_bar("coast-down") as progress:
            result = interruptible(
                lambda: simulate_coast_down(model, case, output=output, resume=resume, progress=progress)
            )
    except KeyboardInterrupt:
        if output is not None:
            console(sys.stderr).print(f"the part of {output} done so far is kept: go on with --resume")
        raise
    certificate = None
    if certify and result.finished:
        with progress_bar("at a tighter tolerance") as progress:
            certificate = certify_coast_down(model, case, result, progress=progress)
    numbers: dict[str, Any] = result.as_json()
    analysis = None
    if report is not None:
        # with samples on disk the page also has waterfalls, lines and resonances
        analysis = None if result.path is None else waterfall(described, result.path)
        numbers["frequencies"] = None if analysis is None else analysis.as_json()
    if certificate is not None:
        numbers["certificate"] = certificate.as_json()
    page = coast_down_page(result, described, analysis, certificate)
    deliver(numbers, json, page, report=report, written=[output])
    result.check_finished()
