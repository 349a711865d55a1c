"""The paper's route: the drop replayed open loop with what was identified of it (Neisi 2020, Fig. 4).

Its initial state the paper's way, by modal expansion, stands beside the smoothed one it starts from.

A replay cannot follow a chaotic drop for long: after some contacts its force is that of *a* drop like the
recorded one, so it has no interval; the tracked twin, from whose smoothed estimate it starts, has.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.touchdown_bearing import AIR_GAP
from rotordrop.errors import IdentificationError
from rotordrop.estimate.agreement import compare_orbits
from rotordrop.estimate.assumptions import twin_assumptions
from rotordrop.estimate.bearing_drop import AirGap, FirstContact, Motion, Origin, simulated_bearings
from rotordrop.estimate.bearing_drop import Role as MotionRole
from rotordrop.estimate.bearing_values import bearing_values
from rotordrop.estimate.estimate import Estimate, Replay, ReplaySteps, Verdict
from rotordrop.estimate.published import Expansion, InitialState, later_warning
from rotordrop.estimate.record_facts import RecordFacts
from rotordrop.evidence.contacts import identify_first_contacts, local_polynomial
from rotordrop.evidence.evidence import Missing, sought
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate.case import DropCase, StateStart
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.result import DropResult
from rotordrop.track.input_state import at_bearings
from rotordrop.track.problem import parameters_at
from rotordrop.twin.tracked import TrackedDrop
from rotordrop.twin.tracked_estimate import measured_motion, motion_later
from rotordrop.twin.tracked_loads import widening_of
from rotordrop.twin.tracked_parameters import joint_estimate, parameters

SMOOTHING = 2e-3
"""Width of the window from which displacement and velocity at power-off are taken [s]."""


@dataclass(frozen=True, kw_only=True)
class ExpandedState:
    """Initial state by modal expansion; m modes per plane, B bearings."""

    amplitudes: Array
    """Amplitudes (x, y) and their velocities; zero beyond the modes used, shape (2, m, 2)."""
    at_bearings: Array
    """Displacement [m] and velocity [m/s] at the bearing nodes, shape (2, B, 2)."""


def expansion_matrix(rows: Array, modes: int) -> Array:
    """Amplitudes of the lowest modes per measured displacement, ``(QΦ)^+``, shape (2·modes, S).

    ``rows`` (S, 2m) is the displacement along each sensor per amplitude, QΦ of all modes, x amplitudes before
    y; of the modes per plane at most half the number of sensors can be used.

    Source: Neisi 2020, eqs. (14)–(16). Differs from the paper: pseudo-inverse with a rank check instead of
    the normal equations.

    Raises
    ------
    IdentificationError
        If the sensors cannot tell these modes apart.
    """
    m = rows.shape[1] // 2
    chosen = rows[:, [*range(modes), *range(m, m + modes)]]
    strength = np.linalg.svd(chosen / np.maximum(np.linalg.norm(chosen, axis=0), 1e-300), compute_uv=False)
    if len(chosen) < 2 * modes or strength[-1] < 0.02:
        weakest = strength[-1] if len(chosen) >= 2 * modes else 0.0
        raise IdentificationError(
            f"{len(chosen)} sensors cannot tell {modes} modes per plane apart: smallest singular value "
            f"{weakest:.2g}, "
            "at least 0.02 is needed. The sensor planes coincide or lie in a node of a mode: give the "
            "sensors' true nodes, or use fewer modes."
        )
    return np.asarray(np.linalg.pinv(chosen), dtype=np.float64)


def expand_initial_state(
    time: Array, along: Array, rows: Array, model: DropModel, *, modes: int = 2
) -> ExpandedState:
    """Initial displacement and velocity at all degrees of freedom by modal expansion.

    Displacements along the sensors (N, S) [m] have their zeros taken off, times (N,) count from power-off
    [s], ``rows`` (S, s) give the former from the states; 2 modes per plane are the rigid ones of the paper.

    Source: Neisi 2020, section 3.1. The velocity comes from a local polynomial through samples on both sides
    of power-off. Sensors need not sit at the bearing nodes.
    """
    live = np.isfinite(along).any(axis=0)
    known = np.isfinite(along[:, live]).all(axis=1)
    seen = local_polynomial(time[known], along[known][:, live], 0.0, width=SMOOTHING, order=2)
    x, y = model.layout.modal_x, model.layout.modal_y
    inverse = expansion_matrix(np.hstack([rows[live][:, x], rows[live][:, y]]), modes)
    amplitudes = np.zeros((2, model.basis.size, 2))
    amplitudes[:, :modes] = [(inverse @ one).reshape(2, modes).T for one in seen]
    return ExpandedState(amplitudes=amplitudes, at_bearings=model.parameters.bearing_shape @ amplitudes)


DURATION = 0.2
"""Part of the drop that is replayed [s]: that of Neisi 2020."""


def replayed_drop(drop: TrackedDrop, method: Replay, facts: RecordFacts) -> Estimate:
    """Replay a drop that the twin has followed.

    Raises
    ------
    IdentificationError
        If the model does not follow the record: a replay from there is none of that drop.

    Notes
    -----
    Source: Neisi 2020, Fig. 4. Differs from the paper: state at power-off, unbalance, remanent lift, air
    gaps, supports, contacts and friction come from a smoother over the drop, in place of a modal expansion,
    a least-squares fit of the first impacts and a sweep.
    """
    problem, evidence, machine = drop.problem, drop.evidence, drop.problem.model.machine
    if failed := [one.said() for one in drop.checks if one.failed]:
        raise IdentificationError(
            f"the model does not follow the record {evidence.name} ({'; '.join(failed)}), so a replay would "
            "be of another drop; take the tracked twin, which states ranges then"
        )
    found = parameters(problem, drop.smoothed, fits=True, widening=widening_of(drop.checks))
    values = {one.path: one.estimate for one in found}
    gaps = [values[AIR_GAP.path_of(name)] for name in problem.model.bearing_names]
    gap = np.array([one.value for one in gaps])
    ends = [np.array([getattr(one, end) for one in gaps]) for end in ("low", "high")]
    results = [_open_loop(drop, change) for change in (0.0 * gap, *(end - gap for end in ends))]
    result, states = results[0], problem.n_dynamic
    # as the sensors would show it: the straight rotor through their planes
    shown = [at_bearings(problem, one.state[:, :states] @ problem.sensor_rows.T) for one in results]
    time, measured = evidence.time, measured_motion(drop, evidence.readings(np.inf), believed=True)
    known = np.isfinite(measured).all(axis=(1, 2))
    inside = known & (time >= 0.0) & (time <= DURATION)
    noise = float(np.sqrt(np.mean(problem.variances)))
    shares, gravity = np.asarray(problem.model.load_shares), float(machine.gravity)
    contacts = identify_first_contacts(time[known], measured[known], gap, shares, gravity, noise)
    later = motion_later(drop, believed=True)
    bearings = []
    for b, simulated in enumerate(simulated_bearings(result, evidence.machine)):
        seen = Motion(label="measured", time=time[inside], displacement=measured[inside, b], role="measured")
        middle, lower, upper = (
            Motion(label=label, time=result.time, displacement=moved[:, b], role=role)
            for (label, role), moved in zip(_MOTIONS.items(), shown, strict=True)
        )
        own = bearing_values(machine, b, float(shares[b]), found)
        bearings.append(
            replace(
                simulated,
                peak_force=replace(simulated.peak_force, origin=Origin.REPLAY),
                peak_stress=replace(simulated.peak_stress, origin=Origin.REPLAY),
                motions=(seen, middle),
                at_gap_limits=(seen, lower, upper),
                air_gap=AirGap(lower=float(ends[0][b]), upper=float(ends[1][b])),
                values={**own, **simulated.values},
                first_contact=FirstContact(
                    start=contacts[b].start, end=contacts[b].end, indentation=contacts[b].indentation
                ),
            )
        )
    return Estimate(
        name=evidence.name,
        method=method,
        machine=machine,
        record=evidence.record,
        drop_instant=evidence.power_off,
        speed=float(problem.mean[problem.model.layout.rotor_speed]),
        until=float(result.time[-1]),
        verdict=Verdict.OPEN_LOOP,
        bearings=tuple(bearings),
        parameters=found,
        joint=joint_estimate(problem, drop.smoothed),
        structure=tuple(one.structure(machine, values, believed=True) for one in drop.accepted),
        agreement=compare_orbits(
            time[inside], measured[inside], shown[0], gap, result.bearing_names, at=result.time
        ),
        replay=ReplaySteps(contacts=contacts, initial_state=_initial_state(drop)),
        later=later,
        findings=facts.findings,
        warnings=facts.warnings_with(*evidence.power_off.notes, later_warning(later, DURATION)),
        notes=twin_assumptions(evidence, problem),
        simulated_record=facts.simulated,
    )


_MOTIONS: dict[str, MotionRole] = {
    "simulated": "simulated",
    "simulated, lower gap": "simulated, lower gap",
    "simulated, upper gap": "simulated",
}
"""Labels of the motions with the air gap and with its limits, and their roles."""


def _open_loop(drop: TrackedDrop, gap_change: Array) -> DropResult:
    """The drop simulated from its first sample on, its air gaps (B,) changed by so much [m]."""
    problem, means = drop.problem, drop.smoothed.means
    theta = means[drop.smoothed.filtered.parameter_sample][problem.parameter_slice]
    p, layout = parameters_at(problem, theta), problem.model.layout
    p.bearing[:, L.AIR_GAP] += gap_change
    p.bearing[:, L.ROTOR_RADIUS] -= gap_change
    bearings = problem.model.machine.touchdown_bearings
    p.bearing[:, L.SMOOTHING_SPEED] = [float(one.friction.smoothing_speed) for one in bearings]
    state = layout.zeros()
    state[: problem.n_dynamic] = means[0][: problem.n_dynamic]
    case = DropCase(speed=float(state[layout.rotor_speed]), duration=DURATION, start=StateStart(state=state))
    result = simulate_drop(replace(problem.model, parameters=p), case)
    if not result.finished:
        raise IdentificationError(f"a simulation with the identified values ended early. {result.outcome}")
    first, log = float(problem.time[0]), result.contacts  # times count from power-off
    log = replace(log, start=log.start + first, end=log.end + first, peak_time=log.peak_time + first)
    return replace(result, time=result.time + first, contacts=log)


def _initial_state(drop: TrackedDrop) -> InitialState:
    """Where the replay starts, and where the paper's would: by two rigid modes from the samples around it."""
    problem, evidence, at_off = drop.problem, drop.evidence, drop.smoothed.means[0]
    layout, p = problem.model.layout, problem.model.parameters
    identified = parameters_at(problem, at_off[problem.parameter_slice])

    def by_bearing(values: Array) -> dict[str, list[float]]:
        return dict(zip(problem.model.bearing_names, values.tolist(), strict=True))

    def of_rotor(x: slice, y: slice) -> dict[str, list[float]]:
        return by_bearing(p.bearing_shape @ np.column_stack([at_off[x], at_off[y]]))

    gains, offsets = problem.sensor_errors(drop.smoothed.means[-1])
    along = (evidence.readings(np.inf) - offsets) / (1.0 + gains)
    expanded = sought(lambda: expand_initial_state(evidence.time, along, problem.sensor_rows, problem.model))
    expansion: dict[str, Expansion] = {}
    if not isinstance(expanded, Missing):
        place, velocity = map(by_bearing, expanded.at_bearings)
        expansion["modal_expansion"] = Expansion(displacement_m=place, velocity_m_per_s=velocity)
    return InitialState(
        displacement_m=of_rotor(layout.modal_x, layout.modal_y),
        velocity_m_per_s=of_rotor(layout.velocity_of(layout.modal_x), layout.velocity_of(layout.modal_y)),
        remanent_force_N=identified.magnet[:, L.REMANENT_X : L.REMANENT_Y + 1].tolist(),
        remanence_time_constant_s=float(identified.spin[L.REMANENCE_TIME_CONSTANT]),
        **expansion,
    )
