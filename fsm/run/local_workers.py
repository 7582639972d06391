"""Worker processes of this machine: executors with one process each, their interrupts, and their end with their parent."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.process import BaseProcess
from typing import Any

from fsm.io.threads import one_thread

_LOOK = 0.2
"""Time between two looks of a worker at its parent, s."""
GRACE = 20.0
"""Time for interrupted workers to write their checkpoints, s."""
_own: dict[str, bool] = {}
"""State of this process if it is a worker of `LocalTeam`: whether it is at work."""
_one = threading.Lock()
"""One chunk at a time: a worker of a cluster may have several threads."""


@dataclass
class _Worker:
    executor: ProcessPoolExecutor
    process: BaseProcess


class LocalTeam:
    """Worker processes of this machine.

    Parameters
    ----------
    count : number of processes; each one starts with its first call
    copies : whether they are copies of this process
    """

    def __init__(self, count: int, copies: bool) -> None:
        self.count = count
        self.context = multiprocessing.get_context("fork" if copies else "spawn")
        self.free: list[_Worker] = []
        self.busy: dict[Future[Any], _Worker] = {}

    def room(self, sent: int) -> int:
        """Number of workers without a call: a worker has one call at a time, so that the call of one that dies is known."""
        return self.count - sent

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Call a function in a worker without a call."""
        while True:
            worker = self.free.pop() if self.free else self._started()
            try:
                call = worker.executor.submit(work, *arguments)
            except BrokenExecutor:  # it has died while it had no call
                continue
            self.busy[call] = worker
            return call

    def back(self, call: Future[Any]) -> None:
        """Take a worker back whose call has ended."""
        self.free.append(self.busy.pop(call))

    def _started(self) -> _Worker:
        """New worker process."""
        before = set(multiprocessing.active_children())
        executor = ProcessPoolExecutor(1, self.context, _begin)
        with one_thread(), _no_interrupt(), warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # about threads, such as that of a progress bar
            executor.submit(os.getpid)
        (process,) = set(multiprocessing.active_children()) - before
        return _Worker(executor, process)

    def lost(self, call: Future[Any], error: BaseException) -> str:
        """Forget a worker that has died, and give the cause."""
        worker = self.busy.pop(call)
        worker.executor.shutdown(wait=False)
        worker.process.join(GRACE)
        code = worker.process.exitcode
        if code is None or not isinstance(error, BrokenExecutor):
            return f"the worker process failed: {type(error).__name__}: {error}"
        how = f"by signal {-code}" if code < 0 else f"with code {code}"
        return f"the worker process ended {how}{'; out of memory? try fewer workers' if code == -signal.SIGKILL else ''}"

    def end(self, interrupted: bool) -> None:
        """End all workers; interrupt them before if they are at work."""
        workers = [*self.free, *self.busy.values()]
        for worker in workers:
            worker.executor.shutdown(wait=False, cancel_futures=True)
            if interrupted and worker.process.is_alive() and worker.process.pid is not None:
                with contextlib.suppress(OSError):
                    os.kill(worker.process.pid, signal.SIGINT)
        for worker in workers:
            worker.process.join(GRACE)
            if worker.process.is_alive():
                worker.process.kill()
                worker.process.join()


@contextlib.contextmanager
def _no_interrupt() -> Iterator[None]:
    """Block interrupts while processes are started in the block; a worker unblocks them when it is ready."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    # the first process starts the resource tracker, which would unblock interrupts; so start the tracker before
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin() -> None:
    """Prepare a new worker process."""
    # own process group: Ctrl-C then comes from the parent only, not also from the terminal
    if hasattr(os, "setpgrp"):
        os.setpgrp()
    _own["at work"] = False
    signal.signal(signal.SIGINT, _interrupted)  # also below a shell that ignores interrupts in the background
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    threading.Thread(target=_end_with_parent, name="watch of the parent", daemon=True).start()


def _interrupted(*_: Any) -> None:
    """Interrupt the work of this worker; without work, end at once."""
    if _own["at work"]:
        raise KeyboardInterrupt
    os._exit(1)


@contextlib.contextmanager
def at_work() -> Iterator[None]:
    """The block is work that an interrupt may end; then it also ends this process, if it is a worker of this machine."""
    mine = bool(_own)
    _own.update({"at work": True} if mine else {})
    try:
        with _one:
            yield
    except KeyboardInterrupt:
        if mine:
            os._exit(1)
        raise
    finally:
        _own.update({"at work": False} if mine else {})


def _end_with_parent() -> None:
    """Interrupt this worker when its parent dies, so that it writes its checkpoint; end it after `GRACE` seconds."""
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    if hasattr(os, "getppid") and sys.platform != "win32":  # other workers may be copies that keep `parent` joinable
        while os.getppid() == parent.pid:
            time.sleep(_LOOK)
    else:
        parent.join()
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(GRACE)
    os._exit(1)
