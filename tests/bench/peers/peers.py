#!/usr/bin/env python3
"""Compares Tessera with other path tracers: same glTF files, size, depth, filter and threads,
alternating.

usage: tests/bench/run --peers [--short] [--scenes NAME,...] [--engines NAME,...]
                               [--scene FILE [--environment HDR]]...
                               [--maps HDR,...]

Prints a table for each scene and one for all, and writes results.json and peers.svg into
build/peers (or --out). Engines are installed into build/peers on first use, in pinned versions;
those that cannot be installed are reported and skipped.

Method
  Order     Runs of all engines alternate; each repetition has another seed. 95 % intervals are
            Student's over the repetitions, of ratios over their logarithms, pair by pair.
  T         CPU seconds of all threads of an engine's process while it renders. Before timing,
            scenes are loaded, and each engine has rendered an image with each number of samples
            (kernels, hierarchies).
  relMSE    Mean of (a - r)^2 / (r^2 + 0.01) over pixels and channels; the noise of r, estimated
            from its parts, is subtracted. r is a long render by a peer, the one that differs least
            from those of all others ("common"). An engine whose own long render differs from it
            beyond noise is measured against its own ("own"): materials and lights of two engines
            are never exactly equal, and that is not noise.
  bright    Mean of the engine's long render over that of Tessera's. Other than 1: they do not
            render the same scene.
  eff       1/(V T) = threads / (relMSE x CPU seconds); (trimmed): without the worst 0.1 % of
            pixels.
  peer/Tessera  Ratio of the two efficiencies; above 1 the peer is better.
  samples/s     Per second with all threads busy, by CPU time, so that other load has no effect.
  rays/s    As counted by the engine; most do not count.
  start     From the start of the process to a first image with 1 sample per pixel, including
            reading files.
  peak      Peak resident memory of the process.
Depth is 8 scattering events, the filter a box; roulette, samplers and light sampling are each
engine's defaults, except that LuxCore's BIDIRCPU has no roulette, which would brighten its images.
Its depth limits each of the two subpaths, so it needs a depth that loses little light, as
--depth 24. With --maps, each --scene is rendered under each map, and V is the variance between the
repetitions, relative to the pixel's squared mean, without the worst 1 % of the pixels: for files
that engines understand differently, and with light that few paths find. Clamps, denoisers,
adaptive sampling, blurred caustics and all other biased noise reductions are off.
"""

import argparse
import json
import os
import platform
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)

import environments  # noqa: E402


class EnvironmentOfScene(argparse.Action):
    def __call__(self, parser, options, value, flag=None):
        if not options.scene:
            parser.error("--environment belongs to the --scene before it")
        options.scene[-1][1] = os.path.abspath(value)


class OneMoreScene(argparse.Action):
    def __call__(self, parser, options, value, flag=None):
        options.scene = [*(options.scene or []), [os.path.abspath(value), None]]


def arguments(words):
    def names(text):
        return text.split(",")

    def numbers(text):
        return [int(word) for word in text.split(",")]

    def size(text):
        width, height = text.split("x")
        return int(width), int(height)

    parser = argparse.ArgumentParser(prog="tests/bench/run --peers", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--short", action="store_true", help="cornell-box at 4 and 16 samples: about a minute"
    )
    parser.add_argument(
        "--scene", action=OneMoreScene, metavar="FILE", help="a .glb or .gltf; again for more"
    )
    parser.add_argument(
        "--environment",
        action=EnvironmentOfScene,
        metavar="HDR",
        help="lights the --scene before it",
    )
    parser.add_argument("--maps", type=names, metavar="HDR,...",
                        help="each --scene under each of these, by variances alone")
    parser.add_argument("--scenes", type=names, help="of the benchmark's own; --list names them")
    parser.add_argument("--engines", type=names, help="those whose names begin so")
    parser.add_argument("--list", action="store_true", help="names scenes and engines")
    parser.add_argument("--samples", type=numbers, help="samples a pixel (4,16,64,256)")
    parser.add_argument("--repeats", type=int, help="(5)")
    parser.add_argument("--size", type=size, help="(256x256)")
    parser.add_argument("--depth", type=int, default=8)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument(
        "--reference", type=numbers, metavar="N,SAMPLES", help="N long renders of so many (16,256)"
    )
    parser.add_argument(
        "--assets", default=os.environ.get("TESSERA_ASSETS"), help="folder of products and maps"
    )
    parser.add_argument(
        "--tessera", default=os.path.join(environments.ROOT, "build", "release", "tessera")
    )
    parser.add_argument("--out", default=environments.HOME)
    options = parser.parse_args(words)
    short = options.short
    options.samples = sorted(options.samples or ([4, 16] if short else [4, 16, 64, 256]))
    options.repeats = options.repeats or (3 if short else 5)
    options.size = options.size or ((128, 128) if short else (256, 256))
    options.reference = options.reference or ([4, 64] if short else [16, 256])
    if len(options.reference) != 2 or options.reference[0] < 2:
        parser.error(
            "--reference: at least 2 renders, of which the noise is known, and their samples"
        )
    if options.maps and (not options.scene or options.repeats < 2):
        parser.error("--maps: light each --scene, at least twice")
    options.tessera, options.out = os.path.abspath(options.tessera), os.path.abspath(options.out)
    return options


