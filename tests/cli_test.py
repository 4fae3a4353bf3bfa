#!/usr/bin/env python3
"""The command line as a user meets it: exit codes, one-line errors, the files that it leaves.  Usage: cli_test.py WARPATH SOURCE_DIR"""
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
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
        return subprocess.run([WARPATH, *map(str, args)], capture_output=True, text=True, timeout=300, **kwargs)

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
        for command in ("render", "train", "compare", "inspect"):
            result = self.warpath(command, "--help")
            self.assertEqual(result.returncode, 0)
            self.assertIn("--seed", result.stdout)

    def test_bad_usage_exits_with_2(self):
        self.fails(2)
        self.fails(2, "rende", BOX)
        self.fails(2, "render", BOX, "--spp", 0, "-o", self.path("a.exr"))
        self.fails(2, "render", BOX, "--spp", 4, "--time", 1, "-o", self.path("a.exr"))
        self.fails(2, "render", BOX, "--size", "32", "-o", self.path("a.exr"), says=["--size", "WxH"])
        self.fails(2, "render", BOX, "-D", "spp", "-o", self.path("a.exr"), says=["-D", "name=value"])
        self.fails(2, "render", BOX, "-o", self.path("a.bmp"), says=[".exr"])
        self.fails(2, "render", BOX, "--warp", "realnpv:film", "-o", self.path("a.exr"), says=['did you mean "realnvp"?'])
        self.fails(2, "render", BOX, "--warp", "kdtree:film+bonce1", "-o", self.path("a.exr"), says=["bonce1", "bounceK.light_uv"])
        self.fails(2, "render", BOX, "--warp", "none:film", "-o", self.path("a.exr"), says=["uniform:film"])
        self.fails(2, "render", BOX, "--aov", "albdo", "-o", self.path("a.exr"), says=["albedo"])
        self.fails(2, "render", BOX, "--crop", "0,0,9999,1", "-o", self.path("a.exr"), says=["--crop"])
        self.fails(2, "train", BOX, "--warp", "none", "-o", self.path("a.warp"), says=["nothing to train"])
        self.fails(2, "train", BOX, "--warp", "auto", "-o", self.path("a.warp"), says=["nothing to train"])
        self.fails(2, "render", BOX, "--warp", "field:film", "-o", self.path("a.exr"), says=["field:film", "light_uv"])
        self.fails(2, "render", BOX, "--warp", "field:bounce1", "-o", self.path("a.exr"), says=["bounce1.lobe+bounce1.dir"])
        for method in ("kdtree:bounce1.lobe+bounce1", "spline:bounce1.lobe+bounce1"):
            self.fails(2, "render", BOX, "--warp", method, "--init", BOX, "-o", self.path("a.exr"), says=[method, "starts anew"])
        self.fails(2, "render", BOX, "--warp", "kdtree:bounce1.lobe+bounce1+bounce2.lobe+bounce2", "-o", self.path("a.exr"), says=["one vertex"])
        self.fails(2, "render", BOX, "--warp", "field", "--objective", "mape", "-o", self.path("a.exr"), says=["--objective"])

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
        for warp in ("none", "kdtree:film+bounce1", "field", "kdtree:bounce1.lobe+bounce1", "spline:bounce1.lobe+bounce1", "auto"):
            images = []
            for threads in (1, 2):
                out = self.path(f"{threads}.exr")
                common = ["--size", "32x24", "--spp", 3, "--examples", 4096, "--seed", 7, "--quiet"]
                result = self.warpath("render", BOX, "--warp", warp, "--threads", threads, "-o", out, *common)
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
        for method, what in (("field", "every vertex"), ("field:bounce1.light+bounce1.light_uv", "bounce1.light+bounce1.light_uv"),
                             ("kdtree:bounce1.lobe+bounce1", "bounce1.lobe+bounce1.dir"),
                             ("spline:bounce1.lobe+bounce1+bounce2.lobe+bounce2", "bounce2.lobe+bounce2.dir")):
            result = self.warpath("train", BOX, "--warp", method, "-o", warp, "--examples", 2048, "--batch", 256, *SMALL)
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

        for seconds in (0.7, 3, 12):  # until there is something to decide, however busy the machine is
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

    def test_interrupt_leaves_the_image_so_far(self):
        out = self.path("out.exr")
        process = subprocess.Popen([WARPATH, "render", BOX, "--spp", "1000000", "-o", out, *SMALL], stderr=subprocess.PIPE)
        # It renders when its workers run; how soon that is depends on the machine.
        deadline = time.time() + 60
        while len(os.listdir(f"/proc/{process.pid}/task")) < 2 and time.time() < deadline:
            time.sleep(0.05)
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 0, errors)
        self.assertGreater(os.path.getsize(out), 1000)
        self.assertEqual(os.listdir(self.folder.name), ["out.exr"])

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
