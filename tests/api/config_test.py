"""The configuration: the order of its sources, and the printed form."""

import os
import tempfile
import unittest

from harness import tessera


class Configuration(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = os.path.join(folder.name, "tessera.conf")

    def write(self, text):
        with open(self.file, "w", encoding="utf-8") as file:
            file.write(text)

    def printed(self, *flags, **variables):
        code, said, complaints = tessera("serve", "--print-config", *flags, environ=variables)
        self.assertEqual(code, 0, complaints)
        return dict(line.split(" = ", 1) for line in said.splitlines() if " = " in line)

    def test_flag_overrides_variable_overrides_file(self):
        self.write("# a comment\n\nport = 1\nmax-queue=2\n  grace = 3 \ndemo = true\n")
        found = self.printed(
            "--config", self.file, "--port", "11", TESSERA_PORT="12", TESSERA_MAX_QUEUE="13"
        )
        self.assertEqual((found["port"], found["max-queue"], found["grace"], found["demo"]),
                         ("11", "13", "3", "true"))
        self.assertEqual(self.printed(TESSERA_CONFIG=self.file)["port"], "1")

    def test_printed_configuration_can_be_read(self):
        first = self.printed(
            "--port", "7", "--hosts", "a,b", "--disk-limit", "50%", "--isa", "avx2"
        )
        self.write("".join(f"{name} = {value}\n" for name, value in first.items()))
        self.assertEqual(self.printed("--config", self.file), first)

    def test_hides_secrets(self):
        code, said, _ = tessera("serve", "--print-config", "--key", "a-key-of-mine",
                                "--webhook-secret", "whsec_of-mine")
        self.assertEqual(code, 0)
        self.assertNotIn("of-mine", said)

    def test_reports_a_wrong_line(self):
        for text, words in (
            ("port = x\n", "line 1"),
            ("\ncolour = red\n", "line 2"),
            ("port\n", "line 1"),
            ("config = x\n", "line 1"),
        ):
            self.write(text)
            code, _, complaints = tessera("serve", "--config", self.file)
            self.assertEqual(code, 2, text)
            self.assertIn(words, complaints)
        self.assertEqual(tessera("serve", "--config", self.file + ".none")[0], 2)
