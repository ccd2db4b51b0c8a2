#pragma once

#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

#include "hpsdf/types.h"

namespace hpsdf {

class TriangleSearch;

/// The test that decides whether a point is inside.
enum class InsideTest : std::uint8_t {
  automatic,     ///< `pseudonormal` if it is certain to be right for the mesh, else `winding`
  pseudonormal,  ///< pseudonormal of the nearest face, edge or vertex: for closed meshes without self-intersections
  winding,       ///< inside where the winding number is above ½: works for any mesh and closes holes
  shell,         ///< a wall of constant thickness around the surface, which may be open
  outerHull,     ///< as `winding`, but without the triangles that have the inside on both sides
};

/// The inside test that a distance uses, and the reason for this choice.
struct InsideTestChoice {
  InsideTest insideTest = InsideTest::pseudonormal;  ///< never `automatic`
  std::string reason = {};  ///< such as "the mesh has no holes and does not intersect itself"; empty if requested
  std::optional<Vector3> position = {};  ///< a position on the mesh that shows the reason, if there is one
};

/// Tells which values of a signed distance are exact: which are the distance to the surface on which the values are 0.
/// The magnitudes of all others are lower bounds of this distance.
enum class Exactness : std::uint8_t {
  everywhere,
  outside,  ///< the values above 0
  inside,   ///< the values below 0
  nowhere,
};

/// A description of where a signed distance comes from. It is stored with each field that is built from this
/// distance.
struct Source {
  std::string name = {};  ///< the mesh file's name without its path, or the shape's specification
  /// 64-bit hash of the mesh, the grid's samples or the combined solids; 0 for an analytic shape or another function
  std::uint64_t fingerprint = 0;
  std::uint64_t vertices = 0;
  std::uint64_t faces = 0;
  Box box = {};                                   ///< smallest box of the surface in world units; empty if unknown
  Normalization normalization = {};               ///< transform from the mesh's own units to world units
  InsideTest insideTest = InsideTest::automatic;  ///< the test that was chosen; `automatic` if unknown
  double thickness = 0;                           ///< thickness of a shell, in world units
  /// Of a combination of solids (`CombinedDistance`): which of its values are exact. Empty for other distances.
  std::optional<Exactness> exactness = {};
};

/// A signed distance Φ of any kind, negative inside, evaluated in batches of points.
///
/// Any callable for single points (`double(const Vector3&)`) or for batches (`void(std::span<const Vector3>,
/// std::span<double>)`) converts to a `DistanceFunction`. The callable must be thread-safe. The points of a
/// batch lie close to each other, in a deterministic order. If the callable has a member function `Source
/// source() const`, this function provides the source, unless the constructor gets another source.
///
/// A callable that knows ∇Φ has two more member functions: `void withGradients(std::span<const Vector3> points,
/// std::span<double> out, std::span<Vector3> gradients) const`, which evaluates both Φ and ∇Φ, and `bool hasGradients()
/// const`, which tells whether this is possible. The construction of a field then evaluates Φ at far fewer points.
///
/// A callable that is passed as an lvalue is not copied, because it may be large. This object refers to the callable,
/// which must outlive this object. A temporary callable is moved into this object.
class DistanceFunction {
 public:
  template <typename F>
  requires(!std::same_as<std::remove_cvref_t<F>, DistanceFunction>)
      DistanceFunction(F&& f)  // NOLINT: implicit on purpose
      : DistanceFunction(std::forward<F>(f), sourceOf(f)) {}

  template <typename F>
  DistanceFunction(F&& f, Source source) : DistanceFunction(pointerTo(std::forward<F>(f)), std::move(source)) {}

  /// Shares a callable with its other owners.
  template <typename Callable>
  explicit DistanceFunction(std::shared_ptr<const Callable> callable)
      : DistanceFunction(callable, sourceOf(*callable)) {}

  template <typename Callable>
  DistanceFunction(std::shared_ptr<const Callable> callable, Source source)
      : evaluate_(adapt(callable)),
        gradients_(gradientsOf(callable)),
        source_(std::move(source)),
        bytes_(bytesOf(*callable)),
        triangleSearch_(triangleSearchOf(*callable)) {}

