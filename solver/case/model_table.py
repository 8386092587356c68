"""The table [model]: the fidelity level that a case is computed on."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gapbeam.solver.table import Positive, Table, Whole


class FullModel(Table):
    """All DOFs of the finite element mesh, condensed onto the contact points in each step: exact."""

    type: Literal["full"] = Field(default="full", description="name of the model")


class ReducedModel(Table):
    """The finite element mesh in a basis of vibration modes and of shapes that contact and loads give it."""

    type: Literal["reduced"] = Field(description="name of the model")
    interface: Literal["free", "fixed"] = Field(
        default="free",
        description="modes of the body with free contact faces and residual flexibility, or with fixed ones and "
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
        description="contact points across the width for each place along it, four times as many where the motion is "
        "not symmetric about the bending plane (3D); all: those of the mesh",
    )


class BeamModel(Table):
    """Timoshenko beam elements between the contact faces of the mesh: bending alone, in one plane or in two."""

    type: Literal["beam"] = Field(description="name of the model")
    elements: Whole = Field(default=102, ge=2, le=2000, description="number of elements along the beam")


class RigidModel(Table):
    """The beam as a rigid body between the contact faces of the mesh: three motions in 2D, six in 3D."""

    type: Literal["rigid"] = Field(description="name of the model")


ModelTable = Annotated[FullModel | ReducedModel | BeamModel | RigidModel, Field(discriminator="type")]
