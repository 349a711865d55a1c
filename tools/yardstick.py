"""The yardstick: documents, bits and times that a change of the code is compared with.

    python tools/yardstick.py make OUTDIR [--quick-set | --all | --only NAME ...] [--work FOLDER]
    python tools/yardstick.py compare EXPECTED ACTUAL [--allow NAME ...] [--within SHARE] [--full]
    python tools/yardstick.py times [--rounds 5] [--output FILE]
    python tools/yardstick.py list

What is expected lies in ``tests/yardstick``. Cases run by command line, so that they outlive a move of
modules; where a command is named otherwise later, add a variant to its row in `CASES`. What has no command
is in `internals` and `timed_actions`, with all imports inside.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import resource
import shlex
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
EXPECTED = HERE.parent / "tests" / "yardstick"
GIVEN = EXPECTED / "given"


@dataclass(frozen=True, kw_only=True)
class Case:
    """One row of the table: what is run and which of its files are compared.

    Attributes
    ----------
    name : str
        Name of the case; ``{name}`` in the commands and files.
    commands : tuple of str
        Modules with arguments, run by ``python -m`` in the work folder; the first that is known counts.
    files : tuple of str
        What it writes, relative to the work folder; ``stdout`` is what it prints.
    needs : tuple of str
        Cases whose files it reads.
    quick : bool
        Whether it belongs to the quick set.
    """

    name: str
    commands: tuple[str, ...]
    files: tuple[str, ...] = ("{name}.json",)
    needs: tuple[str, ...] = ()
    quick: bool = False


LP400 = "lp400/machine.toml lp400/drop_060.h5 --tail lp400/drop_060_tail.csv"
SIMPLE = (
    '--simple --mass "60 kg" --length "1.1 m" --centre "520 mm" --bearings "110 mm, 980 mm" '
    '--sensors "180 mm, 900 mm" --sensor-angle "135 deg" --designation XCB71914-E --gap "0.25 mm" '
    '--speed "9000 rpm" --grade "G 2.5" --support stiff'
)


def _example(name: str, *more: str) -> Case:
    files = ("machine.toml", *more)
    return Case(
        name=f"example-{name}",
        commands=(f"rotordrop init --force --example {name} {name}",),
        files=tuple(f"{name}/{file}" for file in files),
        quick=True,
    )


def _bench(number: str, *, tail: bool = True, quick: bool = False) -> tuple[Case, Case]:
    """Recording of a drop of the bench, and its estimate."""
    drop = f"drop_{number}"
    place = f"bench/drops/{drop}"
    recorded = ["machine.toml", "record.csv", *(["tail.csv"] if tail else [])]
    make = f"bench make bench --only {drop}"
    with_tail = f" --tail {place}/tail.csv" if tail else ""
    return (
        Case(
            name=f"recording-{number}",
            commands=(
                f"rotordrop {make}",
                f"rotordrop_bench {make}",
                f"rotordrop_bench make bench --only {drop}",
            ),
            files=(*(f"{place}/{file}" for file in recorded), f"bench/truth/{drop}.json"),
            quick=quick,
        ),
        Case(
            name=f"estimate-bench-{number}",
            commands=(
                f"rotordrop estimate {place}/machine.toml {place}/record.csv{with_tail} --json {{name}}.json",
            ),
            needs=(f"recording-{number}",),
        ),
    )


CASES: tuple[Case, ...] = (
    _example("paper"),
    _example("small"),
    _example("lp400", "drop_060_tail.csv"),
    Case(
        name="init-simple",
        commands=(f"rotordrop init --force {SIMPLE} twelve.toml",),
        files=("twelve.toml",),
        quick=True,
    ),
    *(
        Case(
            name=f"simulate-{name}",
            commands=(
                f"rotordrop simulate {name}/machine.toml --speed {speed} {how} --output-step 50us "
                "-o {name}.h5 --json {name}.json",
            ),
            files=("{name}.json", "{name}.h5"),
            needs=(f"example-{name}",),
            quick=True,
        )
        for name, speed, how in (
            ("paper", "60Hz", "--displacement 'NDE: 2 um, -5 um'"),
            ("lp400", "60Hz", "--levitated --rotor-angle '40 deg' --remanent-force 'NDE: 5 N, 40 N'"),
            ("small", "300Hz", "--levitated --reduction full --duration 0.1s"),
        )
    ),
    Case(
        name="simulate-extended",
        commands=(
            "rotordrop simulate extended_60kg.toml --speed 120Hz --levitated --duration 0.1s "
            "--integrator dp5 --output-step 50us -o {name}.h5 --json {name}.json",
        ),
        files=("{name}.json", "{name}.h5"),
        quick=True,
    ),
    Case(
        name="simulate-certified",
        commands=(
            "rotordrop simulate scaled_5kg.toml --speed 400Hz --spin coasting --reduction quick "
            "--duration 0.05s --certify --json {name}.json",
        ),
    ),
    *(
        Case(
            name=f"check-{name}",
            commands=(f"rotordrop check {path} --all --json {{name}}.json",),
            needs=(f"example-{name}",) if "/" in path else (),
            quick=True,
        )
        for name, path in (
            ("paper", "paper/machine.toml"),
            ("lp400", "lp400/machine.toml"),
            ("small", "small/machine.toml"),
            ("extended", "extended_60kg.toml"),
        )
    ),
    *(
        Case(
            name=f"schema-{document}",
            commands=(f"rotordrop init --schema {document}", "rotordrop_bench schema"),
            files=("stdout",),
            quick=True,
        )
        for document in ("machine", "estimate", "look", "numbers", "violations")
    ),
    Case(
        name="fingerprint",
        commands=("rotordrop fingerprint", "rotordrop doctor --fingerprint"),
        files=("stdout",),
        quick=True,
    ),
    Case(
        name="look",
        commands=("rotordrop look lp400/drop_060.h5 lp400/machine.toml --json {name}.json",),
        needs=("example-lp400",),
        quick=True,
    ),
    Case(
        name="look-alone",
        commands=("rotordrop look lp400/drop_060.h5 --gap '250 um' --speed '60 Hz' --json {name}.json",),
        needs=("example-lp400",),
    ),
    Case(
        name="critical-speeds",
        commands=("rotordrop critical-speeds paper/machine.toml --json {name}.json",),
        needs=("example-paper",),
        quick=True,
    ),
    Case(
        name="unbalance-response",
        commands=("rotordrop critical-speeds paper/machine.toml --unbalance --json {name}.json",),
        needs=("example-paper",),
        quick=True,
    ),
    Case(
        name="coast-down",
        commands=(
            "rotordrop coast-down paper/machine.toml --speed 60Hz --until 0.4s -o {name}.h5 "
            "--json {name}.json",
        ),
        files=("{name}.json", "{name}.h5"),
        needs=("example-paper",),
    ),
    Case(
        name="waterfall",
        commands=(
            "rotordrop waterfall lp400/machine.toml lp400/drop_060.h5 --points 2048 --json {name}.json",
        ),
        needs=("example-lp400",),
    ),
    Case(
        name="study",
        commands=("rotordrop study run study.toml --folder {name} --threads 1 --json {name}.json",),
        needs=("example-lp400",),
    ),
    Case(
        name="recording-twelve",
        commands=(
            "rotordrop synthesize twelve.toml --speed 150Hz --seed 3 -o twelve",
            "rotordrop_bench synthesize twelve.toml --speed 150Hz --seed 3 -o twelve",
        ),
        files=(
            "twelve/synthetic_150Hz.csv",
            "twelve/synthetic_150Hz_tail.csv",
            "twelve/truth/synthetic_150Hz.json",
        ),
        needs=("init-simple",),
        quick=True,
    ),
    Case(
        name="recording-lp400",
        commands=(
            "rotordrop synthesize lp400/machine.toml --speed 75Hz --seed 5 -o hidden",
            "rotordrop_bench synthesize lp400/machine.toml --speed 75Hz --seed 5 -o hidden",
        ),
        files=(
            "hidden/synthetic_075Hz.csv",
            "hidden/synthetic_075Hz_tail.csv",
            "hidden/truth/synthetic_075Hz.json",
        ),
        needs=("example-lp400",),
        quick=True,
    ),
    Case(
        name="calibrate",
        commands=(
            f"rotordrop calibrate {LP400} --even-if-inconsistent -o {{name}}.toml --json {{name}}.json",
        ),
        files=("{name}.json", "{name}.toml"),
        needs=("example-lp400",),
    ),
    Case(
        name="estimate-quick",
        commands=(
            "rotordrop estimate lp400_calibrated.toml lp400/drop_060.h5 --tail lp400/drop_060_tail.csv "
            "--quick --json {name}.json",
        ),
        needs=("example-lp400",),
        quick=True,
    ),
    Case(
        name="estimate-tracked",
        commands=(f"rotordrop estimate {LP400} -o {{name}}.h5 --json {{name}}.json",),
        files=("{name}.json", "{name}.h5"),
        needs=("example-lp400",),
    ),
    Case(
        name="estimate-replay",
        commands=(f"rotordrop estimate {LP400} --method replay --json {{name}}.json",),
        needs=("example-lp400",),
    ),
    Case(
        name="estimate-since",
        commands=(
            "rotordrop estimate lp400/machine.toml hidden/synthetic_075Hz.csv "
            "--tail hidden/synthetic_075Hz_tail.csv --since estimate-tracked.json --json {name}.json",
        ),
        needs=("example-lp400", "recording-lp400", "estimate-tracked"),
    ),
    Case(
        name="compare",
        commands=(
            "rotordrop compare estimate-tracked.json estimate-since.json --scatter '300 N' "
            "--json {name}.json",
        ),
        needs=("estimate-tracked", "estimate-since"),
    ),
    Case(
        name="changed",
        commands=(
            "rotordrop changed estimate-tracked.json estimate-since.json --json {name}.json",
            "rotordrop compare estimate-tracked.json estimate-since.json --changes --json {name}.json",
        ),
        needs=("estimate-tracked", "estimate-since"),
    ),
    *_bench("006", tail=False, quick=True),
    *_bench("018", quick=True),
    *_bench("009"),
    *_bench("036"),
    *_bench("071"),
    *_bench("015"),
    *_bench("038"),
    *_bench("049"),
    Case(
        name="estimate-twelve",
        commands=(
            "rotordrop estimate twelve.toml twelve/synthetic_150Hz.csv "
            "--tail twelve/synthetic_150Hz_tail.csv --json {name}.json",
        ),
        needs=("init-simple", "recording-twelve"),
    ),
    Case(
        name="score",
        commands=(
            "rotordrop score estimate-twelve.json twelve/truth/synthetic_150Hz.json --json {name}.json",
            "rotordrop_bench score estimate-twelve.json twelve/truth/synthetic_150Hz.json --json {name}.json",
        ),
        needs=("estimate-twelve", "recording-twelve"),
    ),
)

INTERNALS = "internals"
VOLATILE = frozenset(
    {"rotordrop_version", "created", "computed", "written", "host", "threads", "wall_time_s"}
    | {"document_sha256", "sealed"}
)
"""Keys of documents and attributes of HDF5 files that say when, where or how fast, not what, and digests of
what is compared itself."""

LONG = 24
"""Numbers in an array from which on it is told by its digest."""
WIDTH = 160
MANY = 16
"""Rows of a table from which on only the first half as many stand there, and a digest of all."""
UNKNOWN_COMMAND = (
    "there is no command",
    "No such command",
    "is not one of",
    "No such option",
    "No module named",
    "Got unexpected extra argument",
)


# ---------------------------------------------------------------------------------------------- making


def make(out: Path, names: list[str], work: Path) -> None:
    """Run cases, with those they need, and write one result each."""
    out.mkdir(parents=True, exist_ok=True)
    work.mkdir(parents=True, exist_ok=True)
    shutil.copytree(GIVEN, work, dirs_exist_ok=True)
    known = {case.name: case for case in CASES}
    for name in names:
        if name == INTERNALS:
            before = _children_and_self()
            make_internals(out)
            print(f"{name}: {_children_and_self() - before:.1f} s", flush=True)
            continue
        for needed in known[name].needs:
            if not _is_there(known[needed], work):
                _run(known[needed], work, known)
        result, seconds = _run(known[name], work, known)
        (out / f"{name}.json").write_text(written(result) + "\n", encoding="utf-8")
        print(f"{name}: {seconds:.1f} s", flush=True)


def _files(case: Case) -> list[str]:
    return [file.replace("{name}", case.name) for file in case.files]


def _is_there(case: Case, work: Path) -> bool:
    return all((work / file).is_file() for file in _files(case) if file != "stdout")


def _children_and_self() -> float:
    used = (resource.getrusage(resource.RUSAGE_CHILDREN), resource.getrusage(resource.RUSAGE_SELF))
    return sum(u.ru_utime + u.ru_stime for u in used)


def _run(case: Case, work: Path, known: dict[str, Case]) -> tuple[dict[str, Any], float]:
    """Result of a case and its processor time [s]; what it needs is run first where it is not there."""
    for needed in case.needs:
        if not _is_there(known[needed], work):
            _run(known[needed], work, known)
    for file in _files(case):
        (work / file).unlink(missing_ok=True)
    shutil.rmtree(work / case.name, ignore_errors=True)
    before = _children_and_self()
    for command in case.commands:
        words = shlex.split(command.replace("{name}", case.name))
        done = subprocess.run(
            [sys.executable, "-m", *words],
            cwd=work,
            capture_output=True,
            text=True,
            check=False,
            env=os.environ | {"COLUMNS": "200", "NO_COLOR": "1"},
        )
        if done.returncode == 0 or not any(text in done.stderr for text in UNKNOWN_COMMAND):
            break
    seconds = _children_and_self() - before
    result: dict[str, Any] = {"exit_code": done.returncode}
    if done.returncode != 0:
        result["stderr"] = [line.rstrip() for line in done.stderr.strip().splitlines()]
    result["files"] = {
        file: done_text(done.stdout) if file == "stdout" else told(work / file)
        for file in _files(case)
        if file == "stdout" or (work / file).is_file()
    }
    absent = [file for file in _files(case) if file != "stdout" and not (work / file).is_file()]
    if absent:
        result["not_written"] = absent
        print(f"{case.name}: not written: {', '.join(absent)}", file=sys.stderr, flush=True)
    return result, seconds


def done_text(text: str) -> Any:
    """What a command printed: a document where it is one, else its lines."""
    try:
        return condensed(json.loads(text))
    except json.JSONDecodeError:
        return [line.rstrip() for line in text.strip().splitlines()]


def told(path: Path) -> Any:
    """A file as a small document: whole, or by digests where it is long."""
    if path.suffix == ".json":
        return condensed(json.loads(path.read_text(encoding="utf-8")))
    if path.suffix == ".toml":
        return condensed(tomllib.loads(path.read_text(encoding="utf-8")))
    if path.suffix == ".h5":
        return _hdf5(path)
    content = path.read_bytes()
    return {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}


def _hdf5(path: Path) -> dict[str, Any]:
    import h5py
    import numpy as np

    found: dict[str, Any] = {}

    def visit(name: str, item: Any) -> None:
        attributes = {
            key: _plain(value)
            for key, value in sorted(item.attrs.items())
            if key not in VOLATILE
            and not key.startswith("_")
            and key not in ("DIMENSION_LIST", "REFERENCE_LIST")
        }
        entry: dict[str, Any] = {"attributes": condensed(attributes)} if attributes else {}
        if isinstance(item, h5py.Dataset):
            values = np.asarray(item[()])
            numeric = values.dtype.kind in "fiub"
            entry |= _numbers_told(values) if numeric else {"values": condensed(_plain(values))}
        found[name] = entry

    with h5py.File(path) as file:
        visit("/", file)
        file.visititems(visit)
    return found


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    if isinstance(value, list):
        return [_plain(v) for v in value]
    if isinstance(value, str):
        try:
            return json.loads(value) if value[:1] in "{[" else value
        except json.JSONDecodeError:
            return value
    return value if isinstance(value, (int, float, bool)) or value is None else str(value)


def _numbers_told(values: Any) -> dict[str, Any]:
    """Digest of the exact bytes of an array and some of its numbers."""
    import numpy as np

    values = np.asarray(values)
    flat = values.ravel().astype(np.float64)
    finite = flat[np.isfinite(flat)]
    entry: dict[str, Any] = {
        "shape": list(values.shape),
        "type": str(values.dtype),
        "sha256": hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest(),
    }
    if len(finite):
        entry |= {
            "min": float(finite.min()),
            "max": float(finite.max()),
            "mean": math.fsum(finite) / len(finite),
        }
        entry["sample"] = [_json_number(v) for v in flat[np.linspace(0, len(flat) - 1, 7).astype(int)]]
    return entry


def _json_number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def condensed(value: Any) -> Any:
    """A document without its volatile entries, long arrays of numbers replaced by digest and sample."""
    if isinstance(value, dict):
        return {key: condensed(v) for key, v in value.items() if key not in VOLATILE}
    if isinstance(value, list):
        leaves = _leaves(value)
        if leaves is None and len(value) > MANY and all(isinstance(v, dict) for v in value):
            whole = [condensed(v) for v in value]
            exact = json.dumps(whole, separators=(",", ":"))
            digest = hashlib.sha256(exact.encode()).hexdigest()
            return {"length": len(value), "sha256": digest, "first": whole[: MANY // 2]}
        if leaves is None or len(leaves) <= LONG:
            return [condensed(v) for v in value]
        exact = json.dumps(value, separators=(",", ":"))
        numbers = [float(v) for v in leaves if v is not None]
        entry: dict[str, Any] = {
            "length": [len(value), len(leaves)],
            "sha256": hashlib.sha256(exact.encode()).hexdigest(),
        }
        if numbers:
            entry |= {"min": min(numbers), "max": max(numbers), "mean": math.fsum(numbers) / len(numbers)}
        entry["sample"] = [leaves[round(k * (len(leaves) - 1) / 6)] for k in range(7)]
        return entry
    return value


def written(value: Any, indent: str = "") -> str:
    """JSON with short parts on one line."""
    flat = json.dumps(value, ensure_ascii=False)
    if not isinstance(value, (dict, list)) or len(flat) + len(indent) <= WIDTH:
        return flat
    inner = indent + " "
    if isinstance(value, dict):
        parts = [f"{json.dumps(k, ensure_ascii=False)}: {written(v, inner)}" for k, v in value.items()]
    else:
        parts = [written(v, inner) for v in value]
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    return f"{opening}\n{inner}" + f",\n{inner}".join(parts) + f"\n{indent}{closing}"


def _leaves(value: list[Any]) -> list[Any] | None:
    """All numbers of a nested list; None where it holds something else."""
    leaves: list[Any] = []
    for entry in value:
        if isinstance(entry, list):
            inner = _leaves(entry)
            if inner is None:
                return None
            leaves += inner
        elif entry is None or (isinstance(entry, (int, float)) and not isinstance(entry, bool)):
            leaves.append(entry)
        else:
            return None
    return leaves


# ------------------------------------------------------------------------------------------- internals


def internals(states: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Per machine: states, right-hand side, Jacobian, energy and power, in an order of states that stays.

    ``states`` holds what is given already, by machine; where it holds none, states are drawn. Adapt this
    function and the two below when modules move, and keep the order: modes x, modes y, races, supports, their
    velocities, spins of the races, further states, rotor speed, rotor angle.
    """
    import numpy as np

    from rotordrop.machine import example_machine, load_machine
    from rotordrop.rotor.parameters import build_drop_model
    from rotordrop.simulate._histories import stored_energy
    from rotordrop.simulate._rhs import drop_derivative, scratch_of
    from rotordrop.simulate._sensitivity import drop_jacobian
    from rotordrop.simulate.case import DropCase, LevitatedStart
    from rotordrop.simulate.levitation import start_of_drop

    held = LevitatedStart(delay=0.01)
    let_go = LevitatedStart(
        delay=0.001, remanent_force=np.array([[40.0, 90.0], [-25.0, 60.0]]), remanence_time_constant=2e-3
    )
    machines = (
        ("paper", example_machine("paper"), "quick", 60.0, {}),
        ("paper-accurate", example_machine("paper"), "accurate", 100.0, {"spin": "prescribed"}),
        ("lp400", example_machine("lp400"), "accurate", 60.0, {"start": let_go}),
        ("small", example_machine("small"), "quick", 300.0, {"start": held}),
        ("scaled-5kg", load_machine(GIVEN / "scaled_5kg.toml"), "quick", 500.0, {}),
        ("scaled-1600kg", load_machine(GIVEN / "scaled_1600kg.toml"), "accurate", 80.0, {}),
        ("extended-60kg", load_machine(GIVEN / "extended_60kg.toml"), "quick", 150.0, {"start": let_go}),
    )

    for name, machine, reduction, hertz, how in machines:
        speed = 2.0 * np.pi * hertz
        model = build_drop_model(machine, reduction)
        _, parameters = start_of_drop(model, DropCase(speed=speed, **how))
        layout, at = model.layout, _order(model.layout)
        if name in states:
            given = np.asarray(states[name], dtype=np.float64)
        else:
            drawings = [_drawn(model, speed, seed)[at] for seed in range(200)]
            given = np.array(drawings).astype(np.float32).astype(np.float64)
        n = len(at)
        rates, jacobians = np.empty((len(given), n)), np.empty((len(given), n, n))
        energy, power = np.empty(len(given)), np.empty((len(given), 2))
        work, size = scratch_of(parameters), layout.rotor_angle + 1
        for i, values in enumerate(given):
            state, rate, jacobian = layout.zeros(), layout.zeros(), np.zeros((size, size))
            state[at] = values
            drop_derivative(0.003, state, parameters, rate, work)
            drop_jacobian(0.003, state, parameters, jacobian)
            rates[i], jacobians[i] = rate[at], jacobian[np.ix_(at, at)]
            energy[i] = stored_energy(0.003, state, parameters, True)
            power[i] = rate[layout.dissipated], rate[layout.work_in]
        yield (
            name,
            {"states": given, "rates": rates, "jacobians": jacobians, "energy": energy, "power": power},
        )


