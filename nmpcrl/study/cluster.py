"""Runs on a Dask cluster; needs the optional extra `nmpcrl[cluster]`.

The cluster's workers train and hand summaries back, so they need this package and nothing else: no
shared disk, no way to the reader's files. Dask starts again what a lost worker was at.
"""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Any

from nmpcrl.study.provenance import signature


class NoCluster(RuntimeError):
    """There is no cluster that could be used; the message says why."""


@contextmanager
def executor(address: str, *, patience: float = 30.0) -> Iterator[Executor]:
    """An executor whose workers are those of the scheduler at `address`, as "tcp://host:8786".

    Args:
        address: of the scheduler.
        patience: how long to wait for it and its first worker [s].

    Raises:
        NoCluster: Dask is missing, nobody answers, or a worker has other code or other versions.
    """
    try:
        from distributed import Client
    except ImportError:
        raise NoCluster(
            "dask.distributed is not installed: pip install 'nmpcrl[cluster]'"
        ) from None
    try:
        client = Client(address, timeout=patience, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise NoCluster(f"no scheduler answers at {address}: {error}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=patience)
        except TimeoutError:
            raise NoCluster(f"the scheduler at {address} has no worker") from None
        _refuse_others(client)
        yield client.get_executor(pure=False)


def _refuse_others(client: Any) -> None:
    """Say at once if a worker would make other numbers; one that joins later says it itself."""
    ours = signature()
    try:
        signatures = client.run(signature)
    except Exception as error:  # Dask wraps whatever went wrong over there
        raise NoCluster(f"a worker cannot say which code it has: {error}") from None
    for worker, theirs in signatures.items():
        if theirs != ours:
            raise NoCluster(
                f"the worker {worker} has other code or other versions of what the numbers depend"
                " on than this machine"
            )
