"""Write the small files that the agreement scenes load: textures, an environment, volumes, a lamp mesh.

Everything is a closed formula, so that running this again changes no byte of the volumes and meshes.

    python tests/agreement/make_assets.py
"""

import struct
from pathlib import Path

import mitsuba as mi
import numpy as np

ASSETS = Path(__file__).parent / "scenes" / "assets"


def write_image(name, pixels):
    mi.Bitmap(pixels).write(str(ASSETS / name))


def write_volume(name, values):
    """Mitsuba's .vol format, version 3, float32; `values` is indexed [z, y, x, channel]."""
    depth, height, width, channels = values.shape
    header = b"VOL" + struct.pack("<B5i6f", 3, 1, width, height, depth, channels, 0, 0, 0, 1, 1, 1)
    (ASSETS / name).write_bytes(header + values.astype("<f4").tobytes())


def cell_centres(resolution):
    """Coordinates x, y, z in (0, 1) of the cells of a cubic grid, each indexed [z, y, x]."""
    c = (np.arange(resolution) + 0.5) / resolution
    z, y, x = np.meshgrid(c, c, c, indexing="ij")
    return x, y, z


def textures():
    y, x = np.mgrid[0:8, 0:8]
    colours = np.stack([60 + 24 * x, 220 - 20 * y, 80 + 12 * (x + y)], axis=-1)
    write_image("colours.png", colours.astype(np.uint8))

    slide = np.where(((x // 2 + y // 2) % 2)[..., None] == 0, [230, 180, 90], [60, 110, 200])
    write_image("slide.png", slide.astype(np.uint8))

    y, x = (np.mgrid[0:32, 0:32] + 0.5) / 32
    height = 0.5 + 0.25 * (np.sin(2 * np.pi * 2 * x) + np.sin(2 * np.pi * 2 * y))
    write_image("bumps.png", np.round(255 * height).astype(np.uint8))

    tilt = np.stack([0.2 * np.sin(2 * np.pi * 3 * x), 0.2 * np.sin(2 * np.pi * 3 * y), np.ones_like(x)], axis=-1)
    normal = tilt / np.linalg.norm(tilt, axis=-1, keepdims=True)
    write_image("normals.png", np.round(255 * (0.5 + 0.5 * normal)).astype(np.uint8))


def environment():
    """A sky, brighter above, with one broad warm lobe: nothing small, so that any sampler finds it."""
    y, x = np.mgrid[0:16, 0:32]
    up = np.cos(np.pi * (y + 0.5) / 16)
    lobe = np.exp(-(((x - 9) / 4.0) ** 2) - ((y - 5) / 2.5) ** 2)
    sky = 0.35 + 0.25 * up
    pixels = np.stack([sky + 2.4 * lobe, sky + 1.8 * lobe, 1.3 * sky + 1.0 * lobe], axis=-1)
    write_image("sky.exr", pixels.astype(np.float32))


def volumes():
    x, y, z = cell_centres(8)
    radius2 = (x - 0.5) ** 2 + (y - 0.5) ** 2 + (z - 0.5) ** 2
    smoke = np.exp(-8 * radius2) * (1 + 0.6 * np.sin(5 * x + 3 * y) * np.cos(4 * z))
    write_volume("smoke.vol", (smoke / smoke.max())[..., None])

    x, y, z = cell_centres(4)
    write_volume("albedo.vol", np.stack([0.95 - 0.6 * x, 0.4 + 0.5 * y, 0.9 - 0.5 * z], axis=-1))

    # SGGX matrices Sxx, Syy, Szz, Sxy, Sxz, Syz of fibres along u (S = I + (0.15 - 1) u u^T: small area seen along
    # the fibre) that turn by a quarter from the bottom of the grid to its top. No eigenvalue exceeds 1.
    x, y, z = cell_centres(4)
    angle = 0.5 * np.pi * y
    ux, uz = np.cos(angle), np.sin(angle)
    squash = 0.15 - 1
    fibres = [1 + squash * ux * ux, np.ones_like(x), 1 + squash * uz * uz, np.zeros_like(x), squash * ux * uz, np.zeros_like(x)]
    write_volume("fibres.vol", np.stack(fibres, axis=-1))


def lamp_mesh():
    """An octahedron without vertex normals, its faces counter-clockwise seen from outside."""
    vertices = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    faces = [(1, 3, 5), (3, 2, 5), (2, 4, 5), (4, 1, 5), (3, 1, 6), (2, 3, 6), (4, 2, 6), (1, 4, 6)]
    lines = ["v %d %d %d" % v for v in vertices] + ["f %d %d %d" % f for f in faces]
    (ASSETS / "octahedron.obj").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    mi.set_variant("scalar_rgb")
    ASSETS.mkdir(parents=True, exist_ok=True)
    textures()
    environment()
    volumes()
    lamp_mesh()
