"""Open untrusted SQLite databases, so that nothing but rows can be read from them.

A database is opened immutable: SQLite neither writes to it nor looks at what lies beside it. What
its recorder left beside it when it was killed, a log or a journal, is brought into a private copy
first. Only plain tables are read: views, triggers and generated columns run SQL of the database,
which can return anything, and take for ever.
"""

import re
import shutil
import sqlite3
from collections.abc import Callable, Collection
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from time import monotonic
from urllib.parse import quote_from_bytes

from climber_uk.bags.unpacking import LARGEST_MESSAGE

MAGIC = b"SQLite format 3\0"
PATIENCE = 10.0  # [s]
INSTRUCTIONS = 100_000  # of SQLite, after which it is asked how long it has been at it
LARGEST_SQL = 10**6  # [characters] of a definition
MOST_DEFINITIONS = 10_000
NOTHING = 32  # [bytes] that a log has at least, a journal with something in it more
PLAIN = re.compile(r"CREATE\s+(UNIQUE\s+)?(TABLE|INDEX|VIEW|TRIGGER)\b", re.IGNORECASE)
FUNCTIONS = "typeof", "length"
TABLES = "sqlite_master", "topics", "messages", "message_definitions"


class Patience:
    """Until when SQLite may search for the next row: damaged pages may form a circle."""

    def __init__(self) -> None:
        self.renew()

    def renew(self) -> None:
        """Begin anew."""
        self.until = monotonic() + PATIENCE

    def is_over(self) -> bool:
        """Whether SQLite has to give up."""
        return monotonic() > self.until


def open_database(path: Path, patience: Patience) -> sqlite3.Connection:
    """Open a database for nothing but to select from its tables; raises `sqlite3.Error`."""
    with ExitStack() as stack:
        database = stack.enter_context(closing(_connect(path, "mode=ro&immutable=1")))
        _restrict(database, patience)
        database.text_factory = lambda text: text.decode("utf-8", "replace")
        database.set_authorizer(_authorize)
        definitions = database.execute(
            f"SELECT sql FROM sqlite_master WHERE typeof(sql) = 'text' LIMIT {MOST_DEFINITIONS}"
        ).fetchall()
        for (sql,) in definitions:
            if not PLAIN.match(sql):
                raise sqlite3.DatabaseError(f"it defines more than tables: {sql:.40}")
        stack.pop_all()  # it stays open
    return database


def has_columns(database: sqlite3.Connection, table: str, columns: Collection[str]) -> bool:
    """Whether there is a table with some columns that are stored, not computed."""
    found = database.execute(f"PRAGMA table_xinfo({table})").fetchall()
    stored = {name for _, name, _, _, _, _, hidden in found if not hidden}
    return stored >= set(columns) and "_rowid_" not in {name.lower() for _, name, *_ in found}


def recovered(path: Path, scratch: Path, lose: Callable[[str], None]) -> Path:
    """Return the database, or a copy with what its killed recorder left beside it."""
    beside = [path.with_name(path.name + ending) for ending in ("-wal", "-journal")]
    left = [file for file in beside if file.is_file() and file.stat().st_size > NOTHING]
    if not left:
        return path
    if 2 * sum(file.stat().st_size for file in (path, *left)) > shutil.disk_usage(scratch).free:
        lose(f"{left[0].name} is not read: no room for a copy in {scratch}")
        return path
    copy = scratch / path.name
    shutil.copyfile(path, copy)
    for file in left:
        target = copy.with_name(file.name)
        shutil.copyfile(file, target)
        with target.open("ab") as journal:  # its end may name another file, which SQLite removes
            journal.write(bytes(NOTHING))
    with suppress(sqlite3.Error), closing(_connect(copy, "mode=rw")) as database:
        _restrict(database, Patience())
        database.execute("PRAGMA journal_mode = DELETE").fetchall()
        database.execute("SELECT count(*) FROM sqlite_master").fetchall()
    lose(f"its recorder was killed, read together with {left[0].name}")
    return copy


def stated_size(path: Path) -> int:
    """Size [bytes] by a database's header; raises `ValueError` if the file is none."""
    with path.open("rb") as stream:
        header = stream.read(100)
    if not header:
        raise ValueError("empty")
    if not header.startswith(MAGIC) or len(header) < 100:
        raise ValueError("no SQLite database")
    page_size = int.from_bytes(header[16:18])
    return (65536 if page_size == 1 else page_size) * int.from_bytes(header[28:32])


def _connect(path: Path, how: str) -> sqlite3.Connection:
    uri = f"file:{quote_from_bytes(bytes(path.absolute()))}?{how}"
    return sqlite3.connect(uri, uri=True, isolation_level=None)


def _restrict(database: sqlite3.Connection, patience: Patience) -> None:
    database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_MESSAGE + LARGEST_SQL)
    database.setlimit(sqlite3.SQLITE_LIMIT_SQL_LENGTH, LARGEST_SQL)
    database.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 0)
    database.set_progress_handler(patience.is_over, INSTRUCTIONS)
    for pragma in (
        "trusted_schema = OFF",
        "cell_size_check = ON",
        "temp_store = MEMORY",
        "writable_schema = ON",  # else one with missing pages does not open
    ):
        database.execute(f"PRAGMA {pragma}")


def _authorize(
    action: int, first: str | None, second: str | None, _: str | None, source: str | None
) -> int:
    """Deny all but to read the columns of tables; `source` is a view or a trigger."""
    allowed = source is None and (
        action == sqlite3.SQLITE_SELECT
        or (action == sqlite3.SQLITE_READ and (first or "").lower() in TABLES)
        or (action == sqlite3.SQLITE_FUNCTION and second in FUNCTIONS)
        or (action == sqlite3.SQLITE_PRAGMA and first == "table_xinfo")
    )
    return sqlite3.SQLITE_OK if allowed else sqlite3.SQLITE_DENY
