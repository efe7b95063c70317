"""A study's tasks that are not done yet, on threads of this process or on Dask distributed, with the same numbers.

A task takes seconds and computes on one thread alone, so workers of one thread each, or one worker a machine with as
many threads as it has cores, are both right. Where the store is a folder that all can reach, a worker writes its task's
chunks itself; what travels is the task's order and that it is done. A worker that is lost loses the tasks that it was
at; they go to others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ramsight.errors import RamsightError, one_line
from ramsight.optional import needs
from ramsight.signals import Dataset
from ramsight.study.datasheet.machine_tasks import Order, bench_of, work_through
from ramsight.study.datasheet.store import Layout, Store, write_apart
from ramsight.study.datasheet.studied_duties import Work
from ramsight.study.datasheet.study_plan import Plan
from ramsight.system import processors

_AHEAD = 3  # tasks for each thread of the cluster: one that runs, the others on their way
_RETRIES = 3  # of a task whose worker was lost
_ENVIRONMENT = "distributed.nanny.pre-spawn-environ"  # of workers, in Dask's configuration
_PATIENCE = "10 s"  # until a scheduler has answered


class ClusterError(RamsightError):
    """A cluster that is not available, or was lost."""


@contextmanager
def cluster(address: str, workers: int | None = None) -> Iterator[Any]:
    """A client of Dask distributed.

    Args:
        address: of a scheduler, ``"tcp://host:8786"``; or ``"local"`` for workers of one thread each on this machine.
        workers: how many local ones; by default one for each core that this process may use.

    Raises:
        MissingPackageError: Dask distributed is not installed.
        ClusterError: there is no scheduler at the address.
    """
    distributed = needs("distributed", "cluster")
    here = None
    try:
        if address == "local":
            count = workers or processors()
            with _memory_kept():
                here = distributed.LocalCluster(
                    n_workers=count,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address="127.0.0.1:0",
                    silence_logs="CRITICAL",
                )
        client = distributed.Client(here or address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, RuntimeError) as error:
        if here is not None:
            here.close()
        raise ClusterError(f"--cluster = {address!r}: no scheduler answers: {one_line(error)}") from None
    try:
        yield client
    finally:
        client.close()
        if here is not None:
            here.close()


def _memory_kept() -> Any:
    """Within it, workers start without Dask's limit of the memory that a process keeps for its next arrays.

    With the limit the system clears the memory of every array of a run again, which takes a third of a task's time.
    """
    dask = needs("dask", "cluster")
    started_with = dict(dask.config.get(_ENVIRONMENT))
    started_with.pop("MALLOC_TRIM_THRESHOLD_", None)
    return dask.config.set({_ENVIRONMENT: started_with})


def run_on(client: Any, plan: Plan, store: Store, advance: Callable[[int], object]) -> None:
    """Run what is not done yet of a study on a cluster.

    Raises:
        ClusterError: scheduler or workers are lost; what was done is in the store.
    """
    distributed = needs("distributed", "cluster")
    tasks, path = store.tasks(plan.count), store.path.absolute() if store.path is not None else None
    layout = plan.layout

    def submit(rows: range) -> Any:
        spec = (plan.toml, plan.unit, asdict(plan.work), plan.sensor)
        order = plan.order(rows)
        return client.submit(_task, spec, order, rows, path, layout, pure=False, retries=_RETRIES)

    threads = max(sum(client.nthreads().values()), 1)
    try:
        first: list[Any] = [submit(rows) for _, rows in zip(range(_AHEAD * threads), tasks, strict=False)]
        running = distributed.as_completed(first, loop=client.loop)
        for future in running:
            rows, found = future.result()
            if found is not None:
                store.write(rows, found)
            advance(len(rows))
            future.release()
            if (more := next(tasks, None)) is not None:
                running.add(submit(more))
    except RamsightError:
        raise
    except (OSError, CancelledError, distributed.KilledWorker) as error:
        text = "the cluster was lost; what is done is in the store, run the same again to go on"
        raise ClusterError(f"{text} ({type(error).__name__}: {one_line(error)})") from None


def _task(
    spec: tuple[str, str, dict[str, Any], str], order: Order, rows: range, path: Path | None, layout: Layout
) -> tuple[range, dict[str, Any] | None]:
    """A task, as a worker does it: its results are written, or go back where there is no folder."""
    toml, unit, work, sensor = spec
    found = {**work_through(bench_of(toml, unit, Work(**work), sensor), order), "values": order.values}
    if path is None:
        return rows, found
    write_apart(path, layout, rows, found)
    return rows, None


def run(
    plan: Plan,
    path: Path | None,
    *,
    client: Any = None,
    threads: int | None = None,
    advance: Callable[[int], object] = lambda machines: None,
) -> Dataset:
    """Run what is not done yet of a study.

    Args:
        path: folder of its store; None keeps everything in memory.

    Returns:
        What is kept of all machines.

    Raises:
        StoreError: there is another study's store.
        OutputError: the store cannot be written; what was written stays.
    """
    store = Store(path, plan.layout, plan.count)
    advance(int(store.done[: plan.count].sum()))
    if client is not None:
        run_on(client, plan, store, advance)
    else:
        _on_threads(plan, store, threads or processors(), advance)
    return store.dataset(plan.count)


def _on_threads(plan: Plan, store: Store, threads: int, advance: Callable[[int], object]) -> None:
    tasks = store.tasks(plan.count)
    running: set[Future[range]] = set()
    with ThreadPoolExecutor(threads) as pool:

        def begin() -> None:
            if (rows := next(tasks, None)) is not None:
                running.add(pool.submit(_task_here, plan, store, rows))

        try:
            first = next(tasks, None)
            if first is not None:  # whatever is compiled is compiled once
                bench_ready(plan)
                running.add(pool.submit(_task_here, plan, store, first))
            for _ in range(2 * threads - 1):  # one runs, one waits
                begin()
            while running:
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                for one in done:
                    running.discard(one)
                    advance(len(one.result()))
                    begin()
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def bench_ready(plan: Plan) -> None:
    """Make and compile what a study's machines have in common."""
    _ = plan.bench


def _task_here(plan: Plan, store: Store, rows: range) -> range:
    found = {**work_through(plan.bench, plan.order(rows)), "values": plan.values(rows)}
    store.write(rows, found)
    return rows
