#include "hpsdf/build.h"

#include <span>

#include "arguments.h"
#include "call.h"
#include "handles.h"

using namespace hpsdf;

namespace hpsdf::c {
namespace {

/// A function of the caller's as a distance.
struct CallerFunction {
  hpsdf_function function;
  void* user;

  void operator()(std::span<const Vector3> points, std::span<double> out) const {
    const int code = function(user, reinterpret_cast<const double*>(points.data()), points.size(), out.data());
    if (code != 0) throw CallbackError(code);
  }
};

double longestSideOf(const Box& surface) { return surface.isEmpty() ? 0 : surface.sizes().maxCoeff(); }

BuildOptions optionsFrom(const hpsdf_options* options, const Box& surface) {
  return (options == nullptr ? GivenSettings() : options->settings).options(longestSideOf(surface));
}

Box domainFrom(const double* box, const Box& surface) {
  if (box == nullptr) return domainAround(surface);
  return Box(Vector3(box[0], box[1], box[2]), Vector3(box[3], box[4], box[5]));
}

Field fieldOf(const DistanceFunction& distance, const double* box, const hpsdf_options* options,
              const hpsdf_progress* progress) {
  const Box& surface = distance.source().box;
  return build(distance, domainFrom(box, surface), optionsFrom(options, surface), progressOf(progress));
}

Field fieldOfMesh(const TriangleMesh& mesh, const double* box, const hpsdf_options* options,
                  const hpsdf_progress* progress) {
  const BuildOptions settings = optionsFrom(options, boundingBox(mesh));
  const Box any(Vector3::Constant(-1), Vector3::Constant(1));
  checkBuild(domainFrom(box, any), settings);  // before the distance is prepared, which takes longer
  const ExactDistance distance(mesh, {.threads = settings.threads}, progressOf(progress));
  return fieldOf(distance, box, options, progress);
}

}  // namespace
}  // namespace hpsdf::c

hpsdf_status hpsdf_build_mesh(const hpsdf_mesh* mesh, const double* box, const hpsdf_options* options,
                              const hpsdf_progress* progress, hpsdf_field** field) {
  return c::create(field, "field", [&] {
    c::requirePointer(mesh, "mesh");
    return c::fieldOfMesh(mesh->mesh, box, options, progress);
  });
}

hpsdf_status hpsdf_build_distance(const hpsdf_distance* distance, const double* box, const hpsdf_options* options,
                                  const hpsdf_progress* progress, hpsdf_field** field) {
  return c::create(field, "field", [&] {
    c::requirePointer(distance, "distance");
    return c::fieldOf(distance->distance, box, options, progress);
  });
}

hpsdf_status hpsdf_build_function(hpsdf_function function, void* user, const double* box, const hpsdf_options* options,
                                  const hpsdf_progress* progress, hpsdf_field** field) {
  return c::create(field, "field", [&] {
    if (function == nullptr) throw c::ArgumentError("function", "expected a function, got NULL");
    c::requirePointer(box, "box");
    return c::fieldOf(c::CallerFunction{function, user}, box, options, progress);
  });
}
