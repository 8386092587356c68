"""[[feedback]]: linear forces that follow the motion, of flows and controllers, on spans or at points.

Contradictions are found before anything is read or computed.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain, pairwise
from math import pi
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, create_model

from gapbeam.solver.messages.errors import Fault, Key, UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.beam_structure import ELEMENTS
from gapbeam.solver.scene.feedback import Feedback
from gapbeam.solver.scene.flow_force import MOTIONS, FlowSpan, quasi_steady, span
from gapbeam.solver.scene.lagged_force import TOLERANCE, aerodynamic_lag, measured, unsteady
from gapbeam.solver.scene.structure import Structure, StructurePoint
from gapbeam.solver.scene_file.structure_tables import BodyTable, ElementBeam, FileName, LumpedMass, RigidBar
from gapbeam.solver.schema.table import OF_TYPE, Name, NonNegative, Number, PointName, Positive, Table, Whole
from gapbeam.solver.system.operators import Array

Pair = tuple[Number, Number]
MOST = 1000  # entries of a list
Numbers = Annotated[tuple[Number, ...], Field(max_length=MOST)]
Positives = Annotated[tuple[Positive, ...], Field(min_length=1, max_length=MOST)]
Matrix = Annotated[tuple[Numbers, ...], Field(max_length=MOST)]
Points = Annotated[tuple[PointName, ...], Field(min_length=1, max_length=100)]
Coefficient = Number | tuple[Pair, Pair]
Profile = Annotated[tuple[Pair, ...], Field(min_length=2, max_length=MOST)]


class _Span(Table):
    structure: Name = Field(description="name of the tube", examples=["tube"])
    points: Annotated[tuple[Name, ...], Field(min_length=2, max_length=MOST)] | None = Field(
        default=None, description="points of matrices or modes along the tube; default none, for a beam"
    )
    at: Numbers | None = Field(default=None, description="place of each of these points along the tube, m")
    velocity: Profile | None = Field(
        default=None,
        description="profile of the velocity over its reference: rows [place, m; share], lines between; default 1",
        examples=[[[0.0, 1.0], [2.0, 1.4]]],
    )
    density: Profile | None = Field(default=None, description="profile of the density, likewise; default 1")

    def ends(self, length: float) -> tuple[float, float]:
        """Return both ends of the flow along a beam of that length, m."""
        return vars(self)["from"] or 0.0, vars(self)["to"] or length


_ENDS: dict[str, Any] = {
    "from": (NonNegative | None, Field(default=None, description="where the flow begins along a beam, m; default 0")),
    "to": (Positive | None, Field(default=None, description="where it ends, m; default the end of the beam")),
}
SpanTable = create_model(
    "SpanTable", __base__=_Span, __module__=__name__, __doc__="A length of a tube in the flow.", **_ENDS
)


class _Acting(Table):
    name: Name = Field(description="unique name", examples=["flow"])


class _Stream(_Acting):
    velocity: Positive = Field(description="reference velocity of the flow, m/s", examples=[3.0])
    density: Positive = Field(description="reference density, kg/m^3", examples=[1000.0])


class _Tube(_Stream):
    span: SpanTable | None = Field(  # type: ignore[valid-type]
        default=None, description="length of a tube that the flow acts on, a table; default none: at `point`"
    )
    point: PointName | None = Field(
        default=None, description="a point that the force of 1 m acts on; default none: on a span"
    )
    diameter: Positive = Field(description="outer diameter of the tube, m", examples=[0.019])
    modes: Annotated[Whole, Field(ge=1)] | None = Field(
        default=None, description="the flow acts on so many modes of the structure, from the lowest; default all"
    )


class QuasiSteadyFlow(_Tube):
    """Drag, and a lift that follows the displacement after a delay (Price and Paidoussis)."""

    type: Literal["quasi-steady"] = Field(description="kind of force")
    drag: NonNegative = Field(description="drag coefficient, no unit", examples=[1.0])
    slope: Coefficient = Field(
        description="dC_L/d(y/D); for two motions [[dC_D/dx, dC_D/dy], [dC_L/dx, dC_L/dy]], no unit", examples=[-4.0]
    )
    lift: Number = Field(default=0.0, description="lift coefficient at rest, no unit")
    delay: NonNegative = Field(default=1.0, description="delay over diameter / velocity, no unit")
    frequency: Positive = Field(description="largest frequency of interest, Hz: the delay is right up to it")
    tolerance: Number = Field(default=1e-5, gt=0.0, lt=1.0, description="error of the delay at it, no unit")


class UnsteadyFlow(_Tube):
    """A force that remembers the motion by decaying exponentials (Granger and Paidoussis)."""

    type: Literal["unsteady"] = Field(description="kind of force")
    stiffness: Coefficient = Field(description="steady force over displacement, K, or a matrix, no unit")
    damping: Coefficient = Field(description="damping by the flow, C, or a matrix, no unit")
    amplitudes: Numbers = Field(description="a_i of the memory, no unit", examples=[[0.3, 0.4]])
    rates: Positives = Field(description="d_i, in velocity / diameter, no unit", examples=[[0.1, 0.5]])


class MeasuredFlow(_Tube):
    """Complex coefficients over the reduced velocity from a file, fitted by states."""

    type: Literal["measured"] = Field(description="kind of force")
    file: FileName = Field(
        description="CSV: reduced velocity U/(f D), then real and imaginary part of c, or of c_xx, c_xy, c_yx, c_yy",
        examples=["coefficients.csv"],
    )
    frequencies: Positives = Field(
        description="frequencies of interest, Hz, which the file must cover", examples=[[20.0, 60.0]]
    )
    states: Annotated[Whole, Field(ge=0, le=12)] = Field(default=2, description="exponentials of the fit")
    tolerance: Number = Field(
        default=TOLERANCE, gt=0.0, lt=1.0, description="misfit that is accepted, over the largest coefficient, no unit"
    )


class LaggedForces(_Stream):
    """Aerodynamic forces on the motions of points in Roger's form, without apparent mass."""

    type: Literal["aerodynamic-lag"] = Field(description="kind of force")
    points: Points = Field(description="points, whose motions one after the other are those of the matrices")
    half_chord: Positive = Field(description="b, m")
    steady: Matrix = Field(description="A_0", examples=[[[0.0, -1.0], [0.0, 0.5]]])
    damping: Matrix = Field(description="A_1")
    lags: Positives = Field(description="b_l, no unit", examples=[[0.0455, 0.3]])
    matrices: tuple[Matrix, ...] = Field(max_length=MOST, description="A_3, A_4, ..., one for each lag")


