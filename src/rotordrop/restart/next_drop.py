"""What the next drop would be, up to which speed it keeps to limits, whether the rotor can be lifted now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rotordrop.estimate.published import Drop, Parameter
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.machine.calibration import CalibrationDrop, CalibrationOrigin
from rotordrop.progress import Progress
from rotordrop.restart.card import Foreseen, LiftNow, NextDrop
from rotordrop.rotor.magnet_loop import carrying_currents
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.unknowns import all_unknowns, smallest_gap
from rotordrop.study.distributions import Distribution
from rotordrop.study.plan import Study
from rotordrop.study.quantities import LIFT
from rotordrop.study.repeat import COMPARED, OFF_CENTRE, repeat_study
from rotordrop.study.run import run_study
from rotordrop.study.summary import StudyResults, exceedance
from rotordrop.track.prior import fall_time
from rotordrop.twin.calibrated import as_filed, joint_covariance, machine_values
from rotordrop.twin.problems import WINDOW
from rotordrop.twin.tracked_parameters import NOT_DETERMINED

DROPS = 24
"""Drops behind the prediction at full speed, half as many at each lower one; chosen, not measured: intervals
say what they tell."""
SHARES = (1.0, 0.8, 0.6, 0.4, 0.25)
"""Speeds at which drops are simulated where a speed limit is sought, over the full one [1]; chosen, not
measured."""
MOST_BEYOND = 0.05
"""Share of the simulated drops that may pass a limit at and below a speed limit [1]; chosen."""
LONGER = 1.25
"""Time simulated over that of the last drop's largest motion after its estimated part [1]; chosen."""

LIFTS = 12
"""Simulated lifts; chosen, not measured: the interval of the share says what they tell."""
LIFT_BEGINS, LIFT_ENDS = 40.0, 60.0
"""When the magnets take the rotor up again, and the end, over the time of a fall [1]; chosen. Twelve lifts of
one machine took 1.6 falls at most."""


def found_machine(machine: Machine, drop: Drop) -> Machine | None:
    """The machine as the estimate of a drop found it: gaps, supports and friction with their joint intervals.

    None where the estimate has no joint distribution, or does not fit its record. What the
    record does not determine keeps the width it had before.
    """
    joint = drop.joint
    if joint is None or not drop.consistent:
        return None
    known = {one.path: _as_known(one) for one in drop.parameters if one.scope == "machine"}
    model = build_drop_model(machine)
    by_path = {one.path: one for one in all_unknowns(model)}
    at = [k for k, path in enumerate(joint.paths) if path in by_path and path in known]
    fitted = {joint.paths[k]: by_path[joint.paths[k]] for k in at}
    if not at:
        return None
    lower = np.zeros((len(joint.paths), len(joint.paths)))
    lower[np.tril_indices(len(joint.paths))] = joint.covariance
    covariance = (lower + np.tril(lower, -1).T)[np.ix_(at, at)]
    known = as_filed(machine, {path: known[path] for path in fitted})
    spread = joint_covariance(model, fitted, [joint.mean[k] for k in at], covariance, known)
    names = [bearing.name for bearing in machine.touchdown_bearings]
    values = machine_values(names, known, f"estimated from {drop.record}")
    before = () if machine.calibration is None else machine.calibration.drops
    origin = CalibrationOrigin(
        drops=(
            *(one for one in before if one.name != drop.record),
            CalibrationDrop(name=drop.record, sha256=drop.record_sha256),
        ),
        consistent=True,
        joint=spread,
    )
    return machine.with_values(values).calibrated_on(origin)


def _as_known(one: Parameter) -> Known:
    """An estimated parameter; one that the record does not determine is as wide as it was before."""
    status, value, ends = one.estimate.status or "determined", one.estimate.value, one.estimate.interval
    before = None if one.prior is None else one.prior.interval
    if status in NOT_DETERMINED and before is not None:
        ends = min(before[0], value), max(before[1], value)
    return Known(value=value, status=status, interval_90=ends, unit=one.estimate.unit)  # type: ignore[arg-type]


