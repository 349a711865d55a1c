"""An estimate as the document that is published of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from rotordrop._version import __version__
from rotordrop.estimate import published
from rotordrop.estimate.agreement import Agreement
from rotordrop.estimate.bearing_drop import finite, published_bearing
from rotordrop.estimate.estimate import Estimate, Structure
from rotordrop.estimate.methods import Replay
from rotordrop.estimate.published import FORMAT, Value
from rotordrop.estimate.severity_numbers import severity_values
from rotordrop.evidence.contacts import TimedContact
from rotordrop.known import Known
from rotordrop.simulate.fingerprint import fingerprint


def published_drop(estimate: Estimate) -> published.Drop:
    """What is published of an estimate; Python and the command line get the same."""
    record, method, joint = estimate.record, estimate.method, estimate.joint
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
        structure=published_structure(estimate.structure),
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
        later_motion=[published.LaterMotion(**asdict(one), larger=one.larger) for one in estimate.later],
        parameters=[
            published.Parameter(
                path=one.path,
                scope=one.scope,
                prior=_value(one.prior),
                estimate=Value.of_known(one.estimate),
            )
            for one in estimate.parameters
        ],
        joint=None
        if joint is None
        else published.Joint(
            paths=list(joint.paths),
            mean=joint.mean.tolist(),
            covariance=[float(f"{c:.9g}") for c in joint.covariance[np.tril_indices(len(joint.paths))]],
            prior_mean=joint.prior_mean.tolist(),
            prior_standard_deviation=joint.prior_sigma.tolist(),
        ),
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


def published_structure(structure: Sequence[Structure]) -> list[published.Structure]:
    """What a machine has beyond the base model."""
    return [
        published.Structure(
            name=one.name,
            log_likelihood_rise=finite(one.gain),
            sentence=one.sentence,
            probability=one.probability,
        )
        for one in structure
    ]


def _value(known: Known | None) -> Value | None:
    return None if known is None else Value.of_known(known)


def _replay(estimate: Estimate) -> dict[str, Any]:
    """What a replay has beside the common result; nothing for another method."""
    steps, agreement = estimate.replay, estimate.agreement
    if steps is None:
        return {}
    assert agreement is not None
    names = [bearing.name for bearing in estimate.bearings]
    return {
        "fixed": steps.fixed or None,
        **steps.document,
        "first_contact": {
            name: _first_contact(contact) for name, contact in zip(names, steps.contacts, strict=True)
        },
        "agreement": _agreement(agreement, names),
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


def _agreement(agreement: Agreement, names: Sequence[str]) -> published.Agreement:
    bearings = {
        name: published.BearingAgreement(
            measured_contacts_s=one.measured_contacts.tolist(),
            simulated_contacts_s=one.simulated_contacts.tolist(),
            measured_bounce_m=finite(one.measured_bounce),
            simulated_bounce_m=finite(one.simulated_bounce),
            horizon_s=one.horizon,
        )
        for name, one in zip(names, agreement.bearings, strict=True)
    }
    windows = [
        published.Window(**{**asdict(window), "rms": dict(zip(names, window.rms.tolist(), strict=True))})
        for window in agreement.windows
    ]
    return published.Agreement(
        windows=windows,
        bearings=bearings,
        orbit_disagreement_m=agreement.disagreement,
        expected_horizon_s=agreement.expected_horizon,
    )
