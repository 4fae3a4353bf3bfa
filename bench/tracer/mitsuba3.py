"""Mitsuba 3 renders a scene; the first image, in which kernels are compiled or read from their cache, does not count.

  mitsuba3.py VARIANT SCENE WxH SPP THREADS      one line of JSON
"""
import json
import sys
import time

import drjit
import mitsuba

variant, scene, size, spp, threads = sys.argv[1:]
mitsuba.set_variant(variant)
if variant.startswith("llvm"):
    drjit.set_thread_count(int(threads))
width, height = size.split("x")
loaded = mitsuba.load_file(scene, resx=width, resy=height)
seconds, cpu_seconds = [], []
for seed in range(4 if variant.startswith("llvm") else 2):
    wall, cpu = time.perf_counter(), time.process_time()
    drjit.eval(mitsuba.render(loaded, spp=int(spp), seed=seed))
    drjit.sync_thread()
    seconds.append(time.perf_counter() - wall)
    cpu_seconds.append(time.process_time() - cpu)
print(json.dumps({"paths": int(width) * int(height) * int(spp), "seconds": seconds[1:], "cpu_seconds": cpu_seconds[1:]}))
