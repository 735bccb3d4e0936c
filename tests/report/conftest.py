"""A browser, where there is one."""

from __future__ import annotations

import shutil

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


@pytest.fixture(scope="session")
def browser() -> str:
    """A browser's name; tests that ask for it are skipped where there is none."""
    found = next((name for name in BROWSERS if shutil.which(name)), "")
    if not found:
        pytest.skip("needs Chromium")
    return found
