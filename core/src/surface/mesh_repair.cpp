#include "hpsdf/mesh_repair.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "bvh/hierarchy.h"
#include "mesh/connectivity.h"
#include "mesh/orientation.h"
#include "sign/winding_number.h"
#include "sign/winding_sign.h"

namespace hpsdf {
namespace surface {
namespace {

/// The bodies that the patches of a surface form. A patch is a set of triangles that are connected across edges of
/// exactly two triangles. Several patches form one body if only their union is closed and solid material lies between
/// them. Every other patch is a body of its own. Solids that touch at an edge or a shared wall are different bodies.
struct Bodies {
  std::vector<std::uint32_t> ofPatch;  ///< for each patch, its body, named by the body's lowest patch index
  std::vector<char> closed;            ///< for each patch, 1 if its body is closed and thus has no one-sided patch
};

/// Angle in radians below which two faces count as coplanar.
constexpr double kSameAngle = 1e-9;

/// Returns true if an edge has exactly two faces, both faces belong to the same patch, and they run along the edge in
/// opposite directions.
bool isWithinPatch(const mesh::Patches& patches, std::span<const mesh::DirectedEdge> edge) {
  return edge.size() == 2 && edge[0].rising != edge[1].rising &&
         patches.patchOf[edge[0].face] == patches.patchOf[edge[1].face];
}

/// Returns the directed edges along one undirected edge that remain after pairs of opposite directions in the same
/// patch cancel. The order of the faces determines which edges cancel.
std::vector<mesh::DirectedEdge> unbalanced(const mesh::Patches& patches, std::span<const mesh::DirectedEdge> edge) {
  std::vector<mesh::DirectedEdge> sides(edge.begin(), edge.end());
  std::ranges::stable_sort(sides, {}, [&](const mesh::DirectedEdge& side) { return patches.patchOf[side.face]; });
  std::vector<mesh::DirectedEdge> remaining;
  for (const mesh::DirectedEdge& side : sides) {
    const bool cancels = !remaining.empty() && patches.patchOf[remaining.back().face] == patches.patchOf[side.face] &&
                         remaining.back().rising != side.rising;
    cancels ? remaining.pop_back() : remaining.push_back(side);
  }
  return remaining;
}

/// A face at an edge, with its angle around the edge. In a correctly oriented mesh, solid material lies between a
/// face with `rising` = false and the face with `rising` = true that follows it counterclockwise.
struct RadialFace {
  double angle;  ///< in radians, around the edge
  bool rising;
  std::uint32_t patch;
};

/// Sorts the faces at an edge by angle, counterclockwise as seen with the edge pointing to the viewer. Faces with
/// `rising` equal to `begins` begin a solid; all other faces end one. Coplanar faces get the same angle. Among coplanar
/// faces, those that end a solid come first. Coincident faces of the same orientation are sorted by patch, so that all
/// edges of a shared wall match the same patches.
void sortAround(std::vector<RadialFace>& faces, bool begins) {
  std::ranges::sort(faces, {}, &RadialFace::angle);
  const auto before = [begins](const RadialFace& a, const RadialFace& b) {
    if (a.rising != b.rising) return b.rising == begins;
    return a.rising ? a.patch < b.patch : a.patch > b.patch;
  };
  for (auto first = faces.begin(), next = first; first != faces.end(); first = next) {
    while (++next != faces.end() && next->angle - (next - 1)->angle < kSameAngle) {
    }
    for (auto same = first; same != next; ++same) same->angle = first->angle;
    std::sort(first, next, before);
  }
}

/// Returns the faces at an edge with their angles about the edge, measured from the first of these faces.
std::vector<RadialFace> radialFaces(const TriangleMesh& mesh, const mesh::Patches& patches,
                                    std::span<const mesh::DirectedEdge> sides) {
  const Vector3& low = mesh.vertices[sides.front().low()];
  const Vector3 along = (mesh.vertices[sides.front().high()] - low).stableNormalized();
  const auto fromEdge = [&](const mesh::DirectedEdge& side) {
    const auto& [a, b, c] = mesh.triangles[side.face];
    const std::uint32_t apex = a ^ b ^ c ^ side.low() ^ side.high();
    const Vector3 arm = mesh.vertices[apex] - low;
    return Vector3(arm - arm.dot(along) * along);
  };
  const Vector3 right = fromEdge(sides.front()).stableNormalized(), up = along.cross(right);
  std::vector<RadialFace> faces;
  for (const mesh::DirectedEdge& side : sides) {
    const Vector3 arm = fromEdge(side);
    const double angle = std::atan2(arm.dot(up), arm.dot(right));
    faces.push_back(
        {angle < -kSameAngle ? angle + 2 * std::numbers::pi : angle, side.rising, patches.patchOf[side.face]});
  }
  return faces;
}

/// Two faces at an edge with solid material between them.
using Wedge = std::array<RadialFace, 2>;

/// Matches each face that begins a solid with the face that ends the same solid, like opening and closing parentheses,
/// in two passes around the edge. The number of faces that begin a solid must equal the number of faces that end one.
std::vector<Wedge> wedgesOf(std::vector<RadialFace> faces, bool begins) {
  sortAround(faces, begins);
  std::vector<Wedge> wedges;
  std::vector<RadialFace> begun;
  std::vector<char> ended(faces.size(), 0);
  for (std::size_t i = 0; i < 2 * faces.size(); ++i) {
    const std::size_t at = i % faces.size();
    if (faces[at].rising == begins) {
      if (i < faces.size()) begun.push_back(faces[at]);
    } else if (!begun.empty() && !std::exchange(ended[at], 1)) {
      wedges.push_back({begun.back(), faces[at]});
      begun.pop_back();
    }
  }
  return wedges;
}

bool anyIsFlat(const std::vector<Wedge>& wedges) {
  return std::ranges::any_of(wedges, [](const Wedge& wedge) { return wedge[0].angle == wedge[1].angle; });
}

/// Joins patches that have solid material between them at an edge. If two coplanar faces would enclose a solid without
/// thickness, all solids at the edge may be oriented inward. The function then exchanges solid and empty space. If this
/// also yields a solid without thickness, it joins all patches at the edge.
void joinSolids(const std::vector<RadialFace>& faces, mesh::DisjointSets& bodies) {
  std::vector<Wedge> wedges = wedgesOf(faces, false);
  if (anyIsFlat(wedges)) wedges = wedgesOf(faces, true);
  const bool unclear = anyIsFlat(wedges);
  for (const auto& [from, to] : wedges) {
    bodies.join(from.patch, to.patch);
    if (unclear) bodies.join(wedges.front()[0].patch, to.patch);
  }
}

/// Finds the bodies that the patches of a mesh form. All faces of a patch must have the same orientation, except
/// in one-sided patches. `sides` are the directed edges of the mesh, grouped by undirected edge.
Bodies findBodies(const TriangleMesh& mesh, const mesh::Patches& patches, std::span<const mesh::DirectedEdge> sides) {
  mesh::DisjointSets joined(patches.count);
  std::vector<char> open = patches.oneSided;
  mesh::forEachEdge(sides, [&](std::span<const mesh::DirectedEdge> edge) {
    if (isWithinPatch(patches, edge)) return;
    const std::vector<mesh::DirectedEdge> remaining = unbalanced(patches, edge);
    if (remaining.empty()) return;
    const auto rising = static_cast<std::size_t>(std::ranges::count_if(remaining, &mesh::DirectedEdge::rising));
    if (2 * rising == remaining.size()) return joinSolids(radialFaces(mesh, patches, remaining), joined);
    const std::uint32_t first = patches.patchOf[remaining.front().face];
    for (const mesh::DirectedEdge& side : remaining) joined.join(first, patches.patchOf[side.face]);
    open[first] = 1;
  });
  const auto count = static_cast<std::uint32_t>(patches.count);
  for (std::uint32_t patch = 0; patch < count; ++patch)
    if (open[patch]) open[joined.first(patch)] = 1;
  // Make each patch of an open body a body of its own.
  Bodies bodies;
  for (std::uint32_t patch = 0; patch < count; ++patch) {
    const std::uint32_t body = joined.first(patch);
    bodies.closed.push_back(!open[body]);
    bodies.ofPatch.push_back(open[body] ? patch : body);
  }
  return bodies;
}

/// The faces and the measures of one body. A body is reversed as a whole or not at all.
struct Body {
  std::vector<std::uint32_t> faces;
  double area = 0, volume = 0;
  Box box;
  bool closed = false;
  bool solid = false;     ///< true if the sign of `volume` reliably tells the orientation
  bool reversed = false;  ///< true if the faces are to be reversed
};

Vector3 areaVector(const TriangleMesh& mesh, std::uint32_t face) {
  const auto [a, b, c] = cornersOf(mesh, mesh.triangles[face]);
  return (b - a).cross(c - a) / 2;
}

void reverse(TriangleMesh& mesh, std::uint32_t face) { std::swap(mesh.triangles[face][1], mesh.triangles[face][2]); }

/// Gives all faces of a patch the same orientation: the one that the greater part of the patch's area already has.
/// Skips one-sided patches. Returns the number of reversed faces.
std::size_t orientPatches(TriangleMesh& mesh, const mesh::Patches& patches) {
  std::vector<double> area(patches.count), against(patches.count);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f)
    (patches.against[f] ? against : area)[patches.patchOf[f]] += areaVector(mesh, f).norm();
  std::size_t reversed = 0;
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    const std::uint32_t patch = patches.patchOf[f];
    const char minority = against[patch] <= area[patch] ? 1 : 0;
    if (patches.oneSided[patch] || patches.against[f] != minority) continue;
    reverse(mesh, f);
    ++reversed;
  }
  return reversed;
}

/// Returns the faces and measures of all bodies, in one entry per patch. A body is in the entry of its first patch; the
/// entries of its other patches have no faces. A body's volume is the sum of the signed volumes of the tetrahedra
/// between its triangles and the center of its bounding box. A one-sided body has `solid` = false.
std::vector<Body> measureBodies(const TriangleMesh& mesh, const mesh::Patches& patches, const Bodies& bodies) {
  std::vector<Body> measured(patches.count);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
    Body& body = measured[bodies.ofPatch[patches.patchOf[f]]];
    body.faces.push_back(f);
    body.area += areaVector(mesh, f).norm();
    for (const std::uint32_t v : mesh.triangles[f]) body.box.extend(mesh.vertices[v]);
  }
  for (std::size_t i = 0; i < measured.size(); ++i) {
    Body& body = measured[i];
    if (body.faces.empty() || patches.oneSided[i]) continue;
    for (const std::uint32_t f : body.faces)
      body.volume += areaVector(mesh, f).dot(mesh.vertices[mesh.triangles[f][0]] - body.box.center()) / 3;
    body.closed = bodies.closed[i] != 0;
    body.solid = mesh::hasReliableVolumeSign(body.volume, body.area, body.box, body.closed);
    body.reversed = body.solid && body.volume < 0;
  }
  return measured;
}

