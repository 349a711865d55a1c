"""A recorded or simulated coast-down made ready for the frequency analysis, and its frequencies named.

Of a recorded one: power-off, centre, planes, speed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.sensor import Sensor
from rotordrop.elements.touchdown_bearing import AIR_GAP
from rotordrop.errors import IdentificationError, RecordError
from rotordrop.evidence.evidence import Evidence, Missing, known, read_evidence
from rotordrop.evidence.given import require_drop
from rotordrop.evidence.one_end import with_zeros
from rotordrop.evidence.paths import Drop, drops_of, with_impacts
from rotordrop.evidence.rest import identify_air_gap
from rotordrop.evidence.sensing import Sensing
from rotordrop.evidence.wall import Wall
from rotordrop.known import NINETY, Known
from rotordrop.machine import Machine
from rotordrop.progress import Shown, shown
from rotordrop.record.axes import along_sensors, end_columns
from rotordrop.record.record import Record
from rotordrop.require import require
from rotordrop.rotor.assembly import build_rotor_fe
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop.simulate.coast_down_file import is_coast_down, load_coast_down, open_samples
from rotordrop.spectrum.candidates import machine_candidates
from rotordrop.spectrum.coast_down import (
    RACES_SPUN_UP,
    SHORTEST_LAW,
    CoastDownAnalysis,
    CoastDownSignal,
    WaterfallChoice,
    analyse_coast_down,
)
from rotordrop.spectrum.speed import exact_speed_profile, fit_drag, fit_speed_profile
from rotordrop.spectrum.waterfall import PlanarSignal

MOST_UNEVEN = 0.01
"""Share of uneven steps of the clock above which a spectrum means nothing [1] (chosen)."""
SPEED_STEP = 0.02
"""Distance of the values [s] from which the profile of the exact speed is drawn (chosen)."""
LEAST_KNOTS = 20
"""Values of it at least, also of a coast-down of a few tenths of a second (chosen)."""


@dataclass(frozen=True, eq=False)
class RecordedPlane:
    """Displacement at one bearing out of the readings of a record, computed where it is asked for.

    A coast-down of a minute fills a quarter of a gigabyte as soon as every step keeps a copy of it.
    """

    signals: Array
    """Readings from power-off on [m], shape (N, S)."""
    sensors: tuple[Sensor, ...]
    """Behind every column."""
    sensing: Sensing
    """What they say about the bearings."""
    bearing: int
    """Which of them."""
    centre: Array
    """Where displacements count from [m], shape (2,)."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Samples and directions, (N, 2)."""
        return (len(self.signals), 2)

    def __getitem__(self, key: slice, /) -> Array:
        """Displacement (x, y) [m] of a part, shape (K, 2)."""
        along = along_sensors(self.signals[key], self.sensors) - self.sensing.settled_bend
        moved: Array = np.einsum("cs,ns->nc", self.sensing.to_bearings[self.bearing], along)
        return moved - self.centre


