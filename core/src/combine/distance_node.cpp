#include "combine/distance_node.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace hpsdf::combine {
namespace {

Box widened(const Box& box, double by) {
  if (box.isEmpty()) return box;
  return Box(Vector3(box.min().array() - by), Vector3(box.max().array() + by));
}

/// Buffers for the samples of an operand.
class Buffer {
 public:
  /// Evaluates a node at points, with gradients if `like` has them.
  Samples evaluate(const DistanceNode& node, std::span<const Vector3> points, const Samples& like) {
    values_.resize(points.size());
    if (like.hasGradients()) gradients_.resize(points.size());
    const Samples samples{values_, gradients_};
    node.evaluate(points, samples);
    return samples;
  }

 private:
  std::vector<double> values_;
  std::vector<Vector3> gradients_;
};

class MeshNode final : public DistanceNode {
 public:
  explicit MeshNode(std::shared_ptr<const ExactDistance> distance) : distance_(std::move(distance)) {
    box = distance_->source().box;
    hasGradients = distance_->hasGradients();
    bytes = distance_->bytes();
    const auto& [test, reason, position] = distance_->insideTestChoice();
    const bool isForced = test == InsideTest::pseudonormal && reason.empty();
    exactSides.outside = hasGradients && !isForced;
    exactSides.inside = test == InsideTest::pseudonormal && !isForced;
    if (test == InsideTest::shell) box = widened(box, distance_->source().thickness / 2);
  }

  void evaluate(std::span<const Vector3> points, const Samples& out) const override {
    if (out.hasGradients())
      distance_->withGradients(points, out.values, out.gradients);
    else
      (*distance_)(points, out.values);
  }

 private:
  std::shared_ptr<const ExactDistance> distance_;
};

class BooleanNode final : public DistanceNode {
 public:
  /// The triangles of the boundary have no common vertices, so that pseudonormals give no sign there. The inside test
  /// by pseudonormals is taken because it costs least; only magnitudes are taken from this distance.
  BooleanNode(std::vector<MeshSolid> solids, BooleanTree tree, const TriangleMesh& boundary)
      : solids_(std::move(solids)),
        tree_(std::move(tree)),
        boundary_(boundary, {.insideTest = InsideTest::pseudonormal}) {
    box = boundary_.source().box;
    exactSides = {true, true};
    hasGradients = true;
    bytes = boundary_.bytes();
    for (const MeshSolid& solid : solids_) bytes += solid.distance->bytes();
  }

  void evaluate(std::span<const Vector3> points, const Samples& out) const override {
    if (out.hasGradients())
      boundary_.withGradients(points, out.values, out.gradients);
    else
      boundary_(points, out.values);
    std::vector<double> magnitudes(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) magnitudes[i] = std::abs(out.values[i]);
    const std::vector<char> inside = insideAt(points, magnitudes);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double value = inside[i] != 0 ? -magnitudes[i] : magnitudes[i];
      // The gradient's sign follows from that of the value for which it was computed.
      if (out.hasGradients() && std::signbit(value) != std::signbit(out.values[i]))
        out.gradients[i] = -out.gradients[i];
      out.values[i] = value + 0.0;  // adding 0 turns -0 into 0
    }
  }

