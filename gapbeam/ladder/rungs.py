"""The rungs of a case: models, meshes, degrees, bases, steps and schemes of one and the same beam."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import prod, sqrt
from typing import Any

from solver.case import Case, Mesh
from solver.case_tables.analysis import Periodic
from solver.case_tables.contact import Penalty
from solver.case_tables.model import BeamModel
from solver.errors import UserError
from solver.model import Model
from solver.studies.kept_body import KeptBody

REFINEMENT = sqrt(2.0)  # between the meshes of the reference
FINEST = 0.75  # cell size of the reference relative to that of the case
RICH = {"type": "reduced", "modes": 40, "shapes": 19}
LEAN = {"type": "reduced", "modes": 10, "shapes": 5}
USUAL = {"type": "reduced"}
FULL = {"type": "full"}


@dataclass(frozen=True)
class Rung:
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
        """The same for rungs that share a mesh and a model."""
        return repr([value for key, value in self.changes.items() if key.startswith(("mesh.", "model"))])


@dataclass(frozen=True)
class Ladder:
    """What is run of a case.

    Attributes:
        fixed: Keys that are the same on all rungs: the contact stiffness, which must not follow the mesh.
        reference: The finest that is affordable.
        meshes: The same on two coarser meshes, the finer one first.
        steps: The same with twice and four times the step.
        basis: The same with the usual basis.
        rungs: The others, from cheap to dear.
        notes: What is told beforehand.
    """

    fixed: Mapping[str, Any]
    reference: Rung
    meshes: tuple[Rung, Rung]
    steps: tuple[Rung, Rung]
    basis: Rung
    rungs: tuple[Rung, ...]
    notes: tuple[str, ...]

    @property
    def family(self) -> tuple[Rung, ...]:
        """The reference and what its uncertainty is made of."""
        return (self.reference, *self.meshes, *self.steps, self.basis)


def ladder_of(case: Case, coarser: float = 1.0) -> Ladder:
    """Return the rungs of a case.

    Args:
        case: The case; its dimension is that of the finest rungs.
        coarser: How much coarser the meshes of the reference are than they could be.

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
    if not isinstance(case.contact.formulation, Penalty):
        raise UserError(
            f"contact.formulation = {case.contact.formulation.type}: the trade-off marches reduced models, which take "
            "contact stiffness; expected penalty"
        )
    beam = KeptBody().model(case.model_copy(update={"model": BeamModel(type="beam")}))
    fixed, notes = _fixed(case, beam)
    step, dimension = beam.step, case.mesh.dimension
    finest = FINEST * coarser

    def rung(name: str, model: Mapping[str, Any], refinement: float = 1.0, in_plane: bool = False, **more: Any) -> Rung:
        even = more.get("mesh__degree", case.mesh.degree) == 1
        changes: dict[str, Any] = {"model": dict(model), **_mesh(case, refinement, in_plane, even)}
        changes |= {key.replace("__", "."): value for key, value in more.items()}
        if changes.get("time.step", step) > step:
            changes["output.history_interval"] = None  # records are then as far apart as steps
        return Rung(name, changes, _dofs(case, changes), model["type"] == "full", 2 if in_plane else dimension)

    solid = f"{dimension}D"
    reference = rung(f"reduced {solid}, rich basis, cells x {finest:.2f}, step / 4", RICH, finest, time__step=step / 4)
    coarse = [
        rung(f"reduced {solid}, rich basis, cells x {c:.2f}, step / 4", RICH, c, time__step=step / 4)
        for c in (finest * REFINEMENT, finest * REFINEMENT**2)
    ]
    steps = [
        rung(f"reduced {solid}, rich basis, cells x {finest:.2f}, {word}", RICH, finest, time__step=step / part)
        for word, part in (("step / 2", 2.0), ("the step", 1.0))
    ]
    basis = rung(f"reduced {solid}, cells x {finest:.2f}, step / 4", USUAL, finest, time__step=step / 4)
    rungs = [
        rung("rigid body", {"type": "rigid"}),
        rung("beam, 24 elements", {"type": "beam", "elements": 24}),
        rung("beam, 102 elements", {"type": "beam", "elements": 102}),
        rung("reduced 2D, coarse, lean basis", LEAN, 2.0, in_plane=True),
        rung("reduced 2D", USUAL, in_plane=True),
        rung("reduced 2D, degree 1", USUAL, in_plane=True, mesh__degree=1),
    ]
    if dimension == 3:
        rungs += [
            rung("reduced 3D, coarse, lean basis", LEAN, 2.0),
            rung("reduced 3D, coarse", USUAL, 2.0),
            rung("reduced 3D", USUAL),
        ]
    own = f"reduced {solid}"
    rungs += [
        rung(f"{own}, step x 2", USUAL, time__step=2.0 * step),
        rung(f"{own}, step / 2", USUAL, time__step=step / 2.0),
        rung(f"{own}, implicit-midpoint", USUAL, time__scheme={"type": "implicit-midpoint"}),
        rung(f"{own}, generalized-alpha", USUAL, time__scheme={"type": "generalized-alpha", "rho_inf": 0.5}),
        rung("full 2D, coarse", FULL, 2.0, in_plane=True),
        rung("full 2D", FULL, in_plane=True),
        rung("full 2D, degree 1", FULL, in_plane=True, mesh__degree=1),
    ]
    if dimension == 3:
        rungs += [
            rung("full 3D, degree 1", FULL, mesh__degree=1),
            rung("full 3D, coarse", FULL, 2.0),
            rung("full 3D", FULL),
        ]
    return Ladder(fixed, reference, (coarse[0], coarse[1]), (steps[0], steps[1]), basis, tuple(rungs), tuple(notes))