class Contest:
    """Runs all engines on one scene."""

    def __init__(self, case, kinds, options, folder):
        self.case, self.options, self.folder = case, options, folder
        self.workers, self.left_out, self.results = {}, {}, {}
        self.number = 0
        for kind in kinds:
            self.attempt(kind.name, lambda kind=kind: self.start(kind))

    def attempt(self, name, action):
        """Skips an engine that fails, and reports the reason."""
        try:
            return action()
        except Exception as error:
            self.left_out[name] = str(error)
            self.results.pop(name, None)
            worker = self.workers.pop(name, None)
            if worker:
                worker.close()
            print(f"  left out: {name}: {error}", file=sys.stderr)
            return None

    def start(self, kind):
        import engines
        width, height = self.options.size
        folder = os.path.join(self.folder, kind.name)
        os.makedirs(folder, exist_ok=True)
        began = time.monotonic()
        worker = self.workers[kind.name] = engines.Worker(
            kind, os.path.join(self.options.out, kind.name + ".log")
        )
        loaded = worker.ask(
            "load",
            job={
                "scene": self.case.scene,
                "environment": self.case.environment,
                "sky": self.case.sky,
                "width": width,
                "height": height,
                "depth": self.options.depth,
                "threads": self.options.threads,
                "variant": kind.variant,
                "folder": folder,
                "binary": self.options.tessera,
            },
        )
        self.render(kind.name, 1, 1)
        self.results[kind.name] = {"version": loaded["version"], "start": time.monotonic() - began}
        print(f"  {kind.name}: {loaded['version']}", file=sys.stderr)

    def render(self, name, samples, seed):
        """Returns image and cost."""
        import numpy as np
        path = os.path.join(self.folder, f"{self.number % 8}.npy")
        self.number += 1
        cost = self.workers[name].ask("render", samples=samples, seed=seed, output=path)
        picture = np.load(path)
        width, height = self.options.size
        if picture.shape != (height, width, 3) or not np.isfinite(picture).all():
            raise RuntimeError(
                f"an image of {picture.shape} with "
                f"{np.count_nonzero(~np.isfinite(picture))} non-finite values"
            )
        return picture, cost

    def alternate(self, rounds, action):
        """Runs action(name, round) for all engines in turn, starting with another one in each
        round."""
        for i in rounds:
            names = list(self.workers)
            for name in names[i % len(names):] + names[:i % len(names)] if names else ():
                self.attempt(name, lambda name=name: action(name, i))

    def run(self):
        from measures import Reference
        options = self.options
        longs = {}
        parts, samples = options.reference
        # Seeds from 1000 on: distinct from the measured ones.
        self.alternate(range(parts), lambda name, i: longs.setdefault(name, []).append(
            self.render(name, samples, 1000 + i)[0]))
        references = {name: Reference(longs[name]) for name in self.workers}
        for count in options.samples:
            self.alternate([0], lambda name, i: self.render(name, count, 1))
        runs = {name: {count: [] for count in options.samples} for name in self.workers}
        for count in options.samples:
            self.alternate(range(options.repeats), lambda name, i: runs[name][count].append(
                self.render(name, count, 2 + i + 100 * count)))
        for name in list(self.workers):
            self.attempt(name, lambda name=name: self.results[name].update(
                peak_bytes=self.workers[name].ask("end")["peak_bytes"]))
        self.evaluate(references, runs)
        return self

    def run_variances(self):
        """Prints a line for each peer; returns Tessera's efficiencies over theirs."""
        import measures
        count = self.options.samples[-1]
        runs = {name: [] for name in self.workers}
        self.alternate(range(self.options.repeats), lambda name, i: runs[name].append(
            self.render(name, count, 2 + i)))
        all_efficiencies = {}
        brightness = {}
        for name in self.workers:
            pictures = [picture for picture, _ in runs[name]]
            cpu_seconds = sum(cost["cpu"] for _, cost in runs[name]) / len(pictures)
            errors = measures.relative_variances(pictures)
            all_efficiencies[name] = [measures.efficiency(v, cpu_seconds, self.options.threads)
                                      for v in (measures.without_worst(errors, 0.01),
                                                measures.relative_mse(errors))]
            brightness[name] = sum(picture.mean() for picture in pictures)
        ours = all_efficiencies.pop("tessera", None)
        if ours is None:
            return {}
        out = {name: [a / b for a, b in zip(ours, theirs, strict=True)]
               for name, theirs in all_efficiencies.items()}
        for name, (trimmed, whole) in out.items():
            bright = brightness[name] / brightness["tessera"]
            print(f"{self.case.name:54} {name:20}Tessera/peer {trimmed:7.2f}   with all pixels "
                  f"{whole:7.2f}   bright {bright:.3f}", flush=True)
        return out

    def evaluate(self, references, runs):
        import measures
        names = [name for name in self.results if name in runs]
        self.common = common = measures.most_agreed(references)
        for name in names:
            result, own = self.results[name], references[name]
            shared = references[common]
            difference, doubt = measures.difference(own, shared)
            most = max(runs[name])
            noise = measures.relative_mse(own.pixel_errors(runs[name][most][0][0], shared.mean))
            # They must agree to a tenth of the smallest measured noise.
            agrees = own is shared or difference + 2 * doubt <= 0.1 * noise
            reference = shared if agrees else own
            result.update(
                difference=difference,
                reference="common" if agrees else "own",
                brightness=own.brightness(),
            )
            result["runs"] = {}
            for count, pictures in runs[name].items():
                rows = []
                for picture, cost in pictures:
                    errors = reference.pixel_errors(picture, shared.mean)
                    rows.append({**cost, "relmse": measures.relative_mse(errors),
                                 "relmse_trimmed": measures.without_worst(errors)})
                result["runs"][count] = rows

    def close(self):
        for worker in self.workers.values():
            worker.close()


