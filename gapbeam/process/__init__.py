"""The process that gapbeam runs in: environment, signals, terminal, failing ranks."""
