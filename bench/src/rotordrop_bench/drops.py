"""The list of DropBench: which drops there are, from which seeds; fixed for a version."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import cycle

from rotordrop_bench.departures import DEPARTURES, LARGE, LATER_DEPARTURES, LATEST_DEPARTURES, SLIGHT
from rotordrop_bench.rotors import ROTORS

VERSION = "3"
"""Changes whenever a drop of the list does; scores of different versions are not comparable."""


@dataclass(frozen=True, kw_only=True)
class BenchDrop:
    """One drop of the bench."""

    name: str
    """Name, which says nothing of what is hidden."""
    family: str
    """What is scored together."""
    rotor: str
    """Rotor, by its name in `ROTORS`."""
    speed: float
    """Speed at power-off [Hz]."""
    machine_seed: int
    drop_seed: int
    """Seeds of the hidden machine and of the drop."""
    departures: tuple[tuple[str, int], ...] = ()
    """Kinds and sizes of what the description of the machine does not have."""
    tail: bool = True
    """Whether the settled tail was recorded."""
    sampling_rate: float = 20e3
    """Samples per second [Hz]."""


SPEEDS: dict[str, tuple[float, ...]] = {
    "5 kg": (550.0, 320.0, 150.0),
    "13 kg": (500.0, 260.0, 120.0),
    "30 kg": (300.0, 180.0, 80.0),
    "60 kg": (120.0, 210.0, 60.0),
    "140 kg": (180.0, 110.0, 60.0),
    "500 kg": (115.0, 70.0, 40.0),
    "1.6 t": (80.0, 50.0, 30.0),
    "6 t": (50.0, 35.0, 20.0),
}
"""Speeds at which each rotor is dropped, in turn [Hz]."""

PAIRS: tuple[tuple[str, ...], ...] = (
    ("turned support axes", "cross-axis sensitivity"),
    ("sensor lag", "foundation mode"),
    ("cubic support", "long remanence"),
    ("brackets that follow the housing", "turned support axes"),
    ("friction", "unbalance beyond its grade"),
    ("contact law", "sensor planes elsewhere"),
)
TRIPLES: tuple[tuple[str, ...], ...] = (
    ("turned support axes", "cross-axis sensitivity", "sensor lag"),
    ("foundation mode", "hysteretic support", "cross-axis sensitivity"),
    ("cubic support", "turned support axes", "rotor stiffness"),
    ("brackets that follow the housing", "long remanence", "thermal gap"),
    ("sensor lag", "sensor planes elsewhere", "bearing centres"),
    ("foundation mode", "turned support axes", "sensor lag"),
)
RATES = (10e3, 50e3, 100e3)


FIRST_LATER = 101
"""Number of the first drop that came with version 2."""
FIRST_LATEST = 201
"""Number of the first drop that came with version 3."""


def _listed() -> tuple[BenchDrop, ...]:
    found: list[BenchDrop] = []
    speeds = {rotor: cycle(values) for rotor, values in SPEEDS.items()}
    rotors = cycle(ROTORS)

    def add(family: str, rotor: str, machine_seed: int, **more: object) -> None:
        number = len(found) + 1
        found.append(
            BenchDrop(
                name=f"drop_{number:03d}",
                family=family,
                rotor=rotor,
                speed=next(speeds[rotor]),
                machine_seed=machine_seed,
                drop_seed=9000 + number,
                **more,  # type: ignore[arg-type]
            )
        )

    for i, rotor in enumerate(ROTORS):
        add("right", rotor, 700 + i)
        add("right, without tail", rotor, 700 + i, tail=False)
    for size, word in ((SLIGHT, "slight"), (LARGE, "large")):
        for i, kind in enumerate((*DEPARTURES, "unbalance jump")):
            add(f"one departure, {word}", next(rotors), 800 + 100 * size + i, departures=((kind, size),))
        next(rotors)  # else each kind would meet one rotor in both sizes
    for i, kinds in enumerate(PAIRS):
        add("two departures", next(rotors), 1000 + i, departures=tuple((kind, SLIGHT) for kind in kinds))
    for i, kinds in enumerate(TRIPLES):
        add("three departures", next(rotors), 1100 + i, departures=tuple((kind, SLIGHT) for kind in kinds))
    for i, rate in enumerate(RATES):
        add("other sampling rates", next(rotors), 1200 + i, sampling_rate=rate)
    return tuple(found)


def _later() -> tuple[BenchDrop, ...]:
    found: list[BenchDrop] = []
    rotors, speeds = cycle(ROTORS), {rotor: cycle(values) for rotor, values in SPEEDS.items()}
    for size, word in ((SLIGHT, "slight"), (LARGE, "large")):
        for i, kind in enumerate(LATER_DEPARTURES):
            number, rotor = FIRST_LATER + len(found), next(rotors)
            found.append(
                BenchDrop(
                    name=f"drop_{number:03d}",
                    family=f"later kinds, {word}",
                    rotor=rotor,
                    speed=next(speeds[rotor]),
                    machine_seed=1300 + 100 * size + i,
                    drop_seed=9000 + number,
                    departures=((kind, size),),
                )
            )
    return tuple(found)


def _latest() -> tuple[BenchDrop, ...]:
    """Every rotor once, slight and large in turn, at the second of its speeds."""
    (kind,) = LATEST_DEPARTURES
    found = []
    for i, (rotor, (size, word)) in enumerate(zip(ROTORS, cycle(((SLIGHT, "slight"), (LARGE, "large"))))):
        number = FIRST_LATEST + i
        found.append(
            BenchDrop(
                name=f"drop_{number:03d}",
                family=f"seat play, {word}",
                rotor=rotor,
                speed=SPEEDS[rotor][1],
                machine_seed=1500 + i,
                drop_seed=9000 + number,
                departures=((kind, size),),
            )
        )
    return tuple(found)


LISTS: dict[str, tuple[BenchDrop, ...]] = {"1": _listed(), "2": _later(), VERSION: _latest()}
"""What came with each version; the drops of an earlier one stay as they are, bit for bit."""
DROPS: tuple[BenchDrop, ...] = tuple(drop for drops in LISTS.values() for drop in drops)
"""All drops of the bench, in order."""
SINCE: dict[str, str] = {drop.name: version for version, drops in LISTS.items() for drop in drops}
"""Version with which a drop came, by its name; its truth file has it."""
