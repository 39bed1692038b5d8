"""Which files a bag consists of, and their formats, by their first bytes."""

import os
import re
from contextlib import suppress
from itertools import islice
from pathlib import Path

import yaml
import zstandard
from mcap.writer import MCAP0_MAGIC

from climber_uk.bags.connection import Lose, StorageFile, listed
from climber_uk.bags.mcap_file import McapFile
from climber_uk.bags.sqlite_database import MAGIC as SQLITE_MAGIC
from climber_uk.bags.sqlite_file import SqliteFile
from climber_uk.bags.unpacking import PIECE, ZSTD_MAGIC, Allowance, zstandard_reader
from climber_uk.parameters.parameter_file import load

METADATA = "metadata.yaml"
LARGEST_METADATA = 2**24  # [bytes]
LIST = re.compile(
    r"^[ \t]*relative_file_paths:[ \t]*(\[(?P<row>[^\[\]]*)\]|(?P<lines>(\r?\n[ \t]*-[^\n]*)+))",
    re.MULTILINE,
)
MOST_FILES = 10_000  # of a directory that are looked at
MCAP, SQLITE, ZSTD = "MCAP", "SQLite", "zstd"
MAGICS = {MCAP0_MAGIC: MCAP, SQLITE_MAGIC: SQLITE, ZSTD_MAGIC: ZSTD}
SUFFIXES = {".mcap": MCAP, ".db3": SQLITE, ".zstd": ZSTD, ".zst": ZSTD}
# other files that are given for bags, by their first bytes, and how to make a bag of them
OTHERS = {
    b"#ROSBAG": "a ROS 1 bag; `rosbags-convert --src FILE --dst BAG` makes one of ROS 2 of it",
    b"PK\3\4": "a zip archive; unpack it",
    b"\x1f\x8b": "packed with gzip; unpack it",
    b"BZh": "packed with bzip2; unpack it",
    b"\xfd7zXZ": "packed with xz; unpack it",
    b"\x04\x22\x4d\x18": "packed with lz4; unpack it",
    b"7z\xbc\xaf": "a 7z archive; unpack it",
    b"Rar!": "a RAR archive; unpack it",
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"\x89HDF": "an HDF5 file",
    b"%PDF": "a PDF document",
    b"ULog": "a PX4 log",
    b"\x7fELF": "a program",
    b"PAR1": "a Parquet file",
}
TAR = slice(257, 262), b"ustar"


def storage_files(bag: Path, lose: Lose) -> list[Path]:
    """Storage files of a bag: those that metadata.yaml names, else those in the directory.

    Raises `ValueError` if there are none.
    """
    if not bag.is_dir():
        return [bag]
    present = _present(bag)
    try:
        listed_files = _listed_files(bag / METADATA)
        names = list(dict.fromkeys(Path(name).name or name for name in listed_files))
    except (OSError, ValueError):
        lose(f"{METADATA}: missing or damaged, not needed")
        return [bag / name for name in present]
    here = os.listdir(bag)
    found = [name for name in names if name in here]
    missing = [name for name in names if name not in found]
    others = [name for name in present if name not in found]
    if (missing and others) or not found:
        what = f"names {listed(missing)}, not there" if missing else "names no file"
        lose(f"{METADATA} {what}: {listed(others)} read instead")
        return [bag / name for name in found + others]
    for name in missing:
        lose(f"{name}: not there")
    if others:
        lose(f"{METADATA} does not name {listed(others)}: not read")
    return [bag / name for name in found]


def open_file(path: Path, scratch: Path, lose: Lose) -> StorageFile:
    """Open a storage file, unpacked into the directory `scratch` if it is packed.

    Raises `ValueError` saying what else it is.
    """
    if not path.is_file():
        raise ValueError("no regular file")
    if _kind(path) == ZSTD or (_kind(path) is None and SUFFIXES.get(path.suffix) == ZSTD):
        path = _unpacked(path, scratch, lose)
    match _kind(path) or SUFFIXES.get(path.suffix):
        case "MCAP":
            kind: type[McapFile] | type[SqliteFile] = McapFile
        case "SQLite":
            kind = SqliteFile
        case _:
            raise ValueError(f"no MCAP or sqlite3 file, but {description(path)}")
    try:
        return kind(path, scratch, lose)
    except ValueError as error:
        is_other = _kind(path) is None and path.stat().st_size
        what = f"; it is {description(path)}" if is_other else ""
        raise ValueError(f"{error}{what}") from None


