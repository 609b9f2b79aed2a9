"""Watching renders from Python."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Callable, Optional

import mitsuba

from . import _abi
from ._display import Monitor
from ._interrupt import Interrupts
from ._plugin import library
from ._state import Film, Progress

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
