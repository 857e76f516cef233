"""Ctrl-C ends a program at once and in one line, whatever it does in C or in threads.

Python's own way raises `KeyboardInterrupt` between two lines of Python: a compilation is
waited for, a callback swallows it, and what runs in other threads is waited for again.
"""

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
from itertools import pairwise

INTERRUPTED = 130
"""Exit code, as of a shell's command that was ended by SIGINT."""
MODULES = "jaxplan", "jaxplan.train"
"""That are commands."""
CLOSED = 141
"""Of one whose reader went away, as by SIGPIPE."""


def is_command() -> bool:
    """Whether this process was started as `jaxplan`, or by `python -m` one of `MODULES`."""
    script = os.path.basename(sys.argv[0]) if sys.argv else ""
    modules = {("-m", module) for module in MODULES}
    return script == "jaxplan" or not modules.isdisjoint(pairwise(sys.orig_argv))


def end_on_interrupt() -> None:
    """Lets SIGINT end this process with `INTERRUPTED`; for programs, not for libraries.

    Processes that are started from now on do not hear it: they end with this one. Where
    somebody else handles SIGINT, or it is ignored as under `nohup`, nothing changes.
    """
    if sys.platform == "win32" or (
        signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):
        return
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    signal.set_wakeup_fd(writer)
    signal.signal(signal.SIGINT, lambda *_: None)
    threading.Thread(target=_end, args=(reader,), daemon=True).start()
    # The thread before hears it still; who is started from here inherits the mask.
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def _end(reader: int) -> None:
    """Waits for the signal's number in the pipe, and ends the process."""
    while os.read(reader, 1)[0] != signal.SIGINT:
        pass
    for process in multiprocessing.active_children():
        process.kill()
    with contextlib.suppress(OSError):
        os.write(2, b"interrupted\n")
    os._exit(INTERRUPTED)
