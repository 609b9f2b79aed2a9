"""``vpt compare`` from Python, and what it measured as arrays."""

from __future__ import annotations

import html
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _pictures
from ._program import PathLike, run, scene_arguments, scene_file

#: What is measured at each time of a run.
COLUMNS = ("seconds", "work", "rmse", "relative_mse", "flip")


def compare(
    scene: PathLike,
    methods: Sequence[str] = ("ppt_metro", "ppt", "apa", "ppb", "volpath"),
    *,
    time: float = 60.0,
    seeds: int = 2,
    reference: PathLike | None = None,
    reference_method: str | None = None,
    reference_time: float | None = None,
    output: PathLike | None = None,
    restart: bool = False,
    defines: Mapping[str, Any] | None = None,
    settings: Mapping[str, Any] | None = None,
    variant: str | None = None,
    sensor: int = 0,
    quiet: bool = False,
) -> Comparison:
    """Measures what accuracy costs in time: methods and integrators side by side, in a process of their own.

    Every method renders the scene (a file) for ``time`` seconds with each seed; ``vpt compare --help`` tells the rest.
    ``output`` is the folder of the report, by default the scene's name with ``-compare`` in the working folder. Ctrl-C
    ends early; what was measured is then on disk, and `Comparison` opens it.
    """
    folder = Path(output) if output is not None else Path(f"{scene_file(scene).stem}-compare")
    arguments: list[PathLike] = ["compare"]
    arguments += scene_arguments(scene, defines=defines, settings=settings, variant=variant, sensor=sensor)
    arguments += ["--methods", ",".join(methods), "--time", str(time), "--seeds", str(seeds), "-o", folder]
    for option, value in (
        ("--reference", reference),
        ("--reference-method", reference_method),
        ("--reference-time", reference_time),
    ):
        if value is not None:
            arguments += [option, os.fspath(value) if isinstance(value, os.PathLike) else str(value)]
    arguments += ["--restart"] if restart else []
    arguments += ["--quiet"] if quiet else []
    run(arguments, quiet=quiet)
    return Comparison(folder)


class Comparison:
    """What ``vpt compare`` left in a folder. In a notebook it is its report."""

    def __init__(self, folder: PathLike) -> None:
        self.folder = Path(folder)
        try:
            text = (self.folder / "results.json").read_text(encoding="utf-8")
        except FileNotFoundError:
            raise FileNotFoundError(f"{self.folder} holds no comparison: it has no results.json") from None
        #: All of ``results.json``.
        self.results: dict[str, Any] = json.loads(text)

    @property
    def methods(self) -> list[str]:
        """The names of what was compared."""
        return [method["name"] for method in self.results["methods"]]

    @property
    def report(self) -> Path:
        """The HTML report, which opens offline."""
        return self.folder / "report.html"

    @property
    def reference(self) -> _pictures.Array:
        """The linear picture that errors were held against."""
        return _pictures.read(self.folder / "images" / "reference.exr")

    def seeds(self, method: str) -> list[int]:
        """The seeds that a method ran with."""
        return [run["seed"] for run in self._runs(method)]

    def errors(self, method: str, seed: int = 0) -> dict[str, npt.NDArray[np.float64]]:
        """Errors over time: arrays by the names of `COLUMNS`; ``work`` is passes, or samples per pixel."""
        snapshots = self._run(method, seed)["snapshots"]
        # An error that no number can say is null in the file.
        return {
            name: np.array([np.nan if shot[name] is None else shot[name] for shot in snapshots], dtype=np.float64)
            for name in COLUMNS
        }

    def picture(self, method: str, seed: int = 0, index: int = -1) -> _pictures.Array:
        """A linear picture that was measured, by default the run's last; of seeds but the first no other is kept."""
        image = self._run(method, seed)["snapshots"][index]["image"]
        if image is None:
            raise LookupError(f"picture {index} of {method} with seed {seed} was not kept; that of index -1 is")
        return _pictures.read(self.folder / image)

    def _runs(self, method: str) -> list[dict[str, Any]]:
        for found in self.results["methods"]:
            if found["name"] == method:
                runs: list[dict[str, Any]] = found["runs"]
                return runs
        raise LookupError(f"{method!r} was not compared; there are {', '.join(self.methods)}")

    def _run(self, method: str, seed: int) -> dict[str, Any]:
        for found in self._runs(method):
            if found["seed"] == seed:
                return found
        raise LookupError(f"{method} did not run with seed {seed}; it did with {self.seeds(method)}")

    def __repr__(self) -> str:
        return f"Comparison({str(self.folder)!r}: {', '.join(self.methods)})"

    def _repr_html_(self) -> str:
        # In a frame of its own: neither the page's styles nor the report's reach the other.
        report = html.escape(self.report.read_text(encoding="utf-8"), quote=True)
        return f'<iframe srcdoc="{report}" style="width: 100%; height: 40em; border: 0"></iframe>'
