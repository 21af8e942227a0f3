"""Output in notebooks."""

import asyncio
import base64
import re
import sys
import types
from html.parser import HTMLParser
from unittest import mock

from harness import png_size
from support import ServerTest

import tessera_render
from tessera_render import AsyncClient


class Notebook:
    """Replaces the module IPython.display: records the displayed objects."""

    def __init__(self):
        self.shown = []
        module = types.ModuleType("IPython.display")
        module.HTML = lambda text: types.SimpleNamespace(text=text)
        module.display = self.display
        self.modules = {"IPython": types.ModuleType("IPython"), "IPython.display": module}

    def display(self, html, display_id):
        assert display_id is True
        return types.SimpleNamespace(update=lambda html: self.shown.append(html.text))


class Balance(HTMLParser):
    """Fails if a closed tag is not the last one opened."""

    def __init__(self, text):
        super().__init__()
        self.open = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, tag


def picture_in(text):
    return base64.b64decode(re.search(r"data:image/png;base64,([^']+)'", text).group(1))


class Notebooks(ServerTest):
    def test_job_shows_its_state_error_and_image(self):
        job = self.client.submit("cornell-box", name="<b> & 'co'", size=(1000, 50), layers=[],
                                 samples_per_pixel=2).wait()
        text = job._repr_html_()
        self.assertEqual(Balance(text).open, [])
        self.assertNotIn("<b> &", text)
        self.assertIn("&lt;b&gt; &amp; &#x27;co&#x27;", text)
        for fact in ("finished (samples_per_pixel)", str(job.error), "2 per pixel", job.id):
            self.assertTrue(fact in text, fact)
        self.assertEqual(png_size(picture_in(text))[:2], (640, 32))
        self.assertEqual(job._repr_png_(), picture_in(text))

    def test_show_draws_until_the_end(self):
        notebook = Notebook()
        job = self.client.submit("cornell-box", size=(96, 64), layers=[], samples_per_pixel=32)
        with mock.patch.dict(sys.modules, notebook.modules):
            # A returned value would be drawn again as the last line of a cell.
            self.assertIsNone(job.show(refresh_s=0.05))
        self.assertGreaterEqual(len(notebook.shown), 2)
        for text in notebook.shown:
            self.assertEqual(Balance(text).open, [])
        self.assertRegex(notebook.shown[-1][:700], "finished")
        self.assertEqual(re.search("width:([0-9.]+)%", notebook.shown[-1]).group(1), "100.0")
        self.assertEqual(picture_in(notebook.shown[-1]), job.picture(max_size=640))

    def test_show_works_with_the_asynchronous_client(self):
        notebook = Notebook()

        async def run():
            async with AsyncClient(self.url()) as client:
                job = await client.submit(
                    "cornell-box", size=(48, 32), layers=[], samples_per_pixel=8
                )
                self.assertIsNone(await job.show(refresh_s=0.05))
                return job

        with mock.patch.dict(sys.modules, notebook.modules):
            job = asyncio.run(run())
        self.assertTrue(job.ended)
        self.assertRegex(notebook.shown[-1][:700], "finished")
        self.assertEqual(png_size(picture_in(notebook.shown[-1]))[:2], (48, 32))
        self.assertEqual(Balance(job._repr_html_()).open, [])

    def test_show_reports_a_missing_notebook(self):
        job = self.client.submit("cornell-box", size=(16, 16), layers=[], samples_per_pixel=1)
        with mock.patch.dict(sys.modules, {"IPython": None, "IPython.display": None}):
            with self.assertRaisesRegex(tessera_render.NotOffered, "IPython"):
                job.show()

    def test_failed_job_shows_the_reason(self):
        job = self.client.submit(
            "cornell-box", size=(16, 16), layers=[], samples_per_pixel=1
        ).wait()
        job.data |= {
            "state": "failed",
            "stop_reason": "failed",
            "failure": {"detail": "<out of memory>"},
        }
        self.assertIn("&lt;out of memory&gt;", job._repr_html_())
        with self.assertRaisesRegex(tessera_render.JobFailed, "out of memory"):
            job.wait()
        self.assertEqual(job.wait(check=False).state, "failed")

    def test_growing_image_is_a_png(self):
        job = self.client.submit(
            "cornell-box", size=(70, 40), layers=[], samples_per_pixel=1
        ).wait()
        film = job.tile_image()
        film.put(next(job.tiles()))
        self.assertEqual(png_size(film._repr_png_())[:2], (70, 40))
