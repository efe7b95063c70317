"""Where records are kept: SQLite, or PostgreSQL by URL, with one schema and the same statements.

Each record is written in one transaction, so that a program that is killed leaves all of it or nothing. Two programs
may write at once: what makes a record one of a kind is a constraint of the database.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ramsight._version import __version__
from ramsight.errors import OutputError, RamsightError, one_line
from ramsight.histories.record import Learned, MachineKey, Record
from ramsight.optional import needing

if TYPE_CHECKING:
    from sqlalchemy import Connection, Engine, MetaData, Table

SCHEMA = 1
"""Number of the schema. A store of a later one is refused, one of an earlier one is migrated."""
MIGRATIONS: dict[int, Callable[[Connection], None]] = {}
"""What makes a store of schema n one of schema n + 1; those that are due run in one transaction when it is opened."""
PATIENCE = 60.0
"""How long a writer waits for another one [s]."""
_LOCK = 0x72616D73  # of the transaction that makes the tables, in PostgreSQL
_POSTGRESQL = ("postgresql://", "postgres://")
KINDS_OF_EVENT = ("oil change", "repair", "other")
"""What may be declared to have happened to a machine."""


class HistoryError(RamsightError):
    """A store of records that cannot be used; the text says why and what to do."""


class DescriptionChangedError(HistoryError):
    """A machine whose records rest on another description than the one that was passed."""


@dataclass(frozen=True)
class Event:
    """Something that was done to a machine."""

    at: float  # when [s since 1970, UTC]
    kind: str  # of `KINDS_OF_EVENT`
    note: str = ""  # in words


@dataclass(frozen=True)
class Kept:
    """A unit in the store."""

    key: MachineKey  # whose records they are
    place: int  # of its newest description in the store
    toml: str  # that description
    digest: str
    descriptions: int  # how many there have been


class HistoryStore:
    """A database of records.

    Args:
        url: a file (SQLite), or ``postgresql://user@host/database``.

    Raises:
        HistoryError: it is no history, of a later schema, or cannot be reached.
        MissingPackageError: SQLAlchemy is not installed, or the driver of PostgreSQL.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder, HistoryStore(f"{folder}/fleet.db", makes=True) as store:
        ...     store.machines()
        []
    """

    def __init__(self, url: str | Path, *, makes: bool = False) -> None:
        with needing("history"):
            import sqlalchemy

        self._sql, self.name = sqlalchemy, one_line(str(url))
        self._tables = _tables(sqlalchemy)
        self._engine = self._opened(str(url), makes=makes)
        try:
            with self._transaction() as connection:
                is_current = self._found(connection) == SCHEMA
            if not is_current:
                with self._transaction(writes=True) as connection:
                    self._make(connection)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> HistoryStore:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections to the database."""
        self._engine.dispose()

    def machines(self) -> list[Kept]:
        """All units in the store, by name."""
        table, sql = self._table("descriptions"), self._sql
        with self._transaction() as connection:
            rows = connection.execute(sql.select(table).order_by(table.c.id)).mappings().all()
        found: dict[MachineKey, Kept] = {}
        for row in rows:
            key = MachineKey(row["machine"], row["unit"], row["serial"])
            before = found[key].descriptions if key in found else 0
            found[key] = Kept(key, row["id"], row["toml"], row["digest"], before + 1)
        return sorted(found.values(), key=lambda one: (one.key.machine, one.key.unit, one.key.serial))

    def described(self, key: MachineKey, digest: str, toml: str, *, has_changed: bool = False) -> int:
        """The place of a unit's description in the store, which it gets if it is new.

        Args:
            digest: of the description, as `description_digest` gives it.
            has_changed: a description other than that of the records so far begins a history of its own.

        Raises:
            DescriptionChangedError: it is another one, and that is not allowed.
        """
        table, sql = self._table("descriptions"), self._sql
        same = {"machine": key.machine, "unit": key.unit, "serial": key.serial}
        chosen = [table.c[name] == value for name, value in same.items()]
        with self._transaction(writes=True) as connection:
            rows = connection.execute(sql.select(table.c.id, table.c.digest).where(*chosen).order_by(table.c.id)).all()
            if rows and rows[-1].digest == digest:
                return int(rows[-1].id)
            if rows and not has_changed:
                raise DescriptionChangedError(
                    f"{self.name}: the records of {key.text} rest on another description; factors over two of them are "
                    "not comparable: pass the one they rest on, or --new-description to begin a history of its own"
                )
            if any(row.digest == digest for row in rows):
                raise DescriptionChangedError(
                    f"{self.name}: {key.text} had this description before the newest one; take another --serial for it"
                )
            made = connection.execute(
                table.insert()
                .values(**same, digest=digest, toml=toml, added=time.time(), version=__version__)
                .returning(table.c.id)
            )
            return int(made.scalar_one())

    def has_file(self, place: int, digest: str) -> bool:
        """Whether there is a record of a file."""
        table, sql = self._table("records"), self._sql
        asked = sql.select(table.c.id).where(table.c.description == place, table.c.file_digest == digest).limit(1)
        with self._transaction() as connection:
            return connection.execute(asked).first() is not None

    def add(self, place: int, record: Record) -> bool:
        """Keep a record; False if its log has one already."""
        table, quantities = self._table("records"), self._table("quantities")
        values = {name: _stored(getattr(record, name)) for name in _PLAIN}
        values |= {"faults": json.dumps(record.faults), "covariances": json.dumps(dict(record.covariances))}
        insert = self._insert(table).values(**values, description=place, added=time.time(), version=__version__)
        insert = insert.on_conflict_do_nothing(index_elements=["description", "log_digest"]).returning(table.c.id)
        with self._transaction(writes=True) as connection:
            made = connection.execute(insert).first()
            if made is None:
                return False
            rows = [
                {"record": made.id, "name": name, "value": _stored(one.value), "std": _stored(one.std),
                 "prior": _stored(one.prior), "prior_std": _stored(one.prior_std)}
                for name, one in record.quantities.items()
            ]  # fmt: skip
            if rows:
                connection.execute(quantities.insert(), rows)
        return True

    def records(self, place: int) -> list[Record]:
        """The records of a description, in the order of their times."""
        table, quantities, sql = self._table("records"), self._table("quantities"), self._sql
        wanted = [table.c[name] for name in ("id", *_PLAIN, "faults", "covariances")]
        asked = sql.select(*wanted).where(table.c.description == place).order_by(table.c.begun, table.c.log_digest)
        parts = [quantities.c[name] for name in ("record", "name", "value", "std", "prior", "prior_std")]
        of_them = sql.select(*parts).join(table, table.c.id == quantities.c.record).where(table.c.description == place)
        with self._transaction() as connection:
            rows = connection.execute(asked).all()
            learned: dict[int, dict[str, Learned]] = {}
            for record, name, *numbers, prior_std in connection.execute(
                of_them.order_by(quantities.c.record, quantities.c.name)
            ):
                value, std, prior = (math.nan if one is None else one for one in numbers)
                found = Learned(value, std, prior, math.inf if prior_std is None else prior_std)
                learned.setdefault(record, {})[name] = found
        return [_record(row, learned.get(row[0], {})) for row in rows]

    def declare(self, key: MachineKey, event: Event) -> bool:
        """Keep that something was done to a machine; False if that is known already.

        Raises:
            HistoryError: the store has no such unit.
        """
        if not any(one.key == key for one in self.machines()):
            known = "; ".join(one.key.text for one in self.machines()) or "none"
            raise HistoryError(f"{self.name}: has no records of {key.text} (known: {known})")
        table = self._table("events")
        values = {"machine": key.machine, "unit": key.unit, "serial": key.serial}
        insert = self._insert(table).values(**values, at=event.at, kind=event.kind, note=event.note)
        insert = insert.on_conflict_do_nothing().returning(table.c.id)
        with self._transaction(writes=True) as connection:
            return connection.execute(insert).first() is not None

    def events(self, key: MachineKey) -> list[Event]:
        """What was done to a machine, in order."""
        table, sql = self._table("events"), self._sql
        chosen = [table.c.machine == key.machine, table.c.unit == key.unit, table.c.serial == key.serial]
        with self._transaction() as connection:
            rows = connection.execute(sql.select(table).where(*chosen).order_by(table.c.at, table.c.kind)).all()
        return [Event(row.at, row.kind, row.note) for row in rows]

    def _table(self, name: str) -> Table:
        return self._tables.tables[name]

    def _insert(self, table: Table) -> Any:
        """An insert that knows conflicts, in the words of the database."""
        if self._is_postgresql:
            from sqlalchemy.dialects.postgresql import insert
        else:
            from sqlalchemy.dialects.sqlite import insert  # type: ignore[assignment]
        return insert(table)

    def _opened(self, url: str, *, makes: bool) -> Engine:
        sql = self._sql
        engine: Engine
        try:
            if url.startswith(_POSTGRESQL):
                with needing("history"):
                    import psycopg  # noqa: F401 - SQLAlchemy imports it, and says it in its own words
                address = sql.engine.make_url(url).set(drivername="postgresql+psycopg")
                self.name = one_line(address.render_as_string(hide_password=True))
                engine = sql.create_engine(address, pool_pre_ping=True)
                return engine
            if "://" in url:
                raise HistoryError(f"{self.name}: no known kind of store (known: a file, postgresql://host/database)")
            if not makes and not Path(url).is_file():
                raise HistoryError(f"{self.name}: there is no such file; ramsight history add makes it")
            engine = sql.create_engine(
                sql.engine.URL.create("sqlite", database=url), connect_args={"timeout": PATIENCE}
            )
        except sql.exc.ArgumentError as error:
            raise HistoryError(f"{self.name}: is no address of a database: {one_line(error)}") from None
        # Python's driver begins a transaction with the first change; a reader that then writes could not wait.
        sql.event.listen(engine, "connect", _no_transactions_of_its_own)
        sql.event.listen(engine, "begin", _begin)
        return engine

    @contextmanager
    def _transaction(self, *, writes: bool = False) -> Iterator[Connection]:
        """All or nothing of what is done within it."""
        sql = self._sql
        options = {"ramsight_writes": writes}
        try:
            with self._engine.connect().execution_options(**options) as connection, connection.begin():
                yield connection
        except sql.exc.DBAPIError as error:
            said = one_line(" ".join(str(error.orig).split()))
            kind = OutputError if writes else HistoryError
            raise kind(f"{self.name}: {said}") from None

    def _found(self, connection: Connection) -> int:
        """Number of the schema that the database has; 0 if it has none yet.

        Raises:
            HistoryError: it is a later one, or the database holds something else.
        """
        version, sql = self._table("ramsight_history"), self._sql
        there = set(sql.inspect(connection).get_table_names())
        if version.name in there:
            found = int(connection.execute(sql.select(version.c.schema)).scalar_one())
            if found > SCHEMA:
                raise HistoryError(
                    f"{self.name}: schema {found} is newer than this ramsight knows ({SCHEMA}); update it"
                )
            return found
        in_the_way = there & set(self._tables.tables) if self._is_postgresql else there
        if in_the_way:
            raise HistoryError(f"{self.name}: is a database of something else; give another one")
        return 0

    def _make(self, connection: Connection) -> None:
        """Make the tables where there are none; migrate those of an earlier schema."""
        version, sql = self._table("ramsight_history"), self._sql
        if self._is_postgresql:  # SQLite has one writer at a time by itself
            connection.execute(sql.select(sql.func.pg_advisory_xact_lock(_LOCK)))
        found = self._found(connection)
        if not found:
            self._tables.create_all(connection)
            connection.execute(version.insert().values(schema=SCHEMA))
            return
        for number in range(found, SCHEMA):
            MIGRATIONS[number](connection)
        connection.execute(version.update().values(schema=SCHEMA))

    @property
    def _is_postgresql(self) -> bool:
        return bool(self._engine.dialect.name == "postgresql")


