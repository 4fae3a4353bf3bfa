#!/usr/bin/env python3
"""The command line as a user meets it: exit codes, one-line errors, the files that it leaves.  Usage: cli_test.py WARPATH SOURCE_DIR"""
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import unittest

WARPATH, SOURCE = sys.argv[1], sys.argv[2]
BOX = os.path.join(SOURCE, "scenes", "box", "scene.xml")
SMALL = ["--size", "32x24", "--threads", "2"]


class CommandLine(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def warpath(self, *args, **kwargs):
        return subprocess.run([WARPATH, *map(str, args)], capture_output=True, text=True, **kwargs)

    def fails(self, code, *args, says=()):
        result = self.warpath(*args)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stdout, "")
        self.assertEqual(result.stderr.strip().count("\n"), 0, "an error is one line: " + result.stderr)
        for text in says:
            self.assertIn(text, result.stderr)
        self.assertEqual(os.listdir(self.folder.name), [], "nothing half-written stays behind")

    def read(self, path):
        with open(path, "rb") as file:
            return file.read()

    def test_version_and_help(self):
        self.assertRegex(self.warpath("--version").stdout, r"^warpath \d+\.\d+\.\d+")
        for command, option in (("render", "--spp"), ("train", "--examples"), ("compare", "--runs"), ("inspect", "--max-depth")):
            result = self.warpath(command, "--help")
            self.assertEqual(result.returncode, 0)
            self.assertIn(option, result.stdout)

    def refuses(self, *options, says, command="render"):
        """That a command with these options is bad usage; nothing is loaded, written or computed for it."""
        self.fails(2, command, BOX, *options, "-o", self.path("a.exr"), says=says)

    def test_bad_usage_exits_with_2(self):
        self.fails(2)
        self.fails(2, "rende", BOX)
        self.refuses("--spp", 4, "--time", 1, says=["--spp", "--time"])
        self.refuses("-D", "spp", says=["-D", "name=value"])
        self.fails(2, "render", BOX, "-o", self.path("a.bmp"), says=[".exr"])
        self.refuses("--warp", "realnpv:film", says=['did you mean "realnvp"?'])
        self.refuses("--warp", "neural:film", says=["neural"])
        self.refuses("--warp", "kdtree:film+bonce1", says=["bonce1", "bounceK.light_uv"])
        self.refuses("--warp", "none:film", says=["uniform:film"])
        self.refuses("--aov", "albdo", says=["albedo"])
        for warp in ("none", "auto"):
            self.refuses("--warp", warp, command="train", says=["nothing to train"])
        self.refuses("--warp", "field:film", says=["field:film", "light_uv"])
        self.refuses("--warp", "field:bounce1", says=["bounce1.lobe+bounce1.dir"])
        self.refuses("--warp", "conditional-kdtree:bounce1.lobe+bounce1+bounce2.lobe+bounce2", says=["one vertex"])
        for family in ("kdtree", "spline"):
            self.refuses("--warp", f"{family}:bounce1.lobe+bounce1", says=[f"is called conditional-{family}:bounce1.lobe+bounce1.dir"])

    def test_values_out_of_range_exit_with_2(self):
        for name, values, says in (
            ("spp", (0, -1, 1.5, "", "4x", 2**63), "1 to "),
            ("time", ("nan", "inf", 0, -1, "1e300"), "above 0"),
            ("seed", (-1, 2**64, "seven"), "whole number"),
            ("size", ("32", "0x4", "4x4x4", "99999999999x1"), "WxH"),
            ("crop", ("2147483647,0,1,1", "0,0,1", "-1,0,1,1"), "X,Y,W,H"),
            ("crop", ("0,0,9999,1",), "not inside the film"),
            ("objective", ("mape",), "mse"),
            ("threads", (0, 10**9), "1 to "),
        ):
            for value in values:
                self.refuses(f"--{name}={value}", says=[name, says])
        for name, values, says in (
            ("examples", (0, 2**64 - 1, 2**64, "many"), "whole number"),
            ("epp", ("1e300", 0, "nan"), "above 0"),
            ("alpha", (0.5, "inf"), "1 to "),
            ("uniform-share", (1, -0.1, "nan"), "0 to 0.999"),
            ("rate", ("nan", 0, 2), "above 0 to 1"),
            ("couplings", (0, 2**31), "1 to 64"),
            ("init", (self.path("absent.warp"),), "does not exist"),
        ):
            for value in values:
                self.refuses("--warp", "realnvp:film+bounce1", f"--{name}={value}", says=[f"--{name}: ", says])
        self.refuses("--warp", "kdtree", "--uniform", 0.1, says=["--uniform-share"])

    def test_options_that_no_method_uses_exit_with_2(self):
        for warp, option, value, says in (
            ("field", "couplings", 3, "field does not use it; it is for realnvp, spline"),
            ("field", "examples", 4096, "field does not use it"),
            ("none", "leaves", 16, "none does not use it; it is for kdtree"),
            ("auto", "epp", 1, "field does not use it; it is for grid, kdtree, realnvp or spline"),
            ("uniform:film", "alpha", 2, "uniform does not use it"),
            ("kdtree", "bins", 8, "kdtree does not use it; it is for spline or conditional-spline"),
            ("conditional-kdtree:bounce1.lobe+bounce1", "init", BOX, "conditional-kdtree does not use it; it is for "),
            ("conditional-spline:bounce1.lobe+bounce1", "init", BOX, "conditional-spline does not use it; it is for "),
        ):
            self.refuses("--warp", warp, f"--{option}", value, says=[f"--{option}: ", says])
        self.refuses("--warp", "field", "--couplings", 3, command="train", says=["--couplings: field does not use it"])

    def test_bad_files_exit_with_3(self):
        self.fails(3, "render", self.path("absent.xml"), "-o", self.path("a.exr"), says=["absent.xml"])
        with tempfile.TemporaryDirectory() as elsewhere:
            scene = os.path.join(elsewhere, "scene.xml")
            with open(scene, "w") as file:
                file.write('<scene version="3.0.0">\n  <bsdf type="rougplastic" id="a"/>\n  <sensor type="perspective"/>\n'
                           '  <integrator type="path"/>\n  <shape type="sphere"><ref id="a"/></shape>\n</scene>\n')
            self.fails(3, "render", scene, "-o", self.path("a.exr"), says=["scene.xml:2:", 'did you mean "roughplastic"?'])
            warp = os.path.join(elsewhere, "broken.warp")
            with open(warp, "wb") as file:
                file.write(b"\xff" * 100)
            self.fails(3, "render", BOX, "--warp", warp, "-o", self.path("a.exr"), says=["broken.warp"])

    def test_same_seed_same_file_for_any_number_of_threads(self):
        first_hit = "bounce1.lobe+bounce1"
        for warp in ("none", "kdtree:film+bounce1", "field", f"conditional-kdtree:{first_hit}", f"conditional-spline:{first_hit}", "auto"):
            training = ["--examples", 4096] if warp.startswith("kdtree") else []
            images = []
            for threads in (1, 2):
                out = self.path(f"{threads}.exr")
                common = ["--size", "32x24", "--spp", 3, "--seed", 7, "--quiet"]
                result = self.warpath("render", BOX, "--warp", warp, "--threads", threads, "-o", out, *common, *training)
                self.assertEqual(result.returncode, 0, result.stderr)
                result = self.warpath("compare", BOX, "--methods", "none", "--reference", out, "--spp", 1, "--report",
                                      self.path(f"report{threads}"), "--size", "32x24", "--quiet", "--seed", 7)
                self.assertEqual(result.returncode, 0, result.stderr)
                with open(self.path(f"report{threads}/results.json")) as file:
                    images.append(json.load(file)["results"][0]["mse_raw"])
            self.assertEqual(images[0], images[1])

    def test_train_inspect_render_with_a_saved_warp(self):
        warp, out = self.path("box.warp"), self.path("out.exr")
        result = self.warpath("train", BOX, "--warp", "kdtree:film+bounce1", "-o", warp, "--examples", 8192, *SMALL)
        self.assertEqual(result.returncode, 0, result.stderr)
        told = self.warpath("inspect", warp).stdout
        for text in ("kdtree", "film+bounce1", "8192"):
            self.assertIn(text, told)
        result = self.warpath("render", BOX, "--warp", warp, "--spp", 2, "-o", out, *SMALL)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertGreater(os.path.getsize(out), 1000)
        self.assertEqual(self.warpath("inspect", BOX).returncode, 0)

    def test_a_field_learns_while_it_renders_or_is_saved(self):
        warp, out = self.path("box.warp"), self.path("out.exr")
        result = self.warpath("train", BOX, "--warp", "field", "-o", warp, "--examples", 2048, *SMALL)
        self.assertEqual(result.returncode, 0, result.stderr)
        told = self.warpath("inspect", warp).stdout
        for text in ("field", "every vertex", "paths"):
            self.assertIn(text, told)
        for method in (warp, "field"):
            for objective in ("mse", "relmse", "even"):
                result = self.warpath("render", BOX, "--warp", method, "--objective", objective, "--spp", 7, "-o", out, *SMALL)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn(f"{32 * 24 * 7} samples", result.stderr)
        result = self.warpath("render", BOX, "--warp", "field", "--init", warp, "--spp", 7, "-o", out, *SMALL)
        self.assertEqual(result.returncode, 0, result.stderr)
        result = self.warpath("render", BOX, "--warp", "auto", "--spp", 32, "-o", out, *SMALL)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("auto: ", result.stderr)

    def test_warps_of_vertices_are_saved_with_the_numbers_that_they_warp(self):
        warp, out = self.path("box.warp"), self.path("out.exr")
        first, second = "bounce1.lobe+bounce1", "bounce2.lobe+bounce2"
        for method, what, *options in (
            ("field", "every vertex"),
            ("field:bounce1.light+bounce1.light_uv", "bounce1.light+bounce1.light_uv"),
            (f"conditional-kdtree:{first}", "bounce1.lobe+bounce1.dir"),
            (f"conditional-spline:{first}+{second}", "bounce2.lobe+bounce2.dir", "--batch", 256),
        ):
            result = self.warpath("train", BOX, "--warp", method, "-o", warp, "--examples", 2048, *options, *SMALL)
            self.assertEqual(result.returncode, 0, result.stderr)
            told = self.warpath("inspect", warp).stdout
            for text in (method.split(":")[0], what, "paths"):
                self.assertIn(text, told)
            for spelled in (warp, method):
                result = self.warpath("render", BOX, "--warp", spelled, "--spp", 7, "-o", out, *SMALL)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn(f"{32 * 24 * 7} samples", result.stderr)

    def test_compare_writes_report_and_results(self):
        report = self.path("report")
        result = self.warpath("compare", BOX, "--methods", "none,kdtree:film+bounce1", "--spp", 4, "--runs", 2,
                              "--examples", 4096, "--report", report, *SMALL)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("kdtree:film+bounce1", result.stdout)
        with open(os.path.join(report, "results.json")) as file:
            results = json.load(file)
        self.assertEqual([r["method"] for r in results["results"]], ["none"] * 2 + ["kdtree:film+bounce1"] * 2)
        for run in results["results"]:
            self.assertEqual(run["samples"], 32 * 24 * 4)
            for key in ("mse", "relmse", "relmse_trimmed", "mape", "mse_raw", "relmse_raw", "mse_rest", "relmse_rest",
                        "candidate_seconds", "train_seconds", "warp_seconds", "trace_seconds", "total_seconds",
                        "candidate_cpu_seconds", "train_cpu_seconds", "warp_cpu_seconds", "trace_cpu_seconds", "total_cpu_seconds"):
                self.assertIsInstance(run[key], (int, float), key)
            self.assertGreater(run["total_cpu_seconds"], 0)
            self.assertGreater(run["error_curve"][-1]["cpu_seconds"], run["error_curve"][0]["cpu_seconds"])
        for name in ("index.html", "none.exr", "kdtree_film+bounce1.exr", "reference.exr"):
            self.assertTrue(os.path.exists(os.path.join(report, name)), name)

    def test_compare_resumes(self):
        report = self.path("report")

        def compare(runs, *more):
            result = self.warpath("compare", BOX, "--methods", "none,kdtree", "--spp", 4, "--examples", 4096, "--runs", runs,
                                  "--report", report, *SMALL, *more)
            if result.returncode != 0:
                return result
            with open(os.path.join(report, "results.json")) as file:
                return json.load(file)["results"]

        def densities():
            with open(os.path.join(report, "index.html")) as file:
                page = file.read()
            data = page[page.index('id="data">') + len('id="data">'):]
            return json.loads(data[:data.index("</script>")])["densities"]

        first, pictures = compare(1), densities()
        both = compare(2, "--resume")
        self.assertEqual([picture["method"] for picture in pictures], ["kdtree", "kdtree"])
        self.assertEqual(densities(), pictures)
        self.assertEqual([both[0], both[2]], first, "the runs that were there are kept, their times too")
        self.assertEqual([run["seed"] for run in both], [0, 1, 0, 1])
        other = compare(2, "--resume", "--max-depth", 2)
        self.assertEqual(other.returncode, 2)
        self.assertIn("another command", other.stderr)

    def test_replay_repeats_what_the_clock_decided(self):
        def compare(name, *options):
            report = self.path(name)
            result = self.warpath("compare", BOX, "--methods", "none,auto,kdtree:film+bounce1", "--examples", 4096, "--reference-spp", 8, "--report",
                                  report, "--size", "32x24", *options)
            if result.returncode != 0:
                return result
            with open(os.path.join(report, "results.json")) as file:
                return json.load(file)["results"]

        for seconds in (0.7, 3, 12, 50, 200):  # until there was something to decide, however slow the machine is
            timed = compare("timed", "--time", seconds, "--threads", 2, "--seed", 5)
            if min(len(run["passes"]) for run in timed) > 4:
                break
        record = self.path("timed/results.json")
        again = compare("again", "--replay", record, "--threads", 1, "--seed", 5)
        for before, after in zip(timed, again):
            self.assertGreater(len(before["passes"]), 4)
            for key in ("method", "samples", "passes", "mean", "mean_rest", "mse", "relmse", "mse_predicted"):
                self.assertEqual(before[key], after[key], key)
        # In place: the file is read before it is written anew.
        in_place = compare("timed", "--replay", record, "--threads", 1, "--seed", 5)
        self.assertEqual([run["passes"] for run in in_place], [run["passes"] for run in timed])
        other = compare("other", "--replay", record, "--seed", 6)
        self.assertEqual(other.returncode, 2)
        self.assertIn("no run of none under --time with seed 6", other.stderr)
        self.assertFalse(os.path.exists(self.path("other")))
        for method, seed, code in (("auto", 5, 0), ("field", 5, 2)):
            image = self.path(method + ".exr")
            result = self.warpath("render", BOX, "--warp", method, "--replay", record, "--seed", seed, "--size", "32x24", "-o", image)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertEqual(os.path.exists(image), code == 0)

    def test_a_warp_of_another_kind_is_no_start(self):
        with tempfile.TemporaryDirectory() as elsewhere:
            field, tree = (os.path.join(elsewhere, name) for name in ("field.warp", "tree.warp"))
            for warp, file in (("field", field), ("kdtree:film+bounce1", tree)):
                self.assertEqual(self.warpath("train", BOX, "--warp", warp, "-o", file, "--examples", 2048, *SMALL).returncode, 0)
            for warp, file in (("realnvp:film+bounce1", field), ("field", tree)):
                self.fails(2, "render", BOX, "--warp", warp, "--init", file, "-o", self.path("a.exr"), *SMALL, "--quiet",
                           says=["--init", "cannot start"])

    def test_passes_that_cannot_be_rendered_are_refused(self):
        good = {"spp": 2, "batches": 3, "teaches": True, "drawn_by": "field", "chosen": ""}
        with tempfile.TemporaryDirectory() as elsewhere:
            record = os.path.join(elsewhere, "results.json")
            for wrong in ({"spp": 0}, {"spp": -4}, {"spp": 2**30}, {"batches": 0}, {"drawn_by": "magic"}):
                run = {"method": "field", "size": "32x24", "seed": 0, "passes": [good, good | wrong]}
                with open(record, "w") as file:
                    json.dump({"results": [run]}, file)
                self.fails(3, "render", BOX, "--warp", "field", "--size", "32x24", "--replay", record, "-o", self.path("a.exr"), says=["passes"])

    def test_interrupt_leaves_the_image_so_far(self):
        out = self.path("out.exr")
        terminal, errors = os.openpty()
        self.addCleanup(os.close, terminal)
        process = subprocess.Popen([WARPATH, "render", BOX, "--spp", "1000000", "-o", out, *SMALL], stderr=errors)
        os.close(errors)
        said = b""
        while b"rendering" not in said:  # the terminal is told once there are samples
            said += os.read(terminal, 4096)
        process.send_signal(signal.SIGINT)
        while chunk := self.read_terminal(terminal):
            said += chunk
        self.assertEqual(process.wait(), 0, said)
        self.assertGreater(os.path.getsize(out), 1000)
        self.assertEqual(os.listdir(self.folder.name), ["out.exr"])

    def read_terminal(self, terminal):
        """What was written to it; nothing once its other side is closed, which Linux calls an input/output error."""
        try:
            return os.read(terminal, 4096)
        except OSError:
            return b""

    def test_full_disk_keeps_the_last_complete_output(self):
        out = self.path("out.exr")
        self.assertEqual(self.warpath("render", BOX, "--spp", 1, "-o", out, *SMALL).returncode, 0)
        before = self.read(out)

        def no_room():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (512, 512))

        result = self.warpath("render", BOX, "--spp", 2, "-o", out, *SMALL, preexec_fn=no_room)
        self.assertEqual(result.returncode, 3, result.stderr)
        self.assertIn("out.exr", result.stderr)
        self.assertEqual(self.read(out), before)
        self.assertEqual(os.listdir(self.folder.name), ["out.exr"])


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]])
