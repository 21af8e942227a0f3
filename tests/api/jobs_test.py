"""Jobs: submit, read, list, wait, change, cancel, extend, delete."""

import os
import re
import time
import urllib.parse
import uuid
from datetime import datetime

from harness import PATIENCE_S, ApiTest, in_background, job_body

FINAL = ("finished", "failed", "cancelled")


class Submitting(ApiTest):
    def test_submit_is_201_with_location_and_etag(self):
        answer = self.server.post("/v1/jobs", job_body(name="a job", labels={"k": "v"}, seed=7))
        self.assertEqual(answer.status, 201, answer)
        job = answer.json()
        uuid.UUID(job["id"])
        self.assertEqual(answer.headers["Location"], "/v1/jobs/" + job["id"])
        self.assertTrue(answer.headers["ETag"])
        self.assertEqual(
            set(job),
            {
                "id",
                "state",
                "pause_reason",
                "stop_reason",
                "created_at",
                "started_at",
                "finished_at",
                "spec",
                "progress",
                "light_not_found",
                "available",
                "error",
                "failure",
                "queue_position",
                "statistics",
                "revision",
                "film_digest",
                "denoised",
                "denoising",
                "doubted",
                "merged",
                "warnings",
                "warning_details",
                "links",
            },
        )
        self.assertLessEqual({"fraction", "samples_per_pixel", "elapsed_seconds", "cpu_seconds",
                              "eta_seconds"}, set(job["progress"]))
        self.assertLessEqual(
            {"relative", "low", "high", "grain", "doubt", "unreliable", "confidence", "bias",
             "valid", "relative_rmse"}, set(job["error"])
        )
        self.assertLessEqual(
            {"rays", "rays_per_second", "efficiency", "rejected_samples", "peak_bytes"},
            set(job["statistics"]),
        )
        self.assertEqual((job["spec"]["name"], job["spec"]["labels"], job["spec"]["seed"]),
                         ("a job", {"k": "v"}, 7))
        done = self.server.wait(job["id"])
        self.assertEqual((done["state"], done["stop_reason"]), ("finished", "samples_per_pixel"))
        self.assertEqual(done["progress"]["fraction"], 1)
        self.assertEqual(done["progress"]["samples_per_pixel"], {"min": 8, "mean": 8, "max": 8})
        self.assertRegex(done["film_digest"], "^[0-9a-f]{64}$")
        self.assertEqual(done["statistics"]["rejected_samples"], 0)
        self.assertGreater(done["statistics"]["rays"], 8 * 48 * 32)
        times = [datetime.fromisoformat(done[t].replace("Z", "+00:00"))
                 for t in ("created_at", "started_at", "finished_at")]
        self.assertEqual(times, sorted(times))
        error = done["error"]
        self.assertTrue(error["low"] <= error["relative"] <= error["high"], error)
        self.assert_close(error["relative"], error["grain"] + error["doubt"] / 2, 1e-6)
        self.assertEqual(error["relative_rmse"], error["relative"])
        self.assertEqual(error["unreliable"], error["doubt"] > error["grain"])
        self.assertEqual((error["confidence"], error["bias"]), (0.95, "none"))
        self.assertLessEqual(
            done["progress"]["cpu_seconds"], 2 * done["progress"]["elapsed_seconds"] + 0.1
        )

    def test_every_link_resolves(self):
        job = self.server.render(job_body())
        for name, link in job["links"].items():
            method = "POST" if name == "cancel" else "GET"
            self.assertEqual(self.server.request(method, link).status, 200, name)

    def test_defaults_match_the_documentation(self):
        spec = self.server.post("/v1/jobs?dry_run=1", {"scene": "cornell-box"}).json()["spec"]
        self.assertEqual(spec["film"], {"width": 960, "height": 540, "crop": None,
                                        "filter": {"type": "blackman-harris", "radius": 1.5},
                                        "layers": ["albedo", "normal", "depth"]})
        self.assertEqual(spec["stop"], {"samples_per_pixel": 256})
        self.assertEqual(spec["integrator"], {"type": "path", "max_depth": 16})
        self.assertEqual(spec["sampler"], {"type": "sobol", "replicates": 2})
        self.assertEqual(spec["light_sampler"], {"type": "measured"})
        self.assertEqual((spec["class"], spec["priority"], spec["seed"]), ("normal", 0, 0))

    def test_spec_of_a_job_can_be_submitted_again(self):
        first = self.server.render(job_body(seed=3))
        second = self.server.render(first["spec"])
        self.assertEqual(first["film_digest"], second["film_digest"])

    def test_dry_run_is_200_and_creates_nothing(self):
        before = len(self.server.get("/v1/jobs?limit=200").json()["jobs"])
        answer = self.server.post("/v1/jobs?dry_run=1", job_body(samples=1000))
        self.assertEqual(answer.status, 200)
        self.assertIn("spec", answer.json())
        self.assertEqual(len(self.server.get("/v1/jobs?limit=200").json()["jobs"]), before)

    def test_dry_run_predicts_the_samples_of_an_error_target(self):
        # Furnace: uniform noise, so the small pilot image represents the large one. Errors of the
        # sampler decrease faster than those of independent samples, for which three times as many
        # would be needed here. The sky is a map: a constant sky is sampled by the cosine, which
        # leaves noise only at silhouettes.
        head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 64\n"
        sky = head + b"\x80\x80\x80\x81" * (64 * 32)
        asset = self.server.post("/v1/assets", sky, {"Content-Type": "image/vnd.radiance"})
        job = {
            "scene": "furnace",
            "environment": {"asset": asset.json()["id"]},
            "film": {"width": 128, "height": 72},
            "stop": {"relative_error": 0.008},
        }
        foreseen = self.server.post("/v1/jobs?dry_run=1", job).json()["estimate"][
            "samples_per_pixel"
        ]
        needed = self.server.render(job)["progress"]["samples_per_pixel"]["mean"]
        self.assertLess(foreseen, 2 * needed)
        self.assertGreater(foreseen, needed / 2)

    def test_rounds_odd_counts_up_with_a_warning(self):
        job = self.server.render(job_body(samples=7))
        self.assertEqual(job["spec"]["stop"]["samples_per_pixel"], 8)
        self.assertTrue(any("7" in w for w in job["warnings"]), job["warnings"])

    def test_prefer_wait_is_201_if_the_job_ended(self):
        answer = self.server.post("/v1/jobs", job_body(samples=2), {"Prefer": "wait=60"})
        self.assertEqual(answer.status, 201)
        # --max-wait: gateways give up after 60 s.
        self.assertEqual(answer.headers["Preference-Applied"], "wait=25")
        self.assertEqual(answer.json()["state"], "finished")
        self.assertIsNotNone(answer.json()["film_digest"])

    def test_prefer_wait_is_202_if_it_did_not(self):
        answer = self.server.post("/v1/jobs", job_body(samples=65536), {"Prefer": "wait=1"})
        self.assertEqual(answer.status, 202)
        self.assertEqual(answer.headers["Preference-Applied"], "wait=1")
        self.assertIn("Location", answer.headers)
        self.assertNotIn(answer.json()["state"], FINAL)
        self.server.post(f"/v1/jobs/{answer.json()['id']}/cancel")

    def test_ignores_other_preferences(self):
        answer = self.server.post("/v1/jobs", job_body(), {"Prefer": "respond-async"})
        self.assertEqual(answer.status, 201)
        self.assertNotIn("Preference-Applied", answer.headers)

    def test_idempotency_key_replays(self):
        key = {"Idempotency-Key": str(uuid.uuid4())}
        first = self.server.post("/v1/jobs", job_body(seed=11), key)
        again = self.server.post("/v1/jobs", job_body(seed=11), key)
        other = self.server.post("/v1/jobs", job_body(seed=12), key)
        self.assertEqual((first.status, again.status), (201, 200))
        self.assertEqual(first.json()["id"], again.json()["id"])
        self.assert_problem(other, 409)

    def test_equal_keys_at_once_create_one_job(self):
        key = {"Idempotency-Key": str(uuid.uuid4())}
        answers = [
            in_background(lambda: self.server.post("/v1/jobs", job_body(), key)) for _ in range(6)
        ]
        answers = [answer() for answer in answers]
        self.assertEqual(len({a.json()["id"] for a in answers}), 1)
        self.assertEqual(sorted(a.status for a in answers), [200] * 5 + [201])

    def test_every_sampler_renders_whole_sets_and_reports_it(self):
        # As documented: even counts for sobol and halton, whole sets of every replicate for the
        # others.
        least = {"independent": 1, "antithetic": 4, "stratified": 32, "latin-hypercube": 32,
                 "orthogonal-array": 50, "halton": 2, "sobol": 2, "zsobol": 16}
        listed = {entry["type"] for entry in self.server.get("/v1/server").json()["samplers"]}
        self.assertEqual(listed, set(least))
        for sampler, unit in least.items():
            job = self.server.render(job_body(samples=5, sampler={"type": sampler}))
            rounded = -(-5 // unit) * unit
            self.assertEqual(job["spec"]["stop"]["samples_per_pixel"], rounded, sampler)
            self.assertEqual(job["progress"]["samples_per_pixel"],
                             {"min": rounded, "mean": rounded, "max": rounded}, sampler)
            said = [w for w in job["warnings"] if "5 was requested" in w and sampler in w]
            self.assertEqual(len(said), 0 if rounded == 5 else 1, job["warnings"])
            self.assertGreater(job["error"]["relative"], 0)

    def test_extension_by_sets_gives_the_digest_of_the_longer_job(self):
        body = job_body(samples=32, sampler={"type": "stratified"})
        job = self.server.render(body)
        answer = self.server.post(
            f"/v1/jobs/{job['id']}/extend", {"stop": {"samples_per_pixel": 40}}
        )
        self.assertEqual(answer.status, 202)
        extended = self.server.wait(job["id"])
        self.assertEqual(extended["spec"]["stop"]["samples_per_pixel"], 64)
        longer = self.server.render(job_body(samples=64, sampler={"type": "stratified"}))
        self.assertEqual(extended["film_digest"], longer["film_digest"])

    def test_one_sample_fills_only_half_a(self):
        job = self.server.render(job_body(samples=1, sampler={"type": "independent"}))
        count = job["progress"]["samples_per_pixel"]["max"]
        if count == 1:
            self.assertIsNone(job["error"]["relative"])


class Waiting(ApiTest):
    def test_wait_returns_at_the_end(self):
        job = self.server.submit(job_body(samples=64))["id"]
        self.assertEqual(self.server.get(f"/v1/jobs/{job}?wait=60").json()["state"], "finished")

    def test_wait_returns_after_its_time(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        began = time.monotonic()
        state = self.server.get(f"/v1/jobs/{job}?wait=0.5").json()["state"]
        self.assertNotIn(state, FINAL)
        self.assertGreaterEqual(time.monotonic() - began, 0.5)
        self.server.post(f"/v1/jobs/{job}/cancel")

    def test_wait_with_an_etag_returns_at_a_change(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        path = f"/v1/jobs/{job}?wait=60"
        tag = self.server.get(path.split("?")[0]).headers["ETag"]
        for _ in range(3):
            answer = self.server.get(path, {"If-None-Match": tag})
            self.assertEqual(answer.status, 200)
            self.assertNotEqual(answer.headers["ETag"], tag)
            tag = answer.headers["ETag"]
        self.server.post(f"/v1/jobs/{job}/cancel")

    def test_cancel_ends_every_wait(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        waits = [
            in_background(lambda: self.server.get(f"/v1/jobs/{job}?wait=60")) for _ in range(4)
        ]
        self.server.wait_for_samples(job)
        self.server.post(f"/v1/jobs/{job}/cancel")
        for wait in waits:
            self.assertEqual(wait().json()["state"], "cancelled")

    def test_etag_of_a_final_job_gives_304(self):
        job = self.server.render(job_body())["id"]
        tag = self.server.get(f"/v1/jobs/{job}").headers["ETag"]
        for query in ("", "?wait=1"):
            answer = self.server.get(f"/v1/jobs/{job}{query}", {"If-None-Match": tag})
            self.assertEqual((answer.status, answer.body, answer.headers["ETag"]), (304, b"", tag))


class Listing(ApiTest):
    def test_lists_are_newest_first_with_cursors(self):
        ids = [self.server.submit(job_body(samples=2, labels={"group": "pages"}))["id"]
               for _ in range(5)][::-1]
        seen, target = [], "/v1/jobs?label=group%3Dpages&limit=2"
        while target:
            answer = self.server.get(target)
            page = answer.json()
            seen.append([job["id"] for job in page["jobs"]])
            link = answer.headers["Link"]
            self.assertEqual(link is None, page["next"] is None)
            target = re.match('<(.*)>; rel="next"', link).group(1) if link else None
        self.assertEqual(seen, [ids[:2], ids[2:4], ids[4:]])

    def test_filters_by_labels_and_states(self):
        red = self.server.render(job_body(samples=2, labels={"colour": "red", "size": "big"}))["id"]
        blue = self.server.render(job_body(samples=2, labels={"colour": "blue"}))["id"]

        def ids(query):
            return [job["id"] for job in self.server.get("/v1/jobs?" + query).json()["jobs"]]

        self.assertEqual(ids("label=colour%3Dred"), [red])
        self.assertEqual(ids("label=colour"), [blue, red])
        self.assertEqual(ids("label=colour&label=size%3Dbig"), [red])
        self.assertEqual(ids("label=colour&state=finished"), [blue, red])
        self.assertEqual(ids("label=colour&state=cancelled&state=queued"), [])
        self.assertEqual(ids("label=taste"), [])

    def test_filters_by_parts_of_names_with_cursors(self):
        tag = uuid.uuid4().hex
        labels = {"labels": {"tag": tag}}
        chair = self.server.submit(job_body(name=f"Chair {tag} 100%", samples=2, **labels))["id"]
        sofa = self.server.submit(job_body(name=f"Red Sofa {tag}", samples=2, **labels))["id"]
        preview = self.server.submit(
            job_body(name=f"sofa {tag}", samples=2, **{"class": "preview"})
        )["id"]
        nameless = self.server.submit(job_body(samples=2, **labels))["id"]

        def ids(**query):
            found, target = [], "/v1/jobs?" + urllib.parse.urlencode({"limit": 1, **query})
            while target:
                answer = self.server.get(target)
                found += [job["id"] for job in answer.json()["jobs"]]
                link = answer.headers["Link"]
                target = link and re.match('<(.*)>; rel="next"', link).group(1)
            return found

        self.assertEqual(ids(name=tag, **{"class": "all"}), [preview, sofa, chair])
        self.assertEqual(ids(name=f"SOFA {tag.upper()}", **{"class": "all"}), [preview, sofa])
        self.assertEqual(ids(name=f"sofa {tag}", **{"class": "normal"}), [sofa])
        self.assertEqual(ids(name=f"{tag} 1%"), [])
        self.assertEqual(ids(name="Cornell", label=f"tag={tag}"), [nameless])
        self.server.wait(sofa)
        self.assertEqual(ids(name=f"sofa {tag}", state="finished", label="tag"), [sofa])
        self.assertEqual(ids(name=f"sofa {tag}", state="cancelled", label="tag"), [])
        self.server.request("PATCH", f"/v1/jobs/{sofa}", {"name": f"Bench {tag}"})
        self.assertEqual(ids(name=f"sofa {tag}", **{"class": "normal"}), [])
        self.assertEqual(ids(name=f"bench {tag}"), [sofa])
        self.assert_problem(self.server.get("/v1/jobs?name="), 400, "/name")


class Changing(ApiTest):
    def patch(self, job, body, **headers):
        return self.server.request("PATCH", f"/v1/jobs/{job}", body,
                                   {k.replace("_", "-"): v for k, v in headers.items()})

    def setUp(self):
        self.job = self.server.submit(job_body(samples=65536, labels={"a": "1", "b": "2"}))["id"]
        self.addCleanup(lambda: self.server.post(f"/v1/jobs/{self.job}/cancel"))

    def test_patch_changes_only_its_members(self):
        before = self.server.job(self.job)["spec"]
        answer = self.patch(
            self.job, {"name": "new", "priority": 3, "labels": {"a": None, "c": "3"}}
        )
        self.assertEqual(answer.status, 200, answer)
        spec = answer.json()["spec"]
        self.assertEqual((spec["name"], spec["priority"], spec["labels"]),
                         ("new", 3, {"b": "2", "c": "3"}))
        changed = {"name": "new", "priority": 3, "labels": {"b": "2", "c": "3"}}
        self.assertEqual(spec, before | changed)
        self.assertEqual(self.server.job(self.job)["spec"], spec)

    def test_merge_patch_requires_its_media_type(self):
        answer = self.server.request("PATCH", f"/v1/jobs/{self.job}", b'{"name": "merged"}',
                                     {"Content-Type": "application/merge-patch+json"})
        self.assertEqual(answer.json()["spec"]["name"], "merged")

    def test_stop_can_be_lowered_while_rendering(self):
        self.server.wait_for_samples(self.job)
        self.assertEqual(self.patch(self.job, {"stop": {"samples_per_pixel": 4}}).status, 200)
        done = self.server.wait(self.job)
        self.assertEqual((done["state"], done["stop_reason"]), ("finished", "samples_per_pixel"))
        samples = done["progress"]["samples_per_pixel"]
        self.assertEqual(samples["min"], samples["max"])
        self.assertLess(samples["max"], 65536)

    def test_stop_can_be_raised(self):
        job = self.server.submit(job_body(samples=256))["id"]
        self.patch(job, {"stop": {"samples_per_pixel": 258}})
        self.assertEqual(self.server.wait(job)["progress"]["samples_per_pixel"]["mean"], 258)

    def test_stop_can_be_lowered_while_loading(self):
        self.assertEqual(self.patch(self.job, {"stop": {"samples_per_pixel": 4}}).status, 200)
        done = self.server.wait(self.job)
        self.assertEqual((done["state"], done["stop_reason"]), ("finished", "samples_per_pixel"))
        self.assertLess(done["progress"]["samples_per_pixel"]["max"], 65536)

    def test_pause_stops_and_resume_continues(self):
        self.server.wait_for_samples(self.job)
        paused = self.patch(self.job, {"paused": True})
        self.assertEqual(paused.json()["state"], "paused")
        # Slices in progress may still be committed, and then nothing more.
        deadline = time.monotonic() + PATIENCE_S
        first, second = None, self.server.job(self.job)
        while first is None or (first["revision"], first["progress"]["elapsed_seconds"]) != (
                second["revision"], second["progress"]["elapsed_seconds"]):
            self.assertLess(time.monotonic(), deadline, (first, second))
            time.sleep(0.5)
            first, second = second, self.server.job(self.job)
        self.assertEqual(self.server.get(f"/v1/jobs/{self.job}/image.png").status, 200)
        self.assertIn(
            self.patch(self.job, {"paused": False}).json()["state"], ("rendering", "queued")
        )
        self.server.wait_until(self.job, lambda job: job["revision"] > second["revision"])

    def test_if_match_compares_the_spec_part(self):
        tag = self.server.get(f"/v1/jobs/{self.job}").headers["ETag"]
        self.server.wait_for_samples(self.job)  # The revision has changed, the spec has not.
        self.assertEqual(self.patch(self.job, {"priority": 1}, If_Match=tag).status, 200)
        self.assert_problem(self.patch(self.job, {"priority": 2}, If_Match=tag), 412)
        self.assertEqual(self.patch(self.job, {"priority": 2}, If_Match="*").status, 200)

    def test_etag_covers_the_spec(self):
        self.server.wait_for_samples(self.job)
        self.patch(self.job, {"paused": True})
        time.sleep(0.3)
        before = self.server.get(f"/v1/jobs/{self.job}").headers["ETag"]
        self.patch(self.job, {"name": "other"})
        self.assertNotEqual(self.server.get(f"/v1/jobs/{self.job}").headers["ETag"], before)


class CancelAndDelete(ApiTest):
    def test_cancel_is_idempotent_and_keeps_the_image(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        self.server.wait_for_samples(job)
        for _ in range(3):
            answer = self.server.post(f"/v1/jobs/{job}/cancel")
            self.assertEqual(answer.status, 200)
            self.assertEqual((answer.json()["state"], answer.json()["stop_reason"]),
                             ("cancelled", "cancelled"))
            self.assertLess(answer.json()["progress"]["fraction"], 1)
        self.assertEqual(self.server.get(f"/v1/jobs/{job}/image.png").status, 200)
        self.assertEqual(self.server.get(f"/v1/jobs/{job}/pixels/1/1").status, 200)

    def test_cancel_costs_less_than_a_tenth_of_a_second_of_rendering(self):
        body = job_body(samples=65536)
        body["film"] = {"width": 320, "height": 240}
        job = self.server.submit(body)["id"]
        self.server.wait_for_samples(job)
        cpu = self.server.post(f"/v1/jobs/{job}/cancel").json()["progress"]["cpu_seconds"]
        self.assertEqual(
            self.server.get(f"/v1/jobs/{job}/film").status, 200
        )  # Waits until no slice is in progress.
        settled = self.server.job(job)["progress"]["cpu_seconds"]
        self.assertLess(settled - cpu, 0.1 * 2)
        time.sleep(0.5)
        self.assertEqual(self.server.job(job)["progress"]["cpu_seconds"], settled)

    def test_cancel_of_a_finished_job_changes_nothing(self):
        job = self.server.render(job_body())
        answer = self.server.post(f"/v1/jobs/{job['id']}/cancel")
        self.assertEqual((answer.status, answer.json()["state"]), (200, "finished"))

    def test_delete_removes_the_job_and_its_files(self):
        job = self.server.render(job_body())["id"]
        films = os.path.join(self.server.data, "films")
        self.assertTrue([f for f in os.listdir(films) if f.startswith(job)])
        self.assertEqual(self.server.request("DELETE", f"/v1/jobs/{job}").status, 204)
        self.assertEqual([f for f in os.listdir(films) if f.startswith(job)], [])
        self.assert_problem(self.server.get(f"/v1/jobs/{job}"), 404)
        self.assert_problem(self.server.get(f"/v1/jobs/{job}/image.png"), 404)
        self.assert_problem(self.server.request("DELETE", f"/v1/jobs/{job}"), 404)

    def test_delete_right_after_cancel_leaves_no_file(self):
        films = os.path.join(self.server.data, "films")
        for _ in range(8):
            job = self.server.submit(job_body(samples=65536))["id"]
            self.server.wait_for_samples(job)
            self.assertEqual(self.server.post(f"/v1/jobs/{job}/cancel").status, 200)
            self.assertEqual(self.server.request("DELETE", f"/v1/jobs/{job}").status, 204)
            self.assertEqual(self.server.get(f"/v1/jobs/{job}").status, 404)
            time.sleep(0.2)
            self.assertEqual([f for f in os.listdir(films) if f.startswith(job)], [])


class Extending(ApiTest):
    def test_extended_job_equals_the_longer_one(self):
        whole = self.server.render(job_body(samples=24))
        job = self.server.render(job_body(samples=8))
        self.assertNotEqual(whole["film_digest"], job["film_digest"])
        for samples in (16, 24):
            answer = self.server.post(f"/v1/jobs/{job['id']}/extend",
                                      {"stop": {"samples_per_pixel": samples}})
            self.assertEqual(answer.status, 202, answer)
            self.assertEqual(answer.json()["spec"]["stop"], {"samples_per_pixel": samples})
            self.assertLess(answer.json()["progress"]["fraction"], 1)
            done = self.server.wait(job["id"])
            self.assertEqual(done["progress"]["samples_per_pixel"]["mean"], samples)
        self.assertEqual(done["film_digest"], whole["film_digest"])
        self.assertGreater(done["revision"], job["revision"])

    def test_lower_error_extends_too(self):
        job = self.server.render(job_body(samples=16))
        target = job["error"]["relative"] / 1.5
        self.server.post(f"/v1/jobs/{job['id']}/extend", {"stop": {"relative_error": target}})
        done = self.server.wait(job["id"])
        self.assertEqual((done["state"], done["stop_reason"]), ("finished", "relative_error"))
        self.assertLessEqual(done["error"]["relative"], target)

    def test_more_time_extends_too(self):
        job = self.server.render(job_body(samples=4))
        self.server.post(f"/v1/jobs/{job['id']}/extend", {"stop": {"seconds": 0.3}})
        done = self.server.wait(job["id"])
        self.assertEqual((done["state"], done["stop_reason"]), ("finished", "seconds"))
