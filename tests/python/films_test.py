"""Films and comparisons of the client; the server's metrics against an independent computation with
numpy."""

import asyncio
import os
import struct
import tempfile

import numpy as np
from support import ServerTest

import tessera_render
from tessera_render import AsyncClient

SMALL = {"size": (64, 48), "layers": []}


def replicates(path):
    """Means (height, width, replicate, channel) of a film file, by the documented layout."""
    with open(path, "rb") as file:
        data = file.read()
    head, _, _, flags, width, height = struct.unpack_from("<IIIIii", data, 8)
    count, tiles = struct.unpack_from("<II", data, 48)
    means, at = np.zeros((height, width, count, 3)), head
    for _ in range(tiles):
        x, y = struct.unpack_from("<ii", data, at)
        w, h = min(32, width - x), min(32, height - y)
        pixel = np.dtype([("mean", "<f4", 3), ("rest", "<f4", 2), ("count", "<u4")])
        found = np.frombuffer(data, pixel, w * h * count, at + 40).reshape(h, w, count)
        means[y:y + h, x:x + w] = found["mean"]
        at += 40 + found.nbytes + (32 * w * h if flags & 1 else 0)
    return means


def convolved(plane, kernel):
    radius = [n // 2 for n in kernel.shape]
    padded = np.pad(plane, [(r, r) for r in radius], mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, kernel.shape)
    return np.einsum("ijkl,kl->ij", windows, kernel)


XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def flip(a, b, pixels_per_degree=67):
    """Andersson et al. 2020, LDR, from linear values."""
    white = XYZ @ np.ones(3)

    def opponent(rgb):
        x, y, z = np.moveaxis(rgb @ XYZ.T / white, -1, 0)
        return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)])

    def colour(planes):
        y = (planes[0] + 16) / 116
        xyz = np.stack([planes[1] / 500 + y, y, y - planes[2] / 200], -1) * white
        return np.clip(xyz @ np.linalg.inv(XYZ).T, 0, 1)

    def hunt(rgb):
        t = rgb @ XYZ.T / white
        f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
        lightness = 116 * f[..., 1] - 16
        return np.stack([lightness, 5 * lightness * (f[..., 0] - f[..., 1]),
                         2 * lightness * (f[..., 1] - f[..., 2])])

    def distance(p, q):
        d = p - q
        return (np.abs(d[0]) + np.hypot(d[1], d[2])) ** 0.7

    radius = int(np.ceil(3 * np.sqrt(0.04 / (2 * np.pi**2)) * pixels_per_degree))
    grid = np.arange(-radius, radius + 1) / pixels_per_degree
    squares = grid[:, None] ** 2 + grid**2
    eye = []
    for terms in (((1, 0.0047),), ((1, 0.0053),), ((34.1, 0.04), (13.5, 0.025))):
        kernel = sum(s * np.sqrt(np.pi / w) * np.exp(-np.pi**2 * squares / w) for s, w in terms)
        eye.append(kernel / kernel.sum())
    sigma = 0.5 * 0.082 * pixels_per_degree
    reach = int(np.ceil(3 * sigma))
    k = np.arange(-reach, reach + 1)
    bell = np.exp(-(k[:, None] ** 2 + k**2) / (2 * sigma**2))

    def signed(kernel):
        return np.where(
            kernel > 0, kernel / kernel[kernel > 0].sum(), kernel / -kernel[kernel < 0].sum()
        )

    edge, point = signed(-k * bell), signed((k**2 / sigma**2 - 1) * bell)

    def features(planes):
        y = (planes[0] + 16) / 116
        return [np.hypot(convolved(y, kernel), convolved(y, kernel.T)) for kernel in (edge, point)]

    seen = []
    for picture in (a, b):
        planes = opponent(np.clip(picture, 0, 1))
        sharp = np.stack([convolved(p, kernel) for p, kernel in zip(planes, eye)])
        seen.append((hunt(colour(sharp)), features(planes)))
    most = distance(hunt(np.array([0.0, 1, 0])), hunt(np.array([0.0, 0, 1])))
    d = distance(seen[0][0], seen[1][0])
    knee = 0.4 * most
    d = np.where(d < knee, 0.95 / knee * d, 0.95 + (d - knee) / (most - knee) * 0.05)
    f = np.max([np.abs(p - q) for p, q in zip(seen[0][1], seen[1][1])], axis=0)
    return (d ** (1 - np.sqrt(np.minimum(f / np.sqrt(2), 1)))).mean()


