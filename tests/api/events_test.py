"""The event stream: order, numbers, resumption."""

import time

from harness import ApiTest, EventStream, job_body, png_size, tile_places


def number(event):
    stream, seq = event.id.split("-")
    return stream, int(seq)


def big_job(server, samples=65536):
    body = job_body(samples=samples)
    body["film"] = {"width": 96, "height": 64, "layers": []}
    return server.submit(body)["id"]


class StreamFromTheStart(ApiTest):
    """Streams opened before their job starts."""

    FLAGS = ("--max-running", "1")

    def test_reports_a_job_from_snapshot_to_end(self):
        let_go = self.hold()
        job = big_job(self.server, 48)
        with EventStream(self.server, job) as stream:
            let_go()
            self.assertEqual(stream.status, 200)
            self.assertEqual(stream.headers["Content-Type"].split(";")[0], "text/event-stream")
            events = stream.all()
        self.assertEqual(events[0].name, "snapshot")
        self.assertEqual(events[0].json()["id"], job)
        self.assertEqual(events[-1].name, "end")
        names = {event.name for event in events}
        self.assertLessEqual({"snapshot", "state", "tile", "end"}, names)
        self.assertLessEqual(names, {"snapshot", "state", "progress", "tile", "warning", "end"})
        end = events[-1].json()
        done = self.server.job(job)
        self.assertEqual(end["state"], "finished")
        self.assertEqual(end["film_digest"], done["film_digest"])
        ids = [number(event) for event in events]
        self.assertEqual(len({stream for stream, _ in ids}), 1)
        self.assertEqual([seq for _, seq in ids], sorted(seq for _, seq in ids))
        for event in events:
            self.assertRegex(event.id, "^[0-9a-z]+-[0-9]+$")

    def test_tiles_cover_the_film_and_their_urls_work(self):
        let_go = self.hold()
        job = big_job(self.server, 16)
        with EventStream(self.server, job) as stream:
            let_go()
            tiles = [event.json() for event in stream if event.name == "tile"]
        places = {(t["x"], t["y"], t["width"], t["height"]) for t in tiles}
        self.assertEqual(places, tile_places(0, 0, 96, 64))
        newest = {}
        for tile in tiles:
            self.assertEqual(
                set(tile), {"x", "y", "width", "height", "revision", "samples", "error", "url"}
            )
            place = (tile["x"], tile["y"])
            self.assertGreater(tile["revision"], newest.get(place, {"revision": 0})["revision"])
            newest[place] = tile
        for tile in newest.values():
            self.assertEqual(tile["samples"], 16)
            picture = self.server.get(tile["url"])
            self.assertEqual(png_size(picture.body)[:2], (tile["width"], tile["height"]))