def is_quiet():
    """Returns whether other processes use at most a tenth of a core."""
    return os.getloadavg()[0] < 0.1 * (os.cpu_count() or 1)


def compare_variances(cases, kinds, options):
    import tempfile
    import scenes
    found = []
    for case in cases:
        for environment in options.maps:
            stem = os.path.splitext(os.path.basename(environment))[0]
            lit = scenes.Case(f"{case.name}, {stem}", case.scene, os.path.abspath(environment))
            with tempfile.TemporaryDirectory() as scratch:
                contest = Contest(lit, kinds, options, scratch)
                try:
                    found += (ratios[0] for ratios in contest.run_variances().values())
                finally:
                    contest.close()
    print(f"{len(found)} comparisons: Tessera ahead in {sum(r > 1 for r in found)}, twice in "
          f"{sum(r >= 2 for r in found)}")
    return 0


def main(words):
    options = arguments(words)
    import engines
    import report
    import scenes
    import tempfile
    if options.list:
        print("scenes:", *scenes.names(options.assets))
        print("scenes, only if named:", *scenes.HIDDEN_LIGHT)
        print("engines:", *(kind.name for kind in engines.KINDS))
        return 0
    if not os.path.exists(options.tessera):
        sys.exit(f"{options.tessera} is not there: build it, or name one with --tessera")
    os.makedirs(options.out, exist_ok=True)
    load = os.getloadavg()[0]
    machine = f"{platform.machine()}, {os.cpu_count()} cores, load {load:.1f}"
    if not is_quiet():
        print(
            f"the machine is busy (load {load:.1f}): compare only runs that go side by side",
            file=sys.stderr,
        )
    wanted = options.scenes or (() if options.scene else ["cornell-box"] if options.short
                                else scenes.names(options.assets))
    known = [*scenes.names(options.assets), *scenes.HIDDEN_LIGHT]
    unknown = set(wanted) - set(known)
    if unknown:
        sys.exit(
            f"unknown scenes: {', '.join(sorted(unknown))}; there are {', '.join(known)}"
            + ("" if options.assets else " (TESSERA_ASSETS is not set: no products)")
        )
    kinds = engines.available(options.engines)
    width, height = options.size
    folder = os.path.join(options.out, "scenes")
    cases = scenes.prepare(wanted, options.tessera, folder, width / height, options.assets)
    for path, environment in options.scene or ():
        name = os.path.splitext(os.path.basename(path))[0]
        cases.append(scenes.Case(name, scenes.packed(path, folder, width / height), environment))
    if options.maps:
        return compare_variances(cases, kinds, options)
    document = {
        "machine": machine,
        "size": options.size,
        "depth": options.depth,
        "threads": options.threads,
        "samples": options.samples,
        "repeats": options.repeats,
        "reference": options.reference,
        "scenes": [],
    }
    for case in cases:
        print(f"{case.name}:", file=sys.stderr)
        with tempfile.TemporaryDirectory() as scratch:
            contest = Contest(case, kinds, options, scratch)
            try:
                contest.run()
            finally:
                contest.close()
        scene = {"name": case.name, "common": contest.common, "left_out": contest.left_out,
                 "engines": contest.results}
        document["scenes"].append(scene)
        print(report.scene_table(document, scene))
        with open(os.path.join(options.out, "results.json"), "w") as file:
            json.dump(document, file, indent=1)
        with open(os.path.join(options.out, "peers.svg"), "w") as file:
            file.write(report.svg(document))
    print(report.summary(document))
    print(f"written: {options.out}/results.json, {options.out}/peers.svg")
    return 0


if __name__ == "__main__":
    # numpy and the Python client's httpx are in a separate environment.
    if os.environ.get("TESSERA_PEERS_PYTHON") != "here":
        try:
            interpreter = environments.python_of("bench")
        except environments.Missing as why:
            sys.exit(f"no environment for the benchmark itself: {why}")
        os.environ["TESSERA_PEERS_PYTHON"] = "here"
        os.execv(interpreter, [interpreter, os.path.abspath(__file__), *sys.argv[1:]])
    sys.exit(main(sys.argv[1:]))
