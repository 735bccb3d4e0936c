"""Tests of the source code's structure: imports between modules, access to files, and sizes of classes and functions.

Reads the syntax trees of the sources, so imports inside functions and under TYPE_CHECKING count too.
"""

from __future__ import annotations

import ast
import fnmatch
import functools
import inspect
import itertools
import re
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import pytest

import pipeline

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("pipeline", "walk3d")
"""Package with the papers' work, and package built on top of it."""
STANDARD_LIBRARY = sys.stdlib_module_names | {"__future__"}


def _module_name(path: Path) -> str:
    """Return the short name of a module, such as ``core.fourier`` for pipeline/core/fourier.py."""
    dotted = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    return dotted.removeprefix("pipeline.").removesuffix(".__init__")


def dotted(module: str) -> str:
    """Return the full dotted name with which a module is imported."""
    return module if module.startswith("walk3d") else f"pipeline.{module}"


SOURCES = {_module_name(path): path for folder in PACKAGES for path in sorted((ROOT / folder).rglob("*.py"))}
MODULES = sorted(set(SOURCES) - {"__init__", "walk3d"})


@functools.cache
def tree_of(module: str) -> ast.Module:
    """Return the syntax tree of a module, which is parsed when a test first needs it."""
    return ast.parse(SOURCES[module].read_text(encoding="utf-8"))


def imports(tree: ast.AST) -> tuple[set[str], set[str]]:
    """Return the project's modules and the external packages that a syntax tree imports, at any level."""
    inside, outside = set(), set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            target = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"relative import on line {node.lineno}"
            target = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in target:
            first, _, rest = name.partition(".")
            if first not in PACKAGES:
                outside.add(first)
                continue
            rest = name if first == "walk3d" else rest
            while rest not in SOURCES:
                rest = rest.rpartition(".")[0]
                assert rest, f"{name} is not a module of the package"
            inside.add(rest)
    return inside, outside - STANDARD_LIBRARY


@functools.cache
def imports_of(module: str) -> tuple[set[str], set[str]]:
    """Return the project's modules and the external packages that a module imports."""
    return imports(tree_of(module))


_GROUND = (
    "validation locks shortened skeleton palette tidy charts chart_limits chart_json scenes"
    " processes compilation seeding resources reading plugins"
)
LAYERS = {
    "validation locks shortened": "",
    "skeleton palette tidy processes compilation seeding resources reading": "validation locks shortened",
    "plugins": "validation resources",
    "charts scenes": "validation palette tidy",
    "chart_limits chart_json": "validation palette charts",
    "core": "validation skeleton compilation shortened",
    "formats mappings fetch storage papers": "validation locks shortened skeleton palette tidy resources reading"
    " plugins",
    "pictures recordings": "validation locks skeleton palette tidy resources charts chart_limits scenes reading",
    "synthetic": f"{_GROUND} core",
    "clips": f"{_GROUND} core synthetic",
    "ingestion": f"{_GROUND} core clips formats mappings fetch",
    "studies": f"{_GROUND} core synthetic clips storage papers pictures recordings",
    "stages": f"{_GROUND} clips ingestion studies storage papers pictures recordings",
    "api": f"{_GROUND} core clips ingestion formats mappings",
    "report": f"{_GROUND} core studies storage papers pictures",
    "cli": f"{_GROUND} core synthetic clips formats mappings fetch storage papers pictures recordings"
    " ingestion studies stages report",
    "__main__": "cli",
    "walk3d.plugin": "plugins",
    "walk3d.anatomy": f"{_GROUND} core clips studies",
    "walk3d.author": f"{_GROUND} core clips formats mappings ingestion studies walk3d.anatomy",
    "walk3d.export": f"{_GROUND} core formats mappings ingestion storage cli",
    "walk3d.pointlight": f"{_GROUND} core api synthetic storage pictures cli",
    "walk3d.film": f"{_GROUND} core synthetic clips formats report storage papers pictures recordings studies cli"
    " walk3d.anatomy walk3d.export",
    "walk3d.studies walk3d.methods": "walk3d.anatomy walk3d.author walk3d.film",
    "walk3d.api": f"{_GROUND} core api storage walk3d.anatomy walk3d.export walk3d.film",
}
"""Modules and packages from the lowest layer up, with the packages that each may import."""

MAY_IMPORT = {name: set(allowed.split()) for names, allowed in LAYERS.items() for name in names.split()}

