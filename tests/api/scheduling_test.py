"""Several jobs on one machine: priorities, fairness, previews, and the same bits for any number of
threads."""

import os
import subprocess
import time

from harness import BINARY, PATIENCE_S, ApiTest, job_body, started


def big(**members):
    body = job_body(**{"samples": 65536, **members})
    body["film"] = {"width": 96, "height": 64, "layers": []}
    return body


class Sharing(ApiTest):
    # A second thread helps the next job for as long as the first holds the last unit of a pass: on
    # a busy machine, where the first may wait for a core, that is most of the time.
    THREADS = 1

    def progress(self, job):
        return self.server.job(job)["progress"]

    def watch(self, jobs, seconds=0.5):
        """CPU seconds that each job got within an interval, of a hundred slices or more.

        Work that is in flight when priorities change is booked when it ends, so an interval of the
        same length passes first."""
        self.spent(jobs, seconds)
        return self.spent(jobs, seconds)

    def spent(self, jobs, seconds):
        before = [self.progress(job)["cpu_seconds"] for job in jobs]
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            time.sleep(0.05)
            spent = [self.progress(job)["cpu_seconds"] - b for job, b in zip(jobs, before)]
            if sum(spent) > seconds:
                return spent
        self.fail(f"too little was rendered: {spent}")

    def cancel(self, *jobs):
        for job in jobs:
            self.server.post(f"/v1/jobs/{job}/cancel")

    def test_higher_priority_is_served_first(self):
        low = self.server.submit(big())["id"]
        self.server.wait_for_samples(low)
        high = self.server.submit(big(priority=10))["id"]
        self.server.wait_for_samples(high)
        spent = self.watch([low, high])
        self.assertGreater(spent[1], 4 * spent[0], spent)
        # And vice versa.
        self.server.request("PATCH", f"/v1/jobs/{low}", {"priority": 20})
        spent = self.watch([low, high])
        self.assertGreater(spent[0], 4 * spent[1], spent)
        self.cancel(low, high)

    def test_oldest_comes_first_after_a_first_pass_of_each(self):
        early = self.server.submit(big())["id"]
        self.server.wait_until(early, lambda job: job["progress"]["cpu_seconds"] > 0.3)
        late = self.server.submit(big())["id"]
        self.server.wait_until(late, lambda job: job["progress"]["samples_per_pixel"]["min"] > 0)
        spent = self.watch([early, late])
        self.assertGreater(spent[0], 4 * spent[1], spent)
        self.server.wait_until(late, lambda job: job["progress"]["samples_per_pixel"]["min"] > 1)
        self.cancel(early)
        self.assertGreater(self.watch([late], 0.2)[0], 0)
        self.cancel(late)

    def test_jobs_whose_clock_runs_share_fairly(self):
        timed = {"stop": {"seconds": 600}}
        jobs = [self.server.submit(big(seed=seed, **timed))["id"] for seed in range(3)]
        for job in jobs:
            self.server.wait_for_samples(job)
        spent = self.watch(jobs, 1)
        self.assertLess(max(spent), 2 * min(spent), spent)
        self.cancel(*jobs)

    def test_later_job_whose_clock_runs_does_not_wait_for_an_earlier_one(self):
        early = self.server.submit(big())["id"]
        self.server.wait_until(early, lambda job: job["progress"]["cpu_seconds"] > 0.3)
        late = self.server.submit(big(stop={"seconds": 600}))["id"]
        self.server.wait_for_samples(late)
        spent = self.watch([early, late], 0.7)
        self.assertLess(max(spent), 2.5 * min(spent), spent)
        self.cancel(early, late)

    def test_extended_job_precedes_lower_priorities(self):
        # Adaptive sampling plans at 32 samples, so the extended job has no slice at first.
        job = self.server.render(job_body(samples=32, adaptive={"type": "pilot"}))
        hog = self.server.submit(big(priority=-10))["id"]
        self.server.wait_for_samples(hog)
        self.server.post(f"/v1/jobs/{job['id']}/extend", {"stop": {"samples_per_pixel": 64}})
        self.assertEqual(self.server.wait(job["id"])["state"], "finished")
        self.cancel(hog)

    def test_preview_is_served_first(self):
        hog = self.server.submit(big(priority=100))["id"]
        self.server.wait_for_samples(hog)
        preview = self.server.submit(big(**{"class": "preview"}))["id"]
        self.server.wait_for_samples(preview)
        spent = self.watch([hog, preview], 1)
        self.assertGreater(spent[1], 4 * spent[0], spent)
        self.cancel(hog, preview)

    def test_next_preview_of_a_key_supersedes_it(self):
        def preview(key):
            return self.server.submit(big(**{"class": "preview", "preview_key": key}))["id"]

        first, other = preview("a"), preview("b")
        second = preview("a")
        self.assertEqual(self.server.wait(first)["state"], "cancelled")
        for job in (other, second):
            self.assertNotIn(self.server.job(job)["state"], ("finished", "failed", "cancelled"))
        self.cancel(other, second)

    def test_lists_exclude_previews_by_default(self):
        kept = self.server.submit(job_body())["id"]
        preview = self.server.submit(job_body(**{"class": "preview"}))["id"]

        def listed(query):
            jobs, path = [], f"/v1/jobs?limit=1{query}"
            while path:
                answer = self.server.get(path)
                page = answer.json()
                jobs += [job["id"] for job in page["jobs"]]
                path = page["next"] and f"/v1/jobs?limit=1{query}&cursor={page['next']}"
            return {kept, preview} & set(jobs)

        self.assertEqual(listed(""), {kept})
        self.assertEqual(listed("&class=normal"), {kept})
        self.assertEqual(listed("&class=all"), {kept, preview})
        self.assertEqual(listed("&class=preview"), {preview})
        self.assertEqual(self.server.get("/v1/jobs?class=other").status, 400)

        def tessera(*args):
            return subprocess.run(
                [BINARY, *args, "--server", f"http://127.0.0.1:{self.server.port}"],
                capture_output=True,
                text=True,
                timeout=PATIENCE_S,
                check=True,
            ).stdout

        # Previews of a browser that places a camera are not jobs of the command line.
        self.assertNotIn(preview, tessera("jobs"))
        self.assertIn(preview, tessera("jobs", "--previews"))
        self.assertNotIn(preview, tessera("cancel", "latest"))

    def test_workers_have_a_moderate_nice_value(self):
        self.server.render(job_body())
        with open(f"/proc/{self.server.process.pid}/comm", encoding="ascii") as comm:
            self.assertTrue(comm.read().startswith("tessera"))
        levels = [os.getpriority(os.PRIO_PROCESS, int(task))
                  for task in os.listdir(f"/proc/{self.server.process.pid}/task")]
        base = os.getpriority(os.PRIO_PROCESS, 0)
        self.assertLessEqual(max(levels), min(19, base + 5))
        self.assertEqual(min(levels), base)

    def test_probes_answer_under_full_load(self):
        jobs = [self.server.submit(big(seed=seed))["id"] for seed in range(6)]
        for _ in range(20):
            self.assertEqual(self.server.get("/livez").status, 200)
            self.assertEqual(self.server.get("/readyz").status, 200)
        self.cancel(*jobs)


