"""Submit, wait, image and upload with a client of openapi-python-client: generated_tour.py URL."""

import io
import sys

from generated.api.jobs import create_job, get_job
from generated.api.results import get_image_in_format
from generated.api.scenes import create_scene, get_scene, get_scene_gltf
from generated.client import Client
from generated.models.get_image_in_format_format import GetImageInFormatFormat
from generated.models.job_request import JobRequest
from generated.models.job_request_film import JobRequestFilm
from generated.models.job_request_stop import JobRequestStop
from generated.models.job_state import JobState
from generated.types import File

client = Client(base_url=sys.argv[1], raise_on_unexpected_status=True)

# Only the scene is required and sent: the server's defaults apply.
assert JobRequest(scene="cornell-box").to_dict() == {"scene": "cornell-box"}
request = JobRequest(
    scene="cornell-box",
    film=JobRequestFilm(width=48, height=32),
    stop=JobRequestStop(samples_per_pixel=4),
)
job = create_job.sync(client=client, body=request)
assert job.spec.integrator.max_depth > 0 and job.spec.film.width == 48, job

while job.state not in (JobState.FINISHED, JobState.FAILED):
    job = get_job.sync(job.id, client=client, wait=20)
assert job.state == JobState.FINISHED and job.error.relative > 0, job

image = get_image_in_format.sync(job.id, GetImageInFormatFormat.PNG, client=client, exposure=1)
assert image.payload.read(8) == b"\x89PNG\r\n\x1a\n", image

glb = get_scene_gltf.sync("cornell-box", client=client).payload.read()
assert glb[:4] == b"glTF"
scene = create_scene.sync(client=client, body=File(payload=io.BytesIO(glb)), name="box.glb")
box = get_scene.sync("cornell-box", client=client)
assert scene.name == "box.glb" and scene.triangles == box.triangles > 0, scene

refused = create_job.sync(client=client, body=JobRequest(scene="nowhere"))
assert refused.status == 404 and refused.title, refused
