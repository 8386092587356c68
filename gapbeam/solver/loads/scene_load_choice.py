"""[[load]] of a file of several structures: the loads of case files, at points and structures of a scene."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeGuard, Union

from pydantic import Field, create_model

from gapbeam.solver.loads.load_table import Gravity, LoadTable
from gapbeam.solver.loads.point_load import ConstantForce, HarmonicForce, RecordedForce
from gapbeam.solver.loads.random_line_load import RandomLineLoad
from gapbeam.solver.loads.random_load import RandomLoad
from gapbeam.solver.loads.step_force import StepForce
from gapbeam.solver.loads.support_motion import (
    BaseMotion,
    ClearanceChange,
    HarmonicSupportMotion,
    MovingSupport,
    RecordedMotion,
    RecordedSupportMotion,
)
from gapbeam.solver.schema.table import OF_TYPE, Name, Number, PointName, Vector

DIRECTION: Any = (
    tuple[Number] | tuple[Number, Number] | tuple[Number, Number, Number] | None,
    Field(
        default=None,
        description="in the motions of the points, a number for each, no unit; default along the first",
        examples=[[1.0, 0.0]],
    ),
)


def _at_point(base: type[LoadTable], **more: Any) -> type[LoadTable]:
    """Return a load whose place is a point of a structure."""
    keys: dict[str, Any] = {
        "point": (PointName, Field(description="the point", examples=["tube.tip"])),
        "direction": DIRECTION,
        **more,
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


def _of_support(base: type[MovingSupport]) -> type[LoadTable]:
    """Return a motion of the side of pairs and joints that is on the frame."""
    text = "name of the pair, snubber or elastic joint of one point whose side on the frame moves, or of another joint"
    keys: dict[str, Any] = {"support": (Name, Field(description=text, examples=["hanger"])), "direction": DIRECTION}
    return create_model("Of" + base.__name__, __base__=base, __module__=__name__, __doc__=base.__doc__, **keys)


def _of_pair(base: type[MovingSupport]) -> type[LoadTable]:
    """Return a change of the clearance of a pair."""
    text = "name of the pair whose clearance changes"
    keys: dict[str, Any] = {"support": (Name, Field(description=text, examples=["end-stop"]))}
    return create_model("Of" + base.__name__, __base__=base, __module__=__name__, __doc__=base.__doc__, **keys)


AlongBeam = create_model(
    "AlongBeam", __base__=RandomLineLoad, __module__=__name__, __doc__=RandomLineLoad.__doc__,
    structure=(Name, Field(description="name of the beam", examples=["tube"])), direction=DIRECTION,
)  # fmt: skip
FORCE: Any = (Literal["force"], Field(default="force", description="quantity: a force"))
TABLES = (
    *(_at_point(one) for one in (HarmonicForce, ConstantForce, StepForce, RecordedForce)),
    _at_point(RandomLoad, quantity=FORCE),
    AlongBeam,
    *(_of_structures(one) for one in (Gravity, BaseMotion, RecordedMotion)),
    *(_of_support(one) for one in (HarmonicSupportMotion, RecordedSupportMotion)),
    _of_pair(ClearanceChange),
)
SceneLoad: Any = Annotated[Union[TABLES], OF_TYPE]  # noqa: UP007 - of a tuple
"""Loads of case files whose functions of time a scene takes."""


AnyLoad = LoadTable
"""A load, whichever it is."""
LineLoad = RandomLineLoad
"""A load along a beam."""
OpenedPair = ClearanceChange
"""A change of the clearance of a pair."""


def is_along_beam(load: LoadTable) -> TypeGuard[LineLoad]:
    """Return whether a load acts along a beam, whose structure and direction it names."""
    return isinstance(load, AlongBeam)


def point_of(load: LoadTable) -> str | None:
    """Return the point that a load acts on; None: it acts on structures."""
    return getattr(load, "point", None)


def structure_of(load: LoadTable) -> str | None:
    """Return the structure that a load acts on; None: all, or a point."""
    return getattr(load, "structure", None)


def support_of(load: LoadTable) -> str | None:
    """Return the pair, snubber or joint whose side on the frame a load moves; None: another load."""
    return None if opens(load) else getattr(load, "support", None)


def opens(load: LoadTable) -> TypeGuard[OpenedPair]:
    """Return whether a load changes the clearance of a pair."""
    return isinstance(load, ClearanceChange)
