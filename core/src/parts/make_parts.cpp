#include "parts/make_parts.h"

#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "bvh/triangle_frame.h"
#include "distance/exact_leaf_signs.h"
#include "hpsdf/detail/memory.h"
#include "mesh/connectivity.h"
#include "mesh/mesh_fingerprint.h"
#include "parts/division.h"
#include "parts/mesh_part.h"
#include "parts/part_index.h"
#include "sign/pseudonormals.h"
#include "surface/crossings.h"
#include "util/number_text.h"
#include "util/refuse.h"

namespace hpsdf::parts {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFewestFaces = 1 << 16, kMostParts = 256;
constexpr double kDiskBytesPerFace = 180;    ///< a fifth more than was measured, with the lists of the parts' triangles
constexpr double kBytesPerFaceOfPart = 400;  ///< memory while a part is made, as for a mesh in memory
constexpr std::size_t kFacesAtOnce = 1 << 20;  ///< between two reports of progress

constexpr std::string_view kAdvice = "; 'hpsdf mesh --repair' writes a mesh without such faults";

/// A triangle of a part, as it is listed before the part is made.
struct ListedFace {
  std::uint32_t face;  ///< as in `MeshPart::faces`
  Triangle corners;    ///< indices of vertices of the whole mesh
};

Vector3 centroidOf(const std::array<Vector3, 3>& corners) { return (corners[0] + corners[1] + corners[2]) / 3; }

std::array<Vector3, 3> cornersOf(const FaceList& mesh, const Triangle& face) {
  return {mesh.vertex(face[0]), mesh.vertex(face[1]), mesh.vertex(face[2])};
}

double largestCoordinate(const Box& box) {
  return std::max(box.min().cwiseAbs().maxCoeff(), box.max().cwiseAbs().maxCoeff());
}

Box boxOf(const std::array<Vector3, 3>& corners) {
  Box box(corners[0]);
  box.extend(corners[1]);
  box.extend(corners[2]);
  return box;
}

/// Calls visit(index, triangle) for all triangles of a mesh, in their order.
template <typename Visit>
void forEachFace(const FaceList& mesh, const Progress& progress, std::string_view task, const Visit& visit) {
  for (std::size_t f = 0; f < mesh.faces(); ++f) {
    if (f % kFacesAtOnce == 0) progress.update(task, double(f) / double(mesh.faces()));
    visit(f, mesh.face(f));
  }
}

/// Reads the whole mesh once. Returns its description, and throws `Error` for faults that its numbers show.
Source survey(const FaceList& mesh, bool isTested, const Progress& progress) {
  const std::size_t vertices = mesh.vertices(), faces = mesh.faces();
  bvh::requireFaceCount(mesh.name(), faces);
  Source source{.name = mesh.name(), .vertices = vertices, .faces = faces, .insideTest = InsideTest::pseudonormal};
  mesh::MeshFingerprint fingerprint(vertices, faces);
  for (std::size_t v = 0; v < vertices; ++v) {
    if (v % kFacesAtOnce == 0) progress.throwIfCancelled();
    const Vector3 x = mesh.vertex(v);
    bvh::requireFinite(mesh.name(), v, x);
    fingerprint.add(x);
    source.box.extend(x);
  }
  std::vector<bool> isUsed(vertices);
  const Vector3 center = source.box.center();
  double volume = 0;
  forEachFace(mesh, progress, "reading the mesh", [&](std::size_t f, const Triangle& face) {
    requireValidIndices(mesh.name(), f, face, vertices);
    for (const std::uint32_t corner : face) isUsed[corner] = true;
    const auto [a, b, c] = cornersOf(mesh, face);
    volume += (a - center).dot((b - center).cross(c - center));
    fingerprint.add(std::span(&face, 1));
  });
  source.fingerprint = fingerprint.value();
  if (const auto unused = std::ranges::find(isUsed, false); unused != isUsed.end())
    detail::refuseMesh(mesh.name(), "vertex ", unused - isUsed.begin() + 1, " belongs to no face", kAdvice);
  if (isTested && volume < 0) detail::refuseMesh(mesh.name(), "the faces point inward", kAdvice);
  return source;
}

/// A new folder that is removed with everything in it, unless it is given its final name.
class NewFolder {
 public:
  explicit NewFolder(fs::path final) : final_(std::move(final)) {
    std::string name = final_.string() + ".XXXXXX";
    if (::mkdtemp(name.data()) == nullptr)
      throw Error(ErrorKind::file, final_.parent_path().string(),
                  "no folder can be made here: " + std::generic_category().message(errno));
    path_ = name;
  }
  ~NewFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  const fs::path& path() const { return path_; }

