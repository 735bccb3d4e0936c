"""Bill of materials of an archive: the packages that made it, as CycloneDX, which tools of the supply chain read."""

from __future__ import annotations

import json
import re
from pathlib import Path

from pipeline.storage.sealed_folders import file_digest
from pipeline.validation import InvalidInput

SBOM = "sbom.cdx.json"


def bill_of_materials(lock: Path, commit: str) -> bytes:
    """Return the packages of a lock file as CycloneDX 1.6, the same bytes for the same lock and commit.

    The digests of the packages' files stay in the lock file, which is named with its own.

    Raises
    ------
    InvalidInput
        If the lock file pins no package.
    """
    pinned = re.findall(r"^([A-Za-z0-9._-]+)==([^\s;\\]+)", lock.read_text("utf-8"), re.MULTILINE)
    if not pinned:
        raise InvalidInput("no package is pinned", lock.name, "name==version", code="nothing_pinned")
    packages = [
        {"type": "library", "bom-ref": purl, "name": name, "version": version, "purl": purl}
        for name, version in pinned
        for purl in [f"pkg:pypi/{re.sub(r'[._-]+', '-', name).lower()}@{version}"]
    ]
    program = {
        "type": "application",
        "bom-ref": "gait-pipeline",
        "name": "gait-pipeline",
        "version": commit,
        "licenses": [{"license": {"id": "MIT"}}],
        "externalReferences": [
            {
                "type": "other",
                "url": lock.name,
                "comment": "versions, and the digest of every file that may be installed",
                "hashes": [{"alg": "SHA-256", "content": file_digest(lock)}],
            }
        ],
    }
    bill = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": program},
        "components": packages,
        "dependencies": [{"ref": "gait-pipeline", "dependsOn": [one["bom-ref"] for one in packages]}],
    }
    return json.dumps(bill, indent=1).encode() + b"\n"