def _order(layout: Any) -> Any:
    """Places of all states in the order of the yardstick."""
    import numpy as np

    q = [layout.modal_x, layout.modal_y, layout.race, layout.support]
    own = slice(layout.race_spin.stop, layout.magnets.stop)
    parts = [*q, *(layout.velocity_of(part) for part in q), layout.race_spin, own]
    places = [np.arange(part.start, part.stop) for part in parts]
    return np.concatenate([*places, [layout.rotor_speed, layout.rotor_angle]])


def _drawn(model: Any, speed: float, seed: int) -> Any:
    """A state with everything moving, in flight or in contact."""
    import numpy as np

    from rotordrop.simulate.levitation import rigid_amplitudes

    random = np.random.default_rng(seed)
    layout, state = model.layout, model.layout.zeros()
    ends = model.machine.touchdown_bearings
    gap = np.array([float(b.air_gap) for b in ends])
    azimuth = random.uniform(0.0, 2 * np.pi, len(ends))
    race = 3e-6 * random.standard_normal((len(ends), 2))
    # flight, one or more contacts, from grazing to far beyond what a drop does
    deep = random.choice([-0.8, -0.1, 1e-3, 0.05, 0.2], len(ends)) * gap
    place = race + (gap + deep)[:, None] * np.array([np.cos(azimuth), np.sin(azimuth)]).T
    positions = np.array([model.fe.node_positions[b.node - 1] for b in ends])
    modes = rigid_amplitudes(model, positions, place)
    bent = 1e-7 * random.standard_normal((layout.n_modes, 2))
    state[layout.modal_x], state[layout.modal_y] = (modes + bent).T
    state[layout.race] = race.ravel()
    state[layout.support] = 5e-6 * random.standard_normal(2 * len(ends))
    moving = slice(layout.n_coordinates, 2 * layout.n_coordinates)
    state[moving] = random.choice([0.005, 0.3]) * random.standard_normal(layout.n_coordinates)
    own = slice(layout.race_spin.stop, layout.magnets.stop)
    state[own] = 1e-5 * random.standard_normal(own.stop - own.start)
    state[layout.rotor_speed] = speed * random.uniform(0.2, 1.0)
    state[layout.rotor_angle] = random.uniform(0.0, 200.0)
    rims = 1.0 - gap / np.array([float(b.bore_radius) for b in ends])
    slip = random.choice([0.0, 0.98, 0.99995, 1.3], len(ends))
    state[layout.race_spin] = slip * state[layout.rotor_speed] * rims
    return state


