"""See a record: look at it, name its channels, measure the gap with a lift check, find its frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

from rotordrop.cli import _options as options
from rotordrop.cli._options import file_option, measured, refuse_beside, text_option
from rotordrop.cli._output import console, deliver, progress_bar, require_places
from rotordrop.errors import RecordError, UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.machine import Machine


def look(
    files: Annotated[
        list[Path],
        Argument(
            metavar="[MACHINE] RECORD",
            help="Recorded drop, and its machine description, a .toml file, if there is one.",
            show_default=False,
        ),
    ],
    gap: Annotated[float | None, measured("length", 'Radial air gap, "250 um".')] = None,
    speed: Annotated[float | None, measured("speed", 'Speed at the drop, "9000 rpm".')] = None,
    mapping: options.Planes = None,
    profile: options.Profile = None,
    split: Annotated[
        Path | None,
        Option(
            metavar="FOLDER",
            help="Write one record for each of several drops there, as HDF5, and look no further.",
            file_okay=False,
        ),
    ] = None,
    report: options.Report = None,
    json: options.Json = None,
) -> None:
    """Look at a recorded drop: what was read, its quality, what happened when, impacts, whirl, indices.

    Example: rotordrop look record.csv --report look.html
    """
    if len(files) > 2:
        raise UsageError(f"look takes one record and its machine file, and {len(files)} files are given")
    if len(files) == 2 and all(file.suffix.lower() not in ("", ".toml") for file in files):
        told = " and ".join(str(file) for file in files)
        raise UsageError(f"look takes one record and its machine file (.toml), and {told} are two records")
    *first, record = options.machine_first(*files)
    machine = first[0] if first else None
    if split is not None:
        refuse_beside("--split", {"--gap": gap, "--speed": speed, "--report": report, "--json": json})
        if machine is None:
            raise UsageError(
                "--split needs the machine file too: rotordrop look machine.toml both.h5 --split parts"
            )
    described = _loaded(machine)
    if split is not None and described is not None:
        _split(record, described, split, mapping or (), profile)
        return
    from rotordrop.evidence.look import look as look_at
    from rotordrop.report.look_page import look_page

    seen = look_at(record, machine=described, gap=gap, speed=speed, mapping=mapping or (), profile=profile)
    drawn = None if report is None else look_page(seen, described)
    deliver(seen.as_json(), json, look_page(seen, drawn=False), report=report, drawn=drawn)


def _loaded(machine: Path | None) -> Machine | None:
    if machine is None:
        return None
    from rotordrop.machine import load_machine  # half a second that a look alone does not need

    return load_machine(machine)


def _split(
    record: Path, machine: Machine, folder: Path, mapping: Sequence[str], profile: Path | None
) -> None:
    """Cut a recording with several drops into one record for each; no sample is changed."""
    from rotordrop.evidence.paths import split_drops
    from rotordrop.files import make_folder
    from rotordrop.record.record import read_record, save_record

    parts = split_drops(read_record(record, machine, profile=profile, mapping=mapping))
    places = [folder / f"{part.name}.h5" for part in parts]
    if len(parts) == 1:
        console().print(f"{record} holds one drop; nothing to split.")
        return
    make_folder(folder)
    require_places(*places)
    for part, place in zip(parts, places, strict=True):
        save_record(part, place)
        console().print(f"{place}: {part.time[0]:.6g} to {part.time[-1]:.6g} s, {len(part.time)} samples")


def profile(
    record: Annotated[Path, Argument(metavar="RECORD", help="A file of the recorder.")],
    output: Annotated[Path, file_option("--output", "Profile to write, a .toml file.", "-o")],
    machine: Annotated[Path | None, file_option("--machine", "Machine whose sensors need a channel.")] = None,
    mapping: options.Planes = None,
    profile: Annotated[Path | None, file_option("--profile", "Profile to begin with.")] = None,
    unit: Annotated[str | None, text_option("TEXT", "Unit of displacements that name none, um.")] = None,
    sensitivity: Annotated[str | None, text_option("TEXT", 'Volts per length, "8 mV/um".')] = None,
    full_scale: Annotated[str | None, text_option("TEXT", 'Full scale of a WAV file, "500 um".')] = None,
    speed: Annotated[str | None, text_option("TEXT", 'Speed by hand, "60 Hz".')] = None,
    speed_channel: Annotated[str | None, text_option("TEXT", "Channel of the shaft speed.")] = None,
    pulses: Annotated[str | None, text_option("TEXT", "Channel of tacho or keyphasor pulses.")] = None,
) -> None:
    """Make a profile of a recorder: what its files do not say themselves, said once.

    Example: rotordrop profile record.csv -o record.profile.toml
    """
    from rotordrop.evidence.unsaid import guess_profile
    from rotordrop.record.profile import OPTIONS, profile_of, rules_of, save_profile
    from rotordrop.record.readers import read_recording

    def with_stated(entries: dict[str, Any], **said: object) -> dict[str, Any]:
        return entries | {name: value for name, value in said.items() if value is not None}

    begun = rules_of(profile).model_dump(exclude_defaults=True)
    turning = with_stated(begun.get("speed", {}), constant=speed, channel=speed_channel, pulses=pulses)
    whole = with_stated(begun, unit=unit, sensitivity=sensitivity, full_scale=full_scale, speed=turning)
    given = rules_of(profile_of(whole, OPTIONS), mapping or [])
    described = _loaded(machine)
    guess = guess_profile(
        read_recording(record, given), given, () if described is None else described.sensors
    )
    out = console()
    for line in guess.found:
        out.print(line)
    if guess.missing:
        raise RecordError(
            f"{record}: say what is missing:" + "".join(f"\n  {line}" for line in guess.missing)
        )
    save_profile(guess.profile, output)
    out.print(f"Profile: {output}")


def clearance(
    before: Annotated[Path, Argument(metavar="RECORD", help="Recorded lift check.", show_default=False)],
    after: Annotated[
        Path | None, Argument(metavar="[AFTER]", help="A later one; its growth is the wear.")
    ] = None,
    machine: Annotated[Path | None, file_option("--machine", "Machine description with the sensors.")] = None,
    output: Annotated[
        Path | None, file_option("--output", "Write the machine file with the measured gaps.", "-o")
    ] = None,
    mapping: options.Planes = None,
    profile: options.Profile = None,
    json: options.Json = None,
) -> None:
    """Measure the air gap of every touchdown bearing by a lift check, and its wear by two.

    Example: rotordrop clearance lift.csv --machine machine.toml -o measured.toml
    """
    from rotordrop.evidence.clearance import measure_clearance, wear_between, with_measured_gaps
    from rotordrop.machine.saving import save_machine

    if output is not None and machine is None:
        raise UsageError("--output writes a machine file with the measured gaps; give --machine too")
    described = _loaded(machine)
    paths = [before] if after is None else [before, after]
    checks = [
        measure_clearance(path, machine=described, mapping=mapping or (), profile=profile) for path in paths
    ]
    wear = wear_between(*checks) if after is not None else ()
    if output is not None and described is not None:
        save_machine(with_measured_gaps(described, checks[-1], f"lift check {paths[-1].name}"), output)
    content: dict[str, Any] = {"clearances": [found.as_json() for found in checks[-1]]}
    if wear:
        content["earlier"] = [found.as_json() for found in checks[0]]
        content["wear"] = [found.as_json() for found in wear]

    def summarise(out: Console) -> None:
        for said in (*(one.sentence() for one in checks[-1]), *(one.sentence() for one in wear)):
            out.print(said)
        if not any(found.sag for found in checks[-1]):
            out.print(
                "The gain of the sensors comes on top: an error of 1 % is 1 % of the gap. What the bearing "
                "gives way to the push counts to the gap; --machine takes both into account."
            )
        if output is not None:
            out.print(f"Machine file with the measured gaps: {output}")

    deliver(content, json, summarise)


class Direction(StrEnum):
    """What of the displacement is transformed."""

    x = "x"
    y = "y"
    full = "full"


Amplitude = StrEnum("Amplitude", {"zero_to_peak": "zero-to-peak", "peak_to_peak": "peak-to-peak"})
"""How amplitudes are given."""
Against = StrEnum("Against", ["time", "speed"])
"""What goes upwards in a waterfall."""


def waterfall(
    machine: options.Machine,
    record: Annotated[
        Path, Argument(metavar="RECORD", help="Recorded coast-down, or one from 'coast-down --output'.")
    ],
    component: Annotated[
        list[Direction] | None, Option(help="Direction, or forward and backward; all when left out.")
    ] = None,
    amplitude: Annotated[Amplitude, Option(help="Amplitudes of the waterfalls.")] = Amplitude.zero_to_peak,
    against: Annotated[Against, Option(help="What goes upwards.")] = Against.time,
    points: Annotated[
        int | None,
        Option(min=16, metavar="N", help="Samples per frame; the paper's 32768, less in a short record."),
    ] = None,
    mapping: options.Planes = None,
    profile: options.Profile = None,
    output: Annotated[
        Path | None, file_option("--output", "Write waterfalls, envelopes, orders and speed as HDF5.", "-o")
    ] = None,
    report: options.Report = None,
    json: options.Json = None,
) -> None:
    """Find and name the frequencies of a coast-down, and say whether 0.2 s held the maximum.

    Example: rotordrop waterfall machine.toml coastdown.h5 --report waterfall.html
    """
    from rotordrop.estimate.coast_down import waterfall as analyse
    from rotordrop.machine import load_machine
    from rotordrop.record.record import Record, read_record
    from rotordrop.simulate.coast_down_file import is_coast_down
    from rotordrop.spectrum.coast_down import WaterfallChoice, write_findings

    machine, record = options.machine_first(machine, record)
    described = load_machine(machine)
    read: Path | Record = record
    if not is_coast_down(record):
        read = read_record(record, described, profile=profile, mapping=mapping or ())
    choice = WaterfallChoice(
        components=tuple(direction.value for direction in component or tuple(Direction)),
        amplitude_kind=amplitude.value,
        points=points,
    )
    with progress_bar("frequencies") as progress:
        found = analyse(described, read, choice, progress=progress)
    if against is Against.speed and found.signal.profile is None:
        raise UsageError(f"--against speed: {record} has no rotor speed; use --against time")
    from rotordrop.report.content import SIMULATED_MACHINE, SIMULATED_RECORD
    from rotordrop.report.origin import machine_facts
    from rotordrop.report.waterfall_page import waterfall_page

    said = SIMULATED_RECORD if isinstance(read, Record) else SIMULATED_MACHINE
    simulated = "" if isinstance(read, Record) and not read.is_simulated else said
    page = waterfall_page(
        found,
        title=f"Frequencies of a coast-down of {described.name}",
        facts=(
            *machine_facts(described),
            ("centre of the bearings", found.signal.centre),
        ),
        simulated=simulated,
        against=against.value,
        drawn=report is not None,
    )
    if output is not None:
        write_findings(found, output)
    content = {"simulated_record": bool(simulated), **found.as_json()}
    deliver(content, json, page, report=report, written=[output])