class Events(ApiTest):
    def big(self, samples=65536):
        return big_job(self.server, samples)

    def test_sends_progress_at_most_twice_a_second(self):
        job = self.big()
        times = []
        with EventStream(self.server, job) as stream:
            for event in stream:
                if event.name == "progress":
                    times.append(time.monotonic())
                    progress = event.json()["progress"]
                    self.assertLess(progress["fraction"], 1)
                if len(times) == 4:
                    break
        self.server.post(f"/v1/jobs/{job}/cancel")
        # Three intervals of half a second each; their sum hardly depends on the latency of the
        # reader.
        self.assertGreater(times[-1] - times[0], 1.2)

    def test_reports_a_patch(self):
        job = self.big()
        with EventStream(self.server, job) as stream:
            events = iter(stream)
            next(events)
            self.server.request("PATCH", f"/v1/jobs/{job}", {"paused": True})
            for event in events:
                if event.name == "state" and event.json()["state"] == "paused":
                    break
            self.server.post(f"/v1/jobs/{job}/cancel")
            rest = list(events)
        self.assertEqual((rest[-1].name, rest[-1].json()["state"]), ("end", "cancelled"))
        self.assertEqual(rest[-1].json()["stop_reason"], "cancelled")

    def test_sends_nothing_after_the_end(self):
        for _ in range(5):
            job = self.big()
            with EventStream(self.server, job) as stream:
                events = iter(stream)
                for event in events:
                    if event.name == "tile":
                        break
                self.server.post(f"/v1/jobs/{job}/cancel")
                rest = list(events)
            self.assertEqual([e.name for e in rest].index("end"), len(rest) - 1)

    def test_resuming_before_an_older_end_gets_the_newer_one(self):
        job = self.big(4)
        with EventStream(self.server, job) as stream:
            early = next(iter(stream))
        self.server.wait(job)
        self.server.post(f"/v1/jobs/{job}/extend", {"stop": {"samples_per_pixel": 64}})
        with EventStream(self.server, job, last=early.id) as stream:
            events = stream.all()
        self.assertEqual([e.name for e in events].count("end"), 1)
        self.assertEqual(events[-1].json()["film_digest"], self.server.job(job)["film_digest"])

    def test_sends_the_warnings_of_the_submission(self):
        job = self.server.submit(job_body(samples=7))
        with EventStream(self.server, job["id"]) as stream:
            first = next(iter(stream)).json()
        self.assertTrue(first["warnings"])

    def test_last_event_id_resumes_without_a_gap(self):
        job = self.big()
        with EventStream(self.server, job) as stream:
            seen = []
            for event in stream:
                seen.append(event)
                if len(seen) == 8:
                    break
        self.server.request("PATCH", f"/v1/jobs/{job}", {"name": "missed"})
        self.server.request("PATCH", f"/v1/jobs/{job}", {"stop": {"samples_per_pixel": 2}})
        self.server.wait(job)
        with EventStream(self.server, job, last=seen[-1].id) as stream:
            events = stream.all()
        self.assertEqual(events[0].name, "snapshot")
        self.assertEqual(events[-1].name, "end")
        after = number(seen[-1])[1]
        for event in events[1:]:
            self.assertGreater(number(event)[1], after)
        self.assertEqual(sum(event.name == "end" for event in events), 1)
        self.assertGreaterEqual(sum(event.name == "state" for event in events), 3)

    def test_first_connection_to_a_finished_job_gets_snapshot_and_end(self):
        job = self.server.render(job_body())["id"]
        with EventStream(self.server, job) as stream:
            events = stream.all()
        self.assertEqual([event.name for event in events], ["snapshot", "end"])
        self.assertEqual(events[0].json()["state"], "finished")
        self.assertLess(number(events[0])[1], number(events[1])[1])

    def test_only_the_end_itself_gives_204(self):
        job = self.server.render(job_body())["id"]
        with EventStream(self.server, job) as stream:
            snapshot, end = stream.all()
        with EventStream(self.server, job, last=end.id) as stream:
            self.assertEqual(stream.status, 204)
        for last in (snapshot.id, "zz-1", "nonsense", end.id + "0"):
            with EventStream(self.server, job, last=last) as stream:
                self.assertEqual(stream.status, 200, last)
                names = [event.name for event in stream]
            self.assertIn("snapshot", names)
            self.assertEqual(names[-1], "end", last)

    def test_extended_job_has_another_end(self):
        job = self.server.render(job_body(samples=4))["id"]
        with EventStream(self.server, job) as stream:
            first_end = stream.all()[-1]
        self.server.post(f"/v1/jobs/{job}/extend", {"stop": {"samples_per_pixel": 8}})
        self.server.wait(job)
        with EventStream(self.server, job, last=first_end.id) as stream:
            self.assertEqual(stream.status, 200)
            events = stream.all()
        self.assertEqual(events[-1].name, "end")
        self.assertNotEqual(events[-1].id, first_end.id)

    def test_broken_stream_is_harmless(self):
        job = self.big()
        for _ in range(10):
            with EventStream(self.server, job) as stream:
                next(iter(stream))
        self.server.post(f"/v1/jobs/{job}/cancel")
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            line = next(line for line in self.server.get("/metrics").body.decode().splitlines()
                        if line.startswith("tessera_streams "))
            if float(line.split()[1]) == 0:
                return
            time.sleep(0.05)
        self.fail(line)


class StreamLimit(ApiTest):
    FLAGS = ("--max-streams", "2")

    def test_answers_with_one_overloaded_event_at_the_limit(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        with EventStream(self.server, job) as one, EventStream(self.server, job) as two:
            next(iter(one)), next(iter(two))
            with EventStream(self.server, job) as three:
                self.assertEqual(three.status, 200)
                events = three.all()
            self.assertEqual([event.name for event in events], ["overloaded"])
            self.assertGreater(events[0].retry, 0)
            self.assert_problem(self.server.get(f"/v1/jobs/{job}/tiles"), 503)
            self.assertEqual(self.server.get(f"/v1/jobs/{job}").status, 200)
        self.server.post(f"/v1/jobs/{job}/cancel")
