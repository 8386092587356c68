"""Make the meshes of all cells on several ranks; reports figures, areas and distances of the points."""

from __future__ import annotations

import json

from gapbeam.meshes.mesh_size import BeamSizing
from gapbeam.meshes.tagged_mesh import build_beam
from tests.shared.mesh_figures import described
from tests.unit.test_meshes import CELLS, COMM, POINTS_3D, beam, integral, nearest_vertex

for cell in CELLS:
    geometry = beam(cell, *POINTS_3D)
    tagged = build_beam(COMM, geometry, BeamSizing(cell))
    owned = COMM.allgather(tagged.mesh.topology.index_map(tagged.dimension).size_local)
    assert min(owned) > 0, owned
    assert sum(owned) == tagged.cell_count, owned
    facets = COMM.allgather(len(tagged.facets_of("base")))
    assert sum(facets) == tagged.facet_counts["base"], facets
    assert max(facets) <= 2 * min(facets), facets
    figures = COMM.allgather(json.dumps(described(tagged)))
    assert len(set(figures)) == 1, figures
    areas = [integral(tagged, name) for name in tagged.groups]
    distances = [nearest_vertex(tagged, point) for point in geometry.points]
    if COMM.rank == 0:
        print(json.dumps([json.loads(figures[0]), areas, max(distances)]))