 private:
  /// Returns whether each point is inside. Signs are asked of the solids only at few points: the ball around a point
  /// that just touches the boundary lies on one side.
  std::vector<char> insideAt(std::span<const Vector3> points, std::span<const double> magnitudes) const {
    constexpr double kShare = 0.999;  // of the radius, which leaves room for rounding
    std::vector<std::size_t> sampleOf(points.size());
    std::vector<std::size_t> samples;
    const auto covers = [&](std::size_t sample, std::size_t i) {
      return (points[i] - points[samples[sample]]).norm() < kShare * magnitudes[samples[sample]];
    };
    if (!points.empty())
      samples.push_back(static_cast<std::size_t>(std::ranges::max_element(magnitudes) - magnitudes.begin()));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::size_t last = samples.size() - 1;
      sampleOf[i] = covers(0, i) ? 0 : last;
      if (sampleOf[i] == last && !covers(last, i) && i != samples[last]) {
        sampleOf[i] = samples.size();
        samples.push_back(i);
      }
    }
    const std::vector<char> insideOfSamples = insideAtSamples(points, magnitudes, samples);
    std::vector<char> inside(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) inside[i] = insideOfSamples[sampleOf[i]];
    return inside;
  }

  /// Returns whether each sample is inside. On the surface of a solid, such as a face where two of them touch, rounding
  /// decides on which side of it a point is. There the sign is that of another place in the ball around the sample.
  std::vector<char> insideAtSamples(std::span<const Vector3> points, std::span<const double> magnitudes,
                                    const std::vector<std::size_t>& samples) const {
    constexpr double kNear = 1e-6;  // distance to a solid's surface, over that to the boundary
    std::vector<char> inside(samples.size());
    std::vector<std::size_t> open(samples.size());
    for (std::size_t i = 0; i < open.size(); ++i) open[i] = i;
    for (const Vector3& step : kSteps) {
      std::vector<Vector3> places;
      for (const std::size_t i : open) places.push_back(points[samples[i]] + magnitudes[samples[i]] * step);
      std::vector<std::vector<double>> distances;
      for (const MeshSolid& solid : solids_) (*solid.distance)(places, distances.emplace_back(places.size()));
      std::vector<std::size_t> doubtful;
      for (std::size_t k = 0; k < open.size(); ++k) {
        inside[open[k]] = tree_.contains([&](std::uint32_t solid) { return distances[solid][k] < 0; });
        const double near = kNear * magnitudes[samples[open[k]]];
        if (std::ranges::any_of(distances, [&](const auto& ofSolid) { return std::abs(ofSolid[k]) <= near; }))
          doubtful.push_back(open[k]);
      }
      open = std::move(doubtful);
      if (open.empty()) break;
    }
    return inside;
  }

  /// Steps within the unit ball, in directions that surfaces hardly have.
  inline static const std::array<Vector3, 6> kSteps = {Vector3::Zero(),
                                                       Vector3(0.311, 0.227, 0.173),
                                                       Vector3(-0.193, 0.307, -0.271),
                                                       Vector3(0.141, -0.373, 0.263),
                                                       Vector3(-0.347, -0.149, 0.211),
                                                       Vector3(0.103, 0.089, -0.457)};

  std::vector<MeshSolid> solids_;
  BooleanTree tree_;
  ExactDistance boundary_;
};

/// A node whose operand is placed by a similarity.
class PlacedNode : public DistanceNode {
 public:
  explicit PlacedNode(const Similarity& placement) : placement_(placement) {}

  void evaluate(std::span<const Vector3> points, const Samples& out) const final {
    std::vector<Vector3> local(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) local[i] = placement_.inverse(points[i]);
    evaluateLocally(local, out);
    for (double& value : out.values) value *= placement_.scale;
    for (Vector3& gradient : out.gradients) gradient = placement_.rotation * gradient;
  }

 private:
  virtual void evaluateLocally(std::span<const Vector3> points, const Samples& out) const = 0;

  Similarity placement_;
};

/// A solid of which distances are known in a box only, its domain. It ends at the domain's walls.
class WalledNode : public PlacedNode {
 public:
  WalledNode(const Similarity& placement, const Box& domain) : PlacedNode(placement), domain_(domain) {}

 protected:
  /// Returns the box of the surface, placed. Where `surface` is not known, it is the domain.
  Box placedBox(const Box& surface, const Similarity& placement) const {
    const bool isKnown = !surface.isEmpty() && surface.sizes().allFinite();
    return transformed(isKnown ? Box(surface.intersection(domain_)) : domain_, placement);
  }

 private:
  void evaluateLocally(std::span<const Vector3> points, const Samples& out) const final {
    std::vector<Vector3> nearest(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      nearest[i] = points[i].cwiseMax(domain_.min()).cwiseMin(domain_.max());
    evaluateInDomain(nearest, out);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (points[i] == nearest[i])
        endAtWall(points[i], out, i);
      else
        continueOutside(points[i] - nearest[i], out, i);
    }
  }

  virtual void evaluateInDomain(std::span<const Vector3> points, const Samples& out) const = 0;

  /// Where the solid reaches a wall of the domain, the wall is its surface: the value is at least the negative distance
  /// to the nearest wall.
  void endAtWall(const Vector3& x, const Samples& out, std::size_t i) const {
    int axis = 0;
    const double wall = ((x - domain_.center()).cwiseAbs() - domain_.sizes() / 2).maxCoeff(&axis);
    if (out.values[i] >= wall) return;
    out.values[i] = wall;
    if (out.hasGradients()) out.gradients[i] = Vector3::Unit(axis) * (x[axis] < domain_.center()[axis] ? -1 : 1);
  }

  /// Turns a sample at the domain's nearest point into one at a point farther outside: a bound of the distance to a
  /// surface that lies in the domain, and the distance to the wall where the solid reaches it.
  static void continueOutside(const Vector3& away, const Samples& out, std::size_t i) {
    const double distance = away.norm(), value = std::max(out.values[i], 0.0);
    const double continued = std::hypot(distance, value);
    out.values[i] = continued;
    if (!out.hasGradients()) return;
    Vector3& gradient = out.gradients[i];
    for (int axis = 0; axis < 3; ++axis)
      if (away[axis] != 0) gradient[axis] = 0;
    gradient = (away + value * gradient) / continued;
  }

  Box domain_;
};

