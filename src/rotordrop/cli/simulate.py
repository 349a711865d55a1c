"""Simulate a drop and show forces, stresses and contacts.

Starts centred, from given displacements and velocities, or levitated in the AMBs.
"""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotordrop.cli._interruption import interruptible
from rotordrop.cli._options import DataOption, JsonOption, MachineArgument, quantity
from rotordrop.cli._output import deliver, require_places
from rotordrop.cli._start import levitated_start, placed_start
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rotordrop.simulate.case import Start


class Reduction(StrEnum):
    """Presets of the reduction of the rotor."""

    accurate = "accurate"
    quick = "quick"
    full = "full"


class Spin(StrEnum):
    """What makes the speed fall."""

    dynamic = "dynamic"
    prescribed = "prescribed"
    coasting = "coasting"
    constant = "constant"


class Integrator(StrEnum):
    """Runge–Kutta pairs."""

    tsit5 = "tsit5"
    dp5 = "dp5"


def simulate(
    machine: MachineArgument,
    speed: Annotated[
        float, typer.Option(parser=quantity("speed"), metavar="SPEED", help='Speed at power-off, "60 Hz".')
    ],
    duration: Annotated[
        float,
        typer.Option(
            parser=quantity("time"), metavar="TIME", help="How long to simulate.", show_default="0.2 s"
        ),
    ] = 0.2,
    output_step: Annotated[
        float,
        typer.Option(
            parser=quantity("time"), metavar="TIME", help="Step of the histories.", show_default="10 us"
        ),
    ] = 1e-5,
    displacement: Annotated[
        list[str] | None,
        typer.Option(metavar="PLACE", help='Start displaced: "NDE: 10 um, -20 um" (horizontal, vertical).'),
    ] = None,
    velocity: Annotated[
        list[str] | None, typer.Option(metavar="PLACE", help='Start moving: "NDE: 0 mm/s, -5 mm/s".')
    ] = None,
    levitated: Annotated[
        bool, typer.Option("--levitated", help="Start floating in the AMBs: synchronous orbit and sag.")
    ] = False,
    rotor_angle: Annotated[
        float,
        typer.Option(
            parser=quantity("angle"), metavar="ANGLE", help="Levitated: rotor angle.", show_default="0 deg"
        ),
    ] = 0.0,
    delay: Annotated[
        float,
        typer.Option(
            parser=quantity("time"), metavar="TIME", help="Levitated: magnets hold on.", show_default="0 s"
        ),
    ] = 0.0,
    remanent_force: Annotated[
        list[str] | None,
        typer.Option(metavar="FORCE", help='Levitated: force left at power-off, "NDE: 0 N, 40 N".'),
    ] = None,
    remanence_time: Annotated[
        float,
        typer.Option(
            parser=quantity("time"), metavar="TIME", help="Levitated: its decay.", show_default="2 ms"
        ),
    ] = 2e-3,
    spin: Annotated[
        Spin, typer.Option(help="What brakes: drag and friction; a drag profile; friction alone; nothing.")
    ] = Spin.dynamic,
    reduction: Annotated[Reduction, typer.Option(help="Modes of the rotor.")] = Reduction.accurate,
    tolerance: Annotated[float, typer.Option(min=1e-12, max=1e-3, help="Accuracy of a step.")] = 1e-6,
    integrator: Annotated[Integrator, typer.Option(help="Runge–Kutta pair.")] = Integrator.tsit5,
    certify: Annotated[
        bool, typer.Option("--certify", help="Also measure the numerical error (three times the time).")
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write all histories as HDF5 (NetCDF4)."),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the report as one HTML file.")
    ] = None,
    data: DataOption = None,
    json_file: JsonOption = None,
) -> None:
    """Simulate a drop and show forces, stresses and contacts of every touchdown bearing."""
    from rotordrop.machine import load_machine
    from rotordrop.report.page import write_page
    from rotordrop.report.simulate_page import simulate_page
    from rotordrop.report.simulation_numbers import simulation_numbers
    from rotordrop.report.terminal import print_summary, summary_console
    from rotordrop.simulate.case import DropCase
    from rotordrop.simulate.drop import simulate_drop
    from rotordrop.simulate.expected_steps import long_run

    require_places(output, report, json_file)
    described = load_machine(machine)
    if levitated:
        if displacement or velocity:
            raise UsageError("--levitated cannot go with --displacement or --velocity; choose one start")
        start: Start = levitated_start(described, rotor_angle, delay, remanent_force or (), remanence_time)
    else:
        start = placed_start(described, displacement or (), velocity or ())
    case = DropCase(
        speed=speed,
        duration=duration,
        output_step=output_step,
        tolerance=tolerance,
        reduction=reduction.value,
        start=start,
        spin=spin.value,
        integrator=integrator.value,
    )
    warning = long_run(described, duration, case.most_steps)
    if warning is not None:
        summary_console(sys.stderr).print(warning, soft_wrap=True)
    result = interruptible(lambda: simulate_drop(described, case, certify=certify))
    page = simulate_page(result, described)
    if output is not None:
        result.save(output)
    if report is not None:
        write_page(page, report)
    if data is not None:
        from rotordrop.report.csv_files import write_data

        write_data(page, data)
    deliver(simulation_numbers(result), json_file, lambda out: print_summary(page, out))
