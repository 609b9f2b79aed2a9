"""A render as a job array of Slurm, by submitit; its local executor does the same with processes of one machine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import submitit

from .._program import PathLike
from . import _parts


def render(
    scene: PathLike,
    output: PathLike,
    *,
    passes: int,
    tasks: int,
    folder: PathLike,
    executor: Any = None,
    attempts: int = 3,
    **arguments: Any,
) -> Path:
    """Renders ``passes`` passes in ``tasks`` jobs and merges them to ``output``.

    ``folder`` is for parts and logs, and must be seen by all nodes. ``executor`` is one of submitit's, with its
    parameters set (partition, time, cpus); left out, it is Slurm where there is one, else this machine. A range whose
    job failed is submitted again until it was tried ``attempts`` times. The other arguments are those of `share_out`.
    """
    Path(folder).mkdir(parents=True, exist_ok=True)
    executor = executor if executor is not None else submitit.AutoExecutor(folder=Path(folder) / "logs")
    parts = _parts.share_out(scene, passes, tasks, folder, **arguments)
    waiting = parts
    for attempt in range(1, attempts + 1):
        jobs = executor.map_array(_parts.render_part, waiting)
        failures = [(part, error) for part, job in zip(waiting, jobs) if (error := failure(job)) is not None]
        if not failures:
            return _parts.merge([part.file for part in parts], output)
        for part, error in failures:
            # What the user must mend fails again on every node.
            if attempt == attempts or is_final(error):
                raise RuntimeError(f"passes {part.first}..{part.end} were not rendered: {error}") from error
        waiting = [part for part, _ in failures]
    raise ValueError(f"attempts must be 1 or more, but is {attempts}")


def failure(job: Any) -> Exception | None:
    """Waits for a job; what became of it, unless that is its part."""
    try:
        job.result()
    except Exception as error:  # submitit's own, or what the task raised
        return error
    return None


def is_final(error: Exception) -> bool:
    """Whether the program refused its input; submitit hands on the text of what a task raised."""
    return "(exit code 2)" in str(error)
