"""Results that are read while a run writes them: whole at any moment, and never fewer than before."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np

from gapbeam.command_line import main
from postprocess.errors import ResultsError
from postprocess.results import open_results
from tests.command import DEMO, RATTLE, alone, settings
from tests.processes import beside, ended, often

pytestmark = alone
KEYS = (*RATTLE, "time.end=0.15", "output.fields_interval=2e-3", "output.checkpoint_interval=0.05")


def test_reader_beside_a_run(tmp_path: Path) -> None:
    """A reader that looks all the time sees finite records and fields that only become more, or none at all."""
    folder, told = tmp_path / "out", tmp_path / "told"

    def run() -> int:
        often()
        try:
            main(["run", str(DEMO), *settings(*KEYS), "--output", str(folder)])
        except SystemExit as leaving:
            return int(leaving.code or 0)

    process = beside(run, told)
    looks, records, shown = 0, 0, 0
    while (
        Path(f"/proc/{process}").exists() and os.waitid(os.P_PID, process, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None
    ):
        try:
            results = open_results(folder)
            found = results.history["contact_force"].values
            assert np.all(np.isfinite(found))
            assert len(found) >= records
            records = len(found)
            with results.fields() as fields:
                assert len(fields) >= shown
                shown = len([frame for frame in fields if np.all(np.isfinite(frame.displacement))])
                assert shown == len(fields)
            looks += 1
        except ResultsError:
            assert looks == 0, "results that were there could not be read any more"
        time.sleep(0.02)
    assert ended(process) == 0, told.read_text(encoding="utf-8")
    assert looks > 5
    assert open_results(folder).history.sizes["time"] == 1501
