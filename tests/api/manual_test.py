"""Shell completions and the manual page: everything in --help, read by the shells themselves."""

import os
import pty
import re
import select
import subprocess
import tempfile
import time

from harness import BINARY, PATIENCE_S, ApiTest, job_body

PROGRAM = os.path.abspath(BINARY)
HERE = {**os.environ, "PATH": os.path.dirname(PROGRAM) + ":" + os.environ["PATH"]}


def tessera(*args):
    done = subprocess.run([PROGRAM, *args], capture_output=True, text=True, timeout=PATIENCE_S)
    if done.returncode != 0 or done.stderr:
        raise AssertionError(f"{args}: {done}")
    return done.stdout


def run(command, text=None, **environ):
    done = subprocess.run(command, input=text, capture_output=True, text=True, timeout=PATIENCE_S,
                          env={**HERE, **environ})
    if done.returncode != 0 or done.stderr:
        raise AssertionError(f"{command}: {done}")
    return done.stdout


class Program(ApiTest):
    def test_client_verbs_load_neither_the_renderer_nor_its_image_library(self):
        needed = run(["ldd", PROGRAM])
        self.assertIn("libpng", needed)  # `watch --picture` reads images with it
        for library in ("OpenImageIO", "embree", "tbb", "draco", "sqlite"):
            self.assertNotIn(library, needed)