SAMPLED = {"rates": 24, "jacobians": 1, "rows": 24, "energy": 200, "power": 200}
"""States of which all numbers are held, by quantity."""


def make_internals(out: Path) -> None:
    """Digests of all internals in one document, a sample of their numbers in an .npz beside it."""
    import numpy as np

    there = EXPECTED / "states.npz"
    states = dict(np.load(there)) if there.is_file() else {}
    drawn: dict[str, Any] = {}
    document: dict[str, Any] = {}
    sample: dict[str, Any] = {}
    for name, found in internals(states):
        drawn[name] = found["states"].astype(np.float32)
        # a Jacobian times a fixed vector of changes shows all its rows at a small price
        n = found["states"].shape[1]
        changes = 1e-3 * np.max(np.abs(found["states"]), axis=0) * np.cos(np.arange(n))
        found["rows"] = np.sum(found["jacobians"] * changes, axis=2)
        document[name] = {
            key: {
                "shape": list(v.shape),
                "sha256": hashlib.sha256(np.ascontiguousarray(v).tobytes()).hexdigest(),
            }
            for key, v in found.items()
            if key != "rows"
        }
        sample |= {f"{name}.{key}": found[key][:count] for key, count in SAMPLED.items()}
    if not states:
        np.savez_compressed(there, **drawn)
    text = written({"exit_code": 0, "files": document})
    (out / f"{INTERNALS}.json").write_text(text + "\n", encoding="utf-8")
    np.savez_compressed(out / f"{INTERNALS}.npz", **sample)


