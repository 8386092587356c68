"""Snubbers: supports that are free while a point moves slowly, and lock when it moves or accelerates too much.

    free:    F = -drag r',                                     until |r'| or |r''| reaches `lock`, at a place r_l,
    locked:  F = -stiffness (r - r_l) - damping r',            until it falls to `release`.

The state changes between steps by the mean velocity of the step that ended, or by its change: in the limit of small
steps, at the crossing. What the spring stores when it opens is lost, and stands in the ledger of the law.

Source for control by a velocity or acceleration with values for on and off: element COMBIN37, ANSYS Mechanical APDL
Theory Reference.
"""

# mypy: disable-error-code="no-untyped-def"
from __future__ import annotations

from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import ArgumentError, checked, positive
from gapbeam.solver.scene.contact_pair import Contact
from gapbeam.solver.scene.convex_region import HalfPlane
from gapbeam.solver.scene.force_law import law
from gapbeam.solver.scene.structure import StructurePoint


def _settle(x0, x1, h, stiffness, damping, drag, lock, release, order, locked, anchor, speed):  # noqa: ARG001
    v = (x1 - x0) / h
    size = abs(v) if order < 1.5 else abs(v - speed) / h
    if locked < 0.5 and size >= lock:
        return 1.0, x1, v
    if locked > 0.5 and size <= release:
        return 0.0, anchor, v
    return locked, anchor, v


def _mean(a, b, stiffness, damping, drag, lock, release, order, locked, anchor, speed):  # noqa: ARG001
    return locked * stiffness * (0.5 * (a + b) - anchor), 0.5 * locked * stiffness


def _damper(force, share, rate, stiffness, damping, drag, lock, release, order, locked, anchor, speed):  # noqa: ARG001
    return (locked * damping + (1.0 - locked) * drag) * rate


def _potential(x, stiffness, damping, drag, lock, release, order, locked, anchor, speed):  # noqa: ARG001
    return 0.5 * locked * stiffness * (x - anchor) ** 2


@law(
    potential=_potential, damper=_damper, mean=_mean, settle=_settle, adhesive=True,
    nonnegative=("stiffness", "damping", "drag", "release"), positive=("lock",),
)  # fmt: skip
def Snubber(x, stiffness, damping, drag, lock, release, order, locked=0.0, anchor=0.0, speed=0.0):  # type: ignore[no-untyped-def] # noqa: ARG001, N802
    """Return the force of the spring: 0 while the snubber is free."""
    return locked * stiffness * (x - anchor)


@checked
def snubber(
    between: StructurePoint | tuple[StructurePoint, StructurePoint],
    stiffness: float,
    *,
    release: float,
    velocity: float | None = None,
    acceleration: float | None = None,
    damping: float = 0.0,
    drag: float = 0.0,
    name: str = "",
) -> Contact:
    """Return a snubber, one of the contacts of a scene, between a point and the frame, or between two points.

    Args:
        between: A point of one motion, or two: the motion of the first relative to the second.
        stiffness: Stiffness of the locked snubber, from the place where it locked, N/m.
        release: Velocity, m/s, or acceleration, m/s^2, at which it opens again; below that at which it locks.
        velocity: Velocity at which it locks, m/s.
        acceleration: Acceleration at which it locks, m/s^2; one of both.
        damping: Damping of the locked snubber beside its spring, N s/m.
        drag: Drag of the free snubber, N s/m.
        name: Name in results and paths; unique in a scene.

    Raises:
        UserError: A value is out of range, or both velocity and acceleration are given, or none.
    """
    where = f"snubber {name or '?'}"
    if (velocity is None) is (acceleration is None):
        found = "neither" if velocity is None else "both"
        raise ArgumentError(f"{where}: found {found}, expected velocity or acceleration: what locks it", "velocity")
    key, given = ("velocity", velocity) if acceleration is None else ("acceleration", acceleration)
    lock = float(positive(given, f"{where}: {key}"))
    opens = float(positive(release, f"{where}: release", zero=True))
    if not opens < lock:
        raise ArgumentError(f"{where}: found release {opens:g}, expected less than the {key} {lock:g}", "release")
    if not (stiffness > 0.0 or damping > 0.0):
        raise UserError(f"{where}: found neither stiffness nor damping, expected one that holds when it is locked")
    order = 1.0 if acceleration is None else 2.0
    held = Snubber(stiffness=stiffness, damping=damping, drag=drag, lock=lock, release=opens, order=order)
    return Contact(between, HalfPlane(0.0), held, name=name)