class Manual(ApiTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.verbs = re.findall(r"^  ([a-z]+) ", tessera("--help"), re.M)
        cls.flags = {
            verb: set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", cls.heads(tessera(verb, "--help"))))
            for verb in cls.verbs
        }
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.files = {}
        for shell in ("bash", "zsh", "fish"):
            cls.files[shell] = os.path.join(folder.name, "tessera." + shell)
            with open(cls.files[shell], "w", encoding="utf-8") as file:
                file.write(tessera("completion", shell))
        cls.page = tessera("man")

    @staticmethod
    def heads(text):
        """The first column of a help text."""
        return "\n".join(re.findall(r"^ +(-.*?)(?:  |$)", text, re.M))

    def bash(self, *words, **environ):
        """The completions that bash offers for the last of the words."""
        script = ('source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); '
                  '_tessera; printf "%s\\n" "${COMPREPLY[@]}"')
        return run(["bash", "-c", script, "bash", self.files["bash"], "tessera", *words],
                   **environ).split()

    def fish(self, line, **environ):
        told = run(["fish", "--no-config", "-c", 'source $argv[1]; complete -C $argv[2]',
                    self.files["fish"], line], HOME=os.path.dirname(self.files["fish"]), **environ)
        return [row.split("\t")[0] for row in told.splitlines()]

    def test_finds_verbs_and_flags(self):
        self.assertLessEqual(
            {"serve", "render", "submit", "watch", "man", "completion"}, set(self.verbs)
        )
        for verb in self.verbs:
            self.assertIn(
                "--help", self.flags[verb] | ({"--help"} if verb == "serve" else set()), verb
            )
        self.assertIn("--relative-error", self.flags["submit"])
        self.assertIn("--disk-limit", self.flags["serve"])

    def test_page_has_every_verb_with_every_flag(self):
        sections = dict(re.findall(r"^\.SS tessera ([a-z]+)[^\n]*\n(.*?)(?=^\.S[SH])", self.page,
                                   re.S | re.M))
        self.assertEqual(list(sections), self.verbs)
        for verb, flags in self.flags.items():
            for flag in flags:
                self.assertIn(flag.replace("-", "\\-") + "\\fR", sections[verb], verb)
        for variable in ("TESSERA_SERVER", "TESSERA_KEY", "TESSERA_DATA"):
            self.assertIn(variable, self.page.split(".SH ENVIRONMENT")[1])

    def test_page_has_a_date_and_the_version(self):
        version = tessera("--version").split()[1]
        title = f'.TH TESSERA 1 "DATE" "Tessera {version}"'
        self.assertRegex(self.page.splitlines()[0],
                         "^" + re.escape(title).replace("DATE", r"\d{4}-\d\d-\d\d") + "$")

    def test_page_has_no_formatting_errors(self):
        run(["groff", "-man", "-ww", "-Tutf8", "-z"], self.page)
        with self.assertRaises(AssertionError):
            run(["groff", "-man", "-ww", "-Tutf8", "-z"], self.page + ".SS\n.no-such-macro\n")
        shown = run(["groff", "-man", "-Tascii", "-P-cbou"], self.page)
        self.assertRegex(shown, r"--relative-error E\n +Stop when the relative error")

    def test_bash_offers_every_verb_and_flag(self):
        self.assertEqual(self.bash(""), [*self.verbs, "--help", "--version"])
        self.assertEqual(self.bash("su"), ["submit"])
        for verb, flags in self.flags.items():
            self.assertLessEqual(flags, set(self.bash(verb, "--")), verb)
        self.assertEqual(self.bash("submit", "--rel"), ["--relative-error"])
        self.assertEqual(self.bash("submit", "--spp", ""), [], "the user types a number")

    def test_bash_offers_files_for_file_arguments(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("chair.glb", "chess.zip"):
                open(os.path.join(folder, name), "w", encoding="utf-8").close()
            os.mkdir(os.path.join(folder, "chambers"))
            head = os.path.join(folder, "ch")
            self.assertEqual(len(self.bash("submit", head)), 3)
            self.assertEqual(
                self.bash("submit", "box", "--environment", head + "e"), [head + "ess.zip"]
            )
            self.assertEqual(
                self.bash("submit", "box", "-o", "=", head + "air"), [head + "air.glb"]
            )
            self.assertEqual(self.bash("serve", "--data", head), [head + "ambers"])

    def test_offers_jobs_by_their_ids(self):
        ids = [self.server.render(job_body())["id"] for _ in range(2)]
        server = {"TESSERA_SERVER": f"http://127.0.0.1:{self.server.port}"}
        self.assertEqual(self.bash("watch", "", **server)[:3], ["latest", ids[1], ids[0]])
        self.assertEqual(self.bash("cancel", ids[0][:10], **server), [ids[0]])
        self.assertLessEqual(set(ids), set(self.fish("tessera fetch ", **server)))
        self.assertEqual(self.bash("watch", "", TESSERA_SERVER="http://127.0.0.1:9"), ["latest"])

    def test_offers_both_jobs_and_files_where_both_are_accepted(self):
        job = self.server.render(job_body())["id"]
        server = {"TESSERA_SERVER": f"http://127.0.0.1:{self.server.port}"}
        with tempfile.TemporaryDirectory() as folder:
            film = os.path.join(folder, "part.film")
            open(film, "w", encoding="utf-8").close()
            for verb in ("merge", "compare"):
                self.assertIn(job, self.bash(verb, "", **server))
                self.assertEqual(self.bash(verb, os.path.join(folder, "p"), **server), [film])
                offered = self.fish(f"tessera {verb} ", **server)
                self.assertIn(job, offered)
                self.assertIn(film, self.fish(f"tessera {verb} {folder}/", **server))
            self.assertIn(film, self.typed_in_zsh(f"tessera merge {folder}/pa\t", film))

    def test_offers_built_in_scenes_by_their_names(self):
        names = [scene["name"] for scene in self.server.get("/v1/server").json()["scenes"]]
        listed = tessera("render", "--scenes").splitlines()
        self.assertEqual([line.split()[0] for line in listed], names)
        for verb in ("render", "submit"):
            self.assertLessEqual(set(names), set(self.bash(verb, "")))
            self.assertEqual(self.bash(verb, "corn"), ["cornell-box"])
            self.assertIn("cornell-box", self.fish(f"tessera {verb} corn"))
        self.assertIn(
            "tessera render cornell-box ",
            self.typed_in_zsh("tessera render corn\t", "cornell-box "),
        )

    def test_offers_shells(self):
        self.assertEqual(self.bash("completion", ""), ["bash", "zsh", "fish"])
        self.assertEqual(self.fish("tessera completion z"), ["zsh"])

    def test_offers_enumerations_by_their_names(self):
        server = self.server.get("/v1/server").json()
        types = {
            "--integrator": "integrators",
            "--sampler": "samplers",
            "--light-sampler": "light_samplers",
            "--adaptive": "adaptive",
        }
        for flag, table in types.items():
            names = [row["type"] for row in server[table]]
            for verb in ("render", "submit"):
                self.assertEqual(self.bash(verb, "cornell-box", flag, ""), names)
                self.assertEqual(
                    sorted(self.fish(f"tessera {verb} cornell-box {flag} ")), sorted(names)
                )
        for flag in ("--mis", "--roulette", "--control-variate"):
            self.assertIn("none" if flag != "--mis" else "balance", self.bash("submit", flag, ""))
        layers = server["layers"] + server["optional_layers"]
        self.assertEqual(sorted(self.bash("fetch", "--layer", "")), sorted(layers))
        self.assertEqual(self.bash("fetch", "--tonemap", ""), server["tone_maps"])
        self.assertEqual(self.bash("jobs", "--state", "q"), ["queued"])
        self.assertEqual(self.bash("jobs", "--state", "c"), ["cancelled"])
        estimators = {each["name"] for row in server["experiments"] for each in row["estimators"]}
        self.assertEqual(set(self.bash("lab", "pi", "--estimator", "")), estimators)
        self.assertLessEqual(
            set(self.bash("lab", "--sampler", "")), {row["type"] for row in server["samplers"]}
        )
        self.assertEqual(self.bash("keys", ""), ["add", "list", "remove"])
        self.assertEqual(sorted(self.fish("tessera keys ")), ["add", "list", "remove"])
        expected = "tessera submit --light-sampler restir "
        self.assertIn(
            expected, self.typed_in_zsh("tessera submit --light-sampler rest\t", expected)
        )
        self.assertIn(
            "tessera keys remove ", self.typed_in_zsh("tessera keys rem\t", "tessera keys remove ")
        )

    def test_offers_experiments_by_their_names(self):
        names = [e["name"] for e in self.server.get("/v1/server").json()["experiments"]]
        self.assertEqual(self.bash("lab", ""), names)
        self.assertEqual(self.bash("lab", "rest"), ["restir-1d"])
        self.assertLessEqual(set(names), set(self.fish("tessera lab ")))
        self.assertIn(
            "tessera lab restir-1d ",
            self.typed_in_zsh("tessera lab rest\t", "tessera lab restir-1d "),
        )

    def test_fish_offers_every_verb_and_flag(self):
        self.assertLessEqual(set(self.verbs), set(self.fish("tessera ")))
        self.assertEqual(self.fish("tessera su"), ["submit"])
        for verb, flags in self.flags.items():
            self.assertLessEqual(flags, set(self.fish(f"tessera {verb} --")), verb)

    def test_zsh_completes_verbs_and_flags(self):
        script = open(self.files["zsh"], encoding="utf-8").read()
        for verb, flags in self.flags.items():
            part = script.split(f"\n    {verb})\n")[1].split(";;")[0]
            for flag in flags:
                self.assertIn(flag + "[", part, verb)
        for typed, expected in (("tessera heal\t", "tessera health "),
                                ("tessera submit --rel\t", "tessera submit --relative-error ")):
            self.assertIn(expected, self.typed_in_zsh(typed, expected))

    def typed_in_zsh(self, keys, expected):
        """Returns the terminal's output after the keys, up to `expected`."""
        begin = f"autoload -U compinit; compinit -u -D; source {self.files['zsh']}; PS1='ready> '\n"
        child, terminal = pty.fork()
        if child == 0:
            os.environ.update(HERE, TERM="dumb")
            os.execvp("zsh", ["zsh", "-f", "-i"])
        shown, deadline = "", time.monotonic() + PATIENCE_S
        try:
            os.write(terminal, begin.encode())
            steps = ["ready> ", expected]
            while steps and time.monotonic() < deadline:
                if select.select([terminal], [], [], 1)[0]:
                    shown += os.read(terminal, 4096).decode(errors="replace")
                if steps[0] in re.sub(r"PS1='ready> '", "", shown):
                    steps.pop(0)
                    if steps:
                        shown = ""
                        os.write(terminal, keys.encode())
        finally:
            os.close(terminal)
            os.waitpid(child, 0)
        return shown

    def test_help_of_a_verb_works_in_both_forms(self):
        for verb in ("watch", "lab", "serve"):
            self.assertEqual(tessera("help", verb), tessera(verb, "--help"))

    def test_unknown_verb_is_reported_with_a_suggestion(self):
        for word, near in (("wach", "watch"), ("rendr", "render"), ("qqqq", None)):
            for args in ((word,), ("help", word)):
                done = subprocess.run(
                    [PROGRAM, *args], capture_output=True, text=True, timeout=PATIENCE_S
                )
                self.assertEqual(
                    (done.returncode, done.stdout, done.stderr.count("\n")), (2, "", 1)
                )
                self.assertIn(f'unknown command "{word}"', done.stderr)
                self.assertEqual("did you mean" in done.stderr, near is not None)
                self.assertIn(near or "--help", done.stderr)

    def test_does_not_write_an_image_to_a_terminal(self):
        job = self.server.render(job_body())["id"]
        child, terminal = pty.fork()
        if child == 0:
            os.environ["TESSERA_SERVER"] = f"http://127.0.0.1:{self.server.port}"
            os.execv(PROGRAM, [PROGRAM, "fetch", job, "-o", "-"])
        shown = b""
        try:
            while piece := os.read(terminal, 4096):
                shown += piece
        except OSError:  # Linux reports this way that the other end is closed
            pass
        finally:
            os.close(terminal)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 2)
        self.assertIn(b"stdout is a terminal", shown)
        self.assertNotIn(b"PNG", shown)

    def test_lists_jobs_by_their_names(self):
        ids = [
            self.server.render(job_body(name=name))["id"] for name in ("Red chair", "Blue chair")
        ]
        server = {"TESSERA_SERVER": f"http://127.0.0.1:{self.server.port}"}
        self.assertIn(ids[0], run([PROGRAM, "jobs", "--name", "red ch"], **server))
        self.assertNotIn(ids[1], run([PROGRAM, "jobs", "--name", "red ch"], **server))

    def test_refuses_another_shell(self):
        done = subprocess.run([PROGRAM, "completion", "tcsh"], capture_output=True, text=True,
                              timeout=PATIENCE_S)
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("bash, zsh, fish", done.stderr)
