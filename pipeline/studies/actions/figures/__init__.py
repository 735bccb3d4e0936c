"""Four figures of mozerov2006 and three figures of our own."""