class Controller(_Acting):
    """A linear controller from motions of points to forces: z' = A z + B u, F = C z + D u."""

    type: Literal["controller"] = Field(description="kind of force")
    sense: Points = Field(description="points that it reads: u has their displacements, then their velocities")
    act: Points = Field(description="points that its forces act on")
    A: Matrix = Field(default=(), description="state matrix, 1/s; [] without states")
    B: Matrix = Field(default=(), description="a row for each state")
    C: Matrix = Field(default=(), description="a row for each force")
    D: Matrix = Field(default=(), description="a row for each force, N/m and N s/m; [] is 0")


class ConnorsCheck(_Stream):
    """No force: the margin by Connors' formula, with frequencies and shapes of the tube in its closed supports."""

    type: Literal["connors"] = Field(description="kind of force")
    span: SpanTable = Field(description="length of a tube in the flow, a table")  # type: ignore[valid-type]
    diameter: Positive = Field(description="outer diameter of the tube, m", examples=[0.019])
    constant: Positive = Field(description="Connors' K of the bundle, no unit", examples=[3.0])
    mass: Positive = Field(description="mass per length with the added mass, kg/m", examples=[0.8])
    decrement: Positive | None = Field(
        default=None,
        description="logarithmic decrement of the damping, no unit; default 2 pi times the damping ratio of the tube, "
        "with its two-phase part",
        examples=[0.06],
    )


AnyFeedback = QuasiSteadyFlow | UnsteadyFlow | MeasuredFlow | LaggedForces | Controller | ConnorsCheck
FeedbackTable = Annotated[AnyFeedback, OF_TYPE]


FEWEST = 11  # stations of a span
KINDS: dict[str, Callable[..., Feedback]] = {
    "quasi-steady": quasi_steady, "unsteady": unsteady, "measured": measured, "aerodynamic-lag": aerodynamic_lag,
    "controller": Feedback,
}  # fmt: skip
LAW_OF = {"quasi-steady": "slope", "unsteady": "stiffness", "measured": "file", "aerodynamic-lag": "steady"}
"""The key that says of how many motions a law is, by kind of force."""
CALLED = re.compile(r"(?:flow|feedback) [^:]*: (?:found )?(\w+)")
Exists = Callable[[Key, str], Iterable[Fault]]


