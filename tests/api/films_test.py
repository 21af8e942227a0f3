"""Films as files, and merging films, over HTTP."""

import hashlib
import json
import os
import random
import struct
import time
import unittest

from harness import ApiTest, in_background, job_body, started, tessera, wait_for

FILM = "application/vnd.tessera.film"


def part(first=0, replicates=2, samples=8, seed=0, sampler="sobol", **members):
    sampler = {"type": sampler, "replicates": replicates, "first_replicate": first}
    return job_body(samples=samples, seed=seed, sampler=sampler, **members)


def sealed(data):
    """Recomputes the last checksum of a film."""
    return bytes(data[:-64]) + hashlib.sha256(data[:-64]).hexdigest().encode()


def halves(data):
    """Returns (A - B) / 2 of every pixel and channel."""
    head, _, _, flags, width, height = struct.unpack_from("<IIIIii", data, 8)
    replicates, tiles = struct.unpack_from("<II", data, 48)
    found, at = [], head
    for _ in range(tiles):
        x, y = struct.unpack_from("<ii", data, at)
        at += 40
        pixels = min(32, width - x) * min(32, height - y)
        for _ in range(pixels):
            values = [struct.unpack_from("<5fI", data, at + 24 * k) for k in range(replicates)]
            at += 24 * replicates
            for c in range(3):
                sums = [
                    sum(v[c] * v[5] for v in values[h::2]) / sum(v[5] for v in values[h::2])
                    for h in (0, 1)
                ]
                found.append((sums[0] - sums[1]) / 2)
        at += 32 * pixels if flags & 1 else 0
    return found


class FilmTest(ApiTest):
    def film(self, job):
        answer = self.server.get(f"/v1/jobs/{job['id']}/film")
        self.assertEqual(answer.status, 200, answer)
        return answer

    def merge(self, *films):
        return self.server.post("/v1/films/merge", {"films": list(films)})

    def merged(self, *jobs):
        answer = self.merge(*(job["id"] for job in jobs))
        self.assertEqual(answer.status, 201, answer)
        return answer.json()

    def upload(self, data):
        answer = self.server.request(
            "POST", "/v1/assets", data, {"Content-Type": "application/octet-stream"}
        )
        self.assertIn(answer.status, (200, 201), answer)
        return answer.json()["id"]


