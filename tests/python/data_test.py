"""Bytes to events, tiles and images: complete, in chunks, and broken."""

import json
import struct
import unittest
import zlib

import numpy as np
from support import END, frame

import tessera_render
from tessera_render.events import EventFeed, EventParser
from tessera_render.png import encode_png, srgb8
from tessera_render.tiff import decode_tiff
from tessera_render.tiles import EndFrame, FrameParser, TileFeed, TileImage

EVENTS = (": hello\n\nid: a-1\nevent: state\ndata: {\"state\":\ndata:  \"queued\"}\n\n"
          "retry: 250\r\n\r\nevent: tile\r\ndata: {\"x\": 1}\r\nid: a-2\r\n\r\n"
          "data: {\"half\": 1}\n")


def told(events):
    return [(event.type, event.data, event.id) for event in events]


class Events(unittest.TestCase):
    EXPECTED = [("state", {"state": "queued"}, "a-1"), ("tile", {"x": 1}, "a-2")]

    def test_reads_a_stream(self):
        parser = EventParser()
        self.assertEqual(told(parser.feed(EVENTS.encode())), self.EXPECTED)
        self.assertEqual((parser.last_id, parser.retry_s), ("a-2", 0.25))

    def test_chunks_may_end_anywhere(self):
        for text in (
            EVENTS,
            EVENTS.replace("\r\n", "\n"),
            EVENTS.replace("\r\n", "\n").replace("\n", "\r"),
        ):
            data = text.encode()
            for size in (1, 2, 3, 7):
                parser, events = EventParser(), []
                for i in range(0, len(data), size):
                    events += parser.feed(data[i:i + size])
                # A CR at the very end waits for its LF.
                self.assertEqual(told(events), self.EXPECTED, (size, text[:20]))

    def test_incomplete_event_does_not_change_the_resume_position(self):
        feed = EventFeed("/v1/jobs/x", None)
        self.assertNotIn("Last-Event-ID", feed.call().headers)
        list(feed.take(b"id: a-1\nevent: tile\ndata: {}\n\nid: a-2\nevent: tile\ndata: {"))
        self.assertEqual(feed.call().headers["Last-Event-ID"], "a-1")
        self.assertEqual(
            told(feed.take(b"id: a-3\nevent: end\ndata: {}\n\n")), [("end", {}, "a-3")]
        )
        self.assertTrue(feed.ended)

    def test_ignores_everything_after_the_end(self):
        feed = EventFeed("/v1/jobs/x", None)
        feed.call()
        text = b"event: end\ndata: {}\n\nevent: tile\ndata: {}\n\n"
        self.assertEqual([event.type for event in feed.take(text)], ["end"])

    def test_overloaded_is_a_pause_not_an_event(self):
        feed = EventFeed("/v1/jobs/x", None)
        feed.call()
        text = b'event: overloaded\nretry: 15000\ndata: {"retry_after_seconds": 15}\n\n'
        self.assertEqual(list(feed.take(text)), [])
        self.assertTrue(feed.refused)
        self.assertEqual(feed.pause_s(0.1), 15)

    def test_refuses_data_that_is_not_an_object(self):
        for data in (b"{", b"[1]", b"\xff"):
            with self.assertRaises(tessera_render.CorruptData):
                list(EventParser().feed(b"data: " + data + b"\n\n"))


PLANES = [[1, 2], [3, 4], [5, 6], [0.1, 0.2], [0.3, 0.4], [0.5, 0.6], [16, 32]]


