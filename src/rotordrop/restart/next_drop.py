"""What the next drop would be, up to which speed it keeps to limits, whether the rotor can be lifted now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rotordrop.arrays import Array
from rotordrop.estimate.published import Drop, Parameter
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.machine.calibration import CalibrationDrop, CalibrationOrigin
from rotordrop.progress import Progress
from rotordrop.restart.foreseen import Foreseen, LiftNow, NextDrop, SpeedLimit
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
from rotordrop.twin.calibrated import as_filed, machine_values
from rotordrop.twin.joint_covariance import joint_covariance
from rotordrop.twin.problems import WINDOW
from rotordrop.twin.tracked_parameters import NOT_DETERMINED

DROPS = 24
"""Drops behind the prediction at full speed, half as many at each lower one; chosen, not measured: intervals
say what they tell."""
FEWEST = 20
"""Drops below which the 95 % that next drops stay below is not known."""
SHARES = (1.0, 0.8, 0.6, 0.4, 0.25)
"""Speeds at which drops are simulated where a speed limit is sought, over the full one [1]; chosen, not
measured."""
MOST_BEYOND = 0.05
"""Chance that the next drop passes a limit, to which a speed limit brings it down [1]; chosen."""
LONGER = 1.25
"""Time simulated over that of the last drop's largest motion after its estimated part [1]; chosen."""
DRAWN_AGAIN = 400
"""Sets of drops drawn from those simulated for the interval of a speed limit; chosen, not measured."""

LIFTS = 12
"""Simulated lifts; chosen, not measured: the interval of the share says what they tell."""
LIFT_BEGINS, LIFT_ENDS = 40.0, 60.0
"""When the magnets take the rotor up again, and the end, over the time of a fall [1]; chosen. Twelve lifts of
one machine took 1.6 falls at most."""


def found_machine(machine: Machine, drop: Drop) -> Machine | None:
    """The machine as the estimate of a drop found it: gaps, supports and friction with their joint intervals.

    None where the estimate has no joint distribution: it is a replay, or does not fit its record. What the
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
    chance: float = MOST_BEYOND,
    drop: Drop | None = None,
    shares: Sequence[float] | None = None,
    drops: int = DROPS,
    duration: float | None = None,
    seed: int = 1,
    progress: Progress | None = None,
) -> Foreseen:
    """Simulate the drops that could happen next, at a speed [rad/s] and at shares of it.

    ``limits`` are known by the field of an estimate document (``"peak_stress_Pa"``) [SI]; with them the speed
    is sought up to which they are passed with no more than ``chance`` [1]. The machine is that of ``drop``,
    by its estimate, where there is one; what stays open varies as in `repeat_study`. Damage is not simulated.
    By default 0.2 s are simulated, or until past where the rotor went further out than that in ``drop`` [s].
    """
    if duration is None:
        later = [] if drop is None else [one.later_time for one in drop.later_motion if one.larger]
        duration = max(WINDOW, LONGER * max(later, default=0.0))
    found = None if drop is None else found_machine(machine, drop)
    at, names = found or machine, [bearing.name for bearing in machine.touchdown_bearings]
    shares = shares or (SHARES if limits else SHARES[:1])
    made, ratios = [], []
    for k, share in enumerate(shares):
        count = drops if k == 0 else max(drops // 2, 2)
        study = repeat_study(at, share * speed, duration=duration, drops=count, seed=seed)
        with TemporaryDirectory() as folder:
            results = run_study(study, Path(folder) / "drops", progress=False)
        beyond = [
            results.column(f"{name}.{COMPARED[field]}") / limit
            for field, limit in limits.items()
            for name in names
        ]
        worst = np.max(beyond, axis=0) if beyond else np.zeros(0)
        ratios.append(worst)
        made.append(
            NextDrop(
                speed=share * speed,
                peak_force={name: _middle_and_high(results, f"{name}.peak_force") for name in names},
                peak_stress={name: _middle_and_high(results, f"{name}.peak_stress") for name in names},
                beyond_limit=exceedance(worst, 1.0) if beyond else None,
            )
        )
        if progress is not None:
            progress("the next drop", (k + 1) / len(shares))
    limit = None
    if limits and len(shares) > 2:
        fewest = min(map(len, ratios))  # each draw at every speed
        limit = speed_limit(np.array(shares) * speed, np.array([one[:fewest] for one in ratios]), chance)
    return Foreseen(
        drops=tuple(made),
        duration=duration,
        speed_limit=limit,
        limits=dict(limits),
        of_estimate=found is not None,
    )


def lift_now(
    machine: Machine, *, drop: Drop | None = None, lifts: int = LIFTS, seed: int = 1
) -> LiftNow | None:
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
        seed=seed,
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


def speed_limit(speeds: Array, ratios: Array, chance: float) -> SpeedLimit | None:
    """The speed limit by drops at several speeds [rad/s], shape (S,), over their limit [1], shape (S, drops).

    The logarithm of a peak over its limit is a parabola of the logarithm of the speed, with the scatter of
    all drops about it. The interval is that of drops drawn again from those simulated, each at all speeds.
    A draw that failed at any speed (NaN) is left out; None where no other is there.
    """
    low, high = float(speeds.min()), float(speeds.max())
    fine = np.linspace(low, high, 200)
    basis = np.vander(np.log(speeds / high), 3)
    logs = np.log(np.maximum(ratios, 1e-9))
    sound = np.isfinite(logs).all(axis=0)
    logs = logs[:, sound]
    if not logs.size:
        return None
    random = np.random.default_rng(0)

    def fastest(of: Array) -> float:
        """Below it no speed passes the limit too often; zero where the lowest does."""
        course = np.linalg.lstsq(basis, of.mean(axis=1), rcond=None)[0]
        scatter = np.sort((of - (basis @ course)[:, None]).ravel())
        middle = np.vander(np.log(fine / high), 3) @ course
        passed = 1.0 - np.searchsorted(scatter, -middle, side="right") / len(scatter)
        too_often = np.flatnonzero(passed > chance)
        return high if not too_often.size else float(fine[too_often[0] - 1]) if too_often[0] else 0.0

    found = fastest(logs)
    drawn = [fastest(logs[:, random.integers(0, logs.shape[1], logs.shape[1])]) for _ in range(DRAWN_AGAIN)]
    ends = np.maximum(np.quantile(drawn, (0.05, 0.95)), low)
    return SpeedLimit(
        speed=found or None,
        interval_90=(float(ends[0]), float(ends[1])) if found else None,
        chance=chance,
        tried=(low, high),
        drops=int(logs.size),
    )


def _middle_and_high(results: StudyResults, column: str) -> tuple[Known, Known]:
    """What half and 95 % of the drops stay below."""
    return results.quantile(column, 0.5), results.quantile(column, 0.95)
