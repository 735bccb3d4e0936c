"""Composition of an experiment with Hydra: the only module that uses Hydra and OmegaConf.

The option classes are registered as schemas.  An unknown key, a wrong type, a wrong choice or a missing value is
therefore rejected, with its full key, before any computation.  An option class needs no YAML file.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import hydra
from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.core.plugins import Plugins
from hydra.errors import MissingConfigException, OverrideParseException
from hydra.plugins.search_path_plugin import SearchPathPlugin
from hydra.types import RunMode
from omegaconf import OmegaConf
from omegaconf.errors import (
    ConfigAttributeError,
    ConfigKeyError,
    InterpolationResolutionError,
    OmegaConfBaseException,
)

from pipeline import plugins
from pipeline.cli.earlier_names import earlier_names
from pipeline.cli.overrides import quoted
from pipeline.cli.presets import presets, split_named
from pipeline.ingestion.data import DATA_SETS
from pipeline.studies import registry
from pipeline.studies.experiment import Experiment, Scale
from pipeline.validation import InvalidInput, require_choice

_BY_SCALE = "by_scale"
"""Name of the OmegaConf resolver for options that have a separate value for each ``scale=``."""


class _PluginFolders(SearchPathPlugin):
    """Hydra plug-in that adds the option folders of this package's plug-ins to Hydra's search path."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Append the option folders of plug-ins to Hydra's search path."""
        for folder in plugins.conf_folders()[1:]:
            search_path.append("plug-in", f"file://{folder}")


def register() -> None:
    """Register the option classes with Hydra, only once for each set of plug-ins because registration is slow.

    A YAML file of an option extends the schema ``base_<name>``; an option without a YAML file is selected by its name.
    """
    _register(plugins.edition())


@cache
def _register(_: object) -> None:
    Plugins.instance().register(_PluginFolders)
    # Hydra copies the whole store before every composition, and each node again when it uses it: skip the first copy.
    ConfigStore.__deepcopy__ = lambda stored, _: stored  # type: ignore[attr-defined]
    store = ConfigStore.instance()
    store.store(name="experiment_schema", node=Experiment)
    store.store(group="scale", name="base_scale", node=Scale)
    for name, kind in DATA_SETS.items():
        store.store(group="data", name=f"base_{name}", node=kind)
    for group in registry.GROUPS:
        for name, option in registry.options(group).items():
            alone = name not in plugins.conf_files(group)
            store.store(group=group, name=name if alone else f"base_{name}", node=_schema(option))


def _schema(option: type[Any]) -> Any:
    """Return an option class as an OmegaConf structure, with interpolations for values that depend on ``scale=``."""
    schema = OmegaConf.structured(option)
    for field in fields(option):
        if sizes := field.metadata.get("scale"):
            assert field.default is MISSING, f"{field.name}: the scale sets it"
            values = {name: _interpolation(size) for name, size in sizes.items()}
            OmegaConf.update(schema, field.name, values.get("value", values))
    return schema


def _interpolation(size: str | float | Mapping[str, float]) -> str | float:
    """Return the value of an option that depends on ``scale=``: a number, or an OmegaConf interpolation."""
    if isinstance(size, Mapping):
        sizes = ",".join(f"{scale}:{value}" for scale, value in size.items())
        return f"${{{_BY_SCALE}:${{scale.name}},{{{sizes}}}}}"
    return f"${{scale.{size}}}" if isinstance(size, str) else size


def _by_scale(scale: str, sizes: Mapping[str, float]) -> float:
    """Return an option's value at a scale such as ``full``; raise InvalidInput if the option has no value there."""
    if scale not in sizes:
        raise InvalidInput(
            "must be set, because this option has no default at this scale",
            expected=f"scale={'|'.join(sizes)}",
            received=scale,
            code="no_size",
        )
    return sizes[scale]


OmegaConf.register_new_resolver(_BY_SCALE, _by_scale, replace=True)


