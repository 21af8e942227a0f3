"""The client without a server: retries, exceptions, and the requests it sends."""

import asyncio
import inspect
import json
import os
import pickle
import unittest
from unittest import mock

import httpx

import tessera_render
from tessera_render import AsyncClient, AsyncJob, Client, Job, Retry

JOB = {"id": "0b1e7c1c-0000-4000-8000-000000000001", "state": "rendering",
       "spec": {"scene": "glass", "film": {"width": 8, "height": 4, "crop": None}}}
FAST = Retry(attempts=3, first_delay_s=0.001, longest_delay_s=0.002)


class Script:
    """Answers requests from a list: a status, (status, body, headers), or an exception; records the
    requests."""

    def __init__(self, *answers):
        self.answers = list(answers)
        self.requests = []

    def __call__(self, request):
        request.read()
        self.requests.append(request)
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        status, body, headers = answer if isinstance(answer, tuple) else (answer, JOB, {})
        if isinstance(body, bytes):
            return httpx.Response(status, content=body, headers=headers)
        return httpx.Response(status, json=body, headers=headers)

    def client(self, **options):
        return Client("http://tessera.test", transport=httpx.MockTransport(self),
                      **{"retry": FAST, **options})


def problem(status, **members):
    body = {"type": "about:blank", "title": "Title", "status": status, "detail": "Why.",
            "instance": "/v1/x", **members}
    return status, body, {"Content-Type": "application/problem+json", "X-Request-Id": "r-1"}


LOST = httpx.ReadError("reset")
REFUSED = httpx.ConnectError("refused")


class Retries(unittest.TestCase):
    def test_retries_a_submission_with_the_same_key_and_body(self):
        script = Script(REFUSED, LOST, 201)
        script.client().submit("glass", samples_per_pixel=4)
        keys = {request.headers["Idempotency-Key"] for request in script.requests}
        bodies = {request.content for request in script.requests}
        self.assertEqual((len(script.requests), len(keys), len(bodies)), (3, 1, 1))

    def test_two_submissions_have_two_keys(self):
        script = Script(201, 201)
        client = script.client()
        client.submit("glass")
        client.submit("glass")
        self.assertEqual(len({r.headers["Idempotency-Key"] for r in script.requests}), 2)

    def test_gives_up_after_the_maximum_number_of_attempts(self):
        script = Script(*[REFUSED] * 9)
        with self.assertRaisesRegex(tessera_render.ConnectionFailed, "tessera.test.*refused"):
            script.client().info()
        self.assertEqual(len(script.requests), 3)

    def test_does_not_retry_an_extension_that_may_have_arrived(self):
        script = Script(200, LOST, 202)
        job = script.client().job(JOB["id"])
        with self.assertRaises(tessera_render.ConnectionFailed):
            job.extend(samples_per_pixel=8)
        self.assertEqual(len(script.requests), 2)

    def test_retries_an_extension_that_was_not_sent(self):
        script = Script(200, REFUSED, 202)
        script.client().job(JOB["id"]).extend(samples_per_pixel=8)
        self.assertEqual(
            json.loads(script.requests[-1].content), {"stop": {"samples_per_pixel": 8}}
        )

    def test_answers_of_a_proxy_repeat_only_what_may_be_repeated(self):
        for status in (502, 504):
            script = Script(200, (status, b"<html>", {}), 202)
            job = script.client().job(JOB["id"])
            with self.assertRaises(tessera_render.ServerFault):
                job.extend(samples_per_pixel=8)
            self.assertEqual(len(script.requests), 2, "it may have taken effect")
            script = Script((status, b"<html>", {}), 200)
            script.client().job(JOB["id"])
            self.assertEqual(len(script.requests), 2)

    def test_retries_503_and_then_reports_it(self):
        script = Script(*[problem(503)] * 3)
        with self.assertRaises(tessera_render.Unavailable):
            script.client().info()
        self.assertEqual(len(script.requests), 3)

    def test_retry_after_is_a_lower_bound(self):
        status, body, headers = problem(503)
        script = Script((status, body, {**headers, "Retry-After": "7"}), 200)
        with mock.patch("tessera_render._client.time.sleep") as sleep:
            script.client().job(JOB["id"])
        self.assertEqual([call.args[0] for call in sleep.call_args_list], [7.0])

    def test_delays_grow_to_a_limit_and_are_randomised(self):
        retry = Retry(first_delay_s=1, longest_delay_s=4)
        for tries, longest in ((1, 1), (2, 2), (3, 4), (9, 4)):
            drawn = [retry.pause_s(tries) for _ in range(200)]
            self.assertTrue(all(longest / 2 <= pause <= longest for pause in drawn))
            self.assertGreater(len(set(drawn)), 100)

    def test_does_not_retry_other_errors(self):
        for status in (400, 404, 409, 422, 500):
            script = Script(problem(status), 200)
            with self.assertRaises(tessera_render.Problem):
                script.client().info()
            self.assertEqual(len(script.requests), 1)

    def test_404_after_a_lost_deletion_counts_as_success(self):
        script = Script(200, LOST, problem(404))
        script.client().job(JOB["id"]).delete()
        script = Script(200, problem(404))
        with self.assertRaises(tessera_render.NotFound):
            script.client().job(JOB["id"]).delete()

    def test_wait_tolerates_more_failures_than_a_request(self):
        script = Script(201, *[REFUSED] * 20, (200, {**JOB, "state": "finished"}, {}))
        job = script.client().submit("glass")
        self.assertEqual(job.wait().state, "finished")

    def test_wait_gives_up_after_its_patience(self):
        retry = Retry(first_delay_s=0.01, longest_delay_s=0.02, patience_s=0.1)
        script = Script(201, *[REFUSED] * 100)
        job = script.client(retry=retry).submit("glass")
        with self.assertRaises(tessera_render.ConnectionFailed):
            job.wait()

    def test_asynchronous_client_follows_the_same_rules(self):
        script = Script(LOST, problem(503), 201)

        async def run():
            transport = httpx.MockTransport(script)
            async with AsyncClient(
                "http://tessera.test", retry=FAST, transport=transport
            ) as client:
                await client.submit("glass")

        asyncio.run(run())
        self.assertEqual(len({r.headers["Idempotency-Key"] for r in script.requests}), 1)
        self.assertEqual(len(script.requests), 3)


