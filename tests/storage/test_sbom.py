"""Tests that the software bill of materials lists the installed packages in terms that CycloneDX allows."""

from __future__ import annotations

import hashlib
import json
import re
from importlib import metadata

import pytest

from pipeline.storage import crate
from pipeline.storage.crate import bill_of_materials
from pipeline.storage.provenance import LOCK

ALLOWED = {
    "bill": {"bomFormat", "specVersion", "version", "metadata", "components", "dependencies"},
    "component": {"type", "bom-ref", "name", "version", "purl", "licenses", "externalReferences"},
    "reference": {"type", "url", "comment", "hashes"},
}
"""Keys of CycloneDX 1.6 that the bill of materials may contain."""
TOOLS = {"pytest", "ruff", "mypy", "hypothesis", "pip", "setuptools"}
"""Packages of the test environment that no figure needs."""


def test_every_package_that_the_program_needs_is_named_once_as_it_is_installed() -> None:
    content = bill_of_materials(LOCK, "c" * 40)
    assert content == bill_of_materials(LOCK, "c" * 40)
    bill = json.loads(content)
    assert set(bill) == ALLOWED["bill"]
    assert (bill["bomFormat"], bill["specVersion"], bill["version"]) == ("CycloneDX", "1.6", 1)
    program = bill["metadata"]["component"]
    assert (program["type"], program["version"]) == ("application", "c" * 40)
    for first in [program, *bill["components"]]:
        assert set(first) <= ALLOWED["component"]
        assert {"type", "name", "bom-ref", "licenses"} <= set(first)
        assert all(set(each) <= {"license", "expression"} for each in first["licenses"])
        assert first["licenses"]
    for first in bill["components"]:
        assert first["type"] == "library"
        assert first["version"] == metadata.version(first["name"])
        assert re.fullmatch(r"pkg:pypi/[a-z0-9]+(-[a-z0-9]+)*@[0-9][0-9A-Za-z.+]*", first["purl"])
    names = [first["name"] for first in bill["components"]]
    assert names == sorted(set(names))
    assert {"numpy", "scipy", "pandas", "numba", "llvmlite", "hydra-core", "antlr4-python3-runtime"} <= set(
        names
    )
    assert not TOOLS & set(names)
    (lock,) = program["externalReferences"]
    assert set(lock) == ALLOWED["reference"]
    digest = hashlib.sha256(LOCK.read_bytes()).hexdigest()
    assert (lock["url"], lock["hashes"]) == ("requirements.lock", [{"alg": "SHA-256", "content": digest}])


def test_every_package_depends_on_what_its_metadata_require() -> None:
    bill = json.loads(bill_of_materials(LOCK, "c" * 40))
    references = {first["bom-ref"]: first["name"] for first in bill["components"]}
    needs = {references.get(each["ref"], each["ref"]): each["dependsOn"] for each in bill["dependencies"]}
    named = {name: {references[ref] for ref in refs} for name, refs in needs.items()}
    assert set(named) == {"gait-pipeline", *references.values()}
    assert {"numpy", "pyyaml", "numba", "pandas"} <= named["gait-pipeline"]
    assert "llvmlite" not in named["gait-pipeline"]
    assert named["numba"] == {"numpy", "llvmlite"}
    assert named["scipy"] == {"numpy"}  # and not what its extra `test` requires
    assert named["omegaconf"] == {"antlr4-python3-runtime", "pyyaml"}
    assert named["numpy"] == set()


def test_an_installed_package_states_its_requirements_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    requires = metadata.requires

    def stated(name: str) -> list[str] | None:
        requirements = ["numpy>=2", 'numba>=0.61; extra == "papers"', "pytest>=9; extra == 'test'"]
        return requirements if name == "gait-pipeline" else requires(name)

    monkeypatch.setattr(crate, "project", lambda: None)
    monkeypatch.setattr(crate.metadata, "requires", stated)
    bill = json.loads(bill_of_materials(LOCK, "c" * 40))
    assert [first["name"] for first in bill["components"]] == ["llvmlite", "numba", "numpy"]
