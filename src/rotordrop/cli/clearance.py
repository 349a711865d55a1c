"""Measure the air gap: a shaft pushed round its bearings.

Circle and polygon per bearing, gap with interval, and wear by the difference of two checks.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotordrop.cli._options import JsonOption, PlanesOption, ProfileOption
from rotordrop.cli._output import deliver
from rotordrop.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from rotordrop.evidence.clearance import Clearance, Wear
    from rotordrop.machine import Machine


def clearance(
    before: Annotated[
        Path, typer.Argument(metavar="RECORD", help="Recorded lift check.", show_default=False)
    ],
    after: Annotated[
        Path | None, typer.Argument(metavar="[AFTER]", help="A later one; its growth is the wear.")
    ] = None,
    machine: Annotated[
        Path | None, typer.Option("--machine", metavar="FILE", help="Machine description with the sensors.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write the machine file with the measured gaps."),
    ] = None,
    mapping: PlanesOption = None,
    profile: ProfileOption = None,
    json: JsonOption = None,
) -> None:
    """Measure the air gap of every touchdown bearing by a lift check, and its wear by two."""
    from rotordrop.evidence.clearance import measure_clearance, wear_between

    described = _described(machine, output)
    checks = [
        measure_clearance(path, machine=described, mapping=mapping or (), profile=profile)
        for path in (before, after)
        if path is not None
    ]
    wear = wear_between(checks[0], checks[1]) if len(checks) > 1 else ()
    if output is not None and described is not None:
        _save(described, checks[-1], (after or before).name, output)
    content: dict[str, Any] = {"clearances": [found.as_json() for found in checks[-1]]}
    if wear:
        content |= {
            "earlier": [found.as_json() for found in checks[0]],
            "wear": [found.as_json() for found in wear],
        }
    deliver(content, json, lambda out: _summary(checks[-1], wear, output, out))


def _described(machine: Path | None, output: Path | None) -> Machine | None:
    if machine is None:
        if output is not None:
            raise UsageError("--output writes a machine file with the measured gaps; give --machine too")
        return None
    from rotordrop.machine import load_machine

    return load_machine(machine)


def _save(machine: Machine, found: tuple[Clearance, ...], source: str, output: Path) -> None:
    from rotordrop.known import Known
    from rotordrop.machine import save_machine

    values = {
        f"{clearance.bearing}.air_gap": Known(
            value=clearance.gap,
            status="estimated",
            interval_90=clearance.interval_90,
            standard_error=clearance.standard_error,
            source=f"lift check {source}",
            unit="m",
        )
        for clearance in found
    }
    save_machine(machine.with_values(values), output)


def _summary(found: tuple[Clearance, ...], wear: tuple[Wear, ...], output: Path | None, out: Console) -> None:
    for clearance in found:
        low, high = (1e6 * limit for limit in clearance.interval_90)
        x, y = 1e6 * clearance.centre
        out.print(
            f"{clearance.bearing}: air gap {1e6 * clearance.gap:.1f} µm (90 %: {low:.1f} to {high:.1f} µm), "
            f"centre at x = {x:+.1f} µm, y = {y:+.1f} µm, {len(clearance.polygon)} directions, "
            f"out of round by {1e6 * clearance.out_of_round:.1f} µm"
        )
    for change in wear:
        low, high = (1e6 * limit for limit in change.interval_90)
        told = "" if low <= 0.0 <= high else "; it has worn" if change.growth > 0 else "; it has shrunk"
        span = f"{low:+.1f} to {high:+.1f} µm"
        out.print(f"{change.bearing}: grown by {1e6 * change.growth:+.1f} µm (90 %: {span}){told}")
    out.print("The gain of the sensors comes on top: an error of 1 % is 1 % of the gap.")
    if output is not None:
        out.print(f"Machine file with the measured gaps: {output}")