void reverseBodies(TriangleMesh& mesh, const std::vector<Body>& bodies) {
  for (const Body& body : bodies)
    if (body.reversed)
      for (const std::uint32_t f : body.faces) reverse(mesh, f);
}

/// Evaluates the winding number of a list of bodies. Only bodies with `solid` = true contribute.
class BodyWinding {
 public:
  BodyWinding(const TriangleMesh& mesh, std::span<const Body> bodies)
      : surface_(surfaceOf(mesh, bodies)), hierarchy_(surface_, boundingBox(surface_)), winding_(hierarchy_) {}
  BodyWinding(const BodyWinding&) = delete;
  BodyWinding& operator=(const BodyWinding&) = delete;

  /// Returns the winding number of the solid bodies at x, to within 0.25.
  double windingNumber(const Vector3& x) const {
    return winding_.estimateWithin(x, 0.25, [](const auto&) { return false; }).value;
  }

 private:
  /// Returns a mesh of the faces of the solid bodies. Each face gets three vertices of its own, and no other
  /// vertices are copied, so that a small body of a large mesh costs little.
  static TriangleMesh surfaceOf(const TriangleMesh& mesh, std::span<const Body> bodies) {
    TriangleMesh surface{.vertices = {}, .triangles = {}, .name = mesh.name};
    for (const Body& body : bodies) {
      if (!body.solid) continue;
      for (const std::uint32_t f : body.faces) {
        const auto first = static_cast<std::uint32_t>(surface.vertices.size());
        surface.triangles.push_back({first, first + 1, first + 2});
        for (const Vector3& corner : cornersOf(mesh, mesh.triangles[f])) surface.vertices.push_back(corner);
      }
    }
    return surface;
  }

