#include "hpsdf/input/distance_on_disk.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "bvh/search.h"
#include "distance/far_points.h"
#include "distance/foot.h"
#include "hpsdf/detail/memory.h"
#include "hpsdf/detail/threads.h"
#include "parts/face_list.h"
#include "parts/make_parts.h"
#include "parts/mesh_part.h"
#include "parts/part_index.h"

namespace hpsdf {
namespace parts {

/// The parts that are mapped into memory.
class MappedParts {
 public:
  MappedParts(std::filesystem::path folder, const PartIndex& index, std::size_t memory)
      : folder_(std::move(folder)), memory_(memory) {
    for (const PartIndex::Part& part : index.parts) parts_.push_back({.stamp = part.stamp});
  }

  /// Returns a part, which stays mapped at least as long as the result is there. Throws `Error` if it is damaged.
  std::shared_ptr<const MeshPart> get(std::size_t index) {
    const std::lock_guard lock(mutex_);
    Entry& entry = parts_[index];
    entry.lastUse = ++uses_;
    if (entry.part) return entry.part;
    while (mapped_ + entry.stamp.bytes > memory_ && mapped_ > 0) unmapOldest();
    entry.part = mapPart(partFile(folder_, index), entry.stamp, entry.isTrusted);
    entry.isTrusted = true;
    mapped_ += entry.stamp.bytes;
    ++mappings_;
    return entry.part;
  }

  std::uint64_t mappings() const {
    const std::lock_guard lock(mutex_);
    return mappings_;
  }

 private:
  struct Entry {
    PartStamp stamp;
    bool isTrusted = false;  ///< its checksum has been compared
    std::uint64_t lastUse = 0;
    std::shared_ptr<const MeshPart> part = {};
  };

  void unmapOldest() {
    Entry* oldest = nullptr;
    for (Entry& entry : parts_)
      if (entry.part && (oldest == nullptr || entry.lastUse < oldest->lastUse)) oldest = &entry;
    oldest->part.reset();
    mapped_ -= oldest->stamp.bytes;
  }

  mutable std::mutex mutex_;
  std::filesystem::path folder_;
  std::size_t memory_;
  std::vector<Entry> parts_;
  std::uint64_t uses_ = 0, mapped_ = 0, mappings_ = 0;
};

/// The nearest triangle to a point that has been found in the parts so far.
struct FoundTriangle {
  double squared = std::numeric_limits<double>::infinity();
  std::uint32_t face = 0;
  bool isOwn = false;  ///< the triangle is one of its part's own, so that its pseudonormals are known
  double signedDistance = std::numeric_limits<double>::quiet_NaN();
  Vector3 direction = Vector3::Constant(std::numeric_limits<double>::quiet_NaN());

  /// Among equally near triangles, the one with the lowest index counts.
  bool isBeatenBy(double otherSquared, std::uint32_t otherFace, bool otherIsOwn) const {
    if (otherSquared != squared) return otherSquared < squared;
    return otherFace < face || (otherFace == face && otherIsOwn && !isOwn);
  }
};

}  // namespace parts

using distance::FarPoints;
using parts::FoundTriangle;
using parts::MeshPart;

struct DistanceOnDisk::Data {
  /// `name` is the mesh's name, or empty for the name under which it was divided.
  Data(std::filesystem::path folderOfParts, const std::string& name, const DistanceOnDiskOptions& options)
      : folder(std::move(folderOfParts)),
        index(parts::readIndex(folder)),
        memory(memoryOf(options)),
        mapped(folder, index, memory),
        far(index.source.box) {
    if (!name.empty()) index.source.name = name;
    if (options.insideTest != InsideTest::automatic) return;
    const Vector3 x = far.pointAround();
    double distance = 0;
    toTriangles({&x, 1}, {&distance, 1}, {});
    far.setSideAround(distance < 0);
  }

  static std::size_t memoryOf(const DistanceOnDiskOptions& options) {
    const auto most = static_cast<std::size_t>(allowedMemory() / 2);
    return options.memory > 0 ? std::min(options.memory, most) : most;
  }

