"""Server-sent events: the parser, and resumption of interrupted streams."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, cast

from ._wire import SILENCE_S, Call
from .errors import CorruptData

EventType = Literal[
    "snapshot", "state", "progress", "tile", "warning", "end", "reset", "overloaded"
]


@dataclass(frozen=True)
class Event:
    """One event of a job.

    `snapshot` (the whole job; first on every connection), `state`, `progress` (at most two per
    second), `tile` (x, y, width, height, revision, samples, error, url), `warning` (message),
    `reset` (progress and tiles were lost; a snapshot follows) and `end`. Members of `data` are
    those of the API. Types of a newer server that this package does not know are passed on
    unchanged.
    """

    type: EventType
    data: dict[str, Any]
    id: str = ""


class EventParser:
    """Parses bytes into events, as the HTML standard defines it (section 9.2.6)."""

    def __init__(self) -> None:
        self.last_id = ""
        self.retry_s: float | None = None
        self._pending = b""
        self._begin()

    def _begin(self) -> None:
        self._type = ""
        self._data: list[str] = []
        self._id = self.last_id

    def restart(self) -> None:
        """Starts a new connection: discards the incomplete event and keeps the last id."""
        self._pending = b""
        self._begin()

    def feed(self, piece: bytes) -> Iterator[Event]:
        # A CR at the very end may be half of a CR LF: it waits for the next piece.
        text = self._pending + piece
        lines = text.replace(b"\r\n", b"\n")
        held = b"\r" if lines.endswith(b"\r") else b""
        lines = lines[: len(lines) - len(held)].replace(b"\r", b"\n")
        *complete, rest = lines.split(b"\n")
        self._pending = rest + held
        for line in complete:
            event = self._take(line.decode("utf-8", "replace"))
            if event is not None:
                yield event

    def _take(self, line: str) -> Event | None:
        if not line:
            event = self._finish() if self._data else None
            self._begin()
            return event
        name, _, value = line.partition(":")
        value = value.removeprefix(" ")
        if name == "event":
            self._type = value
        elif name == "data":
            self._data.append(value)
        elif name == "id" and "\0" not in value:
            self._id = value
        elif name == "retry" and value.isascii() and value.isdigit():
            self.retry_s = int(value) / 1000
        return None

    def _finish(self) -> Event:
        self.last_id = self._id
        text = "\n".join(self._data)
        try:
            data = json.loads(text)
        except ValueError as error:
            raise CorruptData(f"an event is not JSON: {text[:200]!r}") from error
        if not isinstance(data, dict):
            raise CorruptData(f"an event is not a JSON object: {text[:200]!r}")
        return Event(cast(EventType, self._type or "message"), data, self._id)


class EventFeed:
    """A job's events over any number of connections."""

    def __init__(self, job_path: str, last_event_id: str | None) -> None:
        self._path = job_path + "/events"
        self._parser = EventParser()
        self._parser.last_id = last_event_id or ""
        self.ended = False
        self._come_back_s = 0.0
        self.refused = False  # the last connection got `overloaded` instead of events

    def call(self) -> Call:
        self._parser.restart()
        self.refused = False
        headers = {"Accept": "text/event-stream"}
        if self._parser.last_id:
            headers["Last-Event-ID"] = self._parser.last_id
        return Call("GET", self._path, headers=headers, timeout_s=SILENCE_S)

    def take(self, piece: bytes) -> Iterator[Event]:
        """Returns the events completed by this piece. Nothing follows the end."""
        for event in self._parser.feed(piece):
            if event.type == "overloaded":
                self._come_back_s = float(event.data.get("retry_after_seconds") or 0)
                self.refused = True
                continue  # not an event of the job; the server closes the stream now
            self.ended = event.type == "end"
            yield event
            if self.ended:
                return

    def pause_s(self, suggested_s: float) -> float:
        """Returns the seconds before the next connection: the server's or the given ones."""
        if self.refused:
            return self._come_back_s
        return suggested_s if self._parser.retry_s is None else self._parser.retry_s
