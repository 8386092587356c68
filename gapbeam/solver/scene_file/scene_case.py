"""The file of a scene of several structures as frozen pydantic models."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field

from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.case.solution_tables import Gates
from gapbeam.solver.loads.scene_load_choice import SceneLoad
from gapbeam.solver.scene import linear_scheme
from gapbeam.solver.scene_file.feedback_tables import FeedbackTable
from gapbeam.solver.scene_file.pair_tables import PairContact, PairTable
from gapbeam.solver.scene_file.structure_tables import BodyJoint, BodyTable, LoadedPoint, MemberTable, PointTable
from gapbeam.solver.schema.table import OF_TYPE, MadeTable, Number, Positive, Table, named


class MidpointRule(MadeTable):
    """The midpoint rule: conserves energy in contact at any step."""

    make = partial(linear_scheme.theta, 0.5)
    type: Literal["midpoint"] = Field(description="name of the scheme")


class EulerRule(MadeTable):
    """Implicit Euler: of order 1; damps all that a step does not resolve."""

    make = linear_scheme.euler
    type: Literal["euler"] = Field(description="name of the scheme")


class NewmarkRule(MadeTable):
    """Newmark's scheme, beta 1/4 and gamma 1/2."""

    make = linear_scheme.newmark
    type: Literal["newmark"] = Field(description="name of the scheme")


class HhtRule(MadeTable):
    """The scheme of Hilber, Hughes and Taylor."""

    make = linear_scheme.hht
    type: Literal["hht"] = Field(description="name of the scheme")
    damping: Number = Field(default=0.05, ge=0.0, le=1.0 / 3.0, description="-alpha, no unit")


class GeneralizedAlphaRule(MadeTable):
    """The generalized-alpha scheme."""

    make = linear_scheme.generalized_alpha
    type: Literal["generalized-alpha"] = Field(description="name of the scheme")
    rho: Number = Field(default=0.8, ge=0.0, le=1.0, description="spectral radius at infinite frequency, no unit")


SceneScheme = Annotated[MidpointRule | EulerRule | NewmarkRule | HhtRule | GeneralizedAlphaRule, OF_TYPE]


class SceneTime(Table):
    """Span, step and scheme."""

    end: Positive = Field(description="end of the run, s", examples=[0.2])
    step: Literal["auto"] | Positive = Field(
        default="auto", description="time step, s; auto: from the loads, the modes and the contacts", examples=[1e-5]
    )
    scheme: Annotated[SceneScheme, BeforeValidator(named)] = Field(
        default=MidpointRule(type="midpoint"), description="time integration: a name, or a table with the type"
    )


class SceneStart(Table):
    """The state at the start."""

    state: Literal["rest", "seat"] = Field(
        default="rest",
        description="undeformed and at rest, or the static equilibrium under the loads at t = 0 but steps",
    )


class SceneWear(Table):
    """Archard's law: the volume worn is a coefficient times the work of sliding, at pairs of two motions."""

    coefficient: Positive | None = Field(
        default=None, description="volume worn per work of sliding, 1/Pa; default none: only the work", examples=[2e-14]
    )
    area: Positive | None = Field(
        default=None, description="worn area of each pair, m^2; default none: no depth is given", examples=[1e-5]
    )
    depth_limit: Positive | None = Field(
        default=None, description="depth at which a life ends, m; of gapbeam life", examples=[0.2e-3]
    )


class SceneOutput(Table):
    """Interval of the output, and limits of the run."""

    history_interval: Positive | None = Field(default=None, description="time between history records, s; default step")
    fields_interval: Positive | None = Field(
        default=None,
        description="time between shapes of structures in space, for films, s; default end/200, longer for large ones",
    )
    wall_time: Positive | None = Field(
        default=None, description="wall time after which a run writes a checkpoint and stops, s; default none"
    )
    errors: Literal["companions", "none"] = Field(
        default="companions",
        description="error estimate of a finished run, by half its step, twice the modes of `reduce` and the "
        "elements of beams and frames, and finer meshes of reduced solids; or none",
    )


class SceneCase(Table):
    """A whole file: structures, contacts and loads."""

    elsewhere: ClassVar[Mapping[str, str]] = {
        "probe": "leave [[probe]] out: the motions of all points are recorded, and a [[point]] adds one",
        "support": "a contact with the frame is a [[pair]] between one point",
        "analysis": "`gapbeam atlas` finds the responses that repeat",
    }

    title: str = Field("", max_length=200, description="one line that says what the case shows")
    structure: tuple[BodyTable, ...] = Field(min_length=1, description="linear bodies")
    member: tuple[MemberTable, ...] = Field(default=(), description="branches of frames")
    point: tuple[PointTable, ...] = Field(default=(), description="points of contact, loads and records")
    joint: tuple[BodyJoint, ...] = Field(default=(), description="joints, which hold structures without play")
    mass: tuple[LoadedPoint, ...] = Field(default=(), description="masses at points")
    contact: PairContact = PairContact()
    pair: tuple[PairTable, ...] = Field(default=(), description="pairs that may touch")
    load: tuple[SceneLoad, ...] = Field(default=(), description="loads acting together")
    feedback: tuple[FeedbackTable, ...] = Field(default=(), description="linear forces that follow the motion")
    figure: tuple[Figure, ...] = Field(default=(), description="results of one's own, of points and contacts")
    time: SceneTime
    start: SceneStart = SceneStart()
    wear: SceneWear | None = None
    gates: Gates = Gates()
    output: SceneOutput = SceneOutput()
