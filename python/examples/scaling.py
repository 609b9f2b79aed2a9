"""Prints how a render gets faster with more workers: `python scaling.py scene.xml --passes 64 --workers 1,2,4`.

Strong scaling: the same passes for all, one thread for each worker. Workers are processes of this machine, of Dask or
of submitit; on a cluster give its `Client` or executor instead.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import mitsuba as mi
import numpy as np


def with_dask(workers: int, **job) -> tuple[Path, float]:
    from distributed import Client, LocalCluster

    from mitsuba_vpt.cluster import dask

    options = {"n_workers": workers, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with LocalCluster(**options) as cluster, Client(cluster) as client:
        client.wait_for_workers(workers)
        return timed(dask.render, client, tasks=workers, **job)


def with_submitit(workers: int, **job) -> tuple[Path, float]:
    import submitit

    from mitsuba_vpt.cluster import slurm

    executor = submitit.LocalExecutor(folder=Path(job["folder"]) / "logs")
    return timed(slurm.render, tasks=workers, executor=executor, **job)


def timed(render, *arguments, **job) -> tuple[Path, float]:
    start = time.perf_counter()
    picture = render(*arguments, **job)
    return picture, time.perf_counter() - start


def pixels(picture: Path) -> np.ndarray:
    return np.array(mi.Bitmap(str(picture)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--passes", type=int, default=64)
    parser.add_argument("--workers", default="1,2", help="numbers of workers, with commas between")
    parser.add_argument("--engine", choices=["dask", "submitit"], default="dask")
    parser.add_argument("-D", dest="defines", action="append", default=[], metavar="NAME=VALUE")
    given = parser.parse_args()
    run = {"dask": with_dask, "submitit": with_submitit}[given.engine]
    defines = dict(pair.split("=", 1) for pair in given.defines)

    print("workers  seconds  speed-up  efficiency  same picture")
    with tempfile.TemporaryDirectory() as folder:
        first = None
        for workers in map(int, given.workers.split(",")):
            parts = Path(folder) / str(workers)
            picture, seconds = run(
                workers,
                scene=given.scene,
                output=parts / "picture.exr",
                passes=given.passes,
                folder=parts,
                threads=1,
                defines=defines,
            )
            first = first or (workers, seconds, picture)
            gain = first[0] * first[1] / seconds
            same = "yes" if np.array_equal(pixels(picture), pixels(first[2])) else "no"
            print(f"{workers:7}  {seconds:7.2f}  {gain:8.2f}  {gain / workers:9.0%}   {same}", flush=True)


if __name__ == "__main__":
    main()
