"""Real NVP in four dimensions at epp-16 on the kitchen, trained until the held-out loss stops rising. The paper names 9 to 20 minutes
on a GTX 1070."""
import json
import tempfile
from pathlib import Path

from harness import SIZE, Bound, Row


def rows(bench):
    scene = bench.scene("country-kitchen")
    with tempfile.TemporaryDirectory() as folder:
        run = [bench.warpath, "compare", scene, "--methods", "realnvp:film+bounce1", "--epp", "16", "--size", SIZE, "--max-depth", "8", "--spp", "1"]
        bench.run(*run, "--reference-spp", "1", "--threads", "2", "--quiet", "--report", folder)
        result = json.loads((Path(folder) / "results.json").read_text())["results"][0]
    yield Row("training, 2 threads", result["train_seconds"], "s", Bound(most=20), f"candidates {result['candidate_seconds']:.1f} s")
