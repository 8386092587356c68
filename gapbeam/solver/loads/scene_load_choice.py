"""[[load]] of a file of several structures: the loads of case files, at points and structures of a scene."""

from __future__ import annotations

from typing import Annotated, Any, Union

from pydantic import Field, create_model

from gapbeam.solver.loads.gravity import Gravity
from gapbeam.solver.loads.load_table import LoadTable
from gapbeam.solver.loads.point_load import ConstantForce, HarmonicForce, RecordedForce
from gapbeam.solver.loads.step_force import StepForce
from gapbeam.solver.loads.support_motion import BaseMotion, RecordedMotion
from gapbeam.solver.table import Name, Number, PointName, Vector


def _at_point(base: type[LoadTable]) -> type[LoadTable]:
    """Return a load whose place is a point of a structure."""
    keys: dict[str, Any] = {
        "point": (PointName, Field(description="the point", examples=["tube.tip"])),
        "direction": (
            tuple[Number] | tuple[Number, Number] | None,
            Field(
                default=None,
                description="in the motions of the point, a number for each, no unit; default along the first",
                examples=[[1.0, 0.0]],
            ),
        ),
    }
    return create_model("At" + base.__name__, __base__=base, __module__=__name__, __doc__=base.__doc__, **keys)


def _of_structures(base: type[LoadTable]) -> type[LoadTable]:
    """Return a load on the inertia of one structure or of all, along their motion with the frame."""
    keys: dict[str, Any] = {
        "structure": (
            Name | None,
            Field(default=None, description="name of the structure; default all", examples=["rack"]),
        ),
        "direction": (
            Vector | None,
            Field(
                default=None,
                description="in space, of structures with a place, no unit; default downward for gravity; others: "
                "`frame` of the structure is the direction",
            ),
        ),
    }
    return create_model("Of" + base.__name__, __base__=base, __module__=__name__, __doc__=base.__doc__, **keys)


TABLES = (
    *(_at_point(one) for one in (HarmonicForce, ConstantForce, StepForce, RecordedForce)),
    *(_of_structures(one) for one in (Gravity, BaseMotion, RecordedMotion)),
)
SceneLoad: Any = Annotated[Union[TABLES], Field(discriminator="type")]  # noqa: UP007 - of a tuple
"""Loads of case files whose functions of time a scene takes."""


AnyLoad = LoadTable
"""A load, whichever it is."""


def point_of(load: LoadTable) -> str | None:
    """Return the point that a load acts on; None: it acts on structures."""
    return getattr(load, "point", None)


def structure_of(load: LoadTable) -> str | None:
    """Return the structure that a load acts on; None: all, or a point."""
    return getattr(load, "structure", None)
