"""No worker outlives the process that started it."""

import os
import sys
import threading
from multiprocessing import parent_process
from multiprocessing.process import BaseProcess

if sys.platform != "win32":
    import fcntl


def end_with_parent() -> None:
    """End this process, a worker, as soon as its parent has ended, even if that was killed.

    The parent holds one end of a pipe, which is closed when it ends, and here is the other.
    """
    parent = parent_process()
    assert parent, "only what multiprocessing has started has such a pipe"
    if sys.platform == "linux":
        # The system sends SIGIO, which ends a process even where no other thread gets its turn.
        # PR_SET_PDEATHSIG would do so too, but when the thread ends that started the process.
        fcntl.fcntl(parent.sentinel, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(parent.sentinel, fcntl.F_SETFL, os.O_ASYNC)
    threading.Thread(target=_follow, args=(parent,), daemon=True).start()


def _follow(parent: BaseProcess) -> None:
    """For other systems, and for a parent that has ended before the signal was asked for."""
    parent.join()
    os._exit(1)
