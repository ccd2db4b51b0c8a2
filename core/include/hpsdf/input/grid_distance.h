#pragma once
// Signed distances from samples on a regular grid, so that fields can be built from grids that other programs made.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hpsdf/distance_function.h"
#include "hpsdf/error.h"
#include "hpsdf/output/grids.h"
#include "hpsdf/types.h"

namespace hpsdf {

/// Samples of a signed distance in a part of an unbounded regular grid, in blocks of 8 × 8 × 8 points. Point (i, j, k)
/// lies at origin + (i, j, k) · spacing.
struct SampledBlocks {
  static constexpr int kSize = 8;

  /// One block: the block (a, b, c) holds the points from 8 · (a, b, c) on, with x fastest. NaN stands for a point
  /// without a sample.
  struct Block {
    std::array<std::int32_t, 3> index;
    std::array<double, std::size_t{kSize} * kSize * kSize> values;
  };

  Vector3 origin = Vector3::Zero();
  Vector3 spacing = Vector3::Ones();
  std::vector<Block> blocks;
};

/// The likely error of the interpolation between samples near the surface.
struct InterpolationError {
  std::size_t samples = 0;  ///< samples near the surface at which it was estimated
  double rms = 0;
  double max = 0;
};

/// The signed distance that interpolates samples on a regular grid tricubically, by Catmull-Rom splines (Keys 1981 with
/// a = −1/2). It has the value of each sample, its gradient is continuous, and it reproduces quadratic polynomials.
///
/// Beyond a grid that fills a box, the distance is continued as fields are: f(q) + |x − q| with the closest point q of
/// the box. Where samples of `SampledBlocks` are missing, another distance takes their place; over the last cell before
/// them, the interpolation passes into it continuously.
///
/// Copies share the samples. All queries are const and thread-safe.
class GridDistance {
 public:
  /// Takes the values of a grid. Throws `Error` if a value is not finite, if there are fewer than four points along an
  /// axis, or if no two neighbouring values have different signs, so that there is no surface.
  explicit GridDistance(const RegularGrid& grid, Source source = {});

  /// Takes samples near a surface, and the distance `beyond` for points beside which a sample has fewer than 5 × 5 × 5
  /// samples around it. Throws `Error` if there is no surface.
  GridDistance(SampledBlocks samples, DistanceFunction beyond, Source source = {});

  void operator()(std::span<const Vector3> points, std::span<double> out) const;
  bool hasGradients() const;
  void withGradients(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> gradients) const;

  /// Returns the source that the constructor got, with the box of the surface and a hash of the samples.
  const Source& source() const;
  std::size_t bytes() const;  ///< memory of the samples and of the other distance

  /// Returns the box that a grid fills, or an empty one for `SampledBlocks`, whose distance is known everywhere.
  Box domain() const;

  /// Estimates the error of the interpolation at the samples within three spacings of the surface: half of the
  /// difference between a sample and the interpolation of its neighbours at the distance of one and three spacings
  /// along an axis, the axis with the greatest difference. Leaving samples out doubles the spacing, which makes the
  /// error of an interpolation at least twice as great, and eight times where the distance is smooth.
  InterpolationError interpolationError() const;

  struct Samples;  ///< the samples, by their indices

 private:
  template <bool WithGradients>
  void evaluate(std::span<const Vector3> points, std::span<double> out, std::span<Vector3> gradients) const;

  std::shared_ptr<const Samples> samples_;
  std::optional<DistanceFunction> beyond_;
  Source source_;
};

/// Returns true for the name of a file that `loadGrid` reads: *.vti or *.npy.
bool isRegularGridName(const std::filesystem::path& file);

/// Reads a grid's values: image data of VTK (`.vti`: one piece, scalars at points, arrays as text, base64 or appended,
/// uncompressed or compressed by zlib), or an array of NumPy (`.npy`) of floats or doubles with the shape (nz, ny, nx)
/// or (nz, ny, nx, 4), of which the first number counts. A `.npy` does not tell where its points lie: they get the
/// origin 0 and the spacing 1. Throws `Error` (of the kind `file`) if the file cannot be read.
RegularGrid loadGrid(const std::filesystem::path& file);

}  // namespace hpsdf