def compare_internals(expected: Path, actual: Path) -> Iterator[tuple[float, str]]:
    """How far the sampled numbers are apart, relative to the largest of their kind in the sample."""
    import numpy as np

    old, new = np.load(expected), np.load(actual)
    for key in old.files:
        if key not in new.files or old[key].shape != new[key].shape:
            yield math.inf, f"{key}: missing or of another shape"
            continue
        before, after = old[key], new[key]
        if key.endswith("jacobians"):
            # an entry counts beside the largest one of its row, its column scaled to the others
            rows = np.max(np.abs(before), axis=2, keepdims=True)
            scale = rows * np.max(np.abs(before) / np.where(rows > 0.0, rows, 1.0), axis=1, keepdims=True)
        else:
            scale = np.max(np.abs(before), axis=0, keepdims=True)
        apart = np.abs(after - before)
        share = np.max(apart / np.where(scale > 0.0, scale, 1.0))
        one = np.max(np.where(apart > 0.0, apart / np.maximum(np.abs(before), 1e-300), 0.0))
        if share > 0.0:
            yield share, f"{key}: up to {share:.2e} of the largest, {one:.2e} of the number itself"


# ------------------------------------------------------------------------------------------- comparing


@dataclass(frozen=True, kw_only=True)
class Difference:
    """One place where two documents differ; ``size`` relative, or in half widths of its interval.

    A ``sampled`` digest says only that something moved; numbers beside it say how far.
    """

    path: str
    old: Any
    new: Any
    size: float = math.inf
    of_half_width: bool = False
    sampled: bool = False

    def __str__(self) -> str:
        text = f"{self.path}: {_short(self.old)} -> {_short(self.new)}"
        if math.isfinite(self.size):
            text += f"  ({self.size:.2e} {'of the half width' if self.of_half_width else 'relative'})"
        return text


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= 160 else text[:157] + "..."


