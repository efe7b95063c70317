"""Running a study: the tasks that are not done yet, on the threads of this process or on a cluster."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ramsight.study.datasheet.machine_tasks import work_through
from ramsight.study.datasheet.store import Store
from ramsight.study.datasheet.study_plan import Plan
from ramsight.system import processors

if TYPE_CHECKING:
    import xarray


def run(
    plan: Plan,
    path: Path | None,
    *,
    client: Any = None,
    threads: int | None = None,
    advance: Callable[[int], object] = lambda machines: None,
) -> xarray.Dataset:
    """Run what is not done yet of a study.

    Args:
        plan: the study.
        path: folder of its store; None keeps everything in memory.
        client: of Dask distributed; None for the threads of this process.
        threads: how many; by default one for each core that this process may use.
        advance: called with the number of machines that are done since the last call.

    Returns:
        What is kept of all machines.

    Raises:
        StoreError: there is another study's store.
        OutputError: the store cannot be written; what was written stays.
    """
    store = Store(path, plan.layout, plan.count)
    advance(int(store.done[: plan.count].sum()))
    if client is not None:
        from ramsight.study.datasheet.cluster import run_on

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
                running.add(pool.submit(_task, plan, store, rows))

        try:
            first = next(tasks, None)
            if first is not None:  # whatever is compiled is compiled once
                bench_ready(plan)
                running.add(pool.submit(_task, plan, store, first))
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


def _task(plan: Plan, store: Store, rows: range) -> range:
    found = {**work_through(plan.bench, plan.order(rows)), "values": plan.values(rows)}
    store.write(rows, found)
    return rows
