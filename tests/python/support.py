"""Helpers shared by the tests of the Python package."""

import os
import socket
import struct
import threading
import unittest
import zlib

from harness import ApiTest

from tessera_render import Client, Retry

REPOSITORY = os.path.abspath(os.path.join(os.path.dirname(__file__), "../.."))
FAST = Retry(first_delay_s=0.01, longest_delay_s=0.05)


class ServerTest(ApiTest):
    """A server for the class, and a client for each test."""

    def setUp(self):
        self.client = Client(self.url(), retry=FAST)
        self.addCleanup(self.client.close)

    def url(self):
        return f"http://127.0.0.1:{self.server.port}"


class Relay:
    """A fixed port while the server behind it restarts; can cut its connections.

    cut_after: bytes of an answer after which each of the next `cuts` connections ends.
    """

    def __init__(self, port):
        self.target = port
        self.cut_after = 0
        self.cuts = 0
        self.connections = 0
        self._lines = []
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self):
        self._socket.close()
        self.cut()

    def cut(self):
        """Ends all open connections."""
        for line in self._lines:
            for end in line:
                try:
                    end.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass  # It is already closed.
        self._lines.clear()

    def _accept(self):
        while True:
            try:
                near, _ = self._socket.accept()
            except OSError:
                return
            try:
                far = socket.create_connection(("127.0.0.1", self.target), timeout=60)
            except OSError:
                near.close()
                continue
            self.connections += 1
            left = None
            if self.cuts > 0:
                self.cuts -= 1
                left = self.cut_after
            self._lines.append((near, far))
            threading.Thread(target=self._copy, args=(near, far, None), daemon=True).start()
            threading.Thread(target=self._copy, args=(far, near, left), daemon=True).start()

    @staticmethod
    def _copy(source, sink, left):
        try:
            while piece := source.recv(65536):
                if left is not None:
                    piece, left = piece[:left], left - len(piece)
                sink.sendall(piece)
                if left is not None and left <= 0:
                    break
        except OSError:
            pass  # One of the two has closed: close the other.
        for end in (source, sink):
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass
            end.close()


class RelayTest(unittest.TestCase):
    def relay(self, port):
        relay = Relay(port)
        self.addCleanup(relay.close)
        return relay


def frame(planes, x=0, y=0, width=1, height=1, revision=1, flags=0, error=0.5):
    """A tile frame in the documented format: planes is a list of lists of floats."""
    payload = b"".join(struct.pack(f"<{len(plane)}f", *plane) for plane in planes)
    head = struct.pack("<4sIIHHHHIfI", b"TSR1", len(payload), revision, x, y, width, height, flags,
                       error, zlib.crc32(payload))
    return head + payload


END = frame([], width=0, height=0, flags=1)
