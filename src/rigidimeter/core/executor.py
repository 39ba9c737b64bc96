"""Many pieces of work: in this process, in processes of this machine, or on a Dask cluster.

joblib and Dask do the scheduling. Whatever must go through many independent pieces comes here.
"""

from __future__ import annotations

import signal
import threading
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import BrokenExecutor
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import Any, TypeVar

from rigidimeter.core.errors import UserError

Item = TypeVar("Item")
Result = TypeVar("Result")

_CONNECT_S = 10.0
_AHEAD = 2
"""Items that wait for each process, so that none waits for its next."""


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
    they and the results must pickle, and a worker must be able to import the function.

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
        Called at the end with the addresses of the workers that were in the cluster at the
        beginning and have left it. Others have done what they had begun.

    Raises
    ------
    UserError
        If the scheduler cannot be reached, or its package is not installed.
    """
    if jobs == 1 and not scheduler:
        for item in items:
            yield item, function(item)
        return
    with ExitStack() as stack:
        new_call, deaths = _workers(jobs, scheduler, in_order, stack, on_lost)
        waiting = _Given(items)
        ended = False
        while not ended:
            try:
                with _ended(new_call()(_tasks(function, waiting))) as done:
                    for number, result in done:
                        yield waiting.given.pop(number), result
                ended = True
            except deaths:
                if on_death is None:
                    raise
            # One of those that were begun ended its process: which, shows when each runs alone.
            # Threads of the call that ended may still take items, which are here the next time.
            for number in list(waiting.given):
                item = waiting.given[number]
                try:
                    ((_, result),) = new_call()(_tasks(function, [(number, item)]))
                except deaths:
                    assert on_death is not None  # else nothing is left after a process ended
                    result = on_death(item)
                del waiting.given[number]
                yield item, result


@contextmanager
def _ended(results: Generator[Any, None, None]) -> Iterator[Generator[Any, None, None]]:
    """End what still runs when the results are not wanted any more."""
    try:
        yield results
    finally:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # joblib warns that it does
            results.close()


def _tasks(function: Callable[[Item], Any], numbered: Iterable[tuple[int, Item]]) -> Iterator[Any]:
    from joblib import delayed

    # In a tuple: joblib would send a large item to one worker of a cluster, to be lost with it.
    return (delayed(_run)(function, (number, item)) for number, item in numbered)


def _run(function: Callable[[Item], Result], numbered: tuple[int, Item]) -> tuple[int, Result]:
    if threading.current_thread() is threading.main_thread():
        # An interrupt from the keyboard goes to all processes; the first ends the others.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    number, item = numbered
    return number, function(item)


class _Given(Iterator[tuple[int, Item]]):
    """Items with their numbers; those that were given out, until they are taken from `given`.

    joblib takes items in threads of its own, one at a time except after a process ended.
    """

    def __init__(self, items: Iterable[Item]) -> None:
        self.given: dict[int, Item] = {}
        self._items = enumerate(items)
        self._lock = threading.Lock()

    def __next__(self) -> tuple[int, Item]:
        with self._lock:
            number, item = next(self._items)
            self.given[number] = item
            return number, item


def _workers(
    jobs: int,
    scheduler: str,
    in_order: bool,
    stack: ExitStack,
    on_lost: Callable[[list[str]], None],
) -> tuple[Callable[[], Any], tuple[type[BaseException], ...]]:
    """Return what makes a call that runs tasks, and the exceptions that say that a process ended.

    Each call is used once: after a process ended, results of its tasks can still come in.
    """
    from joblib import Parallel, parallel_config

    deaths: tuple[type[BaseException], ...] = (BrokenExecutor,)
    if scheduler:
        client, killed = _client(scheduler, stack)
        begun_with = list(client.scheduler_info(n_workers=-1)["workers"])
        stack.callback(_lost, client, begun_with, on_lost)
        deaths = (killed,)
        stack.enter_context(parallel_config(backend="dask", client=client))
    else:
        stack.enter_context(parallel_config(backend="loky", inner_max_num_threads=1))
    new_call = partial(
        Parallel,
        n_jobs=-1 if scheduler else jobs,
        return_as="generator" if in_order else "generator_unordered",
        batch_size=1,
        pre_dispatch=f"{_AHEAD} * n_jobs",
    )
    return new_call, deaths


def _lost(client: Any, before: list[str], on_lost: Callable[[list[str]], None]) -> None:
    now = client.scheduler_info(n_workers=-1)["workers"]
    if gone := [address for address in before if address not in now]:
        on_lost(gone)


def _client(scheduler: str, stack: ExitStack) -> tuple[Any, type[BaseException]]:
    try:
        from distributed import Client, KilledWorker
    except ImportError:
        raise UserError(
            "--scheduler: needs one more package: pip install 'rigidimeter[cluster]'"
        ) from None
    connect: Callable[..., Any] = Client
    try:
        client = stack.enter_context(connect(scheduler, timeout=_CONNECT_S, set_as_default=False))
    except (OSError, ValueError) as error:
        raise UserError(
            f"--scheduler {scheduler}: cannot be reached ({error}); give the address that "
            "`dask scheduler` printed, such as tcp://host:8786"
        ) from None
    if not client.scheduler_info()["workers"]:
        raise UserError(
            f"--scheduler {scheduler}: has no worker; start one with `dask worker {scheduler}`"
        )
    return client, KilledWorker