def next_drops(
    machine: Machine,
    speed: float,
    limits: Mapping[str, float],
    *,
    drop: Drop | None = None,
    shares: Sequence[float] | None = None,
    drops: int = DROPS,
    duration: float | None = None,
    progress: Progress | None = None,
) -> Foreseen:
    """Simulate the drops that could happen next, at a speed [rad/s] and at shares of it.

    ``limits`` are known by the field of an estimate document (``"peak_stress_Pa"``) [SI]; with them the speed
    is sought up to which a share `MOST_BEYOND` of the drops at most passes them. The machine is that of
    ``drop``, by its estimate, where there is one; what stays open varies as in `repeat_study`. Damage is not
    simulated.
    By default 0.2 s are simulated, or until past where the rotor went further out than that in ``drop`` [s].
    """
    if duration is None:
        later = [] if drop is None else [one.later_time for one in drop.later_motion if one.larger]
        duration = max(WINDOW, LONGER * max(later, default=0.0))
    found = None if drop is None else found_machine(machine, drop)
    at, names = found or machine, [bearing.name for bearing in machine.touchdown_bearings]
    shares = shares or (SHARES if limits else SHARES[:1])
    made = []
    for k, share in enumerate(shares):
        count = drops if k == 0 else max(drops // 2, 2)
        study = repeat_study(at, share * speed, duration=duration, drops=count)
        with TemporaryDirectory() as folder:
            results = run_study(study, Path(folder) / "drops", progress=False)
        beyond = [
            results.column(f"{name}.{COMPARED[field]}") / limit
            for field, limit in limits.items()
            for name in names
        ]
        worst = np.max(beyond, axis=0) if beyond else np.zeros(0)
        made.append(
            NextDrop(
                speed=share * speed,
                peak_force={name: _middle_and_high(results, f"{name}.peak_force") for name in names},
                peak_stress={name: _middle_and_high(results, f"{name}.peak_stress") for name in names},
                beyond_limit=exceedance(worst[np.isfinite(worst)], 1.0) if beyond else None,
            )
        )
        if progress is not None:
            progress("the next drop", (k + 1) / len(shares))
    return Foreseen(
        drops=tuple(made),
        duration=duration,
        speed_limit=speed_limit(made, MOST_BEYOND),
        chance=MOST_BEYOND,
        limits=dict(limits),
        of_estimate=found is not None,
    )


def lift_now(machine: Machine, *, drop: Drop | None = None, lifts: int = LIFTS) -> LiftNow | None:
    """Simulate lifts from where the rotor rests, at standstill; None without a magnet in its loop.

    The machine is that of ``drop``, by its estimate, where there is one, and varies as that leaves it open;
    the place of each magnet varies too. Damage is not simulated.
    """
    if not machine.has_loops:
        return None
    at = (None if drop is None else found_machine(machine, drop)) or machine
    fall, gap = fall_time(at), smallest_gap(at)
    off_centre = Distribution(shape="normal", numbers=(0.0, OFF_CENTRE * gap))
    origin = at.calibration
    study = Study(
        name=f"lift of {at.name}",
        machine=at,
        drops=lifts,
        duration=LIFT_ENDS * fall,
        relevitate=LIFT_BEGINS * fall,
        speed=0.0,
        vary={f"{amb.name}.offset_{axis}": off_centre for amb in at.ambs for axis in "xy"},
        calibrated=origin is not None and origin.joint is not None,
        shard=20,
    )
    with TemporaryDirectory() as folder:
        results = run_study(study, Path(folder) / "lifts", progress=False)
    took = results.column("lift_time")
    took = took[np.isfinite(took)]
    return LiftNow(
        probability=exceedance(results.column(LIFT), 0.5),
        took=(float(took.min()), float(took.max())) if len(took) else None,
        current=carrying_currents(at, build_drop_model(at).fe),
        limit={amb.name: float(amb.magnet.current_limit) for amb in at.ambs if amb.magnet is not None},
    )


def speed_limit(drops: Sequence[NextDrop], chance: float) -> float | None:
    """Highest speed of some drops at and below which no more than a share [1] of them passes a limit [rad/s].

    None where the lowest speed passes it more often.
    """
    found = None
    for one in sorted(drops, key=lambda one: one.speed):
        if one.beyond_limit is None or not one.beyond_limit.value <= chance:  # NaN where all drops failed
            break
        found = one.speed
    return found


def _middle_and_high(results: StudyResults, column: str) -> tuple[Known, Known]:
    """What half and 95 % of the drops stay below."""
    return results.quantile(column, 0.5), results.quantile(column, 0.95)
