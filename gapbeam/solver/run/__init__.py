"""One run of a case: set-up, seat, march, outputs, verdict."""
