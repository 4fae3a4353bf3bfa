"""The most memory that a process holds in which Mitsuba 3 loads and renders a scene.

  mitsuba3.py VARIANT SCENE WxH SPP      one line of JSON
"""
import json
import resource
import sys

import mitsuba

variant, scene, size, spp = sys.argv[1:]
mitsuba.set_variant(variant)
width, height = size.split("x")
mitsuba.render(mitsuba.load_file(scene, resx=width, resy=height), spp=int(spp))
print(json.dumps({"bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024}))
