"""Ranges of passes, and the program that renders and merges them."""

from __future__ import annotations

import os
import shutil
import subprocess
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .._program import PROGRAM, PathLike, ProgramError, environment, run, scene_arguments


@dataclass(frozen=True)
class Part:
    """A range of a render's passes, and the file that its sums go to."""

    #: Arguments of ``vpt render`` that are the same for all parts.
    arguments: tuple[str, ...]
    #: Passes ``first`` to ``end - 1``.
    first: int
    end: int
    file: str


def share_out(
    scene: PathLike,
    passes: int,
    tasks: int,
    folder: PathLike,
    *,
    seed: int = 0,
    threads: int | None = None,
    method: str | None = None,
    defines: Mapping[str, Any] | None = None,
    settings: Mapping[str, Any] | None = None,
    variant: str | None = None,
    sensor: int = 0,
    whole: int = 4,
) -> list[Part]:
    """Divides the passes of a render into at most ``tasks`` parts of about the same size.

    A range begins at a multiple of ``whole``, which must be one of ``jitter_every`` (1, or 4 where chains shoot). The
    files lie in ``folder``, which all workers must reach under the same name, as they must the scene.
    """
    if passes < 1 or tasks < 1 or whole < 1:
        raise ValueError(f"passes, tasks and whole must be 1 or more, but are {passes}, {tasks} and {whole}")
    given = {"seed": seed, "threads": threads, "method": method}
    arguments = scene_arguments(
        os.path.abspath(scene), defines=defines, settings=settings, variant=variant, sensor=sensor
    )
    for name, value in given.items():
        arguments += [f"--{name}", str(value)] if value is not None else []
    blocks = -(-passes // whole)
    tasks = min(tasks, blocks)
    bounds = [min(passes, whole * (blocks * task // tasks)) for task in range(tasks + 1)]
    return [
        Part(tuple(arguments), first, end, str(Path(folder).absolute() / f"part-{first:06}-{end:06}.exr"))
        for first, end in zip(bounds, bounds[1:])
    ]


def render_part(part: Part) -> str:
    """Renders a part in a process of its own and returns its file, which appears at once and complete."""
    # A worker that died may have left a program behind that still writes: each try has a file of its own.
    aside = f"{part.file.removesuffix('.exr')}-{uuid.uuid4().hex}.exr"
    passes = ["--passes", f"{part.first}..{part.end}"]
    command = [str(PROGRAM), "render", *part.arguments, *passes, "--quiet", "-o", aside]
    # Where util-linux can, the program dies with its worker.
    setpriv = shutil.which("setpriv")
    bound = [setpriv, "--pdeathsig", "KILL"] if setpriv is not None else []
    try:
        done = subprocess.run(
            [*bound, *command],
            env=environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            errors="replace",
            check=False,
        )
        if done.returncode != 0:
            said = done.stderr.strip() or f"vpt ended with {done.returncode}"
            raise ProgramError(f"{said} (exit code {done.returncode})", done.returncode)
        os.replace(aside, part.file)
    finally:
        Path(aside).unlink(missing_ok=True)
    return part.file


def merge(parts: Sequence[PathLike], output: PathLike) -> Path:
    """Puts parts together to a picture, and returns its path."""
    run(["merge", *parts, "-o", output], quiet=True)
    return Path(output)