class Tiles(unittest.TestCase):
    def test_planes_become_arrays(self):
        data = frame(PLANES, x=32, y=64, width=2, height=1, revision=7, flags=2, error=0.25) + END
        tile, end = FrameParser().feed(data)
        self.assertEqual(
            (tile.x, tile.y, tile.width, tile.height, tile.revision), (32, 64, 2, 1, 7)
        )
        self.assertEqual((tile.relative_error, tile.correlated, tile.alpha), (0.25, True, None))
        np.testing.assert_array_equal(tile.mean, [[[1, 3, 5], [2, 4, 6]]])
        np.testing.assert_array_equal(
            tile.variance, np.float32([[[0.1, 0.3, 0.5], [0.2, 0.4, 0.6]]])
        )
        np.testing.assert_array_equal(tile.samples, [[16, 32]])
        self.assertEqual({a.dtype for a in (tile.mean, tile.variance, tile.samples)},
                         {np.dtype(np.float32)})
        self.assertIsInstance(end, EndFrame)

    def test_rows_are_in_order(self):
        (tile,) = FrameParser().feed(frame([[1, 2, 3, 4, 5, 6]] * 7, width=3, height=2))
        np.testing.assert_array_equal(tile.samples, [[1, 2, 3], [4, 5, 6]])

    def test_alpha_follows_if_flagged(self):
        (tile,) = FrameParser().feed(frame([*PLANES, [0.5, 1]], width=2, height=1, flags=4))
        np.testing.assert_array_equal(tile.alpha, [[0.5, 1]])

    def test_denoised_frame_has_only_colors(self):
        (tile,) = FrameParser().feed(frame([[1, 2], [3, 4], [5, 6]], width=2, height=1, flags=16))
        self.assertTrue(tile.denoised)
        self.assertEqual(tile.mean.tolist(), [[[1, 3, 5], [2, 4, 6]]])
        self.assertTrue(np.isnan(tile.variance).all() and np.isnan(tile.samples).all())
        self.assertIsNone(tile.alpha)

    def test_distinguishes_tiles_of_both_images(self):
        feed = TileFeed("/v1/jobs/x", 0, compressed=False, denoise="mixed")
        self.assertEqual(feed.call().params, {"after": 0, "denoise": "mixed"})
        plain = frame(PLANES, width=2, height=1)
        denoised = frame(PLANES[:3], width=2, height=1, flags=16)
        kinds = [tile.denoised for tile in feed.take(plain + denoised + plain + denoised)]
        self.assertEqual(kinds, [False, True])

    def test_chunks_may_end_anywhere(self):
        data = frame(PLANES, width=2) + frame(PLANES, x=32, width=2) + END
        for size in (1, 5, 31, 33):
            parser, frames = FrameParser(), []
            for i in range(0, len(data), size):
                frames += parser.feed(data[i:i + size])
            self.assertEqual([getattr(f, "x", "end") for f in frames], [0, 32, "end"])

    def test_detects_every_flipped_bit_of_the_payload(self):
        data = bytearray(frame(PLANES, width=2))
        for place in range(32, len(data)):
            broken = data.copy()
            broken[place] ^= 0x10
            with self.assertRaisesRegex(tessera_render.CorruptData, "checksum"):
                list(FrameParser().feed(broken))

    def test_checks_magic_and_sizes(self):
        good = frame(PLANES, width=2)
        for broken in (b"TSR2" + good[4:], good[:4] + struct.pack("<I", 60) + good[8:],
                       good[:16] + struct.pack("<H", 3) + good[18:],
                       good[:20] + struct.pack("<I", 4) + good[24:]):
            with self.assertRaises(tessera_render.CorruptData):
                list(FrameParser().feed(broken))

    def test_new_connection_repeats_only_new_tiles(self):
        feed = TileFeed("/v1/jobs/x", 0, compressed=False)
        self.assertEqual(feed.call().headers["Accept-Encoding"], "identity")
        first = frame(PLANES, width=2, revision=5)
        other = frame(PLANES, x=32, width=2, revision=6)
        self.assertEqual(len(list(feed.take(first + other[:40]))), 1)
        feed.call()
        changed = frame([*PLANES[:6], [64, 64]], width=2, revision=9)
        tiles = list(feed.take(first + other + changed + END))
        self.assertEqual([(tile.x, tile.revision) for tile in tiles], [(32, 6), (0, 9)])
        self.assertIsNotNone(feed.end)

    def test_shows_a_film_that_went_back_after_a_crash(self):
        feed = TileFeed("/v1/jobs/x", 0, compressed=True)
        feed.call()
        later, earlier = frame(PLANES, width=2, revision=9), frame(PLANES, width=2, revision=4)
        self.assertEqual(len(list(feed.take(later))), 1)
        feed.call()
        self.assertEqual([tile.revision for tile in feed.take(earlier)], [4])

    def test_assembles_an_image(self):
        image = TileImage(4, 1, x=30, y=0)
        (left,) = FrameParser().feed(frame(PLANES, x=30, width=2))
        (right,) = FrameParser().feed(frame([*PLANES, [0.5, 0]], x=32, width=2, flags=4))
        image.put(left)
        self.assertFalse(image.complete)
        self.assertTrue(np.isnan(image.mean[0, 2:]).all())
        image.put(right)
        self.assertTrue(image.complete)
        np.testing.assert_array_equal(image.mean[0, :, 0], [1, 2, 1, 2])
        np.testing.assert_array_equal(image.alpha, [[1, 1, 0.5, 0]])
        with self.assertRaises(ValueError):
            TileImage(3, 1, x=30).put(right)


