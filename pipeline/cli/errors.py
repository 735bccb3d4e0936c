"""Messages for errors that a user can correct."""

from __future__ import annotations

import os

from pipeline.resources import install_hint, missing_package
from pipeline.validation import InvalidInput


def sentence(error: Exception) -> str:
    """Return the message for an error that the user can correct; empty for a bug, whose traceback is needed."""
    if isinstance(error, InvalidInput):
        return str(error)
    if isinstance(error, ModuleNotFoundError):
        package = missing_package(error)
        return f"this needs {install_hint(package)}" if package else ""
    if isinstance(error, MemoryError):
        return f"there is not enough memory: {error}"
    if type(error).__module__.partition(".")[0] in ("hydra", "omegaconf"):
        from pipeline.cli.composition import in_words  # already loaded, since it raised the error

        return str(in_words(error))
    if type(error).__module__.startswith("yaml."):
        return " ".join(str(error).split())
    if isinstance(error, OSError) and error.strerror and error.filename:
        return str(InvalidInput(error.strerror, os.fsdecode(error.filename)))
    return ""
