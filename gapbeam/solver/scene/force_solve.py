"""The contact solve of a step: forces on the points that touch, by Newton's method on the forces.

Contacts that feel nothing stay out of the equations. With D the Delassus operator and J the slopes of the law,

    (1 - h J D) F = F_law(y) + J (y_free - y),     y_new = y_free + h D F,

until the law reproduces F: to round-off, or to the tolerance twice running. Where many contacts move with few motions,
as stations of a rigid section do, D = Q Q^T with few columns in Q, and the equations are those of x = Q^T F:

    (1 - h Q^T J Q) x = Q^T (F_law(y) + J (y_free - y)),     y_new = y_free + h Q x,     F = F_law(y) + J (y_new - y).

After some passes a line search on the step
potential helps where there is one (no friction), then a continuation in stiffness. Friction needs neither: a contact
whose slip turns round is linearized at no slip.
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"
from __future__ import annotations

from gapbeam.solver.scene.lane_code import L, add, clear, copy, eliminate, lanewise, spread
from gapbeam.solver.scene.touch_kernel import CREEP, FORCE, LAST, MU, NEW, OLD, SLOPE, WIDTH, call, move

PASSES, PLAIN, RAMP, EPS, SUMMED = 120, 8, 60, 2e-16, 64.0
EASY, HARDER = 20, 2  # powers of two: how easily friction slides at first, and by how much it hardens at a time


@lanewise
def ask(slabs, h, y0, y1, F, room, which, scale, begin):
    """Ask for forces and slopes at y1 of the contacts whose flag is `which`, neighbors in one call.

    Return how many of those that were open feel something; they are flagged.
    """
    flag, law, J, w, fresh, keep = room.flag, room.law, room.J, slabs.work, 0, 0.0 if begin else 1.0
    for s in range(len(slabs.address)):
        first, last, d = slabs.start[s], slabs.start[s + 1], slabs.motions[s]
        e = first
        while e < last:
            b = e
            while e < last and flag[e] == which:
                o, c = slabs.motion[e], e - first
                for k in range(d):
                    row = slabs.place[s] + 8 * (WIDTH * k + L * c)
                    move(row + 8 * WIDTH * NEW, y1.ctypes.data + 8 * L * (o + k), L)
                    if slabs.settle[s] != 0 or (slabs.rough and slabs.sticks[s]):  # impulses and friction ask for it
                        move(row + 8 * WIDTH * FORCE, F.ctypes.data + 8 * L * (o + k), L)
                    if d > 1:
                        for lane in range(L):
                            w[s, LAST + k, c, lane] *= keep
                    if begin:
                        move(row + 8 * WIDTH * OLD, y0.ctypes.data + 8 * L * (o + k), L)
                e += 1
            if e == b:
                e += 1
                continue
            call(slabs.address[s], h, L * (e - b), slabs.place[s] + 8 * L * (b - first))
            for i in range(b, e):
                o, c, felt = slabs.motion[i], i - first, 0.0
                for k in range(d):
                    for lane in range(L):
                        law[o + k, lane] = scale * w[s, FORCE + k, c, lane]
                        J[3 * (o + k), lane] = scale * w[s, SLOPE + 3 * k, c, lane]
                    for n in range(1, d):
                        for lane in range(L):
                            J[3 * (o + k) + n, lane] = scale * w[s, SLOPE + 3 * k + n, c, lane]
                if which != 0:
                    continue
                for k in range(d):
                    for lane in range(L):
                        felt += abs(law[o + k, lane]) + abs(J[3 * (o + k), lane]) + abs(F[o + k, lane])
                    for n in range(1, d):
                        for lane in range(L):
                            felt += abs(J[3 * (o + k) + n, lane])
                if not felt == 0.0:  # noqa: SIM201 - NaN feels
                    flag[i] = 1
                    fresh += 1
    return fresh


@lanewise
def gather(slabs, D, room):
    """List the closed motions, and their part of D if the room takes it."""
    a = 0
    room.shut[:] = 0
    for s in range(len(slabs.address)):
        d = slabs.motions[s]
        for e in range(slabs.start[s], slabs.start[s + 1]):
            if room.flag[e]:
                for k in range(d):
                    room.closed[a + k], room.span[a + k], room.shut[slabs.motion[e] + k] = slabs.motion[e] + k, d - k, 1
                a += d
    if a <= len(room.D):
        for i in range(a):
            for j in range(a):
                room.D[i, j] = D[room.closed[j], room.closed[i]]
    room.size[0] = a
    return a


@lanewise
def off(h, D, free, F, y1, room, a, tolerance, sticks):
    """Compare F with the law, by the motion that the mobility of a contact makes of the difference.

    Where friction sticks, forces may be large whose motions cancel: places are known to round-off of the sum of these
    motions, which stiff friction makes forces.

    Return 0: to round-off, 1: to the tolerance or round-off of sums, so that one more pass of Newton will do, 2: not.
    """
    law, J, size, closed, rough, loose, bad = room.law, room.J, room.way, room.closed, 0, 0, 0
    for i in range(a):
        if room.span[i] == 1 and not sticks and (i == 0 or room.span[i - 1] == 1):
            continue
        for lane in range(L):
            size[i, lane] = abs(y1[closed[i], lane]) + abs(free[closed[i], lane])
    for j in range(a if sticks else 0):
        for i in range(a):
            c = h * abs(D[closed[j], closed[i]])
            for lane in range(L):
                size[i, lane] += c * abs(F[closed[j], lane])
    i = 0
    while i < a:
        d, o = room.span[i], closed[i]
        h00 = h * D[o, o]
        if d == 1:
            for lane in range(L):
                r = abs(law[o, lane] - F[o, lane])
                u = size[i, lane] if sticks else abs(y1[o, lane]) + abs(free[o, lane])
                miss, limit = h00 * r, tolerance * u * (1.0 - h00 * J[3 * o, lane])
                near = EPS * (abs(law[o, lane]) + u * abs(J[3 * o, lane]))
                rough += not r <= near  # NaN is bad
                loose += not r <= SUMMED * near
                bad += not miss <= limit
        elif d == 2:
            h01, h10, h11, p = h * D[o + 1, o], h * D[o, o + 1], h * D[o + 1, o + 1], o + 1
            for lane in range(L):
                r, s = law[o, lane] - F[o, lane], law[p, lane] - F[p, lane]
                j00, j01, j10, j11 = J[3 * o, lane], J[3 * o + 1, lane], J[3 * p, lane], J[3 * p + 1, lane]
                a00, a01 = 1.0 - j00 * h00 - j01 * h10, -j00 * h01 - j01 * h11
                a10, a11 = -j10 * h00 - j11 * h10, 1.0 - j10 * h01 - j11 * h11
                u, v = size[i, lane], size[i + 1, lane]
                x0, x1, limit = a11 * r - a01 * s, a00 * s - a10 * r, tolerance * (u + v) * abs(a00 * a11 - a01 * a10)
                miss = abs(h00 * x0 + h01 * x1) + abs(h10 * x0 + h11 * x1)
                near = EPS * (abs(law[o, lane]) + abs(j00) * u + abs(j01) * v)
                beside = EPS * (abs(law[p, lane]) + abs(j10) * u + abs(j11) * v)
                rough += not (abs(r) <= near and abs(s) <= beside)
                loose += not (abs(r) <= SUMMED * near and abs(s) <= SUMMED * beside)
                bad += not miss <= limit
        else:
            A, x = room.A[:d, :d], room.new[:d]
            for k in range(d):
                for lane in range(L):
                    x[k, lane], near = law[o + k, lane] - F[o + k, lane], abs(law[o + k, lane])
                    for c in range(d):
                        A[k, c, lane] = 1.0 if k == c else 0.0
                        near += abs(J[3 * (o + k) + c, lane]) * size[i + c, lane]
                        for n in range(d):
                            A[k, c, lane] -= J[3 * (o + k) + n, lane] * h * D[o + c, o + n]
                    rough += not abs(x[k, lane]) <= EPS * near
                    loose += not abs(x[k, lane]) <= SUMMED * EPS * near
            eliminate(A, x, room.inverse, d)
            for lane in range(L):
                whole = total = 0.0
                for k in range(d):
                    miss = 0.0
                    for c in range(d):
                        miss += D[o + c, o + k] * x[c, lane]
                    whole, total = whole + size[i + k, lane], total + abs(h * miss)
                bad += not total <= tolerance * whole
        i += d
    return 0 if rough == 0 else 1 if bad == 0 or (sticks and loose == 0) else 2


@lanewise
def solve(slabs, h, D, Q, y0, free, F, y1, room, tolerance):
    """Find contact forces F (a guess at entry) and places y1 of a step. Return passes, negative if not converged.

    Where friction that hardly slides keeps Newton's method in a cycle, the step is solved with friction that slides
    easily, which then hardens to what was given: forces of one solve start the next.
    """
    stage, spent = -1, 0
    while True:
        found = newton(slabs, h, D, Q, y0, free, F, y1, room, tolerance)
        spent += abs(found)
        if stage == 0 or (stage < 0 and (found >= 0 or not slabs.rough)):
            return spent if found >= 0 else -spent
        if stage < 0:
            stage = EASY
            slide(slabs, 2.0**EASY)
            for i in range(len(D)):
                for lane in range(L):
                    F[i, lane] = 0.0
        else:
            stage -= HARDER
            slide(slabs, 0.5**HARDER)


@lanewise
def slide(slabs, ease):
    """Ease friction by a power of two: exactly, so that it can be taken back.

    The speed up to which it gives way is multiplied, or the coefficient of friction that sticks is divided.
    """
    for s in range(len(slabs.address)):
        if slabs.motions[s] > 1:
            row, by = (MU, 1.0 / ease) if slabs.sticks[s] else (CREEP, ease)
            for e in range(slabs.start[s + 1] - slabs.start[s]):
                for lane in range(L):
                    slabs.work[s, row, e, lane] *= by


@lanewise
def newton(slabs, h, D, Q, y0, free, F, y1, room, tolerance):
    """Find contact forces F (a guess at entry) and places y1. Return passes, negative if not converged."""
    m, new, way, closed = len(D), room.new, room.way, room.closed
    room.flag[:] = 0
    copy(free, y1)
    a, near = 0, False
    for j in range(m):
        known = 0.0
        for lane in range(L):
            known += abs(F[j, lane])
        if known > 0:
            closed[a] = j
            a += 1
    if 2 * Q.shape[1] < a and not slabs.rough:
        clear(room.x[: Q.shape[1]])
        spread(Q, closed, a, F, room.x, 1.0)
        add(Q, room.x, y1, h)
    else:
        spread(D, closed, a, F, y1, h)
    fresh = ask(slabs, h, y0, y1, F, room, 0, 1.0, True) > 0
    room.size[0] = 0
    if not fresh:
        return 0
    for it in range(PASSES):
        scale = 1.0 if it < RAMP else min(1.0, 10.0 ** (-8 + 0.25 * (it - RAMP)))
        if fresh:
            a = gather(slabs, D, room)
        else:
            ask(slabs, h, y0, y1, F, room, 1, scale, False)
        miss = off(h, D, free, F, y1, room, a, tolerance, slabs.rough) if scale == 1.0 else 2
        done, near = miss == 0 or (miss == 1 and near), miss == 1
        if done:
            if fresh or a == m:  # the others were asked at these very places
                return it + 1
            for i in range(m):  # places of the open ones; those of the closed stay as they are
                if not room.shut[i]:
                    copy(free[i : i + 1], y1[i : i + 1])
            for t in range(a):
                j = closed[t]
                for i in range(m):
                    if not room.shut[i]:
                        c = h * D[j, i]
                        for lane in range(L):
                            y1[i, lane] += c * F[j, lane]
            fresh = ask(slabs, h, y0, y1, F, room, 0, 1.0, False) > 0
            if not fresh:
                return it + 1
            a = gather(slabs, D, room)
        fresh = False
        if a <= 2 and it < PLAIN:
            few(h, free, F, y1, room, a)
            continue
        for i in range(a):
            copy(free[closed[i] : closed[i] + 1], way[i : i + 1])
        linearized(y1, room, a)
        if a <= len(room.A):
            by_forces(h, room, a)
        else:
            by_motions(h, Q, y1, room, a)
        if PLAIN <= it < RAMP and not slabs.rough:
            search(slabs, h, y0, y1, F, room, a)
        for i in range(a):
            o = closed[i]
            for lane in range(L):
                F[o, lane], y1[o, lane] = new[i, lane], way[i, lane]
    return -PASSES


@lanewise
def linearized(y1, room, a):
    """Set `new` to the forces of `a` closed motions at places `way`, by their slopes at y1."""
    new, way, i = room.new, room.way, 0
    while i < a:
        d, o = room.span[i], room.closed[i]
        for k in range(d):
            for lane in range(L):
                new[i + k, lane] = room.law[o + k, lane] + room.J[3 * (o + k), lane] * (way[i, lane] - y1[o, lane])
            for n in range(1, d):
                for lane in range(L):
                    new[i + k, lane] += room.J[3 * (o + k) + n, lane] * (way[i + n, lane] - y1[o + n, lane])
        i += d


@lanewise
def by_forces(h, room, a):
    """Solve the equations of `a` closed motions for their new forces and places."""
    J, A, D, i = room.J, room.A, room.D, 0
    while i < a:
        d = room.span[i]
        for k in range(i, i + d):
            p = 3 * room.closed[k]
            for j in range(a):
                c0, c1 = h * D[i, j], h * D[i + (d > 1), j]
                for lane in range(L):
                    A[k, j, lane] = -c0 * J[p, lane] - c1 * J[p + 1, lane]  # the second is 0 for one motion
            for lane in range(L):
                A[k, k, lane] += 1.0
            if d == 3:
                for j in range(a):
                    c0 = h * D[i + 2, j]
                    for lane in range(L):
                        A[k, j, lane] -= c0 * J[p + 2, lane]
        i += d
    eliminate(A, room.new, room.inverse, a)
    add(D[:a, :a], room.new[:a], room.way[:a], h)


@lanewise
def by_motions(h, Q, y1, room, a):
    """Solve the equations of `a` closed motions for new forces and places by the columns of Q."""
    J, A, x, new, closed, columns, i = room.J, room.A, room.x, room.new, room.closed, Q.shape[1], 0
    clear(x[:columns])
    for r in range(columns):
        for s in range(columns):
            for lane in range(L):
                A[r, s, lane] = 1.0 if r == s else 0.0
    for t in range(a // 4):
        i = 4 * t
        o, o1, o2, o3 = closed[i], closed[i + 1], closed[i + 2], closed[i + 3]
        for r in range(columns):
            q0, q1, q2, q3 = Q[o, r], Q[o1, r], Q[o2, r], Q[o3, r]
            for lane in range(L):
                x[r, lane] += q0 * new[i, lane] + q1 * new[i + 1, lane] + q2 * new[i + 2, lane] + q3 * new[i + 3, lane]
    for i in range(a // 4 * 4, a):
        for r in range(columns):
            for lane in range(L):
                x[r, lane] += Q[closed[i], r] * new[i, lane]
    i = 0
    while i < a:  # contacts of one motion: a symmetric part
        d, o = room.span[i], closed[i]
        i += d
        if d > 1:
            continue
        if i + 2 < a and room.span[i] == 1 and room.span[i + 1] == 1 and room.span[i + 2] == 1:
            o1, o2, o3, i = closed[i], closed[i + 1], closed[i + 2], i + 3
            for r in range(columns):
                q0, q1, q2, q3 = h * Q[o, r], h * Q[o1, r], h * Q[o2, r], h * Q[o3, r]
                for s in range(r, columns):
                    c0, c1, c2, c3 = q0 * Q[o, s], q1 * Q[o1, s], q2 * Q[o2, s], q3 * Q[o3, s]
                    for lane in range(L):
                        A[r, s, lane] -= (
                            c0 * J[3 * o, lane] + c1 * J[3 * o1, lane] + c2 * J[3 * o2, lane] + c3 * J[3 * o3, lane]
                        )
            continue
        for r in range(columns):
            for s in range(r, columns):
                c = h * Q[o, r] * Q[o, s]
                for lane in range(L):
                    A[r, s, lane] -= c * J[3 * o, lane]
    for r in range(columns):
        for s in range(r):
            copy(A[s, r : r + 1], A[r, s : s + 1])
    i = 0
    while i < a:  # contacts of several: their slopes are not symmetric
        d, o = room.span[i], closed[i]
        for k in range(d if d > 1 else 0):
            for n in range(d):
                for r in range(columns):
                    for s in range(columns):
                        c = h * Q[o + k, r] * Q[o + n, s]
                        for lane in range(L):
                            A[r, s, lane] -= c * J[3 * (o + k) + n, lane]
        i += d
    eliminate(A, x, room.inverse, columns)
    for i in range(a):
        add(Q[closed[i] : closed[i] + 1], x[:columns], room.way[i : i + 1], h)
    linearized(y1, room, a)


@lanewise
def few(h, free, F, y1, room, a):
    """Update one or two closed motions by their equations, whose solution is written out."""
    law, J, o, p = room.law, room.J, room.closed[0], room.closed[a - 1]
    if a == 1:
        c = h * room.D[0, 0]
        for lane in range(L):
            slope = J[3 * o, lane]
            f = (law[o, lane] + slope * (free[o, lane] - y1[o, lane])) / (1.0 - c * slope)
            F[o, lane], y1[o, lane] = f, free[o, lane] + c * f
        return
    c00, c01, c10, c11 = h * room.D[0, 0], h * room.D[0, 1], h * room.D[1, 0], h * room.D[1, 1]
    r, s = (3 * p, 3 * p + 1) if room.span[0] == 2 else (3 * o + 1, 3 * p)  # slopes of p by o, and by itself
    for lane in range(L):
        j00, j01, j10, j11 = J[3 * o, lane], J[3 * o + 1, lane], J[r, lane], J[s, lane]
        x, y = free[o, lane] - y1[o, lane], free[p, lane] - y1[p, lane]
        b0, b1 = law[o, lane] + j00 * x + j01 * y, law[p, lane] + j10 * x + j11 * y
        a00, a01 = 1.0 - j00 * c00 - j01 * c10, -j00 * c01 - j01 * c11
        a10, a11 = -j10 * c00 - j11 * c10, 1.0 - j10 * c01 - j11 * c11
        inverse = 1.0 / (a00 * a11 - a01 * a10)
        f0, f1 = inverse * (a11 * b0 - a01 * b1), inverse * (a00 * b1 - a10 * b0)
        F[o, lane], y1[o, lane] = f0, free[o, lane] + c00 * f0 + c01 * f1
        F[p, lane], y1[p, lane] = f1, free[p, lane] + c10 * f0 + c11 * f1


@lanewise
def search(slabs, h, y0, y1, F, room, a):
    """Shorten each lane's update to where the step potential stops falling (bisection on its derivative)."""
    low, high, s, rise = room.line[0], room.line[1], room.line[2], room.line[3]
    new, way, base = room.new, room.way, room.base
    for i in range(a):
        copy(y1[room.closed[i] : room.closed[i] + 1], base[i : i + 1])
    for lane in range(L):
        low[lane], high[lane], s[lane] = 0.0, 1.0, 1.0
    for _ in range(30):
        for i in range(a):
            for lane in range(L):
                y1[room.closed[i], lane] = base[i, lane] + s[lane] * (way[i, lane] - base[i, lane])
        ask(slabs, h, y0, y1, F, room, 1, 1.0, False)
        for lane in range(L):
            rise[lane] = 0.0
        for i in range(a):
            o = room.closed[i]
            for lane in range(L):
                rise[lane] += (F[o, lane] + s[lane] * (new[i, lane] - F[o, lane]) - room.law[o, lane]) * (
                    way[i, lane] - base[i, lane]
                )
        short = 0
        for lane in range(L):
            if rise[lane] <= 0:
                low[lane] = s[lane]
            else:
                high[lane] = s[lane]
            s[lane] = 1.0 if low[lane] == 1.0 else 0.5 * (low[lane] + high[lane])
            short += low[lane] < 1.0
        if short == 0:
            break
    for i in range(a):
        o = room.closed[i]
        for lane in range(L):
            new[i, lane] = F[o, lane] + low[lane] * (new[i, lane] - F[o, lane])
            way[i, lane] = base[i, lane] + low[lane] * (way[i, lane] - base[i, lane])
