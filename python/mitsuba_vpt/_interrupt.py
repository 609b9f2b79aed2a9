"""Ctrl-C while the plugin calls back into Python."""

from __future__ import annotations

import signal
import threading
from types import CodeType, FrameType


class Interrupts:
    """Keeps a Ctrl-C that Python notices within callbacks, whose exceptions would be lost in C, until the end.

    Mitsuba's own handler has asked the render to end by then. Elsewhere Ctrl-C does what it always does.
    """

    def __init__(self, callbacks: set[CodeType]) -> None:
        self._callbacks = callbacks
        #: Whether one was kept.
        self.kept = False
        self._former = signal.getsignal(signal.SIGINT)
        # Python has handlers on its main thread alone; those of other languages and none at all are left in peace.
        self._listens = callable(self._former) and threading.current_thread() is threading.main_thread()
        if self._listens:
            signal.signal(signal.SIGINT, self._handle)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        outer = frame
        while outer is not None:
            if outer.f_code in self._callbacks:
                self.kept = True
                return
            outer = outer.f_back
        self._hand_on(number, frame)

    def _hand_on(self, number: int, frame: FrameType | None) -> None:
        if callable(self._former):
            self._former(number, frame)

    def close(self) -> None:
        """Listens no more."""
        if self._listens:
            signal.signal(signal.SIGINT, self._former)

    def release(self) -> None:
        """Lets what was kept take effect."""
        if self.kept:
            self._hand_on(signal.SIGINT, None)
