"""One job on many machines: the film equals that of one process, whatever fails on the way."""

import hashlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import nats_keys
from farm import (
    Broker,
    BusyOnceProxy,
    BusyProxy,
    Farm,
    FlakyProxy,
    HandWorker,
    LyingProxy,
    SlowProxy,
    clean_environ,
    free_port,
    request_report,
    sealed,
)
from harness import BINARY, PATIENCE_S, Server, job_body, started, tessera, triangle_glb, wait_for
from moving import moving_triangles

# Long enough to be interrupted: .6 s of one fast thread.
LONG = 64


def long_job(samples=LONG):
    return job_body(samples=samples) | {
        "film": {"width": 160, "height": 128, "layers": ["albedo", "normal", "depth"]}}


class SingleProcess:
    """Digests of one process without workers; each is computed once."""

    server = None
    digests = {}

    @classmethod
    def digest(cls, body, prepare=None):
        name = repr(body)
        if name not in cls.digests:
            if not cls.server:
                cls.server = Server().start()
                unittest.addModuleCleanup(cls.close)
            if prepare:
                prepare(cls.server)
            cls.digests[name] = cls.server.render(body)["film_digest"]
        return cls.digests[name]

    @classmethod
    def close(cls):
        cls.server.close()
        cls.server = None


class FarmTest(unittest.TestCase):
    def farm(self, *flags, **options):
        farm = Farm(*flags, **options)
        self.addCleanup(farm.close)
        return farm

    def check_film(self, farm, job_id, body):
        job = farm.server.wait(job_id)
        self.assertEqual(job["state"], "finished", job)
        self.assertEqual(job["film_digest"], SingleProcess.digest(body))
        return job


