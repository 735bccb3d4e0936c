"""The bill of materials names what the lock file pins, in the words that CycloneDX allows."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path

from pipeline.storage.crate import bill_of_materials
from pipeline.storage.provenance import LOCK
from tests.rejects import rejects

ALLOWED = {
    "bill": {"bomFormat", "specVersion", "version", "metadata", "components", "dependencies"},
    "component": {"type", "bom-ref", "name", "version", "purl", "licenses", "externalReferences"},
    "reference": {"type", "url", "comment", "hashes"},
}
"""Names in version 1.6 that are used here; the schema allows no others."""


def test_every_pinned_package_is_named_once_with_its_version_and_nothing_else() -> None:
    content = bill_of_materials(LOCK, "c" * 40)
    assert content == bill_of_materials(LOCK, "c" * 40)
    bill = json.loads(content)
    assert set(bill) == ALLOWED["bill"]
    assert (bill["bomFormat"], bill["specVersion"], bill["version"]) == ("CycloneDX", "1.6", 1)
    pins = [line.split(" ")[0].split("==") for line in LOCK.read_text().splitlines() if line[:1].isalpha()]
    assert [[first["name"], first["version"]] for first in bill["components"]] == pins
    program = bill["metadata"]["component"]
    assert (program["type"], program["version"]) == ("application", "c" * 40)
    for first in [program, *bill["components"]]:
        assert set(first) <= ALLOWED["component"]
        assert {"type", "name", "bom-ref"} <= set(first)
    for first in bill["components"]:
        assert first["type"] == "library"
        assert re.fullmatch(r"pkg:pypi/[a-z0-9]+(-[a-z0-9]+)*@[0-9][0-9A-Za-z.+]*", first["purl"])
    references = [first["bom-ref"] for first in bill["components"]]
    assert len(set(references)) == len(references) > 20
    assert bill["dependencies"] == [{"ref": program["bom-ref"], "dependsOn": references}]
    (lock,) = program["externalReferences"]
    assert set(lock) == ALLOWED["reference"]
    digest = hashlib.sha256(LOCK.read_bytes()).hexdigest()
    assert (lock["url"], lock["hashes"]) == ("requirements.lock", [{"alg": "SHA-256", "content": digest}])


def test_a_lock_file_without_a_pin_is_refused(tmp_path: Path) -> None:
    (tmp_path / "requirements.lock").write_text("numpy\n")
    with rejects("nothing_pinned", "requirements.lock"):
        bill_of_materials(tmp_path / "requirements.lock", "c" * 40)
