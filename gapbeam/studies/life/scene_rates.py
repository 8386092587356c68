"""Wear rates of a file of structures on worn pairs: regions grow outward by depth, each set of depths takes one run.

    dd_i / dt = k W_i' / A

for the depth d_i of pair i, its work rate W_i' in regions grown by all depths, and the worn area A.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from gapbeam.solver.messages.errors import UserError
from gapbeam.studies.life.face_rates import depth_rates, passed, record_steps, work_rates
from gapbeam.studies.life.worn_march import Array, DepthRates
from gapbeam.studies.trials.scene_subject import SceneSubject


class SceneRates:
    """Runs of a file of structures on worn pairs, one after the other; they share the structures.

    Pairs of two motions wear: those of one have no sliding.

    Args:
        subject: The file.

    Raises:
        CaseError: A structure cannot be read, or parts do not fit.
    """

    def __init__(self, subject: SceneSubject) -> None:
        self.subject, self.scene = subject, subject.scene
        self.mine = [i for i, one in enumerate(self.scene.contacts) if one.motions == 2]
        every = self.scene.contact_names
        self.names = [every[i] for i in self.mine]

    @property
    def inputs(self) -> dict[str, Any]:
        """All that decides the rates."""
        return self.subject.tables | self.subject.contents

    @cached_property
    def limits(self) -> Array:
        """Depth at which the life of each pair ends, (pairs,), m.

        Raises:
            UserError: The file has no depth or coefficient, no pair slides, or a region cannot grow.
        """
        wear = self.subject.case.wear
        lacking = [name for name in ("coefficient", "area", "depth_limit") if wear is None or not getattr(wear, name)]
        if lacking:
            raise UserError(
                f"wear: found no {' and no '.join(lacking)}; expected all three, such as coefficient = 2e-14 (1/Pa), "
                "area = 1e-5 (m^2) and depth_limit = 0.2e-3 (m)"
            )
        if not self.mine:
            raise UserError("wear: found pairs of one motion, which do not slide; expected one of two (motions = 2)")
        assert wear is not None
        limits = np.full(len(self.mine), wear.depth_limit or 0.0)
        self.worn(limits)
        return limits

    def worn(self, depths: Array, number: int = 0) -> SceneSubject:
        """Return the file with regions grown by depths.

        Args:
            depths: Depths of all pairs, (pairs,), m.
            number: Number of the run: each has noise of its own.

        Raises:
            UserError: A region cannot grow.
        """
        subject = self.subject.with_other_noise(number)
        scene = subject.scene
        contacts = list(scene.contacts)
        for i, depth in zip(self.mine, depths, strict=True):
            contacts[i] = replace(contacts[i], region=contacts[i].region.grown(float(depth)))
        return subject.in_scene(scene.with_parts(contacts, scene.loads))

    def clearances(self, depths: Array) -> dict[str, float]:
        """Return the clearance of each pair at depths, (pairs,), m."""
        contacts = self.worn(depths).scene.contacts
        regions = {name: contacts[i].region for name, i in zip(self.names, self.mine, strict=True)}
        return {
            name: float(np.asarray(one.values[one.kind.names.index("clearance")]))
            for name, one in regions.items()
            if "clearance" in one.kind.names
        }

    def __call__(self, depths: Array, number: int) -> DepthRates:
        """Return the rates at given depths.

        Args:
            depths: Depths of all pairs, (pairs,), m.
            number: Number of the run, which chooses the noise.

        Raises:
            RunFailed: The run did not pass.
            UserError: It has too few records for statistics, or there is no seat.
        """
        subject, case = self.worn(depths, number), self.subject.case
        asked, end = subject.asked, case.time.end
        subject.asked = replace(asked, every=record_steps(case.load, end, asked.step, asked.every * asked.step))
        response = subject.respond(subject.start(0, 0), rings=False)
        passed(response, self.names, list(map(float, depths)))
        assert response.statistics is not None
        assert case.wear is not None
        factor = float(case.wear.coefficient or 0.0) / float(case.wear.area or 1.0)
        return depth_rates(work_rates(response.statistics, self.names, end), factor)
