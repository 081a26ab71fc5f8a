"""Runs on a Dask cluster; needs the optional extra `nmpcrl[cluster]`.

The cluster's workers train and return summaries, so they need only this package: no shared disk and
no access to the reader's files. Dask restarts the job of a lost worker.
"""

import asyncio
import socket
import tomllib
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from nmpcrl.study.provenance import signature
from nmpcrl.study.storage.refusal import Refusal

ANSWER = 10.0  # [s] within which a scheduler that is there has answered
SECURITY = ("tls-ca-file", "tls-client-cert", "tls-client-key")  # what a security file names
ADDRESSES = "HOST:PORT, tcp://HOST:PORT or tls://HOST:PORT"


class NoCluster(Refusal):
    """There is no cluster that could be used; the message says why."""


@contextmanager
def executor(
    address: str, *, security: str | Path | None = None, patience: float = 30.0
) -> Iterator[Executor]:
    """An executor whose workers are those of the scheduler at `address`, as "tcp://host:8786".

    Args:
        address: of the scheduler, which is to answer at once.
        security: a file that names certificates, for TLS; see `read_security`.
        patience: how long to wait for its first worker [s].

    Raises:
        NoCluster: the address or the file of certificates is none, Dask is missing, no scheduler
            answers, or a worker is missing or has other code or other versions.
    """
    address, known = check(address, security=security)
    from distributed import Client

    _greet(address, known)
    options = {"timeout": ANSWER, "set_as_default": False}
    try:
        client = Client(address, security=known, **options)
    except OSError as error:
        raise NoCluster(f"no scheduler answers at {address}: {_line(error)}") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=patience)
        except TimeoutError:
            raise NoCluster(f"the scheduler at {address} has no worker") from None
        _refuse_others(client)
        yield client.get_executor(pure=False)


def check(address: str, *, security: str | Path | None = None) -> tuple[str, Any]:
    """The address in full and Dask's `Security`, or None; nobody is asked yet.

    Raises:
        NoCluster: one of the two is none, or they do not go together, or Dask is missing.
    """
    scheme = "tls" if security else "tcp"
    full = address if "://" in address else f"{scheme}://{address}"
    if not _is_address(full):
        raise NoCluster(f"the scheduler's address {address!r} must be {ADDRESSES}")
    if not full.startswith(scheme):
        raise NoCluster(
            f"the scheduler's address {address} goes without a security file; tls:// needs one"
            if security
            else f"the scheduler's address {address} needs a security file with certificates"
        )
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise NoCluster(
            "dask.distributed is not installed: pip install 'nmpcrl[cluster]'"
        ) from None
    return full, read_security(security) if security else None


def read_security(file: str | Path) -> Any:
    """Dask's `Security` of the certificates that a TOML file names, relative to itself.

    One certificate serves all: Dask does not tell clients, schedulers and workers apart.

    Raises:
        NoCluster: the file, or one that it names, cannot be used.
    """
    from distributed.security import Security

    file = Path(file)
    ca, cert, key = _certificates(file)
    roles = ("client", "scheduler", "worker")
    security = Security(
        tls_ca_file=ca,
        require_encryption=True,
        **{f"tls_{role}_cert": cert for role in roles},
        **{f"tls_{role}_key": key for role in roles},
    )
    try:
        security.get_connection_args("client")
    except OSError as error:  # of SSL, too
        raise NoCluster(
            f"the certificates that {file} names cannot be used: {_line(error)}"
        ) from None
    return security


def _certificates(file: Path) -> tuple[str, str, str]:
    """Where the certificate of the authority is, the own one, and its key."""
    try:
        named = tomllib.loads(file.read_text("utf-8"))
    except OSError as error:
        raise NoCluster(f"the security file {file} cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise NoCluster(f"the security file {file} is not TOML: {_line(error)}") from None
    texts = [value for value in named.values() if isinstance(value, str)]
    if set(named) != set(SECURITY) or len(texts) != len(named):
        raise NoCluster(
            f"the security file {file} must name {', '.join(SECURITY)}, each a path; it names"
            f" {', '.join(named) or 'nothing'}"
        )
    places = {name: file.parent / named[name] for name in SECURITY}
    for name, place in places.items():
        if not place.is_file():
            raise NoCluster(
                f"the security file {file} names {name} = {named[name]!r}: no such file"
            )
    if "ENCRYPTED" in places["tls-client-key"].read_text(errors="replace"):
        raise NoCluster(f"the key {places['tls-client-key']} must not have a passphrase")
    ca, cert, key = (str(place.resolve()) for place in places.values())
    return ca, cert, key


def _is_address(text: str) -> bool:
    """Whether this is a scheme, a host and a port, and nothing else."""
    try:
        parts = urlsplit(text)
        port = parts.port or 0
    except ValueError:
        return False
    whole = f"{parts.scheme}://{parts.netloc}" == text and "@" not in text
    return whole and parts.scheme in ("tcp", "tls") and bool(parts.hostname) and port > 0


def _greet(address: str, security: Any) -> None:
    """See that a scheduler answers: Dask's client would retry without end where there is none."""
    parts = urlsplit(address)
    try:
        socket.create_connection((parts.hostname or "", parts.port or 0), timeout=ANSWER).close()
    except OSError as error:
        raise NoCluster(f"no scheduler answers at {address}: {_line(error)}") from None
    with ThreadPoolExecutor(1) as thread:  # this one may have a loop already, as Jupyter's has
        asked = thread.submit(asyncio.run, _identity(address, security))
    # Any error will do: Dask's reader takes whatever comes for a message.
    if asked.exception() or asked.result().get("type") != "Scheduler":
        mode = "or refuses these certificates" if security else "or needs certificates"
        raise NoCluster(f"{address} does not answer like a Dask scheduler, {mode}")


async def _identity(address: str, security: Any) -> Mapping[str, Any]:
    from distributed.comm.core import connect

    options = security.get_connection_args("client") if security else {}
    async with asyncio.timeout(ANSWER):
        comm = await connect(address, timeout=ANSWER, **options)
        try:
            await comm.write({"op": "identity", "reply": True})
            said: Mapping[str, Any] = await comm.read()
        finally:
            comm.abort()
    return said


def _line(error: Exception) -> str:
    """What an error says, in one line."""
    return " ".join((getattr(error, "strerror", None) or str(error)).split())


def _refuse_others(client: Any) -> None:
    """Say at once if a worker would make other numbers; one that joins later says it itself."""
    ours = signature()
    try:
        signatures = client.run(signature)
    except Exception as error:  # Dask wraps whatever went wrong over there
        raise NoCluster(f"a worker cannot report which code it has: {_line(error)}") from None
    for worker, theirs in signatures.items():
        if theirs != ours:
            raise NoCluster(
                f"the worker {worker} has other code or other versions of the libraries than this"
                " machine, so its numbers may differ"
            )
