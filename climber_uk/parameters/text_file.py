"""Texts that users give, within bounds: what is given may be no text, or have no end."""

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
