"""Many models in one process: communicators of MPI, of which MPICH has 2048, are let go of."""

from __future__ import annotations

import gc
import weakref

from gapbeam.solver.models import body
from tests.shared.models import beam_model


def test_meshes_that_nothing_needs_are_let_go_of() -> None:
    """Whether or not Python looks for cycles; a segmentation fault in DOLFINx came after some 600 meshes."""
    meshes = []
    gc.disable()
    try:
        for _ in range(2 * body.FEWEST):
            meshes.append(weakref.ref(beam_model({"mesh": {"degree": 1}}).body.meshed.tagged.mesh))
    finally:
        gc.enable()
    assert sum(mesh() is not None for mesh in meshes) <= body.FEWEST
