"""What each kind of sweep measures; one module to a kind.  The sweep stage dispatches and keeps the results."""
