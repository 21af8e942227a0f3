"""Several jobs on one event stream, and multipart image streams for a plain <img>."""

import unittest

from harness import ApiTest, EventStream, JobsStream, Stream, job_body, png_size, started


class StreamFromTheStart(ApiTest):
    """A stream opened before its jobs start."""

    FLAGS = ("--max-running", "1")

    def test_reports_every_job_from_snapshot_to_end(self):
        let_go = self.hold()
        jobs = [self.server.submit(job_body(samples=64))["id"] for _ in range(3)]
        with JobsStream(self.server, jobs) as stream:
            let_go()
            self.assertEqual(stream.headers["Content-Type"], "text/event-stream")
            told = {}
            for event in stream:
                told.setdefault(event.json()["job"], []).append(event)
        self.assertEqual(set(told), set(jobs))
        for job, events in told.items():
            names = [event.name for event in events]
            self.assertEqual((names[0], names[-1]), ("snapshot", "end"))
            self.assertEqual(names.count("end"), 1)
            self.assertEqual(events[0].json()["id"], job)
            self.assertEqual(events[-1].json()["film_digest"], self.server.job(job)["film_digest"])
            self.assertIn("tile", names)
            for event in events:
                if event.name == "tile":
                    self.assertTrue(event.json()["url"].startswith(f"/v1/jobs/{job}/image.png?"))


