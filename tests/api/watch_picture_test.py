"""`tessera watch` with the image in a terminal, and with the viewer tev."""

import fcntl
import os
import pty
import re
import select
import signal
import socket
import struct
import subprocess
import termios
import threading
import time

from harness import (
    BINARY,
    PATIENCE_S,
    ApiTest,
    TileStream,
    in_background,
    job_body,
    png_pixels,
    tessera,
)

COLUMNS, ROWS = 60, 24


class Screen:
    """The subset of a terminal that images need: half blocks in 24-bit colour, cursor, erasing."""

    def __init__(self):
        self.cells = {}
        self.x = self.y = 0
        self.saved = (0, 0)
        self.front = self.back = None
        self.cursor_shown = True
        self.frames = 0

    def feed(self, text):
        for sequence in re.finditer(r"\x1b(?:\[([0-9;?]*)([A-Za-z])|([78]))|(.)", text, re.DOTALL):
            character = sequence.group(4)
            if character is None:
                self.control(*sequence.groups()[:3])
            elif character == "\x1b":
                raise AssertionError(
                    f"unknown sequence {text[sequence.start():sequence.start() + 20]!r}"
                )
            else:
                self.write(character)

    def write(self, character):
        if character == "\r":
            self.x = 0
        elif character == "\n":
            self.y += 1
        else:
            if self.x == COLUMNS:
                self.x, self.y = 0, self.y + 1
                if character == "\u2580":
                    raise AssertionError("wider than the terminal")
            self.cells[self.y, self.x] = (character, self.front, self.back)
            self.x += 1

    def control(self, parameters, letter, cursor):
        numbers = [int(n or 0) for n in (parameters or "").lstrip("?").split(";")]
        if cursor == "7":
            self.saved = (self.x, self.y)
        elif cursor == "8":
            self.x, self.y = self.saved
        elif letter == "A":
            self.y -= numbers[0]
        elif letter == "B":
            self.y += numbers[0]
        elif letter == "J" and numbers == [2]:
            self.cells = {}
        elif letter == "H":
            self.x = self.y = 0
        elif letter == "K":
            self.cells = {place: cell for place, cell in self.cells.items() if place[0] != self.y}
        elif letter == "m" and numbers == [0]:
            self.front = self.back = None
        elif letter == "m" and numbers[:2] == [38, 2]:
            self.front = tuple(numbers[2:])
        elif letter == "m" and numbers[:2] == [48, 2]:
            self.back = tuple(numbers[2:])
        elif letter in "hl" and parameters == "?25":
            self.cursor_shown = letter == "h"
        elif letter in "hl" and parameters == "?2026":
            self.frames += letter == "l"
        else:
            raise AssertionError(f"unknown control {parameters!r} {letter!r}")

    def rows(self):
        """Converts lines of half blocks to rows of pixels, two per line."""
        out = []
        for y in sorted({y for y, _ in self.cells}):
            line = [self.cells[place] for place in sorted(p for p in self.cells if p[0] == y)]
            if line and all(character == "\u2580" for character, _, _ in line):
                out += [[front for _, front, _ in line], [back for _, _, back in line]]
        return out

    def text(self):
        return "\n".join(
            "".join(self.cells[p][0] for p in sorted(p for p in self.cells if p[0] == y))
            for y in sorted({y for y, _ in self.cells})
        )


