"""What pyproject.toml cannot say: the options, the papers and the table of recordings travel inside the package.

With SOURCE_DATE_EPOCH the same sources make the same wheel, byte by byte.
"""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent


class WithResources(build_py):
    """Copies ``conf`` and ``data/sources.csv`` to where `pipeline.resources` looks for them."""

    def run(self) -> None:
        """Build the modules, then copy the files."""
        super().run()
        target = Path(self.build_lib) / "pipeline"
        shutil.copytree(HERE / "conf", target / "conf", dirs_exist_ok=True)
        (target / "data").mkdir(parents=True, exist_ok=True)
        shutil.copy2(HERE / "data" / "sources.csv", target / "data" / "sources.csv")


class SameBytes(bdist_wheel):
    """Gives all files of the wheel one set of permissions, whatever the sources have."""

    def write_wheelfile(self, wheelfile_base: str) -> None:
        """Write the last of the wheel's files, then set the permissions of all."""
        super().write_wheelfile(wheelfile_base)
        for path in Path(wheelfile_base).parent.rglob("*"):
            path.chmod(0o755 if path.is_dir() else 0o644)


setup(cmdclass={"build_py": WithResources, "bdist_wheel": SameBytes})
