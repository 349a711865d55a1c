"""The numbers of a simulated drop, ready for JSON, under the names an estimate uses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rotordrop.report.from_simulation import peak_stress
from rotordrop.report.simulate_page import SETTLED_FROM, SETTLED_TO
from rotordrop.severity.statistics import stress_statistics
from rotordrop.simulation.result import DropResult


def simulation_numbers(result: DropResult) -> dict[str, Any]:
    """Give the numbers of a simulated drop: SI values under the names of the estimate's schema.

    Parameters
    ----------
    result : DropResult
        The simulated drop.
    """
    return {
        "machine": result.machine_name,
        "method": "simulation",
        "speed_Hz": result.initial_speed / (2 * math.pi),
        "final_speed_Hz": float(result.speed[-1]) / (2 * math.pi),
        "duration_s": float(result.time[-1]),
        "outcome": result.outcome,
        "finished": result.finished,
        "certificate": _certificate(result),
        "bearings": {name: _bearing(result, index) for index, name in enumerate(result.bearing_names)},
    }


def _bearing(result: DropResult, index: int) -> dict[str, Any]:
    force, force_time = result.peak_force(index)
    stress, stress_time = peak_stress(result, index)
    numbers: dict[str, Any] = {
        "peak_force_N": {"value": force, "time_s": force_time},
        "peak_stress_Pa": {"value": stress, "time_s": stress_time},
        "mean_stress_Pa": {"value": float(np.mean(result.max_stress[:, index]))},
        "stress_statistics_Pa": stress_statistics(result.max_stress[:, index]).as_json(),
        "impacts": _impacts(result, index),
    }
    pressed = result.peak_contact_pressure(index)
    if pressed is not None:
        numbers["peak_contact_pressure_Pa"] = {"value": pressed[0], "time_s": pressed[2]}
        numbers["contact_half_width_m"] = {"value": pressed[1]}
    if result.time[-1] >= SETTLED_TO:
        window = (result.time >= SETTLED_FROM) & (result.time <= SETTLED_TO)
        mean = float(np.mean(result.bearing_force_magnitude[window, index]))
        numbers["mean_force_0p15_0p2_N"] = {"value": mean}
    return numbers


def _impacts(result: DropResult, index: int) -> list[dict[str, Any]]:
    """List every contact; the end is null where it still lasts."""
    log = result.contacts.of_bearing(index)
    return [
        {
            "start_s": float(log.start[i]),
            "end_s": None if math.isnan(log.end[i]) else float(log.end[i]),
            "peak_force_N": {"value": float(log.peak_force[i])},
            "peak_time_s": float(log.peak_time[i]),
            "azimuth_rad": float(log.azimuth[i]),
            "impulse_N_s": {"value": float(log.impulse[i])},
            "dissipated_energy_J": {"value": float(log.dissipated_energy[i])},
        }
        for i in range(len(log))
    ]


def _certificate(result: DropResult) -> dict[str, Any]:
    """Give the parts of the certificate that were computed."""
    certificate = result.certificate
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
    return parts