def _fixed(case: Case, beam: Model) -> tuple[dict[str, Any], list[str]]:
    """Return the keys that all rungs share, and what is said about them."""
    fixed: dict[str, Any] = {"output.fields_interval": None}
    notes = []
    computed = {default.key: default for default in beam.defaults}
    if case.contact.stiffness == "auto" and "contact.stiffness" in computed:
        chosen = computed["contact.stiffness"]
        fixed["contact.stiffness"] = chosen.value
        notes.append(
            f"contact.stiffness = {chosen.value:.4g} {chosen.unit} on all rungs, as computed for the mesh of the case"
        )
    fixed["output.history_interval"] = case.output.history_interval or beam.step
    return fixed, notes


def _mesh(case: Case, refinement: float, in_plane: bool, even: bool) -> dict[str, Any]:
    """Return the keys of a mesh with cells of another size; even numbers put nodes of degree 1 on the axis."""
    mesh, thickness = case.mesh, case.beam.thickness
    plane = in_plane or mesh.dimension == 2
    size, support = mesh.size or thickness, mesh.support_size or thickness / 3.0
    changes: dict[str, Any] = {
        "mesh.dimension": 2 if plane else 3,
        "mesh.size": size * refinement,
        "mesh.support_size": min(support * refinement, case.support.length),
        "mesh.edge_size": None if mesh.edge_size is None else mesh.edge_size * refinement,
        "mesh.cells_through_thickness": _cells(mesh.cells_through_thickness, refinement, even),
        "mesh.cells_across_width": None if plane else _cells(mesh.cells_across_width, refinement, even),
    }
    if plane and mesh.dimension == 3:
        changes["mesh.cell"] = Mesh().cell
    return changes


def _dofs(case: Case, changes: Mapping[str, Any]) -> float:
    """Return about how many DOFs a mesh has."""
    dimension, degree = changes["mesh.dimension"], changes.get("mesh.degree", case.mesh.degree)
    supported, free = case.support.length, case.beam.length - case.support.length
    along = supported / changes["mesh.support_size"] + free / changes["mesh.size"]
    cells = [along, changes["mesh.cells_through_thickness"], changes["mesh.cells_across_width"]][:dimension]
    return float(dimension * prod(degree * count + 1.0 for count in cells))


def _cells(count: int | None, refinement: float, even: bool) -> int:
    wanted = (count or 4) / refinement
    return max(2, 2 * round(0.5 * wanted)) if even else max(1, round(wanted))
