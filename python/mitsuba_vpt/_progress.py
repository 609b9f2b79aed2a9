"""Watching renders from Python."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Callable, Optional

import mitsuba
import numpy as np

from . import _abi
from ._display import Monitor
from ._interrupt import Interrupts
from ._pictures import Array
from ._plugin import library


class Film:
    """The film of a render that stands still while its callback runs."""

    def __init__(self, raw: _abi.Progress) -> None:
        self._raw: _abi.Progress | None = raw
        self._thread = threading.get_ident()

    def close(self) -> None:
        """The render goes on."""
        self._raw = None

    def image(self) -> Array:
        """The picture, as Mitsuba develops it but for the last bit."""
        raw = self._raw
        if raw is None or self._thread != threading.get_ident():
            raise RuntimeError("the picture so far is there during the callback alone, on its thread: ask for it there")
        width, height = raw.film_size
        sums = np.empty((height, width, raw.film_channels), dtype=np.float64)
        error = ctypes.create_string_buffer(1024)
        storage = sums.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
        read_film: Any = raw.read_film
        if read_film(raw.film, storage, sums.size, error, len(error)) != 0:
            raise RuntimeError(f"vpt: {error.value.decode(errors='replace')}")
        values, weight = sums[..., :3].astype(np.float32), sums[..., -1:].astype(np.float32)
        return np.divide(values, weight, out=np.zeros_like(values), where=weight != 0)


@dataclass(frozen=True)
class Progress:
    """How far a render is after a pass."""

    #: Passes done, at least 1.
    passes_done: int
    #: Passes asked for.
    passes: int
    #: Wall time since the render began [s].
    seconds: float
    #: Estimated relative error of the picture so far (0.01 is 1 %); None while nothing is known.
    error: float | None
    #: Its two parts: what further passes average out, and what narrower kernels take away.
    noise: float | None
    bias: float | None
    #: Photon walks so far.
    walks: int
    #: Radii of the next pass, in the scene's unit of length.
    surface_radius: float
    medium_radius: float
    _film: Film = field(repr=False, compare=False)

    def image(self) -> Array:
        """The linear picture so far: rows, columns, and red, green and blue. To be asked for within the callback.

        It costs time, about that of splatting a jitter, and only if it is asked for.
        """
        return self._film.image()

    @classmethod
    def _read(cls, raw: _abi.Progress, film: Film) -> Progress:
        known = raw.error.jitters > 0
        return cls(
            passes_done=raw.passes_done,
            passes=raw.passes,
            seconds=raw.seconds,
            error=raw.error.relative if known else None,
            noise=raw.error.noise if known else None,
            bias=raw.error.bias if known else None,
            walks=raw.walks,
            surface_radius=raw.surface_radius,
            medium_radius=raw.medium_radius,
            _film=film,
        )


#: Called after each pass; a result of ``False`` ends the render there.
Callback = Callable[[Progress], Optional[bool]]


class _Watcher:
    """An observer of the plugin that hands on to a callback."""

    def __init__(self, callback: Callback) -> None:
        self.callback = callback
        self.interrupts = Interrupts({function.__code__ for function in (self._progress, self._finished, self._warn)})
        #: What the callback raised.
        self.error: BaseException | None = None
        # ctypes frees what nobody holds, so these live here.
        self.table = _abi.Observer(
            None,
            _abi.ProgressFunction(self._progress),
            _abi.FinishedFunction(self._finished),
            _abi.WarnFunction(self._warn),
        )

    def _progress(self, context: int, raw: Any) -> int:
        if self.error is not None or self.interrupts.kept:
            return 1
        # Before the first pass there is no picture that the render could end with.
        if raw.contents.passes_done == 0:
            return 0
        film = Film(raw.contents)
        try:
            return 1 if self.callback(Progress._read(raw.contents, film)) is False else 0
        except BaseException as error:  # nothing may pass through the plugin
            self.error = error
            return 1
        finally:
            film.close()

    @staticmethod
    def _finished(context: int, stats: int) -> None:
        """The caller gets the picture by then."""

    @staticmethod
    def _warn(context: int, message: bytes) -> None:
        log: Any = mitsuba.Log
        log(mitsuba.LogLevel.Warn, f"vpt: {message.decode(errors='replace')}")


@contextmanager
def observe(callback: Callback) -> Iterator[None]:
    """Calls back after each pass of every ``vpt`` render that this thread starts within the block.

    Mitsuba's own progress bar is silent meanwhile. The callback may run on another thread while this one waits. What it
    raises ends the render and is raised again at the end of the block.
    """
    watcher = _Watcher(callback)
    former = library().vpt_watch(ctypes.addressof(watcher.table))
    try:
        yield
    finally:
        library().vpt_watch(former)
        watcher.interrupts.close()
        if isinstance(callback, Monitor):
            callback.end()
    if watcher.error is not None:
        raise watcher.error
    watcher.interrupts.release()


def render(scene: Any, *, progress: Callback | bool | None = None, **arguments: Any) -> Any:
    """``mitsuba.render(scene, **arguments)`` with a callback after each pass.

    ``progress=True`` shows the progress, inline in a notebook; see `Monitor`. A callback gets a `Progress` and ends the
    render by returning ``False``; the picture of the passes done is returned.
    """
    if progress is None or progress is False:
        return mitsuba.render(scene, **arguments)
    integrator = arguments.get("integrator") or scene.integrator()
    if integrator is None or integrator.class_name() != "VptIntegrator":
        found = "none" if integrator is None else integrator.class_name()
        raise TypeError(
            f"progress is told by the integrator vpt, but the scene's integrator is {found}; "
            'give integrator=mi.load_dict({"type": "vpt"}), or leave progress out'
        )
    with observe(Monitor() if progress is True else progress):
        return mitsuba.render(scene, **arguments)
