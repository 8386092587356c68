"""The case file as frozen pydantic models, and its text with every default.

SI units throughout, frequencies in Hz. The beam axis is x, with x = 0 at the supported end; the bending
direction is y in 2D and z in 3D; the beam rests on the base (below) under the gland (above), or in several supports.

Reading, overriding and the reporting of faults are in `reading.case_reader`; contradictions between tables are
found by `gapbeam.solver.case.checks.all_checks`.

The table [contact] has formulation and law with their figures, [wear] measures the work of sliding, and a [[support]]
may name a contact law of its own.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, ClassVar, Literal

from pydantic import BaseModel, BeforeValidator, Discriminator, Field, Tag

from gapbeam.solver.case.analysis_table import Analysis, Transient
from gapbeam.solver.case.beam_profile import Beam, BeamProfile, Material, PlacedSegment
from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.case.reading.value_words import toml_value
from gapbeam.solver.case.solution_tables import FullModel, Gates, ModelTable, SolverTable, Time
from gapbeam.solver.contact.formulations.formulation_choice import Formulation, Penalty
from gapbeam.solver.contact.laws.law_choice import KelvinVoigt, Law
from gapbeam.solver.contact.laws.law_tables import ChosenLaw
from gapbeam.solver.loads.attachments import JointChoice, PlacedFluid, PointMass
from gapbeam.solver.loads.load_choice import NO_LOADS, Load
from gapbeam.solver.schema.table import (
    FORMS,
    Name,
    NonNegative,
    Number,
    Positive,
    Switch,
    Table,
    Vector,
    Whole,
    named,
    placed_along,
)
from gapbeam.solver.supports.layout import Layout
from gapbeam.solver.supports.support_tables import BaseAndGland, OneOfSeveral, OneSupport


class Friction(Table):
    """Coulomb friction on base and gland, with a velocity over which it sets in."""

    coefficient: Number = Field(ge=0, le=100, description="coefficient of friction mu, no unit", examples=[0.2])
    static_coefficient: Number | None = Field(
        default=None,
        ge=0,
        le=100,
        description="coefficient of friction of points that stick, at least that of points that slide, no unit; "
        "default coefficient",
        examples=[0.3],
    )
    slip_velocity: Literal["auto"] | Positive = Field(
        default="auto",
        description="velocity v0 at which friction has 71 % of its limit, m/s; auto: 1 % of the sliding of a "
        "rocking beam",
    )

    def at_support(self, friction: float | None, static_friction: float | None) -> tuple[float, float]:
        """Return the coefficients of sliding and of sticking at a support with its own figures, or None."""
        sliding = self.coefficient if friction is None else friction
        usual = self.static_coefficient if friction is None else friction
        sticking = usual if static_friction is None else static_friction
        return sliding, sliding if sticking is None else sticking


def whole_unit(law: ChosenLaw) -> str:
    """Return the unit of the stiffness of a whole support, or of a point."""
    exponent = law.spring_exponent
    return "N/m" if exponent == 1.0 else f"N/m^{exponent:g}"


class Contact(Table):
    """Unilateral contact at base and gland."""

    formulation: Annotated[Formulation, BeforeValidator(named)] = Field(
        default=Penalty(), description="contact formulation: a name, or a table with the type and its keys"
    )
    law: Annotated[Law, BeforeValidator(named)] = Field(
        default=KelvinVoigt(), description="pressure over penetration: a name, or a table with the type and its keys"
    )
    stiffness: Literal["auto"] | Positive = Field(
        default="auto",
        description="penalty stiffness K per area (of each of contact.points in N/m; with an exponent n "
        "/m^n), Pa/m; auto: from load, clearance and modulus",
    )
    damping: NonNegative = Field(
        default=0.0,
        description="damping of the law kelvin-voigt per area (of each of contact.points in N s/m), Pa s/m",
    )
    points: tuple[Number | tuple[Number, Number], ...] | None = Field(
        default=None,
        max_length=1000,
        description="places of resultant springs at base and gland, each x (over the whole width) or [x, y] "
        "(3D), m; default contact all over the faces",
        examples=[[0.0, 0.05]],
    )
    patch: Literal["auto"] | Positive = Field(
        default="auto",
        description="size along x, and across for [x, y], of the patch that each of contact.points is spread over, "
        "m; auto: a tenth of support.length",
    )
    tension: Literal["clipped", "adhesive"] = Field(
        default="clipped",
        description="adhesive: the damper may pull while the face separates",
    )
    mass: Literal["consistent", "redistributed"] = Field(
        default="consistent",
        description="mass of the contact nodes; redistributed: moved into the body",
    )
    friction: Friction | None = Field(
        default=None, description="Coulomb friction on both faces, a table; default none: no friction"
    )
    quadrature_degree: Whole | None = Field(
        default=None,
        ge=1,
        le=20,
        description="quadrature degree on the contact faces; default 2*mesh.degree + 2",
    )
    touch_depth: Literal["auto"] | Positive = Field(
        default="auto",
        description="depth over which damping sets in (Newmark, generalized-alpha), m; auto: 1e-6 of the "
        "thickness, at most 1e-4 of the clearance",
    )

    @property
    def stiffness_unit(self) -> str:
        """Unit of `stiffness`."""
        return self.unit_with(self.law)

    def unit_with(self, law: ChosenLaw) -> str:
        """Return the unit of the stiffness of a law."""
        exponent = law.spring_exponent
        return ("Pa/m" if self.points is None else "N/m") + ("" if exponent == 1.0 else f"^{exponent:g}")

    @property
    def damping_unit(self) -> str:
        """Unit of `damping`, of the contact and of its law."""
        return "Pa s/m" if self.points is None else "N s/m"

    @property
    def usual_friction(self) -> Friction:
        """The friction of supports without a coefficient of their own: 0 without the table."""
        return self.friction or Friction(coefficient=0.0)


class Wear(Table):
    """Archard's law: the volume worn is a coefficient times the work of sliding, the integral of N |v_t| over time."""

    coefficient: NonNegative | None = Field(
        default=None,
        description="volume worn per work of sliding (m^3/J), 1/Pa; default none: only the work is measured",
        examples=[2.0e-14],
    )
    area: Positive | None = Field(
        default=None,
        description="worn area of each face, over which the volume is spread, m^2; default none: no depth is given",
        examples=[1.0e-5],
    )
    depth_limit: Positive | None = Field(
        default=None,
        description="depth at which the life of a face ends, for `gapbeam life`, m; default none",
        examples=[0.2e-3],
    )
    growth: Literal["even", "local"] = Field(
        default="even",
        description="growth of gaps in a life: even by the depth of the face, local by the depth of each contact point",
    )
    impact_time: Literal["auto"] | Positive = Field(
        default="auto",
        description="duration of the impact at the start of each contact, s; auto: half a period of the contact",
    )