MISSING = "(missing)"


def differences(old: Any, new: Any, path: str = "", half_width: float = 0.0) -> Iterator[Difference]:
    """All places where two documents differ, in the order of the old one."""
    if isinstance(old, dict) and isinstance(new, dict):
        yield from _of_mappings(old, new, path)
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            yield Difference(path=f"{path} (length)", old=len(old), new=len(new))
        for i, pair in enumerate(zip(old, new, strict=False)):
            yield from differences(*pair, f"{path}/{i}", half_width)
    elif (type(old) is not type(new) or old != new) and not (_is_nan(old) and _is_nan(new)):
        yield _of_values(old, new, path, half_width)


def _of_mappings(old: dict[str, Any], new: dict[str, Any], path: str) -> Iterator[Difference]:
    half_width = _half_width(old)
    for key in [*old, *(k for k in new if k not in old)]:
        place = f"{path}/{key}"
        if key not in old or key not in new:
            yield Difference(path=place, old=old.get(key, MISSING), new=new.get(key, MISSING))
        elif key == "sha256" and ("sample" in old or "first" in old):
            if old[key] != new[key]:
                yield Difference(path=place, old=old[key], new=new[key], sampled=True)
        else:
            yield from differences(old[key], new[key], place, half_width)
    if list(old) != list(new) and set(old) == set(new):
        yield Difference(path=f"{path} (order)", old=list(old), new=list(new))


