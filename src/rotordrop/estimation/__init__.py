"""From a recorded drop to force and stress, with their uncertainty."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, overload

if TYPE_CHECKING:
    from rotordrop.estimation.replayed import ReplayDrop
    from rotordrop.estimation.tracked import TrackedDrop
    from rotordrop.machine import Machine
    from rotordrop.measurement.record import Record


@overload
def estimate_drop(
    machine: Machine,
    record: Record,
    *,
    method: Literal["tracked"] = "tracked",
    tail: Record | None = None,
    **options: Any,
) -> TrackedDrop: ...


@overload
def estimate_drop(
    machine: Machine,
    record: Record,
    *,
    method: Literal["replay"],
    tail: Record | None = None,
    **options: Any,
) -> ReplayDrop: ...


def estimate_drop(
    machine: Machine,
    record: Record,
    *,
    method: str = "tracked",
    tail: Record | None = None,
    **options: Any,
) -> TrackedDrop | ReplayDrop:
    """Estimate force and stress of the touchdown bearings from one recorded drop.

    Parameters
    ----------
    machine : Machine
        The machine, with guesses where nothing better is known.
    record : Record
        The recorded drop.
    method : {"tracked", "replay"}
        A drop model that follows the record, or the paper's open-loop replay.
    tail : Record, optional
        The settled tail; the replay needs it when the record does not reach standstill.
    **options
        Of the method: ``quick`` and ``progress`` for the tracked twin; ``fixed``, ``draws``, ``starts``,
        ``threads`` and ``progress`` for the replay.

    Returns
    -------
    TrackedDrop or ReplayDrop
        The estimate.
    """
    if method == "replay":
        from rotordrop.estimation.replay import replay_drop

        return replay_drop(machine, record, tail, **options)
    if method != "tracked":
        from rotordrop.errors import UsageError

        raise UsageError(f"the method is {method!r}; expected 'tracked' or 'replay'.")
    from rotordrop.estimation.tracked import estimate_tracked

    return estimate_tracked(machine, [record], [tail], **options)[0]
