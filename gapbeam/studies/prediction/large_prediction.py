"""What a run costs that is too large to try out: coarser meshes of the same beam are tried out, and scaled.

    cost(n) = cost(n2) (n / n2)^b,    b = ln(cost(n2) / cost(n1)) / ln(n2 / n1)

for each part of the set-up, for a step, and for the memory above that of a process that has done nothing.
"""

from __future__ import annotations

import gc
import logging
import time
from dataclasses import replace
from math import log

from mpi4py import MPI

from gapbeam.solver.case.case import Case
from gapbeam.solver.models.energy_creation import refuse_energy_creators
from gapbeam.solver.models.model import build_model
from gapbeam.solver.run.output.run_summary import peak_memory
from gapbeam.studies.prediction.trial_prediction import Prediction, predict

LOG = logging.getLogger("gapbeam")
LARGEST = 300_000  # DOFs of a model that is tried out
TRIED = (20_000, 60_000)  # DOFs, about, of those tried out in its place
CELLS = 4  # through the thickness and across the width, by default


def predict_large(case: Case, dofs: int, comm: MPI.Comm) -> Prediction:
    """Predict what a run on a mesh with many DOFs costs.

    Args:
        case: The case.
        dofs: DOFs of its mesh.
        comm: Its ranks.

    Raises:
        UserError: Scheme and contact are known to create energy.
        NotConverged: A coarser beam found no seat.

    Collective.
    """
    idle = float(sum(peak_memory(comm)))
    tried: list[Prediction] = []
    sizes: list[int] = []
    for target in TRIED:
        clock = time.perf_counter()
        if comm.rank == 0:
            LOG.info("tries out a coarser mesh of about %d DOFs: %d are too many for that", target, dofs)
        model = build_model(coarser(case, dofs / target), comm)
        refuse_energy_creators(model)
        tried.append(predict(model, time.perf_counter() - clock, comm))
        sizes.append(model.mesh_dofs)
        del model
        gc.collect()
    small, large = tried
    ratio, growth = log(sizes[1] / sizes[0]), dofs / sizes[1]

    def scaled(first: float, second: float) -> float:
        power = log(second / first) / ratio if min(first, second) > 0.0 else 0.0
        return float(second * growth ** max(power, 0.0))

    return replace(
        large,
        setup={name: scaled(small.setup[name], seconds) for name, seconds in large.setup.items()},
        per_step=scaled(small.per_step, large.per_step),
        back_substitution=scaled(small.back_substitution, large.back_substitution),
        per_field=scaled(small.per_field, large.per_field),
        memory=idle + scaled(small.memory - idle, large.memory - idle),
        basis=f"scaled from coarser meshes of {sizes[0]} and {sizes[1]} DOFs, which were tried out: "
        f"more than {LARGEST} DOFs are too many for that",
        scaled=True,
    )


def coarser(case: Case, share: float) -> Case:
    """Return a case on a mesh that has about 1 / share of the DOFs; instead of a mesh file, on one of gmsh."""
    mesh = case.mesh
    scale = share ** (1.0 / mesh.dimension)
    thickness = case.profile.thickest
    support = mesh.support_size or thickness / 3.0
    sizes: dict[str, float | int | None] = {
        "file": None,
        "size": (mesh.size or thickness) * scale,
        "support_size": support * scale,
        "edge_size": mesh.edge_size and mesh.edge_size * scale,
        "cells_through_thickness": max(1, round((mesh.cells_through_thickness or CELLS) / scale)),
    }
    if mesh.dimension == 3:
        sizes["cells_across_width"] = max(1, round((mesh.cells_across_width or CELLS) / scale))
    return case.model_copy(update={"mesh": mesh.model_copy(update=sizes)})