class Problems(unittest.TestCase):
    def test_statuses_have_their_exceptions(self):
        kinds = {400: tessera_render.BadRequest, 401: tessera_render.Unauthorized,
                 403: tessera_render.Forbidden, 404: tessera_render.NotFound,
                 405: tessera_render.MethodNotAllowed, 406: tessera_render.NotAcceptable,
                 409: tessera_render.Conflict, 410: tessera_render.Gone,
                 412: tessera_render.PreconditionFailed, 413: tessera_render.TooLarge,
                 415: tessera_render.UnsupportedMedia, 421: tessera_render.Misdirected,
                 422: tessera_render.Invalid, 424: tessera_render.MissingFiles,
                 429: tessera_render.TooManyRequests, 500: tessera_render.ServerFault,
                 503: tessera_render.Unavailable, 507: tessera_render.NoSpace}
        for status, kind in kinds.items():
            with self.assertRaises(tessera_render.Problem) as caught:
                Script(*[problem(status)] * 3).client().info()
            self.assertIs(type(caught.exception), kind)
            self.assertEqual(caught.exception.status, status)
            self.assertEqual(caught.exception.request_id, "r-1")

    def test_fault_contains_its_pointer(self):
        errors = [{"pointer": "/film/width", "detail": "0 is outside [1, 16384]"}]
        with self.assertRaisesRegex(tessera_render.Invalid, "/film/width: 0 is outside") as caught:
            Script(problem(422, errors=errors)).client().info()
        self.assertEqual(caught.exception.errors,
                         [tessera_render.FieldError("/film/width", "0 is outside [1, 16384]")])
        copy = pickle.loads(pickle.dumps(caught.exception))
        self.assertEqual((type(copy), str(copy)), (tessera_render.Invalid, str(caught.exception)))

    def test_reports_an_error_page_of_a_proxy(self):
        with self.assertRaisesRegex(tessera_render.ServerFault, "502 Bad Gateway: <html>"):
            Script(*[(502, b"<html>", {})] * 3).client().info()


    def test_redirects_name_their_target_without_a_password(self):
        target = {"Location": "https://u:secretpw@render.example.org/v1/server"}
        for status in (301, 307, 308):
            with self.assertRaisesRegex(
                tessera_render.Problem,
                r"it is at https://\*\*\*@render.example.org/v1/server; give",
            ):
                Script((status, b"<html>", target)).client().info()

    def test_addresses_are_shown_without_their_password(self):
        for address in ("ftp://u:secretpw@x", "u:secretpw@x", "http//u:secretpw@x"):
            with self.assertRaises(tessera_render.TesseraError) as caught:
                tessera_render.Client(address)
            self.assertNotIn("secretpw", str(caught.exception))
        client = tessera_render.Client("http://u:secretpw@127.0.0.1:1")
        self.assertNotIn("secretpw", repr(client))


