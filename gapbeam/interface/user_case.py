"""The case that a Python session holds: the tables of a case file, and the scene that they describe."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from gapbeam.process.launcher import all_ranks
from gapbeam.solver.case.case import Case, case_to_toml

if TYPE_CHECKING:
    from gapbeam.solver.scene.scene import Scene


class UserCase(Case):
    """A case from `gapbeam.read_case`; a notebook shows its case file."""

    @classmethod
    def of(cls, case: Case) -> UserCase:
        """Return a case with the same tables, and the same keys left to their defaults."""
        return cls.model_construct(case.model_fields_set, **vars(case))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Case) and vars(self) == vars(other)

    __hash__ = Case.__hash__

    def scene(self) -> Scene:
        """Return the scene of a case with a reduced, beam or rigid model.

        Raises:
            UserError: The case has what a scene has no noun for.
            MeshError: The mesh file does not fit the case.

        Collective.
        """
        from gapbeam.interface.case_scene import scene_of_model
        from gapbeam.solver.march.simulation import Simulation

        return scene_of_model(Simulation.of_case(self, all_ranks()).model)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(case_to_toml(self))}</pre>"
