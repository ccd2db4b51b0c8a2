"""VTK draws the leaves of a field from a .vtu, coloured by their degrees, and its surface from a .vti, without a display."""

import shutil
import subprocess
import sys
from pathlib import Path

from client import EYE_OF_PICTURES, Program, check_picture, module, skip

# A display is needed only by the program that draws, which is this file, run a second time.
inside = "--draw" in sys.argv


def surface_of(file):
    reader = io.vtkXMLImageDataReader()
    reader.SetFileName(file)
    contour = filters.vtkContourFilter()
    contour.SetInputConnection(reader.GetOutputPort())
    contour.SetValue(0, 0)
    mapper = rendering.vtkPolyDataMapper()
    mapper.SetInputConnection(contour.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor = rendering.vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(0.85, 0.6, 0.45)
    return actor


def leaves_behind_the_middle(file):
    reader = io.vtkXMLUnstructuredGridReader()
    reader.SetFileName(file)
    plane = data.vtkPlane()
    plane.SetOrigin(0, 0, 0.02)
    plane.SetNormal(0, 0, 1)
    extraction = module("vtkmodules.vtkFiltersExtraction", "python3-vtk9").vtkExtractGeometry()
    extraction.SetInputConnection(reader.GetOutputPort())
    extraction.SetImplicitFunction(plane)
    colors = core.vtkLookupTable()
    colors.SetNumberOfTableValues(4)
    for degree, color in enumerate(((0.33, 0.16, 0.49), (0.09, 0.52, 0.67), (0.43, 0.78, 0.6), (1, 0.94, 0.64))):
        colors.SetTableValue(degree, *color, 1)
    mapper = rendering.vtkDataSetMapper()
    mapper.SetInputConnection(extraction.GetOutputPort())
    mapper.SetScalarModeToUseCellFieldData()
    mapper.SetColorModeToMapScalars()
    mapper.SelectColorArray("degree")
    mapper.SetLookupTable(colors)
    mapper.SetScalarRange(1.5, 5.5)
    actor = rendering.vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().EdgeVisibilityOn()
    actor.GetProperty().SetAmbient(0.5)
    actor.GetProperty().SetDiffuse(0.5)
    return actor


def draw(vti, vtu, picture):
    renderer = rendering.vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    renderer.AddActor(surface_of(vti))
    renderer.AddActor(leaves_behind_the_middle(vtu))
    window = rendering.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(400, 300)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(*EYE_OF_PICTURES)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetViewUp(0, 1, 0)
    camera.SetViewAngle(36)
    renderer.ResetCameraClippingRange()
    window.Render()
    image = rendering.vtkWindowToImageFilter()
    image.SetInput(window)
    image.ReadFrontBufferOff()
    writer = module("vtkmodules.vtkIOImage", "python3-vtk9").vtkPNGWriter()
    writer.SetFileName(picture)
    writer.SetInputConnection(image.GetOutputPort())
    writer.Write()


io = module("vtkmodules.vtkIOXML", "python3-vtk9")
if inside:
    module("vtkmodules.vtkRenderingOpenGL2", "python3-vtk9")
    core = module("vtkmodules.vtkCommonCore", "python3-vtk9")
    data = module("vtkmodules.vtkCommonDataModel", "python3-vtk9")
    filters = module("vtkmodules.vtkFiltersCore", "python3-vtk9")
    rendering = module("vtkmodules.vtkRenderingCore", "python3-vtk9")
    draw(*sys.argv[sys.argv.index("--draw") + 1:])
else:
    if not shutil.which("xvfb-run"):
        skip("xvfb is not installed")
    program = Program()
    program.combine_body()
    files = [program.at(name) for name in ("body.vti", "body.vtu", "vtk.png")]
    program.run("export", program.at("body.hpsdf"), "-o", files[0], "--resolution", "128")
    program.run("export", program.at("body.hpsdf"), "-o", files[1])
    made = subprocess.run(["xvfb-run", "-a", sys.executable, str(Path(__file__)), "--draw", *files], capture_output=True,
                          text=True, timeout=100)
    assert made.returncode == 0, made.stderr
    check_picture(files[2], "vtk.png")
