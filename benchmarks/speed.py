"""How much faster a compiled drop is than a naive one, all in one run and on one core.

    python benchmarks/speed.py [--output benchmarks/results.json] [--rounds 5]

Times of one core are processor times of the process, so that other work on the machine does not count; the
batch and the fresh processes are wall times.
"""

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"

import argparse
import json
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numba
import numpy as np
import scipy
from naive_drop import NaiveDrop

from rotordrop.machine import example_machine
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.simulate.case import DropCase, PlacedStart
from rotordrop.simulate.drop import simulate_drop

START = PlacedStart(displacement=np.array([[0.0, 2e-6], [0.0, -5e-6]]), velocity=np.zeros((2, 2)))
CASE = DropCase(speed=2.0 * np.pi * 60.0, duration=0.2, tolerance=1e-6, start=START)
STRETCH = 0.02
BATCH = 16

FRESH = """
import hashlib, time
began = time.perf_counter()
from rotordrop.machine import example_machine
from rotordrop.rotor.parameters import build_drop_model
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.drop import simulate_drop
model = build_drop_model(example_machine("paper"), "quick")
result = simulate_drop(model, DropCase(speed=376.99, duration=0.2))
print(time.perf_counter() - began, time.process_time(), hashlib.sha256(result.state.tobytes()).hexdigest())
"""


def cost(action: Callable[[], Any]) -> tuple[float, Any]:
    """Processor time [s] of an action, and what it returns."""
    began = time.process_time()
    value = action()
    return time.process_time() - began, value


def force_error(model: DropModel) -> tuple[list[float], list[float]]:
    """Largest error of the force over 20 ms against a tight reference, and the peak [N], per bearing."""
    short = DropCase(speed=CASE.speed, duration=STRETCH, tolerance=CASE.tolerance, start=START)
    tight = DropCase(speed=CASE.speed, duration=STRETCH, tolerance=1e-12, start=START)
    force, reference = simulate_drop(model, short).bearing_force, simulate_drop(model, tight).bearing_force
    peak = np.max(np.linalg.norm(reference, axis=-1), axis=0)
    error = np.max(np.linalg.norm(force - reference, axis=-1), axis=0)
    return (error / peak).tolist(), peak.tolist()


def naive_error(drop: NaiveDrop, model: DropModel) -> float:
    """Largest difference of the naive force from the tight reference over 20 ms, over the peak [1]."""
    tight = DropCase(speed=CASE.speed, duration=STRETCH, tolerance=1e-12, start=START)
    reference = simulate_drop(model, tight)
    found = drop.run(STRETCH, reference.time[:-1]).force
    difference = np.linalg.norm(found - reference.bearing_force[:-1], axis=-1)
    peak = np.max(np.linalg.norm(reference.bearing_force, axis=-1), axis=0)
    return float(np.max(difference / peak))


def one_core(model: DropModel, rounds: int) -> dict[str, Any]:
    """Naive numpy over ours, in rounds that take turns."""
    naive = NaiveDrop(model, CASE)
    simulate_drop(model, CASE)
    full, whole = cost(lambda: naive.run(CASE.duration))
    say(
        f"naive, whole drop: {full:.1f} s for {whole.calls} right-hand sides, "
        f"{1e6 * full / whole.calls:.1f} µs each"
    )
    calls, ours, naives = whole.calls, [], []
    for _ in range(rounds):
        ours.append(statistics.median(cost(lambda: simulate_drop(model, CASE))[0] for _ in range(9)))
        seconds, run = cost(lambda: naive.run(STRETCH))
        naives.append(seconds * calls / run.calls)
        say(f"ours {1e3 * ours[-1]:.2f} ms, naive {naives[-1]:.1f} s")
    result = simulate_drop(model, CASE)
    state = np.asarray(result.state[5000, : len(naive.start)])
    return {
        "ours_ms": [1e3 * t for t in ours],
        "ours_steps": [result.steps, result.rejected_steps],
        "naive_whole_drop_s": full,
        "naive_calls": calls,
        "naive_us_per_call": 1e6 * full / calls,
        "naive_right_hand_side_us": right_hand_side(naive, state),
        "naive_scaled_from_20_ms_s": naives,
        "naive_force_difference": naive_error(naive, model),
        "ratio_of_whole_drop": full / statistics.median(ours),
        "ratio_per_round": [n / o for n, o in zip(naives, ours, strict=True)],
        "ratio": statistics.median(n / o for n, o in zip(naives, ours, strict=True)),
    }