class FieldNode final : public WalledNode {
 public:
  FieldNode(std::shared_ptr<const Field> field, const Similarity& placement)
      : WalledNode(placement, field->domain()), field_(std::move(field)) {
    box = placedBox(field_->metadata().source.box, placement);
    hasGradients = true;
    bytes = field_->bytes();
  }

 private:
  void evaluateInDomain(std::span<const Vector3> points, const Samples& out) const override {
    if (!out.hasGradients()) return field_->values(points, out.values);
    std::vector<ValueAndGradient> found(points.size());
    field_->valuesAndGradients(points, found);
    for (std::size_t i = 0; i < points.size(); ++i) {
      out.values[i] = found[i].value;
      out.gradients[i] = found[i].gradient;
    }
  }

  std::shared_ptr<const Field> field_;
};

void evaluateFunction(const DistanceFunction& function, std::span<const Vector3> points, const Samples& out) {
  if (out.hasGradients())
    function.withGradients(points, out.values, out.gradients);
  else
    function(points, out.values);
}

/// Returns on which sides a function is exact: on both unless its source says otherwise.
ExactSides sidesOf(const DistanceFunction& function) {
  const Exactness exactness = function.source().exactness.value_or(Exactness::everywhere);
  return {exactness == Exactness::everywhere || exactness == Exactness::outside,
          exactness == Exactness::everywhere || exactness == Exactness::inside};
}

class FunctionNode final : public PlacedNode {
 public:
  FunctionNode(std::shared_ptr<const DistanceFunction> function, const Similarity& placement)
      : PlacedNode(placement), function_(std::move(function)) {
    exactSides = sidesOf(*function_);
    box = transformed(function_->source().box, placement);
    hasGradients = function_->hasGradients();
    bytes = function_->bytes();
  }

 private:
  void evaluateLocally(std::span<const Vector3> points, const Samples& out) const override {
    evaluateFunction(*function_, points, out);
  }

  std::shared_ptr<const DistanceFunction> function_;
};

class WalledFunctionNode final : public WalledNode {
 public:
  WalledFunctionNode(std::shared_ptr<const DistanceFunction> function, const Similarity& placement, const Box& domain)
      : WalledNode(placement, domain), function_(std::move(function)) {
    box = placedBox(function_->source().box, placement);
    hasGradients = function_->hasGradients();
    bytes = function_->bytes();
  }

 private:
  void evaluateInDomain(std::span<const Vector3> points, const Samples& out) const override {
    evaluateFunction(*function_, points, out);
  }

  std::shared_ptr<const DistanceFunction> function_;
};

/// Combines the values of operands two at a time, from the first to the last.
///
/// All are forms of the union s·min(s·a, t·b), where s and t are 1 or −1: the intersection has s = t = −1, and the
/// difference s = −1, t = 1. The smooth union is that of Quilez, "smooth minimum" (2013, quadratic): its gradient is a
/// mean of the gradients of a and b, with weights that add up to 1.
class FoldNode final : public DistanceNode {
 public:
  FoldNode(std::vector<NodePtr> operands, double radius, double sign, double signOfOthers)
      : operands_(std::move(operands)), radius_(radius), sign_(sign), signOfOthers_(signOfOthers) {
    hasGradients = std::ranges::all_of(operands_, [](const NodePtr& node) { return node->hasGradients; });
    for (const NodePtr& node : operands_) bytes += node->bytes;
  }

  const std::vector<NodePtr>& operands() const { return operands_; }

  void evaluate(std::span<const Vector3> points, const Samples& out) const override {
    operands_[0]->evaluate(points, out);
    Buffer buffer;
    for (std::size_t k = 1; k < operands_.size(); ++k) {
      const Samples other = buffer.evaluate(*operands_[k], points, out);
      for (std::size_t i = 0; i < points.size(); ++i) add(out, other, i);
    }
  }

 private:
  void add(const Samples& out, const Samples& other, std::size_t i) const {
    const double a = sign_ * out.values[i], b = signOfOthers_ * other.values[i];
    const double gap = std::abs(a - b);
    const double overlap = radius_ > gap ? radius_ - gap : 0;
    const double lowered = radius_ > 0 ? overlap * overlap / (4 * radius_) : 0;
    out.values[i] = sign_ * (std::min(a, b) - lowered);
    if (!out.hasGradients()) return;
    const double share = radius_ > 0 ? overlap / (2 * radius_) : 0;  // of the greater one
    const double shareOfOther = b < a ? 1 - share : share;
    out.gradients[i] =
        (1 - shareOfOther) * out.gradients[i] + shareOfOther * sign_ * signOfOthers_ * other.gradients[i];
  }

  std::vector<NodePtr> operands_;
  double radius_, sign_, signOfOthers_;
};