  /// Computes signed distances, as `ExactDistance` does, and the directions from the nearest triangles unless
  /// `directions` is empty.
  void evaluate(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> directions) const {
    far.evaluate(points, out, directions,
                 [&](std::span<const Vector3> some, std::span<double> distances, std::span<Vector3> theirs) {
                   toTriangles(some, distances, theirs);
                   far.applySideAround(some, distances);
                 });
  }

  void toTriangles(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> directions) const {
    using bvh::kPacket;
    std::vector<std::uint32_t> seeds(index.parts.size(), bvh::Nearest::kNone);
    for (std::size_t first = 0; first < points.size(); first += kPacket) {
      const auto packet = points.subspan(first, std::min<std::size_t>(kPacket, points.size() - first));
      std::array<FoundTriangle, kPacket> found;
      findNearest(packet, std::span(found).first(packet.size()), seeds);
      for (std::size_t i = 0; i < packet.size(); ++i) {
        out[first + i] = found[i].signedDistance;
        if (!directions.empty()) directions[first + i] = found[i].direction;
      }
    }
  }

  /// Finds the nearest triangles of a packet of points: searches the parts in the order of their distance, up to the
  /// first one that is farther away than all triangles found. `seeds` holds a triangle of each part from which a search
  /// may start.
  void findNearest(std::span<const Vector3> points, std::span<FoundTriangle> found,
                   std::span<std::uint32_t> seeds) const {
    Box box;
    for (const Vector3& x : points) {
      if (!x.allFinite()) return findNearestOfFinite(points, found, seeds);
      box.extend(x);
    }
    constexpr double kVisited = -1;
    thread_local std::vector<double> lower;  // lower bounds of the distances to the parts
    lower.clear();
    for (const auto& part : index.parts) lower.push_back(part.box.exteriorDistance(box));
    for (std::size_t visits = 0; visits < lower.size(); ++visits) {
      double least = std::numeric_limits<double>::infinity(), worst = 0;
      std::size_t nearest = 0;
      for (std::size_t part = 0; part < lower.size(); ++part)
        if (lower[part] != kVisited && lower[part] < least) least = lower[part], nearest = part;
      for (const FoundTriangle& one : found) worst = std::max(worst, one.squared);
      if (least > reachOf(worst, box)) return;
      lower[nearest] = kVisited;
      search(*mapped.get(nearest), points, found, seeds[nearest]);
    }
  }

  /// Finds the nearest triangles of those points that are finite, one by one.
  void findNearestOfFinite(std::span<const Vector3> points, std::span<FoundTriangle> found,
                           std::span<std::uint32_t> seeds) const {
    for (std::size_t i = 0; i < points.size(); ++i)
      if (points[i].allFinite()) findNearest(points.subspan(i, 1), found.subspan(i, 1), seeds);
  }

  /// Returns a distance of which no computed bound of a part is above, if the part has a triangle whose computed
  /// squared distance is at most `squared`.
  double reachOf(double squared, const Box& points) const {
    constexpr double kRounding = 64 * std::numeric_limits<double>::epsilon();
    const Box& mesh = index.source.box;
    const double largest = std::max({points.min().cwiseAbs().maxCoeff(), points.max().cwiseAbs().maxCoeff(),
                                     mesh.min().cwiseAbs().maxCoeff(), mesh.max().cwiseAbs().maxCoeff()});
    return std::sqrt(squared) + kRounding * largest;
  }

