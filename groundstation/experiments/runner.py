"""Runs many tasks: one after the other or on a dask cluster, one result file per task, so that nothing is run twice."""

import json
import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol, TypeVar

Tell = Callable[[int, int], None]


class Keyed(Protocol):
    """A value that describes a run; equal ones have equal keys and equal results."""

    @property
    def key(self) -> str:
        """Return a name that only equal tasks share."""

    def __hash__(self) -> int:
        """Return the hash: tasks are looked up."""


T = TypeVar("T", bound=Keyed)
Execute = Callable[[T], dict[str, Any]]


class SweepError(RuntimeError):
    """A sweep that cannot go on: no scheduler, or tasks that failed. Finished results stay."""


def result_file(folder: Path, task: Keyed) -> Path:
    """Return the path of a task's result."""
    return folder / f"{task.key}.json"


def read_result(path: Path) -> dict[str, Any] | None:
    """Return a finished result; None if there is none or it is not whole."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) and {"task", "merits", "timing"} <= content.keys() else None


def write_atomically(path: Path, text: str) -> None:
    """Write a file that is either whole or not there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(path)


def run_tasks(
    tasks: Sequence[T],
    folder: Path | None = None,
    scheduler: str = "",
    workers: int = 0,
    tell: Tell = lambda done, total: None,
    run: Execute[T] | None = None,
) -> list[dict[str, Any]]:
    """Return the rows of all tasks, in their order; those whose result is in `folder` are read instead of run.

    scheduler: address of a dask cluster, `local` for one of our own with `workers` processes, empty for none.
    run: function from a task to its row, {"task", "merits", "timing"}; None: that of the planar experiments.
    Raises SweepError when a cluster cannot be reached or a task fails.
    """
    run = run or _planar_run()
    rows: dict[T, dict[str, Any]] = {}
    if folder is not None:
        found = {task: read_result(result_file(folder, task)) for task in tasks}
        rows = {task: row for task, row in found.items() if row is not None}
    missing = [task for task in dict.fromkeys(tasks) if task not in rows]
    tell(len(rows), len(tasks))
    source = _on_cluster(missing, scheduler, workers, run) if scheduler and missing else _one_by_one(missing, run)
    for task, row in source:
        rows[task] = row
        if folder is not None:
            write_atomically(result_file(folder, task), json.dumps(row))
        tell(len(rows), len(tasks))
    return [rows[task] for task in tasks]


def _planar_run() -> Execute[Any]:
    from groundstation.experiments.tasks import execute  # here: it compiles kernels that others do not need

    return execute


def _with_key(run: Execute[T], task: T) -> tuple[str, dict[str, Any]]:
    """Return the key that a worker gives to a task, which tells its version of the program, and the row."""
    return task.key, run(task)


def _of_this_program(task: Keyed, key: str, row: dict[str, Any]) -> dict[str, Any]:
    """Return a worker's row; raises SweepError if its key for the task is not the one of this program."""
    if key != task.key:
        raise SweepError(
            f"a worker ran {task.key} as {key}: its program or a plug-in is another one than here, or has changed "
            "since the worker began; install this one there, and start the workers again"
        )
    return row


def dask_is_there() -> bool:
    """Return whether the optional extra `sweep` is installed."""
    return find_spec("distributed") is not None


def _one_by_one(tasks: Sequence[T], run: Execute[T]) -> Iterator[tuple[T, dict[str, Any]]]:
    for task in tasks:
        yield task, run(task)


def _on_cluster(
    tasks: Sequence[T], scheduler: str, workers: int, run: Execute[T]
) -> Iterator[tuple[T, dict[str, Any]]]:
    """Yield results as they come; a worker that dies is replaced by another one, its tasks are run again."""
    if not dask_is_there():
        raise SweepError("a cluster needs dask: pip install 'skein-groundstation[sweep]', or leave out --scheduler")
    from distributed import Client, LocalCluster, as_completed

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # dask warns of its own ports and of workers that leave
        if scheduler == "local":
            # Silent: its log would fill the terminal with workers that leave.
            cluster = LocalCluster(
                n_workers=workers or os.cpu_count() or 1,
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address=None,
                silence_logs=50,
            )
        try:
            client = Client(cluster if scheduler == "local" else scheduler, timeout="10s")
        except (OSError, TimeoutError, ValueError) as error:
            raise SweepError(f"no dask scheduler answers at {scheduler}: {error}") from error
        try:
            futures = {client.submit(_with_key, run, task, pure=False, retries=3): task for task in tasks}
            for future in as_completed(list(futures)):
                task = futures[future]
                if future.status != "finished":
                    raise SweepError(f"task {task.key} failed: {future.exception()}")
                yield task, _of_this_program(task, *future.result())
                future.release()
        finally:
            client.close()
            if scheduler == "local":
                cluster.close()
