#!/usr/bin/env python3
"""Compares path, bdpt and the irradiance meter with Mitsuba 3, an independent renderer; also in
scenes with scattering media.

usage: tests/render/mitsuba_check.py [--short] [--scene NAME] [--binary build/release/tessera]

Both renderers get the same GLB files, depth and box filter, and render each scene with several
independent seeds. Means of square blocks of pixels, the mean of the whole image and the readings of
the meter, each in three channels, are compared by Welch's t-test over the seeds. The level of a
single test is FALSE_ALARM over their number (Bonferroni), so that a correct run fails with a
probability of at most 1e-3. The planted fault: our values times 1.02 must be rejected, for each
integrator and for the meter, in every scene.

Both renderers support the scenes. Mitsuba has only single scattering between the microfacets of
rough surfaces, Tessera also multiple scattering: roughness is 0.15 (a GGX alpha of 0.0225), where
the difference is far below the noise.

Mitsuba is installed into build/peers on first use, in the version of
tests/bench/peers/environments.py; it computes without LLVM (scalar_rgb).
"""
import argparse
import math
import os
import struct
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "bench", "peers"))

import environments  # noqa: E402

FALSE_ALARM = 1e-3
PLANTED = 1.02
DEPTH = 6  # maximum number of scattering events
# With media, whose events Mitsuba counts: walls of an albedo of 0.8 keep 1e-6 of the light.
DEEP = 64
THREADS = 2
# Pixels of a side of the image, of which each block has a quarter. Paths in media are long.
SIDE, SIDE_OF_MEDIA = 48, 24


def write_map(path):
    """A smooth map, an uncompressed OpenEXR file: a gradient and a wide glow, without symmetry.
    High resolution, since Mitsuba's texels are offset by up to half a row from Tessera's: 0.3 % at
    64."""
    import numpy as np

    width, height = 1024, 512
    v, u = np.mgrid[0:height, 0:width]
    theta, phi = (v + 0.5) * math.pi / height, (u + 0.5) * 2 * math.pi / width
    glow = np.exp(6 * (np.sin(theta) * np.cos(phi - 1) * 0.8 + np.cos(theta) * 0.6 - 1))
    light = 0.3 + 0.2 * np.cos(theta)[..., None] + glow[..., None] * np.array([6, 5, 4])

    def attribute(name, kind, data):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(data)) + data

    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(c + b"\0" + struct.pack("<4i", 2, 0, 1, 1) for c in (b"B", b"G", b"R"))
    header = struct.pack("<2i", 20000630, 2) + b"".join((
        attribute(b"channels", b"chlist", channels + b"\0"),
        attribute(b"compression", b"compression", b"\0"),
        attribute(b"dataWindow", b"box2i", window),
        attribute(b"displayWindow", b"box2i", window),
        attribute(b"lineOrder", b"lineOrder", b"\0"),
        attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        attribute(b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0)),
        attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)))) + b"\0"
    rows = [row[:, ::-1].T.astype("<f4").tobytes() for row in light]  # B, G, R
    first = len(header) + 8 * len(rows)
    with open(path, "wb") as file:
        file.write(header)
        file.write(struct.pack(f"<{height}Q", *(first + y * (8 + len(rows[0]))
                                                for y in range(height))))
        for y, row in enumerate(rows):
            file.write(struct.pack("<2i", y, len(row)) + row)
    return path


def balls_under_map(path):
    """A white, a metal and a rough glass ball on a floor that fills the image: pixels that see the
    map directly have no noise to test."""
    import scenes

    b = scenes.Builder()
    floor = b.material((0.6, 0.5, 0.4), specular=0)
    white = b.material((0.8, 0.8, 0.8), specular=0)
    metal = b.material((0.95, 0.64, 0.54), metallic=1.0, roughness=0.15)
    glass = b.material((1, 1, 1), roughness=0.15, glass=True)
    b.node(b.mesh(scenes.quad((-6, 0, 6), (12, 0, 0), (0, 0, -12), floor)))
    for x, stuff in ((-1.1, white), (0, metal), (1.1, glass)):
        b.node(b.mesh(scenes.ball(stuff)), translation=[x, 0.5, 0], scale=[0.5, 0.5, 0.5])
    return b.save(path, (0.4, 3.2, 3.2), (0, 0.3, 0), math.radians(35))


