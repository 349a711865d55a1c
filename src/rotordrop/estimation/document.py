"""The estimate as a document: field names as published in the schema, times from power-off, SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop._version import __version__
from rotordrop.estimated import IdentifiedValue
from rotordrop.estimation.tracked import Impact, TrackedDrop
from rotordrop.machine import Machine
from rotordrop.physics.ball_bearing import bearing_constants
from rotordrop.severity.statistics import stress_statistics
from rotordrop.simulation.fingerprint import fingerprint

Array = NDArray[np.float64]
FORMAT = "rotordrop estimate 1"


def tracked_document(drop: TrackedDrop, machine: Machine, warnings: Sequence[str] = ()) -> dict[str, Any]:
    """One tracked drop ready for JSON."""
    constants = {b.name: bearing_constants(b.bearing) for b in machine.touchdown_bearings}
    bearings = {}
    for index, (name, values) in enumerate(drop.values.items()):
        entry = nested(values)
        entry["peak_force_N"]["time_s"] = drop.peak_times[name]
        c = constants[name]
        preload_stress = c.stress_coefficient_inner * c.preload_ball_load ** (1.0 / 3.0)
        entry["stress_statistics_Pa"] = statistics_entry(
            drop.forces.stress[:, index], drop.forces.time, preload_stress
        )
        entry["impacts"] = [impact_entry(i) for i in drop.impacts if i.bearing == name]
        bearings[name] = entry
    return {
        **heading(drop, machine),
        "method": "tracked",
        "warnings": [*warnings, *(check.message for check in drop.checks if not check.passed)],
        "consistency": {
            "consistent": drop.consistent,
            "sentence": drop.sentence(),
            "nis": drop.nis,
            "process_noise_factor": drop.noise_factor,
            "checks": [asdict(check) for check in drop.checks],
        },
        "bearings": bearings,
    }


def heading(drop: TrackedDrop, machine: Machine) -> dict[str, Any]:
    """What every estimate document begins with."""
    record = drop.record
    return {
        "format": FORMAT,
        "rotordrop_version": __version__,
        "fingerprint": fingerprint(),
        "machine": machine.name,
        "record": record.name if record.path is None else record.path.name,
        "record_sha256": record.sha256,
        "drop_instant_s": drop.drop_instant.value,
        "drop_instant_interval_90_s": list(drop.drop_instant.interval_90),
        "speed_Hz": drop.speed / (2.0 * np.pi),
    }


def nested(values: Mapping[str, IdentifiedValue]) -> dict[str, Any]:
    """Identified values as nested objects: ``support.mass_kg`` becomes ``support: {mass_kg: …}``."""
    tree: dict[str, Any] = {}
    for path, value in values.items():
        at = tree
        *parents, leaf = path.split(".")
        for parent in parents:
            at = at.setdefault(parent, {})
        at[leaf] = value.as_json()
    return tree


def statistics_entry(stress: Array, time: Array, preload_stress: float) -> dict[str, Any]:
    """Stress statistics of Table 5 [Pa] with the rules named."""
    found = asdict(stress_statistics(stress, time=time, preload_stress=preload_stress))
    return {key: value for key, value in found.items() if value is not None}


def impact_entry(impact: Impact) -> dict[str, Any]:
    """One impact: times from power-off [s], azimuth [rad], peak [N], impulse [N s], energy [J]."""
    return {
        "start_s": impact.start,
        "end_s": impact.end,
        "peak_time_s": impact.peak_time,
        "azimuth_rad": impact.azimuth,
        "peak_force_N": impact.peak_force.as_json(),
        "impulse_N_s": impact.impulse.as_json(),
        "dissipated_energy_J": impact.dissipated_energy.as_json(),
    }


def combined(documents: Mapping[str, dict[str, Any]], machine: Machine) -> dict[str, Any]:
    """One document of a single drop, or ``machine`` and ``drops.<stem>`` of several."""
    if len(documents) == 1:
        return next(iter(documents.values()))
    return {
        "format": FORMAT,
        "rotordrop_version": __version__,
        "fingerprint": fingerprint(),
        "machine": machine.name,
        "drops": dict(documents),
    }
