"""An estimate as the document that is published of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rotordrop._version import __version__
from rotordrop.estimate.estimate import Estimate, Replay
from rotordrop.estimate.published import FORMAT, Bearing, Drop, FirstContact
from rotordrop.simulate.result import fingerprint


def published_drop(estimate: Estimate) -> Drop:
    """What is published of an estimate; Python and the command line get the same."""
    method, steps, names = estimate.method, estimate.replay, [bearing.name for bearing in estimate.bearings]
    replayed: dict[str, Any] = {}
    if steps is not None:
        contacts = map(FirstContact.of_result, steps.contacts)
        first = dict(zip(names, contacts, strict=True))
        replayed = {"initial_state": steps.initial_state, "first_contact": first}
    return Drop.of_result(
        estimate,
        format=FORMAT,
        rotordrop_version=__version__,
        fingerprint=fingerprint(),
        method="replay" if isinstance(method, Replay) else "tracked",
        quick=not isinstance(method, Replay) and method.quick,
        bearings={bearing.name: Bearing.of_result(bearing) for bearing in estimate.rated},
        **replayed,
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
