"""AsyncClient: a server, with calls to be awaited."""

from __future__ import annotations

import asyncio
import time
import warnings
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx

from . import _upload, models
from ._calls import (
    JobQuery,
    batch_call,
    comparison_call,
    is_offered,
    lab_call,
    lab_line,
    lab_run,
    merge_call,
    not_offered,
    scene_id_of,
    wants_upload,
)
from ._wire import (
    Address,
    Call,
    Json,
    Params,
    Retry,
    conclude,
    is_loopback,
    pause_before_retry,
    segment,
    submit_call,
    unreachable,
)
from .async_batch import AsyncBatch
from .async_job import AsyncJob
from .errors import MethodNotAllowed, MissingFiles, NotFound, problem_of, shown_address
from .options import JobOptions, make_request
from .results import Comparison, LabPoint, LabRun, Scene, ServerInfo

if TYPE_CHECKING:
    from typing_extensions import Unpack

Pathish = str | PathLike[str]


class AsyncClient:
    """A connection to one server; a context manager.

    server: http://HOST[:PORT], else TESSERA_SERVER, else http://127.0.0.1:8080. key: bearer token,
    else TESSERA_KEY, else none. timeout: seconds to wait for a response (uploads and long polls
    have their own). compressed: request compressed tiles; None: unless the server is on this
    machine. transport: an httpx transport, for tests.
    """

    def __init__(
        self, server: str | None = None, key: str | None = None, *, timeout: float = 30.0,
        retry: Retry | None = None, compressed: bool | None = None,
        transport: httpx.AsyncBaseTransport | None = None,
    ) -> None:  # fmt: skip
        address = Address.of(server, key)
        self.server, self.key = address.server, address.key
        self.retry = retry or Retry()
        self.compressed = not is_loopback(self.server) if compressed is None else compressed
        self._http = httpx.AsyncClient(transport=transport, **address.settings(timeout))

    async def __aenter__(self) -> AsyncClient:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        """Closes all connections. Jobs continue."""
        await self._http.aclose()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {shown_address(self.server)}>"

    # Reading from the server.

    async def info(self) -> ServerInfo:
        return ServerInfo(await self.ask(Call("GET", "/v1/server")))

    async def scene(self, scene_id: str) -> Scene:
        """Returns a scene by id or built-in name."""
        data = await self.ask(Call("GET", f"/v1/scenes/{segment(scene_id)}", timeout_s=120))
        return Scene(str(data["id"]), data)

    async def scenes(self, limit: int | None = None) -> AsyncIterator[Scene]:
        """Yields uploaded scenes, newest first; requests pages as needed."""
        async for data in self._pages("/v1/scenes", {}, "scenes", limit):
            yield Scene(str(data["id"]), data)

    async def delete_scene(self, scene: Scene | str) -> None:
        """Deletes a scene. Conflict while a job uses it."""
        await self.send(Call("DELETE", f"/v1/scenes/{segment(scene_id_of(scene))}"))

    async def scene_glb(self, name: str) -> bytes:
        """Returns a built-in scene as GLB."""
        headers = {"Accept": "model/gltf-binary"}
        call = Call("GET", f"/v1/scenes/{segment(name)}/gltf", headers=headers)
        response = await self.send(call)
        return response.content

    # Uploads and submissions.

    async def upload(self, scene: Pathish | bytes, *, strict: bool = False) -> Scene:
        """Uploads a scene: .glb, .gltf, .zip, a folder with a glTF, or the bytes of a GLB or zip.

        Also .stl, .ply, .3mf and .obj with the materials and textures beside it, which the server
        converts. Does not send files that the server has already. strict: files with faults are
        refused instead of mended with `warnings`.
        """
        if isinstance(scene, bytes):
            suffix = _upload.bytes_suffix(scene)
            return await self._scene(_upload.single_file_call(scene, suffix, strict))
        path = _upload.scene_file(scene)
        suffix = path.suffix.lower()
        try:
            return await self._scene(_upload.single_file_call(path, suffix, strict))
        except MissingFiles as problem:
            missing = _upload.missing_files(problem)
            if suffix == ".zip" or not missing:
                raise
        return await self._upload_with_files(path, missing, strict)

    async def _upload_with_files(self, path: Path, missing: list[str], strict: bool) -> Scene:
        """Sends the files beside a document that the server asks for, until it asks for no more."""
        document = await self.upload_asset(path)
        files: dict[str, str] = {}
        while True:
            for name in missing:
                files[name] = await self.upload_asset(_upload.side_file(path, name))
            try:
                call = _upload.scene_from_assets_call(document, files, path.name, strict)
                return await self._scene(call)
            except MissingFiles as problem:
                missing = _upload.missing_files(problem)
                if not missing or files.keys() & set(missing):
                    raise

    async def upload_asset(self, content: Pathish | bytes) -> str:
        """Uploads any file, e.g. an environment map. Returns its id, the sha256 of the content."""
        source = content if isinstance(content, bytes) else Path(content)
        asset_id = await asyncio.to_thread(_upload.sha256_of, source)
        known = await self.send(_upload.find_asset_call(asset_id))
        if known.status_code == 404:
            await self.send(_upload.put_asset_call(asset_id, source))
        return asset_id

    async def submit(self, scene: Scene | Pathish, **options: Unpack[JobOptions]) -> AsyncJob:
        """Submits a job. scene: built-in name, id, Scene, or a path, which is uploaded first.

        See JobOptions for the options. Never creates two jobs, even if requests are repeated.
        """
        return AsyncJob(self, await self.ask(submit_call(await self._request(scene, options))))

    async def estimate(
        self, scene: Scene | Pathish, **options: Unpack[JobOptions],
    ) -> models.DryRun:  # fmt: skip
        """Checks a job and estimates its cost without submitting it."""
        call = submit_call(await self._request(scene, options), dry_run=True)
        dry_run: models.DryRun = await self.ask(call)
        return dry_run

    # Batches.

    async def submit_batch(
        self, scene: Scene | Pathish | None, matrix: Mapping[str, Sequence[Any]], *,
        pattern: str = "", webhook: str | None = None, **options: Unpack[JobOptions],
    ) -> AsyncBatch:  # fmt: skip
        """Submits a job for each combination of the matrix's values: all of them or none.

        matrix: paths of members of the job request, each with its values, such as
        {"camera.orbit.theta_degrees": [0, 90], "variant": ["red", "blue"]}. pattern: of the jobs'
        names, such as "{variant}-{theta_degrees}". webhook: an address that is called when all have
        ended. scene, options: as for submit(); scene may be None if the matrix has it.
        """
        request = await self._request(scene if scene is not None else "", options)
        if scene is None:
            request.pop("scene")
        call = batch_call(request, matrix, pattern, webhook)
        return AsyncBatch(self, await self.ask(call))

    async def batch(self, batch_id: str) -> AsyncBatch:
        return AsyncBatch(self, await self.ask(Call("GET", f"/v1/batches/{segment(batch_id)}")))

    async def batches(self, limit: int | None = None) -> AsyncIterator[models.BatchSummary]:
        """Yields batches without their jobs, newest first; requests pages as needed."""
        async for data in self._pages("/v1/batches", {}, "batches", limit):
            yield data

    # Jobs.

    async def job(self, job_id: str) -> AsyncJob:
        return AsyncJob(self, await self.ask(Call("GET", f"/v1/jobs/{segment(job_id)}")))

    async def jobs(
        self, *, state: str | Sequence[str] | None = None,
        label: str | Sequence[str] | Mapping[str, str] | None = None, limit: int | None = None,
    ) -> AsyncIterator[AsyncJob]:  # fmt: skip
        """Yields jobs, newest first; requests pages as needed.

        state: one or several. label: `key`, `key=value`, several of them, or a mapping; all must
        match.
        """
        params = JobQuery(state, label).params()
        async for data in self._pages("/v1/jobs", params, "jobs", limit):
            yield AsyncJob(self, data)

    # Comparisons and experiments.

    async def compare(
        self, a: AsyncJob | Pathish, b: AsyncJob | Pathish, *, a_denoise: str | None = None,
        b_denoise: str | None = None,
    ) -> Comparison:  # fmt: skip
        """Compares two jobs, or a job and an image (a file, which is uploaded, or an asset id).

        a_denoise, b_denoise: mixed or full for a job's denoised image. NotOffered if the server's
        build has no comparisons.
        """
        sides = [await self.upload_asset(s) if wants_upload(s) else s for s in (a, b)]
        try:
            return Comparison.of(await self.ask(comparison_call(sides, a_denoise, b_denoise)))
        except (NotFound, MethodNotAllowed) as error:
            if await self._offers("/v1/comparisons"):
                raise
            raise not_offered("comparisons") from error

    async def compare_meters(self, a: AsyncJob, b: AsyncJob) -> models.MeterComparison:
        """Compares the meters of two jobs point by point: a - b in lux, with intervals.

        Conflict if they have different points, or no reading yet.
        """
        params = {"a": a.id, "b": b.id}
        data: models.MeterComparison = await self.ask(Call("GET", "/v1/comparisons", params=params))
        return data

    async def merge(self, *films: AsyncJob | Pathish) -> AsyncJob:
        """Merges films into a finished job: jobs that have ended, or files that film() wrote.

        Their jobs may differ only in seed, replicates, stop rules and names; Conflict if they have
        common samples.
        """
        sides = [await self.upload_asset(f) if wants_upload(f) else f for f in films]
        return AsyncJob(self, await self.ask(merge_call(sides)))

    async def lab(
        self, experiment: str, *, on_point: Callable[[LabPoint], object] | None = None,
        **members: Any,
    ) -> LabRun:  # fmt: skip
        """Runs an experiment of the laboratory to its end.

        members: estimator, sampler, n (list), replicates, seed, params. on_point: called with each
        line as it arrives. NotOffered if the server's build has no laboratory.
        """
        lines: list[Json] = []
        try:
            async with self.stream(lab_call(experiment, members)) as response:
                async for line in response.aiter_lines():
                    lab_line(line, lines, on_point)
        except (NotFound, MethodNotAllowed) as error:
            raise not_offered("laboratory") from error
        except httpx.TransportError as error:
            raise unreachable(self.server, error) from error
        return lab_run(lines)

    # Requests.

    async def send(self, call: Call, *, patient: bool = False) -> httpx.Response:
        """Sends a request, repeatedly if necessary; raises unless it succeeds."""
        retry = self.retry.endless() if patient else self.retry
        tries, began = 0, time.monotonic()
        while True:
            tries += 1
            content = call.content
            body = _upload.async_pieces(content) if isinstance(content, Path) else content
            outcome: httpx.Response | httpx.TransportError
            try:
                outcome = await self._http.send(call.build(self._http, body))
            except httpx.TransportError as error:
                outcome = error
            pause = pause_before_retry(call, outcome, tries, time.monotonic() - began, retry)
            if pause is None:
                return conclude(call, outcome, tries, self.server)
            await asyncio.sleep(pause)

    async def ask(self, call: Call, *, patient: bool = False) -> Any:
        """Calls send() and returns the JSON object of the response, in the operation's schema."""
        response = await self.send(call, patient=patient)
        return response.json()

    @asynccontextmanager
    async def stream(self, call: Call) -> AsyncIterator[httpx.Response]:
        """Opens a response whose body is read as it arrives. Makes a single attempt."""
        response = await self._http.send(call.build(self._http, call.content), stream=True)
        try:
            if not response.is_success:
                await response.aread()
                raise problem_of(response)
            yield response
        finally:
            await response.aclose()

    async def _offers(self, path: str) -> bool:
        return is_offered(path, await self.ask(Call("GET", "/openapi.json")))

    async def _scene(self, call: Call) -> Scene:
        data = await self.ask(call)
        return Scene(str(data["id"]), data)

    async def _request(self, scene: Scene | Pathish, options: Mapping[str, Any]) -> Json:
        given = dict(options)
        if not isinstance(scene, Scene) and _upload.looks_like_file(scene):
            given.setdefault("name", Path(scene).name)
            scene = await self.upload(scene)
        environment = given.get("environment")
        if isinstance(environment, str | PathLike):
            given["environment"] = {"asset": await self.upload_asset(environment)}
        return make_request(scene_id_of(scene), given)

    async def _pages(
        self, path: str, params: Params, member: str, limit: int | None,
    ) -> AsyncIterator[Any]:  # fmt: skip
        cursor, left = "", limit
        while left is None or left > 0:
            page = dict(params) | {"limit": 200 if left is None else min(left, 200)}
            if cursor:
                page["cursor"] = cursor
            data = await self.ask(Call("GET", path, params=page))
            for job_id in data.get("damaged", ()):
                text = f"the stored record of job {job_id} is damaged; it can only be deleted"
                warnings.warn(text, stacklevel=3)
            for item in data[member]:
                yield item
            left = None if left is None else left - len(data[member])
            cursor = data.get("next") or ""
            if not cursor:
                return
