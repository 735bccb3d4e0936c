"""What pyproject.toml cannot say: the options, the papers and the table of recordings travel inside the package."""

import shutil
from pathlib import Path

from setuptools import setup
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


setup(cmdclass={"build_py": WithResources})