def _of_values(old: Any, new: Any, path: str, half_width: float) -> Difference:
    numbers = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in (old, new))
    if not numbers or _is_nan(old) or _is_nan(new):
        return Difference(path=path, old=old, new=new)
    # a count has no interval of its own
    in_widths = half_width > 0.0 and isinstance(old, float)
    scale = half_width if in_widths else max(abs(old), abs(new))
    size = abs(new - old) / scale if scale > 0.0 else 0.0
    return Difference(path=path, old=old, new=new, size=size, of_half_width=in_widths)


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and math.isnan(value)


def _half_width(entry: dict[str, Any]) -> float:
    interval = entry.get("interval_90")
    if isinstance(interval, list) and len(interval) == 2 and None not in interval:
        return abs(interval[1] - interval[0]) / 2.0
    error = entry.get("standard_error")
    return 1.645 * error if isinstance(error, float) else 0.0


def compare(expected: Path, actual: Path, allowed: list[str], within: float, full: bool) -> int:
    """Print what differs; 1 where anything does that is not allowed."""
    wrong, judged = 0, 0
    for old in sorted(expected.glob("*.json")):
        name, new = old.stem, actual / old.name
        if not new.is_file():
            continue
        judged += 1
        pair = (json.loads(p.read_text(encoding="utf-8")) for p in (old, new))
        found = list(differences(*pair))
        numbers = [d for d in found if math.isfinite(d.size)]
        beyond = [d for d in found if d.size > within and not (d.sampled and within > 0.0)]
        extra: list[str] = []
        if name == INTERNALS and found:
            apart = list(compare_internals(expected / f"{name}.npz", actual / f"{name}.npz"))
            extra = [line for _, line in apart]
            if within > 0.0 and all(share <= within for share, _ in apart):
                beyond = [d for d in beyond if not d.path.endswith("/sha256")]
        if not found:
            print(f"{name}: equal")
            continue
        verdict = "within" if not beyond else ("differs, allowed" if name in allowed else "DIFFERS")
        wrong += verdict == "DIFFERS"
        print(f"{name}: {verdict}, {len(found)} places{_largest(numbers)}")
        for line in found if full else found[:40]:
            print(f"    {line}")
        if len(found) > 40 and not full:
            print(f"    ... and {len(found) - 40} more (--full)")
        for line in extra:
            print(f"    {line}")
    absent = sum(1 for old in expected.glob("*.json") if not (actual / old.name).is_file())
    print(f"{judged} compared, {wrong} differ" + (f", {absent} not made" if absent else ""))
    return 1 if wrong or not judged else 0


