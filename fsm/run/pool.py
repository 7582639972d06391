"""Independent jobs on several processes; a job that fails, or whose process dies, does not affect other jobs."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
import traceback
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any

from fsm.errors import FsmError, OutOfMemory, is_interrupt
from fsm.io.gc_startup import rare_gc
from fsm.io.threads import one_thread

_LOOK = 0.2
"""Time between two looks of a worker at its parent, s."""
GRACE = 20.0
"""Time for interrupted workers to write their checkpoints, s."""


@dataclass(frozen=True)
class JobOutcome:
    """Result of a job.

    Attributes
    ----------
    job : number of the job, from 0
    value : return value
    error : lines of the error message; None without an error
    exit_code : exit code of the error
    trace : traceback of an unexpected error
    """

    job: int
    value: Any = None
    error: tuple[str, ...] | None = None
    exit_code: int = 0
    trace: str = ""


@dataclass
class _Worker:
    process: BaseProcess
    channel: Connection
    job: int | None = None


def run_jobs(
    work: Callable[[Any], Any], jobs: Sequence[Any], workers: int, copies: bool = False
) -> Generator[JobOutcome, None, None]:
    """Run jobs on worker processes and yield their outcomes in the order of completion.

    Parameters
    ----------
    work : callable
        Top-level function of an importable module; a worker calls it with one job.
    jobs : sequence
        Arguments of `work`; they must be picklable.
    workers : int
        Number of processes, at least one.
    copies : bool
        Whether workers are copies of this process, which have its modules, kernels and data at once. Only the command line
        on Linux may ask for this: a copy has no threads but one, and locks of the others would stay locked.

    Notes
    -----
    A worker runs several jobs, so each worker imports modules and loads compiled kernels only once. If a worker dies
    (for example without memory), its job fails and a new worker replaces it. If the consumer stops early or is
    interrupted, every worker is interrupted once, so that it can write its checkpoint. The worker is killed after `GRACE`
    seconds.
    """
    context = multiprocessing.get_context("fork" if copies else "spawn")
    waiting = deque(range(len(jobs)))
    team: list[_Worker] = []
    try:
        for _ in range(min(max(workers, 1), len(jobs))):
            team.append(_start(context, team))
            _give(team[-1], work, waiting, jobs)
        while team:
            yield from _collect(team)
            for worker in [worker for worker in team if worker.job is None]:
                if not worker.process.is_alive():
                    team.remove(worker)
                    worker = _start(context, team)
                    team.append(worker)
                if not _give(worker, work, waiting, jobs):
                    team.remove(worker)
                    worker.channel.close()
    finally:
        _stop(team)


def _start(context: Any, team: Sequence[_Worker]) -> _Worker:
    here, there = context.Pipe()
    copied = [here, *(worker.channel for worker in team)] if context.get_start_method() == "fork" else []
    process = context.Process(target=_serve, args=(there, copied), name="fsm worker", daemon=True)
    with one_thread(), _no_interrupt(), warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # about threads, such as that of a progress bar
        process.start()
    there.close()
    return _Worker(process, here)


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


def _give(worker: _Worker, work: Callable[[Any], Any], waiting: deque[int], jobs: Sequence[Any]) -> bool:
    """Send the next job to a worker, with the function that runs it. Return False if no job is left."""
    if not waiting:
        return False
    worker.job = waiting.popleft()
    with contextlib.suppress(OSError):  # the worker has died; `_collect` handles this
        worker.channel.send((work, jobs[worker.job]))
    return True


def _collect(team: Sequence[_Worker]) -> list[JobOutcome]:
    """Wait until at least one worker has finished or died, and return the outcomes."""
    ready = wait([worker.channel for worker in team])
    outcomes = []
    for worker in team:
        if worker.channel not in ready or worker.job is None:
            continue
        try:
            outcomes.append(replace(worker.channel.recv(), job=worker.job))
        except (EOFError, OSError):
            worker.process.join(GRACE)
            outcomes.append(_died(worker.job, worker.process.exitcode))
        worker.job = None
    return outcomes


def _died(job: int, code: int | None) -> JobOutcome:
    how = f"by signal {-code}" if code is not None and code < 0 else f"with code {code}"
    hint = "; out of memory? try fewer workers" if code == -9 else ""
    return JobOutcome(job, error=(f"the worker process ended {how}{hint}",), exit_code=1)


def _stop(team: Sequence[_Worker]) -> None:
    for worker in team:
        worker.channel.close()
        if worker.process.is_alive() and worker.process.pid is not None:
            with contextlib.suppress(OSError):
                os.kill(worker.process.pid, signal.SIGINT)
    for worker in team:
        worker.process.join(GRACE)
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join()


def _serve(channel: Connection, copied: Sequence[Connection]) -> None:
    """Run jobs in a worker until the channel closes; a copy closes the `copied` channels of its parent at once."""
    for other in copied:
        other.close()
    # own process group: Ctrl-C then comes from the parent only, not also from the terminal
    if hasattr(os, "setpgrp"):
        os.setpgrp()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # also below a shell that ignores interrupts in the background
    threading.Thread(target=_end_with_parent, name="watch of the parent", daemon=True).start()
    try:
        with rare_gc():
            while True:
                message = channel.recv_bytes()
                if hasattr(signal, "pthread_sigmask"):  # the except clause below is active from here on
                    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
                channel.send(_do(message))
    except (KeyboardInterrupt, EOFError, OSError):
        return


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


def _do(message: bytes) -> JobOutcome:
    """Run a job; unpickling imports the module of its function if necessary."""
    unnumbered = -1  # the parent process sets the number
    try:
        work, argument = pickle.loads(message)
        return JobOutcome(unnumbered, value=work(argument))
    except FsmError as error:
        return JobOutcome(unnumbered, error=tuple(str(error).splitlines()), exit_code=error.exit_code)
    except Exception as error:
        if is_interrupt(error):
            raise KeyboardInterrupt from None
        if isinstance(error, MemoryError):
            full = OutOfMemory(error)
            return JobOutcome(unnumbered, error=(str(full),), exit_code=full.exit_code)
        what = f"internal error: {type(error).__name__}: {error}".splitlines()[0]
        return JobOutcome(unnumbered, error=(what,), exit_code=1, trace=traceback.format_exc())
