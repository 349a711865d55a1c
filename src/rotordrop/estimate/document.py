"""The estimate as a document: field names as published in the schema, times from power-off, SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from rotordrop._version import __version__
from rotordrop.estimate.advice import Advice
from rotordrop.estimate.agreement import Agreement
from rotordrop.estimate.bearing_drop import BearingDrop, Impact, Peak
from rotordrop.estimate.estimate import Estimate, JointEstimate, ReplaySteps, Structure
from rotordrop.estimate.methods import Replay
from rotordrop.estimate.severity_numbers import severity_values
from rotordrop.evidence.first_contact import TimedContact
from rotordrop.known import Known
from rotordrop.simulate.fingerprint import fingerprint

FORMAT = "rotordrop estimate 2"


def estimate_document(estimate: Estimate) -> dict[str, Any]:
    """One estimate ready for JSON, complete: whoever makes it, Python or the command line, gets the same."""
    return {
        **_heading(estimate),
        "warnings": list(estimate.warnings),
        "notes": list(estimate.notes),
        "consistency": _consistency(estimate),
        "bearings": {
            bearing.name: {**bearing_entry(bearing), **nested(severity_values(estimate, bearing))}
            for bearing in estimate.bearings
        },
        "structure": structure_json(estimate.structure),
        "advice": [_advice(one) for one in estimate.advice],
        "cross_check": [_cross_check(one) for one in estimate.cross_check],
        "later_motion": [{**asdict(one), "larger": one.larger} for one in estimate.later],
        "parameters": [
            {
                "path": one.path,
                "scope": one.scope,
                "prior": None if one.prior is None else one.prior.as_json(),
                "estimate": one.estimate.as_json(),
            }
            for one in estimate.parameters
        ],
        "joint": None if estimate.joint is None else _joint(estimate.joint),
        "sensors": {
            one.sensor: {
                "gain_error": one.gain_error.as_json(),
                "offset_m": one.offset.as_json(),
                "noise_m": one.noise,
            }
            for one in estimate.sensors
        },
        "unbalance": [
            {
                "node": one.node,
                "amount_kg_m": one.amount.as_json(),
                "phase_rad": None if one.phase is None else one.phase.as_json(),
                "sentence": one.sentence(),
            }
            for one in estimate.unbalance
        ],
        **({} if estimate.replay is None else _replay(estimate, estimate.replay)),
    }


def combined(documents: Sequence[dict[str, Any]], names: Sequence[str]) -> dict[str, Any]:
    """One document of a single drop, or ``machine`` and ``drops.<name>`` of several."""
    if len(documents) == 1:
        return documents[0]
    return {
        "format": FORMAT,
        "rotordrop_version": __version__,
        "fingerprint": fingerprint(),
        "machine": documents[0]["machine"],
        "drops": dict(zip(names, documents, strict=True)),
    }


def _heading(estimate: Estimate) -> dict[str, Any]:
    record, method = estimate.record, estimate.method
    return {
        "format": FORMAT,
        "verdict": estimate.verdict.value,
        "consistent": estimate.consistent,
        "rotordrop_version": __version__,
        "fingerprint": fingerprint(),
        "machine": estimate.machine.name,
        "record": estimate.name if record.path is None else record.path.name,
        "record_sha256": record.sha256,
        "recorded": record.event_date,
        "simulated_record": estimate.simulated_record,
        "method": "replay" if isinstance(method, Replay) else "tracked",
        "quick": not isinstance(method, Replay) and method.quick,
        "drop_instant_s": estimate.drop_instant.value,
        "drop_instant_interval_90_s": list(estimate.drop_instant.interval_90),
        "speed_Hz": estimate.speed / (2.0 * np.pi),
        "estimated_until_s": estimate.until,
    }


def _consistency(estimate: Estimate) -> dict[str, Any]:
    return {
        "consistent": estimate.consistent,
        "sentence": estimate.sentence,
        "nis": _finite(estimate.nis),
        "process_noise_factor": estimate.noise_factor,
        "checks": [asdict(check) for check in estimate.checks],
    }


def _advice(one: Advice) -> dict[str, Any]:
    return {
        "measurement": one.measurement,
        "paths": list(one.paths),
        "half_widths_N": one.half_widths,
        "narrowed_N": one.narrowed,
        "sentence": one.sentence(),
    }


def structure_json(structure: Sequence[Structure]) -> list[dict[str, Any]]:
    """What a machine has beyond the usual model, ready for JSON."""
    return [
        {"name": one.name, "log_likelihood_rise": _finite(one.gain), "sentence": one.sentence}
        for one in structure
    ]


def _joint(joint: JointEstimate) -> dict[str, Any]:
    lower = joint.covariance[np.tril_indices(len(joint.paths))]
    return {
        "paths": list(joint.paths),
        "mean": joint.mean.tolist(),
        "covariance": [float(f"{value:.9g}") for value in lower],
        "prior_mean": joint.prior_mean.tolist(),
        "prior_standard_deviation": joint.prior_sigma.tolist(),
    }


def _cross_check(one: Any) -> dict[str, Any]:
    return {
        "name": one.name,
        "estimate": one.estimate.value,
        "cross_check": one.check,
        "known_relative_accuracy": one.accuracy,
        "agrees": one.agrees,
        "replaced": one.replaced,
    }


def bearing_entry(bearing: BearingDrop) -> dict[str, Any]:
    """Numbers of one bearing, found from a record or simulated."""
    entry: dict[str, Any] = {
        "origin": bearing.peak_force.origin.value,
        "peak_force_N": _peak(bearing.peak_force),
        "peak_stress_Pa": _peak(bearing.peak_stress),
        **nested(bearing.values),
    }
    statistics = {k: v for k, v in asdict(bearing.statistics).items() if v is not None}
    entry["stress_statistics_Pa"] = statistics
    entry["impacts"] = [impact_entry(impact) for impact in bearing.impacts]
    if bearing.missing:
        entry["not_stated"] = dict(bearing.missing)
    return entry


def _peak(peak: Peak) -> dict[str, Any]:
    return {**peak.known.as_json(), "time_s": peak.time}


def nested(values: Mapping[str, Known]) -> dict[str, Any]:
    """Identified values as nested objects: ``support.mass_kg`` becomes ``support: {mass_kg: …}``."""
    tree: dict[str, Any] = {}
    for path, value in values.items():
        at = tree
        *parents, leaf = path.split(".")
        for parent in parents:
            at = at.setdefault(parent, {})
        at[leaf] = value.as_json()
    return tree


def impact_entry(impact: Impact) -> dict[str, Any]:
    """One impact: times from power-off [s], azimuth [rad], peak [N], impulse [N s], energy [J]."""
    return {
        "start_s": impact.start,
        "end_s": _finite(impact.end),
        "peak_time_s": impact.peak_time,
        "azimuth_rad": impact.azimuth,
        "peak_force_N": impact.peak_force.as_json(),
        "impulse_N_s": impact.impulse.as_json(),
        "dissipated_energy_J": impact.dissipated_energy.as_json(),
    }


def _replay(estimate: Estimate, steps: ReplaySteps) -> dict[str, Any]:
    names = [bearing.name for bearing in estimate.bearings]
    assert estimate.agreement is not None
    return {
        "fixed": steps.fixed or None,
        **steps.document,
        "first_contact": {
            name: _first_contact(contact) for name, contact in zip(names, steps.contacts, strict=True)
        },
        "agreement": _agreement(estimate.agreement, names),
    }


def _first_contact(contact: TimedContact) -> dict[str, float]:
    return {
        "start_s": contact.start,
        "end_s": contact.end,
        "duration_s": contact.duration,
        "timing_error_s": contact.timing_error,
        "impact_speed_m_per_s": contact.impact_speed,
        "indentation_m": contact.indentation,
        "mass_kg": contact.mass,
        "half_period_stiffness_N_per_m": contact.equivalent_stiffness,
        "half_period_stiffness_error_N_per_m": contact.standard_error,
        "gravity_corrected_stiffness_N_per_m": contact.corrected_stiffness,
    }


def _agreement(agreement: Agreement, names: Sequence[str]) -> dict[str, Any]:
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


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)
