"""Words for messages: lists, printable text, and the name that was probably meant."""
