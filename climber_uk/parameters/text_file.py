"""Texts that users give, within bounds, and are given: wholly, or not at all."""

import os
from pathlib import Path

LARGEST = 2**24  # [bytes] of a file


def at_home(path: str) -> Path:
    """A path, with the home directory for ~; `ValueError` if there is no such user."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        raise ValueError(f"{path}: there is no such user") from None


def content_of(path: Path) -> bytes:
    """Bytes of a file; `OSError`, or `ValueError` if it is too large.

    A pipe into which nobody writes is empty: to open it would take for ever.
    """
    with open(path, "rb", opener=_at_once) as stream:
        content = stream.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise ValueError(f"larger than {LARGEST >> 20} MiB")
    return content


def _at_once(path: str, flags: int) -> int:
    descriptor = os.open(path, flags | os.O_NONBLOCK)
    os.set_blocking(descriptor, True)
    return descriptor


def text_of(path: Path) -> str:
    """Text of a file; raises as `content_of`, and `ValueError` if it is none in UTF-8."""
    content = content_of(path)
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ValueError(f"line {line}: not a text in UTF-8") from None


def write_whole(path: Path, text: str) -> None:
    """Write a text into a file, in UTF-8; if the disk is full, what was there before is kept.

    Raises `OSError` naming the file.
    """
    if path.exists() and not path.is_file():  # as a pipe
        path.write_text(text, encoding="utf-8")
        return
    target = Path(os.path.realpath(path))  # not a link to it
    part = target.with_name(f".{target.name}.part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(target)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise OSError(f"cannot write {path} ({error.strerror})") from None