class WorkersTest(FarmTest):
    def test_two_workers_make_the_film_of_one_process(self):
        farm = self.farm(workers=2)
        glb = triangle_glb()

        def upload(server):
            return server.request("POST", "/v1/scenes", glb, {"Content-Type": "model/gltf-binary"})

        upload(farm.server)
        scene = hashlib.sha256(glb).hexdigest()
        film = {"width": 100, "height": 70, "crop": {"x": 9, "y": 5, "width": 80, "height": 60}}
        for body in (
            long_job(),
            job_body(scene, 64, sampler={"type": "halton", "replicates": 4}) | {"film": film},
            job_body("veach-mis", stop={"relative_error": 0.1, "samples_per_pixel": 512},
                     adaptive={"type": "pilot"}),
            job_body(samples=64, estimator={"control_variate": {"type": "regression"}}),
            job_body(samples=64, light_sampler={"type": "restir"}),
            # The camera is neither parallel to an axis nor horizontal.
            job_body("still-life", 16, ground={"type": "catcher"}),
            job_body("still-life", 16, ground={"type": "sweep"}),
            job_body("still-life", 16, ground={"type": "catcher", "reflection": 1}),
        ):
            with self.subTest(body=body):
                job = farm.server.render(body)
                self.assertEqual(job["film_digest"], SingleProcess.digest(body, upload))
        listed = farm.listed()
        for worker in farm.workers:
            self.assertGreater(listed[worker.id]["units"], 0)
            self.assertGreater(listed[worker.id]["rate"], 0)
            self.assertEqual(listed[worker.id]["faults"], 0)

    def test_workers_blur_motion_like_one_process(self):
        farm = self.farm(workers=2)
        glb = moving_triangles()

        def upload(server):
            return server.request("POST", "/v1/scenes", glb, {"Content-Type": "model/gltf-binary"})

        upload(farm.server)
        scene = hashlib.sha256(glb).hexdigest()
        digests = set()
        for members in (
            {"shutter_seconds": 0},
            {"shutter_seconds": 1},
            {"shutter_seconds": 1, "ground": {"type": "catcher"}},
            {"shutter_seconds": 1, "ground": {"type": "sweep", "reflection": 1}},
            {"shutter_seconds": 0.5, "time_seconds": 0.25},
        ):
            with self.subTest(**members):
                body = job_body(scene, 16, **members)
                job = farm.server.render(body)
                self.assertEqual(job["film_digest"], SingleProcess.digest(body, upload))
                digests.add(job["film_digest"])
        self.assertEqual(len(digests), 5)

    def test_workers_support_all_integrators_except_prepasses_of_all_samples(self):
        farm = self.farm(workers=2)
        about = farm.server.get("/v1/server").json()
        film = {"width": 60, "height": 44, "crop": {"x": 22, "y": 24, "width": 20, "height": 18}}
        done = 0
        for row in about["integrators"]:
            with self.subTest(integrator=row["type"]):
                body = job_body(samples=6, integrator={"type": row["type"]}) | {"film": film}
                job = farm.server.render(body)
                self.assertEqual(job["film_digest"], SingleProcess.digest(body))
                if row["error"] == "by-comparison":
                    self.assertEqual(job["error"], SingleProcess.server.render(body)["error"])
                units = sum(worker["units"] for worker in farm.listed().values())
                if row["type"] == "irradiance-cache":
                    self.assertEqual(units, done)
                else:
                    self.assertGreater(units, done)
                done = units

    def test_workers_measure_like_one_process(self):
        points = [{"position": [0.1 * i, 0.01, -0.3], "normal": [0, 1, 0]} for i in range(20)]
        body = job_body(samples=8, meter={"points": points})

        def measured(server):
            job = server.render(body)
            return server.get(f"/v1/jobs/{job['id']}/meter").json()

        alone = started(self)
        farm = self.farm(workers=1)
        result = measured(farm.server)
        self.assertTrue(any(point["illuminance_lux"] for point in result["points"]), result)
        self.assertEqual(result, measured(alone))

    def test_jobs_whose_results_may_be_too_large_stay_on_the_coordinator(self):
        # Two replicates of 640 x 512 pixels, 58 bytes each: 38 MB, above an eighth of the memory
        # that the smaller server has in addition to the 144 MB of its process.
        body = job_body(samples=1, integrator={"type": "bdpt"}) | {
            "film": {"width": 640, "height": 512}}
        for flags, is_lent in ((("--memory", "300M"), False), ((), True)):
            with self.subTest(flags=flags):
                farm = self.farm(*flags, workers=1)
                job = farm.server.render(body)
                self.assertEqual(job["film_digest"], SingleProcess.digest(body))
                words = "Workers cannot render this job"
                told = [w for w in job["warnings"] if w.startswith(words)]
                self.assertEqual(len(told), 0 if is_lent else 1, job["warnings"])
                units = farm.listed()[farm.workers[0].id]["units"]
                self.assertEqual(units > 0, is_lent)

    def test_job_without_a_suitable_worker_warns_until_there_is_one(self):
        farm = self.farm(lease=0.5)
        HandWorker(farm, build="another").report()
        body = job_body(samples=8)
        job = farm.server.submit(body)
        waits = "The job is waiting: no suitable worker is connected."
        farm.server.wait_until(job["id"], lambda j: waits in j["warnings"], "the warning")
        farm.add_worker()
        self.check_film(farm, job["id"], body)
        farm.server.wait_until(job["id"], lambda j: waits not in j["warnings"], "the warning's end")

    def test_job_warns_until_the_queue_is_connected(self):
        farm = self.farm(lease=0.5, workers=1)
        body = long_job()
        job = farm.server.submit(body)
        farm.server.wait_for_samples(job["id"], 2)
        farm.broker.kill()
        waits = "The job is waiting: the queue is not connected."
        farm.server.wait_until(job["id"], lambda j: waits in j["warnings"], "the warning")
        farm.broker.start()
        farm.server.wait_until(job["id"], lambda j: waits not in j["warnings"], "the warning's end")
        self.check_film(farm, job["id"], body)

    def test_tiles_are_listed_with_the_worker_that_renders_them(self):
        farm = self.farm(lease=600)
        job = farm.server.submit(long_job())
        path = f"/v1/jobs/{job['id']}/workers"
        hand = HandWorker(farm)
        unit = hand.next_unit()
        self.assertEqual(farm.server.get(path).json(), {"tiles": []})
        hand.lease(unit)
        self.assertEqual(farm.listed()["hand"]["held"], [unit])
        self.assertEqual(farm.metric('tessera_worker_leases{worker="hand"}'), 1)
        self.assertEqual(unit.split(".")[0], job["id"])
        tiles = farm.server.get(path).json()["tiles"]
        self.assertGreater(len(tiles), 0)
        for tile in tiles:
            self.assertEqual(tile["worker"], "hand")
            self.assertEqual((tile["x"] % 32, tile["y"] % 32), (0, 0))
            self.assertEqual((tile["width"], tile["height"]), (32, 32))
        farm.server.post(f"/v1/work/units/{unit}/hand-back", {"worker": "hand"})
        self.assertEqual(farm.server.get(path).json(), {"tiles": []})

    def test_render_threads_support_no_workers(self):
        farm = self.farm("--render-threads", "1")
        body = job_body(samples=16)
        self.assertEqual(farm.server.render(body)["film_digest"], SingleProcess.digest(body))

    def test_job_waits_for_workers_and_can_be_cancelled_while_they_work(self):
        farm = self.farm()
        job = farm.server.submit(long_job())
        farm.server.wait_until(job["id"], lambda j: j["state"] == "rendering", "rendering")
        self.assertEqual(farm.server.job(job["id"])["progress"]["samples_per_pixel"]["max"], 0)
        farm.add_worker()
        farm.server.wait_for_samples(job["id"], 2)
        farm.server.post(f"/v1/jobs/{job['id']}/cancel")
        self.assertEqual(farm.server.wait(job["id"])["state"], "cancelled")
        # Units in progress are dropped, and the next job gets the worker.
        body = job_body(samples=8)
        self.assertEqual(farm.server.render(body)["film_digest"], SingleProcess.digest(body))

    def test_cancel_requests_reports_whose_answers_drop_the_unit(self):
        farm = self.farm(lease=600)
        job = farm.server.submit(long_job())
        hand = HandWorker(farm)
        unit = hand.next_unit()
        hand.lease(unit)
        self.assertEqual(hand.report(units={unit: 0.1}).json()["dropped"], [])
        with hand.report_requests() as wait:
            farm.server.post(f"/v1/jobs/{job['id']}/cancel")
            wait()
        self.assertEqual(hand.report(units={unit: 0.2}).json()["dropped"], [unit])

    def test_worker_reports_at_once_on_request(self):
        farm = self.farm(workers=1, lease=600)
        worker = farm.workers[0].id
        seen_at = farm.wait_for_worker(worker, lambda w: True, "a report")["seen_at"]
        rounds = 10
        begin = time.monotonic()
        for _ in range(rounds):
            time.sleep(0.01)  # more than the resolution of seen_at
            request_report(farm.broker, worker)
            seen_at = farm.wait_for_worker(worker, lambda w, last=seen_at: w["seen_at"] != last,
                                           "the next report")["seen_at"]
        # Unrequested reports arrive every two seconds.
        self.assertLess(time.monotonic() - begin, rounds * 2 / 2)

    def test_worker_drains_on_sigterm_and_exits_when_idle(self):
        farm = self.farm(workers=1)
        body = long_job()
        job = farm.server.submit(body)
        farm.server.wait_for_samples(job["id"], 2)
        self.assertEqual(farm.workers[0].stop(), 0)
        self.assertEqual(farm.workers[0].complaints, "")
        self.assertEqual(farm.listed()[farm.workers[0].id]["faults"], 0)
        idle = farm.add_worker("--idle", "1")
        self.check_film(farm, job["id"], body)
        self.assertEqual(idle.end(), 0)

    def test_returns_unfinished_work_after_the_grace_period(self):
        farm = self.farm(lease=600)
        worker = farm.add_worker("--grace", "0")
        body = long_job()
        job = farm.server.submit(body)
        farm.wait_for_worker(worker.id, lambda w: w["leases"] > 0 and w["units"] > 0, "a lease")
        self.assertEqual(worker.stop(), 0)
        self.assertEqual(worker.complaints, "")
        left = farm.listed()[worker.id]
        self.assertEqual((left["leases"], left["faults"]), (0, 0))
        farm.add_worker()
        self.check_film(farm, job["id"], body)

    def test_returns_a_result_that_the_server_does_not_accept_at_the_end(self):
        farm = self.farm(lease=600)
        proxy = BusyProxy(farm.server.port)
        self.addCleanup(proxy.server_close)
        self.addCleanup(proxy.shutdown)
        worker = farm.add_worker("--grace", "0", port=proxy.server_address[1])
        body = job_body(samples=8)
        job = farm.server.submit(body)
        self.assertTrue(proxy.refused.wait(PATIENCE_S))
        self.assertEqual(worker.stop(), 0)
        self.assertEqual(worker.complaints, "")
        left = farm.listed()[worker.id]
        self.assertEqual((left["leases"], left["faults"]), (0, 0))
        farm.add_worker()
        self.check_film(farm, job["id"], body)

    def test_leaves_soon_after_the_grace_period_if_the_server_hangs(self):
        farm = self.farm(workers=1)
        worker = farm.workers[0]
        farm.server.submit(long_job())
        farm.wait_for_worker(worker.id, lambda w: w["units"] > 0, "a unit")
        idle = farm.add_worker("--grace", "1")
        farm.wait_for_worker(idle.id, lambda w: w["state"] != "lost", "the other worker")
        farm.server.process.send_signal(signal.SIGSTOP)
        self.addCleanup(farm.server.process.send_signal, signal.SIGCONT)
        time.sleep(1)  # Requests of both hang.
        begin = time.monotonic()
        self.assertNotEqual(idle.stop(), 0)
        # The grace period, 5 s to return parts, and as much again for a busy machine.
        self.assertLess(time.monotonic() - begin, 12)
        self.assertIn("does not respond", idle.complaints)

    def test_last_units_do_not_wait_for_a_slow_worker(self):
        farm = self.farm(workers=2, lease=600)
        slow = farm.workers[0]

        def holds_a_lease():
            return farm.listed()[slow.id]["leases"] > 0

        for seed in range(1, 20):  # Each attempt has a job of its own: the last may have ended.
            body = long_job() | {"seed": seed}
            job = farm.server.submit(body)
            while not holds_a_lease() and farm.server.job(job["id"])["state"] != "finished":
                pass
            slow.process.send_signal(signal.SIGSTOP)
            time.sleep(0.2)  # Results sent before the stop have arrived.
            if holds_a_lease():
                break
            slow.process.send_signal(signal.SIGCONT)
            farm.server.wait(job["id"])
        self.check_film(farm, job["id"], body)
        self.assertGreaterEqual(farm.metric("tessera_units_doubled_total"), 1)
        slow.process.send_signal(signal.SIGCONT)
        # Later results are ignored, which is not an error of the worker.
        farm.wait_for_worker(slow.id, lambda w: w["state"] == "idle", "its return")
        self.assertEqual(slow.stop(), 0)
        self.assertEqual((slow.complaints, farm.listed()[slow.id]["faults"]), ("", 0))


