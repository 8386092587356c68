"""March a body of few degrees of freedom, step by step and compiled, in an interpreter without DOLFINx, PETSc and MPI.

Prints what the two marches differ by and how the energy balances, as JSON.
"""

from __future__ import annotations

import importlib
import json
import pkgutil
import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

ABSENT = {"dolfinx", "petsc4py", "mpi4py", "slepc4py", "ufl", "basix", "ffcx"}
ROOMS = ("supports", "system", "contact", "integrators", "case", "diagnostics", "march")


class NotInstalled(MetaPathFinder):
    """Lets no import of what is absent find anything."""

    def find_spec(
        self, name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Refuse a module that is absent; leave the others to those who find them."""
        if name.partition(".")[0] in ABSENT:
            raise ModuleNotFoundError(f"{name} is not installed here", name=name)
        return None


sys.meta_path.insert(0, NotInstalled())

import numpy as np  # noqa: E402 - from here on nothing absent can be imported

from gapbeam.solver.contact.laws.contact_law import kelvin_voigt  # noqa: E402
from gapbeam.solver.diagnostics.march_diagnostics import Accounts  # noqa: E402
from gapbeam.solver.integrators.scheme_choice import scheme_of  # noqa: E402
from gapbeam.solver.march.compiled.compiled_march import CompiledLoop, why_not_compiled  # noqa: E402
from gapbeam.solver.march.stepwise_march import EffectiveOperators, March, march  # noqa: E402
from tests.shared.dense_beams import dense_beam, thrown_start  # noqa: E402
from tests.shared.passages import followed  # noqa: E402

STEPS, DT = 100, 1.0e-3

modules = []
for room in ROOMS:
    package = importlib.import_module(f"gapbeam.solver.{room}")
    modules += [one.name for one in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")]
for name in modules:
    importlib.import_module(name)

system, law, scheme = dense_beam(), kelvin_voigt(1.0e5, 30.0), scheme_of("discrete-gradient")
plan, start = March(system, law, scheme, EffectiveOperators(system, scheme), DT, STEPS), thrown_start(system)
accounts = Accounts.opened(system, law, start, DT)
for step in march(plan, start):
    accounts.take(step)
stepped = step.new
passage = followed(CompiledLoop(plan), start, STEPS)
ledgers = accounts.ledger, passage.accounts.ledger
print(
    json.dumps(
        {
            "modules": modules,
            "reason": why_not_compiled(plan),
            "moved": float(np.max(np.abs(stepped.u[0]))),
            "apart": float(np.max(np.abs(passage.end.u[0] - stepped.u[0]))),
            "impulse": float(np.sum(accounts.peaks.impulse)),
            "residuals": [
                abs(found.ledger.residual) / found.ledger.exchanged for found in (accounts, passage.accounts)
            ],
        }
    )
)
