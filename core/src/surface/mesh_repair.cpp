#include "hpsdf/mesh_repair.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "bvh/hierarchy.h"
#include "mesh/directed_edges.h"
#include "mesh/orientation.h"
#include "mesh/patches.h"
#include "sign/inside.h"
#include "sign/winding.h"
#include "surface/bodies.h"

namespace hpsdf {
namespace {

/// Faces that are turned together.
struct Body {
  std::vector<std::uint32_t> faces;
  double area = 0, volume = 0;
  Box box;
  bool closed = false;
  bool solid = false;   ///< its volume tells inside from outside
  bool turned = false;  ///< is to be
};

Vector3 areaVector(const TriangleMesh& mesh, std::uint32_t face) {
  const auto& [a, b, c] = mesh.triangles[face];
  return (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]) / 2;
}

void turn(TriangleMesh& mesh, std::uint32_t face) { std::swap(mesh.triangles[face][1], mesh.triangles[face][2]); }

/// Makes the triangles of each patch look the way of the greater part of its area, but for those that cannot; how many
/// were turned.
std::size_t agree(TriangleMesh& mesh, const Patches& patches) {
  std::vector<double> area(patches.count), against(patches.count);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f)
    (patches.against[f] ? against : area)[patches.of[f]] += areaVector(mesh, f).norm();
  std::size_t turned = 0;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const std::uint32_t patch = patches.of[f];
    const char minority = against[patch] <= area[patch] ? 1 : 0;
    if (patches.oneSided[patch] || patches.against[f] != minority) continue;
    turn(mesh, f);
    ++turned;
  }
  return turned;
}

/// By patch; those that belong to another's body have no faces. What has one side only is no solid. Volumes are as of
/// tetrahedra between the triangles and the middle of the body's box.
std::vector<Body> measured(const TriangleMesh& mesh, const Patches& patches, const Bodies& bodies) {
  std::vector<Body> found(patches.count);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    Body& body = found[bodies.of[patches.of[f]]];
    body.faces.push_back(f);
    body.area += areaVector(mesh, f).norm();
    for (const std::uint32_t v : mesh.triangles[f]) body.box.extend(mesh.vertices[v]);
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    Body& body = found[i];
    if (body.faces.empty() || patches.oneSided[i]) continue;
    for (const std::uint32_t f : body.faces)
      body.volume += areaVector(mesh, f).dot(mesh.vertices[mesh.triangles[f][0]] - body.box.center()) / 3;
    body.closed = bodies.closed[i] != 0;
    body.solid = isPlain(body.volume, body.area, body.box, body.closed);
    body.turned = body.solid && body.volume < 0;
  }
  return found;
}

void turnBodies(TriangleMesh& mesh, const std::vector<Body>& bodies) {
  for (const Body& body : bodies)
    if (body.turned)
      for (const std::uint32_t f : body.faces) turn(mesh, f);
}

/// Winding numbers of some bodies.
class Around {
 public:
  Around(const TriangleMesh& mesh, std::span<const Body> bodies)
      : surface_(surfaceOf(mesh, bodies)), hierarchy_(surface_, boundingBox(surface_)), winding_(hierarchy_) {}
  Around(const Around&) = delete;
  Around& operator=(const Around&) = delete;

  /// To a quarter.
  double times(const Vector3& place) const {
    return winding_.within(place, 0.25, [](const auto&) { return false; }).value;
  }

 private:
  /// With the corners of each face its own, so that a small part of a large mesh takes little.
  static TriangleMesh surfaceOf(const TriangleMesh& mesh, std::span<const Body> bodies) {
    TriangleMesh surface{.vertices = {}, .triangles = {}, .name = mesh.name};
    for (const Body& body : bodies) {
      if (!body.solid) continue;
      for (const std::uint32_t f : body.faces) {
        const auto first = static_cast<std::uint32_t>(surface.vertices.size());
        surface.triangles.push_back({first, first + 1, first + 2});
        for (const std::uint32_t v : mesh.triangles[f]) surface.vertices.push_back(mesh.vertices[v]);
      }
    }
    return surface;
  }

  TriangleMesh surface_;
  distance::Hierarchy hierarchy_;
  distance::Winding winding_;
};

/// Places spread evenly over a body's area, so far before it.
std::vector<Vector3> placesBefore(const TriangleMesh& mesh, const Body& body, double aside) {
  constexpr int kPlaces = 32;
  constexpr double kStepAlong = 0.7548776662466927, kStepAcross = 0.5698402909980532;  // Roberts' R2 sequence
  std::vector<Vector3> places;
  double passed = 0;
  for (const std::uint32_t f : body.faces) {
    const Vector3 area = areaVector(mesh, f);
    passed += area.norm();
    for (double n = 0.5 + static_cast<double>(places.size()); n * body.area <= passed * kPlaces; ++n) {
      double along = n * kStepAlong - std::floor(n * kStepAlong),
             across = n * kStepAcross - std::floor(n * kStepAcross);
      if (along + across > 1) {
        along = 1 - along;
        across = 1 - across;
      }
      const auto& [a, b, c] = mesh.triangles[f];
      places.push_back(mesh.vertices[a] + along * (mesh.vertices[b] - mesh.vertices[a]) +
                       across * (mesh.vertices[c] - mesh.vertices[a]) + aside * area.stableNormalized());
    }
  }
  return places;
}

