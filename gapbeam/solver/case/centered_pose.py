"""The pose of the undeformed beam in the middle of the play of its supports.

The rigid motion whose axis has the least sum of squared distances to the middles of the play, one for every support
that bounds the beam on both sides:

    sum_k (h + t (x_k - m) - c_k)^2 -> min,    t = sum_k (x_k - m) (c_k - h) / sum_k (x_k - m)^2

with h the mean of the heights c_k and m the mean of the places x_k; likewise sideways, over the supports around the
beam. One support alone turns the beam by its own tilt.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gapbeam.solver.case.rigid_motion import RigidMotion
from gapbeam.solver.errors import Fault, Key
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports, OneSupport, Play, play_of

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
        key: Of what asks for it.
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
        room, x = min((_room(one, pose, x), x) for x in _ends(one))
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


def _ends(support: OneSupport) -> tuple[float, float]:
    return support.start, support.end


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
