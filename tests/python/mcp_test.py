"""The Model Context Protocol server, through the client of the protocol's own SDK."""

import asyncio
import base64
import os
import re
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import anyio
import httpx
import numpy as np
from harness import BINARY, png_pixels, png_size, tessera
from mcp import Client, StdioServerParameters, stdio_client
from support import REPOSITORY, ServerTest

sys.path.insert(0, os.path.join(REPOSITORY, "clients/examples"))
from simple_glb import Glb

from tessera_render.mcp import MOST_PIXELS, error_words
from tessera_render.results import ErrorBar

QUICK = {"width": 64, "height": 48, "error": 0.5}


def two_quads():
    """A GLB with two glowing quads, both facing +z: a plate, and a smaller lid to its right."""
    glb = Glb()
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    glb.binary = b"".join(struct.pack("<3f", *corner) for corner in corners)
    glb.document["bufferViews"] = [{"buffer": 0, "byteLength": len(glb.binary)}]
    glb.document["accessors"] = [
        {"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3",
         "min": [-1, -1, 0], "max": [1, 1, 0]}
    ]  # fmt: skip
    surface = {"roughnessFactor": 0.5}
    material = glb.add_material("paint", pbrMetallicRoughness=surface, emissiveFactor=[1, 1, 1],
                                doubleSided=True)  # fmt: skip
    glb.add("meshes", {"primitives": [{"attributes": {"POSITION": 0}, "material": material}]})
    glb.add_node(mesh=0, name="plate")
    glb.add_node(mesh=0, name="lid", translation=[3, 2, 1], scale=[0.5, 1, 1])
    return glb.bytes()


def words_of(answer):
    return "\n".join(part.text for part in answer.content if part.type == "text")


def images_of(answer):
    return [base64.b64decode(part.data) for part in answer.content if part.type == "image"]


def job_of(answer):
    return re.search(r"Render ([0-9a-f-]{36}):", words_of(answer))[1]


