"""A process that ends with the one that started it, however that ends."""

from __future__ import annotations

import ctypes
import os
import signal

_PR_SET_PDEATHSIG = 1


def die_with(parent_pid: int, number: int = signal.SIGKILL) -> None:
    """Have the kernel send this signal when the parent dies; ends at once where it has died.

    The parent is the thread that started this process. End-of-file on a pipe says
    the same, but nobody sees it while a library holds the interpreter.
    """
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number)
    if os.getppid() != parent_pid:
        os._exit(1)
