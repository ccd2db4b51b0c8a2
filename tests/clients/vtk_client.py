"""VTK reads .vti and .vtu: values, gradients, data of the leaves, polynomials of higher order, a contour; and fields are
built from the .vti that VTK writes. Runs by python3 with the package python3-vtk9, and by pvpython of the package paraview,
whose modules are the same."""

import random

from client import Program, check_near, distance, module

io = module("vtkmodules.vtkIOXML", "python3-vtk9")
core = module("vtkmodules.vtkCommonCore", "python3-vtk9")
filters = module("vtkmodules.vtkFiltersCore", "python3-vtk9")


def read(reader, file):
    reader.SetFileName(file)
    reader.Update()
    assert reader.GetErrorCode() == 0
    return reader.GetOutput()


def contour_points(data):
    contour = filters.vtkContourFilter()
    contour.SetInputData(data)
    contour.SetValue(0, 0)
    contour.Update()
    surface = contour.GetOutput()
    assert surface.GetNumberOfPoints() > 1000, surface.GetNumberOfPoints()
    return [surface.GetPoint(n) for n in range(surface.GetNumberOfPoints())]


def check_image(program, option, tolerance):
    image = read(io.vtkXMLImageDataReader(), program.export("torus.vti", "--resolution", "48", "--gradients", *option))
    assert max(image.GetDimensions()) == 49
    numbers = random.Random(1).sample(range(image.GetNumberOfPoints()), 500)
    points = [image.GetPoint(n) for n in numbers]
    scalars, vectors = image.GetPointData().GetScalars(), image.GetPointData().GetVectors()
    assert (scalars.GetName(), vectors.GetName()) == ("distance", "gradient")
    check_near([scalars.GetTuple1(n) for n in numbers], program.values(points), tolerance, "values of .vti")
    lengths = [sum(c * c for c in vectors.GetTuple3(n)) ** 0.5 for n in numbers if abs(scalars.GetTuple1(n)) < 0.1]
    check_near(lengths, [1] * len(lengths), 0.1, "gradients of .vti")
    check_near([distance(*p) for p in contour_points(image)], [0] * 10**6, 0.003, "contour of .vti")


def check_leaves(program):
    leaves = read(io.vtkXMLUnstructuredGridReader(), program.export("leaves.vtu"))
    data = leaves.GetCellData()
    assert leaves.GetNumberOfCells() * 8 == leaves.GetNumberOfPoints()
    for name, least, most in (("degree", 0, 31), ("depth", 0, 20), ("error", 0, 0.1), ("jump", 0, 0.1)):
        low, high = data.GetArray(name).GetRange()
        assert least <= low <= high <= most, (name, low, high)
    assert data.GetArray("depth").GetRange()[1] > 0
    check_near([distance(*p) for p in contour_points(leaves)], [0] * 10**6, 0.1, "contour of .vtu")


def check_lagrange_cells(program):
    """The cells' polynomials are those of the leaves, within the cells and not only at their points."""
    file = program.export("lagrange.vtu", "--order", "10", "--double")
    leaves = read(io.vtkXMLUnstructuredGridReader(), file)
    values, positions = [], []
    generator = random.Random(2)
    scalars = leaves.GetPointData().GetScalars()
    for number in generator.choices(range(leaves.GetNumberOfCells()), k=300):
        cell = leaves.GetCell(number)
        count = cell.GetNumberOfPoints()
        weights, position = [0.0] * count, [0.0] * 3
        cell.EvaluateLocation(core.reference(0), [generator.random() for _ in range(3)], position, weights)
        positions.append(position)
        values.append(sum(w * scalars.GetTuple1(cell.GetPointId(n)) for n, w in enumerate(weights)))
    check_near(values, program.values(positions), 1e-12, "Lagrange cells")


def check_files_of_vtk(program):
    """VTK writes the grid again, in each of its encodings."""
    image = read(io.vtkXMLImageDataReader(), program.export("torus.vti", "--resolution", "32"))
    for mode in ("Ascii", "Binary", "Appended"):
        for compressor in ("None", "ZLib"):
            for is_base64 in (True, False):
                writer = io.vtkXMLImageDataWriter()
                writer.SetInputData(image)
                writer.SetFileName(program.at("written.vti"))
                getattr(writer, f"SetDataModeTo{mode}")()
                getattr(writer, f"SetCompressorTypeTo{compressor}")()
                writer.SetEncodeAppendedData(is_base64)
                if is_base64:
                    writer.SetHeaderTypeToUInt64()
                else:
                    writer.SetHeaderTypeToUInt32()
                assert writer.Write() == 1
                program.build("written.vti")


program = Program()
check_image(program, [], 1e-6)
check_image(program, ["--double"], 1e-14)
check_leaves(program)
check_lagrange_cells(program)
check_files_of_vtk(program)
