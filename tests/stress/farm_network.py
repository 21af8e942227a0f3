"""A network of namespaces on one machine: each process of a farm has a separate address, and links
that can be cut.

Needs root; everything is removed with the process that made it.
"""

import ctypes
import os
import pathlib
import subprocess
import sys

from farm import Place

CLONE_NEWNET = 0x40000000
INSIDE = "TESSERA_FARM_NETWORK"


def enter_or_stay():
    """Runs this program again in new namespaces. Returns False without permission; True inside
    them."""
    if os.environ.get(INSIDE):
        return True
    if os.geteuid() != 0 or subprocess.run(["unshare", "--net", "--mount", "true"],
                                           stderr=subprocess.DEVNULL).returncode:
        return False
    os.execvpe("unshare", ["unshare", "--net", "--mount", "--propagation", "private",
                           sys.executable, *sys.argv], os.environ | {INSIDE: "1"})
    return True


def ip(*words):
    subprocess.run(["ip", *words], check=True)


def tmpfs(folder, size):
    pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "none", folder], check=True)


class Network:
    def __init__(self):
        self.count = 1
        tmpfs("/run/netns", "1M")
        ip("link", "set", "lo", "up")
        ip("link", "add", "hub", "type", "bridge")
        ip("address", "add", "10.77.0.1/24", "dev", "hub")
        ip("link", "set", "hub", "up")

    def place(self):
        """A namespace with its own address."""
        self.count += 1
        name, host = f"n{self.count}", f"10.77.0.{self.count}"
        ip("netns", "add", name)
        ip("link", "add", name, "type", "veth", "peer", "name", "eth0", "netns", name)
        ip("link", "set", name, "master", "hub", "up")
        for words in (("link", "set", "lo", "up"), ("address", "add", f"{host}/24", "dev", "eth0"),
                      ("link", "set", "eth0", "up")):
            ip("-n", name, *words)
        libc = ctypes.CDLL(None, use_errno=True)

        def enter():
            with open(f"/run/netns/{name}", "rb") as space:
                if libc.setns(space.fileno(), CLONE_NEWNET):
                    raise OSError(ctypes.get_errno(), "setns")

        place = Place(host, enter)
        place.link = name
        return place

    def cut(self, place):
        ip("link", "set", place.link, "down")

    def heal(self, place):
        ip("link", "set", place.link, "up")
