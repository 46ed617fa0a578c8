"""Who computes the points: processes of this machine, or the workers of a dask cluster. Same work, same results."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from itertools import islice
from typing import Any

from iapb.errors import ArgumentError, MissingDependencyError
from reports.sweeps.points import Point
from reports.sweeps.work import Result, compute_point
from reports.workers import worker_pool

Compute = Callable[[Point], Result]
Scheduler = Callable[[Iterable[Point], str, str], Generator[Result]]

_AHEAD = 4  # points handed out per worker: enough that none waits, few enough that little is lost on Ctrl-C
_CLUSTER_AHEAD = 256  # points on their way to a cluster


def here(points: Iterable[Point], folder: str, code: str) -> Generator[Result]:
    """Compute in this process, one after the other."""
    for point in points:
        yield compute_point(point, folder, code)


def processes(workers: int) -> Scheduler:
    """Compute in `workers` processes of this machine; results come as they are done."""

    def compute(points: Iterable[Point], folder: str, code: str) -> Generator[Result]:
        with worker_pool(workers) as pool:
            yield from _as_done(lambda point: pool.submit(compute_point, point, folder, code), points, workers * _AHEAD)

    return compute


def _as_done(submit: Callable[[Point], Future[Result]], points: Iterable[Point], ahead: int) -> Iterator[Result]:
    left = iter(points)
    pending = {submit(point) for point in islice(left, ahead)}
    while pending:
        done, pending = wait(pending, return_when=FIRST_COMPLETED)
        pending |= {submit(point) for point in islice(left, len(done))}
        for future in done:
            yield future.result()


def cluster(address: str) -> Scheduler:
    """Compute on the dask.distributed cluster whose scheduler has this address.

    Raises
    ------
    MissingDependencyError
        Without dask.distributed (extra ``cluster``).
    ArgumentError
        Where no scheduler answers.
    """

    def compute(points: Iterable[Point], folder: str, code: str) -> Generator[Result]:
        client = _client(address)
        try:
            yield from _on_cluster(client, points, folder, code)
        finally:
            client.close()

    return compute


def _client(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingDependencyError("distributed", "A sweep on a cluster", "pip install 'iapb[cluster]'") from error
    try:
        return Client(address, timeout="10s")
    except (OSError, ValueError, TimeoutError) as error:
        raise ArgumentError("--scheduler", address, "the address of a running dask scheduler") from error


def _on_cluster(client: Any, points: Iterable[Point], folder: str, code: str) -> Generator[Result]:
    """Keep _CLUSTER_AHEAD points on their way; pure=False: the work writes a file."""
    from distributed import as_completed

    left = iter(points)

    def send(point: Point) -> Any:
        return client.submit(compute_point, point, folder, code, pure=False)

    pending = as_completed([send(point) for point in islice(left, _CLUSTER_AHEAD)])
    for future in pending:
        for point in islice(left, 1):
            pending.add(send(point))
        yield future.result()