def tiff(values, predictor=1, deflate=False, rows=2):
    """A float TIFF according to TIFF 6.0 and Technote 3, written independently of the reader."""
    height, width, channels = values.shape
    strips = []
    for top in range(0, height, rows):
        strip = b""
        for row in values[top:top + rows]:
            data = row.astype("<f4").tobytes()
            if predictor == 3:
                count = width * channels
                planes = b"".join(
                    bytes(data[4 * i + 3 - p] for i in range(count)) for p in range(4)
                )
                data = bytes((planes[i] - (planes[i - channels] if i >= channels else 0)) & 255
                             for i in range(len(planes)))
            strip += data
        strips.append(zlib.compress(strip) if deflate else strip)
    entries = [(256, 3, [width]), (257, 3, [height]), (258, 3, [32] * channels),
               (259, 3, [8 if deflate else 1]), (262, 3, [1]), (273, 4, None), (277, 3, [channels]),
               (278, 3, [rows]), (279, 4, [len(s) for s in strips]), (284, 3, [1]),
               (317, 3, [predictor]), (339, 3, [3] * channels)]
    place = 8 + 2 + 12 * len(entries) + 4
    extra_bytes = sum(len(v or strips) * (2 if k == 3 else 4) for _, k, v in entries)
    data_at, extra, table = place + extra_bytes, b"", b""
    offsets, at = [], data_at
    for strip in strips:
        offsets.append(at)
        at += len(strip)
    for tag, kind, numbers in entries:
        packed = b"".join(struct.pack("<H" if kind == 3 else "<I", n) for n in numbers or offsets)
        table += struct.pack("<HHI", tag, kind, len(numbers or offsets))
        if len(packed) <= 4:
            table += packed.ljust(4, b"\0")
        else:
            table += struct.pack("<I", place + len(extra))
            extra += packed
    head = struct.pack("<2sHI", b"II", 42, 8) + struct.pack("<H", len(entries)) + table + b"\0" * 4
    return head + extra.ljust(extra_bytes, b"\0") + b"".join(strips)


