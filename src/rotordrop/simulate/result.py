"""The result of one simulated drop: named histories, how it ended, how far it can be trusted."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.elements.race_bearing import numbers_of
from rotordrop.errors import SimulationError, UsageError
from rotordrop.files import new_hdf5, read_hdf5
from rotordrop.physics.hertz import LineContact
from rotordrop.rotor.layout import ROTOR_AXIAL, axial_state, ring_state
from rotordrop.simulate.certificate import Certificate, refined_peak
from rotordrop.simulate.heat import Heat
from rotordrop.simulate.magnets import Lift, MagnetHistory, lift_of
from rotordrop.units import format_quantity

if TYPE_CHECKING:
    import xarray

    from rotordrop.machine import Machine


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
        [J]; NaN where it is not known.
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
        chosen = self.bearing == index
        return ContactLog(**{f.name: getattr(self, f.name)[chosen] for f in fields(self)})

    def __len__(self) -> int:
        return len(self.bearing)


@dataclass(frozen=True, kw_only=True, repr=False)
class DropResult:
    """One simulated drop. Axes: time T, bearing B, last axis (x, y)."""

    time: Array
    """Time from power-off [s], shape (T,)."""
    displacement: Array
    race_displacement: Array
    support_displacement: Array
    """Rotor at the bearing node, race, support [m], all from the undisturbed centre, shape (T, B, 2)."""
    indentation: Array
    """Indentation of the rotor in the race [m]; negative in flight, shape (T, B)."""
    contact_force: Array
    """Normal force between rotor and race [N], shape (T, B)."""
    friction_force: Array
    """Friction force [N], positive when it brakes positive spin, shape (T, B)."""
    bearing_force: Array
    """Elastic ball force on the race [N], shape (T, B, 2)."""
    max_ball_load: Array
    max_stress: Array
    """Load of the most loaded ball [N] and Hertz stress at its inner race [Pa], shape (T, B)."""
    speed: Array
    """Rotor speed [rad/s], shape (T,)."""
    race_speed: Array
    """Spin of the races [rad/s], shape (T, B)."""
    state: Array
    """Complete states, in the order ``state_names``, shape (T, n)."""
    contacts: ContactLog
    """Every contact."""
    bearing_names: tuple[str, ...]
    state_names: tuple[str, ...]
    shapes: Array = field(repr=False)
    machine_name: str
    initial_speed: float
    tolerance: float
    reduction: str
    steps: int
    rejected_steps: int
    outcome: str
    """How the computation ended, as a sentence."""
    finished: bool
    """Whether the whole duration was reached."""
    certificate: Certificate
    line_contacts: tuple[LineContact, ...]
    """Rotor in each race, which gives the pressure there; one per bearing."""
    lost: Array | None = field(default=None, repr=False)
    """Energy lost by place [J], for `rotordrop.simulate.losses`; None where none were booked, shape (B + 1,
    5)."""

    race_stress: Array | None = field(default=None, repr=False)
    """Largest Hertz stress on inner and outer race [Pa], shape (T, B, 2), of a machine with ball_inertia; a
    bearing of it without has zero on its outer race. None where the inner race governs everywhere."""
    face_force: Array | None = field(default=None, repr=False)
    """Axial force of the rotor on the face of each race [N], positive towards higher nodes, shape (T, B);
    None where the rotor does not move along its axis."""
    heat: Heat | None = field(default=None, repr=False)
    """How the bearings warmed; None of a machine whose bearings stay cold."""
    magnets: MagnetHistory | None = field(default=None, repr=False)
    """What magnets in the loop did; None where they are springs and dampers."""
    further_names: tuple[str, ...] = ()
    further_contacts: ContactLog | None = field(default=None, repr=False)
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
        if isinstance(bearing, int) and -len(self.bearing_names) <= bearing < len(self.bearing_names):
            return bearing
        raise UsageError(
            f"there is no touchdown bearing {bearing!r}; there are {', '.join(self.bearing_names)}"
        )

    def check_finished(self) -> None:
        """Refuse a drop whose computation broke off."""
        if not self.finished:
            raise SimulationError(self.outcome)

    @property
    def lift(self) -> Lift | None:
        """What became of the last lift by magnets in the loop; None without any."""
        return lift_of(self.magnets, self.contacts, float(self.time[-1]))

    def ball_loads(self, machine: Machine, bearing: int | str) -> Array:
        """Load of every ball of a bearing [N], shape (T, rows, Z); of the `machine` that was simulated."""
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
        return self._state_called(ring_state(self.bearing_names[self.index_of(bearing)]))

    @property
    def axial_displacement(self) -> Array:
        """Displacement of the rotor along its axis, towards higher nodes [m], (T,); zero without any."""
        return self._state_called(ROTOR_AXIAL)

    def race_axial_displacement(self, bearing: int | str) -> Array:
        """Displacement of a race along the axis [m], (T,); zero without a face."""
        return self._state_called(axial_state(self.bearing_names[self.index_of(bearing)]))

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

        rows = self.shapes[2 * (np.asarray(nodes) - 1)]
        return node_displacements(self.state, np.ascontiguousarray(rows))

    def to_xarray(self) -> xarray.Dataset:
        """The histories as a labelled data set (needs the extra ``rotordrop[xarray]``)."""
        import xarray

        variables = {}
        for name, axes, unit, text in HISTORIES:
            axes = tuple("state_name" if axis == "state" else axis for axis in axes)
            variables[name] = (axes, getattr(self, name), {"units": unit, "long_name": text})
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


HISTORIES: tuple[tuple[str, tuple[str, ...], str, str], ...] = (
    ("displacement", ("time", "bearing", "axis"), "m", "rotor displacement at the bearing node"),
    ("race_displacement", ("time", "bearing", "axis"), "m", "race displacement"),
    ("support_displacement", ("time", "bearing", "axis"), "m", "support displacement"),
    ("indentation", ("time", "bearing"), "m", "indentation of the rotor in the race"),
    ("contact_force", ("time", "bearing"), "N", "normal contact force"),
    ("friction_force", ("time", "bearing"), "N", "friction force"),
    ("bearing_force", ("time", "bearing", "axis"), "N", "ball force on the race"),
    ("max_ball_load", ("time", "bearing"), "N", "largest ball load"),
    ("max_stress", ("time", "bearing"), "Pa", "largest Hertz stress at the inner race"),
    ("speed", ("time",), "rad/s", "rotor speed"),
    ("race_speed", ("time", "bearing"), "rad/s", "race spin"),
    ("state", ("time", "state"), "1", "complete state in SI units, see state_names"),
)

_TEXTS = ("machine_name", "reduction", "outcome")
_NUMBERS = ("initial_speed", "tolerance", "steps", "rejected_steps", "finished")
_FORMAT = "rotordrop drop 2"


def _scale(file: Any, name: str, values: Any) -> None:
    file[name] = values
    file[name].make_scale(name)


def _write(result: DropResult, file: Any) -> None:
    import h5py

    from rotordrop.simulate.fingerprint import fingerprint

    file.attrs["format"] = _FORMAT
    file.attrs["fingerprint"] = fingerprint()
    file.attrs["Conventions"] = "CF-1.8"
    for name in _TEXTS + _NUMBERS:
        value = getattr(result, name)
        file.attrs[name] = value if isinstance(value, str) else float(value)
    text = h5py.string_dtype()
    _scale(file, "time", result.time)
    file["time"].attrs["units"] = "s"
    _scale(file, "bearing", np.array(result.bearing_names, dtype=text))
    _scale(file, "axis", np.array(["x", "y"], dtype=text))
    _scale(file, "state_name", np.array(result.state_names, dtype=text))
    _scale(file, "coordinate", np.arange(result.shapes.shape[0], dtype=np.int64))
    _scale(file, "mode", np.arange(result.shapes.shape[1], dtype=np.int64))
    for name, axes, unit, words in HISTORIES:
        _dataset(file, name, getattr(result, name), axes, unit, words)
    _dataset(file, "shapes", result.shapes, ("coordinate", "mode"), "1", "mode shapes of a plane")
    _write_log(file, "contact", result.contacts)
    if result.further_contacts is not None:
        _write_log(file, "further_contact", result.further_contacts)
        _scale(file, "further_name", np.array(result.further_names, dtype=text))
    for item in fields(LineContact):
        values = np.array([getattr(line, item.name) for line in result.line_contacts])
        _dataset(file, f"line_contact_{item.name}", values, ("bearing",), "", f"rotor on race: {item.name}")
    if result.lost is not None:
        _scale(file, "owner", np.array([*result.bearing_names, "rotor"], dtype=text))
        _scale(file, "loss_column", np.arange(result.lost.shape[1], dtype=np.int64))
        words = "energy lost by place; columns as in rotordrop.simulate.losses"
        _dataset(file, "lost", result.lost, ("owner", "loss_column"), "J", words)
    _write_more(result, file)
    for item in fields(Certificate):
        value = getattr(result.certificate, item.name)
        if value is not None:
            file.attrs[f"certificate_{item.name}"] = value


def _write_more(result: DropResult, file: Any) -> None:
    """Write what only some machines have."""
    import h5py

    if result.race_stress is not None:
        _scale(file, "race", np.array(["inner", "outer"], dtype=h5py.string_dtype()))
        words = "largest Hertz stress of a ball on each race"
        _dataset(file, "race_stress", result.race_stress, ("time", "bearing", "race"), "Pa", words)
    if result.face_force is not None:
        words = "axial force of the rotor on the face of the race"
        _dataset(file, "face_force", result.face_force, ("time", "bearing"), "N", words)
    if result.heat is not None:
        result.heat.write(file)
    if result.magnets is not None:
        result.magnets.write(file)


def _write_log(file: Any, prefix: str, log: ContactLog) -> None:
    _scale(file, prefix, np.arange(len(log), dtype=np.int64))
    for item in fields(ContactLog):
        _dataset(file, f"{prefix}_{item.name}", getattr(log, item.name), (prefix,), "", item.name)


def _dataset(file: Any, name: str, values: Any, axes: tuple[str, ...], unit: str, words: str) -> None:
    compression = {"compression": "gzip", "shuffle": True} if np.size(values) > 1000 else {}
    dataset = file.create_dataset(name, data=values, **compression)
    dataset.attrs["units"] = unit
    dataset.attrs["long_name"] = words
    for position, axis in enumerate(axes):
        dataset.dims[position].attach_scale(file["state_name" if axis == "state" else axis])


def load_result(path: str | Path) -> DropResult:
    """Read a result written by `DropResult.save`; a file of another kind or a damaged one is refused."""
    path = Path(path)
    try:
        with read_hdf5(path, "simulate the drop again") as file:
            if file.attrs.get("format") != _FORMAT:
                raise SimulationError(
                    f"{path} has format {file.attrs.get('format')!r}; expected {_FORMAT!r}. "
                    "Give a file written by 'rotordrop simulate --output'."
                )
            return _read(file)
    except (OSError, KeyError) as error:
        raise SimulationError(
            f"{path} cannot be read as a drop result ({error}); expected an HDF5 file written by "
            "'rotordrop simulate --output'. Write it again."
        ) from error


def _read(file: Any) -> DropResult:
    values: dict[str, Any] = {name: file[name][()] for name, *_ in HISTORIES}
    values["time"] = file["time"][()]
    values["shapes"] = file["shapes"][()]
    values["bearing_names"] = tuple(file["bearing"].asstr()[()])
    values["state_names"] = tuple(file["state_name"].asstr()[()])
    for name in _TEXTS:
        values[name] = str(file.attrs[name])
    values["initial_speed"] = float(file.attrs["initial_speed"])
    values["tolerance"] = float(file.attrs["tolerance"])
    values["steps"] = int(file.attrs["steps"])
    values["rejected_steps"] = int(file.attrs["rejected_steps"])
    values["finished"] = bool(file.attrs["finished"])
    values["contacts"] = _read_log(file, "contact")
    if "further_name" in file:
        values["further_names"] = tuple(file["further_name"].asstr()[()])
        values["further_contacts"] = _read_log(file, "further_contact")
    lines = {f.name: file[f"line_contact_{f.name}"][()].tolist() for f in fields(LineContact)}
    values["line_contacts"] = tuple(
        LineContact(**dict(zip(lines, numbers, strict=True))) for numbers in zip(*lines.values(), strict=True)
    )
    certificate = {
        f.name: file.attrs[f"certificate_{f.name}"]
        for f in fields(Certificate)
        if f"certificate_{f.name}" in file.attrs
    }
    values["certificate"] = Certificate(**certificate)
    for name in ("lost", "race_stress", "face_force"):
        values[name] = file[name][()] if name in file else None
    return DropResult(**values, heat=Heat.read(file), magnets=MagnetHistory.read(file))


def _read_log(file: Any, prefix: str) -> ContactLog:
    unknown = np.full(len(file[prefix]), np.nan)  # files of before the split of the contact's loss
    return ContactLog(
        **{
            f.name: file[name][()] if (name := f"{prefix}_{f.name}") in file else unknown
            for f in fields(ContactLog)
        }
    )