def advised_scheme(contact: Contact) -> str:
    """Return the implicit scheme that fits a contact: it conserves energy where the contact has a potential."""
    return "implicit-midpoint" if contact.formulation.without_potential else "discrete-gradient"


class SupportWithLaw(OneOfSeveral):
    """A [[support]] without its place, with a contact law of its own."""

    law: Annotated[Law, BeforeValidator(named)] | None = Field(
        default=None,
        description="contact law: a name, or a table with the type and its keys; default that of [contact]",
    )

    def without_play(self) -> OneOfSeveral:
        """Return the support with everything taken out that changes its gaps, its contact law and its body alone."""
        return super().without_play().model_copy(update={"law": None})


PlacedSupport = placed_along(
    SupportWithLaw,
    "PlacedSupport",
    "the support",
    (0.2, 0.22),
    "A support along the beam; the beam touches the faces of its region.",
)


def _form(value: object) -> str:
    """Return whether supports are given as one table or as an array of tables."""
    return FORMS[isinstance(value, list | tuple)]


SupportTables = Annotated[
    Annotated[BaseAndGland, Tag(FORMS[0])] | Annotated[tuple[PlacedSupport, ...], Field(min_length=1), Tag(FORMS[1])],  # type: ignore[valid-type]
    Discriminator(_form),
]
"""[support] or [[support]]."""


