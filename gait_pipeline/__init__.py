"""Second name of the package `pipeline`, for programs with a file ``pipeline.py`` in their folder.

``gait_pipeline.core.fourier`` is the module ``pipeline.core.fourier``, not a copy.  The package next to this one is
loaded, even where another `pipeline` comes first.
"""

from __future__ import annotations

import importlib.util
import sys
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pipeline import (
        InvalidInput,
        fit,
        from_view,
        joints,
        motion,
        read,
        represent,
        to_dataframe,
        to_xarray,
    )

    __version__: str

__all__ = [
    "InvalidInput", "__version__", "fit", "from_view", "joints", "motion", "read", "represent", "to_dataframe",
    "to_xarray",
]  # fmt: skip

_INIT = Path(__file__).resolve().parent.parent / "pipeline" / "__init__.py"


def _package() -> Any:
    """Return the package `pipeline` in the same folder, after loading it if necessary."""
    loaded = sys.modules.get("pipeline")
    if loaded is not None:
        if Path(str(getattr(loaded, "__file__", ""))).resolve() != _INIT:
            raise ImportError("another module called pipeline is loaded: import gait_pipeline before it")
        return loaded
    spec = importlib.util.spec_from_file_location(
        "pipeline", _INIT, submodule_search_locations=[str(_INIT.parent)]
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["pipeline"] = module
    spec.loader.exec_module(module)
    return module


class _Modules(MetaPathFinder, Loader):
    """Import hook that loads ``gait_pipeline.x`` as ``pipeline.x``."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        if not name.startswith("gait_pipeline.") or name == "gait_pipeline.__main__":
            return None
        return ModuleSpec(name, self)

    def create_module(self, spec: ModuleSpec) -> Any:
        return importlib.import_module(spec.name.removeprefix("gait_"))

    def exec_module(self, module: object) -> None:
        """Do nothing, because the module is already loaded."""


_ours = _package()
sys.meta_path.insert(0, _Modules())


def __getattr__(name: str) -> Any:
    """Return the attribute of the package `pipeline` with this name."""
    return getattr(_ours, name)
