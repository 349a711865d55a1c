"""Simulate one drop from a machine file.

Prints peaks, contacts, how the computation ended and how far it can be trusted.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotordrop.cli._options import JsonOption, MachineArgument, quantity
from rotordrop.cli._output import deliver
from rotordrop.cli._start import start_of

if TYPE_CHECKING:
    from rotordrop.model.reduction import Reduction
    from rotordrop.simulation.case import DropCase
    from rotordrop.simulation.result import DropResult

_PLACE_HELP = 'Where the rotor starts at a bearing, x and y, such as "NDE: 10 um, -5 um"; with --start given.'


def simulate(
    machine: MachineArgument,
    speed: Annotated[
        float,
        typer.Option(parser=quantity("speed"), metavar="SPEED", help='Speed at power-off, such as "60 Hz".'),
    ],
    duration: Annotated[
        float, typer.Option(parser=quantity("time"), metavar="TIME", help="Length of the simulation.")
    ] = 0.2,
    start: Annotated[
        str,
        typer.Option(
            metavar="START",
            help="centred (at rest), levitated (AMBs, orbit, sag) or given (see --place and --velocity).",
        ),
    ] = "centred",
    place: Annotated[list[str] | None, typer.Option(metavar="PLACE", help=_PLACE_HELP)] = None,
    velocity: Annotated[
        list[str] | None,
        typer.Option(metavar="VELOCITY", help='Its velocity there, such as "NDE: 0 m/s, -2 mm/s".'),
    ] = None,
    reduction: Annotated[
        str, typer.Option(metavar="BASIS", help="Rotor basis: accurate, quick, full, or a number of modes.")
    ] = "accurate",
    tolerance: Annotated[float, typer.Option(metavar="NUMBER", help="Accuracy of a step.")] = 1e-6,
    certify: Annotated[
        bool,
        typer.Option(
            "--certify/--no-certify",
            help="Repeat with a tighter tolerance and more modes; say what moves (three times as long).",
        ),
    ] = True,
    output: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the histories as HDF5, readable as NetCDF4.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write an HTML page with the figures.")
    ] = None,
    json_file: JsonOption = None,
) -> None:
    """Simulate one drop: bearing forces, Hertz stress, contacts, and how exact they are."""
    from rotordrop.machine import load_machine
    from rotordrop.report.simulate_page import simulate_page
    from rotordrop.report.terminal import print_summary
    from rotordrop.simulation.case import DropCase
    from rotordrop.simulation.drop import simulate_drop

    described = load_machine(machine)
    case = DropCase(
        speed=speed,
        duration=duration,
        tolerance=tolerance,
        reduction=_reduction(reduction),
        start=start_of(start, described, place or [], velocity or []),
    )
    result = simulate_drop(described, case, certify=certify)
    if output is not None:
        result.save(output)
    content = simulate_page(result, described)
    if report is not None:
        from rotordrop.report.page import write_page

        write_page(content, report)
    written = [(name, path) for name, path in (("histories", output), ("report", report)) if path is not None]

    def summarise(out: Any) -> None:
        print_summary(content, out)
        for name, path in written:
            out.print(f"{name}: {path}")

    deliver(result_json(result, case), json_file, summarise)


def result_json(result: DropResult, case: DropCase) -> dict[str, Any]:
    """The numbers of a simulated drop, SI units in the names, ready for JSON."""
    from rotordrop.report.from_simulation import peak_stress

    bearings = {}
    for index, name in enumerate(result.bearing_names):
        force, stress = result.peak_force(index), peak_stress(result, index)
        log = result.contacts.of_bearing(index)
        bearings[name] = {
            "peak_force_N": {"value": force[0], "time_s": force[1]},
            "peak_stress_Pa": {"value": stress[0], "time_s": stress[1]},
            "mean_stress_Pa": {"value": float(result.max_stress[:, index].mean())},
            "contacts": [
                {"start_s": float(a), "end_s": float(b) if b == b else None, "peak_force_N": float(f)}
                for a, b, f in zip(log.start, log.end, log.peak_force, strict=True)
            ],
        }
    return {
        "machine": result.machine_name,
        "speed_Hz": result.initial_speed / 6.283185307179586,
        "duration_s": float(result.time[-1]),
        "start": type(case.start).__name__,
        "reduction": result.reduction,
        "tolerance": result.tolerance,
        "finished": result.finished,
        "outcome": result.outcome,
        "certificate": _certificate_json(result),
        "bearings": bearings,
    }


def _certificate_json(result: DropResult) -> dict[str, Any]:
    numbers = {name: value for name, value in vars(result.certificate).items() if value is not None}
    return {name: value.tolist() if hasattr(value, "tolist") else value for name, value in numbers.items()}


def _reduction(text: str) -> str | Reduction:
    if not text.isdigit():
        return text
    from rotordrop.model.reduction import Reduction

    return Reduction(modes=int(text), attachment=False)