class Requests(unittest.TestCase):
    def sent(self, scene="glass", **options):
        script = Script(201)
        script.client().submit(scene, **options)
        return json.loads(script.requests[0].content)

    def test_short_forms_become_members(self):
        body = self.sent(size=(8, 4), crop=(1, 2, 3, 2), layers=("depth",), relative_error=0.1,
                         confidence=0.9, seconds=5, integrator="path", camera="front",
                         sampler={"type": "sobol", "replicates": 4}, job_class="preview")
        self.assertEqual(body, {
            "scene": "glass", "class": "preview", "camera": {"name": "front"},
            "film": {"width": 8, "height": 4, "crop": {"x": 1, "y": 2, "width": 3, "height": 2},
                     "layers": ["depth"]},
            "stop": {"relative_error": 0.1, "confidence": 0.9, "seconds": 5},
            "integrator": {"type": "path"}, "sampler": {"type": "sobol", "replicates": 4}})

    def test_sends_only_given_members(self):
        self.assertEqual(self.sent(), {"scene": "glass"})
        self.assertEqual(self.sent(camera=None), {"scene": "glass"})
        self.assertEqual(self.sent(environment=None), {"scene": "glass", "environment": None})

    def test_size_is_two_numbers_or_a_string(self):
        for size in ((960, 540), [960, 540], "960x540", "960X540"):
            self.assertEqual(self.sent(size=size)["film"], {"width": 960, "height": 540})
        for size in ("big", "960", "960x", "9x5x4", "9.5x4", 960, (960,), (1, 2, 3), None):
            with self.assertRaisesRegex(ValueError, "960x540"):
                self.sent(size=size)

    def test_options_override_a_whole_request(self):
        base = {"film": {"width": 9, "height": 9}, "stop": {"seconds": 1}, "seed": 3}
        body = self.sent(request=base, size=(8, 4), samples_per_pixel=2)
        self.assertEqual(body["film"], {"width": 8, "height": 4})
        self.assertEqual(body["stop"], {"seconds": 1, "samples_per_pixel": 2})
        self.assertEqual(body["seed"], 3)
        self.assertEqual(base["film"]["width"], 9)

    def test_sends_unknown_options_to_the_server(self):
        self.assertEqual(self.sent(colour="red")["colour"], "red")

    def test_sends_the_key_with_every_request(self):
        script = Script((200, {}, {}), LOST, 201, 200, 202)
        client = script.client(key="secret")
        client.info()
        job = client.submit("glass")
        job.refresh()
        job.extend(samples_per_pixel=8)
        self.assertEqual(
            [request.headers["Authorization"] for request in script.requests],
            ["Bearer secret"] * 5,
        )

    def test_reads_server_and_key_from_the_environment(self):
        with mock.patch.dict(
            os.environ, {"TESSERA_SERVER": "http://there:99/", "TESSERA_KEY": "k"}
        ):
            self.assertEqual(Client().server, "http://there:99")
            self.assertEqual(Client("http://here:1").server, "http://here:1")
        with self.assertRaises(tessera_render.TesseraError):
            Client("there:99")

    def test_a_key_loses_the_line_break_of_its_file(self):
        script = Script((200, {}, {}))
        with mock.patch.dict(os.environ, {"TESSERA_KEY": "secret\n"}):
            script.client().info()
        self.assertEqual(script.requests[0].headers["Authorization"], "Bearer secret")

    def test_lists_follow_the_cursor_and_stop_at_the_limit(self):
        pages = [
            (200, {"jobs": [JOB, JOB], "next": "c2"}, {}),
            (200, {"jobs": [JOB], "next": None}, {}),
        ]
        script = Script(*pages)
        found = list(script.client().jobs(state=["queued", "paused"], label={"a": "b"}))
        self.assertEqual(len(found), 3)
        self.assertEqual(script.requests[0].url.params.get_list("state"), ["queued", "paused"])
        self.assertEqual(script.requests[0].url.params["label"], "a=b")
        self.assertEqual(script.requests[1].url.params["cursor"], "c2")
        script = Script(*pages)
        self.assertEqual(len(list(script.client().jobs(limit=2))), 2)
        self.assertEqual((len(script.requests), script.requests[0].url.params["limit"]), (1, "2"))

    def test_warns_of_jobs_whose_records_are_damaged(self):
        script = Script((200, {"jobs": [JOB], "damaged": ["j2"], "next": None}, {}))
        with self.assertWarnsRegex(UserWarning, "job j2 is damaged"):
            self.assertEqual(len(list(script.client().jobs())), 1)

    def test_requests_pages_only_when_needed(self):
        script = Script((200, {"jobs": [JOB], "next": "more"}, {}))
        next(script.client().jobs())
        self.assertEqual(len(script.requests), 1)


