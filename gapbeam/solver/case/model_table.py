"""The table [model]: the fidelity level that a case is computed on."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil
from typing import Annotated, ClassVar, Literal, NamedTuple, Self

from pydantic import Field

from gapbeam.solver.table import Positive, Table, Whole

STATIONS = 8
RIGID_SHARE = 0.3  # of the first bending frequency, up to which a body may be rigid
THICKNESS_OF_WAVE = 0.125  # thickness over the bending wavelength, up to which beam theory holds
SPACING_OF_WAVE = 0.125  # distance of nodes over the bending wavelength
ELEMENTS_IN_SUPPORT = 5
MUCH_FEWER = 0.5  # of as many equal elements: graded ones
MODES_BEYOND = 2  # modes for each half wave along the beam: those across its plane, along it and in torsion, too

Wanted = Literal["motion", "forces", "pressures", "stresses"]


class SceneFigures(NamedTuple):
    """Figures of a scene by which models are chosen.

    Attributes:
        wanted: Results of interest.
        driven: Highest frequency of loads and of contacts, Hz; infinite where the contact is as stiff as the mesh.
        first_bending: First bending frequency, Hz.
        highest: Highest frequency of interest, Hz.
        length: Of the beam, m.
        thickness: Of the beam where it is thickest, m.
        wavelength: Of bending waves of the highest frequency, where they are shortest, m.
        shortest_support: Length of the shortest support, m.
        squeezed: Whether a support is an interference fit, which squeezes the section.
        graded: Number of graded elements that supports and waves ask for.
        around: Whether all supports are around the beam.
    """

    wanted: Wanted
    driven: float
    first_bending: float
    highest: float
    length: float
    thickness: float
    wavelength: float
    shortest_support: float
    squeezed: bool = False
    graded: int = 0
    around: bool = False


class _AnyModel(Table):
    """Keys and traits of all models.

    Attributes:
        decided: Whether this is a model, and not the wish to have one chosen.
        reasons: Why it was chosen.
    """

    reasons: tuple[str, ...] = Field(
        default=(), max_length=20, description='why it was chosen: written by the model "auto", without effect'
    )

    decided: ClassVar[bool] = True

    @property
    def gives(self) -> frozenset[Wanted]:
        """Kinds of results that the model can give."""
        return frozenset({"motion"})

    def fitted(self, scene: SceneFigures) -> Self:
        """Return the model with as many DOFs as the frequencies of a scene ask for."""
        del scene
        return self

    def doubts(self, scene: SceneFigures) -> Iterator[str]:
        """Yield the reasons for which a scene exceeds the range of the model, besides the contradictions of a case."""
        if scene.wanted not in self.gives:
            yield f"it does not give {scene.wanted}"

    @property
    def rings(self) -> int | None:
        """Rigid sections along each support around the beam; None: none, contact is on the surface of the mesh."""
        return None

    @property
    def keeps_sections(self) -> bool:
        """True where sections keep their shape in supports around the beam."""
        return True


class FullModel(_AnyModel):
    """All DOFs of the finite element mesh, condensed onto the contact points in each step: exact."""

    type: Literal["full"] = Field(default="full", description="name of the model")

    @property
    def gives(self) -> frozenset[Wanted]:
        """All."""
        return frozenset({"motion", "forces", "pressures", "stresses"})

    @property
    def keeps_sections(self) -> bool:
        """False: a full model does not prescribe the shape of sections."""
        return False


class ReducedModel(_AnyModel):
    """The finite element mesh in a basis of vibration modes and of shapes that contact and loads give it."""

    type: Literal["reduced"] = Field(description="name of the model")
    interface: Literal["free", "fixed"] = Field(
        default="free",
        description="modes with free contact faces and residual flexibility, or with fixed faces and "
        "constraint modes (Craig and Bampton 1968)",
    )
    modes: Whole = Field(
        default=24, ge=0, le=1000, description="number of elastic modes; those below `frequency` where that is given"
    )
    frequency: Positive | None = Field(
        default=None, description="all modes below this frequency, Hz; default the number `modes`"
    )
    contact: Literal["shapes", "all"] = Field(
        default="shapes",
        description="flexibility of the contact faces that is kept: of `shapes` along the support, or of every "
        "interface DOF",
    )
    shapes: Whole = Field(
        default=13, ge=2, le=200, description="number of hat functions along each face, times 1 and y^2 across it"
    )
    points_across: Literal["all"] | Whole = Field(
        default=1,
        description="contact points across the width, four times as many where the motion is not symmetric "
        "(3D); all: those of the mesh",
    )
    sections: Literal["deformable", "rigid"] = Field(
        default="deformable",
        description="sections of a solid in supports around it; rigid: they keep their shape, which is faster"
        " and leaves out that tubes get oval",
    )
    stations: Whole | None = Field(
        default=None,
        ge=1,
        le=20,
        description=f"rigid sections along each support, at Gauss points; default {STATIONS} where sections are rigid",
    )

    @property
    def rings(self) -> int | None:
        """Rigid sections along each support around the beam; None: sections deform."""
        return None if self.sections == "deformable" else self.stations or STATIONS

    @property
    def keeps_sections(self) -> bool:
        """True where sections are rigid."""
        return self.sections == "rigid"

    @property
    def gives(self) -> frozenset[Wanted]:
        """Pressures only where every interface DOF is kept: others are spread over shapes."""
        spread: frozenset[Wanted] = frozenset({"motion", "forces", "stresses"})
        return spread | {"pressures"} if self.contact == "all" else spread

    def fitted(self, scene: SceneFigures) -> Self:
        """Return the model with modes beyond the highest frequency of interest."""
        half_waves = ceil(2.0 * scene.length / scene.wavelength)
        return self.model_copy(update={"modes": min(max(self.modes, 2 * MODES_BEYOND * half_waves), 1000)})


BeamMotion = Literal["bending", "lateral", "axial", "torsion"]


class BeamModel(_AnyModel):
    """Beam elements between the contact faces of the mesh, with the motions that a case asks for."""

    type: Literal["beam"] = Field(description="name of the model")
    elements: Whole = Field(default=102, ge=2, description="number of elements along the beam")
    spacing: Literal["equal", "graded"] = Field(
        default="equal",
        description="equal elements, or graded ones: short in supports and longer between them, as bending waves allow",
    )
    stations: Whole | None = Field(
        default=None,
        ge=1,
        le=20,
        description="sections that touch along each support around the beam, at Gauss points; default the points of "
        "the mesh",
    )
    motions: Literal["auto"] | tuple[BeamMotion, ...] = Field(
        default="auto",
        description="motions: bending in the plane and across it, axial stretching, torsion; auto: what the "
        "case calls for",
        examples=[["bending", "axial", "torsion"]],
    )

    @property
    def rings(self) -> int | None:
        """Sections that touch along each support around the beam; None: points of the mesh touch."""
        return self.stations

    @property
    def graded(self) -> bool:
        """True where elements are shorter in supports than between them."""
        return self.spacing == "graded"

    def fitted(self, scene: SceneFigures) -> Self:
        """Return the model with elements as short as bending waves and supports ask for.

        Where equal ones would be many, and graded ones are much fewer, these are taken, and a few sections touch.
        """
        in_supports = ELEMENTS_IN_SUPPORT * scene.length / scene.shortest_support
        in_waves = scene.length / (SPACING_OF_WAVE * scene.wavelength)
        wanted = max(self.elements, ceil(in_supports - 1e-9), ceil(in_waves))
        if wanted == self.elements or scene.graded > MUCH_FEWER * wanted:
            return self.model_copy(update={"elements": wanted})
        stations = STATIONS if scene.around else None
        return self.model_copy(update={"elements": scene.graded, "spacing": "graded", "stations": stations})

    def doubts(self, scene: SceneFigures) -> Iterator[str]:
        """Yield results of the section, squeezed sections, and waves that are short compared with the thickness."""
        yield from super().doubts(scene)
        if scene.squeezed:
            yield "an interference fit squeezes sections, and those of a beam keep their shape"
        share = scene.thickness / scene.wavelength
        if share > THICKNESS_OF_WAVE:
            yield (
                f"at {scene.highest:.4g} Hz bending waves are {scene.wavelength:.3g} m long: the thickness is "
                f"{share:.2g} of that, and beam theory holds up to {THICKNESS_OF_WAVE:g}"
            )


class RigidModel(_AnyModel):
    """The beam as a rigid body between the contact faces of the mesh: three motions in 2D, six in 3D."""

    type: Literal["rigid"] = Field(description="name of the model")

    def doubts(self, scene: SceneFigures) -> Iterator[str]:
        """Yield results of a body that deforms, and loads or contacts that make the beam bend."""
        yield from super().doubts(scene)
        if scene.driven > RIGID_SHARE * scene.first_bending:
            driven = (
                f"{scene.driven:.4g} Hz" if scene.driven < float("inf") else "a contact that is not a soft linear one"
            )
            yield (
                f"{driven} bends a beam whose first bending frequency is {scene.first_bending:.4g} Hz; a rigid body "
                f"goes up to {RIGID_SHARE:g} of it"
            )


class AutoModel(_AnyModel):
    """The simplest model that gives what is wanted of the scene; chosen when the case is read."""

    type: Literal["auto"] = Field(description="name of the model")
    wanted: Literal["auto"] | Wanted = Field(
        default="auto",
        description="results of interest; auto: stresses where probes or fields have them, else motion",
    )

    decided: ClassVar[bool] = False


ModelTable = Annotated[FullModel | ReducedModel | BeamModel | RigidModel | AutoModel, Field(discriminator="type")]
