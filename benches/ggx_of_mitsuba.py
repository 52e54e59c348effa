"""GGX of Mitsuba 3 on one thread, M pairs a second of CPU time: beside `cargo bench -- ggx`, which is ours.

pip install mitsuba; python benches/ggx_of_mitsuba.py. DRJIT_LIBLLVM_PATH names a libLLVM that is new enough: 19 is, 15 is not.
Directions and values are arrays in memory (f32, three channels), the kernel is compiled before, and the median of 25
launches is told. Its f has the cosine in it.
"""

from statistics import median
from time import process_time

import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
dr.set_thread_count(0)  # No helpers: the thread that launches works.

PAIRS = 4_000_000


def directions(sampler):
    return mi.warp.square_to_cosine_hemisphere(sampler.next_2d())


def rate(bsdf):
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, PAIRS)
    wi, wo = directions(sampler), directions(sampler)
    dr.eval(wi, wo)
    dr.sync_thread()

    def launch():
        si = dr.zeros(mi.SurfaceInteraction3f, PAIRS)
        si.wi = wi
        value = bsdf.eval(mi.BSDFContext(), si, wo)
        dr.eval(value)
        dr.sync_thread()

    launch()
    times = []
    for _ in range(25):
        start = process_time()
        launch()
        times.append(process_time() - start)
    return PAIRS / median(times) / 1e6


for name, material in [("F = 1", "none"), ("conductor", "Al")]:
    ggx = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.3, "material": material}
    print(f"mitsuba {mi.__version__} ggx 0.3, {name}: {rate(mi.load_dict(ggx)):.0f} M/s")
