"""Functions of PETSc that petsc4py has no method for, called in PETSc's library, and the words of their errors."""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

from petsc4py import PETSc


def gives_inverse() -> bool:
    """Return whether this PETSc gives access to MatMumpsGetInverse."""
    return _inverse() is not None


def mumps_inverse(factored: PETSc.Mat, wanted: PETSc.Mat) -> None:
    """Have MUMPS compute entries of an inverse, by PETSc's MatMumpsGetInverse.

    Args:
        factored: MUMPS's factor.
        wanted: Transpose of the sparse matrix whose entries are wanted, whole on rank 0; MUMPS sets its values.

    Raises:
        RuntimeError: PETSc or MUMPS refused; the message holds the words of both.

    Collective.
    """
    code = _inverse()(factored.handle, wanted.handle)
    if code != 0:
        raise RuntimeError(error_words(code)) from PETSc.Error(code)


def error_words(code: int) -> str:
    """Return PETSc's words for the error that it returned last.

    petsc4py keeps them as well: for all functions until 3.24, since then only for those that it calls itself.

    Args:
        code: Return value of the function.
    """
    general, special = ctypes.c_char_p(), ctypes.c_char_p()
    _library().PetscErrorMessage(code, ctypes.byref(general), ctypes.byref(special))
    words = (text.value.decode(errors="replace") for text in (general, special) if text.value)
    return ": ".join([f"PETSc error {code}", *words])


@cache
def _inverse() -> Any:
    """Return PETSc's MatMumpsGetInverse; None: this PETSc hides it."""
    function = getattr(_library(), "MatMumpsGetInverse", None)
    if function is not None:
        function.restype, function.argtypes = ctypes.c_int, (ctypes.c_void_p, ctypes.c_void_p)
    return function


def _library() -> ctypes.CDLL:
    return ctypes.CDLL(PETSc.__file__)