FROM_OUTSIDE = {
    "pandas": {"api", "studies", "stages", "cli", "walk3d.anatomy", "walk3d.author", "walk3d.film"},
    "xarray": {"api"},
    "matplotlib": {"pictures"},
    "PIL": {"pictures", "walk3d.pointlight"},
    "cv2": {"walk3d.film"},
    "ai_edge_litert": {"walk3d.film"},
    "jinja2": {"report"},
    "rerun": {"recordings"},
    "hydra": {"cli"},
    "omegaconf": {"cli"},
    "rich": {"cli"},
    "yaml": {"papers", "mappings"},
    "numba": {"compilation"},
    "threadpoolctl": {"processes"},
    "dask": {"cli.engine"},
    "distributed": {"cli.engine"},
    "dask_jobqueue": {"cli.engine"},
    "scipy": {"core", "synthetic", "studies", "walk3d.anatomy", "walk3d.film"},
    "numpy": {"*"},
}
"""Packages of the project that may import each external package."""

STUDIES = {
    path.parent.name
    for path in (ROOT / "pipeline" / "studies").glob("*/__init__.py")
    if re.search(r"^STUDY = ", path.read_text(encoding="utf-8"), re.MULTILINE)
}
"""Names of the folders that contain a study; other folders of ``studies`` are shared by several studies."""


def package(module: str) -> str:
    """Return the package of a module, such as ``core`` for core.fourier.series, or ``walk3d.film``."""
    return ".".join(module.split(".")[: 2 if module.startswith("walk3d.") else 1])


def study(module: str) -> str:
    """Return the study of a module, such as ``walks`` for studies.walks.model, or an empty string."""
    parts = module.split(".")
    return parts[1] if parts[0] == "studies" and len(parts) > 1 and parts[1] in STUDIES else ""


def broken_rules(module: str, inside: set[str], outside: set[str]) -> list[str]:
    """Return the forbidden imports of a module, one sentence for each."""
    reference = package(module)
    described = []
    for other in sorted(inside):
        theirs = package(other)
        if theirs != reference and theirs not in MAY_IMPORT[reference]:
            described.append(f"{module} imports {other}")
        elif reference.startswith("walk3d") or module == "studies.registry":
            continue
        elif study(other) and study(other) != study(module):
            if theirs == reference:
                described.append(f"{module} imports {other}, of another study")
            else:
                described.append(f"{module} names the study of {other}")
    for name in sorted(outside):
        allowed = FROM_OUTSIDE.get(name, set())
        if not {"*", reference, module} & allowed:
            described.append(f"{module} imports {name}")
    return described


def test_every_module_and_package_has_a_layer() -> None:
    names = {package(module) for module in MODULES}
    assert names == set(MAY_IMPORT)


def test_layers_import_from_those_above_them_in_the_table() -> None:
    observed: set[str] = set()
    for names, allowed in LAYERS.items():
        assert set(allowed.split()) <= observed, names
        observed |= set(names.split())


@pytest.mark.parametrize("module", MODULES)
def test_a_module_imports_only_what_its_layer_allows(module: str) -> None:
    assert broken_rules(module, *imports_of(module)) == []


@pytest.mark.parametrize(
    ("module", "code"),
    [
        ("core.camera", "from pipeline.storage import store"),
        ("core.camera", "def f():\n    import pandas"),
        ("core.camera", "from pipeline.studies.study import Grid"),
        ("formats.text", "from pipeline.storage.tables import write"),
        ("formats.text", "import scipy.signal"),
        (
            "storage.tables",
            "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from pipeline.studies.study import Grid",
        ),
        ("recordings.check", "import matplotlib"),
        ("recordings.check", "from pipeline.pictures import style"),
        ("studies.walks.methods", "from pipeline.stages import chain"),
        ("studies.walks.methods", "from pipeline.studies.limbs import dataset"),
        ("studies.study", "from pipeline.studies.walks import model"),
        ("stages.chain", "from pipeline.studies.walks import model"),
        ("stages.chain", "import rerun as rr"),
        ("stages.chain", "from omegaconf import OmegaConf"),
        ("papers", "import pandas"),
        ("papers", "from pipeline.storage import tables"),
        ("clips.walks", "from pipeline.studies.study import Study"),
        ("clips.kinds", "from pipeline.formats import read"),
        ("studies.walks.known_view", "from pipeline.ingestion.corpus import Clip"),
        ("studies.walks.known_view", "from pipeline import mappings"),
        ("studies.eigenwalkers.model", "from pipeline.studies.walks import methods"),
        ("ingestion.corpus", "from pipeline.studies.study import Study"),
    ],
)
def test_a_wrong_import_is_noticed(module: str, code: str) -> None:
    assert len(broken_rules(module, *imports(ast.parse(code)))) == 1


