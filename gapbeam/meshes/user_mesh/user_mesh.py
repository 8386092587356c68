"""A user's own mesh, read from a .msh file and distributed."""

from __future__ import annotations

import os
import subprocess
import sys
from os import PathLike
from pathlib import Path

import numpy as np
from mpi4py import MPI

from gapbeam.meshes.beam_geometry import BODY, ENDS, BeamGeometry
from gapbeam.meshes.distributed_mesh import mesh_from_gmsh
from gapbeam.meshes.gmsh_model import gmsh_errors, gmsh_session
from gapbeam.meshes.mesh_errors import MeshError
from gapbeam.meshes.rank_zero import on_rank_zero
from gapbeam.meshes.tagged_mesh import TaggedMesh, mean_section
from gapbeam.meshes.user_mesh.frame_check import TOLERANCE, check_frame


def read_mesh(comm: MPI.Comm, path: str | PathLike[str], geometry: BeamGeometry) -> TaggedMesh:
    """Read, check and distribute a mesh saved by gmsh, with named physical groups.

    Groups: body (all cells), those of the spans (facets of the supports); optionally end (x = 0) and tip
    (x = length). Others are ignored. Cells of one type, order 1 or 2. Coordinates in m, in the beam frame.

    Args:
        comm: Communicator over which the mesh is distributed.
        path: The .msh file; only rank 0 reads it.
        geometry: Dimensions that the mesh has to agree with; its points are not looked at.

    Returns:
        Mesh with the facet groups of the spans, and end and tip when the file has them.

    Raises:
        MeshError: the file cannot be read, groups or elements are missing or unsuitable, or the
            mesh is not the beam of the geometry; on all ranks.

    Collective.
    """
    with gmsh_session(comm):
        groups = on_rank_zero(comm, lambda: _load(Path(path), geometry))
        mesh, _, facets = mesh_from_gmsh(comm, geometry.dimension, lambda: _end(geometry.dimension, groups))
    tagged = TaggedMesh(mesh, facets, groups)
    _check_volume(f"mesh file {path}, group {BODY}", tagged)
    return tagged


def _end(dimension: int, groups: dict[str, int]) -> float:
    """Return the end of the last support, m; on rank 0."""
    from gapbeam.meshes.distributed_mesh import end_of

    return end_of(dimension, groups, tuple(name for name in groups if name not in ENDS))


def _check_volume(where: str, tagged: TaggedMesh) -> None:
    """The cells together are no larger than the box around them. Collective."""
    volume, box = mean_section(tagged, 1.0).volume, float(np.prod(np.subtract(tagged.upper, tagged.lower)))
    if volume > box * (1.0 + TOLERANCE):
        unit = f"m^{tagged.dimension}"
        raise MeshError(
            where,
            found=f"cells of {volume:.4g} {unit} in a box of {box:.4g} {unit}",
            expected="a body that fills every place once",
            hint="Parts overlap, or a part is in the file twice.",
        )


def _load(path: Path, geometry: BeamGeometry) -> dict[str, int]:
    """Load the file into the current gmsh model and check it; returns the tags of its facet groups."""
    import gmsh

    from gapbeam.meshes.user_mesh.frame_check import check_facing
    from gapbeam.meshes.user_mesh.mesh_check import check_elements, check_groups, check_surface

    where = f"mesh file {path}"
    load_msh(path)
    with gmsh_errors(where, "a mesh that can be used"):
        groups = check_groups(where, geometry)
        nodes, facets = check_elements(where, geometry.dimension, groups)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        points = np.empty((len(tags), 3))
        points[tags.astype(np.int64) - 1] = coordinates.reshape(-1, 3)
        used = {name: points[np.unique(rows)] for name, rows in nodes.items()}
        check_frame(where, geometry, used, used[BODY])
        check_surface(f"{where}, group {BODY}", geometry.dimension, nodes[BODY], facets, points)
        check_facing(where, geometry, nodes, facets, points)
    return {name: tag for name, tag in groups.items() if name != BODY}


_EXPECTED = "a mesh saved by gmsh (.msh, version 2.2 or 4)"

