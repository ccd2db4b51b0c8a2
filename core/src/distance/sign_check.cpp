#include "hpsdf/detail/sign_check.h"

#include <cmath>
#include <numbers>

#include "hpsdf/detail/random_points.h"
#include "hpsdf/error.h"
#include "hpsdf/mesh_report.h"
#include "sign/solid_angle.h"
#include "util/chunks.h"

namespace hpsdf {
namespace {

constexpr std::size_t kSignsPerTask = 16;

/// Returns the random point with the index `number`. Even-numbered points lie in the box, odd-numbered points near a
/// triangle.
Vector3 randomPoint(const TriangleMesh& mesh, const Box& box, detail::Random random, std::size_t number) {
  if (number % 2 == 0) return random.inBox(box);
  const auto count = static_cast<double>(mesh.triangles.size());
  const auto [a, b, c] = cornersOf(mesh, mesh.triangles[static_cast<std::size_t>(random.unit() * count)]);
  double u = random.unit(), v = random.unit();
  if (u + v > 1) u = 1 - u, v = 1 - v;
  const Vector3 foot = (1 - u - v) * a + u * b + v * c;
  return foot + random.inBall(0.01 * box.sizes().maxCoeff());
}

/// Counts of the points that are too near to the surface to be checked and of the points with a wrong sign.
struct Tally {
  std::size_t tooNear = 0;
  std::size_t wrong = 0;
  double worstDistance = 0;  ///< greatest distance of a point with a wrong sign
  std::size_t worst = 0;     ///< lowest index of a wrong point at the distance `worstDistance`

  void add(const Tally& other) {
    tooNear += other.tooNear;
    wrong += other.wrong;
    if (other.worstDistance < worstDistance || (other.worstDistance == worstDistance && other.worst >= worst)) return;
    worstDistance = other.worstDistance;
    worst = other.worst;
  }
};

}  // namespace

double windingNumber(const TriangleMesh& mesh, const Vector3& x) {
  sign::AngleSum angles;
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = cornersOf(mesh, triangle);
    addHalfSolidAngle(a - x, b - x, c - x, angles);
  }
  return angles.value() / (2 * std::numbers::pi);
}

SignCheck checkSign(const TriangleMesh& mesh, const ExactDistance& distance, std::size_t points, std::uint64_t seed,
                    const Progress& progress) {
  const MeshReport report = inspect(mesh);
  const double level = report.unbalancedEdges == 0 && report.volume < 0 ? -0.5 : 0.5;  // -0.5 for an inward-facing mesh
  const Box& surface = distance.source().box;
  const double size = surface.sizes().maxCoeff();
  const Vector3 beyond = Vector3::Constant(0.1 * size);
  const Box box(surface.min() - beyond, surface.max() + beyond);
  SignCheck check{.points = points, .tolerance = 1e-6 * size};
  const auto compare = [&](Tally& tally, std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i) {
      const Vector3 x = randomPoint(mesh, box, detail::Random(seed, i), i);
      const double found = distance(x), away = std::abs(found);
      if (!(away > check.tolerance))
        tally.add({.tooNear = 1});
      else if ((found < 0) != (windingNumber(mesh, x) > level))
        tally.add({.wrong = 1, .worstDistance = away, .worst = i});
    }
  };
  const auto all =
      detail::unorderedSumOfChunks<Tally>(points, kSignsPerTask, progress, "summing winding numbers", compare);
  check.tooNear = all.tooNear;
  check.wrong = all.wrong;
  check.worstDistance = all.worstDistance;
  if (all.wrong > 0) check.worst = randomPoint(mesh, box, detail::Random(seed, all.worst), all.worst);
  return check;
}

}  // namespace hpsdf
