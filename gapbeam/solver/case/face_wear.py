"""Wear of each face: coefficient, worn area and limit of its support, or those of [wear]."""

from __future__ import annotations

from typing import NamedTuple

from gapbeam.solver.case.case import Case


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
