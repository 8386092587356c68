"""The fidelity levels of a case: models, meshes, degrees, bases, steps and schemes of one and the same beam."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import prod, sqrt
from typing import Any

from gapbeam.solver.case.analysis_table import Periodic
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.solution_tables import BeamModel
from gapbeam.solver.errors import UserError
from gapbeam.solver.models.model import Model
from gapbeam.studies.trials.refined_mesh import mesh_keys
from gapbeam.studies.trials.starts import KeptBody

REFINEMENT = sqrt(2.0)  # between the meshes of the reference
FINEST = 0.75  # cell size of the reference over the case's
RICH = {"type": "reduced", "modes": 40, "shapes": 19}
LEAN = {"type": "reduced", "modes": 10, "shapes": 5}
USUAL = {"type": "reduced"}
FULL = {"type": "full"}


@dataclass(frozen=True)
class Level:
    """One way to compute a case.

    Attributes:
        name: In words.
        changes: Keys of the case that it replaces; None removes one.
        size: DOFs of its mesh, roughly.
        full: Whether it marches all DOFs of a mesh, which costs most.
        dimension: Of its mesh, 2 or 3.
    """

    name: str
    changes: Mapping[str, Any]
    size: float = 0.0
    full: bool = False
    dimension: int = 3

    @property
    def body(self) -> str:
        """The same for fidelity levels that share a mesh and a model."""
        return repr([value for key, value in self.changes.items() if key.startswith(("mesh.", "model"))])


@dataclass(frozen=True)
class LevelPlan:
    """Levels of a trade-off for a case.

    Attributes:
        fixed: Keys that are the same on all fidelity levels: the contact stiffness, which must not follow the mesh.
        reference: The finest that is affordable.
        meshes: The same on two coarser meshes, the finer one first.
        steps: The same with twice and four times the step.
        basis: The same with the usual basis.
        levels: The others, from cheap to dear.
        notes: Notes before the study.
    """

    fixed: Mapping[str, Any]
    reference: Level
    meshes: tuple[Level, Level]
    steps: tuple[Level, Level]
    basis: Level
    levels: tuple[Level, ...]
    notes: tuple[str, ...]

    @property
    def family(self) -> tuple[Level, ...]:
        """The reference and what its uncertainty is made of."""
        return (self.reference, *self.meshes, *self.steps, self.basis)


def plan_levels(case: Case, coarser: float = 1.0) -> LevelPlan:
    """Return the fidelity levels of a case.

    Args:
        case: The case; the finest fidelity levels have its dimension.
        coarser: Factor by which the meshes of the reference are coarser than they could be.

    Raises:
        UserError: A mesh file, which cannot be refined, or a formulation that reduced models cannot do.
        CaseError: Step and contact do not go together.
    """
    if case.mesh.file is not None:
        raise UserError(
            f"mesh.file = {case.mesh.file} cannot be refined; expected a mesh that gapbeam builds, for a trade-off"
        )
    if isinstance(case.analysis, Periodic):
        raise UserError('analysis.type = "periodic": a trade-off marches; expected "transient"')
    if not case.contact.formulation.follows_the_law:
        raise UserError(
            f"contact.formulation = {case.contact.formulation.type}: the trade-off marches reduced models, which take "
            "contact stiffness; expected penalty"
        )
    bodies = [one.name for one in case.layout.supports if one.body is not None]
    if bodies:
        raise UserError(
            f"support.{bodies[0]}.body: the trade-off compares with a full model, whose supports stand still; expected "
            "supports without body"
        )
    beam = KeptBody().model(case.model_copy(update={"model": BeamModel(type="beam")}))
    fixed, notes = _fixed(case, beam)
    step, dimension = beam.step, case.mesh.dimension
    finest = FINEST * coarser

    def level(
        name: str, model: Mapping[str, Any], refinement: float = 1.0, in_plane: bool = False, **more: Any
    ) -> Level:
        even = more.get("mesh__degree", case.mesh.degree) == 1
        changes: dict[str, Any] = {"model": dict(model), **mesh_keys(case, refinement, in_plane, even)}
        changes |= {key.replace("__", "."): value for key, value in more.items()}
        if changes.get("time.step", step) > step:
            changes["output.history_interval"] = None  # records are then as far apart as steps
        return Level(name, changes, _dofs(case, changes), model["type"] == "full", 2 if in_plane else dimension)

    solid = f"{dimension}D"
    reference = level(f"reduced {solid}, rich basis, cells x {finest:.2f}, step / 4", RICH, finest, time__step=step / 4)
    coarse = [
        level(f"reduced {solid}, rich basis, cells x {c:.2f}, step / 4", RICH, c, time__step=step / 4)
        for c in (finest * REFINEMENT, finest * REFINEMENT**2)
    ]
    steps = [
        level(f"reduced {solid}, rich basis, cells x {finest:.2f}, {word}", RICH, finest, time__step=step / part)
        for word, part in (("step / 2", 2.0), ("the step", 1.0))
    ]
    basis = level(f"reduced {solid}, cells x {finest:.2f}, step / 4", USUAL, finest, time__step=step / 4)
    levels = [] if case.output.stress else [level("rigid body", {"type": "rigid"})]
    levels += [
        level("beam, 24 elements", {"type": "beam", "elements": 24}),
        level("beam, 102 elements", {"type": "beam", "elements": 102}),
    ]
    if case.profile.sliceable(case.beam.width):
        levels += [
            level("reduced 2D, coarse, lean basis", LEAN, 2.0, in_plane=True),
            level("reduced 2D", USUAL, in_plane=True),
            level("reduced 2D, degree 1", USUAL, in_plane=True, mesh__degree=1),
        ]
    if dimension == 3:
        levels += [
            level("reduced 3D, coarse, lean basis", LEAN, 2.0),
            level("reduced 3D, coarse", USUAL, 2.0),
            level("reduced 3D", USUAL),
        ]
    own = f"reduced {solid}"
    levels += [
        level(f"{own}, step x 2", USUAL, time__step=2.0 * step),
        level(f"{own}, step / 2", USUAL, time__step=step / 2.0),
        level(f"{own}, implicit-midpoint", USUAL, time__scheme={"type": "implicit-midpoint"}),
        level(f"{own}, generalized-alpha", USUAL, time__scheme={"type": "generalized-alpha", "rho_inf": 0.5}),
    ]
    if case.profile.sliceable(case.beam.width):
        levels += [
            level("full 2D, coarse", FULL, 2.0, in_plane=True),
            level("full 2D", FULL, in_plane=True),
            level("full 2D, degree 1", FULL, in_plane=True, mesh__degree=1),
        ]
    if dimension == 3:
        if not any(one.beam.section.round for one in case.profile.pieces):  # curved cells are quadratic
            levels.append(level("full 3D, degree 1", FULL, mesh__degree=1))
        levels += [
            level("full 3D, coarse", FULL, 2.0),
            level("full 3D", FULL),
        ]
    return LevelPlan(fixed, reference, (coarse[0], coarse[1]), (steps[0], steps[1]), basis, tuple(levels), tuple(notes))


def _fixed(case: Case, beam: Model) -> tuple[dict[str, Any], list[str]]:
    """Return the keys that all fidelity levels share, and what is said about them."""
    fixed: dict[str, Any] = {"output.fields_interval": None, "output.stress": False}
    notes = []
    computed = {default.key: default for default in beam.defaults}
    if case.contact.stiffness == "auto" and "contact.stiffness" in computed:
        chosen = computed["contact.stiffness"]
        fixed["contact.stiffness"] = chosen.value
        notes.append(
            f"contact.stiffness = {chosen.value:.4g} {chosen.unit} on all fidelity levels, "
            "as computed for the mesh of the case"
        )
    fixed["output.history_interval"] = case.output.history_interval or beam.step
    return fixed, notes


def _dofs(case: Case, changes: Mapping[str, Any]) -> float:
    """Return about how many DOFs a mesh has."""
    dimension, degree = changes["mesh.dimension"], changes.get("mesh.degree", case.mesh.degree)
    supported = case.layout.length
    free = case.beam.length - supported
    along = supported / changes["mesh.support_size"] + free / changes["mesh.size"]
    cells = [along, changes["mesh.cells_through_thickness"], changes["mesh.cells_across_width"]][:dimension]
    return float(dimension * prod(degree * count + 1.0 for count in cells))