class Demo(ApiTest):
    FLAGS = ("--demo",)

    def test_demo_yields_to_requested_jobs(self):
        (demo,) = self.server.get("/v1/jobs?label=demo&limit=1").json()["jobs"]
        self.server.wait_for_samples(demo["id"])
        self.assertEqual(self.server.render(job_body(samples=64))["state"], "finished")
        self.assertEqual(self.server.job(demo["id"])["state"], "rendering")
        self.assertLess(demo["spec"]["priority"], 0)


class SameBits(ApiTest):
    def test_film_is_the_same_for_any_number_of_threads(self):
        digests = {}
        bodies = [job_body(samples=12, seed=5), job_body("veach-mis", samples=6),
                  job_body(samples=6, sampler={"type": "independent", "replicates": 4})]
        for threads in (1, 2, 7):
            server = started(self, threads=threads)
            # together, so that their slices interleave
            jobs = [server.submit(body)["id"] for body in bodies]
            digests[threads] = [server.wait(job)["film_digest"] for job in jobs]
            self.assertNotIn(None, digests[threads])
            self.assertEqual(server.stop(), 0)
        self.assertEqual(digests[1], digests[2])
        self.assertEqual(digests[1], digests[7])

    def test_another_seed_is_another_film(self):
        digests = [self.server.render(job_body(seed=seed))["film_digest"] for seed in (1, 2, 1)]
        self.assertEqual(digests[0], digests[2])
        self.assertNotEqual(digests[0], digests[1])

    def test_pause_does_not_affect_the_film(self):
        calm = self.server.render(job_body(samples=256))["film_digest"]
        job = self.server.submit(job_body(samples=256))["id"]
        for paused in (True, False, True, False):
            self.server.request("PATCH", f"/v1/jobs/{job}", {"paused": paused})
        self.assertEqual(self.server.wait(job)["film_digest"], calm)


