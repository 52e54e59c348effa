"""A gonio material inside Mitsuba 3, evaluated by gonio itself.

    import mitsuba as mi
    mi.set_variant("llvm_ad_rgb")          # or scalar_rgb, which asks pair by pair
    import mitsuba_bsdf
    copy = gonio.reconstruct(gonio.Measurement.open("readings.csv"), "kriging")
    mitsuba_bsdf.register("copy", copy)
    scene = {..., "bsdf": {"type": "copy"}}

This asks the material for every bounce, so that nothing is lost to a table and anything can be tried. Where a picture
is wanted quickly, `copy.write("copy.bsdf")` and Mitsuba's own `{"type": "measured", "filename": "copy.bsdf"}` are.
"""

import drjit as dr
import mitsuba as mi
import numpy as np


def evaluate_mode():
    """Lets Mitsuba call Python with arrays: loops and virtual calls are evaluated, not recorded."""
    for flag in (dr.JitFlag.SymbolicLoops, dr.JitFlag.SymbolicCalls, dr.JitFlag.SymbolicConditionals):
        dr.set_flag(flag, False)


class GonioBSDF(mi.BSDF):
    """f_r of a material. Samples are half cosine, half mirror directions about normals of GGX with `roughness`."""

    def __init__(self, props, material):
        mi.BSDF.__init__(self, props)
        self.material = material
        self.roughness = props.get("roughness", 0.2)
        self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide]
        self.m_flags = self.m_components[0]

    def f_cos(self, wi, wo):
        """f_r cos theta_o: Mitsuba traces from the sensor, so that its `wi` is gonio's omega_o."""
        sensor, light = (np.array(v, dtype=np.float64).reshape(3, -1).T for v in (wi, wo))
        up = (sensor[:, 2] > 0) & (light[:, 2] > 0)
        values = np.zeros((len(up), len(self.material.channels)))
        if up.any():
            # No data is black here; the file format fills such holes with their neighbours.
            values[up] = np.nan_to_num(self.material.eval(light[up], sensor[up])) * light[up, 2:]
        rgb = values if self.material.channels == ["r", "g", "b"] else np.repeat(values.mean(1, keepdims=True), 3, 1)
        if dr.is_jit_v(mi.Float):
            return mi.Color3f(*(mi.Float(channel) for channel in rgb.T.astype(np.float32)))
        return mi.Color3f(*rgb[0])

    def density(self, wi, wo):
        up = (mi.Frame3f.cos_theta(wi) > 0) & (mi.Frame3f.cos_theta(wo) > 0)
        h = dr.normalize(wi + wo)
        normals = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.roughness, self.roughness, False)
        mirror = normals.pdf(wi, h) / (4 * dr.maximum(dr.dot(wo, h), 1e-6))
        return dr.select(up, 0.5 * mi.warp.square_to_cosine_hemisphere_pdf(wo) + 0.5 * mirror, 0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        normals = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, self.roughness, self.roughness, False)
        m, _ = normals.sample(si.wi, sample2)
        mirror = 2 * dr.dot(si.wi, m) * m - si.wi
        wo = dr.select(sample1 < 0.5, mi.warp.square_to_cosine_hemisphere(sample2), mirror)
        bs = mi.BSDFSample3f()
        bs.wo = wo
        bs.pdf = self.density(si.wi, wo)
        bs.eta = 1.0
        bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        bs.sampled_component = mi.UInt32(0)
        good = active & (bs.pdf > 0)
        value = self.f_cos(si.wi, wo) / dr.maximum(bs.pdf, 1e-20)
        return bs, dr.select(good, value, 0)

    def eval(self, ctx, si, wo, active=True):
        return dr.select(active, self.f_cos(si.wi, wo), 0)

    def pdf(self, ctx, si, wo, active=True):
        return dr.select(active, self.density(si.wi, wo), 0)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self):
        return f"GonioBSDF[{self.material!r}]"


def register(name, material):
    """Makes a material the BSDF of this type: `{"type": name, "roughness": 0.2}`."""
    evaluate_mode()
    mi.register_bsdf(name, lambda props: GonioBSDF(props, material))