def student_t_975(degrees):
    """97.5% quantile, to 1e-5 from 15 degrees of freedom on (Abramowitz and Stegun, 26.7.5)."""
    z = 1.959963984540054
    terms = (
        z,
        (z**3 + z) / 4,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
        (79 * z**9 + 776 * z**7 + 1482 * z**5 - 1920 * z**3 - 945 * z) / 92160,
    )
    return sum(term / degrees**power for power, term in enumerate(terms))


class Films(ServerTest):
    def render(self, seed, samples=16, **options):
        return self.client.submit(
            "cornell-box", samples_per_pixel=samples, seed=seed, **{**SMALL, **options}
        ).wait()

    def folder(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        return place.name

    def test_metrics_match_their_formulas(self):
        place = self.folder()
        jobs = [self.render(1, 8), self.render(2, 64)]
        films = [
            replicates(job.film(os.path.join(place, f"{i}.film"))) for i, job in enumerate(jobs)
        ]
        a, b = (film.mean(2) for film in films)
        np.testing.assert_allclose(a, jobs[0].image(), rtol=1e-6, atol=1e-7)
        found = self.client.compare(*jobs)
        self.assertAlmostEqual(found.mse / ((a - b) ** 2).mean(), 1, delta=1e-4)
        self.assertAlmostEqual(found.relmse / ((a - b) ** 2 / (b**2 + 0.01)).mean(), 1, delta=1e-4)
        bias = (a - b).mean()
        self.assertAlmostEqual(found.bias.value, bias, delta=1e-6)
        # Variances of pixel means, from the halves of each, add up over the image.
        half = [((film[:, :, 0] - film[:, :, 1]) / 2).mean(-1) for film in films]
        squares, fourths = (sum((h**power).sum() for h in half) for power in (2, 4))
        error = np.sqrt(squares) / half[0].size
        # Degrees of freedom of a sum of squares, by the kurtosis of its terms.
        t = student_t_975(3 * squares**2 / fourths - 2)
        for end, sign in ((found.bias.low, -1), (found.bias.high, 1)):
            self.assertAlmostEqual(sign * (end - bias) / error, t, delta=1e-3)
        self.assertAlmostEqual(found.flip / flip(a, b), 1, delta=2e-3)

    def test_films_merge_locally_and_on_the_server(self):
        place = self.folder()
        whole = self.render(4, 16, sampler={"replicates": 4})
        parts = [self.render(4, 8, sampler={"first_replicate": first}) for first in (0, 2)]
        path = parts[1].film(os.path.join(place, "part.film"))
        merged = self.client.merge(parts[0], path)
        self.assertEqual(merged.film_digest, whole.film_digest)
        np.testing.assert_array_equal(merged.image(), whole.image())
        with self.assertRaises(tessera_render.Conflict):
            self.client.merge(parts[0], parts[0].film(os.path.join(place, "again.film")))

        async def there():
            async with AsyncClient(self.url()) as client:
                first = await client.job(parts[0].id)
                other = await (await client.job(parts[1].id)).film(
                    os.path.join(place, "async.film")
                )
                self.assertEqual(other.read_bytes(), path.read_bytes())
                return (await client.merge(first, other)).film_digest

        self.assertEqual(asyncio.run(there()), whole.film_digest)