def description(path: Path) -> str:
    """What a file is, in words, by its first bytes, and how to make a bag of it."""
    with path.open("rb") as stream:
        start = stream.read(1024)
    if not start:
        return "empty"
    for magic, what in OTHERS.items():
        if start.startswith(magic):
            return what
    if start[TAR[0]] == TAR[1]:
        return "a tar archive; unpack it"
    is_text = not set(start) & (set(range(32)) - set(b"\t\n\r\f\x1b"))
    return "a text" if is_text else "of no known kind"


def other_files(bag: Path) -> str:
    """Hint, in words, at what is in a directory that is no bag; '' if nothing helps."""
    if not bag.is_dir():
        return ""
    for entry in _entries(bag):
        if entry.is_file() and (what := description(entry)) in OTHERS.values():
            return f"; {entry.name} is {what}"
        if entry.is_dir() and ((entry / METADATA).exists() or _present(entry)):
            return f"; there is a bag {entry.name} in it"
    return ""


def _present(bag: Path) -> list[str]:
    """Names of the storage files in a directory: by their suffixes, else by their first bytes."""
    entries = _entries(bag)
    named = [entry.name for entry in entries if _has_suffix(entry)]
    unpacked = {f"{name}{packed}" for name in named for packed in SUFFIXES}
    return [name for name in named if name not in unpacked] or [
        entry.name for entry in entries if entry.is_file() and _kind(entry)
    ]


def _entries(directory: Path) -> list[Path]:
    return sorted(islice(directory.iterdir(), MOST_FILES))


def _has_suffix(file: Path) -> bool:
    inner = Path(file.stem).suffix if SUFFIXES.get(file.suffix) == ZSTD else file.suffix
    return SUFFIXES.get(inner, ZSTD) != ZSTD


def _kind(file: Path) -> str | None:
    with file.open("rb") as stream:
        start = stream.read(max(map(len, MAGICS)))
    return next((kind for magic, kind in MAGICS.items() if start.startswith(magic)), None)


def _listed_files(metadata: Path) -> list[str]:
    """Names of the files that a metadata.yaml lists; raises `ValueError` if it has no list.

    Nothing but the list is parsed: whatever else YAML can do is of no use in a bag.
    """
    if not metadata.is_file() or metadata.stat().st_size > LARGEST_METADATA:
        raise ValueError("missing, or too large")
    if (listed := LIST.search(metadata.read_text(encoding="utf-8"))) is None:
        raise ValueError("it has no list of files")
    row, lines = listed["row"], listed["lines"] or ""
    items = row.split(",") if row is not None else re.split(r"\n[ \t]*-", lines)
    return [_unquoted(item.strip()) for item in items if item.strip()]


def _unquoted(name: str) -> str:
    if name.startswith('"'):  # escapes
        with suppress(yaml.YAMLError):
            return str(load(name))
    return name.strip("'\"")


def _unpacked(packed: Path, scratch: Path, lose: Lose) -> Path:
    """Unpack a file, up to the first damage or as far as it is allowed to."""
    unpacked = scratch / (packed.stem if SUFFIXES.get(packed.suffix) == ZSTD else packed.name)
    allowance = Allowance(packed.stat().st_size)
    try:
        with (
            packed.open("rb") as stream,
            zstandard_reader(stream) as source,
            unpacked.open("wb") as target,
        ):
            while piece := source.read(PIECE):
                allowance.take(len(piece))
                target.write(piece)
    except (zstandard.ZstdError, ValueError) as error:
        lose(f"{packed.name}: {error}: read up to there")
    return unpacked
