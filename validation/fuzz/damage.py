"""Damage of files: bytes, the tree of a TOML file, cells of a CSV file, datasets of HDF5."""

from __future__ import annotations

import copy
import io
import random
from typing import Any

import h5py
import numpy as np

__all__ = ["damaged_bytes", "damaged_cells", "damaged_datasets", "damaged_tree", "toml_text"]

NUMBERS: list[Any] = [
    0, -1, 1, 2, 3, 7, 64, 1000, 10**6, 10**9, 10**18, 2**63, 10**30, -(10**9), 0.0, -0.0, 1e-300, 5e-324, 1e-12, 1e-3, 0.5,
    1.0, 1e3, 1e12, 1e300, 1.7e308, -1.0, -1e300, float("inf"), float("-inf"), float("nan"),
]  # fmt: skip
TEXTS: list[Any] = [
    "", " ", "none", "ground", "80 deg", "1e400 mm", "-3 N", "5 furlong", "mm", "1e3", "nan mm", "inf", "0x10", "1_000",
    "é" * 50, "../../../etc/passwd", "/dev/zero", "/dev/null", "case.toml", "\x00", "a" * 10_000, "%s%n", "{0}", "panel 1",
    "strip.length",
]  # fmt: skip
LINKS = [h5py.SoftLink("/nowhere"), h5py.SoftLink("/"), h5py.ExternalLink("/etc/passwd", "/")]
OTHERS: list[Any] = [True, False, [], [1, 2], [[1, 2], [3]], {}, {"a": 1}, [0.0] * 3, [{"a": 1}], list(range(200))]


def _value(chance: random.Random) -> Any:
    return copy.deepcopy(chance.choice(chance.choice([NUMBERS, NUMBERS, TEXTS, OTHERS])))


def damaged_bytes(data: bytes, chance: random.Random) -> bytes:
    """Bits are flipped; pieces are omitted, duplicated or moved; or the end is cut off."""
    out = bytearray(data)
    for _ in range(chance.choice([1, 1, 2, 5, 50])):
        if not out:
            break
        at, size = chance.randrange(len(out)), chance.choice([1, 1, 4, 16, 200])
        kind = chance.randrange(6)
        if kind == 0:
            out[at] ^= 1 << chance.randrange(8)
        elif kind == 1:
            out[at : at + size] = bytes(chance.choice([0, 255, chance.randrange(256)]) for _ in range(size))
        elif kind == 2:
            del out[at : at + size]
        elif kind == 3:
            out[at:at] = out[at : at + size]
        elif kind == 4:
            piece = out[at : at + size]
            to = chance.randrange(len(out))
            out[to : to + len(piece)] = piece
        elif chance.random() < 0.2:
            del out[at:]
    return bytes(out)


def damaged_tree(tree: dict[str, Any], other: dict[str, Any], chance: random.Random) -> dict[str, Any]:
    """A TOML table with replaced values, and with keys renamed, omitted, or taken from another file."""
    tree = copy.deepcopy(tree)
    for _ in range(chance.choice([1, 1, 1, 2, 4])):
        places = list(_places(tree))
        if not places:
            return tree
        holder, key = chance.choice(places)
        kind = chance.randrange(8)
        if kind < 4:
            holder[key] = _value(chance)
        elif kind == 4:
            del holder[key]
        elif kind == 5 and isinstance(holder, dict):
            holder[chance.choice([key[:-1], key + "s", key.upper(), "", "x.y"])] = holder.pop(key)
        elif kind == 6:
            source, name = chance.choice(list(_places(other)))
            holder[key] = copy.deepcopy(source[name])
        elif isinstance(holder, list):
            holder.append(copy.deepcopy(holder[key]))
        else:
            holder[key] = [copy.deepcopy(holder[key])] * chance.choice([1, 2, 5])
    return tree


def _places(tree: Any) -> Any:
    """Every (holder, key) of a tree."""
    for key in list(tree) if isinstance(tree, dict) else range(len(tree)):
        yield tree, key
        if isinstance(tree[key], dict | list):
            yield from _places(tree[key])


def toml_text(value: Any, depth: int = 0) -> str:
    """A tree as TOML text: tables of the first level are sections, and all deeper tables are inline tables."""
    if depth == 0:
        return "".join(f"{_key(key)} = {toml_text(one, 1)}\n" for key, one in value.items())
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {toml_text(one, 1)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(toml_text(one, 1) for one in value) + "]"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, int):
        return str(value)
    return _key(str(value))


def _key(text: str) -> str:
    escaped = "".join(c if c.isprintable() and c not in '"\\' else f"\\u{ord(c):04x}" for c in text)
    return f'"{escaped}"'


def damaged_cells(text: str, chance: random.Random) -> str:
    """A CSV file with replaced cells, with rows and columns omitted, duplicated or swapped, and with other separators."""
    rows = [line.split(",") for line in text.splitlines()]
    for _ in range(chance.choice([1, 1, 2, 5])):
        if not rows:
            break
        row = chance.choice(rows)
        kind = chance.randrange(9)
        if kind < 4 and row:
            row[chance.randrange(len(row))] = str(_value(chance))
        elif kind == 4:
            del rows[chance.randrange(len(rows))]
        elif kind == 5:
            rows.insert(chance.randrange(len(rows) + 1), list(row))
        elif kind == 6:
            gone = chance.randrange(max(len(row), 1))
            rows = [cells[:gone] + cells[gone + 1 :] for cells in rows]
        elif kind == 7:
            chance.shuffle(rows)
        else:
            row.append(str(_value(chance)))
    joint = chance.choice([",", ",", ",", ";", "\t", ", "])
    return chance.choice(["\n", "\n", "\r\n", "\r"]).join(joint.join(row) for row in rows)


_READ = 1_000_000
"""Numbers of a dataset that are read to have one changed: one that was made huge before stays as it is."""


def damaged_datasets(data: bytes, chance: random.Random) -> bytes:
    """A valid HDF5 file whose datasets and attributes are replaced, renamed, omitted or of another shape."""
    memory = io.BytesIO(data)
    with h5py.File(memory, "r+") as file:
        names: list[str] = []
        file.visit(names.append)
        for _ in range(chance.choice([1, 1, 2, 4])):
            name = chance.choice(names)
            thing = file.get(name)
            if thing is None:
                continue
            kind = chance.randrange(6)
            if kind == 0:
                del file[name]
            elif kind == 1 and len(thing.attrs):
                attribute = chance.choice(list(thing.attrs))
                thing.attrs[attribute] = chance.choice(["", "x" * 100, -1, 10**12, np.nan, np.arange(5.0)])
            elif kind == 2 and len(file.attrs):
                file.attrs[chance.choice(list(file.attrs))] = chance.choice(["", "fsm result", -1, 999, np.arange(3)])
            elif kind == 3:
                shape = chance.choice([(), (0,), (1,), (3, 3), (2, 2, 2), (10**9,)])
                del file[name]
                file.create_dataset(name, shape, chance.choice([np.float64, np.int8, np.complex128]))
            elif kind == 4:
                del file[name]
                file[name] = chance.choice(LINKS)
            elif isinstance(thing, h5py.Dataset) and 0 < thing.size < _READ and thing.dtype.kind == "f":
                flat = thing[()].ravel()
                flat[chance.randrange(len(flat))] = chance.choice([np.nan, np.inf, 1e300, -1.0])
                thing[()] = flat.reshape(thing.shape)
    return memory.getvalue()
