"""Many pieces of work: in this process, in processes of this machine, or on a Dask cluster.

Both are an executor of concurrent.futures, so the same loop gives out the work of either. Whatever
must go through many independent pieces comes here.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from concurrent.futures import Future, ProcessPoolExecutor
    from multiprocessing.process import BaseProcess

Item = TypeVar("Item")
Result = TypeVar("Result")

_CONNECT_S = 10.0
_AHEAD = 2
"""Items that each process has or waits for, so that none waits for its next."""


def each(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    *,
    jobs: int = 1,
    scheduler: str = "",
    in_order: bool = False,
    on_death: Callable[[Item], Result] | None = None,
    on_lost: Callable[[list[str]], None] = lambda _: None,
) -> Generator[tuple[Item, Result], None, None]:
    """Yield every item with its result, as they are done.

    Items are taken as they are needed, so an iterator of many takes no memory. With processes both
    they and the results must pickle, and a worker must be able to import the function, so it may
    not be one of a script. Closing the generator ends the processes.

    Parameters
    ----------
    function : callable
    items : iterable
    jobs : int
        Processes; with 1 everything runs in this one.
    scheduler : str
        The address of a Dask scheduler, such as ``tcp://host:8786``, instead of `jobs`.
    in_order : bool
        Yield in the order of the items; a result that waits for an earlier one is kept until then.
    on_death : callable, optional
        Gives the result of an item that ended its process twice, such as one that needs more memory
        than there is. Without it that raises.
    on_lost : callable
        Called at the end with the workers that ended or left before: their addresses in a cluster,
        or a name for processes of this machine. Others have done what they had begun.

    Raises
    ------
    UserError
        If the scheduler cannot be reached, or its package is not installed.
    """
    if jobs == 1 and not scheduler:
        for item in items:
            yield item, function(item)
        return
    from concurrent.futures import FIRST_COMPLETED, wait

    left = enumerate(items)
    begun: dict[Future[Result], tuple[int, Item]] = {}
    suspects: dict[int, Item] = {}
    done: dict[int, tuple[Item, Result]] = {}
    yielded, died = 0, False
    with _cluster(scheduler) if scheduler else _machine(jobs) as (submit, size, death, gone):
        while True:
            new: Iterable[tuple[int, Item]] = islice(left, _AHEAD * size - len(begun))
            if suspects:  # one of them ended its process: which, shows when each runs alone
                new = [] if begun else [*suspects.items()][:1]
            for number, item in new:
                begun[submit(function, item)] = number, item
            if not begun:
                break
            for future in wait(begun, return_when=FIRST_COMPLETED).done:
                number, item = begun.pop(future)
                try:
                    result = future.result()
                except death:
                    died = True
                    if number not in suspects:
                        suspects[number] = item
                        continue
                    if on_death is None:
                        raise
                    result = on_death(item)
                suspects.pop(number, None)
                done[number if in_order else yielded] = item, result
                while yielded in done:
                    yield done.pop(yielded)
                    yielded += 1
        if names := gone() or ["a process of this machine"] * died:
            on_lost(names)


_Workers = tuple[Callable[..., "Future[Any]"], int, type[Exception], Callable[[], list[str]]]
"""What begins a piece, how many run at a time, what a piece raises whose process ended, and the
addresses of workers that have left."""


@contextmanager
def _machine(jobs: int) -> Iterator[_Workers]:
    from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
    from multiprocessing import get_context

    def new_pool() -> ProcessPoolExecutor:
        return ProcessPoolExecutor(jobs, get_context("spawn"), _begin)

    pool = new_pool()

    def submit(function: Callable[[Item], Result], item: Item) -> Future[Result]:
        nonlocal pool
        with _script_hidden():
            try:
                return pool.submit(function, item)
            except BrokenExecutor:
                broken, pool = pool, new_pool()
                _end(broken)
                return pool.submit(function, item)

    try:
        yield submit, jobs, BrokenExecutor, list
    finally:
        _end(pool)


@contextmanager
def _script_hidden() -> Iterator[None]:
    """Start processes that do not run the user's script again, which would start processes too."""
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


def _begin() -> None:
    """Prepare a process before it imports NumPy."""
    from multiprocessing import parent_process
    from threading import Thread

    # An interrupt from the keyboard goes to all processes; the first ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for library in ("OMP", "OPENBLAS", "MKL", "VECLIB_MAXIMUM"):
        os.environ[f"{library}_NUM_THREADS"] = "1"
    Thread(target=_end_with, args=(parent_process(),), daemon=True).start()


def _end_with(parent: BaseProcess) -> None:
    """End this process when the first was killed: nothing else would tell it."""
    parent.join()
    os._exit(1)


def _end(pool: ProcessPoolExecutor) -> None:
    """End what still runs too, whose results nobody wants (from Python 3.14 on: kill_workers)."""
    for process in [*pool._processes.values()]:
        process.kill()
    pool.shutdown()


@contextmanager
def _cluster(scheduler: str) -> Iterator[_Workers]:
    from concurrent.futures import CancelledError

    try:
        from distributed import Client, KilledWorker
        from distributed.comm.addressing import get_address_host_port
    except ImportError:
        raise UserError(
            "--scheduler: needs one more package: pip install 'rigidimeter[cluster]'"
        ) from None
    connect: Callable[..., Any] = Client
    check: Callable[..., Any] = get_address_host_port
    try:
        check(scheduler)  # a client of an address without a port would end in a time-out
        client = connect(scheduler, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise UserError(
            f"--scheduler {scheduler}: cannot be reached ({error}); give the address that "
            "`dask scheduler` printed, such as tcp://host:8786"
        ) from None

    with client:
        before = client.ncores()
        if not before:
            raise UserError(
                f"--scheduler {scheduler}: has no worker; start one with `dask worker {scheduler}`"
            )
        executor = client.get_executor(pure=False)  # else an equal piece would not be tried again
        try:
            yield (
                executor.submit,
                sum(before.values()),
                KilledWorker,
                lambda: sorted(before.keys() - client.ncores().keys()),
            )
        except CancelledError:
            raise UserError(f"--scheduler {scheduler}: was lost before the end") from None
        finally:
            executor.shutdown(wait=False)