def recorded_coast_down(machine: Machine, record: Record) -> CoastDownSignal:
    """Cut a record at power-off and resolve x and y at each touchdown bearing, from the centre of its race.

    The settled rotor lies straight below the centre: horizontally the centre is where it rests, vertically it
    is the zero of the sensors, from which the rest also gives the air gap, as in an estimate of the drop. The
    levitated rotor tells neither; it may float anywhere. A record that ends at rest shows centre and air gap;
    in one that ends before, both are those of a look at it, where it determines them.
    """
    uneven = np.mean(np.abs(np.diff(record.time) * record.sampling_rate - 1.0) > 0.5)
    if uneven > MOST_UNEVEN:
        raise RecordError(
            f"{uneven:.0%} of the steps of the clock are uneven; export the record without gaps"
        )
    machine = with_zeros(record, machine)
    ends = end_columns(record.sensors, machine.rotor.node_positions)
    if len(ends) < len(record.sensors):
        record = record.of_channels(ends)
    # before the rotor model: the paths of a minute and the compiler need not be in memory at once
    walls, falls = _seen(record, machine)
    evidence = read_evidence(build_drop_model(machine), record)
    off, names = evidence.power_off.value, evidence.base.bearing_names
    sensing = known(evidence.sensing)
    first = int(np.searchsorted(record.time, off))
    try:
        gap = identify_air_gap(known(evidence.lying), evidence.base, sensing)
        centres = np.column_stack([gap.rest.sideways, np.zeros(len(names))])
        gaps, sigmas = gap.value, gap.standard_error
        centre = (
            f"above the rest of the last {gap.rest.end - gap.rest.start:.3g} s, at the height of sensor zero"
        )
    except IdentificationError as error:
        if set(names) <= {name for name, wall in walls.items() if wall.determined}:
            circles = np.array([walls[sensor.bearing].centre for sensor in record.sensors])
            along = np.sum(record.directions * circles, axis=1) - sensing.settled_bend
            centres = sensing.at_bearings(along)
            gaps, sigmas = (np.array([getattr(walls[n], of) for n in names]) for of in ("gap", "gap_error"))
            centre = f"of the circle in which the record shows the shaft: {error}"
        else:
            centres, sigmas = np.zeros((len(names), 2)), None
            gaps = np.array([float(bearing.air_gap) for bearing in machine.touchdown_bearings])
            centre = f"taken as the zero of the sensors, the air gap from the machine file: {error}"
    # A speed given by hand says from where the rotor fell, not how it slowed down.
    measured = record.measured_speed
    nearest = sorted(falls, key=lambda one: abs(one.release - off))[:1]
    time, speed = (None, None) if measured is None else (measured[0] - off, measured[1])
    return CoastDownSignal(
        planes={
            name: RecordedPlane(record.signals[first:], record.sensors, sensing, b, centres[b])
            for b, name in enumerate(names)
        },
        air_gap=dict(zip(names, map(float, gaps), strict=True)),
        air_gap_error=None if sigmas is None else dict(zip(names, map(float, sigmas), strict=True)),
        centre=centre,
        settling={n: s.after(off) for fall in nearest for n, s in zip(walls, fall.settlings, strict=True)},
        sampling_rate=record.sampling_rate,
        start_time=float(record.time[first]) - off,
        profile=None if time is None or speed is None else fit_speed_profile(time, speed, power_off=0.0),
        speed_time=time,
        speed=speed,
        recorded=True,
    )


def _seen(record: Record, machine: Machine) -> tuple[dict[str, Wall], tuple[Drop, ...]]:
    """Clearance circle by plane, and falls with their impacts, as a look at the record finds them."""
    motion = Evidence(record=record, machine=machine).motion
    if isinstance(motion, Missing):
        return {}, ()
    return motion.walls, tuple(with_impacts(motion, fall) for fall in drops_of(motion))


def with_found_air_gaps(machine: Machine, signal: CoastDownSignal) -> Machine:
    """Give a machine the air gaps that its coast-down shows; itself where none was found."""
    if signal.air_gap_error is None:
        return machine
    found = {}
    for name, gap in signal.air_gap.items():
        low, high = (gap + side * NINETY * signal.air_gap_error[name] for side in (-1.0, 1.0))
        known = Known(value=gap, status="estimated", interval_90=(low, high), unit="m")
        found[AIR_GAP.path_of(name)] = replace(known, lower=max(low, 0.5 * gap), upper=high)
    return machine.with_values(found)


