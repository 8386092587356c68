"""Tables of case files and of results: keys and records with units and meaning."""
