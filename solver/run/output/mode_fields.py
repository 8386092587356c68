"""Mode shapes as fields that ParaView and meshio read: one instant a mode, its time the frequency in Hz."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from mpi4py import MPI

from gapbeam.solver.models.model import Model
from gapbeam.solver.modes.contact_modes import HeldModes
from gapbeam.solver.run.output.field_files import FieldWriter
from gapbeam.solver.system.semi_discrete import State

LARGEST = 0.05  # displacement of a node, of the length of the beam


def write_mode_fields(folder: Path, model: Model, modes: HeldModes) -> None:
    """Write the shapes of all modes to fields.xdmf and fields.h5; the largest motion is 5 % of the length of the beam.

    Args:
        folder: Where they go.
        model: The model.
        modes: Its modes in one state of contact.

    Collective.
    """
    comm, contact = model.space.mesh.comm, model.system.contact
    writer = FieldWriter(folder, model)
    try:
        for frequency, shape in zip(modes.frequencies, modes.shapes.T, strict=True):
            bodies = shape[model.body.operators.size :]  # of supports, beside which the beam may be at rest
            moved = np.abs(np.concatenate([model.expand(shape), bodies]))
            largest = comm.allreduce(float(np.max(moved, initial=0.0)), op=MPI.MAX)
            scaled = shape * (LARGEST * model.case.beam.length / largest)
            u = np.stack([scaled, np.zeros_like(scaled), np.zeros_like(scaled)])
            closed = np.zeros(contact.size)
            writer.write(State(float(frequency), u, np.zeros_like(u), closed, closed), model)
    finally:
        writer.close()