class Terminal:
    """Runs the program in a pseudo-terminal."""

    def __init__(self, *command, **environ):
        self.text = b""
        self.pid, self.end = pty.fork()
        if self.pid == 0:
            variables = {k: v for k, v in os.environ.items()
                         if not k.startswith(("TESSERA_", "KITTY", "TERM", "TMUX"))}
            variables.update({"TERM": "xterm-256color", "LC_ALL": "C.UTF-8", **environ})
            signal.signal(
                signal.SIGINT, signal.SIG_DFL
            )  # Ignored by background processes, and inherited from them.
            time.sleep(0.1)  # The size is set in the meantime.
            os.execve(BINARY, [BINARY, *command], variables)
        self.resize(COLUMNS)

    def resize(self, columns):
        fcntl.ioctl(self.end, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, columns, 0, 0))

    def read_until(self, ready=lambda text: False):
        """Reads the output until ready(text), or to the end; returns False at the end."""
        deadline = time.monotonic() + PATIENCE_S
        while not ready(self.text):
            if time.monotonic() > deadline:
                raise AssertionError(f"no more output after {self.text[-500:]!r}")
            if not select.select([self.end], [], [], 1)[0]:
                continue
            try:
                piece = os.read(self.end, 65536)
            except OSError:  # The other side is closed.
                return False
            if not piece:
                return False
            self.text += piece
        return True

    def wait(self):
        self.read_until()
        os.close(self.end)
        return os.waitpid(self.pid, 0)[1]

    def screen(self):
        screen = Screen()
        screen.feed(self.text.decode())
        return screen


