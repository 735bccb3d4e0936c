"""Artefacts, published figures, archives and tables on disk: written whole, hashed, verified when read."""
