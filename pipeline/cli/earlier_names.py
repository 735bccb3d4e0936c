"""Names of presets, options and columns in earlier versions, each with its current name or the reason for its removal.

Each folder of options may have a table ``earlier_names.yaml``; the tables of plug-ins extend that of ``conf``.
Archives of earlier versions are read with these tables.  If a user types an old name, the error states the new one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import Any

from pipeline import plugins
from pipeline.cli.presets import presets
from pipeline.papers import read_mapping
from pipeline.storage.tables import Table
from pipeline.validation import InvalidInput, require_choice

TABLE = "earlier_names.yaml"
"""Name of the file that lists earlier names in a folder of options."""

TEXT = "str"
"""Entry that marks a former class of choices whose values are now plain text."""


@dataclass(frozen=True)
class Change:
    """Change of a name between an earlier version and this version.

    Attributes
    ----------
    now : str
        Today's name; empty if the name was removed.
    moved : str
        Full key of the option that replaces it and that archives also have, such as ``sweep.partners``.
    gone, added, text : str
        Reason why an option or column was removed, archives lack a column, or a column of sentences is not compared.
    was : list
        Values of a removed option for which this version computes the same results; empty for all values.
    """

    now: str = ""
    moved: str = ""
    gone: str = ""
    added: str = ""
    text: str = ""
    was: list[Any] = field(default_factory=list)


@dataclass(frozen=True)
class EarlierNames:
    """Names that changed since earlier versions: each earlier name with its change.

    Attributes
    ----------
    files : dict
        Changes of presets and option files: ``experiment/zhang2007_fig5``, ``sweep/known_view``.
    classes : dict
        Changes of option classes.
    options : dict
        Changes of options and members of choices, with their present class: ``Scale.trials``, ``Heading.steps``.
    columns : dict
        Changes of columns in published tables: ``zhang2007_fig5/table.csv/method``; in all figures:
        ``table.csv/method``.
    """

    files: dict[str, Change] = field(default_factory=dict)
    classes: dict[str, Change] = field(default_factory=dict)
    options: dict[str, Change] = field(default_factory=dict)
    columns: dict[str, Change] = field(default_factory=dict)

    def option(self, kind: type[Any], name: str) -> Change | None:
        """Return the change of an option's name in a class or its base classes; None if the name did not change."""
        changes = (self.options.get(f"{base.__name__}.{name}") for base in kind.__mro__)
        return next((change for change in changes if change), None)

    def rejection(self, group: str, name: str) -> InvalidInput | None:
        """Return the error for an option file that was renamed or removed; None for any other file."""
        return _rejection(self.files.get(f"{group}/{name}"), group, name)

    def option_rejection(self, kind: type[Any], key: str) -> InvalidInput | None:
        """Return the error for the full key of an option that was renamed or removed; None for any other key."""
        above, dot, name = key.rpartition(".")
        return _rejection(self.option(kind, name), key, name, above + dot)

    def todays_preset(self, name: str) -> Change:
        """Return the change of a preset's name: the current name, or the reason why the preset was removed."""
        change = self.files.get(f"experiment/{name}", Change(now=name))
        return replace(change, now=change.now.rpartition("/")[2])

    def todays_class(self, name: str) -> str:
        """Return the current name of an option class."""
        return change.now if (change := self.classes.get(name)) else name

    def todays_choice(self, kind: type[Any], name: str) -> str:
        """Return the current name of a member of an enumeration."""
        return change.now if (change := self.option(kind, name)) else name

    def todays_options(self, kind: type[Any], values: Mapping[str, Any]) -> dict[str, Any]:
        """Return the option values of a class under their current names, without options that no longer exist.

        Raises
        ------
        InvalidInput
            If a removed option has a value that this version cannot compute.
        """
        options = {}
        for name, value in values.items():
            change = self.option(kind, name) or Change(now=name)
            if change.now:
                options[change.now] = value
            elif change.moved:
                continue
            elif change.was and value not in change.was:
                expected = " or ".join(map(str, change.was))
                raise InvalidInput(
                    f"the option no longer exists: {change.gone}",
                    f"{kind.__name__}.{name}",
                    expected,
                    value,
                    code="gone",
                )
        return options

    def alike(self, figure: str, table: str, kept: Table, made: Table) -> tuple[Table, Table]:
        """Return an archived and a new table with current column names, restricted to columns that can be compared.

        Columns that were removed, that were added since, or that contain sentences are left out.
        """
        changes = {
            key.rpartition("/")[2]: change
            for key, change in self.columns.items()
            if key.rpartition("/")[0] in (table, f"{figure}/{table}")
        }
        dropped = {name for name, change in changes.items() if change.text}
        before = dropped | {name for name, change in changes.items() if change.gone}
        now = dropped | {name for name, change in changes.items() if change.added and name not in kept}
        today = {name: change.now for name, change in changes.items() if change.now}
        return (
            {today.get(name, name): values for name, values in kept.items() if name not in before},
            {name: values for name, values in made.items() if name not in now},
        )


def earlier_names() -> EarlierNames:
    """Return all changes of names, read from ``earlier_names.yaml`` in each folder of options.

    Raises
    ------
    InvalidInput
        If a table is malformed.
    """
    return _earlier_names(plugins.edition())


@cache
def _earlier_names(_: object) -> EarlierNames:
    names = EarlierNames()
    for path in (folder / TABLE for folder in plugins.conf_folders()):
        for section, entries in read_mapping(path).items() if path.is_file() else ():
            require_choice(f"{path}: section", section, [part.name for part in fields(EarlierNames)])
            if not isinstance(entries, dict):
                raise InvalidInput(
                    "the section of earlier names is not a mapping",
                    f"{path}: {section}",
                    code="not_a_mapping",
                )
            getattr(names, section).update(
                {str(name): _change(entry, f"{path}: {name}") for name, entry in entries.items()}
            )
    return names


def _change(entry: Any, where: str) -> Change:
    """Return the change of a name that an entry of ``earlier_names.yaml`` describes."""
    stated = {"now": entry} if isinstance(entry, str) else entry
    kinds = {part.name for part in fields(Change)} - {"was"}
    valid = (
        isinstance(stated, dict)
        and len(kinds & stated.keys()) == 1
        and not stated.keys() - kinds - ({"was"} if "gone" in stated else set())
        and all(isinstance(stated[name], str) and stated[name] for name in kinds & stated.keys())
        and isinstance(stated.get("was", []), list)
    )
    if not valid:
        expected = "a new name, {moved: full key}, {gone: reason}, {added: reason} or {text: reason}"
        raise InvalidInput(
            "the entry of an earlier name is malformed", where, expected, repr(entry), code="not_understood"
        )
    return Change(**stated)


def _rejection(change: Change | None, where: str, name: str, above: str = "") -> InvalidInput | None:
    """Return the error for an earlier name that a user typed; None if the name did not change."""
    if change is None:
        return None
    if new := change.moved or (change.now and above + change.now.rpartition("/")[2]):
        return InvalidInput(
            "this name has changed since an earlier version: use the new name",
            where,
            new,
            name,
            code="renamed",
            typed=True,
            now=new,
        )
    return InvalidInput(
        f"this name no longer exists: {change.gone}", where, received=name, code="gone", typed=True
    )


def require_preset(name: str) -> str:
    """Return the name of a preset after checking that the preset exists.

    Raises
    ------
    InvalidInput
        If there is no such preset.  For an old name the message states the new name or the reason for the removal.
    """
    names = presets()
    if name not in names and (error := earlier_names().rejection("experiment", name)):
        raise error
    return require_choice("experiment", name, names)
