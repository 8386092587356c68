"""Cases that hypothesis draws, with their error estimates, beside a second way."""
