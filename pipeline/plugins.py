"""Extensions of the package: plug-ins of installed packages, and users' files.

A plug-in is a `Plugin`.  An installed package names it under the entry point ``gait_pipeline.plugins``.  A user's file
contains it as ``PLUGIN``; the option ``plugins=my_method.py`` loads the file.  In a clone or a copy the entry points of
the ``pyproject.toml`` next to the package replace those of its installed metadata: the code next to it is loaded.
"""

from __future__ import annotations

import hashlib
import importlib.util
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module, metadata
from pathlib import Path
from types import ModuleType
from typing import Any

from pipeline.resources import CONF, NAME, PACKAGE, project

GROUP = "gait_pipeline.plugins"
"""Group of entry points in which packages name their plug-ins."""

OBJECT = "PLUGIN"
"""Name of the variable that contains the plug-in in a user's file."""

MAX_FILE_BYTES = 1_000_000
"""Maximum size of a user's file in bytes."""


@dataclass(frozen=True, kw_only=True)
class Page:
    """Additions of a plug-in to the HTML page that shows all figures.

    Attributes
    ----------
    scripts : sequence of Path
        JavaScript files, run in this order before the page starts.  They add methods to ``Gait.METHODS``, comparisons
        to ``Agreement.checks``, and functions that start with the walkers to ``Players.additions``.
    columns : mapping
        Columns of tables that the scripts read: by figure, by file name of the table.
    """

    scripts: Sequence[Path] = ()
    columns: Mapping[str, Mapping[str, Sequence[str]]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Plugin:
    """Everything that a plug-in adds to the package.

    Each list is a sequence of values, or an import path ``"package.module:NAME"`` that is resolved at the first use.

    Attributes
    ----------
    methods : sequence of Method, or str
        Methods of reconstruction.
    studies : sequence of Study, or str
        Studies: datasets, models, sweeps, figures and measures.
    claims : sequence of Path, str or mapping, or str
        Files of claims; or claims by name, as a mapping or a YAML text.
    commands : mapping of str to str
        Commands of the command line by name, each with the import path of its function.
    conf : Path, optional
        Folder of presets, data sets, mappings and layouts, structured like ``conf``.
    page : Page, optional
        Players and comparisons on the page over all figures.
    """

    methods: Sequence[Any] | str = ()
    studies: Sequence[Any] | str = ()
    claims: Sequence[Any] | str = ()
    commands: Mapping[str, str] = field(default_factory=dict)
    conf: Path | None = None
    page: Page | None = None


@dataclass(frozen=True)
class Loaded:
    """Loaded plug-in and its origin.

    Attributes
    ----------
    name : str
        Name of the entry point, or of the user's file.
    plugin : Plugin
    module : str
        Module that contains it.
    distribution, version : str
        Name and version of the installed package; empty for a user's file.
    file : Path or None
        The user's file; None for an installed package.
    """

    name: str
    plugin: Plugin
    module: str
    distribution: str = ""
    version: str = ""
    file: Path | None = None

    @property
    def root(self) -> str:
        """Name of the top-level module of the plug-in."""
        return self.module.partition(".")[0]


def _invalid(*arguments: Any, **options: Any) -> Exception:
    """Return an InvalidInput, whose module is imported only when an error occurs, because it imports numpy."""
    from pipeline.validation import InvalidInput

    return InvalidInput(*arguments, **options)


_files: dict[str, Loaded] = {}
"""Loaded plug-ins of users' files, by module name."""


def _entry_points() -> list[metadata.EntryPoint]:
    """Return the entry points of other installed packages, and of the project in the folder of this package."""
    points = list(metadata.entry_points(group=GROUP))
    if (content := project()) is None:
        return points
    others = [point for point in points if point.dist is None or point.dist.name != NAME]
    named = content.get("entry-points", {}).get(GROUP, {})
    return [*(metadata.EntryPoint(name, target, GROUP) for name, target in named.items()), *others]


@cache
def _installed() -> tuple[tuple[Loaded, ...], Mapping[str, str]]:
    """Return the plug-ins of installed packages, and the reason for each plug-in that cannot be loaded, by name."""
    loaded, failures = [], {}
    for point in _entry_points():
        try:
            plugin = point.load()
            if not isinstance(plugin, Plugin):
                raise _invalid("must be a value of the class Plugin", point.value, code="wrong_type")
        except (Exception, SystemExit) as error:
            failures[point.name] = _summary(error)
        else:
            origin = point.dist.name if point.dist else NAME
            version = point.dist.version if point.dist else str((project() or {}).get("version", ""))
            loaded.append(Loaded(point.name, plugin, point.module, origin, version))
    return tuple(loaded), failures


def _summary(error: BaseException) -> str:
    """Return type and message of an error in one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:300]


def failures() -> Mapping[str, str]:
    """Return the reason for each installed plug-in that cannot be loaded, by name."""
    return _installed()[1]


def loaded() -> tuple[Loaded, ...]:
    """Return the loaded plug-ins: first those of installed packages, then those of users' files."""
    return (*_installed()[0], *_files.values())


def load_files(paths: Iterable[str | Path]) -> None:
    """Load plug-ins from users' files; a file already loaded with the same content is not run again.

    Raises
    ------
    InvalidInput
        If a file cannot be read or run, has no plug-in, or two files have the same name.
    """
    files = [*map(Path, paths)]
    names = [*map(_module_name, files)]
    if twice := [path.name for n, path in enumerate(files) if names[n] in names[:n]]:
        raise _invalid(
            "must have files of different names", "plugins", received=twice[0], code="not_distinct"
        )
    for path, name in zip(files, names, strict=True):
        try:
            if not path.is_file() or path.suffix != ".py":
                raise _invalid(
                    "must be an existing Python file", "plugins", received=str(path), code="not_a_file"
                )
            content = path.read_bytes()
        except OSError as error:
            raise _invalid(f"the plug-in cannot be read: {error.strerror}", path, code="unreadable") from None
        if len(content) > MAX_FILE_BYTES:
            raise _invalid(
                "the plug-in is too large",
                path,
                f"at most {MAX_FILE_BYTES} bytes",
                len(content),
                code="file_too_large",
            )
        loaded_before = _files.get(name)
        if (
            loaded_before
            and loaded_before.file == path.resolve()
            and digest_of(loaded_before) == hashlib.sha256(content).hexdigest()
        ):
            continue
        module = _module_of(name, path, content)
        plugin = getattr(module, OBJECT, None)
        if not isinstance(plugin, Plugin):
            raise _invalid(
                f"the file defines no plug-in: end it with {OBJECT} = Plugin(methods=[…])",
                path,
                code="no_plugin",
            )
        _files[name] = Loaded(path.stem, plugin, name, file=path.resolve())
        _digests[module.__name__] = hashlib.sha256(content).hexdigest()


def _module_name(path: str | Path) -> str:
    """Return the module name under which a user's file is loaded."""
    return "plugin_" + re.sub(r"\W", "_", Path(path).stem)


_digests: dict[str, str] = {}
"""The sha256 of each user's file at the time of loading, by module name."""


def _module_of(name: str, path: Path, content: bytes) -> ModuleType:
    """Run a user's file as a module, and return the module."""
    spec = importlib.util.spec_from_file_location(name, path.resolve())
    assert spec
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look up their module here
    try:
        exec(compile(content, str(path), "exec"), module.__dict__)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        line = next((f"line {frame.lineno}" for frame in _frames(error) if frame.filename == str(path)), "")
        raise _invalid(
            f"the plug-in cannot be loaded ({_summary(error)})", f"{path} {line}".strip(), code="plugin_fails"
        ) from None
    return module


def _frames(error: BaseException) -> list[Any]:
    """Return the stack frames of an error, innermost first; for a syntax error, only the frame of the faulty line."""
    import traceback

    if isinstance(error, SyntaxError) and error.lineno:
        return [traceback.FrameSummary(error.filename or "", error.lineno, "")]
    return traceback.extract_tb(error.__traceback__)[::-1]


def edition() -> tuple[tuple[str, str], ...]:
    """Return names and digests of the loaded plug-ins: a key for caches that depend on plug-ins."""
    return tuple((each.name, digest_of(each)) for each in loaded())


def digest_of(plugin: Loaded) -> str:
    """Return the sha256 of a user's file at the time of loading; empty for an installed plug-in."""
    return _digests.get(plugin.module, "")


def named_files(overrides: Iterable[str]) -> list[str]:
    """Return the users' files in overrides such as ``plugins=a.py`` or ``plugins=[a.py,b.py]``.

    Examples
    --------
    >>> named_files(["experiment=zhang2007_fig5", "plugins=[ridge.py, 'my files/knn.py']"])
    ['ridge.py', 'my files/knn.py']
    """
    values = [item.partition("=")[2] for item in overrides if item.startswith("plugins=")]
    names = [name.strip(" \"'") for value in values for name in value.strip("[]").split(",")]
    return [name for name in names if name]


def resolve(place: str) -> Any:
    """Return the object at an import path: ``"package.module:NAME"``, or a dotted name.

    Raises
    ------
    ImportError, AttributeError, ValueError
        If the object does not exist.
    """
    name, colon, inner = place.partition(":")
    thing: Any = import_module(name) if colon else None
    if colon:
        for part in inner.split("."):
            thing = getattr(thing, part)
        return thing
    name = ""
    for part in place.split("."):
        name = f"{name}.{part}".lstrip(".")
        # An attribute of a package takes precedence over a module of the same name.
        thing = getattr(thing, part) if hasattr(thing, part) else import_module(name)
    return thing


# --- contributions ----------------------------------------------------------------------------------------


def contributions(kind: str) -> list[tuple[Loaded, Any]]:
    """Return the additions of one kind (``methods``, ``studies`` or ``claims``), each with its plug-in.

    Raises
    ------
    InvalidInput
        If an import path of a plug-in cannot be resolved or does not lead to a list.
    """
    values: list[tuple[Loaded, Any]] = []
    for each in loaded():
        added = getattr(each.plugin, kind)
        if isinstance(added, str):
            try:
                added = resolve(added)
            except (Exception, SystemExit) as error:
                raise _invalid(
                    f"the {kind} of the plug-in {each.name!r} cannot be loaded ({_summary(error)})",
                    added,
                    code="plugin_fails",
                ) from error
        if not isinstance(added, list | tuple):
            received = type(added).__name__
            raise _invalid(f"{kind} must be a list", each.name, received=received, code="wrong_type")
        values += [(each, value) for value in added]
    return values


def pages() -> list[Page]:
    """Return the additions of all loaded plug-ins to the HTML page that shows all figures."""
    return [each.plugin.page for each in loaded() if each.plugin.page]


def modules_of_files(paths: Iterable[str]) -> list[str]:
    """Return the module names of the given users' files that are loaded."""
    return [name for name in map(_module_name, paths) if name in _files]


def methods_of_files(paths: Iterable[str]) -> list[str]:
    """Return the names of the methods in users' files.

    Figures compare these methods even if no option names them.
    """
    modules = modules_of_files(paths)
    methods = [method for origin, method in contributions("methods") if origin.module in modules]
    return [str(getattr(method, "name", method)) for method in methods]


def priors() -> list[str]:
    """Return the names of the methods that include a model of other people, for ``model.prior=NAME``."""
    methods = (method for _, method in contributions("methods"))
    return [str(method.name) for method in methods if getattr(method, "of_other_people", False)]


def conf_folders() -> tuple[Path, ...]:
    """Return the folders of options: ``conf`` of this package, then the folders of plug-ins."""
    return (CONF, *(each.plugin.conf for each in loaded() if each.plugin.conf))


def conf_files(group: str) -> dict[str, Path]:
    """Return the YAML files of one group of options from all folders, sorted by name.

    Raises
    ------
    InvalidInput
        If two folders contain a file of the same name.
    """
    files: dict[str, Path] = {}
    for folder in conf_folders():
        for path in (folder / group).glob("*.yaml"):
            if path.stem in files:
                raise _invalid(
                    "two folders of options have a file of this name",
                    path,
                    received=files[path.stem],
                    code="duplicate_name",
                )
            files[path.stem] = path
    return dict(sorted(files.items()))


# --- sources ----------------------------------------------------------------------------------------------


def source_of(module: str) -> Path | None:
    """Return the source file of a module of this package or of a plug-in; None for other modules."""
    first, _, rest = module.partition(".")
    for each in _files.values():
        if each.file and first == each.module:
            return each.file
    folder = PACKAGE if first == PACKAGE.name else _folders().get(first)
    if folder is None:  # it may be a module next to a user's file, which that file can import
        siblings = [each.file.parent / f"{first}.py" for each in _files.values() if each.file]
        return next((path for path in siblings if path.is_file() and not rest), None)
    base = folder.joinpath(*rest.split(".")) if rest else folder
    candidates = (base / "__init__.py", base.with_suffix(".py"))
    return next((path for path in candidates if path.is_file()), None)


@cache
def _folders() -> dict[str, Path]:
    """Return the folder of each installed plug-in's package, by package name."""
    folders = {}
    for each in _installed()[0]:
        if each.root != PACKAGE.name and (file := import_module(each.root).__file__):
            folders[each.root] = Path(file).parent
    return folders
