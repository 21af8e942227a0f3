"""Warnings about options without effect, and reports of measured values."""

from harness import ApiTest, job_body


class Options(ApiTest):
    def warnings(self, samples=8, **members):
        answer = self.server.post("/v1/jobs?dry_run=1", job_body(samples=samples, **members))
        self.assertEqual(answer.status, 200, answer)
        return [w for w in answer.json()["warnings"] if not w.startswith("No environment")]

    def test_warns_about_options_without_effect(self):
        for strategy in ("bsdf", "cosine", "uniform"):
            estimator = {"strategy": strategy}
            self.assertEqual(self.warnings(estimator=estimator), [])
            for sampler in ("uniform", "power", "ris"):
                told = self.warnings(estimator=estimator, light_sampler={"type": sampler})
                self.assertEqual(len(told), 1)
                self.assertTrue(
                    told[0].startswith(
                        f"light_sampler: '{sampler}' has no effect: strategy '{strategy}'"
                    ),
                    told,
                )
            told = self.warnings(
                estimator={"strategy": strategy, "roulette": {"type": "threshold"}}
            )
            self.assertTrue(told and told[0].startswith("estimator.roulette: 'threshold'"), told)
        for strategy in ("mis", "light"):
            self.assertEqual(
                self.warnings(
                    estimator={"strategy": strategy, "roulette": {"type": "threshold"}},
                    light_sampler={"type": "power"},
                ),
                [],
            )

    def test_regression_that_learns_nothing_warns(self):
        regression = {"control_variate": {"type": "regression"}}
        for replicates, samples, idle in (
            (2, 8, True),
            (2, 10, False),
            (4, 16, True),
            (4, 20, False),
        ):
            options = {"sampler": {"replicates": replicates}, "samples": samples}
            told = self.warnings(estimator=regression, **options)
            self.assertEqual(len(told), 1 if idle else 0, told)
            with_it = self.server.render(job_body(estimator=regression, **options))
            # Traces every shadow ray: equal to the defaults, but through the code for options.
            threshold = {"roulette": {"type": "threshold", "delta": 0}}
            plain = self.server.render(job_body(estimator=threshold, **options))
            self.assertEqual(with_it["film_digest"] == plain["film_digest"], idle, options)

    def test_reports_the_measured_split(self):
        job = self.server.render(
            job_body(scene="furnace", estimator={"splitting": {"type": "measured"}})
        )
        count = job["statistics"]["split_count"]
        self.assertGreaterEqual(count, 1)
        fixed = job_body(
            scene="furnace", estimator={"splitting": {"type": "fixed", "count": count}}
        )
        same = self.server.render(fixed)
        self.assertEqual(same["film_digest"], job["film_digest"])
        self.assertIsNone(same["statistics"]["split_count"])
        self.server.stop()
        self.server.start()
        self.assertEqual(self.server.job(job["id"])["statistics"]["split_count"], count)

    def test_unknown_field_of_an_empty_object_lists_no_names(self):
        experiments = self.server.get("/v1/server").json()["experiments"]
        plain = next(e for e in experiments if not e["params"])
        answer = self.server.post("/v1/lab/runs", {"experiment": plain["name"], "params": {"x": 1}})
        problem = self.assert_problem(answer, 422, "/params/x")
        detail = problem["errors"][0]["detail"]
        self.assertEqual(detail, "Unknown field; no fields are allowed here")
