"""One request and the handling of its outcome, without a socket, so that both clients share it."""

from __future__ import annotations

import os
import random
import sys
import time
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlsplit

import httpx

from .errors import ConnectionFailed, Problem, TesseraError, problem_of, shown_address

Json = dict[str, Any]
Params = Mapping[str, str | int | float | Sequence[str]]

DEFAULT_SERVER = "http://127.0.0.1:8080"
# The server pings event streams every 15 s; after three missing pings the line is dead.
SILENCE_S = 45.0
LONG_POLL_S = 20
PIECE_BYTES = 1 << 20


@dataclass(frozen=True)
class Retry:
    """When a request is repeated.

    attempts: maximum number, including the first. patience_s: longest time after the first attempt;
    also how long `wait()`, `events()` and `tiles()` look for a server that has gone away. The pause
    before attempt k + 1 is drawn from [d/2, d], d = first_delay_s * 2^(k-1), at most
    longest_delay_s; the server's `Retry-After` is a lower bound. A request that may have taken
    effect is repeated only if repeating it is harmless.
    """

    attempts: int = 5
    first_delay_s: float = 0.2
    longest_delay_s: float = 5.0
    patience_s: float = 60.0

    def pause_s(self, tries: int, at_least_s: float = 0.0) -> float:
        """Returns the seconds to wait after `tries` failures."""
        longest = min(self.first_delay_s * 2.0 ** min(tries - 1, 30), self.longest_delay_s)
        return max(longest * random.uniform(0.5, 1.0), at_least_s)

    def endless(self) -> Retry:
        """Returns a copy that only patience_s limits."""
        return replace(self, attempts=sys.maxsize)


@dataclass(frozen=True)
class Call:
    """A request that may be sent more than once."""

    method: str
    path: str
    params: Params = field(default_factory=dict)
    json: Any = None
    content: bytes | Path | None = None
    headers: Mapping[str, str] = field(default_factory=dict)
    repeatable: bool = True  # sending it twice has the same effect as once
    timeout_s: float | None = None  # of a read; None: the client's default
    missing_is_fine: bool = False  # 404 is a response, not an error

    def build(self, http: httpx.Client | httpx.AsyncClient, body: Any) -> httpx.Request:
        """Builds the request; body: `content`, opened if it is a file."""
        headers = dict(self.headers)
        if isinstance(self.content, Path):
            # Avoids chunked transfer coding.
            headers["Content-Length"] = str(self.content.stat().st_size)
        extra: Json = {}
        if self.timeout_s is not None:
            extra["timeout"] = httpx.Timeout(http.timeout.connect, read=self.timeout_s)
        return http.build_request(
            self.method, self.path, params=dict(self.params), json=self.json, content=body,
            headers=headers, **extra,
        )  # fmt: skip


def submit_call(request: Json, *, dry_run: bool = False) -> Call:
    """POST /v1/jobs; with the key, a repeated request returns the same job."""
    if dry_run:
        return Call("POST", "/v1/jobs", params={"dry_run": 1}, json=request)
    key = f"python-{uuid.uuid4()}"
    return Call("POST", "/v1/jobs", json=request, headers={"Idempotency-Key": key})


def _retry_after_s(response: httpx.Response) -> float:
    try:
        return min(max(float(response.headers.get("Retry-After", "0")), 0.0), 60.0)
    except ValueError:
        return 0.0


Outcome = httpx.Response | httpx.TransportError


def pause_before_retry(
    call: Call, outcome: Outcome, tries: int, elapsed_s: float, retry: Retry
) -> float | None:
    """Returns the seconds until the next attempt, or None if this outcome is final."""
    at_least_s = 0.0
    if isinstance(outcome, httpx.Response):
        status = outcome.status_code
        # After these two nothing was done; others may come from a proxy that does not know.
        again = status in (429, 503) or (status in (502, 504) and call.repeatable)
        at_least_s = _retry_after_s(outcome)
    else:
        never_sent = isinstance(
            outcome, httpx.ConnectError | httpx.ConnectTimeout | httpx.PoolTimeout
        )
        again = never_sent or (
            call.repeatable and not isinstance(outcome, httpx.UnsupportedProtocol)
        )
    if not again or tries >= retry.attempts:
        return None
    pause = retry.pause_s(tries, at_least_s)
    return pause if elapsed_s + pause <= retry.patience_s else None


