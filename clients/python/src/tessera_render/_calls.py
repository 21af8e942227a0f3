"""Requests that both clients build in more than one step."""

from __future__ import annotations

import json
import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any, TypeGuard

from ._job_data import JobData
from ._wire import Call, Json, Params
from .errors import CorruptData, NotOffered
from .results import LabPoint, LabRun, Scene

_EXPERIMENT_S = 600.0


def scene_id_of(scene: Scene | str | PathLike[str]) -> str:
    return scene.id if isinstance(scene, Scene) else str(scene)


@dataclass(frozen=True)
class JobQuery:
    state: str | Sequence[str] | None
    label: str | Sequence[str] | Mapping[str, str] | None

    def params(self) -> Params:
        params: dict[str, Sequence[str]] = {}
        if self.state is not None:
            params["state"] = [self.state] if isinstance(self.state, str) else list(self.state)
        if isinstance(self.label, Mapping):
            params["label"] = [f"{key}={value}" for key, value in self.label.items()]
        elif self.label is not None:
            params["label"] = [self.label] if isinstance(self.label, str) else list(self.label)
        return params


def _is_asset_id(text: str) -> bool:
    return len(text) == 64 and all(c in "0123456789abcdef" for c in text)


def wants_upload(side: JobData | str | PathLike[str]) -> TypeGuard[str | PathLike[str]]:
    """Returns whether this side of a comparison is an image file."""
    if isinstance(side, JobData):
        return False
    return not (isinstance(side, str) and (_is_asset_id(side) or side.count("-") == 4))


def comparison_call(
    sides: Sequence[JobData | str | PathLike[str]], a_denoise: str | None, b_denoise: str | None
) -> Call:
    ids = [side.id if isinstance(side, JobData) else str(side) for side in sides]
    shown = {"a_denoise": a_denoise, "b_denoise": b_denoise}
    body = {"a": ids[0], "b": ids[1]} | {k: v for k, v in shown.items() if v is not None}
    return Call("POST", "/v1/comparisons", json=body, timeout_s=120)


def batch_call(
    template: Json, matrix: Mapping[str, Sequence[Any]], pattern: str, webhook: str | None
) -> Call:
    """POST /v1/batches; with the key, a repeated request returns the same batch."""
    body: Json = {
        "template": template,
        "matrix": {path: list(values) for path, values in matrix.items()},
    }
    if pattern:
        body["name"] = pattern
    if webhook:
        body["webhook"] = {"url": webhook}
    key = f"python-{uuid.uuid4()}"
    return Call("POST", "/v1/batches", json=body, headers={"Idempotency-Key": key}, timeout_s=120)


def merge_call(films: Sequence[JobData | str | PathLike[str]]) -> Call:
    ids = [film.id if isinstance(film, JobData) else str(film) for film in films]
    return Call("POST", "/v1/films/merge", json={"films": ids}, repeatable=False, timeout_s=600)


def lab_call(experiment: str, members: Mapping[str, Any]) -> Call:
    return Call(
        "POST", "/v1/lab/runs", json={"experiment": experiment} | dict(members),
        headers={"Accept": "application/x-ndjson"}, timeout_s=_EXPERIMENT_S,
    )  # fmt: skip


def lab_line(line: str, lines: list[Json], on_point: Callable[[LabPoint], object] | None) -> None:
    """Parses one line of an experiment's stream."""
    if not line.strip():
        return
    try:
        data = json.loads(line)
    except ValueError as error:
        raise CorruptData(f"a line of the experiment is not JSON: {line[:200]!r}") from error
    lines.append(data)
    if on_point is not None and "n" in data:
        on_point(LabPoint.of(data))


def lab_run(lines: Sequence[Json]) -> LabRun:
    if not lines or "verdict" not in lines[-1]:
        raise CorruptData("the experiment's stream ended before its closing line")
    return LabRun.of(lines)


def is_offered(path: str, openapi: Json) -> bool:
    """Returns whether the server's OpenAPI document has this path."""
    return path in openapi.get("paths", {})


def not_offered(what: str) -> NotOffered:
    return NotOffered(f"this server's build has no {what}")
