"""One step, compiled: the linear motion between ports, and feedback and contact condensed on these.

`meet` is the physics of feedback and contact for every structure; `march` adds structures in their modes around it, and
`sparse_march` those with sparse matrices.
"""

# mypy: disable-error-code="no-untyped-def,no-untyped-call"
from __future__ import annotations

from math import sqrt

from gapbeam.solver.scene.force_solve import solve
from gapbeam.solver.scene.lane_code import L, across, add, blocks, clear, copy, diagonals, lanewise, spread
from gapbeam.solver.scene.touch_kernel import LOST, NEW, OLD, POTENTIAL, SLID, call

DAMPED, LAW, RUBBED, LOADED, WALLED, STORED, KINETIC, STRAIN = range(8)


@lanewise
def meet(linear, slabs, h, load, u, y, F, z, yin, ledger, space, room, tolerance):
    """Meet feedback and contact in one step, and keep their ledger; return passes, or a negative number.

    u (p + outputs or more, L): free velocities of the ports, then 0.

    space.moved: motion of the walls. On return: y, z, yin at the end, F the contact forces (those in room.closed), u
    velocities of the ports, then feedback forces.
    """
    free, y1, stack, moved, feed = space.free, space.y1, space.stack, space.moved, linear.feed
    m, no, nf, nz, ni = len(linear.delassus), len(feed.acted), len(linear.patterns), len(z), len(yin)
    phi = m + nf + feed.motions
    if no:
        copy(z, stack)
        copy(yin, stack[nz:])
        for j in range(ni):
            for lane in range(L):
                stack[nz + ni + j, lane] = u[feed.port[j], lane]
        clear(space.felt)
        diagonals(feed.law, 0, feed.forces, stack, space.felt)
        across(feed.acted, space.felt, u)
    for j in range(m):
        for lane in range(L):
            free[j, lane] = y[j, lane] - moved[j, lane] + h * u[j, lane]
    passes = solve(slabs, h, linear.delassus, linear.low_rank, y, free, F, y1, room, tolerance)
    if passes < 0:
        return passes
    spread(linear.carry, room.closed, room.size[0], F, u[m:], 1.0)
    for s in range(len(slabs.settle)):  # laws that remember
        if slabs.settle[s] != 0:
            count = slabs.start[s + 1] - slabs.start[s]
            for c in range(count):
                j = slabs.motion[slabs.start[s] + c]
                for k in range(slabs.motions[s]):
                    for lane in range(L):
                        slabs.work[s, OLD + k, c, lane] = y[j + k, lane]
                        slabs.work[s, NEW + k, c, lane] = y1[j + k, lane]
            call(slabs.settle[s], h, L * count, slabs.place[s])
    clear(ledger[STORED:])
    for s in range(len(slabs.address)):
        for c in range(slabs.start[s + 1] - slabs.start[s]):
            spent = slabs.spent[slabs.start[s] + c]
            for lane in range(L):
                spent[lane] += slabs.work[s, LOST, c, lane] + slabs.work[s, SLID, c, lane]
                ledger[STORED, lane] += slabs.work[s, POTENTIAL, c, lane]
                ledger[LAW, lane] += slabs.work[s, LOST, c, lane]
                ledger[RUBBED, lane] += slabs.work[s, SLID, c, lane]
    for j in range(m):
        for lane in range(L):
            ledger[WALLED, lane] += F[j, lane] * moved[j, lane]
            y[j, lane] = y1[j, lane]
    for j in range(nf):
        for lane in range(L):
            ledger[LOADED, lane] += h * load[j, lane] * u[m + j, lane]
    if no:
        for j in range(no):
            for lane in range(L):
                space.worked[j, lane] += h * u[phi + j, lane] * u[feed.port[ni + j], lane]
        for j in range(ni):
            for lane in range(L):
                stack[nz + ni + j, lane] = u[feed.port[j], lane]
                yin[j, lane] += h * u[feed.port[j], lane]
        clear(z)
        diagonals(feed.law, feed.forces, len(feed.law.row), stack, z)
    return passes


