"""The life of supports that wear: gaps that grow block by block until a depth is reached."""
