"""Numbers that a program gives: finite, real, of the expected shape."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp

from gapbeam.solver.errors import UserError
from gapbeam.solver.system.operators import Array


class ArgumentError(UserError):
    """A fault of one argument.

    Attributes:
        argument: Its name, such as "stiffness"; of an entry of a table "points.tip".
    """

    def __init__(self, message: str, argument: str) -> None:
        super().__init__(message)
        self.argument = argument


def finite(value: Any, where: str) -> Array:
    """Return numbers as an array of floats.

    Raises:
        UserError: A value is no number, complex, or not finite.
    """
    try:
        found = np.asarray(value)
        if found.dtype.kind == "c":
            raise TypeError("complex numbers")
        found = found.astype(float)
    except (TypeError, ValueError) as error:
        raise UserError(f"{where}: expected real numbers ({error})") from None
    if not np.all(np.isfinite(found)):
        raise UserError(f"{where}: expected finite numbers, found {np.count_nonzero(~np.isfinite(found))} that are not")
    return found


def positive(value: Any, where: str, zero: bool = False) -> Array:
    """Return numbers above zero, or from zero on.

    Raises:
        UserError: A value is not.
    """
    found = finite(value, where)
    if not np.all(found >= 0.0 if zero else found > 0.0):
        raise UserError(f"{where}: found {found.min():.6g}, expected numbers {'from' if zero else 'above'} 0")
    return found


def matrix(value: Any, where: str) -> Any:
    """Return a square matrix of floats, dense or in compressed rows.

    Raises:
        UserError: It is not square, or has entries that are not finite.
    """
    if sp.issparse(value):
        found = sp.csr_matrix(value)
        found.data = finite(found.data, where)
    else:
        found = np.atleast_2d(finite(value, where))
    if found.ndim != 2 or found.shape[0] != found.shape[1]:
        raise UserError(f"{where}: found shape {found.shape}, expected a square matrix")
    return found
