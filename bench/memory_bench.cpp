// Peak memory of the construction of the bunny's field, measured in a separate process.

#include <malloc.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

#include "scene.h"

namespace hpsdf::bench {
namespace {

double peakBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_maxrss) * 1024;
}

double meshBytes(const TriangleMesh& mesh) {
  return double(mesh.vertices.size() * sizeof(mesh.vertices[0]) + mesh.triangles.size() * sizeof(mesh.triangles[0]));
}

struct Bytes {
  double peak;  ///< in bytes, above the memory that the process held before, plus the mesh
  double field;
  double meshAndHierarchy;
};

Bytes constructAndMeasure(const TriangleMesh& mesh) {
  const double before = peakBytes();
  const ExactDistance distance(mesh);
  const Field field =
      build(distance, paperDomain(), {.targetError = 1e-6, .coefficients = CoefficientType::float64, .threads = 2});
  return {peakBytes() - before + meshBytes(mesh), double(field.bytes()), meshBytes(mesh) + double(distance.bytes())};
}

/// Measures in a forked child, whose peak excludes reading the mesh. The caller must have no other threads.
Bytes measureInChild(const TriangleMesh& mesh) {
  malloc_trim(0);  // otherwise the construction could reuse memory freed by the mesh reader, which would not count
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no child process");
  if (child == 0) {
    const Bytes bytes = constructAndMeasure(mesh);
    const bool written = write(ends[1], &bytes, sizeof bytes) == sizeof bytes;
    _exit(written ? 0 : 1);
  }
  close(ends[1]);
  Bytes bytes{};
  const bool received = read(ends[0], &bytes, sizeof bytes) == sizeof bytes;
  close(ends[0]);
  waitpid(child, nullptr, 0);
  if (!received) throw std::runtime_error("the construction in a child process failed");
  return bytes;
}

void construction(benchmark::State& state) {
  const TriangleMesh mesh = testMesh("paper/bunny_69k.obj");
  Bytes bytes{};
  for ([[maybe_unused]] auto _ : state) bytes = measureInChild(mesh);
  state.counters["peak"] = bytes.peak;
  state.counters["field"] = bytes.field;
  state.counters["mesh_and_hierarchy"] = bytes.meshAndHierarchy;
}

BENCHMARK(construction)->Name("memory/bunny")->UseRealTime()->Iterations(1);

}  // namespace
}  // namespace hpsdf::bench
