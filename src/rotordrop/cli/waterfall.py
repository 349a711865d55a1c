"""Name the frequencies of a recorded or simulated coast-down.

Waterfalls as in the paper, orders without smear, lines with names, resonances, displacement, speed law.
"""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rotordrop.cli._options import DataOption, JsonOption, MachineArgument, quantity
from rotordrop.cli._output import deliver, progress_bar, require_places
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rotordrop.machine import Machine
    from rotordrop.spectrum.coast_down import CoastDownSignal


class Direction(StrEnum):
    """What of the displacement is transformed."""

    x = "x"
    y = "y"
    full = "full"


class Amplitude(StrEnum):
    """How amplitudes are given."""

    zero_to_peak = "zero-to-peak"
    peak_to_peak = "peak-to-peak"


class Against(StrEnum):
    """What goes upwards in a waterfall."""

    time = "time"
    speed = "speed"


def waterfall(
    machine: MachineArgument,
    record: Annotated[
        Path, typer.Argument(metavar="RECORD", help="Recorded coast-down, or one from 'coast-down --output'.")
    ],
    component: Annotated[
        list[Direction] | None, typer.Option(help="Direction, or forward and backward; all when left out.")
    ] = None,
    amplitude: Annotated[Amplitude, typer.Option(help="Amplitudes of the waterfalls.")] = (
        Amplitude.zero_to_peak
    ),
    against: Annotated[Against, typer.Option(help="What goes upwards.")] = Against.time,
    points: Annotated[int, typer.Option(min=16, help="Samples per frame; the paper's by default.")] = 32768,
    overlap: Annotated[float, typer.Option(min=0.0, max=0.95, help="Share used again.")] = 0.5,
    highest: Annotated[
        float | None,
        typer.Option(
            parser=quantity("frequency"),
            metavar="FREQUENCY",
            help="Highest frequency drawn; as far as anything happens when left out.",
        ),
    ] = None,
    profile: Annotated[Path | None, typer.Option(metavar="FILE", help="Channel map of the recorder.")] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Write waterfalls, envelopes, orders and speed as HDF5.",
        ),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the report as one HTML file.")
    ] = None,
    data: DataOption = None,
    json_file: JsonOption = None,
) -> None:
    """Find and name the frequencies of a coast-down, and say whether 0.2 s held the maximum."""
    from rotordrop.estimate.recorded_coast_down import with_found_air_gaps
    from rotordrop.machine import load_machine
    from rotordrop.report.origin import origin_here
    from rotordrop.report.page import write_page
    from rotordrop.report.terminal import print_summary
    from rotordrop.report.waterfall_page import waterfall_page
    from rotordrop.spectrum.coast_down import WaterfallChoice, analyse_coast_down
    from rotordrop.spectrum.findings_file import write_findings
    from rotordrop.spectrum.machine_candidates import machine_candidates
    from rotordrop.spectrum.waterfall import WaterfallSettings

    require_places(output, report, json_file)
    described = load_machine(machine)
    signal, simulated = _signal(described, record, profile)
    if against is Against.speed and signal.profile is None:
        raise UsageError(f"--against speed: {record} has no rotor speed; use --against time")
    choice = WaterfallChoice(
        components=tuple(direction.value for direction in component or tuple(Direction)),
        amplitude_kind=amplitude.value,
        highest_frequency=highest or WaterfallChoice().highest_frequency,
        settings=WaterfallSettings(points=points, overlap=overlap),
    )
    candidates = machine_candidates(
        with_found_air_gaps(described, signal), {name: name for name in signal.planes}
    )
    with progress_bar("frequencies") as progress:
        found = analyse_coast_down(signal, candidates, choice, progress=progress)
    page = waterfall_page(
        found,
        title=f"Frequencies of a coast-down of {described.name}",
        facts=(
            ("machine", f"{described.name} ({machine.name})"),
            ("record", record.name),
            ("centre of the bearings", signal.centre),
            *origin_here(sys.argv[1:], [("machine file", machine), ("record", record)]).facts(),
        ),
        simulated=simulated,
        against=against.value,
        highest=highest,
    )
    if output is not None:
        write_findings(found, output)
    if report is not None:
        write_page(page, report)
    if data is not None:
        from rotordrop.report.csv_files import write_data

        write_data(page, data)
    deliver(found.as_json(), json_file, lambda out: print_summary(page, out))


def _signal(machine: Machine, path: Path, profile: Path | None) -> tuple[CoastDownSignal, str]:
    """Open a recording or a simulated file, with the sentence that says it is simulated."""
    from rotordrop.estimate.recorded_coast_down import recorded_coast_down
    from rotordrop.estimate.simulated_coast_down import simulated_coast_down
    from rotordrop.record.record import read_record
    from rotordrop.record.simulated import is_simulated
    from rotordrop.report.content import SIMULATED_RECORD
    from rotordrop.simulate.coast_down_file import is_coast_down

    if is_coast_down(path):
        text = "Everything on this page is computed from the machine description; nothing was measured."
        return simulated_coast_down(path, machine), text
    record = read_record(path, machine, profile=profile)
    return recorded_coast_down(machine, record), SIMULATED_RECORD if is_simulated(record) else ""
