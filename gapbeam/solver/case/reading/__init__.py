"""From the text of a case file to a case, or to one error with every fault in it."""