def _largest(numbers: list[Difference]) -> str:
    text = ""
    for what, flag in (("of a half width", True), ("relative", False)):
        sizes = [d.size for d in numbers if d.of_half_width is flag]
        if sizes:
            text += f", largest {max(sizes):.2e} {what}"
    return text


# ----------------------------------------------------------------------------------------------- times


def timed_actions() -> dict[str, Callable[[], Any]]:
    """What is timed, each called several times in this process; the first is the naive reference.

    Adapt this function when modules move.
    """
    sys.path.insert(0, str(HERE.parent / "benchmarks"))
    from naive_drop import NaiveDrop
    from speed import CASE, STRETCH

    from rotordrop.evidence.evidence import read_evidence
    from rotordrop.machine import example_machine, load_machine
    from rotordrop.record.examples import example_record_path
    from rotordrop.record.record import read_record
    from rotordrop.rotor.parameters import build_drop_model
    from rotordrop.simulate.drop import simulate_drop
    from rotordrop.track.calibration import stage_settings
    from rotordrop.track.smoother import forward, smooth
    from rotordrop.twin.problems import WINDOW, twin_problem
    from rotordrop.twin.search import WHOLE_STAGE

    paper = example_machine("paper")
    quick, accurate = build_drop_model(paper, "quick"), build_drop_model(paper, "accurate")
    naive = NaiveDrop(quick, CASE)
    machine = load_machine(GIVEN / "lp400_calibrated.toml")
    record = read_record(example_record_path("lp400_drop_060"), machine)
    tail = read_record(example_record_path("lp400_drop_060_tail"), machine)
    problem = twin_problem(machine, read_evidence(build_drop_model(machine), record, tail))
    settings = stage_settings(problem, WHOLE_STAGE)
    samples = sum(1 for t in problem.time if t <= WINDOW)
    passed = forward(problem, settings, samples=samples)
    return {
        "naive reference, 20 ms": lambda: naive.run(STRETCH),
        "one drop, quick": lambda: simulate_drop(quick, CASE),
        "one drop, accurate": lambda: simulate_drop(accurate, CASE),
        "model, accurate": lambda: build_drop_model(paper, "accurate"),
        "evidence of a record": lambda: read_evidence(build_drop_model(machine), record, tail),
        "filter pass, forward": lambda: forward(problem, settings, samples=samples),
        "filter pass, backward": lambda: smooth(passed, watched=problem.watched),
    }