class CacheTest(FarmTest):
    def cache_after_a_job(self, size):
        """Returns the files of a worker's cache folder, in which other files were before."""
        farm = self.farm()
        worker = farm.add_worker("--cache-size", size)
        inputs = os.path.join(worker.cache, "tessera-inputs")
        os.mkdir(inputs)
        for path, age_s in ((os.path.join(worker.cache, "thesis.odt"), 9000),
                            (os.path.join(inputs, "a" * 64 + ".part12"), 9000),
                            (os.path.join(inputs, "b" * 64 + ".part34"), 0)):
            with open(path, "wb") as file:
                file.write(b"x" * 100)
            os.utime(path, (time.time() - age_s,) * 2)
        uploaded = farm.server.request("POST", "/v1/scenes", triangle_glb(),
                                       {"Content-Type": "model/gltf-binary"})
        self.assertEqual(uploaded.status, 201)
        scene = hashlib.sha256(triangle_glb()).hexdigest()
        farm.server.render(job_body(scene, 1))
        self.assertGreater(farm.listed()[worker.id]["units"], 0)
        return scene, sorted(os.listdir(worker.cache)), sorted(os.listdir(inputs))

    def test_files_of_others_stay(self):
        _, all_files, inputs = self.cache_after_a_job("10")
        self.assertEqual(all_files, ["tessera-inputs", "thesis.odt"])
        self.assertEqual(inputs, [])

    def test_stale_parts_are_removed(self):
        scene, _, inputs = self.cache_after_a_job("1G")
        self.assertEqual(inputs, sorted([scene, "b" * 64 + ".part34"]))


