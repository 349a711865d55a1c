"""Samples of a coast-down on disk: one part per window while it runs, one HDF5 file when it has ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.errors import SimulationError
from rotordrop.files import new_hdf5, read_hdf5, require_file
from rotordrop.simulate.checkpoint import part_path
from rotordrop.simulate.coast_down_result import CoastDownResult, WindowStatistics
from rotordrop.simulate.fingerprint import fingerprint
from rotordrop.simulate.heat import Heat

FORMAT = "rotordrop coast-down 1"
SAMPLES: Mapping[str, tuple[str, str]] = {
    "displacement": ("m", "rotor at the bearing nodes, (x, y)"),
    "race_displacement": ("m", "races, (x, y)"),
    "sensor_displacement": ("m", "rotor at the sensor planes, (x, y)"),
    "indentation": ("m", "indentation of the rotor in the race; negative in flight"),
    "contact_force": ("N", "normal contact force"),
    "bearing_force": ("N", "magnitude of the ball force on the race"),
    "max_stress": ("Pa", "largest Hertz stress at the inner race"),
    "race_speed": ("rad/s", "race spin"),
    "speed": ("rad/s", "rotor speed"),
}
"""What is sampled; single precision but for the speed, whose integral is the rotor angle."""
CONTACT_LOG = "contact_log"
_NUMBERS = (
    "initial_speed",
    "tolerance",
    "output_step",
    "end_time",
    "dissipated",
    "air_work",
    "energy_residual",
    "energy_scale",
    "steps",
    "rejected_steps",
)
_TEXTS = ("machine_name", "reduction", "outcome")
_AGAIN = "simulate the coast-down again"
_ARRAYS = ("peak_value", "peak_time", "whirl_time", "contacts", "contact_energy")


@dataclass(frozen=True, kw_only=True)
class Frame:
    """What every sample of a file refers to."""

    sensor_nodes: tuple[int, ...]
    """Nodes of the sensor planes, counted from 1."""
    air_gap: Array
    """Air gaps of the bearings [m], shape (B,)."""


def write_part(path: Path, samples: Mapping[str, NDArray[Any]], contact_log: Array) -> None:
    """Write the samples and the ended contacts of one window, complete or not at all."""
    require_file(path, f"remove {path.parent} and start the run again")
    with new_hdf5(path) as file:
        for name, values in samples.items():
            file.create_dataset(name, data=values)
        file.create_dataset(CONTACT_LOG, data=contact_log)


def write_coast_down(
    result: CoastDownResult, frame: Frame, digest: str, folder: Path, parts: int, output: Path
) -> None:
    """Join the parts of a run to one file with its statistics; the file appears complete or not at all."""
    with new_hdf5(output) as file:
        file.attrs["format"] = FORMAT
        file.attrs["run"] = digest
        file.attrs["fingerprint"] = fingerprint()
        _write_head(file, result, frame)
        _join(file, [part_path(folder, number) for number in range(parts)])
        count = file["speed"].shape[0]
        file.create_dataset("time", data=np.arange(count) * result.output_step)
        file["time"].attrs["units"] = "s"


def _write_head(file: Any, result: CoastDownResult, frame: Frame) -> None:
    import h5py

    text = h5py.string_dtype()
    for name in _TEXTS + _NUMBERS:
        file.attrs[name] = getattr(result, name)
    file.attrs["finished"] = bool(result.finished)
    file.attrs["standstill_time"] = np.nan if result.standstill_time is None else result.standstill_time
    file.create_dataset("bearing", data=np.array(result.bearing_names, dtype=object), dtype=text)
    file.create_dataset("sensor_node", data=np.array(frame.sensor_nodes, dtype=np.int64))
    file.create_dataset("air_gap", data=frame.air_gap)
    if result.heat is not None:
        result.heat.write(file)
    statistics = file.create_group("statistics")
    for name in _ARRAYS:
        statistics.create_dataset(name, data=getattr(result, name))
    windows = statistics.create_group("windows")
    for item in fields(WindowStatistics):
        windows.create_dataset(item.name, data=getattr(result.windows, item.name))


def _join(file: Any, parts: list[Path]) -> None:
    remedy = f"remove {parts[0].parent} and start the run again" if parts else ""
    lengths: dict[str, int] = {}
    for path in parts:
        with read_hdf5(path, remedy, always_sealed=True) as part:
            for name in part:
                lengths[name] = lengths.get(name, 0) + part[name].shape[0]
    filled = dict.fromkeys(lengths, 0)
    for path in parts:
        with read_hdf5(path, remedy, always_sealed=True) as part:
            for name in part:
                if name not in file:
                    shape = (lengths[name], *part[name].shape[1:])
                    file.create_dataset(name, shape=shape, dtype=part[name].dtype)
                    unit, words = SAMPLES.get(name, ("", "contacts, columns as in the contact log"))
                    file[name].attrs["units"], file[name].attrs["long_name"] = unit, words
                count = part[name].shape[0]
                file[name][filled[name] : filled[name] + count] = part[name][()]
                filled[name] += count


def load_coast_down(path: str | Path) -> CoastDownResult:
    """Read the statistics of a coast-down file; a file of another kind or a damaged one is refused."""
    path = Path(path)
    try:
        with read_hdf5(path, _AGAIN) as file:
            _check_format(file, path)
            return _read_head(file, path)
    except (OSError, KeyError) as error:
        raise SimulationError(
            f"{path} cannot be read as a coast-down ({error}); expected an HDF5 file written by "
            "'rotordrop coast-down --output'. Write it again."
        ) from error


def is_coast_down(path: str | Path) -> bool:
    """Whether a file is a simulated coast-down."""
    import h5py

    path = Path(path)
    if not path.is_file() or not h5py.is_hdf5(path):
        return False
    with h5py.File(path, "r") as file:
        return bool(file.attrs.get("format") == FORMAT)


def ended_run(path: Path, digest: str) -> CoastDownResult | None:
    """What a file holds if it is the whole of just this run, as a run killed behind its end left it."""
    if not is_coast_down(path):
        return None
    with read_hdf5(path, _AGAIN) as file:
        mine = file.attrs.get("run") == digest
    return load_coast_down(path) if mine else None


def _check_format(file: Any, path: Path) -> None:
    if file.attrs.get("format") != FORMAT:
        raise SimulationError(
            f"{path} has format {file.attrs.get('format')!r}; expected {FORMAT!r}. "
            "Give a file written by 'rotordrop coast-down --output'."
        )


def _read_head(file: Any, path: Path) -> CoastDownResult:
    values: dict[str, Any] = {name: str(file.attrs[name]) for name in _TEXTS}
    values |= {name: float(file.attrs[name]) for name in _NUMBERS}
    values["steps"], values["rejected_steps"] = int(values["steps"]), int(values["rejected_steps"])
    values |= {name: file["statistics"][name][()] for name in _ARRAYS}
    stopped = float(file.attrs["standstill_time"])
    windows = file["statistics"]["windows"]
    return CoastDownResult(
        **values,
        bearing_names=tuple(file["bearing"].asstr()[()]),
        finished=bool(file.attrs["finished"]),
        standstill_time=None if np.isnan(stopped) else stopped,
        windows=WindowStatistics(**{f.name: windows[f.name][()] for f in fields(WindowStatistics)}),
        path=path,
        heat=Heat.read(file),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class PlaneInFile:
    """Displacement (x, y) [m] of one plane of a coast-down file, shape (N, 2), read piece by piece."""

    path: Path
    dataset: str
    index: int
    shape: tuple[int, int]

    def __getitem__(self, wanted: slice) -> Array:
        with read_hdf5(self.path, _AGAIN) as file:
            return np.asarray(file[self.dataset][wanted, self.index], dtype=np.float64)


@dataclass(frozen=True, kw_only=True, eq=False)
class CoastDownSamples:
    """Samples of a coast-down file as the frequency analysis wants them."""

    planes: dict[str, PlaneInFile]
    """Displacement at each bearing, and at each sensor plane as ``"node 5"``; they stay in the file."""
    speed: Array
    """Rotor speed [rad/s], shape (N,)."""
    sampling_rate: float
    """Samples per second [Hz]."""
    air_gap: dict[str, float]
    """Air gap of each bearing [m]."""


def open_samples(path: str | Path) -> CoastDownSamples:
    """Open the samples of a coast-down file without reading the displacements into memory."""
    path = Path(path)
    with read_hdf5(path, _AGAIN) as file:
        _check_format(file, path)
        names = tuple(file["bearing"].asstr()[()])
        nodes = [f"node {node}" for node in file["sensor_node"][()]]
        shape = (file["speed"].shape[0], 2)
        planes = {
            label: PlaneInFile(path=path, dataset=dataset, index=index, shape=shape)
            for dataset, labels in (("displacement", names), ("sensor_displacement", nodes))
            for index, label in enumerate(labels)
        }
        return CoastDownSamples(
            planes=planes,
            speed=file["speed"][()],
            sampling_rate=1.0 / float(file.attrs["output_step"]),
            air_gap=dict(zip(names, (float(gap) for gap in file["air_gap"][()]), strict=True)),
        )
