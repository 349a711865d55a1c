"""Line and column of every key and value in a TOML file."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

Place = tuple[int, int]
Path = tuple[str | int, ...]


class TomlPositions:
    """Where the keys and values of a TOML text stand; lines and columns count from 1."""

    def __init__(self, text: str) -> None:
        self._keys: dict[Path, Place] = {}
        self._values: dict[Path, Place] = {}
        self._counts: dict[Path, int] = {}
        tree = _parser().parse(text.encode("utf-8"))
        self._lines = text.encode("utf-8").split(b"\n")
        self._document(tree.root_node)

    def value(self, path: Path) -> Place | None:
        """Place of a value, or of the nearest table around it that stands in the file."""
        return self._nearest(path, self._values)

    def key(self, path: Path) -> Place | None:
        """Place of a key, or of the nearest table around it that stands in the file."""
        return self._nearest(path, self._keys)

    def has(self, path: Path) -> bool:
        """Tell whether a key stands in the file."""
        return path in self._keys

    def _nearest(self, path: Path, places: dict[Path, Place]) -> Place | None:
        for length in range(len(path), 0, -1):
            part = path[:length]
            place = places.get(part) or self._keys.get(part) or self._keys.get((*part, 0))
            if place is not None:
                return place
        return None

    def _document(self, root: Any) -> None:
        for child in root.children:
            if child.type == "pair":
                self._pair(child, ())
            elif child.type in ("table", "table_array_element"):
                self._table(child)

    def _table(self, node: Any) -> None:
        header = next(child for child in node.children if child.is_named)
        path = self._header_path(_key_parts(header), node.type == "table_array_element")
        self._keys.setdefault(path, self._place(header))
        for child in node.children:
            if child.type == "pair":
                self._pair(child, path)

    def _header_path(self, parts: list[str], opens_element: bool) -> Path:
        path: Path = ()
        for depth, part in enumerate(parts):
            path = (*path, part)
            if opens_element and depth == len(parts) - 1:
                self._counts[path] = self._counts.get(path, -1) + 1
                return (*path, self._counts[path])
            if path in self._counts:
                path = (*path, self._counts[path])
        return path

    def _pair(self, node: Any, table: Path) -> None:
        key, value = (child for child in node.children if child.is_named and child.type != "comment")
        path: Path = (*table, *_key_parts(key))
        self._keys[path] = self._place(key)
        self._value(value, path)

    def _value(self, node: Any, path: Path) -> None:
        self._values[path] = self._place(node)
        if node.type == "inline_table":
            for child in node.children:
                if child.type == "pair":
                    self._pair(child, path)
        elif node.type == "array":
            elements = [child for child in node.children if child.is_named and child.type != "comment"]
            for index, element in enumerate(elements):
                self._value(element, (*path, index))

    def _place(self, node: Any) -> Place:
        row, byte = node.start_point
        return row + 1, len(self._lines[row][:byte].decode("utf-8", "replace")) + 1


def _key_parts(node: Any) -> list[str]:
    if node.type == "dotted_key":
        return [part for child in node.children if child.is_named for part in _key_parts(child)]
    text: str = node.text.decode("utf-8")
    return [text[1:-1] if node.type == "quoted_key" else text]


@lru_cache(maxsize=1)
def _parser() -> Any:
    import tree_sitter_toml
    from tree_sitter import Language, Parser

    return Parser(Language(tree_sitter_toml.language()))
