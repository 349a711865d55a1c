"""The friction between rotor and inner race."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

from rotordrop.elements.description import Description, Usual
from rotordrop.elements.parameter import Parameter, Role, bearing_entries
from rotordrop.elements.values import NonNegative, Velocity, default, follows, scaled
from rotordrop.known import Known
from rotordrop.physics import columns as L
from rotordrop.physics.friction import SMOOTHING_SPEED

_STATIC_OVER_DYNAMIC = 1.3
_RATIO_ERROR = 0.15
"""Half width of the 90 % interval of static over dynamic coefficient, over it: chosen, not measured [1]."""


SLIDING = Usual(
    least=0.005, most=0.8, look="steel on steel has 0.05 to 0.4; is it in percent?", label="friction"
)
"""Bounds of a coefficient of dry friction."""


class Friction(Description):
    """Stribeck friction between rotor and inner race."""

    static: NonNegative = follows("1.3 times the dynamic coefficient")
    dynamic: NonNegative = default(0.1, "the range swept in Neisi 2020 lies around it", (0.05, 0.2))
    """Friction coefficients at rest and when sliding fast [1]."""
    stribeck_speed: Velocity = default(0.5, "as in the reference machine", (0.1, 2.0))
    """Sliding speed over which static falls to dynamic [m/s]."""
    smoothing_speed: Velocity = default(
        SMOOTHING_SPEED, "small against any sliding speed that matters in a drop"
    )
    """Sliding speed below which the friction is smoothed [m/s]."""

    columns: ClassVar[Mapping[str, int]] = {
        "static": L.FRICTION_STATIC,
        "dynamic": L.FRICTION_DYNAMIC,
        "stribeck_speed": L.STRIBECK_SPEED,
        "smoothing_speed": L.SMOOTHING_SPEED,
    }

    usual: ClassVar[Mapping[str, Usual]] = {
        "dynamic": replace(SLIDING, label="dynamic friction"),
        "static": Usual(
            least=0.005,
            most=1.2,
            look="it is 1 to 1.5 times the dynamic coefficient",
            label="static friction",
        ),
    }

    def left_out(self) -> dict[str, Any]:
        """Let the static coefficient follow the dynamic one."""
        if "static" in self.model_fields_set:
            return {}
        why = f"{_STATIC_OVER_DYNAMIC:g} times the dynamic coefficient, the ratio of Neisi 2020"
        return {"static": scaled(self.dynamic, _STATIC_OVER_DYNAMIC, why, "")}

    @property
    def ratio(self) -> float:
        """Static over dynamic coefficient [1]."""
        return float(self.static) / float(self.dynamic)

    def static_of(self, dynamic: Known) -> Known:
        """Static coefficient at its described ratio to a dynamic one: sliding drops say little about it."""
        low, high = dynamic.interval_90 or (dynamic.value, dynamic.value)
        return Known(
            value=self.ratio * dynamic.value,
            status="the record does not determine it",
            standard_error=None if dynamic.standard_error is None else self.ratio * dynamic.standard_error,
            interval_90=((1.0 - _RATIO_ERROR) * self.ratio * low, (1.0 + _RATIO_ERROR) * self.ratio * high),
            unit="1",
        )


PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        path="friction.static",
        follows=("friction.dynamic", lambda bearing, dynamic: bearing.friction.static_of(dynamic)),
        label="static friction coefficient",
        kind="dimensionless",
        role=Role.DERIVED,
    ),
    Parameter(
        path="friction.dynamic",
        label="dynamic friction coefficient",
        kind="dimensionless",
        measured_by="a speed sensor on the inner race of {owner}",
        role=Role.SOUGHT,
        guess_sigma=0.4,
        reach=3.0,
        drift=1.0,
        late_drift_factor=5.0,
        entries=bearing_entries(L.FRICTION_DYNAMIC, L.FRICTION_STATIC),
        separated_by={"race.inertia": "a speed sensor on the inner race gives its spin-up"},
    ),
    Parameter(
        path="friction.stribeck_speed",
        label="Stribeck speed of the friction",
        kind="velocity",
        guess_sigma=0.4,
        reach=5.0,
        drift=1.0,
        late_drift_factor=5.0,
        entries=bearing_entries(L.STRIBECK_SPEED),
        spin_up_only=True,
    ),
)
"""Unknowns of the friction."""
