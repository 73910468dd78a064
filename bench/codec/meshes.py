# SPDX-License-Identifier: GPL-3.0-or-later
"""The meshes that the codec is measured on, and how to get at each: from a folder, out of Debian, or made here."""

import dataclasses
import gzip
import pathlib
import shutil
import subprocess

from plate import Plate

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIST, TOPOLOGY, OTHERS = "the list", "high genus or many components", "others"
SCANS = ("armadillo", "bunny00", "diplodocus", "nefertiti", "venus-original", "dragon")
# name: file in the folder of meshes; None: out of Debian's package libcgal-demo.
_LIST = {"dino": "dino.off", "fandisk": "fandisk.off", "armadillo": "armadillo.off", "bunny00": "bunny00.off",
         "diplodocus": "diplodocus.off", "horse": "horse.ply", "nefertiti": "nefertiti.obj",
         "venus-original": "venus-original.off", "rocker-arm": "rocker-arm.obj", "fertility": "fertility.off",
         "femur": "femur.off", "screwdriver": "screwdriver.ply", "spot": "spot.obj", "dragon": "dragon_vrip.ply.gz",
         "camel": None, "man": None, "turbine": None, "refined_elephant": None, "knot1": None}
_TOPOLOGY = {"1002_tray_bottom": "1002_tray_bottom.STL", "bones": "bones.off"}
PLATE = "plate200"


class MeshError(Exception):
    """A mesh that is not where it should be."""


@dataclasses.dataclass(frozen=True)
class Mesh:
    name: str
    group: str
    path: pathlib.Path | None  # None: out of Debian, or made

    def prepare(self, scratch):
        """Its file, fetched, made or unpacked into `scratch` if need be."""
        if self.path is None and self.name == PLATE:
            made = scratch / f"{PLATE}.ply"
            made.write_bytes(Plate().ply())
            return made
        if self.path is None:
            subprocess.run([ROOT / "scripts" / "debian-meshes", scratch, self.name], check=True)
            return scratch / f"{self.name}.off"
        if self.path.suffix != ".gz":
            return self.path
        plain = scratch / self.path.stem
        with gzip.open(self.path) as packed, open(plain, "wb") as file:
            shutil.copyfileobj(packed, file)
        return plain


def choose(names, folder):
    """The meshes of these names, or all. A name is one of the list, a file's in the folder, or a path."""
    known = {name: LIST for name in _LIST} | {name: TOPOLOGY for name in (*_TOPOLOGY, PLATE)}
    files = _LIST | _TOPOLOGY
    return [_find(name, known, files, folder) for name in names or known]


def _find(name, known, files, folder):
    in_folder = pathlib.Path(folder) if folder else None
    stem = next((each for each, file in files.items() if file == name), name)
    if stem in known:
        file = files.get(stem)
        if file is None:
            return Mesh(stem, known[stem], None)
        if in_folder is None:
            raise MeshError(f"{stem} lies in the folder of meshes: give --meshes DIR or set PMCD_TEST_MESHES")
        path = in_folder / file
    else:
        stem, path = pathlib.Path(name).name.removesuffix(".gz").rpartition(".")[0], pathlib.Path(name)
        if in_folder is not None and not path.is_file():
            path = in_folder / name
    if not path.is_file():
        raise MeshError(f"there is no {path}")
    return Mesh(stem, known.get(stem, OTHERS), path)
