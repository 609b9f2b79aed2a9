"""A render on a Dask cluster, its parts as tasks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from distributed import Client

from .._program import PathLike
from . import _parts


def render(
    client: Client,
    scene: PathLike,
    output: PathLike,
    *,
    passes: int,
    tasks: int,
    folder: PathLike,
    **arguments: Any,
) -> Path:
    """Renders ``passes`` passes in ``tasks`` tasks on the cluster's workers and merges them here to ``output``.

    ``folder`` is for parts, and must be seen by all workers. Dask gives the tasks of a worker that died to another one,
    as often as its configuration ``distributed.scheduler.allowed-failures`` says. Workers should have one thread each,
    and ``threads`` (as all other arguments, one of `share_out`) say how many cores a part may use.
    """
    Path(folder).mkdir(parents=True, exist_ok=True)
    parts = _parts.share_out(scene, passes, tasks, folder, **arguments)
    # Not pure: the same part rendered twice is to be rendered twice.
    futures = client.map(_parts.render_part, parts, pure=False)
    return _parts.merge(client.gather(futures), output)
