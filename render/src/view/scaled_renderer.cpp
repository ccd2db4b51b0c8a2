#include "view/scaled_renderer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <set>
#include <utility>
#include <variant>

#include "hpsdf/detail/triangle_list.h"

namespace hpsdf::render {
namespace {

/// Scales the reference points of exact leaves. Several leaves may refer to one list.
void scaleReferences(FieldData& data, double factor) {
  std::set<std::uint32_t> lists;
  for (const std::uint64_t leaf : data.nodes)
    if (node::isExact(leaf) && node::exactSign(leaf) == ExactSign::winding) lists.insert(node::offset(leaf));
  for (const std::uint32_t list : lists) {
    std::uint32_t* const words = data.exact.lists.data() +
                                 (TriangleListView(&data.exact.lists[list]).referenceWords() - data.exact.lists.data());
    PackedReference reference(words);
    reference.offset = (factor * reference.offset.cast<double>()).cast<float>();
    std::ranges::copy(reference.words(), words);
  }
}

Field scaled(const Field& field, double factor) {
  FieldData data = field.data();
  data.domain = Box(factor * data.domain.min(), factor * data.domain.max());
  std::visit(
      [&](auto& coefficients) {
        if constexpr (requires { coefficients.step; })
          coefficients.step *= factor;
        else
          for (auto& c : coefficients.values())
            c = static_cast<std::remove_reference_t<decltype(c)>>(factor * double(c));
      },
      data.coefficients);
  std::visit(
      [&](auto& vertices) {
        for (auto& v : vertices)
          v = (factor * v.template cast<double>())
                  .template cast<typename std::remove_reference_t<decltype(v)>::Scalar>();
      },
      data.exact.vertices);
  scaleReferences(data, factor);
  data.exact.offset *= factor;
  data.bounds.clear();  // the bounds would have to be scaled, and no renderer uses them
  return Field(std::move(data));
}

/// Renders with the renderer `inner`, whose unit of length is `unit` world units. Views are converted to this unit for
/// `inner`, and its buffers are converted back to world units.
class ScaledRenderer final : public Renderer {
 public:
  ScaledRenderer(std::unique_ptr<Renderer> inner, double unit) : inner_(std::move(inner)), unit_(unit) {}

  ViewBuffers slice(const SliceView& view, int width, int height) override {
    return inWorldUnits(inner_->slice({view.origin / unit_, view.right / unit_, view.up / unit_}, width, height));
  }

  ViewBuffers surface(const SurfaceView& view, int width, int height, std::span<const std::uint8_t> chosen) override {
    SurfaceView inner = view;
    inner.camera.eye /= unit_;
    if (view.camera.projection == Projection::orthographic) {
      inner.camera.right /= unit_;
      inner.camera.up /= unit_;
    }
    inner.offset /= unit_;
    if (inner.clip) inner.clip->offset /= unit_;
    return inWorldUnits(inner_->surface(inner, width, height, chosen));
  }

  std::string description() const override { return inner_->description(); }

 private:
  ViewBuffers inWorldUnits(ViewBuffers buffers) const {
    for (auto* lengths : {&buffers.value, &buffers.distance})
      for (float& length : *lengths) length = static_cast<float>(unit_ * length);
    return buffers;
  }

  std::unique_ptr<Renderer> inner_;
  double unit_;
};

}  // namespace

// The destructor is defined here so that only this library contains the virtual table of the class.
Renderer::~Renderer() = default;

std::unique_ptr<Renderer> inUnitsNearOne(const Field& field, const MakeRenderer& make) {
  constexpr int kGreatestExponent = 30;
  const int exponent = std::ilogb(field.domain().sizes().maxCoeff());
  if (std::abs(exponent) <= kGreatestExponent) return make(field);
  const double unit = std::ldexp(1.0, exponent);
  return std::make_unique<ScaledRenderer>(make(scaled(field, 1 / unit)), unit);
}

}  // namespace hpsdf::render