class TroubleTest(FarmTest):
    """The way to the coordinator fails now and then."""

    def worker_behind(self, proxy, farm, *flags):
        self.addCleanup(proxy.server_close)
        self.addCleanup(proxy.shutdown)
        return farm.add_worker(*flags, port=proxy.server_address[1])

    def check_without_faults(self, farm, worker, scene="cornell-box"):
        body = job_body(scene, 1)
        job = farm.server.submit(body)
        self.check_film(farm, job["id"], body)
        self.assertEqual(farm.listed()[worker.id]["faults"], 0)
        self.assertEqual(worker.stop(), 0)
        self.assertEqual(worker.complaints, "")

    def test_failures_that_may_pass_are_no_faults(self):
        for failures in ((408, 429), (500, 502), (503, 504), (507,)):
            with self.subTest(failures=failures):
                farm = self.farm(lease=600)
                proxy = FlakyProxy(farm.server.port, *failures)
                worker = self.worker_behind(proxy, farm)
                self.check_without_faults(farm, worker)
                for part in ("/v1/work/jobs/", "/lease", "/results/"):
                    tried = [n for path, n in proxy.failed.items() if part in path]
                    self.assertEqual(max(tried, default=0), len(failures) + 1, proxy.failed)

    def test_waits_as_long_as_the_server_asks(self):
        farm = self.farm(lease=600)
        proxy = BusyOnceProxy(farm.server.port, retry_after=2)
        worker = self.worker_behind(proxy, farm)
        self.check_without_faults(farm, worker)
        tried = [times for path, times in proxy.times.items() if "/v1/work/jobs/" in path]
        self.assertGreater(len(tried), 0)
        for times in tried:
            self.assertGreaterEqual(times[1] - times[0], 2)

    def test_result_that_waits_longer_than_the_lease_is_no_fault(self):
        farm = self.farm(lease=1)
        worker = self.worker_behind(SlowProxy(farm.server.port, 3), farm)
        self.check_without_faults(farm, worker)

    def test_refused_request_is_a_fault(self):
        farm = self.farm(lease=600)
        proxy = FlakyProxy(farm.server.port, 413, of="/results/")
        worker = self.worker_behind(proxy, farm)
        body = job_body(samples=4)
        job = farm.server.submit(body)
        farm.wait_for_worker(worker.id, lambda w: w["faults"] > 0, "the fault")
        self.check_film(farm, job["id"], body)


class VerifyTest(FarmTest):
    def test_units_rendered_by_two_workers_are_equal(self):
        farm = self.farm(verify=1, workers=2)
        for body in (job_body(samples=32), job_body(samples=4, integrator={"type": "bdpt"})):
            self.assertEqual(farm.server.render(body)["film_digest"], SingleProcess.digest(body))
        verified = farm.metric("tessera_units_verified_total")
        self.assertEqual(verified, farm.metric("tessera_units_taken_total"))
        listed = farm.listed()
        self.assertEqual([listed[w.id]["units"] for w in farm.workers], [verified] * 2)

    def liar(self, farm):
        proxy = LyingProxy(farm.server.port)
        self.addCleanup(proxy.server_close)
        self.addCleanup(proxy.shutdown)
        liar = farm.add_worker(port=proxy.server_address[1])
        farm.wait_for_worker(liar.id, lambda w: w["state"] == "idle", "the faulty worker")
        return liar

    def test_worker_with_wrong_results_is_suspended_and_the_job_is_right(self):
        farm = self.farm(verify=1, workers=2)
        liar = self.liar(farm)
        for body in (long_job(), job_body(samples=4)):
            job = farm.server.submit(body)
            ended = self.check_film(farm, job["id"], body)
            stream = farm.server.get(f"/v1/jobs/{job['id']}/events").body.decode()
            for worker in farm.workers:
                self.assertNotIn(worker.id, stream + str(ended))
        listed = farm.listed()
        self.assertEqual(listed[liar.id]["state"], "suspended", listed)
        self.assertIn("differed from that of the server", listed[liar.id]["reason"])
        for worker in farm.workers[:2]:
            self.assertEqual((listed[worker.id]["faults"], listed[worker.id]["reason"]), (0, None))
        self.assertTrue(farm.server.logged("worker_suspended"))
        self.assertGreaterEqual(farm.metric("tessera_units_differing_total"), 1)
        self.assertEqual(farm.metric("tessera_workers_suspended_total"), 1)
        self.assertEqual(farm.metric('tessera_workers{state="suspended"}'), 1)

    def test_the_server_decides_between_two_workers(self):
        farm = self.farm(verify=1, workers=1)
        liar = self.liar(farm)
        job = farm.server.submit(long_job())
        self.check_film(farm, job["id"], long_job())
        listed = farm.listed()
        self.assertEqual(listed[liar.id]["state"], "suspended", listed)
        self.assertEqual(listed[farm.workers[0].id]["faults"], 0)

    def test_what_a_suspended_worker_rendered_unverified_is_rendered_again(self):
        # Of the liar's units, at least 12, half are verified: the chance that all others come
        # first, and that this job ends with a wrong film, is below 2^-12.
        farm = self.farm(verify=0.5, workers=1)
        liar = self.liar(farm)
        body = job_body(samples=512)
        job = farm.server.submit(body)
        ended = self.check_film(farm, job["id"], body)
        self.assertEqual(farm.listed()[liar.id]["state"], "suspended")
        if farm.listed()[liar.id]["units"] > 1:
            self.assertRegex(str(ended["warnings"]), "rendered again from its beginning")

    def test_a_job_that_ended_before_a_restart_is_warned_of_when_the_liar_is_found(self):
        farm = self.farm(verify=0)
        liar = self.liar(farm)
        body = job_body(samples=8)
        spoilt = farm.server.render(body)
        self.assertNotEqual(spoilt["film_digest"], SingleProcess.digest(body))
        self.assertNotIn("may be wrong", str(spoilt["warnings"]))
        farm.server.kill()
        farm.server.flags[farm.server.flags.index("--verify") + 1] = "1"
        farm.server.flags[farm.server.flags.index("--port") + 1] = str(farm.server.port)
        farm.server.start()
        farm.wait_for_worker(liar.id, lambda w: w["state"] == "idle", "the worker")
        other = job_body(samples=8, seed=2)
        self.check_film(farm, farm.server.submit(other)["id"], other)
        self.assertEqual(farm.listed()[liar.id]["state"], "suspended")
        warned = farm.server.wait_until(spoilt["id"], lambda j: j["warnings"] != spoilt["warnings"],
                                         "the warning")
        self.assertRegex(str(warned["warnings"]), "the image may be wrong")
        self.assertEqual((spoilt["doubted"], warned["doubted"]), (False, True))
        merged = farm.server.post("/v1/films/merge", {"films": [spoilt["id"]]}).json()
        self.assertTrue(merged["doubted"], merged)
        self.assertEqual(farm.server.post(f"/v1/jobs/{spoilt['id']}/retry").status, 202)
        right = self.check_film(farm, spoilt["id"], body)
        self.assertEqual(right["warnings"], spoilt["warnings"])
        self.assertFalse(right["doubted"])
        farm.server.kill()
        farm.server.start()
        farm.wait_for_worker(liar.id, lambda w: w["state"] == "suspended", "the worker that lied")

    def test_the_server_verifies_a_single_worker(self):
        farm = self.farm(verify=1, workers=1)
        body = job_body(samples=8)
        self.assertEqual(farm.server.render(body)["film_digest"], SingleProcess.digest(body))
        self.assertEqual(farm.metric("tessera_units_verified_total"),
                         farm.metric("tessera_units_taken_total"))

    def test_the_server_finds_a_liar_that_is_alone(self):
        farm = self.farm(verify=1)
        liar = self.liar(farm)
        body = job_body(samples=8)
        job = farm.server.submit(body)
        self.check_film(farm, job["id"], body)
        self.assertEqual(farm.listed()[liar.id]["state"], "suspended")


