"""Tables of the case file that are large enough for a file of their own."""
