#!/usr/bin/env python3
"""Writes tiles.png (floor colour) and sky.pfm (environment map) next to this file.

Needs numpy and nothing else; no randomness, so every run writes the same bytes.

    python make_textures.py            write the two files
    python make_textures.py --check    write nothing, exit 1 if the files differ from what would be written
"""

import pathlib
import struct
import sys
import zlib

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
TILES = 96  # pixels along one side of the tile pattern
SKY = (64, 32)  # width, height of the latitude-longitude map


def tiles():
    """Two by two tiles with joints between them and a round inlay in each, as 8-bit sRGB."""
    u = (np.arange(TILES) + 0.5) / TILES * 2.0
    x, y = np.meshgrid(u, u)
    column, row = x.astype(int), y.astype(int)
    dx, dy = x - column - 0.5, y - row - 0.5
    light, dark = np.array([205, 196, 180]), np.array([74, 98, 112])
    odd = ((column + row) % 2 == 1)[..., None]
    colour = np.where(odd, dark, light)
    inlay = (np.hypot(dx, dy) < 0.2)[..., None]
    colour = np.where(inlay, np.where(odd, np.array([190, 140, 70]), np.array([150, 60, 45])), colour)
    joint = (np.maximum(np.abs(dx), np.abs(dy)) > 0.47)[..., None]
    return np.where(joint, np.array([120, 115, 110]), colour).astype(np.uint8)


def sky():
    """A dim evening sky: blue above, a warm band along the horizon, grey ground, one soft bright window of cloud."""
    width, height = SKY
    theta = (np.arange(height) + 0.5) / height * np.pi  # 0 is straight up
    phi = (np.arange(width) + 0.5) / width * 2.0 * np.pi
    elevation = (np.pi / 2.0 - theta)[:, None, None]
    zenith, horizon, ground = np.array([0.10, 0.17, 0.33]), np.array([0.55, 0.36, 0.24]), np.array([0.10, 0.09, 0.08])
    above = np.exp(-4.0 * np.clip(elevation, 0.0, None))
    upper = zenith * (1.0 - above) + horizon * above
    below = np.exp(8.0 * np.clip(elevation, None, 0.0))
    colour = np.where(elevation >= 0.0, upper, ground * (1.0 - below) + horizon * below)
    colour = np.broadcast_to(colour, (height, width, 3)).copy()
    turn = (phi[None, :] - 0.2 * np.pi + np.pi) % (2.0 * np.pi) - np.pi
    cloud = np.exp(-((turn / 0.35) ** 2) - ((theta[:, None] - 0.30 * np.pi) / 0.22) ** 2)
    return colour + cloud[..., None] * np.array([1.9, 1.7, 1.5])


def png_bytes(image):
    """8-bit RGB PNG. Stored, not compressed: the bytes then do not depend on the version of zlib."""
    height, width = image.shape[:2]

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + row.tobytes() for row in image)
    header = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 0)) + chunk(b"IEND", b"")


def pfm_bytes(image):
    """Colour PFM: little endian, rows from bottom to top. Rounded to 1/4096 so that every machine writes the same."""
    height, width = image.shape[:2]
    data = (np.round(image * 4096.0) / 4096.0).astype("<f4")[::-1]
    return f"PF\n{width} {height}\n-1.0\n".encode() + data.tobytes()


def main():
    files = {"tiles.png": png_bytes(tiles()), "sky.pfm": pfm_bytes(sky())}
    if "--check" in sys.argv[1:]:
        stale = [name for name, data in files.items() if (HERE / name).read_bytes() != data]
        print("stale: " + ", ".join(stale) if stale else "up to date")
        return 1 if stale else 0
    for name, data in files.items():
        (HERE / name).write_bytes(data)
        print(f"{name}: {len(data)} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
