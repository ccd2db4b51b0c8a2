#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "hpsdf/combine/expression.h"
#include "hpsdf/detail/field_data.h"
#include "util/checked_file.h"

namespace hpsdf {
namespace combine {
namespace {

using detail::bytesOf;
using detail::Checksum;

template <typename T>
void addAll(Checksum& sum, const std::vector<T>& numbers) {
  sum.add(bytesOf(std::uint64_t{numbers.size()}));
  sum.add(std::as_bytes(std::span(numbers)));
}
template <typename T>
void addAll(Checksum& sum, const FieldArray<T>& numbers) {
  sum.add(bytesOf(std::uint64_t{numbers.size()}));
  numbers.forEachPiece([&](std::span<const T> piece) { sum.add(std::as_bytes(piece)); });
}

void addAll(Checksum& sum, const QuantizedCoefficients& coefficients) {
  sum.add(bytesOf(coefficients.step));
  sum.add(bytesOf(coefficients.meanBits));
  addAll(sum, coefficients.bytes);
}

/// Returns a hash of what a field answers from.
std::uint64_t fingerprintOf(const Field& field) {
  const FieldData& data = field.data();
  Checksum sum;
  for (const Vector3& corner : {data.domain.min(), data.domain.max()})
    sum.add(std::as_bytes(std::span(corner.data(), 3)));
  for (const std::uint32_t cells : data.grid) sum.add(bytesOf(cells));
  sum.add(bytesOf(data.blend));
  addAll(sum, data.nodes);
  std::visit([&](const auto& coefficients) { addAll(sum, coefficients); }, data.coefficients);
  std::visit([&](const auto& vertices) { addAll(sum, vertices); }, data.exact.vertices);
  addAll(sum, data.exact.triangles);
  addAll(sum, data.exact.lists);
  sum.add(bytesOf(data.exact.offset));
  return sum.value();
}

/// Computes the fingerprints of expressions. It reads a solid that several leaves share once.
class Fingerprints {
 public:
  std::uint64_t of(const Expression& expression) {
    const Expression::Node& node = expression.node();
    if (node.operation == Operation::operand)
      return std::visit([&](const auto& operand) { return ofSolid(operand); }, node.operand);
    Checksum sum;
    sum.add(bytesOf(node.operation));
    sum.add(bytesOf(node.side));
    for (const double number : node.numbers) sum.add(bytesOf(number));
    for (const Expression& operand : node.operands) {
      const std::uint64_t own = of(operand);
      sum.add(bytesOf(own));
      if (own == 0) sum.add(std::as_bytes(std::span(operand.node().name)));
    }
    return sum.value();
  }

 private:
  static std::uint64_t ofSolid(const std::string&) { return 0; }
  static std::uint64_t ofSolid(const std::shared_ptr<const DistanceFunction>& distance) {
    return distance->source().fingerprint;
  }
  std::uint64_t ofSolid(const std::shared_ptr<const TriangleMesh>& mesh) {
    const auto [known, isNew] = known_.try_emplace(mesh.get());
    if (isNew) known->second = fingerprint(*mesh);
    return known->second;
  }
  std::uint64_t ofSolid(const std::shared_ptr<const Field>& field) {
    const auto [known, isNew] = known_.try_emplace(field.get());
    if (isNew) known->second = fingerprintOf(*field);
    return known->second;
  }

  std::map<const void*, std::uint64_t> known_;
};

}  // namespace
}  // namespace combine

std::uint64_t fingerprint(const Expression& expression) { return combine::Fingerprints().of(expression); }

}  // namespace hpsdf
