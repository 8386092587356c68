"""From the records of a block to what records of the history are made of."""

from __future__ import annotations

import numpy as np

from solver.compiled import books
from solver.compiled.loop import Block
from solver.operators import Array
from solver.output.instants import Instants
from solver.row_products import row_product


def instants_of(block: Block, count: int) -> Instants:
    """Return the first `count` records of a block."""
    kept, modal = block.records, block.loop.modal
    energies = kept.energies[:count]

    def energy(number: int) -> Array:
        return np.ascontiguousarray(energies[:, number])

    q = kept.q[:count]
    return Instants(
        times=block.times[:count],
        u=block.u[:count],
        v=block.v[:count],
        contact_force=kept.force[:count],
        contact_moment=kept.moment[:count],
        contact_area=kept.area[:count],
        active_points=kept.active[:count],
        penetration=kept.penetration[:count],
        impulse=kept.impulse[:count],
        friction_force=None,
        kinetic=energy(books.KINETIC),
        strain=energy(books.STRAIN),
        restraint=0.5 * np.sum(row_product(q, modal.restraint) * q, axis=1),
        contact=energy(books.CONTACT),
        load_work=kept.load_work[:count],
        structural=energy(books.STRUCTURAL),
        contact_loss=energy(books.CONTACT_LOSS),
        friction_loss=energy(books.FRICTION_LOSS),
        algorithmic=energy(books.ALGORITHMIC),
        residual=kept.residual[:count],
        iterations=kept.iterations[:count].astype(float),
    )
