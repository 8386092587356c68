"""Hinges of frames: ends of branches that bend freely where they meet another member, while twist is carried over."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from gapbeam.solver.scene.argument_checks import ArgumentError
from gapbeam.solver.scene.frame_route import FrameAxes
from gapbeam.solver.scene.structure_geometry import directions_across
from gapbeam.solver.system.operators import Array

MOTIONS = 6
"""Motions of a node of a frame: along x, y and z, and the rotations about them."""


class Hinge(NamedTuple):
    """An end that bends freely: its node, direction of the member there, and two directions across it, (2, 3)."""

    node: int
    along: Array
    across: Array


def hinges_of(
    members: Sequence[Any], axes: FrameAxes, nodes: Sequence[Array], where: str
) -> tuple[list[Hinge], list[Array]]:
    """Return the hinges of all members, and their nodes where each hinge has one of its own beyond the others."""
    found: list[Hinge] = []
    own, count = [some.copy() for some in nodes], 1 + max(int(some.max()) for some in nodes)
    for k, (member, axis) in enumerate(zip(members, axes.routes, strict=True)):
        if wrong := [one for one in member.hinged if k == 0 or one not in ("start", "end")]:
            raise ArgumentError(f"{where}: found {wrong[0]!r} hinged, expected start or end of a branch",
                                f"members.{k - 1}.hinged")  # fmt: skip
        for end in dict.fromkeys(member.hinged):
            place, s = (0, 0.0) if end == "start" else (-1, axis.length)
            along = axis.parts[place].direction(s)
            found.append(Hinge(int(nodes[k][place]), along, directions_across(along)))
            own[k][place] = count + len(found) - 1
    bare = [one for one in found if not any(one.node in some for some in own)]
    if bare:
        k = next(k for k, some in enumerate(nodes) if k and members[k].hinged and bare[0].node in some[[0, -1]])
        loose = f"the {'start' if bare[0].node == nodes[k][0] else 'end'} of member {k}, which touches no axis,"
        words = loose if sum(bare[0].node in some for some in nodes) == 1 else "a joint at which all members are"
        raise ArgumentError(f"{where}: found {words} hinged, expected one there that is not", f"members.{k - 1}.hinged")
    return found, own


def tie_of(count: int, hinges: Sequence[Hinge]) -> Any:
    """Return the motions of all nodes and hinges, (6 (nodes + hinges), 6 nodes + 2 hinges), sparse."""
    if not hinges:
        return sp.identity(MOTIONS * count, format="csr")
    tied = sp.lil_matrix((MOTIONS * (count + len(hinges)), MOTIONS * count + 2 * len(hinges)))
    for k in range(MOTIONS * count):
        tied[k, k] = 1.0
    for i, one in enumerate(hinges):
        row, node, free = MOTIONS * (count + i), MOTIONS * one.node, MOTIONS * count + 2 * i
        for k in range(3):
            tied[row + k, node + k] = 1.0
        tied[row + 3 : row + 6, node + 3 : node + 6] = np.outer(one.along, one.along)
        tied[row + 3 : row + 6, free : free + 2] = one.across.T
    return sp.csr_matrix(tied)
