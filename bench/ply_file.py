"""Writes meshes for benchmarks."""

import pathlib

import numpy as np

FACES_AT_ONCE = 1 << 20


def write(file: pathlib.Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    """Writes a binary PLY file with coordinates in double precision."""
    with open(file, "wb") as stream:
        stream.write(
            f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\nproperty double x\nproperty double y\n"
            f"property double z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n".encode()
        )
        vertices.astype("<f8", copy=False).tofile(stream)
        for first in range(0, len(faces), FACES_AT_ONCE):
            some = faces[first : first + FACES_AT_ONCE]
            rows = np.empty(len(some), dtype=[("count", "u1"), ("corners", "<i4", 3)])
            rows["count"], rows["corners"] = 3, some
            rows.tofile(stream)