def _no_transactions_of_its_own(connection: Any, _record: object) -> None:
    connection.isolation_level = None
    connection.execute("PRAGMA foreign_keys = ON")
    connection.execute("PRAGMA synchronous = FULL")


def _begin(connection: Connection) -> None:
    writes = connection.get_execution_options().get("ramsight_writes", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


_PLAIN = (
    "log_digest", "file_digest", "file", "begun", "dated_by", "duration", "worked", "oil_low", "oil_high", "oil_mean",
    "leak_per_kelvin", "leak_per_kelvin2", "references", "available", "consistency", "mistake",
)  # fmt: skip
"""Fields of a record that are a column each."""


def _tables(sql: Any) -> MetaData:
    """The schema. Times are seconds since 1970 (UTC), all quantities SI."""
    found: MetaData = sql.MetaData()
    column, text, real, whole = sql.Column, sql.Text, sql.Double, sql.Integer

    def needed(name: str, kind: Any, *more: Any) -> Any:
        return column(name, kind, *more, nullable=False)

    who = ("machine", "unit", "serial")
    sql.Table("ramsight_history", found, needed("schema", whole))
    sql.Table(
        "descriptions", found, column("id", whole, primary_key=True), *(needed(name, text) for name in who),
        needed("digest", text), needed("toml", text), needed("added", real), needed("version", text),
        sql.UniqueConstraint(*who, "digest"),
    )  # fmt: skip
    sql.Table(
        "records", found, column("id", whole, primary_key=True),
        needed("description", whole, sql.ForeignKey("descriptions.id")),
        *(needed(name, text) for name in ("log_digest", "file_digest", "file", "dated_by", "mistake")),
        *(needed(name, real) for name in ("begun", "duration", "worked")),
        *(column(name, real) for name in ("oil_low", "oil_high", "oil_mean", "leak_per_kelvin", "leak_per_kelvin2")),
        needed("references", whole), needed("available", real), column("consistency", real),
        needed("faults", text), needed("covariances", text), needed("added", real), needed("version", text),
        sql.UniqueConstraint("description", "log_digest"), sql.Index("records_by_file", "description", "file_digest"),
        sql.Index("records_by_time", "description", "begun"),
    )  # fmt: skip
    sql.Table(
        "quantities", found, column("record", whole, sql.ForeignKey("records.id"), primary_key=True),
        column("name", text, primary_key=True), column("value", real), column("std", real), column("prior", real),
        column("prior_std", real),
    )  # fmt: skip
    sql.Table(
        "events", found, column("id", whole, primary_key=True), *(needed(name, text) for name in who),
        needed("at", real), needed("kind", text), needed("note", text), sql.UniqueConstraint(*who, "at", "kind"),
    )  # fmt: skip
    return found


def _stored(value: Any) -> Any:
    """A value as a database has it: what is no finite number is NULL."""
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value.replace("\0", "").encode(errors="replace").decode() if isinstance(value, str) else value


def _record(row: Sequence[Any], quantities: dict[str, Learned]) -> Record:
    """A record of its row: number, plain fields, faults and covariances."""
    _, *plain, faults, covariances = row
    values: dict[str, Any] = dict(zip(_PLAIN, (math.nan if one is None else one for one in plain), strict=True))
    values |= {"faults": tuple(json.loads(faults)), "covariances": json.loads(covariances)}
    return Record(**values, quantities=quantities)
