"""Picture of a case before it runs, drawn by `gapbeam.view` and `gapbeam view`."""

from __future__ import annotations

from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from gapbeam.interface.case_source import CaseSource, name_of, read_case
from gapbeam.process.failing_ranks import refuse_ranks
from gapbeam.solver.case.reading.overrides import Overrides
from gapbeam.solver.scene.argument_checks import checked

if TYPE_CHECKING:
    from gapbeam.postprocess.scene.set_up import LoadArrow, SectionMask, SetUp
    from gapbeam.solver.case.beam_profile import Beam
    from gapbeam.solver.case.case import Case

GRID = 160  # points of a section either way
MARGIN = 0.01  # of a section, around it


@checked
def view(
    case: CaseSource,
    overrides: Overrides = (),
    output: str | PathLike[str] | None = None,
    size: tuple[int, int] = (1600, 900),
) -> Path:
    """Draw a case before it runs: mesh, supports with enlarged gaps, loads, joints, masses and probes.

    Args:
        case: Path of a case file, its text, a dict of its tables, or a case.
        overrides: Keys to replace.
        output: The picture, *.png; by default results/<case>-view.png.
        size: Width and height in pixels.

    Returns:
        The picture.

    Raises:
        CaseError: The case has faults.
        MeshError: The mesh file does not fit the case.
        UserError: The picture has another suffix, is a link or a folder, or cannot be written.
        RenderError: No solid can be drawn off-screen here.
        OptionError: A size out of range.
    """
    refuse_ranks("view")
    read = read_case(case, overrides)
    path = Path("results") / f"{name_of(case)}-view.png" if output is None else Path(output)
    _check(path)
    from PIL import Image

    from gapbeam.postprocess.render import check_size
    from gapbeam.postprocess.scene.setup_sheet import picture_of
    from gapbeam.solver.messages.errors import UserError

    check_size(size)
    picture, _ = picture_of(set_up_of(read), size)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(picture).save(path)
    except OSError as error:
        raise UserError(f"{path} cannot be written ({error.strerror}); choose another `output=`") from error
    return path


def set_up_of(case: Case) -> SetUp:
    """Mesh a case and return the scene of its picture.

    Raises:
        MeshError: The mesh file does not fit the case.
    """
    import numpy as np
    from meshio import CellBlock

    from gapbeam.meshes.mesh_readings import vector_space
    from gapbeam.meshes.rank_zero import ONE_RANK
    from gapbeam.postprocess.results.columns_of_run import supports_of
    from gapbeam.postprocess.scene.set_up import SetUp
    from gapbeam.solver.assembly.case_mesh import mesh_of_case
    from gapbeam.solver.loads.load_choice import axis_point
    from gapbeam.solver.run.output.parallel_tables import MESHIO_CELLS, around
    from gapbeam.solver.run.output.run_summary import describe_supports

    mesh = mesh_of_case(case, ONE_RANK, assembled=False).mesh
    corners = vector_space(mesh, 1)  # cells may be curved; pictures have their corners
    cell = mesh.topology.cell_name()
    blocks = [CellBlock(MESHIO_CELLS[cell], around(cell, np.asarray(corners.dofmap.list)))]
    supports = supports_of({"model": {"supports": describe_supports(case)}}, {})
    middles = {one.name: 0.5 * (one.start + one.end) for one in case.layout.supports}
    if case.mesh.file is not None and case.mesh.dimension == 3:
        middles = {}  # a mesh of one's own may have another section than its case says
    return SetUp(
        case.title,
        corners.tabulate_dof_coordinates(),
        blocks,
        supports,
        {one.name: one.region.type for one in case.layout.supports},
        {name: _mask(case.profile.at(x).beam) for name, x in middles.items()},
        tuple(_arrows(case)),
        {one.name: tuple(axis_point(one.point)) for one in case.probe},  # type: ignore[misc]
        case.model_dump(mode="json"),
    )


def _mask(beam: Beam) -> SectionMask:
    """Return the material of a section on a grid a little larger than it."""
    import numpy as np

    from gapbeam.postprocess.scene.set_up import SectionMask

    reach = 0.5 + MARGIN
    across = np.linspace(-reach * beam.width, reach * beam.width, GRID)
    up = np.linspace(-reach * beam.thickness, reach * beam.thickness, GRID)
    inside = [[float(beam.contains(float(y), float(z))) for y in across] for z in up]
    return SectionMask(across, up, np.array(inside))


def _arrows(case: Case) -> Iterator[LoadArrow]:
    """Yield the loads of a case."""
    from gapbeam.postprocess.scene.set_up import LoadArrow
    from gapbeam.solver.loads.load_choice import axis_point, unit_direction
    from gapbeam.solver.loads.places import LineForce, PointForce, SupportWalls
    from gapbeam.solver.loads.support_walls import moved_by

    dimension = case.mesh.dimension
    for load in case.load:
        given = getattr(load, "direction", None)
        along = (*map(float, unit_direction(given, dimension, load.default_sense)), 0.0)[:3]
        direction = (along[0], along[1], along[2])
        frequency = f", {load.forcing_frequency:.4g} Hz" if load.forcing_frequency else ""
        match load.place:
            case PointForce(point):
                x, y, z = map(float, axis_point(point))
                yield LoadArrow(f"{load.name} {load.peak:.4g} N{frequency}", (x, y, z), direction, not load.static)
            case LineForce(places):
                for x in places[:: max(1, (len(places) - 1) // 3)]:
                    yield LoadArrow(load.name, (x, 0.0, 0.0), direction, not load.static)
            case SupportWalls() as place:
                moved = moved_by(place, case.layout)
                verb = "opens" if place.opens else "moves"
                name = moved.name if moved is not None else None
                yield LoadArrow(f"{load.name} {verb} {name}{frequency}", None, direction, True, name)
            case _:
                yield LoadArrow(f"{load.name} {load.peak:.4g} m/s²{frequency}", None, direction, not load.static)


def _check(path: Path) -> None:
    """Refuse a place for the picture.

    Raises:
        UserError: Another suffix, a link or a folder.
    """
    from gapbeam.solver.messages.errors import UserError
    from gapbeam.solver.run.output.results_folder import check_name, check_place

    check_name(path)
    if path.suffix.lower() != ".png":
        raise UserError(f"`output=` {path}: expected a name that ends with .png")
    if path.is_symlink() or path.is_dir():
        raise UserError(f"{path} is a {'link' if path.is_symlink() else 'folder'}; choose another `output=`")
    check_place(path.parent)
