"""Published estimates of which a test needs a part; what it does not name is empty."""

from collections.abc import Mapping
from typing import Any

from rotordrop.estimate.published import FORMAT, Bearing, Consistency, Drop, LaterMotion, Value
from rotordrop.severity.statistics import Statistics

NOTHING: dict[str, Any] = {
    "format": FORMAT,
    "verdict": "",
    "consistent": True,
    "rotordrop_version": "0",
    "fingerprint": "",
    "machine": "m",
    "record": "drop.h5",
    "record_sha256": "",
    "recorded": "",
    "simulated_record": False,
    "method": "tracked",
    "quick": False,
    "drop_instant_s": 0.0,
    "drop_instant_interval_90_s": [0.0, 0.0],
    "speed_Hz": 60.0,
    "estimated_until_s": 0.2,
    "warnings": [],
    "notes": [],
    "consistency": Consistency(consistent=True, sentence="", nis=1.0, process_noise_factor=1.0, checks=[]),
    "bearings": {},
    "structure": [],
    "advice": [],
    "cross_check": [],
    "later_motion": [],
    "parameters": [],
    "joint": None,
    "sensors": {},
    "unbalance": [],
}
ZERO = dict.fromkeys((name for name, field in Statistics.model_fields.items() if field.is_required()), 0)
STATISTICS = Statistics(**{**ZERO, "rule": "hazen", "weighted_by_time": False})


def value(number: float, low: float | None = None, high: float | None = None) -> Value:
    """A number, with its 90 % interval where the ends are given."""
    return Value(value=number, **({} if low is None or high is None else {"interval_90": [low, high]}))


def bearing(numbers: Mapping[str, Value]) -> Bearing:
    """A bearing with its numbers by path."""
    return Bearing.model_construct(
        numbers=dict(numbers), stress_statistics_Pa=STATISTICS, impacts=[], origin=""
    )


def went_on(bearing: str, at: float = 0.25) -> LaterMotion:
    """A rotor that went 60 µm further out at a bearing, at a time after the estimated part [s]."""
    within = {"first": 250e-6, "first_time": 0.01, "resolved": 4e-6}
    return LaterMotion(bearing=bearing, later=310e-6, later_time=at, larger=True, **within)


def published(**given: Any) -> Drop:
    """A drop with some parts given."""
    return Drop.model_construct(**{**NOTHING, **given})