class Pictures(unittest.TestCase):
    def values(self, channels):
        random = np.random.default_rng(1)
        values = random.normal(size=(5, 3, channels)) * 10.0 ** random.integers(
            -30, 30, (5, 3, channels)
        )
        values[0, 0, 0], values[1, 1, 0] = np.nan, np.inf
        return values.astype(np.float32)

    def test_reads_every_kind_of_tiff_of_the_server_bit_for_bit(self):
        for channels in (1, 3, 4):
            values = self.values(channels)
            for predictor, deflate in ((1, False), (1, True), (3, True)):
                picture = decode_tiff(tiff(values, predictor, deflate))
                expected = values[:, :, 0] if channels == 1 else values
                self.assertEqual(picture.dtype, np.float32)
                self.assertEqual(picture.tobytes(), expected.tobytes())
                self.assertEqual(picture.shape, expected.shape)

    def test_refuses_other_or_broken_tiffs(self):
        good = tiff(self.values(3), 3, True)
        for broken in (
            b"",
            b"MM" + good[2:],
            good[:20],
            good[:-40],
            good.replace(struct.pack("<HHI", 339, 3, 3), struct.pack("<HHI", 340, 3, 3)),
            tiff(self.values(3), 2),
        ):
            with self.assertRaises(tessera_render.CorruptData):
                decode_tiff(broken)

    def test_srgb_has_its_known_values(self):
        # IEC 61966-2-1: the line ends at 0.0031308; ((128 / 255 + 0.055) / 1.055)^2.4 = 0.215861.
        values = [np.nan, -1, 0, 0.0031308, 0.215861, 1, 7, np.inf]
        np.testing.assert_array_equal(srgb8(values), [0, 0, 0, 10, 128, 255, 255, 255])
        self.assertEqual(srgb8(0.5, exposure_stops=1), 255)

    def test_png_holds_the_pixels(self):
        from harness import png_pixels
        pixels = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)
        rows = png_pixels(encode_png(pixels))
        np.testing.assert_array_equal(rows, pixels)
        for wrong in (pixels.astype(float), pixels[:, :, :2], pixels[0, 0]):
            with self.assertRaises(ValueError):
                encode_png(wrong)


class Values(unittest.TestCase):
    def test_unknown_numbers_are_nan(self):
        error = tessera_render.ErrorBar.of(json.loads('{"relative": null, "confidence": 0.95}'))
        self.assertTrue(np.isnan(error.relative) and np.isnan(error.low))
        self.assertEqual(str(error), "unknown")
        known = tessera_render.ErrorBar(0.051, 0.05, 0.06, 0.01, 0.02, 0.95, "none", True)
        self.assertEqual(str(known), "5.10% (5.00% to 6.00%), unreliable")

    def test_progress_has_every_member_of_the_answer(self):
        data = {"fraction": 0.5, "samples_per_pixel": {"min": 4, "mean": 5.5, "max": 8},
                "elapsed_seconds": 2, "cpu_seconds": 3, "eta_seconds": 1,
                "eta_interval_seconds": [0.5, 2]}
        progress = tessera_render.results.Progress.of(data)
        for name, value in data.items():
            shown = getattr(progress, name)
            if name == "samples_per_pixel":
                shown = shown._asdict()
            self.assertEqual(list(shown) if isinstance(shown, tuple) else shown, value, name)
        self.assertEqual((progress.samples_min, progress.samples_max), (4, 8))
        unknown = tessera_render.results.Progress.of({**data, "eta_interval_seconds": None})
        self.assertTrue(np.isnan(unknown.eta_interval_seconds).all())

    def test_film_may_be_absent(self):
        request = tessera_render.options.make_request("a", {"film": None, "meter_error": 0.1})
        self.assertEqual(request, {"scene": "a", "film": None, "stop": {"meter_error": 0.1}})
        with self.assertRaises(ValueError):
            tessera_render.options.make_request("a", {"film": None, "size": (4, 4)})

    def test_meter_readings_have_their_vectors(self):
        point = {"position": [0, 0.1, 0], "normal": [0, 1, 0], "irradiance_rgb": [1, 2, 3],
                 "irradiance_w_m2": 0.5, "illuminance_lux": 2, "low": 1, "high": 3, "samples": 16,
                 "unreliable": True}
        meter = tessera_render.results.Meter.of({"points": [point, point]})
        np.testing.assert_array_equal(meter.position, [[0, 0.1, 0]] * 2)
        np.testing.assert_array_equal(meter.normal, [[0, 1, 0]] * 2)
        np.testing.assert_array_equal(meter.irradiance_rgb, [[1, 2, 3]] * 2)
        np.testing.assert_array_equal(meter.illuminance_lux, [2, 2])
        np.testing.assert_array_equal(meter.unreliable, [1, 1])
        self.assertEqual(tessera_render.results.Meter.of({"points": []}).normal.shape, (0, 3))