class BothClients(unittest.TestCase):
    def test_both_clients_have_the_same_calls_with_the_same_parameters(self):
        for one, other in ((Client, AsyncClient), (Job, AsyncJob)):
            self.assertEqual(self.calls(one), self.calls(other))

    @staticmethod
    def calls(kind):
        members = inspect.getmembers(kind, inspect.isfunction)
        return {
            name: [(p.name, p.kind, p.default) for p in inspect.signature(f).parameters.values()]
            for name, f in members
            if not name.startswith("_")
        }


COMPARISON = {"id": "c1", "mse": 0.5, "relmse": 0.25, "flip": 0.1,
              "bias": {"value": 0.01, "low": -0.02, "high": 0.04},
              "z": {"mean": 0.1, "variance": 1.1, "share_above_3": 0.003}, "links": {}}
LINES = [{"n": 4, "mean": 3.0, "rmse": 0.8, "standard_error": 0.1, "seconds": 0.01},
         {"n": 16, "mean": 3.1, "rmse": 0.4, "standard_error": 0.05, "seconds": 0.02},
         {"expected": -0.5, "slope": -0.52, "slope_interval": [-0.6, -0.45], "efficiency": 9,
          "verdict": "ok"}]
OTHER = "0b1e7c1c-0000-4000-8000-000000000002"


class Extras(unittest.TestCase):
    """Comparisons and the laboratory, in the documented format."""

    def test_reads_a_comparison(self):
        script = Script((201, COMPARISON, {}))
        comparison = script.client().compare(JOB["id"], OTHER)
        self.assertEqual(json.loads(script.requests[0].content), {"a": JOB["id"], "b": OTHER})
        self.assertEqual((comparison.relmse, comparison.bias.low, comparison.z_variance),
                         (0.25, -0.02, 1.1))

    def test_unknown_job_is_not_a_missing_feature(self):
        script = Script(problem(404), (200, {"paths": {"/v1/comparisons": {}}}, {}))
        with self.assertRaises(tessera_render.NotFound):
            script.client().compare(JOB["id"], OTHER)
        script = Script(problem(404), (200, {"paths": {}}, {}))
        with self.assertRaisesRegex(tessera_render.NotOffered, "comparisons"):
            script.client().compare(JOB["id"], OTHER)

    def test_reads_an_experiment_line_by_line(self):
        body = "".join(json.dumps(line) + "\n" for line in LINES).encode()
        script, seen = Script((200, body, {})), []
        run = script.client().lab("pi", n=[4, 16], seed=1, on_point=seen.append)
        self.assertEqual(json.loads(script.requests[0].content),
                         {"experiment": "pi", "n": [4, 16], "seed": 1})
        self.assertEqual([point.n for point in seen], [4, 16])
        self.assertEqual(run.points, tuple(seen))
        self.assertEqual((run.slope, run.verdict, run.data["efficiency"]), (-0.52, "ok", 9))

    def test_reports_an_experiment_that_breaks_off(self):
        point = json.dumps(LINES[0]).encode() + b"\n"
        for body in (b"", point, point + b'{"cancelled":true}\n'):
            with self.assertRaises(tessera_render.CorruptData):
                Script((200, body, {})).client().lab("pi")

    def test_reports_a_server_without_a_laboratory(self):
        with self.assertRaises(tessera_render.NotOffered):
            Script(problem(404)).client().lab("pi")
