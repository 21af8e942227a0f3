"""One request and what to do about its outcome: without a socket, so that both clients share it."""

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

from .errors import ConnectionFailed, Problem, TesseraError, problem_of

Json = dict[str, Any]
Params = Mapping[str, str | int | float | Sequence[str]]

DEFAULT_SERVER = "http://127.0.0.1:8080"
# The server pings event streams every 15 s: three of them missing is a dead line.
SILENCE_S = 45.0
LONG_POLL_S = 20
PIECE_BYTES = 1 << 20


@dataclass(frozen=True)
class Retry:
    """When a request is tried again.

    attempts: how often at most, the first one included. patience_s: how long after the first one;
    also how long `wait()`, `events()` and `tiles()` go on looking for a server that went away. The
    pause before try k + 1 is drawn from [d/2, d], d = first_delay_s * 2^(k-1), at most
    longest_delay_s; `Retry-After` of the server counts as a lower bound. What may have happened
    already is only repeated if twice is the same as once.
    """

    attempts: int = 5
    first_delay_s: float = 0.2
    longest_delay_s: float = 5.0
    patience_s: float = 60.0

    def pause_s(self, tries: int, at_least_s: float = 0.0) -> float:
        """Seconds to wait after `tries` failures."""
        longest = min(self.first_delay_s * 2.0 ** min(tries - 1, 30), self.longest_delay_s)
        return max(longest * random.uniform(0.5, 1.0), at_least_s)

    def endless(self) -> Retry:
        """Limited by patience_s only."""
        return replace(self, attempts=sys.maxsize)


@dataclass(frozen=True)
class Call:
    """A request that can be sent more than once."""

    method: str
    path: str
    params: Params = field(default_factory=dict)
    json: Any = None
    content: bytes | Path | None = None
    headers: Mapping[str, str] = field(default_factory=dict)
    repeatable: bool = True  # sending it twice is the same as sending it once
    timeout_s: float | None = None  # of a read; None: the client's
    missing_is_fine: bool = False  # 404 is an answer, no error

    def build(self, http: httpx.Client | httpx.AsyncClient, body: Any) -> httpx.Request:
        """The request itself; body: `content`, opened if it is a file."""
        headers = dict(self.headers)
        if isinstance(self.content, Path):
            # With it the transport needs no chunked coding.
            headers["Content-Length"] = str(self.content.stat().st_size)
        extra: Json = {}
        if self.timeout_s is not None:
            extra["timeout"] = httpx.Timeout(http.timeout.connect, read=self.timeout_s)
        return http.build_request(
            self.method, self.path, params=dict(self.params), json=self.json, content=body,
            headers=headers, **extra,
        )  # fmt: skip


def submit_call(request: Json, *, dry_run: bool = False) -> Call:
    """POST /v1/jobs; the key makes a repeated request give the same job."""
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
    """Seconds until the next try, or None if this outcome stands."""
    at_least_s = 0.0
    if isinstance(outcome, httpx.Response):
        status = outcome.status_code
        # These two say that nothing was done; the others may come from a proxy that knows less.
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
    """The response of a request that succeeded; raises for every other."""
    if isinstance(outcome, httpx.TransportError):
        raise unreachable(server, outcome) from outcome
    if outcome.is_success or (call.missing_is_fine and outcome.status_code == 404):
        return outcome
    if call.method == "DELETE" and outcome.status_code == 404 and tries > 1:
        return outcome  # an earlier try did it, only its answer was lost
    raise problem_of(outcome)


def unreachable(server: str, error: Exception) -> ConnectionFailed:
    said = str(error) or type(error).__name__
    return ConnectionFailed(f"cannot reach the server at {server}: {said}")


class Comeback:
    """Whether and when a stream that broke off is tried again."""

    def __init__(self, retry: Retry, server: str) -> None:
        self._retry, self._server = retry, server
        self.contact()

    def contact(self) -> None:
        """The server has said something."""
        self._tries, self._since = 0, time.monotonic()

    def pause_s(self, error: Exception | None) -> float:
        """Seconds until the next try; error: why it broke off, None if the server closed it.

        Raises when that is of no use, or the server has been silent for too long.
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
    """One segment of a path."""
    return quote(text, safe="")


def is_loopback(server: str) -> bool:
    host = urlsplit(server).hostname or ""
    return host in ("localhost", "::1") or host.startswith("127.")


@dataclass(frozen=True)
class Address:
    """Where the server is and how to be let in."""

    server: str
    key: str

    @staticmethod
    def of(server: str | None, key: str | None) -> Address:
        """Arguments, else TESSERA_SERVER and TESSERA_KEY, else the default and no key."""
        url = server or os.environ.get("TESSERA_SERVER") or DEFAULT_SERVER
        if urlsplit(url).scheme not in ("http", "https") or not urlsplit(url).hostname:
            raise TesseraError(f'"{url}" is no address; one looks like {DEFAULT_SERVER}')
        return Address(url.rstrip("/"), os.environ.get("TESSERA_KEY", "") if key is None else key)

    def settings(self, timeout_s: float) -> Json:
        """Arguments of httpx.Client and httpx.AsyncClient."""
        headers = {"User-Agent": "tessera-python", "Accept": "application/json"}
        if self.key:
            headers["Authorization"] = f"Bearer {self.key}"
        return {
            "base_url": self.server,
            "headers": headers,
            "timeout": httpx.Timeout(timeout_s, connect=10.0),
            # Many streams may be open at once.
            "limits": httpx.Limits(max_connections=None, max_keepalive_connections=20),
            # A proxy of the environment cannot reach this machine's own server.
            "trust_env": not is_loopback(self.server),
        }
