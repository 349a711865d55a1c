"""Displacement sensors and what they can resolve."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from pydantic import Field

from rotordrop.elements import values as V
from rotordrop.elements.description import Channel, Misfit, Name, Placed, Usual
from rotordrop.elements.parameter import (
    SMALLEST_GAP,
    Extension,
    Parameter,
    of_one_unknown,
)
from rotordrop.elements.values import default
from rotordrop.physics import columns as L

LEAST_PLANE_DISTANCE = 1e-3
"""Sensor planes closer than this [m] count as one (chosen)."""


class Sensor(Placed):
    """A displacement sensor looking at the shaft."""

    name: Channel
    """Name of its channel in the recording."""
    angle: V.Angle
    """Direction of positive reading [rad], counter-clockwise from +x (horizontal), y up, seen from the DE."""
    polarity: Literal[1, -1] = 1
    """-1 when a motion in the direction of the angle makes the reading fall."""
    gain: V.Positive = default(1.0, "true displacement over reading of a calibrated sensor", (0.97, 1.03))
    """True displacement over reading [1]."""
    offset: V.Length = default(0.0, "reads zero when the rotor is centred", (-50e-6, 50e-6))
    """Reading [m] when the rotor is centred."""
    sensitivity: V.Sensitivity | None = None
    """Volts per metre [V/m], for recordings in volts."""
    bearing: Name = Field(
        default="-",
        validate_default=False,
        description="Touchdown bearing at this end; the nearest when left out",
    )
    """Name of the touchdown bearing at this end; the nearest when left out."""
    position_error: V.NonNegativeLength = default(1e-3, "standard uncertainty of the axial position")
    """Standard uncertainty of the axial position [m]."""
    time_constant: V.PositiveTime | None = None
    """Time by which the reading lags behind, first order [s]."""
    cross_axis: V.Number | None = None
    """Reading per displacement across, in the direction turned by +90° [1]."""
    follows_housing: V.Number | None = None
    """Part of the motion of the bearing housing that the bracket of the sensor makes too [1]."""
    plane_offset: V.Length | None = None
    """How far the sensor stands from its node, towards higher nodes [m]."""
    lost: bool = Field(default=False, description="A sensor without readings; left out of everything")
    """Whether the sensor gave no readings; the machine then goes without it."""

    usual: ClassVar[Mapping[str, Usual]] = {
        "gain": Usual(least=0.5, most=2.0, look="true displacement over reading is near 1"),
        "sensitivity": Usual(least=1e2, most=1e7, look="eddy-current sensors have 1 to 100 mV/um"),
    }

    @property
    def further_states(self) -> Mapping[str, int]:
        """The reading it has got to, where it lags behind."""
        return {} if self.time_constant is None else {"reading {}": L.INTERNAL}


def check_sensors_resolve_motion(sensors: tuple[Sensor, ...], nodes: tuple[float, ...]) -> None:
    """Refuse sensors from which the rigid motion of the rotor (x, y and both tilts) cannot be found."""
    planes: dict[float, list[Sensor]] = {}
    for sensor in sensors:
        position = nodes[sensor.node - 1]
        key = next((z for z in planes if abs(z - position) < LEAST_PLANE_DISTANCE), position)
        planes.setdefault(key, []).append(sensor)
    if len(planes) < 2:
        raise Misfit(
            f"the {len(sensors)} sensors sit in {len(planes)} plane "
            f"({', '.join(f'{z * 1e3:.4g} mm' for z in planes)}) and cannot tell a "
            "tilt of the rotor from its displacement; add sensors in a second plane",
            ("sensors",),
        )
    whole = [plane for plane in planes.values() if _resolves_both(plane)]
    if len(whole) == 1 and any(len(plane) == 1 for plane in planes.values()):
        return  # a plane that lost a sensor: the twin goes on with the other plane and what is left
    if len(whole) < 2 and _rank(sensors, nodes) < 4:
        weak = next(z for z, plane in planes.items() if not _resolves_both(plane))
        stated = ", ".join(f"{one.name} at {math.degrees(one.angle.value):.4g}°" for one in planes[weak])
        raise Misfit(
            f"the sensors resolve only {_rank(sensors, nodes)} of the 4 rigid motions: in the plane at "
            f"{weak * 1e3:.4g} mm all look in the same direction ({stated}); turn one or add one",
            ("sensors", sensors.index(planes[weak][0]), "angle"),
        )


def _resolves_both(plane: list[Sensor]) -> bool:
    first = plane[0].angle.value
    return any(abs(math.sin(sensor.angle.value - first)) > 0.05 for sensor in plane)


def _rank(sensors: tuple[Sensor, ...], nodes: tuple[float, ...]) -> int:
    import numpy as np

    span = max(nodes) - min(nodes)
    rows = [
        (math.cos(a), math.sin(a), math.cos(a) * z, math.sin(a) * z)
        for a, z in ((s.angle.value, nodes[s.node - 1] / span - 0.5) for s in sensors)
    ]
    return int(np.linalg.matrix_rank(np.array(rows), tol=1e-3))


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What a sensor reads per unit of one of its unknowns, besides gain and offset."""

    of_rotor: tuple[float, float] | None = None
    """Per displacement (x, y) of the rotor at its node [1]."""
    of_slope: tuple[float, float] | None = None
    """Per slope (x, y) of the rotor there [m]."""
    of_housing: tuple[float, float] | None = None
    """Per displacement (x, y) of the housing of its bearing [1]."""