def times(rounds: int, output: Path | None) -> None:
    """Medians of processor times, and each over the naive reference of the same round."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # before anything loads numpy
    actions = timed_actions()
    for action in actions.values():
        action()
    seen: dict[str, list[float]] = {name: [] for name in actions}
    for _ in range(rounds):
        for name, action in actions.items():
            repeats = 5 if name.startswith("one drop") else 1
            spent = []
            for _ in range(repeats):
                began = time.process_time()
                action()
                spent.append(time.process_time() - began)
            seen[name].append(statistics.median(spent))
    fresh = "from rotordrop.simulate.fingerprint import fingerprint; fingerprint()"
    first: list[float] = []
    for _ in range(rounds + 1):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-c", fresh], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        first.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    seen["first result, warm"] = first[1:]
    reference = next(iter(seen.values()))
    lines = [f"{'':28}{'median':>12}{'over naive':>14}{'spread':>9}"]
    for name, spent in seen.items():
        ratio = [s / r for s, r in zip(spent, reference, strict=True)]
        spread = (max(ratio) - min(ratio)) / statistics.median(ratio)
        time_ms = 1e3 * statistics.median(spent)
        lines.append(f"{name:28}{time_ms:9.2f} ms{statistics.median(ratio):14.5f}{spread:9.1%}")
    text = "\n".join(lines)
    print(text)
    if output is not None:
        output.write_text(text + "\n", encoding="utf-8")


# ------------------------------------------------------------------------------------------------ main


def _chosen(options: argparse.Namespace) -> list[str]:
    everything = [case.name for case in CASES] + [INTERNALS]
    if options.only:
        unknown = set(options.only) - set(everything)
        if unknown:
            sys.exit(f"no case {', '.join(sorted(unknown))}; there are {', '.join(everything)}")
        return [name for name in everything if name in options.only]
    if options.all:
        return everything
    return [case.name for case in CASES if case.quick] + [INTERNALS]


def main() -> int:
    """Make, compare or time."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    verb = verbs.add_parser("make", help="run cases and write their results; the quick set by default")
    verb.add_argument("out", type=Path)
    verb.add_argument("--only", nargs="+", default=[], metavar="NAME")
    verb.add_argument("--quick-set", action="store_true")
    verb.add_argument("--all", action="store_true")
    verb.add_argument("--work", type=Path, help="folder of inputs and whole documents, held for later")
    verb = verbs.add_parser("compare", help="say what differs")
    verb.add_argument("expected", type=Path)
    verb.add_argument("actual", type=Path)
    verb.add_argument("--allow", nargs="+", default=[], metavar="NAME")
    verb.add_argument("--within", type=float, default=0.0, metavar="SHARE")
    verb.add_argument("--full", action="store_true")
    verb = verbs.add_parser("times", help="time the work that counts")
    verb.add_argument("--rounds", type=int, default=5)
    verb.add_argument("--output", type=Path, help="also write the table to this file")
    verbs.add_parser("list", help="name the cases")
    options = parser.parse_args()
    if options.verb == "compare":
        return compare(options.expected, options.actual, options.allow, options.within, options.full)
    if options.verb == "times":
        times(options.rounds, options.output)
    elif options.verb == "list":
        for case in CASES:
            print(f"{case.name:24}{'quick' if case.quick else '':8}{case.commands[0]}")
        print(f"{INTERNALS:24}quick")
    elif options.work:
        make(options.out, _chosen(options), options.work)
    else:
        with tempfile.TemporaryDirectory() as folder:
            make(options.out, _chosen(options), Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
