#!/usr/bin/env python3
"""Writes smoke.vol (density) and smoke_albedo.vol (colour) next to this file.

Needs numpy and nothing else. No random state: the noise comes from an integer hash, so every run writes the same bytes.

    python make_smoke.py            write the two files
    python make_smoke.py --check    write nothing, exit 1 if the files differ from what would be written

The grids span the unit cube [0, 1]^3 (x, y up, z); scene.xml stretches them to the size of the smoke's bounding box.
"""

import pathlib
import struct
import sys

import numpy as np

SEED = 7
DENSITY_CELLS = (48, 64, 48)  # x, y (up), z
ALBEDO_CELLS = (16, 24, 16)
HERE = pathlib.Path(__file__).resolve().parent


def lattice(ix, iy, iz, seed):
    """A number in [-1, 1] for every lattice point: three rounds of an integer hash."""
    h = ix.astype(np.uint64) * 0x9E3779B1 + iy.astype(np.uint64) * 0x85EBCA77 + iz.astype(np.uint64) * 0xC2B2AE3D
    h = (h + np.uint64(seed * 0x27D4EB2F)) & np.uint64(0xFFFFFFFF)
    for multiplier in (0x7FEB352D, 0x846CA68B, 0x9E3779B1):
        h = ((h ^ (h >> np.uint64(16))) * np.uint64(multiplier)) & np.uint64(0xFFFFFFFF)
    return h.astype(np.float64) / 0x7FFFFFFF - 1.0


def noise(p, seed):
    """Value noise in [-1, 1], smooth to second order. p: (..., 3)."""
    cell = np.floor(p)
    f = p - cell
    f = f * f * f * (f * (f * 6.0 - 15.0) + 10.0)
    cell = cell.astype(np.int64) + 4096  # keep the hash's input positive
    total = 0.0
    for corner in range(8):
        d = np.array([corner & 1, corner >> 1 & 1, corner >> 2])
        weight = np.prod(np.where(d, f, 1.0 - f), axis=-1)
        total = total + weight * lattice(*np.moveaxis(cell + d, -1, 0), seed)
    return total


def fractal(p, octaves, seed):
    """Sum of noise octaves, each twice as fine and about half as strong."""
    return sum(noise(p * 2.03**k, seed + k) * 0.52**k for k in range(octaves))


def curl(p, seed, h=0.05):
    """Curl of a vector potential made of noise: a flow without sources, so it swirls and does not clump."""

    def potential(axis, q):
        return fractal(q, 2, seed + 17 * axis)

    def slope(axis, along):
        step = np.zeros(3)
        step[along] = h
        return (potential(axis, p + step) - potential(axis, p - step)) / (2.0 * h)

    return np.stack([slope(2, 1) - slope(1, 2), slope(0, 2) - slope(2, 0), slope(1, 0) - slope(0, 1)], axis=-1)


def cell_centres(cells):
    """World-like coordinates of the cell centres, shape (z, y, x, 3): x and z in [-0.75, 0.75], y in [0, 2]."""
    nx, ny, nz = cells
    x = (np.arange(nx) + 0.5) / nx * 1.5 - 0.75
    y = (np.arange(ny) + 0.5) / ny * 2.0
    z = (np.arange(nz) + 0.5) / nz * 1.5 - 0.75
    zz, yy, xx = np.meshgrid(z, y, x, indexing="ij")
    return np.stack([xx, yy, zz], axis=-1)


def smoothstep(lo, hi, v):
    t = np.clip((v - lo) / (hi - lo), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def density(cells):
    """A plume: narrow at its foot, wide and torn at its head. Values in [0, 1], 0 on the border of the grid."""
    p = cell_centres(cells)
    y = p[..., 1]
    # Walk every point back along the swirling flow; the higher up, the further it was carried.
    q = p.copy()
    for _ in range(4):
        carried = 0.045 * smoothstep(0.05, 1.2, q[..., 1])[..., None]
        q = q - carried * curl(q * 1.9, SEED)
    # The plume's axis leans and wobbles, its radius grows with height.
    height = np.clip(q[..., 1], 0.0, None)
    axis_x = 0.13 * np.sin(2.6 * height) * height + 0.03 * height
    axis_z = 0.10 * np.sin(2.1 * height + 1.0) * height - 0.08 * height
    radius = 0.07 + 0.20 * height**0.9
    distance = np.hypot(q[..., 0] - axis_x, q[..., 2] - axis_z) / radius
    # Fractal noise eats into the edge of the plume.
    torn = distance + 0.75 * fractal(q * np.array([4.2, 3.2, 4.2]), 4, SEED + 100) * smoothstep(0.0, 0.5, height)
    body = 1.0 - smoothstep(0.35, 1.05, torn)
    thinning = 1.0 / (1.0 + 0.9 * height)  # it spreads, so it gets thinner
    fade = smoothstep(0.0, 0.06, y) * (1.0 - smoothstep(1.45, 1.9, y + 0.15 * fractal(p * 3.0, 3, SEED + 200)))
    wall = smoothstep(0.0, 0.14, 0.75 - np.abs(p[..., 0])) * smoothstep(0.0, 0.14, 0.75 - np.abs(p[..., 2]))
    rho = body * thinning * fade * wall
    for face in (np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1], np.s_[:, :, 0], np.s_[:, :, -1]):
        rho[face] = 0.0
    return rho / rho.max()


def albedo(cells):
    """Single-scattering albedo (r, g, b): warm near the foot, cool at the head, with streaks of both."""
    p = cell_centres(cells)
    warm, cool = np.array([0.97, 0.80, 0.62]), np.array([0.70, 0.84, 0.97])
    mix = smoothstep(0.25, 1.5, p[..., 1] + 0.7 * fractal(p * 2.2, 2, SEED + 300))[..., None]
    return warm * (1.0 - mix) + cool * mix


def vol_bytes(grid):
    """Mitsuba's .vol format, version 3: header, then float32 values with x running fastest."""
    nz, ny, nx = grid.shape[:3]
    channels = grid.shape[3] if grid.ndim == 4 else 1
    header = b"VOL" + struct.pack("<B5i6f", 3, 1, nx, ny, nz, channels, 0, 0, 0, 1, 1, 1)
    # Rounded to 1/1024, so that the last bits of another machine's sin() do not change the file.
    return header + (np.round(grid * 1024.0) / 1024.0).astype("<f4").tobytes()


def main():
    files = {"smoke.vol": vol_bytes(density(DENSITY_CELLS)), "smoke_albedo.vol": vol_bytes(albedo(ALBEDO_CELLS))}
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