def _direction(sensor: Sensor) -> tuple[float, float]:
    return math.cos(float(sensor.angle)), math.sin(float(sensor.angle))


def _across(sensor: Sensor) -> Seen:
    cosine, sine = _direction(sensor)
    return Seen(of_rotor=(-sine, cosine))


def _with_housing(sensor: Sensor) -> Seen:
    cosine, sine = _direction(sensor)
    return Seen(of_housing=(-cosine, -sine))


PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        path="gain",
        owner="sensor",
        label="gain",
        kind="dimensionless",
        logarithmic=False,
        guess_sigma=0.01,
        scale="one",
        least_sigma=1e-12,
    ),
    Parameter(
        path="offset",
        owner="sensor",
        label="offset",
        kind="length",
        logarithmic=False,
        guess_sigma=0.04,
        scale=SMALLEST_GAP,
        least_sigma=1e-12,
    ),
)
"""Unknowns of every sensor."""

LAG = Parameter(
    path="time_constant",
    owner="sensor",
    label="time constant of the sensor",
    kind="time",
    shown_as="short_time",
    guess_sigma=0.1,
    reach=300.0,
    common_sigma=1.2,
)
"""Time by which a sensor lags behind."""

EXTENSIONS: tuple[Extension, ...] = (
    of_one_unknown(LAG, "sensor lag", 1e-5, ("µs", 1e-6), "sensors that lag behind by {}", alone=False),
    of_one_unknown(
        Parameter(
            path="cross_axis",
            owner="sensor",
            seen=_across,
            label="cross-axis sensitivity",
            kind="dimensionless",
            logarithmic=False,
            guess_sigma=0.03,
            given_sigma=0.003,
            lower=-0.3,
            upper=0.3,
            # what both sensors of a plane have in common is a turn of the plane, which friction looks like
            common_sigma=0.003,
            group="plane",
        ),
        "cross-axis sensitivity",
        0.0,
        ("%", 0.01),
        "sensors that read part of the motion across: {}",
    ),
    of_one_unknown(
        Parameter(
            path="follows_housing",
            owner="sensor",
            seen=_with_housing,
            label="part of the motion of the housing that the bracket makes",
            kind="dimensionless",
            logarithmic=False,
            guess_sigma=0.03,
            lower=-0.5,
            upper=1.5,
            common_sigma=0.3,
            group="plane",
        ),
        "brackets that follow the housing",
        0.0,
        ("%", 0.01),
        "brackets that make part of the motion of the housing: {}",
    ),
    of_one_unknown(
        Parameter(
            path="plane_offset",
            owner="sensor",
            seen=lambda sensor: Seen(of_slope=_direction(sensor)),
            label="distance of the sensor from its node",
            kind="length",
            logarithmic=False,
            guess_sigma=0.001,
            scale="one",
            common_sigma=0.015,
            group="plane",
        ),
        "sensor planes elsewhere",
        0.0,
        ("mm", 1e-3),
        "sensors that stand beside their node: {}",
    ),
)
