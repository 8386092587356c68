"""Call gapbeam from a folder, argument 1, that is removed first."""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.chdir(sys.argv[1])
Path(sys.argv[1]).rmdir()
sys.argv = ["gapbeam", *sys.argv[2:]]

from gapbeam.command_line import main  # noqa: E402 - gapbeam is loaded where there is no folder

main()
