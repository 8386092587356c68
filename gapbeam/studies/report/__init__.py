"""The report on results folders of any kind."""
