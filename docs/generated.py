"""Parts of the documentation that are generated from the sources: options, columns, library, the drawing.

This is a hook of MkDocs: ``<!-- made: options -->`` in a page is replaced by the result of the function `options`.
"""

from __future__ import annotations

import ast
import csv
import inspect
import os
import re
import tempfile
import textwrap
import types
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import redirect_stdout
from dataclasses import MISSING, Field, fields, is_dataclass
from enum import Enum
from functools import cache, partial
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parent.parent
PACKAGE, OURS = ROOT / "pipeline", ROOT / "walk3d"


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Return a page with its generated parts inserted."""
    return re.sub(r"<!-- made: (\w+) -->", lambda match: MADE[match[1]](), markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Return a page whose tables and code, which may scroll sideways, can be reached by keyboard."""
    html = html.replace("<pre>", '<pre tabindex="0">')
    return re.sub(r"<table>.*?</table>", r'<div class="wide" tabindex="0">\g<0></div>', html, flags=re.DOTALL)


def on_post_page(output: str, **_: Any) -> str:
    """Return a page whose footer and versions are landmarks."""
    output = output.replace('<div role="contentinfo">', "<div>")  # inside the footer
    output = output.replace("<footer>", '<footer role="contentinfo">')
    return output.replace(
        '<div class="rst-versions" role="note"', '<div class="rst-versions" role="navigation"'
    )


# --- gallery ----------------------------------------------------------------------------------------------

LIGHT = ROOT / "results" / "archive" / "light"
"""Pictures that `make archive LIGHT=1` and `make readme ARGS=data=synthetic` keep in the repository."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pictures of the gallery."""
    for address, content in gallery_pictures().items():
        files.append(File.generated(config, address, content=content))
    return files


def gallery_pictures() -> dict[str, bytes]:
    """Return the pictures that the gallery shows, by address."""
    page = (ROOT / "docs" / "gallery.md").read_text("utf-8")
    return {f"gallery/{name}": _picture(Path(name)) for name in re.findall(r"\]\(gallery/([^)]+)\)", page)}


def _picture(name: Path) -> bytes:
    """Return a picture of the gallery: dots of a walk, a picture of the README, or a figure of a light archive."""
    if name.stem == "pointlight":
        return _pointlight()
    if name.suffix == ".svg":
        return (LIGHT / name).read_bytes()
    figure = Path("optical", "zhang2007_fig4") if name.stem == "recordings" else Path("synthetic", name.stem)
    return (LIGHT / figure / "figure.webp").read_bytes()


def _pointlight() -> bytes:
    """Return a walk of synthetic dots as an SVG."""
    from walk3d.pointlight.command import make

    with tempfile.TemporaryDirectory() as folder:
        path, _ = make(["synthetic", f"to={folder}/walker.svg"])
        return path.read_bytes()


# --- options ----------------------------------------------------------------------------------------------


@cache
def _experiments() -> dict[str, Any]:
    """Return the experiment of each preset."""
    from pipeline.cli.compose import compose
    from pipeline.cli.presets import presets

    return {name: compose([f"experiment={name}"]) for name in presets()}


def option_classes() -> Iterator[tuple[str, str, type[Any], list[str]]]:
    """Yield each class of options: title, prefix of its names, class, presets that use it."""
    from pipeline.ingestion.data import DATA_SETS
    from pipeline.studies.experiment import Experiment
    from pipeline.studies.registry import GROUPS, options
    from walk3d.film.reconstruct.training import Training
    from walk3d.film.reconstruct.writing import Reconstruct

    yield "Every figure", "", Experiment, ["every figure"]
    for name, kind in DATA_SETS.items():
        where = {
            "synthetic": "synthetic",
            "recorded": "optical, many, cmu, hdm05, hdm05_squat",
            "folder": "folder",
            "author": "author",
        }
        yield f"Data set: {where[name]}", "data.", kind, [f"data={where[name]}"]
    for group in GROUPS:
        for name, kind in options(group).items():
            used = [n for n, e in _experiments().items() if type(getattr(e, group)) is kind]
            yield f"{group}={name}", f"{group}.", kind, used
    yield "Walks from keypoints", "", Reconstruct, ["reconstruct"]
    yield "Training the model of walkers", "training.", Training, ["model"]


GROUPED = {"data", "dataset", "model", "sweep", "figure"}
"""Options of an experiment with separate tables."""