_SECONDS = 20.0
_SECONDS_PER_BYTE = 2e-6
_MEMORY = 8 * 2**30
_MEMORY_PER_BYTE = 200
_REFUSED = 3
_NO_GMSH = 4

_REHEARSAL = """
import sys
try:
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[2]), int(sys.argv[2])))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
except (ImportError, ValueError, OSError):
    pass
try:
    import gmsh
except (ImportError, OSError):
    sys.exit(4)
gmsh.initialize(readConfigFiles=False, interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.add("rehearsal")
try:
    gmsh.merge(sys.argv[1])
except Exception as error:
    print(error, end="")
    sys.exit(3)
"""


def load_msh(path: Path) -> None:
    """Merge a .msh file into the current gmsh model. On rank 0.

    gmsh takes any text for a script of its own and runs it, and a damaged mesh can make it crash or read
    without end. So the file's first and last lines are looked at, and another process reads it first.

    Raises:
        MeshError: the file is missing, is not a gmsh mesh, is cut off, or cannot be read in bounded time.
    """
    where = f"mesh file {path}"
    _check_ends(path, where)
    _rehearse(path, where)
    import gmsh

    with gmsh_errors(where, _EXPECTED):
        gmsh.merge(str(path))


def _check_ends(path: Path, where: str) -> None:
    try:
        if path.exists() and not path.is_file():
            found = "a folder" if path.is_dir() else "a device or pipe"
            raise MeshError(where, found=found, expected=_EXPECTED)
        with path.open("rb") as file:
            first = file.read(200)
            size = file.seek(0, 2)
            file.seek(max(0, size - 200))
            last = file.read()
    except FileNotFoundError as error:
        raise MeshError(where, found="no such file", expected=_EXPECTED, hint=_others(path)) from error
    except OSError as error:
        raise MeshError(where, found=error.strerror or str(error), expected=_EXPECTED) from error
    if not first.strip():
        raise MeshError(where, found="an empty file", expected=_EXPECTED)
    if not first.lstrip().startswith(b"$MeshFormat"):
        raise MeshError(
            where,
            found="something else than $MeshFormat in the first line",
            expected=_EXPECTED,
            hint="In gmsh: File, Export, Gmsh MSH; a .geo script has to be meshed and saved first.",
        )
    lines = last.rstrip().splitlines()
    if not lines or not lines[-1].lstrip().startswith(b"$End"):
        raise MeshError(
            where,
            found="a file that stops in the middle of a section",
            expected=_EXPECTED,
            hint="It may have been cut off while it was written or copied.",
        )


def _others(path: Path) -> str:
    """Mesh files in the folder of the missing one."""
    try:
        names = sorted(other.name for other in path.parent.glob("*.msh"))[:5]
    except OSError:
        names = []
    if names:
        return f"In the same folder: {', '.join(names)}."
    return "" if path.parent.is_dir() else f"There is no folder {path.parent} either."


def _rehearse(path: Path, where: str) -> None:
    """Read the file in another process, with limited time and memory."""
    if not sys.executable:
        return
    size = path.stat().st_size
    seconds = _SECONDS + size * _SECONDS_PER_BYTE
    memory = _MEMORY + size * _MEMORY_PER_BYTE
    # numpy, which gmsh imports, sets memory aside for each thread
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    # -P: a gmsh.py in the current folder is not meant
    command = [sys.executable, "-P", "-c", _REHEARSAL, str(path), str(memory)]
    try:
        outcome = subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False, env=environment)
    except subprocess.TimeoutExpired as error:
        raise MeshError(
            where, found=f"that gmsh does not finish reading within {seconds:.0f} s", expected=_EXPECTED
        ) from error
    if outcome.returncode in (0, _NO_GMSH):
        return
    if outcome.returncode == _REFUSED:
        found = f"that gmsh stopped with: {outcome.stdout or 'no message'}"
    else:
        found = f"that gmsh crashes while reading (exit status {outcome.returncode})"
    raise MeshError(where, found=found, expected=_EXPECTED, hint="The file seems to be damaged.")
