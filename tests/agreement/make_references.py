"""Render the references that `tests/agreement.rs` judges against.

For every scene the integrator that the scene names by default renders one image per seed. The images are independent,
so their mean is the reference and their sample variance divided by their number is the variance *of that mean*. Seeds
are added in steps until the targets below are met. What is written depends on the seeds alone (and on the last bits
of the machine's arithmetic).

    python tests/agreement/make_references.py                 what is missing or older than its scene
    python tests/agreement/make_references.py --only beam     these scenes, even where they are up to date
    python tests/agreement/make_references.py --check         render nothing, fail where a scene has changed
    python tests/agreement/make_references.py --variant llvm_ad_spectral
                                                              those of the scenes that are judged in spectral variants

A scene NAME.xml that Mitsuba's path tracers cannot render has a twin NAME.reference.xml with the same image.
Needs mitsuba 3.9.1 and a libLLVM that Dr.Jit can use (see DRJIT_LIBLLVM_PATH).
"""

import argparse
import hashlib
import json
import re
import sys
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
SCENES = HERE / "scenes"

# Where the references of a variant lie, and of which scenes there are any; None for all. Spectral ones serve `scalar_spectral`, too.
VARIANTS = {
    "llvm_ad_rgb": ("references", None),
    "llvm_ad_spectral": (
        "references/spectral",
        [
            "box_constant",
            "box_directional",
            "extinction_box",
            "glass_ball",
            "instances_sunsky",
            "layers_envmap",
            "projector_crop",
            "textures_point_spot",
        ],
    ),
    "llvm_ad_mono": ("references/mono", ["extinction_box", "glass_ball", "projector_crop"]),
}
SPP = 256
FIRST_SEEDS = 16
MORE_SEEDS = 8
MOST_SEEDS = 256

# Standard errors to reach, relative: of the mean of the whole image, and of each block of 8 x 8 pixels. A block that is
# darker than DARK times the image's mean is measured against that instead, as the test does.
IMAGE_TARGET = 0.0005
BLOCK_TARGET = 0.004
BLOCK = 8
DARK = 0.1


def scene_names(variant="llvm_ad_rgb"):
    chosen = VARIANTS[variant][1]
    names = sorted(p.stem for p in SCENES.glob("*.xml") if not p.stem.endswith(".reference"))
    return [name for name in names if chosen is None or name in chosen]


def reference_source(name):
    twin = SCENES / f"{name}.reference.xml"
    return twin if twin.exists() else SCENES / f"{name}.xml"


def fingerprint(name):
    """A hash of all that the image depends on: the scene, its twin, and the assets that they load."""
    texts = [p.read_text() for p in (SCENES / f"{name}.xml", SCENES / f"{name}.reference.xml") if p.exists()]
    assets = sorted(set(re.findall(r"assets/[\w.]+", "".join(texts))))
    digest = hashlib.sha256("".join(texts).encode())
    for asset in assets:
        digest.update((SCENES / asset).read_bytes())
    return digest.hexdigest()[:16]


def default_integrator(source):
    return re.search(r'<default name="integrator" value="(\w+)"', source.read_text()).group(1)


class Moments:
    """Sum and sum of squares of the images, one per seed, in double precision."""

    def __init__(self):
        self.count, self.sum, self.squares = 0, 0.0, 0.0

    def add(self, image):
        image = image.astype(np.float64)
        self.count += 1
        self.sum = self.sum + image
        self.squares = self.squares + image * image

    def mean(self):
        return self.sum / self.count

    def variance_of_mean(self):
        spread = np.maximum(self.squares - self.sum * self.sum / self.count, 0)
        return spread / (self.count - 1) / self.count


def blocks(image):
    height, width, channels = image.shape
    return image.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, channels).mean(axis=(1, 3))