def own_law(support: OneSupport) -> ChosenLaw | None:
    """Return the contact law that a support names; None: that of [contact] acts there."""
    return support.law if isinstance(support, SupportWithLaw) else None


def law_at(contact: Contact, support: OneSupport | None) -> ChosenLaw:
    """Return the contact law that acts at a support; None: at one without a law of its own."""
    own = None if support is None else own_law(support)
    return contact.law if own is None else own


def damps(contact: Contact, support: OneSupport) -> bool:
    """Return whether the contact at a support dissipates energy in its normal direction: by its law, or by damping."""
    own = contact.damping if takes_damping(contact, support) else support.damping or support.support_damping
    return law_at(contact, support).dissipates or bool(own)


def takes_damping(contact: Contact, support: OneSupport) -> bool:
    """Return whether the damping of [contact] acts at a support, whose law takes one and computes none."""
    law = law_at(contact, support)
    given = (support.damping, support.support_damping, getattr(law, "restitution", None))
    return law.takes_damping and all(value is None for value in given)


def acting_friction(contact: Contact, layout: Layout) -> Friction | None:
    """Return the friction of a case; None where no support has a coefficient above 0."""
    usual = contact.usual_friction
    return usual if any(usual.at_support(own, None)[0] > 0.0 for own in layout.own("friction")) else None


class Damping(Table):
    """Rayleigh damping C = mass M + stiffness K, by two frequencies and ratios or coefficients, and modal damping."""

    elsewhere: ClassVar[Mapping[str, str]] = {
        "alpha": "`mass` is the coefficient of M",
        "beta": "`stiffness` is the coefficient of K",
    }

    frequencies: tuple[Positive, Positive] | None = Field(
        default=None, description="two frequencies, Hz", examples=[[40.0, 300.0]]
    )
    ratios: tuple[NonNegative, NonNegative] | None = Field(
        default=None,
        description="fractions of critical damping at the two frequencies, no unit",
        examples=[[0.01, 0.01]],
    )
    mass: NonNegative | None = Field(default=None, description="coefficient of the mass matrix, 1/s", examples=[4.4])
    stiffness: NonNegative | None = Field(
        default=None, description="coefficient of the stiffness matrix, s", examples=[9.4e-6]
    )
    ratio: NonNegative | None = Field(
        default=None,
        lt=1,
        description="fraction of critical damping of every mode free of contact, added to Rayleigh damping; "
        'not for full models; without [model] implies `type = "reduced"`, no unit; default none',
        examples=[0.01],
    )


MOST_CELLS = 200  # through the thickness or across the width


class Restraint(Table):
    """The weak tangential springs, spread over both contact faces, that keep the beam from sliding away."""

    axial: Literal["auto"] | Positive = Field(
        default="auto",
        description="total stiffness along x, N/m; auto: 0 where joints hold the beam, else at most 1e-6 E A "
        "/ L, under friction 1e-11 E A / L",
    )
    lateral: Literal["auto"] | Positive = Field(
        default="auto",
        description="total stiffness across the bending plane (3D), N/m; auto: likewise",
    )