def milk_in_box(path):
    """A ball of wax without a boundary, its extinction another in each channel, close to the lamp
    of a box."""
    import scenes

    b = scenes.Builder()
    white = b.material((0.73, 0.73, 0.73), specular=0)
    lamp = b.material((0, 0, 0), specular=0, emission=(12, 12, 12))
    wax = b.material((1, 1, 1), roughness=0, glass=True, ior=1,
                     medium=(0.5, (0.8, 0.4, 0.1), (0.9, 0.7, 0.5), 0.4))
    b.node(b.mesh(scenes.quad((0, 0, 1), (1, 0, 0), (0, 0, -1), white),
                  scenes.quad((0, 0, 0), (1, 0, 0), (0, 1, 0), white),
                  scenes.quad((0, 0, 1), (0, 0, -1), (0, 1, 0), white),
                  scenes.quad((0.3, 0.98, 0.3), (0.4, 0, 0), (0, 0, 0.4), lamp)))
    b.node(b.mesh(scenes.ball(wax)), translation=[0.5, 0.5, 0.5], scale=[0.35, 0.35, 0.35])
    return b.save(path, (0.5, 0.5, 2.4), (0.5, 0.5, 0), math.radians(36))


def milk_under_map(path):
    """Milk behind a boundary that refracts; seen from close by."""
    import scenes

    b = scenes.Builder()
    floor = b.material((0.6, 0.5, 0.4), specular=0)
    milk = b.material((1, 1, 1), roughness=0, glass=True, ior=1.33,
                      medium=(0.5, (0.4, 0.35, 0.3), (0.9, 0.85, 0.7), 0.6))
    b.node(b.mesh(scenes.quad((-6, 0, 6), (12, 0, 0), (0, 0, -12), floor)))
    b.node(b.mesh(scenes.ball(milk)), translation=[0, 0.5, 0], scale=[0.5, 0.5, 0.5])
    return b.save(path, (0.3, 2.2, 1.6), (0, 0.3, 0), math.radians(30))


def cases(folder):
    """Name, scene, environment, depth and the meter's points (position, normal) of each."""
    import scenes

    def at(name):
        return os.path.join(folder, name)

    yield ("cornell-spheres", scenes.cornell_spheres(at("cornell.glb")), None, DEPTH,
           [([0.5, 0.001, 0.5], [0, 1, 0]), ([0.7, 0.001, 0.85], [0, 1, 0]),
            ([0.001, 0.5, 0.5], [1, 0, 0]), ([0.5, 0.8, 0.001], [0, 0, 1])])
    yield ("balls-under-map", balls_under_map(at("balls.glb")), write_map(at("map.exr")), DEPTH,
           [([0.5, 0.001, 0.9], [0, 1, 0]), ([-1.1, 0.001, -0.8], [0, 1, 0]),
            ([0, 1.5, 0], [-1, 0, 0])])
    yield ("milk-in-box", milk_in_box(at("wax.glb")), None, DEEP,
           [([0.2, 0.001, 0.5], [0, 1, 0]), ([0.001, 0.5, 0.3], [1, 0, 0])])
    yield ("milk-under-map", milk_under_map(at("milk.glb")), at("map.exr"), DEEP,
           [([0.7, 0.001, 0.3], [0, 1, 0])])


def tails(t, freedom):
    """Two-sided p-values of Student's t: with x = sqrt(freedom) tan(a), its density is proportional
    to cos(a)^(freedom - 1)."""
    import numpy as np

    out = np.empty_like(t)
    for i in np.ndindex(t.shape):
        a = math.atan(abs(t[i]) / math.sqrt(freedom[i]))
        above = np.cos(np.linspace(a, math.pi / 2, 2001)) ** (freedom[i] - 1)
        whole = np.cos(np.linspace(0, math.pi / 2, 2001)) ** (freedom[i] - 1)
        out[i] = (above.mean() * (math.pi / 2 - a)) / (whole.mean() * math.pi / 2)
    return out


def welch(ours, theirs):
    """p-values of equal means, for arrays (seeds, ...)."""
    import numpy as np

    a, b = (x.var(axis=0, ddof=1) / len(x) for x in (ours, theirs))
    apart = ours.mean(axis=0) - theirs.mean(axis=0)
    error = np.sqrt(a + b)
    if not np.all(error > 0):
        sys.exit("a block has no scatter over the seeds: they are identical")
    freedom = (a + b) ** 2 / (a ** 2 / (len(ours) - 1) + b ** 2 / (len(theirs) - 1))
    return tails(apart / error, freedom)