def rows_of(before: str, kind: type[Any]) -> Iterator[tuple[str, str, str, str, str, str]]:
    """Yield name, type, default, bounds, unit and meaning of each option of a class, and of nested options."""
    hints = get_type_hints(kind, include_extras=True)
    words = _words(kind)
    for option in fields(kind):
        if before == "" and option.name in GROUPED and kind.__name__ == "Experiment":
            continue
        hint, name = hints[option.name], before + option.name
        plain = _plain(hint)
        about = words.get(option.name) or _choices(plain)
        if isinstance(plain, type) and is_dataclass(plain):
            for inner, *middle, unit, meaning in rows_of(f"{name}.", plain):
                # For a grid, the unit follows from its name, and its description names the swept quantity.
                whole = "; ".join(part for part in (about, meaning) if part)
                yield inner, *middle, unit or _unit(option.name), whole
            continue
        yield name, _type(plain), _default(option), bounds(hint), _unit(option.name), about


def options() -> str:
    """Return the tables of all options, one for each class."""
    parts = []
    for title, before, kind, used in option_classes():
        rows = list(rows_of(before, kind))
        if not rows:
            continue
        parts.append(f"### {title}\n\n{_first_sentence(kind)} Used by {_listed(used)}.\n")
        parts.append(_table(["option", "type", "default", "bounds", "unit", "meaning"], rows))
    return "\n".join(parts)


def _listed(used: list[str]) -> str:
    names = [f"`{name}`" if re.fullmatch(r"\w+", name) else name for name in used]
    return ", ".join(names) if names else "no preset: choose it by name"


def _plain(hint: Any) -> Any:
    """Return the type without its annotations, and without None."""
    if get_origin(hint) is Annotated:
        return _plain(get_args(hint)[0])
    if get_origin(hint) in (Union, types.UnionType):
        inner = [part for part in get_args(hint) if part is not type(None)]
        return _plain(inner[0]) if len(inner) == 1 else hint
    return hint


def _choices(kind: Any) -> str:
    """Return the docstrings of an enumeration and of its members."""
    if get_origin(kind) is list:
        kind = _plain(get_args(kind)[0])
    if not (isinstance(kind, type) and issubclass(kind, Enum)):
        return ""
    sentences = [kind.__doc__ or ""]
    nodes = ast.parse(inspect.getsource(inspect.getmodule(kind) or kind)).body
    body = next(
        (node.body for node in nodes if isinstance(node, ast.ClassDef) and node.name == kind.__name__), []
    )
    for member, after in pairwise(body):
        if (
            isinstance(member, ast.Assign)
            and isinstance(after, ast.Expr)
            and isinstance(after.value, ast.Constant)
        ):
            sentences.append(f"`{ast.unparse(member.targets[0])}`: {after.value.value}")
    return " ".join(" ".join(sentences).split())


def _type(kind: Any) -> str:
    if get_origin(kind) is list:
        return "list of " + _type(_plain(get_args(kind)[0]))
    if get_origin(kind) is not None:
        return re.sub(r"[\w.]+\.", "", str(kind))
    if isinstance(kind, type) and issubclass(kind, Enum):
        return ", ".join(f"`{choice}`" for choice in kind.__members__)
    return {"int": "whole number", "float": "number", "str": "text", "bool": "true or false"}.get(
        kind.__name__, kind.__name__
    )


def _default(one: Field[Any]) -> str:
    if sizes := one.metadata.get("scale"):
        return "of the scale: " + ", ".join(f"{key} {value}" for key, value in sizes.items())
    if one.default is not MISSING:
        return _value(one.default)
    if one.default_factory is not MISSING:
        return "as many as there are cores" if one.name == "workers" else _value(one.default_factory())
    return "set by the preset"


def _value(value: Any) -> str:
    if isinstance(value, Enum):
        return f"`{value.name}`"
    if isinstance(value, list):
        return "`[" + ", ".join(_value(item).strip("`") for item in value) + "]`"
    if value == "":
        return "empty"
    return f"`{str(value).lower() if isinstance(value, bool) else value}`"


_BOUNDS = {"at_least": "≥ {}", "above": "> {}", "at_most": "≤ {}", "below": "< {}"}


def bounds(hint: Any) -> str:
    """Return the bounds in the annotations of an option, as signs and words."""
    terms = []
    if get_origin(hint) is Annotated:
        hint, *checks = get_args(hint)
        for check in checks:
            if isinstance(check, partial):
                terms += [
                    _BOUNDS[name].format(value)
                    for name, value in check.keywords.items()
                    if name in _BOUNDS and value is not None
                ]
            elif callable(check):
                terms.append(check.__name__.removeprefix("require_").replace("_", " "))
    inner = [bounds(part) for part in get_args(hint) if not isinstance(part, str)]
    return ", ".join(dict.fromkeys([*terms, *filter(None, inner)]))


_UNITS = {
    "mm2": "mm²", "mm": "mm", "deg": "°", "hz": "Hz", "px": "px", "s": "s", "rad": "rad", "percent": "%",
    "frames": "frames", "sd": "",
}  # fmt: skip


