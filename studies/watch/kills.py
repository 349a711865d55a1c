"""Watchers that are killed: is any record lost, counted twice, or let through although it is damaged?

Usage: python studies/watch/kills.py FOLDER CALIBRATED.toml [RECORDS] [ESTIMATED] [KILL_EVERY_S] [SEED]

Writes German CSV records of 50 machines (decimal comma, the serial number in the name or the head)
into FOLDER/drops at random times while two watchers run, one in a hundred of them damaged. ESTIMATED of them
are of machines whose file is known, the others are looked at. A watcher, or a computation, is killed
by SIGKILL every KILL_EVERY_S seconds, and once the file system of log and kept records is full, where
FOLDER/kept is one of its own. Prints the table.
"""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path

import numpy as np

from rotordrop.machine import load_machine
from rotordrop.record.record import read_record
from rotordrop.watch.kept import Kept, status_of
from rotordrop.web.workspace import Workspace

PACKAGE = Path(str(resources.files("rotordrop")))
MACHINES, WATCHERS = 50, 2
NOISE, NOISY = 0.02, 200  # added to some samples of each record [µm], so that no two are alike
BUNCH = 16  # records at most that arrive together
LOOK_S = 3.0  # pause between two looks at what is done
SPAN = (-0.12, 0.33)  # of a record [s] about its zero
DAMAGES = (
    "empty",
    "text in a number",
    "binary",
    "missing samples",
    "time runs backwards",
    "dead channel",
    "cut",
)


def templates() -> tuple[list[str], np.ndarray]:
    """Column names and values of the bundled record, in the units of the export."""
    machine = load_machine(PACKAGE / "machine" / "examples" / "lp400.toml")
    record = read_record(PACKAGE / "examples" / "lp400" / "drop_060.h5", machine)
    chosen = (record.time >= SPAN[0]) & (record.time < SPAN[1])
    speed = np.interp(record.time[chosen], record.speed_time, record.speed_readings) * 30.0 / np.pi
    names = [f"{sensor.name} [um]" for sensor in record.sensors]
    columns = [record.time[chosen], *(1e6 * record.signals[chosen].T), speed]
    return ["Zeit [s]", *names, "Drehzahl [rpm]"], np.column_stack(columns)


def rows_of(values: np.ndarray) -> list[str]:
    """Rows of a record as a German Excel writes them."""
    return [";".join(f"{value:.5f}" for value in row).replace(".", ",") for row in values]


def csv(head: str, names: list[str], rows: list[str]) -> bytes:
    """A record as a German Excel writes it."""
    return ("\r\n".join([head, ";".join(names), *rows]) + "\r\n").encode("latin-1")


