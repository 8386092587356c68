"""What a held body keeps of the equations of motion along what joints hold."""

from __future__ import annotations

from dataclasses import dataclass

from gapbeam.solver.system.operators import Array


@dataclass(frozen=True)
class HoldingShapes:
    """Products with the shapes Z that move h held motions by one each; V is the basis of the held body.

    Attributes:
        mass: Z^T M V, (h, n).
        stiffness: Z^T K V, the restraint included, (h, n).
        patterns: Z^T of `Body.patterns`, (h, patterns).
        pressure: Z^T H^T: what forces at the m contact points do along Z, (h, m).
        friction: Z^T T^T: what friction forces there do, (h, m k); without columns where there is no friction.
    """

    mass: Array
    stiffness: Array
    patterns: Array
    pressure: Array
    friction: Array
