"""Artefacts, published figures, archives and tables on disk: written atomically, hashed, and verified when read."""
