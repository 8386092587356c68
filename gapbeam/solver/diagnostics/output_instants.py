"""Motion, contact and ledger at instants of a march, which records are made of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gapbeam.solver.diagnostics.energy_ledger import restraint_energy
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.point_contact import by_face, deepest_by_face, friction_by_face
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, ContactOperator, State


class Instants(NamedTuple):
    """Some instants, row by row; names as in `gapbeam.solver.record_table.HISTORY` and in `Ledger`.

    Attributes:
        times: (times,), s.
        u: DOFs that are marched and that this rank owns, (times, n).
        v: Their velocities, (times, n).
        contact_force: By face, (times, faces), N.
        contact_moment: (times, faces), N m.
        contact_resultant: Across the beam, y and z, (times, faces, 2), N; None where no face is around the beam.
        contact_area: (times, faces), m^2.
        active_points: (times, faces).
        penetration: (times, faces), m.
        impulse: (times, faces), N s.
        contact_time: (times, faces), s.
        closings: (times, faces).
        approach: Sum of the approach speeds of all closings, (times, faces), m/s.
        force_square: Square of the contact force integrated over time, (times, faces), N^2 s.
        friction_force: (times, faces, tangents), N; None: nothing has rubbed.
        joint_contact: Contact's part of the forces of joints, (times, r), N and N m; None: there are no joints.
        sliding_work: (times, faces), J; None: not measured.
        work_by_mode: Its parts, (times, faces, 3), J.
        point_work: That of each point, (times, m), J; None: not asked for.
        kinetic: (times,), J, like the rest of the ledger.
        strain: With the restraint.
        restraint: Energy in the restraint.
        contact: Potential of the contact.
        load_work: (times, loads).
        structural: Loss in Rayleigh damping.
        contact_loss: Loss in contact damping.
        friction_loss: Loss in friction.
        algorithmic: Loss by the scheme.
        residual: Residual of the balance.
        iterations: Contact iterations since the instant before, (times,).
    """

    times: Array
    u: Array
    v: Array
    contact_force: Array
    contact_moment: Array
    contact_resultant: Array | None
    contact_area: Array
    active_points: Array
    penetration: Array
    impulse: Array
    contact_time: Array
    closings: Array
    approach: Array
    force_square: Array
    friction_force: Array | None
    joint_contact: Array | None
    sliding_work: Array | None
    work_by_mode: Array | None
    point_work: Array | None
    kinetic: Array
    strain: Array
    restraint: Array
    contact: Array
    load_work: Array
    structural: Array
    contact_loss: Array
    friction_loss: Array
    algorithmic: Array
    residual: Array
    iterations: Array


def instant_of(state: State, accounts: Accounts) -> Instants:
    """Return a state with the accounts at its time; the iterations are reported once. Collective."""
    contact, ledger, peaks = accounts.system.contact, accounts.ledger, accounts.peaks
    across = contact.across
    if contact.turning is not None:
        across = contact.at(contact.interface.trace(state.u[VALUE], accounts.system.operators), state.time).across
    forces = contact.weights * state.pressure
    pressed = state.pressure > 0.0
    iterations, peaks.iterations = peaks.iterations, 0
    found = Instants(
        times=np.asarray(state.time),
        u=state.u[VALUE],
        v=state.v[VALUE],
        contact_force=by_face(contact, forces),
        contact_moment=by_face(contact, forces * contact.positions[:, 0]),
        contact_resultant=_resultant(contact, forces, across) if contact.support.around else None,
        contact_area=by_face(contact, np.where(pressed, contact.weights, 0.0)),
        active_points=by_face(contact, pressed.astype(float)),
        penetration=deepest_by_face(contact, state, accounts.system.operators),
        impulse=peaks.impulse,
        contact_time=accounts.times.time,
        closings=accounts.times.closings,
        approach=accounts.impacts.approach.copy(),
        force_square=peaks.square,
        friction_force=None if state.traction is None else friction_by_face(contact, state.traction),
        joint_contact=_joint_contact(accounts, state, forces, across),
        sliding_work=accounts.sliding.by_face,
        work_by_mode=accounts.sliding.parts_by_face,
        point_work=accounts.sliding.work.copy() if contact.maps_sliding else None,
        kinetic=np.asarray(ledger.kinetic),
        strain=np.asarray(ledger.strain),
        restraint=np.asarray(restraint_energy(accounts.system, state)),
        contact=np.asarray(ledger.contact),
        load_work=ledger.load_work,
        structural=np.asarray(ledger.structural),
        contact_loss=np.asarray(ledger.contact_loss),
        friction_loss=np.asarray(ledger.friction_loss),
        algorithmic=np.asarray(ledger.algorithmic),
        residual=np.asarray(ledger.residual),
        iterations=np.asarray(float(iterations)),
    )
    return Instants._make(None if column is None else column[None] for column in found)


def joined(instants: Sequence[Instants]) -> Instants:
    """Return several instants as one table; where some have no friction yet, theirs is none."""
    if len(instants) == 1:
        return instants[0]
    return Instants._make(_joined_columns(columns) for columns in zip(*instants, strict=True))


def _joined_columns(columns: Sequence[Array | None]) -> Array | None:
    known = [column for column in columns if column is not None]
    if not known:
        return None
    return np.concatenate([np.zeros_like(known[0]) if column is None else column for column in columns])


def _resultant(contact: ContactOperator, forces: Array, across: Array) -> Array:
    """Return the sum of point forces across the beam for each face, (faces, 2)."""
    return np.stack([by_face(contact, forces * along) for along in across.T], axis=-1)


def _joint_contact(accounts: Accounts, state: State, forces: Array, across: Array) -> Array | None:
    """Return the contact's part of the forces of joints in a state, (r,)."""
    reactions, contact = accounts.system.reactions, accounts.system.contact
    if reactions is None:
        return None
    friction = None if state.traction is None else contact.weights[:, None] * state.traction
    circles, turned = contact.turning, None
    if circles is not None:
        turned = (forces[:, None] * across)[circles.points].reshape(-1)
    return reactions.of_contact(forces, friction, turned)
