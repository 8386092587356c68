"""Instants for records of the history, from the records of a block."""

from __future__ import annotations

import numpy as np

from gapbeam.solver.diagnostics.energy_ledger import Energies
from gapbeam.solver.diagnostics.output_instants import Instants
from gapbeam.solver.march.compiled.compiled_block import CompiledBlock
from gapbeam.solver.march.compiled.ledger_kernel import APPROACH, CLOSINGS, CONTACT_TIME, IMPULSE, SQUARE
from gapbeam.solver.system.operators import Array, row_product


def instants_of(block: CompiledBlock, count: int) -> Instants:
    """Return the first `count` records of a block."""
    kept, modal = block.records, block.modal
    energies = kept.energies[:count]

    def energy(name: str) -> Array:
        return np.ascontiguousarray(energies[:, Energies._fields.index(name)])

    q = kept.q[:count]
    return Instants(
        times=block.times[:count],
        u=block.u[:count],
        v=block.v[:count],
        contact_force=kept.force[:count],
        contact_moment=kept.moment[:count],
        contact_resultant=kept.resultant[:count],
        contact_area=kept.area[:count],
        active_points=kept.active[:count],
        penetration=kept.penetration[:count],
        impulse=kept.over_time[:count, IMPULSE],
        contact_time=kept.over_time[:count, CONTACT_TIME],
        closings=kept.over_time[:count, CLOSINGS],
        approach=kept.over_time[:count, APPROACH],
        force_square=kept.over_time[:count, SQUARE],
        friction_force=None,
        joint_contact=None if modal.system.reactions is None else kept.joint_contact[:count],
        sliding_work=kept.sliding.rows[:count] if modal.system.contact.measures_sliding else None,
        work_by_mode=kept.sliding.part_rows[:count] if modal.system.contact.measures_sliding else None,
        point_work=kept.sliding.point_rows[:count] if modal.system.contact.maps_sliding else None,
        kinetic=energy("kinetic"),
        strain=energy("strain"),
        restraint=0.5 * np.sum(row_product(q, modal.restraint) ** 2, axis=1),
        contact=energy("contact"),
        load_work=kept.load_work[:count],
        structural=energy("structural"),
        contact_loss=energy("contact_loss"),
        friction_loss=energy("friction_loss"),
        algorithmic=energy("algorithmic"),
        residual=kept.residual[:count],
        iterations=kept.iterations[:count].astype(float),
    )
