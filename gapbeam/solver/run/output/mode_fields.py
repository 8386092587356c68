"""Mode shapes as fields that ParaView and meshio read: one instant a mode, its time the frequency in Hz."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from mpi4py import MPI

from gapbeam.solver.models.model import Model
from gapbeam.solver.modes.contact_modes import HeldModes
from gapbeam.solver.run.output.field_files import FieldWriter
from gapbeam.solver.system.semi_discrete import Snapshots

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
            still, none = np.zeros((1, len(scaled))), np.zeros((1, contact.size))
            writer.write(Snapshots(np.array([frequency]), scaled[None], still, none), model)
    finally:
        writer.close()
