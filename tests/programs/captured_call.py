"""The command line called in the process that it stands in, with what it says."""

from __future__ import annotations

import contextlib
import io
import traceback

from gapbeam.command_line import main


def captured(arguments: list[str]) -> tuple[object, str, str]:
    """Return status, standard output and standard error of a command."""
    out, err = io.StringIO(), io.StringIO()
    status: object = 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main(arguments)
        except SystemExit as leaving:
            status = leaving.code
        except BaseException:
            traceback.print_exc()
            status = 1
    return status, out.getvalue(), err.getvalue()
