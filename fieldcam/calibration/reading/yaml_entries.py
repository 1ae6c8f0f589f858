"""YAML, or JSON, as plain lists and mappings of strings, within bounds.

The parser's events are put together here, so that the number of parts and the depth are
known while they come: a bomb of aliases is seen before it is built, and nothing in a file
can run code or build odd objects.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import yaml

from fieldcam.foreign.bounds import DEEPEST_YAML, MAX_YAML_PARTS

LOADER = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
"""Ten times as fast where PyYAML was built with libyaml."""

Entry = str | list["Entry"] | dict[str, "Entry"]


class YamlRefused(Exception):
    """Its text goes on after the file's name, as in `is no YAML file`."""


def yaml_mappings(text: str) -> list[dict[str, Entry]]:
    """The documents of a stream that are mappings; at least one.

    What is damaged behind a whole document is left out: a printed stream that was stopped
    ends anywhere.
    """
    found: list[dict[str, Entry]] = []
    try:
        for document in _documents(text):
            if isinstance(document, dict):
                found.append(document)
            elif not found:
                raise YamlRefused("is no calibration file: it has no named entries")
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        if not found:
            raise YamlRefused("is no YAML file") from error
    if not found:
        raise YamlRefused("is no calibration file: it has no named entries")
    return found


@dataclass(slots=True)
class _Open:
    """A list or mapping whose end has not come yet."""

    entry: list[Entry] | dict[str, Entry]
    anchor: str | None
    parts: int = 1
    key: str | None = None


@dataclass(slots=True)
class _Builder:
    """Puts one document together."""

    stack: list[_Open] = field(default_factory=list)
    anchors: dict[str, tuple[Entry, int]] = field(default_factory=dict)
    """With the parts that each stands for."""
    done: Entry | None = None

    def open(self, entry: list[Entry] | dict[str, Entry], anchor: str | None) -> None:
        if len(self.stack) >= DEEPEST_YAML:
            raise YamlRefused("nests its entries too deep for a calibration")
        self.stack.append(_Open(entry, anchor))

    def close(self) -> None:
        ended = self.stack.pop()
        self.add(ended.entry, ended.parts, ended.anchor)

    def use(self, anchor: str | None) -> None:
        if anchor is None or anchor not in self.anchors:
            raise YamlRefused(f"repeats {anchor!r}, which it does not define before")
        self.add(*self.anchors[anchor], None)

    def add(self, entry: Entry, parts: int, anchor: str | None) -> None:
        if anchor is not None:
            self.anchors[anchor] = (entry, parts)
        if not self.stack:
            self.done = entry
            return
        holder = self.stack[-1]
        holder.parts += parts
        if holder.parts > MAX_YAML_PARTS:
            raise YamlRefused("has more entries than a calibration may")
        if isinstance(holder.entry, list):
            holder.entry.append(entry)
        elif holder.key is not None:
            holder.entry[holder.key] = entry
            holder.key = None
        elif isinstance(entry, str):
            holder.key = entry
        else:
            raise YamlRefused("has an entry without a plain name")


def _documents(text: str) -> Iterator[Entry]:
    builder = _Builder()
    for event in yaml.parse(text, Loader=LOADER):
        match event:
            case yaml.ScalarEvent():
                builder.add(event.value, 1, event.anchor)
            case yaml.AliasEvent():
                builder.use(event.anchor)
            case yaml.SequenceStartEvent():
                builder.open([], event.anchor)
            case yaml.MappingStartEvent():
                builder.open({}, event.anchor)
            case yaml.SequenceEndEvent() | yaml.MappingEndEvent():
                builder.close()
            case yaml.DocumentEndEvent():
                if builder.done is not None:
                    yield builder.done
                builder = _Builder()
