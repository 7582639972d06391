"""Independent jobs on worker processes of this machine, or on the workers of a Dask cluster.

The interface is `concurrent.futures.Executor`. On this machine each worker is an executor with one process, so that a
process that dies takes no other with it, and the job that it had is known; these executors are of the standard library. A
cluster is one executor of a Dask client (`fsm.run.cluster`).

Jobs travel in chunks, whose size follows from the measured time of a job. The jobs of a chunk that is lost with its worker
are tried again one by one; a job that is lost twice fails, with the cause.

Worker processes of this machine: executors with one process each, their interrupts, and their end with their parent.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import platform
import signal
import sys
import threading
import time
import traceback
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sized
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, field, replace
from multiprocessing import resource_tracker
from multiprocessing.process import BaseProcess
from typing import Any, Protocol

from fsm.errors import CaseError, FsmError, OutOfMemory, is_interrupt
from fsm.io.gc_startup import chunk_of_jobs
from fsm.io.provenance import made_by
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


_CHUNK = 0.5
"""Time that a worker needs for a chunk, s."""
_MOST = 64
"""Largest number of jobs of a chunk."""


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


class Team(Protocol):
    """Workers of this machine or of a cluster."""

    def room(self, sent: int) -> int:
        """Number of chunks that may be sent while `sent` chunks are not finished."""

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Send a call to a worker."""

    def back(self, call: Future[Any]) -> None:
        """Take a worker back whose call has ended."""

    def lost(self, call: Future[Any], error: BaseException) -> str:
        """Replace the worker of a call that ended with an error of the machinery, and give the cause."""

    def end(self, interrupted: bool) -> None:
        """End or leave all workers; those of an interrupted table save their work."""


