"""The laboratory course: each topic has a chapter and an experiment, links and jobs are valid."""

import json
import math
import pathlib
import re
import urllib.parse

from harness import ApiTest

COURSE = pathlib.Path(__file__).parents[2] / "clients/web/src/guide/course.md"

# Topic: words of its chapter's text, number of the chapter, experiment.
TOPICS = [
    ("estimand, estimator, estimate", r"\*estimand\*.*\*estimator\*.*\*estimate\*", 1, "pi"),
    ("primary and secondary estimator", r"\*primary\*.*\*secondary\*", 1, "pi"),
    ("why the mean of f/p is unbiased", r"E\[ \\frac\{f\(x\)\}\{p\(x\)\} \]", 1, "pi"),
    ("sample variance", r"s\^2 = \\frac\{1\}\{n-1\}", 1, "mse"),
    ("MSE = V + b^2", r"= V\[F\] \+ b\^2", 1, "mse"),
    ("consistency and unbiasedness", r"\*unbiased\*.*\*consistent\*", 1, "mse"),
    ("cdf and inversion", r"x = P\^\{-1\}\(u\)", 2, "inversion"),
    ("change of variables, Jacobian", r"Jacobian", 2, "inversion"),
    ("conditional and marginal densities", r"marginal.*conditional", 2, "inversion"),
    ("rejection", r"Rejection", 2, "inversion"),
    ("quadrature and dimension", r"n\^\{-2/d\}", 3, "quadrature-d"),
    ("radiance, flux, irradiance, radiosity with units", r"W/\(m² sr\)", 4, "rendering-equation"),
    ("rendering equation", r"L_e\(x, \\omega\) \+ \\int", 4, "rendering-equation"),
    ("area form with G and V", r"V\(x, x′\) G\(x, x′\) dA", 4, "rendering-equation"),
    ("view-dependent and view-independent", r"View-independent", 4, "rendering-equation"),
    ("sampling strategies", r"p_\\omega = p_A", 5, "strategies"),
    ("balance, power, maximum, cutoff", r"balance:.*power:.*maximum:.*cutoff:", 6, "mis-gamma"),
    ("optimal weights", r"optimal weights", 6, "optimal-mis"),
    ("an estimator without a variance", r"= \\infty", 7, "infinite-variance"),
    ("efficiency", r"\\frac\{1\}\{V \\cdot T\}", 8, "roulette-efficiency"),
    ("roulette", r"\\frac\{E\[F\^2\]\}\{q\}", 8, "rr-threshold"),
    ("splitting", r"copies", 8, "splitting"),
    ("V = E V + V E", r"V\[ E\[F \| x\] \] \+ E\[ V\[F \| x\] \]", 9, "expected-values"),
    ("control variates", r"control variate", 9, "control-variate"),
    ("regression", r"regression", 9, "regression"),
    ("antithetic pairs", r"antithetic", 9, "antithetic"),
    ("discrepancy, Koksma and Hlawka", r"Koksma, Hlawka", 10, "discrepancy"),
    ("why QMC beats n^(-1/2)", r"beyond \} n\^\{-1/2\}", 10, "discrepancy"),
    ("samplers", r"orthogonal arrays", 10, "samplers-2d"),
    ("samplers in four dimensions", r"four dimensions", 10, "samplers-4d"),
    ("why RIS is unbiased", r"E\[F \| x_1, \.\.\., x_M\]", 11, "ris-m"),
    ("what M does", r"As M grows", 11, "ris-m"),
    ("w / sum w and the telescoping product", r"telescopes", 11, "reservoir-chi2"),
    ("merging of reservoirs", r"merging:", 11, "reservoir-merge"),
    ("spatial and temporal reuse", r"pixels and frames", 11, "restir-1d"),
    ("path integral, strategies (s, t)", r"p_\{s,t\}", 12, "path-integral"),
    ("detailed balance", r"detailed balance", 13, "metropolis"),
    ("acceptance and mixing", r"`acceptance` and `jump`.*\*mixing\*", 13, "metropolis"),
    ("mutations and start-up bias", r"mutations.*start-up bias", 13, "metropolis"),
    ("density estimation, bias and radius", r"b \\sim r\^2", 14, "density-estimation"),
    ("progressive radius", r"progressive", 14, "ppm-1d"),
    ("irradiance gradients", r"\\nabla E_i", 15, "irradiance-cache"),
    ("stopping", r"n_A \\text\{ depends", 16, "stopping-bias"),
]
# Numbers in the text: chapter, its words with a group for each number, and the numbers from runs of
# the laboratory (seed 0, as the text states) or from a closed form.
FIGURES = [
    (1, r"Their σ are ([0-9.]+) and ([0-9.]+)\.",
     lambda lab: (math.sqrt(math.pi * (4 - math.pi)), math.sqrt(32 / 3 - math.pi**2))),
    (1, r"\(([0-9.]+) / ([0-9.]+)\)² = ([0-9.]+) times",
     lambda lab: (math.sqrt(math.pi * (4 - math.pi)), math.sqrt(32 / 3 - math.pi**2),
                  math.pi * (4 - math.pi) / (32 / 3 - math.pi**2))),
    (3, r"the midpoint rule is off by ([0-9.]+), Monte Carlo by ([0-9.]+):",
     lambda lab: (lab("quadrature-d", "midpoint", n=None, dimensions=6).error(),
                  lab("quadrature-d", "monte-carlo", n=65536, dimensions=6).error())),
    (5, r"have (a thousandth) of the error of uniform directions",
     lambda lab: (lab("strategies", "area", side=0.2).error()
                  / lab("strategies", "uniform", side=0.2).error(),)),
    (6, r"has (a tenth) of the error of the balance heuristic",
     lambda lab: (lab("mis-gamma", "power", side=0.2).error()
                  / lab("mis-gamma", "balance", side=0.2).error(),)),
    (6, r"put the mean off by about ([0-9.]+%) at n = 4",
     lambda lab: (abs(lab("optimal-mis", "same-samples", n=4, replicates=4096).bias()),)),
    (7, r"is −([0-9.]+) at a = 0\.6",
     lambda lab: (-lab("infinite-variance", "median-of-means",
                       n=(16, 64)).outcome["expected_slope"],)),
    (7, r"= ([0-9]+) times as many", lambda lab: (10 ** (1 / 0.4),)),
    (8, r"in `rr-threshold` \(([0-9.]+) against ([0-9.]+)\).* wins \(([0-9.]+)\)",
     lambda lab: tuple(lab("rr-threshold", each, n=None).efficiency()
                       for each in ("throughput", "none", "threshold"))),
    (8, r"at s\* \(([0-9.]+); ([0-9.]+) without splitting, ([0-9.]+) with 64 copies\)",
     lambda lab: (lab("splitting", "optimal", n=None).efficiency(),
                  lab("splitting", "none", n=None).efficiency(),
                  lab("splitting", "fixed", n=None, copies=64).efficiency())),
    (8, r"\) above ([0-9.]+) splits", lambda lab: (1 / 0.9,)),
    (9, r"the error: ([0-9.]+), ([0-9.]+) and ([0-9.]+) at 16384 samples",
     lambda lab: tuple(lab("expected-values", each).error()
                       for each in ("analog", "absorption", "next-event"))),
    (9, r"(an eighth) with a fifth hidden",
     lambda lab: (lab("control-variate", "control-variate").error()
                  / lab("control-variate", "plain").error(),)),
    (9, r"and (eight times) the error with four fifths hidden",
     lambda lab: (lab("control-variate", "control-variate", hidden=0.8).error()
                  / lab("control-variate", "plain", hidden=0.8).error(),)),
    (9, r"\[([0-9.]+%) too low\]",
     lambda lab: (-lab("regression", "same-samples", n=8, replicates=4096, integrand=1).bias(),)),
    (9, r"Antithetic pairs of e\^u have (a fifth) of the error",
     lambda lab: (lab("antithetic", "pairs").error() / lab("antithetic", "plain").error(),)),
    (9, r"those of an even function (twice) the variance",
     lambda lab: ((lab("antithetic", "pairs", integrand=1).error()
                   / lab("antithetic", "plain", integrand=1).error()) ** 2,)),
    # V[e^u] over the variance of the pairs for the same number of values.
    (9, r"That of independent samples, ([0-9]+) times",
     lambda lab: (VAR_EXP / (VAR_EXP + math.e - (math.e - 1) ** 2),)),
    (11, r"the error falls from ([0-9.]+) to ([0-9.]+) to ([0-9.]+),",
     lambda lab: tuple(lab("ris-m", "ris", candidates=each).error() for each in (1, 8, 64))),
    (11, r"its mean is off by ([0-9.]+%)", lambda lab: (abs(lab("ris-m", "blind").bias()),)),
    (11, r"`biased` in `restir-1d` with ([0-9.]+%)",
     lambda lab: (abs(lab("restir-1d", "biased", n=4096).bias()),)),
    (12, r"the sum is exactly (four times) too large",
     lambda lab: (1 + lab("path-integral", "unweighted").bias(),)),
    (13, r"its mean is (2/3) in place of (3/4)",
     lambda lab: (lab("metropolis", "no-balance").mean(),
                  lab("metropolis", "no-balance").outcome["expected"])),
    (16, r"`standard-error` ([0-9.]+), `half-metric` ([0-9.]+), `pilot-reused` ([0-9.]+),",
     lambda lab: tuple(lab("stopping-bias", each, n=1024).mean()
                       for each in ("standard-error", "half-metric", "pilot-reused"))),
]  # fmt: skip
VAR_EXP = (math.e**2 - 1) / 2 - (math.e - 1) ** 2
# Numbers in words: value, and half a unit of their last digit.
WORDED = {"a thousandth": (1e-3, 5e-4), "a tenth": (0.1, 0.05), "an eighth": (1 / 8, 1 / 16),
          "a fifth": (0.2, 0.1), "twice": (2, 0.5), "four times": (4, 0.5),
          "eight times": (8, 0.5), "2/3": (2 / 3, 0.005), "3/4": (3 / 4, 0.005)}  # fmt: skip
