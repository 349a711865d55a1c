"""What ``rotordrop bearings`` says about bearings found by designation."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rotordrop.elements.catalog.boundary import clearance_range
from rotordrop.elements.catalog.lookup import CatalogueBearing
from rotordrop.report.content import Column, ReportContent, Statement, Table, table
from rotordrop.report.machine_content import named_values


def bearing_content(written: str, found: Sequence[CatalogueBearing]) -> ReportContent:
    """Put the bearings that a designation may mean into a report, the most likely one first."""
    others = found if found[0].listed else found[1:]
    columns = (
        Column("listed bearings of this size", lambda one: f"{one.maker} {one.designation}"),
        Column("angle", _angle),
        Column("balls", _balls),
        Column("preload light / medium / heavy", _forces),
        Column("balls are", lambda one: "published" if one.maker == "GMN" else "reconstructed"),
    )
    return ReportContent(
        title=f"Bearings: {written}",
        verdict=tuple(_statements(written, found[0])),
        summary=(_meant(found[0]), *((table(others, columns),) if others else ())),
    )


def bearing_json(bearing: CatalogueBearing) -> dict[str, object]:
    """Give a bearing ready for JSON, in SI units."""
    balls = bearing.complement
    return {
        "designation": bearing.designation,
        "maker": bearing.maker,
        "listed": bearing.listed,
        "kind": bearing.kind,
        "bore_m": bearing.bore,
        "outside_diameter_m": bearing.outside_diameter,
        "width_m": bearing.width,
        "contact_angle_rad": bearing.contact_angle,
        "contact_angle_range_rad": bearing.contact_angle_range,
        "ball_material": bearing.ball_material,
        "ball_count": balls.ball_count,
        "ball_count_range": balls.count_range,
        "ball_diameter_m": balls.ball_diameter,
        "ball_diameter_range_m": balls.diameter_range,
        "pitch_diameter_m": balls.pitch_diameter,
        "conformity": balls.conformity,
        "conformity_range": balls.conformity_range,
        "basis": balls.basis,
        "clearance_range_m": clearance_of(bearing),
        "preload_N": bearing.preload,
        "preload_basis": bearing.preload_basis or None,
        "axial_rigidity_N_per_m": bearing.axial_rigidity,
    }


def clearance_of(bearing: CatalogueBearing) -> tuple[float, float] | None:
    """Radial clearance [m] of the class that a deep-groove designation names, CN where it names none."""
    if bearing.kind != "deep groove" or bearing.read is None:
        return None
    return clearance_range(bearing.read.clearance_class or "CN", bearing.bore)


def _statements(written: str, first: CatalogueBearing) -> list[Statement]:
    balls = first.complement
    if first.listed:
        text = f"{written} is listed: {first.maker} {first.designation}. Balls: {balls.basis}"
        said = [Statement(text, "good")]
    else:
        said = [Statement(f"no list in the catalogue has {written}: size by ISO 15, balls {balls.basis}")]
    if first.contact_angle_range is not None:
        low, high = (math.degrees(angle) for angle in first.contact_angle_range)
        text = f"{written} does not say its contact angle: {low:.0f}° to {high:.0f}° are usual; give it"
        said.append(Statement(text, "warning"))
    if not first.preload and first.kind == "angular contact":
        text = "no bearing of this size is listed, so no preload is known; give it as a force"
        said.append(Statement(text, "warning"))
    elif first.preload_basis:
        said.append(Statement(f"the preload is {first.preload_basis}"))
    return said


def _meant(bearing: CatalogueBearing) -> Table:
    balls, play = bearing.complement, clearance_of(bearing)
    width = "" if bearing.width is None else f" × {1e3 * bearing.width:g}"
    rows: list[tuple[str, object]] = [
        ("bore × outside × width", f"{1e3 * bearing.bore:g} × {1e3 * bearing.outside_diameter:g}{width} mm"),
        ("kind", bearing.kind),
        ("balls per row", _with_range(balls.ball_count, balls.count_range, "")),
        ("ball diameter", _with_range(1e3 * balls.ball_diameter, _scaled(balls.diameter_range, 1e3), " mm")),
        ("pitch diameter", f"{1e3 * balls.pitch_diameter:.4g} mm"),
        ("conformity", _with_range(balls.conformity, balls.conformity_range, "")),
        ("ball material", bearing.ball_material),
    ]
    if bearing.kind == "angular contact":
        rows.insert(2, ("contact angle", _angle(bearing)))
        rows.append(("preload light / medium / heavy", _forces(bearing)))
    if play is not None:
        rows.append(("radial clearance", f"{1e6 * play[0]:.0f} to {1e6 * play[1]:.0f} µm"))
    return named_values(bearing.designation, rows)


def _with_range(value: float, bounds: tuple[float, float] | None, unit: str) -> str:
    known = "" if bounds is None else f" (inferred, 90 %: {bounds[0]:.4g} to {bounds[1]:.4g})"
    return f"{value:.4g}{unit}{known}"


def _scaled(bounds: tuple[float, float] | None, factor: float) -> tuple[float, float] | None:
    return None if bounds is None else (factor * bounds[0], factor * bounds[1])


def _angle(bearing: CatalogueBearing) -> str:
    bounds = _scaled(bearing.contact_angle_range, 180.0 / math.pi)
    known = "" if bounds is None else f" (not said; {bounds[0]:.0f}° to {bounds[1]:.0f}°)"
    return f"{math.degrees(bearing.contact_angle):.0f}°{known}"


def _forces(bearing: CatalogueBearing) -> str:
    forces = [f"{force:.3g}" if force < 1000.0 else f"{force:.0f}" for force in bearing.preload.values()]
    return f"{' / '.join(forces)} N" if forces else "not known"


def _balls(bearing: CatalogueBearing) -> str:
    balls = bearing.complement
    material = "" if bearing.ball_material == "steel" else f", {bearing.ball_material}"
    return f"{balls.ball_count} × {1e3 * balls.ball_diameter:.4g} mm{material}"
