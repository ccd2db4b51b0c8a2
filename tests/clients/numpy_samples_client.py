"""Reads the samples that hpsdf writes by NumPy, as a training program would."""

from client import Program, module

np = module("numpy", "python3-numpy")
program = Program()
COUNTS = ["--surface", "3000", "--edge", "1000", "--near", "3000", "--uniform", "2000"]
TOTAL = 9000


def sample(name, *options):
    program.run("sample", *options, "-o", program.at(name))
    return program.at(name)


def check(holds, what):
    assert holds, what


def check_arrays(file, number):
    samples = np.load(file)
    shapes = {"points": (TOTAL, 3), "distances": (TOTAL,), "gradients": (TOTAL, 3), "kinds": (TOTAL,),
              "closest": (TOTAL, 3), "faces": (TOTAL,), "normals": (TOTAL, 3)}
    check(set(samples.files) == set(shapes), "the names of the arrays")
    for name, shape in shapes.items():
        check(samples[name].shape == shape, "the shape of " + name)
        check(np.isfinite(samples[name]).all(), "all numbers of " + name + " are finite")
    for name in ("points", "distances", "gradients", "closest", "normals"):
        check(samples[name].dtype == number, "the type of " + name)
    check(samples["faces"].dtype == np.int32 and samples["kinds"].dtype == np.uint8, "the types of whole numbers")
    check(np.bincount(samples["kinds"]).tolist() == [3000, 1000, 3000, 2000], "the numbers of points of each kind")
    lengths = np.linalg.norm(samples["points"] - samples["closest"], axis=1)
    check(np.allclose(lengths, np.abs(samples["distances"]), atol=1e-6), "distances are those to the closest points")
    check(np.allclose(np.linalg.norm(samples["gradients"], axis=1), 1, atol=1e-5), "gradients are unit vectors")
    check(np.allclose(np.linalg.norm(samples["normals"], axis=1), 1, atol=1e-5), "normals are unit vectors")
    step = samples["points"] - samples["distances"][:, None] * samples["gradients"]
    check(np.allclose(step, samples["closest"], atol=1e-5), "a step along the gradient leads to the closest point")
    return samples


def check_deepsdf(file):
    samples = np.load(file)
    check(sorted(samples.files) == ["neg", "pos"], "the names of DeepSDF's arrays")
    for name in ("pos", "neg"):
        check(samples[name].dtype == np.float32 and samples[name].shape[1] == 4, "type and shape of " + name)
        check(len(samples[name]) > 500, "the number of points in " + name)
    check(len(samples["pos"]) + len(samples["neg"]) == 5000, "all points are in pos or neg")
    check((samples["pos"][:, 3] > 0).all() and (samples["neg"][:, 3] <= 0).all(), "pos and neg go by the sign")
    center = np.concatenate([samples["neg"], samples["pos"]])[:, :3]
    check(np.abs(center).max() < 1.5, "the mesh is in the unit sphere")


floats = check_arrays(sample("floats.npz", "builtin:gear", *COUNTS), np.float32)
doubles = check_arrays(sample("doubles.npz", "builtin:gear", "--double", *COUNTS), np.float64)
check(np.array_equal(floats["points"], doubles["points"].astype(np.float32)), "floats are the rounded doubles")
check_deepsdf(sample("deepsdf.npz", "builtin:gear,teeth=30", "--layout", "deepsdf", "--unit-sphere", "--near", "3000",
                     "--uniform", "2000"))
table = np.genfromtxt(sample("table.csv", "builtin:gear", *COUNTS), delimiter=",", names=True)
check(np.allclose(table["distance"], floats["distances"], rtol=1e-6), "the table has the distances of the arrays")
print("NumPy", np.__version__, "reads all files")