def with_recorded_drag(machine: Machine, signal: CoastDownSignal) -> Machine:
    """Give a machine the drag that a recorded coast-down shows.

    The linear and the quadratic part of the fit go to the air, the dry part to the races: their drag
    coefficient becomes the one whose torque under the weight stops the rotor as recorded. The exponential
    time constant, which would count the same drag twice, is left alone; it does not act in a coast-down once
    these values are there.
    """
    if signal.speed_time is None or signal.speed is None:
        raise RecordError(
            "the record has no speed, so it shows no drag; give a record with a speed channel, or a drag "
            "under [speed] in the machine file"
        )
    least = RACES_SPUN_UP + SHORTEST_LAW
    known = float(signal.speed_time[-1])
    if known < least:
        raise RecordError(
            f"the speed is recorded for {known:.2f} s after power-off; at least {least:g} s are needed to "
            "tell its drag. Give a longer record, or a drag under [speed] in the machine file"
        )
    drag = fit_drag(signal.speed_time, signal.speed, start=RACES_SPUN_UP)
    shares = bearing_load_shares(machine)
    lever = sum(
        float(share) * 0.5 * numbers_of(bearing).drag_diameter
        for bearing, share in zip(machine.touchdown_bearings, shares, strict=True)
    )
    # races that have spun up turn with the rotor: what slows it slows them too
    races = sum(float(bearing.race.inertia) for bearing in machine.touchdown_bearings)
    turning = build_rotor_fe(machine).polar_inertia + races
    values = {
        "speed.aero_linear": drag.linear.value * turning,
        "speed.aero_quadratic": drag.quadratic.value * turning,
    }
    for bearing in machine.touchdown_bearings:
        values[f"{bearing.name}.race.drag_coefficient"] = drag.constant.value * turning / lever
    return machine.with_values(values)


def simulated_coast_down(path: Path, machine: Machine | None = None) -> CoastDownSignal:
    """Open the samples that ``rotordrop coast-down --output`` wrote where a recording would have its sensors.

    With a machine the planes are those of its sensors, named by the end they belong to; without it, or when
    it has none, those of the bearings.
    """
    result, samples = load_coast_down(path), open_samples(path)
    planes: dict[str, PlanarSignal] = {name: samples.planes[name] for name in samples.air_gap}
    sensors = () if machine is None else machine.sensors
    ends = {sensor.bearing: samples.planes.get(f"node {sensor.node}") for sensor in sensors}
    if set(ends) == set(planes) and all(plane is not None for plane in ends.values()):
        planes = {name: plane for name, plane in ends.items() if plane is not None}
    count = len(samples.speed)
    every = max(1, min(round(SPEED_STEP * samples.sampling_rate), count // LEAST_KNOTS))
    time = np.arange(count)[::every] / samples.sampling_rate
    speed = np.abs(samples.speed[::every])
    return CoastDownSignal(
        planes=planes,
        air_gap={name: samples.air_gap[name] for name in planes},
        sampling_rate=samples.sampling_rate,
        start_time=0.0,
        profile=exact_speed_profile(time, speed),
        speed_time=time,
        speed=speed,
        recorded=False,
        standstill=result.standstill_time,
        force_and_stress=tuple(maximum.as_json() for maximum in result.maxima()),
    )


def waterfall(
    machine: Machine,
    coast_down: Record | str | Path,
    choice: WaterfallChoice | None = None,
    *,
    progress: Shown = None,
) -> CoastDownAnalysis:
    """Find and name the frequencies of a coast-down.

    Parameters
    ----------
    machine : Machine
        What lines are named by.
    coast_down : Record or path
        A recorded one, or the file that `simulate_coast_down` wrote.
    choice : WaterfallChoice, optional
        Which waterfalls; those of the paper by default.
    progress : callable or False, optional
        Called with a text and the fraction done; by default a bar in a terminal or a notebook.

    Raises
    ------
    RecordError
        If the record cannot be used.
    """
    require(machine, "machine", Machine)
    require(coast_down, "the coast-down", Record, str, PathLike)
    require(choice, "choice", WaterfallChoice, none=True)
    if isinstance(coast_down, Record):
        require_drop(coast_down, machine)
        signal = recorded_coast_down(machine, coast_down)
    elif Path(coast_down).is_file() and not is_coast_down(coast_down):
        raise RecordError(
            f"{coast_down} is no simulated coast-down; expected a file of simulate_coast_down. Read a "
            f"recorded one first: waterfall(machine, read_record({str(coast_down)!r}, machine))."
        )
    else:
        signal = simulated_coast_down(Path(coast_down), machine)
    candidates = machine_candidates(
        with_found_air_gaps(machine, signal), {name: name for name in signal.planes}
    )
    with shown(progress, "frequencies") as tell:
        return analyse_coast_down(signal, candidates, choice, progress=tell)