def blocks(pictures, side):
    """Means of blocks of side x side pixels and of the whole: (seeds, blocks + 1, 3)."""
    import numpy as np

    n, height, width, _ = pictures.shape
    parts = pictures.reshape(n, height // side, side, width // side, side, 3).mean(axis=(2, 4))
    return np.concatenate([parts.reshape(n, -1, 3), pictures.mean(axis=(1, 2))[:, None]], axis=1)


class Renderer:
    """A worker process with one scene loaded."""

    def __init__(self, kind, job, folder):
        import engines

        self.worker = engines.Worker(kind, os.path.join(folder, kind.name + ".log"))
        self.folder = folder
        self.worker.ask("load", job={**job, "variant": kind.variant})

    def pictures(self, options):
        import numpy as np

        out = []
        for seed in range(options.seeds):
            path = os.path.join(self.folder, "picture.npy")
            self.worker.ask("render", samples=options.samples, seed=1000 * seed + 1, output=path)
            out.append(np.load(path).astype(np.float64))
        return np.stack(out)

    def readings(self, points, options):
        import numpy as np

        return np.array([
            self.worker.ask("meter", points=points, samples=options.meter_samples,
                            seed=1000 * seed + 1)["irradiance"]
            for seed in range(options.seeds)])

    def close(self):
        self.worker.close()


def measure(case, options, folder):
    """Yields (name, ours, theirs): arrays (seeds, values, 3)."""
    import engines

    name, scene, environment, depth, points = case
    side = SIDE_OF_MEDIA if depth == DEEP else SIDE
    job = {"scene": scene, "environment": environment, "sky": None, "width": side,
           "height": side, "depth": depth, "threads": THREADS, "folder": folder,
           "binary": os.path.abspath(options.binary)}
    theirs = Renderer(engines.MITSUBA_SCALAR, job, folder)
    pictures = blocks(theirs.pictures(options), side // 4)
    readings = theirs.readings(points, options)
    theirs.close()
    for integrator in ("path", "bdpt"):
        ours = Renderer(engines.KINDS[0], {**job, "integrator": integrator}, folder)
        yield f"{name}, {integrator}", blocks(ours.pictures(options), side // 4), pictures
        if integrator == "path":
            yield f"{name}, meter", ours.readings(points, options), readings
        ours.close()


def main(words):
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default=os.path.join(ROOT, "build", "release", "tessera"))
    parser.add_argument("--short", action="store_true", help="a quarter of the samples")
    parser.add_argument("--scene", default="", help="only scenes whose names begin so")
    options = parser.parse_args(words)
    options.seeds = 16
    options.samples, options.meter_samples = (64, 16384) if options.short else (256, 65536)

    results = []
    with tempfile.TemporaryDirectory() as folder:
        for case in cases(folder):
            if not case[0].startswith(options.scene):
                continue
            results += measure(case, options, folder)
    if not results:
        sys.exit(f"no scene begins with {options.scene}")
    level = FALSE_ALARM / sum(ours[0].size for _, ours, _ in results)
    failed = 0
    for name, ours, theirs in results:
        least, planted = (welch(f * ours, theirs).min() for f in (1, PLANTED))
        ratio = ours.mean() / theirs.mean()
        wrong = [what for what, is_wrong in (("differs", least < level),
                                             ("does not detect the planted fault",
                                              planted >= level)) if is_wrong]
        failed += bool(wrong)
        print(f"{name:26} ours/Mitsuba {ratio:.4f}, least p {least:.2g}, planted {planted:.2g}, "
              f"level {level:.2g}: {' and '.join(wrong) or 'ok'}")
    print(f"{len(results) - failed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    # numpy and the Python client's httpx are in a separate environment.
    if os.environ.get("TESSERA_PEERS_PYTHON") != "here":
        try:
            interpreter = environments.python_of("bench")
        except environments.Missing as why:
            sys.exit(f"no environment for the check itself: {why}")
        os.environ["TESSERA_PEERS_PYTHON"] = "here"
        os.execv(interpreter, [interpreter, os.path.abspath(__file__), *sys.argv[1:]])
    sys.exit(main(sys.argv[1:]))