class Tev:
    """Listens like the viewer tev and keeps the received images."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self.listener.getsockname()[1]}"
        self.images = {}
        self.updates = 0
        self.done = in_background(self.serve)

    def serve(self):
        connection, _ = self.listener.accept()
        with connection, connection.makefile("rb") as stream:
            while head := stream.read(4):
                size = struct.unpack("<I", head)[0]
                packet = stream.read(size - 4)
                if len(packet) != size - 4:
                    raise AssertionError("a packet is truncated")
                self.take(packet)
        self.listener.close()

    def take(self, packet):
        operation, place = packet[0], 2  # byte 1: the focus

        def text():
            nonlocal place
            end = packet.index(b"\0", place)
            value, place = packet[place:end].decode(), end + 1
            return value

        def numbers(kind, count):
            nonlocal place
            values = struct.unpack_from(f"<{count}{kind}", packet, place)
            place += struct.calcsize(f"<{count}{kind}")
            return values

        name = text()
        if operation == 4:
            width, height, count = numbers("i", 3)
            channels = [text() for _ in range(count)]
            self.images[name] = (width, height, {c: [None] * (width * height) for c in channels})
        elif operation == 6:
            channels = [text() for _ in range(numbers("i", 1)[0])]
            x, y, width, height = numbers("i", 4)
            offsets, strides = numbers("q", len(channels)), numbers("q", len(channels))
            values = numbers("f", (len(packet) - place) // 4)
            image_width, image_height, planes = self.images[name]
            if x < 0 or y < 0 or x + width > image_width or y + height > image_height:
                raise AssertionError("a tile outside the image")
            for channel, offset, stride in zip(channels, offsets, strides):
                for i in range(width * height):
                    place_in = (y + i // width) * image_width + x + i % width
                    planes[channel][place_in] = values[offset + i * stride]
            self.updates += 1
        else:
            raise AssertionError(f"operation {operation}")
        if place != len(packet):
            raise AssertionError("unused bytes")


class WatchPicture(ApiTest):
    def address(self):
        return f"http://127.0.0.1:{self.server.port}"

    def watch(self, job, *flags, **environ):
        return Terminal("watch", job, "--server", self.address(), *flags, **environ)

    def submit(self, samples, width, height, **film):
        body = job_body(samples=samples)
        body["film"] = {"width": width, "height": height, "layers": [], **film}
        return self.server.submit(body)["id"]

    def png(self, job, side):
        return png_pixels(self.server.get(f"/v1/jobs/{job}/image.png?max_size={side}").body)

    def test_drawn_colors_are_those_of_the_image(self):
        # 60 columns for 120 pixels; the 22 free lines of two pixels each exceed the 40 pixels that
        # follow.
        job = self.submit(16, 120, 80)
        terminal = self.watch(job, "--picture=blocks")
        self.assertEqual(terminal.wait(), 0)
        screen = terminal.screen()
        rows = self.png(job, 60)
        self.assertEqual((len(rows), len(rows[0])), (40, 60))
        self.assertEqual(screen.rows(), rows)
        self.assertGreater(len({pixel for row in rows for pixel in row}), 100)
        self.assertIn("finished", screen.text())
        self.assertTrue(screen.cursor_shown)
        self.assertEqual((screen.front, screen.back), (None, None))

    def test_enlarges_a_small_image_and_fits_a_tall_one_to_the_height(self):
        small = self.server.wait(self.submit(4, 20, 10))["id"]
        terminal = self.watch(small, "--picture=blocks")
        self.assertEqual(terminal.wait(), 0)
        pixels = png_pixels(self.server.get(f"/v1/jobs/{small}/image.png").body)
        self.assertEqual(terminal.screen().rows(),
                         [[pixels[y // 3][x // 3] for x in range(60)] for y in range(30)])
        tall = self.server.wait(self.submit(4, 40, 88))["id"]
        terminal = self.watch(tall, "--picture=blocks")
        self.assertEqual(terminal.wait(), 0)
        self.assertEqual(terminal.screen().rows(), self.png(tall, 44))

    def test_redraws_in_place_and_restores_the_terminal_on_a_signal(self):
        job = self.submit(65536, 64, 40)
        for number in (signal.SIGINT, signal.SIGTERM):
            terminal = self.watch(job, "--picture=blocks")
            # In the middle of a frame, which is larger than the buffer of a terminal.
            self.assertTrue(terminal.read_until(
                lambda text: text.count(b"\x1b[?2026h") == 4 and text.count(b"\x1b[?2026l") == 3))
            os.kill(terminal.pid, number)
            status = terminal.wait()
            self.assertEqual(os.WTERMSIG(status), number)
            screen = terminal.screen()
            self.assertEqual((len(screen.rows()), len(screen.rows()[0])), (38, 60))
            self.assertGreaterEqual(screen.frames, 4)
            self.assertTrue(screen.cursor_shown)
            self.assertEqual((screen.front, screen.back), (None, None))
            self.assertEqual(terminal.text.count(b"\x1b[?2026h"), screen.frames, "half a frame")
        self.assertEqual(self.server.job(job)["state"], "rendering")

    def test_follows_the_size_of_the_terminal(self):
        terminal = self.watch(self.submit(65536, 64, 40), "--picture=blocks")
        terminal.read_until(lambda text: text.count(b"\x1b[?2026l") >= 2)
        terminal.resize(40)
        terminal.read_until(lambda text: text.partition(b"\x1b[2J")[2].count(b"\x1b[?2026l") >= 2)
        os.kill(terminal.pid, signal.SIGINT)
        terminal.wait()
        rows = terminal.screen().rows()
        self.assertEqual((len(rows), len(rows[0])), (26, 40))
        self.assertNotIn(None, rows[24])
        self.assertEqual(set(rows[25]), {None})

    def test_reports_a_job_that_never_had_an_image(self):
        self.submit(65536, 512, 512)
        job = self.submit(65536, 64, 40)
        self.server.post(f"/v1/jobs/{job}/cancel")
        terminal = self.watch(job, "--picture=blocks")
        self.assertEqual(os.waitstatus_to_exitcode(terminal.wait()), 1)
        self.assertIn("cancelled", terminal.screen().text())

    def test_kitty_gets_the_png_and_is_selected_by_its_name(self):
        job = self.server.wait(self.submit(4, 64, 40))["id"]
        for flag, environ in (("--picture=kitty", {}), ("--picture", {"TERM": "xterm-kitty"})):
            terminal = self.watch(job, flag, **environ)
            self.assertEqual(terminal.wait(), 0)
            self.assertIn(b"\x1b_Ga=T,f=100,", terminal.text)
            self.assertNotIn("\u2580".encode(), terminal.text)
        terminal = self.watch(job, "--picture")
        self.assertEqual(terminal.wait(), 0)
        self.assertIn("\u2580".encode(), terminal.text)
        terminal = self.watch(job, "--picture=sixel")
        self.assertEqual(terminal.wait(), 0)
        self.assertIn(b"\x1bP0;1q\"1;1;", terminal.text)

    def test_refuses_a_pipe_unless_one_image_is_requested(self):
        job = self.server.wait(self.submit(4, 64, 40))["id"]
        here = ("watch", job, "--server", self.address())
        code, out, said = tessera(*here, "--picture")
        self.assertEqual((code, out), (2, ""))
        self.assertIn("--final", said)
        code, out, said = tessera(*here, "--picture", "--final", environ={"COLUMNS": "32"})
        self.assertEqual(code, 0, said)
        screen = Screen()
        screen.feed(out.replace("\n", "\r\n"))
        self.assertEqual(screen.rows(), self.png(job, 32))
        self.assertIn("finished", out.splitlines()[-1])

    def test_refuses_incompatible_flags(self):
        for flags in (
            ("--picture=ascii",),
            ("--final",),
            ("--picture", "--json"),
            ("--tev", "latest"),
        ):
            code, out, said = tessera("watch", "--server", self.address(), *flags)
            self.assertEqual((code, out), (2, ""), flags)
            self.assertTrue(said, flags)

    def tev_image(self, job, tev):
        tev.done()
        self.assertEqual(list(tev.images), [f"tessera {job}"])
        return tev.images[f"tessera {job}"]

    def assert_shows_the_film(self, job, image, left, top):
        width, height, planes = image
        with TileStream(self.server, job) as stream:
            for tile in stream.all()[:-1]:
                expected = tile.check()
                for i in range(tile.width * tile.height):
                    place = (
                        (tile.y - top + i // tile.width) * width + tile.x - left + i % tile.width
                    )
                    for c, channel in enumerate("RGB"):
                        self.assertEqual(planes[channel][place], expected[c][i])
        for plane in planes.values():
            self.assertEqual(len(plane), width * height)
            self.assertNotIn(None, plane)

    def test_tev_gets_the_linear_tiles(self):
        job = self.submit(64, 80, 50)
        tev = Tev()
        code, out, said = tessera("watch", job, "--server", self.address(), "--tev", tev.address)
        self.assertEqual((code, said), (0, ""))
        self.assertIn("finished", out)
        image = self.tev_image(job, tev)
        self.assertEqual((image[0], image[1], list(image[2])), (80, 50, ["R", "G", "B"]))
        self.assertGreaterEqual(tev.updates, 6)
        self.assert_shows_the_film(job, image, 0, 0)

    def test_tev_gets_a_crop_with_its_alpha(self):
        body = job_body(samples=2, environment={"visible": False})
        body["film"] = {"width": 100, "height": 80, "layers": [],
                        "crop": {"x": 20, "y": 30, "width": 50, "height": 40}}
        job = self.server.render(body)["id"]
        tev = Tev()
        code, _, said = tessera("watch", job, "--server", self.address(), "--tev=" + tev.address)
        self.assertEqual((code, said), (0, ""))
        image = self.tev_image(job, tev)
        self.assertEqual((image[0], image[1], list(image[2])), (50, 40, ["R", "G", "B", "A"]))
        self.assert_shows_the_film(job, image, 20, 30)

    def test_reports_a_clear_error_without_tev(self):
        job = self.server.wait(self.submit(4, 64, 40))["id"]
        with socket.create_server(("127.0.0.1", 0)) as free:
            address = f"127.0.0.1:{free.getsockname()[1]}"
        code, out, said = tessera("watch", job, "--server", self.address(), "--tev", address)
        self.assertEqual((code, out), (1, ""))
        self.assertIn(f"cannot reach tev at {address}", said)

    def test_reports_a_closed_viewer_and_continues_to_watch_the_job(self):
        job = self.submit(65536, 64, 40)
        with socket.create_server(("127.0.0.1", 0)) as listener:
            address = f"127.0.0.1:{listener.getsockname()[1]}"
            with subprocess.Popen(
                [BINARY, "watch", job, "--server", self.address(), "--tev", address],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            ) as watching:
                listener.accept()[0].close()
                ender = threading.Timer(1.5, lambda: self.server.post(f"/v1/jobs/{job}/cancel"))
                ender.start()
                out, said = watching.communicate(timeout=PATIENCE_S)
                ender.join()
        self.assertEqual(watching.returncode, 1)
        self.assertIn("cancelled", out)
        self.assertIn("tev has closed the connection", said)
