"""Representation of a job in a notebook."""

from __future__ import annotations

import base64
import html
import importlib
import math
from typing import Any

from ._job_data import JobData
from .errors import NotOffered

PICTURE_PX = 640
_STATES = {"finished": "#2e7d32", "failed": "#c62828", "cancelled": "#8d6e63"}


def _duration(seconds: float) -> str:
    if math.isnan(seconds):
        return "unknown"
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s"


def _row(name: str, value: str) -> str:
    return f"<tr><th style='text-align:left'>{name}</th><td>{html.escape(value)}</td></tr>"


def job_html(job: JobData, png: bytes | None) -> str:
    """Returns state, bar and error of a job, with its image if there is one."""
    progress, percent = job.progress, job.progress.fraction * 100
    reason = f" ({job.stop_reason})" if job.stop_reason and job.stop_reason != job.state else ""
    rows = [
        _row("state", job.state + reason),
        _row("error", str(job.error) + ("" if job.error.bias == "none" else f", {job.error.bias}")),
        _row("samples", f"{progress.samples_mean:g} per pixel"),
        _row("time", _duration(progress.elapsed_seconds)),
    ]
    if not job.ended and not math.isnan(progress.eta_seconds):
        rows.append(_row("left", _duration(progress.eta_seconds)))
    if job.failure:
        rows.append(_row("failure", str(job.failure.get("detail", ""))))
    color = _STATES.get(job.state, "#1565c0")
    title = html.escape(job.name or str(job.spec.get("scene", ""))[:24])
    picture = ""
    if png is not None:
        data = base64.b64encode(png).decode()
        picture = f"<img alt='{title}' src='data:image/png;base64,{data}' style='max-width:100%'/>"
    return (
        f"<div class='tessera-job'><b>{title}</b> <code>{html.escape(job.id)}</code>"
        f"<div role='progressbar' aria-valuenow='{percent:.0f}' aria-valuemin='0' "
        f"aria-valuemax='100' style='background:#ddd;width:24em;height:.6em'>"
        f"<div style='background:{color};width:{percent:.1f}%;height:100%'></div></div>"
        f"<table>{''.join(rows)}</table>{picture}</div>"
    )


class Page:
    """HTML in a notebook that is replaced in place."""

    def __init__(self) -> None:
        try:
            ipython: Any = importlib.import_module("IPython.display")
        except ImportError as error:
            raise NotOffered("show() needs a notebook; IPython is not installed") from error
        self._html = ipython.HTML
        self._handle: Any = ipython.display(ipython.HTML(""), display_id=True)

    def show(self, text: str) -> None:
        self._handle.update(self._html(text))