def test_only_the_registry_names_all_studies() -> None:
    target = imports(ast.parse("from pipeline.studies.walks import model"))
    assert broken_rules("studies.limbs.model", *target) != []
    assert broken_rules("studies.registry", *target) == []


def test_the_papers_do_not_know_what_is_built_on_them() -> None:
    """The package `pipeline` neither imports nor mentions `walk3d`."""
    named = [str(path) for path in (ROOT / "pipeline").rglob("*") if path.is_file() and path.suffix != ".pyc"
             if b"walk3d" in path.read_bytes()]  # fmt: skip
    assert named == []
    assert not [m for m in MODULES if not m.startswith("walk3d") for o in imports_of(m)[0] if "walk3d" in o]


BY_STRING = {"import_module", "__import__", "resolve_name", "spec_from_file_location"}


@pytest.mark.parametrize("module", sorted({*MODULES} - {"plugins"}))
def test_only_plug_ins_are_imported_by_a_string(module: str) -> None:
    """Only plug-ins, and the lazy names in the ``__init__`` of a package, are imported by a string."""
    if SOURCES[module].name == "__init__.py":
        return
    called = [
        ast.unparse(node.func).rpartition(".")[2]
        for node in ast.walk(tree_of(module))
        if isinstance(node, ast.Call)
    ]
    assert not BY_STRING & {*called}


def test_no_circle_of_imports() -> None:
    done: set[str] = set()

    def visit(module: str, path: tuple[str, ...]) -> None:
        assert module not in path, " -> ".join([*path, module])
        if module not in done:
            for other in sorted(imports_of(module)[0] - {module}):
                visit(other, (*path, module))
            done.add(module)

    for module in MODULES:
        visit(module, ())
    assert done == set(MODULES)


# --- what one must know -------------------------------------------------------------------------------------


BUDGET = 66
"""Largest number of the project's files that a figure's module may import, directly or indirectly."""

BUDGETS = {
    "studies.walks.figures.spectrum": 26,
    "studies.walks.figures.view_errors": 45,
    "stages.figure": 150,
    "walk3d.film.command": 120,
}


class _WhenRun(ast.NodeTransformer):
    """Syntax-tree transformer that removes imports under TYPE_CHECKING."""

    def visit_If(self, node: ast.If) -> ast.AST | list[ast.stmt]:
        self.generic_visit(node)
        return node.orelse if "TYPE_CHECKING" in ast.unparse(node.test) else node


@functools.cache
def reached_at_once(module: str) -> set[str]:
    """Return the modules that a module imports directly when it runs."""
    return imports(_WhenRun().visit(ast.parse(SOURCES[module].read_text(encoding="utf-8"))))[0]


FIGURES = [m for m in MODULES if study(m) and (".figures." in m or m.endswith("figure"))]


def reached(module: str) -> set[str]:
    """Return a module and all modules that it imports directly or indirectly, without their parent packages."""
    result: set[str] = set()
    waiting = {module}
    while waiting:
        result |= waiting
        waiting = {other for first in waiting for other in reached_at_once(first)} - result
    return result


def test_what_one_must_know_of_a_figure_is_bounded() -> None:
    counts = {module: len(reached(module)) for module in [*FIGURES, *BUDGETS]}
    rows = sorted(counts.items(), key=lambda row: -row[1])
    table = "\n".join(f"{n:5d} of {BUDGETS.get(m, BUDGET):3d}  {m}" for m, n in rows)
    print(table)
    assert all(n <= BUDGETS.get(m, BUDGET) for m, n in counts.items()), table


@pytest.mark.parametrize("module", FIGURES)
def test_a_figure_reaches_no_reader_and_no_renderer(module: str) -> None:
    assert not {package(m) for m in reached(module)} & {
        "formats",
        "mappings",
        "fetch",
        "ingestion",
        "stages",
        "cli",
        "pictures",
        "recordings",
    }


