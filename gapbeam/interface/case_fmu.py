"""Cases and scenes for other programs: data of the C kernel, and Functional Mock-up Units."""

from __future__ import annotations

import json
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from gapbeam.interface.case_source import CaseSource, name_of, read_case
from gapbeam.process.failing_ranks import refuse_ranks
from gapbeam.solver.case.reading.overrides import Overrides
from gapbeam.solver.messages.wording import LOG
from gapbeam.solver.scene.argument_checks import checked
from gapbeam.solver.scene.scene import Scene, SceneState

if TYPE_CHECKING:
    from gapbeam.solver.kernel.kernel_data import KernelData


class MarchedScene(NamedTuple):
    """A scene of a case as its run marches it.

    Attributes:
        scene: The scene.
        step: s.
        end: s.
        start: State at the start.
        faces: Names of faces whose contact points belong together.
    """

    scene: Scene
    step: float
    end: float | None
    start: SceneState | None
    faces: tuple[str, ...]

    def data(self, inputs: Sequence[str] = ()) -> KernelData:
        """Return the data of the kernel; errors as of `kernel_data`."""
        from gapbeam.solver.kernel.kernel_data import kernel_data

        return kernel_data(self.scene, self.step, self.start, inputs, self.faces)


def marched_scene(case: CaseSource, overrides: Overrides = ()) -> MarchedScene:
    """Return the scene of a case or of a file of several structures, with the step and the start of its run.

    Raises:
        CaseError: The case has faults.
        UserError: The case has what a scene has no noun for, or another scheme than the default.
        NotConverged: Nothing holds the beam at the start.
    """
    from gapbeam.solver.case.reading.case_reader import is_scene
    from gapbeam.solver.messages.errors import UserError
    from gapbeam.solver.scene.linear_scheme import MIDPOINT
    from gapbeam.solver.scene_file.scene_reader import read_scene

    if is_scene(case):
        read = read_scene(case, overrides)
        asked = read.march()
        if asked["scheme"] != MIDPOINT:
            raise UserError("fmu: found another scheme than the default; leave out time.scheme")
        return MarchedScene(read.scene, asked["step"], asked["end"], asked["start"], ())
    from gapbeam.interface.case_scene import scene_of_model
    from gapbeam.process.launcher import all_ranks
    from gapbeam.solver.march.simulation import Simulation
    from gapbeam.solver.system.semi_discrete import VALUE

    simulation = Simulation.of_case(read_case(case, overrides), all_ranks())
    scene = scene_of_model(simulation.case, simulation.model)
    begin = simulation.start(simulation.seat_or_failure())
    beam = scene.given[0]
    start = scene.state({beam: begin.u[VALUE]}, {beam: begin.v[VALUE]}, begin.time)
    faces = tuple(simulation.model.system.contact.face_names)
    return MarchedScene(scene, float(simulation.model.step), float(simulation.case.time.end), start, faces)


def live_model(folder: Path) -> dict[str, Any] | None:
    """Return data of the live model of a run's folder; None: the kernel cannot march its case, or its scene."""
    from gapbeam.meshes.mesh_errors import MeshError
    from gapbeam.solver.case.reading.case_reader import is_scene
    from gapbeam.solver.case.solution_tables import FullModel
    from gapbeam.solver.messages.errors import CaseError, RunError
    from gapbeam.solver.schema.record_table import CASE_FILE, SUMMARY_FILE

    try:
        file, changes = folder / CASE_FILE, dict[str, Any]()
        if is_scene(file):
            changes = json.loads((folder / SUMMARY_FILE).read_text(encoding="utf-8"))["overrides"]
        elif isinstance(read_case(file).model, FullModel):
            return None
        data = marched_scene(file, changes).data()
    except (CaseError, MeshError, RunError, ImportError) as reason:
        LOG.debug("no live model: %s", reason)
        return None
    return data.as_json()


@checked
def fmu(
    case: CaseSource | Scene,
    output: str | PathLike[str] | None = None,
    overrides: Overrides = (),
    inputs: Sequence[str] = (),
    overwrite: bool = False,
    step: float | None = None,
    end: float | None = None,
    start: SceneState | None = None,
) -> Path:
    """Write a case or a scene as a Functional Mock-up Unit: FMI 3.0, co-simulation, x86-64 Linux, with its source.

    The unit marches the condensed scene by the default scheme, as `gapbeam.march` does. It keeps no gates: run the case
    once to see that step and model may be trusted.

    Args:
        case: As in `run`; or a scene.
        output: File to write, *.fmu; by default named after the case, in the current folder.
        overrides: As in `run`; not for a scene.
        inputs: Names of loads whose value the importer gives in place of their own function of time.
        overwrite: Replace a file that is there.
        step: Step of a scene, s; a case has its own.
        end: End of a scene: time until which importers simulate by default, s.
        start: Start of a scene: state at the start; default at rest, undeformed.

    Returns:
        The file.

    Raises:
        CaseError: The case has faults.
        UserError: The scene has what the kernel cannot march, all of it in the message; an argument is not for a case,
            or not for a scene; or the file is there, or cannot be written.
        NotConverged: Nothing holds the beam at the start.
    """
    from gapbeam.solver.kernel.kernel_data import write_fmu
    from gapbeam.solver.messages.errors import UserError
    from gapbeam.solver.run.output.results_folder import check_name

    refuse_ranks("fmu")
    own = {"step": step, "end": end, "start": start}
    if isinstance(case, Scene):
        if step is None or overrides:
            raise UserError("fmu: a scene needs `step=`, s, and takes no `overrides=`: see `scene.with_`")
        name, marched = "scene", MarchedScene(case, step, end, start, ())
    elif given := [one for one, value in own.items() if value is not None]:
        raise UserError(f"fmu: found `{given[0]}=` for a case, whose step, end and start are keys of its file")
    else:
        name, marched = name_of(case), None  # type: ignore[arg-type]  # a scene file has a name, too
    path = Path(f"{name}.fmu" if output is None else output)
    if path.suffix != ".fmu":
        raise UserError(f'fmu: found "{path}", expected a name that ends in .fmu')
    check_name(path)
    if path.exists() and not overwrite:
        raise UserError(f"{path} is there already; `overwrite=True` replaces it, or choose another `output=`")
    marched = marched or marched_scene(case, overrides)  # type: ignore[arg-type]
    return write_fmu(marched.data(inputs), path, name, marched.end)