def with_plugins(overrides: Sequence[str]) -> list[str]:
    """Load the plug-in files named in overrides; return the overrides with these files in one ``plugins=`` list."""
    files = plugins.named_files(overrides)
    plugins.load_files(files)
    others = [item for item in overrides if not item.startswith("plugins=")]
    quotes = ["'" + file.replace("\\", "\\\\").replace("'", "\\'") + "'" for file in files]
    return [*others, f"plugins=[{','.join(quotes)}]"] if files else others


def composed(overrides: Sequence[str]) -> Experiment:
    """Return the experiment that overrides define, before adaptation to this machine."""
    overrides = with_plugins(overrides)
    register()
    GlobalHydra.instance().clear()
    with hydra.initialize_config_dir(
        version_base="1.3", config_dir=str(plugins.conf_folders()[0]), job_name="pipeline"
    ):
        try:
            chosen = hydra.compose("config", overrides=quoted(overrides))
        except ValueError as error:
            if isinstance(error, OmegaConfBaseException | InvalidInput):
                raise
            where = _not_utf8() if isinstance(error, UnicodeDecodeError) else "conf"
            # A file in this folder is broken.
            raise InvalidInput(str(error), where, code="broken_options") from None
        return _typed(chosen, overrides)


def _not_utf8() -> str:
    """Return the first option file that is not valid UTF-8, with advice; ``conf`` if all files are valid."""
    for path in (path for folder in plugins.conf_folders() for path in sorted(folder.rglob("*.yaml"))):
        try:
            path.read_text("utf-8")
        except UnicodeDecodeError:
            return f"{path} (save it as UTF-8)"
    return "conf"


def _typed(composed: Any, overrides: Sequence[str]) -> Experiment:
    missing = OmegaConf.missing_keys(composed)
    if "name" in missing:
        raise InvalidInput(
            "no experiment is named",
            expected="experiment= with " + ", ".join(presets()),
            code="no_experiment",
        )
    if missing:
        raise InvalidInput("a required option has no value", ", ".join(sorted(missing)), code="missing_value")
    OmegaConf.resolve(composed)
    experiment: Experiment = OmegaConf.to_object(composed)  # type: ignore[assignment]
    _reject_additions(experiment, "")
    prior = getattr(experiment.model, "prior", "")
    names = [require_choice("model.prior", prior, plugins.priors())] if prior else []
    if not any(item.startswith("sweep.methods") for item in overrides):
        names += plugins.methods_of_files(experiment.plugins)
    if names:
        experiment.sweep = experiment.sweep.with_methods(names)
        if left_out := [name for name in names if name not in getattr(experiment.sweep, "methods", [])]:
            print(f"{experiment.name} cannot compare the methods {', '.join(left_out)}", file=sys.stderr)
    # The results of a copied preset with the original name would replace those of the original.
    files = [name.strip("[]' ") for name in split_named(overrides)[0]]
    if files and experiment.name not in files and not any(item.startswith("name=") for item in overrides):
        where = f"conf/experiment/{files[-1]}.yaml, name"
        raise InvalidInput(
            "must equal the name of the preset's file",
            where,
            files[-1],
            experiment.name,
            code="other_name",
            typed=False,
        )
    return experiment


def _reject_additions(options: Any, path: str) -> None:
    """Raise InvalidInput for an option that a user added with ``+key=value``, because no stage would read it."""
    if not is_dataclass(options):
        return
    names = [field.name for field in fields(options)]
    for name, value in vars(options).items():
        if name not in names:
            raise _unknown_option(type(options), path + name)
        _reject_additions(value, f"{path}{name}.")


def _unknown_option(kind: type[Any], key: str) -> InvalidInput:
    """Return the error for the full key of an option that its option class does not contain."""
    names = [field.name for field in fields(kind)]
    expected = "one of " + ", ".join(names) if names else "no option (this group is empty)"
    unknown = InvalidInput("this option does not exist", key, expected, code="unknown_option")
    return earlier_names().option_rejection(kind, key) or unknown


