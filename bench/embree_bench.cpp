// Distances by Embree's point query: unsigned, in single precision; the distance to a triangle is computed here.

#include <embree3/rtcore.h>
#include <pmmintrin.h>

#include <cmath>
#include <limits>
#include <vector>

#include "peer_points.h"

namespace hpsdf::bench {
namespace {

using Eigen::Vector3f;

/// Treats denormal numbers as zero on this thread during its lifetime, as Embree recommends for speed.
class FlushToZero {
 public:
  FlushToZero() { _mm_setcsr(before_ | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON); }
  ~FlushToZero() { _mm_setcsr(before_); }
  FlushToZero(const FlushToZero&) = delete;
  FlushToZero& operator=(const FlushToZero&) = delete;

 private:
  unsigned before_ = _mm_getcsr();
};

/// Squared distance of x from triangle abc (Ericson, Real-Time Collision Detection, 5.1.5).
float squaredDistance(const Vector3f& x, const Vector3f& a, const Vector3f& b, const Vector3f& c) {
  const Vector3f ab = b - a, ac = c - a, ax = x - a;
  const float d1 = ab.dot(ax), d2 = ac.dot(ax);
  if (d1 <= 0 && d2 <= 0) return ax.squaredNorm();
  const Vector3f bx = x - b;
  const float d3 = ab.dot(bx), d4 = ac.dot(bx);
  if (d3 >= 0 && d4 <= d3) return bx.squaredNorm();
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return (ax - ab * (d1 / (d1 - d3))).squaredNorm();
  const Vector3f cx = x - c;
  const float d5 = ab.dot(cx), d6 = ac.dot(cx);
  if (d6 >= 0 && d5 <= d6) return cx.squaredNorm();
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return (ax - ac * (d2 / (d2 - d6))).squaredNorm();
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return (bx - (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))).squaredNorm();
  const float scale = 1 / (va + vb + vc);
  return (ax - ab * (vb * scale) - ac * (vc * scale)).squaredNorm();
}

class EmbreeMesh {
 public:
  explicit EmbreeMesh(const TriangleMesh& mesh) : triangles_(mesh.triangles) {
    for (const Vector3& v : mesh.vertices) vertices_.push_back(v.cast<float>());
    vertices_.emplace_back();  // padding: Embree reads 16 bytes at each vertex
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices_.data(), 0,
                               sizeof(Vector3f), mesh.vertices.size());
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, triangles_.data(), 0,
                               sizeof(triangles_[0]), triangles_.size());
    rtcSetGeometryPointQueryFunction(geometry, visit);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
    rtcCommitScene(scene_);
  }
  ~EmbreeMesh() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeMesh(const EmbreeMesh&) = delete;
  EmbreeMesh& operator=(const EmbreeMesh&) = delete;

  struct Nearest {
    const EmbreeMesh* mesh;
    unsigned triangle;
    float distance;
  };

  /// Returns the unsigned distance; the search radius starts as the distance to triangle `start`.
  Nearest nearestFrom(const Vector3f& x, unsigned start) const {
    return search(x, {this, start, distanceTo(x, start)});
  }
  Nearest nearest(const Vector3f& x) const { return search(x, {this, 0, std::numeric_limits<float>::infinity()}); }

 private:
  float distanceTo(const Vector3f& x, unsigned triangle) const {
    const auto& [a, b, c] = triangles_[triangle];
    return std::sqrt(squaredDistance(x, vertices_[a], vertices_[b], vertices_[c]));
  }

  Nearest search(const Vector3f& x, Nearest best) const {
    RTCPointQuery query{x.x(), x.y(), x.z(), 0, best.distance};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_, &query, &context, nullptr, &best);
    return best;
  }

  /// Embree's callback for a triangle within the search radius; returns true if it has reduced the radius.
  static bool visit(RTCPointQueryFunctionArguments* arguments) {
    Nearest& best = *static_cast<Nearest*>(arguments->userPtr);
    RTCPointQuery& query = *arguments->query;
    const float distance = best.mesh->distanceTo({query.x, query.y, query.z}, arguments->primID);
    if (distance >= best.distance) return false;
    best.distance = query.radius = distance;
    best.triangle = arguments->primID;
    return true;
  }

  std::vector<Vector3f> vertices_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  RTCDevice device_ = rtcNewDevice(nullptr);
  RTCScene scene_ = rtcNewScene(device_);
};

const EmbreeMesh& embreeBunny() {
  static const EmbreeMesh mesh(bunny());
  return mesh;
}

/// Fails a benchmark whose distances differ from ours, because their times would not be comparable.
void check(benchmark::State& state, const std::vector<Vector3>& points, const std::vector<float>& distances) {
  std::vector<double> exact(points.size());
  bunnyDistance()(points, exact);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (std::abs(std::abs(exact[i]) - double(distances[i])) > 1e-5) state.SkipWithError("wrong distances");
}

void construction(benchmark::State& state) {
  const EmbreeMesh& mesh = embreeBunny();
  const std::vector<Vector3>& points = constructionPoints().points;
  std::vector<float> out(points.size());
  timeEach(state, points.size(), [&] {
    const FlushToZero mode;
    EmbreeMesh::Nearest last{&mesh, 0, 0};
    for (std::size_t i = 0; i < points.size(); ++i) {
      last = mesh.nearestFrom(points[i].cast<float>(), last.triangle);
      out[i] = last.distance;
    }
  });
  check(state, points, out);
}

void uniform(benchmark::State& state) {
  const EmbreeMesh& mesh = embreeBunny();
  const std::vector<Vector3> points = uniformPoints(kUniformPoints);
  std::vector<float> out(points.size());
  timeEach(state, points.size(), [&] {
    const FlushToZero mode;
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = mesh.nearest(points[i].cast<float>()).distance;
  });
  check(state, points, out);
}

BENCHMARK(construction)->Name("distance/construction/embree");
BENCHMARK(uniform)->Name("distance/uniform/embree");

}  // namespace
}  // namespace hpsdf::bench
