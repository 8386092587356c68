"""Tables of the solution of a case: [model], [time], [solver], and [gates] with limits on energy and memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import ceil, inf
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

from pydantic import BeforeValidator, Field

from gapbeam.solver.integrators.scheme_choice import USUAL, Scheme
from gapbeam.solver.schema.table import OF_TYPE, NonNegative, Positive, Switch, Table, Whole, named

STATIONS, MOST_STATIONS = 8, 64  # with eight, the couple of a tilted section on a line is right to 1 %
STATIONS_OF_WAVE = 16  # in a bending wave
RIGID_SHARE = 0.3  # of the first bending frequency, up to which a body may be rigid
THICKNESS_OF_WAVE = 0.125  # thickness over the bending wavelength, up to which beam theory holds
SPACING_OF_WAVE = 0.125  # distance of nodes over the bending wavelength
ELEMENTS_IN_SUPPORT = 5
DENSE = 1000  # DOFs up to which a beam of equal elements is marched whole: its modes take about a second
FEW = 300  # the same of graded elements, which are few where nothing happens: a basis is smaller from there on
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
        length: Length of the beam, m.
        thickness: Thickness of the beam where it is thickest, m.
        wavelength: Wavelength of bending waves of the highest frequency, where they are shortest, m.
        shortest_support: Length of the shortest support, m.
        squeezed: Whether a support is an interference fit, which squeezes the section.
        graded: Number of graded elements that supports and waves ask for.
        around: Whether sections that keep their shape meet all supports: around the beam, or along lines.
        longest_support: Length of the longest support, m.
        rolls: Whether sections that keep their shape meet some supports along lines, and the others as circles.
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
    longest_support: float = 0.0
    rolls: bool = False

    @property
    def stations(self) -> int | None:
        """Sections that touch along each support that they meet; on lines as many as bending waves ask for."""
        if not self.around:
            return None
        wanted = ceil(STATIONS_OF_WAVE * self.longest_support / self.wavelength) if self.rolls else 0
        return min(max(wanted, STATIONS), MOST_STATIONS)


class _AnyModel(Table):
    """Keys and traits of all models.

    Attributes:
        decided: Whether this is a model, and not the wish to have one chosen.
        more_modes: Advice by which its basis gets modes of higher frequencies.
        reasons: Why it was chosen.
    """

    reasons: tuple[str, ...] = Field(
        default=(), max_length=20, description='why it was chosen: written by the model "auto", without effect'
    )

    decided: ClassVar[bool] = True
    more_modes: ClassVar[str] = "more modes in [model]"

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

    gives: ClassVar[frozenset[Wanted]] = frozenset({"motion", "forces", "pressures", "stresses"})
    keeps_sections: ClassVar[bool] = False  # a full model does not prescribe the shape of sections

    type: Literal["full"] = Field(default="full", description="name of the model")


class ReducedModel(_AnyModel):
    """The finite element mesh in a basis of vibration modes and contact shapes."""

    type: Literal["reduced"] = Field(description="name of the model")
    interface: Literal["free", "fixed"] = Field(
        default="free",
        description="free contact faces and residual flexibility, or fixed faces and constraint modes (Craig and "
        "Bampton 1968)",
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
    points_across: Literal["auto", "all"] | Whole = Field(
        default="auto",
        description="contact points across the width, four times as many where the motion is not symmetric "
        "(3D); all: those of the mesh; auto: 1 for solid rectangles, all for others, whose webs carry the load",
    )
    sections: Literal["deformable", "rigid"] = Field(
        default="deformable",
        description="sections in supports around the beam; rigid: they keep their shape",
    )
    stations: Whole | None = Field(
        default=None,
        ge=1,
        le=MOST_STATIONS,
        description="rigid sections along each support, the first and the last at its edges (one or two at Gauss "
        f"points); default {STATIONS} where sections are rigid",
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
    """Beam elements between the contact faces of the mesh."""

    more_modes: ClassVar[str] = "a larger time.frequency"  # its spans have modes above the frequency of interest

    type: Literal["beam"] = Field(description="name of the model")
    elements: Whole = Field(
        default=102,
        ge=2,
        description="number of elements along the beam; where it is left out, more as supports and bending waves ask",
    )
    spacing: Literal["equal", "graded"] = Field(
        default="equal",
        description="graded: short in supports, longer between them as bending waves allow",
    )
    stations: Whole | None = Field(
        default=None,
        ge=1,
        le=MOST_STATIONS,
        description="sections that touch along each support, the first and the last at its edges (one or two at Gauss "
        f"points); default {STATIONS} where all supports are around the beam or meet a round one along lines (there: "
        "more as waves ask for), else the points of the mesh",
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

    def is_whole(self, motions: int) -> bool:
        """Return True where the motions of all nodes are marched, and not those of a basis span by span."""
        return 2 * motions * (self.elements + 1) <= (FEW if self.graded else DENSE)

    def fitted(self, scene: SceneFigures) -> Self:
        """Return the model with its missing keys: enough elements, and a few sections that touch around the beam."""
        given = self.model_fields_set
        whole = self if given & {"elements", "spacing"} else self._resolving(scene)
        return whole if "stations" in given else whole.model_copy(update={"stations": scene.stations})

    def _resolving(self, scene: SceneFigures) -> Self:
        """Return the model with elements as short as bending waves and supports ask for.

        Where equal ones would be many, and graded ones are much fewer, these are taken.
        """
        in_supports = ELEMENTS_IN_SUPPORT * scene.length / scene.shortest_support
        in_waves = scene.length / (SPACING_OF_WAVE * scene.wavelength)
        wanted = max(self.elements, ceil(in_supports - 1e-9), ceil(in_waves))
        if wanted == self.elements or scene.graded > MUCH_FEWER * wanted:
            return self.model_copy(update={"elements": wanted})
        return self.model_copy(update={"elements": scene.graded, "spacing": "graded"})

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
    """A rigid body between the contact faces of the mesh."""

    type: Literal["rigid"] = Field(description="name of the model")
    stations: Whole | None = Field(
        default=None,
        ge=1,
        le=MOST_STATIONS,
        description="sections that touch along each support, as of a beam; default that of a beam where flat walls are "
        "met along lines, else the points of the mesh",
    )

    @property
    def rings(self) -> int | None:
        """Sections that touch along each support; None: points of the mesh touch."""
        return self.stations

    def fitted(self, scene: SceneFigures) -> Self:
        """Return the model with sections that touch flat walls along lines, where all supports can be met so."""
        lines = scene.rolls and "stations" not in self.model_fields_set
        return self.model_copy(update={"stations": scene.stations}) if lines else self

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
    """The simplest model that gives the wanted results."""

    type: Literal["auto"] = Field(description="name of the model")
    wanted: Literal["auto"] | Wanted = Field(
        default="auto",
        description="results of interest; auto: stresses where probes or fields have them, else motion",
    )

    decided: ClassVar[bool] = False


ModelTable = Annotated[FullModel | ReducedModel | BeamModel | RigidModel | AutoModel, OF_TYPE]


class Time(Table):
    """Span, step and scheme."""

    elsewhere: ClassVar[Mapping[str, str]] = {
        "start": "a run begins at t = 0",
        "steps": "their number is `end` over `step`",
    }

    end: Positive = Field(description="end of the run, s", examples=[0.6])
    step: Literal["auto"] | Positive = Field(
        default="auto",
        description="time step, s; auto: from the highest frequency of interest and the contact",
        examples=[1.0e-4],
    )
    frequency: Positive | None = Field(
        default=None,
        description="highest frequency of interest, Hz; default 5 times the highest of the loads, or the "
        "second bending frequency of the overhang if larger",
    )
    scheme: Annotated[Scheme, BeforeValidator(named)] = Field(
        default=USUAL,
        description="time integration: a name, or a table with the type and its keys",
    )
    adaptive: Switch = Field(
        default=False,
        description="halve steps in which a face opens or closes, or the scheme changes the energy",
    )
    max_halvings: Whole = Field(
        default=6,
        ge=0,
        le=20,
        description="most halvings of a step that does not converge, or of an adaptive one",
    )
    max_iterations: Whole = Field(
        default=60, ge=1, le=1000, description="largest number of iterations of one contact solve"
    )


Tolerance = Annotated[float, Field(ge=1.0e-13, le=1.0e-4)]


class SolverTable(Table):
    """Linear solver for the effective operator of finite elements; without effect on beams and rigid bodies."""

    effective: Literal["auto", "factor", "iterative"] = Field(
        default="auto",
        description="factor: Cholesky factor by MUMPS; iterative: conjugate gradients with multigrid; auto: a factor "
        "while it fits in memory",
    )
    tolerance: Tolerance = Field(
        default=1.0e-9, description="of conjugate gradients: error over solution in the energy norm, no unit"
    )
    columns: Literal["auto", "keep", "drop"] = Field(
        default="auto",
        description="responses to forces at the faces: kept, a step takes one back-substitution; dropped, two; auto: "
        "kept while they fit",
    )
    memory: Positive | None = Field(
        default=None, description="memory that auto counts on, over all ranks, GB; default 90 % of what is free"
    )


Bound = Positive | Literal["never"] | None


def _limit(quantity: str) -> Any:
    """Return the key of a limit that is usual by default, by the quantity that it is of, with its unit."""
    return Field(default=None, description=quantity)


class AssumptionLimits(Table):
    """Other limits of the assumptions that a run watches, by their names in the summary; "never" is no limit."""

    small_rotation: Bound = _limit("largest rotation, rad")
    small_strain: Bound = _limit("largest strain at the surface, no unit")
    inside_the_support: Bound = _limit("travel along the support over its length, no unit")
    radii_in_supports_around_the_beam: Bound = _limit("largest motion across the beam over its radius, no unit")
    linear_seat: Bound = _limit("largest rotation at the start, rad")
    penetration_beside_the_thickness: Bound = _limit("largest penetration over the thickness, no unit")
    penetration_beside_the_clearance: Bound = _limit("largest penetration over the clearance, no unit")
    contacts_resolved_by_the_step: Bound = _limit("impulse in contacts of few steps over the whole, no unit")
    weak_restraint: Bound = _limit("energy of the restraint over the energy of the beam, no unit")
    step_beside_the_frequencies: Bound = _limit("mean error of periods by the scheme, no unit")
    damping_of_the_scheme: Bound = _limit("share of the amplitude that the scheme takes, no unit")
    resonance_beside_the_scheme: Bound = _limit("share of a resonant amplitude that the scheme takes, no unit")
    mesh_beside_the_wavelengths: Bound = _limit("distance of nodes over the wavelength, no unit")
    basis_beside_the_frequencies: Bound = _limit("highest frequency over the highest of the basis, no unit")
    beam_model_beside_the_wavelengths: Bound = _limit("thickness over the wavelength, no unit")
    rigid_model_beside_the_frequencies: Bound = _limit("highest frequency over the first of the beam, no unit")
    bounded_motion: Bound = _limit("growth of a motion that no contact limits, in the digits of a number, no unit")
    digits_of_matrices: Bound = _limit("part of a first frequency that the digits of matrices leave unknown, no unit")
    energy_under_noise_kept_by_the_scheme: Bound = _limit("energy that the scheme took or created, no unit")

    def of(self, assumption: str) -> float | None:
        """Return the limit of an assumption, infinite for "never"; None: the usual one."""
        asked: float | str | None = getattr(self, assumption.replace(" ", "_"), None)
        return inf if isinstance(asked, str) else asked


class Gates(Table):
    """Limits on energy that the algorithm creates or loses, on memory, and on assumptions."""

    impact_loss: NonNegative = Field(default=0.008, description="largest algorithmic loss in one impact, no unit")
    impact_growth: NonNegative = Field(default=0.0025, description="largest algorithmic growth in one impact, no unit")
    total_growth: Positive = Field(default=0.05, description="cumulative growth that ends the run, no unit")
    total_loss: Positive = Field(
        default=0.1, description="largest algorithmic loss in the whole run that ends with status 0, no unit"
    )
    accept_energy_loss: Switch = Field(default=False, description="end with status 0 in spite of such a loss")
    accept_energy_growth: Switch = Field(default=False, description="go on, and end with status 0, in spite of growth")
    accept_lack_of_memory: Switch = Field(
        default=False, description="run a model that is expected to need more memory than is free"
    )
    warnings: AssumptionLimits = Field(
        default=AssumptionLimits(),
        description="values of assumptions above which a run warns",
    )
    failures: AssumptionLimits = Field(
        default=AssumptionLimits(),
        description="values of assumptions above which a run ends with status 4",
    )
