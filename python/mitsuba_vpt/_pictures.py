"""Pictures as arrays and as files."""

from __future__ import annotations

import base64
from pathlib import Path

import mitsuba
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float32]


def read(path: Path) -> Array:
    """The linear red, green and blue of an EXR file, as an array of rows, columns and channels."""
    bitmap = mitsuba.Bitmap(str(path))
    # Further channels, such as errors, are layers of their own.
    root = next((part for layer, part in bitmap.split() if layer in ("<root>", "root")), bitmap)
    rgb = root.convert(mitsuba.Bitmap.PixelFormat.RGB, mitsuba.Struct.Type.Float32, False)
    return np.array(rgb, dtype=np.float32)


def html_image(picture: Array, width: int) -> str:
    """A linear picture as an ``<img>`` element that needs no file."""
    rgb = np.ascontiguousarray(np.asarray(picture, dtype=np.float32)[..., :3])
    bitmap = mitsuba.Bitmap(rgb).convert(mitsuba.Bitmap.PixelFormat.RGB, mitsuba.Struct.Type.UInt8, True)
    stream = mitsuba.MemoryStream()
    bitmap.write(stream, mitsuba.Bitmap.FileFormat.PNG)
    data = base64.b64encode(stream.raw_buffer()).decode("ascii")
    return f'<img width="{width}" src="data:image/png;base64,{data}">'
