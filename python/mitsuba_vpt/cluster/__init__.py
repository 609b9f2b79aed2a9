"""Sharing one render out to several machines.

The unit of work is a range of passes: each task is one ``vpt render --passes A..B`` and leaves a part, and
``vpt merge`` puts the parts together. In ``scalar_rgb`` with uniform shooting the picture is bit for bit that of one
machine. Who runs the tasks is submitit (`mitsuba_vpt.cluster.slurm`) or Dask (`mitsuba_vpt.cluster.dask`); a task that
dies with its worker costs its range, which is run again.
"""

from ._parts import Part, merge, render_part, share_out

__all__ = ["Part", "merge", "render_part", "share_out"]