class Mesh(Table):
    """Mesh by gmsh, or from a file with the physical groups body, base and gland."""

    dimension: Literal[2, 3] = Field(
        default=2,
        description="2: a slice in the bending plane, 3: the solid beam; default 3 where a section is no rectangle",
    )
    plane: Literal["stress", "strain"] = Field(default="stress", description="2D assumption")
    cell: Literal["triangle", "quadrilateral", "tetrahedron", "hexahedron"] | None = Field(
        default=None, description="cell shape; default quadrilateral in 2D, hexahedron in 3D"
    )
    degree: Literal[1, 2] = Field(default=2, description="polynomial degree of the displacement")
    size: Positive | None = Field(default=None, description="cell size far from the support, m; default thickness")
    support_size: Positive | None = Field(
        default=None, description="cell size along x in the support, m; default thickness/3"
    )
    edge_size: Positive | None = Field(
        default=None, description="cell size at the edge of the base, m; default support_size/2"
    )
    cells_through_thickness: Whole | None = Field(
        default=None, ge=1, le=MOST_CELLS, description="number of cells in the bending direction; default 4"
    )
    cells_across_width: Whole | None = Field(
        default=None, ge=1, le=MOST_CELLS, description="number of cells across the bending plane in 3D; default 4"
    )
    file: str | None = Field(
        default=None,
        min_length=1,
        description="gmsh .msh file to use instead, relative to the case file",
    )


class Probe(Table):
    """A point whose motion is recorded."""

    name: Name = Field(description="unique name, in results", examples=["tip"])
    point: Number | Vector = Field(description="x on the axis, or all coordinates, m", examples=[0.51])
    stress: Switch = Field(
        default=False, description="record axial and von Mises stress at the point, which is in the material"
    )
    rotation: Switch = Field(
        default=False, description="record the rotation of the cross-section at the point, in the bending plane"
    )


class Output(Table):
    """Files and intervals of the output."""

    history_interval: Positive | None = Field(default=None, description="time between history records, s; default step")
    fields_interval: Positive | None = Field(default=None, description="time between XDMF fields, s; default end/100")
    stress: Switch = Field(
        default=False,
        description="write axial and von Mises stress among the fields",
    )
    points: Switch = Field(
        default=False,
        description="write first touch, contact share, largest penetration and impulse of each contact point",
    )
    checkpoint_interval: NonNegative = Field(
        default=300.0, description="wall time between checkpoints, from which a run resumes, s; 0: none"
    )
    keep_checkpoint: Switch = Field(
        default=False,
        description="keep a checkpoint of the end, for analysis.state of another case",
    )
    keep_states: tuple[Positive, ...] = Field(
        default=(),
        max_length=1000,
        description="times of further checkpoints to keep, each at the nearest step, for analysis.state_time of "
        "another case, s; default none",
        examples=[[0.1, 0.2]],
    )
    wall_time: Positive | None = Field(
        default=None, description="wall time after which a run writes a checkpoint and stops, s; default none"
    )
    smoothing_window: Positive | None = Field(
        default=None,
        description="time over which the smoothed acceleration is a mean, s; default a twentieth of the forcing "
        "period, else of the first bending period, at most of the run",
        examples=[2.5e-3],
    )
    errors: Literal["companions", "thorough", "none"] = Field(
        default="companions",
        description="error estimate of a finished run: from companions that march at most twice its steps; "
        '"thorough": seven times; or none',
    )


