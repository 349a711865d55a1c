"""Make a profile of a recorder from one of its files.

Looks, guesses, asks for everything missing at once, and saves what every later reading needs.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotordrop.cli._output import console
from rotordrop.errors import RecordError, UsageError

if TYPE_CHECKING:
    from rotordrop.record.profile import Profile


def profile(
    record: Annotated[Path, typer.Argument(metavar="RECORD", help="A file of the recorder.")],
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="FILE", help="Profile to write, a .toml file.")
    ],
    machine: Annotated[
        Path | None, typer.Option("--machine", metavar="FILE", help="Machine whose sensors need a channel.")
    ] = None,
    channel: Annotated[
        list[str] | None,
        typer.Option(metavar="SENSOR=CHANNEL", help="Channel of a sensor of the machine; repeatable."),
    ] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of displacements that name none, um.")] = None,
    sensitivity: Annotated[str | None, typer.Option(help='Volts per length, "8 mV/um".')] = None,
    full_scale: Annotated[str | None, typer.Option(help='Full scale of a WAV file, "500 um".')] = None,
    speed: Annotated[str | None, typer.Option(help='Speed by hand, "60 Hz".')] = None,
    speed_channel: Annotated[str | None, typer.Option(help="Channel of the shaft speed.")] = None,
    speed_unit: Annotated[str | None, typer.Option(help="Its unit, rpm.")] = None,
    pulses: Annotated[str | None, typer.Option(help="Channel of tacho or keyphasor pulses.")] = None,
    pulses_per_turn: Annotated[int | None, typer.Option(min=1, help="Pulses per turn, 1.")] = None,
    edge: Annotated[str | None, typer.Option(help="Edge that counts, rising or falling.")] = None,
    time_step: Annotated[str | None, typer.Option(help='Sampling interval, "50 us".')] = None,
    time_start: Annotated[str | None, typer.Option(help='Time of the first sample, "-0.25 s".')] = None,
    names: Annotated[str | None, typer.Option(help="Names of the columns, commas between them.")] = None,
    file_format: Annotated[
        str | None, typer.Option("--format", help="Reader, where the suffix lies.")
    ] = None,
) -> None:
    """Make a profile of a recorder: what its files do not say themselves, said once."""
    from rotordrop.record.profile import save_profile
    from rotordrop.record.profile_guess import guess_profile
    from rotordrop.record.readers import read_recording

    given = _given(
        {
            "format": file_format,
            "channels": _pairs(channel or []),
            "unit": unit,
            "sensitivity": sensitivity,
            "full_scale": full_scale,
            "text": {"names": None if names is None else [name.strip() for name in names.split(",")]},
            "time": {"step": time_step, "start": time_start},
            "speed": {
                "constant": speed,
                "channel": speed_channel,
                "unit": speed_unit,
                "pulses": pulses,
                "pulses_per_turn": pulses_per_turn,
                "edge": edge,
            },
        }
    )
    sensors: Any = ()
    if machine is not None:
        from rotordrop.machine import load_machine

        sensors = load_machine(machine).sensors
    guess = guess_profile(read_recording(record, given), given, sensors)
    out = console()
    for line in guess.found:
        out.print(line)
    if guess.missing:
        raise RecordError(
            f"{record}: say what is missing:" + "".join(f"\n  {line}" for line in guess.missing)
        )
    save_profile(guess.profile, output)
    out.print(f"Profile: {output}")


def _given(entries: dict[str, Any]) -> Profile:
    from rotordrop.record.profile import profile_of

    return profile_of(
        {name: _known(entry) for name, entry in entries.items() if entry is not None}, "the options"
    )


def _known(entry: Any) -> Any:
    return {k: v for k, v in entry.items() if v is not None} if isinstance(entry, dict) else entry


def _pairs(texts: list[str]) -> dict[str, str]:
    found = {}
    for text in texts:
        sensor, equals, name = text.partition("=")
        if not equals:
            raise UsageError(f'{text!r} is not SENSOR=CHANNEL; write for example --channel "S_NDE_A=X1"')
        found[sensor.strip()] = name.strip()
    return found
