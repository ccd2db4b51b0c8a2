"""NumPy reads .npy: shape, type, values and gradients; and fields are built from the arrays that NumPy writes."""

import json

from client import Program, check_near, module

numpy = module("numpy", "python3-numpy")


def check(program, options, shape, number_type, tolerance):
    report = json.loads(program.run("export", program.at("torus.hpsdf"), "-o", program.at("torus.npy"), "--json", *options))
    array = numpy.load(program.at("torus.npy"))
    assert array.shape == shape and array.dtype == number_type, (array.shape, array.dtype)
    origin, spacing = numpy.array(report["origin"]), numpy.array(report["spacing"])
    indices = numpy.random.default_rng(1).integers(0, shape[:3], (200, 3))
    points = origin + spacing * indices[:, ::-1]
    values = array[tuple(indices.T)]
    if array.ndim == 4:
        assert abs(numpy.linalg.norm(values[:, 1:], axis=1) - 1).max() < 0.9
        values = values[:, 0]
    check_near(values, program.values(points), tolerance, "values of .npy")


program = Program()
check(program, ["--resolution", "20,21,22"], (23, 22, 21), numpy.float32, 1e-6)
check(program, ["--resolution", "20,21,22", "--gradients", "--double"], (23, 22, 21, 4), numpy.float64, 1e-14)

x, y, z = numpy.meshgrid(*3 * [numpy.linspace(-1.1, 1.1, 56)], indexing="ij")
torus = numpy.sqrt((numpy.sqrt(x * x + y * y) - 0.7) ** 2 + z * z) - 0.25
for array in (torus.T, torus.T.astype(numpy.float32), numpy.asfortranarray(torus.T)):
    numpy.save(program.at("written.npy"), array)
    program.build("written.npy", "--spacing", "0.04", "--origin=-1.1,-1.1,-1.1")