# Numbers that nobody measures: a parameter, a nominal level.
GIVEN = {"0.2", "0.4", "0.6", "5%", "2%", "95%"}
PARTS = ("**What is estimated.**", "```math", "**Run**", "**Look at:**", "*Question:*",
         "<summary>Answer</summary>", "**In a job:**", "```pair")


def chapters():
    """The text of each chapter by its number."""
    parts = re.split(r"^## Chapter (\d+): ", COURSE.read_text(encoding="utf-8"), flags=re.M)
    texts = {int(number): text for number, text in zip(parts[1::2], parts[2::2])}
    texts[max(texts)] = texts[max(texts)].split("\n## ")[0]
    return texts


class Run:
    """The last point of a finished run, and its outcome."""

    def __init__(self, lines):
        self.point, self.outcome = lines[-2:]

    def mean(self):
        return self.point["mean"]

    def error(self):
        return self.point["rmse"]

    def bias(self):
        return self.mean() / self.outcome["expected"] - 1

    def efficiency(self):
        return self.outcome["efficiency_by_cost"]


def rounded(text):
    """The value that a text states, and half a unit of its last digit."""
    if text in WORDED:
        return WORDED[text]
    digits = text.rstrip("%").rstrip(".")
    share = 100 if text.endswith("%") else 1
    decimals = len(digits.partition(".")[2])
    return float(digits) / share, 0.5 * 10.0**-decimals / share