def _unit(name: str) -> str:
    for end, unit in (("mm_s", "mm/s"), ("deg_s", "°/s")):
        if name.endswith(end):
            return unit
    parts = [part for part in name.split("_") if part not in ("low", "high")]
    return _UNITS.get(parts[-1], "") if len(parts) > 1 else ""


def _words(kind: type[Any]) -> dict[str, str]:
    """Return the meaning of each field of a class, from its comments and the docstring's ``Attributes``."""
    meanings: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        if not is_dataclass(base):
            continue
        meanings |= documented(inspect.cleandoc(vars(base).get("__doc__") or ""), "Attributes")
        lines = inspect.getsource(base).splitlines()
        for node in ast.walk(ast.parse(textwrap.dedent("\n".join(lines)))):
            if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                field_lines = (lines[k] for k in range(node.lineno - 1, node.end_lineno or node.lineno))
                comment = " ".join(
                    m[1] for line in field_lines if (m := re.search(r"  # (?!fmt:)(.+)$", line))
                )
                if comment and not comment.startswith("type:"):
                    meanings[node.target.id] = comment
    return meanings


def documented(docstring: str, title: str) -> dict[str, str]:
    """Return the text of each name in a numpydoc section."""
    match = re.search(rf"^{title}\n-+\n(.*?)(?=^\S[^\n]*\n-{{3,}}|\Z)", docstring, re.MULTILINE | re.DOTALL)
    meanings: dict[str, str] = {}
    names: list[str] = []
    for line in match[1].splitlines() if match else ():
        if line and not line[0].isspace():
            head, _, kind = line.partition(" : ")
            names = [name.strip().lstrip("*") for name in head.split(",")]
            meanings |= dict.fromkeys(names, kind if kind.startswith("(") else "")
        elif line.strip():
            meanings |= {name: f"{meanings[name]} {line.strip()}".strip() for name in names}
    return meanings


def _first_sentence(thing: Any) -> str:
    return (inspect.cleandoc(thing.__doc__ or "").split("\n\n")[0]).replace("\n", " ")