class QueueTest(FarmTest):
    def test_unit_without_workers_stays_one_message(self):
        farm = self.farm(lease=0.5)
        job = farm.server.submit(long_job())
        farm.server.wait_until(job["id"], lambda j: j["state"] == "rendering", "rendering")
        time.sleep(5)  # Five times the time after which a message may count as lost.
        self.assertEqual(farm.metric("tessera_units_open"), 1)
        self.assertEqual(farm.broker.messages(), 1)

    def test_unit_whose_message_is_lost_is_published_again(self):
        farm = self.farm(lease=0.5)
        farm.server.submit(long_job())
        hand = HandWorker(farm)
        unit = hand.next_unit()  # It is acknowledged, but not leased.
        while hand.next_unit() != unit:
            pass


class KillTest(FarmTest):
    def test_killed_worker_only_costs_time(self):
        farm = self.farm(workers=2, lease=2)
        body = long_job()
        job = farm.server.submit(body)
        worker = farm.workers[0]
        farm.wait_for_worker(worker.id, lambda w: w["leases"] > 0, "a lease")
        worker.kill()
        farm.wait_for_worker(worker.id, lambda w: w["state"] == "lost", "the loss")
        self.check_film(farm, job["id"], body)

    def test_killed_broker_without_its_data_only_costs_time(self):
        farm = self.farm(workers=2)
        body = long_job()
        job = farm.server.submit(body)
        farm.server.wait_for_samples(job["id"], 4)
        farm.broker.kill()
        farm.broker.start()
        self.check_film(farm, job["id"], body)

    def test_killed_coordinator_continues_with_the_same_workers(self):
        farm = self.farm(workers=2)
        body = long_job(2 * LONG)  # Units must be left at the kill.
        job = farm.server.submit(body)
        farm.server.wait_for_samples(job["id"])

        def workers():
            return {w["id"]: w for w in farm.server.get("/v1/workers").json()["workers"]}

        before = set(workers())
        farm.server.kill()
        farm.server.start()
        self.check_film(farm, job["id"], body)
        self.assertGreater(sum(w["units"] for w in workers().values()), 0, "for the new one")
        # One may report after the other has rendered all.
        wait_for(lambda: before <= set(workers()), workers)

    def test_messages_of_a_restarted_coordinator_have_other_numbers(self):
        # A worker that is done with an old unit acknowledges it by its number: the unit of the same
        # number would be lost.
        farm = self.farm()
        farm.server.submit(long_job())
        hand = HandWorker(farm)
        hand.next_unit()
        before = hand.message
        farm.server.kill()
        farm.server.start()
        hand.next_unit()
        self.assertGreater(hand.message, before)

    def test_unit_that_kills_three_workers_fails_its_job(self):
        farm = self.farm(lease=0.5)
        job = farm.server.submit(long_job())
        for name in ("first", "second", "third"):
            hand = HandWorker(farm, name)
            # Only one unit is requested, and only the one that was lost before.
            unit = hand.next_unit()
            if name == "first":
                lost = unit
            while unit != lost:
                unit = hand.next_unit()
            self.assertEqual(hand.lease(unit).status, 200)
            farm.wait_for_worker(name, lambda w: w["faults"] == 1, "the loss")
        ended = farm.server.wait(job["id"])
        self.assertEqual(ended["state"], "failed", ended)
        self.assertRegex(ended["failure"]["detail"],
                         "lost with 3 workers, which stopped reporting")
        for name in ("first", "second", "third"):
            self.assertIn(f'"worker":"{name}"', farm.server.log_text())

    def test_what_no_worker_can_render_is_rendered_by_the_server(self):
        farm = self.farm()
        body = job_body(samples=4)
        job = farm.server.submit(body)
        hand = HandWorker(farm)
        lost = hand.next_unit()
        self.assertEqual(hand.lease(lost).status, 200)
        self.assertEqual(hand.hand_back(lost, "no memory").status, 204)
        seen = farm.listed()["hand"]
        self.assertEqual((seen["state"], seen["faults"]), ("suspended", 1))
        self.assertIn("no memory", seen["reason"])
        self.assertFalse(hand.report().json()["suitable"])
        self.assertIn(hand.lease(lost).status, (404, 503))  # It is done already, or not for it.
        while farm.server.job(job["id"])["state"] == "rendering":
            if unit := hand.pull():
                if hand.lease(unit).status == 200:
                    hand.hand_back(unit, "still no memory")
            hand.report()
        self.check_film(farm, job["id"], body)

    def test_a_sick_worker_beside_a_good_one_fails_no_job(self):
        farm = self.farm(workers=1)
        good = farm.workers[0]
        farm.wait_for_worker(good.id, lambda w: w["state"] == "idle", "the good worker")
        sick = HandWorker(farm)
        failed = 0
        for seed in range(3):
            body = long_job() | {"seed": seed}
            job = farm.server.submit(body)
            while farm.server.job(job["id"])["state"] in ("queued", "loading", "rendering"):
                # Like `tessera worker`, it takes no messages while it gets no units.
                unit = sick.pull() if sick.report().json()["suitable"] else None
                if unit and sick.lease(unit).status == 200:
                    sick.hand_back(unit, "the disk is full")
                    failed += 1
            self.check_film(farm, job["id"], body)
        # It rests for 1 s after its first fault, and for twice as long each time.
        self.assertGreater(failed, 0)
        self.assertLess(farm.listed()["hand"]["faults"], 9)
        self.assertEqual(farm.listed()[good.id]["faults"], 0)


