"""Tessera itself, over HTTP as for users: the server's own CPU time, including encoding and error
estimates."""

import os
import subprocess
import sys
import tempfile
import time

import environments
from worker import process_peak_bytes

sys.path.insert(0, os.path.join(environments.ROOT, "clients", "python", "src"))

from tessera_render import Client  # noqa: E402


class Engine:
    def __init__(self, job):
        self.job = job
        self.data = tempfile.TemporaryDirectory(dir=job["folder"])
        self.server = subprocess.Popen(
            [
                job["binary"],
                "serve",
                "--port",
                "0",
                "--data",
                self.data.name,
                "--threads",
                str(job["threads"]),
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        address = self.server.stdout.readline().rsplit(" ", 1)[-1].strip()
        if not address:
            raise RuntimeError(f"{job['binary']} serve does not start")
        self.client = Client(address, timeout=600)
        self.version = "Tessera " + str(self.client.info().version)
        self.scene = self.client.upload(job["scene"])
        if job["environment"]:
            self.environment = {"asset": self.client.upload_asset(job["environment"])}
        elif job["sky"]:
            self.environment = {"color": job["sky"]}
        else:
            self.environment = None
        self.last = None

    def render(self, samples, seed):
        self.last = self.client.submit(
            self.scene,
            seed=seed,
            environment=self.environment,
            film={
                "width": self.job["width"],
                "height": self.job["height"],
                "layers": ["beauty"],
                "filter": {"type": "box", "radius": 0.5},
            },
            integrator={
                "type": self.job["variant"] or self.job.get("integrator", "path"),
                "max_depth": self.job["depth"],
            },
            stop={"samples_per_pixel": samples},
        ).wait()
        return self.last.image()

    def meter(self, points, samples, seed):
        """Irradiance (r, g, b) at points (position, normal)."""
        job = self.client.submit(
            self.scene,
            seed=seed,
            environment=self.environment,
            film={"width": 1, "height": 1},
            integrator={"type": "path", "max_depth": self.job["depth"]},
            meter={"points": [{"position": p, "normal": n} for p, n in points]},
            # 16 paths for each sample of a pixel.
            stop={"samples_per_pixel": samples // 16},
        ).wait()
        return job.meter().irradiance_rgb.tolist()

    def rays(self):
        return self.last.data["statistics"]["rays"]

    def cpu_seconds(self):
        # The render thread ends its slice after the job's last message: that work belongs to the
        # job.
        time.sleep(0.02)
        with open(f"/proc/{self.server.pid}/stat") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def peak_bytes(self):
        return process_peak_bytes(self.server.pid)

    def end(self):
        self.server.terminate()
        self.server.wait(30)
        self.data.cleanup()
