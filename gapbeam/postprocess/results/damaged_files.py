"""Files that are not as gapbeam wrote them: reported as faults of the input, wherever in the reading they show."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gapbeam.postprocess.results_errors import ResultsError

_LONGEST = 200  # characters of a foreign message


@contextmanager
def as_written(*places: Path) -> Iterator[None]:
    """Turn what goes wrong with contents that no gapbeam wrote into one error that names the place.

    What files must hold is checked where they are read; this is for all that a file can hold besides. The message
    reports where in gapbeam it showed, so that an error of ours is not taken for one of the file.

    Args:
        places: Files or folders that are read meanwhile.

    Raises:
        ResultsError: Instead of any error without an exit status of its own.
    """
    place = Path(" or ".join(map(str, places)))
    try:
        yield
    except OSError as fault:
        if hasattr(fault, "exit_status"):
            raise
        raise ResultsError(
            Path(fault.filename) if isinstance(fault.filename, str) else place,
            found=printable(fault.strerror or fault)[:_LONGEST],
            expected="files that can be read, and a folder that can be written",
            remedy="look at permissions and free space, or choose another `output=`",
        ) from fault
    except Exception as fault:  # of any of the libraries that read and draw
        if hasattr(fault, "exit_status") or hasattr(fault, "exit_code"):
            raise
        frames = traceback.extract_tb(fault.__traceback__)
        ours = [frame for frame in frames if "postprocess" in frame.filename] or list(frames)
        shown = printable(f"{type(fault).__name__}: {fault}")[:_LONGEST]
        raise ResultsError(
            place,
            found=f"contents that do not go together ({shown}; at {Path(ours[-1].filename).name}:{ours[-1].lineno})",
            expected="files as gapbeam wrote them",
            remedy="repeat what wrote them; if they are as gapbeam wrote them, this is an error of gapbeam: report it",
        ) from fault


def printable(text: object) -> str:
    """Return a text as it may be shown: control characters of a file do not reach the terminal."""
    return "".join(one if one.isprintable() else one.encode("unicode_escape").decode("ascii") for one in str(text))
