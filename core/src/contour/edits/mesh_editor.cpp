#include "contour/edits/mesh_editor.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "contour/cells/triangle_errors.h"
#include "contour/edits/surface_points.h"
#include "hpsdf/mesh_report.h"
#include "surface/crossings.h"
#include "util/chunks.h"

namespace hpsdf::contouring {
namespace {

constexpr std::size_t kNoEdit = ~std::size_t{0};

/// Triangles that are flatter than this, as the ratio of their height to their longest side, are made only where there
/// were flatter ones.
constexpr double kFlattest = 0.05;

/// Returns the cosines of the angles between the normals of triangles and those of the surface in their middles; 0 for
/// a triangle without an area, or where the function has no gradient.
std::vector<double> cosinesOf(const ImplicitSurface& surface, std::span<const Corners> triangles) {
  std::vector<Vector3> middles;
  for (const auto& [a, b, c] : triangles) middles.emplace_back((a + b + c) / 3);
  std::vector<ValueAndGradient> found(middles.size());
  surface.valuesAndGradients(middles, found);
  std::vector<double> cosines;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& [a, b, c] = triangles[i];
    const Vector3 normal = (b - a).cross(c - a);
    const double lengths = normal.norm() * found[i].gradient.norm();
    cosines.push_back(lengths > 0 ? normal.dot(found[i].gradient) / lengths : 0);
  }
  return cosines;
}

/// The triangles of a mesh as they would be after some edits.
struct Trial {
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> places;  ///< by triangle: the one before the edits in whose place it is
  std::vector<bool> isTested;         ///< by triangle: it is to be tested for crossings
};

/// Returns the triangles after those edits that are made. `editOf` tells which edit removes a triangle, or kNoEdit;
/// `isTested`, by edit, whether the triangles in its place are to be tested.
Trial trialOf(std::span<const Triangle> triangles, std::span<const Edit> edits, std::span<const std::size_t> editOf,
              const std::vector<bool>& isMade, const std::vector<bool>& isTested) {
  Trial trial;
  const auto add = [&](const Triangle& triangle, std::uint32_t place) {
    trial.triangles.push_back(triangle);
    trial.places.push_back(place);
    trial.isTested.push_back(editOf[place] != kNoEdit && isTested[editOf[place]]);
  };
  for (std::uint32_t n = 0; n < triangles.size(); ++n) {
    if (editOf[n] == kNoEdit || !isMade[editOf[n]]) {
      add(triangles[n], n);
      continue;
    }
    const Edit& edit = edits[editOf[n]];
    const auto place = static_cast<std::size_t>(std::ranges::find(edit.removed, n) - edit.removed.begin());
    if (place < edit.added.size()) add(edit.added[place], n);
  }
  return trial;
}

/// Returns the ratio of a triangle's height to its longest side, √3/2 at most.
double flatness(const Corners& corners) {
  const auto& [a, b, c] = corners;
  const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return longest > 0 ? (b - a).cross(c - a).norm() / longest : 0;
}

}  // namespace

std::vector<std::size_t> MeshEditor::independent(std::span<const Edit> edits) const {
  std::vector<bool> isUsed(mesh_.vertices().size());
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < edits.size(); ++i) {
    const auto forEachVertex = [&](const auto& visit) {
      for (const std::uint32_t n : edits[i].removed)
        for (const std::uint32_t vertex : mesh_.triangles()[n]) visit(vertex);
    };
    bool isFree = true;
    forEachVertex([&](std::uint32_t vertex) { isFree = isFree && !isUsed[vertex]; });
    if (!isFree) continue;
    forEachVertex([&](std::uint32_t vertex) { isUsed[vertex] = true; });
    chosen.push_back(i);
  }
  return chosen;
}

/// Returns true if no triangle that is added is folded over, or fewer than before, and none is flatter than all that
/// are removed. Triangles are given by their corners.
bool MeshEditor::isShapely(std::span<const Corners> removed, std::span<const Corners> added) const {
  double allowed = kFlattest;
  for (const Corners& corners : removed) allowed = std::min(allowed, flatness(corners));
  if (!std::ranges::all_of(added, [&](const Corners& corners) { return flatness(corners) >= allowed; })) return false;
  const auto folded = [&](std::span<const Corners> triangles) {
    return std::ranges::count_if(cosinesOf(surface_, triangles), [](double cosine) { return cosine < kFolded; });
  };
  const auto left = folded(added);
  return left == 0 || left < folded(removed);
}

