"""A Model Context Protocol server: tools with which an agent renders a scene and looks at it.

    python -m tessera_render.mcp [--server URL] [--key KEY]         # stdio, started by the agent
    python -m tessera_render.mcp --port 8765 [--files FOLDER]       # http://127.0.0.1:8765/mcp

Needs the extra `mcp`: pip install "tessera-render[mcp]". Images in answers have at most a million
pixels; the error of each is told in words. Files are read from any folder over stdio, where the
agent's user starts this program; over HTTP only below FOLDER, without it none.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, ParamSpec, TypeVar

import anyio
from pydantic import Field

try:
    from mcp.server.mcpserver import Context, Image, MCPServer
    from mcp.server.mcpserver.exceptions import ToolError
except ModuleNotFoundError as missing:
    raise SystemExit(f'{missing}. Install it: pip install "tessera-render[mcp]"') from missing

from . import _upload
from ._version import __version__
from .async_batch import AsyncBatch
from .async_client import AsyncClient
from .async_job import AsyncJob
from .errors import TesseraError
from .options import JobOptions
from .results import ErrorBar

MOST_PIXELS = 1_000_000
#: Of camera.orbit, degrees: about +y from the front, and from +y.
VIEWS = {
    name: {"theta_degrees": theta, "phi_degrees": phi}
    for name, theta, phi in (
        ("front", 0.0, 90.0),
        ("right", 90.0, 90.0),
        ("back", 180.0, 90.0),
        ("left", 270.0, 90.0),
        ("top", 0.0, 0.0),
        ("iso", 45.0, 55.0),
    )
}
#: The sheet of a batch shows its images at most this large.
SHEET_SIDE = 240
#: Of a job that only asks what the file holds.
GLANCE: JobOptions = {"size": (32, 32), "samples_per_pixel": 2, "layers": ["instance"]}
#: Names in one answer of inspect().
MOST_NAMES = 200

Scene = Annotated[
    str,
    Field(
        description="A path to a .glb, .gltf, .zip, .stl, .obj, .ply or .3mf, a scene's id, or a "
        "built-in name."
    ),
]
Job = Annotated[str, Field(description="The id of a render, as an earlier answer names it.")]
Error = Annotated[
    float,
    Field(
        gt=0, le=1, description="Ends when the average pixel is at most this far off: 0.05 is 5%."
    ),
]
Seconds = Annotated[float, Field(gt=0, le=3600, description="Ends at the latest after this time.")]
Parameters = ParamSpec("Parameters")
Answer = TypeVar("Answer")


def percent(share: float) -> str:
    return f"{100 * share:.2g}%"


def error_words(error: ErrorBar) -> str:
    if error.relative != error.relative:  # NaN
        return "The error is not known."
    text = f"The average pixel is {percent(error.relative)} off"
    if error.low == error.low:
        text += f" ({percent(error.low)} to {percent(error.high)} with 95% confidence)"
    if error.unreliable:
        text += "; unreliable, because much of it is light that few samples have found"
    if error.bias == "biased":
        text += "; the method is biased, which this does not include"
    return text + "."


def job_words(job: AsyncJob) -> str:
    """How accurate the image is, what it lacks and what was odd about the job."""
    width, height = job.size
    lines = [
        f"Render {job.id}: {width} x {height}, {job.state} after "
        f"{job.progress.samples_mean:.4g} samples per pixel and "
        f"{job.progress.elapsed_seconds:.1f} s ({job.stop_reason}).",
        error_words(job.error),
    ]
    light = job.data.get("light_not_found")
    if light and light["reason"]:
        missing = percent(light["detected"])
        lines.append(f"{missing} of the light is not in the image. {light['reason']}")
    elif light and light["at_most"] >= 1:
        lines.append("How much light may be missing is not known.")
    elif light:
        lines.append(f"Up to {percent(light['at_most'])} of the light may be missing.")
    lines += [f"Warning: {each}" for each in job.warnings]
    return "\n".join(lines)


async def picture(job: AsyncJob) -> Image:
    """The image with an automatic exposure, reduced to MOST_PIXELS."""
    width, height = job.size
    longest = max(width, height)
    if width * height > MOST_PIXELS:
        longest = int(longest * (MOST_PIXELS / (width * height)) ** 0.5)
    data = await job.picture("png", exposure="auto", max_size=longest)
    return Image(data=data, format="png")


async def followed(job: AsyncJob, context: Context[Any]) -> AsyncJob:
    """Waits for the end and reports progress; cancels the job if the agent gives up."""
    try:
        async for event in job.events():
            if event.type == "progress":
                words = error_words(job.error)
                await context.report_progress(job.progress.fraction, 1.0, words)
    except anyio.get_cancelled_exc_class():
        with anyio.CancelScope(shield=True):
            await job.cancel()
        raise
    job.raise_if_failed()
    return job


def make_server(
    server: str | None = None, key: str | None = None, *, any_file: bool = True,
    files: Path | None = None,
) -> MCPServer[AsyncClient]:  # fmt: skip
    """The MCP server. server, key: of Tessera, as for Client. files: the only folder that is read,
    if not any_file."""

    @asynccontextmanager
    async def connection(_: MCPServer[AsyncClient]) -> AsyncIterator[AsyncClient]:
        async with AsyncClient(server, key) as client:
            yield client

    host: MCPServer[AsyncClient] = MCPServer(
        "tessera",
        version=__version__,
        lifespan=connection,
        log_level="WARNING",
        instructions=(
            "Renders glTF scenes by path tracing and says how accurate each image is. Begin with "
            "inspect and views; render takes a view by name or angle; improve continues a render."
        ),
    )

    def tool(
        run: Callable[Parameters, Awaitable[Answer]],
    ) -> Callable[Parameters, Awaitable[Answer]]:
        """Registers a tool whose known errors are told to the agent."""

        @wraps(run)
        async def told(*arguments: Parameters.args, **named: Parameters.kwargs) -> Answer:
            try:
                return await run(*arguments, **named)
            except (TesseraError, OSError, ValueError) as error:
                raise ToolError(str(error)) from error

        host.add_tool(told)
        return run

    def client_of(context: Context[Any]) -> AsyncClient:
        client: AsyncClient = context.request_context.lifespan_context
        return client

    async def scene_of(scene: str, client: AsyncClient) -> str:
        """The scene's id; uploads a file that may be read."""
        path = Path(scene).expanduser()
        if not _upload.looks_like_file(scene):
            return scene
        inside = files and path.resolve().is_relative_to(files.resolve())
        if inside and path.is_dir():  # The file in it may be a link.
            inside = files and _upload.scene_file(path).resolve().is_relative_to(files.resolve())
        if not any_file and not inside:
            raise ValueError(f"{scene}: this server reads no files there (--files FOLDER)")
        return (await client.upload(path)).id

    @tool
    async def render(
        context: Context[Any], scene: Scene, view: str | None = None,
        theta_degrees: float | None = None, phi_degrees: float | None = None,
        width: int = 800, height: int = 600, error: Error = 0.05, seconds: Seconds = 30,
        job: dict[str, Any] | None = None,
    ) -> tuple[str, Image]:  # fmt: skip
        """Renders an image of a scene and says how accurate it is.

        view: front, right, back, left, top or iso; or give theta_degrees (0 is in front, 90 right)
        and phi_degrees (0 looks down, 90 is level). Without any of them, the file's own camera.
        job: more members of a job request, such as {"environment": {"preset": "studio"}},
        {"ground": {"type": "catcher"}} or {"variant": "red"}.
        """
        if view is not None and view not in VIEWS:
            raise ValueError(f'view "{view}" is not one of {", ".join(VIEWS)}')
        options: dict[str, Any] = dict(job or {})
        given = {"theta_degrees": theta_degrees, "phi_degrees": phi_degrees}
        orbit = dict(VIEWS[view]) if view else {}
        orbit |= {name: value for name, value in given.items() if value is not None}
        if orbit:
            options["camera"] = {**(options.get("camera") or {}), "orbit": orbit}
        client = client_of(context)
        made = await client.submit(
            await scene_of(scene, client),
            size=(width, height), relative_error=error, seconds=seconds, request=options,
        )  # fmt: skip
        await followed(made, context)
        return job_words(made), await picture(made)

    @tool
    async def views(
        context: Context[Any], scene: Scene, error: Error = 0.1, seconds: Seconds = 10,
        job: dict[str, Any] | None = None,
    ) -> tuple[str, Image]:  # fmt: skip
        """Renders six views of a scene on one sheet: front, right, back; left, top, iso.

        error, seconds: of each view. job: more members of a job request, as for render.
        """
        client = client_of(context)
        batch = await client.submit_batch(
            await scene_of(scene, client), {"camera.orbit": list(VIEWS.values())},
            size=(SHEET_SIDE, SHEET_SIDE), relative_error=error, seconds=seconds,
            request=dict(job or {}),
        )  # fmt: skip
        jobs = await batch_end(batch)
        for each in jobs:
            each.raise_if_failed()
        with tempfile.TemporaryDirectory() as folder:
            sheet = await batch.sheet(Path(folder, "views.png"), exposure="auto")
            image = Image(data=sheet.read_bytes(), format="png")
        lines = ["Row by row:"]
        for name, each in zip(VIEWS, jobs, strict=True):
            lines.append(f"{name}: render {each.id}. {error_words(each.error)}")
        told = dict.fromkeys(warning for each in jobs for warning in each.warnings)
        lines += [f"Warning: {each}" for each in told]
        return "\n".join(lines), image

    async def batch_end(batch: AsyncBatch) -> list[AsyncJob]:
        try:
            await batch.wait()
        except anyio.get_cancelled_exc_class():
            with anyio.CancelScope(shield=True):
                await batch.cancel()
            raise
        return await batch.jobs()

    @tool
    async def inspect(context: Context[Any], scene: Scene) -> dict[str, Any]:
        """Says what a scene's file holds: objects with their boxes (metres, +y up), materials,
        variants, cameras, lights, animations, and warnings about what is wrong in it."""
        client = client_of(context)
        found = await client.scene(await scene_of(scene, client))
        job = await client.submit(found, **GLANCE)
        try:
            await followed(job, context)
            objects = (await job.objects())["objects"]
        finally:
            with anyio.CancelScope(shield=True):
                await job.delete()
        data = found.data
        answer: dict[str, Any] = {
            "scene": found.id,
            "name": found.name,
            "triangles": found.triangles,
            "bounds": data["bounds"],
            "objects": [
                {"name": each["name"], "pointer": each["pointer"], "bounds": each["bounds"]}
                for each in objects[:MOST_NAMES]
            ],
            "materials": found.materials[:MOST_NAMES],
            "variants": found.variants,
            "cameras": data["cameras"],
            "lights": found.lights[:MOST_NAMES],
            "animations": found.animations,
            "extensions": data["extensions"],
            "warnings": found.warnings,
        }
        for name, count in (("objects", len(objects)), ("materials", len(found.materials))):
            if count > MOST_NAMES:
                answer[f"{name}_left_out"] = count - MOST_NAMES
        return answer

    @tool
    async def compare(context: Context[Any], a: Job, b: Job) -> tuple[str, Image, Image]:
        """Compares two renders of the same size: do they differ by more than their noise?

        b is the reference. Answers in words, then with both images.
        """
        client = client_of(context)
        jobs = [await client.job(each) for each in (a, b)]
        result = await client.compare(*jobs)
        bias = result.bias
        verdict = "the means differ" if bias.low > 0 or bias.high < 0 else "they may be equal"
        lines = [
            f"Mean of a - b: {bias.value:.3g} (95%: {bias.low:.3g} to {bias.high:.3g}): {verdict}.",
            f"{percent(result.z_share_above_3)} of the pixels differ by more than three standard "
            "errors (0.27% would by noise alone).",
            f"FLIP {result.flip:.3f} (0: no visible difference), relMSE {result.relmse:.3g}.",
            *(f"{name}: {error_words(each.error)}" for name, each in zip("ab", jobs, strict=True)),
        ]
        return "\n".join(lines), await picture(jobs[0]), await picture(jobs[1])

    @tool
    async def improve(
        context: Context[Any], job: Job, error: Error | None = None, seconds: Seconds = 60,
    ) -> tuple[str, Image]:  # fmt: skip
        """Adds samples to a render until its error is small enough; nothing is thrown away.

        error: by default half of the present one. seconds: more time at most.
        """
        made = await client_of(context).job(job)
        before = error_words(made.error)
        target = made.error.relative / 2 if error is None else error
        if target != target:
            raise ValueError("the error of this render is not known: give one")
        spent = made.progress.elapsed_seconds
        await made.extend(relative_error=target, seconds=spent + seconds)
        await followed(made, context)
        return f"Before: {before}\n{job_words(made)}", await picture(made)

    return host


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m tessera_render.mcp",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--server", help="address of Tessera; default: TESSERA_SERVER")
    parser.add_argument("--key", help="its access key; default: TESSERA_KEY")
    parser.add_argument("--port", type=int, help="listen on this port of 127.0.0.1, path /mcp")
    parser.add_argument("--files", type=Path, help="with --port: folder whose files may be read")
    given = parser.parse_args(arguments)
    if given.port is None:
        if given.files:
            parser.error("--files is for --port")
        make_server(given.server, given.key).run("stdio")
    else:
        host = make_server(given.server, given.key, any_file=False, files=given.files)
        host.run("streamable-http", host="127.0.0.1", port=given.port)


if __name__ == "__main__":
    main()