class Films(FilmTest):
    def test_film_describes_itself(self):
        job = self.server.render(part(seed=3))
        answer = self.film(job)
        data = answer.body
        self.assertEqual(answer.headers["Content-Type"], FILM)
        self.assertEqual(data[:8], b"TSRFILM1")
        head, text_bytes, ranges, _, width, height = struct.unpack_from("<IIIIii", data, 8)
        self.assertEqual((width, height, ranges), (48, 32, 1))
        self.assertEqual(data[64:128].decode(), job["film_digest"])
        self.assertEqual(struct.unpack_from("<QIII", data, 128), (3, 0, 2, 8))
        self.assertEqual(hashlib.sha256(data[:-64]).hexdigest().encode(), data[-64:])
        text = json.loads(data[152:152 + text_bytes])
        self.assertEqual(text["spec"], job["spec"])
        self.assertEqual(text["film_digest"], job["film_digest"])
        build = self.server.get("/v1/server").json()["build"]
        self.assertEqual({k: v for k, v in text["build"].items() if k in build}, build)
        self.assertIn(build["isa"], text["build"]["arithmetic"])
        # The mean of all replicates is the image.
        tile = struct.unpack_from("<iiII", data, head)
        self.assertEqual(tile, (0, 0, 8, 0))
        first = struct.unpack_from("<5fI", data, head + 40)
        second = struct.unpack_from("<5fI", data, head + 64)
        pixel = self.server.get(f"/v1/jobs/{job['id']}/pixels/0/0").json()["layers"]["beauty"]
        for c in range(3):
            self.assertAlmostEqual(
                (first[c] + second[c]) / 2, pixel["mean"][c], delta=1e-6 + 1e-6 * first[c]
            )

    def test_downloads_a_film_in_ranges(self):
        job = self.server.render(part())
        path = f"/v1/jobs/{job['id']}/film"
        whole = self.film(job)
        data, etag = whole.body, whole.headers["ETag"]
        self.assertEqual(whole.headers["Content-Length"], str(len(data)))
        self.assertEqual(whole.headers["Accept-Ranges"], "bytes")
        self.assertEqual(self.server.get(path, {"If-None-Match": etag}).status, 304)
        head = self.server.request("HEAD", path)
        self.assertEqual(
            (head.status, head.body, head.headers["Content-Length"]), (200, b"", str(len(data)))
        )
        end = len(data) - 1
        for asked, first, last in (
            ("0-0", 0, 0),
            ("5-", 5, end),
            ("-64", end - 63, end),
            (f"100-{end + 9}", 100, end),
            ("7-70000", 7, min(70000, end)),
        ):
            answer = self.server.get(path, {"Range": f"bytes={asked}"})
            self.assertEqual(answer.status, 206, asked)
            self.assertEqual(answer.body, data[first:last + 1], asked)
            self.assertEqual(answer.headers["Content-Range"], f"bytes {first}-{last}/{len(data)}")
        for asked in (f"{end + 1}-", "-0", "9-3"):
            answer = self.server.get(path, {"Range": f"bytes={asked}"})
            self.assert_problem(answer, 416)
            self.assertEqual(answer.headers["Content-Range"], f"bytes */{len(data)}")
        self.assertEqual(
            self.server.get(path, {"Range": "bytes=0-9", "If-Range": etag}).status, 206
        )
        self.assertEqual(
            self.server.get(path, {"Range": "bytes=0-9", "If-Range": '"other"'}).status, 200
        )
        # A range from before a restart and one from after it belong to the same file.
        self.server.kill()
        self.server.start()
        rest = self.server.get(path, {"Range": "bytes=1000-", "If-Range": etag})
        self.assertEqual((rest.status, data[:1000] + rest.body), (206, data))
        self.server.post(f"/v1/jobs/{job['id']}/extend", {"stop": {"samples_per_pixel": 16}})
        self.server.wait(job["id"])
        self.assertEqual(
            self.server.get(path, {"Range": "bytes=1000-", "If-Range": etag}).status, 200
        )

    def test_parts_of_a_job_merge_to_its_film_and_continue(self):
        whole = self.server.render(part(replicates=4, samples=16))
        a = self.server.render(part(first=0))
        b = self.server.render(part(first=2))
        asset = self.upload(self.film(b).body)
        answer = self.merge(asset, a["id"])
        self.assertEqual(answer.status, 201, answer)
        merged = answer.json()
        self.assertEqual(merged["state"], "finished")
        self.assertEqual(merged["film_digest"], whole["film_digest"])
        self.assertEqual(answer.headers["Location"], f"/v1/jobs/{merged['id']}")
        for end in (".png", ".exr?layer=beauty"):
            pictures = [
                self.server.get(f"/v1/jobs/{job['id']}/image{end}").body for job in (whole, merged)
            ]
            self.assertGreater(len(pictures[0]), 100)
        self.assertEqual(self.server.get(f"/v1/jobs/{whole['id']}/pixels/9/9").json(),
                         self.server.get(f"/v1/jobs/{merged['id']}/pixels/9/9").json())
        for job in (whole, merged):
            extended = self.server.post(
                f"/v1/jobs/{job['id']}/extend", {"stop": {"samples_per_pixel": 32}}
            )
            self.assertEqual(extended.status, 202, extended)
        digests = {self.server.wait(job["id"])["film_digest"] for job in (whole, merged)}
        self.assertEqual(len(digests), 1)

    def test_parts_equal_the_whole_with_every_sampler(self):
        for sampler in self.server.get("/v1/server").json()["samplers"]:
            kind = sampler["type"]
            self.assertIn("/sampler/first_replicate", sampler["accepts"])
            # 800: whole sets of all samplers, for two replicates as well as four.
            film = {"width": 33, "height": 9, "layers": []}
            whole = self.server.render(part(replicates=4, samples=800, sampler=kind, film=film))
            parts = [
                self.server.render(part(first, 2, 400, sampler=kind, film=film)) for first in (2, 0)
            ]
            merged = self.merged(*parts)
            self.assertEqual(merged["film_digest"], whole["film_digest"], kind)
            # Compares the film alone; for the whole job the scene adds information, whose intervals
            # agree.
            self.assertEqual(merged["error"], self.merged(whole)["error"], kind)
            self.assertLess(merged["error"]["low"], whole["error"]["high"], kind)
            self.assertLess(whole["error"]["low"], merged["error"]["high"], kind)
            self.assertEqual(merged["spec"], dict(whole["spec"], name="merged"), kind)
            self.assertNotEqual(parts[0]["film_digest"], parts[1]["film_digest"], kind)

    def test_auxiliary_layers_equal_those_of_the_whole_up_to_rounding(self):
        film = {"width": 48, "height": 32, "layers": ["albedo", "normal", "depth"]}
        whole = self.server.render(part(replicates=4, samples=64, film=film))
        merged = self.merged(
            *(self.server.render(part(first, samples=32, film=film)) for first in (0, 2))
        )
        for x, y in ((0, 0), (20, 16), (47, 31), (31, 9)):
            pair = [
                self.server.get(f"/v1/jobs/{job['id']}/pixels/{x}/{y}").json()["layers"]
                for job in (whole, merged)
            ]
            self.assertEqual(pair[0]["beauty"], pair[1]["beauty"])
            for layer in ("albedo", "normal", "depth"):
                for one, other in zip(pair[0][layer]["mean"], pair[1][layer]["mean"]):
                    # A mean of 64 floats of that size, summed in another order.
                    self.assertAlmostEqual(one, other, delta=64 * 2.0 ** -24 * (abs(one) + 1))

    def test_other_seeds_are_more_replicates_and_survive_a_restart(self):
        jobs = [self.server.render(part(seed=seed, samples=16)) for seed in (1, 2, 3)]
        merged = self.merged(*jobs)
        self.assertEqual(merged["progress"]["samples_per_pixel"]["mean"], 48)
        self.assertEqual(merged["spec"]["sampler"]["replicates"], 6)
        self.assertIn("seed 3", " ".join(merged["warnings"]))
        for x, y in ((3, 3), (24, 16), (40, 30)):
            means = [
                self.server.get(f"/v1/jobs/{job['id']}/pixels/{x}/{y}").json()["layers"]["beauty"][
                    "mean"
                ]
                for job in (*jobs, merged)
            ]
            for c in range(3):
                self.assertAlmostEqual(
                    sum(mean[c] for mean in means[:3]) / 3, means[3][c], delta=1e-5
                )
        # Half the difference of the halves is the mean of theirs, so its expected square is a
        # third.
        before = self.film(merged).body
        for parts, whole in zip(
            zip(*(halves(self.film(job).body) for job in jobs)), halves(before)
        ):
            self.assertAlmostEqual(sum(parts) / 3, whole, delta=1e-5)
        refused = self.server.post(
            f"/v1/jobs/{merged['id']}/extend", {"stop": {"samples_per_pixel": 96}}
        )
        self.assert_problem(refused, 409)
        self.server.kill()
        self.server.start()
        self.assertEqual(self.server.job(merged["id"])["film_digest"], merged["film_digest"])
        self.assertEqual(self.film(merged).body, before)
        again = self.merge(merged["id"], self.server.render(part(seed=4, samples=16))["id"])
        self.assertEqual(again.status, 201, again)
        problem = self.assert_problem(self.merge(merged["id"], jobs[1]["id"]), 409, "/films/1")
        self.assertIn("replicate 0 of seed 2", problem["errors"][0]["detail"])

    def test_adaptive_films_merge_but_do_not_continue(self):
        adaptive = {"type": "pilot", "min_samples": 16}
        jobs = [
            self.server.render(part(seed=seed, samples=256, adaptive=adaptive)) for seed in (1, 2)
        ]
        merged = self.merged(*jobs)
        self.assertEqual(merged["spec"]["adaptive"]["type"], "pilot")
        counts = [
            self.server.get(f"/v1/jobs/{job['id']}/pixels/24/16").json()["samples"]
            for job in (*jobs, merged)
        ]
        self.assertEqual(counts[0] + counts[1], counts[2])
        self.assert_problem(
            self.server.post(
                f"/v1/jobs/{merged['id']}/extend", {"stop": {"samples_per_pixel": 1024}}
            ),
            409,
        )
        before = self.film(merged).body
        self.assertEqual(self.server.stop(), 0)
        code, said, _ = tessera("check", "--json", "--data", self.server.data)
        self.server.start()
        self.assertEqual((code, json.loads(said)["damages"]), (0, []))
        self.assertEqual(self.film(merged).body, before)

    def test_films_with_fits_merge_but_do_not_continue(self):
        estimator = {"mis": {"type": "optimal"}}
        whole = self.server.render(part(replicates=4, samples=128, estimator=estimator))
        merged = self.merged(
            *(self.server.render(part(first, samples=64, estimator=estimator)) for first in (0, 2))
        )
        self.assertEqual(merged["film_digest"], whole["film_digest"])
        self.assert_problem(
            self.server.post(
                f"/v1/jobs/{merged['id']}/extend", {"stop": {"samples_per_pixel": 256}}
            ),
            409,
        )
        before = self.film(merged).body
        self.server.kill()
        self.server.start()
        self.assertEqual(self.film(merged).body, before)

    def test_accepts_films_of_cancelled_and_preview_jobs(self):
        job = self.server.submit(part(samples=65536, seed=1))
        self.server.wait_for_samples(job["id"])
        self.server.post(f"/v1/jobs/{job['id']}/cancel")
        cancelled = self.server.wait(job["id"])
        data = self.film(cancelled).body
        self.assertEqual(self.film(cancelled).body, data)
        preview = self.server.render(part(seed=2, **{"class": "preview"}))
        merged = self.merged(cancelled, preview)
        self.assertEqual(merged["spec"]["class"], "normal")
        samples = [
            job["progress"]["samples_per_pixel"]["max"]
            for job in (self.server.job(job["id"]), preview, merged)
        ]
        self.assertEqual(samples[0] + samples[1], samples[2])
        alone = self.merge(self.upload(data))
        self.assertEqual(alone.status, 201, alone)

    def test_refuses_incompatible_films_with_the_reason(self):
        first = self.server.render(part())
        self.assert_problem(
            self.merge(first["id"], self.server.render(part(samples=16))["id"]), 409, "/films/1"
        )
        overlap = self.server.render(part(first=0, replicates=4))
        self.assert_problem(
            self.merge(self.server.render(part(first=2))["id"], overlap["id"]), 409, "/films/1"
        )
        for other, words in (
            (part(seed=1, integrator={"max_depth": 2}), ["/integrator/max_depth"]),
            (part(seed=1, scene="furnace"), ["/scene", "/environment"]),
            (part(seed=1, sampler="halton"), ["/sampler/type"]),
            (part(seed=1, adaptive={"type": "pilot"}, samples=64), ["/adaptive/type"]),
            (part(seed=1, camera={"vertical_fov_degrees": 30}), ["/camera/vertical_fov_degrees"]),
        ):
            answer = self.merge(first["id"], self.server.render(other)["id"])
            problem = self.assert_problem(answer, 422)
            self.assertEqual({error["pointer"] for error in problem["errors"]}, {"/films/1"})
            for word in words:
                self.assertIn(word, json.dumps(problem["errors"]))
        many = [
            self.server.render(part(seed=seed, replicates=32, samples=32))["id"]
            for seed in (5, 6, 7)
        ]
        self.assert_problem(self.merge(*many), 422, "/films/2")
        running = self.server.submit(part(samples=65536))
        self.assert_problem(self.server.get(f"/v1/jobs/{running['id']}/film"), 409)
        self.assert_problem(self.merge(running["id"]), 409, "/films/0")
        self.server.post(f"/v1/jobs/{running['id']}/cancel")
        for films in ([], ["x"], [first["id"], first["id"]], "x"):
            self.assert_problem(self.server.post("/v1/films/merge", {"films": films}), 422)
        self.assert_problem(self.merge("0" * 64), 404, "/films/0")
        self.assert_problem(self.merge("00000000-0000-4000-8000-000000000000"), 404, "/films/0")
        for body, status in ((b"{", 400), (b"[]", 422), (b'{"films": [], "x": 1}', 422)):
            answer = self.server.request(
                "POST", "/v1/films/merge", body, {"Content-Type": "application/json"}
            )
            self.assert_problem(answer, status)
        self.assert_problem(
            self.server.request("POST", "/v1/films/merge", b"{}", {"Content-Type": "text/plain"}),
            415,
        )

    def test_first_replicate_is_even_and_not_too_large(self):
        for first in (-2, 1, 65538, "2", None):
            answer = self.server.post("/v1/jobs", job_body(sampler={"first_replicate": first}))
            self.assert_problem(answer, 422, "/sampler/first_replicate")
        self.assertEqual(
            self.server.submit(job_body(sampler={"first_replicate": 65536}))["spec"]["sampler"],
            {"type": "sobol", "replicates": 2, "first_replicate": 65536},
        )

    def test_refuses_bytes_that_are_not_a_film(self):
        data = self.film(self.server.render(part())).body
        flipped = bytearray(data)
        flipped[len(data) // 2] ^= 4
        lying = bytearray(data)
        struct.pack_into("<ii", lying, 24, 16000, 4000)
        struct.pack_into("<iiiiII", lying, 32, 0, 0, 16000, 4000, 2, 500 * 125)
        size = struct.unpack_from("<I", data, 8)[0] + 500 * 125 * 40 + 16000 * 4000 * 48 + 64
        struct.pack_into("<Q", lying, 56, size)
        newer = b"TSRFILM2" + data[8:]
        text = data.replace(b'"max_depth":16', b'"max_depth":"x"'[:14])
        other = data.replace(b'"width":48', b'"width":47')
        ids = self.film(self.server.render(part(film=job_body()["film"] | {"layers": ["object"]})))
        unasked = ids.body.replace(b'["object"]', b"[]" + b" " * 8)
        seed = bytearray(data)
        struct.pack_into("<Q", seed, 128, 7)
        infinite = bytearray(data)
        struct.pack_into("<f", infinite, struct.unpack_from("<I", data, 8)[0] + 40, float("inf"))
        many = bytearray(data)
        struct.pack_into("<I", many, struct.unpack_from("<I", data, 8)[0] + 8, 1 << 30)
        picture = self.server.get(
            "/v1/jobs/" + self.server.render(part())["id"] + "/image.png"
        ).body
        for name, bad, words in (
            ("text", b"x", "film"),
            ("short", data[:100], "film"),
            ("cut", data[:-1], "bytes"),
            ("long", data + b"0", "bytes"),
            ("flipped", bytes(flipped), "checksum"),
            ("lying", sealed(lying), "bytes"),
            ("newer", sealed(newer), "film"),
            ("garbled", sealed(text), "text"),
            ("other", sealed(other), "another film"),
            ("unasked", sealed(unasked), "another film"),
            ("seed", sealed(seed), "another film"),
            ("infinite", sealed(infinite), "tile 0"),
            ("many", sealed(many), "tile 0"),
            ("picture", picture, "film"),
        ):
            problem = self.assert_problem(self.merge(self.upload(bad)), 422, "/films/0")
            self.assertIn(words, problem["errors"][0]["detail"], name)
        self.assertEqual(self.server.get("/livez").status, 200)

    def test_refuses_a_film_truncated_anywhere(self):
        data = self.film(self.server.render(part())).body
        chance = random.Random(5)
        for cut in [0, 7, 8, 127, 128, 151, 152, *(chance.randrange(len(data)) for _ in range(20))]:
            asset = self.upload(data[:cut])
            self.assert_problem(self.merge(asset), 422, "/films/0")
            self.assert_problem(
                self.merge(self.upload(sealed(data[:cut] + b"0" * 64))), 422, "/films/0"
            )

    def test_job_may_be_deleted_while_its_film_is_sent_or_merged(self):
        film = {"width": 512, "height": 512, "layers": []}
        job = self.server.render(part(samples=2, film=film))
        other = self.server.render(part(first=2, samples=2, film=film))
        expected = self.film(job).body
        connection = self.server.connect()
        connection.request("GET", f"/v1/jobs/{job['id']}/film")
        response = connection.getresponse()
        merging = in_background(lambda: self.merge(job["id"], other["id"]))
        self.assertEqual(self.server.request("DELETE", f"/v1/jobs/{job['id']}").status, 204)
        self.assertEqual(response.read(), expected)
        connection.close()
        self.assertIn(merging().status, (201, 404))
        self.assert_problem(self.server.get(f"/v1/jobs/{job['id']}/film"), 404)


class FilmMemory(FilmTest):
    FLAGS = ("--max-running", "1")

    def test_refuses_films_that_need_too_much_memory_before_allocation(self):
        first = self.server.submit(part(samples=65536) | {"priority": 1})
        limit = self.server.get("/v1/server").json()["limits"]["film_bytes"]
        # Bytes of a pixel: of two replicates, and of auxiliary values or of mattes.
        for layers, width, height, bytes_of_pixel, where in (
            (["normal"], 8192, 7800, 2 * 24 + 32, 0),
            (["cryptomatte:object"], 5120, 4000, 2 * 24 + 72, 1),
        ):
            film = {"width": width, "height": height, "layers": layers}
            ids = [self.server.submit(part(first=2 * i, film=film))["id"] for i in range(2)]
            self.server.post(f"/v1/jobs/{ids[0]}/cancel")
            self.assertGreater(width * height * bytes_of_pixel * (where + 1), limit)
            self.assertLess(width * height * bytes_of_pixel * where, limit)
            problem = self.assert_problem(self.merge(*ids), 413, f"/films/{where}")
            self.assertIn(str(limit), problem["errors"][0]["detail"])
            self.assertEqual(self.server.job(ids[1])["state"], "queued")
        self.server.post(f"/v1/jobs/{first['id']}/cancel")


class Verbs(FilmTest):
    """The same through the command line."""

    def tessera(self, *arguments, code=0):
        done, said, complained = tessera(
            *arguments, "--server", f"http://127.0.0.1:{self.server.port}"
        )
        self.assertEqual(done, code, complained)
        return said if code == 0 else complained

    def test_fetches_merges_and_compares_films(self):
        whole = self.server.render(part(replicates=4, samples=16))
        parts = [self.server.render(part(first=first)) for first in (0, 2)]
        place = os.path.join(self.server.data, "part.film")
        self.tessera("fetch", parts[0]["id"], "--film", "-o", place)
        with open(place, "rb") as file:
            self.assertEqual(file.read(), self.film(parts[0]).body)
        merged = self.tessera("merge", place, parts[1]["id"]).strip()
        self.assertEqual(self.server.job(merged)["film_digest"], whole["film_digest"])
        told = json.loads(self.tessera("merge", "--json", place))
        self.assertEqual(told["film_digest"], parts[0]["film_digest"])
        self.assertIn("/films/1", self.tessera("merge", place, parts[0]["id"], code=1))
        figures = json.loads(self.tessera("compare", "--json", merged, whole["id"]))
        self.assertEqual((figures["mse"], figures["flip"]), (0, 0))
        lines = self.tessera("compare", parts[0]["id"], parts[1]["id"]).splitlines()
        self.assertEqual([line.split()[0] for line in lines],
                         ["MSE", "relMSE", "FLIP", "bias", "z", "difference", "z", "flip"])
        picture = os.path.join(self.server.data, "picture.exr")
        self.tessera("fetch", whole["id"], "-o", picture)
        self.assertLess(
            json.loads(self.tessera("compare", "--json", whole["id"], picture))["relmse"], 2.0**-22
        )
        self.assertIn("no asset", self.tessera("merge", "0" * 64, code=1))
        # The command line reports errors by file name.
        for verb in ("merge", "compare"):
            self.assertIn(
                "nosuch.film: there is no such file",
                self.tessera(verb, merged, "nosuch.film", code=1),
            )
        self.assertIn(
            f"/films/1 ({parts[0]['id']}): ", self.tessera("merge", place, parts[0]["id"], code=1)
        )
        display = os.path.join(self.server.data, "picture.png")
        self.tessera("fetch", whole["id"], "-o", display)
        server = f"http://127.0.0.1:{self.server.port}"
        for file, warned in ((display, True), (picture, False)):
            _, _, complained = tessera("compare", whole["id"], file, "--server", server)
            self.assertEqual("display values" in complained, warned)
        for wrong in (
            ("merge",),
            ("compare", merged),
            ("fetch", merged, "--film", "--layer", "normal", "-o", place),
        ):
            self.tessera(*wrong, code=2)


class Killed(unittest.TestCase):
    def test_a_merge_exists_completely_or_not_at_all(self):
        server = started(self)
        film = {"width": 256, "height": 256, "layers": []}
        ids = [server.render(part(first=first, samples=2, film=film))["id"] for first in (0, 2)]
        whole = server.render(part(replicates=4, samples=4, film=film))["film_digest"]
        chance = random.Random(3)
        acknowledged = []
        for _ in range(8):
            merging = in_background(lambda: server.post("/v1/films/merge", {"films": ids}))
            time.sleep(chance.uniform(0, 0.06))
            server.kill()
            try:
                answer = merging()
                self.assertEqual(answer.status, 201)
                acknowledged.append(answer.json()["id"])
            except OSError:
                pass
            except Exception as error:  # http.client's own: truncated
                self.assertIn("http.client", type(error).__module__)
            server.start()
            for job in server.get("/v1/jobs?limit=200").json()["jobs"]:
                self.assertEqual(job["state"], "finished")
                if job["spec"]["name"] == "merged":
                    self.assertEqual(job["film_digest"], whole)
                    data = server.get(f"/v1/jobs/{job['id']}/film").body
                    self.assertEqual(data[64:128].decode(), whole)
        for job in acknowledged:
            self.assertEqual(server.job(job)["state"], "finished")
        server.stop()
        code, said, _ = tessera("check", "--json", "--data", server.data)
        found = json.loads(said)
        self.assertEqual((code, found["damages"], found["leftovers"]), (0, [], []))


class FilmAccess(unittest.TestCase):
    """Access to films and to merging."""

    def test_enforces_scopes_and_rates(self):
        server = started(self, "--shared", "--key", "operators-own", key="operators-own")
        job = server.render(part())
        other = server.render(part(first=2))

        def add_key(*flags):
            code, key, said = tessera("keys", "add", "test", "--data", server.data, *flags)
            self.assertEqual(code, 0, said)
            return key.strip()

        def status(key, method, path, body=None):
            return server.request(
                method, path, body, {"Authorization": f"Bearer {key}" if key else ""}
            ).status

        reads, writes, slow = (
            add_key("--scope", "read"),
            add_key("--scope", "write"),
            add_key("--rate", "2"),
        )
        wait_for(lambda: status(reads, "GET", "/v1/jobs") == 200)
        film = f"/v1/jobs/{job['id']}/film"
        merge = {"films": [job["id"], other["id"]]}
        compare = {"a": job["id"], "b": other["id"]}
        self.assertEqual(
            [status(key, "GET", film) for key in (None, reads, writes)], [401, 200, 403]
        )
        for path, body in (("/v1/films/merge", merge), ("/v1/comparisons", compare)):
            self.assertEqual(
                [status(key, "POST", path, body) for key in (None, reads, writes)], [401, 403, 201]
            )
        made = server.post("/v1/comparisons", compare).json()["links"]
        for path in (made["self"], made["z"]):
            self.assertEqual(
                [status(key, "GET", path) for key in (None, reads, writes)], [401, 200, 403]
            )
        self.assertEqual([status(slow, "GET", film) for _ in range(3)], [200, 200, 429])
