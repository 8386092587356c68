"""Compiled marches in few words: records of probes, forces, the end and the figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import State


@dataclass(frozen=True)
class Passage:
    """A march in few words.

    Attributes:
        probes: Displacements of the probes, (records, rows).
        forces: Contact force of each face at the records, (records, faces), N.
        end: The state at the end.
        accounts: Ledger, gates, episodes, peaks and counts.
    """

    probes: Array
    forces: Array
    end: State
    accounts: Accounts


def followed(
    loop: CompiledLoop, start: State, steps: int, probes: Array | None = None, accounts: Accounts | None = None
) -> Passage:
    """March some steps; probes are rows on the DOFs of the dense system, (rows, n); errors as of the loop."""
    if accounts is None:
        accounts = Accounts.opened(loop.plan.system, loop.plan.law, start, loop.plan.dt)
    rows = np.zeros((0, len(loop.modal.squares))) if probes is None else probes @ loop.modal.shapes
    blocks = list(loop.blocks(start, 1, accounts, steps))
    return Passage(
        np.concatenate([block.records.q for block in blocks]) @ rows.T,
        np.concatenate([block.records.force for block in blocks]),
        blocks[-1].end,
        accounts,
    )
