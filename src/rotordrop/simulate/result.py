"""The result of a simulation: named histories, how it ended, how far it can be trusted, and its file.

Every file carries the hash of a short probe drop. Where it differs, drops differ in their last digits at
first and visibly some contacts later, so that comparing two files point by point means nothing; statistics
still agree.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import lru_cache
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.elements.ball_bearing import RING_STATE
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.face import AXIAL_STATE
from rotordrop.errors import SimulationError, UsageError, needing
from rotordrop.files import new_hdf5, read_hdf5
from rotordrop.labelled import Stored, declared, put, read, write
from rotordrop.machine import Machine, example_machine
from rotordrop.physics.hertz import LineContact
from rotordrop.require import each, require
from rotordrop.rotor.layout import ROTOR_AXIAL
from rotordrop.series import refined_peak
from rotordrop.simulate.heat import Heat
from rotordrop.simulate.magnets import Lift, MagnetHistory, lift_of
from rotordrop.sketch import sketch
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    import pandas
    import xarray

COMPARABLE_WINDOW = 0.02
"""Window [s] over which histories are compared point by point; later the drop is chaotic."""


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """Error certificate of one simulated drop."""

    energy_residual: float
    """Largest imbalance of stored, dissipated and supplied energy [J]."""
    energy_scale: float
    """Energy it is to be compared with: the largest change of stored energy [J]."""
    peak_force: Array
    """Peak magnitude of the ball force [N], shape (B,)."""
    peak_change_tolerance: Array | None = None
    """Relative change of the peak in the first 20 ms when the tolerance is ten times tighter [1], shape (B,).
    """
    peak_change_truncation: Array | None = None
    """Relative change of the peak in the first 20 ms with eight more modes per plane [1], shape (B,)."""

    def sentence(self) -> str:
        """The certificate in words."""
        parts = [f"energy balanced to {self.energy_residual:.2g} J of {self.energy_scale:.3g} J"]
        if self.peak_change_tolerance is not None:
            parts.append(
                f"peak force in the first 20 ms moves {100 * np.max(self.peak_change_tolerance):.2g} % "
                "at a ten times tighter tolerance"
            )
        if self.peak_change_truncation is not None:
            parts.append(
                f"and {100 * np.max(self.peak_change_truncation):.2g} % with eight more modes per plane"
            )
        return ", ".join(parts)


def peaks_of(time: Array, force: Array, until: float = np.inf) -> Array:
    """Refined peaks [N], shape (B,), of force histories (T, B) up to a time [s]."""
    inside = time <= until
    return np.array([refined_peak(time[inside], force[inside, b])[0] for b in range(force.shape[1])])


@dataclass(frozen=True, kw_only=True)
class ContactLog:
    """Every contact of a drop, one entry each, in the order of their beginning; shape (R,) throughout.

    Attributes
    ----------
    bearing : ndarray of int
        Index of the bearing, of further contacts that of their name.
    start, end, duration : ndarray
        Times [s]; ``end`` is NaN when the contact still lasts.
    peak_force, peak_time, azimuth : ndarray
        Largest normal force [N], when [s], and direction from race to rotor there [rad ccw from +x].
    impulse, dissipated_energy, sliding_energy : ndarray
        Normal impulse [N s], energy lost in contact and friction [J], and the part of it that sliding takes
        [J].
    """

    bearing: NDArray[np.int64]
    start: Array
    end: Array
    peak_force: Array
    peak_time: Array
    azimuth: Array
    impulse: Array
    dissipated_energy: Array
    sliding_energy: Array

    @property
    def duration(self) -> Array:
        """Duration of each contact [s]."""
        return self.end - self.start

    @property
    def peak(self) -> tuple[float, float]:
        """Largest normal force [N] and when [s]; zero and NaN without any contact."""
        if not len(self):
            return 0.0, math.nan
        hardest = int(np.argmax(self.peak_force))
        return float(self.peak_force[hardest]), float(self.peak_time[hardest])

    def of_bearing(self, index: int) -> ContactLog:
        """The contacts of one bearing only."""
        chosen = self.bearing == require(index, "index of a bearing", int)
        return ContactLog(**{f.name: getattr(self, f.name)[chosen] for f in fields(self)})

    def __len__(self) -> int:
        return len(self.bearing)


@dataclass(frozen=True, kw_only=True)
class SimulationResult:
    """What every simulation tells of itself."""

    machine_name: str
    bearing_names: Annotated[tuple[str, ...], Stored("bearing", name="bearing")]
    initial_speed: float
    tolerance: float
    reduction: str
    steps: int
    rejected_steps: int
    outcome: str
    """How the computation ended, as a sentence."""
    finished: bool
    """Whether it came to the end that was asked for."""
    heat: Annotated[Heat | None, Stored(prefix="heat/")] = None
    """How the bearings warmed; None of a machine whose bearings stay cold."""

    def check_finished(self) -> None:
        """Refuse a simulation that ended before it came to what was asked for."""
        if not self.finished:
            raise SimulationError(self.outcome)


@dataclass(frozen=True, kw_only=True, repr=False)
class DropResult(SimulationResult):
    """One simulated drop. Axes: time T, bearing B, last axis (x, y)."""

    time: Annotated[Array, Stored("time", "s", "time from power-off")]
    displacement: Annotated[Array, Stored("time bearing axis", "m", "rotor displacement at the bearing node")]
    race_displacement: Annotated[Array, Stored("time bearing axis", "m", "race displacement")]
    support_displacement: Annotated[Array, Stored("time bearing axis", "m", "support displacement")]
    """All from the undisturbed centre."""
    indentation: Annotated[
        Array, Stored("time bearing", "m", "indentation of the rotor in the race; negative in flight")
    ]
    contact_force: Annotated[Array, Stored("time bearing", "N", "normal contact force")]
    friction_force: Annotated[Array, Stored("time bearing", "N", "friction force")]
    """Between rotor and race; friction positive when it brakes positive spin."""
    bearing_force: Annotated[Array, Stored("time bearing axis", "N", "ball force on the race")]
    max_ball_load: Annotated[Array, Stored("time bearing", "N", "largest ball load")]
    max_stress: Annotated[Array, Stored("time bearing", "Pa", "largest Hertz stress at the inner race")]
    speed: Annotated[Array, Stored("time", "rad/s", "rotor speed")]
    race_speed: Annotated[Array, Stored("time bearing", "rad/s", "race spin")]
    state: Annotated[Array, Stored("time state_name", "1", "complete state in SI units, see state_names")]
    contacts: Annotated[ContactLog, Stored("contact", prefix="contact_")]
    """Every contact."""
    state_names: Annotated[tuple[str, ...], Stored("state_name", name="state_name")]
    shapes: Annotated[Array, Stored("coordinate mode", "1", "mode shapes of a plane")]
    certificate: Certificate
    line_contacts: tuple[LineContact, ...]
    """Rotor in each race, which gives the pressure there; one per bearing."""
    lost: Annotated[
        Array,
        Stored("owner loss_column", "J", "energy lost by place; columns as in rotordrop.simulate.losses"),
    ]
    """Bearings, then rotor; shape (B + 1, 5)."""
    race_stress: Annotated[
        Array | None, Stored("time bearing race", "Pa", "largest Hertz stress of a ball on each race")
    ] = None
    """Of a machine with ball_inertia; a bearing of it without has zero on its outer race. None where the
    inner race governs everywhere."""
    face_force: Annotated[
        Array | None, Stored("time bearing", "N", "axial force of the rotor on the face of the race")
    ] = None
    """Positive towards higher nodes; None where the rotor does not move along its axis."""
    magnets: Annotated[MagnetHistory | None, Stored(prefix="magnets/")] = None
    """What magnets in the loop did; None where they are springs and dampers."""
    further_names: Annotated[tuple[str, ...], Stored("further_name", name="further_name")] = ()
    further_contacts: Annotated[ContactLog | None, Stored("further_contact", prefix="further_contact_")] = (
        None
    )
    """Contacts of supports with their stops, such as "DE.mount.stop", of the rotor with its housing, by the
    name of the clearance, and with faces of races, "DE.face", whose azimuth is zero towards +z, else π."""

    def index_of(self, bearing: int | str) -> int:
        """Place of a bearing, given by name or by number from 0.

        Raises
        ------
        UsageError
            If there is no such bearing; names those there are.
        """
        if isinstance(bearing, str) and bearing in self.bearing_names:
            return self.bearing_names.index(bearing)
        if type(bearing) is int and -len(self.bearing_names) <= bearing < len(self.bearing_names):
            return bearing
        raise UsageError(
            f"there is no touchdown bearing {bearing!r}; there are {', '.join(self.bearing_names)}"
        )

    @property
    def lift(self) -> Lift | None:
        """What became of the last lift by magnets in the loop; None without any."""
        return lift_of(self.magnets, self.contacts, float(self.time[-1]))

    def ball_loads(self, machine: Machine, bearing: int | str) -> Array:
        """Load of every ball of a bearing [N], shape (T, rows, Z); of the `machine` that was simulated."""
        simulated = (self.machine_name,)
        require(require(machine, "machine", Machine).name, "name of the machine", str, among=simulated)
        b = self.index_of(bearing)
        if self.heat is not None and b in self.heat.warmed:
            raise UsageError(
                f"the balls of {self.bearing_names[b]} warm, and only those of a cold bearing can be told "
                "one by one; max_ball_load has the largest load of each instant"
            )
        moved = self.race_displacement[:, b] - self.support_displacement[:, b]
        numbers = numbers_of(machine.bearing(self.bearing_names[b]))
        return numbers.element_loads(moved, self.ring_travel(b), self.race_axial_displacement(b))

    def ring_travel(self, bearing: int | str) -> Array:
        """Way of sprung outer rings of a bearing from their balls [m], (T,); zero between spacers."""
        return self._state_called(RING_STATE.format(self.bearing_names[self.index_of(bearing)]))

    @property
    def axial_displacement(self) -> Array:
        """Displacement of the rotor along its axis, towards higher nodes [m], (T,); zero without any."""
        return self._state_called(ROTOR_AXIAL)

    def race_axial_displacement(self, bearing: int | str) -> Array:
        """Displacement of a race along the axis [m], (T,); zero without a face."""
        return self._state_called(AXIAL_STATE.format(self.bearing_names[self.index_of(bearing)]))

    def _state_called(self, name: str) -> Array:
        if name not in self.state_names:
            return np.zeros(len(self.time))
        return self.state[:, self.state_names.index(name)]

    def contacts_at(self, name: str) -> ContactLog | None:
        """The contacts at a stop or a clearance; None where no force acts."""
        if self.further_contacts is None or name not in self.further_names:
            return None
        return self.further_contacts.of_bearing(self.further_names.index(name))

    def __repr__(self) -> str:
        """Machine, speed, length, peaks and outcome."""
        peaks = "; ".join(f"{n} {self.peak_force(b)[0]:.4g} N" for b, n in enumerate(self.bearing_names))
        speed = format_quantity(self.initial_speed, "speed")
        return (
            f"<DropResult {self.machine_name} from {speed}, {self.time[-1]:.4g} s: {peaks}. {self.outcome}>"
        )

    def _repr_html_(self) -> str:
        forces = zip(self.bearing_names, self.bearing_force_magnitude.T, strict=True)
        return sketch(repr(self), "time [s]", "force [kN]", {n: (self.time, v) for n, v in forces}, 1e-3)

    def peak_contact_pressure(self, bearing: int | str) -> tuple[float, float, float]:
        """Largest Hertz pressure of rotor on race [Pa], half width of the contact then [m], time [s]."""
        bearing = self.index_of(bearing)
        force, time = refined_peak(self.time, self.contact_force[:, bearing])
        line = self.line_contacts[bearing]
        return float(line.maximum_pressure(force)), float(line.half_width(force)), time

    @property
    def bearing_force_magnitude(self) -> Array:
        """Magnitude of the elastic ball force on the race [N], shape (T, B)."""
        x, y = self.bearing_force[..., 0], self.bearing_force[..., 1]
        return np.asarray(np.sqrt(x * x + y * y))

    def peak_force(self, bearing: int | str) -> tuple[float, float]:
        """Peak ball force on a race [N] and its time [s], by name or number of the bearing."""
        return refined_peak(self.time, self.bearing_force_magnitude[:, self.index_of(bearing)])

    def at_nodes(self, nodes: list[int] | tuple[int, ...]) -> Array:
        """Rotor displacement [m] at any nodes (numbered from 1), shape (T, len(nodes), 2)."""
        from rotordrop.simulate._histories import node_displacements

        last = len(self.shapes) // 2
        chosen = [require(one, "a node", int, least=1, most=last) for one in each(nodes, "nodes", int)]
        rows = self.shapes[2 * (np.array(chosen, dtype=np.int64) - 1)]
        return node_displacements(self.state, np.ascontiguousarray(rows))

    def to_dataframe(self) -> pandas.DataFrame:
        """Histories as a table with columns (bearing, quantity) against time [s]; units in ``attrs``."""
        with needing("tables"):
            import pandas

        told = {name: said.unit for name, said in HISTORIES.items() if said.axes == "time bearing"}
        histories = {"force": self.bearing_force_magnitude, **{name: getattr(self, name) for name in told}}
        columns = {(b, n): v[:, k] for k, b in enumerate(self.bearing_names) for n, v in histories.items()}
        table = pandas.DataFrame(columns, index=pandas.Index(self.time, name="time [s]"))
        table.attrs["units"] = {"force": "N", **told}
        return table

    def to_xarray(self) -> xarray.Dataset:
        """The histories as a labelled data set (needs the extra ``rotordrop[tables]``)."""
        with needing("tables"):
            import xarray

        variables = {
            name: (said.axes.split(), getattr(self, name), {"units": said.unit, "long_name": said.label})
            for name, said in HISTORIES.items()
        }
        coordinates = {
            "time": ("time", self.time, {"units": "s", "long_name": "time from power-off"}),
            "bearing": list(self.bearing_names),
            "axis": ["x", "y"],
            "state_name": list(self.state_names),
        }
        attributes = {"machine": self.machine_name, "outcome": self.outcome, "tolerance": self.tolerance}
        return xarray.Dataset(variables, coords=coordinates, attrs=attributes)

    def save(self, path: str | Path) -> None:
        """Write an HDF5 file that opens as NetCDF4; nothing is left behind when writing fails."""
        with new_hdf5(path, track_order=True) as file:
            _write(self, file)


def stop_of(bearing: str) -> str:
    """Name of the stop in the mount of a bearing."""
    return f"{bearing}.mount.stop"


HISTORIES = {
    name: said
    for name, _, optional, said in declared(DropResult)
    if said.axes.startswith("time") and name != "time" and not optional
}
"""Histories that every drop has, by name."""

_FORMAT = "rotordrop drop 2"


def _write(result: DropResult, file: Any) -> None:
    file.attrs["format"] = _FORMAT
    file.attrs["fingerprint"] = fingerprint()
    file.attrs["Conventions"] = "CF-1.8"
    put(file, "owner", (*result.bearing_names, "rotor"), Stored("owner"))
    write(result, file)
    for item in fields(LineContact):
        values = np.array([getattr(line, item.name) for line in result.line_contacts])
        said = Stored("bearing", label=f"rotor on race: {item.name}")
        put(file, f"line_contact_{item.name}", values, said)
    for item in fields(Certificate):
        value = getattr(result.certificate, item.name)
        if value is not None:
            file.attrs[f"certificate_{item.name}"] = value


@contextmanager
def opened(path: str | Path, form: str, what: str, verb: str) -> Iterator[Any]:
    """Open the file of a result; one of another format or a damaged one is refused."""
    path = Path(require(path, "path", str, PathLike))
    try:
        with read_hdf5(path, f"simulate the {what} again") as file:
            if file.attrs.get("format") != form:
                raise SimulationError(
                    f"{path} has format {file.attrs.get('format')!r}; expected {form!r}. "
                    f"Give a file written by 'rotordrop {verb} --output'."
                )
            yield file
    except (OSError, KeyError) as error:
        raise SimulationError(
            f"{path} cannot be read as a {what} result ({error}); expected an HDF5 file written by "
            f"'rotordrop {verb} --output'. Write it again."
        ) from error


def load_result(path: str | Path) -> DropResult:
    """Read a result written by `DropResult.save`; a file of another kind or a damaged one is refused."""
    with opened(path, _FORMAT, "drop", "simulate") as file:
        lines = {f.name: file[f"line_contact_{f.name}"][()].tolist() for f in fields(LineContact)}
        certificate = {
            f.name: file.attrs[f"certificate_{f.name}"]
            for f in fields(Certificate)
            if f"certificate_{f.name}" in file.attrs
        }
        return DropResult(
            **read(DropResult, file),
            line_contacts=tuple(
                LineContact(**dict(zip(lines, numbers, strict=True)))
                for numbers in zip(*lines.values(), strict=True)
            ),
            certificate=Certificate(**certificate),
        )


PROBE_SPEED = 2.0 * np.pi * 100.0
PROBE_DURATION = 12e-3
"""From levitation to some milliseconds after the first contacts [s]: every part of the model takes part."""


@lru_cache(maxsize=1)
def fingerprint() -> str:
    """SHA-256 (hexadecimal) of all histories of the probe drop on this computer, computed once a process.

    Equal on two computers where a drop has the same bits on both.
    """
    return history_hash(probe_drop())


def probe_drop() -> DropResult:
    """The paper's machine dropped from its AMBs at 100 Hz, with few modes and for 12 ms."""
    from rotordrop.simulate.case import DropCase, LevitatedStart
    from rotordrop.simulate.drop import simulate_drop

    case = DropCase(
        speed=PROBE_SPEED, duration=PROBE_DURATION, reduction="quick", start=LevitatedStart(rotor_angle=1.0)
    )
    return simulate_drop(example_machine("paper"), case)


def history_hash(result: DropResult) -> str:
    """SHA-256 of every number of every history of a drop, in hexadecimal."""
    digest = hashlib.sha256()
    for values in (result.time, *(getattr(result, name) for name in HISTORIES)):
        digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()
