#include "bvh/hierarchy.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "util/refuse.h"

namespace hpsdf::bvh {
namespace {

using Corners = std::array<std::uint32_t, 3>;

/// The branches (inner nodes) of a tree in depth-first order. `nodes[i]` is the branch that becomes node i.
struct Numbered {
  std::vector<const Branch*> nodes;
  std::vector<std::array<std::uint32_t, kWidth>> children;  ///< `Node::child` of each node

  std::uint32_t add(const Branch& branch) {
    const auto self = static_cast<std::uint32_t>(nodes.size());
    nodes.push_back(&branch);
    children.emplace_back().fill(kEmpty);
    for (int i = 0; i < branch.count; ++i) {
      const Branch::Child& child = branch.children[i];
      const std::uint32_t index = child.branch ? add(*child.branch) : kBlockBit | child.begin / kWidth;
      children[self][i] = index;  // index `children` only now, because `add` may reallocate it
    }
    return self;
  }
};

/// A box whose axis directions are the columns of the matrix `axes`.
struct OrientedBox {
  Eigen::Vector3f center = Eigen::Vector3f::Zero(), half = Eigen::Vector3f::Zero();
  Eigen::Matrix3f axes = Eigen::Matrix3f::Zero();

  float area() const { return half[0] * half[1] + half[1] * half[2] + half[2] * half[0]; }
};

/// Returns a box that no search visits. Its half sizes are negative and so large in magnitude that the computed
/// squared distance from any point to the box exceeds kOutOfReach.
OrientedBox unreachableBox() {
  OrientedBox box;
  box.half.setConstant(-2 * std::sqrt(kOutOfReach));
  return box;
}

/// Returns the oriented box with the given axes and extents along these axes, enlarged by a margin for rounding.
OrientedBox boxFrom(const Eigen::Matrix3f& axes, const FloatBox& extents) {
  // The margin covers the rounding of points, of their products with the axes and of the sums of these products.
  // All of these numbers are at most √3 in magnitude.
  constexpr double kRounding = 8 * std::numeric_limits<float>::epsilon();
  const Eigen::Matrix3d asRounded = axes.cast<double>();
  const Vector3 low = extents.lower.head<3>().cast<double>(), high = extents.upper.head<3>().cast<double>();
  OrientedBox box;
  box.axes = axes;
  box.center = (asRounded * ((low + high) / 2)).cast<float>();
  const Vector3 middle = asRounded.transpose() * box.center.cast<double>();
  box.half = ((high - middle).cwiseMax(middle - low).array() + kRounding).cast<float>();
  return box;
}

/// Fits the oriented boxes of nodes to their triangles. The triangles are in the order of the tree.
class BoxFitter {
 public:
  /// `points` are the vertices in local coordinates. Their fourth component is 0.
  BoxFitter(std::span<const Corners> triangles, std::span<const Eigen::Array4f> points)
      : triangles_(triangles), points_(points) {}

  void fit(Node& node, const Branch& branch) const {
    for (int lane = 0; lane < kWidth; ++lane) {
      const OrientedBox box = lane < branch.count ? boxAround(branch.children[lane]) : unreachableBox();
      for (int i = 0; i < 3; ++i) {
        node.field[Node::center + i][lane] = box.center[i];
        node.field[Node::half + i][lane] = box.half[i];
        for (int k = 0; k < 3; ++k) node.field[Node::axes + 3 * i + k][lane] = box.axes(k, i);
      }
    }
  }

 private:
  static constexpr std::uint32_t kSamples = 128;

  OrientedBox boxAround(const Branch::Child& child) const {
    const Eigen::Matrix3f axes = axesOf(child).cast<float>();
    std::array<Eigen::Array4f, 3> rows;
    for (int i = 0; i < 3; ++i) rows[i] << axes.row(i).transpose().array(), 0;
    FloatBox aligned, oriented;
    for (std::uint32_t slot = child.begin; slot < child.end; ++slot)
      for (const std::uint32_t vertex : triangles_[slot]) {
        const Eigen::Array4f point = points_[vertex];
        aligned.extend(point);
        oriented.extend(Eigen::Array4f(rows[0] * point[0] + rows[1] * point[1] + rows[2] * point[2]));
      }
    const OrientedBox alignedBox = boxFrom(Eigen::Matrix3f::Identity(), aligned);
    const OrientedBox orientedBox = boxFrom(axes, oriented);
    return orientedBox.area() < alignedBox.area() ? orientedBox : alignedBox;
  }

  /// Returns the axes of a box for the triangles of `child`: their mean normal, the direction of greatest variance
  /// perpendicular to the normal, and the direction perpendicular to both. A sample of at most kSamples triangles
  /// determines the axes.
  Eigen::Matrix3d axesOf(const Branch::Child& child) const {
    const std::uint32_t step = 1 + (child.end - child.begin) / kSamples;
    const Eigen::Vector4f reference = points_[triangles_[child.begin][0]];
    Eigen::Vector4f doubledArea = Eigen::Vector4f::Zero(), sum = Eigen::Vector4f::Zero();
    Eigen::Matrix4f products = Eigen::Matrix4f::Zero();
    float count = 0;
    for (std::uint32_t slot = child.begin; slot < child.end; slot += step) {
      std::array<Eigen::Vector4f, 3> corners;
      for (int k = 0; k < 3; ++k) {
        corners[k] = points_[triangles_[slot][k]].matrix() - reference;
        sum += corners[k];
        products += corners[k] * corners[k].transpose();
      }
      doubledArea += (corners[1] - corners[0]).cross3(corners[2] - corners[0]);
      count += 3;
    }
    const Eigen::Matrix4f covariance = products - sum * sum.transpose() / count;
    Vector3 normal = doubledArea.head<3>().cast<double>();
    normal = normal.squaredNorm() > 0 ? Vector3(normal.normalized()) : Vector3(Vector3::UnitZ());
    Eigen::Matrix<double, 3, 2> across;
    across.col(0) = normal.unitOrthogonal();
    across.col(1) = normal.cross(across.col(0));
    const Eigen::Matrix2d spread = across.transpose() * covariance.topLeftCorner<3, 3>().cast<double>() * across;
    const double angle = std::atan2(2 * spread(0, 1), spread(0, 0) - spread(1, 1)) / 2;
    const Vector3 widest = across * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    Eigen::Matrix3d axes;
    axes << normal, widest, normal.cross(widest);
    return axes;
  }

