"""One thread a rank unless the user says otherwise: the ranks are the parallelism (docs/how-to/run-on-a-cluster.md).

Numerical libraries read these variables once, when they are loaded, which `import gapbeam` therefore comes before.
"""

from __future__ import annotations

import os

from gapbeam.solver.run.rank_threads import THREADS, is_count


def one_thread_by_default() -> None:
    """Set the variables for the threads of libraries to 1, unless they hold a number.

    Libraries of their own variable follow OMP_NUM_THREADS where that is set and theirs is not.
    """
    wanted = os.environ.get(THREADS[0], "")
    default = wanted if is_count(wanted) else "1"
    for name in THREADS:
        if not is_count(os.environ.get(name, "")):
            os.environ[name] = default