class Case(Table):
    """A whole case."""

    title: str = Field("", max_length=200, description="one line that says what the case shows")
    units: Literal["m-kg-s", "mm-t-s", "mm-kg-s"] | None = Field(
        default=None,
        description="units of the numbers of the file; overrides, files that the case names, "
        "and results are SI; default SI",
        examples=["mm-t-s"],
    )
    beam: Beam
    material: Material
    segment: tuple[PlacedSegment, ...] = Field(  # type: ignore[valid-type]
        default=(), description="parts of the beam with another outer size, section or material"
    )
    damping: Damping = Damping()
    support: SupportTables = Field(
        description="the base and gland at x = 0, as a table, or any supports along the beam, as an array of tables"
    )
    restraint: Restraint = Restraint()
    joint: tuple[JointChoice, ...] = Field(default=(), description="joints, which hold cross-sections without play")
    mass: tuple[PointMass, ...] = Field(default=(), description="masses on the beam")
    fluid: tuple[PlacedFluid, ...] = Field(default=(), description="still fluid around parts of the beam")  # type: ignore[valid-type]
    mesh: Mesh = Mesh()
    model: Annotated[ModelTable, BeforeValidator(named)] = Field(
        default=FullModel(), description="fidelity level: a name, or a table with the type and its keys"
    )
    contact: Contact = Contact()
    wear: Wear | None = Field(
        default=None, description="work rate and wear of the supports, a table; default none: not measured"
    )
    load: tuple[Load, ...] = Field(default=NO_LOADS, description="loads acting together")
    probe: tuple[Probe, ...] = Field(default=(), description="points whose motion is recorded")
    figure: tuple[Figure, ...] = Field(default=(), description="results of one's own")
    time: Time
    analysis: Analysis = Transient()
    solver: SolverTable = SolverTable()
    gates: Gates = Gates()
    output: Output = Output()

    @property
    def layout(self) -> Layout:
        """Layout of the supports: their places and their play."""
        return Layout.of(self.support)

    @property
    def friction(self) -> Friction | None:
        """The friction that acts at some support; none: it acts at none."""
        return acting_friction(self.contact, self.layout)

    @property
    def follows_faces(self) -> bool:
        """True where motion along the faces of supports is followed: for friction, or for the work of sliding."""
        return self.friction is not None or self.wear is not None

    @property
    def profile(self) -> BeamProfile:
        """Cross-section and material of the beam along x."""
        return BeamProfile.of(self.beam, self.material, self.segment)


WIDE = 60  # characters of a line, beyond which comments of others do not stand behind it


def case_to_toml(case: Table, heading: Sequence[str] = ()) -> str:
    """Return a case as a case file with every default, which reads back to an equal case.

    Args:
        case: The case, or the tables of a file of several structures.
        heading: Lines for the comment that opens the file, such as versions.
    """
    lines = [f"# {line}".rstrip() for line in "\n".join(heading).splitlines()]
    lines += [f"{name} = {toml_value(value)}" for name, value in case if isinstance(value, str)]
    for name, value in case:
        if isinstance(value, BaseModel):
            lines += ["", f"[{name}]  {_purpose(value)}", *_keys(value)]
        elif isinstance(value, tuple):
            for entry in value:
                lines += ["", f"[[{name}]]  {_purpose(entry)}", *_keys(entry)]
    return "\n".join(lines) + "\n"


def _purpose(table: BaseModel) -> str:
    return "# " + (inspect.getdoc(type(table)) or "").split("\n")[0]


def _keys(table: BaseModel) -> Iterator[str]:
    """Yield a line for every key, with its meaning behind it; keys without a value stand in comments."""
    keys = sorted(type(table).model_fields, key=lambda key: {"type": 0, "name": 1}.get(key, 2))
    given = {key: f"{key} = {_written(getattr(table, key))}" for key in keys if getattr(table, key) is not None}
    widest = max((len(line) for line in given.values() if len(line) <= WIDE), default=0)
    for key in keys:
        line = f"{given[key]:{widest}}  # " if key in given else f"# {key}: not given; "
        yield line + (type(table).model_fields[key].description or "")


def _written(value: object) -> str:
    """Return a value as TOML writes it, an inner table in one line."""
    if isinstance(value, BaseModel):
        given = (f"{key} = {_written(inner)}" for key, inner in value if inner is not None)
        return "{ " + ", ".join(given) + " }"
    if isinstance(value, tuple) and any(isinstance(one, BaseModel) for one in value):
        return "[" + ", ".join(map(_written, value)) + "]"
    return toml_value(value)


def with_checksums(case: Case) -> Case:
    """Return a case whose loads have the checksums of their files.

    Raises:
        RecordError: The file of a load cannot be used, or is another one than its checksum says.
    """
    return case.model_copy(update={"load": tuple(load.with_checksum() for load in case.load)})