  std::span<const Corners> triangles_;
  std::span<const Eigen::Array4f> points_;
};

std::vector<Eigen::Array4f> localPoints(const Hierarchy& hierarchy, std::span<const Vector3> vertices) {
  std::vector<Eigen::Array4f> points(vertices.size());
  tbb::parallel_for(std::size_t{0}, points.size(),
                    [&](std::size_t v) { points[v] << hierarchy.local(vertices[v]).cast<float>().array(), 0; });
  return points;
}

}  // namespace

void requireFaceCount(const std::string& name, std::size_t faces) {
  if (faces == 0) detail::refuseMesh(name, "no faces; a distance needs at least one triangle");
  if (faces > Hierarchy::kMaxTriangles)
    detail::refuseMesh(name, faces, " faces are more than the ", Hierarchy::kMaxTriangles,
                       " that a distance takes; simplify the mesh first");
}

void requireFinite(const std::string& name, std::size_t index, const Vector3& vertex) {
  if (!(vertex.cwiseAbs().array() <= kLargestCoordinate).all())
    detail::refuseMesh(
        name, "vertex ", index + 1,
        " has a coordinate that is not a finite number (or beyond 1e100); repair or export the mesh again");
}

void requireSurface(const TriangleMesh& mesh) {
  requireFaceCount(mesh.name, mesh.triangles.size());
  requireValidIndices(mesh);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) requireFinite(mesh.name, v, mesh.vertices[v]);
}

Hierarchy::Hierarchy(const TriangleMesh& mesh, const Box& box) {
  // The box's corners are halved before they are added, because their sum could overflow.
  center_ = box.min() / 2 + box.max() / 2;
  const double half = (box.max() / 2 - box.min() / 2).maxCoeff();
  scale_ = half >= std::numeric_limits<double>::min() ? 1 / half : 1;

  TriangleTree tree = makeTriangleTree(localPoints(*this, mesh.vertices), mesh.triangles);
  numbers_ = detail::SharedArray<std::uint32_t>(std::move(tree.order));
  Numbered numbered;
  tbb::parallel_invoke([&] { sortSurface(mesh); }, [&] { numbered.add(*tree.root); });

  const std::vector<Eigen::Array4f> points = localPoints(*this, vertices_);
  const BoxFitter fitter(triangles_, points);
  nodes_ = detail::SharedArray<Node>(numbered.nodes.size());
  tbb::parallel_for(std::size_t{0}, nodes_.size(), [&](std::size_t n) {
    fitter.fit(nodes_[n], *numbered.nodes[n]);
    std::copy(numbered.children[n].begin(), numbered.children[n].end(), nodes_[n].child);
  });
  blocks_ = detail::SharedArray<Block>((triangles_.size() + kWidth - 1) / kWidth);
  tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t b) { fill(blocks_[b], b); });
}

void Hierarchy::sortSurface(const TriangleMesh& mesh) {
  constexpr std::uint32_t kUnused = ~std::uint32_t{0};
  std::vector<std::uint32_t> numbers(mesh.vertices.size(), kUnused);
  std::vector<Vector3> vertices;
  vertices.reserve(mesh.vertices.size());
  triangles_ = detail::SharedArray<Triangle>(numbers_.size());
  for (std::size_t slot = 0; slot < numbers_.size(); ++slot) {
    Corners corners = mesh.triangles[numbers_[slot]];
    for (std::uint32_t& corner : corners) {
      std::uint32_t& number = numbers[corner];
      if (number == kUnused) {
        number = static_cast<std::uint32_t>(vertices.size());
        vertices.push_back(mesh.vertices[corner]);
      }
      corner = number;
    }
    triangles_[slot] = corners;
  }
  vertices_ = detail::SharedArray<Vector3>(std::move(vertices));
}

void Hierarchy::fill(Block& block, std::size_t index) const {
  for (std::size_t lane = 0; lane < kWidth; ++lane) {
    const TriangleFrame frame = this->frame(std::uint32_t(std::min(index * kWidth + lane, triangles_.size() - 1)));
    const Vector3 origin = local(frame.origin);
    const auto set = [&](int field, double value) { block.field[field][lane] = static_cast<float>(value); };
    for (int i = 0; i < 3; ++i) {
      set(Block::origin + i, origin[i]);
      set(Block::along + i, frame.along[i]);
      set(Block::across + i, frame.across[i]);
    }
    set(Block::length, frame.length * scale_);
    set(Block::apexAlong, frame.apexAlong * scale_);
    set(Block::apexAcross, frame.apexAcross * scale_);
    set(Block::inverseLeft, frame.inverseSquaredLeft / (scale_ * scale_));
    set(Block::inverseRight, frame.inverseSquaredRight / (scale_ * scale_));
  }
}

std::size_t Hierarchy::bytes() const {
  const auto sizeOf = [](const auto& values) { return values.size() * sizeof(values[0]); };
  return sizeOf(nodes_) + sizeOf(blocks_) + sizeOf(numbers_) + sizeOf(triangles_) + sizeOf(vertices_);
}

}  // namespace hpsdf::bvh
