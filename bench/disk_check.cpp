// Compares distances to a mesh in parts on the disk with brute force, at 10,000 places, and their time with that of the
// mesh in memory. `bench/out_of_core` calls it.
//
//   hpsdf_disk_check MESH.ply PARTS SAME.ply
//
// SAME.ply is a mesh of the same surface, with fewer triangles, which are tried one by one.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <iostream>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "hpsdf/hpsdf.h"

namespace {

using hpsdf::Vector3;
using Seconds = std::chrono::duration<double>;

constexpr std::size_t kBatch = 50;

/// Returns the squared distance from the origin to the segment from a to b.
double squaredToSegment(const Vector3& a, const Vector3& b) {
  const Vector3 along = b - a;
  const double t = std::clamp(-a.dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (a + t * along).squaredNorm();
}

/// Returns the squared distance from the origin to a triangle: that to its plane, if the origin projects into the
/// triangle, else that to its nearest side.
double squaredToTriangle(const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 normal = (b - a).cross(c - a);
  if (a.cross(b).dot(normal) >= 0 && b.cross(c).dot(normal) >= 0 && c.cross(a).dot(normal) >= 0) {
    const double height = a.dot(normal);
    return height * height / normal.squaredNorm();
  }
  return std::min({squaredToSegment(a, b), squaredToSegment(b, c), squaredToSegment(c, a)});
}

/// Returns places in and around the box of a mesh and, every other one, near one of its vertices.
std::vector<Vector3> placesAround(const hpsdf::TriangleMesh& mesh) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(-1, 1);
  const auto vector = [&] { return Vector3(anywhere(random), anywhere(random), anywhere(random)); };
  const hpsdf::Box box = boundingBox(mesh);
  std::vector<Vector3> places(10000);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vector3& vertex = mesh.vertices[random() % mesh.vertices.size()];
    places[i] = i % 2 == 0 ? Vector3(vertex + 0.005 * box.sizes().maxCoeff() * vector())
                           : Vector3(box.center() + 0.55 * box.sizes().cwiseProduct(vector()));
  }
  return places;
}

std::vector<double> bruteForce(const hpsdf::TriangleMesh& mesh, std::span<const Vector3> places) {
  std::vector<double> squared(places.size(), std::numeric_limits<double>::infinity());
  tbb::parallel_for(std::size_t{0}, places.size() / kBatch, [&](std::size_t batch) {
    for (const hpsdf::Triangle& triangle : mesh.triangles) {
      const auto [a, b, c] = cornersOf(mesh, triangle);
      for (std::size_t i = batch * kBatch; i < (batch + 1) * kBatch; ++i)
        squared[i] = std::min(squared[i], squaredToTriangle(a - places[i], b - places[i], c - places[i]));
    }
  });
  for (double& value : squared) value = std::sqrt(value);
  return squared;
}

/// Returns the distances and the least time of five runs.
template <typename Distance>
std::pair<std::vector<double>, double> timed(const Distance& distance, std::span<const Vector3> places) {
  std::vector<double> values(places.size());
  double least = std::numeric_limits<double>::infinity();
  for (int run = 0; run < 5; ++run) {
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < places.size(); i += kBatch)
      distance(places.subspan(i, kBatch), std::span(values).subspan(i, kBatch));
    least = std::min(least, Seconds(std::chrono::steady_clock::now() - start).count());
  }
  return {values, least};
}

int check(const std::filesystem::path& file, const std::filesystem::path& parts, const std::filesystem::path& same) {
  const hpsdf::DistanceOnDisk onDisk(file, parts);
  const hpsdf::TriangleMesh mesh = hpsdf::importMesh(same).mesh;
  const hpsdf::ExactDistance inMemory(mesh);
  const std::vector<Vector3> places = placesAround(mesh);
  const auto [values, seconds] = timed(onDisk, places);
  const auto [expected, secondsInMemory] = timed(inMemory, places);
  const std::vector<double> unsignedValues = bruteForce(mesh, places);
  double worst = 0;
  std::size_t otherSigns = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    worst = std::max(worst, std::abs(std::abs(values[i]) - unsignedValues[i]));
    otherSigns += (values[i] < 0) != (expected[i] < 0);
  }
  std::cout << "from brute force " << worst << " at most, other signs " << otherSigns << ", time "
            << seconds / secondsInMemory << " of that of " << mesh.triangles.size() << " triangles in memory, "
            << onDisk.bytesOnDisk() << " bytes in " << onDisk.parts() << " parts\n";
  return worst < 1e-12 && otherSigns == 0 ? 0 : 1;
}

}  // namespace

int main(int count, char** words) {
  if (count != 4) {
    std::cerr << "usage: hpsdf_disk_check MESH.ply PARTS SAME.ply\n";
    return 2;
  }
  try {
    return check(words[1], words[2], words[3]);
  } catch (const std::exception& error) {
    std::cerr << "hpsdf_disk_check: " << error.what() << "\n";
    return 2;
  }
}
