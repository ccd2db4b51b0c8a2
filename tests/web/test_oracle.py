"""Picks and buffers of the page against the program's renderer in double precision, on fields of all kinds."""

import json
import os
import pathlib
from collections.abc import Callable
from typing import Any

import numpy
import pytest

from pages import asked, complaints, opened

SIZE = (320, 240)
PICKS = 400

FIELDS: dict[str, tuple[str, ...]] = {
    "torus": ("builtin:torus", "--target-error", "1e-6"),
    "box": ("builtin:box", "--strategy", "hp", "--coefficients", "double"),
    "bunny": ("paper/bunny_69k.obj", "--target-error", "1e-5"),
    "dragon": ("paper/dragon_80k.obj", "--target-error", "1e-5"),
    "open": ("broken/bun_zipper.ply", "--target-error", "1e-5"),
    "exact": ("builtin:gear", "--target-error", "1e-4"),
    "blended": ("builtin:torus", "--strategy", "hp", "--target-error", "1e-5", "--grid", "3", "--continuity", "exact"),
}

VIEWS = {
    "surface": ("show surface", "camera 40,25,0.9"),
    "axis": ("show slice", "plane axis=y"),
    "oblique": ("show slice", "plane through=0.05,0.1,0,1,2,0.5 zoom=1.5"),
}


@pytest.fixture(scope="module", params=FIELDS)
def paged(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, program: Callable[..., str], browser: Any) -> pathlib.Path:
    """The file of a field whose page is open in the browser."""
    source, *options = FIELDS[request.param]
    if not source.startswith("builtin:"):
        meshes = os.environ.get("HPSDF_MESHES")
        if not meshes:
            pytest.skip("HPSDF_MESHES is not set")
        source = f"{meshes}/{source}"
    file = tmp_path_factory.mktemp("oracle") / f"{request.param}.hpsdf"
    program("build", source, *options, "-o", file)
    program("page", file, "-o", file.with_suffix(".html"))
    opened(browser, file.with_suffix(".html"))
    return file


def pixels_of(seed: int) -> Any:
    random = numpy.random.default_rng(seed)
    return numpy.stack([random.integers(0, SIZE[0], PICKS), random.integers(0, SIZE[1], PICKS)], axis=1)


def oracle(program: Callable[..., str], field: pathlib.Path, lines: tuple[str, ...], pixels: Any) -> list[Any]:
    """What the program's renderer in double precision shows at pixels: an object for each, or None for the background."""
    script = field.with_suffix(".hps")
    picks = [f"pick {x},{y} json=true" for x, y in pixels]
    size = "x".join(map(str, SIZE))
    script.write_text("\n".join([f"load {field}", f"{lines[0]} size={size} cpu=true", *lines[1:], "panel all=false", f"shot output={field.with_suffix('.png')}", *picks]))
    printed = program("run", script)
    text, found, decoder = printed[printed.index("\n", printed.index(".png:")) :].strip(), [], json.JSONDecoder()
    while text:
        value, end = decoder.raw_decode(text)
        found.append(value)
        text = text[end:].strip()
    assert len(found) == len(pixels)
    return found


def picked(browser: Any, lines: tuple[str, ...], pixels: Any) -> list[Any]:
    """What the page's buffers show at pixels, and what it answers when it is asked there."""
    return list(
        asked(
            browser,
            f"""
            const [width, height] = [{SIZE[0]}, {SIZE[1]}], [lines, pixels] = arguments;
            const {{renderer}} = page.viewer.painter, {{view}} = viewFrom(lines, firstView(field), field);
            const rays = raysOf(view.orbit, field, width / height), isSlice = view.kind === 'slice';
            const hits = isSlice ? renderer.slice(planeOf(view, field, width, height), width, height) : renderer.surface(rays, width, height, view.offset);
            const buffer = hits.read();
            return pixels.map(([x, y]) => {{
              const pick = pickAt(field, {{hits, view, rays, section: null}}, (x + 0.5) / width, (y + 0.5) / height);
              const [cell, second, third, fourth] = buffer.subarray(4 * (y * width + x), 4 * (y * width + x) + 4);
              const value = new Float32Array(new Uint32Array([isSlice ? fourth : third]).buffer)[0];
              const levels = isSlice ? [second, third] : [second & 0xff, (second >> 8) & 0xff];
              return {{buffer: cell === 0xffffffff ? null : [cell, ...levels, value],
                       pick: pick && [pick.leaf.node, degreeOf(field, pick.leaf.node), pick.leaf.depth, pick.value], point: pick && pick.point}};
            }});
            """,
            "\n".join(lines),
            pixels.tolist(),
        )
    )


def levels(pick: Any) -> list[int]:
    return [pick["cell"], 31 if pick["degree"] == "exact" else pick["degree"], pick["depth"]]


@pytest.mark.parametrize("name", VIEWS)
def test_picks_and_buffers_equal_the_oracles(browser: Any, paged: pathlib.Path, program: Callable[..., str], name: str) -> None:
    pixels = pixels_of(1)
    expected, ours = oracle(program, paged, VIEWS[name], pixels), picked(browser, VIEWS[name], pixels)
    assert sum(pick is not None for pick in expected) > PICKS / 20
    # Rays that just touch the surface may hit it or not; rays at a border of cells may end in either.
    hits = [(them, us) for them, us in zip(expected, ours, strict=True) if them is not None and us["buffer"] is not None]
    assert sum((them is None) != (us["buffer"] is None) for them, us in zip(expected, ours, strict=True)) <= PICKS // 200
    for what in ("buffer", "pick"):
        different = [(them, us) for them, us in hits if levels(them) != us[what][:3]]
        assert len(different) <= (PICKS // 1000 if name == "axis" else PICKS // 200), (what, different[:3])
        same = [(them, us) for them, us in hits if levels(them) == us[what][:3]]
        assert max(abs(them["value"] - us[what][3]) for them, us in same) < 1e-5, what
    assert max(abs(numpy.subtract(them["position"], us["point"])).max() for them, us in hits if levels(them) == us["pick"][:3]) < 1e-4
    assert complaints(browser) == []
    # Another view would be noticed.
    wrong = picked(browser, (VIEWS[name][0], "camera 44,25,0.9", "plane axis=x offset=0.2"), pixels)
    assert sum(them is not None and (us["buffer"] is None or levels(them) != us["buffer"][:3]) for them, us in zip(expected, wrong, strict=True)) > PICKS / 50