/// Returns the greatest errors of the triangles that are added, which are given by their corners; the search ends where
/// they exceed the tolerance.
MeshErrors MeshEditor::distancesAfter(const Edit& edit, std::span<const Corners> removed,
                                      std::span<const Corners> added) const {
  const NearTriangles near(added);
  double squaredGap = 0;
  const auto measure = [&](const Vector3& point) {
    if (squaredGap <= limits_.tolerance * limits_.tolerance) near.raise(squaredGap, point);
  };
  if (mesh_.hasPoints()) {
    for (const std::uint32_t n : edit.removed) mesh_.forEachPointOf(n, measure);
  } else {
    for (const SurfacePoint& point : surfacePointsNear(surface_, limits_, removed)) measure(point.position);
  }
  MeshErrors errors{.value = 0, .gap = std::sqrt(squaredGap)};
  if (errors.gap > limits_.tolerance) return errors;
  std::vector<double> values(added.size());
  raiseErrors([&](auto points, auto found) { surface_.values(points, found); }, added, limits_.tolerance,
              limits_.spacing, values);
  errors.value = std::ranges::max(values);
  return errors;
}

/// Returns the errors of the triangles that are added, or std::nullopt if the edit must not be made.
std::optional<MeshErrors> MeshEditor::errorsAfter(const Edit& edit) const {
  if (edit.vertex) {
    double value = 0;
    surface_.values({&edit.position, 1}, {&value, 1});
    if (!(std::abs(value) <= limits_.accuracy)) return std::nullopt;
  }
  std::vector<Corners> removed, added;
  for (const std::uint32_t n : edit.removed) removed.push_back(mesh_.corners(n));
  for (const Triangle& triangle : edit.added) added.push_back(mesh_.cornersAfter(edit, triangle));
  if (!isShapely(removed, added)) return std::nullopt;
  const MeshErrors errors = distancesAfter(edit, removed, added);
  if (errors.gap > limits_.tolerance || errors.value > limits_.tolerance) return std::nullopt;
  return errors;
}

/// Clears the marks of edits after which the mesh would cross itself.
void MeshEditor::leaveOutCrossing(std::span<const Edit> edits, std::vector<bool>& isMade) const {
  std::vector<Vector3> vertices(mesh_.vertices().begin(), mesh_.vertices().end());
  std::vector<std::size_t> editOf(mesh_.triangles().size(), kNoEdit);
  for (std::size_t i = 0; i < edits.size(); ++i) {
    if (!isMade[i]) continue;
    if (edits[i].vertex) vertices[*edits[i].vertex] = edits[i].position;
    for (const std::uint32_t n : edits[i].removed) editOf[n] = i;
  }
  std::vector<bool> isTested(edits.size(), true);
  for (;;) {
    const Trial trial = trialOf(mesh_.triangles(), edits, editOf, isMade, isTested);
    const Crossings crossings = surface::findCrossingsOf({vertices, trial.triangles, "contour"}, trial.isTested,
                                                         kMaxCrossings, Progress{.cancelled = progress_.cancelled});
    std::vector<std::size_t> wrong;
    for (const Crossing& crossing : crossings.found)
      for (const std::uint32_t triangle : crossing.triangles) wrong.push_back(editOf[trial.places[triangle]]);
    std::erase_if(wrong, [&](std::size_t edit) { return edit == kNoEdit || !isMade[edit]; });
    if (wrong.empty()) return;
    // Where all crossings are known, new ones can only be those of triangles that are as before again.
    isTested.assign(edits.size(), !crossings.complete);
    for (const std::size_t edit : wrong) {
      isMade[edit] = false;
      isTested[edit] = true;
      if (const auto vertex = edits[edit].vertex) vertices[*vertex] = mesh_.vertices()[*vertex];
    }
  }
}

std::vector<bool> MeshEditor::make(std::span<const Edit> edits) {
  constexpr std::size_t kAtOnce = 16;
  std::vector<std::optional<MeshErrors>> errors(edits.size());
  detail::forEachChunk(edits.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    progress_.throwIfCancelled();
    for (std::size_t i = first; i < first + count; ++i) errors[i] = errorsAfter(edits[i]);
  });
  std::vector<bool> isMade(edits.size());
  for (std::size_t i = 0; i < edits.size(); ++i) isMade[i] = errors[i].has_value();
  if (std::ranges::count(isMade, true) == 0) return isMade;
  leaveOutCrossing(edits, isMade);
  std::vector<Edit> made;
  for (std::size_t i = 0; i < edits.size(); ++i) {
    if (!isMade[i]) continue;
    made.push_back(edits[i]);
    errors_ = {std::max(errors_.value, errors[i]->value), std::max(errors_.gap, errors[i]->gap), 0};
  }
  mesh_.make(made);
  return isMade;
}

std::vector<double> MeshEditor::cosines() const {
  constexpr std::size_t kAtOnce = 256;
  std::vector<double> cosines(mesh_.triangles().size());
  detail::forEachChunk(cosines.size(), kAtOnce, [&](std::size_t, std::size_t first, std::size_t count) {
    std::vector<Corners> triangles;
    for (std::size_t n = first; n < first + count; ++n)
      triangles.push_back(mesh_.corners(static_cast<std::uint32_t>(n)));
    std::ranges::copy(cosinesOf(surface_, triangles), cosines.begin() + static_cast<std::ptrdiff_t>(first));
  });
  return cosines;
}

}  // namespace hpsdf::contouring
