"""The case file: its tables, how it is read, checked and written; needs no DOLFINx."""
