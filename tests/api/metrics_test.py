"""/metrics: strict text format, names by Prometheus' rules, and a bounded set of labels."""

import json
import os
import random
import re
import string
import time

from harness import ApiTest, EventStream, job_body, wait_for

NAME = re.compile(r"[a-zA-Z_:][a-zA-Z0-9_:]*")
LABEL = re.compile(r'([a-zA-Z_][a-zA-Z0-9_]*)="((?:[^"\\\n]|\\\\|\\"|\\n)*)"')
DOCKER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docker")


class Family:
    def __init__(self, name, kind):
        self.name, self.kind, self.samples = name, kind, {}


def parse_labels(text):
    """Parses `{a="b"}` into pairs, in order; refuses anything else."""
    pairs, at = [], 1
    while text[at] != "}":
        found = LABEL.match(text, at)
        assert found, text
        pairs.append(found.groups())
        at = found.end()
        assert text[at] in ",}", text
        at += text[at] == ","
    assert at == len(text) - 1, text
    assert len({name for name, _ in pairs}) == len(pairs), f"duplicate label: {text}"
    return tuple(sorted(pairs))


def parse(text):
    """Prometheus' text format 0.0.4, strictly: HELP, TYPE, then all samples of that family."""
    assert text.endswith("\n") and "\r" not in text
    families, current = {}, None
    lines = iter(text[:-1].split("\n"))
    for line in lines:
        if line.startswith("#"):
            helps = re.fullmatch(r"# HELP (\S+) (\S.*)", line)
            assert helps, line
            kind = re.fullmatch(r"# TYPE (\S+) (counter|gauge|histogram)", next(lines))
            assert kind and kind[1] == helps[1] and NAME.fullmatch(kind[1]), line
            assert kind[1] not in families, f"declared twice: {line}"
            current = families[kind[1]] = Family(kind[1], kind[2])
            continue
        sample = re.fullmatch(r"([a-zA-Z0-9_:]+)(\{.*\})? (\S+)", line)
        assert sample and current, line
        name, labels, value = sample[1], parse_labels(sample[2] or "{}"), float(sample[3])
        suffixes = ("_bucket", "_sum", "_count") if current.kind == "histogram" else ("",)
        assert name in {
            current.name + suffix for suffix in suffixes
        }, f"{line} among {current.name}"
        assert (name, labels) not in current.samples, f"duplicate series: {line}"
        current.samples[name, labels] = value
    return families


def check_histogram(family):
    series = {}
    for (name, labels), value in family.samples.items():
        rest = tuple(pair for pair in labels if pair[0] != "le")
        bounds, others = series.setdefault(rest, ([], {}))
        if name.endswith("_bucket"):
            bounds.append((float(dict(labels)["le"]), value))
        else:
            others[name] = value
    for rest, (bounds, others) in series.items():
        assert [b for b, _ in bounds] == sorted(b for b, _ in bounds), (family.name, rest)
        assert [n for _, n in bounds] == sorted(n for _, n in bounds), (family.name, rest)
        assert bounds[-1] == (float("inf"), others[family.name + "_count"]), (family.name, rest)
        assert family.name + "_sum" in others, (family.name, rest)