def test_no_module_is_called_after_a_heap() -> None:
    heaps = {"utils", "util", "helpers", "helper", "common", "manager", "managers", "misc"}
    folders = {path.name for owner in PACKAGES for path in (ROOT / owner).rglob("*") if path.is_dir()}
    parts = {word for name in [*MODULES, *folders] for word in re.split(r"[._]", name)}
    assert not parts & heaps


# --- core is mathematics ----------------------------------------------------------------------------------


_OUTSIDE_WORLD = {
    "os",
    "time",
    "datetime",
    "pathlib",
    "io",
    "sys",
    "subprocess",
    "random",
    "tempfile",
    "logging",
}
_GENERATORS = {"default_rng", "Generator", "PCG64", "SeedSequence"}


def outside_world(tree: ast.AST) -> list[str]:
    """Return the uses of clocks, files, environment variables and global random numbers in a syntax tree."""
    described = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module or ""]
            described += [f"line {node.lineno}: {n}" for n in names if n.split(".")[0] in _OUTSIDE_WORLD]
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id in {"open", "print"}
        ):
            described.append(f"line {node.lineno}: {node.func.id}()")
        if (
            isinstance(node, ast.Attribute)
            and isinstance(node.value, ast.Attribute)
            and (ast.unparse(node.value) in {"np.random", "numpy.random"})
            and node.attr not in _GENERATORS
        ):
            described.append(f"line {node.lineno}: np.random.{node.attr}")
        if isinstance(node, ast.Attribute) and node.attr in {
            "load",
            "save",
            "savez",
            "loadtxt",
            "tofile",
            "fromfile",
        }:
            described.append(f"line {node.lineno}: .{node.attr}")
    return described


CORE = [
    module
    for module in MODULES
    if package(module) == "core" or module.startswith(("walk3d.anatomy.prior", "walk3d.film.walk."))
]


@pytest.mark.parametrize("module", CORE)
def test_core_knows_no_clock_file_environment_or_global_generator(module: str) -> None:
    assert outside_world(tree_of(module)) == []


@pytest.mark.parametrize(
    "code",
    [
        "import os",
        "def f():\n    from time import perf_counter",
        "from pathlib import Path",
        "open('x')",
        "import numpy as np\nnp.random.normal()",
        "import numpy as np\nnp.random.seed(1)",
        "import numpy as np\nnp.load('x')",
    ],
)
def test_a_core_that_looks_outside_is_noticed(code: str) -> None:
    assert len(outside_world(ast.parse(code))) == 1


def test_a_generator_as_an_argument_is_welcome() -> None:
    assert outside_world(ast.parse("def f(g: np.random.Generator) -> float:\n    return g.normal()")) == []


# --- public functions say what they return ----------------------------------------------------------------


def _documented(module: str) -> list[tuple[str, Any]]:
    """Return the public functions, classes and methods that a module defines, with their dotted names."""
    imported = import_module(dotted(module))
    result: list[tuple[str, Any]] = []
    for name, thing in vars(imported).items():
        if name.startswith("_") or getattr(thing, "__module__", None) != imported.__name__:
            continue
        if inspect.isfunction(thing) or inspect.isclass(thing):
            result.append((name, thing))
        if inspect.isclass(thing):
            result += [
                (f"{name}.{method}", getattr(body, "fget", None) or body)
                for method, body in vars(thing).items()
                if not method.startswith("_") and (inspect.isfunction(body) or isinstance(body, property))
            ]
    return result


def _section(docstring: str, title: str) -> list[str]:
    """Return the parameter or attribute names that a numpydoc section documents."""
    match = re.search(rf"^{title}\n-+\n(.*?)(?=^\S[^\n]*\n-{{3,}}|\Z)", docstring, re.MULTILINE | re.DOTALL)
    if match is None:
        return []
    heads = [line for line in match[1].splitlines() if line and not line[0].isspace()]
    return [name.strip() for head in heads for name in head.split(":")[0].split(",")]


@pytest.mark.parametrize("module", MODULES)
def test_public_functions_say_what_they_return_and_name_their_parameters(module: str) -> None:
    assert (import_module(dotted(module)).__doc__ or "").strip(), "the module has no docstring"
    wrong = [complaint for name, thing in _documented(module) for complaint in _complaints(name, thing)]
    assert wrong == []


