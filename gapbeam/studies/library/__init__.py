"""Libraries of marched members, from which values of a scene are estimated out of recordings in milliseconds."""