def disagreements(texts, lab):
    """Numbers of these chapters that are not those of the runs, rounded."""
    wrong = []
    for number, words, measure in FIGURES:
        if number not in texts:
            continue
        found = re.search(words, texts[number], re.S)
        if found is None:
            wrong.append(f"chapter {number} does not say {words}")
            continue
        for text, value in zip(found.groups(), measure(lab)):
            stated, slack = rounded(text)
            if abs(value - stated) > slack * (1 + 1e-9):
                wrong.append(f"chapter {number}: {text} is {value:.4g}: {found[0]}")
    return wrong


class CourseTest(ApiTest):
    def laboratory(self):
        """Runs an experiment once."""
        runs = {}

        def lab(experiment, estimator, n=16384, replicates=None, **params):
            body = {"experiment": experiment, "estimator": estimator, "params": params}
            if n:  # Else all that are usual.
                body["n"] = n if isinstance(n, tuple) else [n]
            if replicates:
                body["replicates"] = replicates
            key = json.dumps(body)
            if key not in runs:
                answer = self.server.request("POST", "/v1/lab/runs", body, timeout=300)
                self.assertEqual(answer.status, 200, answer)
                runs[key] = Run([json.loads(line) for line in answer.body.splitlines()])
            return runs[key]

        return lab

    def test_every_number_that_the_text_measured_is_that_of_a_run(self):
        lab, texts = self.laboratory(), chapters()
        self.assertEqual(disagreements(texts, lab), [])
        # Another digit anywhere would be noticed.
        for number, words, _ in FIGURES:
            found = re.search(words, texts[number], re.S)
            for group, text in enumerate(found.groups(), 1):
                if text in WORDED:
                    continue
                digit = found.end(group) - (2 if text.endswith("%") else 1)
                other = str((int(texts[number][digit]) + 5) % 10)
                changed = texts[number][:digit] + other + texts[number][digit + 1 :]
                self.assertTrue(disagreements({number: changed}, lab), (number, text))

    def test_no_other_number_is_stated_as_measured(self):
        for number, text in chapters().items():
            covered = set()
            for chapter, words, _ in FIGURES:
                if chapter == number:
                    found = re.search(words, text, re.S)
                    covered |= {found.start(i + 1) for i in range(len(found.groups()))}
            for place in re.finditer(r"(?<![\d.=])\d+\.\d+|\b\d+%", text.split("**In a job:**")[0]):
                line = text[: place.start()].rpartition("\n")[2]
                is_reference = re.search(r"(\(#|PBR|Veach)[^)]*$", line)
                if place[0] in GIVEN or is_reference:
                    continue
                self.assertIn(place.start(), covered, f"chapter {number}: {place[0]} in {line}")

    def test_every_topic_has_its_chapter_and_experiment(self):
        texts = chapters()
        for topic, words, number, experiment in TOPICS:
            self.assertRegex(texts[number], re.compile(words, re.S), topic)
            self.assertIn(f"(#/lab/{experiment}?", texts[number], topic)
        # A topic that no chapter has is noticed.
        self.assertNotRegex("".join(texts.values()), r"radiosity matrix")

    def test_topics_cover_every_experiment(self):
        listed = {e["name"] for e in self.server.get("/v1/server").json()["experiments"]}
        self.assertEqual({experiment for *_, experiment in TOPICS}, listed)

    def test_every_chapter_has_all_parts_in_order_and_at_most_ten_formulas(self):
        texts = chapters()
        self.assertEqual(sorted(texts), list(range(1, 17)))
        for number, text in texts.items():
            places = [text.find(part) for part in PARTS]
            self.assertGreaterEqual(min(places), 0, (number, PARTS[places.index(min(places))]))
            self.assertEqual(places, sorted(places), number)
            formulas = re.search(r"```math\n(.*?)\n```", text, re.S).group(1)
            self.assertLessEqual(len(formulas.splitlines()), 10, number)

    def test_every_link_to_the_laboratory_fills_the_form(self):
        listed = {e["name"]: e for e in self.server.get("/v1/server").json()["experiments"]}
        links = re.findall(r"\(#/lab/([^?)]+)\?([^)]*)\)", COURSE.read_text(encoding="utf-8"))
        self.assertGreater(len(links), 40)
        for name, query in links:
            experiment = listed[name]
            params = {p["name"]: p for p in experiment["params"]}
            for key, value in urllib.parse.parse_qsl(query):
                if key == "estimator":
                    self.assertIn(value, [e["name"] for e in experiment["estimators"]], name)
                elif key == "sampler":
                    self.assertIn(value, experiment["samplers"], name)
                elif key == "run":
                    self.assertIn(value, ("1", "all"), name)
                elif key != "replicates":
                    self.assertTrue(
                        params[key]["min"] <= float(value) <= params[key]["max"], (name, key)
                    )

    def test_every_pair_is_two_different_jobs_that_the_server_accepts(self):
        for number, text in chapters().items():
            pair = json.loads(re.search(r"```pair\n(.*?)\n```", text, re.S).group(1))
            self.assertEqual(len(pair["jobs"]), 2, number)
            first, second = pair["jobs"]
            self.assertEqual(first["film"], second["film"], "they are compared pixel by pixel")
            self.assertNotEqual({**first, "name": ""}, {**second, "name": ""}, number)
            for job in pair["jobs"]:
                answer = self.server.post("/v1/jobs", job)
                self.assertEqual(answer.status, 201, (number, answer))
                self.server.post(f"/v1/jobs/{answer.json()['id']}/cancel", {})