def _complaints(name: str, thing: Any) -> list[str]:
    """Return the faults in the docstring of a function or class, one sentence each."""
    docstring = inspect.cleandoc((vars(thing)["__doc__"] if isinstance(thing, type) else thing.__doc__) or "")
    if not docstring or docstring.startswith(f"{name}("):  # which a dataclass writes for itself
        return [f"{name} has no docstring"]
    wrong = []
    first = docstring.split("\n\n")[0]
    if not first.endswith((".", "::")):
        wrong.append(f"{name}: the first sentence does not end: {first!r}")
    if re.search(r"^ +-{3,}$", docstring, re.MULTILINE):  # no tool reads it, nor the store the shapes
        wrong.append(f"{name}: a heading is indented")
    actual = [p for p in inspect.signature(thing).parameters if p != "self"]
    documented = [p.lstrip("*") for p in _section(docstring, "Parameters")]
    if documented and documented != actual:
        wrong.append(f"{name} documents {documented}, its parameters are {actual}")
    return wrong


def test_a_section_of_a_docstring_is_read_as_it_stands() -> None:
    docstring = (
        "First.\n\nParameters\n----------\na, b : int\n    Counts.\nc : str\n\nReturns\n-------\nd : int\n"
    )
    assert _section(docstring, "Parameters") == ["a", "b", "c"]
    assert _section(docstring, "Returns") == ["d"]


# --- nothing executable in data, no strings for types -----------------------------------------------------


@pytest.mark.parametrize("module", MODULES)
def test_nothing_is_pickled(module: str) -> None:
    assert not {"pickle", "cPickle", "dill", "joblib", "shelve", "marshal"} & {
        alias.name.split(".")[0]
        for node in ast.walk(tree_of(module))
        if isinstance(node, ast.Import)
        for alias in node.names
    }
    for node in ast.walk(tree_of(module)):
        if isinstance(node, ast.ImportFrom):
            assert (node.module or "").split(".")[0] not in {"pickle", "dill", "joblib", "shelve", "marshal"}
        if isinstance(node, ast.keyword) and node.arg == "allow_pickle":
            assert isinstance(node.value, ast.Constant)
            assert node.value.value is False
        if isinstance(node, ast.Call) and ast.unparse(node.func) in {"np.load", "np.savez", "np.save"}:
            assert "allow_pickle" in {keyword.arg for keyword in node.keywords}, f"line {node.lineno}"


def test_no_class_is_named_by_a_string() -> None:
    texts = [*SOURCES.values(), *(ROOT / "conf").rglob("*.yaml")]
    result = [p.name for p in texts if re.search(r"_target_|\binstantiate\b", p.read_text(encoding="utf-8"))]
    assert result == []


# --- sizes ------------------------------------------------------------------------------------------------


def lines(path: Path) -> int:
    """Return the number of lines of a file."""
    return len(path.read_text(encoding="utf-8").splitlines())


@pytest.mark.parametrize("module", [m for m in MODULES if package(m) == "stages"])
def test_a_stage_is_thin(module: str) -> None:
    assert lines(SOURCES[module]) <= 120


@pytest.mark.parametrize("preset", sorted(ROOT.glob("**/conf/experiment/*.yaml")), ids=lambda p: p.stem)
def test_a_preset_holds_only_what_differs(preset: Path) -> None:
    assert lines(preset) <= 15


MAX_FIELDS, MAX_ARGUMENTS = 15, 9
"""Largest number of fields of a dataclass other than options, and of arguments without `self` and `cls`."""


@functools.cache
def option_classes() -> frozenset[str]:
    """Return the names of all classes that derive from `Options`, directly or indirectly."""
    classes = [node for m in SOURCES for node in ast.walk(tree_of(m)) if isinstance(node, ast.ClassDef)]
    bases = {node.name: {ast.unparse(base).rpartition(".")[2] for base in node.bases} for node in classes}
    result = {"Options"}
    while more := {name for name, owner in bases.items() if owner & result} - result:
        result |= more
    return frozenset(result)


def too_large(tree: ast.Module) -> list[str]:
    """Return the dataclasses and functions in a syntax tree that exceed the limits, one sentence each.

    Every class whose body annotates fields is a record: a dataclass, a NamedTuple, a TypedDict.  Excepted are classes
    of options, which derive from `Options`, and class variables.
    """
    described = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            annotated = [
                ast.unparse(part.annotation) for part in node.body if isinstance(part, ast.AnnAssign)
            ]
            count = sum(not kind.startswith("ClassVar") for kind in annotated)
            bases = {ast.unparse(base).rpartition(".")[2] for base in node.bases}
            if count > MAX_FIELDS and not bases & option_classes():
                described.append(f"{node.name} has {count} fields")
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            inputs = node.args
            names = [*inputs.posonlyargs, *inputs.args, *inputs.kwonlyargs, inputs.vararg, inputs.kwarg]
            count = sum(first is not None and first.arg not in ("self", "cls") for first in names)
            if count > MAX_ARGUMENTS:
                described.append(f"{getattr(node, 'name', 'lambda')} has {count} arguments")
    return described


