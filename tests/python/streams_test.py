"""Events and tiles over broken connections and restarted servers, through a relay with a fixed
port."""

import asyncio
import unittest
from unittest import mock

import numpy as np
from harness import started
from support import FAST, Relay, ServerTest

import tessera_render
from tessera_render import AsyncClient, Client, Retry
from tessera_render.tiles import TileFeed

FILM = {"size": (96, 64), "layers": []}
PATIENT = Retry(first_delay_s=0.02, longest_delay_s=0.1, patience_s=60)


def numbers(events):
    """The sequence numbers of the durable events, by stream."""
    found = {}
    for event in events:
        if event.id and event.type not in ("snapshot", "progress", "reset"):
            stream, seq = event.id.split("-")
            found.setdefault(stream, []).append(int(seq))
    return found


class Lines(ServerTest):
    def setUp(self):
        self.relay = Relay(self.server.port)
        self.addCleanup(self.relay.close)
        self.client = Client(f"http://127.0.0.1:{self.relay.port}", retry=FAST)
        self.addCleanup(self.client.close)

    def test_events_continue_after_a_broken_connection(self):
        # Without an end of its own: the number of events before one depends on the machine.
        job = self.client.submit("cornell-box", samples_per_pixel=65536, **FILM)
        events, asked, shortened, stream = [], [], None, self.client.stream
        with mock.patch.object(
            self.client,
            "stream",
            side_effect=lambda call: asked.append(dict(call.headers)) or stream(call),
        ):
            for event in job.events():
                events.append(event)
                if event.type != "tile" or len(events) % 5 != 0:
                    continue
                if len(asked) < 4:
                    self.relay.cut()
                elif not shortened:
                    shortened = job.update(
                        stop={"samples_per_pixel": 2}
                    )  # it has more: this is the end
        self.assertGreaterEqual(len(asked), 4)
        for headers in asked[1:]:
            self.assertRegex(headers["Last-Event-ID"], "^[0-9a-z]+-[0-9]+$")
        self.assertEqual([event.type for event in events].count("end"), 1)
        self.assertEqual(events[-1].type, "end")
        for sequence in numbers(events).values():
            self.assertEqual(sequence, sorted(set(sequence)), "an event was repeated or late")
        self.assertEqual(job.state, "finished")
        self.assertEqual(job.data, self.server.job(job.id))

    def test_leaving_a_stream_closes_it(self):
        job = self.client.submit("cornell-box", samples_per_pixel=65536, **FILM)
        events = job.events()
        self.assertEqual(next(events).type, "snapshot")
        events.close()
        self.assertEqual(job.refresh().state in ("queued", "loading", "rendering"), True)

    def test_sends_nothing_after_a_received_end(self):
        job = self.client.submit("cornell-box", samples_per_pixel=2, **FILM)
        last = list(job.events())[-1]
        self.assertEqual(list(job.events(last_event_id=last.id)), [])
        self.assertEqual([event.type for event in job.events()], ["snapshot", "end"])

    def test_repeats_tiles_of_a_broken_connection_until_the_image_is_complete(self):
        job = self.client.submit("cornell-box", samples_per_pixel=64, **FILM)
        film, self.relay.cuts, self.relay.cut_after = job.tile_image(), 3, 40_000
        self.client._http.close()
        self.client = Client(f"http://127.0.0.1:{self.relay.port}", retry=FAST)
        for tile in self.client.job(job.id).tiles():
            film.put(tile)
        self.assertEqual(self.relay.cuts, 0)
        np.testing.assert_array_equal(film.mean, Client(self.url()).job(job.id).image())

    def test_compressed_tiles_are_the_same(self):
        job = self.client.submit("cornell-box", samples_per_pixel=4, **FILM).wait()
        films = []
        for compressed in (True, False):
            client = Client(self.url(), compressed=compressed)
            call = TileFeed(job.path, 0, compressed).call()
            with client.stream(call) as response:
                self.assertEqual(
                    response.headers.get("Content-Encoding"), "gzip" if compressed else None
                )
            film = job.tile_image()
            for tile in client.job(job.id).tiles():
                film.put(tile)
            films.append(film)
            client.close()
        np.testing.assert_array_equal(films[0].mean, films[1].mean)
        self.assertTrue(films[0].complete)

    def test_sends_only_newer_tiles_on_request(self):
        job = self.client.submit("cornell-box", samples_per_pixel=4, **FILM).wait()
        newest = max(tile.revision for tile in job.tiles())
        self.assertEqual([tile.revision for tile in job.tiles(after=newest - 1)], [newest])

    def test_reports_a_missing_job_at_once(self):
        job = self.client.submit("cornell-box", samples_per_pixel=2, **FILM).wait()
        job.delete()
        for stream in (job.events(), job.tiles()):
            with self.assertRaises(tessera_render.NotFound):
                next(stream)