class TenantsTest(FarmTest):
    def test_a_tenant_sees_no_jobs_of_others_and_no_words_of_workers(self):
        operator = "key-of-the-operator"
        farm = self.farm("--key", operator, key=operator)
        code, theirs, said = tessera("keys", "add", "theirs", "--scope", "read",
                                     "--data", farm.server.data)
        self.assertEqual(code, 0, said)

        def seen(key):
            listed = farm.server.get("/v1/workers", {"Authorization": "Bearer " + key.strip()})
            return listed.json()["workers"][0]

        job = farm.server.submit(long_job())
        hand = HandWorker(farm)
        unit = hand.next_unit()
        self.assertEqual(hand.lease(unit).status, 200)
        self.assertEqual((seen(operator)["held"], seen(operator)["leases"]), ([unit], 1))
        self.assertEqual((seen(theirs)["held"], seen(theirs)["leases"]), ([], 1))
        fault = f"no room for /cache/{job['id']}"
        self.assertEqual(hand.hand_back(unit, fault).status, 204)
        self.assertRegex(seen(operator)["reason"], f"^it rests for 1 s .* a unit: {fault}$")
        self.assertRegex(seen(theirs)["reason"], "^it rests for 1 s after failing a unit$")


class SecureQueueTest(FarmTest):
    def test_queue_requires_tls_and_credentials(self):
        folder = tempfile.mkdtemp(prefix="tessera-nats-keys-")
        self.addCleanup(shutil.rmtree, folder)
        lines, credentials = nats_keys.write_credentials(folder)
        tls, certificate = nats_keys.write_certificate(folder)
        config = os.path.join(folder, "nats.conf")
        with open(config, "w", encoding="ascii") as file:
            file.write("\n".join(lines + tls))
        _, other = nats_keys.write_certificate(tempfile.mkdtemp(dir=folder))
        _, strange = nats_keys.write_credentials(os.path.dirname(other))
        farm = self.farm("--queue-ca", certificate, "--queue-creds", credentials,
                         broker=Broker(config=config, scheme="tls"))
        body = long_job()
        job = farm.server.submit(body)
        refused = [
            farm.add_worker("--queue-ca", certificate),
            farm.add_worker("--queue-ca", certificate, "--queue-creds", strange),
            farm.add_worker("--queue-ca", other, "--queue-creds", credentials),
        ]
        farm.add_worker("--queue-ca", certificate, "--queue-creds", credentials)
        self.check_film(farm, job["id"], body)
        listed = farm.listed()
        self.assertEqual([listed[worker.id]["units"] for worker in refused], [0, 0, 0])