/// What the mesh as it was given says of the way a body looks.
enum class Given { unclear, right, inwards };

/// Of three quarters and more of such places before it and behind it, leaving out those where something else of the
/// mesh takes the body back. `right`: outside before it, inside behind it. `inwards`: so it would be with all turned.
/// Where it is both, because a body touches another that looks the other way, it is as its volume has it, `byVolume`.
Given givenWay(const Around& given, const std::vector<Vector3>& before, const std::vector<Vector3>& behind,
               Given byVolume) {
  std::ptrdiff_t right = 0, inwards = 0, left = std::ssize(before), all = left;
  const auto isMost = [&](std::ptrdiff_t count) { return 4 * count >= 3 * all && count > 0; };
  const auto canBeMost = [&](std::ptrdiff_t count) { return 4 * (count + left) >= 3 * all; };
  for (std::size_t n = 0; n < before.size() && (canBeMost(right) || canBeMost(inwards)); ++n, --left) {
    const long from = std::lround(given.times(before[n])), to = std::lround(given.times(behind[n]));
    all -= from == to;
    const bool isRight = from <= 0 && to >= 1, isInwards = from <= -1 && to >= 0;
    right += isRight && !(isInwards && byVolume == Given::inwards);
    inwards += isInwards && !(isRight && byVolume == Given::right);
  }
  return isMost(right) ? Given::right : isMost(inwards) ? Given::inwards : Given::unclear;
}

/// Sets anew which bodies are turned, where there are several solids and any of them was:
/// - one stays that has the outside before it and the inside behind it as given, such as a cavity,
/// - one is turned that had so were all turned, such as a cavity of a shell that looks inwards, and its outer side; but
///   none that is open and looks outwards: what surrounds it is less plain than its volume,
/// - of the others, one that looks inwards is turned but for a cavity: for three quarters of its area and more within
///   an odd number of other solids. What merely reaches into another is none; cavities may reach a little into each
///   other.
/// `outward`: as it is with all solids looking outwards.
void spareCavities(const TriangleMesh& given, const TriangleMesh& outward, std::vector<Body>& bodies) {
  if (std::ranges::count_if(bodies, &Body::solid) < 2 || std::ranges::none_of(bodies, &Body::turned)) return;
  const Around all(outward, bodies), asGiven(given, bodies);
  const double aside = distance::besideSurface(boundingBox(given));
  tbb::parallel_for(std::size_t{0}, bodies.size(), [&](std::size_t i) {
    Body& body = bodies[i];
    if (!body.solid) return;
    const std::vector<Vector3> before = placesBefore(given, body, aside), behind = placesBefore(given, body, -aside);
    const Given way = givenWay(asGiven, before, behind, body.turned ? Given::inwards : Given::right);
    if (way == Given::unclear && body.turned) {
      const Around itself(outward, {&body, 1});
      const auto within = std::ranges::count_if(behind, [&](const Vector3& x) {  // before it as it looks outwards
        return std::lround(all.times(x) - itself.times(x)) % 2 != 0;
      });
      body.turned = 4 * within < 3 * std::ssize(behind);
    } else if (way != Given::unclear) {
      body.turned = way == Given::inwards && (body.turned || body.closed);
    }
  });
}

}  // namespace

RepairedMesh repaired(ImportedMesh imported) {
  TriangleMesh& mesh = imported.mesh;
  distance::requireSurface(mesh);
  const Patches patches = patchesOf(mesh.triangles.size(), sidesByEdge(mesh.triangles));
  RepairedMesh result;
  result.turnedFaces = agree(mesh, patches);
  const Bodies bodies = bodiesOf(mesh, patches, sidesByEdge(mesh.triangles));
  std::vector<Body> found = measured(mesh, patches, bodies);
  TriangleMesh outward = mesh;
  turnBodies(outward, found);
  spareCavities(mesh, outward, found);
  turnBodies(mesh, found);
  result.turnedPatches = static_cast<std::size_t>(
      std::ranges::count_if(bodies.of, [&](std::uint32_t body) { return found[body].turned; }));

  const MeshReport now = inspect(mesh);
  imported.report.inconsistentEdges = now.inconsistentEdges;  // nothing else depends on which way faces look
  imported.report.unbalancedEdges = now.unbalancedEdges;
  imported.report.volume = now.volume;
  result.leftEdges = now.inconsistentEdges;
  result.imported = std::move(imported);
  return result;
}

}  // namespace hpsdf