  /// Gives the folder its final name, unless another process has made it meanwhile.
  void commit() {
    std::error_code error;
    fs::permissions(path_, fs::perms(0755), error);
    fs::rename(path_, final_, error);
    if (error && !fs::is_directory(final_))
      throw Error(ErrorKind::file, final_.string(), "the folder of the parts cannot be made: " + error.message());
  }

 private:
  fs::path final_, path_;
};

/// The lists of the parts' triangles, in one file for each part.
class FaceLists {
 public:
  FaceLists(fs::path folder, std::size_t parts) : folder_(std::move(folder)), pending_(parts) {}

  void add(std::size_t part, const ListedFace& face) {
    pending_[part].push_back(face);
    if (pending_[part].size() == kPending) flush(part);
  }

  /// Returns the list of a part and removes its file.
  std::vector<ListedFace> take(std::size_t part) {
    flush(part);
    const fs::path file = fileOf(part);
    const std::uintmax_t count = fs::file_size(file) / sizeof(ListedFace);
    requireMemory("a part of " + std::to_string(count) + " faces", kBytesPerFaceOfPart * double(count),
                  "the mesh has large faces or very small ones beside others, which the division keeps together");
    std::vector<ListedFace> faces(count);
    std::ifstream stream(file, std::ios::binary);
    if (!stream.read(reinterpret_cast<char*>(faces.data()), std::streamsize(faces.size() * sizeof(ListedFace))))
      throw Error(ErrorKind::file, file.string(), "cannot be read");
    stream.close();
    fs::remove(file);
    return faces;
  }

 private:
  static constexpr std::size_t kPending = 4096;  ///< triangles of a part that are kept in memory

  fs::path fileOf(std::size_t part) const { return folder_ / ("faces-" + std::to_string(part)); }

  void flush(std::size_t part) {
    std::ofstream stream(fileOf(part), std::ios::binary | std::ios::app);
    const auto& faces = pending_[part];
    stream.write(reinterpret_cast<const char*>(faces.data()), std::streamsize(faces.size() * sizeof(ListedFace)));
    stream.close();
    if (!stream) throw Error(ErrorKind::file, fileOf(part).string(), "cannot be written: is the disk full?");
    pending_[part].clear();
  }

  fs::path folder_;
  std::vector<std::vector<ListedFace>> pending_;
};

/// Tests, part by part, whether pseudonormals tell the sign of distances to a mesh.
class SignTest {
 public:
  /// `largest` is the largest coordinate of the mesh.
  SignTest(const FaceList& mesh, double largest) : name_(mesh.name()), largest_(largest), components_(mesh.faces()) {}