def relative_errors(mean, variance):
    """Standard error of the image's mean and the largest of its blocks, both relative, the worst colour of each."""
    level = mean.mean(axis=(0, 1))
    image = np.sqrt(variance.mean(axis=(0, 1)) / (mean.shape[0] * mean.shape[1])) / level
    block = np.sqrt(blocks(variance) / BLOCK**2) / np.maximum(blocks(mean), DARK * level)
    return float(image.max()), float(block.max())


def round_mantissa(values, bits):
    """Keep `bits` of the mantissa. The rest is noise, and noise does not compress."""
    mantissa, exponent = np.frexp(values)
    return np.ldexp(np.round(np.ldexp(mantissa, bits)), exponent - bits)


def write_reference(mi, path, mean, variance):
    channels = np.concatenate([round_mantissa(mean, 15), round_mantissa(variance, 8)], axis=2).astype(np.float32)
    names = ["R", "G", "B", "var.R", "var.G", "var.B"]
    mi.Bitmap(channels, mi.Bitmap.PixelFormat.MultiChannel, names).write(str(path))


def render_reference(mi, name, folder):
    source = reference_source(name)
    scene = mi.load_file(str(source))
    start = time.perf_counter()
    moments = Moments()
    errors = None
    while errors is None or (errors[0] > IMAGE_TARGET or errors[1] > BLOCK_TARGET) and moments.count < MOST_SEEDS:
        for _ in range(FIRST_SEEDS if errors is None else MORE_SEEDS):
            image = np.array(mi.render(scene, spp=SPP, seed=moments.count))
            moments.add(np.repeat(image, 3 // image.shape[2], axis=2))
        errors = relative_errors(moments.mean(), moments.variance_of_mean())
    write_reference(mi, folder / f"{name}.exr", moments.mean(), moments.variance_of_mean())
    return {
        "scene": source.name,
        "integrator": default_integrator(source),
        "variant": mi.variant(),
        "mitsuba": mi.__version__,
        "spp": SPP,
        "seeds": moments.count,
        "seconds": round(time.perf_counter() - start, 1),
        "image_error": float(f"{errors[0]:.2e}"),
        "worst_block_error": float(f"{errors[1]:.2e}"),
        "fingerprint": fingerprint(name),
    }


def folder_of(variant):
    return HERE / VARIANTS[variant][0]


def index_of(variant):
    path = folder_of(variant) / "references.json"
    index = json.loads(path.read_text()) if path.exists() else {}
    return {name: entry for name, entry in index.items() if name in scene_names(variant)}


def stale_names(variant):
    index, folder = index_of(variant), folder_of(variant)
    return [
        name
        for name in scene_names(variant)
        if index.get(name, {}).get("fingerprint") != fingerprint(name) or not (folder / f"{name}.exr").exists()
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--only", nargs="+", metavar="NAME", default=[], choices=scene_names())
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--variant", choices=VARIANTS, default="llvm_ad_rgb")
    args = parser.parse_args()

    if args.check:
        stale = [f"{name} ({variant})" for variant in VARIANTS for name in stale_names(variant)]
        if stale:
            sys.exit("references older than their scenes: " + ", ".join(stale))
        return

    import mitsuba as mi

    mi.set_variant(args.variant)
    mi.set_log_level(mi.LogLevel.Error)
    folder, index = folder_of(args.variant), index_of(args.variant)
    folder.mkdir(parents=True, exist_ok=True)
    for name in args.only or stale_names(args.variant):
        index[name] = render_reference(mi, name, folder)
        (folder / "references.json").write_text(json.dumps(dict(sorted(index.items())), indent=2) + "\n")
        entry = index[name]
        print(
            f"{name:20} {entry['integrator']:10} {entry['seeds']:4} seeds {entry['seconds']:7.1f} s"
            f"   image {100 * entry['image_error']:.3f} %   worst block {100 * entry['worst_block_error']:.2f} %",
            flush=True,
        )


if __name__ == "__main__":
    main()