def in_words(error: Exception) -> Exception:
    """Return an error of Hydra or OmegaConf as an InvalidInput that states the full key of the option."""
    if isinstance(error, MissingConfigException) and error.missing_cfg_file:
        group, _, name = error.missing_cfg_file.partition("/")
        if rejection := earlier_names().rejection(group, name):
            return rejection
        if group == "hydra":  # the groups of Hydra are nested folders
            group, _, name = error.missing_cfg_file.rpartition("/")
        options = " or ".join(o for o in error.options or () if not o.startswith("base_"))
        if group == "hydra/launcher":
            options += "; joblib needs the extra `cluster`"
        return InvalidInput(
            "there is no choice of this name", group, options, name, code="unknown_option", typed=True
        )
    if isinstance(error, OverrideParseException):
        return InvalidInput(
            "this argument is not an override",
            expected="option=value",
            received=repr(error.override or error.message),
            code="not_an_override",
            typed=True,
        )
    cause = error if isinstance(error, OmegaConfBaseException) else error.__cause__
    if isinstance(
        cause, InterpolationResolutionError
    ):  # OmegaConf wraps the error of `_by_scale` several times
        inner: BaseException | None = cause
        while inner is not None and not isinstance(inner, InvalidInput):
            inner = inner.__context__
        if inner is not None:
            return InvalidInput(
                inner.what, cause.full_key, inner.expected, inner.received, code=inner.code, typed=True
            )
    if isinstance(cause, OmegaConfBaseException) and cause.full_key:
        if isinstance(cause, ConfigAttributeError | ConfigKeyError) and is_dataclass(cause.object_type):
            return _unknown_option(cause.object_type, cause.full_key)
        return InvalidInput(str(cause).splitlines()[0], cause.full_key, code="invalid_value")
    lines = str(error).splitlines()
    first = " ".join(lines[: 2 if lines[0].endswith(":") else 1])
    if first.startswith("Ambiguous"):
        several = "one value; for several values put -m in front (multirun)"
        return InvalidInput(first, expected=several, code="several_values")
    return InvalidInput(first, code="not_composed")


def run_hydra(
    arguments: Sequence[str],
    make: Callable[[Experiment, Sequence[str], Path | None], str],
    prepared: Callable[[Experiment], Experiment],
) -> int:
    """Run one experiment, or several variants (multirun), with Hydra's command line; return the exit status.

    Parameters
    ----------
    arguments : sequence of str
        Hydra's flags and overrides.
    make : callable
        Function that makes a figure from an experiment, its overrides and, for a variant of a multirun, its folder.  It
        returns the error message, empty on success.
    prepared : callable
        Function that adapts a composed experiment to this machine.
    """
    arguments = with_plugins(arguments)
    register()
    status = 0

    @hydra.main(version_base="1.3", config_path=str(plugins.conf_folders()[0]), config_name="config")
    def one(composed: Any) -> None:
        nonlocal status
        settings = HydraConfig.get()
        variant = settings.mode == RunMode.MULTIRUN
        try:
            plugins.load_files(composed.plugins)  # not yet loaded in a process of a launcher
            experiment = prepared(_typed(composed, settings.overrides.task))
        except InvalidInput as error:
            if variant:
                raise
            status = 1
            print(error, file=sys.stderr)
            return
        folder = Path(settings.runtime.output_dir) / experiment.name if variant else None
        if variant and settings.runtime.choices["hydra/launcher"] != "basic":
            # Variants run in parallel, each on the cores that its launcher has requested.
            experiment.workers = min(experiment.workers, settings.launcher.get("cpus_per_task") or 1)
        failure = make(experiment, settings.overrides.task, folder)
        if failure and variant:
            # The other variants are still made; the launcher passes this error to the caller.
            raise InvalidInput(failure, settings.job.override_dirname, code="refused")
        status = 1 if failure else 0

    os.environ["HYDRA_FULL_ERROR"] = "1"  # errors reach the caller
    # Hydra requires all overrides in one block; flags and their values go before or after it.
    sys.argv[1:] = sorted(
        quoted(arguments), key=lambda item: item[0] != "-" and ("=" in item or item[0] == "~")
    )
    one()
    return status
