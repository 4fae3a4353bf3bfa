"""Experiments with the field, which learns while it renders."""

from curves import error_charts
from shared_scenes import BOTH, reference
from tables import comparison_table, write_table
from tool import compare, folder_of, own_scene, render_reference, shared_scene, train


def field_at(label, methods, **options):
    """Both shared scenes, samples placed for either error."""
    for name in BOTH:
        for objective in ("mse", "relmse"):
            place = f"{label}/{name}-{objective}"
            results = compare(place, shared_scene(name), methods, size="320x180", max_depth=8, runs=3, objective=objective,
                              **options, **reference(name))  # fmt: skip
            write_table(folder_of(place), comparison_table(results))
            error_charts(folder_of(place), results)


def field_samples():
    """The field at 128 and 512 spp, all passes counted; uniform:bounce1 shows what placing the samples gains alone."""
    field_at("field-128", ["none", "uniform:bounce1", "field"], spp=128)
    field_at("field-512", ["none", "field"], spp=512)


def field_time():
    """The field and auto at equal time, everything included."""
    for seconds in (30, 60):
        field_at(f"field-{seconds}s", ["none", "field", "auto"], time=seconds)


def door_ajar():
    """Light that comes through a door left ajar, at equal time, against a field's long reference."""
    scene, size = own_scene("ajar"), {"size": "160x90"}
    against = render_reference("door-ajar", scene, 8192, objective="relmse", **size)
    for objective in ("mse", "relmse"):
        label = f"door-ajar/{objective}"
        results = compare(label, scene, ["none", "field", "auto"], **size, time=10, runs=5, objective=objective, **against)
        write_table(folder_of(label), comparison_table(results))


def views():
    """A field trained in one view serves others: the camera of scenes/ajar turned by 10, 45 and 90 degrees."""
    scene, size = own_scene("ajar"), {"size": "160x90"}
    field, _, _ = train("views", scene, "field", **size, epp=8)
    for angle in (10, 45, 90):
        label, turned = f"views/{angle}", {**size, "defines": {"turn": angle}}
        against = render_reference(label, scene, 4096, objective="relmse", **turned)
        results = compare(label, scene, ["none", "field", field], **turned, spp=32, runs=5, **against)
        write_table(folder_of(label), comparison_table(results))


ALL = (field_samples, field_time, door_ajar, views)