  TriangleMesh surface_;
  bvh::Hierarchy hierarchy_;
  sign::WindingNumber winding_;
};

/// Returns points beside the faces of a body, at the distance `offset` along the face normals. The points
/// are spread evenly over the body's area by Roberts' R2 sequence.
std::vector<Vector3> pointsBeside(const TriangleMesh& mesh, const Body& body, double offset) {
  constexpr int kPoints = 32;
  constexpr double kStepAlong = 0.7548776662466927, kStepAcross = 0.5698402909980532;
  std::vector<Vector3> points;
  double passed = 0;
  for (const std::uint32_t f : body.faces) {
    const Vector3 area = areaVector(mesh, f);
    passed += area.norm();
    for (double n = 0.5 + static_cast<double>(points.size()); n * body.area <= passed * kPoints; ++n) {
      double along = n * kStepAlong - std::floor(n * kStepAlong);
      double across = n * kStepAcross - std::floor(n * kStepAcross);
      if (along + across > 1) {
        along = 1 - along;
        across = 1 - across;
      }
      const auto [a, b, c] = cornersOf(mesh, mesh.triangles[f]);
      points.push_back(a + along * (b - a) + across * (c - a) + offset * area.stableNormalized());
    }
  }
  return points;
}

enum class Orientation { undecided, outward, inward };

