"""Magnets in the loop of a simulated drop: how it starts, what happens to them, what they did."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rotordrop.arrays import Array
from rotordrop.errors import SimulationError
from rotordrop.physics import columns as L
from rotordrop.physics import magnet as law
from rotordrop.physics.columns import KernelParameters
from rotordrop.physics.magnet_loop import SampledController, sampled_response
from rotordrop.rotor.magnet_loop import growth_with, stability
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate import _sampled as S
from rotordrop.simulate.case import LevitatedStart, MagnetEvent, Simulated
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    from rotordrop.simulate.result import ContactLog

MODES = {"off": law.OFF, "levitate": law.LEVITATES, "hold": law.HOLDS, "lost": law.LOST}
MODES |= {"bias decays": law.DECAYS}
CALM = 0.02
"""Time [s] without contact that makes a lift a success; chosen, longer than a flight through the gap."""
UNBLAMED = 0.01
"""Part of a holding current that the states of a controller may leave out [1]: rounding of its matrices."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MagnetHistory:
    """What magnets in the loop did in a drop; axes: time T, magnet A, axis x and y, coil + and -."""

    names: tuple[str, ...]
    """Names of the AMBs."""
    current: Array
    """Current of every coil [A], shape (T, A, 2, 2)."""
    force: Array
    """Force on the rotor [N], shape (T, A, 2)."""
    events: tuple[str, ...]
    """What happened to them."""
    event_time: Array
    """When [s], shape (E,); NaN of what did not."""

    @property
    def lift_time(self) -> float | None:
        """Time [s] at which controllers last began to hold the rotor anew; None where they never did."""
        found = [
            float(time)
            for text, time in zip(self.events, self.event_time, strict=True)
            if text.startswith("levitate") and np.isfinite(time)
        ]
        return found[-1] if found else None


@dataclass(frozen=True, kw_only=True)
class Lift:
    """How the magnets lifted a rotor that lay in its touchdown bearings, or failed to."""

    begun: float
    """When the controllers began [s]."""
    free_from: float | None
    """From when on the rotor touches nothing any more [s]; None where it still touched at the end."""
    succeeded: bool
    """Whether it was free of contact for the last 20 ms and longer."""
    contacts: int
    """Contacts that began after the controllers did."""

    def sentence(self) -> str:
        """What became of the lift."""
        begun = format_quantity(self.begun, "time", 3)
        if self.free_from is None or not self.succeeded:
            return f"The magnets, switched on again at {begun}, do not lift the rotor within this simulation"
        took = format_quantity(self.free_from - self.begun, "time", 3)
        again = {0: "without a further contact", 1: "after one further contact"}
        after = again.get(self.contacts, f"after {self.contacts} further contacts")
        return f"The magnets, switched on again at {begun}, lift the rotor within {took}, {after}"


def lift_of(magnets: MagnetHistory | None, contacts: ContactLog, end: float) -> Lift | None:
    """What became of the last lift of a drop that ended at a time [s]; None without any."""
    begun = None if magnets is None else magnets.lift_time
    if begun is None:
        return None
    later = contacts.start > begun
    last = float(np.max(contacts.end, initial=begun)) if np.all(np.isfinite(contacts.end)) else None
    free_from = None if last is None else max(last, begun)
    succeeded = free_from is not None and end - free_from >= CALM
    return Lift(begun=begun, free_from=free_from, succeeded=succeeded, contacts=int(np.sum(later)))


def table_of_events(model: DropModel, events: tuple[MagnetEvent, ...]) -> Array:
    """Events for the time loop, shape (E, 6)."""
    names = [amb.name for amb in model.machine.ambs]
    table = np.full((len(events), S.N_EVENT_COLUMNS), -1.0)
    for row, event in zip(table, events, strict=True):
        if event.magnet is not None and event.magnet not in names:
            raise SimulationError(
                f"an event names the magnet {event.magnet!r}; the machine has {', '.join(names)}"
            )
        kinds = (
            (event.time, S.AT_TIME),
            (event.below_speed, S.BELOW_SPEED),
            (event.rest_velocity, S.AT_REST),
        )
        row[[S.EVENT_VALUE, S.EVENT_KIND]] = next(one for one in kinds if one[0] is not None)
        row[S.EVENT_MODE], row[S.EVENT_TIME] = MODES[event.action], np.nan
        if event.magnet is not None:
            row[S.EVENT_MAGNET] = names.index(event.magnet)
        if event.axis is not None:
            row[S.EVENT_AXIS] = "xy".index(event.axis)
    return table