  /// Throws `Error` if one of the part's own triangles shows that they do not.
  void add(const MeshPart& part, const Progress& progress) {
    const auto edges = mesh::directedEdgesOf(part.hierarchy.triangles());
    mesh::forEachEdge(edges, [&](std::span<const mesh::DirectedEdge> edge) {
      if (std::ranges::none_of(edge, [&](const auto& side) { return part.isOwn(side.face); })) return;
      const auto rising = std::ranges::count_if(edge, [](const auto& side) { return side.rising; });
      if (2 * std::size_t(rising) != edge.size())
        refuse(part, edge[0].face,
               "has an edge with more faces in one direction than in the other (a hole or a "
               "reversed face)");
      if (edge.size() == 2) components_.join(part.faceOf(edge[0].face), part.faceOf(edge[1].face));
    });
    for (std::uint32_t slot = 0; slot < part.faces.size(); ++slot)
      if (part.isOwn(slot) && sign::isSharp(part.hierarchy, part.normals, slot))
        refuse(part, slot, "has an edge or a corner that is too sharp for normals");
    // `findCrossings` takes a distance relative to the largest coordinate of its triangles, which are those of the
    // part.
    Box box;
    for (const Vector3& vertex : part.hierarchy.vertices()) box.extend(vertex);
    const double tooNear = distance::kTooNear * std::max(1.0, largest_ / largestCoordinate(box));
    const Crossings crossings = surface::findCrossings(part.hierarchy, 1, tooNear, progress);
    if (crossings.found.empty()) return;
    const Vector3 x = crossings.found[0].position;
    detail::refuseMesh(name_, "the mesh intersects itself at (", x[0], ", ", x[1], ", ", x[2], ")", kHint);
  }

  /// Throws `Error` if the mesh has several components.
  void finish() const {
    if (components_.count() > 1)
      detail::refuseMesh(name_, "the mesh has ", components_.count(), " components, which may lie within each other",
                         kHint);
  }

 private:
  static constexpr std::string_view kHint =
      ": take more memory, or the inside test by pseudonormals, which trusts the mesh";

  [[noreturn]] void refuse(const MeshPart& part, std::uint32_t slot, std::string_view problem) const {
    detail::refuseMesh(name_, "face ", part.faceOf(slot) + 1, " ", problem, kHint);
  }

  std::string name_;
  double largest_;
  mesh::DisjointSets components_;
};

/// Throws `Error` for vertices of equal position.
void requireWelded(const FaceList& whole, std::span<const std::uint32_t> vertices, const TriangleMesh& part) {
  std::vector<std::uint32_t> order(vertices.size());
  for (std::uint32_t v = 0; v < order.size(); ++v) order[v] = v;
  const auto at = [&](std::uint32_t v) {
    const Vector3& x = part.vertices[v];
    return std::array{x[0], x[1], x[2]};
  };
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) { return at(a) < at(b); });
  for (std::size_t i = 1; i < order.size(); ++i)
    if (at(order[i - 1]) == at(order[i]))
      detail::refuseMesh(whole.name(), "vertices ", std::min(vertices[order[i - 1]], vertices[order[i]]) + 1, " and ",
                         std::max(vertices[order[i - 1]], vertices[order[i]]) + 1, " have the same position", kAdvice);
}

MeshPart makePart(const FaceList& whole, std::span<const ListedFace> faces) {
  std::vector<std::uint32_t> vertices;
  vertices.reserve(3 * faces.size());
  for (const ListedFace& face : faces) vertices.insert(vertices.end(), face.corners.begin(), face.corners.end());
  std::ranges::sort(vertices);
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());

  TriangleMesh mesh;
  for (const std::uint32_t vertex : vertices) mesh.vertices.push_back(whole.vertex(vertex));
  requireWelded(whole, vertices, mesh);
  for (const ListedFace& face : faces) {
    Triangle& corners = mesh.triangles.emplace_back();
    std::ranges::transform(face.corners, corners.begin(), [&](std::uint32_t vertex) {
      return static_cast<std::uint32_t>(std::ranges::lower_bound(vertices, vertex) - vertices.begin());
    });
  }
  MeshPart part;
  part.hierarchy = bvh::Hierarchy(mesh, boundingBox(mesh));
  part.normals = sign::Pseudonormals(part.hierarchy);
  part.faces = detail::SharedArray<std::uint32_t>(faces.size());
  for (std::uint32_t slot = 0; slot < faces.size(); ++slot) {
    part.faces[slot] = faces[part.hierarchy.numbers()[slot]].face;
    if (!hasArea(part.hierarchy.frame(slot)))
      detail::refuseMesh(whole.name(), "face ", part.faceOf(slot) + 1, " has no area", kAdvice);
  }
  return part;
}