class RefusedTest(FarmTest):
    def test_refuses_invalid_results(self):
        farm = self.farm()
        farm.server.submit(long_job())
        hand = HandWorker(farm)
        other = HandWorker(farm, "other")
        other.report()
        unit = hand.next_unit()
        given = hand.lease(unit).body
        self.assertEqual(other.lease(unit).status, 409)
        self.assertEqual(other.deliver(unit, given).status, 409)
        self.assertEqual(hand.deliver("no-unit", given).status, 404)

        content = given[:-4]
        for fault, result in (
            ("cut", given[:-100]),
            ("another checksum", content + b"0" * 4),
            ("never rendered", given),
            ("trailing bytes", sealed(content + b"\0" * 8)),
            ("a huge count", sealed(content[:64] + b"\xff" * 4 + content[68:])),
            ("nothing", b""),
        ):
            with self.subTest(fault=fault):
                self.assertEqual(hand.deliver(unit, result).status, 422)
                self.assertEqual(farm.listed()[hand.id]["faults"], 1)
                self.assertEqual(hand.lease(unit).status, 503)  # It rests.
                hand = HandWorker(farm, "after-" + fault.replace(" ", "-"))
                hand.report()
                self.assertEqual(hand.lease(unit).status, 200)
        self.assertEqual(self.declared(farm, unit, hand.id, 1 << 30), 413)
        self.assertEqual(farm.listed()[hand.id]["leases"], 1)  # It still has the unit.

    def declared(self, farm, unit, worker, size):
        """Returns the answer to a result of which nothing has been sent yet."""
        link = farm.server.connect()
        self.addCleanup(link.close)
        link.putrequest("PUT", f"/v1/work/units/{unit}/results/{worker}")
        link.putheader("Content-Type", "application/octet-stream")
        link.putheader("Content-Length", str(size))
        link.endheaders()
        return link.getresponse().status

    def test_unsuitable_worker_is_listed_with_the_reason(self):
        farm = self.farm()
        farm.server.submit(long_job())
        hand = HandWorker(farm, build="another")
        orders = hand.report().json()
        self.assertFalse(orders["suitable"])
        self.assertIn("another", orders["reason"])
        listed = farm.listed()["hand"]
        self.assertEqual((listed["state"], listed["reason"]), ("unsuitable", orders["reason"]))

    def worker_keys(self, farm, *names):
        keys = []
        for name in names:
            code, text, fault = tessera("keys", "add", name, "--scope", "worker", "--data",
                                        farm.server.data)
            self.assertEqual(code, 0, fault)
            keys.append(text.split()[-1])
        deadline = time.monotonic() + PATIENCE_S
        newest = {"Authorization": "Bearer " + keys[-1]}
        while farm.server.request("GET", "/v1/server", headers=newest).status == 401:
            self.assertLess(time.monotonic(), deadline, "the new keys are not accepted")
            time.sleep(0.05)
        return keys

    def test_worker_belongs_to_the_key_that_reported_it(self):
        farm = self.farm("--key", "operator", key="operator", lease=600)
        own, other = self.worker_keys(farm, "own", "other")
        job = farm.server.submit(long_job())
        hand = HandWorker(farm, key=own)
        unit = hand.next_unit()
        given = hand.lease(unit).body
        hand.headers = {"Authorization": "Bearer " + other}
        for answer in (hand.report(), hand.lease(unit), hand.deliver(unit, given),
                       hand.hand_back(unit, "a lie")):
            self.assertEqual(answer.status, 403, answer)
        listed = farm.listed()["hand"]
        self.assertEqual((listed["leases"], listed["faults"]), (1, 0))
        hand.headers = {"Authorization": "Bearer " + own}
        self.assertEqual(hand.hand_back(unit).status, 204)
        self.assertEqual(farm.server.job(job["id"])["state"], "rendering")

    def test_results_of_a_verified_unit_come_from_two_keys(self):
        farm = self.farm("--key", "operator", key="operator", lease=600, verify=1)
        own, other = self.worker_keys(farm, "own", "other")
        first, second, third = (HandWorker(farm, "first", own), HandWorker(farm, "second", own),
                                HandWorker(farm, "third", other))
        for hand in (first, second, third):
            hand.report()
        farm.server.submit(long_job())
        unit = first.next_unit()
        self.assertEqual(first.lease(unit).status, 200)
        refused = second.lease(unit)
        self.assertEqual(refused.status, 503)
        self.assertIn("meant for another worker", refused.json()["detail"])
        third.report(draining=True)  # Now there is only one key.
        self.assertEqual(second.lease(unit).status, 200)
        self.assertEqual(second.hand_back(unit).status, 204)
        third.report()
        self.assertEqual(third.lease(unit).status, 200)

    def test_operator_gives_workers_a_key_and_a_token_of_the_queue(self):
        with tempfile.NamedTemporaryFile("w", suffix=".conf") as config:
            config.write("authorization { token: of-the-queue }\n")
            config.flush()
            farm = self.farm("--key", "operator", "--worker-key", "of-workers", key="operator",
                             broker=Broker(config=config.name, user="of-the-queue@"))
            body = job_body(samples=1)
            job = farm.server.submit(body)
            worker = farm.add_worker(key="of-workers")
            self.check_film(farm, job["id"], body)
            self.assertGreater(farm.listed()[worker.id]["units"], 0)

    def test_worker_key_gives_access_only_to_work(self):
        farm = self.farm("--key", "operator", key="operator")
        code, text, fault = tessera("keys", "add", "farm", "--scope", "worker", "--data",
                                    farm.server.data)
        self.assertEqual(code, 0, fault)
        key = text.split()[-1]
        code, text, fault = tessera("keys", "add", "user", "--data", farm.server.data)
        self.assertEqual(code, 0, fault)
        user = {"Authorization": "Bearer " + text.split()[-1]}
        wait_for(lambda: farm.server.request("GET", "/v1/server", headers=user).status != 401,
                 "the new keys are not accepted")
        job = farm.server.submit(job_body(samples=8))
        farm.add_worker(key=key)
        self.assertEqual(farm.server.wait(job["id"])["state"], "finished")
        worker = {"Authorization": "Bearer " + key}
        for method, path in (("GET", "/v1/jobs"), ("GET", f"/v1/jobs/{job['id']}"),
                             ("POST", "/v1/jobs"), ("GET", "/v1/scenes"), ("GET", "/v1/workers"),
                             ("GET", "/v1/keys"), ("GET", "/v1/server")):
            with self.subTest(path=path):
                answer = farm.server.request(method, path, headers=worker)
                self.assertEqual(answer.status, 403, answer)
        # The job has ended: workers can access nothing of it.
        ended = farm.server.request("GET", f"/v1/work/jobs/{job['id']}", headers=worker)
        self.assertEqual(ended.status, 404)
        answer = farm.server.request("GET", f"/v1/work/jobs/{job['id']}", headers=user)
        self.assertEqual(answer.status, 403)

    def test_worker_key_reads_only_jobs_of_which_it_holds_a_unit(self):
        farm = self.farm("--key", "operator", key="operator")
        keys = []
        for name in ("one", "two"):
            code, text, fault = tessera("keys", "add", name, "--scope", "worker", "--data",
                                        farm.server.data)
            self.assertEqual(code, 0, fault)
            keys.append(text.split()[-1])
        deadline = time.monotonic() + PATIENCE_S
        while farm.server.request("GET", "/v1/work/jobs/x", headers={
                "Authorization": "Bearer " + keys[1]}).status == 401:
            self.assertLess(time.monotonic(), deadline, "the new keys are not accepted")
            time.sleep(0.05)
        scene, stranger = (
            farm.server.post("/v1/scenes", triangle_glb(nodes=[{"mesh": 0, "name": name}]),
                             {"Content-Type": "model/gltf-binary"}).json()["id"]
            for name in ("ours", "theirs")
        )
        job = farm.server.submit(job_body(scene, samples=64))["id"]
        holder = HandWorker(farm, "holder", keys[0])
        other = HandWorker(farm, "other", keys[1])
        other.report()
        unit = holder.next_unit()

        def inputs(worker):
            return farm.server.request("GET", f"/v1/work/jobs/{job}", headers=worker.headers)

        def file(worker, asset):
            return farm.server.request(
                "GET", f"/v1/work/jobs/{job}/files/{asset}", headers=worker.headers
            ).status

        self.assertEqual(inputs(holder).status, 404)  # It holds no unit yet.
        self.assertEqual(holder.lease(unit).status, 200)
        self.assertEqual(inputs(holder).status, 200)
        self.assertEqual(inputs(other).status, 404)
        self.assertEqual((file(holder, scene), file(other, scene)), (200, 404))
        self.assertEqual(file(holder, stranger), 404, "a file that the job does not need")
        holder.hand_back(unit)
        self.assertEqual(inputs(holder).status, 404)
        farm.server.post(f"/v1/jobs/{job}/cancel")

    def test_refuses_servers_that_lose_streams(self):
        for version, is_used in (("2.10.0", False), ("2.10.22", False), ("2.10.23", True),
                                 ("2.9.10", True)):
            with self.subTest(version=version):
                self.assertEqual(self.starts_with(version), is_used)

    def starts_with(self, version):
        with socket.socket() as listener:
            listener.bind(("127.0.0.1", 0))
            listener.listen()

            def greet():
                while True:
                    try:
                        plug, _ = listener.accept()
                    except OSError:
                        return
                    plug.sendall(b'INFO {"server_id":"x","version":"%s"}\r\n' % version.encode())
                    plug.close()

            threading.Thread(target=greet, daemon=True).start()
            server = Server("--queue", f"nats://127.0.0.1:{listener.getsockname()[1]}")
            try:
                server.start()
                return True
            except RuntimeError as refused:
                self.assertIn(version, str(refused))
                return False
            finally:
                server.close()
                listener.shutdown(socket.SHUT_RDWR)

    def test_without_a_queue_there_are_no_workers(self):
        server = started(self)
        self.assertEqual(server.get("/v1/workers").json(), {"workers": []})
        report = {"build": "x", "arithmetic": "y"}
        self.assertEqual(server.request("PUT", "/v1/workers/w", report).status, 409)
        self.assertEqual(server.get("/v1/work/jobs/x").status, 404)

    def test_waits_for_a_queue_that_is_not_ready_yet(self):
        port = free_port()
        server = started(self, "--queue", f"nats://127.0.0.1:{port}", "--render-threads", "1")
        body = job_body(samples=8)
        self.assertEqual(server.render(body)["film_digest"], SingleProcess.digest(body))

    def test_invalid_address_is_wrong_usage(self):
        done = subprocess.run([BINARY, "worker", "--queue", "http://x"], capture_output=True,
                              text=True, env=clean_environ())
        self.assertEqual(done.returncode, 2)
        self.assertIn("nats://HOST:4222", done.stderr)


class StressTest(unittest.TestCase):
    def test_two_rounds_of_random_faults_only_cost_time(self):
        stress = os.path.join(os.path.dirname(__file__), "..", "stress", "farm")
        done = subprocess.run(
            [sys.executable, stress, "--rounds", "2", "--seed", "1", "--samples", "32", BINARY],
            capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