class Agent(ServerTest):
    def setUp(self):
        super().setUp()
        self.folder = Path(tempfile.mkdtemp(prefix="tessera-mcp-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def environ(self):
        # The verb starts the first python3 in PATH.
        return {**os.environ, "PATH": os.path.dirname(sys.executable) + ":" + os.environ["PATH"]}

    def talk(self, conversation, target=None):
        """Runs the coroutine with a connected client; by default to a server over stdio."""

        async def run():
            start = StdioServerParameters(
                command=BINARY, args=["mcp", "--server", self.url()], env=self.environ()
            )
            async with Client(target or stdio_client(start)) as agent:
                return await conversation(agent)

        return asyncio.run(run())

    def call(self, tool, **arguments):
        return self.talk(lambda agent: agent.call_tool(tool, arguments))


class Tools(Agent):
    def test_five_tools_describe_themselves(self):
        listed = self.talk(lambda agent: agent.list_tools()).tools
        self.assertEqual(
            [tool.name for tool in listed], ["render", "views", "inspect", "compare", "improve"]
        )
        for tool in listed:
            self.assertGreater(len(tool.description), 50, tool.name)
            self.assertNotIn("context", tool.input_schema["properties"])

    def test_renders_a_file_from_a_named_side_and_tells_its_error(self):
        path = self.folder / "plates.glb"
        path.write_bytes(two_quads())
        answer = self.call("render", scene=str(path), view="right", **QUICK)
        self.assertFalse(answer.is_error, words_of(answer))
        (image,) = images_of(answer)
        self.assertEqual(png_size(image)[:2], (64, 48))
        job = self.client.job(job_of(answer))
        orbit = job.spec["camera"]["orbit"]
        self.assertEqual((orbit["theta_degrees"], orbit["phi_degrees"]), (90, 90))
        self.assertIn(error_words(job.error), words_of(answer))
        self.assertLessEqual(job.error.high, 0.5)
        for warning in job.warnings:
            self.assertIn(warning, words_of(answer))

    def test_angles_and_members_of_the_job_reach_the_server(self):
        answer = self.call(
            "render", scene="furnace", view="top", phi_degrees=30, **QUICK,
            job={"seed": 5, "ground": {"type": "catcher"}, "camera": {"vertical_fov_degrees": 20}},
        )  # fmt: skip
        spec = self.client.job(job_of(answer)).spec
        self.assertEqual((spec["seed"], spec["ground"]["type"]), (5, "catcher"))
        self.assertEqual(spec["camera"]["vertical_fov_degrees"], 20)
        self.assertEqual(spec["camera"]["orbit"]["phi_degrees"], 30)

    def test_shows_at_most_a_million_pixels(self):
        answer = self.call(
            "render", scene="furnace", width=1500, height=1000, error=1, seconds=0.1
        )
        width, height = png_size(images_of(answer)[0])[:2]
        self.assertLessEqual(width * height, MOST_PIXELS)
        self.assertGreater(width * height, 0.98 * MOST_PIXELS)
        self.assertAlmostEqual(width / height, 1.5, delta=0.01)
        self.assertEqual(self.client.job(job_of(answer)).size, (1500, 1000))

    def test_shows_six_views_on_one_sheet(self):
        path = self.folder / "plates.glb"
        path.write_bytes(two_quads())
        answer = self.call("views", scene=str(path), error=0.5, job={"environment": None})
        (sheet,) = images_of(answer)
        width, height = png_size(sheet)[:2]
        self.assertLessEqual(width * height, MOST_PIXELS)
        lines = re.findall(r"^(\w+): render ([0-9a-f-]{36})\. (.*)$", words_of(answer), re.M)
        angles = {}
        for name, job_id, words in lines:
            job = self.client.job(job_id)
            orbit = job.spec["camera"]["orbit"]
            angles[name] = (orbit["theta_degrees"], orbit["phi_degrees"])
            self.assertEqual(words, error_words(job.error))
        self.assertEqual(list(angles), ["front", "right", "back", "left", "top", "iso"])
        self.assertEqual(angles["left"], (270, 90))
        self.assertEqual(angles["top"], (0, 0))
        # The plate has twice the light of the lid: it is left in front and right from behind, and
        # from the right both are lines.
        pixels = np.array(png_pixels(sheet))[: height // 2, :, 1] > 128
        front, right, back = (view[20:-20, 20:-20] for view in np.array_split(pixels, 3, axis=1))
        half = front.shape[1] // 2
        self.assertGreater(front[:, :half].sum(), 1.5 * front[:, half:].sum())
        self.assertGreater(back[:, half:].sum(), 1.5 * back[:, :half].sum())
        self.assertGreater(front[:, half:].sum(), 100)
        self.assertLess(right.sum(), front.sum() / 10)

    def test_inspects_objects_boxes_materials_and_warnings(self):
        path = self.folder / "plates.glb"
        faulty = two_quads().replace(b'"roughnessFactor": 0.5', b'"roughnessFactor": 1.5')
        self.assertNotEqual(faulty, two_quads())
        path.write_bytes(faulty)
        found = self.call("inspect", scene=str(path)).structured_content
        self.assertEqual(found["triangles"], 4)
        self.assertEqual(found["materials"], ["paint"])
        boxes = {each["name"]: each["bounds"] for each in found["objects"]}
        self.assertEqual(boxes["plate"], {"min": [-1, -1, 0], "max": [1, 1, 0]})
        self.assertEqual(boxes["lid"], {"min": [2.5, 1, 1], "max": [3.5, 3, 1]})
        self.assertRegex("\n".join(found["warnings"]), "roughnessFactor")
        names = [job.spec["scene"] for job in self.client.jobs()]
        self.assertNotIn(found["scene"], names, "the look leaves no job")

    def test_compares_noise_and_a_difference(self):
        async def conversation(agent):
            ids = []
            for members in ({"seed": 1}, {"seed": 2}, {"seed": 3, "spectral": False, "environment":
                            {"color": [1.5, 1.5, 1.5]}}):  # fmt: skip
                made = await agent.call_tool("render", {"scene": "furnace", **QUICK, "error": 0.05,
                                                        "job": members})  # fmt: skip
                ids.append(job_of(made))
            same = await agent.call_tool("compare", {"a": ids[0], "b": ids[1]})
            brighter = await agent.call_tool("compare", {"a": ids[2], "b": ids[1]})
            return same, brighter

        same, brighter = self.talk(conversation)
        self.assertIn("they may be equal", words_of(same))
        self.assertIn("the means differ", words_of(brighter))
        mean = re.search(r"Mean of a - b: (\S+)", words_of(brighter))[1]
        self.assertGreater(float(mean), 0)
        self.assertEqual(len(images_of(same)), 2)

    def test_improves_the_same_render(self):
        async def conversation(agent):
            first = await agent.call_tool("render", {"scene": "cornell-box", **QUICK})
            second = await agent.call_tool("improve", {"job": job_of(first), "error": 0.2})
            third = await agent.call_tool("improve", {"job": job_of(first)})
            return first, second, third

        first, second, third = self.talk(conversation)
        self.assertEqual(len({job_of(first), job_of(second), job_of(third)}), 1)
        self.assertNotEqual(images_of(first), images_of(second))
        error = re.compile(r"The average pixel is ([0-9.]+)% off")
        before, now = map(float, error.findall(words_of(second)))
        self.assertLessEqual(now, 20)
        last, least = map(float, error.findall(words_of(third)))
        self.assertEqual(last, now)
        self.assertLessEqual(least, now / 2 + 0.05)
        self.assertGreater(before, now)

    def test_tells_what_is_wrong_and_what_is_possible(self):
        cases = (
            ({"scene": "no-such-scene"}, "cornell-box"),
            ({"scene": "/nowhere/chair.glb"}, "/nowhere/chair.glb"),
            ({"scene": "furnace", "view": "below"}, "front, right, back, left, top, iso"),
            ({"scene": "furnace", "width": 0}, "/film/width"),
            ({"scene": "furnace", "job": {"colour": 1}}, "/colour"),
        )

        async def conversation(agent):
            return [await agent.call_tool("render", QUICK | case) for case, _ in cases]

        for answer, (_, told) in zip(self.talk(conversation), cases, strict=True):
            self.assertTrue(answer.is_error)
            self.assertIn(told, words_of(answer))

    def test_reports_progress_and_cancels_what_nobody_waits_for(self):
        shares = []

        async def listen(progress, total, message):
            shares.append((progress, total, message))

        async def conversation(agent):
            with anyio.move_on_after(4):
                await agent.call_tool(
                    "render",
                    {"scene": "glass", "width": 600, "height": 600, "error": 0.001,
                     "seconds": 600, "job": {"name": "given up"}},
                    progress_callback=listen,
                )  # fmt: skip
                self.fail("it cannot be so quick")

        self.talk(conversation)
        self.assertTrue(shares)
        self.assertEqual({total for _, total, _ in shares}, {1})
        job = next(job for job in self.client.jobs() if job.name == "given up")
        self.assertEqual(job.wait(30).state, "cancelled")


class OverHttp(Agent):
    def serve(self, *flags):
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        process = subprocess.Popen(
            [BINARY, "mcp", "--server", self.url(), "--port", str(port), *flags], env=self.environ()
        )
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        end = time.monotonic() + 60
        while time.monotonic() < end:
            try:
                socket.create_connection(("127.0.0.1", port), timeout=1).close()
                return f"http://127.0.0.1:{port}/mcp"
            except OSError:
                time.sleep(0.1)
        self.fail("it does not listen")

    def test_reads_only_files_of_the_named_folder(self):
        inside, outside = self.folder / "shared", self.folder / "private"
        for folder in (inside, outside):
            folder.mkdir()
            (folder / "plates.glb").write_bytes(two_quads())
        (inside / "link.glb").symlink_to(outside / "plates.glb")
        address = self.serve("--files", str(inside))
        paths = [inside / "plates.glb", outside / "plates.glb", inside / "link.glb",
                 inside / "../private/plates.glb"]  # fmt: skip

        async def conversation(agent):
            return [await agent.call_tool("render", QUICK | {"scene": str(path)}) for path in paths]

        answers = self.talk(conversation, address)
        self.assertEqual([answer.is_error for answer in answers], [False, True, True, True])
        for refused in answers[1:]:
            self.assertIn("reads no files there", words_of(refused))

    def test_without_a_folder_it_reads_no_files(self):
        (self.folder / "plates.glb").write_bytes(two_quads())
        address = self.serve()

        async def conversation(agent):
            file = await agent.call_tool("render", QUICK | {"scene": f"{self.folder}/plates.glb"})
            return file, await agent.call_tool("render", QUICK | {"scene": "furnace"})

        file, built_in = self.talk(conversation, address)
        self.assertEqual((file.is_error, built_in.is_error), (True, False))

    def test_verb_says_what_is_missing(self):
        python = self.folder / "python3"
        python.write_text(f'#!/bin/sh\nexec {sys.executable} -I -S "$@"\n')  # no packages
        python.chmod(0o755)
        code, told, said = tessera("mcp", environ={"PATH": str(self.folder)})
        self.assertEqual((code, told), (1, ""))
        self.assertIn("has no package tessera_render; install it: pip install", said)
        code, _, said = tessera("mcp", environ={"PATH": "/nowhere"})
        self.assertEqual(code, 1)
        self.assertIn("cannot start python3", said)

    def test_a_page_elsewhere_cannot_call_it(self):
        address = self.serve()
        body = {"jsonrpc": "2.0", "id": 1, "method": "tools/list", "params": {}}
        headers = {"Accept": "application/json, text/event-stream"}
        for name, value in (("Host", "evil.example"), ("Origin", "http://evil.example")):
            answer = httpx.post(address, json=body, headers={**headers, name: value})
            self.assertIn(answer.status_code, (403, 421), name)


class Words(unittest.TestCase):
    def test_say_the_error_its_interval_and_its_limits(self):
        def words(**members):
            return error_words(ErrorBar.of({"relative": 0.0312, "low": 0.02, "high": 0.041,
                                            "bias": "none", **members}))  # fmt: skip

        self.assertEqual(
            words(), "The average pixel is 3.1% off (2% to 4.1% with 95% confidence)."
        )
        self.assertEqual(words(relative=None), "The error is not known.")
        self.assertEqual(words(low=None, high=None), "The average pixel is 3.1% off.")
        self.assertIn("unreliable", words(unreliable=True))
        self.assertIn("biased", words(bias="biased"))
