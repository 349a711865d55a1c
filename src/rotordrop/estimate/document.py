"""An estimate as the document that is published of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rotordrop._version import __version__
from rotordrop.estimate import published
from rotordrop.estimate.bearing_drop import finite, published_bearing
from rotordrop.estimate.estimate import Estimate
from rotordrop.estimate.methods import Replay
from rotordrop.estimate.published import FORMAT, Value
from rotordrop.estimate.severity_numbers import severity_values
from rotordrop.evidence.contacts import TimedContact
from rotordrop.known import Known
from rotordrop.simulate.fingerprint import fingerprint


def published_drop(estimate: Estimate) -> published.Drop:
    """What is published of an estimate; Python and the command line get the same."""
    record, method = estimate.record, estimate.method
    return published.Drop(
        format=FORMAT,
        verdict=estimate.verdict.value,
        consistent=estimate.consistent,
        rotordrop_version=__version__,
        fingerprint=fingerprint(),
        machine=estimate.machine.name,
        record=estimate.name if record.path is None else record.path.name,
        record_sha256=record.sha256,
        recorded=record.event_date,
        simulated_record=estimate.simulated_record,
        method="replay" if isinstance(method, Replay) else "tracked",
        quick=not isinstance(method, Replay) and method.quick,
        drop_instant_s=estimate.drop_instant.value,
        drop_instant_interval_90_s=list(estimate.drop_instant.interval_90),
        speed_Hz=estimate.speed / (2.0 * np.pi),
        estimated_until_s=estimate.until,
        warnings=list(estimate.warnings),
        notes=list(estimate.notes),
        consistency=published.Consistency(
            consistent=estimate.consistent,
            sentence=estimate.sentence,
            nis=finite(estimate.nis),
            process_noise_factor=estimate.noise_factor,
            checks=[
                published.Check(
                    name=one.name,
                    passed=one.passed,
                    message=one.said(),
                    note=one.noted(),
                    **({} if one.widening == 1.0 else {"widening": one.widening}),
                )
                for one in estimate.checks
            ],
        ),
        bearings={
            bearing.name: published_bearing(bearing, severity_values(estimate, bearing))
            for bearing in estimate.bearings
        },
        structure=list(estimate.structure),
        advice=[
            published.Advice(
                measurement=one.measurement,
                paths=list(one.paths),
                half_widths_N=one.half_widths,
                narrowed_N=one.narrowed,
                sentence=one.sentence(),
            )
            for one in estimate.advice
        ],
        cross_check=[
            published.CrossCheck(
                name=one.name,
                estimate=one.estimate.value,
                cross_check=one.check,
                known_relative_accuracy=one.accuracy,
                agrees=one.agrees,
                replaced=one.replaced,
            )
            for one in estimate.cross_check
        ],
        later_motion=list(estimate.later),
        parameters=[
            published.Parameter(
                path=one.path,
                scope=one.scope,
                prior=_value(one.prior),
                estimate=Value.of_known(one.estimate),
            )
            for one in estimate.parameters
        ],
        joint=estimate.joint,
        sensors={
            one.sensor: published.Sensor(
                gain_error=Value.of_known(one.gain_error),
                offset_m=Value.of_known(one.offset),
                noise_m=one.noise,
            )
            for one in estimate.sensors
        },
        unbalance=[
            published.Unbalance(
                node=one.node,
                amount_kg_m=Value.of_known(one.amount),
                phase_rad=_value(one.phase),
                sentence=one.sentence(),
            )
            for one in estimate.unbalance
        ],
        **_replay(estimate),
    )


def estimate_document(estimate: Estimate) -> dict[str, Any]:
    """The same ready for JSON."""
    return published_drop(estimate).as_json()


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


def _value(known: Known | None) -> Value | None:
    return None if known is None else Value.of_known(known)


def _replay(estimate: Estimate) -> dict[str, Any]:
    """What a replay has beside the common result; nothing for another method."""
    steps = estimate.replay
    if steps is None:
        return {}
    names = [bearing.name for bearing in estimate.bearings]
    return {
        "fixed": steps.fixed or None,
        **steps.document,
        "first_contact": {
            name: _first_contact(contact) for name, contact in zip(names, steps.contacts, strict=True)
        },
        "agreement": estimate.agreement,
    }


def _first_contact(contact: TimedContact) -> published.FirstContact:
    return published.FirstContact(
        start_s=contact.start,
        end_s=contact.end,
        duration_s=contact.duration,
        timing_error_s=contact.timing_error,
        impact_speed_m_per_s=contact.impact_speed,
        indentation_m=contact.indentation,
        mass_kg=contact.mass,
        half_period_stiffness_N_per_m=contact.equivalent_stiffness,
        half_period_stiffness_error_N_per_m=contact.standard_error,
        gravity_corrected_stiffness_N_per_m=contact.corrected_stiffness,
    )
