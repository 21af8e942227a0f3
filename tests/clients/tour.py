"""A tour with the Python client of openapi-generator: tour.py URL."""

import sys

import openapi_client as api
from openapi_client.exceptions import NotFoundException, UnprocessableEntityException

client = api.ApiClient(api.Configuration(host=sys.argv[1]))
jobs, scenes, results = api.JobsApi(client), api.ScenesApi(client), api.ResultsApi(client)

assert api.ServiceApi(client).get_server().version
glb = scenes.get_scene_gltf("cornell-box")
assert glb[:4] == b"glTF"
scene = scenes.create_scene(glb, name="box.glb", _content_type="model/gltf-binary")
assert scene.name == "box.glb" and scene.triangles > 0, scene

job = jobs.create_job(api.JobRequest(
    scene=scene.id,
    seed=9007199254740991,
    film=api.JobRequestFilm(width=48, height=32,
                            crop=api.JobRequestFilmCrop(x=8, y=0, width=32, height=32)),
    stop=api.JobRequestStop(samples_per_pixel=4)))
assert job.spec.medium is None and job.spec.film.crop.width == 32, job
assert job.spec.integrator.max_depth > 0 and job.spec.seed == 9007199254740991, job
for _ in range(12):
    job = jobs.get_job(job.id, wait=10)
    if job.state == "finished":
        break
assert job.state == "finished" and job.error.relative > 0 and job.statistics.rays > 0, job

picture = results.get_image_in_format(job.id, "png")
assert picture[:8] == b"\x89PNG\r\n\x1a\n"
assert jobs.patch_job(job.id, api.JobPatch(name="tour")).spec.name == "tour"
assert jobs.list_jobs(limit=10).jobs[0].id == job.id
estimate = jobs.create_job(api.JobRequest(scene="cornell-box"), dry_run=True)
assert estimate.actual_instance.spec.film.width == 960, estimate

try:
    jobs.create_job(api.JobRequest(scene="nowhere"))
    sys.exit("an unknown scene was accepted")
except NotFoundException as error:
    assert error.data.status == 404 and error.data.title, error
try:
    jobs.create_job(api.JobRequest(scene="cornell-box", name="\n"))
    sys.exit("a name with a line break was accepted")
except UnprocessableEntityException as error:
    assert error.data.errors[0].pointer == "/name", error