def places_of(table: AnyFeedback) -> dict[str, list[str]]:
    """Return the names of the points of a table by key."""
    given = {name: getattr(table, name, None) or [] for name in ("point", "points", "sense", "act")}
    return {name: [one] if isinstance(one, str) else list(one) for name, one in given.items()}


def stations(number: int, table: AnyFeedback, body: BodyTable) -> dict[str, float]:
    """Return the stations of a span along a beam, places by a name that no point of the file has; none for others."""
    along, model = getattr(table, "span", None), body.model
    if along is None or along.structure != body.name or not isinstance(model, ElementBeam | RigidBar):
        return {}
    low, high = along.ends(model.length)
    elements = (model.elements if isinstance(model, ElementBeam) else None) or ELEMENTS
    count = max(FEWEST, round(elements * (high - low) / model.length) + 1)
    return {f"feedback {number}: {i}": float(x) for i, x in enumerate(np.linspace(low, high, count))}


def flow_span(number: int, table: AnyFeedback, structure: Structure, body: BodyTable) -> FlowSpan:
    """Return the span of a table that has one."""
    along: Any = getattr(table, "span")  # noqa: B009 - of most tables
    places = stations(number, table, body) or dict(zip(along.points, along.at, strict=True))

    def profile(rows: Sequence[tuple[float, float]] | None) -> float | Callable[[Array], Array]:
        return 1.0 if rows is None else lambda x: np.interp(x, *np.transpose(rows))

    return span(structure, places, profile(along.velocity), profile(along.density))


def made_feedback(
    table: AnyFeedback, where: FlowSpan | None, points: Mapping[str, Sequence[StructurePoint]]
) -> Feedback | None:
    """Return the force of a table, whose keys are the arguments of its kind in Python; None: it makes none.

    `where` is its span, and `points` are its points by key; frequencies of the table are in Hz.
    """
    if table.type not in KINDS:
        return None
    given: dict[str, Any] = {key: value for key, value in table if key not in ("type", "span")}
    given |= {key: list(places) for key, places in points.items() if places}
    given |= {key: 2.0 * pi * np.array(given[key]) for key in ("frequency", "frequencies") if key in given}
    place = given.pop("point", None), given.pop("points", None)
    if isinstance(table, Controller):
        return Feedback(**given | {"D": table.D or None})
    if isinstance(table, MeasuredFlow):
        given["table"] = given.pop("file")
    return KINDS[table.type](where or place[1] or place[0][0], **given)


def faulty_key(number: int, table: AnyFeedback, error: UserError) -> Key:
    """Return the key that an error is about."""
    argument, key = getattr(error, "argument", ""), ("feedback", number)
    called = CALLED.match(str(error))
    for name in ({MOTIONS: LAW_OF.get(table.type, ""), "table": "file"}.get(argument, argument), called and called[1]):
        if name in type(table).model_fields:
            return (*key, str(name))
    return (*key, "span") if getattr(table, "span", None) is not None else key


def feedback_faults(
    tables: Mapping[str, Any], by_name: Mapping[str, BodyTable], point: Exists, structure: Exists
) -> Iterator[Fault]:
    """Yield the contradictions in [[feedback]], given all tables that are intact, and the structures by name.

    Arrays of tables are {number: entry}; `point` and `structure` yield a fault where such a one does not exist.
    """
    time = tables.get("time")
    for number, one in tables.get("feedback", {}).items():
        key: Key = ("feedback", number)
        for name, places in places_of(one).items():
            yield from chain(*(point((*key, name), place) for place in places))
        if isinstance(one, MeasuredFlow) and not Path(one.file).is_file():
            yield Fault((*key, "file"), f'"{one.file}", which is no file', "a file that is there")
        yield from _rows(key, one)
        if isinstance(one, _Tube) and (one.span is None) == (one.point is None):
            found = "neither" if one.span is None else "both"
            yield Fault((*key, "span"), f"{found} of span and point", "one of them: where the flow acts",
                        'span = { structure = "tube" }', ((*key, "point"),))  # fmt: skip
        along, slowest = getattr(one, "span", None), 1.0
        unknown = [] if along is None else list(structure((*key, "span", "structure"), along.structure))
        yield from unknown
        if along is not None and not unknown and along.structure in by_name:
            body = by_name[along.structure]
            faults = list(_span_faults((*key, "span"), along, body, point))
            yield from faults
            if isinstance(one, ConnorsCheck) and one.decrement is None and not body.damping:
                yield Fault((*key, "decrement"), f'nothing, and no damping ratio of "{along.structure}"',
                            "a decrement, or a structure with ratio or two_phase")  # fmt: skip
            slowest = min((row[1] for row in along.velocity or ()), default=1.0) if not faults else 1.0
        if isinstance(one, QuasiSteadyFlow) and time is not None:
            lag = one.delay * one.diameter / (one.velocity * slowest)
            if lag > time.end:
                yield Fault((*key, "delay"), f"a delay of {lag:.4g} s, longer than the run of {time.end:g} s",
                            "a delay within the run: its force would never begin", "a larger time.end",
                            (("time", "end"),))  # fmt: skip


