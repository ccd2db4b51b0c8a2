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

/// How inside is told from outside.
enum class InsideTest : std::uint8_t {
  automatic,     ///< whichever of the next two suits the mesh
  pseudonormal,  ///< by the nearest feature's normal: for closed meshes that do not meet themselves
  winding,       ///< by the winding number: for any mesh, holes being closed
  shell,         ///< a wall of some thickness around the surface, which may be open
  outerHull,     ///< as winding, and faces with the inside on both sides are no surface
};

/// Which sign distances have, and why.
struct InsideTestChoice {
  InsideTest insideTest = InsideTest::pseudonormal;  ///< never automatic
  std::string reason = {};            ///< half a sentence, such as "the mesh has no holes and does not meet itself"
  std::optional<Vector3> place = {};  ///< where that is seen, if it is at a place
};

/// Where a signed distance comes from: kept with a field built from it.
struct Source {
  std::string name = {};          ///< the mesh file's name without its path, or a shape's spec
  std::uint64_t fingerprint = 0;  ///< `fingerprint` of the mesh, 0 where there is none
  std::uint64_t vertices = 0;
  std::uint64_t faces = 0;
  Box box = {};                      ///< smallest box of the surface in world units; empty where it is not known
  Normalization normalization = {};  ///< that took the mesh's own units to these
  InsideTest insideTest = InsideTest::automatic;  ///< as it was chosen; automatic where it is not known
  double thickness = 0;                           ///< of a shell, in world units
};

/// Any signed distance Φ, evaluated in batches; negative inside. Converts from anything callable, single
/// (`double(const Vector3&)`) or batched (`void(std::span<const Vector3>, std::span<double>)`). It is called from
/// several threads at once. Points of one batch lie close together, in a deterministic order.
///
/// A callable with a `Source source() const` hands that on, unless another source is given.
/// Lvalues are referred to, not copied (an `ExactDistance` is large): they must outlive this object. Temporaries are
/// kept.
class DistanceFunction {
 public:
  template <typename F>
  requires(!std::same_as<std::remove_cvref_t<F>, DistanceFunction>)
      DistanceFunction(F&& f)  // NOLINT: implicit on purpose
      : DistanceFunction(std::forward<F>(f), sourceOf(f)) {}

  template <typename F>
  DistanceFunction(F&& f, Source source) : source_(std::move(source)), bytes_(bytesOf(f)) {
    using Callable = std::remove_cvref_t<F>;
    if constexpr (std::is_lvalue_reference_v<F>)
      evaluate_ = adapt<Callable>([&f]() -> const Callable& { return f; });
    else
      evaluate_ = adapt<Callable>(
          [owned = std::make_shared<const Callable>(std::forward<F>(f))]() -> const Callable& { return *owned; });
  }

  /// out[i] = Φ(points[i]); the spans have equal length.
  void operator()(std::span<const Vector3> points, std::span<double> out) const {
    assert(points.size() == out.size());
    evaluate_(points, out);
  }

  const Source& source() const { return source_; }

  /// Bytes that the callable holds, where it tells by a `std::size_t bytes() const`; else 0.
  std::size_t bytes() const { return bytes_; }

 private:
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

  using Batch = std::function<void(std::span<const Vector3>, std::span<double>)>;

  template <typename Callable, typename Get>
  static Batch adapt(Get get) {
    if constexpr (std::invocable<const Callable&, std::span<const Vector3>, std::span<double>>) {
      return [get](std::span<const Vector3> points, std::span<double> out) { get()(points, out); };
    } else {
      static_assert(std::is_invocable_r_v<double, const Callable&, const Vector3&>,
                    "a distance takes one point and returns a double, or takes spans of points and of results");
      return [get](std::span<const Vector3> points, std::span<double> out) {
        for (std::size_t i = 0; i < points.size(); ++i) out[i] = get()(points[i]);
      };
    }
  }

  Batch evaluate_;
  Source source_;
  std::size_t bytes_;
};

}  // namespace hpsdf
