"""`tessera lab`: the same experiments on the command line, and the files it writes."""

import csv
import io
import json
import math
import os
import tempfile
import xml.etree.ElementTree as xml

from harness import ApiTest, tessera

SVG = "{http://www.w3.org/2000/svg}"
TIMES = ("seconds", "efficiency")


def lab(*arguments):
    code, out, said = tessera("lab", *arguments)
    if code != 0:
        raise AssertionError(f"{arguments}: {code} {said}")
    return out


class LabCommand(ApiTest):
    def test_lists_the_experiments_of_the_service(self):
        served = self.server.get("/v1/server").json()["experiments"]
        self.assertEqual(
            [line.split()[0] for line in lab().splitlines()], [e["name"] for e in served]
        )
        self.assertEqual(json.loads(lab("--json")), served)
        for experiment in served[::5]:
            told = lab(experiment["name"], "--explain")
            for text in (
                experiment["title"],
                experiment["formula"],
                experiment["look_for"],
                *(e["summary"] for e in experiment["estimators"]),
                *experiment["samplers"],
            ):
                self.assertIn(text, told)

    def test_prints_the_lines_of_the_service_for_any_number_of_threads(self):
        body = {
            "experiment": "strategies",
            "estimator": "mis",
            "sampler": "sobol",
            "n": [16, 64, 256],
            "replicates": 8,
            "seed": 5,
            "params": {"side": 4},
        }
        flags = ("strategies", "--estimator", "mis", "--sampler", "sobol", "--n", "16,64,256",
                 "--replicates", "8", "--seed", "5", "--param", "side=4", "--json")

        def stable(text):
            return [
                {k: v for k, v in json.loads(line).items() if k not in TIMES}
                for line in text.splitlines()
            ]
        served = stable(self.server.post("/v1/lab/runs", body).body.decode())
        for threads in ("1", "3"):
            self.assertEqual(stable(lab(*flags, "--threads", threads)), served)

    def test_writes_csv_and_svg(self):
        with tempfile.TemporaryDirectory() as folder:
            table, drawing = os.path.join(folder, "a.csv"), os.path.join(folder, "a.svg")
            shown = lab(
                "samplers-2d", "--n", "16,64", "--replicates", "8", "--csv", table, "--svg", drawing
            )
            self.assertIn("verdict", shown)
            with open(table, encoding="utf-8", newline="") as file:
                rows = list(csv.DictReader(file))
            self.assertEqual([row["n"] for row in rows], ["16", "64"])
            for row in rows:
                self.assertAlmostEqual(
                    float(row["mean"]), 1, delta=6 * float(row["standard_error"])
                )
            root = xml.parse(drawing).getroot()
            self.assertEqual(root.tag, SVG + "svg")
            self.assertEqual(len(root.findall(SVG + "circle")), 2)
            kinds = {path.get("class") for path in root.iter(SVG + "path")}
            self.assertLessEqual({"fitted", "expected", "points"}, kinds)
        printed = lab("pi", "--n", "16,64", "--replicates", "8", "--csv", "-")
        self.assertEqual(len(list(csv.DictReader(io.StringIO(printed)))), 2)
        self.assertEqual(xml.fromstring(lab("--n", "16", "pi", "--svg", "-")).tag, SVG + "svg")

    def test_table_has_a_row_for_each_n_and_the_expected_value(self):
        rows = lab("pi", "--n", "16,64", "--replicates", "8").splitlines()
        self.assertEqual([row.split()[0] for row in rows[1:3]], ["16", "64"])
        expected = next(row for row in rows if row.startswith("expected  "))
        self.assertAlmostEqual(float(expected.split()[1]), math.pi, places=8)

    def test_wrong_usage_is_2_and_names_the_argument(self):
        for arguments, told in (
            (("nothing",), "/experiment"),
            (("nothing", "--explain"), "/experiment"),
            (("pi", "--sampler", "x"), "/sampler"),
            (("pi", "--n", "0"), "/n/0"),
            (("pi", "--n", "100000000"), "/n"),
            (("pi", "--replicates", "1"), "/replicates"),
            (("strategies", "--param", "side=0"), "/params/side"),
            (("strategies", "--param", "side"), "NAME=NUMBER"),
            (("pi", "--colour"), "--colour"),
            (("pi", "--threads", "0"), "--threads"),
            (("--explain",), "which experiment"),
            (("--seed", "1"), "which experiment"),
            (("pi", "--json", "--csv", "-"), "stdout"),
        ):
            code, out, said = tessera("lab", *arguments)
            self.assertEqual((code, out), (2, ""), arguments)
            self.assertIn(told, said, arguments)

    def test_unwritable_file_is_1(self):
        code, _, said = tessera(
            "lab", "pi", "--n", "4", "--replicates", "2", "--csv", "/nowhere/a.csv"
        )
        self.assertEqual(code, 1)
        self.assertIn("/nowhere/a.csv", said)
