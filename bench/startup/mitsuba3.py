"""Mitsuba 3 loads a scene; importing Mitsuba does not count.

  mitsuba3.py VARIANT SCENE WxH      one line of JSON
"""
import json
import sys
import time

import mitsuba

variant, scene, size = sys.argv[1:]
mitsuba.set_variant(variant)
width, height = size.split("x")
start = time.perf_counter()
loaded = mitsuba.load_file(scene, resx=width, resy=height)
print(json.dumps({"seconds": time.perf_counter() - start}))