def conclude(call: Call, outcome: Outcome, tries: int, server: str) -> httpx.Response:
    """Returns the response of a successful request; raises for any other."""
    if isinstance(outcome, httpx.TransportError):
        raise unreachable(server, outcome) from outcome
    if outcome.is_success or (call.missing_is_fine and outcome.status_code == 404):
        return outcome
    if call.method == "DELETE" and outcome.status_code == 404 and tries > 1:
        return outcome  # an earlier attempt succeeded, but its response was lost
    raise problem_of(outcome)


def unreachable(server: str, error: Exception) -> ConnectionFailed:
    said = str(error) or type(error).__name__
    return ConnectionFailed(f"cannot reach the server at {shown_address(server)}: {said}")


class Comeback:
    """Decides whether and when an interrupted stream is reopened."""

    def __init__(self, retry: Retry, server: str) -> None:
        self._retry, self._server = retry, server
        self.contact()

    def contact(self) -> None:
        """Records that the server has sent something."""
        self._tries, self._since = 0, time.monotonic()

    def pause_s(self, error: Exception | None) -> float:
        """Returns the seconds until the next attempt. error: None if the server closed the stream.

        Raises if another attempt is useless, or the server has been silent for too long.
        """
        if error is not None and not _may_be_tried_again(error):
            raise error
        if time.monotonic() - self._since > self._retry.patience_s:
            raise unreachable(
                self._server, error or TesseraError("it closes every stream")
            ) from error
        self._tries += 1
        return self._retry.pause_s(self._tries)


def _may_be_tried_again(error: Exception) -> bool:
    if isinstance(error, Problem):
        return error.status in (429, 502, 503, 504)
    return isinstance(error, httpx.TransportError | httpx.StreamError) and not isinstance(
        error, httpx.UnsupportedProtocol
    )


def segment(text: str) -> str:
    """Encodes one segment of a path."""
    return quote(text, safe="")


def is_loopback(server: str) -> bool:
    host = urlsplit(server).hostname or ""
    return host in ("localhost", "::1") or host.startswith("127.")


@dataclass(frozen=True)
class Address:
    """Address and key of the server."""

    server: str
    key: str

    @staticmethod
    def of(server: str | None, key: str | None) -> Address:
        """Takes arguments, else TESSERA_SERVER and TESSERA_KEY, else the default and no key."""
        url = server or os.environ.get("TESSERA_SERVER") or DEFAULT_SERVER
        if urlsplit(url).scheme not in ("http", "https") or not urlsplit(url).hostname:
            raise TesseraError(f'"{shown_address(url)}" is not an address such as {DEFAULT_SERVER}')
        given = os.environ.get("TESSERA_KEY", "") if key is None else key
        # Without the line break of the file that a secret was made from.
        return Address(url.rstrip("/"), given.strip())

    def settings(self, timeout_s: float) -> Json:
        """Returns arguments of httpx.Client and httpx.AsyncClient."""
        headers = {"User-Agent": "tessera-python", "Accept": "application/json"}
        if self.key:
            headers["Authorization"] = f"Bearer {self.key}"
        return {
            "base_url": self.server,
            "headers": headers,
            "timeout": httpx.Timeout(timeout_s, connect=10.0),
            # Many streams may be open at once.
            "limits": httpx.Limits(max_connections=None, max_keepalive_connections=20),
            # A proxy from the environment cannot reach a local server.
            "trust_env": not is_loopback(self.server),
        }
