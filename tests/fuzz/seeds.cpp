// Writes the binary files of the fuzzing corpus: fields of every kind, states of constructions, grids, and raw
// values. Usage: fuzz_seeds tests/fuzz/corpus
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>

#include "checkpoint.h"
#include "hpsdf/build.h"
#include "hpsdf/error.h"
#include "hpsdf/field_file.h"
#include "hpsdf/output/grids.h"
#include "hpsdf/verify.h"
#include "target.h"

namespace {

using namespace hpsdf;
namespace fs = std::filesystem;

void write(const fs::path& file, const std::string& bytes) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << bytes;
}

/// Returns two octahedra that intersect each other, so that the signs of exact leaves follow from the winding number.
TriangleMesh overlappingOctahedra() {
  TriangleMesh mesh = fuzz::octahedron();
  const std::size_t vertices = mesh.vertices.size(), triangles = mesh.triangles.size();
  for (std::size_t v = 0; v < vertices; ++v) mesh.vertices.push_back(mesh.vertices[v] + Vector3(0.15, 0.1, 0.05));
  for (std::size_t t = 0; t < triangles; ++t) {
    Triangle triangle = mesh.triangles[t];
    for (std::uint32_t& corner : triangle) corner += static_cast<std::uint32_t>(vertices);
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

void writeFields(const fs::path& folder) {
  fs::create_directories(folder);
  const BuildOptions plain{.targetError = 1e-2, .grid = {2, 1, 1}, .maxDegree = 3, .maxDepth = 2, .threads = 1};
  const Source mesh{.name = "sphere.obj",
                    .fingerprint = 7,
                    .vertices = 8,
                    .faces = 12,
                    .box = fuzz::domain(),
                    .insideTest = InsideTest::pseudonormal};
  const auto addOf = [&](const Source& source, const std::string& name, const auto& change) {
    BuildOptions options = plain;
    change(options);
    save(build(DistanceFunction(fuzz::sphere, source), fuzz::domain(), options), folder / (name + ".hpsdf"));
  };
  const auto add = [&](const std::string& name, const auto& change) { addOf(mesh, name, change); };
  addOf({.name = "union(a.obj, b.hpsdf)", .exactness = Exactness::outside}, "combination", [](BuildOptions&) {});
  add("double", [](BuildOptions& o) { o.targetError = 1e-4, o.coefficients = CoefficientType::float64; });
  add("float", [](BuildOptions& o) { o.coefficients = CoefficientType::float32; });
  add("quantized", [](BuildOptions& o) { o.targetError = 1e-4, o.coefficients = CoefficientType::quantized; });
  add("shifted", [](BuildOptions& o) { o.targetError = 1e-3, o.maxError = 0.01, o.maxDegree = 3; });
  add("band", [](BuildOptions& o) { o.targetError = 1e-4, o.band = 0.2; });
  add("bounds", [](BuildOptions& o) { o.bounds = true; });
  add("blended", [](BuildOptions& o) { o.targetError = 1e-4, o.blend = 0.1, o.bounds = true; });
  add("weak", [](BuildOptions& o) { o.targetError = 1e-3, o.continuityWeight = 1, o.enrich = true; });
  add("h2", [](BuildOptions& o) { o.targetError = 1e-3, o.strategy = Strategy::h2, o.criterion = Criterion::optimal; });
  add("cell", [](BuildOptions& o) { o.grid = {1, 1, 1}, o.maxSteps = 0; });
  const ExactDistance octahedron(fuzz::octahedron(), {.insideTest = InsideTest::pseudonormal, .threads = 1});
  const ExactDistance overlapping(overlappingOctahedra(), {.threads = 1});
  const auto addExact = [&](const std::string& name, const ExactDistance& distance, const auto& change) {
    BuildOptions options = plain;
    options.grid = {3, 3, 3};
    options.strategy = Strategy::hpx;
    options.exactTriangles = 6;
    options.coefficients = CoefficientType::float32;
    change(options);
    save(build(distance, fuzz::domain(), options), folder / (name + ".hpsdf"));
  };
  addExact("exact", octahedron, [](BuildOptions&) {});
  addExact("exact-double", octahedron, [](BuildOptions& o) { o.coefficients = CoefficientType::float64; });
  addExact("exact-blended", octahedron, [](BuildOptions& o) { o.blend = 0.1, o.bounds = true; });
  addExact("exact-winding", overlapping, [](BuildOptions& o) { o.exactTriangles = 16; });
  save(withMeasurement(load(folder / "exact.hpsdf"), measure(load(folder / "exact.hpsdf"), octahedron)),
       folder / "measured.hpsdf");
  add("wide", [](BuildOptions& o) { o.grid = {5, 4, 3}, o.maxDegree = 1, o.maxDepth = 0; });
  for (const char* name : {"double", "float", "quantized", "bounds", "exact", "exact-double", "exact-winding"}) {
    const std::string file = std::string(name) + ".hpsdf";
    save(load(folder / file), folder / ("compressed-" + file), {.compress = true});
  }
}

/// Returns the checkpoint of a construction that ends when it has asked so many times whether to cancel; empty if it
/// has not written one by then.
std::string checkpointAfter(int questions, std::size_t construction) {
  const auto file = fuzz::fileOf("state", "");
  fs::remove(file);
  try {
    buildResumably(fuzz::distanceOf(construction), fuzz::domain(), fuzz::constructions()[construction],
                   {.file = file, .seconds = 0, .share = 1},
                   {.report = {}, .cancelled = [&] { return --questions < 0; }});
  } catch (const Cancelled&) {
  }
  return fs::exists(file) ? fuzz::bytesOf(file) : "";
}

void writeStates(const fs::path& folder) {
  constexpr int kMiddle = 12, kNever = 1 << 30;
  for (std::size_t which = 0; which < fuzz::constructions().size(); ++which) {
    int questions = kMiddle;
    while (checkpointAfter(questions, which).empty()) ++questions;
    for (const int last : {questions, kNever}) {  // interrupted in the middle, and ended
      const std::string whole = checkpointAfter(last, which);
      const std::size_t begin = fuzz::bytesBeforeState(whole);
      write(folder / ("state-" + std::to_string(which) + (last == kNever ? "-end" : "-middle")),
            std::string(1, static_cast<char>(which)) + whole.substr(begin, whole.size() - 8 - begin));
    }
  }
}

void writeTables(const fs::path& folder) {
  const std::array<float, 6> values = {0.5f, -1.25f, 3e38f, NAN, INFINITY, 0};
  std::string bytes(sizeof values, '\0');
  std::memcpy(bytes.data(), values.data(), sizeof values);
  write(folder / "slice.pfm", "Pf\n3 2\n-1.0\n" + bytes);
}

void writeGrids(const fs::path& corpus) {
  RegularGrid grid{.layout = {.points = {5, 4, 6}, .origin = Vector3(-1, 0, 2), .spacing = Vector3(0.5, 0.6, 0.4)},
                   .values = {},
                   .gradients = {}};
  for (std::size_t n = 0; n < grid.layout.count(); ++n)
    grid.values.push_back((grid.layout.position(n % 5, n / 5 % 4, n / 20) - grid.layout.box().center()).norm() - 0.7);
  fs::create_directories(corpus / "grid_vti");
  fs::create_directories(corpus / "grid_npy");
  for (const NumberType type : {NumberType::float32, NumberType::float64}) {
    const std::string name = type == NumberType::float32 ? "floats" : "doubles";
    OutputFile vti(corpus / "grid_vti" / (name + ".vti")), npy(corpus / "grid_npy" / (name + ".npy"));
    writeVti(grid, type, vti);
    writeNpy(grid, type, npy);
    vti.commit();
    npy.commit();
  }
  std::string ascii, raw;
  for (const double value : grid.values) {
    const auto number = static_cast<float>(value);
    ascii += std::to_string(number) + " ";
    raw.append(reinterpret_cast<const char*>(&number), sizeof(number));
  }
  const auto image = [](const std::string& array, const std::string& appended) {
    return "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\">\n<!-- a grid -->\n"
           "<ImageData WholeExtent=\"0 4 0 3 0 5\" Origin=\"-1 0 2\" Spacing=\"0.5 0.6 0.4\">\n"
           "<Piece Extent=\"0 4 0 3 0 5\">\n<PointData Scalars=\"d\">\n<DataArray type=\"Float32\" Name=\"d\" " +
           array + "</PointData>\n</Piece>\n</ImageData>\n" + appended + "</VTKFile>\n";
  };
  write(corpus / "grid_vti" / "text.vti", image("format=\"ascii\">\n" + ascii + "\n</DataArray>\n", ""));
  const auto bytes = static_cast<std::uint32_t>(raw.size());
  const std::string size(reinterpret_cast<const char*>(&bytes), sizeof(bytes));
  write(corpus / "grid_vti" / "appended.vti",
        image("format=\"appended\" offset=\"0\"/>\n",
              "<AppendedData encoding=\"raw\">_" + size + raw + "</AppendedData>\n"));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " FOLDER" << std::endl;
    return 1;
  }
  const fs::path corpus = argv[1];
  writeFields(corpus / "field_file");
  writeStates(corpus / "checkpoint");
  writeTables(corpus / "data_table");
  writeGrids(corpus);
}
