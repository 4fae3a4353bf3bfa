"""The integrator plugin `warpath`, for scene files and dictionaries."""

from __future__ import annotations

import mitsuba as mi

from .estimator import render


def register() -> None:
    """Makes `{"type": "warpath", "nested": {...}}` known to the variant that is set; done by itself when a variant is set."""
    mi.register_integrator("warpath", _plugin_class())


def _plugin_class() -> type:
    class Warpath(mi.SamplingIntegrator):
        """Renders with the nested integrator and warped numbers: properties `warp` and those of training, as in `render`."""

        def __init__(self, props: mi.Properties):
            super().__init__(props)
            self.nested, self.options = None, {}
            for name in props.keys():
                value = props[name]
                if isinstance(value, mi.Integrator):
                    if self.nested is not None:
                        raise ValueError("warpath: more than one nested integrator")
                    self.nested = value
                else:
                    self.options[name] = value
            if self.nested is None:
                raise ValueError('warpath: there is no nested integrator, such as "nested": {"type": "path"}')

        def render(self, scene, sensor=0, seed=0, spp=0, develop=True, evaluate=True):
            return render(scene, spp, sensor=sensor, integrator=self.nested, seed=int(seed), **self.options)

        def sample(self, scene, sampler, ray, medium=None, active=True):
            return self.nested.sample(scene, sampler, ray, medium, active)

        def to_string(self) -> str:
            return f"Warpath[nested = {self.nested}, {self.options}]"

    return Warpath


if mi.variant() is not None:
    register()
mi.detail.add_variant_callback(lambda old, new: register())
