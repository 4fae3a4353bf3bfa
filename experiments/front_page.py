"""The pictures of README.md."""

from pictures import write_strip
from records import write_record
from shared_scenes import FILM
from tables import rows_of
from tool import compare, folder_of, own_scene, render, render_reference, shared_scene

#: The kitchen's wall, cooker, window and table, in shares of the film.
PART = (0.30, 0.24, 0.47, 0.74)


def front_page():
    """README's pictures: half a minute without and with the field beside the reference, and the study without noise."""
    film = {**FILM, "size": "640x360"}
    scene, folder = shared_scene("country-kitchen"), folder_of("front-page")
    against = render_reference("front-page", scene, 1024, objective="relmse", **film)
    results = compare("front-page", scene, ["none", "field"], **film, time=30, objective="relmse", **against)
    write_strip(folder, ["none", "field"], PART)
    write_record("front-page", {"country-kitchen": rows_of(results)}, {**film, "time": 30, "objective": "relmse"})
    render("front-page/study", own_scene("study"), folder / "study.jpg", warp="field", size="640x360", spp=1024)


ALL = (front_page,)
