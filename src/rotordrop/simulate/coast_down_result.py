"""What remains of a simulated coast-down: statistics per second, peaks with their time, whirl, energy."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.document import stated
from rotordrop.labelled import Stored
from rotordrop.simulate.case import FIRST_WINDOW
from rotordrop.simulate.result import SimulationResult
from rotordrop.units import format_quantity

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
QUANTITIES: Mapping[str, tuple[str, str]] = {
    "indentation": ("length", "m"),
    "bearing force": ("force", "N"),
    "Hertz stress": ("pressure", "Pa"),
}
"""Quantities whose peaks and quantiles are kept: kind for `format_quantity`, SI unit."""


@dataclass(frozen=True, kw_only=True)
class Maximum:
    """The largest value of a quantity over a coast-down, and whether the first 0.2 s held it."""

    quantity: str
    bearing: str
    """What, and where."""
    value: float
    time: float
    """Largest value [SI] and when [s]."""
    later: float
    later_time: float
    """Largest value after the first 0.2 s [SI] on the output grid, and the middle of the second in which it
    came [s]; NaN when the simulation ends before."""

    @property
    def in_first_window(self) -> bool:
        """Whether the largest value came within the first 0.2 s."""
        return self.time <= FIRST_WINDOW

    def sentence(self) -> str:
        """The finding in words."""
        kind = QUANTITIES[self.quantity][0]
        when = "within" if self.in_first_window else "after"
        text = (
            f"{self.bearing}: the largest {self.quantity} of {format_quantity(self.value, kind)} came at "
            f"{format_quantity(self.time, 'time')}, {when} the first {format_quantity(FIRST_WINDOW, 'time')}"
        )
        if not np.isfinite(self.later):
            return f"{text}; nothing later was simulated."
        share = f"{100.0 * self.later / self.value:.0f} %" if self.value > 0.0 else "none"
        if share == "100 %":
            return f"{text}; it was equalled at {format_quantity(self.later_time, 'time')}."
        return f"{text}; the largest one after that is {share} of it."

    def as_json(self) -> dict[str, Any]:
        """All fields, ready for JSON."""
        finite = np.isfinite(self.later)
        return stated(
            self,
            "quantity bearing unit value time_s within_first_0.2_s=in_first_window largest_later=later "
            "largest_later_time_s statement=sentence",
            unit=QUANTITIES[self.quantity][1],
            largest_later_time_s=self.later_time if finite else None,
        )


def first_window_sentence(maxima: Iterable[Mapping[str, Any]]) -> str:
    """Whether the first 0.2 s held the largest values of a coast-down, as JSON, in one sentence."""
    later = [
        f"{one['bearing']} {one['quantity']} ({format_quantity(one['time_s'], 'time')})"
        for one in maxima
        if not one["within_first_0.2_s"]
    ]
    if later:
        return f"Largest only after the first {FIRST_WINDOW:g} s: {', '.join(later)}."
    return f"The first {FIRST_WINDOW:g} s held the largest indentation, force and stress of every bearing."


@dataclass(frozen=True, kw_only=True)
class WindowStatistics:
    """Statistics window by window: the first 0.2 s, the rest of the first second, then second by second."""

    start: Array
    end: Array
    """Limits of the windows [s], shape (W,)."""
    speed: Array
    """Rotor speed at the end of each [rad/s], shape (W,)."""
    race_speed: Array
    """Race spin at the end of each [rad/s], shape (W, B)."""
    dissipated: Array
    """Energy lost in contacts, bearings, supports and rotor damping within each [J]; air drag apart, shape
    (W,)."""
    contacts: Array
    """Contacts that began within each [1], shape (W, B)."""
    contact_share: Array
    """Share of the time in contact [1], shape (W, B)."""
    peak: Array
    """Largest value on the output grid, last axis in the order of `QUANTITIES` [m, N, Pa], shape (W, B, 3).
    """
    quantile: Array
    """Quantiles at the levels `QUANTILES` of the samples, indentation as −depth when in flight [m, N, Pa],
    shape (W, B, 3, Q)."""
    energy_residual: Array
    """Stored, dissipated and supplied energy out of balance at the end of each, since the start [J], shape
    (W,)."""
    settled: Array
    """Share of the window done with the scheme for settled rotors [1], and how far it was from the
    Runge–Kutta pair over the first 2 ms: displacement at the bearings [m], ball force [N], shape (W, 3)."""


@dataclass(frozen=True, kw_only=True)
class CoastDownResult(SimulationResult):
    """One simulated coast-down, reduced to statistics; the samples are in the file at ``path``, if any."""

    output_step: float
    end_time: float
    """Time reached [s]."""
    standstill_time: float | None
    """When the rotor stopped [s]."""
    windows: Annotated[WindowStatistics, Stored(prefix="statistics/windows/")]
    """Statistics second by second."""
    peak_value: Annotated[Array, Stored(name="statistics/peak_value")]
    peak_time: Annotated[Array, Stored(name="statistics/peak_time")]
    """Largest values at the integrator's own steps [m, N, Pa] and their times [s], shape (B, 3)."""
    whirl_time: Annotated[Array, Stored(name="statistics/whirl_time")]
    """Time of forward and backward whirl, whole turns round the race only [s], shape (B, 2)."""
    contacts: Annotated[Array, Stored(name="statistics/contacts")]
    """Number of contacts, shape (B,)."""
    contact_energy: Annotated[Array, Stored(name="statistics/contact_energy")]
    """Energy lost in contact and friction at each bearing [J], shape (B,)."""
    dissipated: float
    air_work: float
    """Energy lost in all of the machine, and work done by air drag and unbalance (mostly negative) [J]."""
    energy_residual: float
    energy_scale: float
    """Largest imbalance of energy, and the energy it is to be compared with [J]."""
    sensor_nodes: Annotated[NDArray[np.int64], Stored(name="sensor_node")]
    """Nodes of the sensor planes, counted from 1."""
    air_gap: Array
    """Air gaps of the bearings [m], shape (B,)."""
    path: Path | None = None
    """Where the samples are."""

    def maxima(self) -> tuple[Maximum, ...]:
        """When the largest indentation, force and stress of every bearing came: does 0.2 s hold them?"""
        windows = self.windows
        later = windows.start >= FIRST_WINDOW - 1e-9
        found = []
        for b, bearing in enumerate(self.bearing_names):
            for q, quantity in enumerate(QUANTITIES):
                value, when = np.nan, np.nan
                if np.any(later):
                    best = int(np.argmax(np.where(later, windows.peak[:, b, q], -np.inf)))
                    value = float(windows.peak[best, b, q])
                    when = 0.5 * float(windows.start[best] + windows.end[best])
                found.append(
                    Maximum(
                        quantity=quantity,
                        bearing=bearing,
                        value=float(self.peak_value[b, q]),
                        time=float(self.peak_time[b, q]),
                        later=value,
                        later_time=when,
                    )
                )
        return tuple(found)

    def as_json(self) -> dict[str, Any]:
        """Everything but the samples, ready for JSON, SI units."""

        def named(values: Iterable[Any]) -> dict[str, Any]:
            return dict(zip(self.bearing_names, values, strict=True))

        found = stated(
            self,
            "machine=machine_name bearings=bearing_names initial_speed_rad_s=initial_speed tolerance "
            "reduction output_step_s end_time_s standstill_time_s finished outcome maxima whirl_s contacts "
            "contact_energy_J dissipated_J air_work_J energy_residual_J energy_scale_J steps rejected_steps "
            "quantile_levels quantities windows samples",
            whirl_s=named(dict(zip(("forward", "backward"), one, strict=True)) for one in self.whirl_time),
            contacts=named(map(int, self.contacts)),
            contact_energy_J=named(self.contact_energy),
            quantile_levels=QUANTILES,
            quantities=list(QUANTITIES),
            windows={name: np.round(value, 12) for name, value in vars(self.windows).items()},
            samples=None if self.path is None else str(self.path),
        )
        return found | ({} if self.heat is None else {"heat": self.heat.as_json(self.bearing_names)})
