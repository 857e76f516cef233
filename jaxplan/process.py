"""What a process may be, and how it ends.

Not a forked child: JAX's threads stay behind, and a call would hang.
"""

import errno
import os

BAD_INPUT, FULL = 2, 1
"""Exit codes; the second one of a full disk."""

_home: int | None = None
"""The process that used JAX first."""


def refuse_fork() -> None:
    """Every door that uses JAX calls this.

    Raises:
        RuntimeError: The process was forked from one that has used JAX.
    """
    global _home
    _home = os.getpid() if _home is None else _home
    if _home != os.getpid():
        raise RuntimeError(
            "JAX does not work in a process forked from one that has used it: start "
            'processes by spawn, multiprocessing.get_context("spawn")'
        )


def exit_code(error: BaseException) -> int:
    """Of a program that an error has ended."""
    return FULL if getattr(error, "errno", None) == errno.ENOSPC else BAD_INPUT