def refuse_unstable(model: DropModel, speed: float) -> None:
    """Refuse a loop that does not hold the rotor at a speed [rad/s], with its margin."""
    controller = model.machine.looped_ambs[0].controller
    assert controller is not None
    if growth_with(model, speed)(controller.delay.value)[0] >= 0.0:
        shown, found = format_quantity(speed, "speed"), stability(model, speed)
        raise SimulationError(f"{model.machine.name!r} at {shown}: {found.sentence()}")


def equivalent_springs(model: DropModel, speed: float) -> Array:
    """Stiffness [N/m] and damping [N s/m] of each AMB in the loop at a speed [rad/s], shape (A, 2)."""
    rows = []
    for amb in model.machine.looped_ambs:
        assert amb.magnet is not None
        assert amb.controller is not None
        by_current, by_way = amb.magnet.slopes
        controller = amb.controller
        response = sampled_response(
            speed, controller.sampled, controller.sample_time.value, controller.delay.value
        )
        lag = 1.0 + 1j * speed / (2.0 * np.pi * amb.magnet.bandwidth.value)
        whole = by_current * response / lag - by_way
        rows.append((whole.real, whole.imag / speed))
    return np.array(rows)


def with_springs_of(model: DropModel, case: Simulated) -> DropModel:
    """The model whose AMBs are, as springs and dampers, what their controllers are at the speed of a case."""
    if case.speed == 0.0:
        return model
    magnet = model.parameters.magnet.copy()
    magnet[:, [L.AMB_STIFFNESS, L.AMB_DAMPING]] = equivalent_springs(model, abs(case.speed))
    return replace(model, parameters=model.parameters._replace(magnet=magnet))


def start_loop(
    model: DropModel, case: Simulated, holding: Array, state: Array, parameters: KernelParameters
) -> KernelParameters:
    """Parameters of a drop with magnets in the loop that have forces (A, 2) to hold [N].

    Of a levitated start the currents are put into the state and the controllers have settled: they hold the
    weight from the first sample on. A controller without integral has the weight compensated, always.
    """
    levitated = isinstance(case.start, LevitatedStart)
    if levitated or any(event.action == "levitate" for event in case.magnets or ()):
        refuse_unstable(model, case.speed)
    parameters = parameters._replace(memory=parameters.memory.copy(), magnet=parameters.magnet.copy())
    for a, amb in enumerate(model.machine.looped_ambs):
        assert amb.controller is not None
        row, numbers = parameters.magnet[a], parameters.magnet[a, L.LOOP : L.LOOP_END]
        for axis in range(2):
            control = _holding_current(
                amb.name, numbers, float(row[L.AMB_REFERENCE_X + axis]), holding[a, axis]
            )
            states = _settled(amb.controller.sampled, control)
            if states is None:
                numbers[law.FEED + axis] = control
            if not levitated:
                continue
            first = parameters.magnet_at[a, L.MAGNET_MEMORY] + axis * law.N_AXIS
            kept = parameters.memory[first : first + law.N_AXIS]
            kept[[law.MODE, law.REFERENCE, law.LAST]] = law.LEVITATES, control, control
            kept[law.PENDING :] = control
            if states is not None:
                kept[law.STATES : law.STATES + len(states)] = states
            own = parameters.magnet_at[a, L.MAGNET_OWN] + 2 * axis
            state[own : own + 2] = numbers[law.BIAS] + control, numbers[law.BIAS] - control
    return parameters


def _settled(controller: SampledController, control: float) -> Array | None:
    """States of a controller that puts out a constant current [A] without any input; None where none do."""
    n = len(controller.step)
    system = np.vstack([np.eye(n) - controller.step, controller.output[None, :]])
    wanted = np.concatenate([np.zeros(n), [control]])
    states = np.linalg.lstsq(system, wanted, rcond=None)[0]
    missed = float(np.max(np.abs(system @ states - wanted)))
    return np.asarray(states) if missed <= UNBLAMED * abs(control) else None


def _holding_current(name: str, numbers: Array, x: float, force: float) -> float:
    """Control current [A] with which an axis of a magnet pulls a force [N] at x [m]."""
    bias, gap = numbers[law.BIAS], numbers[law.GAP]
    limit = min(numbers[law.CURRENT_LIMIT], bias, numbers[law.OUTPUT_LIMIT])

    def pull(control: float) -> float:
        return float(law.magnet_force(numbers[law.FORCE], gap, x, bias + control, bias - control)[0])

    if not pull(-limit) <= force <= pull(limit):
        most, load = (format_quantity(abs(one), "force") for one in (pull(limit), force))
        raise SimulationError(
            f"the magnet of AMB {name} pulls {most} at most and has {load} to hold; raise its "
            "current_limit or bias, or check its turns and pole_area"
        )
    low, high = -limit, limit
    for _ in range(60):  # the force rises with the current
        middle = 0.5 * (low + high)
        low, high = (low, middle) if pull(middle) > force else (middle, high)
    return float(0.5 * (low + high))