@lanewise
def sum_up(sums, place, F, size):
    """Take a step into the sums; size: room, (1, L)."""
    turns, window, at, slot = sums.turns, sums.window, sums.at[0], sums.at[1]
    for j in range(len(place)):  # arrays of their own: parts of one array would not go in vectors
        for lane in range(L):
            x = place[j, lane]
            sums.most[j, lane] = max(sums.most[j, lane], abs(x))
            sums.square[j, lane] += x * x
            window[j, slot, lane] = x
    contacts = len(sums.face)
    for c in range(len(sums.top)):
        if c >= contacts:
            for lane in range(L):
                size[0, lane] = sums.whole[c - contacts, lane]
                sums.whole[c - contacts, lane] = 0.0
        elif sums.first[c + 1] == sums.first[c] + 1:
            o = sums.first[c]
            for lane in range(L):
                size[0, lane] = abs(F[o, lane])
        else:
            o = sums.first[c]
            for lane in range(L):
                size[0, lane] = F[o, lane] * F[o, lane] + F[o + 1, lane] * F[o + 1, lane]
            for n in range(o + 2, sums.first[c + 1]):
                for lane in range(L):
                    size[0, lane] += F[n, lane] * F[n, lane]
            for lane in range(L):
                size[0, lane] = sqrt(size[0, lane])
        if c < contacts and sums.face[c] >= 0:
            f = sums.face[c]
            for lane in range(L):
                sums.whole[f, lane] += size[0, lane]
        for lane in range(L):
            x, before = size[0, lane], sums.before[c, lane]
            touched = 1.0 if x > 0.0 else 0.0
            sums.top[c, lane] = max(sums.top[c, lane], x)
            sums.total[c, lane] += x
            sums.closed[c, lane] += touched
            sums.closings[c, lane] += touched - touched * before
            sums.before[c, lane] = touched
    if len(turns):
        for i in range(len(turns)):
            sums.turned[i, slot] = turns[i, at]
        sums.at[0] = at + 1 if at + 1 < turns.shape[1] else 0
        sums.at[1] = slot + 1
        if slot + 1 == window.shape[1]:
            for j in range(len(place)):
                add(sums.turned, window[j], sums.waves[j], 1.0)
            sums.at[1] = 0


