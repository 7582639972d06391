"""Workers of a Dask cluster: any scheduler by its address, or workers that dask-jobqueue starts as jobs of Slurm.

Slurm is reached through dask-jobqueue, so that the same Dask client serves every cluster. submitit, the alternative, starts
one job of Slurm per call and has no queue of tasks: chunks would wait in the queue of the machine one by one.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from typing import Any

from fsm.errors import CaseError

_PLUGIN = "fsm: no profile"
_WAIT = 30.0
"""Time to wait for the scheduler, s."""


def _without_profile() -> Any:
    """Plugin of workers, also of those that join late, that stops the profile of their work while it is registered.

    A worker of Dask looks at the stack of its work every 10 ms, which takes 8 % of its time.
    """
    from distributed import WorkerPlugin

    class WithoutProfile(WorkerPlugin):  # type: ignore[misc, unused-ignore]
        def setup(self, worker: Any) -> None:
            calls = worker.periodic_callbacks  # a worker that joins starts all that are here after this
            self.stopped = {name: calls.pop(name) for name in [*calls] if name.startswith("profile")}
            for call in self.stopped.values():
                call.stop()

        def teardown(self, worker: Any) -> None:
            worker.periodic_callbacks.update(self.stopped)
            for call in self.stopped.values():
                call.start()

    return WithoutProfile()


class ClusterTeam:
    """Workers of a Dask cluster.

    Parameters
    ----------
    on : "tcp://HOST:PORT", or "slurm"
    count : number of jobs of Slurm; default: as many as its configuration starts

    Raises
    ------
    CaseError
        There is no scheduler at this address, or a package is missing.
    """

    def __init__(self, on: str, count: int | None) -> None:
        self.on, self.cluster = on, None
        try:
            from distributed import Client

            if on == "slurm":
                from dask_jobqueue import SLURMCluster
        except ImportError as error:
            raise CaseError(f"needs the package {error.name}: pip install 'fsm[cluster]'", f"--on {on}") from None
        try:
            if on == "slurm":
                self.cluster = SLURMCluster()
                self.cluster.scale(jobs=count or 1)
            self.client = Client(self.cluster or on, timeout=_WAIT, set_as_default=False)
        except (OSError, ValueError, RuntimeError) as error:
            why = " ".join(str(error).split())
            raise CaseError(f"no cluster there ({why}); start one, as `dask scheduler` does", f"--on {on}") from None
        self.client.register_plugin(_without_profile(), name=_PLUGIN)
        self.executor = self.client.get_executor(pure=False)

    def room(self, sent: int) -> int:
        """Number of further chunks: two for each thread of a worker, also of those that join late."""
        if self.client.status != "running":
            raise CaseError("the scheduler is gone; the finished jobs are kept, --resume runs the others", f"--on {self.on}")
        return 2 * max(1, sum(self.client.nthreads().values())) - sent

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Send a call to the cluster."""
        return self.executor.submit(work, *arguments)

    def back(self, call: Future[Any]) -> None:
        """The scheduler itself knows which workers are free."""

    def lost(self, call: Future[Any], error: BaseException) -> str:
        """Cause of a call that was lost; the scheduler replaces the worker."""
        if isinstance(error, ImportError):
            text = f"a worker has another fsm or none ({error}); install the same versions on all machines"
            raise CaseError(text, f"--on {self.on}") from None
        return f"lost by the cluster: {type(error).__name__}: {' '.join(str(error).split())}"[:300]

    def end(self, interrupted: bool) -> None:
        """Leave the cluster; calls that are not finished are cancelled."""
        self.executor.shutdown(wait=False)
        with suppress(OSError, TimeoutError):  # the scheduler may be gone
            if self.client.status == "running":
                self.client.unregister_worker_plugin(_PLUGIN)
        self.client.close()
        if self.cluster is not None:
            self.cluster.close()
