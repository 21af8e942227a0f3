"""The laboratory course: each topic has a chapter and an experiment, links and jobs are valid."""

import json
import pathlib
import re
import unittest
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
    ("mutations and start-up bias", r"mutations.*start-up bias", 13, "metropolis"),
    ("density estimation, bias and radius", r"b \\sim r\^2", 14, "density-estimation"),
    ("progressive radius", r"progressive", 14, "ppm-1d"),
    ("irradiance gradients", r"\\nabla E_i", 15, "irradiance-cache"),
    ("stopping", r"n_A \\text\{ depends", 16, "stopping-bias"),
]
PARTS = ("**What is estimated.**", "```math", "**Run**", "**Look at:**", "*Question:*",
         "<summary>Answer</summary>", "**In a job:**", "```pair")


def chapters():
    """The text of each chapter by its number."""
    parts = re.split(r"^## Chapter (\d+): ", COURSE.read_text(encoding="utf-8"), flags=re.M)
    texts = {int(number): text for number, text in zip(parts[1::2], parts[2::2])}
    texts[max(texts)] = texts[max(texts)].split("\n## ")[0]
    return texts


class CourseTest(ApiTest):
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


if __name__ == "__main__":
    unittest.main()
