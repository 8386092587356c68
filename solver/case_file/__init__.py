"""Reading, checking and writing case files; the models themselves are in `solver.case`."""
