#include "hpsdf/detail/sign_check.h"

#include <cmath>
#include <mutex>
#include <numbers>

#include "hpsdf/error.h"
#include "hpsdf/mesh_report.h"
#include "sign/solid_angle.h"
#include "util/chunks.h"
#include "util/random_points.h"

namespace hpsdf {
namespace {

constexpr std::size_t kTogether = 16;  // places of one piece of work

/// Even numbers in a box, odd ones beside a triangle.
Vector3 placeOf(const TriangleMesh& mesh, const Box& box, Random random, std::size_t number) {
  if (number % 2 == 0) return random.inBox(box);
  const auto count = static_cast<double>(mesh.triangles.size());
  const auto& [a, b, c] = mesh.triangles[static_cast<std::size_t>(random.unit() * count)];
  double u = random.unit(), v = random.unit();
  if (u + v > 1) u = 1 - u, v = 1 - v;
  const Vector3 foot = (1 - u - v) * mesh.vertices[a] + u * mesh.vertices[b] + v * mesh.vertices[c];
  return foot + random.inBall(0.01 * box.sizes().maxCoeff());
}

/// Of some of the places; the same in whatever order they are added.
struct Tally {
  std::size_t tooNear = 0;
  std::size_t wrong = 0;
  double depth = 0;       ///< of the wrong ones, the greatest
  std::size_t worst = 0;  ///< the number of the first that is so deep

  void add(const Tally& other) {
    tooNear += other.tooNear;
    wrong += other.wrong;
    if (other.depth < depth || (other.depth == depth && other.worst >= worst)) return;
    depth = other.depth;
    worst = other.worst;
  }
};

}  // namespace

double windingNumber(const TriangleMesh& mesh, const Vector3& x) {
  distance::AngleSum angles;
  for (const auto& [a, b, c] : mesh.triangles)
    addHalfAngle(mesh.vertices[a] - x, mesh.vertices[b] - x, mesh.vertices[c] - x, angles);
  return angles.value() / (2 * std::numbers::pi);
}

SignCheck checkSign(const TriangleMesh& mesh, const ExactDistance& distance, std::size_t places, std::uint64_t seed,
                    const Progress& progress) {
  const MeshReport report = inspect(mesh);
  const double level = report.unbalancedEdges == 0 && report.volume < 0 ? -0.5 : 0.5;  // of one that looks inwards
  const Box& surface = distance.source().box;
  const double size = surface.sizes().maxCoeff();
  const Vector3 beyond = Vector3::Constant(0.1 * size);
  const Box box(surface.min() - beyond, surface.max() + beyond);
  SignCheck check{.places = places, .nearest = 1e-6 * size};
  Tally all;
  std::mutex adding;
  forEachChunk(places, kTogether, progress, "asking all triangles",
               [&](std::size_t, std::size_t first, std::size_t count) {
                 Tally tally;
                 for (std::size_t i = first; i < first + count; ++i) {
                   const Vector3 place = placeOf(mesh, box, Random(seed, i), i);
                   const double found = distance(place), away = std::abs(found);
                   if (!(away > check.nearest))
                     tally.add({.tooNear = 1});
                   else if ((found < 0) != (windingNumber(mesh, place) > level))
                     tally.add({.wrong = 1, .depth = away, .worst = i});
                 }
                 const std::lock_guard lock(adding);
                 all.add(tally);
               });
  check.tooNear = all.tooNear;
  check.wrong = all.wrong;
  check.depth = all.depth;
  if (all.wrong > 0) check.worst = placeOf(mesh, box, Random(seed, all.worst), all.worst);
  return check;
}

}  // namespace hpsdf