class Restarts(unittest.TestCase):
    def setUp(self):
        self.server = started(self)
        self.relay = Relay(self.server.port)
        self.addCleanup(self.relay.close)
        self.address = f"http://127.0.0.1:{self.relay.port}"

    def again(self, kill):
        if kill:
            self.server.kill()
        else:
            self.server.stop()
        self.server.start()
        self.relay.target = self.server.port
        self.relay.cut()

    def test_everything_survives_a_killed_and_a_stopped_server(self):
        events = []

        async def follow(job):
            async for event in job.events():
                events.append(event)

        async def seen(kind, times):
            while [event.type for event in events].count(kind) < times:
                await asyncio.sleep(0.01)

        async def collect(job):
            film = job.tile_image()
            async for tile in job.tiles():
                film.put(tile)
            return film

        async def run():
            async with AsyncClient(self.address, retry=PATIENT) as client:
                job = await client.submit("cornell-box", samples_per_pixel=65536, **FILM)
                tasks = [asyncio.create_task(follow(job)), asyncio.create_task(collect(job)),
                         asyncio.create_task((await client.job(job.id)).wait())]
                await asyncio.to_thread(self.server.wait_for_samples, job.id, 2)
                # A reset is told to those who have seen an event of the server before.
                await asyncio.wait_for(seen("snapshot", 1), PATIENT.patience_s)
                for restarts, kill in enumerate((True, False), 1):
                    await asyncio.to_thread(self.again, kill)
                    await asyncio.to_thread(self.server.wait_for_samples, job.id, 2)
                    await asyncio.wait_for(seen("reset", restarts), PATIENT.patience_s)
                target = (await job.refresh()).progress.samples_max + 64
                await job.update(stop={"samples_per_pixel": target})
                _, film, waited = await asyncio.gather(*tasks)
                return job, film, waited, await job.image()

        job, film, waited, image = asyncio.run(run())
        self.assertEqual(
            (job.state, waited.state, events[-1].type), ("finished", "finished", "end")
        )
        kinds = [event.type for event in events]
        self.assertEqual(kinds.count("end"), 1)
        self.assertGreaterEqual(kinds.count("reset"), 2)
        self.assertGreaterEqual(kinds.count("snapshot"), 3)
        self.assertGreaterEqual(len(numbers(events)), 2)
        for sequence in numbers(events).values():
            self.assertEqual(sequence, sorted(set(sequence)))
        np.testing.assert_array_equal(film.mean, image)

    def test_gives_up_if_the_server_stays_away(self):
        retry = Retry(first_delay_s=0.02, longest_delay_s=0.05, patience_s=0.5)
        with Client(self.address, retry=retry) as client:
            job = client.submit("cornell-box", samples_per_pixel=65536, **FILM)
            events, tiles = job.events(), job.tiles()
            next(events)
            next(tiles)
            self.server.kill()
            for call in (lambda: list(events), lambda: list(tiles), job.wait, client.info):
                with self.assertRaises(tessera_render.ConnectionFailed):
                    call()