/// Returns the orientation of a body according to the winding numbers of the imported mesh in front of the body's
/// faces and behind them, at the points `before` and `behind` (step 4 in the documentation of `repaired`). `byVolume`,
/// the orientation according to the sign of the body's own volume, decides where these allow both orientations.
Orientation importedOrientation(const BodyWinding& imported, const std::vector<Vector3>& before,
                                const std::vector<Vector3>& behind, Orientation byVolume) {
  std::ptrdiff_t outward = 0, inward = 0, left = std::ssize(before), all = left;
  const auto isMost = [&](std::ptrdiff_t count) { return 4 * count >= 3 * all && count > 0; };
  const auto canBeMost = [&](std::ptrdiff_t count) { return 4 * (count + left) >= 3 * all; };
  for (std::size_t n = 0; n < before.size() && (canBeMost(outward) || canBeMost(inward)); ++n, --left) {
    const long from = std::lround(imported.windingNumber(before[n])),
               to = std::lround(imported.windingNumber(behind[n]));
    all -= from == to;
    const bool isOutward = from <= 0 && to >= 1, isInward = from <= -1 && to >= 0;
    outward += isOutward && !(isInward && byVolume == Orientation::inward);
    inward += isInward && !(isOutward && byVolume == Orientation::outward);
  }
  return isMost(outward) ? Orientation::outward : isMost(inward) ? Orientation::inward : Orientation::undecided;
}

/// Corrects `Body::reversed` so that cavities stay oriented inward (steps 4 and 5 in the documentation of
/// `repaired`). Changes nothing unless there are at least two solid bodies and at least one body is to be
/// reversed. In the mesh `outward` all solid bodies are oriented outward.
void keepCavityOrientation(const TriangleMesh& imported, const TriangleMesh& outward, std::vector<Body>& bodies) {
  if (std::ranges::count_if(bodies, &Body::solid) < 2 || std::ranges::none_of(bodies, &Body::reversed)) return;
  const BodyWinding allOutward(outward, bodies), asImported(imported, bodies);
  const double offset = sign::probeDistance(boundingBox(imported));
  tbb::parallel_for(std::size_t{0}, bodies.size(), [&](std::size_t i) {
    Body& body = bodies[i];
    if (!body.solid) return;
    const std::vector<Vector3> before = pointsBeside(imported, body, offset);
    const std::vector<Vector3> behind = pointsBeside(imported, body, -offset);
    const Orientation orientation =
        importedOrientation(asImported, before, behind, body.reversed ? Orientation::inward : Orientation::outward);
    if (orientation == Orientation::undecided && body.reversed) {
      // The faces of this body are oriented inward, so that the points `behind` them are outside the body.
      const BodyWinding itself(outward, {&body, 1});
      const auto within = std::ranges::count_if(behind, [&](const Vector3& x) {
        return std::lround(allOutward.windingNumber(x) - itself.windingNumber(x)) % 2 != 0;
      });
      body.reversed = 4 * within < 3 * std::ssize(behind);
    } else if (orientation != Orientation::undecided) {
      body.reversed = orientation == Orientation::inward && (body.reversed || body.closed);
    }
  });
}

}  // namespace
}  // namespace surface

RepairedMesh repaired(ImportedMesh imported) {
  TriangleMesh& mesh = imported.mesh;
  bvh::requireSurface(mesh);
  RepairedMesh result;

  // Orient the faces of each patch consistently, find the bodies that the patches form, and measure the bodies.
  const mesh::Patches patches = mesh::patchesOf(mesh.triangles.size(), mesh::directedEdgesOf(mesh.triangles));
  result.reversedFaces = surface::orientPatches(mesh, patches);
  const surface::Bodies bodies = surface::findBodies(mesh, patches, mesh::directedEdgesOf(mesh.triangles));
  std::vector<surface::Body> measured = surface::measureBodies(mesh, patches, bodies);

  // Reverse the bodies that are oriented inward, except cavities.
  TriangleMesh outward = mesh;
  surface::reverseBodies(outward, measured);
  surface::keepCavityOrientation(mesh, outward, measured);
  surface::reverseBodies(mesh, measured);
  result.reversedPatches = static_cast<std::size_t>(
      std::ranges::count_if(bodies.ofPatch, [&](std::uint32_t body) { return measured[body].reversed; }));

  // Update the entries of the mesh report that depend on the orientation of the faces.
  const MeshReport now = inspect(mesh);
  imported.report.inconsistentEdges = now.inconsistentEdges;
  imported.report.unbalancedEdges = now.unbalancedEdges;
  imported.report.volume = now.volume;
  result.imported = std::move(imported);
  return result;
}

}  // namespace hpsdf
