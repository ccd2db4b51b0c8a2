#include "picture/describe.h"

namespace hpsdf::render {
namespace {

/// Formats ascending levels (degrees or depths) as text, as in "2, 4–6".
std::string describeRuns(const std::vector<int>& levels) {
  std::string text;
  for (std::size_t i = 0, last; i < levels.size(); i = last + 1) {
    for (last = i;
         last + 1 < levels.size() && levels[last + 1] == levels[last] + 1 && levels[last + 1] != kExactDegree;)
      ++last;
    text += (i == 0 ? "" : ", ") + levelName(levels[i]);
    if (last > i) text += "–" + levelName(levels[last]);
  }
  return text;
}

}  // namespace

std::string formatVector(const Vector3& v, int digits) {
  return "(" + formatNumber(v.x(), digits) + ", " + formatNumber(v.y(), digits) + ", " + formatNumber(v.z(), digits) +
         ")";
}

std::string describeSource(const Field& field) {
  const std::string& name = field.metadata().source.name;
  return name.empty() ? "unnamed field" : name;
}

std::string describeTarget(const Field& field) {
  const BuildOptions& settings = field.metadata().settings;
  if (settings.tolerance > 0) return "tolerance " + formatNumber(settings.tolerance, 3);
  return "τ = " + formatNumber(settings.targetError.weighted(), 3);
}

std::string describePlane(const std::string& name, const Plane& plane) {
  if (const auto* axis = std::get_if<AxisPlane>(&plane))
    return name + " " + "xyz"[axis->axis] + " = " + formatNumber(axis->offset);
  const auto& free = std::get<FreePlane>(plane);
  return name + " through " + formatVector(free.point) + " with normal " + formatVector(free.normal);
}

std::string describeCells(const ShownCells& cells) {
  const bool onlyExact = cells.degrees == std::vector<int>{kExactDegree};
  std::string text = cells.style == CellStyle::lines ? "edges of " : "";
  text += onlyExact ? "exact cells" : "cells";
  if (!cells.degrees.empty() && !onlyExact) text += " of degree " + describeRuns(cells.degrees);
  if (!cells.depths.empty())
    text += std::string(cells.degrees.empty() || onlyExact ? " of" : ",") + " depth " + describeRuns(cells.depths);
  return cells.atSurface ? text + " at the surface" : text;
}

std::string describeCamera(const OrbitCamera& camera) {
  return (camera.projection == Projection::orthographic ? "orthographic camera " : "camera ") +
         formatNumber(camera.azimuthDegrees) + "°, " + formatNumber(camera.elevationDegrees) + "°" +
         (camera.target ? " at " + formatVector(*camera.target) : "");
}

std::string describeCracks(const Cracks& cracks) {
  if (cracks.pixels == 0) return "no cracks";
  return "cracks (violet) in " + formatCount(cracks.pixels) + (cracks.pixels == 1 ? " pixel" : " pixels") + ", up to " +
         formatNumber(cracks.widest, 3);
}

std::string describeLevels(const std::map<int, double>& shares) {
  const bool hasExact = shares.contains(kExactDegree);
  if (hasExact && shares.size() == 1) return levelName(kExactDegree);
  const int first = shares.begin()->first, last = std::prev(shares.end(), hasExact ? 2 : 1)->first;
  const std::string range = first == last ? levelName(first) : levelName(first) + "–" + levelName(last);
  return hasExact ? range + ", " + levelName(kExactDegree) : range;
}

std::string describeBytes(std::size_t bytes) {
  return bytes < 1000000 ? printed("%.1f kB", double(bytes) / 1e3) : printed("%.2f MB", double(bytes) / 1e6);
}

std::string describeGreatest(const std::vector<float>& values) {
  float greatest = -1;
  for (const float value : values)
    if (value > greatest) greatest = value;
  return greatest < 0 ? "nothing shown" : "up to " + formatNumber(greatest, 3);
}

}  // namespace hpsdf::render
