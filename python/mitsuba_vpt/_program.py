"""The program ``vpt`` that lies in this package."""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Union

PROGRAM = Path(__file__).resolve().parent / "vpt"

PathLike = Union[str, "os.PathLike[str]"]


class ProgramError(RuntimeError):
    """``vpt`` could not do what it was asked to.

    ``exit_code`` is 1 where the work failed, 2 where the arguments or the scene must be mended, 130 where Ctrl-C
    aborted it.
    """

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        self.exit_code = exit_code

    def __reduce__(self) -> tuple[Any, ...]:
        return (type(self), (str(self), self.exit_code))


def environment() -> dict[str, str]:
    """This process's environment, in which the program finds the libraries of the Mitsuba that Python imports."""
    folders = []
    for package in ("mitsuba", "drjit"):
        spec = importlib.util.find_spec(package)
        if spec is not None and spec.origin is not None:
            folders.append(os.path.dirname(os.path.realpath(spec.origin)))
    given = os.environ.get("LD_LIBRARY_PATH")
    return {**os.environ, "LD_LIBRARY_PATH": ":".join(folders + ([given] if given else []))}


def run(arguments: Sequence[PathLike], *, quiet: bool = False) -> None:
    """Runs ``vpt`` with these arguments and waits for it; what it says goes to ``sys.stderr`` unless ``quiet``.

    Ctrl-C is handed on: the program then writes what was done, before ``KeyboardInterrupt`` is raised. A second one
    aborts it.
    """
    process = subprocess.Popen(
        [PROGRAM, *(os.fspath(argument) for argument in arguments)],
        env=environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="replace",
        # A terminal's Ctrl-C would reach the program twice, and the second one aborts.
        start_new_session=True,
    )
    with process:
        try:
            last = _hand_on(process, quiet)
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)
            try:
                _hand_on(process, quiet)
                process.wait()
            except KeyboardInterrupt:
                process.send_signal(signal.SIGINT)
            raise
    if process.returncode != 0:
        raise ProgramError(last.removeprefix("error: ") or f"vpt ended with {process.returncode}", process.returncode)


def _hand_on(process: subprocess.Popen[str], quiet: bool) -> str:
    """Prints what the process says; returns its last line."""
    last = ""
    for line in process.stderr or ():
        last = line.strip() or last
        if not quiet:
            sys.stderr.write(line)
    return last


def scene_arguments(
    scene: Any,
    *,
    defines: Mapping[str, Any] | None = None,
    settings: Mapping[str, Any] | None = None,
    variant: str | None = None,
    sensor: int = 0,
) -> list[str]:
    """The arguments that say which scene, and how it is read."""
    arguments = [str(scene_file(scene)), *_pairs("-D", defines), *_pairs("--set", settings)]
    arguments += ["--sensor", str(sensor)] + (["--variant", variant] if variant is not None else [])
    return arguments


def _pairs(option: str, values: Mapping[str, Any] | None) -> Iterator[str]:
    for name, value in (values or {}).items():
        yield option
        yield f"{name}={str(value).lower() if isinstance(value, bool) else value}"


def scene_file(scene: Any) -> Path:
    """The scene's file; scenes that have none are refused."""
    if isinstance(scene, dict):
        raise TypeError(
            "the scene is a dict, but the program vpt reads files: write it with `mi.parser.write_file("
            'mi.parser.parse_dict(mi.parser.ParserConfig(mi.variant()), scene), "scene.xml")` and give that path'
        )
    if not isinstance(scene, (str, os.PathLike)):
        raise TypeError(
            f"the scene is a {type(scene).__name__}, but the program vpt reads files: give the path of its XML"
        )
    return Path(scene)
