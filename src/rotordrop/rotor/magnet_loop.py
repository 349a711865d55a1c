"""Control loops of the magnets of a machine: operating point, margins, stability of the whole rotor."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.document import stated
from rotordrop.elements.magnet import Controller, Magnet
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.physics.magnet_loop import (
    Lift,
    Margins,
    closed_loop,
    growth,
    linear_lift,
    margins,
    sampled_response,
)
from rotordrop.rotor.assembly import RotorFE
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.rotor.statics import rest_on
from rotordrop.units import format_quantity

MOST_DELAYS = 64.0
"""Delays beyond this multiple of the sample time are not looked at [1]: no controller has them."""


@dataclass(frozen=True, kw_only=True)
class LoopStability:
    """Whether controllers hold the rotor, bending included, at small motion about their reference."""

    growth: float
    """Rate at which motion grows fastest [1/s]; negative where the loop is stable."""
    frequency: float
    """Frequency of that motion [Hz]."""
    delay: float
    """Delay of the controllers [s]."""
    longest_delay: float | None
    """Delay up to which the loop is stable [s]; None where it is not without any either."""

    @property
    def stable(self) -> bool:
        """Whether motion decays."""
        return self.growth < 0.0

    def as_json(self) -> dict[str, Any]:
        """Give it ready for JSON, SI units."""
        return stated(self, "stable growth_per_s frequency_Hz delay_s longest_delay_s")

    def sentence(self) -> str:
        """What is wrong with a loop that is not stable, with its margin; else what is left."""
        delay = format_quantity(self.delay, "time", 3)
        longest = None if self.longest_delay is None else format_quantity(self.longest_delay, "time", 3)
        if self.stable:
            return f"the control loop holds the rotor; its delay of {delay} may grow to {longest}"
        rate, frequency = f"{self.growth:.3g} 1/s", format_quantity(self.frequency, "frequency", 3)
        way_out = f"it is stable up to a delay of {longest}: shorten the delay, or change its gains"
        if longest is None:
            way_out = "no shorter delay makes it stable: change its gains, or filter the bending modes"
        return (
            f"the control loop is unstable: motion at {frequency} grows by {rate} with a delay of {delay}; "
            f"{way_out}"
        )


def plant_of(model: DropModel, speed: float) -> tuple[Array, Array, Array]:
    """Rotor in its magnets at a speed [rad/s] for `closed_loop`: modes, velocities, control currents.

    Inputs and measured places are x and y of each AMB in turn.
    """
    p, ambs = model.parameters, model.machine.looped_ambs
    m, n_a = len(p.eigenvalue), len(ambs)
    n = 4 * m + 2 * n_a
    rate, entry, seen = np.zeros((n, n)), np.zeros((n, 2 * n_a)), np.zeros((2 * n_a, n))
    rate[: 2 * m, 2 * m : 4 * m] = np.eye(2 * m)
    for plane in range(2):
        q, s = slice(plane * m, (plane + 1) * m), slice((2 + plane) * m, (3 + plane) * m)
        rate[s, q], rate[s, s] = -np.diag(p.eigenvalue), -np.diag(p.damping)
        across = slice((3 - plane) * m, (4 - plane) * m)
        rate[s, across] = (-1.0 if plane == 0 else 1.0) * speed * p.polar
        for a, amb in enumerate(ambs):
            assert amb.magnet is not None
            by_current, by_way = amb.magnet.slopes
            bandwidth, i = 2.0 * math.pi * amb.magnet.bandwidth.value, 2 * a + plane
            rate[s, q] += by_way * np.outer(p.magnet_shape[a], p.magnet_shape[a])
            rate[s, 4 * m + i] = by_current * p.magnet_shape[a]
            rate[4 * m + i, 4 * m + i], entry[4 * m + i, i] = -bandwidth, bandwidth
            seen[i, q] = p.magnet[a, L.LOOP_END :]
    return rate, entry, seen


def growth_with(model: DropModel, speed: float) -> Callable[[float], tuple[float, float]]:
    """Growth [1/s] and frequency [Hz] of the loops of a model built with ``loops``, by their delay [s].

    At a speed [rad/s], of the motion that grows fastest.
    """
    plant = plant_of(model, speed)
    controllers = [amb.controller for amb in model.machine.looped_ambs if amb.controller is not None]
    sampled = [one.sampled for one in controllers for _axis in range(2)]
    period = controllers[0].sample_time.value
    return lambda delay: growth(closed_loop(plant, sampled, period, delay), period)


def stability(model: DropModel, speed: float) -> LoopStability:
    """Stability of the sampled loops of a model built with ``loops`` at a speed [rad/s], with its margin."""
    grows, controller = growth_with(model, speed), model.machine.looped_ambs[0].controller
    assert controller is not None
    period, delay = controller.sample_time.value, controller.delay.value
    rate, frequency = grows(delay)
    low, high = (delay, None) if rate < 0.0 else (None, delay)
    step = period
    while high is None and low is not None and low < MOST_DELAYS * period:
        low, high = (low + step, None) if grows(low + step)[0] < 0.0 else (low, low + step)
        step *= 2.0
    if low is None and grows(0.0)[0] < 0.0:
        low = 0.0
    if low is not None and high is not None:
        for _ in range(12):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if grows(middle)[0] < 0.0 else (low, middle)
    return LoopStability(growth=rate, frequency=frequency, delay=delay, longest_delay=low)


def loop_of(machine: Machine) -> LoopStability | None:
    """Stability of the loops of a machine at nominal speed; None where an AMB lacks magnet or controller."""
    if not machine.has_loops:
        return None
    return stability(build_drop_model(machine, loops=True), float(machine.speed.nominal))


@dataclass(frozen=True, kw_only=True)
class MagnetSummary:
    """One magnet, with the mass that its AMB carries as a point."""

    name: str
    """Name of the AMB."""
    by_current: float
    """Force by current k_i [N/A]."""
    by_way: float
    """Force by displacement k_s [N/m]: a negative stiffness."""
    inductance: float
    """Inductance of a coil [H]."""
    spare_at_rest: float
    """Pull at full current on the rotor at rest in its touchdown bearings, less the weight carried [N]."""
    lift: Lift
    """Lift from there by full current, by the two slopes alone."""
    margins: Margins | None
    """Crossover, phase and delay margin; None without a controller, or where the gain never falls through
    one."""

    def as_json(self) -> dict[str, Any]:
        """Give it ready for JSON, SI units."""
        known = stated(
            self,
            "force_by_current_N_per_A=by_current negative_stiffness_N_per_m=by_way inductance_H "
            "spare_force_at_rest_N=spare_at_rest linear_lift",
            linear_lift=stated(self.lift, "deepest_m time_s speed_m_per_s"),
        )
        if self.margins is None:
            return known
        crossover = self.margins.crossover / (2.0 * math.pi)
        keys = "crossover_Hz phase_margin_rad=phase delay_margin_s=delay"
        return known | stated(self.margins, keys, crossover_Hz=crossover)


def magnet_summaries(machine: Machine, fe: RotorFE) -> tuple[MagnetSummary, ...]:
    """What every described magnet of a machine amounts to."""
    depth = _depth(machine)
    found = []
    for amb, mass in zip(machine.ambs, _carried_masses(machine, fe), strict=True):
        if amb.magnet is None:
            continue
        (by_current, by_way), limit = amb.magnet.slopes, amb.magnet.current_limit.value
        most, weight = amb.magnet.pull(-depth, limit), mass * float(machine.gravity)
        found.append(
            MagnetSummary(
                name=amb.name,
                by_current=by_current,
                by_way=by_way,
                inductance=amb.magnet.inductance,
                spare_at_rest=most - weight,
                lift=linear_lift(mass, amb.magnet.slopes, limit, weight, depth),
                margins=None if amb.controller is None else _margins(amb.magnet, amb.controller, mass),
            )
        )
    return tuple(found)


def carrying_currents(machine: Machine, fe: RotorFE) -> dict[str, float | None]:
    """Control current [A] with which each described magnet carries its share of a rotor that rests in the
    touchdown bearings; None where that is beyond its limit.
    """
    from scipy.optimize import brentq  # slow to load, and most commands do without

    depth = _depth(machine)
    found: dict[str, float | None] = {}
    for amb, mass in zip(machine.ambs, _carried_masses(machine, fe), strict=True):
        if amb.magnet is None:
            continue
        weight, most = mass * float(machine.gravity), amb.magnet.current_limit.value

        def spare(current: float, magnet: Magnet = amb.magnet, weight: float = weight) -> float:
            return magnet.pull(-depth, current) - weight

        if spare(most) < 0.0:
            found[amb.name] = None
        else:
            found[amb.name] = float(brentq(spare, 0.0, most)) if spare(0.0) < 0.0 else 0.0
    return found


def _depth(machine: Machine) -> float:
    """Way [m] from the centre of the magnets to a rotor at rest in its touchdown bearings."""
    return max(bearing.air_gap.value for bearing in machine.touchdown_bearings)


def _carried_masses(machine: Machine, fe: RotorFE) -> list[float]:
    """Mass [kg] that each AMB carries as a point."""
    nodes = [amb.node for amb in machine.ambs]
    if len(set(nodes)) == len(nodes) > 1:
        return [float(mass) for mass in rest_on(fe, nodes, 1.0)[1]]
    return [machine.rotor.mass / max(1, len(nodes))] * len(nodes)


def _margins(magnet: Magnet, controller: Controller, mass: float) -> Margins | None:
    by_current, by_way = magnet.slopes
    sampled, period, delay = controller.sampled, controller.sample_time.value, controller.delay.value
    bandwidth = 2.0 * math.pi * magnet.bandwidth.value

    def loop(w: float) -> complex:
        response = sampled_response(w, sampled, period, delay)
        return by_current * response / (1.0 + 1j * w / bandwidth) / (-mass * w * w - by_way)

    return margins(loop, 1e-2 * math.sqrt(by_way / mass), math.pi / period)
