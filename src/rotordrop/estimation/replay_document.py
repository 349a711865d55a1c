"""A replayed drop as a document: field names as published in the schema, times from power-off, SI units."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from rotordrop._version import __version__
from rotordrop.estimation.agreement import Agreement
from rotordrop.estimation.document import FORMAT, nested, statistics_entry
from rotordrop.estimation.replay_values import LOADS
from rotordrop.estimation.uncertainty import FEWEST_DRAWS
from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.simulation.fingerprint import fingerprint

if TYPE_CHECKING:
    from rotordrop.estimation.replayed import ReplayDrop


def replay_document(drop: ReplayDrop) -> dict[str, Any]:
    """One replayed drop ready for JSON."""
    record = drop.record
    return {
        "format": FORMAT,
        "rotordrop_version": __version__,
        "fingerprint": fingerprint(),
        "machine": drop.machine.name,
        "record": record.name if record.path is None else record.path.name,
        "record_sha256": record.sha256,
        "simulated_record": any("simulated" in str(value).lower() for value in record.metadata.values()),
        "drop_instant_s": drop.drop_instant.value,
        "drop_instant_interval_90_s": list(drop.drop_instant.interval_90),
        "speed_Hz": drop.speed.initial / (2.0 * np.pi),
        "method": "replay",
        "warnings": list(drop.warnings),
        "fixed": drop.fixed or None,
        "speed": _speed(drop),
        "initial_state": _initial(drop),
        "identification": _identification(drop),
        "agreement": agreement_entry(drop.agreement, drop.simulated.bearing_names),
        "bearings": {name: _bearing(drop, b, name) for b, name in enumerate(drop.values)},
    }


def _bearing(drop: ReplayDrop, b: int, name: str) -> dict[str, Any]:
    entry = nested(drop.values[name])
    for field in LOADS:
        if field in entry and "interval_90" not in entry[field]:
            made = 0 if drop.draws is None else len(drop.draws)
            entry[field]["status"] = f"no interval: {made} draws, at least {FEWEST_DRAWS} are needed"
    entry["peak_force_N"]["time_s"] = drop.peak_times[name]
    entry["equivalent_stiffness_N_per_m"]["source"] = "first contact, Neisi 2020, eq. (17)"
    contact = drop.contacts[b]
    entry["first_contact"] = {
        "start_s": contact.start,
        "end_s": contact.end,
        "duration_s": contact.duration,
        "timing_error_s": contact.timing_error,
        "impact_speed_m_per_s": contact.impact_speed,
        "indentation_m": contact.indentation,
        "mass_kg": contact.mass,
        "equivalent_stiffness_N_per_m": contact.equivalent_stiffness,
        "gravity_corrected_stiffness_N_per_m": contact.corrected_stiffness,
    }
    sag, rest = drop.gap.sag, drop.gap.rest
    entry["settled"] = {
        "radius_m": float(rest.radius[b]),
        "sideways_m": float(rest.sideways[b]),
        "sway_m": float(rest.sway[b]),
        "indentation_m": float(sag.indentation[b]),
        "race_deflection_m": float(sag.race[b]),
        "support_deflection_m": float(sag.support[b]),
        "vertical_zero_sigma_m": float(drop.gap.zero_sigma[b]),
    }
    constants = bearing_constants(drop.identified.touchdown_bearings[b].bearing)
    preload = constants.stress_coefficient_inner * constants.preload_ball_load ** (1.0 / 3.0)
    entry["stress_statistics_Pa"] = statistics_entry(
        drop.simulated.max_stress[:, b], drop.simulated.time, preload
    )
    return entry


def _speed(drop: ReplayDrop) -> dict[str, Any]:
    fit = drop.speed
    known = np.isfinite(fit.aero_time_constant.value)
    return {
        "aero_time_constant_s": fit.aero_time_constant.as_json() if known else None,
        "profile_time_constant_s": fit.profile_time_constant
        if np.isfinite(fit.profile_time_constant)
        else None,
        "friction_loss_Hz": fit.friction_loss / (2.0 * np.pi),
        "simulated_end_Hz": float(drop.simulated.speed[-1]) / (2.0 * np.pi),
    }


def _initial(drop: ReplayDrop) -> dict[str, Any]:
    initial, expanded = drop.initial, drop.expanded
    return {
        "displacement_m": _by_bearing(drop, initial.displacement),
        "velocity_m_per_s": _by_bearing(drop, initial.velocity),
        "remanent_force_N": initial.remanent_force.tolist(),
        "remanence_time_constant_s": initial.decay,
        "misfit": initial.misfit,
        "modal_expansion": {
            "displacement_m": _by_bearing(drop, expanded.at_bearings),
            "velocity_m_per_s": _by_bearing(drop, expanded.velocity_at_bearings),
        },
    }


def _by_bearing(drop: ReplayDrop, values: Any) -> dict[str, list[float]]:
    return {name: [float(v) for v in values[b]] for b, name in enumerate(drop.simulated.bearing_names)}


def _identification(drop: ReplayDrop) -> dict[str, Any]:
    entry: dict[str, Any] = {}
    if drop.support is not None:
        search = drop.support.search
        entry["support"] = {
            "starts": len(drop.support.coarse.starts),
            "agreeing": drop.support.coarse.agreeing,
            "windows_s": [fit.window for fit in (*drop.support.coarse.by_window, *search.by_window)],
            "misfit": search.best.misfit,
            "simulations": drop.support.coarse.evaluations + search.evaluations,
            "ended_early": search.ended_early or None,
            "correlations": drop.support.correlations,
        }
    if drop.friction is not None:
        entry["friction_sweep"] = {
            "dynamic": drop.friction.coefficients.tolist(),
            "disagreement_m": drop.friction.disagreement.tolist(),
            "window_s": list(drop.friction.window),
        }
    if drop.draws is not None:
        entry["draws"] = {"count": len(drop.draws), "rejected": drop.draws.rejected}
    return entry


def agreement_entry(agreement: Agreement, names: tuple[str, ...]) -> dict[str, Any]:
    """Agreement of simulation and record: windows, contacts, bounces, horizons [m], [s]."""
    bearings = {}
    for name, one in zip(names, agreement.bearings, strict=True):
        bearings[name] = {
            "measured_contacts_s": one.measured_contacts.tolist(),
            "simulated_contacts_s": one.simulated_contacts.tolist(),
            "measured_bounce_m": _finite(one.measured_bounce),
            "simulated_bounce_m": _finite(one.simulated_bounce),
            "horizon_s": one.horizon,
        }
    windows = [
        {**asdict(window), "rms": dict(zip(names, window.rms.tolist(), strict=True))}
        for window in agreement.windows
    ]
    return {
        "windows": windows,
        "bearings": bearings,
        "orbit_disagreement_m": agreement.disagreement,
        "expected_horizon_s": agreement.expected_horizon,
    }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
