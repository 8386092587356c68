"""Reports: one page of words, numbers and figures, as HTML and as PDF."""
