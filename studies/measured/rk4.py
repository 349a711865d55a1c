"""The run-up of an RK-4 kit against `run_up_response`: fitted amplitude over the speed, with the beat.

    python studies/measured/rk4.py runup_bode.csv [TABLE.md]

Five numbers are fitted to the measured 1X vectors: critical speed (by the bending stiffness), damping of the
shaft, time of the run-up, unbalance and its phase; a constant vector stands for the runout, which was not
taken off. The rest is the file rk4.toml.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from rotordrop import Machine, load_machine
from rotordrop.files import write_text
from rotordrop.rotor.unbalanced import run_up_response

RPM = 2.0 * np.pi / 60.0
PROBE = 7
Array = np.ndarray


def read(path: Path, last: float = 2002.5) -> tuple[Array, Array]:
    """Speeds [rad/s] and 1X vectors [m] up to a speed [rpm]."""
    print("SHA-256", hashlib.sha256(path.read_bytes()).hexdigest())
    lines = [line for line in path.read_text().splitlines() if line[:1].isdigit()]
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    rows = rows[rows[:, 0] <= last]
    # amplitude in micrometres is the last column of the source and the second of a copy
    amplitude, phase = (rows[:, 3], rows[:, 2]) if rows.shape[1] == 4 else (rows[:, 1], rows[:, 2])
    return rows[:, 0] * RPM, 1e-6 * amplitude * np.exp(1j * np.radians(phase))


def risen(machine: Machine, speed: Array, factors: Array) -> Array:
    """1X vectors in x per 10 g mm at the probe at measured speeds for stiffness, damping, time."""
    stiffness, damping, duration = factors
    values = {"rotor.stiffness_factor": stiffness, "rotor.modal_damping": damping}
    described = machine.with_values(values)
    start, top = float(speed[0]), float(speed[-1])
    found = run_up_response(described, top, duration, "AMBs", start=start)
    x = found.at(PROBE)[:, 0]
    return np.interp(speed, found.speed, x.real) + 1j * np.interp(speed, found.speed, x.imag)


def matched(machine: Machine, speed: Array, seen: Array, factors: Array, turned: int) -> tuple[Array, Array]:
    """Measured vectors as far as unbalance and runout explain them, and both complex numbers."""
    one = risen(machine, speed, factors)
    one = one.conj() if turned < 0 else one
    design = np.column_stack([one, np.ones_like(one)])
    solution = np.linalg.lstsq(design, seen, rcond=None)[0]
    return design @ solution, solution


def maxima(speed: Array, amplitude: Array) -> list[int]:
    """Speeds [rpm] of the later maxima."""
    inner = (amplitude[1:-1] > amplitude[:-2]) & (amplitude[1:-1] > amplitude[2:])
    at = 1 + np.flatnonzero(inner & (speed[1:-1] > 1700.0 * RPM))
    return [round(speed[i] / RPM) for i in at]


def main() -> None:
    machine = load_machine(Path(__file__).with_name("rk4.toml"))
    speed, seen = read(Path(sys.argv[1]))
    begin = np.array([1.17, 0.03, 5.5])
    sense = {turned: matched(machine, speed, seen, begin, turned)[0] - seen for turned in (1, -1)}
    turned = min(sense, key=lambda one: float(np.linalg.norm(sense[one])))

    def left(point: Array) -> Array:
        rest = matched(machine, speed, seen, np.exp(point), turned)[0] - seen
        print(np.exp(point), 1e6 * np.linalg.norm(rest) / np.sqrt(len(rest)), flush=True)
        return np.concatenate([rest.real, rest.imag]) * 1e6

    factors = np.exp(least_squares(left, np.log(begin), diff_step=3e-3, xtol=1e-3, max_nfev=15).x)
    fit, (unbalance, runout) = matched(machine, speed, seen, factors, turned)
    rest = np.sqrt(np.mean(np.abs(fit - seen) ** 2))
    lines = [
        "| quantity | measured | computed |",
        "|---|---:|---:|",
        f"| largest 1X, µm | {1e6 * np.abs(seen).max():.1f} | {1e6 * np.abs(fit).max():.1f} |",
        f"| at, rpm | {speed[np.abs(seen).argmax()] / RPM:.0f} | {speed[np.abs(fit).argmax()] / RPM:.0f} |",
        f"| later maxima, rpm | {', '.join(map(str, maxima(speed, np.abs(seen))))} "
        f"| {', '.join(map(str, maxima(speed, np.abs(fit))))} |",
        f"| rms of the difference of the vectors, µm | – | {1e6 * rest:.2f} |",
        f"| run-up over these speeds, s | not stated | {factors[2]:.2f} |",
        f"| bending stiffness, factor | – | {factors[0]:.3f} |",
        f"| damping ratio of the free shaft's modes, % | – | {100.0 * factors[1]:.1f} |",
        f"| unbalance of a disc, g mm | not stated | {10.0 * abs(unbalance):.1f} |",
        f"| runout, µm | not stated | {1e6 * abs(runout):.2f} |",
    ]
    print("\n".join(lines))
    if len(sys.argv) > 2:
        write_text(sys.argv[2], "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