@pytest.mark.parametrize("module", SOURCES)
def test_records_and_functions_are_small(module: str) -> None:
    assert too_large(tree_of(module)) == []


@pytest.mark.parametrize(
    ("code", "count"),
    [
        ("class Record(NamedTuple):\n" + "".join(f"    f{n}: int\n" for n in range(16)), 1),
        ("class Record:\n    kind: ClassVar[str]\n" + "".join(f"    f{n}: int\n" for n in range(15)), 0),
        ("class Film(Options):\n" + "".join(f"    f{n}: int\n" for n in range(16)), 0),
        ("class Film(study.Sweep):\n" + "".join(f"    f{n}: int\n" for n in range(16)), 0),
        ("def f(self, a, b, c, d, e, *f, g, h, i): ...", 0),
        ("def f(self, a, b, c, d, e, *f, g, h, i, **j): ...", 1),
    ],
)
def test_a_large_record_or_function_is_noticed(code: str, count: int) -> None:
    assert len(too_large(ast.parse(code))) == count


# --- what the project says of itself ----------------------------------------------------------------------


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
DISTRIBUTIONS = {
    "hydra": "hydra-core", "rerun": "rerun-sdk", "yaml": "pyyaml", "PIL": "pillow", "cv2": "opencv-python-headless",
    "ai_edge_litert": "ai-edge-litert", "dask_jobqueue": "dask-jobqueue",
}  # fmt: skip
"""Names of distributions that differ from the name of the imported package."""


def _requirement(text: str) -> str:
    return re.split(r"[<>=!~\[; ]", text, maxsplit=1)[0].lower()


def test_every_package_from_outside_is_a_dependency() -> None:
    declared = {_requirement(text) for text in PROJECT["project"]["dependencies"]}
    assert declared == {"numpy", "scipy", "pyyaml", "threadpoolctl"}
    used = {DISTRIBUTIONS.get(name, name) for module in SOURCES for name in imports_of(module)[1]}
    optional = PROJECT["project"]["optional-dependencies"]
    papers, others = (
        {_requirement(text) for name in names for text in optional[name]}
        for names in (["papers"], ["xarray", "cluster", "video"])
    )
    listed = declared | papers | others
    assert used <= listed, f"not declared: {sorted(used - listed)}"
    assert declared | papers <= used, f"declared and not used: {sorted((declared | papers) - used)}"


def test_every_folder_of_the_package_is_installed() -> None:
    folders = {dotted(name) if name != "__init__" else "pipeline" for name, path in SOURCES.items()
               if path.name == "__init__.py"}  # fmt: skip
    result = PROJECT["tool"]["setuptools"]["packages"]["find"]
    assert result == {"include": ["pipeline*", "walk3d*", "gait_pipeline*"]}
    assert all(any(fnmatch.fnmatch(name, pattern) for pattern in result["include"]) for name in folders)
    without = {dotted(_module_name(path.parent / "__init__.py")) for path in SOURCES.values()} - folders
    assert without - {"pipeline.__init__"} == set(), "a folder without __init__.py is not installed"


def _locked(name: str) -> dict[str, str]:
    """Return the entries of a lock file by package name, each with version and hashes."""
    text = (ROOT / name).read_text(encoding="utf-8")
    assert "://" not in text
    for line in text.splitlines():
        assert re.match(r"[A-Za-z0-9_.-]+==|    --hash=sha256:[0-9a-f]{64}|    #|#|$", line), line
    entries = re.finditer(r"^([A-Za-z0-9_.-]+)==\S+.*\n(?:    .*\n)*", text, re.MULTILINE)
    return {match[1].lower(): match[0] for match in entries}


