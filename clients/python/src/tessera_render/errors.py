"""Exceptions of this package.

`Problem` is an error response of the server (RFC 9457) and has one subclass for each status that
the API uses; `ConnectionFailed` means that there was no response. All derive from `TesseraError`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import httpx


class TesseraError(Exception):
    """Base class of all exceptions that this package raises."""


class ConnectionFailed(TesseraError):
    """The server could not be reached, or the connection broke and could not be restored."""


class CorruptData(TesseraError):
    """Bytes that are not a tile frame, event or image, or whose checksum is wrong."""


class WaitTimeout(TesseraError, TimeoutError):
    """The job had not ended when the time was over. It continues to render."""


class NotOffered(TesseraError):
    """This server's build does not support the request."""


class FfmpegFailed(TesseraError):
    """ffmpeg is not installed, or could not write the video."""


class JobFailed(TesseraError):
    """The job ended in the state `failed`; `failure` is the problem document with the reason."""

    def __init__(self, job_id: str, failure: dict[str, Any]) -> None:
        self.job_id = job_id
        self.failure = failure
        reason = failure.get("detail") or failure.get("title") or "no reason was given"
        super().__init__(f"job {job_id} failed: {reason}")


@dataclass(frozen=True)
class FieldError:
    """One error in a request: a JSON pointer (RFC 6901) and what is wrong there."""

    pointer: str
    detail: str


class Problem(TesseraError):
    """An error response of the server."""

    def __init__(self, status: int, document: dict[str, Any], request_id: str = "") -> None:
        self.status = status
        self.document = document
        self.title = str(document.get("title", ""))
        self.detail = str(document.get("detail", ""))
        self.type = str(document.get("type", "about:blank"))
        self.instance = str(document.get("instance", ""))
        self.request_id = request_id
        listed = document.get("errors")
        self.errors = [
            FieldError(str(each.get("pointer", "")), str(each.get("detail", "")))
            for each in (listed if isinstance(listed, list) else [])
            if isinstance(each, dict)
        ]
        super().__init__(str(self))

    def __str__(self) -> str:
        text = f"{self.status} {self.title}".strip()
        places = "; ".join(f"{each.pointer}: {each.detail}" for each in self.errors)
        said = places or self.detail
        return f"{text}: {said}" if said else text

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.status, self.document, self.request_id)


class BadRequest(Problem):
    """400: invalid JSON or query."""


class Unauthorized(Problem):
    """401: a key is missing or wrong."""


class Forbidden(Problem):
    """403."""


class NotFound(Problem):
    """404: no such job, scene, asset or pixel."""


class MethodNotAllowed(Problem):
    """405."""


class NotAcceptable(Problem):
    """406: no such image format."""


class Conflict(Problem):
    """409: not in this state, e.g. an image before the first sample."""


class Gone(Problem):
    """410: the film was evicted; the job's record is kept."""


class PreconditionFailed(Problem):
    """412."""


class TooLarge(Problem):
    """413."""


class UnsupportedMedia(Problem):
    """415: not a scene file that the server reads."""


class Misdirected(Problem):
    """421: the server does not accept this host name."""


class Invalid(Problem):
    """422: well-formed, but with invalid values; `errors` names each location."""


class MissingFiles(Problem):
    """424: the scene refers to files that were not uploaded with it; `errors` point to them."""


class TooManyRequests(Problem):
    """429."""


class ServerFault(Problem):
    """5xx."""


class Unavailable(ServerFault):
    """503: starting, stopping or overloaded, even after all retries."""


class NoSpace(ServerFault):
    """507: the server's disk is full."""


BY_STATUS: dict[int, type[Problem]] = {
    400: BadRequest,
    401: Unauthorized,
    403: Forbidden,
    404: NotFound,
    405: MethodNotAllowed,
    406: NotAcceptable,
    409: Conflict,
    410: Gone,
    412: PreconditionFailed,
    413: TooLarge,
    415: UnsupportedMedia,
    421: Misdirected,
    422: Invalid,
    424: MissingFiles,
    429: TooManyRequests,
    503: Unavailable,
    507: NoSpace,
}


def shown_address(url: str) -> str:
    """Returns the address with *** for all before its last @, which may be a password."""
    before, at, host = url.rpartition("@")
    scheme = re.match(r"[A-Za-z0-9]+://", before)
    return (scheme[0] if scheme else "") + "***@" + host if at else url


def problem_of(response: httpx.Response) -> Problem:
    """Returns the exception for an unsuccessful response whose body has been read."""
    status = response.status_code
    try:
        body = response.json()
    except ValueError:
        body = None
    if not isinstance(body, dict):
        # Not from the server: a proxy, for example.
        body = {"title": response.reason_phrase, "detail": response.text[:500]}
    if place := response.headers.get("Location") if 300 <= status < 400 else None:
        body["detail"] = f"it is at {shown_address(place)}; give that address"
    kind = BY_STATUS.get(status, ServerFault if status >= 500 else Problem)
    return kind(status, body, response.headers.get("X-Request-Id", ""))
