"""Showing how far a render is: a line in a terminal, a bar in a notebook."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Any

from ._pictures import html_image

if TYPE_CHECKING:
    from ._state import Progress

#: Seconds between two lines where no terminal rewrites them.
SLOWLY = 10.0


class Monitor:
    """A progress callback that shows progress where it was made: ``render(scene, progress=Monitor(picture=True))``.

    ``picture`` shows the picture so far, too (in notebooks alone), ``every`` is the time between two updates [s],
    ``width`` that of the picture on the page [pixels].
    """

    def __init__(self, *, picture: bool = False, every: float = 0.5, width: int = 400) -> None:
        self.picture = picture
        self.every = every
        self.width = width
        self._text = "no pass is done yet"
        self._share = 0.0
        self._image = ""
        self._shown_at = -float("inf")
        self._is_shown = True
        self._handle: Any = None
        self._notebook = _in_notebook()

    def __call__(self, progress: Progress) -> None:
        """Shows it, unless something was just shown."""
        self._text = describe(progress)
        self._share = progress.passes_done / progress.passes
        self._is_shown = False
        over = progress.passes_done >= progress.passes
        by_line = not self._notebook and not sys.stderr.isatty()
        if not over and time.monotonic() - self._shown_at < (max(self.every, SLOWLY) if by_line else self.every):
            return
        if self._notebook and self.picture:
            self._image = html_image(progress.image(), self.width)
        self._show()
        self._shown_at = time.monotonic()

    def end(self) -> None:
        """Shows the last pass of a render that ended early, and ends the line."""
        if not self._is_shown:
            self._show()
        if not self._notebook and sys.stderr.isatty():
            sys.stderr.write("\n")

    def _show(self) -> None:
        self._is_shown = True
        if self._notebook:
            self._update_notebook()
            return
        start, end = ("\r\x1b[K", "") if sys.stderr.isatty() else ("", "\n")
        sys.stderr.write(f"{start}vpt: {self._text}{end}")
        sys.stderr.flush()

    def _update_notebook(self) -> None:
        from IPython.display import display  # noqa: PLC0415 - optional, and there in a notebook

        if self._handle is None:
            self._handle = display(self, display_id=True)
        else:
            self._handle.update(self)

    def _repr_html_(self) -> str:
        bar = f'<progress max="1" value="{self._share:.4f}"></progress>'
        return f"<div>{bar} {self._text}</div>{self._image}"

    def __repr__(self) -> str:
        return f"Monitor({self._text})"


def describe(progress: Progress) -> str:
    """One line for people."""
    off = "" if progress.error is None else f", about {100 * progress.error:.2g} % off"
    return f"pass {progress.passes_done} of {progress.passes}, {progress.seconds:.1f} s{off}"


def _in_notebook() -> bool:
    ipython: Any | None = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and hasattr(shell, "kernel")