class Watch(ApiTest):
    def test_last_id_of_all_is_204(self):
        jobs = [self.server.render(job_body())["id"] for _ in range(2)]
        with JobsStream(self.server, jobs) as stream:
            last = stream.all()[-1].id
        with JobsStream(self.server, jobs, last=last) as stream:
            self.assertEqual(stream.status, 204)
        with JobsStream(self.server, jobs[:1], last=last) as stream:  # an id of other jobs
            self.assertEqual(stream.status, 200)
        with JobsStream(self.server, jobs, last="nonsense") as stream:
            self.assertEqual([e.name for e in stream], ["snapshot", "end"] * 2)

    def test_resumes_where_it_stopped(self):
        jobs = [self.server.submit(job_body(samples=65536))["id"] for _ in range(2)]
        last, seen = None, set()
        with JobsStream(self.server, jobs) as stream:
            for event in stream:
                last = event.id or last
                if event.name == "tile":
                    seen.add(event.json()["job"])
                if seen == set(jobs):
                    break
        for job in jobs:
            self.server.request("PATCH", f"/v1/jobs/{job}", {"name": "missed"})
        with JobsStream(self.server, jobs, last=last) as stream:
            missed = {}
            for event in stream:
                self.assertNotEqual(event.name, "reset")
                if event.name == "state":
                    missed.setdefault(event.json()["job"], event.json()["spec_version"])
                if set(missed) == set(jobs):
                    break
        self.assertEqual(set(missed.values()), {2})

    def test_invalid_list_of_jobs_is_422(self):
        job = self.server.render(job_body())["id"]
        for query in (
            "",
            "?jobs=",
            "?jobs=x",
            f"?jobs={job},",
            f"?jobs={job}&colour=1",
            "?jobs=" + ",".join(f"{n:08x}-0000-4000-8000-000000000000" for n in range(33)),
        ):
            self.assert_problem(self.server.get("/v1/events" + query), 422)
        self.assert_problem(
            self.server.get("/v1/events?jobs=00000000-0000-4000-8000-000000000000"), 404
        )

    def parts(self, stream):
        """The parts of a multipart answer as they arrive: (headers, body)."""
        boundary = stream.headers["Content-Type"].split("boundary=")[1]
        line = stream.response.readline()
        self.assertEqual(line, f"--{boundary}\r\n".encode())
        while True:
            headers = {}
            while True:
                line = stream.response.readline().strip()
                if not line:
                    break
                name, _, value = line.decode().partition(": ")
                headers[name] = value
            body = stream.response.read(int(headers["Content-Length"]))
            yield headers, body
            self.assertEqual(stream.response.readline(), b"\r\n")
            line = stream.response.readline()
            if line == f"--{boundary}--\r\n".encode():
                return
            self.assertEqual(line, f"--{boundary}\r\n".encode())

    def test_sends_images_until_the_end(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        self.server.wait_for_samples(job)
        with Stream(self.server, f"/v1/jobs/{job}/image?stream=1") as stream:
            self.assertTrue(stream.headers["Content-Type"].startswith("multipart/x-mixed-replace"))
            revisions = []
            for headers, body in self.parts(stream):
                self.assertEqual(headers["Content-Type"], "image/jpeg")
                self.assertEqual(body[:2], b"\xff\xd8")
                revisions.append(int(headers["X-Tessera-Revision"]))
                if len(revisions) == 2:
                    self.server.post(f"/v1/jobs/{job}/cancel")
        self.assertGreaterEqual(len(revisions), 2)
        self.assertEqual(revisions, sorted(set(revisions)))

    def test_sends_a_finished_image_once_in_the_requested_format(self):
        job = self.server.render(job_body())["id"]
        for name, kind in (("png", "image/png"), ("jpg", "image/jpeg"), ("exr", "image/x-exr")):
            path = f"/v1/jobs/{job}/image.{name}"
            with Stream(self.server, path, {"Accept": "multipart/x-mixed-replace"}) as stream:
                parts = list(self.parts(stream))
            self.assertEqual(len(parts), 1)
            self.assertEqual(parts[0][0]["Content-Type"], kind)
            self.assertEqual(parts[0][1], self.server.get(path).body)
        self.assertEqual(png_size(self.server.get(f"/v1/jobs/{job}/image.png").body)[:2], (48, 32))

    def test_clients_that_accept_everything_get_one_image(self):
        job = self.server.render(job_body())["id"]
        answer = self.server.get(f"/v1/jobs/{job}/image.png", {
            "Accept": "multipart/x-mixed-replace, image/png, application/problem+json"})
        self.assertEqual(answer.headers["Content-Type"], "image/png")

    def test_checks_an_image_stream_like_an_image(self):
        job = self.server.render(job_body())["id"]
        self.assert_problem(self.server.get(f"/v1/jobs/{job}/image?stream=2"), 422, "/stream")
        self.assert_problem(self.server.get(f"/v1/jobs/{job}/image.gif?stream=1"), 406)
        self.assert_problem(
            self.server.get(f"/v1/jobs/{job}/image?stream=1&max_size=0"), 422, "/max_size"
        )


class WatchOverRestarts(unittest.TestCase):
    def test_ids_of_several_jobs_remain_valid_after_a_kill(self):
        server = started(self, "--checkpoint", "0.3")
        done = server.render(job_body())["id"]
        running = server.submit(job_body(samples=65536))["id"]
        with JobsStream(server, [done, running]) as stream:
            for event in stream:
                last = event.id or last
                if event.name == "tile":
                    break
        server.request("PATCH", f"/v1/jobs/{running}", {"name": "missed"})
        server.kill()
        server.start()
        told = {done: [], running: []}
        with JobsStream(server, [done, running], last=last) as stream:
            for event in stream:
                told[event.json()["job"]].append(event.name)
                if "snapshot" in told[running]:
                    break
        self.assertEqual(told[done][-2:], ["snapshot", "end"])
        self.assertEqual(told[running][-2:], ["reset", "snapshot"])
        self.assertIn("state", told[running])
        server.post(f"/v1/jobs/{running}/cancel")
        with EventStream(server, running) as stream:
            self.assertEqual(stream.all()[-1].name, "end")


class TooManyStreams(ApiTest):
    FLAGS = ("--max-streams", "1")

    def test_answers_overloaded_at_the_limit(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        with JobsStream(self.server, [job]) as first:
            next(iter(first))
            with JobsStream(self.server, [job]) as second:
                events = second.all()
            self.assertEqual([e.name for e in events], ["overloaded"])
            self.assertGreater(events[0].retry, 0)
            self.assert_problem(self.server.get(f"/v1/jobs/{job}/image?stream=1"), 503)
