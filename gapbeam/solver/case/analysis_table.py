"""The table [analysis]: kind of run, and motion added to the state at t = 0.

The start may add a rigid motion to the pose or the velocity, [analysis.motion],

    u(X) = t + w x (X - p)

with x along the beam, y across the bending plane and z along the bending direction, also where the case is a slice.
Rotations are small: u is linear in the coordinates.

A mode, [analysis.mode], may be added as well.

An undeformed beam is centered by the rigid motion whose axis has the least sum of squared distances to the middles of
the play, one for every support that bounds the beam on both sides:

    sum_k (h + t (x_k - m) - c_k)^2 -> min,    t = sum_k (x_k - m) (c_k - h) / sum_k (x_k - m)^2

with h the mean of the heights c_k and m the mean of the places x_k; likewise sideways, over the supports around the
beam. One support alone turns the beam by its own tilt.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from gapbeam.solver.loads.attachments import BENDING, MotionName
from gapbeam.solver.messages.errors import Fault, Key
from gapbeam.solver.schema.table import OF_TYPE, Name, Number, Positive, Table, Vector, Whole
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports, OneSupport, Play, play_of
from gapbeam.solver.system.operators import Array

NAMES: tuple[MotionName, ...] = ("axial", "lateral", "vertical", "twist", "rotation", "lateral_rotation")
"""The six rigid motions, as cross-sections take part in them: along x, y, z and about x, -y, z."""


@dataclass(frozen=True)
class RigidMotion:
    """A displacement, or a velocity, of all points of a rigid body.

    Attributes:
        translation: Translation of the origin, (x, y, z), m or m/s.
        rotation: Rotation of the body, a vector by the rule of the right hand, (x, y, z), rad or rad/s.
    """

    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def about(
        cls,
        point: tuple[float, float, float],
        translation: tuple[float, float, float],
        rotation: tuple[float, float, float],
    ) -> RigidMotion:
        """Return the motion whose rotation leaves a point in its place."""
        (x, y, z), (a, b, c), (u, v, w) = point, rotation, translation
        return cls((u - (b * z - c * y), v - (c * x - a * z), w - (a * y - b * x)), rotation)

    def __add__(self, other: RigidMotion) -> RigidMotion:
        (u, v, w), (a, b, c) = self.translation, self.rotation
        (du, dv, dw), (da, db, dc) = other.translation, other.rotation
        return RigidMotion((u + du, v + dv, w + dw), (a + da, b + db, c + dc))

    @property
    def names(self) -> frozenset[MotionName]:
        """The motions that it consists of, as the section at x = 0 takes part in them."""
        return frozenset(name for name, value in self.section(0.0).items() if value != 0.0)

    def section(self, x: float) -> Mapping[MotionName, float]:
        """Return the motions of the cross-section at x, m and rad, or per second."""
        (u, v, w), (a, b, c) = self.translation, self.rotation
        return dict(zip(NAMES, (u, v + c * x, w - b * x, a, -b, c), strict=True))

    def at(self, places: Array) -> Array:
        """Return the motion of points, (k, 3).

        Args:
            places: x, y and z of points, (k, 3), m.
        """
        return np.asarray(np.array(self.translation) + np.cross(np.array(self.rotation), places))


def unit_motions() -> tuple[RigidMotion, ...]:
    """Return the six motions of `NAMES`, each with the value 1 in the section at x = 0."""
    ends = {"axial": (1.0, 0.0, 0.0), "lateral": (0.0, 1.0, 0.0), "vertical": (0.0, 0.0, 1.0)}
    turns = {"twist": (1.0, 0.0, 0.0), "rotation": (0.0, -1.0, 0.0), "lateral_rotation": (0.0, 0.0, 1.0)}
    return tuple(
        RigidMotion(translation=ends[name]) if name in ends else RigidMotion(rotation=turns[name]) for name in NAMES
    )


Components = tuple[Number, Number, Number]


class StartMotion(Table):
    """A rigid motion, added to the state at t = 0.

    The rotation is small and leaves `point` in its place; [x, y] of a slice, [x, y, z] of a solid or a beam in 3D.
    """

    lift: Number = Field(default=0.0, description="displacement along the bending direction, m", examples=[0.1e-3])
    displacement: Vector | None = Field(
        default=None,
        description="displacement [x, y] or [x, y, z] instead of lift, m; default none",
        examples=[[0.0, 0.1e-3, 0.0]],
    )
    tilt: Number = Field(default=0.0, description="rotation that raises the far end, rad", examples=[1.0e-4])
    rotation: Components | None = Field(
        default=None,
        description="rotation about x, y and z by the right-hand rule (3D) instead of tilt, which is about -y, rad; "
        "default none",
        examples=[[0.0, 0.0, 1.0e-4]],
    )
    velocity: Number | Vector = Field(
        default=0.0,
        description="velocity along the bending direction, or [x, y] or [x, y, z], m/s",
        examples=[-0.2, [0.0, 0.1, 0.0]],
    )
    spin: Number | Components = Field(
        default=0.0,
        description="rotation rate that raises the far end, or the vector about x, y and z (3D), rad/s",
        examples=[1.0, [10.0, 0.0, 0.0]],
    )
    point: Number | Vector | None = Field(
        default=None,
        description="point that rotations leave in place, x on the axis or all coordinates, m; default the middle",
    )

    def pose(self, length: float) -> RigidMotion:
        """Return the displacement of a beam of a length, m."""
        translation = self.lift if self.displacement is None else self.displacement
        return self._about(length, translation, self.tilt if self.rotation is None else self.rotation)

    def rate(self, length: float) -> RigidMotion:
        """Return the velocity of a beam of a length, m."""
        return self._about(length, self.velocity, self.spin)

    def _about(self, length: float, translation: float | Vector, rotation: float | Components) -> RigidMotion:
        along = (0.0, 0.0, translation) if isinstance(translation, float | int) else in_space(translation)
        turn = (0.0, -rotation, 0.0) if isinstance(rotation, float | int) else rotation
        point = 0.5 * length if self.point is None else self.point
        center = (point, 0.0, 0.0) if isinstance(point, float | int) else in_space(point)
        return RigidMotion.about(center, along, turn)


class StartMode(Table):
    """A vibration mode of the beam without contact, added to the state at t = 0.

    u = a cos(phase) x(X) and v = a w sin(phase) x(X), with x = 1 at the probe along the bending direction.
    """

    number: Whole = Field(
        ge=1,
        le=1000,
        description="bending mode of the free model, as `gapbeam modes` numbers it; 1 and 2 of a beam without"
        " joints are rigid motions",
        examples=[1],
    )
    amplitude: Number = Field(description="a, amplitude of the probe along the bending direction, m", examples=[1.0e-4])
    probe: Name = Field(description="name of the [[probe]] whose amplitude is meant", examples=["tip"])
    phase: Number = Field(
        default=0.0,
        description="phase of a cos(w t - phase): 0 starts at rest with a, 90 with the velocity w a, degrees",
        examples=[90.0],
    )


def in_space(vector: Vector) -> tuple[float, float, float]:
    """Return [x, y] of a slice, whose y is the bending direction, or [x, y, z] as x, y, z."""
    return (vector[0], 0.0, vector[1]) if len(vector) == 2 else vector


TOUCHES = 1.0e-9  # of the clearance or the play: round-off


def centered_pose(support: AnySupports) -> RigidMotion:
    """Return the pose; no motion where no support has play on both sides."""
    plays = [play for _, one in keyed(support) if (play := play_of(one)) is not None]
    heights = [(_middle(play.support), _resolved(play.height, play)) for play in plays]
    sideways = [(_middle(one.support), _resolved(one.lateral, one)) for one in plays if one.lateral is not None]
    least = TOUCHES * min((abs(play.half) for play in plays), default=0.0)
    middle, height, climb = _line(heights, plays[0].support.faces[0].tilt if plays else 0.0, least)
    place, lateral, turn = _line(sideways, 0.0, least)
    lifted = RigidMotion.about((middle, 0.0, 0.0), (0.0, 0.0, height), (0.0, -climb, 0.0))
    return lifted + RigidMotion.about((place, 0.0, 0.0), (0.0, lateral, 0.0), (0.0, 0.0, turn))


def centering_faults(support: AnySupports, key: Key) -> Iterator[Fault]:
    """Yield the reasons against a start in the middle of the play: there is none, or supports contradict each other.

    Args:
        support: The supports.
        key: Key that asks for the start.
    """
    found: list[tuple[Key, Play]] = [
        (place, play) for place, one in keyed(support) if (play := play_of(one)) is not None
    ]
    if not found:
        yield Fault(
            key,
            "centered, with no support that bounds the beam on both sides",
            "play that has a middle: base and gland, a slot, a hole, a profile or a closed polygon",
            'start = "undeformed", with analysis.motion.lift where the beam shall be lifted',
            tuple(place for place, _ in keyed(support)),
        )
        return
    tight = [(place, play) for place, play in found if play.half <= 0.0]
    for place, play in tight:
        yield Fault(
            key,
            f"centered, where the support {play.support.name} has no play: {2.0 * play.half:g} m across",
            "play at every support: a beam that is held has no middle to be put in",
            'start = "seat", the equilibrium in the supports',
            ((*place, "clearance"),),
        )
    if tight:
        return
    pose = centered_pose(support)
    for place, one in keyed(support):
        room, x = min((_room(one, pose, x), x) for x in (one.start, one.end))
        if room < -TOUCHES * abs(one.clearance):
            yield Fault(
                key,
                f"centered, which is {-room:.3g} m within the support {one.name} at x = {x:g} m: the supports "
                "contradict each other",
                "supports whose middles lie on a line, within their play",
                'start = "seat", or less offset, lateral or tilt',
                (place,),
            )


def _room(support: OneSupport, pose: RigidMotion, x: float) -> float:
    moved = pose.section(x)
    return min(face.room(x, moved["lateral"], moved["vertical"]) for face in support.faces)


def _middle(support: OneSupport) -> float:
    return 0.5 * (support.start + support.end)


def _resolved(place: float, play: Play) -> float:
    """Return the middle of a play without its round-off: the centroid of a symmetric support is its center."""
    return 0.0 if abs(place) <= TOUCHES * abs(play.half) else place


def _line(points: Sequence[tuple[float, float]], alone: float, least: float) -> tuple[float, float, float]:
    """Return the mean place of points (x, c), their mean c, and the slope of the line of least squares.

    Args:
        points: The points.
        alone: The slope of a line through one point.
        least: Distances from the mean c up to this are round-off.
    """
    if not points:
        return 0.0, 0.0, 0.0
    middle = sum(x for x, _ in points) / len(points)
    mean = sum(value for _, value in points) / len(points)
    spread = sum((x - middle) ** 2 for x, _ in points)
    if len(points) == 1:
        return middle, mean, alone
    if all(abs(value - mean) <= least for _, value in points):
        return middle, mean, 0.0
    return middle, mean, sum((x - middle) * (value - mean) for x, value in points) / spread


class Transient(Table):
    """A march from the seat, the undeformed pose or the middle of the play, to time.end."""

    type: Literal["transient"] = Field(default="transient", description="kind of analysis")
    start: Literal["seat", "undeformed", "centered"] = Field(
        default="seat",
        description="state at t = 0, at rest: the static seat; undeformed, flat on the base, from which the "
        "beam falls; or undeformed in the middle of the play",
    )

    state: str | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="results folder of an earlier run of the same model, relative to the case file, whose "
        "kept state is the start; default none",
        examples=["results/settled"],
    )
    state_time: Positive | None = Field(
        default=None,
        description="time of that run, one of its output.keep_states, s; default the last",
        examples=[0.1],
    )
    motion: StartMotion | None = Field(
        default=None, description="a rigid motion added to that state, a table; default none"
    )
    mode: StartMode | None = Field(
        default=None, description="a vibration mode added to that state, a table; default none"
    )

    @property
    def needs_seat(self) -> bool:
        """True where every computation starts from the static seat."""
        return self.start == "seat" and self.state is None

    @property
    def start_words(self) -> str:
        """Start of a run, in a sentence."""
        return self.start if self.state is None else "from the state of another run"

    @property
    def moves_aside(self) -> frozenset[MotionName]:
        """The motions of the start that are not those of a beam in its bending plane."""
        found = () if self.motion is None else (self.motion.pose(0.0), self.motion.rate(0.0))
        return frozenset(name for one in found for name in one.names).difference(BENDING)

    @property
    def for_body(self) -> Transient:
        """Return the part of the start that a body depends on: motions that leave bending in the plane."""
        if not self.moves_aside:
            return Transient()
        along, across, turned, twisted = (
            float(name in self.moves_aside) for name in ("axial", "lateral", "lateral_rotation", "twist")
        )
        return Transient(motion=StartMotion(velocity=(along, across, 0.0), spin=(twisted, 0.0, turned)))


class Continuation(Table):
    """A curve of periodic responses, followed from the value of the case in both directions."""

    key: str = Field(
        min_length=1,
        max_length=100,
        description="parameter: support.clearance, contact.stiffness, contact.damping, load.NAME.amplitude, "
        "load.NAME.frequency (shared by all loads), or of an exciter load.NAME.mass, .stiffness, .damping, "
        ".preload",
        examples=["load.shaker.frequency"],
    )
    low: Number = Field(description="least value, in the unit of the key", examples=[15.0])
    high: Number = Field(description="largest value, in the unit of the key", examples=[25.0])
    first_step: Positive = Field(
        default=0.01, lt=1, description="first arc length, relative to the range and the size of the response, no unit"
    )
    longest_step: Positive = Field(default=0.1, lt=1, description="longest arc length, likewise, no unit")
    max_points: Whole = Field(default=300, ge=1, le=100000, description="largest number of points in each direction")


class Periodic(Table):
    """A periodic response by shooting or harmonic balance, with its stability, or a curve of them."""

    start_words: ClassVar[str] = "seated"
    needs_seat: ClassVar[bool] = True  # marches before the search start at the static seat
    moves_aside: ClassVar[frozenset[MotionName]] = frozenset()  # the search starts at rest
    for_body: ClassVar[Transient] = Transient()

    type: Literal["periodic"] = Field(description="kind of analysis")
    method: Literal["shooting", "harmonic-balance"] = Field(
        default="shooting", description="Newton's method on the period map, or on the harmonics"
    )
    periods: Whole = Field(
        default=1, ge=1, le=100, description="forcing periods in a period of the response; 3 finds a period-3 response"
    )
    start: Literal["march", "seat"] = Field(
        default="march", description="start of the search: the end of a march to time.end, or the seat"
    )
    tolerance: Positive = Field(
        default=1.0e-8, lt=1, description="largest change of the state over a period, relative, no unit"
    )
    max_iterations: Whole = Field(default=30, ge=1, le=1000, description="largest number of Newton iterations")
    harmonics: Whole = Field(
        default=40, ge=1, le=1000, description="harmonic-balance: number of harmonics of the period of the response"
    )
    samples_per_harmonic: Whole = Field(
        default=64, ge=5, le=1000, description="harmonic-balance: samples in a period over the number of harmonics"
    )
    continuation: Continuation | None = Field(
        default=None, description="parameter to vary, a table; default none: one response"
    )


Analysis = Annotated[Transient | Periodic, OF_TYPE]
