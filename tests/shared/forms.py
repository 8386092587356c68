"""Forms that tests compare with: FFCx compiles them, which a wheel of DOLFINx brings no compiler for."""

from __future__ import annotations

import shutil

import pytest
import ufl
from dolfinx import fem

LACKING = "there is no gcc here: FFCx compiles the forms of this test"
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason=LACKING)


def compiled_form(form: ufl.Form) -> fem.Form:
    """Return a form that DOLFINx can assemble; leave the test out where there is no C compiler."""
    if shutil.which("gcc") is None:
        pytest.skip(LACKING)
    return fem.form(form)
