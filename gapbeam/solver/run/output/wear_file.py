"""wear.csv: the work of sliding at every contact point of a run, one a line, readable by any program.

The angle of the wall is measured from straight down, positive toward +y: 0 for a plane below the beam, 180 above it.
The depth rate of a point by itself is k W' / w, with the area w that belongs to the point. Under random loads the
settled rate is the work rate behind the burn-in, with the 95 % interval of this point alone.

Coefficient, worn area and limit of a face are those of its support, or of [wear].
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gapbeam.solver.case.case import Case
from gapbeam.solver.diagnostics.point_contact import SlidingWork
from gapbeam.solver.diagnostics.statistics.batch_interval import Interval
from gapbeam.solver.run.output.atomic_files import written
from gapbeam.solver.run.output.results_folder import write_beside
from gapbeam.solver.schema.record_table import WEAR_COLUMNS, WEAR_FILE
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import ContactOperator


class FaceWear(NamedTuple):
    """Wear of a face; None: neither its support nor [wear] gives the value.

    Attributes:
        coefficient: Archard's k, 1/Pa.
        area: Area over which the volume is spread, m^2.
        depth_limit: Depth at which the life of the face ends, m.
    """

    coefficient: float | None
    area: float | None
    depth_limit: float | None

    @property
    def wears(self) -> bool:
        """True where sliding wears the face."""
        return bool(self.coefficient)


def face_wear(case: Case) -> dict[str, FaceWear]:
    """Return the wear of each face by name, in the order of `Case.layout`."""
    wear, faces = case.wear, [face.name for face in case.layout.faces]
    usual = FaceWear(*(None if wear is None else getattr(wear, key) for key in FaceWear._fields))
    own = zip(*(case.layout.own(key) for key in ("wear", "area", "depth_limit")), strict=True)
    return {
        face: FaceWear(*(shared if mine is None else mine for mine, shared in zip(of_face, usual, strict=True)))
        for face, of_face in zip(faces, own, strict=True)
    }


HEAD = ",".join(["face", *(f"{name} ({unit})" for name, unit in WEAR_COLUMNS.items())])


def write_wear(
    folder: Path,
    sliding: SlidingWork,
    seconds: float,
    faces: Mapping[str, FaceWear],
    rates: Sequence[Interval] = (),
) -> None:
    """Write work, its parts, work rate and depth rate of all contact points; nothing where nothing was measured.

    Args:
        folder: Folder of the results.
        sliding: Work of sliding up to the end of the run.
        seconds: Its span, s.
        faces: Wear of each face; without a coefficient no depth rate is known, and its cell is empty.
        rates: Work rate of each point behind the burn-in, W; empty: there are no statistics.

    Raises:
        NotWritten: The file could not be written.
    """
    contact = sliding.contact
    if not contact.measures_sliding:
        return
    names, lines = contact.face_names, [HEAD]
    settled = [",,"] * contact.size if not rates else [f"{one.value!r},{one.low!r},{one.high!r}" for one in rates]
    for face, columns, last in zip(contact.faces, point_rows(sliding, seconds), settled, strict=True):
        name, row = names[face], list(map(float, columns))
        known = faces[name].coefficient
        depth = "" if known is None else repr(known * row[-1] / row[_AREA])
        lines.append(f"{name},{','.join(map(repr, row))},{depth},{last}")
    path = folder / WEAR_FILE
    with written(path):
        write_beside(path, "\n".join(lines) + "\n")


_AREA = list(WEAR_COLUMNS).index("area")


def point_rows(sliding: SlidingWork, seconds: float) -> Array:
    """Return the columns of `WEAR_COLUMNS` up to the work rate, (m, 9)."""
    contact = sliding.contact
    rates = sliding.work / seconds if seconds > 0.0 else np.zeros(contact.size)
    x, y = contact.positions[:, 0], contact.positions[:, 1]
    return np.column_stack([x, y, angles(contact), contact.surfaces, sliding.work, *sliding.parts, rates])


def angles(contact: ContactOperator) -> Array:
    """Return the direction of the wall that each point meets, degrees from straight down, positive toward +y, (m,)."""
    across = 0.0 - contact.across
    return np.asarray(np.degrees(np.arctan2(across[:, 0], -across[:, 1])))