class Metrics(ApiTest):
    def families(self):
        answer = self.server.get("/metrics")
        self.assertEqual(answer.headers["Content-Type"], "text/plain; version=0.0.4; charset=utf-8")
        return parse(answer.body.decode())

    def value(self, name, **labels):
        for family in self.families().values():
            found = family.samples.get((name, tuple(sorted(labels.items()))))
            if found is not None:
                return found
        return None

    def wait_for(self, name, at_least, **labels):
        wait_for(lambda: (self.value(name, **labels) or 0) >= at_least,
                 f"{name} {labels} stays below {at_least}")

    def test_text_is_well_formed_and_names_follow_the_rules(self):
        job = self.server.submit(job_body())["id"]
        with EventStream(self.server, job) as stream:
            self.assertEqual([event.name for event in stream][-1], "end")
        for family in self.families().values():
            name = family.name
            self.assertRegex(name, r"^(tessera|process)_[a-z][a-z_]*[a-z]$")
            self.assertEqual(family.kind == "counter", name.endswith("_total"), name)
            self.assertNotRegex(name, r"_(milliseconds|ms|minutes|kilobytes|kb|mb|percent)(_|$)")
            for unit in ("seconds", "bytes"):
                if unit in name.split("_"):
                    self.assertRegex(name, f"_{unit}(_total)?$")
            if family.kind == "histogram":
                check_histogram(family)
            if family.kind == "counter":
                self.assertTrue(all(value >= 0 for value in family.samples.values()), name)

    def test_reports_jobs_and_process_resources(self):
        families = self.families()
        (info,) = families["tessera_build_info"].samples.items()
        self.assertEqual(info[1], 1)
        about = self.server.get("/v1/server").json()
        labels = dict(info[0][1])
        self.assertEqual(labels["version"], about["version"])
        self.assertEqual(labels["commit"], about["build"]["commit"])
        started = self.value("process_start_time_seconds")
        self.assertAlmostEqual(started, time.time(), delta=3600)
        with open(f"/proc/{self.server.process.pid}/statm", encoding="ascii") as statm:
            resident = int(statm.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
        told = self.value("process_resident_memory_bytes")
        self.assertLess(abs(told - resident), 0.5 * resident)
        open_files = len(os.listdir(f"/proc/{self.server.process.pid}/fd"))
        self.assertLess(abs(self.value("process_open_fds") - open_files), 8)
        self.assertGreater(self.value("process_cpu_seconds_total"), 0)
        for name in ("process_virtual_memory_bytes", "process_max_fds", "process_threads"):
            self.assertGreater(self.value(name), 0, name)

    def test_unknown_methods_and_paths_create_no_series(self):
        dice = random.Random(7)

        def ask():
            method = "".join(dice.choices(string.ascii_uppercase, k=12))
            path = "".join(dice.choices(string.ascii_lowercase, k=12))
            self.server.raw(
                f"{method} /{path} HTTP/1.1\r\nHost: localhost\r\n"
                "Connection: close\r\n\r\n".encode()
            )

        def series():
            return {key for family in self.families().values() for key in family.samples}

        ask()
        self.wait_for(
            "tessera_http_requests_total", 1, method="other", route="unknown", status="404"
        )
        before = series()
        for _ in range(100):
            ask()
        self.wait_for(
            "tessera_http_requests_total", 101, method="other", route="unknown", status="404"
        )
        # Our own requests of /metrics are counted only after the first of them has ended.
        made = {key for key in series() - before if ("route", "/metrics") not in key[1]}
        self.assertEqual(made, set())

    def test_counts_jobs_by_reason_of_their_end(self):
        ends = "tessera_jobs_ended_total"
        before = self.value(ends, reason="samples_per_pixel") or 0
        for _ in range(2):
            self.server.get(f"/v1/jobs/{self.server.submit(job_body())['id']}?wait=60")
        self.wait_for(ends, before + 2, reason="samples_per_pixel")
        before = self.value(ends, reason="cancelled") or 0
        job = self.server.submit(job_body(samples=65536))["id"]
        self.server.post(f"/v1/jobs/{job}/cancel")
        self.wait_for(ends, before + 1, reason="cancelled")

    def test_separates_streams_and_waits_from_requests(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        with EventStream(self.server, job) as stream:
            next(iter(stream))
            self.assertGreaterEqual(self.value("tessera_streams"), 1)
        waited = {"route": "/v1/jobs/{id}"}
        looks = self.value("tessera_http_request_duration_seconds_count", **waited) or 0
        self.assertEqual(self.server.get(f"/v1/jobs/{job}?wait=1").status, 200)
        self.wait_for("tessera_http_stream_duration_seconds_count", 1, **waited)
        self.wait_for("tessera_http_stream_duration_seconds_count", 1, route="/v1/jobs/{id}/events")
        self.assertEqual(
            self.value("tessera_http_request_duration_seconds_count", **waited) or 0, looks
        )
        self.assertIsNone(
            self.value("tessera_http_request_duration_seconds_count", route="/v1/jobs/{id}/events"))
        self.server.post(f"/v1/jobs/{job}/cancel")

    def test_counts_refusals_by_reason(self):
        before = self.value("tessera_http_refusals_total", reason="host")
        self.assertEqual(self.server.get("/v1/jobs", {"Host": "elsewhere.example"}).status, 421)
        self.wait_for("tessera_http_refusals_total", before + 1, reason="host")

    def test_alerts_and_dashboard_use_existing_metrics_and_labels(self):
        series = {}
        for family in self.families().values():
            for name, labels in family.samples:
                series.setdefault(name, set()).update(label for label, _ in labels)
            series.setdefault(family.name, set())
            if family.kind == "histogram":  # exists after the first count
                for suffix in ("_bucket", "_sum", "_count"):
                    series.setdefault(family.name + suffix, set())
        with open(f"{DOCKER}/prometheus-alerts.yaml", encoding="utf-8") as file:
            texts = [file.read()]
        with open(f"{DOCKER}/grafana-dashboard.json", encoding="utf-8") as file:
            dashboard = json.load(file)
        texts += [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
        used = {
            name for text in texts for name in re.findall(r"\b(?:tessera|process)_[a-z_]+", text)
        }
        self.assertGreater(len(used), 20)
        self.assertEqual(used - set(series), set())
        self.assertEqual(texts[0].count("- alert:"), texts[0].count("expr:"))


class MetricsKey(ApiTest):
    FLAGS = ("--metrics-key", "of-the-figures")

    def test_metrics_require_their_key(self):
        self.assertEqual(self.server.get("/metrics").status, 401)
        for key, status in (("wrong", 401), ("of-the-figures", 200)):
            answer = self.server.get("/metrics", {"Authorization": "Bearer " + key})
            self.assertEqual(answer.status, status, key)
        self.assertEqual(self.server.get("/livez").status, 200)