@dataclass
class _Queue:
    """Jobs that wait: first those that are tried again, each alone, then new ones in chunks."""

    jobs: Iterator[tuple[int, Any]]
    left: int
    """Number of new jobs; an estimate, if their number is not known."""
    workers: int
    again: deque[tuple[int, Any]] = field(default_factory=deque)
    tried: set[int] = field(default_factory=set)
    cost: float = 0.0
    """Measured time of a job, s; 0 before the first chunk returns."""

    def chunk(self) -> list[tuple[int, Any]]:
        """Next jobs for one worker; an empty list if none wait."""
        if self.again:
            return [self.again.popleft()]
        fair = max(1, self.left // (2 * self.workers))  # all workers end at the same time
        size = min(fair, _MOST, max(1, int(_CHUNK / self.cost))) if self.cost else 1
        taken = [job for _, job in zip(range(size), self.jobs, strict=False)]
        self.left = max(self.left - size, 0)
        return taken

    def returned(self, count: int, seconds: float) -> None:
        """Correct the time of a job by that of a chunk."""
        new = max(seconds / count, 1e-6)
        self.cost = 0.7 * self.cost + 0.3 * new if self.cost else new


def run_jobs(
    work: Callable[[Any], Any],
    jobs: Iterable[Any],
    workers: int | None = None,
    copies: bool = False,
    on: str | None = None,
) -> Generator[JobOutcome, None, None]:
    """Run jobs on workers and yield their outcomes in the order of completion.

    Parameters
    ----------
    work : callable
        Top-level function of an importable module; a worker calls it with one job.
    jobs : iterable
        Arguments of `work`; they must be picklable. They are taken one after the other as workers become free, so a
        generator of a million jobs needs no memory.
    workers : int, optional
        Number of processes; default: the number of cores. On a cluster: the number of its jobs, for "slurm" only.
    copies : bool
        Whether workers are copies of this process, which have its modules, kernels and data at once. Only the command line
        on Linux may ask for this: a copy has no threads but one, and locks of the others would stay locked.
    on : str, optional
        "tcp://HOST:PORT", the scheduler of a Dask cluster, or "slurm"; default: processes of this machine.

    Raises
    ------
    CaseError
        The cluster cannot be reached or has ended, or one of its workers has another version of fsm or its libraries.

    Notes
    -----
    A worker runs many jobs, so each worker imports modules and loads compiled kernels only once. If the consumer stops
    early or is interrupted, every worker of this machine is interrupted once, so that it can write its checkpoint. It is
    killed after `GRACE` seconds.
    """
    numbered = enumerate(jobs)
    first = next(numbered, None)
    if first is None:
        return
    left = len(jobs) if isinstance(jobs, Sized) else 1_000_000_000
    team = _team(min(workers or os.cpu_count() or 1, left), copies, on, workers)
    queue = _Queue(_chain(first, numbered), left, team.room(0))
    sent: dict[Future[Any], list[tuple[int, Any]]] = {}
    ended = False
    try:
        while True:
            _send(team, queue, sent, work)
            if not sent:
                break
            for future in wait(sent, timeout=1.0, return_when=FIRST_COMPLETED).done:
                yield from _outcomes(team, queue, future, sent.pop(future))
        ended = True
    finally:
        team.end(not ended)


def _team(count: int, copies: bool, on: str | None, asked: int | None) -> Team:
    if on is None:
        return LocalTeam(count, copies)
    from fsm.run.cluster import ClusterTeam  # this import needs the package distributed

    return ClusterTeam(on, asked)


def _chain(first: tuple[int, Any], others: Iterator[tuple[int, Any]]) -> Iterator[tuple[int, Any]]:
    yield first
    yield from others


def _send(team: Team, queue: _Queue, sent: dict[Future[Any], list[tuple[int, Any]]], work: Callable[[Any], Any]) -> None:
    """Send chunks as long as the team has room and jobs wait."""
    for _ in range(team.room(len(sent))):
        chunk = queue.chunk()
        if not chunk:
            return
        message = pickle.dumps((work, [job for _, job in chunk]))
        sent[team.submit(run_chunk, message, len(chunk), made_by())] = chunk


def _outcomes(team: Team, queue: _Queue, future: Future[Any], chunk: list[tuple[int, Any]]) -> Iterator[JobOutcome]:
    """Outcomes of a chunk that has ended; jobs that were lost with their worker for the first time wait again."""
    try:
        other, outcomes, seconds = future.result()
    except (Exception, CancelledError) as error:  # of the machinery: `run_chunk` catches those of the jobs
        cause = team.lost(future, error)
        for number, job in chunk:
            if number in queue.tried:
                yield JobOutcome(number, error=(cause,), exit_code=1)
            else:
                queue.tried.add(number)
                queue.again.append((number, job))
        return
    team.back(future)
    if other:
        raise CaseError(f"a worker has another fsm: {other}; install the same versions on all machines")
    queue.returned(len(chunk), seconds)
    for (number, _), outcome in zip(chunk, outcomes, strict=True):
        yield replace(outcome, job=number)


def run_chunk(message: bytes, count: int, versions: dict[str, str]) -> tuple[str, list[JobOutcome], float]:
    """Run the `count` jobs of a message in a worker; gives differing versions, the outcomes, and the time (s)."""
    own = made_by()
    if own != versions:
        differing = [f"{key} {own.get(key)}, here {value}" for key, value in versions.items() if own.get(key) != value]
        return f"{platform.node()} has {'; '.join(differing)}", [], 0.0
    begun = time.perf_counter()
    with at_work(), chunk_of_jobs():
        loaded = _run(pickle.loads, message)  # this imports the module of the function if necessary
        outcomes = [loaded] * count if loaded.error else [_run(loaded.value[0], job) for job in loaded.value[1]]
    return "", outcomes, time.perf_counter() - begun


def _run(work: Callable[[Any], Any], job: Any) -> JobOutcome:
    """Outcome of a job, without its number."""
    unnumbered = -1
    try:
        return JobOutcome(unnumbered, value=work(job))
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
