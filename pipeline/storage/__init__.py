"""Artefacts, published figures, archives and tables on disk: written atomically, hashed, verified when read."""
