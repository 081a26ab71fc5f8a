"""Runs on a Dask cluster; needs the optional extra `nmpcrl[cluster]`.

Workers train and return summaries: they need this package, and no shared disk.
"""

import socket
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from urllib.parse import urlsplit

from nmpcrl.study.refusal import Refusal


@contextmanager
def executor(address: str, patience: float = 30.0) -> Iterator[Executor]:
    """The workers of the scheduler at an address such as "tcp://host:8786".

    A Refusal names what is missing: Dask, or a scheduler or worker after `patience` seconds.
    """
    try:
        from distributed import Client
    except ImportError:
        raise Refusal("Dask is not installed: pip install 'nmpcrl[cluster]'") from None
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        place = (parts.hostname or "", parts.port or 0)
        socket.create_connection(place, patience).close()  # Dask tries unknown hosts for ever
        client = Client(address, timeout=patience, set_as_default=False)
    except (OSError, TypeError, ValueError) as error:  # TypeError without certificates for TLS
        raise Refusal(f"no scheduler answers at {address!r}: {error}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=patience)
        except TimeoutError:
            raise Refusal(f"the scheduler at {address} has no worker") from None
        yield client.get_executor(pure=False)
