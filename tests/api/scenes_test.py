"""Scenes: all forms of upload, their descriptions, and truncated or wrong files."""

import base64
import io
import json
import struct
import zipfile

from harness import (ApiTest, TRIANGLE, glb, job_body, triangle_document, triangle_glb)

GLB = {"Content-Type": "model/gltf-binary"}
GLTF = {"Content-Type": "model/gltf+json"}
ZIP = {"Content-Type": "application/zip"}
BYTES = {"Content-Type": "application/octet-stream"}


def zipped(files, method=zipfile.ZIP_DEFLATED):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return out.getvalue()


class Scenes(ApiTest):
    def asset(self, data):
        return self.server.post("/v1/assets", data, BYTES).json()["id"]

    def test_a_glb_is_201_and_then_200(self):
        data = triangle_glb(cameras=[{"type": "perspective", "name": "front",
                                      "perspective": {"yfov": 0.8, "znear": 0.1}}],
                            nodes=[{"mesh": 0}, {"camera": 0, "translation": [0, 0, 4]}],
                            scenes=[{"nodes": [0, 1]}])
        first = self.server.post("/v1/scenes", data, GLB)
        again = self.server.post("/v1/scenes", data, GLB)
        self.assertEqual((first.status, again.status), (201, 200), first)
        self.assertEqual(first.json(), again.json())
        scene = first.json()
        self.assertEqual(first.headers["Location"], "/v1/scenes/" + scene["id"])
        self.assertEqual(self.server.get("/v1/scenes/" + scene["id"]).json(), scene)
        self.assertEqual(set(scene), {"id", "name", "bytes", "bounds", "triangles", "instances",
                                      "cameras", "lights", "light_groups", "materials",
                                      "variants", "animations", "extensions", "warnings",
                                      "warning_details"})
        self.assertEqual(scene["triangles"], 1)
        self.assertEqual(scene["bounds"], {"min": [-1, -1, 0], "max": [1, 1, 0]})
        self.assertIn("front", json.dumps(scene["cameras"]))
        self.assertIn(
            scene["id"], [s["id"] for s in self.server.get("/v1/scenes").json()["scenes"]]
        )
        self.assertEqual(
            self.server.render(job_body(scene["id"], camera={"name": "front"}))["state"], "finished"
        )

    def test_accepts_a_gltf_with_embedded_data(self):
        uri = "data:application/octet-stream;base64," + base64.b64encode(TRIANGLE).decode()
        answer = self.server.post("/v1/scenes", json.dumps(triangle_document(uri)).encode(), GLTF)
        self.assertEqual(answer.status, 201, answer)

    def test_scene_has_the_name_of_its_first_upload_or_its_own(self):
        data = triangle_glb(extras={"made": "for its name"})
        made = self.server.post("/v1/scenes?name=red%20chair.glb", data, GLB)
        self.assertEqual((made.status, made.json()["name"]), (201, "red chair.glb"))
        again = self.server.post("/v1/scenes?name=other", data, GLB)
        self.assertEqual((again.status, again.json()["id"], again.json()["name"]),
                         (200, made.json()["id"], "red chair.glb"))
        kept = 'the file is known as "red chair.glb", and keeps this name'
        self.assertEqual(again.json()["warnings"], [kept])
        self.assertEqual(again.json()["warning_details"],
                         [{"code": "name", "pointer": "", "detail": kept}])
        for query in ("", "?name=red%20chair.glb"):
            same = self.server.post("/v1/scenes" + query, data, GLB)
            self.assertEqual((same.status, same.json()), (200, made.json()))
        listed = self.server.get("/v1/scenes").json()["scenes"]
        self.assertIn("red chair.glb", [scene["name"] for scene in listed])
        own = triangle_glb(scene=0, scenes=[{"nodes": [0], "name": "its own"}])
        self.assertEqual(self.server.post("/v1/scenes", own, GLB).json()["name"], "its own")

    def test_checks_the_name_of_an_upload(self):
        for query, pointer in (
            ("name=", "/name"),
            ("name=" + "x" * 256, "/name"),
            ("name=%07", "/name"),
            ("name=a&name=b", "/name"),
            ("title=a", "/title"),
        ):
            self.assert_problem(
                self.server.post("/v1/scenes?" + query, triangle_glb(), GLB), 422, pointer
            )

    def test_missing_files_are_424_with_their_names(self):
        gltf = self.asset(json.dumps(triangle_document("parts/points.bin")).encode())
        answer = self.server.post("/v1/scenes", {"gltf": gltf, "files": {}})
        problem = self.assert_problem(answer, 424)
        self.assertIn("parts/points.bin", json.dumps(problem))
        self.assertEqual([error["pointer"] for error in problem["errors"]],
                         ["/files/parts~1points.bin"])
        answer = self.server.post(
            "/v1/scenes", {"gltf": gltf, "files": {"parts/points.bin": "0" * 64}}
        )
        self.assert_problem(answer, 422, "/files/parts~1points.bin")
        points = self.asset(TRIANGLE)
        answer = self.server.post(
            "/v1/scenes", {"gltf": gltf, "files": {"parts/points.bin": points}}
        )
        self.assertEqual(answer.status, 201, answer)

    def test_files_outside_are_told_first_and_names_alike_are_named(self):
        images = {"images": [{"uri": "../a.png"}], "textures": [{"source": 0}],
                  "materials": [{"normalTexture": {"index": 0}}],
                  "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}]}
        gltf = self.asset(json.dumps(triangle_document("parts/points.bin", **images)).encode())
        other = self.asset(b"other")
        answer = self.server.post("/v1/scenes", {"gltf": gltf, "files": {"Points.BIN": other}})
        problem = self.assert_problem(answer, 424)
        self.assertEqual(problem["detail"],
                         "files outside the folder of the scene are not read: ../a.png; "
                         "files that the scene refers to are missing: parts/points.bin")
        details = {e["pointer"]: e["detail"] for e in problem["errors"]}
        self.assertEqual(details["/files/..~1a.png"], "lies outside the folder of the scene")
        self.assertEqual(details["/files/parts~1points.bin"],
                         'is missing; there is "Points.BIN"')

    def test_names_in_files_are_found_as_in_archives(self):
        points = self.asset(TRIANGLE)
        for uri, name in (("./sub/../points.bin", "points.bin"), ("Points.BIN", "points.bin"),
                          ("parts\\points.bin", "parts/points.bin")):
            gltf = self.asset(json.dumps(triangle_document(uri)).encode())
            answer = self.server.post("/v1/scenes", {"gltf": gltf, "files": {name: points}})
            self.assertIn(answer.status, (200, 201), answer)

    def test_gltf_alone_that_refers_to_files_is_424(self):
        body = json.dumps(triangle_document("points.bin")).encode()
        self.assert_problem(self.server.post("/v1/scenes", body, GLTF), 424)

    def test_names_in_files_are_exact_or_as_in_the_document(self):
        gltf = self.asset(json.dumps(triangle_document("rate%2520a.bin")).encode())
        points, other = self.asset(TRIANGLE), self.asset(b"other")
        for files in ({"rate%20a.bin": points}, {"rate%2520a.bin": points},
                      {"rate%20a.bin": points, "rate%2520a.bin": other}):
            answer = self.server.post("/v1/scenes", {"gltf": gltf, "files": files})
            self.assertIn(answer.status, (200, 201), (files, answer))

    def test_a_glb_takes_files_beside_it(self):
        document = triangle_document("points.bin")
        body = glb(document)
        problem = self.assert_problem(self.server.post("/v1/scenes", body, GLB), 424)
        self.assertEqual([error["pointer"] for error in problem["errors"]], ["/files/points.bin"])
        answer = self.server.post("/v1/scenes", {
            "gltf": self.asset(body), "files": {"points.bin": self.asset(TRIANGLE)}})
        self.assertIn(answer.status, (200, 201), answer)

    def test_images_that_no_texture_uses_are_not_needed(self):
        document = triangle_document("points.bin", images=[{"uri": "gone.png"}])
        data = zipped({"a.gltf": json.dumps(document), "points.bin": TRIANGLE})
        self.assertIn(self.server.post("/v1/scenes", data, ZIP).status, (200, 201))

    def test_cannot_refer_to_a_file_of_the_server(self):
        for uri in (
            "/etc/passwd",
            "../../../etc/passwd",
            "file:///etc/passwd",
            "http://127.0.0.1/x",
        ):
            body = json.dumps(triangle_document(uri)).encode()
            answer = self.server.post("/v1/scenes", body, GLTF)
            self.assertIn(answer.status, (422, 424), (uri, answer))

    def test_checks_asset_requests(self):
        for body, status, pointer in (({}, 422, "/gltf"), ({"gltf": "x"}, 422, "/gltf"),
                                      ({"gltf": "0" * 64, "colour": 1}, 422, "/colour"),
                                      ({"gltf": "0" * 64, "files": {"a": "x"}}, 422, "/files/a")):
            self.assert_problem(self.server.post("/v1/scenes", body), status, pointer)
        self.assertIn(self.server.post("/v1/scenes", {"gltf": "0" * 64}).status, (404, 422, 424))

    def test_accepts_a_zip_with_a_scene_in_a_folder(self):
        for method in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            data = zipped(
                {
                    "thing/scene.gltf": json.dumps(triangle_document("bin/points.bin")),
                    "thing/bin/points.bin": TRIANGLE,
                    f"thing/readme{method}.txt": "hello",
                },
                method,
            )
            answer = self.server.post("/v1/scenes", data, ZIP)
            self.assertIn(answer.status, (200, 201), answer)
            self.assertEqual(answer.json()["triangles"], 1)

    def test_refuses_invalid_zips(self):
        good = zipped({"scene.glb": triangle_glb(), "big.txt": "x" * 5000})
        cases = [b"", b"PK", good[:40], good[:-10], zipped({"readme.txt": "nothing"}),
                 zipped({"a.glb": triangle_glb(), "b.glb": triangle_glb()}),
                 zipped({"scene.gltf": json.dumps(triangle_document("../outside.bin"))}),
                 zipped({"scene.gltf": json.dumps(triangle_document("missing.bin"))})]
        flipped = bytearray(good)
        flipped[60] ^= 0xFF
        cases.append(bytes(flipped))
        for data in cases:
            answer = self.server.post("/v1/scenes", data, ZIP)
            self.assertTrue(400 <= answer.status < 500, (len(data), answer))
            self.assert_problem(answer, answer.status)

    def test_refuses_a_zip_bomb(self):
        data = zipped({"scene.glb": triangle_glb(), "bomb.bin": b"\0" * (64 << 20)})
        answer = self.server.post("/v1/scenes", data, ZIP)
        self.assertIn(answer.status, (201, 413, 422), answer)

    def test_unknown_required_extension_is_422(self):
        data = triangle_glb(
            extensionsRequired=["EXT_nobody_knows"], extensionsUsed=["EXT_nobody_knows"]
        )
        problem = self.assert_problem(self.server.post("/v1/scenes", data, GLB), 422)
        self.assertIn("EXT_nobody_knows", problem["detail"])

    def test_unknown_used_extension_is_a_warning(self):
        data = triangle_glb(extensionsUsed=["EXT_nobody_needs"])
        answer = self.server.post("/v1/scenes", data, GLB)
        self.assertEqual(answer.status, 201, answer)
        self.assertIn("EXT_nobody_needs", json.dumps(answer.json()["warnings"]))

    def test_faults_are_mended_and_told_or_refused_on_request(self):
        metal = {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1.00000012, 0.5, 1]}}
        data = triangle_glb(
            materials=[metal],
            meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        )
        pointer = "/materials/0/pbrMetallicRoughness/baseColorFactor/1"
        self.assert_problem(self.server.post("/v1/scenes?strict=1", data, GLB), 422, pointer)
        answer = self.server.post("/v1/scenes", data, GLB)
        self.assertEqual(answer.status, 201, answer)
        scene = answer.json()
        (detail,) = scene["warning_details"]
        self.assertEqual((detail["code"], detail["pointer"]), ("clamped", pointer))
        self.assertEqual(scene["warnings"], [pointer + ": " + detail["detail"]])
        self.assertEqual(self.server.get("/v1/scenes/" + scene["id"]).json(), scene)
        # Also once the scene is known.
        self.assert_problem(self.server.post("/v1/scenes?strict=1", data, GLB), 422, pointer)
        self.assert_problem(self.server.post("/v1/scenes?strict=2", data, GLB), 422)
        job = self.server.render(job_body(scene["id"]))
        self.assertEqual(job["warning_details"], scene["warning_details"])
        self.assertEqual(job["warnings"].count(scene["warnings"][0]), 1)

    def test_checks_curves_of_the_index_of_refraction(self):
        def post(cauchy, query=""):
            glass = {"extensions": {"KHR_materials_ior": {"ior": 1.45},
                                    "KHR_materials_transmission": {"transmissionFactor": 1},
                                    "KHR_materials_volume": {"thicknessFactor": 1}},
                     "extras": {"ior_cauchy": cauchy}}
            data = triangle_glb(materials=[glass], extensionsUsed=list(glass["extensions"]))
            return self.server.post("/v1/scenes" + query, data, GLB)
        answer = post([1.504584, 0.004217, 0])
        self.assertEqual(answer.status, 201, answer)
        warnings = answer.json()["warnings"]
        self.assertEqual(len(warnings), 1, warnings)
        self.assertIn("KHR_materials_ior says 1.45", warnings[0])
        self.assert_problem(
            post([0.9, 0, 0], "?strict=1"), 422, "/materials/0/extras/ior_cauchy"
        )

    def test_integrators_that_lack_the_scenes_matter_are_refused_at_once(self):
        volume = {"KHR_materials_transmission": {"transmissionFactor": 1},
                  "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 0.1,
                                           "attenuationColor": [0.5, 0.5, 0.5]}}
        milk = {**volume, "KHR_materials_volume_scatter": {"multiscatterColor": [0.9, 0.9, 0.9]}}
        prism = {**volume, "KHR_materials_dispersion": {"dispersion": 1}}
        for extensions, refused in ((milk, ("sppm",)), (prism, ("sppm",)), (volume, ())):
            glb = triangle_glb(materials=[{"extensions": extensions}],
                               extensionsUsed=list(extensions))
            scene = self.server.post("/v1/scenes", glb, GLB).json()
            for integrator in ("path", "bdpt", "sppm"):
                for query in ("", "?dry_run=1"):
                    wanted = job_body(scene["id"], integrator={"type": integrator})
                    answer = self.server.post("/v1/jobs" + query, wanted)
                    if integrator in refused:
                        self.assert_problem(answer, 422, "/integrator/type")
                    else:
                        self.assertEqual(answer.status, 200 if query else 201, answer)

    def test_wrong_documents_are_422_with_a_reason(self):
        huge = 1 << 40
        too_many = {"bufferView": 0, "componentType": 5126, "count": huge, "type": "VEC3"}
        # The document, the place of the fault, and words that the reason must have.
        for data, pointer, words in (
            (triangle_glb(asset={"version": "1.0"}), "/asset/version", ["1.0", "2.0"]),
            (triangle_glb(nodes=[{"mesh": 7}]), "/nodes/0/mesh", ["7", "meshes"]),
            (triangle_glb(accessors=[]), "/meshes/0/primitives/0/attributes/POSITION",
             ["0", "accessors"]),
            (triangle_glb(nodes=[{"mesh": 0, "children": [0]}]), "/nodes/0", ["descendants"]),
            (triangle_glb(bufferViews=[{"buffer": 0, "byteLength": huge}]), "/bufferViews/0",
             [str(huge), str(len(TRIANGLE))]),
            (triangle_glb(accessors=[too_many]), "/accessors/0", [str(huge), str(len(TRIANGLE))]),
            (b"glTF", None, ["4 bytes", "header"]),
            (b"", None, ["GLB", "JSON"]),
            (b"\0" * 100, None, ["GLB", "JSON"]),
            (b"glTF" + struct.pack("<IIII", 2, 1 << 30, 1 << 30, 0x4E4F534A), None,
             [str(1 << 30)]),
        ):
            answer = self.server.post("/v1/scenes", data, GLB)
            problem = self.assert_problem(answer, 422, *([pointer] if pointer else []))
            for word in words:
                self.assertIn(word, problem["detail"])

    def test_accepts_a_document_without_a_scene(self):
        self.assertEqual(self.server.post(
            "/v1/scenes", glb({"asset": {"version": "2.0"}}), GLB).status, 201)

    def test_reports_a_file_that_is_not_a_scene_without_its_bytes(self):
        noise = bytes((7 * i * i + 150) % 256 for i in range(2048))
        for data, said in (
            (noise, "neither a GLB nor glTF JSON"),
            (b"[1]", "neither a GLB nor glTF JSON"),
            (b' {"asset": \xff}', "not JSON from byte 11 (line 1, column 12) on"),
        ):
            answer = self.server.post("/v1/scenes", data, GLB)
            self.assert_problem(answer, 422)
            self.assertIn(said, answer.json()["detail"])
            self.assertNotRegex(answer.json()["detail"], "exception|last read")

    def test_refuses_a_built_in_scene_truncated_anywhere(self):
        whole = self.server.get("/v1/scenes/cornell-box/gltf")
        self.assertEqual(whole.headers["Content-Type"].split(";")[0], "model/gltf-binary")
        data = whole.body
        json_bytes = struct.unpack("<I", data[12:16])[0]
        cuts = sorted(
            {
                *range(0, 28),
                *range(28, json_bytes, max(1, json_bytes // 40)),
                19 + json_bytes,
                20 + json_bytes,
                24 + json_bytes,
                28 + json_bytes,
                *range(28 + json_bytes, len(data), max(1, len(data) // 40)),
                *range(len(data) - 9, len(data)),
            }
        )
        for cut in cuts:
            answer = self.server.post("/v1/scenes", data[:cut], GLB)
            self.assertTrue(400 <= answer.status < 500, (cut, answer))
            # The same with a header that has the correct length.
            if cut >= 12:
                honest = data[:8] + struct.pack("<I", cut) + data[12:cut]
                answer = self.server.post("/v1/scenes", honest, GLB)
                self.assertTrue(400 <= answer.status < 500, (cut, answer))
        self.assertTrue(self.server.alive())
        answer = self.server.post("/v1/scenes", data, GLB)
        self.assertIn(answer.status, (200, 201), answer)

    def test_built_in_scene_round_trips_to_the_same_image(self):
        data = self.server.get("/v1/scenes/veach-mis/gltf").body
        scene = self.server.post("/v1/scenes", data, GLB).json()
        here = self.server.render(job_body("veach-mis"))
        there = self.server.render(job_body(scene["id"]))
        self.assertEqual(here["film_digest"], there["film_digest"])

    def test_describes_built_in_scenes(self):
        for name in [s["name"] for s in self.server.get("/v1/server").json()["scenes"]]:
            scene = self.server.get("/v1/scenes/" + name)
            self.assertEqual(scene.status, 200, scene)
            self.assertGreater(scene.json()["triangles"], 0)
        self.assert_problem(self.server.request("DELETE", "/v1/scenes/glass"), 409)
        self.assert_problem(self.server.get("/v1/scenes/nowhere"), 404)
        self.assert_problem(self.server.get("/v1/scenes/nowhere/gltf"), 404)

    def test_delete_is_409_while_a_job_uses_it(self):
        scene = self.server.post("/v1/scenes", triangle_glb(nodes=[{"mesh": 0, "name": "del"}]),
                                 GLB).json()["id"]
        job = self.server.submit(job_body(scene, samples=65536))["id"]
        self.assert_problem(self.server.request("DELETE", "/v1/scenes/" + scene), 409)
        self.server.post(f"/v1/jobs/{job}/cancel")
        self.assertEqual(self.server.request("DELETE", "/v1/scenes/" + scene).status, 204)
        self.assert_problem(self.server.request("DELETE", "/v1/scenes/" + scene), 404)
        self.assert_problem(self.server.post("/v1/jobs", job_body(scene)), 404)

    def test_lists_have_pages(self):
        for number in range(3):
            self.server.post(
                "/v1/scenes", triangle_glb(nodes=[{"mesh": 0, "name": f"p{number}"}]), GLB
            )
        everything = [s["id"] for s in self.server.get("/v1/scenes?limit=200").json()["scenes"]]
        seen, cursor = [], None
        while True:
            page = self.server.get("/v1/scenes?limit=2" + (f"&cursor={cursor}" if cursor else ""))
            seen += [s["id"] for s in page.json()["scenes"]]
            cursor = page.json()["next"]
            self.assertEqual(cursor is not None, "Link" in page.headers)
            if cursor is None:
                break
        self.assertEqual(seen, everything)
