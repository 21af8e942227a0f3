"""Tessera with a server of its own, and the client of a running one.

    from tessera_render import render

    job = render("chair.glb", size=800)          # starts a private server the first time
    job.save("chair.png")

    from tessera_render import Client

    with Client() as client:                     # TESSERA_SERVER, else http://127.0.0.1:8080
        job = client.submit("cornell-box", size=(480, 270), relative_error=0.05)
        job.wait()
        print(job.error)                         # 4.19% (4.08% to 4.31%)
        pixels = job.image()                     # (270, 480, 3), float32, linear

`AsyncClient` has the same calls to be awaited. Values, units and names are those of the HTTP API.
"""

from . import datasets, models, views
from ._client import Client
from ._private import client, render
from ._version import __version__
from ._wire import Retry
from .async_batch import AsyncBatch
from .async_client import AsyncClient
from .async_job import AsyncJob
from .batch import Batch
from .datasets import CocoFolder, NerfstudioFolder, Segment
from .errors import (
    BadRequest,
    Conflict,
    ConnectionFailed,
    CorruptData,
    FfmpegFailed,
    FieldError,
    Forbidden,
    Gone,
    Invalid,
    JobFailed,
    MethodNotAllowed,
    Misdirected,
    MissingFiles,
    NoSpace,
    NotAcceptable,
    NotFound,
    NotOffered,
    PreconditionFailed,
    Problem,
    ServerFault,
    TesseraError,
    TooLarge,
    TooManyRequests,
    Unauthorized,
    Unavailable,
    UnsupportedMedia,
    WaitTimeout,
)
from .events import Event
from .job import Job
from .options import JobOptions
from .png import encode_png, srgb8
from .results import (
    Comparison,
    Convergence,
    ErrorBar,
    Interval,
    LabPoint,
    LabRun,
    Meter,
    Pixel,
    PixelLayer,
    Progress,
    Scene,
    ServerInfo,
)
from .tiles import Tile, TileImage

__all__ = [
    "AsyncBatch",
    "AsyncClient",
    "AsyncJob",
    "BadRequest",
    "Batch",
    "Client",
    "CocoFolder",
    "Comparison",
    "Conflict",
    "ConnectionFailed",
    "Convergence",
    "CorruptData",
    "ErrorBar",
    "Event",
    "FfmpegFailed",
    "FieldError",
    "Forbidden",
    "Gone",
    "Interval",
    "Invalid",
    "Job",
    "JobFailed",
    "JobOptions",
    "LabPoint",
    "LabRun",
    "Meter",
    "MethodNotAllowed",
    "Misdirected",
    "MissingFiles",
    "NerfstudioFolder",
    "NoSpace",
    "NotAcceptable",
    "NotFound",
    "NotOffered",
    "Pixel",
    "PixelLayer",
    "PreconditionFailed",
    "Problem",
    "Progress",
    "Retry",
    "Scene",
    "Segment",
    "ServerFault",
    "ServerInfo",
    "TesseraError",
    "Tile",
    "TileImage",
    "TooLarge",
    "TooManyRequests",
    "Unauthorized",
    "Unavailable",
    "UnsupportedMedia",
    "WaitTimeout",
    "__version__",
    "client",
    "datasets",
    "encode_png",
    "models",
    "render",
    "srgb8",
    "views",
]
