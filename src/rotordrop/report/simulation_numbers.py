"""The numbers of a simulated drop, ready for JSON, under the names an estimate uses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop.estimate.bearing_drop import published_bearing, simulated_bearings
from rotordrop.report.simulate_summary import landing_count
from rotordrop.simulate.clearances import clearance_uses
from rotordrop.simulate.landing import Landing, landings
from rotordrop.simulate.magnets import MagnetHistory
from rotordrop.simulate.result import DropResult
from rotordrop.simulate.ribbons import ribbon_uses

if TYPE_CHECKING:
    from rotordrop.machine import Machine


def simulation_numbers(result: DropResult, machine: Machine | None = None) -> dict[str, Any]:
    """Give the numbers of a simulated drop: SI values under the names of the estimate's schema.

    The machine that was simulated gives the use of its clearances.
    """
    certificate, bearings = result.certificate, {}
    parts: dict[str, Any] = {
        "tolerance": result.tolerance,
        "reduction": result.reduction,
        "energy_residual_J": certificate.energy_residual,
        "energy_scale_J": certificate.energy_scale,
    }
    for name in ("peak_change_tolerance", "peak_change_truncation"):
        change = getattr(certificate, name)
        if change is not None:
            parts[name] = [float(value) for value in change]
    for index, one in enumerate(simulated_bearings(result)):
        pressure, half_width, moment = result.peak_contact_pressure(index)
        bearings[one.name] = {
            **published_bearing(one).as_json(),
            "peak_contact_pressure_Pa": {"value": pressure, "time_s": moment},
            "contact_half_width_m": {"value": half_width},
        }
    numbers: dict[str, Any] = {
        "machine": result.machine_name,
        "method": "simulation",
        "speed_Hz": result.initial_speed / (2 * math.pi),
        "final_speed_Hz": float(result.speed[-1]) / (2 * math.pi),
        "duration_s": float(result.time[-1]),
        "outcome": result.outcome,
        "finished": result.finished,
        "certificate": parts,
        "bearings": bearings,
    }
    for use in () if machine is None else clearance_uses(machine, result):
        entry = {
            "node": use.node,
            "gap_m": use.gap,
            "largest_travel_m": use.travel,
            "travel_over_gap": use.share,
            "time_s": use.time,
        }
        if use.contacts is not None:
            entry |= {"contacts": len(use.contacts), "peak_force_N": use.peak_force}
            entry |= {"first_contact_s": float(use.contacts.start[0])} if len(use.contacts) else {}
        numbers.setdefault("stops" if use.stop else "clearances", {})[use.name] = entry
    for ribbon in () if machine is None else ribbon_uses(machine, result):
        numbers.setdefault("ribbons", {})[ribbon.name] = {
            "slip_force_N": ribbon.slip_force,
            "peak_force_N": {"value": ribbon.peak_force, "time_s": ribbon.peak_time},
            "slipped_s": ribbon.slipped,
            "first_slip_s": ribbon.first_slip if math.isfinite(ribbon.first_slip) else None,
            "dissipated_J": ribbon.dissipated,
        }
    if machine is not None and machine.axial:
        latest = int(np.argmax(np.abs(result.axial_displacement)))
        numbers["axial"] = {
            "largest_travel_m": float(abs(result.axial_displacement[latest])),
            "time_s": float(result.time[latest]),
            "faces": {one.name: _landed(one) for one in landings(machine, result)},
        }
    if result.heat is not None:
        numbers["heat"] = result.heat.as_json(result.bearing_names)
    if result.magnets is not None:
        numbers["magnets"] = _magnets(result, result.magnets)
    return numbers


def _magnets(result: DropResult, magnets: MagnetHistory) -> dict[str, Any]:
    events = zip(magnets.events, magnets.event_time.tolist(), strict=True)
    known: dict[str, Any] = {
        "events": [{"what": what, "time_s": time if math.isfinite(time) else None} for what, time in events],
        "largest_current_A": dict(
            zip(magnets.names, np.max(magnets.current, axis=(0, 2, 3)).tolist(), strict=True)
        ),
        "largest_force_N": dict(
            zip(
                magnets.names,
                np.max(np.hypot(*np.moveaxis(magnets.force, 2, 0)), axis=0).tolist(),
                strict=True,
            )
        ),
    }
    if (lift := result.lift) is not None:
        known["lift"] = {
            "begun_s": lift.begun,
            "free_from_s": lift.free_from,
            "succeeded": lift.succeeded,
            "contacts": lift.contacts,
        }
    return known


def _landed(one: Landing) -> dict[str, Any]:
    force, moment = one.contacts.peak
    entry: dict[str, Any] = {
        "gap_m": one.gap,
        "largest_travel_m": one.travel,
        "time_s": one.travel_time,
        "contacts": len(one.contacts),
        "landings": landing_count(one),
        "peak_force_N": {"value": force, "time_s": moment if len(one.contacts) else None},
        "contact_angle_rad": one.contact_angle,
        "contact_edge_rad": {"value": one.edge_angle, "time_s": one.edge_time},
        "shoulder_angle_rad": one.climb.shoulder,
        "beyond_shoulder": one.climb.excess is not None,
    }
    return entry | ({"first_contact_s": float(one.contacts.start[0])} if len(one.contacts) else {})