def right_hand_side(drop: NaiveDrop, state: np.ndarray) -> float:
    """Time of one call with both bearings in contact [µs]."""
    return (
        1e6 * min(cost(lambda: [drop.derivative(0.05, state) for _ in range(500)])[0] for _ in range(5)) / 500
    )


def batch(model: DropModel, rounds: int) -> dict[str, Any]:
    """Wall time of a batch on one thread over that on two."""
    ratios, rates = [], []
    for _ in range(rounds):
        times = []
        for threads in (1, 2):
            began = time.perf_counter()
            with ThreadPoolExecutor(threads) as pool:
                list(pool.map(simulate_drop, [model] * BATCH, [CASE] * BATCH))
            times.append(time.perf_counter() - began)
        ratios.append(times[0] / times[1])
        rates.append(BATCH / times[1])
    return {"ratio_per_round": ratios, "ratio": statistics.median(ratios), "drops_per_second": max(rates)}


def fresh_process(cache: str) -> tuple[float, float, float, str]:
    """Time to the first result: wall, processor, wall with the start of Python [s]; digest of the states."""
    environment = os.environ | {"NUMBA_CACHE_DIR": cache}
    began = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", FRESH], env=environment, capture_output=True, text=True, check=True
    )
    inside, processor, digest = done.stdout.split()
    return float(inside), float(processor), time.perf_counter() - began, digest


def first_result(rounds: int) -> dict[str, Any]:
    """First result of a fresh process, with an empty and with a filled cache of machine code."""
    with tempfile.TemporaryDirectory() as cache:
        cold = fresh_process(cache)
        warm = [fresh_process(cache) for _ in range(rounds)]
    return {
        "cold_s": cold[0],
        "cold_processor_s": cold[1],
        "warm_s": statistics.median(w[0] for w in warm),
        "warm_processor_s": statistics.median(w[1] for w in warm),
        "warm_with_start_of_python_s": statistics.median(w[2] for w in warm),
        "bit_identical": {w[3] for w in warm} == {cold[3]},
    }


def say(text: str) -> None:
    print(text, flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else {0}
    model = build_drop_model(example_machine("paper"), "quick")
    error, peak = force_error(model)
    results: dict[str, Any] = {"force_error_over_peak": error, "peak_force_N": peak}
    say(f"force error over 20 ms: {max(error):.2e} of the peak")
    if len(cores) > 1:
        os.sched_setaffinity(0, {min(cores)})
    results["one_core"] = one_core(model, options.rounds)
    if len(cores) > 1:
        os.sched_setaffinity(0, cores)
    say("ratio to naive numpy {ratio:.0f}".format(**results["one_core"]))
    results["first_result"] = first_result(options.rounds)
    text = "first result: cold {cold_s:.1f} s, warm {warm_s:.2f} s (processor {warm_processor_s:.2f} s)"
    say((text + ", same bits: {bit_identical}").format(**results["first_result"]))
    results["batch_on_two_threads"] = batch(model, options.rounds)
    say(
        "batch on two threads over one: {ratio:.2f}, {drops_per_second:.0f} drops/s".format(
            **results["batch_on_two_threads"]
        )
    )
    results["load_at_end"] = os.getloadavg()[0]
    results["machine"] = {
        "processor": _processor(),
        "cores": len(cores),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "numba": numba.__version__,
    }
    if options.output:
        options.output.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
