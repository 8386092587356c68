"""The contact force of one region and one law, compiled together: a touch.

A touch loops over evaluations (members, or contacts of one kind) on a workspace of rows of WIDTH numbers: three of the
OLD place, NEW place, FORCE (when impulses or friction that sticks are asked, the force that the solve gives); its SLOPE
by rows of three; POTENTIAL; work LOST in the law; work SLID off in friction; the motion when it was LAST asked; MU, a
coefficient; CREEP: sliding speed, or stiffness where friction sticks; then the VALUES of the region and of the law.
Kernels call touches by their address, so that a new law or region compiles a touch only, and a touch is the one source
of contact force, slope, potential and losses.

The force that the solve gives a face, with c s of the slip s, says whether friction sticks there (Alart and Curnier
1991, Comput. Methods Appl. Mech. Eng. 92, 353). A polygon keeps three rows for each face after two of the place where
it was last asked: friction there, and its slope, which make this force of the new place. The first row of LAST is then
0 where nothing was asked yet.

Where a region grows, the place has one motion more: its growth o, by which all faces move outward, x(r) - o.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from gapbeam.solver.scene.convex_region import RegionKind
from gapbeam.solver.scene.force_law import LawKind, inlined, responder
from gapbeam.solver.scene.object_code import address

WIDTH, ROWS = 64, 73
OLD, NEW, FORCE, SLOPE, POTENTIAL, LOST, SLID, LAST, MU, CREEP, VALUES = 0, 3, 6, 9, 18, 19, 20, 21, 24, 25, 26
IN_SPACE = 9
"""Rows that friction in space keeps."""
STICKING = 1e5
"""Stiffness of friction that sticks, times the mobility of its contact in a step."""
SIGNATURE = types.void(types.float64, types.int64, types.CPointer(types.float64))


_touches: dict[tuple[Any, ...], int] = {}


def touch(
    region: RegionKind, law: LawKind, motions: int, rough: bool, exact: bool, damped: bool, level: float,
    grows: bool = False,
) -> int:  # fmt: skip
    """Return the address of the compiled touch of a kind of region and a kind of law.

    Args:
        region: Kind of region.
        law: Kind of law.
        motions: 1, 2 in a section plane, or 3 in space, where walls are flat.
        rough: Whether there is friction.
        exact: Whether friction sticks without creep, by Coulomb's own law.
        damped: Whether the damper of the law acts.
        level: Level of the step at which the law is asked; 0: the mean over the step.
        grows: Whether the last motion is the growth of the region.
    """
    key = (region, law, motions, rough, exact, damped, level, grows)
    if key in _touches:
        return _touches[key]
    if motions == 3:
        _touches[key] = address(SIGNATURE, _in_space(law, rough, exact, damped, level))
        return _touches[key]
    face, respond, faces, faced = _grown(region.face), responder(law, damped), region.faces, _faced(law)
    growth, beside = _growth(motions, grows)
    own = VALUES + len(region.names) + len(law.names)  # first row that friction keeps
    at_region, at_law = _values(VALUES, len(region.names)), _values(VALUES + len(region.names), len(law.names))

    def compiled(h, count, workspace):  # type: ignore[no-untyped-def]
        w = numba.carray(workspace, (ROWS, WIDTH))
        for i in range(count):
            place, values = at_region(w, i), at_law(w, i)
            r0x, r1x = w[OLD, i], w[NEW, i]
            r0y, r1y = (w[OLD + 1, i], w[NEW + 1, i]) if motions == 2 else (0.0, 0.0)
            o0, o1 = growth(w, i)
            fx = fy = a = b = c = d = stored = lost = rubbed = turned = way = had = 0.0
            push = pushx = pushy = outx = outy = outward = 0.0
            given_x, given_y = w[FORCE, i], w[FORCE + 1, i]
            for k in range(faces):
                ex, ey, slides = r1x, r1y, 1.0  # where the face is linearised
                x0, x1, step, gx, gy, nx, ny, g00, g01, g10, g11 = face(k, r0x, r0y, ex, ey, place, o0, o1)
                if rough and exact and (x0 > 0 or x1 > 0):  # inside the cone: at no slip
                    s = (gx * (ey - r0y) - gy * (ex - r0x)) / (gx * gx + gy * gy + 1e-300)
                    reach = s * np.sqrt(gx * gx + gy * gy)
                    if faces == 1:
                        had = (gy * given_x - gx * given_y) / (np.sqrt(gx * gx + gy * gy) + 1e-300)
                    else:
                        had = w[LAST, i] * (
                            w[own + 2 + 3 * k, i]
                            + w[own + 3 + 3 * k, i] * (r1x - w[own, i])
                            + w[own + 4 + 3 * k, i] * (r1y - w[own + 1, i])
                        )
                    way = had + w[CREEP, i] / STICKING * reach
                    if level > 0:
                        mx, my = r0x + level * (r1x - r0x), r0y + level * (r1y - r0y)
                        om = o0 + level * (o1 - o0)
                        xm = face(k, mx, my, mx, my, place, om, om)[1]
                        normal = respond(xm, xm, step, h, level, values)[0]
                    else:
                        normal = respond(x0, x1, step, h, level, values)[0]
                    if abs(way) <= w[MU, i] * abs(normal):
                        ex, ey, slides = ex + s * gy, ey - s * gx, 0.0
                        x0, x1, step, gx, gy, nx, ny, g00, g01, g10, g11 = face(k, r0x, r0y, ex, ey, place, o0, o1)
                if rough and not exact:  # a slip that turned round: at no slip
                    s = (gx * (ey - r0y) - gy * (ex - r0x)) / (gx * gx + gy * gy + 1e-300)
                    if (x0 > 0 or x1 > 0) and s * (gx * w[LAST + 1, i] - gy * w[LAST, i]) < 0:
                        ex, ey, turned, slides = ex + s * gy, ey - s * gx, 1.0, 0.0
                        x0, x1, step, gx, gy, nx, ny, g00, g01, g10, g11 = face(k, r0x, r0y, ex, ey, place, o0, o1)
                dx, dy = ex - r0x, ey - r0y
                if level > 0:  # at one place of the step: slopes by both ends of none
                    mx, my = r0x + level * dx, r0y + level * dy
                    W0, W1 = respond(x0, x0, 0.0, h, level, values)[3], respond(x1, x1, 0.0, h, level, values)[3]
                    om = o0 + level * (o1 - o0)
                    x0, x1, step, gx, gy, nx, ny, g00, g01, g10, g11 = face(k, mx, my, mx, my, place, om, om)
                    step, twice = gx * dx + gy * dy - (o1 - o0), 2 * level
                    g00, g01, g10, g11 = twice * g00, twice * g01, twice * g10, twice * g11
                T, slope, beyond, W = respond(x0, x1, step, h, level, faced(w, i, values, gx, *beside(gy)))
                ux, uy, j00, j01 = -T * gx, -T * gy, -slope * nx * gx - T * g00, -slope * ny * gx - T * g01
                j10, j11 = -slope * nx * gy - T * g10, -slope * ny * gy - T * g11
                push += T + slope * (nx * (r1x - ex) + ny * (r1y - ey))
                pushx, pushy, outx, outy = pushx + slope * nx, pushy + slope * ny, outx + slope * gx, outy + slope * gy
                outward += slope
                stored += W1 if level > 0 else W
                lost += T * step - (W1 - W0) if level > 0 else beyond * step
                if rough:
                    mu, full, size = w[MU, i], w[CREEP, i], np.sqrt(gx * gx + gy * gy)
                    inverse = 1.0 / size if size > 0 else 0.0  # at rest in the center of a disc there is no direction
                    tx, ty = -gy * inverse, gx * inverse
                    s, rub = slides * (tx * dx + ty * dy), mu * abs(T)
                    if exact:
                        side = np.sign(way)
                        force, bend, share = (had, full, 0.0) if slides == 0.0 else (rub * side, 0.0, side)
                    else:
                        root = np.sqrt(s * s + full * full * h * h)
                        force, bend, share = rub * s / root, rub * (full * h) ** 2 / root**3, s / root
                    couple, growx, growy = mu * (1.0 if T > 0 else -1.0) * slope * share, 0.0, 0.0
                    ux -= force * tx
                    uy -= force * ty
                    for col in range(2):
                        gxc, gyc, nc, tc = (g00, g10, nx, tx) if col == 0 else (g01, g11, ny, ty)
                        along = tx * -gyc + ty * gxc  # turn of the tangent, along the tangent: none
                        turnx, turny = (-gyc - along * tx) * inverse, (gxc - along * ty) * inverse
                        grow = couple * nc + bend * (turnx * dx + turny * dy + tc)
                        growx, growy = (grow, 0.0) if col == 0 else (growx, grow)
                        if col == 0:
                            j00 -= grow * tx + force * turnx
                            j10 -= grow * ty + force * turny
                        else:
                            j01 -= grow * tx + force * turnx
                            j11 -= grow * ty + force * turny
                    if exact:
                        force += growx * (r1x - ex) + growy * (r1y - ey)
                        if faces > 1:
                            w[own + 2 + 3 * k, i], w[own + 3 + 3 * k, i], w[own + 4 + 3 * k, i] = force, growx, growy
                        s = tx * (r1x - r0x) + ty * (r1y - r0y)
                    rubbed += force * s
                    ux += j00 * (r1x - ex) + j01 * (r1y - ey)
                    uy += j10 * (r1x - ex) + j11 * (r1y - ey)
                fx, fy, a, b, c, d = fx + ux, fy + uy, a + j00, b + j01, c + j10, d + j11
            if rough and exact:
                w[SLID, i] = rubbed
                if faces > 1:
                    w[LAST, i], w[own, i], w[own + 1, i] = 1.0, r1x, r1y
            elif rough:
                w[SLID, i], w[LAST, i], w[LAST + 1, i] = rubbed, (1 - turned) * (r1x - r0x), (1 - turned) * (r1y - r0y)
            w[FORCE, i], w[SLOPE, i] = fx, a
            if motions == 2:
                w[FORCE + 1, i], w[SLOPE + 1, i], w[SLOPE + 3, i], w[SLOPE + 4, i] = fy, b, c, d
            if grows:
                w[FORCE + motions, i], w[SLOPE + 4 * motions, i] = push, -outward
                w[SLOPE + 3 * motions, i], w[SLOPE + motions, i] = pushx, outx
            if grows and motions == 2:
                w[SLOPE + 7, i], w[SLOPE + 5, i] = pushy, outy
            w[POTENTIAL, i], w[LOST, i] = stored, lost

    _touches[key] = address(SIGNATURE, compiled)
    return _touches[key]


def _grown(face: Any) -> Any:
    """Return the compiled face of a region that grows, by o0 at the start and o1 at the end of a step."""

    @inlined
    def grown(k, r0x, r0y, r1x, r1y, values, o0, o1):  # type: ignore[no-untyped-def]
        x0, x1, step, gx, gy, nx, ny, g00, g01, g10, g11 = face(k, r0x, r0y, r1x, r1y, values)
        return x0 - o0, x1 - o1, step - (o1 - o0), gx, gy, nx, ny, g00, g01, g10, g11

    return grown


def _growth(motions: int, grows: bool) -> tuple[Any, Any]:
    """Return compiled growth(w, i) -> (o0, o1), and beside(gy) -> the discrete gradient of a face behind gx."""
    if not grows:
        return inlined(lambda w, i: (0.0, 0.0)), inlined(lambda gy: (gy, 0.0))  # noqa: ARG005
    growth = inlined(lambda w, i: (w[OLD + motions, i], w[NEW + motions, i]))
    return growth, inlined(lambda gy: (gy, -1.0)) if motions == 2 else inlined(lambda gy: (-1.0, 0.0))  # noqa: ARG005


def _in_space(law: LawKind, rough: bool, exact: bool, damped: bool, level: float) -> Any:
    """Return the touch of a flat wall in space, whose friction is a vector across the normal n.

    With the slip s of a step and the force N on the wall, friction is mu N s / sqrt(s^2 + (v h)^2). Coulomb's own is
    the force f of the solve, with a stiff spring on s, where |f + c s| <= mu N; else mu N d with d along f + c s, which
    the part of s across d turns. In all cases its slope is turn (1 - n n^T - d d^T) + mu N' d n^T.
    """
    respond, faced, wall, own = responder(law, damped), _faced(law), VALUES, VALUES + 4 + len(law.names)
    at_law, force, slip, unit = _values(wall + 4, len(law.names)), own, own + 3, own + 6

    def compiled(h, count, workspace):  # type: ignore[no-untyped-def]
        w = numba.carray(workspace, (ROWS, WIDTH))
        for i in range(count):
            values, x0, x1 = at_law(w, i), -w[wall + 3, i], -w[wall + 3, i]
            for k in range(3):
                x0, x1 = x0 + w[wall + k, i] * w[OLD + k, i], x1 + w[wall + k, i] * w[NEW + k, i]
            step = x1 - x0
            if level > 0:
                W0, W1 = respond(x0, x0, 0.0, h, level, values)[3], respond(x1, x1, 0.0, h, level, values)[3]
                T, slope, _, _ = respond(x0 + level * step, x0 + level * step, step, h, level, values)
                w[POTENTIAL, i], w[LOST, i] = W1, T * step - (W1 - W0)
            else:
                seen = faced(w, i, values, w[wall, i], w[wall + 1, i], w[wall + 2, i])
                T, slope, beyond, W = respond(x0, x1, step, h, level, seen)
                w[POTENTIAL, i], w[LOST, i] = W, beyond * step
            w[SLID, i] = 0.0
            for k in range(3):
                if rough and exact:
                    w[unit + k, i] = -w[FORCE + k, i]
                w[FORCE + k, i] = -T * w[wall + k, i]
                for n in range(3):
                    w[SLOPE + 3 * k + n, i] = -slope * w[wall + k, i] * w[wall + n, i]
            if not rough:
                continue
            most, grow, full, size, back = w[MU, i] * abs(T), w[MU, i] * np.sign(T) * slope, w[CREEP, i], 0.0, 0.0
            for k in range(3):
                w[slip + k, i] = w[NEW + k, i] - w[OLD + k, i] - step * w[wall + k, i]
            for row in (unit, slip):  # round-off along the normal, which stiff friction would make a force
                out = w[wall, i] * w[row, i] + w[wall + 1, i] * w[row + 1, i] + w[wall + 2, i] * w[row + 2, i]
                for k in range(3):
                    w[row + k, i] -= out * w[wall + k, i]
            for k in range(3):
                way = s = w[slip + k, i]
                if exact:
                    way, w[force + k, i] = w[unit + k, i] + full / STICKING * s, w[unit + k, i] + full * s
                w[unit + k, i], size, back = way, size + way * way, back + s * w[LAST + k, i]
            if exact:
                size = np.sqrt(size)
                holds = most > 0 and size <= most
                turn = full if holds else min(most * full / STICKING / (size - most), full) if most > 0 else 0.0
            else:  # a slip that turned round: at no slip
                holds = back < 0
                size = np.sqrt((0.0 if holds else size) + (full * h) ** 2)
                turn = most / size
            along, worked = 0.0, 0.0
            for k in range(3):
                w[unit + k, i] = 0.0 if holds else w[unit + k, i] / (size + 1e-300)
                along += w[unit + k, i] * w[slip + k, i]
            for k in range(3):
                s, d = w[slip + k, i], w[unit + k, i]
                if not exact:
                    w[force + k, i], w[LAST + k, i] = turn * s, 0.0 if holds else s
                elif not holds:
                    w[force + k, i] = most * d + turn * (s - along * d)
                for n in range(3):
                    across = (1.0 if k == n else 0.0) - w[wall + k, i] * w[wall + n, i] - d * w[unit + n, i]
                    w[SLOPE + 3 * k + n, i] -= turn * across + grow * d * w[wall + n, i]
                w[FORCE + k, i] -= w[force + k, i]
                worked += w[force + k, i] * s
            w[SLID, i] = worked

    return compiled


def _faced(law: LawKind) -> Any:
    """Return compiled faced(w, i, values, g) -> values of a law; of impulses, what `LawKind.impact` takes along g."""
    if law.impact is None:
        return inlined(lambda w, i, values, gx, gy, gz: values)  # noqa: ARG005

    @inlined
    def faced(w, i, values, gx, gy, gz):  # type: ignore[no-untyped-def]
        force = -(gx * w[FORCE, i] + gy * w[FORCE + 1, i] + gz * w[FORCE + 2, i]) / (gx * gx + gy * gy + gz * gz)
        return force, w[CREEP, i], gx * values[1] + gy * values[2] + gz * values[3], values[0]

    return faced


def settled(region: RegionKind, law: LawKind) -> int:
    """Return the address of the memory of a kind of law after a step from rows 0 to 2, with stored and lost energy."""
    key = (region, law)
    if key in _touches:
        return _touches[key]
    face, settle, potential, given = region.face, law.settle, law.potential, len(law.given)
    first = VALUES + len(region.names)
    at_region, at_law, kept = _values(VALUES, len(region.names)), _values(first, len(law.names)), len(law.memory)

    def struck(h, count, workspace):  # type: ignore[no-untyped-def]
        w = numba.carray(workspace, (ROWS, WIDTH))
        for i in range(count):
            for k in range(kept):
                w[first + given + k, i] = settle(w[OLD + k, i], w[NEW + k, i], h, w[first + given + k, i])

    def compiled(h, count, workspace):  # type: ignore[no-untyped-def]
        w = numba.carray(workspace, (ROWS, WIDTH))
        for i in range(count):
            x0, x1 = face(0, w[OLD, i], 0.0, w[NEW, i], 0.0, at_region(w, i))[:2]
            before = potential(x1, *at_law(w, i))
            new = settle(x0, x1, h, *at_law(w, i))
            for k in range(kept):
                w[first + given + k, i] = new[k]
            after = potential(x1, *at_law(w, i))
            w[POTENTIAL, i], w[LOST, i] = after, w[LOST, i] + before - after

    _touches[key] = address(SIGNATURE, compiled if law.impact is None else struck)
    return _touches[key]


def _values(row: int, count: int) -> Any:
    """Return compiled values(w, i) -> tuple of `count` rows from `row` at evaluation i."""
    items = "".join(f"w[{row + k}, i], " for k in range(count))
    space: dict[str, Any] = {}
    exec(f"def values(w, i): return ({items})", space)  # numba unrolls no tuple of a variable length
    return inlined(space["values"])


@intrinsic
def call(typing, address, h, count, workspace):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Call a compiled touch by its address: the kernel needs no recompilation for new laws and regions."""
    signature = types.void(types.int64, types.float64, types.int64, types.int64)

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]  # noqa: ARG001
        f64, i64 = ir.DoubleType(), ir.IntType(64)
        kind = ir.FunctionType(ir.VoidType(), [f64, i64, f64.as_pointer()])
        builder.call(
            builder.inttoptr(args[0], kind.as_pointer()),
            [args[1], args[2], builder.inttoptr(args[3], f64.as_pointer())],
        )
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def move(typing, target, source, count):  # type: ignore[no-untyped-def]  # noqa: ARG001
    """Copy numbers from one address to another: loops over lanes that do nothing else are not made vectors."""

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]  # noqa: ARG001
        to, here = (builder.inttoptr(one, ir.DoubleType().as_pointer()) for one in args[:2])
        cgutils.raw_memcpy(builder, to, here, args[2], ir.Constant(ir.IntType(64), 8))
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), generate
