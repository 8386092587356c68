"""[[structure]], [[point]], [[joint]] and [[mass]]: bodies, their points, joints and masses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from gapbeam.solver.case.beam_profile import Material
from gapbeam.solver.messages.errors import Fault, Key, UserError
from gapbeam.solver.scene.argument_checks import ArgumentError
from gapbeam.solver.scene.mesh_structure import mesh_model
from gapbeam.solver.scene.solid_material import OrthotropicMaterial, orthotropic
from gapbeam.solver.scene.structure_files import ImportedModel
from gapbeam.solver.scene.structure_geometry import Pose
from gapbeam.solver.schema.table import (
    OF_TYPE,
    Name,
    NonNegative,
    Number,
    PointName,
    Positive,
    Switch,
    Table,
    Whole,
    named,
)
from gapbeam.solver.sections.section_choice import RECTANGLE, SectionChoice

Direction = tuple[Number, Number, Number]
FileName = Annotated[str, Field(min_length=1, max_length=1000)]


class MeshMaterial(Table):
    """A material of a mesh: isotropic, or orthotropic with own axes."""

    group: str | None = Field(
        default=None, min_length=1, max_length=80, description="group of cells; default all cells of no other group",
        examples=["RUBBER"],
    )  # fmt: skip
    density: Positive = Field(description="mass density, kg/m^3", examples=[7850.0])
    young_modulus: Positive | None = Field(default=None, description="of an isotropic material, Pa", examples=[2.1e11])
    poisson_ratio: Annotated[Number, Field(gt=-1.0, lt=0.5)] | None = Field(
        default=None, description="of an isotropic material, no unit", examples=[0.3]
    )
    young_moduli: Direction | None = Field(
        default=None, description="E1, E2, E3 of an orthotropic material, Pa", examples=[[1.35e11, 9e9, 9e9]]
    )
    poisson_ratios: Direction | None = Field(
        default=None,
        description="nu12, nu13, nu23, no unit; nu12 is the contraction along 2 under tension along 1",
        examples=[[0.3, 0.3, 0.4]],
    )
    shear_moduli: Direction | None = Field(default=None, description="G12, G13, G23, Pa", examples=[[5e9, 5e9, 3.2e9]])
    axis: Direction = Field(default=(1.0, 0.0, 0.0), description="direction 1 of an orthotropic material, no unit")
    across: Direction | None = Field(
        default=None, description="direction 3, at right angles to axis, no unit; default z, made to be at right angles"
    )

    def made(self) -> Material | OrthotropicMaterial:
        """Return the material."""
        if self.young_moduli is not None and self.poisson_ratios is not None and self.shear_moduli is not None:
            moduli = self.young_moduli, self.poisson_ratios, self.shear_moduli
            return orthotropic(*moduli, self.density, self.axis, self.across)
        return Material.model_validate(
            {"young_modulus": self.young_modulus, "poisson_ratio": self.poisson_ratio, "density": self.density}
        )


class MeshFile(Table):
    """Solids of a mesh file, relative to the case file."""

    type: Literal["mesh"] = Field(description="kind of model")
    file: FileName = Field(
        description="mesh: .inp (Abaqus, CalculiX), .bdf (Nastran), .msh (gmsh), .vtk, .vtu, .med, ...; cells of one "
        "kind, order 1 or 2",
        examples=["bracket.inp"],
    )
    units: Literal["m", "cm", "mm", "inch"] = Field(description="unit of its coordinates", examples=["mm"])
    materials: tuple[MeshMaterial, ...] = Field(
        min_length=1,
        max_length=100,
        description="materials of groups of cells",
        examples=[[{"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}]],
    )
    plane: Literal["stress", "strain"] | None = Field(
        default=None,
        description="assumption for triangles or quadrilaterals in a plane z = constant",
        examples=["stress"],
    )
    thickness: Positive | None = Field(default=None, description="of cells in a plane, m", examples=[0.01])

    def read(self, place: Pose | None, name: str, finer: bool) -> ImportedModel:
        """Return the matrices of the file, or of a finer mesh, before anything is clamped.

        Raises:
            UserError: The file cannot be read, or materials do not fit.
        """
        try:
            materials = {one.group or "": one.made() for one in self.materials}
        except UserError as error:
            raise ArgumentError(str(error), "materials") from None
        return mesh_model(
            self.file, materials, units=self.units, plane=self.plane, thickness=self.thickness, place=place, name=name,
            finer=finer,
        )  # fmt: skip


def material_faults(key: Key, model: MeshFile) -> Iterator[Fault]:
    """A material is isotropic or orthotropic, and every group has one."""
    for number, one in enumerate(model.materials):
        given = {
            kind: [name for name in kind if getattr(one, name) is not None]
            for kind in (("young_modulus", "poisson_ratio"), ("young_moduli", "poisson_ratios", "shear_moduli"))
        }
        whole = [kind for kind, names in given.items() if len(names) == len(kind)]
        if len(whole) != 1 or sum(map(len, given.values())) != len(whole[0]):
            found = ", ".join(name for names in given.values() for name in names) or "no elastic constants"
            yield Fault((*key, number), found, "young_modulus and poisson_ratio, or young_moduli, poisson_ratios and "
                        "shear_moduli")  # fmt: skip
        if one.group in [other.group for other in model.materials[:number]]:
            yield Fault((*key, number, "group"), f"{one.group or 'none'}, a second time", "a group for each material")


class ImportedMatrices(Table):
    """Matrices that another program wrote, in files relative to the case file."""

    type: Literal["matrices"] = Field(description="kind of model")
    stiffness: FileName = Field(description="file of K: .mtx, .npz, .npy, .sti, .pch, .op4", examples=["rack.sti"])
    mass: FileName = Field(description="file of M, likewise", examples=["rack.mas"])
    damping: FileName | None = Field(default=None, description="file of C, likewise; default none")
    dofs: FileName | None = Field(
        default=None,
        description='file with a "node.direction" for each row; default the names in the files of the matrices',
        examples=["rack.dof"],
    )
    nodes: FileName | None = Field(
        default=None,
        description="file of coordinates, node x y z, in the unit of the matrices: .inp with its sets, .txt, or a mesh",
        examples=["rack.inp"],
    )
    units: Literal["m-kg-s", "mm-t-s", "mm-kg-s"] = Field(description="units of all these files", examples=["mm-t-s"])


class ModesOfFile(Table):
    """Modes in a CSV file, with columns frequency (Hz), damping, frame and one for each point, or a universal file."""

    type: Literal["modes"] = Field(description="kind of model")
    file: FileName = Field(
        description="the file; its points are its columns, or nodes of a .unv or .uff: 12x, 12xz, or 12 in space",
        examples=["arm.csv"],
    )


class _Profile(Table):
    thickness: Positive = Field(description="size in the bending direction, m", examples=[0.012])
    width: Positive | None = Field(
        default=None, description="size across the bending plane, m; default the thickness", examples=[0.02]
    )
    section: Annotated[SectionChoice, BeforeValidator(named)] = Field(
        default=RECTANGLE, description="the cross-section: a name, or a table with the type and its keys"
    )
    material: Material = Field(
        description="the material: young_modulus, poisson_ratio, density",
        examples=[{"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}],
    )
    added_mass: NonNegative = Field(
        default=0.0, description="mass of a fluid that moves with it across its axis, per length, without weight, kg/m"
    )


TENSION: Any = Field(
    default=0.0,
    description="axial preload of a straight beam or member, which keeps its direction and size, N; below 0: "
    "compression",
)


class _Bar(_Profile):
    length: Positive = Field(description="length, m", examples=[0.5])


class ElementBeam(_Bar):
    """A straight beam of Timoshenko elements that bends in one plane or two; its points move across it."""

    type: Literal["beam"] = Field(description="kind of model")
    elements: Whole | None = Field(default=None, ge=1, le=10_000, description="about so many elements; default 40")
    motions: Whole = Field(
        default=1, ge=1, le=2, description="1: it bends in one plane; 2: in two, round sections only"
    )
    tension: Number = TENSION


class RigidBar(_Bar):
    """A straight rigid bar: heave and pitch."""

    type: Literal["rigid"] = Field(description="kind of model")


class ElementFrame(_Profile):
    """A frame in space of Timoshenko elements along a route; its points move along their directions."""

    type: Literal["frame"] = Field(description="kind of model")
    route: tuple[Direction, ...] = Field(
        min_length=2, max_length=1000, description="ends and corners, m", examples=[[[0, 0, 0], [2, 0, 0], [2, 1, 0]]]
    )
    bend_radius: NonNegative | tuple[NonNegative, ...] = Field(
        default=0.0, description="radius of all bends, or of each, m; 0: sharp corners"
    )
    flexibility: Positive | None = Field(
        default=None,
        description="flexibility factor of all bends, no unit; default 1.65 r^2 / (t R), 1 at least, for tubes of mean "
        "radius r and wall t, and 1 for other sections",
    )
    up: Direction = Field(default=(0.0, 0.0, 1.0), description="direction of the thickness")
    elements: Whole | None = Field(
        default=None, ge=1, le=10_000, description="about so many elements along straight legs; default 40"
    )
    tension: Number = TENSION


class MemberTable(Table):
    """A branch of a frame, joined rigidly to the axis on which one of its ends lies."""

    structure: Name = Field(description="the frame", examples=["pipe"])
    route: tuple[Direction, ...] = Field(
        min_length=2, max_length=1000, description="ends and corners, m", examples=[[[1, 0, 0], [1, 1, 0]]]
    )
    bend_radius: NonNegative | tuple[NonNegative, ...] = Field(
        default=0.0, description="as of the frame, m; 0: sharp corners"
    )
    flexibility: Positive | None = Field(default=None, description="as of the frame, no unit")
    thickness: Positive | None = Field(default=None, description="as of the frame, m; default the frame's")
    width: Positive | None = Field(
        default=None, description="as of the frame, m; default the thickness where that is given, else the frame's"
    )
    section: Annotated[SectionChoice, BeforeValidator(named)] | None = Field(
        default=None, description="the cross-section, as of the frame; default the frame's"
    )
    material: Material | None = Field(default=None, description="the material; default the frame's")
    up: Direction | None = Field(default=None, description="direction of the thickness; default the frame's")
    added_mass: NonNegative | None = Field(default=None, description="as of the frame, kg/m; default the frame's")
    tension: Number = TENSION
    hinged: tuple[Literal["start", "end"], ...] = Field(
        default=(), max_length=2, description="ends that bend freely", examples=[["end"]]
    )

    def outer_sizes(self, frame: ElementFrame) -> tuple[float, float]:
        """Return thickness and width, m."""
        if self.thickness is None:
            return frame.thickness, self.width or frame.width or frame.thickness
        return self.thickness, self.width or self.thickness


class LumpedMass(Table):
    """A rigid mass with equal springs and dampers to the frame; its point is "at"."""

    type: Literal["mass"] = Field(description="kind of model")
    mass: Positive = Field(description="kg", examples=[1.0])
    motions: Whole = Field(
        default=1, ge=1, le=3, description="1: across its axis, 2: along its own y, too, 3: along its axis, too"
    )
    stiffness: NonNegative = Field(default=0.0, description="spring to the frame in each motion, N/m")
    damping: NonNegative = Field(default=0.0, description="damper to the frame in each motion, N s/m")


ModelChoice = Annotated[
    ImportedMatrices | MeshFile | ModesOfFile | ElementBeam | ElementFrame | RigidBar | LumpedMass,
    OF_TYPE,
]


NODAL = ImportedMatrices | MeshFile
"""Models of nodes with rows in three directions."""


class Reduction(Table):
    """Reduction to the first modes and the static response at each point."""

    modes: Whole = Field(ge=1, le=10_000, description="first modes that are kept", examples=[40])


class PlaceTable(Table):
    """Place of a structure in space."""

    origin: Direction = Field(default=(0.0, 0.0, 0.0), description="start of a beam or bar, or origin of the nodes, m")
    axis: Direction = Field(
        default=(1.0, 0.0, 0.0), description="direction of the beam, or of the x axis of the nodes, no unit"
    )
    across: Direction | None = Field(
        default=None,
        description="direction in which a beam, bar or mass moves, or of the z axis of nodes, across axis, no unit; "
        "default z of space, turned to be across",
        examples=[[0.0, 0.0, 1.0]],
    )

    def made(self) -> Pose:
        """Return the place."""
        return Pose(self.origin, self.axis, self.across)


class TwoPhaseDamping(Table):
    """Damping by a two-phase flow around a tube, from a test or a guide."""

    ratio: Annotated[Positive, Field(lt=1)] = Field(
        description="fraction of critical damping that each mode gets beside `ratio` of the structure, no unit"
    )
    source: str = Field(
        min_length=3, max_length=200, description="where the ratio is from: a report, a guide, a test, with its values",
        examples=["test of 2024, void fraction 0.6"],
    )  # fmt: skip


class BodyTable(Table):
    """A linear body."""

    name: Name = Field(description="unique name")
    model: ModelChoice = Field(description="the kind of model, a table with the type and its keys")
    reduce: Reduction | None = Field(
        default=None, description="reduction to modes and static responses, a table; default none: all DOFs"
    )
    ratio: Annotated[NonNegative, Field(lt=1)] = Field(
        default=0.0,
        description="fraction of critical damping that each mode, masses included, gets beside its own, no unit",
    )
    two_phase: TwoPhaseDamping | None = Field(
        default=None, description="damping by a two-phase flow, a table with its source; default none"
    )
    frame: Direction | None = Field(
        default=None,
        description="direction in which weight and base motions act on matrices or a mesh, no unit; default none",
        examples=[[0.0, 0.0, 1.0]],
    )
    place: PlaceTable | None = Field(
        default=None,
        description="place in space, a table; default none: nodes are where their file says, beams have no place",
    )
    velocity: Number | Direction = Field(
        default=0.0,
        description="velocity of the whole structure with the frame at the start, m/s; a vector where it has a place",
    )

    @property
    def damping(self) -> float:
        """Fraction of critical damping that each mode gets beside its own."""
        return self.ratio + (0.0 if self.two_phase is None else self.two_phase.ratio)


class PointTable(Table):
    """A point of a structure where something touches, acts or is read."""

    name: Name = Field(description="name, unique in its structure", examples=["tip"])
    structure: Name = Field(description="name of its structure", examples=["rack"])
    at: Number | None = Field(
        default=None,
        description="x of a beam or bar, length along the axis of a frame, m; below 0 only of a point that comes later",
        examples=[0.5],
    )
    node: Annotated[Whole, Field(ge=1)] | None = Field(
        default=None, description="node of matrices or a mesh", examples=[12]
    )
    set: str | None = Field(
        default=None,
        min_length=1,
        max_length=80,
        description="set of nodes, whose mean motion is taken",
        examples=["RIM"],
    )
    nearest: Direction | None = Field(default=None, description="coordinates whose nearest place is taken, m")
    dof: str | None = Field(
        default=None,
        min_length=1,
        max_length=20,
        description='"node.direction", or the number of a row from 0 on',
        examples=["12.3"],
    )
    direction: Direction | tuple[Direction, Direction] | tuple[Direction, Direction, Direction] | None = Field(
        default=None,
        description="direction of its motion, or two or three at right angles, no unit",
        examples=[[0.0, 0.0, 1.0]],
    )
    about: Direction | None = Field(
        default=None,
        description="axis of its rotation, rad, of a frame, in place of direction: pairs have an angular play, forces "
        "are moments, N m",
        examples=[[0.0, 1.0, 0.0]],
    )
    rotation: Switch = Field(
        default=False, description="the motion of `dof` is a rotation, rad: forces of pairs are moments, N m"
    )
    stress: Switch = Field(
        default=False,
        description="record axial and von Mises stress: at the surface of a beam or a round frame, on the side of its "
        "direction, or in a mesh along its direction",
    )
    speed: Number | None = Field(
        default=None,
        description="of a point that moves along a beam or a frame from `at` on, for pairs and forces, m/s; default it "
        "stays",
        examples=[20.0],
    )


NAME: Any = Field(default=None, description="name by which loads move it, and of its records", examples=["foot"])
AT: Any = Field(default=None, description="x of a beam, length along the axis of a frame, m", examples=[0.0])
NEAREST: Any = Field(default=None, description="coordinates whose nearest place is taken, m")
FORCE: Any = Field(default=False, description="record its force and moment on a frame; needs a name")


class ClampedBody(Table):
    """Nodes of matrices or a mesh, or a place of a beam, that neither move nor rotate."""

    type: Literal["clamped"] = Field(description="kind of joint")
    name: Name | None = NAME
    structure: Name = Field(description="name of the structure", examples=["rack"])
    nodes: str | tuple[Annotated[Whole, Field(ge=1)] | str, ...] | None = Field(
        default=None, description='set of nodes, or a list of nodes, sets and "node.direction"', examples=["ROOT"]
    )
    at: NonNegative | None = AT
    nearest: Direction | None = NEAREST
    force: Switch = FORCE

    @property
    def labels(self) -> tuple[int | str, ...]:
        """Nodes, sets and DOFs of matrices or a mesh."""
        return (self.nodes,) if isinstance(self.nodes, str) else self.nodes or ()


class PinnedBody(Table):
    """A place of a beam or a frame that does not move, and rotates freely."""

    type: Literal["pinned"] = Field(description="kind of joint")
    name: Name | None = NAME
    structure: Name = Field(description="name of the structure", examples=["tube"])
    at: NonNegative | None = AT
    nearest: Direction | None = NEAREST
    force: Switch = FORCE


class HeldBody(Table):
    """A place of a frame that does not move along a direction."""

    type: Literal["held"] = Field(description="kind of joint")
    name: Name | None = NAME
    structure: Name = Field(description="name of the structure", examples=["pipe"])
    at: NonNegative | None = AT
    nearest: Direction | None = NEAREST
    force: Switch = FORCE
    direction: Direction = Field(description="the direction, no unit", examples=[[0.0, 0.0, 1.0]])


class SpringJoint(Table):
    """A spring and damper between two points, or from a point to the frame, in all motions of the points."""

    type: Literal["elastic"] = Field(description="kind of joint")
    name: Name = Field(default="joint", description="unique name")
    between: tuple[PointName] | tuple[PointName, PointName] = Field(
        description="a point, or two", examples=[["rack.tip", "box.at"]]
    )
    stiffness: NonNegative = Field(description="N/m", examples=[1e4])
    damping: NonNegative = Field(default=0.0, description="N s/m")
    force: Switch = Field(default=False, description="record its force on the first point, which is placed in space")


class SnubberJoint(Table):
    """Free while its point moves slowly; locks as a spring and damper beyond a limit."""

    type: Literal["snubber"] = Field(description="kind of joint")
    name: Name = Field(description="unique name, also among pairs", examples=["lock"])
    between: tuple[PointName] | tuple[PointName, PointName] = Field(
        description="a point of one motion, or two", examples=[["pipe.hanger"]]
    )
    velocity: Positive | None = Field(default=None, description="at which it locks, m/s", examples=[5e-3])
    acceleration: Positive | None = Field(
        default=None, description="at which it locks, m/s^2; velocity or acceleration", examples=[0.2]
    )
    release: NonNegative = Field(description="at which it opens again, m/s or m/s^2, below the lock", examples=[1e-3])
    stiffness: NonNegative = Field(description="of the locked one, from where it locked, N/m", examples=[2e7])
    damping: NonNegative = Field(default=0.0, description="of the locked one beside its spring, N s/m")
    drag: NonNegative = Field(default=0.0, description="of the free one, N s/m")


BodyJoint = Annotated[ClampedBody | PinnedBody | HeldBody | SpringJoint | SnubberJoint, OF_TYPE]


class LoadedPoint(Table):
    """A mass that moves with a point, in all its motions."""

    point: PointName = Field(description="the point", examples=["rack.tip"])
    mass: Positive = Field(description="kg", examples=[0.3])