def test_every_dependency_is_locked_to_one_version() -> None:
    light, run, tools, cluster, video = (
        _locked(f"requirements{end}.lock") for end in ("-light", "", "-dev", "-cluster", "-video")
    )
    optional = {
        name: {_requirement(text) for text in texts} - {"gait-pipeline"}
        for name, texts in PROJECT["project"]["optional-dependencies"].items()
    }
    # What the wheel brings, and what builds it and the packages that have no wheel.
    assert set(light) == {_requirement(text) for text in PROJECT["project"]["dependencies"]} | {"setuptools"}
    assert optional["papers"] <= set(run)
    assert optional["video"] <= set(video)
    assert optional["cluster"] <= set(cluster)
    locked = set(run) | set(tools) | set(video) | set(cluster)
    assert set().union(*optional.values()) <= locked
    assert light.items() <= run.items(), "the light environment is a part of the whole"
    for first, other in itertools.combinations((run, tools, cluster, video), 2):
        twice = set(first) & set(other)
        assert all(first[name] == other[name] for name in twice), f"two versions: {sorted(twice)}"
    assert set(run) & set(tools) == set(run) & set(cluster) == set(tools) & set(cluster) == set()


def _tracked() -> list[Path]:
    """Return the files of the project that git does not ignore."""
    listed = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "--cached", "--others", "--exclude-standard"],
        capture_output=True,
        text=True,
        check=False,
    )
    if listed.returncode:
        pytest.skip("needs git and a checkout")
    return [path for name in listed.stdout.splitlines() if (path := ROOT / name).is_file()]


# As a pattern it does not find itself.
_OF_ONE_MACHINE = re.compile(r"/(?:home|Users|root|work)/|\.\./(?:shared)\b")


def test_no_path_of_one_machine_in_tracked_files() -> None:
    result = []
    for path in _tracked():
        content = path.read_bytes()
        if b"\0" in content:
            continue
        for number, line in enumerate(content.decode("utf-8", "replace").splitlines(), start=1):
            if _OF_ONE_MACHINE.search(line):
                result.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()[:80]}")
    assert result == []


def entries_of_the_map(indentation: int) -> list[str]:
    """Return the names at one indentation level in the overview of the package's docstring, in their order."""
    lines = re.findall(rf"^ {{{indentation}}}(\w+(?:(?:/|,) \w+)*)", pipeline.__doc__ or "", re.MULTILINE)
    return [name for line in lines for name in re.findall(r"\w+", line)]


def test_the_map_names_every_package_from_the_base_upwards() -> None:
    order = entries_of_the_map(4)
    assert sorted(order) == sorted({package(m) for m in MODULES if not m.startswith("walk3d")})
    places = {name: order.index(name) for name in order}
    upwards = {
        (package(m), package(other))
        for m in MODULES
        if not m.startswith("walk3d")
        for other in imports_of(m)[0]
        if places[package(other)] > places[package(m)]
    }
    assert upwards == set()


def test_the_map_names_every_part_of_core_and_none_that_is_not() -> None:
    """The overview in the package docstring lists all modules of ``core``; a new study need not be listed."""
    core, studies = (
        {m.split(".")[1] for m in MODULES if m.startswith(owner)} for owner in ("core.", "studies.")
    )
    entries = entries_of_the_map(6)
    assert len(entries) == len({*entries})
    assert core <= {*entries} <= core | studies


def test_docstrings_name_modules_that_exist() -> None:
    missing = set()
    for path in SOURCES.values():
        for name in re.findall(r"`((?:pipeline|walk3d)(?:\.\w+)+)`", path.read_text(encoding="utf-8")):
            try:
                resolve_name(name)
            except (ImportError, AttributeError):
                missing.add(f"{path.relative_to(ROOT)}: {name}")
    assert missing == set()


def test_the_source_distribution_is_complete() -> None:
    """MANIFEST.in names every file of the project that setuptools does not include by default."""
    used = {"pyproject.toml", "setup.py", "README.md", "LICENSE", "MANIFEST.in"}
    of_the_repository = {".gitignore", ".gitattributes"}
    folders = ["pipeline/", "walk3d/"]
    for line in (ROOT / "MANIFEST.in").read_text(encoding="utf-8").splitlines():
        rule, *names = line.split()
        if rule in ("graft", "recursive-include"):
            names = names[:1] if rule == "recursive-include" else names
            folders += [f"{name}/" for name in names]
        elif rule == "include":
            used.update(names)
    tracked = {path.relative_to(ROOT).as_posix() for path in _tracked()}
    assert (
        sorted(tracked - used - of_the_repository - {n for n in tracked if n.startswith(tuple(folders))})
        == []
    )
    assert used <= tracked | {"LICENSE"}