def _rows(key: Key, table: AnyFeedback) -> Iterator[Fault]:
    """Rows of one matrix have one length."""
    for name in ("steady", "damping", "matrices", "A", "B", "C", "D"):
        rows = getattr(table, name, ())
        rows = chain(*rows) if name == "matrices" else rows if isinstance(rows, tuple) else ()
        lengths = sorted({len(row) for row in rows})
        if len(lengths) > 1:
            yield Fault((*key, name), f"rows of {' and '.join(map(str, lengths))} numbers", "rows of one length")


def _span_faults(key: Key, along: Any, body: BodyTable, point: Exists) -> Iterator[Fault]:
    """Yield the faults of a span of a structure that exists."""
    model, given = body.model, {name for name, value in along if value is not None}
    if isinstance(model, LumpedMass):
        yield Fault((*key, "structure"), f'"{body.name}", a mass', "a structure with a length",
                    f'point = "{body.name}.at"')  # fmt: skip
        return
    if body.place is not None:
        yield Fault((*key, "structure"), f'"{body.name}", which has a place in space', "a structure without place",
                    "leave its place out; motions = 2 lets a beam bend along and across the flow")  # fmt: skip
        return
    if isinstance(model, ElementBeam | RigidBar):
        low, high = along.ends(model.length)
        if given & {"points", "at"}:
            name = "points" if "points" in given else "at"
            yield Fault((*key, name), f"{name} of a model {model.type}", "from and to: places along it, m")
            return
        if high > model.length:
            yield Fault((*key, "to"), f"{high:g} m, beyond the end", f"at most {model.length:g} m")
            return
        if not low < high:
            yield Fault((*key, "from"), f"{low:g} m, not before the end of the span", f"less than {high:g} m")
            return
    else:
        if not given >= {"points", "at"}:
            yield Fault((*key, "at" if "points" in given else "points"), "nothing: the key is missing",
                        f"points of a model {model.type} along the tube, and `at`, their places, m")  # fmt: skip
            return
        yield from chain(*(point((*key, "points"), f"{body.name}.{name}") for name in along.points))
        for name in sorted(given & {"from", "to"}):
            found = f"{vars(along)[name]:g} m of a model {model.type}"
            yield Fault((*key, name), found, "points and at", f"leave {name} out")
        if len(along.at) != len(along.points) or not all(a < b for a, b in pairwise(along.at)):
            yield Fault((*key, "at"), f"{counted(len(along.at), 'place')} for {counted(len(along.points), 'point')}",
                        "a place for each point, one after the other along the tube")  # fmt: skip
            return
        low, high = along.at[0], along.at[-1]
    for name in ("velocity", "density"):
        places, shares = zip(*(getattr(along, name) or [(low, 1.0), (high, 1.0)]), strict=True)
        if not all(a < b for a, b in pairwise(places)):
            yield Fault((*key, name), "places that do not increase", "rows one after the other along the tube")
        elif places[0] > low or places[-1] < high:
            yield Fault((*key, name), f"a profile from {places[0]:g} to {places[-1]:g} m",
                        f"one that covers the span, {low:g} to {high:g} m")  # fmt: skip
        elif not min(shares) > 0.0:
            yield Fault((*key, name), f"a share of {min(shares):g}", "shares above 0",
                        "end the span where the flow ends")  # fmt: skip
