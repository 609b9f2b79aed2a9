"""Renders shared out to real workers: the same picture, also when one of them is killed on the way."""

import os
import signal
from pathlib import Path

import numpy as np
import pytest
from conftest import SCENE, SIZE

from mitsuba_vpt import ProgramError, _pictures, cluster, run

PASSES = 12
DEFINES = {"resx": SIZE, "resy": SIZE}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The picture of one machine."""
    picture = tmp_path_factory.mktemp("whole") / "picture.exr"
    defines = [word for name, value in DEFINES.items() for word in ("-D", f"{name}={value}")]
    run(["render", SCENE, *defines, "--passes", str(PASSES), "--seed", "4", "-o", picture], quiet=True)
    return _pictures.read(picture)


def test_shares_cover_all_passes_once():
    for passes in range(1, 40):
        for tasks in range(1, 12):
            for whole in (1, 4):
                parts = cluster.share_out(SCENE, passes, tasks, "parts", whole=whole)
                covered = [number for part in parts for number in range(part.first, part.end)]
                assert covered == list(range(passes))
                assert len(parts) == min(tasks, -(-passes // whole))
                assert all(part.first % whole == 0 for part in parts)
                sizes = [part.end - part.first for part in parts[:-1]]
                assert not sizes or max(sizes) - min(sizes) <= whole
                assert len({part.file for part in parts}) == len(parts)


def test_shares_of_nothing_are_refused():
    with pytest.raises(ValueError, match="passes, tasks and whole must be 1 or more, but are 0, 2 and 4"):
        cluster.share_out(SCENE, 0, 2, "parts")


def test_parts_merge_to_the_whole(whole, tmp_path):
    parts = cluster.share_out(SCENE, PASSES, 3, tmp_path, seed=4, defines=DEFINES)
    files = [cluster.render_part(part) for part in parts]
    assert sorted(os.listdir(tmp_path)) == sorted(Path(file).name for file in files)
    merged = cluster.merge(files, tmp_path / "merged.exr")
    assert np.array_equal(_pictures.read(merged), whole)


def test_a_refused_part_says_why(tmp_path):
    (part,) = cluster.share_out(SCENE, 4, 1, tmp_path, method="magic")
    with pytest.raises(ProgramError, match=r"magic.*\(exit code 2\)"):
        cluster.render_part(part)
    assert os.listdir(tmp_path) == []


def killing_once(marker: Path):
    """A task that kills its worker on the first try at the second range, as a machine that goes down would."""

    def render(part):
        if part.first > 0 and not marker.exists():
            marker.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return cluster.render_part(part)

    return render


def test_job_array_with_a_killed_job(whole, tmp_path, monkeypatch):
    submitit = pytest.importorskip("submitit")
    from mitsuba_vpt.cluster import _parts, slurm

    marker = tmp_path / "killed"
    monkeypatch.setattr(_parts, "render_part", killing_once(marker))
    executor = submitit.LocalExecutor(folder=tmp_path / "logs")
    picture = slurm.render(
        SCENE, tmp_path / "picture.exr", passes=PASSES, tasks=3, folder=tmp_path / "parts", executor=executor,
        seed=4, threads=1, defines=DEFINES,
    )  # fmt: skip
    assert marker.exists()
    assert np.array_equal(_pictures.read(picture), whole)


def test_job_array_gives_up(tmp_path):
    submitit = pytest.importorskip("submitit")
    from mitsuba_vpt.cluster import slurm

    executor = submitit.LocalExecutor(folder=tmp_path / "logs")
    with pytest.raises(RuntimeError, match=r"(?s)passes 0\.\.4 were not rendered.*magic"):
        slurm.render(
            SCENE, tmp_path / "picture.exr", passes=4, tasks=1, folder=tmp_path, executor=executor, method="magic"
        )
    # Input that the user must mend is not tried again.
    assert len(list((tmp_path / "logs").glob("*_submitted.pkl"))) == 1


def test_dask_cluster_with_a_killed_worker(whole, tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    from mitsuba_vpt.cluster import _parts, dask

    marker = tmp_path / "killed"
    monkeypatch.setattr(_parts, "render_part", killing_once(marker))
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as workers,
        distributed.Client(workers) as client,
    ):
        picture = dask.render(
            client, SCENE, tmp_path / "picture.exr", passes=PASSES, tasks=4, folder=tmp_path / "parts",
            seed=4, threads=1, defines=DEFINES,
        )  # fmt: skip
    assert marker.exists()
    assert np.array_equal(_pictures.read(picture), whole)
