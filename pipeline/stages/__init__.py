"""Five thin stages: read artefacts, call core, write artefacts.  None imports another."""