  /// Evaluates out[i] = Φ(points[i]) for all i. Both spans must have the same length.
  void operator()(std::span<const Vector3> points, std::span<double> out) const {
    assert(points.size() == out.size());
    evaluate_(points, out);
  }

  /// Returns true if the callable offers the gradient of Φ.
  bool hasGradients() const { return gradients_ != nullptr; }

  /// Evaluates out[i] = Φ(points[i]) and gradients[i] = ∇Φ(points[i]) for all i. All spans must have the same length,
  /// and `hasGradients` must be true. The values are those of `operator()`.
  void withGradients(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> gradients) const {
    assert(points.size() == out.size() && points.size() == gradients.size());
    gradients_(points, out, gradients);
  }

  const Source& source() const { return source_; }

  /// Returns the number of bytes that the callable holds, as told by its member `std::size_t bytes() const`, or 0
  /// if it has no such member.
  std::size_t bytes() const { return bytes_; }

  /// Returns the search for triangles that the callable offers by its member `const TriangleSearch& triangleSearch()
  /// const`, or nullptr if it has no such member. Fields of such distances can have exact leaves.
  const TriangleSearch* triangleSearch() const { return triangleSearch_; }

 private:
  /// Returns a pointer to a callable: one that does not own it, if it is an lvalue, else one that owns it.
  template <typename F>
  static auto pointerTo(F&& f) {
    using Callable = std::remove_cvref_t<F>;
    if constexpr (std::is_lvalue_reference_v<F> && !std::is_function_v<Callable>)
      return std::shared_ptr<const Callable>(std::shared_ptr<const void>(), &f);
    else
      return std::make_shared<const std::decay_t<F>>(std::forward<F>(f));
  }

  template <typename F>
  static std::size_t bytesOf(const F& f) {
    if constexpr (requires {
                    { f.bytes() } -> std::convertible_to<std::size_t>;
                  })
      return f.bytes();
    else
      return 0;
  }

  template <typename F>
  static Source sourceOf(const F& f) {
    if constexpr (requires {
                    { f.source() } -> std::convertible_to<Source>;
                  })
      return f.source();
    else
      return {};
  }

  template <typename F>
  static const TriangleSearch* triangleSearchOf(const F& f) {
    if constexpr (requires {
                    { f.triangleSearch() } -> std::convertible_to<const TriangleSearch&>;
                  })
      return &f.triangleSearch();
    else
      return nullptr;
  }

  using Batch = std::function<void(std::span<const Vector3>, std::span<double>)>;

  using GradientBatch = std::function<void(std::span<const Vector3>, std::span<double>, std::span<Vector3>)>;

  template <typename Callable>
  static GradientBatch gradientsOf(const std::shared_ptr<const Callable>& callable) {
    if constexpr (requires(const Callable& f, std::span<const Vector3> points, std::span<double> out,
                           std::span<Vector3> gradients) {
                    { f.hasGradients() } -> std::convertible_to<bool>;
                    f.withGradients(points, out, gradients);
                  }) {
      if (callable->hasGradients())
        return [callable](std::span<const Vector3> points, std::span<double> out, std::span<Vector3> gradients) {
          callable->withGradients(points, out, gradients);
        };
    }
    return nullptr;
  }

  template <typename Callable>
  static Batch adapt(const std::shared_ptr<const Callable>& callable) {
    if constexpr (std::invocable<const Callable&, std::span<const Vector3>, std::span<double>>) {
      return [callable](std::span<const Vector3> points, std::span<double> out) { (*callable)(points, out); };
    } else {
      static_assert(std::is_invocable_r_v<double, const Callable&, const Vector3&>,
                    "a distance maps one point to a double, or takes a span of points and a span of results");
      return [callable](std::span<const Vector3> points, std::span<double> out) {
        for (std::size_t i = 0; i < points.size(); ++i) out[i] = (*callable)(points[i]);
      };
    }
  }

  Batch evaluate_;
  GradientBatch gradients_;
  Source source_;
  std::size_t bytes_;
  const TriangleSearch* triangleSearch_ = nullptr;
};

}  // namespace hpsdf
