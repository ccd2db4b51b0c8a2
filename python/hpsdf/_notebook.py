"""The pictures and tables of figures by which fields and meshes show themselves in notebooks."""

import base64
import html
from typing import Any, cast

from . import _hpsdf
from ._pictures import Picture, Session
from ._types import Mesh

_SIZE = (640, 400)


def field_info(field: _hpsdf.Field) -> dict[str, Any]:
    """The figures of the field, as `hpsdf info --json` writes them, in a dict: the mesh and the settings that it was
    made from, its sizes, its measured and estimated errors, and the shares of the volume by degree and depth.
    """
    return cast(dict[str, Any], Session(field).perform("info"))


def mesh_report(mesh: Mesh) -> dict[str, Any]:
    """The report on the mesh, as `hpsdf mesh --json` writes it, in a dict: counts, volume, area, whether it is closed,
    its defects with their places, and how its inside is decided.
    """
    return cast(dict[str, Any], Session().perform("mesh", mesh=mesh))


def field_png(field: _hpsdf.Field) -> bytes:
    """The picture of the field as the bytes of a PNG file; without OpenGL it is drawn by the CPU."""
    return _hpsdf.png_of(_picture(Session(field)))


def field_html(field: _hpsdf.Field) -> str:
    """The figures of the field and its picture as HTML."""
    return _html_of(Session(field), field_png(field))


def field_bundle(field: _hpsdf.Field, include: Any = None, exclude: Any = None) -> dict[str, Any]:
    """What a notebook shows of the field, by kind, so that it draws one picture and not one for each kind."""
    session = Session(field)
    png = _hpsdf.png_of(_picture(session))
    return {"image/png": png, "text/html": _html_of(session, png), "text/plain": repr(field)}


def _html_of(session: Session, png: bytes) -> str:
    info = session.perform("info")
    rows = [
        ("made from", (info["mesh"] or {}).get("name") or "a function"),
        ("cells", f"{info['leaves']:,}"),
        ("memory", _bytes_text(info["bytes"])),
        *_error_rows(info["measured"]),
    ]
    data = base64.b64encode(png).decode("ascii")
    image = f'<img alt="the surface of the field" src="data:image/png;base64,{data}" width="{_SIZE[0]}"/>'
    return f"<div>{_table('hpsdf.Field', rows)}{image}</div>"


def mesh_html(mesh: _hpsdf.TriangleMesh) -> str:
    """The report on the mesh as HTML, or why there is none."""
    title = f"hpsdf.TriangleMesh {mesh.name}".rstrip()
    try:
        report = mesh_report(mesh)
    except _hpsdf.Error as error:
        return _table(title, [("vertices, triangles", f"{len(mesh.vertices):,}, {len(mesh.faces):,}"), ("report", str(error))])
    verdict = report["verdict"]
    defects = {name.replace("_", " "): found["count"] for name, found in report["defects"].items() if found["count"]}
    rows = [
        ("vertices, triangles", f"{report['vertices']:,}, {report['faces']:,}"),
        ("parts", f"{report['parts']:,}"),
        ("surface", "closed" if verdict["closed"] else "not closed"),
        ("defects", ", ".join(f"{count:,} {name}" for name, count in defects.items()) or "none"),
        ("volume, area", f"{report['volume']:.6g}, {report['area']:.6g}"),
        ("inside test", report["sign"]["by"]),
    ]
    return _table(title, rows)


def _picture(session: Session) -> Picture:
    try:
        return session.render(size=_SIZE)
    except _hpsdf.Error:
        return session.render(size=_SIZE, cpu=True)


def _error_rows(measured: dict[str, Any] | None) -> list[tuple[str, str]]:
    if not measured:
        return []
    near, domain = measured["near"], measured["domain"]
    return [
        ("error near the surface", f"RMS {near['rms']:.3g}, greatest {near['max']:.3g}"),
        ("error over the domain", f"RMS {domain['rms']:.3g}, greatest {domain['max']:.3g}"),
    ]


def _bytes_text(count: int) -> str:
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.2f} {unit}"
    return f"{count} bytes"


def _table(title: str, rows: list[tuple[str, str]]) -> str:
    cells = "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in rows)
    return f"<table><caption>{html.escape(title)}</caption>{cells}</table>"


def attach() -> None:
    """Gives the classes of the extension these methods."""
    for kind, name, method in (
        (_hpsdf.Field, "info", field_info),
        (_hpsdf.Field, "_repr_png_", field_png),
        (_hpsdf.Field, "_repr_html_", field_html),
        (_hpsdf.Field, "_repr_mimebundle_", field_bundle),
        (_hpsdf.TriangleMesh, "report", mesh_report),
        (_hpsdf.TriangleMesh, "_repr_html_", mesh_html),
    ):
        setattr(kind, name, method)