/// f(a) of the operand's value a, whose slope is 1 or −1.
template <typename ValueAndSlope>
class MappedNode final : public DistanceNode {
 public:
  MappedNode(NodePtr solid, ValueAndSlope map) : solid_(std::move(solid)), map_(std::move(map)) {
    hasGradients = solid_->hasGradients;
    bytes = solid_->bytes;
  }

  void evaluate(std::span<const Vector3> points, const Samples& out) const override {
    solid_->evaluate(points, out);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto [value, slope] = map_(out.values[i]);
      out.values[i] = value;
      if (out.hasGradients()) out.gradients[i] *= slope;
    }
  }

 private:
  NodePtr solid_;
  ValueAndSlope map_;
};

bool allAre(const std::vector<NodePtr>& operands, bool ExactSides::*side) {
  return std::ranges::all_of(operands, [side](const NodePtr& node) { return node->exactSides.*side; });
}

}  // namespace

Exactness ExactSides::exactness() const {
  if (outside) return inside ? Exactness::everywhere : Exactness::outside;
  return inside ? Exactness::inside : Exactness::nowhere;
}

NodePtr meshNode(std::shared_ptr<const ExactDistance> distance) {
  return std::make_unique<MeshNode>(std::move(distance));
}

NodePtr booleanNode(std::vector<MeshSolid> solids, BooleanTree tree, const TriangleMesh& boundary) {
  return std::make_unique<BooleanNode>(std::move(solids), std::move(tree), boundary);
}

NodePtr fieldNode(std::shared_ptr<const Field> field, const Similarity& placement) {
  return std::make_unique<FieldNode>(std::move(field), placement);
}

NodePtr functionNode(std::shared_ptr<const DistanceFunction> function, const Similarity& placement, const Box& domain) {
  if (!domain.isEmpty()) return std::make_unique<WalledFunctionNode>(std::move(function), placement, domain);
  return std::make_unique<FunctionNode>(std::move(function), placement);
}

NodePtr uniteNode(std::vector<NodePtr> operands, double radius) {
  auto node = std::make_unique<FoldNode>(std::move(operands), radius, 1, 1);
  const std::vector<NodePtr>& all = node->operands();
  node->exactSides.outside = radius == 0 && allAre(all, &ExactSides::outside);
  const bool areBoxed = std::ranges::none_of(all, [](const NodePtr& operand) { return operand->box.isEmpty(); });
  if (areBoxed)
    for (const NodePtr& operand : all) node->box.extend(operand->box);
  node->box = widened(node->box, radius / 4 * static_cast<double>(all.size() - 1));
  return node;
}

NodePtr intersectNode(std::vector<NodePtr> operands, double radius) {
  auto node = std::make_unique<FoldNode>(std::move(operands), radius, -1, -1);
  node->exactSides.inside = radius == 0 && allAre(node->operands(), &ExactSides::inside);
  for (const NodePtr& operand : node->operands()) {
    const Box common = node->box.intersection(operand->box);
    if (node->box.isEmpty() || !common.isEmpty()) node->box = node->box.isEmpty() ? operand->box : common;
  }
  return node;
}

NodePtr subtractNode(std::vector<NodePtr> operands, double radius) {
  auto node = std::make_unique<FoldNode>(std::move(operands), radius, -1, 1);
  const std::vector<NodePtr>& all = node->operands();
  const bool areOthersExact =
      std::all_of(all.begin() + 1, all.end(), [](const NodePtr& other) { return other->exactSides.outside; });
  node->exactSides.inside = radius == 0 && all[0]->exactSides.inside && areOthersExact;
  node->box = all[0]->box;
  return node;
}

NodePtr offsetNode(NodePtr solid, double distance) {
  const Box box = solid->box;
  const ExactSides sides = solid->exactSides;
  const auto map = [distance](double value) { return std::pair(value - distance, 1.0); };
  auto node = std::make_unique<MappedNode<decltype(map)>>(std::move(solid), map);
  node->exactSides = {sides.outside && distance >= 0, sides.inside && distance <= 0};
  const Box moved = widened(box, distance);
  node->box = moved.isEmpty() ? box : moved;
  return node;
}

NodePtr shellNode(NodePtr solid, double thickness, ShellSide side) {
  const std::array middles = {-thickness / 2, 0.0, thickness / 2};  // where the middle of the wall is
  const double middle = middles[static_cast<std::size_t>(side)];
  const Box box = solid->box;
  const bool isExact = solid->exactSides.outside && solid->exactSides.inside;
  const auto map = [middle, thickness](double value) {
    const double fromMiddle = value - middle;
    return std::pair(std::abs(fromMiddle) - thickness / 2, fromMiddle < 0 ? -1.0 : 1.0);
  };
  auto node = std::make_unique<MappedNode<decltype(map)>>(std::move(solid), map);
  node->exactSides.outside = isExact;
  node->box = widened(box, middle + thickness / 2);
  return node;
}

}  // namespace hpsdf::combine