/// Makes all parts of a mesh in the folder `into`.
void divideInto(const fs::path& into, const FaceList& mesh, const Source& source, const PartOptions& options,
                const Progress& progress) {
  const std::size_t most =
      options.facesOfPart > 0 ? options.facesOfPart : std::max(kFewestFaces, mesh.faces() / kMostParts);
  Division division(source.box);
  forEachFace(mesh, progress, "dividing the mesh",
              [&](std::size_t, const Triangle& face) { division.count(centroidOf(cornersOf(mesh, face))); });
  PartIndex index{.source = source, .parts = std::vector<PartIndex::Part>(division.divide(most))};
  forEachFace(mesh, progress, "dividing the mesh", [&](std::size_t, const Triangle& face) {
    const auto corners = cornersOf(mesh, face);
    index.parts[division.partOf(centroidOf(corners))].box.extend(boxOf(corners));
  });

  // Triangles so close to a part that they may cross it to rounding count as meeting its box.
  const double largest = largestCoordinate(source.box);
  const Vector3 margin = Vector3::Constant(std::max(0x1p-40 * source.box.sizes().maxCoeff(), 0x1p-42 * largest));
  std::vector<Box> boxes;
  for (const PartIndex::Part& part : index.parts) boxes.emplace_back(part.box.min() - margin, part.box.max() + margin);
  division.setBoxes(std::move(boxes));
  FaceLists lists(into, index.parts.size());
  forEachFace(mesh, progress, "listing the triangles of parts", [&](std::size_t f, const Triangle& face) {
    const auto corners = cornersOf(mesh, face);
    const std::uint32_t own = division.partOf(centroidOf(corners));
    division.forEachMeeting(boxOf(corners), [&](std::uint32_t part) {
      lists.add(part, {std::uint32_t(f) | (part == own ? MeshPart::kOwn : 0), face});
    });
  });

  std::optional<SignTest> test;
  if (options.insideTest == InsideTest::automatic) test.emplace(mesh, largest);
  for (std::size_t p = 0; p < index.parts.size(); ++p) {
    progress.update("making parts of the mesh", double(p) / double(index.parts.size()));
    const MeshPart part = makePart(mesh, lists.take(p));
    if (test) test->add(part, Progress{.cancelled = progress.cancelled});
    index.parts[p].stamp = writePart(part, partFile(into, p));
  }
  if (test) test->finish();
  writeIndex(index, into);
}

}  // namespace

fs::path makeParts(const FaceList& mesh, const fs::path& folder, const PartOptions& options,
                   const Progress& progress) try {
  if (options.insideTest != InsideTest::automatic && options.insideTest != InsideTest::pseudonormal)
    throw Error(ErrorKind::option, "inside test",
                "a mesh that is not in memory has its sign from pseudonormals: choose automatic or pseudonormal");
  if (!fs::is_directory(folder)) throw Error(ErrorKind::file, folder.string(), "is not a folder; make it first");
  const bool isTested = options.insideTest == InsideTest::automatic;
  const Source source = survey(mesh, isTested, progress);
  const fs::path parts = folder / (detail::hexText(source.fingerprint) + (isTested ? "-tested" : "-trusted"));
  if (fs::exists(parts)) return parts;

  const double needed = kDiskBytesPerFace * double(mesh.faces()), free = double(fs::space(folder).available);
  if (needed > free)
    throw Error(ErrorKind::limit, folder.string(),
                "the parts of the mesh may need " + bytesText(needed) + ", but the disk has " + bytesText(free) +
                    " left; name a folder on another disk");
  NewFolder made(parts);
  divideInto(made.path(), mesh, source, options, progress);
  made.commit();
  return parts;
} catch (const fs::filesystem_error& error) {
  throw Error(ErrorKind::file, error.path1().string(), "cannot be used: " + error.code().message());
}

}  // namespace hpsdf::parts
