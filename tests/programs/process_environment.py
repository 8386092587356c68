"""Report home, cache and remarks of a process in which gapbeam was imported."""

from __future__ import annotations

import json
import os

import gapbeam  # noqa: F401 - sets home and cache
from gapbeam.process.process_environment import REMARKS

print(json.dumps([os.environ.get("HOME"), os.environ.get("XDG_CACHE_HOME"), REMARKS]))