  static void search(const MeshPart& part, std::span<const Vector3> points, std::span<FoundTriangle> found,
                     std::uint32_t& seed) {
    std::array<bvh::Nearest, bvh::kPacket> nearest{};
    std::array<double, bvh::kPacket> within{};
    for (std::size_t i = 0; i < points.size(); ++i) {
      nearest[i].slot = seed;
      within[i] = found[i].squared;
    }
    nearestTriangles(part.hierarchy, points, std::span(nearest).first(points.size()),
                     std::span(within).first(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::uint32_t slot = nearest[i].slot;
      if (slot == bvh::Nearest::kNone) continue;
      seed = slot;
      if (!found[i].isBeatenBy(nearest[i].squared, part.faceOf(slot), part.isOwn(slot))) continue;
      const distance::Foot foot = distance::footOf(part.hierarchy, &part.normals, points[i], nearest[i]);
      found[i] = {nearest[i].squared, part.faceOf(slot), part.isOwn(slot), foot.signedDistance,
                  distance::directionFrom(foot, points[i], nearest[i])};
    }
  }

  std::filesystem::path folder;
  parts::PartIndex index;
  std::size_t memory;
  mutable parts::MappedParts mapped;
  FarPoints far;
};

namespace {

parts::PartOptions partOptions(const DistanceOnDiskOptions& options) {
  return {.insideTest = options.insideTest, .facesOfPart = options.facesOfPart};
}

}  // namespace

DistanceOnDisk::DistanceOnDisk(const TriangleMesh& mesh, const std::filesystem::path& folder,
                               const DistanceOnDiskOptions& options, const Progress& progress) {
  const auto made = withThreads(options.threads, [&] {
    return parts::makeParts(parts::FacesInMemory(mesh), folder, partOptions(options), progress);
  });
  data_ = std::make_unique<const Data>(made, mesh.name, options);
}

DistanceOnDisk::DistanceOnDisk(const std::filesystem::path& file, const std::filesystem::path& folder,
                               const DistanceOnDiskOptions& options, const Progress& progress) {
  const auto faces = parts::FacesOfPly::open(file, progress);
  if (!faces)
    throw Error(ErrorKind::file, file.string(),
                "is not a binary PLY file with nothing but vertex indices for its faces");
  const auto made =
      withThreads(options.threads, [&] { return parts::makeParts(*faces, folder, partOptions(options), progress); });
  data_ = std::make_unique<const Data>(made, faces->name(), options);
}

DistanceOnDisk::DistanceOnDisk(std::unique_ptr<const Data> data) : data_(std::move(data)) {}

DistanceOnDisk DistanceOnDisk::open(const std::filesystem::path& parts, const DistanceOnDiskOptions& options) {
  return DistanceOnDisk(std::make_unique<const Data>(parts, "", options));
}

DistanceOnDisk::~DistanceOnDisk() = default;
DistanceOnDisk::DistanceOnDisk(DistanceOnDisk&&) noexcept = default;
DistanceOnDisk& DistanceOnDisk::operator=(DistanceOnDisk&&) noexcept = default;

bool DistanceOnDisk::isMappable(const std::filesystem::path& file) {
  return parts::FacesOfPly::open(file, {}) != nullptr;
}

void DistanceOnDisk::operator()(std::span<const Vector3> points, std::span<double> out) const {
  assert(points.size() == out.size());
  data_->evaluate(points, out, {});
}

void DistanceOnDisk::withGradients(std::span<const Vector3> points, std::span<double> out,
                                   std::span<Vector3> gradients) const {
  assert(points.size() == out.size() && points.size() == gradients.size());
  data_->evaluate(points, out, gradients);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (out[i] < 0) gradients[i] = -gradients[i];
}

const Source& DistanceOnDisk::source() const { return data_->index.source; }

std::size_t DistanceOnDisk::bytes() const { return std::min<std::uint64_t>(data_->memory, bytesOnDisk()); }

std::uint64_t DistanceOnDisk::bytesOnDisk() const {
  std::uint64_t bytes = 0;
  for (const auto& part : data_->index.parts) bytes += part.stamp.bytes;
  return bytes;
}

std::size_t DistanceOnDisk::parts() const { return data_->index.parts.size(); }

std::uint64_t DistanceOnDisk::mappings() const { return data_->mapped.mappings(); }

std::filesystem::path DistanceOnDisk::folder() const { return data_->folder; }

}  // namespace hpsdf
