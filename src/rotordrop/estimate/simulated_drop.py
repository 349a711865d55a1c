"""The document of a simulated drop: its numbers under the names of the estimate's schema."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotordrop.document import stated
from rotordrop.estimate.bearing_drop import simulated_bearings
from rotordrop.estimate.published import Bearing
from rotordrop.evidence.impacts import after_flights
from rotordrop.machine import Machine
from rotordrop.simulate.magnets import MagnetHistory
from rotordrop.simulate.result import DropResult
from rotordrop.simulate.used import Landing, clearance_uses, landings, ribbon_uses


def simulation_numbers(result: DropResult, machine: Machine | None = None) -> dict[str, Any]:
    """Give the numbers of a simulated drop: SI values under the names of the estimate's schema.

    The machine that was simulated gives the use of its clearances.
    """
    certificate, bearings = result.certificate, {}
    parts = stated(
        result,
        "tolerance reduction energy_residual_J=certificate.energy_residual "
        "energy_scale_J=certificate.energy_scale",
    )
    for name in ("peak_change_tolerance", "peak_change_truncation"):
        if (change := getattr(certificate, name)) is not None:
            parts[name] = change.tolist()
    for index, one in enumerate(simulated_bearings(result, machine)):
        pressure, half_width, moment = result.peak_contact_pressure(index)
        bearings[one.name] = {
            **Bearing.of_result(one).as_json(),
            "peak_contact_pressure_Pa": {"value": pressure, "time_s": moment},
            "contact_half_width_m": {"value": half_width},
        }
    numbers = stated(
        result,
        "machine=machine_name method speed_Hz final_speed_Hz duration_s outcome finished certificate "
        "bearings",
        method="simulation",
        speed_Hz=result.initial_speed / (2 * math.pi),
        final_speed_Hz=float(result.speed[-1]) / (2 * math.pi),
        duration_s=result.time[-1],
        certificate=parts,
        bearings=bearings,
    )
    for use in () if machine is None else clearance_uses(machine, result):
        entry = stated(use, "node gap_m largest_travel_m=travel travel_over_gap=share time_s")
        if use.contacts is not None:
            entry |= {"contacts": len(use.contacts), "peak_force_N": use.peak_force}
            entry |= {"first_contact_s": float(use.contacts.start[0])} if len(use.contacts) else {}
        numbers.setdefault("stops" if use.stop else "clearances", {})[use.name] = entry
    for ribbon in () if machine is None else ribbon_uses(machine, result):
        numbers.setdefault("ribbons", {})[ribbon.name] = stated(
            ribbon,
            "slip_force_N peak_force_N slipped_s first_slip_s dissipated_J",
            peak_force_N={"value": ribbon.peak_force, "time_s": ribbon.peak_time},
        )
    if machine is not None and machine.axial:
        latest = int(np.argmax(np.abs(result.axial_displacement)))
        numbers["axial"] = {
            "largest_travel_m": float(abs(result.axial_displacement[latest])),
            "time_s": float(result.time[latest]),
            "faces": {one.name: _landed_faces(one) for one in landings(machine, result)},
        }
    if result.heat is not None:
        numbers["heat"] = result.heat.as_json(result.bearing_names)
    if result.magnets is not None:
        numbers["magnets"] = _magnets_json(result, result.magnets)
    return numbers


def _magnets_json(result: DropResult, magnets: MagnetHistory) -> dict[str, Any]:
    events = zip(magnets.events, magnets.event_time.tolist(), strict=True)
    pulls = np.hypot(*np.moveaxis(magnets.force, 2, 0))
    known: dict[str, Any] = {
        "events": [{"what": what, "time_s": time if math.isfinite(time) else None} for what, time in events],
    }
    for name, largest in (
        ("largest_current_A", np.max(magnets.current, axis=(0, 2, 3))),
        ("largest_force_N", np.max(pulls, axis=0)),
    ):
        known[name] = dict(zip(magnets.names, largest.tolist(), strict=True))
    if (lift := result.lift) is not None:
        known["lift"] = stated(lift, "begun_s free_from_s succeeded contacts")
    return known


def _landed_faces(one: Landing) -> dict[str, Any]:
    force, moment = one.contacts.peak
    entry = stated(
        one,
        "gap_m largest_travel_m=travel time_s=travel_time contacts landings peak_force_N contact_angle_rad "
        "contact_edge_rad shoulder_angle_rad=climb.shoulder beyond_shoulder",
        contacts=len(one.contacts),
        landings=landing_count(one),
        peak_force_N={"value": force, "time_s": moment if len(one.contacts) else None},
        contact_edge_rad={"value": one.edge_angle, "time_s": one.edge_time},
        beyond_shoulder=one.climb.excess is not None,
    )
    return entry | ({"first_contact_s": float(one.contacts.start[0])} if len(one.contacts) else {})


def landing_count(one: Landing) -> int:
    """Number of landings on a face: contacts that no flight parts are one, by the rule of radial impacts."""
    return int(np.sum(after_flights(one.contacts.start, one.contacts.end, one.gap, one.acceleration[1:])))
