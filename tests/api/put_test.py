"""Jobs with a client-chosen id, lists in If-Match, and cost estimates."""

import unittest
import uuid

from harness import ApiTest, in_background, job_body, started


class ClientIds(ApiTest):
    def put(self, name, body, **headers):
        return self.server.request("PUT", f"/v1/jobs/{name}", body, headers)

    def test_repeated_put_creates_one_job(self):
        name = str(uuid.uuid4())
        first = self.put(name, job_body())
        self.assertEqual((first.status, first.json()["id"]), (201, name))
        self.assertEqual(first.headers["Location"], "/v1/jobs/" + name)
        self.assertTrue(first.headers["ETag"])
        again = self.put(name, job_body())
        self.assertEqual((again.status, again.json()["id"]), (200, name))
        self.assert_problem(self.put(name, job_body(samples=4)), 409)
        self.assertEqual(self.server.wait(name)["state"], "finished")
        self.assertEqual(self.put(name, job_body()).status, 200)
        listed = [job["id"] for job in self.server.get("/v1/jobs?limit=200").json()["jobs"]]
        self.assertEqual(listed.count(name), 1)

    def test_does_not_take_over_a_job_of_another_client(self):
        job = self.server.render(job_body())["id"]
        self.assert_problem(self.put(job, job_body()), 409)

    def test_many_puts_at_once_create_one_job(self):
        name = str(uuid.uuid4())
        calls = [in_background(lambda: self.put(name, job_body()).status) for _ in range(8)]
        self.assertEqual(sorted(call() for call in calls), [200] * 7 + [201])

    def test_ids_are_case_insensitive(self):
        name = str(uuid.uuid4())
        self.assertEqual(self.put(name.upper(), job_body()).json()["id"], name)
        self.assertEqual(self.put(name, job_body()).status, 200)

    def test_deleted_job_can_be_created_again(self):
        name = str(uuid.uuid4())
        self.put(name, job_body())
        self.server.wait(name)
        self.server.request("DELETE", f"/v1/jobs/{name}")
        self.assertEqual(self.put(name, job_body(samples=4)).status, 201)

    def test_validates_requests_like_post(self):
        name = str(uuid.uuid4())
        self.assert_problem(self.put("me", job_body()), 422, "/id")
        self.assert_problem(self.put(name, {"scene": "cornell-box", "seed": -1}), 422, "/seed")
        self.assert_problem(self.put(name, {"scene": "nowhere"}), 404, "/scene")
        self.assert_problem(
            self.server.request("PUT", f"/v1/jobs/{name}?dry_run=1", job_body()), 422, "/dry_run"
        )
        self.assert_problem(self.server.get(f"/v1/jobs/{name}"), 404)

    def test_applies_prefer_wait(self):
        answer = self.put(str(uuid.uuid4()), job_body(), Prefer="wait=60")
        self.assertEqual((answer.status, answer.headers["Preference-Applied"]), (201, "wait=25"))
        self.assertEqual(answer.json()["state"], "finished")


class ClientIdsAfterAKill(unittest.TestCase):
    def test_client_chosen_id_survives(self):
        server = started(self)
        name = str(uuid.uuid4())
        server.request("PUT", f"/v1/jobs/{name}", job_body())
        server.kill()
        server.start()
        self.assertEqual(server.request("PUT", f"/v1/jobs/{name}", job_body()).status, 200)
        self.assertEqual(server.request("PUT", f"/v1/jobs/{name}", job_body(samples=4)).status, 409)


class Preconditions(ApiTest):
    def test_any_tag_of_the_list_matches(self):
        job = self.server.render(job_body())["id"]
        path = f"/v1/jobs/{job}"
        for number, (tags, status) in enumerate(
            (
                ('"nonsense", {}', 200),
                ('{}', 200),
                ('"s99-r0-queued", {}', 200),
                ('{}, "s99-r0-queued"', 200),
                ('*', 200),
                ('"nonsense", "s99-r0-queued"', 412),
                ('"s99-r0-queued"', 412),
                ('nonsense', 412),
            )
        ):
            tag = self.server.get(path).headers["ETag"]
            answer = self.server.request(
                "PATCH", path, {"name": str(number)}, {"If-Match": tags.format(tag)}
            )
            self.assertEqual(answer.status, status, tags)


class Estimates(ApiTest):
    def estimate(self, body):
        answer = self.server.post("/v1/jobs?dry_run=1", body)
        self.assertEqual(answer.status, 200, answer)
        found = answer.json()["estimate"]
        self.assertTrue(
            0 < found["seconds_low"] <= found["seconds"] <= found["seconds_high"], found
        )
        self.assertTrue(
            0 < found["memory_bytes_low"] <= found["memory_bytes"] <= found["memory_bytes_high"],
            found,
        )
        self.assertEqual(found["confidence"], 0.95)
        self.assertGreater(found["pilot_cpu_seconds"], 0)
        return found

    def test_cost_grows_with_the_work(self):
        small = self.estimate(job_body(samples=64))
        large = job_body(samples=6400)
        large["film"] = {"width": 480, "height": 320, "layers": []}
        large = self.estimate(large)
        self.assertEqual((small["samples_per_pixel"], large["samples_per_pixel"]), (64, 6400))
        # 10,000 times the path samples, measured twice by pilots of different sizes.
        self.assertGreater(large["cpu_seconds"], 1000 * small["cpu_seconds"])
        self.assertLess(large["cpu_seconds"], 100000 * small["cpu_seconds"])

    def test_cost_estimate_is_that_of_the_job(self):
        body = job_body("interior", samples=64)
        body["film"] = {"width": 128, "height": 72, "layers": []}
        promised = self.estimate(body)["cpu_seconds"]
        took = self.server.render(body)["progress"]["cpu_seconds"]
        self.assertTrue(took / 4 < promised < took * 4, (promised, took))

    def test_estimates_the_samples_of_an_error_target(self):
        loose = self.estimate({"scene": "cornell-box", "stop": {"relative_error": 0.2}})
        tight = self.estimate({"scene": "cornell-box", "stop": {"relative_error": 0.05}})
        # Independent samples need sixteen times as many; errors that decrease as 1/n, as at the
        # edges of a box, need four times as many, which is the minimum. Two pilots of 16 samples of
        # one seed are the same image.
        ratio = tight["samples_per_pixel"] / loose["samples_per_pixel"]
        self.assertTrue(3.9 < ratio < 16.1, (tight, loose))

    def test_time_limit_limits_the_estimate(self):
        found = self.estimate(
            {"scene": "cornell-box", "stop": {"samples_per_pixel": 65536, "seconds": 2}}
        )
        self.assertEqual(found["seconds"], 2)
        self.assertLess(found["samples_per_pixel"], 65536)

    def test_estimate_creates_no_job(self):
        before = self.server.get("/v1/jobs").body
        self.estimate(job_body())
        self.assertEqual(self.server.get("/v1/jobs").body, before)