class Memory(ApiTest):
    """Memory for one film of 512 by 512 pixels but not for two."""

    FLAGS = ("--memory", "106M")

    def metric(self, name):
        lines = self.server.get("/metrics").body.decode().splitlines()
        return next(float(line.split()[-1]) for line in lines if line.startswith(name + " "))

    def submit(self, width=512, height=512, **members):
        body = job_body(**{"samples": 65536, **members})
        body["film"] = {"width": width, "height": height}
        return self.server.post("/v1/jobs", body)

    def test_jobs_wait_for_memory_and_a_paused_one_releases_it(self):
        first = self.submit(priority=1).json()["id"]  # It does not move to disk for the other.
        self.server.wait_for_samples(first)
        second = self.submit().json()["id"]
        time.sleep(0.3)
        self.assertEqual(self.server.job(second)["state"], "queued")
        self.assertEqual(self.metric("tessera_queue_waits_for_memory"), 1)
        self.assertGreater(self.metric("tessera_held_memory_bytes"), 512 * 512 * 64)
        self.server.request("PATCH", f"/v1/jobs/{first}", {"paused": True})
        self.server.wait_for_samples(second)
        self.assertEqual(self.metric("tessera_queue_waits_for_memory"), 0)
        self.assertLess(
            self.metric("tessera_held_memory_bytes"), self.metric("tessera_held_memory_limit_bytes")
        )
        # The parked job kept its samples.
        parked = self.server.job(first)
        self.assertEqual(parked["state"], "paused")
        self.assertGreater(parked["progress"]["samples_per_pixel"]["mean"], 0)
        self.assertEqual(self.server.get(f"/v1/jobs/{first}/image.png?max_size=64").status, 200)
        self.server.request("PATCH", f"/v1/jobs/{first}", {"paused": False})
        self.assertEqual(self.server.job(first)["state"], "queued")
        before = parked["progress"]["samples_per_pixel"]["mean"]
        self.server.post(f"/v1/jobs/{second}/cancel")
        self.server.wait_until(
            first, lambda job: job["progress"]["samples_per_pixel"]["mean"] > before, "more samples"
        )
        self.server.post(f"/v1/jobs/{first}/cancel")

    def test_preview_need_not_wait_for_it(self):
        first = self.submit(width=500).json()["id"]
        self.server.wait_for_samples(first)
        preview = self.submit(96, 64, **{"class": "preview", "samples": 8}).json()["id"]
        self.assertEqual(self.server.wait(preview)["state"], "finished")
        self.server.post(f"/v1/jobs/{first}/cancel")

    def test_refuses_a_film_that_never_fits(self):
        answer = self.submit(1024, 1024)
        self.assert_problem(answer, 413, "/film")
        self.assertIn("--memory", answer.body.decode())
        body = {**job_body(), "film": {"width": 1024, "height": 1024}}
        self.assert_problem(self.server.post("/v1/jobs?dry_run=1", body), 413, "/film")

    def test_reports_the_limit(self):
        limits = self.server.get("/v1/server").json()["limits"]
        self.assertEqual(limits["memory_bytes_of_jobs"], 106 << 20)
