"""The energy ledger, energy gates, contact episodes, peaks and step counts of a march."""