@lanewise
def march(
    linear, slabs, h, steps, q, v, acc, y, F, z, yin, loads, walls, ledger, sums, records, space, room, tolerance
):
    """March all lanes in place. Return Newton passes, or minus the number of the step that failed.

    Motions are (modes or rows, L); acc has no rows where the scheme needs none. loads (steps, loads, L), walls (steps +
    1, m, L), or (1, m, L) where none moves. sums, records: see `StepSums` and `StepRecords`.
    """
    inverse, squares, damping = linear.inverse, linear.squares, linear.damping
    patterns, answers, scheme = linear.patterns, linear.answers, linear.scheme
    speed, lag, u, place, moved, lost = space.speed, space.lag, space.u, space.place, space.moved, space.lost
    n, m, nw = len(squares), len(linear.delassus), len(linear.watch)
    no, nf, feed = len(linear.feed.acted), len(patterns), linear.feed
    accelerated, diagonal, total = len(acc) > 0, damping.shape[0] == 1, 0
    r, weight, root, drive = space.r, linear.weight, linear.root, speed if diagonal else space.r
    cv, ca, d0, d1, d2 = -scheme[0, 1] / h, -scheme[0, 2], scheme[1, 0], scheme[1, 1], scheme[1, 2] * h
    e0, e1, e2 = scheme[2, 0], scheme[2, 1], scheme[2, 2] * h
    g0, g1, g2 = scheme[3, 0] / h, scheme[3, 1] / h, scheme[3, 2]
    for k in range(steps):
        if accelerated:
            for i in range(n):
                for lane in range(L):
                    lag[i, lane] = d1 * v[i, lane] + d2 * acc[i, lane]
                    drive[i, lane] = (
                        cv * v[i, lane]
                        + ca * acc[i, lane]
                        - squares[i] * q[i, lane]
                        + patterns[0, i] * loads[k, 0, lane]
                    )
            if diagonal:
                for i in range(n):
                    for lane in range(L):
                        drive[i, lane] = weight[i] * (drive[i, lane] - damping[0, i] * lag[i, lane])
            else:
                add(damping, lag, drive, -1.0)
        else:
            for i in range(n):
                for lane in range(L):
                    drive[i, lane] = weight[i] * (
                        cv * root[i] * v[i, lane] - squares[i] * q[i, lane] + patterns[0, i] * loads[k, 0, lane]
                    )
        for j in range(1, nf):
            for i in range(n):
                for lane in range(L):
                    drive[i, lane] += weight[i] * patterns[j, i] * loads[k, j, lane]
        if not diagonal:
            clear(speed)
            add(inverse, drive, speed, 1.0)
        clear(u)
        add(linear.ports, speed, u, 1.0)
        if no:
            blocks(feed.rows, 0, feed.sensed, speed, u[m + nf :])
        if len(walls) > 1:
            for j in range(m):
                for lane in range(L):
                    moved[j, lane] = walls[k + 1, j, lane] - walls[k, j, lane]
        passes = meet(linear, slabs, h, loads[k], u, y, F, z, yin, ledger, space, room, tolerance)
        if passes < 0:
            return -(k + 1)
        total += passes
        spread(answers, room.closed, room.size[0], F, speed, 1.0)
        if no:
            blocks(feed.rows, feed.sensed, len(feed.rows.row), u[m + nf + feed.motions :], speed)
        clear(lost)
        if accelerated:
            for i in range(n):
                for lane in range(L):
                    x, b, w = v[i, lane], acc[i, lane], speed[i, lane]
                    lag[i, lane] += d0 * w
                    r[i, lane] = w * lag[i, lane]
                    q[i, lane] += h * w
                    v[i, lane] = e0 * w + e1 * x + e2 * b
                    acc[i, lane] = g0 * w + g1 * x + g2 * b
        else:
            for i in range(n):
                for lane in range(L):
                    w = speed[i, lane]
                    q[i, lane] += h * w
                    v[i, lane] = e0 * root[i] * w + e1 * v[i, lane]
                    if L == 1:
                        r[i, lane] = d0 * w * w
                    else:  # one reading of the modes less
                        lost[0, lane] += h * d0 * damping[0, i] * w * w
        if diagonal:
            if L == 1 or accelerated:
                add(damping, r, lost, h)
        else:
            clear(lost)
            clear(r)
            add(damping, lag if accelerated else speed, r, h if accelerated else h * d0)
            for i in range(n):
                for lane in range(L):
                    lost[0, lane] += speed[i, lane] * r[i, lane]
        for lane in range(L):
            ledger[DAMPED, lane] += lost[0, lane]
        summed = len(sums.most) + len(sums.top) > 0
        if summed or len(records.seen):
            clear(place)
            add(linear.watch, q, place, 1.0)
        if summed:
            sum_up(sums, place, F, lost)
        if len(records.seen):
            for lane in range(L):
                for j in range(nw):
                    records.seen[k, j, lane] = place[j, lane]
                for j in range(m):
                    records.felt[k, j, lane] = F[j, lane]
        if len(records.energies):
            copy(y, records.places[k])
            copy(space.worked, records.works[k])
            clear(records.speeds[k])
            add(linear.watch, v, records.speeds[k], 1.0)
            for lane in range(L):
                kinetic = strain = 0.0
                for i in range(n):
                    kinetic += 0.5 * v[i, lane] * v[i, lane]
                    strain += 0.5 * squares[i] * q[i, lane] * q[i, lane]
                for j in range(KINETIC):
                    records.energies[k, j, lane] = ledger[j, lane]
                records.energies[k, KINETIC, lane], records.energies[k, STRAIN, lane] = kinetic, strain
    return total
