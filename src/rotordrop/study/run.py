"""Work on a study: compute the drops of a shard and publish it, on threads or on Dask."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, Executor, ThreadPoolExecutor, wait
from contextlib import ExitStack, nullcontext
from functools import partial
from importlib import import_module
from os import PathLike, cpu_count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np

from rotordrop.errors import RotordropError, UsageError, needing
from rotordrop.machine import Machine
from rotordrop.one_thread import one_thread
from rotordrop.progress import Progress, Shown, shown
from rotordrop.require import each, require
from rotordrop.rotor.parameters import DropModel, build_drop_model
from rotordrop.simulate.drop import simulate_drop
from rotordrop.study.folder import (
    Shard,
    StudyFolder,
    alone_in,
    open_folder,
    publish,
    put_damaged_aside,
    read_plan,
    require_same_version,
    study_of,
)
from rotordrop.study.plan import Study, read_study
from rotordrop.study.quantities import columns_of, row_of
from rotordrop.study.summary import EarlyEnd, StudyResults, load_results

LOOK_EVERY, LOOK_SHARE = 0.5, 0.02
"""Pause between two looks at the folder [s], and what looks may take of the time [1]: one at 50,000 finished
shards takes 0.1 s."""


@one_thread()
def run_study(
    study: Study,
    folder: str | Path,
    *,
    threads: int | None = None,
    dask: str | Literal["local"] | None = None,
    progress: Shown = None,
) -> StudyResults:
    """Compute all drops of a study that are not computed yet, and give its results.

    Parameters
    ----------
    study : Study
        What to compute.
    folder : path
        Its folder; made when it does not exist, continued when it holds the same study.
    threads : int, optional
        Threads of this process; all cores by default.
    dask : str, optional
        Address of a Dask scheduler whose workers see the folder, or ``"local"`` for one made here (needs the
        extra ``rotordrop[cluster]``).
    progress : callable or False, optional
        Called with the drops done, their rate and the fraction done, about twice a second; by default a bar
        in a terminal or a notebook.

    Returns
    -------
    StudyResults
        All finished drops, in order.

    Raises
    ------
    UsageError
        If the folder holds another study, or another run works there.

    Notes
    -----
    The numbers do not depend on who computed what. A finished shard that has changed on the disk is kept
    under another name and computed again.
    """
    require(study, "study", Study)
    require(folder, "folder", str, PathLike)
    require(threads, "threads", int, none=True, least=1, most=1024)
    require(dask, "dask", str, none=True)
    place = open_folder(study, folder)
    with alone_in(place), shown(progress, study.name) as tell:
        put_damaged_aside(place, study)
        finished = set(place.finished())
        wanted = [shard for shard in range(study.shards) if shard not in finished]
        watch = _Watch(study, place, tell)
        if wanted and dask is not None:
            _on_dask(place, wanted, dask, watch)
        elif wanted:
            _on_threads(place, wanted, threads or cpu_count() or 1, study, watch)
        watch.look()
    return load_results(place.path)


def sweep(
    machine: Machine,
    vary: Mapping[str, Sequence[float | str]],
    *,
    repeats: int = 1,
    folder: str | Path | None = None,
    threads: int | None = None,
    progress: Shown = None,
    **settings: Any,
) -> StudyResults:
    """Simulate a drop for every combination of values of a machine or of its drops.

    Parameters
    ----------
    machine : Machine
        The machine around which values vary.
    vary : mapping
        Values by path (``"NDE.support.stiffness"``, ``"*.friction.dynamic"`` for all touchdown bearings with
        one value) or by name of the case (``"speed"``); texts with units, or pure numbers.
    repeats : int
        Drops of each combination; they differ in what is left to chance, above all the rotor angle.
    folder : path, optional
        Folder of the study, which can be resumed; left out, nothing is kept but the results.
    threads, progress : optional
        As for `run_study`.
    **settings
        Further keys of a study file, such as ``speed="60 Hz"``, ``duration="0.1 s"`` or ``seed=2``.

    Returns
    -------
    StudyResults
        Values and quantities of every drop; ``results.to_dataframe()`` is one table.
    """
    require(machine, "machine", Machine)
    require(vary, "vary", Mapping, hint="Write {'speed': ['60 Hz', '90 Hz']}")
    repeats = require(repeats, "repeats", int, least=1)
    spreads = {name: {"grid": list(each(values, name, str, float))} for name, values in vary.items()}
    drops = repeats * math.prod(len(one["grid"]) for one in spreads.values())
    study = read_study({"drops": drops, "design": "grid", "vary": spreads} | settings, machine)
    with TemporaryDirectory() if folder is None else nullcontext(folder) as place:
        own = Path(place) / "study" if folder is None else place
        return run_study(study, own, threads=threads, progress=progress)


def compute_shard(
    study: Study,
    model: DropModel,
    shard: int,
    stop: threading.Event | None = None,
) -> Shard | None:
    """Compute the drops of one shard, in order; None when ``stop`` was set before the end.

    A drop that fails is a result: its numbers are missing and its reason is kept.
    """
    drops = study.drops_of(shard)
    varied = study.values(drops.start, drops.stop)
    numbers = np.full((len(drops), len(columns_of(study.machine))), np.nan)
    reasons = []
    for row in range(len(drops)):
        if stop is not None and stop.is_set():
            return None
        numbers[row], reason = one_drop(
            study, model, dict(zip(study.varied, varied[row].tolist(), strict=True))
        )
        reasons.append(reason)
    return Shard(first=drops.start, varied=varied, numbers=numbers, reasons=tuple(reasons))


def one_drop(study: Study, model: DropModel, values: dict[str, float]) -> tuple[Any, str]:
    """Numbers of the drop with given varied values [SI], in the order of `columns_of`, and why it failed."""
    nothing = np.nan
    try:
        drawn = model.with_machine(study.machine_of(values))
        result = simulate_drop(drawn, study.case(values))
        if not result.finished:
            return nothing, result.outcome
        return row_of(drawn, result), ""
    except RotordropError as error:
        return nothing, str(error)


@one_thread()
def work_on(folder: str | Path, shard: int) -> None:
    """Compute and publish one shard of the study in a folder; for Dask workers."""
    plan = read_plan(folder)  # another study may have taken the place of the one before
    require_same_version(plan, Path(folder))
    digest = plan["digest"]
    if digest not in _OPEN:
        study = study_of(folder)
        _OPEN[digest] = (study, build_drop_model(study.machine, study.reduction, loops=study.looped))
    _work(*_OPEN[digest], StudyFolder(Path(folder)), shard, None)


_OPEN: dict[str, tuple[Study, DropModel]] = {}
"""Studies that this process has opened, by digest: a worker builds the model of a study once."""


def _work(
    study: Study, model: DropModel, place: StudyFolder, shard: int, stop: threading.Event | None
) -> None:
    found = compute_shard(study, model, shard, stop)
    if found is not None:
        publish(place, study, shard, found)


def _on_threads(place: StudyFolder, wanted: list[int], threads: int, study: Study, watch: _Watch) -> None:
    model = build_drop_model(study.machine, study.reduction, loops=study.looped)
    stop = threading.Event()
    with ThreadPoolExecutor(max_workers=threads) as pool:
        try:
            _drive(pool, wanted, lambda shard: _work(study, model, place, shard, stop), watch)
        except BaseException:
            stop.set()  # the drops that run now end, nothing new begins; finished shards are on disk
            raise


def _on_dask(place: StudyFolder, wanted: list[int], address: str, watch: _Watch) -> None:
    with needing("cluster"):
        distributed: Any = import_module("distributed")
    with ExitStack() as stack:
        scheduler: Any = address
        if address == "local":
            workers = {"n_workers": cpu_count() or 1, "threads_per_worker": 1, "dashboard_address": None}
            scheduler = stack.enter_context(distributed.LocalCluster(**workers))
        try:
            client = stack.enter_context(distributed.Client(scheduler))
        except (ValueError, OSError) as error:
            raise UsageError(f"no Dask scheduler at {address!r}: {error}; give 'tcp://host:8786'") from error
        task = partial(work_on, str(place.path.resolve()))
        _drive(client.get_executor(pure=False), wanted, task, watch)


def _drive(pool: Executor, wanted: list[int], work: Callable[[int], None], watch: _Watch) -> None:
    """Hand out the shards in order and look at the folder until all is done or enough is known."""
    running = {pool.submit(work, shard) for shard in wanted}
    pause = LOOK_EVERY
    try:
        while running:
            done, running = wait(running, timeout=pause, return_when=FIRST_EXCEPTION)
            for one in done:
                one.result()
            looked = time.monotonic()
            if watch.look():
                break
            pause = max(LOOK_EVERY, (time.monotonic() - looked) / LOOK_SHARE)
    finally:
        for one in running:
            one.cancel()


class _Watch:
    """Looks at the folder of a study, tells how far it is, and knows whether it may end early."""

    def __init__(self, study: Study, place: StudyFolder, tell: Progress) -> None:
        self._study, self._place, self._tell = study, place, tell
        self._began, self._before = time.monotonic(), _drops(study, place)
        self._end = EarlyEnd(study, place)

    def look(self) -> bool:
        """Say how far it is; whether enough is known."""
        drops, of = _drops(self._study, self._place), self._study.drops
        rate = (drops - self._before) / max(time.monotonic() - self._began, 1e-9)
        self._tell(f"{drops} of {of} drops, {rate:.1f}/s", drops / of)
        return self._end.shards() is not None


def _drops(study: Study, place: StudyFolder) -> int:
    return sum(len(study.drops_of(shard)) for shard in place.finished())