def damaged(kind: str, whole: bytes, names: list[str], values: np.ndarray, head: str) -> bytes:
    """The same record, damaged."""
    rows = len(values)
    if kind == "empty":
        return b" " * len(head)
    if kind == "text in a number":
        lines = whole.split(b"\r\n")
        lines[rows // 2] = lines[rows // 2].replace(b",", b"#", 3)
        return b"\r\n".join(lines)
    if kind == "binary":
        return whole[:300] + os.urandom(len(whole) // 2)
    if kind == "cut":  # before the drop
        return whole[: len(whole) // 6]
    worse = values.copy()
    if kind == "missing samples":
        worse = np.delete(worse, slice(rows // 3, rows // 2), axis=0)
    elif kind == "time runs backwards":
        worse[rows // 2 :, 0] -= 0.05
    else:
        worse[:, 1] = worse[0, 1]
    return csv(head, names, rows_of(worse))


def written(folder: Path, records: int, estimated: int, draw: random.Random) -> dict[str, tuple[str, str]]:
    """Write all records beside the folder that is watched; kind of damage and serial number by name."""
    names, values = templates()
    plain = rows_of(values)
    noise = np.random.default_rng(draw.randrange(2**32))
    made = {}
    known = set(draw.sample(range(records), estimated))
    bad = set(draw.sample(range(records), max(records // 100, len(DAMAGES))))
    for k in range(records):
        serial = f"{'K' if k in known else 'U'}{4700 + draw.randrange(MACHINES // 2)}"
        in_head = draw.random() < 0.3
        head = f"Messung 14.03.2026 15:09;Anlage {serial if in_head else 'Halle 3'}"
        first = draw.randrange(len(values) - NOISY)
        noisy = values.copy()
        noisy[first : first + NOISY, 1:5] += NOISE * noise.standard_normal((NOISY, 4))
        rows = [*plain[:first], *rows_of(noisy[first : first + NOISY]), *plain[first + NOISY :]]
        whole, kind = csv(head, names, rows), ""
        if k in bad:
            kind = DAMAGES[len([one for one in made.values() if one[0]]) % len(DAMAGES)]
            whole = damaged(kind, whole, names, noisy, head)
        name = f"{'drop' if in_head else serial}_{k:05d}.csv"
        (folder / name).write_bytes(whole)
        made[name] = (kind, serial if k in known else "")
    return made


def begun(place: Path, number: int) -> subprocess.Popen[bytes]:
    """A watcher."""
    return subprocess.Popen(
        [
            *(sys.executable, "-m", "rotordrop", "watch", str(place / "drops"), "--every", "0.5", "--quick"),
            *("--machines", str(place / "machines"), "--log", str(place / "kept" / "drops.db")),
            *("--keep", str(place / "kept" / "kept"), "--hook", f"{sys.executable} {place / 'hook.py'}"),
        ],
        stdout=(place / f"watcher{number}.txt").open("ab"),
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )


HOOK = """import json, os, sys
told = json.load(sys.stdin)
line = (json.dumps(told) + "\\n").encode()
descriptor = os.open({place!r}, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
os.write(descriptor, line)
"""


def done(kept: Kept) -> Counter[str]:
    """Outcomes so far."""
    found: Counter[str] = Counter()
    for number in kept.numbers():
        told = status_of(kept.job(number))
        found[told["outcome"] if told and told.get("done") else "under way"] += 1
    return found


def memory(process: subprocess.Popen[bytes]) -> float:
    """Resident memory [MB]."""
    try:
        text = Path(f"/proc/{process.pid}/status").read_text()
        return int(text.split("VmRSS:")[1].split()[0]) / 1024.0
    except (OSError, IndexError):
        return float("nan")


@dataclass
class Killing:
    """Kills watchers and computations, and fills the disk once."""

    place: Path
    kept: Kept
    watchers: list[subprocess.Popen[bytes]]
    draw: random.Random
    every: float
    last: float = field(default_factory=time.time)
    kills: int = 0
    of_computations: int = 0
    filled: float = 0.0

    def turn(self, *, filling: bool) -> None:
        """Kill one where it is time; the disk is full for a quarter of a minute."""
        ballast = self.place / "kept" / "ballast"
        if self.filled and time.time() - self.filled > 15.0:
            ballast.unlink(missing_ok=True)
        if time.time() - self.last < self.every:
            return
        self.last = time.time()
        victim = self.draw.randrange(len(self.watchers) + 1)
        if victim < len(self.watchers):
            os.kill(self.watchers[victim].pid, signal.SIGKILL)
            self.watchers[victim].wait()
            self.watchers[victim] = begun(self.place, victim)
            self.kills += 1
        else:
            self.of_computations += kill_a_child(self.kept)
        own = self.place.stat().st_dev != ballast.parent.stat().st_dev
        if own and filling and not self.filled:
            self.filled = time.time()
            fill(ballast)


def main() -> None:
    """Write, watch, kill, count."""
    place, calibrated = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    records, estimated = (int(text) for text in (sys.argv[3:5] or ("200", "4")))
    every = float(sys.argv[5]) if len(sys.argv) > 5 else 10.0
    draw = random.Random(int(sys.argv[6]) if len(sys.argv) > 6 else 1)
    for name in ("all", "drops", "machines", "kept"):
        (place / name).mkdir(parents=True, exist_ok=True)
    (place / "hook.py").write_text(HOOK.format(place=str(place / "hooked.jsonl")))
    for k in range(MACHINES // 2):
        shutil.copy(calibrated, place / "machines" / f"K{4700 + k}.toml")
    for table in calibrated.parent.glob("*.csv"):
        shutil.copy(table, place / "machines")
    made = written(place / "all", records, estimated, draw)
    kept = Kept(Workspace(place / "kept" / "kept"))
    waiting = sorted(made, key=lambda _: draw.random())
    watchers = [begun(place, k) for k in range(WATCHERS)]
    start, asked, sizes = time.time(), 0.0, []
    killing = Killing(place, kept, watchers, draw, every)
    while time.time() - start < 3.0 * 3600.0:
        for _ in range(draw.randrange(BUNCH)):
            if waiting:
                arrive(place, waiting.pop(), draw)
        time.sleep(draw.uniform(0.1, 0.5))
        killing.turn(filling=len(waiting) < records // 2)
        sizes.append(max(memory(one) for one in watchers))
        if not waiting and time.time() - asked > LOOK_S:
            found, asked = done(kept), time.time()
            if sum(found.values()) >= records and not found["under way"]:
                break
    for one in watchers:
        one.send_signal(signal.SIGINT)
        one.wait()
    report(place, kept, made, time.time() - start, killing, sizes)


def arrive(place: Path, name: str, draw: random.Random) -> None:
    """A record arrives: at once, or in two pieces with a pause in between."""
    whole = (place / "all" / name).read_bytes()
    if draw.random() < 0.1:
        with (place / "drops" / name).open("wb") as stream:
            stream.write(whole[: len(whole) // 2])
            stream.flush()
            time.sleep(1.0)
            stream.write(whole[len(whole) // 2 :])
        return
    (place / "drops" / name).write_bytes(whole)


def kill_a_child(kept: Kept) -> int:
    """Kill one computation."""
    for number in kept.numbers():
        for file in kept.job(number).path.glob("*.process"):
            process = int(file.read_text())
            command = Path(f"/proc/{process}/cmdline")
            if command.exists() and b"rotordrop.child" in command.read_bytes():
                os.kill(process, signal.SIGKILL)
                return 1
    return 0


def fill(ballast: Path) -> None:
    """Leave no byte."""
    with ballast.open("wb") as stream:
        try:
            while True:
                stream.write(b"\0" * 2**16)
                stream.flush()
        except OSError:
            pass


def report(place: Path, kept: Kept, made, seconds: float, killing: Killing, sizes) -> None:
    """Count and print."""
    outcomes: dict[str, list[tuple[str, str]]] = {}
    for number in kept.numbers():
        told = status_of(kept.job(number))
        if told is not None:
            why = kept.path / "quarantine" / number / "why.txt"
            said = why.read_text().strip() if why.exists() else ""
            outcomes.setdefault(Path(told["source"]).name, []).append((told["outcome"], said))
    final = {name: [one for one in found if one[0] != "superseded"] for name, found in outcomes.items()}
    lost = [name for name in made if not final.get(name)]
    twice = [name for name, found in final.items() if len(found) > 1]
    bad = [name for name, (kind, _) in made.items() if kind]
    through = [
        (name, made[name][0]) for name in bad if name not in lost and final[name][0][0] != "quarantined"
    ]
    silent = [name for name in bad if name not in lost and final[name][0] == ("quarantined", "")]
    sound = [n for n, found in final.items() if not made[n][0] and found and found[0][0] == "quarantined"]
    with sqlite3.connect(place / "kept" / "drops.db") as log:
        logged = [name for (name,) in log.execute("SELECT record FROM drops")]
    wanted = [n for n, (kind, serial) in made.items() if serial and not kind]
    hooked = Counter()
    if (place / "hooked.jsonl").exists():
        for line in (place / "hooked.jsonl").read_text().splitlines():
            hooked[json.loads(line)["sha256"]] += 1
    print(
        f"{len(made)} records, {len(wanted)} with an estimate, {len(bad)} damaged; {seconds:.0f} s, "
        f"{3600 * len(made) / seconds:.0f} records an hour"
    )
    print(
        f"kills of watchers {killing.kills}, of computations {killing.of_computations}, "
        f"disk full: {killing.filled > 0}"
    )
    print(f"lost {len(lost)} {lost[:5]}, twice {len(twice)} {twice[:5]}")
    print(f"outcomes {dict(Counter(found[0][0] for found in final.values() if found))}")
    print(
        f"damaged and not quarantined {through}; without a reason {silent}; sound and quarantined {sound[:5]}"
    )
    logged_twice = [name for name, count in Counter(logged).items() if count > 1]
    print(f"logged {len(logged)}, missing {sorted(set(wanted) - set(logged))[:5]}, twice {logged_twice}")
    print(f"hook: {len(hooked)} drops, {sum(hooked.values())} calls")
    third = len(sizes) // 3
    first, last = (np.nanmedian(part) for part in (sizes[:third], sizes[-third:]))
    largest = np.nanmax(sizes)
    print(f"memory of a watcher [MB], first and last third, largest: {first:.0f} {last:.0f} {largest:.0f}")
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"processor time {spent.ru_utime + spent.ru_stime:.0f} s, what killed watchers began left out")


if __name__ == "__main__":
    main()
