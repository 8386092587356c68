"""Figures of a mesh that are the same whatever holds it, and on every rank; lengths in m."""

from __future__ import annotations

from typing import Any

import numpy as np

from gapbeam.meshes.tagged_mesh import TaggedMesh, contact_facet_length
from gapbeam.meshes.versions.mesh_geometry import geometry_order


def described(tagged: TaggedMesh) -> dict[str, Any]:
    """Count and measure a mesh; the size of a cell is the largest distance of its vertices. Collective."""
    mesh, comm = tagged.mesh, tagged.mesh.comm
    owned = np.arange(mesh.topology.index_map(tagged.dimension).size_local, dtype=np.int32)
    sizes = mesh.h(tagged.dimension, owned)
    return {
        "cell": mesh.topology.cell_name(),
        "geometry_order": geometry_order(mesh),
        "cells": tagged.cell_count,
        "vertices": tagged.vertex_count,
        "facets": dict(tagged.facet_counts),
        "lower": tagged.lower,
        "upper": tagged.upper,
        "smallest_cell": min(comm.allgather(float(np.min(sizes, initial=np.inf)))),
        "largest_cell": max(comm.allgather(float(np.max(sizes, initial=0.0)))),
        "contact_facet_length": contact_facet_length(tagged),
    }