def _table(head: list[str], rows: Any) -> str:
    def line(cells: Any) -> str:
        return "| " + " | ".join(str(cell).replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"

    quoted = ([f"`{row[0]}`", *row[1:]] for row in rows)
    return "\n".join([line(head), line("---" for _ in head), *map(line, quoted)]) + "\n"


# --- columns of the tables --------------------------------------------------------------------------------


def golden_columns() -> dict[str, list[str]]:
    """Return the columns of ``table.csv`` of each figure, from its golden table."""
    columns_of = {}
    for path in sorted((ROOT / "tests" / "golden").glob("*_*.csv")):
        with path.open(encoding="utf-8", newline="") as table:
            columns_of[path.stem] = next(csv.reader(table))
    return columns_of


def columns() -> str:
    """Return a table of every column: its unit, its meaning, and the figures that have it."""
    having = defaultdict(list)
    for figure, names in golden_columns().items():
        for name in names:
            having[name].append(figure)
    rows = []
    for name, figures in sorted(having.items()):
        if name.endswith(("_low", "_high")):
            continue
        ends = (
            " (with its 95 % interval: `_low`, `_high`)"
            if name + "_low" in having or _moved(name) in having
            else ""
        )
        words = COLUMNS.get(name) or next(filter(None, (_said(figure).get(name) for figure in figures)), "")
        rows.append((name, _unit(name), words + ends, ", ".join(f"`{figure}`" for figure in figures)))
    return _table(["column", "unit", "meaning", "in `table.csv` of"], rows)


def _moved(name: str) -> str:
    """Return the lower end's name where the unit comes last: ``error_low_mm``."""
    first, _, unit = name.rpartition("_")
    return f"{first}_low_{unit}"


@cache
def _said(figure: str) -> dict[str, str]:
    """Return the meaning of each result, from the docstrings of the figure's study and of code that studies share."""
    folder = PACKAGE.joinpath(*type(_experiments()[figure].figure).__module__.split(".")[1:3])
    meanings: dict[str, str] = {}
    for path in sorted(folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                attributes = documented(inspect.cleandoc(ast.get_docstring(node) or ""), "Attributes")
                plain = {
                    name: re.sub(r"^\([^)]*\)( \w+$)? ?", "", words) for name, words in attributes.items()
                }
                meanings = {name: words for name, words in plain.items() if words} | meanings
    return meanings


COLUMNS = {
    # Names and times.
    "walker": "the clip",
    "walkers": "number of people",
    "people": "number of people in the model",
    "laboratory": "laboratory that recorded the clips",
    "laboratories": "mean number of laboratories of the people",
    "left_out": "left out of the model: the `person`, or the whole `laboratory`",
    "leave_out": "left out of the model: the `performance`, or the `person`",
    "clip": "name of the recording or synthetic clip",
    "clips": "number of clips",
    "action": "action in the clip",
    "performance": "name of the performance",
    "performances": "number of performances",
    "trial": "number of the trial",
    "frame": "frame of the mean performance",
    "sample": "number of the sample within the action",
    "instant": "one of five instants of a cycle",
    "time_s": "time since the start of the performance",
    "joint": "one of the fifteen, as on the page on conventions",
    "angle": "joint and side",
    "limb": "limb, named by the joint at its end",
    # Varied quantities.
    "method": "method of reconstruction: `least_squares`, `map`, …",
    "condition": "varied quantity",
    "change": "varied quantity",
    "varied": "varied quantity",
    "level": "size of the variation",
    "view_angle_deg": "0: from the front, −90: the left profile, 90: the right profile",
    "heading_deg": "heading of the walk in the image: 0 towards the camera",
    "camera": "motion of the camera: `still`, `moving` or another one",
    "noise_mm": "standard deviation of the noise of the image",
    "hidden": "joints that the image does not show",
    "occluded": "share of the joints that the image does not show",
    "sigma2_mm2": "σ² of the observation in approach II [zhang2007 3.12]",
    "penalty": "penalty of the path: `change` of disparity [mozerov2006 12], or `as_printed` [mozerov2006 16]",
    "smoothness": "μ of the penalty, relative to a frame's mean squared deviation",
    "particles": "number of particles",
    "missing_fraction": "requested share of missing points",
    "missing_share": "share of missing points",
    "pattern": "pattern of missing points: `random`, or a `block` of frames",
    "adjust": "adjustment of the radius if a ray misses the sphere: `per_frame`, `global`, `robust`, `refined`",
    "radius_scale": "assumed radius over the true one",
    "root_error_ratio": "root mean square error of the parent's trajectory, over the limb's length",
    # Walks.
    "component": "number of the eigenwalker, or of the dimension of the aSpace",
    "eigenvalue_mm2": "variance along the eigenwalker",
    "variance_fraction": "share of the variance",
    "cumulative_fraction": "share of the variance, of this component and all before it",
    "spanned_percent": "share of a left-out walker that eigenwalkers span",
    "absolute_error_mm2": "mean square error in the missing dimension [zhang2007 4.1]",
    "absolute_error_sd_mm2": "its standard deviation over walkers",
    "absolute_error_se_mm2": "its standard error over walkers",
    "absolute_error_mm2_sides_at_random": "the same with sides exchanged for half of the people",
    "rms_error_mm": "mean over walkers of the root of their absolute error",
    "percent_of_average_walker": "error, in per cent of that of the average walker at this view",
    "relative_error": "absolute error over each walker's missing variance [zhang2007 4.3]; "
    "of limbs, ‖X − X̂‖ / ‖X‖ in the world's coordinates",
    "relative_error_sd": "its standard deviation over walkers",
    "missing_variance_mm2": "variance of the missing dimension",
    "missing_variance_sd_mm2": "its standard deviation over walkers",
    "missing_variance_mm2_sides_at_random": "the same with sides exchanged for half of the people",
    "hidden_error_mm": "root mean square distance of hidden joints from their true positions",
    "original_x_mm": "position as recorded, to the walker's right",
    "original_y_mm": "the same, along the walk",
    "original_z_mm": "the same, upwards",
    "reconstructed_x_mm": "position as reconstructed, to the walker's right",
    "reconstructed_y_mm": "the same, along the walk",
    "reconstructed_z_mm": "the same, upwards",
    "estimated_mean_deg": "circular mean of the estimated view angles over walkers",
    "estimated_sd_deg": "circular standard deviation of the estimated view angles over walkers",
    "absolute_angle_error_median_deg": "median over walkers of the error of the view angle",
    "failures": "walkers with an error of the view angle above `sweep.failure_deg`",
    "rmse_deg": "root mean square error of the angle over the cycle, mean over walkers",
    "rmse_sd_deg": "its standard deviation over walkers",
    "offset_free_rmse_deg": "`rmse_deg` without each walker's constant offset",
    "offset_free_rmse_sd_deg": "its standard deviation over walkers",
    "bars": "`as computed` by the method, or `calibrated` on other people",
    "level_percent": "nominal coverage of the bars",
    "covered_percent": "share of the truth that the bars cover",
    "half_width_mm": "mean half width of the bars",
    "error_mm": "mean distance of joints from their true positions",
    "error_sd_mm": "standard deviation of `error_mm`, over performances or over frames",
    "error_median_mm": "median of `error_mm` over performances",
    **{
        f"{angle}_error_deg": f"root mean square error of {words}"
        for angle, words in {
            "knee": "the flexion of the knee",
            "hip": "the flexion of the hip",
            "shank": "the shank against the vertical",
            "elbow": "the flexion of the elbow",
            "shoulder": "the flexion of the shoulder",
            "trunk": "the trunk against the vertical",
        }.items()
    },
    # Actions.
    "stage": "alignment of the performances: `raw`, `linear`, `keyframe`, `synchronized`",
    "value": "coordinate along the dimension of the aSpace",
    "disparity": "shift of the performance at the sample, in samples",
    "cost": "squared distance at the sample and disparity [mozerov2006 14]",
    "on_path": "true on the optimal path",
    "error_frames": "mean error of the recovered time",
    "error_sd_frames": "standard deviation of `error_frames` over performances",
    "error_moving_frames": "mean error of the recovered time where the pattern moves",
    "error_moving_sd_frames": "standard deviation of `error_moving_frames` over performances",
    "draw": "number of the sampled posture; −1: the mean posture",
    "x_mm": "position, to the person's right",
    "y_mm": "position, forwards",
    "z_mm": "position, upwards",
    "aspace_error_mm": "smallest possible error of postures of the aSpace",
    "lost_fraction": "share of frames in which the filter had lost the person",
    # Limbs.
    "reconstructibility": "η of the limb, of the vectors that the programme uses [park2011 13]",
    "reconstructibility_angle": "the same for the angle at the parent, as printed",
    "mirror_margin": "cost of the mirror image over that of the choice: 1 where the data do not distinguish them",
    "confidence": "`green`, `amber` or `red`, by the margin of the mirror",
    "limb_error": "mean error of the end of a limb about its parent, over its length; "
    "of skeletons, of joints over the mean length of limbs",
    "limb_error_shuffled": "`limb_error` of other limbs, exchanged at random",
    "error_up_to_mirror": "`limb_error` of the choice or of its mirror, whichever is smaller",
    "limb_error_up_to_mirror": "`limb_error` with the better one of every limb and its mirror image",
    "relative_error_up_to_mirror": "`relative_error` with the better one of every limb and its mirror image",
    "child_error_ratio": "mean error of the limb's end in the world, over the limb's length",
    "parent_error_ratio": "mean error of its parent, over the limb's length",
    "hanging_error": "the error of a limb that hangs straight down, over its length",
    "adjusted_hanging_error": "the error of a limb that hangs, as long as the adjusted radius, over its true length",
    "hanging_error_mm": "mean distance of joints of a skeleton that hangs straight down",
    "hanging_imputed_error_mm": "mean distance of missing points in a skeleton that hangs straight down",
    "hanging_relative_error": "relative error of a skeleton that hangs straight down",
    "mean_pose_error": "the error of the limb's mean direction over the clip, over its length",
    "mean_pose_error_mm": "mean distance of joints of the clip's mean pose",
    "mean_pose_imputed_error_mm": "mean distance of missing points in the clip's mean pose",
    "mean_pose_relative_error": "relative error of the clip's mean pose",
    "basis_alone_error": "error of the trajectory basis without the limb's length, over its length",
    "joint_error_mm": "mean distance of joints from their true positions",
    "seen_error_mm": "mean distance of visible points from their true positions",
    "imputed_error_mm": "mean distance of missing points from their true positions",
    "imputed_share": "share of frames in which the joint was not visible",
    "adjusted_share": "frames whose ray misses the sphere of the assumed radius",
    "radius_ratio": "radius after the adjustment or refinement, over the true one",
    "reprojection_error_px": "root mean square distance in the image",
    "length_violation": "largest relative change of a limb's length, at frames and between them",
    "cartesian_length_violation": "largest relative change of a limb's length with coordinates in the trajectory basis",
    "taken_impostor": "true if most of the chosen candidates are the impostor's",
    "proved": "true if the solution was proved to be optimal",
    "objective": "value of the binary programme at its solution",
    "truth_objective": "value of the binary programme at the true candidates",
    "impostor_objective": "value of the binary programme at the impostor's candidates",
    "lower_bound": "proved lower bound of the binary programme",
    "positive_off_diagonal": "share of positive elements off the diagonal of the programme's matrix",
    "numerically_singular": "true if the smallest eigenvalue of the programme's matrix is under 10⁻⁸ of the largest",
}
"""Meaning of each column; other columns take theirs from the docstrings of their study."""


# --- the library ------------------------------------------------------------------------------------------


LIBRARY = {
    "pipeline": [
        "read",
        "joints",
        "represent",
        "fit",
        "from_view",
        "to_dataframe",
        "to_xarray",
    ],
    "walk3d": ["reconstruct", "from_view", "calibrate", "walkers", "write"],
    "walk3d.api": ["Reconstruction"],
    "pipeline.core.fourier": ["FourierRepresentation", "represent", "synthesise"],
    "pipeline.core.linear_model": ["LinearModel", "fit", "leave_one_out"],
    "pipeline.core.reconstruction": ["least_squares", "maximum_a_posteriori", "from_known_views"],
    "pipeline.core.viewpoint": ["estimate"],
    "pipeline.core.camera": ["project", "combine"],
    "pipeline.core.synchronization": ["synchronize", "synchronize_all", "distances", "median_sequence"],
    "pipeline.core.trajectory_basis": ["cosine_basis", "TrajectoryBasis"],
    "pipeline.core.articulation": ["ray_sphere"],
    "pipeline.core.binary_quadratic": ["minimise"],
    "pipeline.core.refinement": ["refine"],
    "pipeline.core.reconstructibility": ["reconstructibility"],
    "pipeline.core.pinhole": ["Pinhole"],
    "pipeline.core.limb_chain": ["Chain"],
    "pipeline.core.articulated_trajectory": ["reconstruct", "Options"],
    "walk3d.film.walk": ["reconstruct"],
    "pipeline.formats": ["read"],
    "walk3d.pointlight": ["walker", "scrambled", "inverted", "with_noise"],
    "walk3d.film.simulation.keypoints": ["simulate_keypoints"],
}
"""Stable functions and classes, by module."""


def library() -> str:
    """Return the reference of the library, from the docstrings."""
    parts = []
    for module, names in LIBRARY.items():
        loaded = __import__(module, fromlist=["_"])
        public = re.sub(r"^pipeline\b", "gait_pipeline", module)  # as programs import it
        parts.append(f"## {public}\n\n{_first_sentence(loaded)}\n")
        for name in names:
            thing = getattr(loaded, name)
            target = thing
            # Names lose their modules and types their quotes; choices and numbers stay as written.
            signature = re.sub(
                r"\bself, |\b[a-zA-Z_][\w.]*\.(?=[a-zA-Z_])", "", str(inspect.signature(target))
            )
            signature = re.sub(r"<\w+: ('\w+')>", r"\1", signature)
            signature = re.sub(r"(: |-> )'(.*?)'", r"\1\2", signature)
            parts.append(f"### {public}.{name}\n\n```text\n{name}{signature}\n```\n")
            parts.append(_as_markdown(inspect.cleandoc(target.__doc__ or "")))
    return "\n".join(parts)


def _as_markdown(docstring: str) -> str:
    """Return a numpydoc docstring as Markdown: sections as lists, examples as code."""
    lines: list[str] = []
    section = ""
    source = docstring.splitlines()
    for number, line in enumerate(source):
        if number + 1 < len(source) and re.fullmatch(r"-{3,}", source[number + 1]):
            section = line
            lines += ["", f"**{line}**", ""]
            lines += ["```text"] if line == "Examples" else []
        elif re.fullmatch(r"-{3,}", line):
            continue
        elif section in ("Parameters", "Attributes", "Returns", "Raises") and line:
            indented = line[0].isspace()
            lines.append(f"    {_escaped(line.strip())}" if indented else f"- `{line}`  ")
        else:
            lines.append(line if section == "Examples" else _escaped(line))
    if section == "Examples":
        lines.append("```")
    return "\n".join(lines) + "\n"


def _escaped(text: str) -> str:
    """Return prose of a docstring with double backticks as code, and tags that are not links."""
    text = re.sub(r"``(.+?)``", r"`\1`", text)
    return re.sub(r"\[(\w+ [\w.]+)\]", r"(\1)", text).replace("<", "&lt;").replace("*", "\\*")


# --- the drawing of the imports ---------------------------------------------------------------------------


def _drawn(parts: Sequence[str]) -> str:
    """Return the box of a module: ``core`` for pipeline.core.camera, ``walk3d.film`` for walk3d.film.video."""
    return ".".join(parts[:2]) if parts[0] == "walk3d" else parts[1]


@cache
def imports() -> dict[str, set[str]]:
    """Return the imports of each package or module of both packages, read from the sources."""
    imports_of: dict[str, set[str]] = {}
    for path in [*PACKAGE.rglob("*.py"), *OURS.rglob("*.py")]:
        first = _drawn(path.relative_to(ROOT).with_suffix("").parts)
        if first.rpartition(".")[2] in ("__init__", "__main__"):
            continue
        mine = imports_of.setdefault(first, set())
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in (
                "pipeline",
                "walk3d",
            ):
                names = [(node.module or "").split(".")]
                if len(names[0]) == 1:
                    names = [[*names[0], alias.name] for alias in node.names]
                mine.update(_drawn(parts) for parts in names)
    return {
        name: {other for other in others if other in imports_of} - {name}
        for name, others in imports_of.items()
    }


GROUND = {
    "validation",
    "locks",
    "shortened",
    "palette",
    "tidy",
    "resources",
    "processes",
    "compilation",
    "seeding",
}
"""Small modules that every package may use, drawn as one box."""


def levels() -> list[list[str]]:
    """Return the packages from the base upwards, each on the lowest level above its imports."""
    graph = {name: others - GROUND for name, others in imports().items() if name not in GROUND}
    height: dict[str, int] = {}

    def of(name: str) -> int:
        if name not in height:
            height[name] = 1 + max((of(other) for other in graph[name]), default=-1)
        return height[name]

    for name in graph:
        of(name)
    return [sorted(n for n in graph if height[n] == k) for k in range(max(height.values()) + 1)]


def drawing() -> str:
    """Return an SVG of the imports: arrows point from a package to those that it imports."""
    rows = levels()
    width, high, step = 120, 30, 74
    across = max(map(len, rows)) * (width + 22) + 20
    height = len(rows) * step + 70
    centre: dict[str, tuple[float, float]] = {}
    for k, names in enumerate(rows):
        for n, name in enumerate(names):
            centre[name] = (across * (n + 0.5) / len(names), height - 70 - k * step - 10)
    graph = imports()
    parts = []
    for name, (x, y) in centre.items():
        for other in sorted(graph[name] & centre.keys()):
            if any(other in graph[between] for between in graph[name] & centre.keys() if between != other):
                continue  # drawn by way of what stands between
            u, v = centre[other]
            parts.append(
                f'<path d="M{x:.0f},{y + high / 2:.0f} L{u:.0f},{v - high / 2 - 4:.0f}" class="to"/>'
            )
    for name, (x, y) in centre.items():
        parts.append(
            f'<rect x="{x - width / 2:.0f}" y="{y - high / 2:.0f}" width="{width}" height="{high}" rx="5"/>'
            f'<text x="{x:.0f}" y="{y + 4:.0f}">{name}</text>'
        )
    ground = ", ".join(sorted(GROUND))
    parts.append(f'<rect x="10" y="{height - 40}" width="{across - 20}" height="{high}" rx="5"/>')
    parts.append(f'<text x="{across / 2:.0f}" y="{height - 21}">{ground}</text>')
    style = (
        "rect{fill:#f3f6f9;stroke:#456}text{font:13px sans-serif;text-anchor:middle;fill:#123}"
        ".to{stroke:#89a;fill:none;marker-end:url(#tip)}"
    )
    tip = (
        '<marker id="tip" markerWidth="7" markerHeight="6" refX="6" refY="3" orient="auto">'
        '<path d="M0,0 L7,3 L0,6z" fill="#89a"/></marker>'
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {across} {height}" role="img" '
        f'aria-label="Packages and their imports"><defs><style>{style}</style>{tip}</defs>{"".join(parts)}</svg>\n'
    )


@cache
def _sources() -> dict[str, Path]:
    """Return the files of both packages, by module name."""
    return {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for folder in (PACKAGE, OURS)
        for path in folder.rglob("*.py")
    }


@cache
def _imported(module: str) -> frozenset[str]:
    """Return the modules that a module imports at run time, anywhere in it; imports for types alone do not count."""

    class WhenRun(ast.NodeTransformer):
        def visit_If(self, node: ast.If) -> Any:
            self.generic_visit(node)
            return node.orelse if "TYPE_CHECKING" in ast.unparse(node.test) else node

    modules = set()
    for node in ast.walk(WhenRun().visit(ast.parse(_sources()[module].read_text(encoding="utf-8")))):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        for name in names:
            while name and name not in _sources():
                name = name.rpartition(".")[0]
            modules.add(name)
    return frozenset(modules - {""})


def reached(module: str) -> set[str]:
    """Return a module and all modules that it imports, directly or through others."""
    modules: set[str] = set()
    waiting = {module}
    while waiting:
        modules |= waiting
        waiting = {other for module_name in waiting for other in _imported(module_name)} - modules
    return modules


def closures() -> str:
    """Return a table of the figures: module, and number of files of both packages that it imports."""
    rows = []
    for name, experiment in _experiments().items():
        module = type(experiment.figure).__module__
        rows.append((name, f"`{module}`", str(len(reached(module)))))
    return _table(["figure", "module", "files"], rows)


def packages() -> str:
    """Return a table of the packages with the first sentence of each, from the base upwards."""
    rows = []
    for name in [*sorted(GROUND), *(name for level in levels() for name in level)]:
        source = ROOT.joinpath(*name.split(".")) if name.startswith("walk3d") else PACKAGE / name
        path = source / "__init__.py" if source.is_dir() else source.with_suffix(".py")
        docstring = (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n\n")[0]
        rows.append((name, re.sub(r"\s+", " ", docstring)))
    return _table(["package", "is"], rows)


def _plotted(width: float, height: float) -> tuple[Any, Any, Callable[[], str]]:
    """Return a figure, its axes without a frame and to scale, and the function that returns it as SVG."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), aspect="equal", frame_on=False, xticks=(), yticks=())

    def finished() -> str:
        buffer = StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None})
        return "".join(
            line.strip() + " " for line in buffer.getvalue()[buffer.getvalue().index("<svg") :].splitlines()
        )

    return figure, axes, finished


def joints() -> str:
    """Return an SVG of the fifteen joints [zhang2007 figure 1]: a synthetic walker, seen obliquely."""
    import numpy as np

    from pipeline.skeleton import WALKER15
    from pipeline.synthetic.walkers import walking_population

    posture = walking_population(np.random.default_rng(1), male=1, female=1, duration_s=3.0).positions_mm[0][
        0
    ]
    _, axes, finished = _plotted(4.6, 5.2)
    x, z = posture @ np.array([0.8, 0.6, 0.0]), posture[:, 2]
    for bone in WALKER15.bones:
        axes.plot(x[list(bone)], z[list(bone)], color="#456", zorder=1)
    axes.scatter(x, z, color="#d55e00", s=24, zorder=2)
    for name, u, v in zip(WALKER15.joints, x, z, strict=True):
        side = np.sign(np.round(u - x[WALKER15.index("pelvis")], -1)) * (name not in ("pelvis", "sternum"))
        offset, align = (8 * side, 2 if side else 8), {-1: "right", 0: "center", 1: "left"}[int(side)]
        axes.annotate(
            name.replace("_", " "), (u, v), offset, textcoords="offset points", ha=align, fontsize=9
        )
    axes.margins(x=0.5, y=0.04)
    return finished()


def two_points() -> str:
    """Return an SVG of the two ends of a limb on one ray [park2011 figure 2a], computed by `ray_sphere`."""
    import numpy as np
    from matplotlib.patches import Circle

    from pipeline.core.articulation import ray_sphere

    camera = np.array(
        [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]
    )  # at the origin, along z
    parent, radius = np.array([[0.6, 0.0, 6.0]]), 1.5
    hits = ray_sphere(camera, np.array([[0.02, 0.0]]), parent, radius)
    _, axes, finished = _plotted(6.0, 2.4)
    (px, pz), ends = parent[0, [0, 2]], [(parent + end)[0, [0, 2]] for end in (hits.near, hits.far)]
    axes.add_patch(Circle((pz, px), radius, fill=False, color="#89a"))
    axes.plot([0.0, 8.5], [0.0, 0.02 * 8.5], color="#456", linewidth=0.8)
    for (x, z), name, style in zip(ends, ("first end", "second end"), ("-", "--"), strict=True):
        axes.plot([pz, z], [px, x], color="#d55e00", linestyle=style, marker="o")
        axes.annotate(name, (z, x), (-6, -14), textcoords="offset points", ha="right", fontsize=9)
    axes.annotate("parent joint", (pz, px), (0, 7), textcoords="offset points", ha="center", fontsize=9)
    axes.annotate("camera", (0.0, 0.0), (0, 7), textcoords="offset points", fontsize=9)
    axes.plot([0.0], [0.0], marker="s", color="#456")
    axes.margins(0.06)
    return finished()


# --- notebooks --------------------------------------------------------------------------------------------


def notebooks() -> str:
    """Return the notebooks with the output of each cell, run in a temporary folder."""
    parts = []
    before = Path.cwd()
    os.environ["PYTHONPATH"] = str(ROOT)  # for the commands that they start
    for script in sorted((ROOT / "notebooks").glob("*.py")):
        names: dict[str, Any] = {"__name__": "__main__"}
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                for kind, _, cell in (each.partition("\n") for each in script.read_text().split("# %%")[1:]):
                    if "markdown" in kind:
                        parts.append(re.sub(r"^# ?", "", cell.strip(), flags=re.MULTILINE))
                        parts[-1] = re.sub(r"^# ", "## ", parts[-1])
                        continue
                    output = StringIO()
                    with redirect_stdout(output):
                        exec(compile(cell, script.name, "exec"), names)
                    parts.append(f"```python\n{cell.strip()}\n```")
                    if output.getvalue().strip():
                        parts.append(f"```\n{output.getvalue().strip()}\n```")
            finally:
                os.chdir(before)
    return "\n\n".join(parts).replace("](../docs/", "](")


MADE = {
    "notebooks": notebooks,
    "options": options, "columns": columns, "library": library, "drawing": drawing, "packages": packages,
    "joints": joints, "two_points": two_points, "closures": closures,
}  # fmt: skip
"""Functions of the generated parts, by the name in the page."""
